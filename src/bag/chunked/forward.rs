//! A chunked bag record by record from the front: without an index, cut, still open, or from a pipe.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use super::Grammar;
use super::check::{Behind, ChunkMessages};
use super::index::{OTHER_TIMES, absent, hand_over, nameless, spans};
use super::plan::MOST_CHUNKS;
use super::record::{
    Announced, ChunkHead, Counts, MessageHead, NoRecord, RecordHead, pass, peek_whole, walk,
};
use super::search::{Before, next_chunk, next_record};
use super::unpack::{Visitor, records, unpack};
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::model::{ConnectionId, MOST_PAYLOAD, Sink, damaged};
use crate::bag::source::ByteStream;
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
            let step = G::next(stream).and_then(|record| match record {
                RecordHead::Chunk(head) if is_growing && head.unclosed => {
                    let body = stream.position();
                    let is_followed = next_chunk::<G>(stream, from);
                    stream.back(body);
                    let chunk = is_followed.then(|| forward.chunk(stream, from, &head));
                    chunk.unwrap_or(Err(NoRecord::Cut))
                }
                record if is_growing && stream.left().is_some_and(|left| left < record.len()) => {
                    Err(NoRecord::Cut)
                }
                record => forward.record(stream, from, record),
            });
            at = if is_growing { at } else { stream.position() };
            let is_found = match step {
                // Of a record that grows, only what follows it is whole.
                Err(NoRecord::Cut) if is_growing => next_chunk::<G>(stream, from),
                Err(NoRecord::Broken | NoRecord::Cut) => next_record::<G>(stream, from, u64::MAX),
                _ => false,
            };
            if is_found {
                forward.skipped(stream, from);
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
        record: RecordHead<G::Description>,
    ) -> Result<(), NoRecord> {
        self.walk.records += 1;
        let is_content = matches!(record, RecordHead::Chunk(_) | RecordHead::Message(_));
        if self.walk.ended && is_content {
            self.walk.ended = false;
            self.damage("messages follow the end of the data");
        }
        if record.is_of_the_end() && G::HAS_END && !self.walk.ended {
            self.damage("records that belong to the bag's end are among its messages");
        }
        match record {
            RecordHead::Chunk(head) => self.chunk(stream, from, &head),
            RecordHead::Message(head) => {
                if self.walk.is_chunked && !G::IS_LOOSE {
                    self.damage("messages are outside of chunks");
                }
                self.walk.compression.insert(Compression::None);
                self.message(stream, head)
            }
            RecordHead::Description { what, len } => self.description(stream, &what, len),
            RecordHead::Index { raw, count, len } => self.index(stream, (raw, count), len),
            RecordHead::Total { stated, len } => {
                self.walk.account.stated = stated;
                pass(stream, len)
            }
            RecordHead::Listed { at, times, len } => {
                self.report_chunk();
                self.walk.account.list(at, times);
                pass(stream, len)
            }
            RecordHead::DataEnd { len, crc } => {
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
            RecordHead::FileEnd { len, crc } => self.file_end(stream, len, crc),
            RecordHead::Unknown { len, extension } => {
                self.walk.found_messages.interrupt();
                let text = "records of a kind that the format does not define were skipped";
                if extension {
                    self.sink.notice(Notice::new(NoticeKind::Note, text));
                } else {
                    self.damage(text);
                }
                pass(stream, len)
            }
            RecordHead::Other { len } | RecordHead::Tail { len } => {
                self.walk.found_messages.interrupt();
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

    /// Reports the bytes from `from` on, which are not records.
    fn skipped(&mut self, stream: &ByteStream<'_>, from: u64) {
        let lost = stream.position() - from;
        self.damage(&format!(
            "skipped {lost} bytes at byte {from} that are not records"
        ));
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
        if self.walk.found_messages.is_misdated() {
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
        let new = self.walk.announced.read(stream, (what, len), self.sink)?;
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
