//! Adapters between a reader and its target sink: clipping to a range, moved times, batching, crossing threads.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use crate::bag::model::{ConnectionId, Message, Reader, Report, Sink};
use crate::bag::straight::{Straightened, pass};
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

/// A finding of one thread, to be reported to a sink on another.
enum Finding {
    Part,
    Stamps(ConnectionId, Vec<Stamp>, Option<Vec<u32>>),
    /// A message with its payload.
    Message(ConnectionId, Stamp, u32, Vec<u8>),
    Notice(Notice),
}

impl Finding {
    fn report(self, sink: &mut dyn Sink) {
        match self {
            Self::Part => sink.part(),
            Self::Stamps(id, stamps, sizes) => sink.stamps(id, &stamps, sizes.as_deref()),
            Self::Message(connection, time, size, data) => sink.message(Message {
                connection,
                time,
                data: &data,
                size,
            }),
            Self::Notice(notice) => sink.notice(notice),
        }
    }
}

/// The most bytes of stamps and payloads that are sent at once, and that a single finding counts as at least.
const MOST_SENT: usize = 1 << 17;
const LEAST_SENT: usize = 1 << 6;

/// A sink that sends findings to another thread: many at once, and `None` after those of each part.
struct BatchSender {
    batch: Vec<Finding>,
    bytes: usize,
    to: SyncSender<Option<Vec<Finding>>>,
}

impl BatchSender {
    fn add(&mut self, finding: Finding, bytes: usize) {
        self.batch.push(finding);
        self.bytes += bytes.max(LEAST_SENT);
        if self.bytes > MOST_SENT {
            self.flush();
        }
    }

    fn flush(&mut self) {
        self.bytes = 0;
        let batch = std::mem::take(&mut self.batch);
        // A receiver that has hung up needs no more.
        let _ = self.to.send(Some(batch));
    }
}

impl Sink for BatchSender {
    fn part(&mut self) {
        self.add(Finding::Part, 0);
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let sizes = sizes.map(<[u32]>::to_vec);
        let finding = Finding::Stamps(connection, stamps.to_vec(), sizes);
        self.add(finding, size_of_val(stamps));
    }

    fn message(&mut self, message: Message<'_>) {
        let Message { time, size, .. } = message;
        let finding = Finding::Message(message.connection, time, size, message.data.to_vec());
        self.add(finding, message.data.len());
    }

    fn notice(&mut self, notice: Notice) {
        self.add(Finding::Notice(notice), 0);
    }
}

/// The number of chunks in one part: a hand-over between threads costs more than reading a small index.
pub(crate) const GROUP: usize = 16;

/// Runs `work` on the parts `0..count` on `threads` threads and reports their findings to `sink` in part order:
/// the same calls as with one thread. Reports progress after each part, as equal shares of `whole` bytes.
///
/// All connections must have been announced before; `work` cannot announce more.
pub(crate) fn in_order(
    count: usize,
    threads: usize,
    work: &(dyn Fn(usize, &mut dyn Sink) + Sync),
    sink: &mut dyn Sink,
    whole: u64,
) {
    let after = |part: usize, sink: &mut dyn Sink| {
        let done = u128::from(whole) * (part as u128 + 1) / (count as u128).max(1);
        sink.progress(u64::try_from(done).unwrap_or(whole), whole);
    };
    if threads <= 1 {
        for part in 0..count {
            work(part, sink);
            after(part, sink);
        }
        return;
    }
    thread::scope(|scope| {
        // Each thread works on every so-many-th part.
        let work_from = |first: usize| {
            let (to, from) = sync_channel(8);
            scope.spawn(move || {
                let mut sender = BatchSender {
                    batch: Vec::new(),
                    bytes: 0,
                    to,
                };
                for part in (first..count).step_by(threads) {
                    work(part, &mut sender);
                    sender.flush();
                    if sender.to.send(None).is_err() {
                        break;
                    }
                }
            });
            from
        };
        let lines: Vec<Receiver<_>> = (0..threads).map(work_from).collect();
        for part in 0..count {
            while let Ok(Some(batch)) = lines[part % threads].recv() {
                for finding in batch {
                    finding.report(sink);
                }
            }
            after(part, sink);
        }
    });
}

// A bag whose recorder's clock was wrong by a known time: a reader that moves all its times.

/// A reader of another one's bag at other times.
pub(crate) struct Moved {
    reader: Box<dyn Reader>,
    /// The time by which its times are moved, in nanoseconds.
    by: i64,
}

impl Moved {
    pub(crate) fn new(reader: Box<dyn Reader>, by: i64) -> Self {
        Self { reader, by }
    }
}

impl Reader for Moved {
    fn is_straight(&self) -> bool {
        self.reader.is_straight()
    }

    fn span(&mut self) -> Result<Option<Span>> {
        let span = self.reader.span()?;
        Ok(span.map(|span| span.moved(self.by)))
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let range = range.map(|range| range.moved(self.by.saturating_neg()));
        let mut moved = Straightened::by(self.by, sink);
        self.reader.read(range, &mut moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::{Input, OpenOptions, open};

    /// The first and the last time of a bag.
    struct Ends(Option<(Stamp, Stamp)>);

    impl Sink for Ends {
        fn stamps(&mut self, _: ConnectionId, stamps: &[Stamp], _: Option<&[u32]>) {
            for time in stamps {
                let ends = self.0.get_or_insert((*time, *time));
                *ends = (ends.0.min(*time), ends.1.max(*time));
            }
        }
    }

    fn ends(by: i64, range: Option<Span>) -> (Option<Span>, (Stamp, Stamp)) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
        let reader = open(&Input::Path(path.into()), &OpenOptions::default()).unwrap();
        let mut reader = Moved::new(reader, by);
        let mut sink = Ends(None);
        reader.read(range, &mut sink).unwrap();
        (reader.span().unwrap(), sink.0.unwrap())
    }

    #[test]
    fn span_range_and_messages_are_moved_alike() {
        let (span, (first, last)) = ends(0, None);
        let (at, (from, to)) = ends(5, None);
        assert_eq!(at, span.map(|span| span.moved(5)));
        assert_eq!((from, to), (first.plus(5), last.plus(5)));
        let only = Span::new(first.plus(5), first.plus(6));
        assert_eq!(ends(5, Some(only)).1, (first.plus(5), first.plus(5)));
    }
}
