//! The whole sequence: every window with its graph and what changed; written as JSON and read back as an input.

pub(crate) mod activity;
pub mod events;
pub mod info;
pub mod ledger;
pub mod phases;

mod json;
pub(crate) use json::raw;
pub(crate) use json::read::mission_of;
pub use json::read::read_json;
pub(crate) use json::write::Json;
pub use json::write::{JsonForm, write_json};

use crate::bag::Report;
use crate::base::geometry::Rect;
use crate::base::notice::Notices;
use crate::base::time::{Period, Span, Stamp};
use crate::graph::diff::{Change, Changes};
use crate::graph::{Elements, Graph, Graphs, NodeId};

pub use activity::Activity;
pub(crate) use ledger::EntryId;
pub use ledger::Ledger;

/// One window; its graph is in [`Mission::graphs`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Window {
    /// Its place, 0...
    pub index: usize,
    /// Its time; the last one may be shorter than the period.
    pub span: Span,
    /// Whether it is shorter than the period.
    pub partial: bool,
    /// Messages in it.
    pub messages: u64,
    /// What changed against the window before; empty in the first.
    pub changes: Vec<Change>,
    /// The place in the ledger of the entry that each of the changes belongs to.
    pub entries: Vec<EntryId>,
}

/// A mission as a sequence of graphs.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Mission {
    /// The bags it was read from, in order.
    pub bags: Vec<Report>,
    /// From the first message to the last, plus 1 ns.
    pub span: Span,
    /// All messages in it.
    pub messages: u64,
    /// The length of a window.
    pub period: Period,
    /// From the start of one window to the start of the next.
    pub step: Period,
    /// Names, types and evidence, once.
    pub elements: Elements,
    /// The windows in order; those without a message are there too.
    pub windows: Vec<Window>,
    /// The graph of each window.
    pub graphs: Graphs,
    /// What happened, in continuous time.
    pub ledger: Ledger,
    /// What was alive and how busy on a grid of its own.
    pub activity: Activity,
    /// Where everything was drawn, if it was.
    pub layout: Option<Places>,
    /// What went wrong without stopping us.
    pub notices: Notices,
    /// What source code offers and was not drawn, a line each; made when bags are read, not part of a mission's file.
    pub undrawn: Vec<String>,
}

/// The places of a drawing, in pixels at scale 1, y down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// The width of the whole.
    pub width: f64,
    /// The height of the whole.
    pub height: f64,
    /// `LR` or `TB`.
    pub orientation: String,
    /// A box per node and topic drawn, sorted by (what, name).
    pub boxes: Vec<Place>,
}

/// The place of one node or topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// `node` or `topic`.
    pub what: String,
    /// Its full name.
    pub name: String,
    /// Where it stands.
    pub rect: Rect,
}

impl Mission {
    /// The windows in order, each with its graph, which is made as it is asked for.
    pub fn each(&self) -> impl Iterator<Item = (&Window, Graph)> {
        self.windows.iter().zip(&self.graphs)
    }

    /// Finds what changed from each window to the next, by the ledger.
    pub(crate) fn explain(&mut self) {
        let spans = self.windows.iter().map(|w| w.span);
        let windows = spans.zip(&self.graphs);
        let told = ledger::explain(windows, &self.elements, &self.ledger);
        for (window, (changes, entries)) in self.windows.iter_mut().zip(told) {
            (window.changes, window.entries) = (changes, entries);
        }
    }

    /// Finds what changed from each window to the next, and makes the ledger of it: for missions of which nothing but
    /// windows is known. A rate must change by more than the share `threshold`; `restarts` are nodes that began anew
    /// under the same name, and when, sorted by time.
    pub fn find_changes(&mut self, threshold: f64, restarts: &[(NodeId, Stamp)]) {
        let mut changes = Changes::new(&self.elements, threshold);
        for (window, graph) in self.windows.iter_mut().zip(&self.graphs) {
            let inside: Vec<_> = restarts
                .iter()
                .copied()
                .filter(|(_, at)| window.span.contains(*at))
                .collect();
            window.changes = changes.next(window.span, &graph, &inside);
        }
        self.ledger = Ledger::from_changes(&self.elements, &self.windows);
        let places = ledger::places(&self.ledger, &self.windows);
        for (window, places) in self.windows.iter_mut().zip(places) {
            window.entries = places;
        }
    }

    /// Whether it is known when elements lived, not only which windows show them.
    pub(crate) fn knows_lives(&self) -> bool {
        let all = &self.elements;
        all.topics.iter().any(|t| !t.runs.is_empty())
            || all.nodes.iter().any(|n| !n.runs.is_empty())
    }

    /// The name of its bag, or of the first of several and how many more there are.
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
