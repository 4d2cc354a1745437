//! The grammar of ROS 1 bags, version 2, and their tail.
//!
//! The format: <https://wiki.ros.org/Bags/Format/2.0>.

mod records;
mod verify;

use std::collections::HashSet;
use std::io;
use std::path::Path;
use std::sync::Arc;

use records::{ENTRY, Header};

use crate::bag::chunked::{
    self, ChunkHead, ChunkPlan, Connections, Counts, Grammar, Index, IndexSum, MessageHead,
    NoRecord, RecordHead, RecordKind, SecondReading, Tail, Unindexed, pass, peek_whole, walk,
};
use crate::bag::decompress::Compression;
use crate::bag::input::FormatRow;
use crate::bag::model::{Connection, Sink};
use crate::bag::source::{ByteStream, FAR, FileSource, NEAR};
use crate::base::error::{Error, Result};
use crate::base::time::Stamp;

/// ROS 1 bags.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "rosbag1",
    what: "ROS 1 bag",
    extensions: &["bag", "bag.active"],
    needs_file: false,
    sniff: |_, head| head.starts_with(Rosbag1::OPENING) || head.starts_with(b"#ROSRECORD V"),
    is_inside: chunked::has_chunk::<Rosbag1>,
    open: chunked::open::<Rosbag1>,
    follow: Some(chunked::follow::<Rosbag1>),
};

/// The definitions seen, of which equal ones share one text.
#[derive(Default)]
struct Rosbag1 {
    definitions: HashSet<Arc<str>>,
    held: usize,
}

/// The head of a connection record.
struct Described {
    raw: u32,
    topic: Vec<u8>,
}

impl Grammar for Rosbag1 {
    const NAME: &'static str = FORMAT.name;
    const HAS_END: bool = false;
    const IS_LOOSE: bool = false;
    const OPENING: &'static [u8] = b"#ROSBAG V2.";
    const CLOSING: &'static [u8] = b"";
    type Description = Described;

    /// Refuses bags older than version 2, and encrypted ones.
    fn accept(path: &Path, head: &[u8]) -> Result<Vec<(String, String)>> {
        if head.starts_with(b"#ROSRECORD V") {
            let line = head.split(|b| *b == b'\n').next().unwrap_or_default();
            let line = String::from_utf8_lossy(&line[..line.len().min(32)]);
            let what = format!("it is of an old format, `{line}`");
            let hint =
                "convert it to version 2 with `rosbag fix old.bag new.bag` of a ROS 1 installation";
            return Err(Error::unsupported(path, what, hint));
        }
        let mut stream = ByteStream::of_reader(head);
        Self::begin(&mut stream);
        match records::header(&mut stream) {
            Ok((Header::Bag { encryptor, .. }, _)) if !encryptor.is_empty() => {
                let what = format!("it is encrypted by `{encryptor}`");
                let hint = "decrypt it first with `rosbag decrypt`, on a machine that has its key";
                Err(Error::unsupported(path, what, hint))
            }
            _ => Ok(Vec::new()),
        }
    }

    /// The first line names the version.
    fn begin(stream: &mut ByteStream<'_>) {
        if let Ok(head) = stream.peek(32) {
            let line = head.iter().position(|b| *b == b'\n');
            stream.advance(line.map_or(0, |at| at + 1));
        }
    }

    fn next(stream: &mut ByteStream<'_>) -> Result<RecordHead<Described>, NoRecord> {
        let (header, size) = records::header(stream)?;
        let mut len = u64::from(size);
        let kind = match header {
            Header::Chunk { how, size } => RecordKind::Chunk(ChunkHead {
                how,
                packed: len,
                plain: u64::from(size),
                // A recorder writes the lengths when it closes the chunk.
                unclosed: len == 0 && how.is_some_and(|how| how != Compression::None),
                ..ChunkHead::default()
            }),
            Header::Message { raw, time } => RecordKind::Message(MessageHead { raw, time, size }),
            Header::Connection { raw, topic } => RecordKind::Description(Described { raw, topic }),
            Header::Index { raw, count } => {
                // Its length is computed from its count: writers of 2010 stored a wrong one.
                len = u64::from(count.checked_mul(ENTRY).ok_or(NoRecord::Broken)?);
                RecordKind::Index { raw, count }
            }
            Header::Bag { chunks, .. } => RecordKind::Total(Counts {
                chunks,
                ..Counts::default()
            }),
            Header::ChunkInfo {
                pos, start, end, ..
            } => RecordKind::Listed {
                at: pos,
                times: (start, end),
            },
            Header::Unknown => RecordKind::Unknown { extension: false },
        };
        Ok(RecordHead { kind, len })
    }

    fn describe(
        &mut self,
        what: &Described,
        data: &[u8],
        known: &Connections,
    ) -> Result<Option<(u32, Connection)>, NoRecord> {
        let is_new = known.get(what.raw).is_none();
        Ok(is_new.then(|| (what.raw, records::connection(self, &what.topic, data))))
    }

    fn is_chunk(bytes: &[u8]) -> bool {
        matches!(records::short(bytes), Some((Header::Chunk { .. }, _)))
    }

    fn is_content(bytes: &[u8]) -> bool {
        let Some((Header::Message { .. } | Header::Connection { .. }, len)) = records::short(bytes)
        else {
            return false;
        };
        let next = bytes.get(len..);
        next.is_some_and(|next| next.is_empty() || records::short(next).is_some())
    }

    fn index(bytes: &[u8], promised: &IndexSum) -> Option<Index> {
        let mut found = IndexSum::default();
        let mut index = Index::default();
        let mut at = 0;
        while found.connections < promised.connections {
            let (raw, count, start) = record_at(bytes, at)?;
            let end = start.checked_add((count as usize).checked_mul(ENTRY as usize)?)?;
            let entries = bytes.get(start..end)?.chunks_exact(ENTRY as usize);
            found.add(raw, count);
            index.add(raw, entries.filter_map(entry));
            at = end;
        }
        // One more record than the tail states: then the tail lacks a connection.
        let is_all = record_at(bytes, at).is_none();
        (is_all && found == *promised).then_some(index)
    }

    fn index_stamps(data: &[u8]) -> Vec<Stamp> {
        let entries = data.chunks_exact(ENTRY as usize);
        entries.filter_map(|e| Some(entry(e)?.0)).collect()
    }

    /// Reads the head and the tail of `source`.
    fn plan(source: &FileSource) -> io::Result<Result<ChunkPlan, Unindexed>> {
        let mut stream = ByteStream::of_file(source, 0, source.len(), NEAR);
        Self::begin(&mut stream);
        let (header, len) = match records::header(&mut stream) {
            Ok(found) => found,
            Err(NoRecord::Io(e)) => return Err(e),
            Err(NoRecord::End | NoRecord::Cut) => return Ok(Unindexed::cut(HEAD_DAMAGED)),
            Err(_) => return Ok(Unindexed::wrong(HEAD_DAMAGED)),
        };
        let Header::Bag {
            index_pos,
            connections,
            chunks,
            ..
        } = header
        else {
            return Ok(Unindexed::wrong("it has no head"));
        };
        let body = stream.position() + u64::from(len);
        if let Err(reason) = placed(index_pos, body, source.len()) {
            return Ok(Err(reason));
        }
        let mut tail = Tail::default();
        tail.plan.body = body..index_pos;
        match tail_records(&mut tail, source, (connections, chunks)) {
            Ok(()) => Ok(into_plan(tail)),
            Err(NoRecord::Io(e)) => Err(e),
            Err(_) => Ok(Unindexed::wrong("its index is cut or damaged")),
        }
    }

    fn verify(
        source: &FileSource,
        plan: &Result<ChunkPlan, Unindexed>,
        sink: &mut dyn Sink,
    ) -> SecondReading {
        match plan {
            Ok(plan) => verify::read(source, plan, sink),
            Err(reason) => SecondReading {
                stopped: Some(format!(
                    "the crate `rosbag` needs an index, and {}",
                    reason.why
                )),
                refused: true,
                ..SecondReading::default()
            },
        }
    }
}

/// The index record at `at`: its connection, its count, and the start of its entries.
fn record_at(bytes: &[u8], at: usize) -> Option<(u32, u32, usize)> {
    let len = records::u32_at(bytes, at)? as usize;
    let header = bytes.get(at + 4..)?.get(..len)?;
    match records::parse(header)? {
        Header::Index { raw, count } => Some((raw, count, at + 4 + len + 4)),
        _ => None,
    }
}

/// The time and the offset in an entry of an index record.
fn entry(bytes: &[u8]) -> Option<(Stamp, u64)> {
    let offset = records::u32_at(bytes, 8)?;
    Some((records::time_at(bytes, 0)?, u64::from(offset)))
}

// The tail of a ROS 1 bag: its connections and chunks, and whether they are reliable.

/// The reason why a bag without a readable head is read from the front.
const HEAD_DAMAGED: &str = "its head is damaged";

/// Rejects an index outside the bag.
fn placed(index_pos: u64, body: u64, len: u64) -> Result<(), Unindexed> {
    if index_pos == 0 {
        Unindexed::missing("it was never closed and has no index")
    } else if index_pos > len {
        Unindexed::cut(format!("its index at byte {index_pos} is cut off"))
    } else if index_pos < body {
        Unindexed::wrong(format!("its index cannot be at byte {index_pos}"))
    } else {
        Ok(())
    }
}

/// Reads the records of the tail: `expected` connections and chunks, and no more of them.
fn tail_records(
    tail: &mut Tail<Rosbag1>,
    source: &FileSource,
    expected: (u32, u32),
) -> Result<(), NoRecord> {
    let mut stream = ByteStream::of_file(source, tail.plan.body.end, source.len(), FAR);
    let mut found = (0, 0);
    let stop = walk(&mut stream, u64::MAX, |stream| {
        let (header, len) = match records::header(stream) {
            Err(_) if found == expected => return Err(NoRecord::End),
            header => header?,
        };
        let len = u64::from(len);
        match header {
            Header::Connection { raw, topic } => {
                found.0 += 1;
                tail.describe(&Described { raw, topic }, peek_whole(stream, len)?)?;
            }
            Header::ChunkInfo {
                pos,
                start,
                end,
                count,
            } if u64::from(count) * PAIR as u64 == len => {
                found.1 += 1;
                let number = |pair: &[u8], at| records::u32_at(pair, at);
                let pairs = peek_whole(stream, len)?.chunks_exact(PAIR);
                let counts = pairs.filter_map(|pair| number(pair, 0).zip(number(pair, 4)));
                tail.list((pos, 0..0), (start, end), Some(counts.collect()))?;
            }
            Header::ChunkInfo { .. } => return Err(NoRecord::Broken),
            _ if found == expected => return Err(NoRecord::End),
            _ => {}
        }
        if found.0 > expected.0 || found.1 > expected.1 {
            return Err(NoRecord::Broken);
        }
        pass(stream, len)
    });
    match stop {
        NoRecord::End if found == expected => Ok(()),
        NoRecord::End => Err(NoRecord::Cut),
        stop => Err(stop),
    }
}

/// The number of bytes of a connection's number and that of its messages in a chunk.
const PAIR: usize = 8;

/// Sorts the chunks and sets the end of each.
fn into_plan(mut tail: Tail<Rosbag1>) -> Result<ChunkPlan, Unindexed> {
    tail.sort();
    let body = tail.plan.body.clone();
    let chunks = &mut tail.plan.chunks;
    if chunks.is_empty() && body.end > body.start {
        return Unindexed::wrong("its index names no chunks");
    }
    if chunks.iter().any(|c| !body.contains(&c.start)) {
        return Unindexed::wrong("its index names chunks outside the bag");
    }
    let mut end = body.end;
    for chunk in chunks.iter_mut().rev() {
        chunk.end = end;
        let len = chunk.promised.as_ref().map_or(0, index_len);
        chunk.index = end.saturating_sub(len).max(chunk.start)..end;
        end = chunk.start;
    }
    tail.is_described()?;
    Ok(tail.plan)
}

/// The expected length of the index records, with headers as all writers make them: 47 bytes.
fn index_len(promised: &IndexSum) -> u64 {
    let entries = promised.messages.saturating_mul(u64::from(ENTRY));
    entries.saturating_add(u64::from(promised.connections) * (4 + 47 + 4))
}
