//! Sinks between a reader and its target sink: clipping to a range, batching, crossing threads.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use crate::bag::model::{ConnectionId, Message, Reader, Sink};
use crate::bag::straight::pass;
use crate::base::error::Result;
use crate::base::ids::ById;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::rhythm::OUT_OF_ORDER_NS;
use crate::base::time::{Span, Stamp};

/// A sink that passes on only messages inside a range, and records whether anything was lost.
pub(crate) struct Clip<'a> {
    range: Option<Span>,
    sink: &'a mut dyn Sink,
    /// Whether a notice reported skipped data.
    pub(crate) lost: bool,
    /// Whether one reported that the end is missing.
    pub(crate) is_cut: bool,
}

impl<'a> Clip<'a> {
    /// A filter in front of `sink`; without a range everything passes.
    pub(crate) fn new(range: Option<Span>, sink: &'a mut dyn Sink) -> Self {
        Self {
            range,
            sink,
            lost: false,
            is_cut: false,
        }
    }
}

impl Sink for Clip<'_> {
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        Some(&mut *self.sink)
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let Some(range) = self.range else {
            return self.sink.stamps(connection, stamps, sizes);
        };
        if stamps.iter().all(|t| range.contains(*t)) {
            return self.sink.stamps(connection, stamps, sizes);
        }
        let inside = |at: &Stamp| Some(*at).filter(|at| range.contains(*at));
        let inside: Vec<Option<Stamp>> = stamps.iter().map(inside).collect();
        pass(self.sink, connection, &inside, sizes);
    }

    fn message(&mut self, message: Message<'_>) {
        if self.range.is_none_or(|r| r.contains(message.time)) {
            self.sink.message(message);
        }
    }

    fn notice(&mut self, notice: Notice) {
        self.lost |= notice.kind.is_loss();
        self.is_cut |= notice.kind == NoticeKind::Truncated;
        self.sink.notice(notice);
    }
}

/// A sink that keeps only the time covered.
#[derive(Default)]
pub(crate) struct Bounds(pub(crate) Option<Span>);

impl Sink for Bounds {
    fn stamps(&mut self, _: ConnectionId, stamps: &[Stamp], _: Option<&[u32]>) {
        for at in stamps {
            let own = Span::new(*at, at.plus(1));
            self.0 = Some(self.0.map_or(own, |all| all.hull(own)));
        }
    }
}

/// The time span covered by all bags; `None` unless each reports its own without being read.
///
/// # Errors
/// If one cannot be read.
pub(crate) fn known_span(readers: &mut [Box<dyn Reader>]) -> Result<Option<Span>> {
    let mut all: Option<Span> = None;
    for reader in readers {
        let Some(span) = reader.span()? else {
            return Ok(None);
        };
        all = Some(all.map_or(span, |all| all.hull(span)));
    }
    Ok(all)
}

/// The bytes of `whole` that correspond to `done` of `total` equal parts.
pub(crate) fn share(done: usize, total: usize, whole: u64) -> u64 {
    let bytes = u128::from(whole) * done as u128 / (total as u128).max(1);
    u64::try_from(bytes).unwrap_or(whole)
}

/// Stamps and sizes of single messages, batched per connection so that a sink receives long runs.
#[derive(Default)]
pub(crate) struct Gather {
    /// Whether the sizes are not known.
    pub(crate) sizeless: bool,
    runs: ById<ConnectionId, (Vec<Stamp>, Vec<u32>)>,
    touched: Vec<ConnectionId>,
    held: usize,
    last: Stamp,
    /// For each point at which time went back, the number of stamps batched per connection.
    cuts: Vec<ById<ConnectionId, usize>>,
    /// The numbers of stamps that were passed on before [`Gather::flush`].
    spilled: BTreeMap<ConnectionId, u64>,
}

/// The most points in one batch at which time goes back that are reported; with more, messages are merely out
/// of order.
pub(crate) const MOST_CUTS: usize = 64;
/// The most stamps in a batch: 3 MB.
const MOST_GATHERED: usize = 1 << 18;

impl Gather {
    /// Adds one message.
    pub(crate) fn add(&mut self, id: ConnectionId, time: Stamp, size: u32, sink: &mut dyn Sink) {
        if self.last.since(time) > OUT_OF_ORDER_NS && self.cuts.len() < MOST_CUTS {
            self.cuts
                .push(self.runs.iter().map(|run| run.0.len()).collect());
            self.last = time;
        }
        self.last = self.last.max(time);
        let run = self.runs.grown(id);
        if run.0.is_empty() {
            self.touched.push(id);
        }
        run.0.push(time);
        run.1.push(size);
        self.held += 1;
        if self.held >= MOST_GATHERED {
            self.spill(sink);
        }
    }

    /// The number of messages added for a connection.
    pub(crate) fn count(&self, id: ConnectionId) -> u64 {
        let run = self.runs.get(id);
        let spilled = self.spilled.get(&id).copied().unwrap_or(0);
        run.map_or(0, |run| run.0.len() as u64) + spilled
    }

    /// Whether exactly these stamps are batched for a connection, in any order, as far as they are still here.
    pub(crate) fn holds(&self, id: ConnectionId, stamps: &[Stamp]) -> bool {
        let held = self.runs.get(id).map_or(&[][..], |run| &run.0);
        let sorted = |stamps: &[Stamp]| {
            let mut stamps = stamps.to_vec();
            stamps.sort_unstable();
            stamps
        };
        !self.spilled.is_empty()
            || held == stamps
            || held.len() == stamps.len() && sorted(held) == sorted(stamps)
    }

    /// Drops the stamps batched for a connection; returns their number, or `None` if some were already
    /// passed on.
    pub(crate) fn take(&mut self, id: ConnectionId) -> Option<u64> {
        if !self.spilled.is_empty() {
            return None;
        }
        let Some(run) = self.runs.get_mut(id) else {
            return Some(0);
        };
        let held = run.0.len();
        run.0.clear();
        run.1.clear();
        self.cuts.clear();
        self.touched.retain(|touched| *touched != id);
        self.held -= held;
        Some(held as u64)
    }

    /// Keeps messages with a correct time, one per time; returns the number of messages dropped.
    pub(crate) fn retain(&mut self, is_right: impl Fn(Stamp) -> bool) -> u64 {
        let mut gone = 0;
        self.cuts.clear();
        for id in &self.touched {
            let (stamps, sizes) = &mut self.runs[*id];
            let before = stamps.len();
            let mut pairs: Vec<_> = stamps.drain(..).zip(sizes.drain(..)).collect();
            pairs.retain(|(at, _)| is_right(*at));
            pairs.dedup_by_key(|(at, _)| *at);
            (*stamps, *sizes) = pairs.into_iter().unzip();
            gone += before - stamps.len();
        }
        self.held -= gone;
        gone as u64
    }

    /// Passes on all batched stamps, by connection, and begins another batch.
    pub(crate) fn flush(&mut self, sink: &mut dyn Sink) {
        self.deliver(sink);
        self.spilled.clear();
    }

    /// Passes on what is batched so far, which still counts.
    pub(crate) fn spill(&mut self, sink: &mut dyn Sink) {
        for id in &self.touched {
            *self.spilled.entry(*id).or_default() += self.runs[*id].0.len() as u64;
        }
        self.deliver(sink);
    }

    fn deliver(&mut self, sink: &mut dyn Sink) {
        self.touched.sort_unstable();
        let mut from = ById::like(&self.runs, 0);
        let whole = self.runs.iter().map(|run| run.0.len()).collect();
        for to in self.cuts.drain(..).chain([whole]) {
            sink.part();
            for id in &self.touched {
                let (stamps, sizes) = &self.runs[*id];
                let part = from[*id]..to.get(*id).copied().unwrap_or(0);
                if !part.is_empty() {
                    let sizes = (!self.sizeless).then(|| &sizes[part.clone()]);
                    from[*id] = part.end;
                    sink.stamps(*id, &stamps[part], sizes);
                }
            }
        }
        for id in self.touched.drain(..) {
            let (stamps, sizes) = &mut self.runs[id];
            stamps.clear();
            sizes.clear();
        }
        self.last = Stamp::MIN;
        self.held = 0;
    }
}

/// The findings of one thread, to be reported to a sink on another.
#[derive(Default)]
struct Delivery {
    /// Runs of stamps: the connection, or `None` for the beginning of a part of the file.
    runs: Vec<(Option<ConnectionId>, usize, bool)>,
    stamps: Vec<Stamp>,
    sizes: Vec<u32>,
    messages: Vec<(ConnectionId, Stamp, usize, u32)>,
    bytes: Vec<u8>,
    notices: Vec<Notice>,
}

impl Delivery {
    fn is_full(&self) -> bool {
        self.stamps.len() > 1 << 14 || self.bytes.len() > 1 << 17
    }

    fn report(&self, sink: &mut dyn Sink) {
        let (mut at, mut size_at, mut byte_at) = (0, 0, 0);
        for (id, count, sized) in &self.runs {
            let Some(id) = id else {
                sink.part();
                continue;
            };
            let sizes = sized.then(|| &self.sizes[size_at..size_at + count]);
            sink.stamps(*id, &self.stamps[at..at + count], sizes);
            at += count;
            size_at += if *sized { *count } else { 0 };
        }
        for (connection, time, len, size) in &self.messages {
            sink.message(Message {
                connection: *connection,
                time: *time,
                data: &self.bytes[byte_at..byte_at + len],
                size: *size,
            });
            byte_at += len;
        }
        for notice in &self.notices {
            sink.notice(notice.clone());
        }
    }
}

/// A part of a thread's findings, or the end of its work on one part.
enum Sent {
    Some(Delivery),
    Done,
}

struct BatchSender {
    batch: Delivery,
    to: SyncSender<Sent>,
    /// Whether the receiver has hung up.
    is_closed: bool,
}

impl BatchSender {
    fn flush(&mut self) {
        let batch = std::mem::take(&mut self.batch);
        self.is_closed |= self.to.send(Sent::Some(batch)).is_err();
    }

    fn flush_if_full(&mut self) {
        if self.batch.is_full() {
            self.flush();
        }
    }

    fn done(&mut self) {
        self.flush();
        self.is_closed |= self.to.send(Sent::Done).is_err();
    }
}

impl Sink for BatchSender {
    fn part(&mut self) {
        self.batch.runs.push((None, 0, false));
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        self.batch
            .runs
            .push((Some(connection), stamps.len(), sizes.is_some()));
        self.batch.stamps.extend_from_slice(stamps);
        self.batch.sizes.extend_from_slice(sizes.unwrap_or(&[]));
        self.flush_if_full();
    }

    fn message(&mut self, message: Message<'_>) {
        let len = message.data.len();
        self.batch
            .messages
            .push((message.connection, message.time, len, message.size));
        self.batch.bytes.extend_from_slice(message.data);
        self.flush_if_full();
    }

    fn notice(&mut self, notice: Notice) {
        self.batch.notices.push(notice);
    }
}

/// The number of chunks in one part: a hand-over between threads costs more than reading a small index.
pub(crate) const GROUP: usize = 16;

/// Runs `work` on the parts `0..count` on `threads` threads and reports their findings to `sink` in part order:
/// the same calls as with one thread. `after` is called after each reported part.
///
/// All connections must have been announced before; `work` cannot announce more.
pub(crate) fn in_order(
    count: usize,
    threads: usize,
    work: &(dyn Fn(usize, &mut dyn Sink) + Sync),
    sink: &mut dyn Sink,
    mut after: impl FnMut(usize, &mut dyn Sink),
) {
    if threads <= 1 {
        for part in 0..count {
            work(part, sink);
            after(part, sink);
        }
        return;
    }
    thread::scope(|scope| {
        let lines: Vec<Receiver<Sent>> = (0..threads)
            .map(|first| {
                let (to, from) = sync_channel(8);
                scope.spawn(move || work_on(first, count, threads, work, to));
                from
            })
            .collect();
        for part in 0..count {
            let line = &lines[part % threads];
            while let Ok(Sent::Some(batch)) = line.recv() {
                batch.report(sink);
            }
            after(part, sink);
        }
    });
}

/// Works on every `step`th part from `first` on.
fn work_on(
    first: usize,
    count: usize,
    step: usize,
    work: &(dyn Fn(usize, &mut dyn Sink) + Sync),
    to: SyncSender<Sent>,
) {
    let mut sender = BatchSender {
        batch: Delivery::default(),
        to,
        is_closed: false,
    };
    for part in (first..count).step_by(step) {
        work(part, &mut sender);
        sender.done();
        if sender.is_closed {
            break;
        }
    }
}
