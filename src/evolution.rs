//! The whole sequence: every window with its graph and what changed; written as JSON and read back as an input.

use crate::bag::Report;
use crate::diff::Change;
use crate::graph::{Elements, Graph};
use crate::notice::Notices;
use crate::time::{Period, Span, Stamp};

/// One window with its graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Its place, 0...
    pub index: usize,
    /// Its time; the last one may be shorter than the period.
    pub span: Span,
    /// Whether it is shorter than the period.
    pub partial: bool,
    /// Messages in it.
    pub messages: u64,
    /// The graph.
    pub graph: Graph,
    /// What changed against the window before; empty in the first.
    pub changes: Vec<Change>,
}

/// A mission as a sequence of graphs.
#[derive(Clone, Debug, PartialEq)]
pub struct Evolution {
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
    /// What went wrong without stopping us.
    pub notices: Notices,
}

impl Evolution {
    /// Nanoseconds from the mission's start to `at`.
    pub fn offset(&self, at: Stamp) -> i64 {
        at.since(self.span.start)
    }
}
