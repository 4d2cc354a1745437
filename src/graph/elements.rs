//! The nodes, topics and edges of a mission, their names and ids; and a value for each of them.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::base::ids::ids;
use crate::base::name::{NodeName, TopicName, is_player, is_quiet, is_recorder, is_service};
use crate::base::time::{Span, Stamp};
use crate::evidence::Evidence;
use crate::graph::{ById, Id};

ids! {
    /// The id of a node: its index in [`Elements::nodes`].
    NodeId,
    /// The id of a topic: its index in [`Elements::topics`].
    TopicId,
    /// The id of an edge: its index in [`Elements::publishes`] or [`Elements::subscribes`].
    EdgeId,
}

/// How an element is known, and when it exists, over the whole mission.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(default)]
pub struct Existence {
    /// The kinds of evidence for it.
    #[serde(skip)]
    pub evidence: Evidence,
    /// The time of its first message or other sign.
    #[serde(rename = "first_ns")]
    pub first: Option<Stamp>,
    /// The time of its last message or other sign.
    #[serde(rename = "last_ns")]
    pub last: Option<Stamp>,
    /// The intervals in which it exists, in order, half-open; empty if only windows are known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lives: Vec<Span>,
}

impl Existence {
    /// That of an element with this evidence and without times.
    pub(crate) const fn of(evidence: Evidence) -> Self {
        Self {
            evidence,
            first: None,
            last: None,
            lives: Vec::new(),
        }
    }
}

/// A node, over the whole mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// The name as recorded.
    pub name: NodeName,
    /// The name with anonymous suffixes folded; equal to the name for most.
    pub role: Arc<str>,
    /// How it is known, and when it exists.
    pub seen: Existence,
}

impl Node {
    /// Whether it records or plays bags, by its name or its log records.
    pub(crate) fn records(&self) -> bool {
        let name = self.name.as_str();
        is_recorder(name) || is_player(name) || self.seen.evidence.has("recorder")
    }

    /// Whether it is housekeeping, a recorder or a player: events, phases and figures leave it out.
    pub(crate) fn is_tool(&self) -> bool {
        self.records() || is_quiet(self.name.as_str())
    }
}

/// A topic, over the whole mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Topic {
    /// The name as recorded.
    pub name: TopicName,
    /// Its types, sorted; more than one is a mistake in the robot's software.
    pub types: Vec<Arc<str>>,
    /// The quality of service offered, in short words, if known: `reliable transient_local depth 1`.
    pub qos: Option<Arc<str>>,
    /// How it is known, and when it exists.
    pub seen: Existence,
    /// The number of publishers that the bag counts but does not name, ≥ 0; `None` if it does not count publishers.
    /// They are not nodes: a picture may show them as one small box.
    pub unknown_publishers: Option<u32>,
}

impl Topic {
    /// Whether it is a service: its clients write to it, and its server reads it. A topic of the same name
    /// takes precedence.
    pub fn is_service(&self) -> bool {
        !self.types.is_empty() && self.types.iter().all(|kind| is_service(kind))
    }

    /// Whether many nodes publish to topics of its type in turn, so that a new publisher is not a takeover.
    pub(crate) fn is_shared(&self) -> bool {
        let mut types = self.types.iter();
        types.any(|kind| SHARED.contains(&kind.rsplit('/').next().unwrap_or(kind)))
    }
}

/// Types of topics that many nodes publish to in turn.
const SHARED: [&str; 8] = [
    "Log",
    "ParameterEvent",
    "TFMessage",
    "DiagnosticArray",
    "Status",
    "Clock",
    "tfMessage",
    "TopicStatistics",
];

/// A publication or a subscription, over the whole mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edge {
    /// The node that publishes or subscribes.
    pub node: NodeId,
    /// The topic.
    pub topic: TopicId,
    /// How it is known, and when it exists.
    pub seen: Existence,
}

/// The ends of each topic and the topics of each node, in order.
pub(crate) struct Wiring {
    pub(crate) publishers: ById<TopicId, Vec<NodeId>>,
    pub(crate) subscribers: ById<TopicId, Vec<NodeId>>,
    pub(crate) published: ById<NodeId, Vec<TopicId>>,
    pub(crate) subscribed: ById<NodeId, Vec<TopicId>>,
}

/// All nodes, topics and edges of the mission: nodes and topics sorted by name, publications by (node, topic),
/// subscriptions by (topic, node).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Elements {
    /// Nodes, sorted by name.
    pub nodes: ById<NodeId, Node>,
    /// Topics, sorted by name.
    pub topics: ById<TopicId, Topic>,
    /// Publications, sorted by (node, topic).
    pub publishes: ById<EdgeId, Edge>,
    /// Subscriptions, sorted by (topic, node).
    pub subscribes: ById<EdgeId, Edge>,
}

/// A node, topic or edge of the mission.
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
    /// Makes an element of each kind from its id: nodes, topics, publications, subscriptions.
    pub(crate) const KINDS: [fn(usize) -> Self; 4] = [
        |at| Self::Node(Id::of(at)),
        |at| Self::Topic(Id::of(at)),
        |at| Self::Publish(Id::of(at)),
        |at| Self::Subscribe(Id::of(at)),
    ];

    /// The index of its kind in [`Element::KINDS`], and its id.
    pub(crate) fn place(self) -> (usize, usize) {
        match self {
            Self::Node(id) => (0, id.at()),
            Self::Topic(id) => (1, id.at()),
            Self::Publish(id) => (2, id.at()),
            Self::Subscribe(id) => (3, id.at()),
        }
    }

    /// Whether it is a node.
    pub fn is_node(&self) -> bool {
        matches!(self, Self::Node(_))
    }

    /// Whether it is a topic.
    pub fn is_topic(&self) -> bool {
        matches!(self, Self::Topic(_))
    }

    /// Whether it is a publication or subscription.
    pub fn is_edge(&self) -> bool {
        !self.is_node() && !self.is_topic()
    }

    /// The word for the element's kind in JSON: `node`, `topic`, `publish` or `subscribe`.
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
    /// Every element: nodes, topics, publications, subscriptions.
    pub(crate) fn all(&self) -> impl Iterator<Item = Element> + Clone + use<> {
        let many = [
            self.nodes.len(),
            self.topics.len(),
            self.publishes.len(),
            self.subscribes.len(),
        ];
        let kinds = Element::KINDS.into_iter().zip(many);
        kinds.flat_map(|(kind, many)| (0..many).map(kind))
    }

    /// Every edge: publications, then subscriptions.
    pub(crate) fn edges(&self) -> impl Iterator<Item = (Element, &Edge)> {
        let publishes = self.publishes.with_ids();
        let subscribes = self.subscribes.with_ids();
        let publishes = publishes.map(|(id, edge)| (Element::Publish(id), edge));
        publishes.chain(subscribes.map(|(id, edge)| (Element::Subscribe(id), edge)))
    }

    /// The names of the node and the topic of an element: both for an edge, otherwise one.
    pub(crate) fn names(&self, element: Element) -> (Option<&str>, Option<&str>) {
        let (node, topic) = self.ends(element);
        let node = node.and_then(|id| Some(self.nodes.get(id)?.name.as_str()));
        let topic = topic.and_then(|id| Some(self.topics.get(id)?.name.as_str()));
        (node, topic)
    }

    /// The node of this name.
    pub fn node(&self, name: &str) -> Option<NodeId> {
        let order = |node: &Node| node.name.as_str().cmp(name);
        self.nodes.binary_search_by(order).ok().map(Id::of)
    }

    /// The topic of this name.
    pub fn topic(&self, name: &str) -> Option<TopicId> {
        let order = |topic: &Topic| topic.name.as_str().cmp(name);
        self.topics.binary_search_by(order).ok().map(Id::of)
    }

    /// Who publishes and subscribes to what, as far as `is_meant` of node and topic.
    pub(crate) fn wiring(&self, is_meant: impl Fn(NodeId, TopicId) -> bool) -> Wiring {
        let mut all = Wiring {
            publishers: ById::like(&self.topics, Vec::new()),
            subscribers: ById::like(&self.topics, Vec::new()),
            published: ById::like(&self.nodes, Vec::new()),
            subscribed: ById::like(&self.nodes, Vec::new()),
        };
        for edge in self.publishes.iter().filter(|e| is_meant(e.node, e.topic)) {
            all.publishers[edge.topic].push(edge.node);
            all.published[edge.node].push(edge.topic);
        }
        for edge in self.subscribes.iter().filter(|e| is_meant(e.node, e.topic)) {
            all.subscribers[edge.topic].push(edge.node);
            all.subscribed[edge.node].push(edge.topic);
        }
        all
    }

    /// The publication of a topic by a node.
    pub fn publication(&self, node: NodeId, topic: TopicId) -> Option<EdgeId> {
        let key = |edge: &Edge| (edge.node, edge.topic);
        let at = self.publishes.binary_search_by_key(&(node, topic), key);
        at.ok().map(Id::of)
    }

    /// The subscription of a topic by a node.
    pub fn subscription(&self, topic: TopicId, node: NodeId) -> Option<EdgeId> {
        let key = |edge: &Edge| (edge.topic, edge.node);
        let at = self.subscribes.binary_search_by_key(&(topic, node), key);
        at.ok().map(Id::of)
    }

    /// As [`Elements::publication`], of a node and a topic.
    pub(crate) fn published(&self, (node, topic): (NodeId, TopicId)) -> Option<Element> {
        self.publication(node, topic).map(Element::Publish)
    }

    /// As [`Elements::subscription`], of a node and a topic.
    pub(crate) fn subscribed(&self, (node, topic): (NodeId, TopicId)) -> Option<Element> {
        self.subscription(topic, node).map(Element::Subscribe)
    }

    /// The node and the topic of an element: both for an edge, otherwise one.
    pub fn ends(&self, element: Element) -> (Option<NodeId>, Option<TopicId>) {
        let ends = |edge: Option<&Edge>| (edge.map(|e| e.node), edge.map(|e| e.topic));
        match element {
            Element::Node(id) => (Some(id), None),
            Element::Topic(id) => (None, Some(id)),
            Element::Publish(id) => ends(self.publishes.get(id)),
            Element::Subscribe(id) => ends(self.subscribes.get(id)),
        }
    }

    /// Whether an element is a service, or an end of one.
    pub(crate) fn is_service(&self, what: Element) -> bool {
        let topic = self.ends(what).1;
        topic.is_some_and(|id| self.topics.get(id).is_some_and(Topic::is_service))
    }

    /// How an element is known, and when it exists; empty if there is no such element.
    pub fn seen(&self, element: Element) -> &Existence {
        const NONE: &Existence = &Existence::of(Evidence::NONE);
        let found = match element {
            Element::Node(id) => self.nodes.get(id).map(|node| &node.seen),
            Element::Topic(id) => self.topics.get(id).map(|topic| &topic.seen),
            Element::Publish(id) => self.publishes.get(id).map(|edge| &edge.seen),
            Element::Subscribe(id) => self.subscribes.get(id).map(|edge| &edge.seen),
        };
        found.unwrap_or(NONE)
    }

    /// The kinds of evidence for an element.
    pub fn evidence(&self, element: Element) -> Evidence {
        self.seen(element).evidence
    }

    /// That of every element, to change it, in the order of [`Elements::all`].
    pub(crate) fn seen_mut(&mut self) -> impl Iterator<Item = &mut Existence> {
        let nodes = self.nodes.iter_mut().map(|node| &mut node.seen);
        let topics = self.topics.iter_mut().map(|topic| &mut topic.seen);
        let edges = self.publishes.iter_mut().chain(&mut *self.subscribes);
        let edges = edges.map(|edge| &mut edge.seen);
        nodes.chain(topics).chain(edges)
    }

    /// The only publication of each topic; `None` if none or several are known, or if the bag counts
    /// publishers that it does not name.
    pub(crate) fn sole_publishers(&self) -> ById<TopicId, Option<EdgeId>> {
        let mut found = ById::like(&self.topics, (0, None));
        for (id, edge) in self.publishes.with_ids() {
            if let Some(found) = found.get_mut(edge.topic) {
                *found = (found.0 + 1, Some(id));
            }
        }
        let is_all = |topic: &Topic| topic.unknown_publishers.unwrap_or(0) == 0;
        let each = self.topics.iter().zip(found);
        each.map(|(topic, (many, id))| id.filter(|_| many == 1 && is_all(topic)))
            .collect()
    }
}

/// A value per element, by the element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PerElement<T>(pub(super) [Vec<T>; 4]);

impl<T> Default for PerElement<T> {
    fn default() -> Self {
        Self([const { Vec::new() }; 4])
    }
}

impl PerElement<bool> {
    /// Whether it is true of an element.
    pub(crate) fn is(&self, what: Element) -> bool {
        self.of(what) == Some(&true)
    }
}

impl<T> PerElement<T> {
    /// A value for each of these elements.
    pub(crate) fn new(elements: &Elements, mut value: impl FnMut(Element) -> T) -> Self {
        let mut all = Self::default();
        for what in elements.all() {
            all.0[what.place().0].push(value(what));
        }
        all
    }

    /// The value of an element; `None` for one that has none.
    pub fn of(&self, what: Element) -> Option<&T> {
        let (kind, id) = what.place();
        self.0[kind].get(id)
    }

    /// As [`PerElement::of`], to change it.
    pub(crate) fn of_mut(&mut self, what: Element) -> Option<&mut T> {
        let (kind, id) = what.place();
        self.0[kind].get_mut(id)
    }

    /// Adds the value of the next element of this kind.
    pub(crate) fn push(&mut self, what: Element, value: T) {
        self.0[what.place().0].push(value);
    }

    /// Every value with its element: nodes, topics, publications, subscriptions.
    pub fn iter(&self) -> impl Iterator<Item = (Element, &T)> {
        let lists = self.0.iter().zip(Element::KINDS);
        lists.flat_map(|(list, kind)| (0..).map(kind).zip(list))
    }

    /// Every value, to change it.
    pub(crate) fn values_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.0.iter_mut().flatten()
    }

    /// Reserves space for exactly this many more values of each kind.
    pub(crate) fn reserve_exact(&mut self, many: [usize; 4]) {
        for (list, many) in self.0.iter_mut().zip(many) {
            list.reserve_exact(many);
        }
    }
}
