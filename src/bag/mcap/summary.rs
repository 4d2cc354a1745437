//! The summary at the end of an MCAP file: its channels and chunks, and whether they can be relied on.

use std::io;

use super::chunk::{self, Chunk, Chunks};
use super::records::{self, Cursor, HEAD, MAGIC, Table, op};
use crate::bag::index::{IndexSum, Query, pass, span_of};
use crate::bag::model::{ConnectionId, Want};
use crate::bag::source::{FAR, Source, Stream};
use crate::base::time::{Span, Stamp};

/// What the summary says.
#[derive(Default)]
pub(super) struct Summary {
    pub(super) table: Table,
    /// In the order of the file, none twice, none over another.
    pub(super) chunks: Vec<Chunk>,
    /// Messages and chunks by the file's own statistics.
    statistics: Option<(u64, u32)>,
}

/// Why a file cannot be read by its summary.
#[derive(Clone, Debug)]
pub(super) struct Unindexed(pub(super) String);

impl Unindexed {
    fn because<T>(reason: &str) -> Result<T, Self> {
        Err(Self(reason.to_owned()))
    }
}

/// More chunks than this are not planned for.
const MOST_CHUNKS: usize = 1 << 20;

/// As many as there are ids for channels.
const MOST_CHANNELS: usize = 1 << 16;

/// A footer record and what closes the file.
const FOOTER: u64 = HEAD + 8 + 8 + 4 + 8;

/// Reads the end of `source`.
pub(super) fn of(source: &Source) -> io::Result<Result<Summary, Unindexed>> {
    let start = match footer(source)? {
        Ok(start) => start,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut summary = Summary::default();
    let told = summary.read(source, start)?;
    Ok(told.and_then(|()| summary.settle(start)).map(|()| summary))
}

/// Where the summary begins.
fn footer(source: &Source) -> io::Result<Result<u64, Unindexed>> {
    let mut bytes = [0; 37];
    let Some(at) = source.len().checked_sub(FOOTER) else {
        return Ok(Unindexed::because("it is cut"));
    };
    let got = source.read_at(at, &mut bytes)?;
    let mut cursor = Cursor(&bytes[..got]);
    let head = (cursor.u8(), cursor.u64());
    let start = cursor.u64().unwrap_or(0);
    if !bytes[..got].ends_with(MAGIC) || head != (Some(op::FOOTER), Some(20)) {
        return Ok(Unindexed::because("its end is missing"));
    }
    Ok(match start {
        0 => Unindexed::because("it has no summary"),
        n if n < 8 || n > at => Unindexed::because("its summary lies outside the file"),
        n => Ok(n),
    })
}

impl Summary {
    fn read(&mut self, source: &Source, start: u64) -> io::Result<Result<(), Unindexed>> {
        let mut stream = Stream::of_file(source, start, source.len(), FAR);
        let mut channels: Vec<Vec<u8>> = Vec::new();
        while let Some((kind, len)) = records::next(&mut stream)? {
            if kind == op::FOOTER {
                break;
            }
            let Some(record) = records::whole(&mut stream, len)? else {
                return Ok(Unindexed::because("its summary is damaged"));
            };
            match kind {
                op::SCHEMA => drop(self.table.schema(record)),
                // A channel may stand before its schema.
                op::CHANNEL if channels.len() < MOST_CHANNELS => channels.push(record.to_vec()),
                op::STATISTICS => self.statistics = statistics(record),
                op::CHUNK_INDEX => match chunk_index(record) {
                    Some(chunk) if self.chunks.len() < MOST_CHUNKS => self.chunks.push(chunk),
                    _ => return Ok(Unindexed::because("its chunk index is damaged or too long")),
                },
                _ => {}
            }
            pass(&mut stream, len)?;
        }
        for channel in &channels {
            self.table.channel(channel);
        }
        Ok(Ok(()))
    }

    /// Orders the chunks and decides whether they hold all messages.
    fn settle(&mut self, end: u64) -> Result<(), Unindexed> {
        self.chunks.sort_by_key(|c| c.start);
        self.chunks.dedup_by_key(|c| c.start);
        let mut free = 8;
        for chunk in &self.chunks {
            if chunk.start < free || chunk.end() > end {
                return Unindexed::because("its index names chunks where none can be");
            }
            free = chunk.end();
        }
        let known: u64 = self
            .chunks
            .iter()
            .filter_map(|c| Some(c.tally?.messages))
            .sum();
        let blind = |c: &Chunk| c.tally.is_none() && c.size > 0;
        match self.statistics {
            Some((_, chunks)) if chunks as usize != self.chunks.len() => {
                Unindexed::because("its index does not name all of its chunks")
            }
            Some((messages, _)) if messages == known => Ok(()),
            Some((_, 0)) => Unindexed::because("its messages lie outside chunks"),
            _ if self.chunks.iter().any(blind) => {
                Unindexed::because("its chunks have no message index")
            }
            Some(_) => Unindexed::because("its index and its statistics disagree"),
            None if self.chunks.is_empty() => Unindexed::because("its summary names no chunks"),
            None => Ok(()),
        }
    }

    /// How many bytes the longest index takes.
    pub(super) fn longest_index(&self) -> u64 {
        self.chunks.iter().map(|c| c.index_len).max().unwrap_or(0)
    }

    /// The time covered.
    pub(super) fn span(&self, source: &Source) -> Option<Span> {
        let wants = vec![Want::Stamps; self.table.list().len()];
        let resolve = |raw| self.resolve(raw);
        let reader = reader(source, &resolve, &wants, None);
        let full = self.chunks.iter().enumerate();
        let full = full.filter(|(_, c)| c.tally.is_some_and(|t| t.messages > 0));
        let claims = full.map(|(at, c)| (at, c.first, c.last));
        span_of(claims, |at, sink| reader.read(&self.chunks[at], sink))
    }

    /// The connection of a channel.
    pub(super) fn resolve(&self, raw: u32) -> Option<ConnectionId> {
        self.table.get(u16::try_from(raw).ok()?)
    }
}

/// What reads the chunks of `source`.
pub(super) fn reader<'a>(
    source: &'a Source,
    resolve: &'a (dyn Fn(u32) -> Option<ConnectionId> + Sync),
    wants: &'a [Want],
    range: Option<Span>,
) -> Chunks<'a> {
    let head = chunk::head;
    let ask = Query {
        resolve,
        wants,
        range,
        head,
    };
    Chunks { source, ask }
}

/// The counts of messages and chunks in a statistics record.
fn statistics(record: &[u8]) -> Option<(u64, u32)> {
    let mut cursor = Cursor(record);
    let messages = cursor.u64()?;
    let (_schemas, _channels, _attachments, _metadata) =
        (cursor.u16()?, cursor.u32()?, cursor.u32()?, cursor.u32()?);
    Some((messages, cursor.u32()?))
}

/// What a chunk index record says.
fn chunk_index(record: &[u8]) -> Option<Chunk> {
    let mut cursor = Cursor(record);
    let (first, last) = (cursor.u64()?, cursor.u64()?);
    let (start, len) = (cursor.u64()?, cursor.u64()?);
    let offsets = cursor.bytes()?;
    let index_len = cursor.u64()?;
    let _compression = cursor.bytes()?;
    let (_compressed, size) = (cursor.u64()?, cursor.u64()?);
    start.checked_add(len)?.checked_add(index_len)?;
    if len < HEAD {
        return None;
    }
    let mut chunk = Chunk {
        start,
        len,
        index_len,
        size,
        first: Stamp::from_nanos(first),
        last: Stamp::from_nanos(last),
        tally: None,
    };
    chunk.tally = tally(offsets, start + len, chunk.end());
    Some(chunk)
}

/// The counts that follow from where the message indexes of a chunk's channels begin: they stand one behind the other,
/// 15 bytes and 16 for each message. `None` if they do not, or if there are none.
fn tally(offsets: &[u8], start: u64, end: u64) -> Option<IndexSum> {
    let mut places = Vec::with_capacity(offsets.len() / 10);
    let mut cursor = Cursor(offsets);
    while let (Some(channel), Some(at)) = (cursor.u16(), cursor.u64()) {
        places.push((at, channel));
    }
    places.sort_unstable();
    if places.first()?.0 != start {
        return None;
    }
    let mut tally = IndexSum::default();
    let ends = places.iter().skip(1).map(|p| p.0).chain([end]);
    for ((at, channel), end) in places.iter().zip(ends) {
        let entries = end.checked_sub(*at)?.checked_sub(15)?;
        if entries % 16 != 0 {
            return None;
        }
        tally.add(u32::from(*channel), u32::try_from(entries / 16).ok()?);
    }
    Some(tally)
}

impl Chunk {
    /// Where the message indexes behind it end.
    pub(super) fn end(&self) -> u64 {
        self.start + self.len + self.index_len
    }
}
