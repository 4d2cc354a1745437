//! The tables of elements with a row per run of windows in which an element is the same, for `--runs`.

use std::collections::BTreeSet;

use super::mission::{RowTaker, load_cells, measure_cells, text, time, words};
use crate::base::table::TableCell;
use crate::base::time::{Span, Stamp};
use crate::evidence::Degree;
use crate::graph::diff::Change;
use crate::graph::{self, Edge, Element, Measures, State};
use crate::mission::Mission;

/// Neighbouring windows in which an element has one state, and between which the ledger tells no change of its rate.
struct StateRun {
    first: usize,
    last: usize,
    state: State,
    degree: Degree,
    lifecycle: u32,
    count: Option<u64>,
    bytes: Option<u64>,
    gap: Option<f64>,
    median: Option<f64>,
    measures: Measures,
}

impl StateRun {
    fn of(at: usize, row: &graph::Row) -> Self {
        Self {
            first: at,
            last: at,
            state: row.state,
            degree: row.degree,
            lifecycle: row.lifecycle,
            count: row.count,
            bytes: row.bytes,
            gap: row.gap.value(),
            median: row.median.value(),
            measures: row.measures(),
        }
    }

    fn goes_on(&self, at: usize, row: &graph::Row) -> bool {
        let look = (self.state, self.degree, self.lifecycle);
        self.last + 1 == at && look == (row.state, row.degree, row.lifecycle)
    }

    /// Takes in the next window, of which a median, the gap to the one before, jitter and age of both are not known.
    fn take(&mut self, at: usize, row: &graph::Row) {
        self.last = at;
        self.count = add(self.count, row.count);
        self.bytes = add(self.bytes, row.bytes);
        (self.gap, self.median) = (None, None);
        self.measures = Measures {
            drops: add(self.measures.drops, row.drops),
            ..Measures::default()
        };
    }

    /// Its first window, its times, and its length.
    fn cells(&self, mission: &Mission) -> [TableCell<'static>; 4] {
        let span = self.span(mission);
        [
            TableCell::count(self.first as u64),
            time(Some(span.start)),
            time(Some(span.end)),
            TableCell::Int(span.nanos()),
        ]
    }

    fn span(&self, mission: &Mission) -> Span {
        let at = |place: usize| mission.windows.get(place).map(|w| w.span);
        Span::new(
            at(self.first).map_or(Stamp(0), |span| span.start),
            at(self.last).map_or(Stamp(0), |span| span.end),
        )
    }

    /// The number of its messages, and their number per second; unknown where windows overlap and count messages twice.
    fn sent(&self, mission: &Mission) -> (Option<u64>, Option<f64>) {
        let is_one = self.first == self.last || mission.step == mission.period;
        let count = self.count.filter(|_| is_one);
        let hz = count.and_then(|count| graph::per_second(count, self.span(mission)));
        (count, hz)
    }
}

fn add(a: Option<u64>, b: Option<u64>) -> Option<u64> {
    Some(a?.saturating_add(b?))
}

/// The runs of an element, in order.
fn runs(mission: &Mission, turns: &BTreeSet<(Element, usize)>, what: Element) -> Vec<StateRun> {
    let mut all: Vec<StateRun> = Vec::new();
    for (at, row) in mission.graphs.rows(what) {
        let turns = turns.contains(&(what, at));
        match all.last_mut() {
            Some(run) if !turns && run.goes_on(at, &row) => run.take(at, &row),
            _ => all.push(StateRun::of(at, &row)),
        }
    }
    all
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

pub(super) fn nodes(mission: &Mission, row: RowTaker<'_>) {
    let turns = turns(mission);
    for (id, node) in (0..).zip(&mission.elements.nodes) {
        for run in runs(mission, &turns, Element::Node(id)) {
            let [win, start, end, length] = run.cells(mission);
            let lifecycle = mission.graphs.lifecycle_of(run.lifecycle);
            let [
                messages_in,
                messages_out,
                bytes_in,
                bytes_out,
                topics_in,
                topics_out,
            ] = load_cells(None);
            row(&[
                win,
                start,
                end,
                length,
                TableCell::text(node.name.as_str()),
                TableCell::text(&*node.role),
                TableCell::text(run.state.word()),
                TableCell::text(run.degree.word()),
                words(node.evidence),
                TableCell::known(run.sent(mission).1, TableCell::Float),
                messages_in,
                messages_out,
                bytes_in,
                bytes_out,
                topics_in,
                topics_out,
                text(lifecycle),
                time(node.first),
                time(node.last),
            ]);
        }
    }
}

pub(super) fn topics(mission: &Mission, row: RowTaker<'_>) {
    let turns = turns(mission);
    for (id, topic) in (0..).zip(&mission.elements.topics) {
        for run in runs(mission, &turns, Element::Topic(id)) {
            let [win, start, end, length] = run.cells(mission);
            let (count, hz) = run.sent(mission);
            let [drops, jitter, age] = measure_cells(run.measures);
            row(&[
                win,
                start,
                end,
                length,
                TableCell::text(topic.name.as_str()),
                TableCell::text(topic.types.join(" ")),
                TableCell::text(run.state.word()),
                TableCell::text(run.degree.word()),
                words(topic.evidence),
                TableCell::known(count, TableCell::count),
                TableCell::known(run.bytes.filter(|_| count.is_some()), TableCell::count),
                TableCell::known(hz, TableCell::Float),
                TableCell::known(run.median, TableCell::Float),
                TableCell::known(run.gap, TableCell::Float),
                drops,
                jitter,
                age,
                text(topic.qos.as_deref()),
                time(topic.first),
                time(topic.last),
            ]);
        }
    }
}

pub(super) fn edges(mission: &Mission, row: RowTaker<'_>) {
    let turns = turns(mission);
    let all = &mission.elements;
    for (what, edge) in all.edges() {
        edge_rows(mission, &turns, (what, edge), row);
    }
}

fn edge_rows(
    mission: &Mission,
    turns: &BTreeSet<(Element, usize)>,
    (what, edge): (Element, &Edge),
    row: RowTaker<'_>,
) {
    let elements = &mission.elements;
    for run in runs(mission, turns, what) {
        let [win, start, end, length] = run.cells(mission);
        let (count, hz) = run.sent(mission);
        let [drops, jitter, age] = measure_cells(run.measures);
        row(&[
            win,
            start,
            end,
            length,
            TableCell::text(what.word()),
            TableCell::text(elements.nodes[edge.node as usize].name.as_str()),
            TableCell::text(elements.topics[edge.topic as usize].name.as_str()),
            TableCell::text(run.state.word()),
            TableCell::text(run.degree.word()),
            words(edge.evidence),
            TableCell::known(count, TableCell::count),
            TableCell::known(hz, TableCell::Float),
            TableCell::known(run.bytes.filter(|_| count.is_some()), TableCell::count),
            drops,
            jitter,
            age,
            time(edge.first),
            time(edge.last),
        ]);
    }
}
