//! The names of a mission read from JSON, and the graphs of its windows.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::elements::{KnownJson, LifeJson, NodeJson, PublishJson, TopicJson, evidence, spans};
use super::raw::RawWindow;
use crate::base::time::Stamp;
use crate::graph::{Edge, Element, ElementState, Elements, Existence, Graph, Node, Topic};

/// Names with their facts over all windows.
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
        let new = || Node {
            name: name.into(),
            role: name.into(),
            ..Node::default()
        };
        self.nodes.entry(name.into()).or_insert_with(new)
    }

    fn topic(&mut self, name: &str) -> &mut Topic {
        let new = || Topic {
            name: name.into(),
            ..Topic::default()
        };
        self.topics.entry(name.into()).or_insert_with(new)
    }

    /// Adds elements of each kind.
    pub(crate) fn elements(
        &mut self,
        nodes: &[NodeJson<'_>],
        topics: &[TopicJson<'_>],
        publishes: &[PublishJson<'_>],
        subscribes: &[PublishJson<'_>],
    ) {
        for raw in nodes {
            let node = self.node(&raw.name);
            if let Some(role) = &raw.role {
                node.role = (&**role).into();
            }
            widen(&mut node.seen, &raw.known, &raw.life);
        }
        for raw in topics {
            let topic = self.topic(&raw.name);
            topic
                .types
                .extend(raw.types.iter().map(|t| Arc::from(&**t)));
            topic.types.sort();
            topic.types.dedup();
            topic.qos = raw.qos.as_deref().map(Arc::from).or(topic.qos.take());
            topic.unknown_publishers = raw.unknown_publishers.or(topic.unknown_publishers);
            widen(&mut topic.seen, &raw.known, &raw.life);
        }
        for raw in publishes {
            let ends = self.ends(raw);
            let edge = self.publishes.entry(ends).or_default();
            widen(&mut edge.seen, &raw.edge.known, &raw.edge.life);
        }
        for raw in subscribes {
            let (node, topic) = self.ends(raw);
            let edge = self.subscribes.entry((topic, node)).or_default();
            widen(&mut edge.seen, &raw.edge.known, &raw.edge.life);
        }
    }

    /// The names of the node and the topic of an edge, which it adds.
    fn ends(&mut self, raw: &PublishJson<'_>) -> (Arc<str>, Arc<str>) {
        self.node(&raw.node);
        self.topic(&raw.topic);
        ((*raw.node).into(), (*raw.topic).into())
    }

    /// Assigns all ids.
    pub(crate) fn placed(self) -> Elements {
        let mut all = Elements {
            nodes: self.nodes.into_values().collect(),
            topics: self.topics.into_values().collect(),
            ..Elements::default()
        };
        let placed = |node: &str, topic: &str, edge: Edge| Edge {
            node: all.node(node).unwrap_or_default(),
            topic: all.topic(topic).unwrap_or_default(),
            ..edge
        };
        let publishes = self.publishes.into_iter();
        let publishes = publishes.map(|((node, topic), edge)| placed(&node, &topic, edge));
        let publishes = publishes.collect();
        let subscribes = self.subscribes.into_iter();
        let subscribes = subscribes.map(|((topic, node), edge)| placed(&node, &topic, edge));
        all.subscribes = subscribes.collect();
        all.publishes = publishes;
        all
    }
}

/// Adds the evidence and times of an element. The first intervals are kept: up to schema 2 every window repeats all of them.
fn widen(seen: &mut Existence, known: &KnownJson<'_>, life: &LifeJson) {
    seen.evidence = seen.evidence.and(evidence(&known.evidence));
    let begins = [seen.first, life.first_ns.map(Stamp)];
    seen.first = begins.into_iter().flatten().min();
    seen.last = seen.last.max(life.last_ns.map(Stamp));
    if seen.lives.is_empty() {
        seen.lives = spans(&life.lives);
    }
}

/// The graph of a window; an element listed twice counts once, and the ends of an edge are always included.
pub(crate) fn graph(window: &RawWindow, all: &Elements) -> Graph {
    let mut states = BTreeMap::new();
    let mut add = |state: ElementState| _ = states.insert(state.what, state);
    let publishes = window.publishes.iter().map(|raw| (raw, true));
    let subscribes = window.subscribes.iter().map(|raw| (raw, false));
    for (PublishJson { node, topic, edge }, publishes) in publishes.chain(subscribes) {
        let ends = (
            all.node(node).unwrap_or_default(),
            all.topic(topic).unwrap_or_default(),
        );
        // An end is at least as certain as the edge.
        add(edge.known.state(Element::Node(ends.0)));
        let topic = edge.known.state(Element::Topic(ends.1));
        add(ElementState {
            count: Some(0),
            ..topic
        });
        let what = if publishes {
            all.published(ends)
        } else {
            all.subscribed(ends)
        };
        if let Some(what) = what {
            add(edge.state(what));
        }
    }
    for raw in &window.nodes {
        add(raw.state(all.node(&raw.name).unwrap_or_default()));
    }
    for raw in &window.topics {
        add(raw.state(all.topic(&raw.name).unwrap_or_default()));
    }
    Graph {
        states: states.into_values().collect(),
    }
}
