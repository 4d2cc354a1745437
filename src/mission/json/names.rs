//! The names of a mission read from JSON, and the graphs of its windows.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::elements::{
    EdgeJson, LifeJson, NodeJson, PublishJson, Text, TopicJson, evidence, spans,
};
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

    pub(crate) fn window(&mut self, window: &RawWindow) {
        self.elements(&window.nodes, &window.topics, &window.publishes);
        for raw in &window.subscribes {
            self.subscribe(&raw.node, &raw.topic, &raw.edge);
        }
    }

    /// Adds all elements except subscriptions.
    pub(crate) fn elements(
        &mut self,
        nodes: &[NodeJson<'_>],
        topics: &[TopicJson<'_>],
        publishes: &[PublishJson<'_>],
    ) {
        for raw in nodes {
            let node = self.node(&raw.name);
            if let Some(role) = &raw.role {
                node.role = (&**role).into();
            }
            widen(&mut node.seen, &raw.evidence, &raw.life);
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
            widen(&mut topic.seen, &raw.evidence, &raw.life);
        }
        for raw in publishes {
            self.node(&raw.node);
            self.topic(&raw.topic);
            let key = ((*raw.node).into(), (*raw.topic).into());
            learn(self.publishes.entry(key).or_default(), &raw.edge);
        }
    }

    pub(crate) fn subscribe(&mut self, node: &str, topic: &str, raw: &EdgeJson<'_>) {
        self.node(node);
        self.topic(topic);
        let edge = self.subscribes.entry((topic.into(), node.into()));
        learn(edge.or_default(), raw);
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

fn learn(edge: &mut Edge, raw: &EdgeJson<'_>) {
    widen(&mut edge.seen, &raw.evidence, &raw.life);
}

/// Adds the evidence and times of an element. The first intervals are kept: up to schema 2 every window repeats all of them.
fn widen(known: &mut Existence, words: &[Text<'_>], life: &LifeJson) {
    known.evidence = known.evidence.and(evidence(words));
    let begins = [known.first, life.first_ns.map(Stamp)];
    known.first = begins.into_iter().flatten().min();
    known.last = known.last.max(life.last_ns.map(Stamp));
    if known.lives.is_empty() {
        known.lives = spans(&life.lives);
    }
}

/// The graph of a window; an element listed twice counts once, and the ends of an edge are always included.
pub(crate) fn graph(window: &RawWindow, all: &Elements) -> Graph {
    let mut states = BTreeMap::new();
    let mut add = |state: ElementState| _ = states.insert(state.what, state);
    let publishes = window.publishes.iter();
    let publishes = publishes.map(|raw| (&raw.node, &raw.topic, &raw.edge, true));
    let subscribes = window.subscribes.iter();
    let subscribes = subscribes.map(|raw| (&raw.node, &raw.topic, &raw.edge, false));
    for (node, topic, edge, publishes) in publishes.chain(subscribes) {
        let ends = (
            all.node(node).unwrap_or_default(),
            all.topic(topic).unwrap_or_default(),
        );
        add(edge.end(Element::Node(ends.0)));
        let topic = edge.end(Element::Topic(ends.1));
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
