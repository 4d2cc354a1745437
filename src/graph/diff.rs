//! What changed from one graph to the next.

mod changes;

pub use changes::{Changes, RATE_CHANGE};

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::base::time::Stamp;
use crate::graph::{EdgeState, Element, Graph, NodeId, NodeState, TopicId, TopicState};

/// One reconfiguration, as JSON and the log of events tell it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Change {
    /// It was not in the window before.
    Added {
        /// What.
        what: Element,
        /// Its first sign of life in the window, if known.
        time: Option<Stamp>,
    },
    /// It was in the window before and is not in this one.
    Removed {
        /// What.
        what: Element,
        /// Its last sign of life, if known.
        time: Option<Stamp>,
    },
    /// The rate of a topic or publication changed by more than the threshold.
    Rate {
        /// A topic or publication.
        what: Element,
        /// Messages per second in the window before.
        from_hz: f64,
        /// Messages per second in this one.
        to_hz: f64,
    },
    /// A topic lost all its publishers and got others.
    HandedOver {
        /// The topic.
        topic: TopicId,
        /// Who published it before, sorted.
        from: Vec<NodeId>,
        /// Who publishes it now, sorted.
        to: Vec<NodeId>,
    },
    /// A node began anew under the same name.
    Restarted {
        /// The node.
        node: NodeId,
        /// When it was first seen again.
        time: Stamp,
    },
    /// A value of an element changed.
    Value {
        /// Which value.
        kind: ValueKind,
        /// Of what.
        what: Element,
        /// Before, empty if none.
        from: Arc<str>,
        /// Now, empty if none.
        to: Arc<str>,
    },
}

impl Change {
    /// The word for its kind in JSON and in the log of events.
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

/// The values that [`Change::Value`] tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueKind {
    /// The types of a topic.
    Type,
    /// The quality of service of a topic.
    Qos,
    /// The lifecycle state of a node.
    Lifecycle,
}

impl ValueKind {
    /// Its word in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Type => "type",
            Self::Qos => "qos",
            Self::Lifecycle => "lifecycle",
        }
    }
}

/// What turns one graph into the next, exactly: [`apply`] of it to the first gives the second.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diff {
    /// Nodes.
    pub nodes: Delta<NodeState>,
    /// Topics.
    pub topics: Delta<TopicState>,
    /// Publications.
    pub publishes: Delta<EdgeState>,
    /// Subscriptions.
    pub subscribes: Delta<EdgeState>,
}

/// What happened in one list of a graph. Each part is sorted by id.
#[derive(Clone, Debug, PartialEq)]
pub struct Delta<T> {
    /// States of what is new.
    pub added: Vec<T>,
    /// Ids of what is gone.
    pub removed: Vec<u32>,
    /// States before and after of what differs in anything.
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

    /// Whether an element appeared or vanished.
    pub fn is_structural(&self) -> bool {
        fn moved<T>(delta: &Delta<T>) -> bool {
            !delta.added.is_empty() || !delta.removed.is_empty()
        }
        moved(&self.nodes)
            || moved(&self.topics)
            || moved(&self.publishes)
            || moved(&self.subscribes)
    }
}

/// What changed from `before` to `after`.
pub fn diff(before: &Graph, after: &Graph) -> Diff {
    Diff {
        nodes: delta(&before.nodes, &after.nodes),
        topics: delta(&before.topics, &after.topics),
        publishes: delta(&before.publishes, &after.publishes),
        subscribes: delta(&before.subscribes, &after.subscribes),
    }
}

/// The graph that `diff` makes of `before`.
pub fn apply(before: &Graph, diff: &Diff) -> Graph {
    Graph {
        nodes: patched(&before.nodes, &diff.nodes),
        topics: patched(&before.topics, &diff.topics),
        publishes: patched(&before.publishes, &diff.publishes),
        subscribes: patched(&before.subscribes, &diff.subscribes),
    }
}

/// Something with a place in the mission's list of elements.
trait HasId {
    fn place(&self) -> u32;
}

macro_rules! placed {
    ($($type:ty),*) => { $(impl HasId for $type { fn place(&self) -> u32 { self.id } })* };
}
placed!(NodeState, TopicState, EdgeState);

/// Walks two lists that are sorted by id, in step.
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
                delta.removed.push(b.place());
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
    let gone: BTreeSet<u32> = delta.removed.iter().copied().collect();
    let kept = before.iter().filter(|s| !gone.contains(&s.place()));
    let mut all: BTreeMap<u32, T> = kept.map(|s| (s.place(), s.clone())).collect();
    let fresh = delta
        .added
        .iter()
        .chain(delta.changed.iter().map(|(_, after)| after));
    all.extend(fresh.map(|s| (s.place(), s.clone())));
    all.into_values().collect()
}
