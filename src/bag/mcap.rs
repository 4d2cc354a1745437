//! The grammar of MCAP files, and their summary.
//!
//! The format: <https://mcap.dev/spec>.

mod records;
mod verify;

use std::collections::HashMap;
use std::io;
use std::ops::Range;
use std::path::Path;

use mcap::MAGIC;
use mcap::records::op;
use records::{DATA_END, ENTRY, FOOTER, FieldCursor, HEAD, SchemaRecord};

use crate::bag::chunked::{
    self, Chunk, ChunkPlan, Connections, Counts, Grammar, Index, IndexSum, NoRecord, RecordHead,
    RecordKind, SecondReading, Tail, Unindexed, pass, peek_whole, walk,
};
use crate::bag::input::FormatRow;
use crate::bag::model::{Connection, MOST_PAYLOAD, Sink};
use crate::bag::source::{ByteStream, FAR, FileSource, NEAR};
use crate::base::error::Result;
use crate::base::time::Stamp;

/// MCAP files.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "mcap",
    what: "MCAP file (ROS 1 or ROS 2)",
    extensions: &["mcap"],
    needs_file: false,
    sniff: |_, head| head.starts_with(MAGIC),
    is_inside: |bytes| bytes.ends_with(MAGIC) || chunked::has_chunk::<Mcap>(bytes),
    open: chunked::open::<Mcap>,
    follow: Some(chunked::follow::<Mcap>),
};

/// The schemas seen, which channels refer to.
#[derive(Default)]
struct Mcap {
    schemas: HashMap<u16, SchemaRecord>,
    held: usize,
}

/// The two kinds of records that describe a connection.
#[derive(Clone, Copy)]
enum Described {
    Schema,
    Channel,
}

impl Grammar for Mcap {
    const NAME: &'static str = FORMAT.name;
    const HAS_END: bool = true;
    const IS_LOOSE: bool = true;
    const OPENING: &'static [u8] = MAGIC;
    const CLOSING: &'static [u8] = MAGIC;
    type Description = Described;

    /// The facts in the file's header.
    fn accept(_path: &Path, head: &[u8]) -> Result<Vec<(String, String)>> {
        Ok(facts(head).unwrap_or_default())
    }

    fn begin(stream: &mut ByteStream<'_>) {
        if stream.peek(MAGIC.len()).is_ok() {
            stream.advance(MAGIC.len());
        }
    }

    fn next(stream: &mut ByteStream<'_>) -> Result<RecordHead<Described>, NoRecord> {
        records::next(stream)
    }

    fn describe(
        &mut self,
        what: &Described,
        data: &[u8],
        known: &Connections,
    ) -> Result<Option<(u32, Connection)>, NoRecord> {
        match what {
            Described::Schema => records::schema(self, data)
                .ok_or(NoRecord::Broken)
                .map(|()| None),
            Described::Channel => records::channel(self, data, known),
        }
    }

    fn is_chunk(bytes: &[u8]) -> bool {
        records::is_chunk(bytes)
    }

    fn is_content(bytes: &[u8]) -> bool {
        records::is_content(bytes)
    }

    fn index(bytes: &[u8], promised: &IndexSum) -> Option<Index> {
        let mut found = IndexSum::default();
        let mut index = Index::default();
        let mut rest = FieldCursor(bytes);
        // The crate reads these into vectors of pairs, which takes several times as long.
        while let Some(kind) = rest.u8() {
            let len = usize::try_from(rest.u64()?).ok()?;
            let (record, after) = rest.0.split_at_checked(len)?;
            rest = FieldCursor(after);
            if kind != op::MESSAGE_INDEX {
                return None;
            }
            let mut cursor = FieldCursor(record);
            let channel = u32::from(cursor.u16()?);
            let entries = cursor.bytes()?.chunks_exact(records::ENTRY);
            found.add(channel, u32::try_from(entries.len()).ok()?);
            index.add(channel, entries.filter_map(entry));
        }
        (found == *promised).then_some(index)
    }

    fn index_stamps(data: &[u8]) -> Vec<Stamp> {
        let mut cursor = FieldCursor(data);
        let entries = cursor.u16().and_then(|_| cursor.bytes());
        let entries = entries.unwrap_or_default().chunks_exact(records::ENTRY);
        entries.filter_map(|e| Some(entry(e)?.0)).collect()
    }

    /// Reads the summary at the end of `source`.
    fn plan(source: &FileSource) -> io::Result<Result<ChunkPlan, Unindexed>> {
        let (start, crc) = match footer(source)? {
            Ok(found) => found,
            Err(reason) => return Ok(Err(reason)),
        };
        let mut summary = Summary::default();
        summary.tail.plan.body = MAGIC.len() as u64..start;
        let end = source.len() - CRC_AND_CLOSING;
        let mut stream = ByteStream::of_file(source, start, end, FAR);
        stream.sum_up();
        match summary.records(&mut stream) {
            Ok(()) => {}
            Err(NoRecord::Io(e)) => return Err(e),
            Err(_) => return Ok(Unindexed::wrong("its summary is damaged")),
        }
        if crc != 0 && stream.sum() != Some(crc) {
            return Ok(Unindexed::wrong("the checksum of its summary is wrong"));
        }
        Ok(summary.into_plan(source))
    }

    fn stated_sum(source: &FileSource) -> Option<u32> {
        data_crc(source).ok().flatten()
    }

    /// The crate reads from the front, with or without a summary.
    fn verify(
        source: &FileSource,
        _plan: &Result<ChunkPlan, Unindexed>,
        sink: &mut dyn Sink,
    ) -> SecondReading {
        SecondReading {
            stopped: verify::read(source, sink).err(),
            ..SecondReading::default()
        }
    }
}

/// The facts in the file's header, if its first bytes contain it.
fn facts(head: &[u8]) -> Option<Vec<(String, String)>> {
    let mut cursor = FieldCursor(head.get(MAGIC.len()..)?);
    let kind = cursor.u8().filter(|kind| *kind == op::HEADER);
    let len = usize::try_from(kind.and(cursor.u64())?).ok()?;
    let mut cursor = FieldCursor(cursor.0.get(..len)?);
    let known = [("profile", cursor.text()?), ("library", cursor.text()?)];
    let known = known.into_iter().filter(|(_, value)| !value.is_empty());
    let facts = known.map(|(name, value)| (name.to_owned(), value));
    Some(facts.collect())
}

/// The time and the offset in an entry of a message index.
fn entry(bytes: &[u8]) -> Option<(Stamp, u64)> {
    let mut cursor = FieldCursor(bytes);
    Some((Stamp::from_nanos(cursor.u64()?), cursor.u64()?))
}

// The summary at the end of an MCAP file: its channels and chunks, and whether they are reliable.

/// The most channels: as many as there are ids.
const MOST_CHANNELS: usize = 1 << 16;

/// The number of bytes of a footer record and of the closing bytes of the file.
const END: usize = 9 + 20 + 8;

/// The number of bytes from the checksum of the summary to the end of the file, which the checksum does not cover.
const CRC_AND_CLOSING: u64 = 4 + 8;

/// The position of the summary and its checksum, 0 for none.
fn footer(source: &FileSource) -> io::Result<Result<(u64, u32), Unindexed>> {
    let mut bytes = [0; END];
    let Some(at) = source.len().checked_sub(bytes.len() as u64) else {
        return Ok(Unindexed::wrong("it is cut"));
    };
    let got = source.read_at(at, &mut bytes)?;
    let mut cursor = FieldCursor(&bytes[..got]);
    let head = (cursor.u8(), cursor.u64());
    let fields = (cursor.u64(), cursor.u64(), cursor.u32());
    let is_footer = head == (Some(op::FOOTER), Some(FOOTER)) && bytes[..got].ends_with(MAGIC);
    let (true, (Some(start), Some(_), Some(crc))) = (is_footer, fields) else {
        return Ok(Unindexed::wrong("its end is missing"));
    };
    Ok(match start {
        0 => Unindexed::missing("it has no summary"),
        n if n < MAGIC.len() as u64 || n > at => {
            Unindexed::wrong("its summary lies outside the file")
        }
        n => Ok((n, crc)),
    })
}

/// The number of bytes of the record that ends the data.
const DATA_END_RECORD: usize = 9 + 4;

/// The CRC-32 of all data as stated by the record before the summary or the footer, 0 for none; `None` if that record
/// is missing.
fn data_crc(source: &FileSource) -> io::Result<Option<u32>> {
    let end = match footer(source)? {
        Ok((start, _)) => start,
        Err(_) => source.len().saturating_sub(END as u64),
    };
    let mut bytes = [0; DATA_END_RECORD];
    let at = end.saturating_sub(DATA_END_RECORD as u64);
    let got = source.read_at(at, &mut bytes)?;
    let mut cursor = FieldCursor(&bytes[..got]);
    let is_end = (cursor.u8(), cursor.u64()) == (Some(op::DATA_END), Some(DATA_END));
    Ok(cursor.u32().filter(|_| is_end))
}

/// The part of a summary that has been read.
#[derive(Default)]
struct Summary {
    tail: Tail<Mcap>,
    statistics: Option<Counts>,
    /// Whether a channel refers to a schema that the summary does not repeat.
    untyped: bool,
}

impl Summary {
    /// Takes the records up to the footer. All of them are kept in memory, so none may be long.
    fn records(&mut self, stream: &mut ByteStream<'_>) -> Result<(), NoRecord> {
        let mut channels: Vec<Vec<u8>> = Vec::new();
        let stop = walk(stream, u64::MAX, |stream| {
            let (kind, len) = records::head(stream)?;
            if kind == op::FOOTER {
                // Up to the end of the bytes that the checksum covers.
                stream.skip(FOOTER)?;
                return Err(NoRecord::End);
            }
            if len > MOST_PAYLOAD as u64 {
                return Err(NoRecord::Broken);
            }
            let record = peek_whole(stream, len)?;
            match kind {
                op::SCHEMA => self.tail.describe(&Described::Schema, record)?,
                // A channel may precede its schema.
                op::CHANNEL if channels.len() < MOST_CHANNELS => channels.push(record.to_vec()),
                op::STATISTICS => self.statistics = records::counts(record),
                op::CHUNK_INDEX => {
                    let (place, times, counts) = chunk_index(record).ok_or(NoRecord::Broken)?;
                    self.tail.list(place, times, counts)?;
                }
                _ => {}
            }
            pass(stream, len)
        });
        let NoRecord::End = stop else {
            return Err(stop);
        };
        for channel in &channels {
            let schema = channel.get(2..4).map(FieldCursor);
            let schema = schema.and_then(|mut id| id.u16()).unwrap_or(0);
            self.untyped |= schema > 0 && !self.tail.grammar.schemas.contains_key(&schema);
            self.tail.describe(&Described::Channel, channel)?;
        }
        Ok(())
    }

    /// Sorts the chunks and decides whether they contain all messages. Every part of a summary is optional.
    fn into_plan(mut self, source: &FileSource) -> Result<ChunkPlan, Unindexed> {
        self.tail.sort();
        let chunks = &self.tail.plan.chunks;
        let promised = chunks.iter().filter_map(|c| Some(c.promised?.messages));
        let known: u64 = promised.sum();
        let Some(all) = &self.statistics else {
            return Unindexed::missing("its summary has no statistics to check its index by");
        };
        if chunks.is_empty() && all.chunks > 0 {
            return Unindexed::missing("its summary has no index of its chunks");
        }
        if chunks.is_empty() && all.messages > 0 {
            return Unindexed::missing("its messages are outside chunks");
        }
        if all.chunks as usize != chunks.len() {
            return Unindexed::wrong("its index does not list all of its chunks");
        }
        if all.messages != known {
            are_counted(source, chunks)?;
            gaps(source, &self.tail.plan)?;
            return Unindexed::wrong("its index and its statistics disagree");
        }
        let undescribed = self.tail.is_described();
        let described = self.tail.plan.connections.list().len();
        if self.untyped || undescribed.is_err() && described < all.channels as usize {
            return Unindexed::missing("its summary does not repeat all channels and schemas");
        }
        undescribed?;
        gaps(source, &self.tail.plan)?;
        Ok(self.tail.plan)
    }
}

/// Checks that the offsets of the message indexes of these chunks determine the numbers of their messages.
fn are_counted(source: &FileSource, chunks: &[Chunk]) -> Result<(), Unindexed> {
    let first = chunks.iter().find(|chunk| !chunk.index.is_empty());
    let is_extended = |chunk: &Chunk| {
        let mut stream = ByteStream::of_file(source, chunk.index.start, chunk.index.end, NEAR);
        let first = Mcap::next(&mut stream).map(|first| (first.kind, first.len));
        matches!(first, Ok((RecordKind::Index { count, .. }, len)) if 2 + 4 + u64::from(count) * (ENTRY as u64) < len)
    };
    if first.is_some_and(is_extended) {
        Unindexed::missing("its message indexes have fields of a later version of the format")
    } else if chunks.iter().any(|chunk| chunk.promised.is_none()) {
        Unindexed::missing("its chunks have no message index")
    } else {
        Ok(())
    }
}

/// Checks that between the chunks, where other records may occur, there are no messages missing from the summary.
fn gaps(source: &FileSource, plan: &ChunkPlan) -> Result<(), Unindexed> {
    let mut free = plan.body.start;
    let ends = plan.chunks.iter().map(|c| (c.start, c.end));
    for (start, end) in ends.chain([(plan.body.end, plan.body.end)]) {
        if start < free || end > plan.body.end {
            return Unindexed::wrong("its index lists chunks at impossible positions");
        }
        let mut stream = ByteStream::of_file(source, free, start, NEAR);
        let (mut hidden, mut loose) = (false, false);
        // Bytes that are not a record contain no readable message.
        walk(&mut stream, start, |stream| {
            let record = Mcap::next(stream)?;
            hidden |= matches!(record.kind, RecordKind::Chunk(_) | RecordKind::Index { .. });
            loose |= matches!(record.kind, RecordKind::Message(_));
            pass(stream, record.len)
        });
        if hidden {
            return Unindexed::wrong("its summary does not list all of its messages");
        }
        if loose {
            return Unindexed::missing("some of its messages are outside chunks");
        }
        free = end;
    }
    Ok(())
}

/// The places of a chunk and its index, its times and its message counts in a chunk index record.
type Listed = ((u64, Range<u64>), (Stamp, Stamp), Option<Vec<(u32, u32)>>);

/// The chunk of a chunk index record.
fn chunk_index(record: &[u8]) -> Option<Listed> {
    let mut cursor = FieldCursor(record);
    let (first, last) = (cursor.u64()?, cursor.u64()?);
    let (start, len) = (cursor.u64()?, cursor.u64()?);
    let offsets = cursor.bytes()?;
    let index_len = cursor.u64()?;
    let _compression = cursor.bytes()?;
    let _sizes = (cursor.u64()?, cursor.u64()?);
    let behind = start.checked_add(len)?;
    let end = behind.checked_add(index_len)?;
    if len < HEAD {
        return None;
    }
    let times = (Stamp::from_nanos(first), Stamp::from_nanos(last));
    Some(((start, behind..end), times, counts(offsets, behind, end)))
}

/// The message counts, computed from the offsets of the message indexes of a chunk's channels, which are contiguous:
/// 15 bytes, plus 16 per message. `None` if they are not contiguous, or if there are none.
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
