//! One chunk of an indexed bag: its index, reported to a sink, and the wanted messages, picked from the chunk's bytes.

use std::io;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use super::Grammar;
use super::record::{MessageHead, RecordKind};
use crate::bag::adapters::{Gather, MOST_CUTS};
use crate::bag::chunked::record::{NoRecord, Visitor, next_chunk, unpack};
use crate::bag::chunked::{Chunk, ChunkPlan};
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::model::{ConnectionId, MOST_PAYLOAD, Message, Sink, Want, damaged, lost};
use crate::bag::source::{ByteStream, FAR, FileSource, GLANCE, NEAR};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::rhythm::OUT_OF_ORDER_NS;
use crate::base::time::{Span, Stamp};

/// The expected checksum of a chunk's index, independent of the order of its entries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct IndexSum {
    pub(crate) connections: u32,
    pub(crate) messages: u64,
    mix: u64,
}

impl IndexSum {
    /// Adds `count` messages of the connection that the bag calls `raw`.
    pub(crate) fn add(&mut self, raw: u32, count: u32) {
        // Multiplying by an odd number is invertible; folding in the high bits distinguishes sums of pairs.
        let pair = u64::from(raw) << 32 | u64::from(count);
        let spread = pair.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.mix = self.mix.wrapping_add(spread ^ spread >> 29);
        self.connections = self.connections.saturating_add(1);
        self.messages = self.messages.saturating_add(u64::from(count));
    }
}

/// The step for picking records that are close together: fits a processor's cache.
const CLOSE: usize = 64 * 1024;

/// An index longer than this, in bytes, is not loaded; its chunk is walked instead.
pub(crate) const LONGEST_INDEX: u64 = 16 << 20;

/// The entries of a chunk's index.
#[derive(Default)]
pub(crate) struct Index {
    /// A connection's number in the bag, and the range of its entries.
    runs: Vec<(u32, Range<usize>)>,
    stamps: Vec<Stamp>,
    /// The position of each message, from the start of the chunk's plain bytes.
    offsets: Vec<u64>,
}

impl Index {
    /// Adds the entries of one connection.
    pub(crate) fn add(&mut self, raw: u32, entries: impl Iterator<Item = (Stamp, u64)>) {
        let start = self.stamps.len();
        for (time, offset) in entries {
            self.stamps.push(time);
            self.offsets.push(offset);
        }
        // Recorders sort the entries of a connection by time.
        if !self.offsets[start..].is_sorted() {
            let stamps = self.stamps.drain(start..).zip(self.offsets.drain(start..));
            let mut pairs: Vec<(Stamp, u64)> = stamps.collect();
            pairs.sort_by_key(|(_, offset)| *offset);
            let (stamps, offsets): (Vec<Stamp>, Vec<u64>) = pairs.into_iter().unzip();
            self.stamps.extend(stamps);
            self.offsets.extend(offsets);
        }
        self.runs.push((raw, start..self.stamps.len()));
    }

    /// The positions in the chunk where time goes back, in order.
    fn falls(&self) -> impl Iterator<Item = u64> + use<> {
        let mut falls = Vec::new();
        for (_, entries) in &self.runs {
            let mut last = Stamp::MIN;
            for at in entries.clone() {
                let time = self.stamps[at];
                if last.since(time) > OUT_OF_ORDER_NS {
                    falls.push(self.offsets[at]);
                    last = time;
                }
                last = last.max(time);
            }
        }
        falls.sort_unstable();
        let is_few = falls.len() <= MOST_CUTS;
        falls.into_iter().filter(move |_| is_few)
    }

    /// The part of the entries of one connection that lies in a part of the chunk.
    fn between(&self, entries: &Range<usize>, part: Range<u64>) -> Range<usize> {
        let offsets = &self.offsets[entries.clone()];
        let place = |offset| entries.start + offsets.partition_point(|at| *at < offset);
        place(part.start)..if part.end == u64::MAX {
            entries.end
        } else {
            place(part.end)
        }
    }

    /// The first and the last time in it.
    pub(super) fn times(&self) -> Option<(Stamp, Stamp)> {
        bounds(&self.stamps)
    }
}

/// The first and the last of some times.
pub(super) fn bounds(stamps: &[Stamp]) -> Option<(Stamp, Stamp)> {
    let ends = stamps.iter().map(|at| (*at, *at));
    ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Whether the first and the last time in a chunk are the stated ones. A message at 0 does not count: some writers take 0
/// for an unknown time and state the time of another message.
pub(super) fn spans((low, high): (Stamp, Stamp), (first, last): (Stamp, Stamp)) -> bool {
    (low == first || low == Stamp(0)) && high == last
}

/// The position of a chunk's records.
pub(crate) struct ChunkBody {
    pub(crate) how: Compression,
    pub(crate) range: Range<u64>,
}

impl ChunkBody {
    /// A stream of the plain bytes, and the position at which they start. `step` is the number of bytes read at a time
    /// if they are plain in the file.
    pub(crate) fn plain<'a>(
        &self,
        source: &'a FileSource,
        step: usize,
        allowance: &Arc<Allowance>,
    ) -> io::Result<(ByteStream<'a>, u64)> {
        if self.how == Compression::None {
            let stream = ByteStream::of_file(source, self.range.start, self.range.end, step);
            return Ok((stream, self.range.start));
        }
        let packed = ByteStream::of_file(source, self.range.start, self.range.end, FAR);
        Ok((ByteStream::of_reader(allowance.open(self.how, packed)?), 0))
    }
}

/// The requested parts of a bag: the same for all of its chunks.
pub(super) struct Query<'a, G> {
    pub(super) source: &'a FileSource,
    pub(super) allowance: Arc<Allowance>,
    pub(super) plan: &'a ChunkPlan,
    /// The wanted part of each message, by connection.
    pub(super) wants: &'a [Want],
    pub(super) range: Option<Span>,
    pub(super) grammar: PhantomData<fn() -> G>,
}

impl<G: Grammar> Query<'_, G> {
    /// Reports the stamps of `index` to `sink`, and the wanted messages from `body`.
    pub(super) fn report(&self, index: &Index, body: Option<ChunkBody>, sink: &mut dyn Sink) {
        let wanted = self.wanted(index);
        let sizes = if wanted.is_empty() {
            None
        } else {
            self.fetch(index, &wanted, body, sink)
        };
        let mut from = 0;
        for to in index.falls().chain([u64::MAX]) {
            sink.part();
            for (raw, entries) in &index.runs {
                let entries = index.between(entries, from..to);
                if entries.is_empty() {
                    continue;
                }
                let Some(id) = self.plan.connections.get(*raw) else {
                    nameless(sink, entries.len() as u64);
                    continue;
                };
                // Sizes of entries outside the range are not looked up, and such entries are not reported.
                let known = self.wants[id.0 as usize] > Want::Stamps;
                let sizes = sizes.as_ref().filter(|_| known);
                let sizes = sizes.map(|s| &s[entries.clone()]);
                sink.stamps(id, &index.stamps[entries], sizes);
            }
            from = to;
        }
    }

    /// The entries for which more than the stamp is wanted, in the order of the chunk.
    fn wanted(&self, index: &Index) -> Vec<Wanted> {
        let mut all = Vec::new();
        for (run, (raw, entries)) in index.runs.iter().enumerate() {
            let want = self.plan.connections.get(*raw);
            let want = want.map_or(Want::Stamps, |id| self.wants[id.0 as usize]);
            if want == Want::Stamps {
                continue;
            }
            let is_inside = |at: &usize| self.range.is_none_or(|r| r.contains(index.stamps[*at]));
            all.extend(entries.clone().filter(is_inside).map(|entry| Wanted {
                offset: index.offsets[entry],
                entry,
                run,
            }));
        }
        // A stable sort merges sorted runs: the entries of each connection.
        all.sort_by_key(|w| w.offset);
        all
    }

    /// Fetches wanted messages; returns the size per entry if all were there.
    fn fetch(
        &self,
        index: &Index,
        wanted: &[Wanted],
        body: Option<ChunkBody>,
        sink: &mut dyn Sink,
    ) -> Option<Vec<u32>> {
        let mut sizes = vec![0; index.stamps.len()];
        let mut missing = 0;
        let step = step(wanted);
        let plain = body.and_then(|b| b.plain(self.source, step, &self.allowance).ok());
        match plain {
            None => missing = wanted.len(),
            Some((mut stream, base)) => {
                for one in wanted {
                    match self.pick(&mut stream, base, (index, one), sink) {
                        Some(size) => sizes[one.entry] = size,
                        None => missing += 1,
                    }
                }
            }
        }
        if missing == 0 {
            return Some(sizes);
        }
        absent(sink, missing as u64);
        None
    }

    /// Reports one wanted message to `sink`; returns its size, or `None` if it is missing.
    fn pick(
        &self,
        stream: &mut ByteStream<'_>,
        base: u64,
        (index, one): (&Index, &Wanted),
        sink: &mut dyn Sink,
    ) -> Option<u32> {
        let ahead = base
            .checked_add(one.offset)?
            .checked_sub(stream.position())?;
        if stream.skip(ahead).ok()? < ahead {
            return None;
        }
        let (expected, _) = index.runs[one.run];
        let size = match G::next(stream).ok()?.kind {
            RecordKind::Message(head) if head.raw == expected => head.size,
            _ => return None,
        };
        let connection = self.plan.connections.get(expected)?;
        let want = self.wants[connection.0 as usize];
        if let Some(data) = wanted_part(stream, size, want, sink).ok()? {
            sink.message(Message {
                connection,
                time: index.stamps[one.entry],
                data,
                size,
            });
        }
        Some(size)
    }
}

/// A message to be fetched.
struct Wanted {
    offset: u64,
    /// The positions of its entry and of the entry's run in the index.
    entry: usize,
    run: usize,
}

/// The number of bytes to read at a time for these messages, in order: far if the next one lies in the next few pages.
fn step(wanted: &[Wanted]) -> usize {
    let [first, .., last] = wanted else {
        return NEAR;
    };
    let between = (last.offset - first.offset) / wanted.len() as u64;
    if between <= NEAR as u64 { CLOSE } else { NEAR }
}

/// The notice about other times.
pub(super) const OTHER_TIMES: &str =
    "chunks begin or end at other times than the bag's index states";

/// Reports messages of a connection that the bag does not describe.
pub(crate) fn nameless(sink: &mut dyn Sink, count: u64) {
    let text = "messages belong to a connection that the bag does not describe";
    damaged(sink, count, text);
}

/// Reports messages that only the index has.
pub(super) fn absent(sink: &mut dyn Sink, count: u64) {
    let text = "messages are in the index but not in their chunk";
    damaged(sink, count, text);
}

/// Passes on the wanted part of the message at the position of `stream`, and skips it.
pub(super) fn hand_over(
    stream: &mut ByteStream<'_>,
    (connection, want): (ConnectionId, Want),
    MessageHead { time, size, .. }: MessageHead,
    sink: &mut dyn Sink,
) -> Result<(), super::record::NoRecord> {
    if let Some(data) = wanted_part(stream, size, want, sink)? {
        sink.message(Message {
            connection,
            time,
            data,
            size,
        });
    }
    super::record::pass(stream, u64::from(size))
}

/// Passes on the wanted part of a message from another reader.
pub(crate) fn hand_over_slice(
    whole: &[u8],
    (connection, time): (ConnectionId, Stamp),
    want: Want,
    sink: &mut dyn Sink,
) {
    let size = u32::try_from(whole.len()).unwrap_or(u32::MAX);
    let data = match want {
        Want::Stamps | Want::Sizes => return,
        Want::Beside(n) | Want::Head(n) => &whole[..n.min(whole.len())],
        Want::Payload => whole,
    };
    sink.message(Message {
        connection,
        time,
        data,
        size,
    });
}

/// The wanted bytes of the message at the position of `stream`; `None` if none are wanted, or too many.
fn wanted_part<'s>(
    stream: &'s mut ByteStream<'_>,
    size: u32,
    want: Want,
    sink: &mut dyn Sink,
) -> io::Result<Option<&'s [u8]>> {
    let len = match want {
        Want::Stamps | Want::Sizes => return Ok(None),
        Want::Beside(n) | Want::Head(n) => (size as usize).min(n),
        Want::Payload => size as usize,
    };
    if len > MOST_PAYLOAD {
        sink.notice(Notice::new(NoticeKind::Undecodable, TOO_LARGE));
        return Ok(None);
    }
    let data = stream.peek(len)?;
    if data.len() < len {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(Some(data))
}

/// The notice about a payload larger than [`MOST_PAYLOAD`].
const TOO_LARGE: &str = "messages larger than 16 MiB were counted but not decoded";

// Reads one chunk of an indexed bag: by its index, or record by record if that is missing or wrong.

impl<G: Grammar> Query<'_, G> {
    /// Reports all stamps of `chunk` and the wanted parts of its messages to `sink`.
    pub(super) fn read(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        // A chunk without an index was stated to be empty elsewhere.
        let Some(promised) = &chunk.promised else {
            return;
        };
        let found = match self.index(chunk, promised) {
            Ok(found) => found,
            Err(e) => return lost(sink, "a chunk's index cannot be read", &e),
        };
        let times = (chunk.first, chunk.last);
        let found = found.filter(|found| found.index.times().is_none_or(|own| spans(own, times)));
        let Some(found) = found else {
            let text = "chunks were read whole, since their index is missing or wrong";
            damaged(sink, 1, text);
            let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, FAR);
            self.walked(&mut stream, Share::Whole, sink);
            return self.unnamed(chunk, sink);
        };
        let body = found.body.or_else(|| self.moved(chunk));
        self.report(&found.index, body, sink);
        if found.place == Place::Apart {
            damaged(sink, 1, APART);
        }
        if found.place != Place::Expected {
            self.unnamed(chunk, sink);
        }
    }

    /// Reads the chunks after `chunk` that the tail does not list.
    fn unnamed(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        let Ok(Some(body)) = self.body(chunk.start, chunk.end) else {
            return;
        };
        let tail = self.plan.body.end;
        let mut stream = ByteStream::of_file(self.source, body.range.end, tail, FAR);
        let mut from = chunk.start;
        while next_chunk::<G>(&mut stream, from) && stream.position() < chunk.end {
            damaged(sink, 1, "chunks that the index does not list were read");
            from = stream.position();
            let body = self.body(from, tail).ok().flatten();
            if chunk.end < tail && body.is_some_and(|body| body.range.end > chunk.end) {
                // The next listed chunk, listed at a wrong position: its index is found there, its messages here.
                let mut stream = ByteStream::of_file(self.source, from, tail, FAR);
                return self.walked(&mut stream, Share::Payloads, sink);
            }
            self.walked(&mut stream, Share::Whole, sink);
        }
    }

    /// The chunk's index, if it agrees exactly with the tail.
    fn index(&self, chunk: &Chunk, promised: &IndexSum) -> io::Result<Option<Found>> {
        let len = chunk.index.end - chunk.index.start;
        if len > LONGEST_INDEX {
            return Ok(None);
        }
        let body = self.body(chunk.start, chunk.end)?;
        let behind = body.as_ref().map(|body| body.range.end);
        let expected = || self.index_at(chunk.index.start, len, promised);
        // Bytes between a chunk and its index belong to neither.
        let mut place = Place::Expected;
        let mut index = None;
        if behind == Some(chunk.index.start) {
            index = expected()?;
        }
        if let (None, Some(behind)) = (&index, behind) {
            // After a chunk there may be a gap, and headers may be longer than usual.
            let most = (len * 2 + 4096).min(LONGEST_INDEX);
            let len = chunk.end.saturating_sub(behind).min(most);
            index = self.index_at(behind, len, promised)?;
            place = Place::Behind;
        }
        if index.is_none() && len > 0 && !behind.is_some_and(|at| self.is_index(at, chunk.end)) {
            index = expected()?;
            place = Place::Apart;
        }
        Ok(index.map(|index| Found { index, body, place }))
    }

    /// Whether an index begins at `start`, even if not the stated one.
    fn is_index(&self, start: u64, end: u64) -> bool {
        let mut stream = ByteStream::of_file(self.source, start, end, GLANCE);
        G::next(&mut stream).is_ok_and(|next| matches!(next.kind, RecordKind::Index { .. }))
    }

    fn index_at(&self, start: u64, len: u64, promised: &IndexSum) -> io::Result<Option<Index>> {
        let len = len.min(self.source.len());
        let mut bytes = vec![0; usize::try_from(len).unwrap_or(0)];
        let got = self.source.read_at(start, &mut bytes)?;
        Ok(G::index(&bytes[..got], promised))
    }

    /// The compression of the chunk at byte `start` and the position of its body, which ends at byte `end` at the latest.
    pub(super) fn body(&self, start: u64, end: u64) -> io::Result<Option<ChunkBody>> {
        let mut stream = ByteStream::of_file(self.source, start, end, GLANCE);
        let head = match G::next(&mut stream).map(|next| next.kind) {
            Ok(RecordKind::Chunk(head)) => head,
            Err(NoRecord::Io(e)) => return Err(e),
            _ => return Ok(None),
        };
        let start = stream.position();
        let range = start..start.saturating_add(head.packed);
        let how = head.how.filter(|_| range.end <= end);
        Ok(how.map(|how| ChunkBody { how, range }))
    }

    /// The body of a chunk whose position in the tail is too early.
    fn moved(&self, chunk: &Chunk) -> Option<ChunkBody> {
        let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, FAR);
        let start = next_chunk::<G>(&mut stream, chunk.start).then(|| stream.position())?;
        self.body(start, chunk.end).ok().flatten()
    }

    /// Reports the chunk at the position of `stream` to `sink`, record by record, and damage in it.
    fn walked(&self, stream: &mut ByteStream<'_>, what: Share, sink: &mut dyn Sink) {
        if let Err(why) = self.walk(stream, what, sink) {
            damaged(sink, 1, &format!("a chunk is damaged inside: {why}"));
        }
    }

    fn walk(
        &self,
        stream: &mut ByteStream<'_>,
        what: Share,
        sink: &mut dyn Sink,
    ) -> Result<(), String> {
        let Ok(RecordKind::Chunk(head)) = G::next(stream).map(|next| next.kind) else {
            return Err("it has no readable head".to_owned());
        };
        let mut walk = ChunkWalk {
            query: self,
            what,
            gather: Gather::default(),
            sink,
        };
        let walked = unpack(stream, &head, &self.allowance, &mut walk);
        walk.gather.flush(walk.sink);
        match walked {
            Ok(None) => Ok(()),
            Ok(Some(why)) => Err(why),
            Err(stop) => Err(stop.to_string()),
        }
    }
}

const APART: &str = "chunks differ in position or length from the bag's index";

/// The index of a chunk.
struct Found {
    index: Index,
    /// The position of the chunk's records, if its head is readable.
    body: Option<ChunkBody>,
    place: Place,
}

/// The position of a chunk's index.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// At the stated position, right after the chunk.
    Expected,
    /// After the chunk, but not at the stated position.
    Behind,
    /// At the stated position, but not after the chunk: the chunk has another length or position.
    Apart,
}

/// The part of a chunk that is reported.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Share {
    Whole,
    /// Only the wanted payloads: an index elsewhere reports the stamps.
    Payloads,
}

/// The messages of a chunk on their way to a sink.
struct ChunkWalk<'a, 's, G> {
    query: &'a Query<'a, G>,
    what: Share,
    gather: Gather,
    sink: &'s mut dyn Sink,
}

impl<G: Grammar> Visitor<G> for ChunkWalk<'_, '_, G> {
    fn message(&mut self, stream: &mut ByteStream<'_>, head: MessageHead) -> Result<(), NoRecord> {
        let Some(id) = self.query.plan.connections.get(head.raw) else {
            nameless(self.sink, 1);
            return super::record::pass(stream, u64::from(head.size));
        };
        let want: Want = self.query.wants[id.0 as usize];
        hand_over(stream, (id, want), head, self.sink)?;
        if self.what == Share::Whole {
            self.gather.add(id, head.time, head.size, self.sink);
        }
        Ok(())
    }
}
