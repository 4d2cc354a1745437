//! The tail of a bag: its connections and chunks, and whether they are reliable.

use std::collections::BTreeSet;
use std::ops::Range;

use super::Grammar;
use super::index::IndexSum;
use super::record::{Connections, NoRecord};
use crate::bag::adapters::Bounds;
use crate::bag::model::Sink;
use crate::base::time::{Span, Stamp};

/// A chunk as the tail describes it. Sums of its numbers do not overflow.
#[derive(Clone, Debug)]
pub(crate) struct Chunk {
    /// The position of its record.
    pub(crate) start: u64,
    /// The expected position of its index.
    pub(crate) index: Range<u64>,
    /// The latest possible end of its index.
    pub(crate) end: u64,
    /// The times of its first and last message, as stated.
    pub(crate) first: Stamp,
    pub(crate) last: Stamp,
    /// The expected sum of its index; `None` if it has none.
    pub(crate) promised: Option<IndexSum>,
    /// The time that its messages cover, if it was inspected.
    pub(crate) seen: Option<Span>,
}

impl Chunk {
    pub(super) fn holds_messages(&self) -> bool {
        self.promised.is_some_and(|sum| sum.messages > 0)
    }

    /// The time that it covers, as stated.
    pub(super) fn stated(&self) -> Option<Span> {
        (self.first <= self.last).then(|| Span::new(self.first, self.last.plus(1)))
    }

    /// Whether it may contain messages inside `range`.
    fn reaches(&self, range: Span) -> bool {
        let span = self.seen.or_else(|| self.stated());
        span.is_none_or(|span| span.start < range.end && range.start < span.end)
    }
}

/// The contents of the tail.
#[derive(Debug, Default)]
pub(crate) struct ChunkPlan {
    pub(crate) connections: Connections,
    /// The chunks in file order, without duplicates or overlaps.
    pub(crate) chunks: Vec<Chunk>,
    /// The part of the file that contains the chunks.
    pub(crate) body: Range<u64>,
}

/// The most chunks that are planned for: a tail of at most 100 MB in memory, a bag of at least 768 GB.
pub(crate) const MOST_CHUNKS: usize = 1 << 20;

/// The most chunks that are all inspected to determine the covered time.
const MOST_LOOKED_INTO: usize = 512;

impl ChunkPlan {
    /// The number of bytes of the longest index.
    pub(super) fn longest_index(&self) -> u64 {
        let len = |c: &Chunk| c.index.end - c.index.start;
        self.chunks.iter().map(len).max().unwrap_or(0)
    }

    /// The chunks that may contain messages inside `range`.
    pub(super) fn within(&self, range: Option<Span>) -> Vec<&Chunk> {
        let reaches = |c: &&Chunk| range.is_none_or(|range| c.reaches(range));
        self.chunks.iter().filter(reaches).collect()
    }

    /// The time that each chunk covers which `read` inspects: the chunks stated to be first and last, or all of them if
    /// they are few or one of these two has other times than stated.
    pub(super) fn spans(&self, read: impl Fn(&Chunk, &mut dyn Sink)) -> Vec<(usize, Span)> {
        let seen = |(at, chunk): &(usize, &Chunk)| {
            let mut seen = Bounds::default();
            read(chunk, &mut seen);
            Some((*at, seen.0?))
        };
        let full = self.chunks.iter().enumerate();
        let full: Vec<(usize, &Chunk)> = full.filter(|(_, c)| c.holds_messages()).collect();
        if full.len() > MOST_LOOKED_INTO {
            let first = full.iter().min_by_key(|(_, c)| c.first);
            let last = full.iter().max_by_key(|(_, c)| c.last);
            let ends: Vec<_> = first.into_iter().chain(last).filter_map(seen).collect();
            let is_right = |(at, span): &(usize, Span)| self.chunks[*at].stated() == Some(*span);
            if ends.iter().all(is_right) {
                return ends;
            }
        }
        full.iter().filter_map(seen).collect()
    }
}

/// The reason why a bag cannot be read by its index.
#[derive(Clone, Debug)]
pub(crate) struct Unindexed {
    pub(crate) why: String,
    pub(crate) fault: Fault,
}

/// What a missing or wrong index implies about the bag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// No damage: the index was never written.
    Missing,
    /// The head states that the bag was longer.
    Cut,
    /// The index contradicts itself or the bag.
    Wrong,
}

impl Unindexed {
    /// An error with this reason: the index is missing.
    pub(crate) fn missing<T>(why: impl Into<String>) -> Result<T, Self> {
        let fault = Fault::Missing;
        let why = why.into();
        Err(Self { why, fault })
    }

    /// An error with this reason: the index contradicts itself or the bag.
    pub(crate) fn wrong<T>(why: impl Into<String>) -> Result<T, Self> {
        let fault = Fault::Wrong;
        let why = why.into();
        Err(Self { why, fault })
    }
}

/// The part of a tail that has been read.
#[derive(Default)]
pub(crate) struct Tail<G> {
    pub(crate) plan: ChunkPlan,
    pub(crate) grammar: G,
    used: Used,
}

impl<G: Grammar> Tail<G> {
    /// Adds the connection that a record describes, if it is a new one.
    ///
    /// # Errors
    /// As [`Grammar::describe`].
    pub(crate) fn describe(&mut self, what: &G::Description, data: &[u8]) -> Result<(), NoRecord> {
        let connections = &mut self.plan.connections;
        if let Some((raw, connection)) = self.grammar.describe(what, data, connections)? {
            connections.add(raw, connection);
        }
        Ok(())
    }

    /// Adds a chunk at byte `start` whose first and last message have these `times`, of which `counts` are the numbers of
    /// messages by connection, `None` if they are not stated. Its index is at the bytes `index`.
    ///
    /// # Errors
    /// If there are too many chunks.
    pub(crate) fn list(
        &mut self,
        (start, index): (u64, Range<u64>),
        (first, last): (Stamp, Stamp),
        counts: Option<Vec<(u32, u32)>>,
    ) -> Result<(), NoRecord> {
        if self.plan.chunks.len() >= MOST_CHUNKS {
            return Err(NoRecord::Broken);
        }
        let promised = counts.map(|counts| {
            let mut sum = IndexSum::default();
            for (raw, count) in counts {
                sum.add(raw, count);
                if count > 0 {
                    self.used.add(raw);
                }
            }
            sum
        });
        self.plan.chunks.push(Chunk {
            start,
            end: index.end,
            index,
            first,
            last,
            promised,
            seen: None,
        });
        Ok(())
    }

    /// Puts the chunks into the order of the file, each once.
    pub(crate) fn sort(&mut self) {
        self.plan.chunks.sort_by_key(|chunk| chunk.start);
        self.plan.chunks.dedup_by_key(|chunk| chunk.start);
    }

    /// Checks that all connections are described of which chunks are stated to contain messages. If not, the chunks themselves
    /// may describe the others.
    pub(crate) fn is_described(&self) -> Result<(), Unindexed> {
        let small = (0..).zip(&self.used.small).filter(|(_, used)| **used);
        let small = small.map(|(raw, _)| raw);
        let mut all = small.chain(self.used.large.iter().copied());
        if all.all(|raw| self.plan.connections.get(raw).is_some()) {
            return Ok(());
        }
        Unindexed::wrong("its index counts messages of undescribed connections")
    }
}

/// The numbers of the connections that chunks are stated to contain.
#[derive(Default)]
struct Used {
    /// Flags by number, up to the largest that real bags use.
    small: Vec<bool>,
    large: BTreeSet<u32>,
}

/// Numbers below this have flags.
const SMALL: usize = 1 << 16;

impl Used {
    /// Adds the number of a connection.
    fn add(&mut self, raw: u32) {
        let at = raw as usize;
        if at >= SMALL {
            self.large.insert(raw);
            return;
        }
        if self.small.len() <= at {
            self.small.resize(at + 1, false);
        }
        self.small[at] = true;
    }
}
