//! The tail of a ROS 1 bag: its connections and chunks, and whether they are reliable.

use std::io;

use super::records::{self, ENTRY, Header};
use super::{Described, Rosbag1};
use crate::bag::chunked::{
    ChunkPlan, Fault, Grammar as _, IndexSum, NoRecord, Tail, Unindexed, pass, peek_whole, walk,
};
use crate::bag::source::{ByteStream, FAR, FileSource, NEAR};

/// Reads the head and the tail of `source`.
pub(super) fn read(source: &FileSource) -> io::Result<Result<ChunkPlan, Unindexed>> {
    let mut stream = ByteStream::of_file(source, 0, source.len(), NEAR);
    Rosbag1::begin(&mut stream);
    let (header, len) = match records::header(&mut stream) {
        Ok(found) => found,
        Err(NoRecord::Io(e)) => return Err(e),
        Err(error) => {
            let fault = match error {
                NoRecord::End | NoRecord::Cut => Fault::Cut,
                _ => Fault::Wrong,
            };
            let why = "its head is damaged".to_owned();
            return Ok(Err(Unindexed { why, fault }));
        }
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
    match records(&mut tail, source, (connections, chunks)) {
        Ok(()) => Ok(into_plan(tail)),
        Err(NoRecord::Io(e)) => Err(e),
        Err(_) => Ok(Unindexed::wrong("its index is cut or damaged")),
    }
}

/// Rejects an index outside the bag.
fn placed(index_pos: u64, body: u64, len: u64) -> Result<(), Unindexed> {
    if index_pos == 0 {
        Unindexed::missing("it was never closed and has no index")
    } else if index_pos > len {
        let why = format!("its index at byte {index_pos} is cut off");
        let fault = Fault::Cut;
        Err(Unindexed { why, fault })
    } else if index_pos < body {
        Unindexed::wrong(format!("its index cannot be at byte {index_pos}"))
    } else {
        Ok(())
    }
}

/// Reads the records of the tail: `expected` connections and chunks, and no more of them.
fn records(
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
