//! The windows in which an element exists, with its states and numbers in them as columns: with every window in full,
//! the file of a long mission would be larger than its bag.
//!
//! ```text
//! "windows": [{"index": 0, "start_ns": …, "end_ns": …, "messages": …, "changes": […]}, …],
//! "elements": [{"what": "topic", "name": "/scan", "types": […], …, "in": {"windows": [[0, 99], [120, 35999]],
//!   "state": [["active", 35979]], "degree": [["measured", 35979]], "count": [9, [10, 700], 11, …], …}}, …]
//! ```
//!
//! `windows` contains pairs of a first and a last index. A column has one value for each of these windows, in
//! order; `[value, times]` is a run of equal values; a missing column is `null` in all of them. The rate is
//! the count divided by the window's length, unless a column `hz` overrides it (in which `"="` stands for
//! that rate); a node's count is `sent`.

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::Text;
use crate::evidence::Confidence;
use crate::graph::{ColumnWriter, Element, Graphs, GraphsWriter, Number, Row, State};

/// The windows in which an element exists, with its states in them.
#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct JsonColumns<'a> {
    windows: Vec<(usize, usize)>,
    state: JsonColumn<Text<'a>>,
    degree: JsonColumn<Text<'a>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    sent: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    count: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    bytes: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    median_period_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    max_gap_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    drops: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    jitter_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    age_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    hz: JsonColumn<JsonRate>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    lifecycle: JsonColumn<Option<Text<'a>>>,
}

impl<'a> JsonColumns<'a> {
    pub(crate) fn of(graphs: &'a Graphs, what: Element) -> Self {
        let mut all = Self::default();
        for (at, row) in graphs.rows(what) {
            match all.windows.last_mut() {
                Some((_, last)) if *last + 1 == at => *last = at,
                _ => all.windows.push((at, at)),
            }
            all.state.push(row.state.word().into());
            all.degree.push(row.confidence.word().into());
            match what {
                Element::Node(_) => all.sent.push(row.count),
                _ => all.count.push(row.count),
            }
            all.bytes.push(row.bytes);
            all.median_period_s.push(row.median.value());
            all.max_gap_s.push(row.gap.value());
            all.drops.push(row.drops);
            all.jitter_s.push(row.jitter.value());
            all.age_s.push(row.age.value());
            all.hz.push(JsonRate::of(&row));
            all.lifecycle
                .push(graphs.lifecycle(&row).map(|word| Text::from(&**word)));
        }
        all
    }

    /// Adds the rows to those of the element, of which `all` has `many` windows; rows out of order or after the last window
    /// are ignored.
    pub(crate) fn add(&self, rows: &mut ColumnWriter, many: usize, all: &mut GraphsWriter) {
        let number = |word: &Option<Text<'_>>| {
            let word = word.as_deref().map(Arc::from);
            word.map_or(0, |word| all.lifecycle(&word))
        };
        let lifecycles: Vec<u32> = self.lifecycle.values(number).take(many).collect();
        let mut lifecycles = lifecycles.into_iter();
        let mut states = self.state.values(|word| State::from_word(word));
        let mut degrees = self.degree.values(|word| Confidence::from_word(word));
        let (mut sent, mut counts) = (self.sent.plain(), self.count.plain());
        let (mut bytes, mut drops) = (self.bytes.plain(), self.drops.plain());
        let [mut medians, mut gaps, mut jitters, mut ages] = [
            &self.median_period_s,
            &self.max_gap_s,
            &self.jitter_s,
            &self.age_s,
        ]
        .map(|column| column.values(|value| Number::of(*value)));
        let mut rates = self.hz.values(JsonRate::number);
        let mut next = 0;
        for (from, to) in &self.windows {
            for at in (*from).max(next)..(*to).saturating_add(1).min(many) {
                let state = states.next().flatten().unwrap_or(State::Active);
                let degree = degrees.next().flatten().unwrap_or(Confidence::Stated);
                let row = Row {
                    lifecycle: lifecycles.next().unwrap_or(0),
                    count: sent.next().flatten().or(counts.next().flatten()),
                    bytes: bytes.next().flatten(),
                    median: medians.next().unwrap_or_default(),
                    gap: gaps.next().unwrap_or_default(),
                    drops: drops.next().flatten(),
                    jitter: jitters.next().unwrap_or_default(),
                    age: ages.next().unwrap_or_default(),
                    rate: rates.next().flatten(),
                    ..Row::new(state, degree)
                };
                rows.push(at, row);
                next = at + 1;
            }
        }
    }
}

// Run-length encoded columns.

/// Values, each with the number of its repetitions.
#[derive(Clone, Debug, Default, PartialEq)]
struct JsonColumn<T>(Vec<(T, u32)>);

impl<T: PartialEq> JsonColumn<T> {
    fn push(&mut self, value: T) {
        match self.0.last_mut() {
            Some((last, times)) if *last == value => *times = times.saturating_add(1),
            _ => self.0.push((value, 1)),
        }
    }
}

impl<T: Default + PartialEq> JsonColumn<T> {
    /// Whether all windows have the default value.
    fn is_plain(&self) -> bool {
        self.0.iter().all(|(value, _)| *value == T::default())
    }
}

impl<T> JsonColumn<T> {
    /// The meaning of every value, in order.
    fn values<'a, U: Copy + 'a>(
        &'a self,
        mut meaning: impl FnMut(&T) -> U + 'a,
    ) -> impl Iterator<Item = U> + 'a {
        let values = self.0.iter();
        values.flat_map(move |(value, times)| std::iter::repeat_n(meaning(value), *times as usize))
    }
}

impl<T: Copy> JsonColumn<T> {
    fn plain(&self) -> impl Iterator<Item = T> {
        self.values(|value| *value)
    }
}

/// One value with the number of its repetitions, or one alone.
#[derive(Deserialize, Serialize)]
#[serde(untagged)]
enum JsonCell<T> {
    Repeated(T, u32),
    One(T),
}

impl<T: Serialize> Serialize for JsonColumn<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|(value, times)| match times {
            1 => JsonCell::One(value),
            _ => JsonCell::Repeated(value, *times),
        }))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for JsonColumn<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let cells = Vec::<JsonCell<T>>::deserialize(deserializer)?;
        let cells = cells.into_iter().map(|cell| match cell {
            JsonCell::Repeated(value, times) => (value, times),
            JsonCell::One(value) => (value, 1),
        });
        Ok(Self(cells.collect()))
    }
}

/// A rate: computed from the count, which is written as `=`, or another.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(untagged)]
enum JsonRate {
    Other(Option<f64>),
    Counted(char),
}

impl Default for JsonRate {
    fn default() -> Self {
        Self::Counted('=')
    }
}

impl JsonRate {
    fn of(row: &Row) -> Self {
        row.rate
            .map_or_else(Self::default, |rate| Self::Other(rate.value()))
    }

    fn number(&self) -> Option<Number> {
        match self {
            Self::Counted(_) => None,
            Self::Other(hz) => Some(Number::of(*hz)),
        }
    }
}
