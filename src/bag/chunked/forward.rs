//! A chunked bag record by record from the front: without an index, cut, still open, or from a pipe.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::Grammar;
use super::check::{Behind, ChunkMessages};
use super::index::{hand_over, nameless};
use super::record::{Announced, ChunkHead, NoRecord, RecordHead, pass, peek_whole, walk};
use super::unpack::{Visitor, records, unpack};
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::model::Sink;
use crate::bag::source::ByteStream;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;

/// The number of bytes searched at a time for the next record.
const STRIDE: usize = 64 * 1024;

/// The result of reading from the front.
#[derive(Debug, Default)]
pub(super) struct ForwardScan {
    pub(super) compression: BTreeSet<Compression>,
    /// Whether the bag is not cut and nothing was skipped.
    pub(super) complete: bool,
}

/// Messages that came before the description of their connection.
#[derive(Default)]
struct Early {
    runs: BTreeMap<u32, (Vec<Stamp>, Vec<u32>)>,
    held: usize,
    dropped: u64,
}

/// The most early messages that are kept: 3 MB.
const MOST_EARLY: usize = 1 << 18;

/// A walk through the records of a bag.
struct Forward<'s, G> {
    sink: &'s mut dyn Sink,
    announced: Announced<G>,
    found_messages: ChunkMessages,
    early: Early,
    found: ForwardScan,
    allowance: Arc<Allowance>,
    /// The number of messages that the bag states.
    total: Option<u64>,
    /// Whether the end of the data was reached.
    ended: bool,
    /// Whether messages are stored in chunks: a closed chunk was found.
    is_chunked: bool,
}

/// Reads all of `stream` from the first record on; `size` is the length of the bag, 0 if unknown.
pub(super) fn read<G: Grammar>(
    stream: &mut ByteStream<'_>,
    size: u64,
    sink: &mut dyn Sink,
) -> ForwardScan {
    let mut forward: Forward<'_, G> = Forward {
        sink,
        announced: Announced::default(),
        found_messages: ChunkMessages::default(),
        early: Early::default(),
        found: ForwardScan {
            complete: true,
            ..ForwardScan::default()
        },
        allowance: Arc::default(),
        total: None,
        ended: false,
        is_chunked: false,
    };
    let mut at = stream.position();
    let stop = walk(stream, u64::MAX, |stream| {
        let from = stream.position();
        let step = G::next(stream).and_then(|record| forward.record(stream, record));
        at = stream.position();
        match step {
            Err(NoRecord::Broken | NoRecord::Cut) if forward.resume(stream, from) => {}
            step => step?,
        }
        forward.sink.progress(at, size);
        Ok(())
    });
    forward.finish(stop, at)
}

impl<G: Grammar> Forward<'_, G> {
    fn record(
        &mut self,
        stream: &mut ByteStream<'_>,
        record: RecordHead<G::Description>,
    ) -> Result<(), NoRecord> {
        if self.ended && matches!(record, RecordHead::Chunk(_) | RecordHead::Message { .. }) {
            self.ended = false;
            self.damage("messages follow the end of the data");
        }
        if let RecordHead::Tail { .. } | RecordHead::Total { .. } = record
            && !self.ended
        {
            self.damage("records that belong to the bag's end are among its messages");
        }
        match record {
            RecordHead::Chunk(head) => self.chunk(stream, &head),
            RecordHead::Message { raw, time, size } => {
                if self.is_chunked && !G::IS_LOOSE {
                    self.damage("messages are outside of chunks");
                }
                self.found.compression.insert(Compression::None);
                self.message(stream, (raw, time, size))
            }
            RecordHead::Description { what, len } => self.description(stream, &what, len),
            RecordHead::Index { raw, count, len } => self.index(stream, (raw, count), len),
            RecordHead::Total { messages, len } => {
                self.total = Some(messages);
                pass(stream, len)
            }
            RecordHead::DataEnd { len, crc } => {
                self.ended = true;
                if crc.is_some_and(|crc| stream.sum().is_some_and(|sum| sum != crc)) {
                    self.damage("the checksum of its data is wrong");
                }
                pass(stream, len)
            }
            RecordHead::FileEnd { len } => self.file_end(stream, len),
            RecordHead::Unknown { len, extension } => {
                self.found_messages.interrupt();
                let text = "records of a kind that the format does not define were skipped";
                if extension {
                    self.sink.notice(Notice::new(NoticeKind::Note, text));
                } else {
                    self.damage(text);
                }
                pass(stream, len)
            }
            RecordHead::Other { len } | RecordHead::Tail { len } => {
                self.found_messages.interrupt();
                pass(stream, len)
            }
        }
    }

    /// Ends the walk if the bag ends here properly.
    fn file_end(&mut self, stream: &mut ByteStream<'_>, len: u64) -> Result<(), NoRecord> {
        self.ended = true;
        pass(stream, len)?;
        if stream.peek(G::CLOSING.len() + 1)? == G::CLOSING {
            return Err(NoRecord::End);
        }
        let at = stream.position();
        self.damage(&format!(
            "unexpected data at byte {at} instead of the end of the bag"
        ));
        Ok(())
    }

    /// Skips bytes that are not a record, after byte `from` up to the next chunk; returns whether there is one.
    fn resume(&mut self, stream: &mut ByteStream<'_>, from: u64) -> bool {
        let found = next_chunk::<G>(stream, from);
        if found {
            let lost = stream.position() - from;
            self.damage(&format!(
                "skipped {lost} bytes at byte {from} that are not records"
            ));
        }
        found
    }

    fn chunk(&mut self, stream: &mut ByteStream<'_>, head: &ChunkHead) -> Result<(), NoRecord> {
        self.report_chunk();
        self.is_chunked = head.packed > 0;
        self.found.compression.extend(head.how);
        if head.misnamed {
            self.damage("a chunk is marked as another kind of record; it was read anyway");
        }
        if head.unclosed {
            return Err(self.tail(stream, head.how.unwrap_or(Compression::None)));
        }
        let allowance = Arc::clone(&self.allowance);
        let wrong = unpack(stream, head, &allowance, self)?;
        if let Some(why) = wrong {
            self.found_messages.doubt(head.times);
            self.damage(&format!("a chunk is damaged inside: {why}"));
        }
        Ok(())
    }

    /// Reads the rest of the file as one compressed chunk that was never closed.
    fn tail(&mut self, stream: &mut ByteStream<'_>, how: Compression) -> NoRecord {
        let mut plain = match self.allowance.open(how, &mut *stream) {
            Ok(reader) => ByteStream::of_reader(reader),
            Err(e) => return NoRecord::Io(e),
        };
        match records(&mut plain, u64::MAX, self) {
            Ok(()) => NoRecord::End,
            Err(NoRecord::Broken) => NoRecord::Cut,
            Err(stop) => stop,
        }
    }

    /// Compares an index record with the messages found in the chunk before it.
    fn index(
        &mut self,
        stream: &mut ByteStream<'_>,
        (raw, count): (u32, u32),
        len: u64,
    ) -> Result<(), NoRecord> {
        let Some((id, _)) = self.announced.get(raw) else {
            return pass(stream, len);
        };
        let stamps = if self.found_messages.wants_stamps(id, count) {
            let bytes = peek_whole(stream, len)?;
            G::index_stamps(bytes)
        } else {
            Vec::new()
        };
        if self.found_messages.is_of_another(id, &stamps) {
            self.report_chunk();
        }
        self.found_messages.behind(Behind { id, count, stamps });
        pass(stream, len)
    }

    /// Reports the messages of the last chunk, once everything after it has been read.
    fn report_chunk(&mut self) {
        let (mended, surplus) = self.found_messages.report_all(self.sink);
        if mended > 0 {
            self.found.complete = false;
            super::index::absent(self.sink, mended);
        }
        if surplus > 0 {
            self.found.complete = false;
            let text = "messages are in a chunk but not in its index";
            self.sink
                .notice(Notice::counted(NoticeKind::Damaged, surplus, text));
        }
    }

    fn damage(&mut self, text: &str) {
        self.found.complete = false;
        self.sink.notice(Notice::new(NoticeKind::Damaged, text));
    }

    fn finish(mut self, stop: NoRecord, at: u64) -> ForwardScan {
        self.report_chunk();
        let early = self.early.runs.values();
        let homeless =
            early.map(|(stamps, _)| stamps.len() as u64).sum::<u64>() + self.early.dropped;
        if homeless > 0 {
            self.found.complete = false;
            nameless(self.sink, homeless);
        }
        let found = self.found_messages.messages + homeless;
        if let Some(total) = self.total.filter(|total| *total > found) {
            self.damage(&format!(
                "the bag should contain {total} messages; found {found}"
            ));
        }
        let (kind, text) = match stop {
            NoRecord::End if self.ended || !G::HAS_END => return self.found,
            // Only the index is cut, which is not needed.
            NoRecord::End | NoRecord::Cut | NoRecord::Broken if self.ended => return self.found,
            NoRecord::End => (
                NoticeKind::Truncated,
                format!("the bag was never finished; it ends at byte {at}"),
            ),
            NoRecord::Cut => (
                NoticeKind::Truncated,
                format!("the bag is cut at byte {at}"),
            ),
            NoRecord::Broken => (NoticeKind::Damaged, format!("no record at byte {at}")),
            NoRecord::Io(e) => (
                NoticeKind::Damaged,
                format!("reading stopped at byte {at}: {e}"),
            ),
        };
        self.found.complete = false;
        self.sink.notice(Notice::new(kind, text));
        self.found
    }
}

impl<G: Grammar> Visitor<G> for Forward<'_, G> {
    fn message(
        &mut self,
        stream: &mut ByteStream<'_>,
        (raw, time, size): (u32, Stamp, u32),
    ) -> Result<(), NoRecord> {
        let Some((id, want)) = self.announced.get(raw) else {
            pass(stream, u64::from(size))?;
            self.early.hold(raw, time, size);
            return Ok(());
        };
        hand_over(stream, (id, time, size), want, self.sink)?;
        self.found_messages.add(id, time, size, self.sink);
        Ok(())
    }

    fn description(
        &mut self,
        stream: &mut ByteStream<'_>,
        what: &G::Description,
        len: u64,
    ) -> Result<(), NoRecord> {
        let new = self.announced.read(stream, (what, len), self.sink)?;
        match new {
            Err(_) => self.damage("the description of a connection cannot be read"),
            Ok(Some((raw, id))) => {
                if let Some((stamps, sizes)) = self.early.runs.remove(&raw) {
                    self.found_messages.messages += stamps.len() as u64;
                    self.sink.stamps(id, &stamps, Some(&sizes));
                }
            }
            Ok(None) => {}
        }
        Ok(())
    }
}

/// Goes to the beginning of the next chunk after byte `from`; false if there is none before the end of the stream.
pub(super) fn next_chunk<G: Grammar>(stream: &mut ByteStream<'_>, from: u64) -> bool {
    if stream.position() <= from && !matches!(stream.skip(1), Ok(1)) {
        return false;
    }
    while let Ok(window) = stream.peek(2 * STRIDE) {
        let len = window.len();
        let mut starts = 0..len.min(STRIDE);
        if let Some(at) = starts.find(|at| G::is_chunk(&window[*at..])) {
            stream.advance(at);
            return true;
        }
        if len <= STRIDE {
            break;
        }
        stream.advance(STRIDE);
    }
    false
}

impl Early {
    fn hold(&mut self, raw: u32, time: Stamp, size: u32) {
        if self.held >= MOST_EARLY {
            self.dropped += 1;
            return;
        }
        self.held += 1;
        let run = self.runs.entry(raw).or_default();
        run.0.push(time);
        run.1.push(size);
    }
}
