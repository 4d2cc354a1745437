//! The changes from one graph to the next.

mod changes;

pub use changes::{Changes, RATE_CHANGE};

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::base::time::Stamp;
use crate::base::words::worded;
use crate::graph::{EdgeState, Element, Graph, NodeId, NodeState, TopicId, TopicState};

/// A reconfiguration, as in JSON and the log of events.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Change {
    /// An element that was not in the previous window.
    Added {
        /// The element.
        what: Element,
        /// The time of its first sign in the window, if known.
        time: Option<Stamp>,
    },
    /// An element that was in the previous window and is not in this one.
    Removed {
        /// The element.
        what: Element,
        /// The time of its last sign, if known.
        time: Option<Stamp>,
    },
    /// The rate of a topic or publication changed by more than the threshold.
    Rate {
        /// The topic or publication.
        what: Element,
        /// Messages per second in the previous window.
        from_hz: f64,
        /// Messages per second in this window.
        to_hz: f64,
    },
    /// All publishers of a topic were replaced by others.
    HandedOver {
        /// The topic.
        topic: TopicId,
        /// The publishers before, sorted.
        from: Vec<NodeId>,
        /// The publishers now, sorted.
        to: Vec<NodeId>,
    },
    /// A node that restarted under the same name.
    Restarted {
        /// The node.
        node: NodeId,
        /// The time at which it was first seen again.
        time: Stamp,
    },
    /// A value of an element changed.
    Value {
        /// The kind of value.
        kind: ValueKind,
        /// The element.
        what: Element,
        /// The value before, empty if none.
        from: Arc<str>,
        /// The value now, empty if none.
        to: Arc<str>,
    },
}

impl Change {
    /// The word for the change's kind in JSON and in the log of events.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Added { .. } => "added",
            Self::Removed { .. } => "removed",
            Self::Rate { .. } => "rate",
            Self::HandedOver { .. } => "handed_over",
            Self::Restarted { .. } => "restarted",
            Self::Value { kind, .. } => kind.word(),
        }
    }
}

worded! {
    /// The kinds of values in [`Change::Value`].
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ValueKind {
        /// The types of a topic.
        Type = "type",
        /// The quality of service of a topic.
        Qos = "qos",
        /// The lifecycle state of a node.
        Lifecycle = "lifecycle",
    }
}

/// The exact difference between two graphs: [`apply`] of it to the first gives the second.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diff {
    /// Differences in nodes.
    pub nodes: Delta<NodeState>,
    /// Differences in topics.
    pub topics: Delta<TopicState>,
    /// Differences in publications.
    pub publishes: Delta<EdgeState>,
    /// Differences in subscriptions.
    pub subscribes: Delta<EdgeState>,
}

/// The elements of one part of a difference.
macro_rules! elements {
    ($diff:expr, $part:ident) => {{
        let nodes = $diff.nodes.$part.iter().map(|s| Element::Node(s.id));
        let topics = $diff.topics.$part.iter().map(|s| Element::Topic(s.id));
        let publishes = $diff.publishes.$part.iter();
        let subscribes = $diff.subscribes.$part.iter();
        let publishes = publishes.map(|s| Element::Publish(s.id));
        let subscribes = subscribes.map(|s| Element::Subscribe(s.id));
        nodes.chain(topics).chain(publishes).chain(subscribes)
    }};
}

impl Diff {
    /// The new elements.
    pub(crate) fn added(&self) -> impl Iterator<Item = Element> {
        elements!(self, added)
    }

    /// The removed elements.
    pub(crate) fn removed(&self) -> impl Iterator<Item = Element> {
        elements!(self, removed)
    }
}

/// The difference between one list of two graphs. Each part is sorted by id.
#[derive(Clone, Debug, PartialEq)]
pub struct Delta<T> {
    /// States of new elements.
    pub added: Vec<T>,
    /// States of removed elements, before.
    pub removed: Vec<T>,
    /// States before and after of elements that differ.
    pub changed: Vec<(T, T)>,
}

impl<T> Default for Delta<T> {
    fn default() -> Self {
        Self {
            added: Vec::new(),
            removed: Vec::new(),
            changed: Vec::new(),
        }
    }
}

impl Diff {
    /// Whether the graphs are equal.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The difference from `before` to `after`.
pub fn diff(before: &Graph, after: &Graph) -> Diff {
    Diff {
        nodes: delta(&before.nodes, &after.nodes),
        topics: delta(&before.topics, &after.topics),
        publishes: delta(&before.publishes, &after.publishes),
        subscribes: delta(&before.subscribes, &after.subscribes),
    }
}

/// The result of applying `diff` to `before`.
pub fn apply(before: &Graph, diff: &Diff) -> Graph {
    Graph {
        nodes: patched(&before.nodes, &diff.nodes),
        topics: patched(&before.topics, &diff.topics),
        publishes: patched(&before.publishes, &diff.publishes),
        subscribes: patched(&before.subscribes, &diff.subscribes),
    }
}

/// An element state with an index in the mission's list of elements.
trait HasId {
    fn place(&self) -> u32;
}

macro_rules! placed {
    ($($type:ty),*) => { $(impl HasId for $type { fn place(&self) -> u32 { self.id.0 } })* };
}
placed!(NodeState, TopicState, EdgeState);

/// The difference between two lists that are sorted by id.
fn delta<T: HasId + Clone + PartialEq>(before: &[T], after: &[T]) -> Delta<T> {
    let mut delta = Delta::default();
    let (mut old, mut new) = (before.iter().peekable(), after.iter().peekable());
    loop {
        match (old.peek(), new.peek()) {
            (Some(b), Some(a)) if b.place() == a.place() => {
                if b != a {
                    delta.changed.push(((*b).clone(), (*a).clone()));
                }
                old.next();
                new.next();
            }
            (Some(b), a) if a.is_none_or(|a| b.place() < a.place()) => {
                delta.removed.push((*b).clone());
                old.next();
            }
            (_, Some(a)) => {
                delta.added.push((*a).clone());
                new.next();
            }
            _ => return delta,
        }
    }
}

fn patched<T: HasId + Clone>(before: &[T], delta: &Delta<T>) -> Vec<T> {
    let gone: BTreeSet<u32> = delta.removed.iter().map(T::place).collect();
    let kept = before.iter().filter(|s| !gone.contains(&s.place()));
    let mut all: BTreeMap<u32, T> = kept.map(|s| (s.place(), s.clone())).collect();
    let fresh = delta
        .added
        .iter()
        .chain(delta.changed.iter().map(|(_, after)| after));
    all.extend(fresh.map(|s| (s.place(), s.clone())));
    all.into_values().collect()
}
