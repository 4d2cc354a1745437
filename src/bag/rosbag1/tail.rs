//! The tail of a ROS 1 bag: its connections and chunks, and whether they are reliable.

use std::io;

use super::records::{self, ENTRY, Header};
use super::{Described, Rosbag1};
use crate::bag::chunked::{
    Chunk, ChunkPlan, Fault, Grammar as _, IndexSum, MOST_CHUNKS, NoRecord, Unindexed, Used, pass,
    walk,
};
use crate::bag::model::MOST_PAYLOAD;
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
    match tail.records(source, (connections, chunks)) {
        Ok(()) => Ok(tail.into_plan()),
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

/// The part of a tail that has been read.
#[derive(Default)]
struct Tail {
    plan: ChunkPlan,
    grammar: Rosbag1,
    used: Used,
}

impl Tail {
    /// Reads the records of the tail: `expected` connections and chunks, and no more of them.
    fn records(&mut self, source: &FileSource, expected: (u32, u32)) -> Result<(), NoRecord> {
        let mut stream = ByteStream::of_file(source, self.plan.body.end, source.len(), FAR);
        let mut found = (0, 0);
        let stop = walk(&mut stream, u64::MAX, |stream| {
            let (header, len) = match records::header(stream) {
                Err(_) if found == expected => return Err(NoRecord::End),
                header => header?,
            };
            let end = stream.position() + u64::from(len);
            match header {
                Header::Connection { raw, topic } => {
                    found.0 += 1;
                    self.connection(stream, &Described { raw, topic }, len)?;
                }
                Header::ChunkInfo { .. } => {
                    found.1 += 1;
                    self.chunk(stream, &header, len)?;
                }
                _ if found == expected => return Err(NoRecord::End),
                _ => {}
            }
            let too_many = self.plan.chunks.len() > MOST_CHUNKS;
            if found.0 > expected.0 || found.1 > expected.1 || too_many {
                return Err(NoRecord::Broken);
            }
            pass(stream, end.saturating_sub(stream.position()))
        });
        match stop {
            NoRecord::End if found == expected => Ok(()),
            NoRecord::End => Err(NoRecord::Cut),
            stop => Err(stop),
        }
    }

    fn connection(
        &mut self,
        stream: &mut ByteStream<'_>,
        what: &Described,
        len: u32,
    ) -> Result<(), NoRecord> {
        if len as usize > MOST_PAYLOAD {
            return Err(NoRecord::Broken);
        }
        let data = stream.peek(len as usize)?;
        let connections = &mut self.plan.connections;
        if let Some((raw, connection)) = self.grammar.describe(what, data, connections)? {
            connections.add(raw, connection);
        }
        Ok(())
    }

    fn chunk(
        &mut self,
        stream: &mut ByteStream<'_>,
        header: &Header,
        len: u32,
    ) -> Result<(), NoRecord> {
        let Header::ChunkInfo {
            pos,
            start,
            end,
            count,
        } = *header
        else {
            return Err(NoRecord::Broken);
        };
        let promised = self.promised(stream, count, len)?;
        self.plan.chunks.push(Chunk {
            start: pos,
            index: 0..0,
            end: 0,
            first: start,
            last: end,
            promised: Some(promised),
            seen: None,
        });
        Ok(())
    }

    /// The sum of a chunk info record.
    fn promised(
        &mut self,
        stream: &mut ByteStream<'_>,
        count: u32,
        len: u32,
    ) -> Result<IndexSum, NoRecord> {
        let mut sum = IndexSum::default();
        if u64::from(count) * 8 != u64::from(len) {
            return Err(NoRecord::Broken);
        }
        for _ in 0..count {
            let pair = stream.peek(8)?;
            let raw = records::u32_at(pair, 0).ok_or(NoRecord::Cut)?;
            let messages = records::u32_at(pair, 4).ok_or(NoRecord::Cut)?;
            sum.add(raw, messages);
            if messages > 0 {
                self.used.add(raw);
            }
            stream.advance(8);
        }
        Ok(sum)
    }

    /// Sorts the chunks and sets the end of each.
    fn into_plan(mut self) -> Result<ChunkPlan, Unindexed> {
        let body = self.plan.body.clone();
        let chunks = &mut self.plan.chunks;
        if chunks.is_empty() && body.end > body.start {
            return Unindexed::wrong("its index names no chunks");
        }
        chunks.sort_by_key(|c| c.start);
        chunks.dedup_by_key(|c| c.start);
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
        self.used.are_in(&self.plan.connections)?;
        Ok(self.plan)
    }
}

/// The expected length of the index records, with headers as all writers make them: 47 bytes.
fn index_len(promised: &IndexSum) -> u64 {
    let entries = promised.messages.saturating_mul(u64::from(ENTRY));
    entries.saturating_add(u64::from(promised.connections) * (4 + 47 + 4))
}
