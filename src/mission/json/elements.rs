//! Nodes, topics and edges in JSON: each once for the whole mission, with its lifetimes, its stretches and, as columns,
//! its windows. Each is one struct for writing and for reading; when read, everything except names and windows is
//! optional.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::runs::JsonColumns;
use super::sending::SendingJson;
use crate::base::time::{Span, Stamp};
use crate::evidence::{Confidence, Evidence};
use crate::graph::{Edge, Elements, Existence, Node, State, Topic};

/// A text, borrowed when written.
pub(crate) type Text<'a> = Cow<'a, str>;

/// An element over the whole mission.
#[derive(Deserialize, Serialize)]
#[serde(tag = "what", rename_all = "lowercase")]
pub(crate) enum ElementJson<'a> {
    Node(NodeJson<'a>),
    Topic(TopicJson<'a>),
    Publish(EdgeJson<'a>),
    Subscribe(EdgeJson<'a>),
}

#[derive(Deserialize, Serialize)]
pub(crate) struct NodeJson<'a> {
    pub(crate) name: Text<'a>,
    pub(crate) role: Option<Text<'a>>,
    #[serde(default)]
    pub(crate) evidence: Vec<Text<'a>>,
    #[serde(flatten)]
    pub(crate) life: LifeJson,
    #[serde(rename = "in")]
    pub(crate) columns: Box<JsonColumns<'a>>,
}

#[derive(Deserialize, Serialize)]
pub(crate) struct TopicJson<'a> {
    pub(crate) name: Text<'a>,
    #[serde(default)]
    pub(crate) types: Vec<Text<'a>>,
    #[serde(default)]
    pub(crate) evidence: Vec<Text<'a>>,
    pub(crate) qos: Option<Text<'a>>,
    pub(crate) unknown_publishers: Option<u32>,
    #[serde(flatten)]
    pub(crate) life: LifeJson,
    #[serde(flatten)]
    pub(crate) sending: SendingJson,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) pauses: Vec<[i64; 2]>,
    #[serde(rename = "in")]
    pub(crate) columns: Box<JsonColumns<'a>>,
}

#[derive(Deserialize, Serialize)]
pub(crate) struct EdgeJson<'a> {
    pub(crate) node: Text<'a>,
    pub(crate) topic: Text<'a>,
    #[serde(default)]
    pub(crate) evidence: Vec<Text<'a>>,
    #[serde(flatten)]
    pub(crate) life: LifeJson,
    #[serde(flatten)]
    pub(crate) sending: SendingJson,
    #[serde(rename = "in")]
    pub(crate) columns: Box<JsonColumns<'a>>,
}

/// The times of an element, and the intervals in which it exists, in nanoseconds.
#[derive(Deserialize, Serialize)]
pub(crate) struct LifeJson {
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lives: Vec<[i64; 2]>,
}

impl<'a> NodeJson<'a> {
    pub(crate) fn new(node: &'a Node, columns: JsonColumns<'a>) -> Self {
        Self {
            name: node.name.as_str().into(),
            role: Some((&*node.role).into()),
            evidence: words(node.seen.evidence),
            life: LifeJson::new(&node.seen),
            columns: Box::new(columns),
        }
    }

    pub(crate) fn node(&self) -> Node {
        Node {
            name: (&*self.name).into(),
            role: self.role.as_deref().unwrap_or(&self.name).into(),
            seen: self.life.existence(&self.evidence),
        }
    }
}

impl<'a> TopicJson<'a> {
    /// A topic with the messages of its unknown senders.
    pub(crate) fn new(topic: &'a Topic, sending: SendingJson, columns: JsonColumns<'a>) -> Self {
        Self {
            name: topic.name.as_str().into(),
            types: topic.types.iter().map(|t| Text::from(&**t)).collect(),
            evidence: words(topic.seen.evidence),
            qos: topic.qos.as_deref().map(Text::from),
            unknown_publishers: topic.unknown_publishers,
            life: LifeJson::new(&topic.seen),
            sending,
            pauses: Vec::new(),
            columns: Box::new(columns),
        }
    }

    pub(crate) fn topic(&self) -> Topic {
        let mut types: Vec<_> = self.types.iter().map(|name| (&**name).into()).collect();
        types.sort();
        types.dedup();
        Topic {
            name: (&*self.name).into(),
            types,
            qos: self.qos.as_deref().map(Into::into),
            unknown_publishers: self.unknown_publishers,
            seen: self.life.existence(&self.evidence),
        }
    }
}

impl<'a> EdgeJson<'a> {
    pub(crate) fn new(
        edge: &'a Edge,
        all: &'a Elements,
        sending: SendingJson,
        columns: JsonColumns<'a>,
    ) -> Self {
        Self {
            node: all.nodes[edge.node].name.as_str().into(),
            topic: all.topics[edge.topic].name.as_str().into(),
            evidence: words(edge.seen.evidence),
            life: LifeJson::new(&edge.seen),
            sending,
            columns: Box::new(columns),
        }
    }

    /// The edge between these nodes and topics.
    ///
    /// # Errors
    /// The name of an end that is not among them.
    pub(crate) fn edge(&self, all: &Elements) -> Result<Edge, String> {
        let missing = |name: &str| format!("`{name}` has an edge and is not in `elements`");
        Ok(Edge {
            node: all.node(&self.node).ok_or_else(|| missing(&self.node))?,
            topic: all.topic(&self.topic).ok_or_else(|| missing(&self.topic))?,
            seen: self.life.existence(&self.evidence),
        })
    }
}

impl LifeJson {
    fn new(known: &Existence) -> Self {
        Self {
            first_ns: known.first.map(|at| at.0),
            last_ns: known.last.map(|at| at.0),
            lives: pairs(&known.lives),
        }
    }

    fn existence(&self, words: &[Text<'_>]) -> Existence {
        Existence {
            evidence: evidence(words),
            first: self.first_ns.map(Stamp),
            last: self.last_ns.map(Stamp),
            lives: spans(&self.lives),
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
