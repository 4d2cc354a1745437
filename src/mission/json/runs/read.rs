//! Reader of elements with their columns.

use std::sync::Arc;

use serde::Deserialize;

use super::super::names::Ids;
use super::super::raw::{RawEdge, RawNode, RawTopic, degree_of, state_of};
use super::columns::{JsonColumn, JsonRate};
use crate::base::time::Span;
use crate::evidence::Degree;
use crate::graph::{Graphs, GraphsWriter, Number, Row, State};

/// The lists of all elements.
#[derive(Default)]
pub(crate) struct RawElements {
    pub(crate) nodes: Vec<RawWhole<RawNode>>,
    pub(crate) topics: Vec<RawWhole<RawTopic>>,
    pub(crate) publishes: Vec<RawWhole<RawEdge>>,
    pub(crate) subscribes: Vec<RawWhole<RawEdge>>,
}

/// An element, with its states and their windows.
#[derive(Deserialize)]
pub(crate) struct RawWhole<E> {
    #[serde(flatten)]
    pub(crate) element: E,
    #[serde(rename = "in", default)]
    seen: RawColumns,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct RawColumns {
    windows: Vec<(usize, usize)>,
    state: JsonColumn<String>,
    degree: JsonColumn<String>,
    sent: JsonColumn<Option<u64>>,
    count: JsonColumn<Option<u64>>,
    bytes: JsonColumn<Option<u64>>,
    median_period_s: JsonColumn<Option<f64>>,
    max_gap_s: JsonColumn<Option<f64>>,
    drops: JsonColumn<Option<u64>>,
    jitter_s: JsonColumn<Option<f64>>,
    age_s: JsonColumn<Option<f64>>,
    hz: JsonColumn<JsonRate>,
    lifecycle: JsonColumn<Option<String>>,
}

/// The graphs of these windows.
pub(crate) fn graphs(raw: &RawElements, ids: &Ids, spans: &[Span]) -> Graphs {
    let mut all = GraphsWriter::new(spans.to_vec());
    let many = spans.len();
    for whole in &raw.nodes {
        let id = ids.of_node(&whole.element.name);
        whole
            .seen
            .rows(many, &mut all, |all, at, row| all.node_row(id, at, row));
    }
    for whole in &raw.topics {
        let id = ids.of_topic(&whole.element.name);
        whole
            .seen
            .rows(many, &mut all, |all, at, row| all.topic_row(id, at, row));
    }
    for whole in &raw.publishes {
        let id = ids.of_publish(&whole.element);
        whole
            .seen
            .rows(many, &mut all, |all, at, row| all.publish_row(id, at, row));
    }
    for whole in &raw.subscribes {
        let id = ids.of_subscribe(&whole.element);
        whole.seen.rows(many, &mut all, |all, at, row| {
            all.subscribe_row(id, at, row);
        });
    }
    all.finish()
}

impl RawColumns {
    /// Passes each row with its window to `put`, in order; rows out of order or behind the last window are left out.
    fn rows(
        &self,
        many: usize,
        all: &mut GraphsWriter,
        put: impl Fn(&mut GraphsWriter, usize, Row),
    ) {
        let number = |word: &Option<String>| {
            let word = word.as_deref().map(Arc::from);
            word.map_or(0, |word| all.lifecycle(&word))
        };
        let lifecycles: Vec<u32> = self.lifecycle.values(number).take(many).collect();
        let mut lifecycles = lifecycles.into_iter();
        let mut states = self.state.values(|word| state_of(Some(word)));
        let mut degrees = self.degree.values(|word| degree_of(Some(word)));
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
                let degree = degrees.next().unwrap_or(Degree::Stated);
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
                put(all, at, row);
                next = at + 1;
            }
        }
    }
}
