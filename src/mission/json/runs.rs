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

mod columns;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::elements::{Text, confidence_of, state_of};
use crate::evidence::Confidence;
use crate::graph::{ColumnWriter, Element, Graphs, GraphsWriter, Number, Row, State};
use columns::{JsonColumn, JsonRate};

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
            all.lifecycle.push(graphs.lifecycle(&row).map(Text::from));
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
        let mut states = self.state.values(|word| state_of(Some(word)));
        let mut degrees = self.degree.values(|word| confidence_of(Some(word)));
        let mut sent = self.sent.values(|count| *count);
        let mut counts = self.count.values(|count| *count);
        let mut bytes = self.bytes.values(|bytes| *bytes);
        let mut medians = self.median_period_s.values(|value| Number::of(*value));
        let mut gaps = self.max_gap_s.values(|value| Number::of(*value));
        let mut drops = self.drops.values(|count| *count);
        let mut jitters = self.jitter_s.values(|value| Number::of(*value));
        let mut ages = self.age_s.values(|value| Number::of(*value));
        let mut rates = self.hz.values(JsonRate::number);
        let mut next = 0;
        for (from, to) in &self.windows {
            for at in (*from).max(next)..(*to).saturating_add(1).min(many) {
                let state = states.next().unwrap_or(State::Active);
                let degree = degrees.next().unwrap_or(Confidence::Stated);
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
