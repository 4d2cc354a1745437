//! Several sequences of sorted blocks as one sorted sequence.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io;

use super::{SeriesId, StampBlock, Stamps};
use crate::base::time::Stamp;

/// One time out of several sequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Timed {
    /// The time.
    pub time: Stamp,
    /// The place of the sequence among those asked for.
    pub series: usize,
    /// The payload's bytes; 0 where not known ([`Stamps::sized`]).
    pub size: u32,
}

/// A block being read: ordered by its next stamp, then by the place of its sequence.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct OpenBlock {
    next: (Stamp, usize, u32),
    at: usize,
    run: Vec<(Stamp, u32)>,
}

impl Stamps {
    /// Passes all times of some sequences to `each`, sorted by (time, place of the sequence, size).
    ///
    /// # Errors
    /// If the unnamed file cannot be read.
    pub(crate) fn merge(&self, ids: &[SeriesId], mut each: impl FnMut(Timed)) -> io::Result<()> {
        let mut waiting = self.blocks(ids);
        let mut open: BinaryHeap<Reverse<OpenBlock>> = BinaryHeap::new();
        loop {
            let top = open.peek().map(|o| o.0.next.0);
            let next = waiting.last().map(|(_, block)| block.first);
            match (top, next) {
                (None, None) => return Ok(()),
                (top, Some(next)) if top.is_none_or(|top| next <= top) => {
                    if let Some((series, block)) = waiting.pop() {
                        let run = self.load(&block)?;
                        open.extend(enter(series, run).map(Reverse));
                    }
                }
                _ => drain(&mut open, next, &mut each),
            }
        }
    }

    /// The blocks of these sequences with the places of the sequences, the earliest last.
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

fn enter(series: usize, run: Vec<(Stamp, u32)>) -> Option<OpenBlock> {
    let (time, size) = *run.first()?;
    Some(OpenBlock {
        next: (time, series, size),
        at: 0,
        run,
    })
}

/// Passes on the earliest block's stamps as long as no other block, open or waiting, comes before them.
fn drain(
    open: &mut BinaryHeap<Reverse<OpenBlock>>,
    waiting: Option<Stamp>,
    each: &mut impl FnMut(Timed),
) {
    let Some(Reverse(mut block)) = open.pop() else {
        return;
    };
    let rival = open.peek().map(|o| o.0.next);
    loop {
        let (time, series, size) = block.next;
        each(Timed { time, series, size });
        block.at += 1;
        let Some((time, size)) = block.run.get(block.at) else {
            return;
        };
        block.next = (*time, series, *size);
        let behind = rival.is_some_and(|rival| rival < block.next);
        if behind || waiting.is_some_and(|waiting| waiting <= *time) {
            open.push(Reverse(block));
            return;
        }
    }
}
