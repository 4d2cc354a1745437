//! What is known not to be there: edges that a complete list of a node's would name, and does not.

use std::collections::{BTreeMap, BTreeSet};

use super::{Conclusions, Key, Reliability};
use crate::evidence::SOURCES;
use crate::evidence::claim::{Claim, Name};

/// Complete lists of what nodes publish and subscribe, as far as somebody gives them.
#[derive(Debug, Default)]
pub(crate) struct Closed {
    /// By node: all that a rospy node names as its own, or all that a snapshot of the graph shows of a node.
    all: BTreeMap<Name, BTreeSet<Name>>,
    /// By node: all that a roscpp node publishes.
    published: BTreeMap<Name, BTreeSet<Name>>,
    /// Topics whose every message names its publisher, with all of these.
    told: BTreeMap<Name, BTreeSet<Name>>,
}

impl Closed {
    pub(crate) fn new(known: &Conclusions<'_>) -> Self {
        let mut closed = Self::default();
        for fact in &known.facts.list {
            let listed = fact.snapshot.is_some();
            let word = SOURCES.get(fact.source).map_or("", |s| s.word);
            match (fact.claim, word) {
                (Claim::Lists(node, topic), _)
                | (Claim::Publish(node, topic) | Claim::Subscribe(node, topic), "rosgraph") => {
                    closed.all.entry(node).or_default().insert(topic);
                }
                (Claim::Publish(node, topic), "rosout") if listed => {
                    closed.published.entry(node).or_default().insert(topic);
                }
                _ => {}
            }
        }
        closed.tell(known);
        closed
    }

    fn tell(&mut self, known: &Conclusions<'_>) {
        let mut untold = BTreeSet::new();
        for stream in known.streams {
            match stream.publisher {
                Some(node) if stream.trust == Reliability::Whole => {
                    self.told.entry(stream.topic).or_default().insert(node);
                }
                _ => {
                    untold.insert(stream.topic);
                }
            }
        }
        self.told.retain(|topic, _| !untold.contains(topic));
    }

    /// Whether some complete list leaves this edge out; nothing is known against nodes and topics.
    pub(crate) fn denies(&self, what: Key) -> bool {
        let lacks = |lists: &BTreeMap<Name, BTreeSet<Name>>, of: Name, member: Name| {
            lists.get(&of).is_some_and(|list| !list.contains(&member))
        };
        match what {
            Key::Publish(node, topic) => {
                lacks(&self.all, node, topic)
                    || lacks(&self.published, node, topic)
                    || lacks(&self.told, topic, node)
            }
            Key::Subscribe(topic, node) => lacks(&self.all, node, topic),
            Key::Node(_) | Key::Topic(_) => false,
        }
    }
}
