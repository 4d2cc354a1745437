//! The graphs of all windows in little memory: per element the windows in which it is unchanged, and
//! differences elsewhere. Memory grows with the changes, not with the number of windows.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::cast;
use crate::base::time::Span;
use crate::base::varint::{put, take, take_u64};
use crate::evidence::Confidence;
use crate::graph::{
    Element, ElementState, Elements, Graph, Measures, PerElement, State, per_second,
};

/// A graph per window, in order.
#[derive(Clone, Debug, Default)]
pub struct Graphs {
    /// The times of the windows.
    spans: Vec<Span>,
    /// The lifecycle states that occur; rows refer to them by number, counted from 1.
    lifecycles: Vec<Arc<str>>,
    /// The rows of each element; those after the last existing one of a kind may be left out.
    columns: PerElement<Column>,
}

impl Graphs {
    /// The number of windows.
    pub fn len(&self) -> usize {
        self.spans.len()
    }

    /// Whether there are no windows.
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// The times of the windows, in order.
    pub(crate) fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// The graphs in order, each built on demand.
    pub fn iter(&self) -> Iter<'_> {
        let columns = self.columns.0.each_ref();
        Iter {
            all: self,
            next: 0,
            cursors: columns.map(|list| list.iter().map(Column::cursor).collect()),
        }
    }

    /// The graph of one window, computed from all previous ones: for many, use [`Self::iter`].
    pub fn get(&self, window: usize) -> Option<Graph> {
        self.iter().nth(window)
    }

    /// A cursor over the rows of an element; `None` if it exists in no window.
    fn cursor(&self, what: Element) -> Option<ColumnCursor<'_>> {
        self.columns.of(what).map(Column::cursor)
    }

    /// The rows of an element in the windows in which it exists, in order, with the indices of the windows.
    pub(crate) fn rows(&self, what: Element) -> impl Iterator<Item = (usize, Row)> + '_ {
        let mut cursor = self.cursor(what);
        let row = move |at| {
            let row = cursor.as_mut().and_then(ColumnCursor::next);
            row.map(|row| (at, row))
        };
        (0..self.spans.len()).filter_map(row)
    }

    /// The indices of the windows from which an element exists (`true`) or no longer exists.
    pub(crate) fn presence_changes(&self, what: Element) -> Vec<(usize, bool)> {
        let mut found = Vec::new();
        let Some(mut cursor) = self.cursor(what) else {
            return found;
        };
        let (mut at, mut exists) = (0, false);
        while at < self.spans.len() {
            let (row, stays) = cursor.next_run();
            if row.is_some() != exists {
                exists = !exists;
                found.push((at, exists));
            }
            at = at.saturating_add(usize::try_from(stays).unwrap_or(usize::MAX));
        }
        found
    }

    /// The strongest confidence to which each element is known in any window.
    pub(crate) fn confidences(&self, elements: &Elements) -> PerElement<Confidence> {
        PerElement::new(elements, |what| {
            let confidences = self.rows(what).map(|(_, row)| row.confidence);
            confidences.min().unwrap_or(Confidence::Declared)
        })
    }

    /// The lifecycle state in a row.
    pub(crate) fn lifecycle(&self, row: &Row) -> Option<&Arc<str>> {
        self.lifecycles
            .get((row.lifecycle as usize).checked_sub(1)?)
    }

    /// A walk through all windows that yields only differences from the previous one.
    pub(crate) fn walk(&self) -> ColumnWalk<'_> {
        ColumnWalk::new(&self.columns.0)
    }
}

impl PartialEq for Graphs {
    /// Whether all graphs are equal; the numbers of lifecycle states do not matter.
    fn eq(&self, other: &Self) -> bool {
        self.spans == other.spans && self.iter().eq(other)
    }
}

/// The graphs of a mission's windows, one after the other.
#[derive(Clone, Debug)]
pub struct Iter<'a> {
    all: &'a Graphs,
    next: usize,
    cursors: [Vec<ColumnCursor<'a>>; 4],
}

impl Iterator for Iter<'_> {
    type Item = Graph;

    fn next(&mut self) -> Option<Graph> {
        let span = *self.all.spans.get(self.next)?;
        let mut states = Vec::with_capacity(self.cursors.iter().map(Vec::len).sum());
        for (of, cursors) in Element::KINDS.into_iter().zip(&mut self.cursors) {
            let rows = cursors.iter_mut().enumerate();
            states.extend(rows.filter_map(|(at, cursor)| {
                let row = cursor.next()?;
                Some(row.state(of(at), span, self.all.lifecycle(&row)))
            }));
        }
        self.next += 1;
        Some(Graph { states })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.all.spans.len() - self.next;
        (left, Some(left))
    }

    fn nth(&mut self, many: usize) -> Option<Graph> {
        let passed = many.min(self.all.spans.len() - self.next);
        for cursor in self.cursors.iter_mut().flatten() {
            (0..passed).for_each(|_| _ = cursor.next());
        }
        self.next += passed;
        self.next()
    }
}

impl ExactSizeIterator for Iter<'_> {}

impl<'a> IntoIterator for &'a Graphs {
    type Item = Graph;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

/// A writer of the graphs of windows, element by element.
pub(crate) struct GraphsWriter(Graphs);

impl GraphsWriter {
    /// A writer for these windows, without any states.
    pub(crate) fn new(spans: Vec<Span>) -> Self {
        Self(Graphs {
            spans,
            ..Graphs::default()
        })
    }

    /// Sets all rows of an element.
    pub(crate) fn element(&mut self, what: Element, rows: ColumnWriter) {
        let (kind, id) = what.place();
        let columns = &mut self.0.columns.0[kind];
        if columns.len() <= id {
            columns.resize_with(id + 1, Column::default);
        }
        columns[id] = rows.finish();
    }

    /// A copy of the rows of an element that has been set.
    pub(crate) fn column(&self, what: Element) -> Option<Column> {
        self.0.columns.of(what).cloned()
    }

    /// The number of a lifecycle state in rows, counted from 1; states are few.
    pub(crate) fn lifecycle(&mut self, word: &Arc<str>) -> u32 {
        let words = &mut self.0.lifecycles;
        let found = words.iter().position(|w| w == word).unwrap_or_else(|| {
            words.push(Arc::clone(word));
            words.len() - 1
        });
        u32::try_from(found + 1).unwrap_or(0)
    }

    /// The finished graphs.
    pub(crate) fn finish(mut self) -> Graphs {
        self.0.columns.0.iter_mut().for_each(Vec::shrink_to_fit);
        self.0
    }
}

impl FromIterator<(Span, Graph)> for Graphs {
    fn from_iter<I: IntoIterator<Item = (Span, Graph)>>(graphs: I) -> Self {
        let mut all = GraphsWriter::new(Vec::new());
        let mut columns: BTreeMap<Element, ColumnWriter> = BTreeMap::new();
        for (at, (span, graph)) in graphs.into_iter().enumerate() {
            all.0.spans.push(span);
            for state in &graph.states {
                let lifecycle = state.lifecycle.as_ref();
                let lifecycle = lifecycle.map_or(0, |word| all.lifecycle(word));
                let rows = columns.entry(state.what).or_default();
                rows.push(at, Row::of(state, span, lifecycle));
            }
        }
        for (what, rows) in columns {
            all.element(what, rows);
        }
        all.finish()
    }
}

// The state of a node, topic or edge in one window, in one form: exact integers where numbers come from integers.

/// A number, as an integer where possible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Number {
    #[default]
    Unknown,
    /// Seconds as a whole number of half nanoseconds.
    Halves(i64),
    /// Any other number, by its bits.
    Bits(u64),
}

impl Number {
    pub(crate) fn of(value: Option<f64>) -> Self {
        let Some(value) = value else {
            return Self::Unknown;
        };
        let halves = libm::round(value * 2e9);
        let exact = Self::Halves(cast::to_i64(halves));
        let bits = value.to_bits();
        let is_exact = halves.abs() < EXACT && exact.value().map(f64::to_bits) == Some(bits);
        if is_exact { exact } else { Self::Bits(bits) }
    }

    pub(crate) fn value(self) -> Option<f64> {
        match self {
            Self::Unknown => None,
            Self::Halves(halves) => Some(halves as f64 / 2.0 / 1e9),
            Self::Bits(bits) => Some(f64::from_bits(bits)),
        }
    }
}

/// The number below which integers are exact in a float, 2^53, rounded down.
const EXACT: f64 = 9e15;

/// The state of one element in one window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) state: State,
    pub(crate) confidence: Confidence,
    /// The number of its lifecycle state, counted from 1; 0 for none.
    pub(crate) lifecycle: u32,
    /// The number of messages; for a node, those from which its rate is computed.
    pub(crate) count: Option<u64>,
    pub(crate) bytes: Option<u64>,
    pub(crate) median: Number,
    pub(crate) gap: Number,
    pub(crate) drops: Option<u64>,
    pub(crate) jitter: Number,
    pub(crate) age: Number,
    /// The rate, if it differs from the count divided by the window's length.
    pub(crate) rate: Option<Number>,
}

impl Row {
    pub(crate) fn new(state: State, confidence: Confidence) -> Self {
        Self {
            state,
            confidence,
            ..Self::default()
        }
    }

    pub(crate) fn with_measures(self, measures: &Measures) -> Self {
        Self {
            drops: measures.drops,
            jitter: Number::of(measures.jitter_s),
            age: Number::of(measures.age_s),
            ..self
        }
    }

    /// With this rate in a window `span`.
    pub(crate) fn with_hz(self, hz: Option<f64>, span: Span) -> Self {
        let row = Self { rate: None, ..self };
        let follows = row.hz(span).map(f64::to_bits) == hz.map(f64::to_bits);
        Self {
            rate: (!follows).then(|| Number::of(hz)),
            ..row
        }
    }

    /// Further measurements of the window.
    pub(crate) fn measures(&self) -> Measures {
        Measures {
            drops: self.drops,
            jitter_s: self.jitter.value(),
            age_s: self.age.value(),
        }
    }

    /// Messages per second in a window of this length.
    pub(crate) fn hz(&self, span: Span) -> Option<f64> {
        match self.rate {
            Some(rate) => rate.value(),
            None => self.count.and_then(|count| per_second(count, span)),
        }
    }

    /// The row of a state in the window `span`; `lifecycle` is the number of its lifecycle state.
    fn of(state: &ElementState, span: Span, lifecycle: u32) -> Self {
        let sent = || {
            let count = libm::round(state.hz? * span.nanos() as f64 / 1e9);
            let is_exact = (0.0..EXACT).contains(&count);
            is_exact.then(|| cast::to_u64(count))
        };
        let row = Self {
            lifecycle,
            count: match state.what {
                Element::Node(_) => sent(),
                _ => state.count,
            },
            bytes: state.bytes,
            median: Number::of(state.median_period_s),
            gap: Number::of(state.max_gap_s),
            ..Self::new(state.state, state.confidence).with_measures(&state.measures)
        };
        row.with_hz(state.hz, span)
    }

    /// The state of an element in the window `span`.
    fn state(&self, what: Element, span: Span, lifecycle: Option<&Arc<str>>) -> ElementState {
        ElementState {
            count: match what {
                Element::Node(_) => None,
                Element::Topic(_) => Some(self.count.unwrap_or(0)),
                _ => self.count,
            },
            bytes: self.bytes,
            hz: self.hz(span),
            median_period_s: self.median.value(),
            max_gap_s: self.gap.value(),
            lifecycle: lifecycle.map(Arc::clone),
            measures: self.measures(),
            ..ElementState::new(what, self.state, self.confidence)
        }
    }
}

// The rows of one element over all windows, as bytes: the lengths of its absences, the lengths without
// changes, and the differences from the previous window.

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
#[derive(Clone, Copy, Debug, Default)]
struct Memory {
    row: Row,
    /// The last whole numbers of the median, the gap, the rate, jitter and age.
    halves: [i64; 5],
}

/// A writer of the rows of an element in order of their windows.
#[derive(Default)]
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
            let known = Confidence::ALL.get(confidence);
            row.confidence = known.copied().unwrap_or(row.confidence);
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

// A walk through all elements at once, window by window, that stops only where one of them differs from the
// previous window.

/// The state of a walk through all columns.
pub(crate) struct ColumnWalk<'a> {
    /// The next window.
    window: u64,
    /// For each node, topic, publication and subscription, the next window in which it may differ.
    due: [Vec<u64>; 4],
    cursors: [Vec<ColumnCursor<'a>>; 4],
}

impl<'a> ColumnWalk<'a> {
    fn new(columns: &'a [Vec<Column>; 4]) -> Self {
        let columns = columns.each_ref();
        Self {
            window: 0,
            due: columns.map(|list| vec![0; list.len()]),
            cursors: columns.map(|list| list.iter().map(Column::cursor).collect()),
        }
    }

    /// Calls `visit` for every element that may differ in the next window, with its row there, if it exists.
    pub(crate) fn next(&mut self, mut visit: impl FnMut(Element, Option<Row>)) {
        let lists = self.due.iter_mut().zip(&mut self.cursors);
        for ((due, cursors), kind) in lists.zip(Element::KINDS) {
            for (at, due) in due.iter_mut().enumerate() {
                if *due > self.window {
                    continue;
                }
                let (row, stays) = cursors[at].next_run();
                *due = self.window.saturating_add(stays);
                visit(kind(at), row);
            }
        }
        self.window += 1;
    }
}

#[cfg(test)]
pub(crate) mod tests;
