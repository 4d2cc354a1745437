//! Edges known not to exist: a complete list of a node's edges omits them.

use std::collections::{BTreeMap, BTreeSet};

use super::{Conclusions, ElementKey, Reliability};
use crate::base::time::Span;
use crate::evidence::observation::{Name, Observation};
use crate::evidence::source_word;

/// Complete lists of the topics that nodes publish and subscribe to, if there are any.
#[derive(Debug, Default)]
pub(crate) struct Closed {
    /// By node: all topics that a rospy node names as its own, or all that a snapshot of the graph shows for
    /// a node.
    all: BTreeMap<Name, BTreeSet<Name>>,
    /// By node: all topics that a roscpp node publishes.
    published: BTreeMap<Name, BTreeSet<Name>>,
    /// Nodes whose lists were repeated long after the first: a list made at a node's start may lack later topics.
    settled: BTreeSet<Name>,
    /// Topics on which every message names its publisher, with all these publishers.
    stated: BTreeMap<Name, BTreeSet<Name>>,
}

impl Closed {
    pub(crate) fn new(known: &Conclusions<'_>) -> Self {
        let mut closed = Self::default();
        let mut context: BTreeMap<Name, Span> = BTreeMap::new();
        for fact in &known.facts.list {
            let listed = fact.snapshot.is_some();
            let word = source_word(fact.source);
            if let (
                Observation::Lists(node, _) | Observation::Publish(node, _),
                Some((first, last)),
                true,
            ) = (
                fact.observation,
                known.facts.times.bounds(fact.times),
                listed,
            ) {
                let span = context.entry(node).or_insert(Span::new(first, last));
                span.start = span.start.min(first);
                span.end = span.end.max(last);
            }
            match (fact.observation, word) {
                (Observation::Lists(node, topic), _)
                | (
                    Observation::Publish(node, topic) | Observation::Subscribe(node, topic),
                    "rosgraph",
                ) => {
                    closed.all.entry(node).or_default().insert(topic);
                }
                (Observation::Publish(node, topic), "rosout") if listed => {
                    closed.published.entry(node).or_default().insert(topic);
                }
                _ => {}
            }
        }
        context.retain(|_, span| span.nanos() >= SETTLED_NS);
        closed.settled = context.into_keys().collect();
        closed.fill(known);
        closed
    }

    fn fill(&mut self, known: &Conclusions<'_>) {
        let mut unnamed = BTreeSet::new();
        for stream in known.streams {
            match stream.publisher {
                Some(node) if stream.trust == Reliability::Whole => {
                    self.stated.entry(stream.topic).or_default().insert(node);
                }
                _ => {
                    unnamed.insert(stream.topic);
                }
            }
        }
        self.stated.retain(|topic, _| !unnamed.contains(topic));
    }

    /// Whether every message of a topic names its publisher, and this node is never named.
    pub(crate) fn headers_deny(&self, what: ElementKey) -> bool {
        match what {
            ElementKey::Publish(node, topic) => lacks(&self.stated, topic, node),
            _ => false,
        }
    }

    /// Whether a complete list that was made long after its node's start omits this edge.
    pub(crate) fn settled_lists_deny(&self, what: ElementKey) -> bool {
        let node = match what {
            ElementKey::Publish(node, _) | ElementKey::Subscribe(_, node) => node,
            ElementKey::Node(_) | ElementKey::Topic(_) => return false,
        };
        self.settled.contains(&node) && self.lists_deny(what)
    }

    /// Whether a complete list omits this edge; false for nodes and topics.
    pub(crate) fn lists_deny(&self, what: ElementKey) -> bool {
        match what {
            ElementKey::Publish(node, topic) => {
                lacks(&self.all, node, topic) || lacks(&self.published, node, topic)
            }
            ElementKey::Subscribe(topic, node) => lacks(&self.all, node, topic),
            ElementKey::Node(_) | ElementKey::Topic(_) => false,
        }
    }
}

/// The time after a node's start at which it has made its connections, in nanoseconds.
const SETTLED_NS: i64 = 5_000_000_000;

/// Whether there is a list for `of` without `member`.
fn lacks(lists: &BTreeMap<Name, BTreeSet<Name>>, of: Name, member: Name) -> bool {
    lists.get(&of).is_some_and(|list| !list.contains(&member))
}
