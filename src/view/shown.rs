//! The look of an item or arrow in one window: its state, its change, its numbers.

use std::sync::Arc;

use super::{ArrowId, Counts, ItemId, TopicRow};
use crate::evidence::Confidence;
use crate::graph::State;
use crate::mission::event_log::EventId;

/// The sum of two numbers of which one, or both, may be unknown.
pub(super) fn sum<T>(a: Option<T>, b: Option<T>, add: impl Fn(T, T) -> T) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(add(a, b)),
        (a, b) => a.or(b),
    }
}

/// The change of an item or arrow in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Mark {
    /// It began.
    Added,
    /// It ended and is listed in this one window as a ghost, or left and returns in a later window.
    Removed,
    /// Its rate rose.
    Faster,
    /// Its rate fell.
    Slower,
    /// It is a topic whose messages now come from other senders.
    HandedOver,
    /// It is back: a node that ended and returned, or a silent element that publishes again.
    Restarted,
    /// It paused.
    Paused,
    /// Its lifecycle state, type or quality of service changed.
    Changed,
    /// An element inside a group or a collapsed namespace was added, removed or changed.
    Inside,
    /// It is a node that left in an earlier window and returns in a later one.
    Away,
    /// It ended with others, as their common coloured frame shows.
    Gone,
}

impl Mark {
    /// Its exact word in SVG.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Removed => "removed",
            Self::Faster => "faster",
            Self::Slower => "slower",
            Self::HandedOver => "handed-over",
            Self::Restarted => "restarted",
            Self::Paused => "paused",
            Self::Changed => "changed",
            Self::Inside => "inside",
            Self::Away => "away",
            Self::Gone => "gone",
        }
    }

    /// Whether it has its own colour.
    pub(crate) fn has_color(self) -> bool {
        self != Self::Gone
    }

    /// The class in SVG: `added`, `removed`, `away`, `gone` or `changed`.
    pub fn class(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Removed => "removed",
            Self::Away => "away",
            Self::Gone => "gone",
            _ => "changed",
        }
    }
}

/// The look of an item or arrow in one window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// Its index in `View::items` or `View::arrows`.
    pub id: u32,
    /// Its state; for a ghost, the last one before its end.
    pub state: State,
    /// The strength of the evidence for it.
    pub confidence: Confidence,
    /// Its change in the window, if any.
    pub mark: Option<Mark>,
    /// Messages per second in the window, if known.
    pub hz: Option<f64>,
    /// Messages per second, averaged over the time between the rate changes before and after this window.
    pub steady_hz: Option<f64>,
    /// The rate that is written, with its number of messages: that of an earlier window as long as the
    /// difference may be random.
    pub held: Option<(f64, Option<u64>)>,
    /// Messages per second before and after, if `mark` is `Faster` or `Slower`.
    pub rates: Option<(f64, f64)>,
    /// Whether it is silent or away during the whole window, with a beginning and an end in the event log, or
    /// before its first message.
    pub is_paused: bool,
    /// Whether the subscriber receives nothing because the qualities of service are incompatible.
    pub is_starved: bool,
    /// The headlines behind `mark`, sorted: indices in the event log.
    pub events: Vec<EventId>,
    /// The topics that a bundle carries, sorted by index; empty for everything else.
    pub topics: Vec<TopicRow>,
    /// The number of equal namespaces it represents in the window; 0 for everything else.
    pub each: usize,
    /// The nodes and topics in a collapsed namespace in the graph of the window; none for everything else.
    pub members: Members,
    /// The number of headlines of each kind about elements inside a collapsed namespace or a bundle; `None` without any.
    pub inside: Option<Box<Counts>>,
    /// The number of messages in the window, if known.
    pub count: Option<u64>,
    /// The lifecycle state of a node, if it has one.
    pub lifecycle: Option<Arc<str>>,
}

/// The numbers of nodes and topics in a collapsed namespace that are in the graph of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Members {
    /// The number of nodes.
    pub nodes: usize,
    /// The number of topics.
    pub topics: usize,
}

impl Shown {
    /// The item that looks like this.
    pub fn item(&self) -> ItemId {
        ItemId(self.id)
    }

    /// The arrow that looks like this.
    pub fn arrow(&self) -> ArrowId {
        ArrowId(self.id)
    }
}

impl Members {
    /// The number written in the box: of its nodes, or of its topics if it has no nodes; `None` if it is not
    /// a collapsed namespace.
    pub(crate) fn number(self) -> Option<(usize, &'static str)> {
        match (self.nodes, self.topics) {
            (0, 0) => None,
            (0, topics) => Some((topics, "topic")),
            (nodes, _) => Some((nodes, "node")),
        }
    }
}

impl Shown {
    /// An element about which nothing else is known.
    pub fn plain(id: u32, state: State, confidence: Confidence) -> Self {
        Self {
            id,
            state,
            confidence,
            ..Self::default()
        }
    }

    /// The rate that is written, and its number of messages, as far as they are known.
    pub(crate) fn written_rate(&self) -> (Option<f64>, Option<u64>) {
        match self.held {
            Some((hz, count)) => (Some(hz), count),
            None => (self.hz, self.count),
        }
    }

    /// Whether it ended in the window.
    pub(crate) fn is_ghost(&self) -> bool {
        matches!(self.mark, Some(Mark::Removed | Mark::Gone))
    }

    /// Makes it the look of a service, whose lack of messages does not mean silence.
    pub(super) fn is_called(&mut self) {
        (self.state, self.is_paused) = (self.state.min(State::Active), false);
    }

    /// The topics of a bundle, those that changed first, then those with the highest rate.
    pub(crate) fn by_rate(&self) -> impl Iterator<Item = &TopicRow> {
        let mut rows: Vec<&TopicRow> = self.topics.iter().collect();
        let hz = |row: &TopicRow| row.hz.unwrap_or(0.0);
        rows.sort_by(|a, b| {
            let changed = b.mark.is_some().cmp(&a.mark.is_some());
            changed
                .then(hz(b).total_cmp(&hz(a)))
                .then(a.topic.cmp(&b.topic))
        });
        rows.into_iter()
    }
}
