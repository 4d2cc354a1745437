//! A chunked bag record by record from the front: without an index, cut, from a pipe, or while it is still being written.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Grammar;
use super::index::{OTHER_TIMES, absent, hand_over, nameless, spans};
use super::record::{
    Announced, ChunkHead, Counts, MessageHead, NoRecord, RecordKind, pass, peek_whole, walk,
};
use crate::bag::adapters::Gather;
use crate::bag::chunked::record::{Before, Visitor, next_chunk, next_record, records, unpack};
use crate::bag::chunked::{HEAD, MOST_CHUNKS};
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::input::{BagPlace, closed, head};
use crate::bag::model::{ConnectionId, Growing, Growth, MOST_PAYLOAD, Sink, damaged};
use crate::bag::source::{ByteStream, FAR, FileSource};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;

/// The messages of connections that are not described, or not yet.
#[derive(Default)]
struct Early {
    runs: BTreeMap<u32, EarlyRun>,
    held: usize,
    /// The connections of those of the last chunk, in order.
    last: Vec<u32>,
}

/// The messages of one of them. Those that only the index of their chunk has come without sizes.
#[derive(Default)]
struct EarlyRun {
    stamps: Vec<Stamp>,
    sizes: Vec<u32>,
    /// The number of those of the last chunk that no index record has stated yet.
    last: usize,
}

/// The most early messages that are kept: 3 MB.
const MOST_EARLY: usize = 1 << 18;

/// What a bag states about itself, beside what was found in it.
#[derive(Default)]
struct Account {
    stated: Counts,
    /// The chunks found by their positions, with the first and the last time in those that were read whole.
    chunks: BTreeMap<u64, Option<(Stamp, Stamp)>>,
    /// The chunks that the index lists, and whether one of them was found at other times than listed.
    listed: BTreeSet<u64>,
    is_misdated: bool,
}

impl Account {
    /// Takes a chunk that was found.
    fn find(&mut self, at: u64, times: Option<(Stamp, Stamp)>) {
        if self.chunks.len() < MOST_CHUNKS {
            self.chunks.insert(at, times);
        }
    }

    /// Takes a chunk that the index lists.
    fn list(&mut self, at: u64, listed: (Stamp, Stamp)) {
        if self.listed.len() < MOST_CHUNKS {
            self.listed.insert(at);
        }
        let times = self.chunks.get(&at).copied().flatten();
        self.is_misdated |= times.is_some_and(|times| !spans(times, listed));
    }

    /// Says what a walk left unread, which found `messages` messages. What nothing states is not missed; everything that
    /// the head, the summary or the index states is compared here and nowhere else.
    fn unread(&self, messages: u64, mut say: impl FnMut(&str)) {
        let stated = self.stated;
        let chunks = self.chunks.len() as u64;
        let pairs = [
            (stated.messages, messages, "messages"),
            (stated.chunks.into(), chunks, "chunks"),
        ];
        for (stated, found, what) in pairs {
            if stated > found && chunks < MOST_CHUNKS as u64 {
                say(&format!(
                    "the bag should contain {stated} {what}; found {found}"
                ));
            }
        }
        if !self.listed.is_empty() && !self.listed.iter().eq(self.chunks.keys()) {
            say("its index lists other chunks than were found");
        }
        if self.is_misdated {
            say(OTHER_TIMES);
        }
    }
}

/// A walk through the records of a bag: of all of it at once, or in steps while it grows.
#[derive(Default)]
pub(super) struct Walk<G> {
    announced: Announced<G>,
    found_messages: ChunkMessages,
    early: Early,
    compression: BTreeSet<Compression>,
    allowance: Arc<Allowance>,
    account: Account,
    /// The number of records found: even a bag that was never closed has its head.
    records: u64,
    /// Whether the end of the data was reached, and the record that ends the file.
    ended: bool,
    closed: bool,
    /// The position after the head of the last chunk, which its recorder may write again.
    pub(super) body: u64,
    /// Whether messages are stored in chunks: a closed chunk was found.
    is_chunked: bool,
    /// The first and the last time in the chunk that is read.
    times: Option<(Stamp, Stamp)>,
}

/// Its next steps, with the receiver of what they find.
struct Forward<'a, G> {
    walk: &'a mut Walk<G>,
    sink: &'a mut dyn Sink,
}

/// Reads all of `stream` from the first record on; `size` is the length of the bag, 0 if unknown. Returns the compressions of
/// its chunks; every loss is a notice.
pub(super) fn read<G: Grammar>(
    stream: &mut ByteStream<'_>,
    size: u64,
    sink: &mut dyn Sink,
) -> BTreeSet<Compression> {
    let mut walk = Walk::<G>::default();
    let (stop, at) = walk.go(stream, size, false, sink);
    walk.finish(&stop, at, sink)
}

impl<G: Grammar> Walk<G> {
    /// Takes the records of `stream`; returns why they end and the position after the last one that was taken. If the bag
    /// `is_growing`, a record that is not complete is left for later, unless a chunk follows it.
    pub(super) fn go(
        &mut self,
        stream: &mut ByteStream<'_>,
        size: u64,
        is_growing: bool,
        sink: &mut dyn Sink,
    ) -> (NoRecord, u64) {
        let mut forward = Forward { walk: self, sink };
        let mut at = stream.position();
        let stop = walk(stream, u64::MAX, |stream| {
            let from = stream.position();
            let step = G::next(stream).and_then(|record| match record.kind {
                RecordKind::Chunk(head) if is_growing && head.unclosed => {
                    let body = stream.position();
                    let is_followed = next_chunk::<G>(stream, from);
                    stream.back(body);
                    let chunk = is_followed.then(|| forward.chunk(stream, from, &head));
                    chunk.unwrap_or(Err(NoRecord::Cut))
                }
                _ if is_growing && stream.left().is_some_and(|left| left < record.len) => {
                    Err(NoRecord::Cut)
                }
                kind => forward.record(stream, from, kind, record.len),
            });
            at = if is_growing { at } else { stream.position() };
            let is_found = match step {
                // Of a record that grows, only what follows it is whole.
                Err(NoRecord::Cut) if is_growing => next_chunk::<G>(stream, from),
                Err(NoRecord::Broken | NoRecord::Cut) => next_record::<G>(stream, from, u64::MAX),
                _ => false,
            };
            if is_found {
                // The bytes from `from` on are not records.
                let lost = stream.position() - from;
                forward.damage(&format!(
                    "skipped {lost} bytes at byte {from} that are not records"
                ));
            } else {
                step?;
            }
            at = stream.position();
            forward.sink.progress(at, size);
            Ok(())
        });
        if is_growing {
            self.found_messages.spill(sink);
        }
        (stop, at)
    }

    /// Reports what the walk left unread, once it stopped at byte `at`.
    pub(super) fn finish(
        mut self,
        stop: &NoRecord,
        at: u64,
        sink: &mut dyn Sink,
    ) -> BTreeSet<Compression> {
        let mut forward = Forward {
            walk: &mut self,
            sink,
        };
        forward.report_chunk();
        forward.name_early();
        let found = forward.walk.found_messages.messages;
        let account = std::mem::take(&mut forward.walk.account);
        account.unread(found, |text| forward.damage(text));
        let walk = forward.walk;
        let is_cut = !matches!(stop, NoRecord::Io(_));
        let text = match stop {
            NoRecord::End if !G::HAS_END && walk.records > 0 => return self.compression,
            _ if walk.closed && is_cut => return self.compression,
            _ if walk.ended && is_cut => {
                format!("the bag is cut at byte {at}, behind its messages")
            }
            NoRecord::End => format!("the bag was never finished; it ends at byte {at}"),
            NoRecord::Cut => format!("the bag is cut at byte {at}"),
            NoRecord::Broken => format!("no record at byte {at}"),
            NoRecord::Io(e) => format!("reading stopped at byte {at}: {e}"),
        };
        let is_broken = !is_cut || matches!(stop, NoRecord::Broken) && !walk.ended;
        let kind = if is_broken {
            NoticeKind::Damaged
        } else {
            NoticeKind::Truncated
        };
        forward.sink.notice(Notice::new(kind, text));
        self.compression
    }
}

impl<G: Grammar> Forward<'_, G> {
    fn record(
        &mut self,
        stream: &mut ByteStream<'_>,
        from: u64,
        kind: RecordKind<G::Description>,
        len: u64,
    ) -> Result<(), NoRecord> {
        self.walk.records += 1;
        let is_content = matches!(kind, RecordKind::Chunk(_) | RecordKind::Message(_));
        if self.walk.ended && is_content {
            self.walk.ended = false;
            self.damage("messages follow the end of the data");
        }
        if kind.is_of_the_end() && G::HAS_END && !self.walk.ended {
            self.damage("records that belong to the bag's end are among its messages");
        }
        match kind {
            RecordKind::Chunk(head) => self.chunk(stream, from, &head),
            RecordKind::Message(head) => {
                if self.walk.is_chunked && !G::IS_LOOSE {
                    self.damage("messages are outside of chunks");
                }
                self.walk.compression.insert(Compression::None);
                self.message(stream, head)
            }
            RecordKind::Description(what) => self.description(stream, &what, len),
            RecordKind::Index { raw, count } => self.index(stream, (raw, count), len),
            RecordKind::Total(stated) => {
                self.walk.account.stated = stated;
                pass(stream, len)
            }
            RecordKind::Listed { at, times } => {
                self.report_chunk();
                self.walk.account.list(at, times);
                pass(stream, len)
            }
            RecordKind::DataEnd(crc) => {
                self.walk.ended = true;
                if is_other(stream, crc) {
                    self.damage("the checksum of its data is wrong");
                }
                pass(stream, len)?;
                if stream.sum().is_some() {
                    stream.sum_up();
                }
                Ok(())
            }
            RecordKind::FileEnd(crc) => self.file_end(stream, len, crc),
            RecordKind::Unknown { extension } => {
                self.walk.found_messages.interrupted = true;
                let text = "records of a kind that the format does not define were skipped";
                if extension {
                    self.sink.notice(Notice::new(NoticeKind::Note, text));
                } else {
                    self.damage(text);
                }
                pass(stream, len)
            }
            RecordKind::Other | RecordKind::Tail => {
                self.walk.found_messages.interrupted = true;
                pass(stream, len)
            }
        }
    }

    /// Ends the walk if the bag ends here properly.
    fn file_end(
        &mut self,
        stream: &mut ByteStream<'_>,
        len: u64,
        crc: Option<u32>,
    ) -> Result<(), NoRecord> {
        (self.walk.ended, self.walk.closed) = (true, true);
        pass(stream, len.saturating_sub(4))?;
        if is_other(stream, crc) {
            self.damage("the checksum of its summary is wrong");
        }
        pass(stream, len.min(4))?;
        if stream.peek(G::CLOSING.len() + 1)? == G::CLOSING {
            stream.advance(G::CLOSING.len());
            return Err(NoRecord::End);
        }
        let at = stream.position();
        self.damage(&format!(
            "unexpected data at byte {at} instead of the end of the bag"
        ));
        Ok(())
    }

    /// Reads a chunk whose record began at byte `from`.
    fn chunk(
        &mut self,
        stream: &mut ByteStream<'_>,
        from: u64,
        head: &ChunkHead,
    ) -> Result<(), NoRecord> {
        self.report_chunk();
        self.walk.body = stream.position();
        self.walk.is_chunked = head.packed > 0;
        self.walk.compression.extend(head.how);
        if head.misnamed {
            self.damage("a chunk is marked as another kind of record; it was read anyway");
        }
        if head.unclosed {
            self.walk.account.find(from, None);
            return self.unclosed(stream, head.how.unwrap_or(Compression::None));
        }
        let allowance = Arc::clone(&self.walk.allowance);
        self.walk.times = None;
        let wrong = unpack(stream, head, &allowance, self)?;
        let times = self.walk.times.filter(|_| wrong.is_none());
        self.walk.account.find(from, times);
        if let Some(why) = wrong {
            self.walk.found_messages.doubt(head.times);
            self.damage(&format!("a chunk is damaged inside: {why}"));
        }
        Ok(())
    }

    /// Reads a compressed chunk without a length: the last one, which was never closed, unless another follows.
    fn unclosed(&mut self, stream: &mut ByteStream<'_>, how: Compression) -> Result<(), NoRecord> {
        let mut body = Before::new(stream, G::is_chunk);
        let read = match self.walk.allowance.open(how, &mut body) {
            Ok(reader) => records(&mut ByteStream::of_reader(reader), u64::MAX, self),
            Err(e) => Err(NoRecord::Io(e)),
        };
        let behind = io::copy(&mut body, &mut io::sink())?;
        let is_followed = body.is_there;
        if behind > 0 || is_followed {
            self.damage("a chunk has no length, and more follows it");
        }
        match read {
            Err(_) if is_followed => Ok(()),
            Err(NoRecord::Broken) => Err(NoRecord::Cut),
            read => read,
        }
    }

    /// Compares an index record with the messages found in the chunk before it.
    fn index(
        &mut self,
        stream: &mut ByteStream<'_>,
        (raw, count): (u32, u32),
        len: u64,
    ) -> Result<(), NoRecord> {
        let is_long = len > MOST_PAYLOAD as u64;
        let stamps = if is_long {
            Vec::new()
        } else {
            G::index_stamps(peek_whole(stream, len)?)
        };
        let Some((id, _)) = self.walk.announced.get(raw) else {
            let lost = self.walk.early.index(raw, count, &stamps);
            absent(self.sink, lost);
            return pass(stream, len);
        };
        if self.walk.found_messages.is_of_another(id, &stamps) {
            self.report_chunk();
        }
        let record = Behind { id, count, stamps };
        self.walk.found_messages.behind(record);
        pass(stream, len)
    }

    /// Reports the messages of the last chunk, once everything after it has been read.
    fn report_chunk(&mut self) {
        if std::mem::take(&mut self.walk.found_messages.misdated) {
            self.damage(OTHER_TIMES);
        }
        let (mended, surplus) = self.walk.found_messages.report_all(self.sink);
        self.walk.early.take_back(mended);
        absent(self.sink, mended);
        let text = "messages are in a chunk but not in its index";
        damaged(self.sink, surplus, text);
    }

    fn damage(&mut self, text: &str) {
        damaged(self.sink, 1, text);
    }

    /// Gives the messages of undescribed connections to connections that are named by their numbers.
    fn name_early(&mut self) {
        for (raw, run) in std::mem::take(&mut self.walk.early).runs {
            if !run.stamps.is_empty() {
                nameless(self.sink, run.stamps.len() as u64);
                let id = self.walk.announced.unnamed(raw, self.sink);
                self.described(id, &run);
            }
        }
    }

    /// Passes on the messages that came before the description of their connection.
    fn described(&mut self, id: Option<ConnectionId>, run: &EarlyRun) {
        self.walk.found_messages.messages += run.stamps.len() as u64;
        if let Some(id) = id {
            let is_sized = run.sizes.len() == run.stamps.len();
            let sizes = is_sized.then_some(&run.sizes[..]);
            self.sink.stamps(id, &run.stamps, sizes);
        }
    }
}

impl<G: Grammar> Visitor<G> for Forward<'_, G> {
    fn message(&mut self, stream: &mut ByteStream<'_>, head: MessageHead) -> Result<(), NoRecord> {
        let MessageHead { raw, time, size } = head;
        let (first, last) = self.walk.times.unwrap_or((time, time));
        self.walk.times = Some((first.min(time), last.max(time)));
        let Some((id, want)) = self.walk.announced.get(raw) else {
            pass(stream, u64::from(size))?;
            self.walk.early.hold(raw, time, size);
            if self.walk.early.held >= MOST_EARLY {
                self.name_early();
            }
            return Ok(());
        };
        hand_over(stream, (id, want), head, self.sink)?;
        let messages = &mut self.walk.found_messages;
        messages.add(id, time, size, self.sink);
        Ok(())
    }

    fn description(
        &mut self,
        stream: &mut ByteStream<'_>,
        what: &G::Description,
        len: u64,
    ) -> Result<(), NoRecord> {
        if len > MOST_PAYLOAD as u64 {
            // Too long to be one.
            return pass(stream, len);
        }
        let data = peek_whole(stream, len)?;
        let new = self.walk.announced.describe(what, data, self.sink);
        pass(stream, len)?;
        let Ok(new) = new else {
            self.damage("the description of a connection cannot be read");
            return Ok(());
        };
        let early = new.and_then(|(raw, id)| Some((id, self.walk.early.runs.remove(&raw)?)));
        if let Some((id, run)) = early {
            self.described(Some(id), &run);
        }
        Ok(())
    }
}

/// Whether the bytes taken have another checksum than stated.
fn is_other(stream: &mut ByteStream<'_>, crc: Option<u32>) -> bool {
    crc.zip(stream.sum())
        .is_some_and(|(stated, sum)| stated != sum)
}

impl Early {
    /// Drops as many messages of the last chunk that no index record has stated, since its index has them under other numbers.
    fn take_back(&mut self, mut many: u64) {
        for raw in self.last.drain(..).rev() {
            if let Some(run) = self.runs.get_mut(&raw).filter(|run| run.last > 0) {
                run.last -= 1;
                if many > 0 {
                    many -= 1;
                    run.stamps.pop();
                    run.sizes.pop();
                }
            }
        }
    }

    /// Takes an index record of the last chunk, which replaces the messages found in it if it has more; returns how many more.
    fn index(&mut self, raw: u32, count: u32, stamps: &[Stamp]) -> u64 {
        let count = count as usize;
        let mut none = EarlyRun::default();
        let run = self.runs.get_mut(&raw).unwrap_or(&mut none);
        let found = run.last.min(count);
        run.last -= found;
        if count > found && stamps.len() == count && self.held < MOST_EARLY {
            self.held += count;
            let run = self.runs.entry(raw).or_default();
            let before = run.stamps.len().saturating_sub(found);
            run.stamps.truncate(before);
            run.sizes.truncate(before);
            run.stamps.extend(stamps);
        }
        (count - found) as u64
    }

    fn hold(&mut self, raw: u32, time: Stamp, size: u32) {
        self.held += 1;
        self.last.push(raw);
        let run = self.runs.entry(raw).or_default();
        run.stamps.push(time);
        run.sizes.push(size);
        run.last += 1;
    }
}

// The messages found in a chunk, kept until the index that follows it has been read.

/// An index record after a chunk.
pub(super) struct Behind {
    pub(super) id: ConnectionId,
    pub(super) count: u32,
    /// The times of the messages; none if there are too many.
    pub(super) stamps: Vec<Stamp>,
}

/// The messages found since the last chunk began.
#[derive(Default)]
struct ChunkMessages {
    gather: Gather,
    /// The number of messages of the bag that have been or will be reported.
    messages: u64,
    /// Whether the chunk is damaged, so that its index is used instead.
    doubtful: bool,
    /// Whether another record followed the chunk: it may have been a chunk, and the index records after it may be its
    /// own.
    interrupted: bool,
    /// Index records that contradict the chunk.
    behind: Vec<Behind>,
    /// Whether one has the same messages at other times.
    misdated: bool,
    /// The number of messages in the index but not in the chunk; `surplus` is the converse.
    missing: u64,
    surplus: u64,
}

impl ChunkMessages {
    /// Adds one message.
    fn add(&mut self, id: ConnectionId, time: Stamp, size: u32, sink: &mut dyn Sink) {
        self.messages += 1;
        self.gather.add(id, time, size, sink);
    }

    /// Marks the chunk as damaged and keeps only plausible messages: times inside `times`, none twice.
    fn doubt(&mut self, times: Option<(Stamp, Stamp)>) {
        self.doubtful = true;
        if let Some((first, last)) = times {
            self.messages -= self.gather.retain(|at| first <= at && at <= last);
        }
    }

    /// Passes on what was found so far, unless the index may be needed instead.
    fn spill(&mut self, sink: &mut dyn Sink) {
        if !self.doubtful {
            self.gather.spill(sink);
        }
    }

    /// Whether an index record belongs to a chunk that was not seen, not to the last one.
    fn is_of_another(&self, id: ConnectionId, stamps: &[Stamp]) -> bool {
        self.interrupted && !self.gather.holds(id, stamps)
    }

    /// Adds an index record.
    fn behind(&mut self, record: Behind) {
        let (found, count) = (self.gather.count(record.id), u64::from(record.count));
        self.missing += count.saturating_sub(found);
        self.surplus += found.saturating_sub(count);
        let is_whole = record.stamps.len() as u64 == count;
        let is_needed = self.interrupted || self.doubtful && found != count || found < count;
        if !is_needed && is_whole && found == count {
            self.misdated |= !self.gather.holds(record.id, &record.stamps);
        } else if is_needed && is_whole {
            self.behind.push(record);
        }
    }

    /// Reports all messages to `sink`; returns how many were only in the index, and how many only in the chunk. If the
    /// two disagree, the index is used if the chunk is damaged or lacks more messages than it has in excess.
    fn report_all(&mut self, sink: &mut dyn Sink) -> (u64, u64) {
        let believed = self.doubtful || self.missing > self.surplus;
        let mut witnessed = 0;
        for record in self.behind.drain(..).filter(|_| believed) {
            // Messages that were already passed on cannot be taken back.
            let Some(found) = self.gather.take(record.id) else {
                continue;
            };
            let known = record.stamps.len() as u64;
            witnessed += known.saturating_sub(found);
            self.messages = self.messages - found + known;
            if known > 0 {
                sink.stamps(record.id, &record.stamps, None);
            }
        }
        self.gather.flush(sink);
        let surplus = std::mem::take(&mut self.surplus);
        self.missing = 0;
        (self.doubtful, self.interrupted) = (false, false);
        (witnessed, surplus)
    }
}

// A chunked bag that is still being written: each record once, as soon as it is complete.

/// The position up to which a growing bag has been read, and the state of the walk there.
struct GrowingChunks<G> {
    path: PathBuf,
    /// The first byte that has not been reported.
    at: u64,
    /// The size of the bag when it was last read.
    len: u64,
    /// Whether the bag had its end at that time.
    is_closed: bool,
    walk: Walk<G>,
    /// The last bytes before `at` that a recorder never changes.
    behind: Vec<u8>,
}

/// The number of bytes by which it is noticed that a bag was replaced.
const BEHIND: u64 = 64;

/// Follows a bag of this grammar.
pub(crate) fn follow<G: Grammar>(path: &Path) -> Result<Box<dyn Growing>> {
    let mut place = BagPlace::File(FileSource::open(path)?);
    G::accept(path, &head(&mut place, HEAD)?)?;
    Ok(Box::new(GrowingChunks::<G> {
        path: path.to_owned(),
        at: 0,
        len: 0,
        is_closed: false,
        walk: Walk::default(),
        behind: Vec::new(),
    }))
}

impl<G: Grammar> Growing for GrowingChunks<G> {
    fn poll(&mut self, sink: &mut dyn Sink) -> Result<Growth> {
        if let Some(closed) = closed(&self.path) {
            self.path = closed;
        }
        let source = FileSource::open(&self.path)?;
        let len = source.len();
        let fail = || Error::io("read", &self.path);
        let behind = self.last_bytes(&source).map_err(fail())?;
        if len < self.len || behind != self.behind {
            let text = if len < self.len {
                format!("the bag was shortened to {len} bytes while it was followed")
            } else {
                "the bag was rewritten while it was followed".to_owned()
            };
            sink.notice(Notice::new(NoticeKind::Truncated, text));
            return Ok(Growth::Ended);
        }
        if len == self.len {
            return Ok(if self.is_closed {
                Growth::Ended
            } else {
                Growth::Same
            });
        }
        let plan = G::plan(&source).map_err(fail())?;
        self.is_closed = plan.is_ok() || G::stated_sum(&source).is_some();
        self.len = len;
        let mut stream = ByteStream::of_file(&source, self.at, len, FAR);
        if self.at == 0 {
            G::begin(&mut stream);
        }
        let (stop, at) = self.walk.go(&mut stream, 0, !self.is_closed, sink);
        self.at = at;
        if self.is_closed {
            std::mem::take(&mut self.walk).finish(&stop, at, sink);
        }
        self.behind = self.last_bytes(&source).map_err(fail())?;
        Ok(Growth::More)
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

impl<G: Grammar> GrowingChunks<G> {
    /// The bytes before byte `at`, as far as the head of a chunk.
    fn last_bytes(&self, source: &FileSource) -> std::io::Result<Vec<u8>> {
        let len = self.at.saturating_sub(self.walk.body).min(BEHIND);
        let mut bytes = vec![0; usize::try_from(len).unwrap_or(0)];
        let got = source.read_at(self.at - len, &mut bytes)?;
        bytes.truncate(got);
        Ok(bytes)
    }
}
