//! All log times of a mission in little memory: sorted blocks, written to an unnamed file once they grow large.
//!
//! Times arrive in any order and are returned sorted, so that the order of messages in a file never matters.

use std::cmp::Reverse;
use std::collections::binary_heap::PeekMut;
use std::collections::{BTreeMap, BinaryHeap};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::sync::{Mutex, PoisonError};

use tempfile::SpooledTempFile;

use crate::base::ids::{ById, ids};
use crate::base::time::{DAY, Span, Stamp};
use crate::base::varint::{put, take_u64};

/// The number of stamps per block: enough for a block's head (32 bytes) to be negligible, few enough to sort
/// in the cache.
const BLOCK: usize = 1024;
/// The number of bytes of encoded blocks kept in memory (8 to 20 million stamps) before they are written to a
/// file: hours of a robot without one, and little beside the 30 MB of the program itself.
const IN_MEMORY: usize = 16 << 20;
/// The number of stamps not yet in a block, of all series together (8 MB), at which all of them are put into blocks: with 20,000
/// topics each has 26 by then, so that blocks are not mostly head.
const MOST_OPEN: usize = 1 << 19;

/// The messages of one bag by day.
#[derive(Clone, Debug, Default)]
pub(crate) struct Calendar {
    /// The number of messages of each day since 1970, without those at exactly 0.
    pub(crate) days: BTreeMap<i64, u64>,
    /// The number of messages at exactly 0.
    pub(crate) zeros: u64,
    /// The first time after 0.
    pub(crate) next: Option<Stamp>,
}

impl Calendar {
    /// Adds sorted times.
    fn add(&mut self, sorted: &[(Stamp, u32)]) {
        let zeros = sorted.partition_point(|t| t.0 < Stamp(0));
        let (before, rest) = sorted.split_at(zeros);
        let (zeros, after) = rest.split_at(rest.partition_point(|t| t.0 == Stamp(0)));
        self.zeros += zeros.len() as u64;
        let next = after.first().map(|t| t.0);
        self.next = self.next.into_iter().chain(next).min();
        for part in [before, after] {
            for run in part.chunk_by(|a, b| a.0.0.div_euclid(DAY) == b.0.0.div_euclid(DAY)) {
                *self.days.entry(run[0].0.0.div_euclid(DAY)).or_default() += run.len() as u64;
            }
        }
    }
}

ids! {
    @pub(crate),
    /// The number of a sequence of times, counted from 0.
    SeriesId,
}

/// An encoded run of stamps and its position.
#[derive(Clone, Debug)]
struct StampBlock {
    first: Stamp,
    last: Stamp,
    at: u64,
    bytes: u32,
    count: u32,
}

#[derive(Clone, Debug, Default)]
struct OpenSeries {
    /// The bag that its times are of.
    bag: usize,
    open: Vec<(Stamp, u32)>,
    blocks: Vec<StampBlock>,
    count: u64,
    /// Whether some message came without its size.
    size_unknown: bool,
    bounds: Option<(Stamp, Stamp)>,
}

impl OpenSeries {
    /// Adds a block.
    fn hold(&mut self, block: StampBlock) {
        let (from, to) = self.bounds.unwrap_or((block.first, block.last));
        self.bounds = Some((from.min(block.first), to.max(block.last)));
        // Most sequences of a mission with very many names are one block.
        self.blocks
            .reserve_exact(usize::from(self.blocks.is_empty()));
        self.blocks.push(block);
    }
}

/// Any number of sequences of times, each message with its size if known.
#[derive(Debug, Default)]
pub(crate) struct Stamps {
    series: ById<SeriesId, OpenSeries>,
    spool: Spool,
    open: usize,
    /// The messages of each bag by day.
    calendars: ById<usize, Calendar>,
    failed: Option<io::Error>,
}

/// The temporary file of encoded blocks, and the number of bytes written to it.
#[derive(Debug)]
struct Spool {
    /// Locked because reading moves its position.
    file: Mutex<SpooledTempFile>,
    written: u64,
}

impl Default for Spool {
    fn default() -> Self {
        Self {
            file: Mutex::new(SpooledTempFile::new(IN_MEMORY)),
            written: 0,
        }
    }
}

impl Spool {
    /// Adds bytes; returns their position.
    fn append(&mut self, bytes: &[u8]) -> io::Result<u64> {
        let at = self.written;
        let file = self.file.get_mut();
        let file = file.unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(at))?;
        file.write_all(bytes)?;
        self.written += bytes.len() as u64;
        Ok(at)
    }

    /// The bytes of a block.
    fn bytes(&self, block: &StampBlock) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; block.bytes as usize];
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(block.at))?;
        file.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

impl Stamps {
    /// A new, empty sequence.
    pub(crate) fn series(&mut self) -> SeriesId {
        self.series_of(0)
    }

    /// A new, empty sequence of times of a bag.
    pub(crate) fn series_of(&mut self, bag: usize) -> SeriesId {
        self.series.push(OpenSeries {
            bag,
            ..OpenSeries::default()
        })
    }

    /// Adds times; `sizes`, if given, is as long as `stamps`. Times for a sequence that does not exist are
    /// dropped.
    pub(crate) fn add(&mut self, id: SeriesId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let Some(series) = self.series.get_mut(id) else {
            return;
        };
        let sizes = sizes.filter(|s| s.len() == stamps.len());
        series.size_unknown |= sizes.is_none() && !stamps.is_empty();
        for (at, stamp) in stamps.iter().enumerate() {
            let size = sizes.map_or(0, |s| s[at]);
            series.open.push((*stamp, size));
            if series.open.len() == BLOCK {
                self.open = self.open.saturating_sub(BLOCK - 1);
                close(series, &mut self.spool, &mut self.calendars)
                    .unwrap_or_else(|e| self.failed = Some(e));
            } else {
                self.open += 1;
            }
        }
        series.count += stamps.len() as u64;
        if self.open > MOST_OPEN {
            self.close_all();
        }
    }

    /// Encodes all open stamps as blocks.
    fn close_all(&mut self) {
        for series in self.series.iter_mut() {
            close(series, &mut self.spool, &mut self.calendars)
                .unwrap_or_else(|e| self.failed = Some(e));
        }
        self.open = 0;
    }

    /// The same sequences with the times from about `from` on, and the last of each; calendars keep their counts.
    ///
    /// # Errors
    /// If the unnamed file cannot be read or written.
    pub(crate) fn since(&self, from: Stamp) -> io::Result<Self> {
        let mut new = Self {
            calendars: self.calendars.clone(),
            ..Self::default()
        };
        for old in &self.series {
            let open = || old.open.iter().copied();
            let open_last = open().map(|(time, _)| time).max();
            let last = old.bounds.map(|(_, last)| last).max(open_last);
            let from = last.map_or(from, |last| from.min(last));
            let mut series = OpenSeries {
                bag: old.bag,
                open: open().filter(|(time, _)| *time >= from).collect(),
                size_unknown: old.size_unknown,
                ..OpenSeries::default()
            };
            series.count = series.open.len() as u64;
            new.open += series.open.len();
            for block in old.blocks.iter().filter(|block| block.last >= from) {
                let at = new.spool.append(&self.spool.bytes(block)?)?;
                series.hold(StampBlock {
                    at,
                    ..block.clone()
                });
                series.count += u64::from(block.count);
            }
            new.series.push(series);
        }
        Ok(new)
    }

    /// The first and the last of all times, and their number; `None` if there is none.
    pub(crate) fn extent(&self) -> Option<(Stamp, Stamp, u64)> {
        let open = |series: &OpenSeries| {
            let times = || series.open.iter().map(|(time, _)| *time);
            Some((times().min()?, times().max()?))
        };
        let ends = self.series.iter().flat_map(|s| [s.bounds, open(s)]);
        let (first, last) = ends.flatten().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        Some((first, last, self.series.iter().map(|s| s.count).sum()))
    }

    /// Finishes adding times.
    ///
    /// # Errors
    /// If times could not be written to the unnamed file.
    pub(crate) fn finish(&mut self) -> io::Result<()> {
        self.close_all();
        for series in self.series.iter_mut() {
            series.open = Vec::new();
            series.blocks.sort_by_key(|b| (b.first, b.last, b.at));
        }
        self.failed.take().map_or(Ok(()), Err)
    }

    /// The number of times in a sequence.
    pub(crate) fn count(&self, id: SeriesId) -> u64 {
        self.series.get(id).map_or(0, |s| s.count)
    }

    /// The number of times of a sequence in an interval.
    ///
    /// # Errors
    /// If the unnamed file cannot be read.
    pub(crate) fn count_in(&self, id: SeriesId, span: Span) -> io::Result<u64> {
        let blocks = self
            .series
            .get(id)
            .into_iter()
            .flat_map(|series| &series.blocks);
        let mut many = 0;
        for block in blocks.filter(|block| block.first < span.end && span.start <= block.last) {
            let is_inside = |(time, _): &&(Stamp, u32)| span.contains(*time);
            many += if span.contains(block.first) && span.contains(block.last) {
                u64::from(block.count)
            } else {
                self.load(block)?.iter().filter(is_inside).count() as u64
            };
        }
        Ok(many)
    }

    /// The first and last time of a sequence, as far as they are in blocks.
    pub(crate) fn bounds(&self, id: SeriesId) -> Option<(Stamp, Stamp)> {
        self.series.get(id).and_then(|s| s.bounds)
    }

    /// Whether every message of a sequence came with its size.
    pub(crate) fn sized(&self, id: SeriesId) -> bool {
        self.series.get(id).is_some_and(|s| !s.size_unknown)
    }

    /// The bag that the times of a sequence are of.
    pub(crate) fn bag_of(&self, id: SeriesId) -> usize {
        self.series.get(id).map_or(0, |series| series.bag)
    }

    /// The messages of each bag by day, as they were added and as far as they are in blocks.
    pub(crate) fn calendars(&self) -> &ById<usize, Calendar> {
        &self.calendars
    }

    /// All times of one sequence, sorted.
    ///
    /// # Errors
    /// If the unnamed file cannot be read.
    pub(crate) fn times(&self, id: SeriesId) -> io::Result<Vec<Stamp>> {
        let mut times = Vec::new();
        self.merge(&[id], |timed| times.push(timed.time))?;
        Ok(times)
    }

    /// Moves the times from `at` on into a new sequence.
    ///
    /// # Errors
    /// If the unnamed file cannot be read or written.
    pub(crate) fn split(&mut self, id: SeriesId, at: Stamp) -> io::Result<SeriesId> {
        let mut early = Vec::new();
        self.merge(&[id], |timed| early.push((timed.time, timed.size)))?;
        let late = early.split_off(early.partition_point(|(time, _)| *time < at));
        let sized = self.sized(id);
        let rest = self.series_of(self.bag_of(id));
        self.fill(id, &early, sized)?;
        self.fill(rest, &late, sized)?;
        Ok(rest)
    }

    /// Removes the times of a sequence outside of an interval; returns their number.
    ///
    /// # Errors
    /// If the unnamed file cannot be read or written.
    pub(crate) fn clip(&mut self, id: SeriesId, span: Span) -> io::Result<u64> {
        let is_inside = |(first, last)| span.contains(first) && span.contains(last);
        if self.bounds(id).is_none_or(is_inside) {
            return Ok(0);
        }
        let mut kept = Vec::new();
        self.merge(&[id], |timed| {
            if span.contains(timed.time) {
                kept.push((timed.time, timed.size));
            }
        })?;
        let removed = self.count(id) - kept.len() as u64;
        self.fill(id, &kept, self.sized(id))?;
        Ok(removed)
    }

    /// Replaces the times of a sequence by these, sorted, which its calendar contains already.
    fn fill(&mut self, id: SeriesId, times: &[(Stamp, u32)], sized: bool) -> io::Result<()> {
        let Some(series) = self.series.get_mut(id) else {
            return Ok(());
        };
        *series = OpenSeries {
            bag: series.bag,
            count: times.len() as u64,
            size_unknown: !sized,
            ..OpenSeries::default()
        };
        for block in times.chunks(BLOCK) {
            series.open = block.to_vec();
            close(series, &mut self.spool, &mut ById::default())?;
        }
        series.open = Vec::new();
        Ok(())
    }

    fn load(&self, block: &StampBlock) -> io::Result<Vec<(Stamp, u32)>> {
        let bytes = self.spool.bytes(block)?;
        Ok(decode(&bytes, block.count as usize))
    }
}

/// Sorts and writes the open stamps of a series.
fn close(
    series: &mut OpenSeries,
    spool: &mut Spool,
    calendars: &mut ById<usize, Calendar>,
) -> io::Result<()> {
    let mut open = std::mem::take(&mut series.open);
    if !open.is_sorted() {
        open.sort_unstable();
    }
    let (Some(first), Some(last)) = (open.first(), open.last()) else {
        return Ok(());
    };
    let (first, last) = (first.0, last.0);
    calendars.grown(series.bag).add(&open);
    let bytes = encode(&open);
    series.hold(StampBlock {
        first,
        last,
        at: spool.append(&bytes)?,
        bytes: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
        count: u32::try_from(open.len()).unwrap_or(u32::MAX),
    });
    open.clear();
    series.open = open;
    Ok(())
}

// A sorted run of stamps as bytes: differences as variable-length numbers, then the sizes.

/// Writes sorted stamps with their sizes.
fn encode(run: &[(Stamp, u32)]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(run.len() * 6);
    let mut before = 0_i64;
    for (stamp, _) in run {
        // Wraps around on purpose: any two stamps differ by less than 2^64.
        put(&mut bytes, stamp.0.wrapping_sub(before).cast_unsigned());
        before = stamp.0;
    }
    if run.iter().any(|(_, size)| *size != 0) {
        for (_, size) in run {
            put(&mut bytes, u64::from(*size));
        }
    }
    bytes
}

/// Reads `count` stamps back; sizes are 0 if none were written.
fn decode(mut bytes: &[u8], count: usize) -> Vec<(Stamp, u32)> {
    let mut before = 0_i64;
    let mut run = Vec::with_capacity(count);
    for _ in 0..count {
        before = before.wrapping_add(take_u64(&mut bytes).cast_signed());
        run.push((Stamp(before), 0));
    }
    if !bytes.is_empty() {
        for (_, size) in &mut run {
            *size = u32::try_from(take_u64(&mut bytes)).unwrap_or(u32::MAX);
        }
    }
    run
}

// Several sequences of sorted blocks as one sorted sequence.

/// One time from one of several sequences.
#[derive(Clone, Copy)]
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
        let of = |id: &SeriesId| self.series.get(*id).map_or(&[][..], |s| &s.blocks);
        let all = (0..).zip(ids);
        let all = all.flat_map(|(place, id)| of(id).iter().map(move |b| (place, b.clone())));
        let mut all: Vec<_> = all.collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    fn stamps(times: impl IntoIterator<Item = i64>) -> Vec<Stamp> {
        times.into_iter().map(Stamp).collect()
    }

    #[test]
    fn values_are_returned_sorted() {
        let mut all = Stamps::default();
        let id = all.series();
        for part in [5000..9000, 0..3000, 2500..5000] {
            all.add(id, &stamps(part), None);
        }
        all.finish().unwrap();
        let mut expected: Vec<i64> = (0..9000).chain(2500..3000).collect();
        expected.sort_unstable();
        assert_eq!(all.times(id).unwrap(), stamps(expected));
        assert_eq!(all.count(id), 9500);
        assert_eq!(all.bounds(id), Some((Stamp(0), Stamp(8999))));
        let count = |from, to| all.count_in(id, Span::new(Stamp(from), Stamp(to))).unwrap();
        assert_eq!(
            [count(0, 9000), count(10, 2600), count(9000, 9999)],
            [9500, 2690, 0]
        );
    }

    #[test]
    fn the_whole_range_of_time_is_kept() {
        let mut all = Stamps::default();
        let id = all.series();
        let odd = [i64::MAX, 0, i64::MIN, -1];
        all.add(id, &stamps(odd), Some(&[1, u32::MAX, 3, 4]));
        all.finish().unwrap();
        let mut seen = Vec::new();
        all.merge(&[id], |t| seen.push((t.time.0, t.size))).unwrap();
        assert_eq!(seen, [(i64::MIN, 3), (-1, 4), (0, u32::MAX), (i64::MAX, 1)]);
        assert!(all.sized(id));
    }

    #[test]
    fn a_sequence_is_divided_at_a_time() {
        let mut all = Stamps::default();
        let id = all.series();
        all.add(id, &stamps([5, 1, 3, DAY]), Some(&[50, 10, 30, 7]));
        all.finish().unwrap();
        let rest = all.split(id, Stamp(3)).unwrap();
        assert_eq!(all.times(id).unwrap(), stamps([1]));
        assert_eq!(all.times(rest).unwrap(), stamps([3, 5, DAY]));
        assert!(all.sized(id) && all.sized(rest));
        assert_eq!((all.count(id), all.count(rest)), (1, 3));
        assert_eq!(all.calendars()[0].days.values().sum::<u64>(), 4);
    }

    #[test]
    fn times_outside_of_an_interval_are_removed() {
        let mut all = Stamps::default();
        let id = all.series_of(7);
        all.add(id, &stamps([5, 0, 3, 0]), Some(&[50, 10, 30, 7]));
        all.finish().unwrap();
        let calendar = &all.calendars()[7];
        assert_eq!((calendar.zeros, calendar.next), (2, Some(Stamp(3))));
        let span = Span::new(Stamp(1), Stamp(5));
        assert_eq!((all.clip(id, span).unwrap(), all.count(id)), (3, 1));
        assert_eq!(all.clip(id, span).unwrap(), 0);
        assert_eq!(all.bounds(id), Some((Stamp(3), Stamp(3))));
        assert!(all.sized(id));
    }

    #[test]
    fn a_copy_of_the_newest_times_leaves_out_whole_blocks_and_keeps_the_last_of_all() {
        let mut all = Stamps::default();
        let id = all.series();
        all.add(id, &stamps(0..5000), None);
        let new = all.since(Stamp(2500));
        let mut new = new.unwrap();
        assert_eq!(new.extent(), Some((Stamp(2048), Stamp(4999), 2952)));
        new.add(id, &stamps([6000]), None);
        new.finish().unwrap();
        assert_eq!(new.times(id).unwrap(), stamps((2048..5000).chain([6000])));
        assert_eq!(all.extent(), Some((Stamp(0), Stamp(4999), 5000)));
        let latched = all.series();
        all.add(latched, &stamps([1, 7]), None);
        let mut new = all.since(Stamp(9000)).unwrap();
        new.finish().unwrap();
        assert_eq!(new.times(latched).unwrap(), stamps([7]));
        assert_eq!(new.count(id), 1);
    }

    #[test]
    fn many_stamps_are_spilled_and_read_back() {
        let mut all = Stamps::default();
        let ids: Vec<_> = (0..3).map(|_| all.series()).collect();
        // Far apart, so that each takes many bytes.
        for (n, id) in (0..1_500_000).zip(ids.iter().cycle()) {
            all.add(*id, &[Stamp(n << 42)], None);
        }
        all.finish().unwrap();
        let is_rolled = all.spool.file.get_mut().unwrap().is_rolled();
        assert!(is_rolled || all.spool.written <= IN_MEMORY as u64);
        let mut next = 0;
        all.merge(&ids, |t| {
            assert_eq!(t.time, Stamp(next << 42));
            next += 1;
        })
        .unwrap();
        assert_eq!(next, 1_500_000);
    }
}
