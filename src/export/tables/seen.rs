//! The rows of tables of elements: an element in each window, or with `--runs` in each run of windows in which it does
//! not change.

use std::collections::BTreeSet;

use crate::base::time::{Span, Stamp};
use crate::graph::diff::Change;
use crate::graph::{self, Element, ElementState, Id, NodeLoad};
use crate::mission::Mission;

/// An element in a window, or in a run of windows.
pub(super) struct Seen {
    /// The window, the first one of a run.
    pub(super) win: usize,
    pub(super) span: Span,
    pub(super) state: ElementState,
    /// The skew of a topic over all windows.
    pub(super) skew: Option<f64>,
    pub(super) load: Option<NodeLoad>,
}

/// A function that takes an element.
pub(super) type SeenTaker<'a> = &'a mut dyn FnMut(&Seen);

/// The elements of a kind in each window.
pub(super) fn each(
    mission: &Mission,
    is_kind: fn(&Element) -> bool,
    has_runs: bool,
    take: SeenTaker<'_>,
) {
    if has_runs {
        return runs(mission, is_kind, take);
    }
    let skews = mission.skews();
    for (window, graph) in mission.each() {
        // Of nodes, which come first.
        let has_loads = is_kind(&Element::Node(Id::of(0)));
        let loads = has_loads.then(|| graph.loads(&mission.elements));
        let mut loads = loads.into_iter().flatten();
        for state in graph.states {
            let load = loads.next();
            if is_kind(&state.what) {
                take(&Seen {
                    win: window.index,
                    span: window.span,
                    skew: match state.what {
                        Element::Topic(id) => skews.get(id).copied().flatten(),
                        _ => None,
                    },
                    load,
                    state,
                });
            }
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
            win: self.first,
            span,
            state: ElementState {
                count,
                bytes: self.row.bytes.filter(|_| count.is_some()),
                hz: count.and_then(|count| graph::per_second(count, span)),
                median_period_s: self.row.median.value(),
                max_gap_s: self.row.gap.value(),
                lifecycle: mission.graphs.lifecycle_word(&self.row),
                measures: self.row.measures(),
                ..ElementState::new(what, self.row.state, self.row.confidence)
            },
            skew: None,
            load: None,
        }
    }
}

fn add(a: Option<u64>, b: Option<u64>) -> Option<u64> {
    Some(a?.saturating_add(b?))
}

/// The runs of all elements of a kind, in order.
fn runs(mission: &Mission, is_kind: fn(&Element) -> bool, take: SeenTaker<'_>) {
    let turns = turns(mission);
    for what in mission.elements.all().filter(is_kind) {
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
