//! The computation graph of one window: which nodes and topics are there, who talks to whom, how often.
//!
//! A graph holds numbers only; names stand once, in the [`Elements`] of the whole mission, sorted, so that an index
//! is an order and equal graphs are equal bytes.

mod build;
pub mod diff;
mod graphs;
pub(crate) mod lives;
pub(crate) mod sending;
pub mod window;

use std::sync::Arc;

use crate::base::name::{NodeName, TopicName};
use crate::base::time::{Span, Stamp};
use crate::evidence::{Degree, Evidence};

#[cfg(test)]
pub(crate) use graphs::tests as graphs_for_tests;
pub(crate) use graphs::{Column, ColumnCursor, ColumnWriter, GraphsWriter, Number, Row};
pub use graphs::{Graphs, Iter as GraphsIter};

pub use build::{Built, build};
pub(crate) use build::{History, TopicCount, Windowed, counts, graphs, history};

/// A node's place in [`Elements::nodes`].
pub type NodeId = u32;
/// A topic's place in [`Elements::topics`].
pub type TopicId = u32;
/// An edge's place in [`Elements::publishes`] or [`Elements::subscribes`].
pub type EdgeId = u32;

/// A node, over the whole mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The name as recorded.
    pub name: NodeName,
    /// The name with anonymous suffixes folded; equal to the name for most.
    pub role: Arc<str>,
    /// What proves it.
    pub evidence: Evidence,
    /// Its first sign of life in the mission.
    pub first: Option<Stamp>,
    /// Its last sign of life.
    pub last: Option<Stamp>,
    /// When it is there, in order, half-open; empty where only windows are known.
    pub runs: Vec<Span>,
}

/// A topic, over the whole mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Topic {
    /// The name as recorded.
    pub name: TopicName,
    /// Its types, sorted; more than one is a mistake of the robot's worth seeing.
    pub types: Vec<Arc<str>>,
    /// What proves it.
    pub evidence: Evidence,
    /// Its first message or sign of life.
    pub first: Option<Stamp>,
    /// Its last.
    pub last: Option<Stamp>,
    /// The quality of service offered, in short words, if known: `reliable transient_local depth 1`.
    pub qos: Option<Arc<str>>,
    /// When it is there, in order, half-open; empty where only windows are known.
    pub runs: Vec<Span>,
    /// How many publishers the bag counts that nobody names, 0..; `None` if it counts none at all. They are no nodes: a
    /// picture may show them as one small box.
    pub unknown_publishers: Option<u32>,
}

/// A publication or a subscription, over the whole mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Who publishes or subscribes.
    pub node: NodeId,
    /// What.
    pub topic: TopicId,
    /// What proves it.
    pub evidence: Evidence,
    /// Its first message or sign of life.
    pub first: Option<Stamp>,
    /// Its last.
    pub last: Option<Stamp>,
    /// When it is there, in order, half-open; empty where only windows are known.
    pub runs: Vec<Span>,
}

/// Everything that ever is in the mission: nodes and topics sorted by name, publications by (node, topic),
/// subscriptions by (topic, node).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Elements {
    /// Nodes, sorted by name.
    pub nodes: Vec<Node>,
    /// Topics, sorted by name.
    pub topics: Vec<Topic>,
    /// Publications, sorted by (node, topic).
    pub publishes: Vec<Edge>,
    /// Subscriptions, sorted by (topic, node).
    pub subscribes: Vec<Edge>,
}

/// How alive something is in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum State {
    /// Messages or evidence fall into the window.
    Active,
    /// Alive without a message.
    Silent,
    /// Alive by a latched or transient-local message.
    Latched,
    /// Known from a header or metadata only.
    Declared,
}

impl State {
    /// All of them, the liveliest first.
    pub const ALL: [Self; 4] = [Self::Active, Self::Silent, Self::Latched, Self::Declared];

    /// Its word in JSON and in class names.
    pub fn word(self) -> &'static str {
        match self {
            Self::Active => "active",
            Self::Silent => "silent",
            Self::Latched => "latched",
            Self::Declared => "declared",
        }
    }
}

/// A node in a window.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeState {
    /// Which.
    pub id: NodeId,
    /// How alive.
    pub state: State,
    /// How well known in this window.
    pub degree: Degree,
    /// The sum of what it publishes, in messages per second: its intensity. `None` where not known.
    pub hz: Option<f64>,
    /// The lifecycle state, if it has one: `inactive`, `active`, …
    pub lifecycle: Option<Arc<str>>,
}

/// A topic in a window.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicState {
    /// Which.
    pub id: TopicId,
    /// How alive.
    pub state: State,
    /// How well known in this window.
    pub degree: Degree,
    /// Messages in the window, 0...
    pub count: u64,
    /// Their payload bytes, if known.
    pub bytes: Option<u64>,
    /// Messages per second over the window's true length; `None` below 1 ms of length.
    pub hz: Option<f64>,
    /// The median time between messages in seconds; `None` with fewer than two.
    pub median_period_s: Option<f64>,
    /// The longest time between messages in seconds; `None` with fewer than two.
    pub max_gap_s: Option<f64>,
}

/// A publication or subscription in a window.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeState {
    /// Which.
    pub id: EdgeId,
    /// How alive.
    pub state: State,
    /// How well known in this window.
    pub degree: Degree,
    /// Messages over this edge in the window, if known.
    pub count: Option<u64>,
    /// The same per second; `None` where not known.
    pub hz: Option<f64>,
}

/// The computation graph of one window. Each list is sorted by id; an element that is not there is not listed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// Nodes in the window.
    pub nodes: Vec<NodeState>,
    /// Topics in the window.
    pub topics: Vec<TopicState>,
    /// Publications in the window.
    pub publishes: Vec<EdgeState>,
    /// Subscriptions in the window.
    pub subscribes: Vec<EdgeState>,
}

/// One element of the mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Element {
    /// A node.
    Node(NodeId),
    /// A topic.
    Topic(TopicId),
    /// A publication.
    Publish(EdgeId),
    /// A subscription.
    Subscribe(EdgeId),
}

impl Element {
    /// The word for its kind in JSON: `node`, `topic`, `publish` or `subscribe`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Node(_) => "node",
            Self::Topic(_) => "topic",
            Self::Publish(_) => "publish",
            Self::Subscribe(_) => "subscribe",
        }
    }
}

impl Elements {
    /// The node and the topic of an element: both of an edge, one of the others.
    pub fn ends(&self, element: Element) -> (Option<NodeId>, Option<TopicId>) {
        let ends = |edge: Option<&Edge>| (edge.map(|e| e.node), edge.map(|e| e.topic));
        match element {
            Element::Node(id) => (Some(id), None),
            Element::Topic(id) => (None, Some(id)),
            Element::Publish(id) => ends(self.publishes.get(id as usize)),
            Element::Subscribe(id) => ends(self.subscribes.get(id as usize)),
        }
    }

    /// What proves an element.
    pub fn evidence(&self, element: Element) -> Evidence {
        match element {
            Element::Node(id) => self.nodes.get(id as usize).map(|n| n.evidence),
            Element::Topic(id) => self.topics.get(id as usize).map(|t| t.evidence),
            Element::Publish(id) => self.publishes.get(id as usize).map(|e| e.evidence),
            Element::Subscribe(id) => self.subscribes.get(id as usize).map(|e| e.evidence),
        }
        .unwrap_or(Evidence::NONE)
    }

    /// When an element is there, in order, half-open; empty where only windows are known.
    pub fn runs(&self, element: Element) -> &[Span] {
        let runs = match element {
            Element::Node(id) => self.nodes.get(id as usize).map(|n| &n.runs),
            Element::Topic(id) => self.topics.get(id as usize).map(|t| &t.runs),
            Element::Publish(id) => self.publishes.get(id as usize).map(|e| &e.runs),
            Element::Subscribe(id) => self.subscribes.get(id as usize).map(|e| &e.runs),
        };
        runs.map_or(&[], Vec::as_slice)
    }

    /// The first and the last sign of life of an element, where known.
    pub fn life(&self, element: Element) -> (Option<Stamp>, Option<Stamp>) {
        match element {
            Element::Node(id) => self.nodes.get(id as usize).map(|n| (n.first, n.last)),
            Element::Topic(id) => self.topics.get(id as usize).map(|t| (t.first, t.last)),
            Element::Publish(id) => self.publishes.get(id as usize).map(|e| (e.first, e.last)),
            Element::Subscribe(id) => self.subscribes.get(id as usize).map(|e| (e.first, e.last)),
        }
        .unwrap_or_default()
    }
}

/// Windows shorter than this have no rates.
const SHORTEST_NS: i64 = 1_000_000;

/// The rate of so many messages in a window; `None` below 1 ms.
pub(crate) fn per_second(count: u64, window: Span) -> Option<f64> {
    let nanos = window.nanos();
    (nanos >= SHORTEST_NS).then(|| count as f64 / (nanos as f64 / 1e9))
}

#[cfg(test)]
mod tests;
