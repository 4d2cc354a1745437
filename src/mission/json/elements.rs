//! Nodes, topics and edges in JSON: each once for the whole mission, with its lifetimes, its stretches and, as columns, its
//! windows. When read, everything except names and windows is optional.
//!
//! ```text
//! {"what": "publish", "node": "/lidar", "topic": "/scan", …, "latched": true,
//!     "stretches": [[first_ns, last_ns, messages, period_ns, flags], …]}
//! {"what": "topic", "name": "/scan", …, "stretches": […], "pauses": [[from_ns, to_ns], …]}
//! ```
//!
//! The stretches of a topic are those of all unknown senders together, so that phases and figures from a file equal those from
//! its bag. `pauses` are the longest intervals between two messages.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::Text;
use super::columns::JsonColumns;
use crate::base::time::Span;
use crate::evidence::Evidence;
use crate::graph::history::Sender;
use crate::graph::{Edge, Elements, Existence, Node, Topic};

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
    role: Option<Text<'a>>,
    #[serde(default)]
    evidence: Evidence,
    #[serde(flatten)]
    life: Cow<'a, Existence>,
    #[serde(rename = "in")]
    pub(crate) columns: Box<JsonColumns<'a>>,
}

#[derive(Deserialize, Serialize)]
pub(crate) struct TopicJson<'a> {
    pub(crate) name: Text<'a>,
    #[serde(default)]
    types: Vec<Text<'a>>,
    #[serde(default)]
    evidence: Evidence,
    qos: Option<Text<'a>>,
    unknown_publishers: Option<u32>,
    #[serde(flatten)]
    life: Cow<'a, Existence>,
    #[serde(flatten)]
    pub(crate) sender: Cow<'a, Sender>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) pauses: Vec<Span>,
    #[serde(rename = "in")]
    pub(crate) columns: Box<JsonColumns<'a>>,
}

#[derive(Deserialize, Serialize)]
pub(crate) struct EdgeJson<'a> {
    pub(crate) node: Text<'a>,
    pub(crate) topic: Text<'a>,
    #[serde(default)]
    evidence: Evidence,
    #[serde(flatten)]
    life: Cow<'a, Existence>,
    #[serde(flatten)]
    pub(crate) sender: Cow<'a, Sender>,
    #[serde(rename = "in")]
    pub(crate) columns: Box<JsonColumns<'a>>,
}

impl<'a> NodeJson<'a> {
    pub(crate) fn new(node: &'a Node, columns: JsonColumns<'a>) -> Self {
        Self {
            name: node.name.as_str().into(),
            role: Some((&*node.role).into()),
            evidence: node.seen.evidence,
            life: Cow::Borrowed(&node.seen),
            columns: Box::new(columns),
        }
    }

    pub(crate) fn node(&self) -> Node {
        Node {
            name: (&*self.name).into(),
            role: self.role.as_deref().unwrap_or(&self.name).into(),
            seen: seen(self.evidence, &self.life),
        }
    }
}

impl<'a> TopicJson<'a> {
    /// A topic with the messages of its unknown senders.
    pub(crate) fn new(
        topic: &'a Topic,
        sender: Option<&'a Sender>,
        pauses: Vec<Span>,
        columns: JsonColumns<'a>,
    ) -> Self {
        Self {
            name: topic.name.as_str().into(),
            types: topic.types.iter().map(|t| Text::from(&**t)).collect(),
            evidence: topic.seen.evidence,
            qos: topic.qos.as_deref().map(Text::from),
            unknown_publishers: topic.unknown_publishers,
            life: Cow::Borrowed(&topic.seen),
            sender: sender.map(Cow::Borrowed).unwrap_or_default(),
            pauses,
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
            seen: seen(self.evidence, &self.life),
        }
    }
}

impl<'a> EdgeJson<'a> {
    /// An edge with its messages, if it has any of its own.
    pub(crate) fn new(
        edge: &'a Edge,
        all: &'a Elements,
        sender: Option<&'a Sender>,
        columns: JsonColumns<'a>,
    ) -> Self {
        Self {
            node: all.nodes[edge.node].name.as_str().into(),
            topic: all.topics[edge.topic].name.as_str().into(),
            evidence: edge.seen.evidence,
            life: Cow::Borrowed(&edge.seen),
            sender: sender.map(Cow::Borrowed).unwrap_or_default(),
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
            seen: seen(self.evidence, &self.life),
        })
    }
}

fn seen(evidence: Evidence, life: &Existence) -> Existence {
    Existence {
        evidence,
        ..life.clone()
    }
}
