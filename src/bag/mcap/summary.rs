//! The summary at the end of an MCAP file: its channels and chunks, and whether they are reliable.

use std::io;

use mcap::MAGIC;
use mcap::records::{Record as Parsed, Statistics, op};

use super::records::{self, FOOTER, FieldCursor, HEAD};
use super::{Described, Mcap};
use crate::bag::chunked::{
    Chunk, ChunkPlan, Grammar as _, IndexSum, MOST_CHUNKS, NoRecord, RecordHead, Unindexed, Used,
    pass,
};
use crate::bag::model::MOST_PAYLOAD;
use crate::bag::source::{ByteStream, FAR, FileSource, NEAR};
use crate::base::time::Stamp;

/// The most channels: as many as there are ids.
const MOST_CHANNELS: usize = 1 << 16;

/// Reads the summary at the end of `source`.
pub(super) fn read(source: &FileSource) -> io::Result<Result<ChunkPlan, Unindexed>> {
    let start = match footer(source)? {
        Ok(start) => start,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut summary = Summary::default();
    summary.plan.body = MAGIC.len() as u64..start;
    match summary.records(source) {
        Ok(()) => {}
        Err(NoRecord::Io(e)) => return Err(e),
        Err(_) => return Ok(Unindexed::because("its summary is damaged")),
    }
    Ok(summary.settle(source))
}

/// The number of bytes of a footer record and of the closing bytes of the file.
const END: usize = 9 + 20 + 8;

/// The place where the summary begins.
fn footer(source: &FileSource) -> io::Result<Result<u64, Unindexed>> {
    let mut bytes = [0; END];
    let Some(at) = source.len().checked_sub(bytes.len() as u64) else {
        return Ok(Unindexed::because("it is cut"));
    };
    let got = source.read_at(at, &mut bytes)?;
    let mut cursor = FieldCursor(&bytes[..got]);
    let head = (cursor.u8(), cursor.u64());
    if !bytes[..got].ends_with(MAGIC) || head != (Some(op::FOOTER), Some(FOOTER)) {
        return Ok(Unindexed::because("its end is missing"));
    }
    let Ok(Parsed::Footer(footer)) = mcap::parse_record(op::FOOTER, cursor.0) else {
        return Ok(Unindexed::because("its end is missing"));
    };
    Ok(match footer.summary_start {
        0 => Unindexed::because("it has no summary"),
        n if n < MAGIC.len() as u64 || n > at => {
            Unindexed::because("its summary lies outside the file")
        }
        n => Ok(n),
    })
}

/// The part of a summary that has been read.
#[derive(Default)]
struct Summary {
    plan: ChunkPlan,
    grammar: Mcap,
    used: Used,
    statistics: Option<Statistics>,
    /// Whether a chunk holds records and has no message index.
    blind: bool,
}

impl Summary {
    fn records(&mut self, source: &FileSource) -> Result<(), NoRecord> {
        let mut stream = ByteStream::of_file(source, self.plan.body.end, source.len(), FAR);
        let mut channels: Vec<Vec<u8>> = Vec::new();
        loop {
            let (kind, len) = match records::head(&mut stream) {
                Ok((op::FOOTER, _)) | Err(NoRecord::End) => break,
                head => head?,
            };
            if len > MOST_PAYLOAD as u64 {
                return Err(NoRecord::Broken);
            }
            let wanted = usize::try_from(len).unwrap_or(usize::MAX);
            let record = stream.peek(wanted)?;
            if record.len() < wanted {
                return Err(NoRecord::Cut);
            }
            match kind {
                op::SCHEMA => drop(records::schema(&mut self.grammar, record)),
                // A channel may stand before its schema.
                op::CHANNEL if channels.len() < MOST_CHANNELS => channels.push(record.to_vec()),
                op::STATISTICS => self.statistics = statistics(record),
                op::CHUNK_INDEX => {
                    let index = chunk_index(record, &mut self.used).ok_or(NoRecord::Broken)?;
                    self.chunk(index)?;
                }
                _ => {}
            }
            pass(&mut stream, len)?;
        }
        for channel in &channels {
            let connections = &mut self.plan.connections;
            let described = self
                .grammar
                .describe(&Described::Channel, channel, connections);
            if let Some((raw, connection)) = described {
                connections.add(raw, connection);
            }
        }
        Ok(())
    }

    fn chunk(&mut self, index: ChunkIndex) -> Result<(), NoRecord> {
        let ChunkIndex {
            chunk,
            counts,
            size,
        } = index;
        self.blind |= chunk.promised.is_none() && size > 0;
        if self.plan.chunks.len() >= MOST_CHUNKS {
            return Err(NoRecord::Broken);
        }
        let counts = self.plan.keep(&counts);
        self.plan.chunks.push(Chunk { counts, ..chunk });
        Ok(())
    }

    /// Orders the chunks and decides whether they hold all messages.
    fn settle(mut self, source: &FileSource) -> Result<ChunkPlan, Unindexed> {
        let chunks = &mut self.plan.chunks;
        chunks.sort_by_key(|c| c.start);
        chunks.dedup_by_key(|c| c.start);
        let known: u64 = chunks
            .iter()
            .filter_map(|c| Some(c.promised?.messages))
            .sum();
        match &self.statistics {
            Some(all) if all.chunk_count as usize != chunks.len() => {
                return Unindexed::because("its index does not name all of its chunks");
            }
            Some(all) if all.message_count == known => {}
            Some(all) if all.chunk_count == 0 => {
                return Unindexed::because("its messages lie outside chunks");
            }
            _ if self.blind => return Unindexed::because("its chunks have no message index"),
            Some(_) => return Unindexed::because("its index and its statistics disagree"),
            None if chunks.is_empty() => {
                return Unindexed::because("its summary names no chunks");
            }
            None => {}
        }
        self.used.are_in(&self.plan.connections)?;
        gaps(source, &self.plan)?;
        Ok(self.plan)
    }
}

/// Checks between the chunks, where other records may stand, that there are no messages that the summary does not know
/// of.
fn gaps(source: &FileSource, plan: &ChunkPlan) -> Result<(), Unindexed> {
    let mut free = plan.body.start;
    let ends = plan.chunks.iter().map(|c| (c.start, c.end));
    for (start, end) in ends.chain([(plan.body.end, plan.body.end)]) {
        if start < free || end > plan.body.end {
            return Unindexed::because("its index names chunks where none can be");
        }
        let mut stream = ByteStream::of_file(source, free, start, NEAR);
        while stream.position() < start {
            match Mcap::next(&mut stream) {
                Ok(RecordHead::Chunk(_) | RecordHead::Message { .. }) => {
                    return Unindexed::because("its summary does not name all of its messages");
                }
                Ok(
                    RecordHead::Description { len, .. }
                    | RecordHead::Index { len, .. }
                    | RecordHead::Total { len, .. }
                    | RecordHead::DataEnd { len }
                    | RecordHead::FileEnd { len }
                    | RecordHead::Other { len },
                ) if pass(&mut stream, len).is_ok() => {}
                // Bytes that are not a record hide no message that could be read.
                _ => break,
            }
        }
        free = end;
    }
    Ok(())
}

/// The counts in a statistics record.
fn statistics(record: &[u8]) -> Option<Statistics> {
    match mcap::parse_record(op::STATISTICS, record) {
        Ok(Parsed::Statistics(statistics)) => Some(statistics),
        _ => None,
    }
}

/// A chunk index record.
struct ChunkIndex {
    chunk: Chunk,
    /// Message counts by channel.
    counts: Vec<(u32, u32)>,
    /// The length of the chunk's records.
    size: u64,
}

fn chunk_index(record: &[u8], used: &mut Used) -> Option<ChunkIndex> {
    let mut cursor = FieldCursor(record);
    let (first, last) = (cursor.u64()?, cursor.u64()?);
    let (start, len) = (cursor.u64()?, cursor.u64()?);
    let offsets = cursor.bytes()?;
    let index_len = cursor.u64()?;
    let _compression = cursor.bytes()?;
    let (_compressed, size) = (cursor.u64()?, cursor.u64()?);
    let behind = start.checked_add(len)?;
    let end = behind.checked_add(index_len)?;
    if len < HEAD {
        return None;
    }
    let counts = counts(offsets, behind, end);
    let promised = counts.as_ref().map(|counts| promised(counts, used));
    let chunk = Chunk {
        start,
        index: behind..end,
        end,
        first: Stamp::from_nanos(first),
        last: Stamp::from_nanos(last),
        promised,
        counts: 0..0,
    };
    Some(ChunkIndex {
        chunk,
        counts: counts.unwrap_or_default(),
        size,
    })
}

/// The message counts, computed from the places where the message indexes of a chunk's channels begin: they stand one
/// behind the other, 15 bytes and 16 for each message. `None` if they do not stand so, or if there are none.
fn counts(offsets: &[u8], start: u64, end: u64) -> Option<Vec<(u32, u32)>> {
    let mut places = Vec::with_capacity(offsets.len() / 10);
    let mut cursor = FieldCursor(offsets);
    while let (Some(channel), Some(at)) = (cursor.u16(), cursor.u64()) {
        places.push((at, channel));
    }
    places.sort_unstable();
    if places.first()?.0 != start {
        return None;
    }
    let ends = places.iter().skip(1).map(|p| p.0).chain([end]);
    let count = |((at, channel), end): (&(u64, u16), u64)| {
        let entries = end.checked_sub(*at)?.checked_sub(15)?;
        let count = u32::try_from(entries / 16).ok()?;
        (entries % 16 == 0).then_some((u32::from(*channel), count))
    };
    places.iter().zip(ends).map(count).collect()
}

/// The expected sum of the index.
fn promised(counts: &[(u32, u32)], used: &mut Used) -> IndexSum {
    let mut sum = IndexSum::default();
    for (channel, count) in counts {
        sum.add(*channel, *count);
        if *count > 0 {
            used.add(*channel);
        }
    }
    sum
}
