//! Places for the names of an evolution that is read, and graphs for its windows.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::raw::{RawEdge, RawNode, RawTopic, RawWindow};
use super::runs::RawElements;
use crate::base::name::{NodeName, TopicName};
use crate::base::time::{Span, Stamp};
use crate::evidence::Evidence;
use crate::graph::{Edge, Elements, Graph, Measures, Node, NodeState, Topic, TopicState};

/// Names with their facts over all windows, before they have places.
#[derive(Default)]
pub(crate) struct Names {
    nodes: BTreeMap<Arc<str>, Node>,
    topics: BTreeMap<Arc<str>, Topic>,
    /// Publications by (node, topic).
    publishes: BTreeMap<(Arc<str>, Arc<str>), Edge>,
    /// Subscriptions by (topic, node).
    subscribes: BTreeMap<(Arc<str>, Arc<str>), Edge>,
}

impl Names {
    fn node(&mut self, name: &str) -> &mut Node {
        let name: Arc<str> = name.into();
        self.nodes.entry(Arc::clone(&name)).or_insert_with(|| Node {
            name: NodeName::from(Arc::clone(&name)),
            role: name,
            evidence: Evidence::NONE,
            first: None,
            last: None,
            runs: Vec::new(),
        })
    }

    fn topic(&mut self, name: &str) -> &mut Topic {
        let name: Arc<str> = name.into();
        self.topics
            .entry(Arc::clone(&name))
            .or_insert_with(|| Topic {
                name: TopicName::from(name),
                types: Vec::new(),
                evidence: Evidence::NONE,
                first: None,
                last: None,
                runs: Vec::new(),
                qos: None,
                unknown_publishers: None,
            })
    }

    pub(crate) fn window(&mut self, window: &RawWindow) {
        window.nodes.iter().for_each(|raw| self.take_node(raw));
        window.topics.iter().for_each(|raw| self.take_topic(raw));
        window
            .publishes
            .iter()
            .for_each(|raw| self.take_publish(raw));
        window
            .subscribes
            .iter()
            .for_each(|raw| self.take_subscribe(raw));
    }

    pub(crate) fn whole(&mut self, all: &RawElements) {
        let nodes = all.nodes.iter();
        nodes.for_each(|raw| self.take_node(&raw.element));
        let topics = all.topics.iter();
        topics.for_each(|raw| self.take_topic(&raw.element));
        let publishes = all.publishes.iter();
        publishes.for_each(|raw| self.take_publish(&raw.element));
        let subscribes = all.subscribes.iter();
        subscribes.for_each(|raw| self.take_subscribe(&raw.element));
    }

    pub(crate) fn take_node(&mut self, raw: &RawNode) {
        let node = self.node(&raw.name);
        if let Some(role) = &raw.role {
            node.role = role.as_str().into();
        }
        node.evidence = node.evidence.and(raw.rest.evidence());
        widen(&mut node.first, &mut node.last, raw.rest.life());
        keep(&mut node.runs, raw.rest.runs());
    }

    pub(crate) fn take_topic(&mut self, raw: &RawTopic) {
        let topic = self.topic(&raw.name);
        let types = raw.types.iter();
        topic.types.extend(types.map(|t| Arc::from(t.as_str())));
        topic.types.sort();
        topic.types.dedup();
        topic.evidence = topic.evidence.and(raw.rest.evidence());
        topic.qos = raw.qos.as_deref().map(Arc::from).or(topic.qos.take());
        topic.unknown_publishers = raw.unknown_publishers.or(topic.unknown_publishers);
        widen(&mut topic.first, &mut topic.last, raw.rest.life());
        keep(&mut topic.runs, raw.rest.runs());
    }

    pub(crate) fn take_publish(&mut self, raw: &RawEdge) {
        self.ends(raw);
        edge(&mut self.publishes, (&raw.node, &raw.topic), raw);
    }

    pub(crate) fn take_subscribe(&mut self, raw: &RawEdge) {
        self.ends(raw);
        edge(&mut self.subscribes, (&raw.topic, &raw.node), raw);
    }

    fn ends(&mut self, raw: &RawEdge) {
        self.node(&raw.node);
        self.topic(&raw.topic);
    }

    /// Gives everything its place.
    pub(crate) fn elements(self) -> (Elements, Ids) {
        let places = Ids {
            nodes: numbered(self.nodes.keys().cloned()),
            topics: numbered(self.topics.keys().cloned()),
            publishes: numbered(self.publishes.keys().cloned()),
            subscribes: numbered(self.subscribes.keys().cloned()),
        };
        let settle = |(key, edge): ((Arc<str>, Arc<str>), Edge), node_first: bool| {
            let (node, topic) = if node_first {
                (&key.0, &key.1)
            } else {
                (&key.1, &key.0)
            };
            Edge {
                node: places.nodes[node],
                topic: places.topics[topic],
                ..edge
            }
        };
        let elements = Elements {
            publishes: self
                .publishes
                .into_iter()
                .map(|e| settle(e, true))
                .collect(),
            subscribes: self
                .subscribes
                .into_iter()
                .map(|e| settle(e, false))
                .collect(),
            nodes: self.nodes.into_values().collect(),
            topics: self.topics.into_values().collect(),
        };
        (elements, places)
    }
}

fn edge(edges: &mut BTreeMap<(Arc<str>, Arc<str>), Edge>, key: (&str, &str), raw: &RawEdge) {
    let edge = edges
        .entry((key.0.into(), key.1.into()))
        .or_insert_with(|| Edge {
            node: 0,
            topic: 0,
            evidence: Evidence::NONE,
            first: None,
            last: None,
            runs: Vec::new(),
        });
    edge.evidence = edge.evidence.and(raw.rest.evidence());
    widen(&mut edge.first, &mut edge.last, raw.rest.life());
    keep(&mut edge.runs, raw.rest.runs());
}

/// Keeps the first intervals read: every window repeats all of them.
fn keep(runs: &mut Vec<Span>, told: Vec<Span>) {
    if runs.is_empty() {
        *runs = told;
    }
}

fn widen(
    first: &mut Option<Stamp>,
    last: &mut Option<Stamp>,
    life: (Option<Stamp>, Option<Stamp>),
) {
    *first = [*first, life.0].into_iter().flatten().min();
    *last = (*last).max(life.1);
}

fn numbered<K: Ord>(keys: impl Iterator<Item = K>) -> BTreeMap<K, u32> {
    keys.zip(0..).collect()
}

/// The place of every name in [`Elements`].
pub(crate) struct Ids {
    nodes: BTreeMap<Arc<str>, u32>,
    topics: BTreeMap<Arc<str>, u32>,
    publishes: BTreeMap<(Arc<str>, Arc<str>), u32>,
    subscribes: BTreeMap<(Arc<str>, Arc<str>), u32>,
}

impl Ids {
    /// The place of a node that was read.
    pub(crate) fn of_node(&self, name: &str) -> u32 {
        self.nodes[name]
    }

    /// The place of a topic.
    pub(crate) fn of_topic(&self, name: &str) -> u32 {
        self.topics[name]
    }

    /// The place of a publication.
    pub(crate) fn of_publish(&self, raw: &RawEdge) -> u32 {
        self.publishes[&(Arc::from(raw.node.as_str()), Arc::from(raw.topic.as_str()))]
    }

    /// The place of a subscription.
    pub(crate) fn of_subscribe(&self, raw: &RawEdge) -> u32 {
        self.subscribes[&(Arc::from(raw.topic.as_str()), Arc::from(raw.node.as_str()))]
    }

    /// The number of topics.
    pub(crate) fn topics(&self) -> usize {
        self.topics.len()
    }

    /// The place of a node, if there is one of this name.
    pub(crate) fn node(&self, name: &str) -> Option<u32> {
        self.nodes.get(name).copied()
    }

    /// The place of a topic, if there is one of this name.
    pub(crate) fn topic(&self, name: &str) -> Option<u32> {
        self.topics.get(name).copied()
    }

    /// The graph of a window; an element listed twice counts once, and the ends of an edge are always included.
    pub(crate) fn graph(&self, window: &RawWindow) -> Graph {
        let pair = |a: &str, b: &str| (Arc::from(a), Arc::from(b));
        let publishes = by_id(window.publishes.iter().map(|raw| {
            let id = self.publishes[&pair(&raw.node, &raw.topic)];
            (id, raw.rest.edge(id))
        }));
        let subscribes = by_id(window.subscribes.iter().map(|raw| {
            let id = self.subscribes[&pair(&raw.topic, &raw.node)];
            (id, raw.rest.edge(id))
        }));
        let edges = || window.publishes.iter().chain(&window.subscribes);
        let nodes = edges()
            .map(|raw| self.bare_node(raw))
            .chain(window.nodes.iter().map(|raw| self.node_state(raw)));
        let topics = edges()
            .map(|raw| self.bare_topic(raw))
            .chain(window.topics.iter().map(|raw| self.topic_state(raw)));
        Graph {
            nodes: by_id(nodes),
            topics: by_id(topics),
            publishes,
            subscribes,
        }
    }

    fn node_state(&self, raw: &RawNode) -> (u32, NodeState) {
        let state = NodeState {
            id: self.nodes[raw.name.as_str()],
            state: raw.rest.state(),
            degree: raw.rest.degree(),
            hz: raw.rest.hz,
            lifecycle: raw.lifecycle.as_deref().map(Arc::from),
        };
        (state.id, state)
    }

    fn topic_state(&self, raw: &RawTopic) -> (u32, TopicState) {
        let state = TopicState {
            id: self.topics[raw.name.as_str()],
            state: raw.rest.state(),
            degree: raw.rest.degree(),
            count: raw.rest.count.unwrap_or(0),
            bytes: raw.rest.bytes,
            hz: raw.rest.hz,
            median_period_s: raw.median_period_s,
            max_gap_s: raw.max_gap_s,
            measures: raw.rest.measures(),
        };
        (state.id, state)
    }

    /// The state of a node that only an edge names.
    fn bare_node(&self, raw: &RawEdge) -> (u32, NodeState) {
        let id = self.nodes[raw.node.as_str()];
        (
            id,
            NodeState {
                id,
                state: raw.rest.state(),
                degree: raw.rest.degree(),
                hz: None,
                lifecycle: None,
            },
        )
    }

    /// The state of a topic that only an edge names.
    fn bare_topic(&self, raw: &RawEdge) -> (u32, TopicState) {
        let id = self.topics[raw.topic.as_str()];
        let state = TopicState {
            id,
            state: raw.rest.state(),
            degree: raw.rest.degree(),
            count: 0,
            bytes: None,
            hz: None,
            median_period_s: None,
            max_gap_s: None,
            measures: Measures::default(),
        };
        (id, state)
    }
}

/// The states sorted by id; of several with one id the last.
fn by_id<T>(states: impl Iterator<Item = (u32, T)>) -> Vec<T> {
    states.collect::<BTreeMap<_, _>>().into_values().collect()
}
