//! The mission: all windows with their graphs and changes.
//!
//! In: the elements, the history and the graph of each window. Out: a [`Mission`], with its log of events, its phases and its
//! summary, as JSON and back. Begin with `event_log`, what happened and when; `phases` divides the mission by it, `info` sums it
//! up, `json` writes and reads it.

pub mod event_log;
pub mod info;
pub mod phases;
pub(crate) mod rates;

pub(crate) mod changes;
mod joined;
mod json;
pub use changes::Change;
pub(crate) use changes::RATE_CHANGE;
pub(crate) use json::Json;
pub use json::{read_json, write_json};

use serde::{Deserialize, Serialize};

use crate::bag::Report;
use crate::base::geometry::Rect;
use crate::base::notice::Notices;
use crate::base::time::{Period, Span, Stamp};
use crate::evidence::observation::LoggedText;
use crate::graph::history::{Record, Sending, windows};
use crate::graph::{ById, Element, Elements, Graph, Graphs, TopicId};

pub(crate) use event_log::EventId;
pub use event_log::EventLog;

/// One window; its graph is in [`Mission::graphs`].
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Window {
    /// The index, counted from 0.
    pub index: usize,
    /// The time span; the last window may be shorter than the period.
    pub span: Span,
    /// Whether it is shorter than the period.
    pub partial: bool,
    /// The number of messages in it.
    pub messages: u64,
    /// The changes since the window before; empty in the first.
    pub changes: Vec<Change>,
    /// The log events that the changes belong to, one per change.
    pub events: Vec<EventId>,
}

/// A mission as a sequence of graphs.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Mission {
    /// The bags from which it was read, in order.
    pub bags: Vec<Report>,
    /// The time from the first message to the last, plus 1 ns.
    pub span: Span,
    /// The number of messages.
    pub messages: u64,
    /// The length of a window.
    pub period: Period,
    /// The time from the start of one window to the start of the next.
    pub step: Period,
    /// All nodes, topics and edges, with names, types and evidence.
    pub elements: Elements,
    /// The windows in order, including empty ones.
    pub windows: Vec<Window>,
    /// The graph of each window.
    pub graphs: Graphs,
    /// The events, in continuous time.
    pub log: EventLog,
    /// The activity of every sender, in continuous time.
    pub sending: Sending,
    /// The positions of the drawing, if one was made.
    pub layout: Option<Places>,
    /// Problems that did not stop the reading.
    pub notices: Notices,
    /// Edges from source code that were not drawn, one per line; created when bags are read, not part of a mission's
    /// file.
    pub undrawn: Vec<String>,
    /// The texts that nodes logged, sorted by time, each with the name of its node; also not part of a mission's file.
    pub(crate) logged: Vec<LoggedText>,
}

/// The positions in a drawing, in pixels at scale 1, y down.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(default)]
pub struct Places {
    /// The width of the whole drawing.
    pub width: f64,
    /// The height of the whole drawing.
    pub height: f64,
    /// The direction of the drawing, `LR` or `TB`.
    pub orientation: String,
    /// The boxes of the nodes and topics drawn, sorted by (what, name).
    pub boxes: Vec<Place>,
}

/// The position of a node or topic.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Place {
    /// The kind of element, `node` or `topic`.
    pub what: String,
    /// The full name.
    pub name: String,
    /// The box.
    #[serde(flatten)]
    pub rect: Rect,
}

impl Mission {
    /// The windows in order, each with its graph, which is built on demand.
    pub fn each(&self) -> impl Iterator<Item = (&Window, Graph)> {
        self.windows.iter().zip(&self.graphs)
    }

    /// The skew of each topic: the coefficient of variation of its rate over the windows, 0 for one that is always the
    /// same; `None` without two whole windows or without messages. A partial window at the end does not count.
    pub(crate) fn skews(&self) -> ById<TopicId, Option<f64>> {
        let many = self.windows.iter().filter(|w| !w.partial).count() as f64;
        let skew = |topic| {
            let (mut sum, mut squares) = (0.0, 0.0);
            for (at, row) in self.graphs.rows(Element::Topic(topic)) {
                if let Some(window) = self.windows.get(at).filter(|w| !w.partial) {
                    let nanos = window.span.nanos().max(1);
                    let hz = row.count.unwrap_or(0) as f64 * 1e9 / nanos as f64;
                    (sum, squares) = (sum + hz, squares + hz * hz);
                }
            }
            let mean = sum / many;
            let spread = libm::sqrt((squares / many - mean * mean).max(0.0));
            (many > 1.0 && mean > 0.0).then(|| spread / mean)
        };
        let topics = self.elements.topics.with_ids();
        topics.map(|(id, _)| skew(id)).collect()
    }

    /// Determines the changes from each window to the next, by the event log.
    pub(crate) fn explain(&mut self) {
        let reported = changes::explain(&self.graphs, &self.elements, &self.log);
        for (window, (changes, events)) in self.windows.iter_mut().zip(reported) {
            (window.changes, window.events) = (changes, events);
        }
    }

    /// Derives lifetimes, messages, events and changes from the windows of a mission of which nothing else is known. A rate must
    /// change by more than the fraction `threshold`, ≥ 0.
    pub fn find_changes(&mut self, threshold: f64) {
        let history = windows::history(&self.elements, &self.graphs);
        let all: Vec<Element> = self.elements.all().collect();
        for (seen, what) in self.elements.seen_mut().zip(all) {
            let record = history.records.of(what);
            seen.lives = record.into_iter().flat_map(Record::spans).collect();
        }
        self.log.events = event_log::make(&event_log::LogInput {
            elements: &self.elements,
            history: &history,
            rate_change: threshold,
        });
        self.sending = history.sending;
        self.explain();
    }

    /// Whether exact lifetimes are known, not only windows.
    pub(crate) fn knows_lives(&self) -> bool {
        let all = &self.elements;
        all.topics.iter().any(|t| !t.seen.lives.is_empty())
            || all.nodes.iter().any(|n| !n.seen.lives.is_empty())
    }

    /// The name of the bag, or of the first of several with the number of the others.
    pub fn title(&self) -> String {
        match &self.bags[..] {
            [] => String::new(),
            [one] => one.name.clone(),
            [first, rest @ ..] => format!("{} and {} more", first.name, rest.len()),
        }
    }

    /// Nanoseconds from the mission's start to `at`.
    pub fn offset(&self, at: Stamp) -> i64 {
        at.since(self.span.start)
    }
}
