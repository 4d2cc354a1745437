//! Several sequences of sorted blocks as one sorted sequence.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;
use std::io;

use super::{SeriesId, StampBlock, Stamps};
use crate::base::time::Stamp;

/// One time from one of several sequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Timed {
    /// The time.
    pub time: Stamp,
    /// The index of the sequence among the requested ones.
    pub series: usize,
    /// The payload's bytes; 0 if unknown ([`Stamps::sized`]).
    pub size: u32,
}

/// The next stamp of a block being read, in the order in which they are passed on. Small, since each step
/// moves several.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Next {
    time: Stamp,
    series: usize,
    size: u32,
    /// The index of its block among those being read.
    block: u32,
}

/// The blocks being read, and the free slots of those that were read completely.
#[derive(Default)]
struct OpenBlocks {
    runs: Vec<std::vec::IntoIter<(Stamp, u32)>>,
    free: Vec<u32>,
    heap: BinaryHeap<Reverse<Next>>,
}

impl Stamps {
    /// Passes all times of some sequences to `each`, sorted by (time, index of the sequence, size).
    ///
    /// # Errors
    /// If the unnamed file cannot be read.
    pub(crate) fn merge(&self, ids: &[SeriesId], mut each: impl FnMut(Timed)) -> io::Result<()> {
        let mut waiting = self.blocks(ids);
        let mut open = OpenBlocks::default();
        loop {
            let top = open.heap.peek().map(|next| next.0.time);
            let next = waiting.last().map(|(_, block)| block.first);
            match (top, next) {
                (None, None) => return Ok(()),
                (top, Some(next)) if top.is_none_or(|top| next <= top) => {
                    if let Some((series, block)) = waiting.pop() {
                        open.enter(series, self.load(&block)?);
                    }
                }
                _ => open.drain(next, &mut each),
            }
        }
    }

    /// The blocks of these sequences with the indices of the sequences, the earliest last.
    fn blocks(&self, ids: &[SeriesId]) -> Vec<(usize, StampBlock)> {
        let of = |id: &SeriesId| self.get(*id).map_or(&[][..], |s| &s.blocks);
        let mut all: Vec<_> = ids
            .iter()
            .enumerate()
            .flat_map(|(place, id)| of(id).iter().map(move |b| (place, b.clone())))
            .collect();
        all.sort_by_key(|(place, b)| Reverse((b.first, *place, b.at)));
        all
    }
}

impl OpenBlocks {
    /// Begins to read a block.
    fn enter(&mut self, series: usize, run: Vec<(Stamp, u32)>) {
        let mut run = run.into_iter();
        let Some((time, size)) = run.next() else {
            return;
        };
        let block = self.free.pop().unwrap_or_else(|| {
            self.runs.push(Vec::new().into_iter());
            u32::try_from(self.runs.len() - 1).unwrap_or(u32::MAX)
        });
        self.runs[block as usize] = run;
        self.heap.push(Reverse(Next {
            time,
            series,
            size,
            block,
        }));
    }

    /// Passes on stamps until a waiting block begins before them.
    fn drain(&mut self, waiting: Option<Stamp>, each: &mut impl FnMut(Timed)) {
        while let Some(mut top) = self.heap.peek_mut() {
            let next = &mut top.0;
            if waiting.is_some_and(|waiting| waiting <= next.time) {
                return;
            }
            let (time, series, size) = (next.time, next.series, next.size);
            each(Timed { time, series, size });
            let block = next.block;
            if let Some((time, size)) = self.runs[block as usize].next() {
                (next.time, next.size) = (time, size);
            } else {
                self.free.push(block);
                PeekMut::pop(top);
            }
        }
    }
}
