//! The changes from one graph to the next.

mod changes;

pub use changes::{Changes, RATE_CHANGE};

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::base::time::Stamp;
use crate::base::words::worded;
use crate::graph::{Element, ElementState, Graph, NodeId, TopicId};

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

/// The exact difference between two graphs: [`apply`] of it to the first gives the second. Each list is sorted
/// by element.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diff {
    /// States of new elements.
    pub added: Vec<ElementState>,
    /// Removed elements.
    pub removed: Vec<Element>,
    /// States before and after of elements that differ.
    pub changed: Vec<(ElementState, ElementState)>,
}

impl Diff {
    /// Whether the graphs are equal.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The difference from `before` to `after`.
pub fn diff(before: &Graph, after: &Graph) -> Diff {
    let mut diff = Diff::default();
    let mut old = before.states.iter().peekable();
    for new in &after.states {
        while let Some(gone) = old.next_if(|old| old.what < new.what) {
            diff.removed.push(gone.what);
        }
        match old.next_if(|old| old.what == new.what) {
            Some(old) if old == new => {}
            Some(old) => diff.changed.push((old.clone(), new.clone())),
            None => diff.added.push(new.clone()),
        }
    }
    diff.removed.extend(old.map(|gone| gone.what));
    diff
}

/// The result of applying `diff` to `before`.
pub fn apply(before: &Graph, diff: &Diff) -> Graph {
    let gone: BTreeSet<Element> = diff.removed.iter().copied().collect();
    let kept = before.states.iter().filter(|s| !gone.contains(&s.what));
    let fresh = diff.changed.iter().map(|(_, after)| after);
    let all = kept.chain(&diff.added).chain(fresh);
    let all: BTreeMap<Element, &ElementState> = all.map(|s| (s.what, s)).collect();
    Graph {
        states: all.into_values().cloned().collect(),
    }
}
