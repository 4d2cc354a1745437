//! Nodes, topics and edges in JSON: over the whole mission, and in one window.

use serde::{Serialize, Serializer};

use super::write::words;
use crate::base::time::{Span, Stamp};
use crate::graph::{Edge, EdgeState, Elements, Measures, Node, NodeState, Topic, TopicState};

/// The intervals in which an element exists, as pairs of nanoseconds.
#[derive(Clone, Copy)]
pub(crate) struct RunRows<'a>(pub(crate) &'a [Span]);

impl Serialize for RunRows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|run| [run.start.0, run.end.0]))
    }
}

pub(crate) fn nanos(stamp: Option<Stamp>) -> Option<i64> {
    stamp.map(|s| s.0)
}

/// A node without its states.
#[derive(Serialize)]
pub(crate) struct NodeOf<'a> {
    name: &'a str,
    role: &'a str,
    evidence: Vec<&'static str>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: RunRows<'a>,
}

impl<'a> NodeOf<'a> {
    pub(crate) fn new(node: &'a Node) -> Self {
        Self {
            name: node.name.as_str(),
            role: &node.role,
            evidence: words(node.evidence),
            first_ns: nanos(node.first),
            last_ns: nanos(node.last),
            runs: RunRows(&node.runs),
        }
    }
}

/// A topic without its states.
#[derive(Serialize)]
pub(crate) struct TopicOf<'a> {
    name: &'a str,
    types: Vec<&'a str>,
    evidence: Vec<&'static str>,
    qos: Option<&'a str>,
    unknown_publishers: Option<u32>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: RunRows<'a>,
}

impl<'a> TopicOf<'a> {
    pub(crate) fn new(topic: &'a Topic) -> Self {
        Self {
            name: topic.name.as_str(),
            types: topic.types.iter().map(AsRef::as_ref).collect(),
            evidence: words(topic.evidence),
            qos: topic.qos.as_deref(),
            unknown_publishers: topic.unknown_publishers,
            first_ns: nanos(topic.first),
            last_ns: nanos(topic.last),
            runs: RunRows(&topic.runs),
        }
    }
}

/// A publication or subscription without its states.
#[derive(Serialize)]
pub(crate) struct EdgeOf<'a> {
    node: &'a str,
    topic: &'a str,
    evidence: Vec<&'static str>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: RunRows<'a>,
}

impl<'a> EdgeOf<'a> {
    pub(crate) fn new(edge: &'a Edge, elements: &'a Elements) -> Self {
        let (node, topic) = ends(edge, elements);
        Self {
            node,
            topic,
            evidence: words(edge.evidence),
            first_ns: nanos(edge.first),
            last_ns: nanos(edge.last),
            runs: RunRows(&edge.runs),
        }
    }
}

#[derive(Serialize)]
pub(crate) struct NodeRow<'a> {
    name: &'a str,
    role: &'a str,
    state: &'a str,
    degree: &'a str,
    evidence: Vec<&'static str>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: RunRows<'a>,
    hz: Option<f64>,
    lifecycle: Option<&'a str>,
}

impl<'a> NodeRow<'a> {
    pub(crate) fn new(state: &'a NodeState, elements: &'a Elements) -> Self {
        let node = &elements.nodes[state.id as usize];
        Self {
            name: node.name.as_str(),
            role: &node.role,
            state: state.state.word(),
            degree: state.degree.word(),
            evidence: words(node.evidence),
            first_ns: nanos(node.first),
            last_ns: nanos(node.last),
            runs: RunRows(&node.runs),
            hz: state.hz,
            lifecycle: state.lifecycle.as_deref(),
        }
    }
}

/// The further numbers of a window, those that are known.
#[derive(Serialize)]
struct MeasureRow {
    #[serde(skip_serializing_if = "Option::is_none")]
    drops: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    jitter_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    age_s: Option<f64>,
}

impl From<Measures> for MeasureRow {
    fn from(measures: Measures) -> Self {
        Self {
            drops: measures.drops,
            jitter_s: measures.jitter_s,
            age_s: measures.age_s,
        }
    }
}

#[derive(Serialize)]
pub(crate) struct TopicRow<'a> {
    name: &'a str,
    types: Vec<&'a str>,
    state: &'a str,
    degree: &'a str,
    evidence: Vec<&'static str>,
    count: u64,
    bytes: Option<u64>,
    hz: Option<f64>,
    median_period_s: Option<f64>,
    max_gap_s: Option<f64>,
    #[serde(flatten)]
    measures: MeasureRow,
    qos: Option<&'a str>,
    unknown_publishers: Option<u32>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: RunRows<'a>,
}

impl<'a> TopicRow<'a> {
    pub(crate) fn new(state: &'a TopicState, elements: &'a Elements) -> Self {
        let topic = &elements.topics[state.id as usize];
        Self {
            name: topic.name.as_str(),
            types: topic.types.iter().map(AsRef::as_ref).collect(),
            state: state.state.word(),
            degree: state.degree.word(),
            evidence: words(topic.evidence),
            count: state.count,
            bytes: state.bytes,
            hz: state.hz,
            median_period_s: state.median_period_s,
            max_gap_s: state.max_gap_s,
            measures: state.measures.into(),
            qos: topic.qos.as_deref(),
            unknown_publishers: topic.unknown_publishers,
            first_ns: nanos(topic.first),
            last_ns: nanos(topic.last),
            runs: RunRows(&topic.runs),
        }
    }
}

#[derive(Serialize)]
pub(crate) struct PublishRow<'a> {
    node: &'a str,
    topic: &'a str,
    #[serde(flatten)]
    rest: EdgeRow<'a>,
}

#[derive(Serialize)]
pub(crate) struct SubscribeRow<'a> {
    topic: &'a str,
    node: &'a str,
    #[serde(flatten)]
    rest: EdgeRow<'a>,
}

#[derive(Serialize)]
struct EdgeRow<'a> {
    state: &'a str,
    degree: &'a str,
    evidence: Vec<&'static str>,
    count: Option<u64>,
    hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
    #[serde(flatten)]
    measures: MeasureRow,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: RunRows<'a>,
}

impl<'a> EdgeRow<'a> {
    pub(crate) fn new(state: &'a EdgeState, edge: &'a Edge) -> Self {
        Self {
            state: state.state.word(),
            degree: state.degree.word(),
            evidence: words(edge.evidence),
            count: state.count,
            hz: state.hz,
            bytes: state.bytes,
            measures: state.measures.into(),
            first_ns: nanos(edge.first),
            last_ns: nanos(edge.last),
            runs: RunRows(&edge.runs),
        }
    }
}

pub(crate) fn ends<'a>(edge: &Edge, elements: &'a Elements) -> (&'a str, &'a str) {
    let node = elements.nodes[edge.node as usize].name.as_str();
    (node, elements.topics[edge.topic as usize].name.as_str())
}

impl<'a> PublishRow<'a> {
    pub(crate) fn new(state: &'a EdgeState, elements: &'a Elements) -> Self {
        let edge = &elements.publishes[state.id as usize];
        let (node, topic) = ends(edge, elements);
        Self {
            node,
            topic,
            rest: EdgeRow::new(state, edge),
        }
    }
}

impl<'a> SubscribeRow<'a> {
    pub(crate) fn new(state: &'a EdgeState, elements: &'a Elements) -> Self {
        let edge = &elements.subscribes[state.id as usize];
        let (node, topic) = ends(edge, elements);
        Self {
            topic,
            node,
            rest: EdgeRow::new(state, edge),
        }
    }
}
