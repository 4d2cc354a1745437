//! The rows of tables of elements: an element in each window, or with `--runs` in each run of windows in which it does
//! not change.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::base::time::{Span, Stamp};
use crate::evidence::Confidence;
use crate::graph::diff::Change;
use crate::graph::{self, EdgeState, Element, Measures, NodeLoad, State};
use crate::mission::{Mission, Window};

/// An element in a window, or in a run of windows.
pub(super) struct Seen {
    pub(super) what: Element,
    /// The window, the first one of a run.
    pub(super) win: usize,
    pub(super) span: Span,
    pub(super) state: State,
    pub(super) confidence: Confidence,
    pub(super) lifecycle: Option<Arc<str>>,
    pub(super) count: Option<u64>,
    pub(super) bytes: Option<u64>,
    pub(super) hz: Option<f64>,
    pub(super) median: Option<f64>,
    pub(super) gap: Option<f64>,
    pub(super) measures: Measures,
    /// The skew of a topic over all windows.
    pub(super) skew: Option<f64>,
    pub(super) load: Option<NodeLoad>,
}

impl Seen {
    fn new(what: Element, window: &Window, state: State, confidence: Confidence) -> Self {
        Self {
            what,
            win: window.index,
            span: window.span,
            state,
            confidence,
            lifecycle: None,
            count: None,
            bytes: None,
            hz: None,
            median: None,
            gap: None,
            measures: Measures::default(),
            skew: None,
            load: None,
        }
    }

    fn edge(what: Element, window: &Window, state: &EdgeState) -> Self {
        Self {
            count: state.count,
            bytes: state.bytes,
            hz: state.hz,
            measures: state.measures,
            ..Self::new(what, window, state.state, state.confidence)
        }
    }
}

/// A function that takes an element.
pub(super) type SeenTaker<'a> = &'a mut dyn FnMut(&Seen);

pub(super) fn nodes(mission: &Mission, has_runs: bool, take: SeenTaker<'_>) {
    if has_runs {
        return runs(mission, |what| matches!(what, Element::Node(_)), take);
    }
    for (window, graph) in mission.each() {
        for (state, load) in graph.nodes.iter().zip(graph.loads(&mission.elements)) {
            take(&Seen {
                lifecycle: state.lifecycle.clone(),
                hz: state.hz,
                load: Some(load),
                ..Seen::new(
                    Element::Node(state.id),
                    window,
                    state.state,
                    state.confidence,
                )
            });
        }
    }
}

pub(super) fn topics(mission: &Mission, has_runs: bool, take: SeenTaker<'_>) {
    if has_runs {
        return runs(mission, |what| matches!(what, Element::Topic(_)), take);
    }
    let skews = mission.skews();
    for (window, graph) in mission.each() {
        for state in &graph.topics {
            take(&Seen {
                count: Some(state.count),
                bytes: state.bytes,
                hz: state.hz,
                median: state.median_period_s,
                gap: state.max_gap_s,
                measures: state.measures,
                skew: skews.get(state.id).copied().flatten(),
                ..Seen::new(
                    Element::Topic(state.id),
                    window,
                    state.state,
                    state.confidence,
                )
            });
        }
    }
}

pub(super) fn edges(mission: &Mission, has_runs: bool, take: SeenTaker<'_>) {
    if has_runs {
        let is_edge = |what| matches!(what, Element::Publish(_) | Element::Subscribe(_));
        return runs(mission, is_edge, take);
    }
    for (window, graph) in mission.each() {
        for state in &graph.publishes {
            take(&Seen::edge(Element::Publish(state.id), window, state));
        }
        for state in &graph.subscribes {
            take(&Seen::edge(Element::Subscribe(state.id), window, state));
        }
    }
}

/// Consecutive windows in which an element has one state, without a rate change in the event log.
struct StateRun {
    first: usize,
    last: usize,
    /// The first window's row, with the numbers of all.
    row: graph::Row,
}

impl StateRun {
    fn goes_on(&self, at: usize, row: &graph::Row) -> bool {
        let look = |row: &graph::Row| (row.state, row.confidence, row.lifecycle);
        self.last + 1 == at && look(&self.row) == look(row)
    }

    /// Adds the next window; median, gap, jitter and age of both together are unknown.
    fn take(&mut self, at: usize, row: &graph::Row) {
        self.last = at;
        let own = &self.row;
        self.row = graph::Row {
            lifecycle: own.lifecycle,
            count: add(own.count, row.count),
            bytes: add(own.bytes, row.bytes),
            drops: add(own.drops, row.drops),
            ..graph::Row::new(own.state, own.confidence)
        };
    }

    /// The element in this run. Its numbers are unknown if windows overlap and count messages twice.
    fn seen(&self, mission: &Mission, what: Element) -> Seen {
        let at = |place: usize| mission.windows.get(place).map(|w| w.span);
        let span = Span::new(
            at(self.first).map_or(Stamp(0), |span| span.start),
            at(self.last).map_or(Stamp(0), |span| span.end),
        );
        let is_one = self.first == self.last || mission.step == mission.period;
        let count = self.row.count.filter(|_| is_one);
        Seen {
            what,
            win: self.first,
            span,
            state: self.row.state,
            confidence: self.row.confidence,
            lifecycle: mission.graphs.lifecycle_word(&self.row),
            count,
            bytes: self.row.bytes.filter(|_| count.is_some()),
            hz: count.and_then(|count| graph::per_second(count, span)),
            median: self.row.median.value(),
            gap: self.row.gap.value(),
            measures: self.row.measures(),
            skew: None,
            load: None,
        }
    }
}

fn add(a: Option<u64>, b: Option<u64>) -> Option<u64> {
    Some(a?.saturating_add(b?))
}

/// The runs of all elements of a kind, in order.
fn runs(mission: &Mission, is_kind: impl Fn(Element) -> bool, take: SeenTaker<'_>) {
    let turns = turns(mission);
    for what in mission.elements.all().filter(|what| is_kind(*what)) {
        let mut open: Option<StateRun> = None;
        for (at, row) in mission.graphs.rows(what) {
            let turns = turns.contains(&(what, at));
            match &mut open {
                Some(run) if !turns && run.goes_on(at, &row) => run.take(at, &row),
                _ => {
                    let (first, last) = (at, at);
                    if let Some(run) = open.replace(StateRun { first, last, row }) {
                        take(&run.seen(mission, what));
                    }
                }
            }
        }
        if let Some(run) = &open {
            take(&run.seen(mission, what));
        }
    }
}

/// The windows in which the rate of an element changes.
fn turns(mission: &Mission) -> BTreeSet<(Element, usize)> {
    let changes = mission.windows.iter().enumerate();
    let changes = changes.flat_map(|(at, w)| w.changes.iter().map(move |change| (at, change)));
    let rate = |(at, change): (usize, &Change)| match change {
        Change::Rate { what, .. } => Some((*what, at)),
        _ => None,
    };
    changes.filter_map(rate).collect()
}
