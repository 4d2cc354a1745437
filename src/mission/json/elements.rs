//! Nodes, topics and edges in JSON: in one window, or over the whole mission, with their lifetimes, stretches
//! and, in the form of runs, their windows as columns. Each is one struct for writing and for reading; when
//! read, everything except names is optional.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::runs::JsonColumns;
use super::sending::SendingJson;
use crate::base::time::{Span, Stamp};
use crate::evidence::{Confidence, Evidence};
use crate::graph::{
    Edge, Element, ElementState, Elements, Existence, Measures, Node, NodeId, State, Topic, TopicId,
};

/// A text, borrowed when written.
pub(crate) type Text<'a> = Cow<'a, str>;

/// An element over the whole mission.
#[derive(Deserialize, Serialize)]
#[serde(tag = "what", rename_all = "lowercase")]
pub(crate) enum ElementJson<'a> {
    Node(NodeJson<'a>),
    Topic(TopicJson<'a>),
    Publish(PublishJson<'a>),
    Subscribe(PublishJson<'a>),
}

/// The evidence for an element; in a window also its state and the confidence.
#[derive(Default, Deserialize, Serialize)]
pub(crate) struct KnownJson<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) state: Option<Text<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) degree: Option<Text<'a>>,
    #[serde(default)]
    pub(crate) evidence: Vec<Text<'a>>,
}

#[derive(Default, Deserialize, Serialize)]
pub(crate) struct NodeJson<'a> {
    pub(crate) name: Text<'a>,
    pub(crate) role: Option<Text<'a>>,
    #[serde(flatten)]
    pub(crate) known: KnownJson<'a>,
    #[serde(flatten)]
    pub(crate) life: LifeJson,
    #[serde(flatten)]
    pub(crate) numbers: Option<NodeNumbers<'a>>,
    #[serde(rename = "in", skip_serializing_if = "Option::is_none")]
    pub(crate) columns: Option<Box<JsonColumns<'a>>>,
}

/// The times of an element, and the intervals in which it exists, in nanoseconds. Windows leave out the intervals; up to
/// schema 2 they were `runs` in each of them.
#[derive(Default, Deserialize, Serialize)]
pub(crate) struct LifeJson {
    pub(crate) first_ns: Option<i64>,
    pub(crate) last_ns: Option<i64>,
    #[serde(default, alias = "runs", skip_serializing_if = "Vec::is_empty")]
    pub(crate) lives: Vec<[i64; 2]>,
}

/// The numbers of a node in one window.
#[derive(Default, Deserialize, Serialize)]
pub(crate) struct NodeNumbers<'a> {
    pub(crate) hz: Option<f64>,
    pub(crate) lifecycle: Option<Text<'a>>,
}

#[derive(Default, Deserialize, Serialize)]
pub(crate) struct TopicJson<'a> {
    pub(crate) name: Text<'a>,
    #[serde(default)]
    pub(crate) types: Vec<Text<'a>>,
    #[serde(flatten)]
    pub(crate) known: KnownJson<'a>,
    #[serde(flatten)]
    pub(crate) numbers: Option<TopicNumbers>,
    pub(crate) qos: Option<Text<'a>>,
    pub(crate) unknown_publishers: Option<u32>,
    #[serde(flatten)]
    pub(crate) life: LifeJson,
    #[serde(flatten)]
    pub(crate) sending: SendingJson,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) pauses: Vec<[i64; 2]>,
    #[serde(rename = "in", skip_serializing_if = "Option::is_none")]
    pub(crate) columns: Option<Box<JsonColumns<'a>>>,
}

/// The numbers of a topic in one window.
#[derive(Default, Deserialize, Serialize)]
pub(crate) struct TopicNumbers {
    pub(crate) count: Option<u64>,
    pub(crate) bytes: Option<u64>,
    pub(crate) hz: Option<f64>,
    pub(crate) median_period_s: Option<f64>,
    pub(crate) max_gap_s: Option<f64>,
    #[serde(flatten)]
    pub(crate) measures: Measures,
}

#[derive(Default, Deserialize, Serialize)]
pub(crate) struct PublishJson<'a> {
    pub(crate) node: Text<'a>,
    pub(crate) topic: Text<'a>,
    #[serde(flatten)]
    pub(crate) edge: EdgeJson<'a>,
}

/// A subscription in a window as it is written, with the topic first; it is read as a [`PublishJson`].
#[derive(Serialize)]
pub(crate) struct SubscribeJson<'a> {
    topic: Text<'a>,
    node: Text<'a>,
    #[serde(flatten)]
    edge: EdgeJson<'a>,
}

/// An edge without the names of its ends.
#[derive(Default, Deserialize, Serialize)]
pub(crate) struct EdgeJson<'a> {
    #[serde(flatten)]
    pub(crate) known: KnownJson<'a>,
    #[serde(flatten)]
    pub(crate) numbers: Option<EdgeNumbers>,
    #[serde(flatten)]
    pub(crate) life: LifeJson,
    #[serde(flatten)]
    pub(crate) sending: SendingJson,
    #[serde(rename = "in", skip_serializing_if = "Option::is_none")]
    pub(crate) columns: Option<Box<JsonColumns<'a>>>,
}

/// The numbers of an edge in one window.
#[derive(Default, Deserialize, Serialize)]
pub(crate) struct EdgeNumbers {
    pub(crate) count: Option<u64>,
    pub(crate) hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bytes: Option<u64>,
    #[serde(flatten)]
    pub(crate) measures: Measures,
}

impl<'a> NodeJson<'a> {
    /// A node in the window in which it has this state; in the whole mission without one.
    pub(crate) fn new(node: &'a Node, seen: Option<&'a ElementState>) -> Self {
        Self {
            name: node.name.as_str().into(),
            role: Some((&*node.role).into()),
            known: KnownJson::new(&node.seen, seen),
            life: LifeJson::new(&node.seen, seen.is_some()),
            numbers: seen.map(|s| NodeNumbers {
                hz: s.hz,
                lifecycle: s.lifecycle.as_deref().map(Text::from),
            }),
            columns: None,
        }
    }

    pub(crate) fn state(&self, id: NodeId) -> ElementState {
        let numbers = self.numbers.as_ref();
        let lifecycle = numbers.and_then(|n| n.lifecycle.as_deref());
        ElementState {
            hz: numbers.and_then(|n| n.hz),
            lifecycle: lifecycle.map(Into::into),
            ..self.known.state(Element::Node(id))
        }
    }
}

impl<'a> TopicJson<'a> {
    /// A topic, as a node.
    pub(crate) fn new(topic: &'a Topic, seen: Option<&ElementState>) -> Self {
        Self {
            name: topic.name.as_str().into(),
            types: topic.types.iter().map(|t| Text::from(&**t)).collect(),
            known: KnownJson::new(&topic.seen, seen),
            numbers: seen.map(|s| TopicNumbers {
                count: Some(s.messages()),
                bytes: s.bytes,
                hz: s.hz,
                median_period_s: s.median_period_s,
                max_gap_s: s.max_gap_s,
                measures: s.measures,
            }),
            qos: topic.qos.as_deref().map(Text::from),
            unknown_publishers: topic.unknown_publishers,
            life: LifeJson::new(&topic.seen, seen.is_some()),
            sending: SendingJson::default(),
            pauses: Vec::new(),
            columns: None,
        }
    }

    pub(crate) fn state(&self, id: TopicId) -> ElementState {
        let none = TopicNumbers::default();
        let numbers = self.numbers.as_ref().unwrap_or(&none);
        ElementState {
            count: Some(numbers.count.unwrap_or(0)),
            bytes: numbers.bytes,
            hz: numbers.hz,
            median_period_s: numbers.median_period_s,
            max_gap_s: numbers.max_gap_s,
            measures: numbers.measures,
            ..self.known.state(Element::Topic(id))
        }
    }
}

impl<'a> PublishJson<'a> {
    /// A publication or subscription, as a node.
    pub(crate) fn new(edge: &'a Edge, elements: &'a Elements, seen: Option<&ElementState>) -> Self {
        Self {
            node: elements.nodes[edge.node].name.as_str().into(),
            topic: elements.topics[edge.topic].name.as_str().into(),
            edge: EdgeJson {
                known: KnownJson::new(&edge.seen, seen),
                numbers: seen.map(|s| EdgeNumbers {
                    count: s.count,
                    hz: s.hz,
                    bytes: s.bytes,
                    measures: s.measures,
                }),
                life: LifeJson::new(&edge.seen, seen.is_some()),
                sending: SendingJson::default(),
                columns: None,
            },
        }
    }
}

impl<'a> From<PublishJson<'a>> for SubscribeJson<'a> {
    fn from(PublishJson { node, topic, edge }: PublishJson<'a>) -> Self {
        Self { topic, node, edge }
    }
}

impl EdgeJson<'_> {
    pub(crate) fn state(&self, what: Element) -> ElementState {
        let none = EdgeNumbers::default();
        let numbers = self.numbers.as_ref().unwrap_or(&none);
        ElementState {
            count: numbers.count,
            hz: numbers.hz,
            bytes: numbers.bytes,
            measures: numbers.measures,
            ..self.known.state(what)
        }
    }
}

impl KnownJson<'_> {
    fn new(known: &Existence, seen: Option<&ElementState>) -> Self {
        Self {
            state: seen.map(|s| s.state.word().into()),
            degree: seen.map(|s| s.confidence.word().into()),
            evidence: words(known.evidence),
        }
    }

    /// The state of this element, without numbers.
    pub(crate) fn state(&self, what: Element) -> ElementState {
        let confidence = confidence_of(self.degree.as_deref());
        ElementState::new(what, state_of(self.state.as_deref()), confidence)
    }
}

impl LifeJson {
    fn new(known: &Existence, is_window: bool) -> Self {
        let lives = if is_window { &[] } else { &known.lives[..] };
        Self {
            first_ns: known.first.map(|at| at.0),
            last_ns: known.last.map(|at| at.0),
            lives: pairs(lives),
        }
    }
}

pub(crate) fn words<'a>(evidence: Evidence) -> Vec<Text<'a>> {
    evidence.words().map(Text::from).collect()
}

pub(crate) fn evidence(words: &[Text<'_>]) -> Evidence {
    let all = words.iter().map(|word| Evidence::of(word));
    all.fold(Evidence::NONE, Evidence::and)
}

/// Intervals as pairs of nanoseconds.
pub(crate) fn pairs(spans: &[Span]) -> Vec<[i64; 2]> {
    let pair = |span: &Span| [span.start.0, span.end.0];
    spans.iter().map(pair).collect()
}

pub(crate) fn spans(pairs: &[[i64; 2]]) -> Vec<Span> {
    let span = |[start, end]: &[i64; 2]| Span::new(Stamp(*start), Stamp(*end.max(start)));
    pairs.iter().map(span).collect()
}

/// The state of this name; active if unknown or missing.
pub(crate) fn state_of(word: Option<&str>) -> State {
    word.and_then(State::from_word).unwrap_or(State::Active)
}

/// The degree of this name; stated if unknown or missing.
pub(crate) fn confidence_of(word: Option<&str>) -> Confidence {
    word.and_then(Confidence::from_word)
        .unwrap_or(Confidence::Stated)
}
