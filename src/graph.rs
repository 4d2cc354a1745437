//! The computation graph of one window: its nodes, topics and edges, with their states and rates.
//!
//! In: everything recorded and the findings of the evidence. Out: [`Elements`], their `history` in continuous time, and
//! a [`Graph`] per window. Begin with [`build`]: conclusions, the traffic of every topic, the history, then the windows.
//!
//! A graph contains numbers only; names are stored once, in the [`Elements`] of the whole mission, sorted, so that an index
//! is an order and equal graphs are equal bytes.

mod elements;
mod graphs;
pub(crate) mod history;
pub mod window;
mod windowed;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::base::error::Result;
pub use crate::base::ids::{ById, Id};
use crate::base::notice::Notices;
use crate::base::time::{Span, Stamp};
use crate::base::words::worded;
use crate::evidence::collector::Recorded;
use crate::evidence::conclude::{self, conclude};
use crate::evidence::{Confidence, EvidenceLine};

#[cfg(test)]
pub(crate) use graphs::tests as graphs_for_tests;
pub(crate) use graphs::{Column, ColumnCursor, ColumnWriter, GraphsWriter, Number, Row};
pub use graphs::{Graphs, Iter as GraphsIter};

pub(crate) use elements::Wiring;
pub use elements::{
    Edge, EdgeId, Element, Elements, Existence, Node, NodeId, PerElement, Topic, TopicId,
};
pub(crate) use history::{History, made, parts, traffic, unread};
use history::{Life, Sending};
pub(crate) use windowed::{TopicCount, Windowed, counts, graphs};

worded! {
    /// The state of an element in one window.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum State {
        /// Messages or evidence in the window.
        #[default]
        Active = "active",
        /// Present without a message.
        Silent = "silent",
        /// Present through a latched or transient-local message.
        Latched = "latched",
        /// Known from a header or metadata only.
        Declared = "declared",
    }
}

/// Measurements of the messages of a topic or edge in one window, besides their number.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Measures {
    /// The number of messages that a subscriber lost, as statistics of the middleware count them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drops: Option<u64>,
    /// The standard deviation of the time between messages in seconds; `None` with fewer than three messages.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter_s: Option<f64>,
    /// The mean time from a message's header stamp to its recording, or to its arrival according to
    /// statistics, in seconds; negative if clocks differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub age_s: Option<f64>,
}

/// The state of an element in one window.
#[derive(Clone, Debug, PartialEq)]
pub struct ElementState {
    /// The element.
    pub what: Element,
    /// The state.
    pub state: State,
    /// The strength of the evidence for it in this window.
    pub confidence: Confidence,
    /// The number of messages on the topic or over the edge in the window, if known; `None` for a node.
    pub count: Option<u64>,
    /// The payload bytes of these messages, if known.
    pub bytes: Option<u64>,
    /// Messages per second over the window's true length; for a node, the sum of those of its publications.
    /// `None` if unknown, and below 1 ms of length.
    pub hz: Option<f64>,
    /// The median time between messages of a topic in seconds; `None` with fewer than two messages.
    pub median_period_s: Option<f64>,
    /// The longest time between messages of a topic in seconds; `None` with fewer than two messages.
    pub max_gap_s: Option<f64>,
    /// The lifecycle state of a node, if it has one: `inactive`, `active`, …
    pub lifecycle: Option<Arc<str>>,
    /// Further numbers.
    pub measures: Measures,
}

impl ElementState {
    /// A state without numbers.
    pub fn new(what: Element, state: State, confidence: Confidence) -> Self {
        Self {
            what,
            state,
            confidence,
            count: None,
            bytes: None,
            hz: None,
            median_period_s: None,
            max_gap_s: None,
            lifecycle: None,
            measures: Measures::default(),
        }
    }

    /// The number of messages, 0 if unknown.
    pub fn messages(&self) -> u64 {
        self.count.unwrap_or(0)
    }
}

/// The computation graph of one window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// The elements that exist in the window, sorted: nodes, topics, publications, subscriptions.
    pub states: Vec<ElementState>,
}

/// The traffic of a node in one window: the messages of its topics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct NodeLoad {
    /// The number of topics that it subscribes to.
    pub topics_in: u32,
    /// The number of topics that it publishes.
    pub topics_out: u32,
    /// The number of messages on the topics that it subscribes to, whether or not they reached it.
    pub messages_in: u64,
    /// The number of messages that it is known to have sent.
    pub messages_out: u64,
    /// Their payload bytes, if all are known.
    pub bytes_in: Option<u64>,
    /// The payload bytes of the messages that it is known to have sent, if all are known.
    pub bytes_out: Option<u64>,
}

/// The states of one kind of element, by id.
macro_rules! of_kind {
    ($($(#[$doc:meta])* $name:ident: $kind:ident $id:ident;)*) => {$(
        $(#[$doc])*
        pub fn $name(&self) -> impl Iterator<Item = ($id, &ElementState)> + Clone {
            self.states.iter().filter_map(|state| match state.what {
                Element::$kind(id) => Some((id, state)),
                _ => None,
            })
        }
    )*};
}

impl Graph {
    of_kind! {
        /// Nodes in the window, sorted by id.
        nodes: Node NodeId;
        /// Topics in the window, sorted by id.
        topics: Topic TopicId;
        /// Publications in the window, sorted by id.
        publishes: Publish EdgeId;
        /// Subscriptions in the window, sorted by id.
        subscribes: Subscribe EdgeId;
    }

    /// The state of an element; `None` if it does not exist in the window.
    pub fn get(&self, what: Element) -> Option<&ElementState> {
        let at = self.states.binary_search_by_key(&what, |state| state.what);
        self.states.get(at.ok()?)
    }

    /// Who publishes what in the window: node, topic, and the state of the publication with its rate.
    pub fn publications<'a>(
        &'a self,
        elements: &'a Elements,
    ) -> impl Iterator<Item = (&'a Node, &'a Topic, &'a ElementState)> {
        self.publishes().filter_map(|(id, state)| {
            let edge = elements.publishes.get(id)?;
            let node = elements.nodes.get(edge.node)?;
            Some((node, elements.topics.get(edge.topic)?, state))
        })
    }

    /// The traffic of each node, in the order of [`Graph::nodes`].
    pub fn loads(&self, elements: &Elements) -> Vec<NodeLoad> {
        let idle = NodeLoad {
            bytes_in: Some(0),
            bytes_out: Some(0),
            ..NodeLoad::default()
        };
        let nodes: Vec<NodeId> = self.nodes().map(|(id, _)| id).collect();
        let mut all = vec![idle; nodes.len()];
        let place = |edge: Option<&Edge>| nodes.binary_search(&edge?.node).ok();
        let add = |sum: &mut Option<u64>, more: Option<u64>| {
            *sum = sum.zip(more).map(|(sum, more)| sum.saturating_add(more));
        };
        for (id, state) in self.publishes() {
            if let Some(at) = place(elements.publishes.get(id)) {
                let load = &mut all[at];
                load.topics_out += 1;
                load.messages_out += state.messages();
                let bytes = state.bytes.or((state.messages() == 0).then_some(0));
                add(&mut load.bytes_out, bytes);
            }
        }
        for (id, _) in self.subscribes() {
            let edge = elements.subscribes.get(id);
            if let (Some(at), Some(edge)) = (place(edge), edge) {
                let load = &mut all[at];
                let topic = self.get(Element::Topic(edge.topic));
                load.topics_in += 1;
                load.messages_in += topic.map_or(0, ElementState::messages);
                let bytes = topic.map_or(Some(0), |topic| topic.bytes);
                add(&mut load.bytes_in, bytes);
            }
        }
        all
    }
}

/// The shortest window that has rates, in nanoseconds.
const SHORTEST_NS: i64 = 1_000_000;

/// The rate of `count` messages in a window, in messages per second; `None` below 1 ms.
pub(crate) fn per_second(count: u64, window: Span) -> Option<f64> {
    let nanos = window.nanos();
    (nanos >= SHORTEST_NS).then(|| count as f64 / (nanos as f64 / 1e9))
}

/// The shortest time that has a rate of its own, in nanoseconds: what many nodes send within milliseconds at their start is no
/// rate.
const SHORTEST_SENDING_NS: i64 = 50_000_000;

/// The rate of `count` messages from the first of them to the last, in messages per second; `None` for fewer than two, and
/// below 0.05 s.
pub(crate) fn mean_rate(count: u64, (first, last): (Stamp, Stamp)) -> Option<f64> {
    rate_between(count.checked_sub(1)?, Span::new(first, last), i64::MAX)
}

/// The rate of so many intervals between messages, which take the time `sending` of a window of `window` nanoseconds, in
/// messages per second; `None` without intervals, and below 0.05 s in a longer window.
pub(crate) fn rate_between(intervals: u64, sending: Span, window: i64) -> Option<f64> {
    let is_long = sending.nanos() >= SHORTEST_SENDING_NS.min(window);
    per_second(intervals, sending).filter(|_| is_long && intervals > 0)
}

/// The result of building all graphs for one division of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Built {
    /// All nodes, topics and edges of the mission.
    pub elements: Elements,
    /// A graph per window.
    pub graphs: Vec<Graph>,
    /// The number of messages of each window.
    pub messages: Vec<u64>,
    /// The lifetimes of each element.
    pub lives: PerElement<Vec<Life>>,
    /// The messages of every sender.
    pub sending: Sending,
    /// Notices about the user's files.
    pub notices: Notices,
    /// Every requested piece of evidence.
    pub lines: Vec<EvidenceLine>,
}

/// Draws the conclusions and builds the graph of each window. Windows are sorted by start, none inside another; they
/// may overlap.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub fn build(
    recorded: &Recorded,
    windows: &[Span],
    options: &conclude::ConcludeOptions,
) -> Result<Built> {
    let mut findings = conclude(recorded, options)?;
    let traffic = traffic(recorded, &findings)?;
    let history = made(recorded, &mut findings, &traffic)?;
    let windowed = graphs(recorded, &findings, &history, windows)?;
    Ok(Built {
        lives: PerElement::new(&history.elements, |what| {
            let record = history.records.of(what);
            record.map_or_else(Vec::new, |record| record.lives.clone())
        }),
        elements: history.elements,
        graphs: windowed.graphs.iter().collect(),
        messages: windowed.messages,
        sending: history.sending,
        notices: findings.notices,
        lines: findings.lines,
    })
}

#[cfg(test)]
mod tests;
