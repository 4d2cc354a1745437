//! The rows of one element over all windows, as bytes: the lengths of its absences, the lengths without
//! changes, and the differences from the previous window.

use super::row::{Number, Row};
use crate::base::varint::{put, take, take_u64};
use crate::evidence::Confidence;
use crate::graph::State;

/// The rows of one element over all windows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Column {
    bytes: Box<[u8]>,
}

// The kind of the next byte; any other is a row, with bits for the parts that differ.
const AWAY: u8 = 0x80;
const SAME: u8 = 0x40;
// The parts of a row.
const LOOK: u8 = 1;
const COUNT: u8 = 2;
const BYTES: u8 = 4;
const MEDIAN: u8 = 8;
const GAP: u8 = 16;
const RATE: u8 = 32;
/// Always with [`LOOK`], so that it is not confused with [`SAME`].
const MEASURES: u8 = 64;

/// The state that writer and reader share: the rows so far.
#[derive(Clone, Copy, Debug)]
struct Memory {
    row: Row,
    /// The last whole numbers of the median, the gap, the rate, jitter and age.
    halves: [i64; 5],
}

impl Default for Memory {
    fn default() -> Self {
        Self {
            row: Row::new(State::Active, Confidence::Measured),
            halves: [0; 5],
        }
    }
}

/// A writer of the rows of an element in order of their windows.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColumnWriter {
    bytes: Vec<u8>,
    memory: Memory,
    /// The next window.
    next: usize,
    /// The number of windows up to `next` that repeat the last row.
    same: u64,
    is_there: bool,
}

impl ColumnWriter {
    /// Adds the row of a window; ignored if the window is before `next`.
    pub(crate) fn push(&mut self, window: usize, row: Row) {
        let Some(away) = window.checked_sub(self.next) else {
            return;
        };
        self.next = window + 1;
        if away == 0 && self.is_there && row == self.memory.row {
            self.same += 1;
            return;
        }
        self.end_run();
        if away > 0 {
            self.bytes.push(AWAY);
            put(&mut self.bytes, away as u64);
        }
        self.row(&row);
        self.is_there = true;
    }

    fn end_run(&mut self) {
        if self.same > 0 {
            self.bytes.push(SAME);
            put(&mut self.bytes, self.same);
            self.same = 0;
        }
    }

    fn row(&mut self, row: &Row) {
        let old = self.memory.row;
        let look = |row: &Row| (row.state, row.confidence, row.lifecycle);
        let measures = |row: &Row| (row.drops, row.jitter, row.age);
        let parts = [
            (LOOK, look(row) != look(&old)),
            (COUNT, row.count != old.count),
            (BYTES, row.bytes != old.bytes),
            (MEDIAN, row.median != old.median),
            (GAP, row.gap != old.gap),
            (RATE, row.rate != old.rate),
            (MEASURES | LOOK, measures(row) != measures(&old)),
        ];
        let tag = parts.iter().filter(|(_, differs)| *differs);
        let tag = tag.fold(0, |tag, (bit, _)| tag | bit);
        let bytes = &mut self.bytes;
        bytes.push(tag);
        if tag & LOOK != 0 {
            bytes.push(row.state as u8 | (row.confidence as u8) << 4);
            put(bytes, u64::from(row.lifecycle));
        }
        if tag & COUNT != 0 {
            put_count(bytes, old.count, row.count);
        }
        if tag & BYTES != 0 {
            put_count(bytes, old.bytes, row.bytes);
        }
        let halves = &mut self.memory.halves;
        if tag & MEDIAN != 0 {
            put_number(bytes, &mut halves[0], row.median);
        }
        if tag & GAP != 0 {
            put_number(bytes, &mut halves[1], row.gap);
        }
        if tag & RATE != 0 {
            bytes.push(u8::from(row.rate.is_some()));
            if let Some(rate) = row.rate {
                put_number(bytes, &mut halves[2], rate);
            }
        }
        if tag & MEASURES != 0 {
            put_count(bytes, old.drops, row.drops);
            put_number(bytes, &mut halves[3], row.jitter);
            put_number(bytes, &mut halves[4], row.age);
        }
        self.memory.row = *row;
    }

    /// The finished column.
    pub(crate) fn finish(mut self) -> Column {
        self.end_run();
        Column {
            bytes: self.bytes.into(),
        }
    }
}

impl Column {
    /// The number of bytes.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.bytes.len()
    }

    /// A cursor at the first window.
    pub(crate) fn cursor(&self) -> ColumnCursor<'_> {
        ColumnCursor {
            bytes: &self.bytes,
            memory: Memory::default(),
            away: 0,
            same: 0,
        }
    }
}

/// A cursor over a column.
#[derive(Clone, Debug)]
pub(crate) struct ColumnCursor<'a> {
    bytes: &'a [u8],
    memory: Memory,
    away: u64,
    same: u64,
}

impl ColumnCursor<'_> {
    /// The row of the next window; `None` if the element does not exist, and after the last.
    pub(crate) fn next(&mut self) -> Option<Row> {
        if self.same > 0 {
            self.same -= 1;
            return Some(self.memory.row);
        }
        if self.away == 0 && self.bytes.first() == Some(&AWAY) {
            self.bytes = &self.bytes[1..];
            self.away = take_u64(&mut self.bytes);
        }
        if self.away > 0 {
            self.away -= 1;
            return None;
        }
        let (tag, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        self.row(*tag);
        if self.bytes.first() == Some(&SAME) {
            self.bytes = &self.bytes[1..];
            self.same = take_u64(&mut self.bytes);
        }
        Some(self.memory.row)
    }

    /// The row of the next window as [`Self::next`], and the number of windows for which it is unchanged, ≥
    /// 1.
    pub(crate) fn next_run(&mut self) -> (Option<Row>, u64) {
        let row = self.next();
        let more = match row {
            Some(_) => std::mem::take(&mut self.same),
            None if self.away == 0 && self.bytes.is_empty() => u64::MAX - 1,
            None => std::mem::take(&mut self.away),
        };
        (row, more.saturating_add(1))
    }

    fn row(&mut self, tag: u8) {
        let (bytes, Memory { row, halves }) = (&mut self.bytes, &mut self.memory);
        if tag & LOOK != 0 {
            let look = take_byte(bytes);
            let (state, confidence) = (usize::from(look & 15), usize::from(look >> 4));
            row.state = State::ALL.get(state).copied().unwrap_or(row.state);
            row.confidence = Confidence::ALL
                .get(confidence)
                .copied()
                .unwrap_or(row.confidence);
            row.lifecycle = u32::try_from(take(bytes)).unwrap_or(0);
        }
        if tag & COUNT != 0 {
            row.count = take_count(bytes, row.count);
        }
        if tag & BYTES != 0 {
            row.bytes = take_count(bytes, row.bytes);
        }
        if tag & MEDIAN != 0 {
            row.median = take_number(bytes, &mut halves[0]);
        }
        if tag & GAP != 0 {
            row.gap = take_number(bytes, &mut halves[1]);
        }
        if tag & RATE != 0 {
            let is_given = take_byte(bytes) == 1;
            row.rate = is_given.then(|| take_number(bytes, &mut halves[2]));
        }
        if tag & MEASURES != 0 {
            row.drops = take_count(bytes, row.drops);
            row.jitter = take_number(bytes, &mut halves[3]);
            row.age = take_number(bytes, &mut halves[4]);
        }
    }
}

fn take_byte(bytes: &mut &[u8]) -> u8 {
    let Some((byte, rest)) = bytes.split_first() else {
        return 0;
    };
    *bytes = rest;
    *byte
}

/// A number of either sign as an unsigned one; small stays small.
fn folded(value: i64) -> u128 {
    u128::from((value.wrapping_shl(1) ^ (value >> 63)).cast_unsigned())
}

#[expect(clippy::cast_possible_truncation, reason = "the value has 64 bits")]
fn unfolded(value: u128) -> i64 {
    let value = value as u64;
    (value >> 1).cast_signed() ^ -(value & 1).cast_signed()
}

/// Writes a count: 0 for none, else the difference.
fn put_count(bytes: &mut Vec<u8>, old: Option<u64>, new: Option<u64>) {
    let step = |new: u64| new.wrapping_sub(old.unwrap_or(0)).cast_signed();
    put(bytes, new.map_or(0, |new| folded(step(new)) + 1));
}

fn take_count(bytes: &mut &[u8], old: Option<u64>) -> Option<u64> {
    let step = unfolded(take(bytes).checked_sub(1)?);
    Some(old.unwrap_or(0).wrapping_add(step.cast_unsigned()))
}

/// Writes a number: 0 for none, 1 for bits, else the difference to the last whole one.
fn put_number(bytes: &mut Vec<u8>, last: &mut i64, number: Number) {
    match number {
        Number::Unknown => put(bytes, 0_u8),
        Number::Bits(bits) => {
            put(bytes, 1_u8);
            bytes.extend(bits.to_le_bytes());
        }
        Number::Halves(halves) => {
            put(bytes, folded(halves.wrapping_sub(*last)) + 2);
            *last = halves;
        }
    }
}

fn take_number(bytes: &mut &[u8], last: &mut i64) -> Number {
    match take(bytes) {
        0 => Number::Unknown,
        1 => {
            let bits = bytes.get(..8).and_then(|b| b.try_into().ok());
            *bytes = bytes.get(8..).unwrap_or_default();
            Number::Bits(bits.map_or(0, u64::from_le_bytes))
        }
        step => {
            *last = last.wrapping_add(unfolded(step - 2));
            Number::Halves(*last)
        }
    }
}
