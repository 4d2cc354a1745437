//! What changed from one graph to the next.

use std::sync::Arc;

use crate::graph::{Element, NodeId, TopicId};
use crate::time::Stamp;

/// One reconfiguration, as JSON and the log of events tell it.
#[derive(Clone, Debug, PartialEq)]
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
