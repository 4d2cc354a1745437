//! How much a mission reconfigures: changes per minute, lifetimes of nodes, and the distance between the graphs of
//! consecutive windows.
//!
//! Only the robot counts: recorders, housekeeping and mere guesses ([`is_guess`](crate::evidence::Evidence::is_guess))
//! are left out.

use std::collections::BTreeSet;

use crate::base::name::is_quiet;
use crate::base::table::{Batch, ColumnKind, ColumnOf, TableCell, columns};
use crate::base::time::Span;
use crate::graph::Element;
use crate::mission::Mission;

/// The numbers of one recording.
pub(crate) struct Reconfiguration {
    run: String,
    span: Span,
    period_s: f64,
    /// The number of events that a reader of the event log sees.
    changes: usize,
    windows: Vec<WindowDistance>,
    /// The lifetimes of each node.
    lives: Vec<(String, Span)>,
}

/// The graph of a window compared with that of the previous window.
struct WindowDistance {
    span: Span,
    nodes: usize,
    edges: usize,
    /// The number of nodes and edges that appeared or vanished; `None` for the first window.
    changed: Option<[usize; 4]>,
    /// The number of elements in at least one of the two windows.
    either: usize,
}

impl WindowDistance {
    /// The edit distance of labelled graphs: the number of nodes and edges that only one of them has.
    fn distance(&self) -> Option<usize> {
        self.changed.map(|changed| changed.iter().sum())
    }

    /// The share of the elements of both graphs that only one of them has.
    fn turnover(&self) -> Option<f64> {
        Some(self.distance()? as f64 / self.either.max(1) as f64)
    }
}

impl Reconfiguration {
    /// The numbers of the recording `run`.
    pub(crate) fn new(run: &str, mission: &Mission) -> Self {
        let elements = &mission.elements;
        let is_robot = |what: &Element| {
            let (node, topic) = elements.ends(*what);
            let node = node.and_then(|id| elements.nodes.get(id));
            let topic = topic.and_then(|id| elements.topics.get(id));
            !elements.evidence(*what).is_guess()
                && node.is_some_and(|node| !node.is_tool() && !node.seen.evidence.is_guess())
                && topic.is_none_or(|topic| !is_quiet(topic.name.as_str()))
        };
        let mut before: Option<BTreeSet<Element>> = None;
        let mut windows = Vec::new();
        for (window, graph) in mission.each() {
            let all = graph.states.iter().map(|state| state.what);
            let own: BTreeSet<Element> = all
                .filter(|what| !what.is_topic() && is_robot(what))
                .collect();
            let is_node = |what: &&Element| what.is_node();
            let nodes = own.iter().filter(is_node).count();
            let split = |some: Vec<&Element>| {
                let nodes = some.iter().filter(|what| is_node(what)).count();
                [nodes, some.len() - nodes]
            };
            let changed = before.as_ref().map(|before| {
                let [came, to] = split(own.difference(before).collect());
                let [went, from] = split(before.difference(&own).collect());
                [came, went, to, from]
            });
            windows.push(WindowDistance {
                span: window.span,
                nodes,
                edges: own.len() - nodes,
                changed,
                either: before.map_or(0, |before| before.union(&own).count()),
            });
            before = Some(own);
        }
        let nodes = elements.nodes.with_ids();
        let nodes = nodes.filter(|(id, _)| is_robot(&Element::Node(*id)));
        let lives = nodes.flat_map(|(_, node)| {
            let name = node.name.to_string();
            node.seen.lives.iter().map(move |run| (name.clone(), *run))
        });
        Self {
            run: run.to_owned(),
            span: mission.span,
            period_s: mission.period.nanos() as f64 / 1e9,
            changes: mission.log.headlines(mission.span).count(),
            lives: lives.collect(),
            windows,
        }
    }

    /// The mean over all windows but the first.
    fn mean(&self, of: impl Fn(&WindowDistance) -> Option<f64>) -> Option<f64> {
        let all: Vec<f64> = self.windows.iter().filter_map(of).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    }

    /// The median lifetime in seconds; of the two in the middle, the longer.
    fn lifetime(&self) -> Option<f64> {
        let mut all: Vec<i64> = self.lives.iter().map(|(_, run)| run.nanos()).collect();
        all.sort_unstable();
        all.get(all.len() / 2).map(|nanos| *nanos as f64 / 1e9)
    }
}

/// All recordings, and a position in them: the recording, and the window or the lifetime.
type Runs = Vec<Reconfiguration>;
type Place = (usize, usize);

const RUNS: &[ColumnOf<(), Reconfiguration>] = columns! {
    "run" Text |(), one| TableCell::text(&one.run);
    "duration_s" F64 |(), one| TableCell::Float(one.span.nanos() as f64 / 1e9);
    "period_s" F64 |(), one| TableCell::Float(one.period_s);
    "windows" I64 |(), one| TableCell::count(one.windows.len());
    "changes" I64 |(), one| TableCell::count(one.changes);
    "changes_per_min" F64 |(), one| TableCell::Float(one.changes as f64 * 60e9 / one.span.nanos() as f64);
    "distance_mean" F64 |(), one| number(one.mean(|window| Some(window.distance()? as f64)));
    "distance_max" I64 |(), one| count(one.windows.iter().filter_map(WindowDistance::distance).max());
    "turnover_mean" F64 |(), one| number(one.mean(WindowDistance::turnover));
    "lives" I64 |(), one| TableCell::count(one.lives.len());
    "lifetime_median_s" F64 |(), one| number(one.lifetime());
};

const WINDOWS: &[ColumnOf<Runs, Place>] = columns! {
    "run" Text |all, at| TableCell::text(&all[at.0].run);
    "win" I64 |_, at| TableCell::count(at.1);
    "start_ns" Time |all, at| TableCell::Time(window(all, *at).span.start);
    "end_ns" Time |all, at| TableCell::Time(window(all, *at).span.end);
    "nodes" I64 |all, at| TableCell::count(window(all, *at).nodes);
    "edges" I64 |all, at| TableCell::count(window(all, *at).edges);
    "nodes_added" I64 |all, at| count(window(all, *at).changed.map(|changed| changed[0]));
    "nodes_removed" I64 |all, at| count(window(all, *at).changed.map(|changed| changed[1]));
    "edges_added" I64 |all, at| count(window(all, *at).changed.map(|changed| changed[2]));
    "edges_removed" I64 |all, at| count(window(all, *at).changed.map(|changed| changed[3]));
    "distance" I64 |all, at| count(window(all, *at).distance());
    "turnover" F64 |all, at| number(window(all, *at).turnover());
};

const LIVES: &[ColumnOf<Runs, Place>] = columns! {
    "run" Text |all, at| TableCell::text(&all[at.0].run);
    "node" Text |all, at| TableCell::text(&all[at.0].lives[at.1].0);
    "start_ns" Time |all, at| TableCell::Time(life(all, *at).start);
    "end_ns" Time |all, at| TableCell::Time(life(all, *at).end);
    "lifetime_s" F64 |all, at| TableCell::Float(life(all, *at).nanos() as f64 / 1e9);
    "is_from_start" Flag |all, at| TableCell::Flag(life(all, *at).start <= all[at.0].span.start);
    "is_to_end" Flag |all, at| TableCell::Flag(life(all, *at).end >= all[at.0].span.end);
};

fn window(all: &Runs, at: Place) -> &WindowDistance {
    &all[at.0].windows[at.1]
}

fn life(all: &Runs, at: Place) -> Span {
    all[at.0].lives[at.1].1
}

fn count(count: Option<usize>) -> TableCell<'static> {
    TableCell::known(count, TableCell::count)
}

fn number(number: Option<f64>) -> TableCell<'static> {
    TableCell::known(number, TableCell::Float)
}

/// The tables of all recordings by name: a row per recording, per window, and per lifetime of a node.
pub(crate) fn tables(all: &Runs) -> [(&'static str, Batch); 3] {
    let places = |of: fn(&Reconfiguration) -> usize| -> Vec<Place> {
        let runs = all.iter().enumerate();
        runs.flat_map(|(run, one)| (0..of(one)).map(move |at| (run, at)))
            .collect()
    };
    [
        ("reconfiguration", Batch::filled(RUNS, &(), all)),
        (
            "windows",
            Batch::filled(WINDOWS, all, &places(|one| one.windows.len())),
        ),
        (
            "lifetimes",
            Batch::filled(LIVES, all, &places(|one| one.lives.len())),
        ),
    ]
}
