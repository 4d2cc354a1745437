//! The tail of a ROS 1 bag: which connections and chunks it has, and whether that can be relied on.

use std::io;

use super::chunk::{self, Chunk, Chunks};
use super::records::{self, Record, Stop, Table};
use crate::bag::index::{IndexSum, Query, span_of};
use crate::bag::model::{ConnectionId, MOST_PAYLOAD, Sink, Want};
use crate::bag::source::{FAR, NEAR, Source, Stream};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Span;

/// What the tail says.
pub(super) struct Plan {
    pub(super) table: Table,
    /// In the order of the file, none twice.
    pub(super) chunks: Vec<Chunk>,
    /// Where the first chunk may begin.
    pub(super) body: u64,
    /// Where the chunks end and the tail begins.
    pub(super) index_pos: u64,
    encryptor: String,
}

/// Why a bag cannot be read by its index.
#[derive(Clone, Debug)]
pub(super) struct Unindexed {
    pub(super) why: String,
    /// The head says that there was more.
    pub(super) cut: bool,
}

impl Unindexed {
    fn because<T>(why: impl Into<String>) -> Result<T, Self> {
        Err(Self {
            why: why.into(),
            cut: false,
        })
    }
}

/// More chunks than this are not planned for: a tail of at most 100 MB in memory, a bag of at least 768 GB.
const MOST_CHUNKS: usize = 1 << 20;

/// Reads the head and the tail of `source`.
pub(super) fn of(source: &Source) -> io::Result<Result<Plan, Unindexed>> {
    let mut stream = Stream::of_file(source, 0, source.len(), NEAR);
    let head = stream.peek(32)?;
    let line = head.iter().position(|b| *b == b'\n').unwrap_or(0);
    stream.advance(line + 1);
    let (record, len) = match records::next(&mut stream) {
        Ok(found) => found,
        Err(Stop::Io(e)) => return Err(e),
        Err(_) => return Ok(Unindexed::because("its head is damaged")),
    };
    let Record::Bag {
        index_pos,
        connections,
        chunks,
        encryptor,
    } = record
    else {
        return Ok(Unindexed::because("it has no head"));
    };
    let body = stream.position() + u64::from(len);
    if let Some(why) = misplaced(index_pos, body, source.len()) {
        let cut = index_pos > source.len();
        return Ok(Err(Unindexed { why, cut }));
    }
    let mut plan = Plan {
        table: Table::default(),
        chunks: Vec::new(),
        body,
        index_pos,
        encryptor,
    };
    let told = plan.tail(source, index_pos, (connections, chunks));
    match told {
        Ok(()) => Ok(plan.settle().map(|()| plan)),
        Err(Stop::Io(e)) => Err(e),
        Err(_) => Ok(Unindexed::because("its index is cut or damaged")),
    }
}

fn misplaced(index_pos: u64, body: u64, len: u64) -> Option<String> {
    if index_pos == 0 {
        Some("it was never closed and has no index".to_owned())
    } else if index_pos > len {
        Some(format!("its index at byte {index_pos} is cut off"))
    } else if index_pos < body {
        Some(format!("its index cannot be at byte {index_pos}"))
    } else {
        None
    }
}

impl Plan {
    /// The records from `index_pos` on: `expected` connections and chunks. What follows them does not matter.
    fn tail(&mut self, source: &Source, index_pos: u64, expected: (u32, u32)) -> Result<(), Stop> {
        let mut stream = Stream::of_file(source, index_pos, source.len(), FAR);
        let (mut connections, mut chunks) = (0, 0);
        while (connections, chunks) != expected {
            let (record, len) = records::next(&mut stream)?;
            let end = stream.position() + u64::from(len);
            match record {
                Record::Connection { id, topic } => {
                    connections += 1;
                    if len as usize > MOST_PAYLOAD {
                        return Err(Stop::Broken);
                    }
                    let data = stream.peek(len as usize)?;
                    self.table.add(id, &topic, data);
                }
                Record::ChunkInfo {
                    pos,
                    start,
                    end,
                    count,
                } => {
                    chunks += 1;
                    let tally = tally(&mut stream, count, len)?;
                    self.chunks.push(Chunk {
                        pos,
                        end: 0,
                        first: start,
                        last: end,
                        tally,
                    });
                }
                _ => {}
            }
            if connections > expected.0 || chunks > expected.1 || self.chunks.len() > MOST_CHUNKS {
                return Err(Stop::Broken);
            }
            let left = end.saturating_sub(stream.position());
            if stream.skip(left)? < left {
                return Err(Stop::Cut);
            }
        }
        // The head may lie as well as the tail.
        match records::next(&mut stream) {
            Ok((Record::ChunkInfo { .. }, _)) => Err(Stop::Broken),
            _ => Ok(()),
        }
    }

    /// Orders the chunks and tells each where it ends.
    fn settle(&mut self) -> Result<(), Unindexed> {
        let (body, index_pos) = (self.body, self.index_pos);
        if self.chunks.is_empty() && index_pos > body {
            return Unindexed::because("its index names no chunks");
        }
        self.chunks.sort_by_key(|c| c.pos);
        self.chunks.dedup_by_key(|c| c.pos);
        let mut end = index_pos;
        for chunk in self.chunks.iter_mut().rev() {
            chunk.end = end;
            end = chunk.pos;
        }
        let outside = |c: &Chunk| c.pos < body || c.pos >= index_pos;
        if self.chunks.iter().any(outside) {
            return Unindexed::because("its index names chunks outside the bag");
        }
        Ok(())
    }

    /// Says what names cannot be known.
    pub(super) fn notices(&self, sink: &mut dyn Sink) {
        if !self.encryptor.is_empty() {
            let text = format!(
                "the bag is encrypted by `{}`: counts are right, names are not known",
                self.encryptor
            );
            sink.notice(Notice::new(NoticeKind::Note, text));
        }
    }

    /// How many bytes the longest index takes.
    pub(super) fn longest_index(&self) -> u64 {
        self.chunks.iter().map(Chunk::index_len).max().unwrap_or(0)
    }

    /// The time covered.
    pub(super) fn span(&self, source: &Source) -> Option<Span> {
        let wants = vec![Want::Stamps; self.table.list().len()];
        let resolve = |raw| self.table.get(raw);
        let reader = self.reader(source, &resolve, &wants, None);
        let full = self.chunks.iter().enumerate();
        let full = full.filter(|(_, c)| c.tally.messages > 0);
        let claims = full.map(|(at, c)| (at, c.first, c.last));
        span_of(claims, |at, sink| reader.read(&self.chunks[at], sink))
    }

    /// What reads its chunks.
    pub(super) fn reader<'a>(
        &'a self,
        source: &'a Source,
        resolve: &'a (dyn Fn(u32) -> Option<ConnectionId> + Sync),
        wants: &'a [Want],
        range: Option<Span>,
    ) -> Chunks<'a> {
        let ask = Query {
            resolve,
            wants,
            range,
            head: chunk::head,
        };
        Chunks {
            source,
            table: &self.table,
            ask,
        }
    }
}

/// The counts of a chunk info record.
fn tally(stream: &mut Stream<'_>, count: u32, len: u32) -> Result<IndexSum, Stop> {
    let mut tally = IndexSum::default();
    if u64::from(count) * 8 > u64::from(len) {
        return Err(Stop::Broken);
    }
    for _ in 0..count {
        let pair = stream.peek(8)?;
        let id = records::u32_at(pair, 0).ok_or(Stop::Cut)?;
        tally.add(id, records::u32_at(pair, 4).ok_or(Stop::Cut)?);
        stream.advance(8);
    }
    Ok(tally)
}
