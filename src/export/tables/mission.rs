//! The tables of a mission: their columns, and what fills them.

use std::borrow::Cow;

use super::runs;
use crate::base::table::{Cell, Kind};
use crate::base::time::Stamp;
use crate::evidence::Evidence;
use crate::graph::diff::Change;
use crate::graph::{Edge, EdgeState, Element, NodeId};
use crate::mission::ledger::{Detail, Entry};
use crate::mission::{Mission, Window};

/// Takes a row.
pub(super) type Row<'a> = &'a mut dyn FnMut(&[Cell<'_>]);

/// A table: its word in the file's name, its columns, and what fills it.
pub(super) struct Table {
    pub(super) word: &'static str,
    pub(super) columns: &'static [(&'static str, Kind)],
    pub(super) fill: fn(&Mission, Row<'_>),
    /// The same by runs of equal windows, where it is about windows.
    pub(super) fill_runs: Option<fn(&Mission, Row<'_>)>,
}

/// The first columns of every table about windows.
const WIN: (&str, Kind) = ("win", Kind::I64);
const START: (&str, Kind) = ("start_ns", Kind::Time);
const END: (&str, Kind) = ("end_ns", Kind::Time);
const LENGTH: (&str, Kind) = ("length_ns", Kind::I64);

/// All tables of a mission.
pub(super) const TABLES: &[Table] = &[
    Table {
        word: "edges",
        columns: &[
            WIN,
            START,
            END,
            LENGTH,
            ("what", Kind::Text),
            ("node", Kind::Text),
            ("topic", Kind::Text),
            ("state", Kind::Text),
            ("degree", Kind::Text),
            ("evidence", Kind::Text),
            ("n", Kind::I64),
            ("hz", Kind::F64),
            ("first_ns", Kind::Time),
            ("last_ns", Kind::Time),
        ],
        fill: edges,
        fill_runs: Some(runs::edges),
    },
    Table {
        word: "topics",
        columns: &[
            WIN,
            START,
            END,
            LENGTH,
            ("topic", Kind::Text),
            ("types", Kind::Text),
            ("state", Kind::Text),
            ("degree", Kind::Text),
            ("evidence", Kind::Text),
            ("n", Kind::I64),
            ("bytes", Kind::I64),
            ("hz", Kind::F64),
            ("median_period_s", Kind::F64),
            ("max_gap_s", Kind::F64),
            ("qos", Kind::Text),
            ("first_ns", Kind::Time),
            ("last_ns", Kind::Time),
        ],
        fill: topics,
        fill_runs: Some(runs::topics),
    },
    Table {
        word: "nodes",
        columns: &[
            WIN,
            START,
            END,
            LENGTH,
            ("node", Kind::Text),
            ("node_role", Kind::Text),
            ("state", Kind::Text),
            ("degree", Kind::Text),
            ("evidence", Kind::Text),
            ("hz", Kind::F64),
            ("lifecycle", Kind::Text),
            ("first_ns", Kind::Time),
            ("last_ns", Kind::Time),
        ],
        fill: nodes,
        fill_runs: Some(runs::nodes),
    },
    Table {
        word: "changes",
        columns: &[
            WIN,
            START,
            END,
            LENGTH,
            ("kind", Kind::Text),
            ("what", Kind::Text),
            ("node", Kind::Text),
            ("topic", Kind::Text),
            ("time_ns", Kind::Time),
            ("from_hz", Kind::F64),
            ("to_hz", Kind::F64),
            ("from_value", Kind::Text),
            ("to_value", Kind::Text),
        ],
        fill: changes,
        fill_runs: None,
    },
    Table {
        word: "ledger",
        columns: &[
            ("entry", Kind::I64),
            ("kind", Kind::Text),
            ("what", Kind::Text),
            ("node", Kind::Text),
            ("topic", Kind::Text),
            ("time_ns", Kind::Time),
            ("earliest_ns", Kind::Time),
            ("latest_ns", Kind::Time),
            ("until_ns", Kind::Time),
            ("from_hz", Kind::F64),
            ("to_hz", Kind::F64),
            ("from_value", Kind::Text),
            ("to_value", Kind::Text),
            ("degree", Kind::Text),
            ("evidence", Kind::Text),
            ("part_of", Kind::I64),
            ("is_quiet", Kind::Flag),
            ("weight", Kind::I64),
        ],
        fill: ledger,
        fill_runs: None,
    },
    Table {
        word: "phases",
        columns: &[
            ("phase", Kind::I64),
            START,
            END,
            LENGTH,
            ("phase_name", Kind::Text),
            ("nodes_added", Kind::I64),
            ("nodes_removed", Kind::I64),
            ("same_as", Kind::I64),
        ],
        fill: phases,
        fill_runs: None,
    },
    Table {
        word: "bags",
        columns: &[
            ("bag", Kind::Text),
            ("bag_format", Kind::Text),
            ("compression", Kind::Text),
            ("tier", Kind::Text),
            ("tier_reason", Kind::Text),
            ("is_complete", Kind::Flag),
            ("file_bytes", Kind::I64),
        ],
        fill: bags,
        fill_runs: None,
    },
];

fn bags(mission: &Mission, row: Row<'_>) {
    for bag in &mission.bags {
        row(&[
            Cell::text(&bag.name),
            Cell::text(&bag.format),
            Cell::text(bag.compression.join(" ")),
            Cell::text(bag.tier.word()),
            text(bag.tier_reason.as_deref()),
            Cell::Flag(bag.complete),
            Cell::count(bag.file_bytes),
        ]);
    }
}

fn nodes(mission: &Mission, row: Row<'_>) {
    for (window, graph) in mission.each() {
        let [win, start, end, length] = cells_of(window);
        for state in &graph.nodes {
            let node = &mission.elements.nodes[state.id as usize];
            row(&[
                win.clone(),
                start.clone(),
                end.clone(),
                length.clone(),
                Cell::text(node.name.as_str()),
                Cell::text(&*node.role),
                Cell::text(state.state.word()),
                Cell::text(state.degree.word()),
                words(node.evidence),
                Cell::known(state.hz, Cell::Float),
                text(state.lifecycle.as_deref()),
                time(node.first),
                time(node.last),
            ]);
        }
    }
}

fn topics(mission: &Mission, row: Row<'_>) {
    for (window, graph) in mission.each() {
        let [win, start, end, length] = cells_of(window);
        for state in &graph.topics {
            let topic = &mission.elements.topics[state.id as usize];
            row(&[
                win.clone(),
                start.clone(),
                end.clone(),
                length.clone(),
                Cell::text(topic.name.as_str()),
                Cell::text(topic.types.join(" ")),
                Cell::text(state.state.word()),
                Cell::text(state.degree.word()),
                words(topic.evidence),
                Cell::count(state.count),
                Cell::known(state.bytes, Cell::count),
                Cell::known(state.hz, Cell::Float),
                Cell::known(state.median_period_s, Cell::Float),
                Cell::known(state.max_gap_s, Cell::Float),
                text(topic.qos.as_deref()),
                time(topic.first),
                time(topic.last),
            ]);
        }
    }
}

fn edges(mission: &Mission, row: Row<'_>) {
    let elements = &mission.elements;
    for (window, graph) in mission.each() {
        let [win, start, end, length] = cells_of(window);
        let mut edge = |what: &'static str, edge: &Edge, state: &EdgeState| {
            row(&[
                win.clone(),
                start.clone(),
                end.clone(),
                length.clone(),
                Cell::text(what),
                Cell::text(elements.nodes[edge.node as usize].name.as_str()),
                Cell::text(elements.topics[edge.topic as usize].name.as_str()),
                Cell::text(state.state.word()),
                Cell::text(state.degree.word()),
                words(edge.evidence),
                Cell::known(state.count, Cell::count),
                Cell::known(state.hz, Cell::Float),
                time(edge.first),
                time(edge.last),
            ]);
        };
        for state in &graph.publishes {
            edge("publish", &elements.publishes[state.id as usize], state);
        }
        for state in &graph.subscribes {
            edge("subscribe", &elements.subscribes[state.id as usize], state);
        }
    }
}

fn changes(mission: &Mission, row: Row<'_>) {
    for window in &mission.windows {
        for change in &window.changes {
            let (kind, what, at, detail) = told(mission, change);
            let [node, topic] = ends(mission, what);
            let [from_hz, to_hz, from, to] = detail;
            let [win, start, end, length] = cells_of(window);
            let (kind, what) = (Cell::text(kind), Cell::text(what.word()));
            row(&[
                win,
                start,
                end,
                length,
                kind,
                what,
                node,
                topic,
                time(at),
                from_hz,
                to_hz,
                from,
                to,
            ]);
        }
    }
}

/// What a change says beside its time: `from_hz to_hz from_value to_value`.
type DetailCells<'a> = [Cell<'a>; 4];

const NO_DETAIL: DetailCells<'static> = [Cell::Null, Cell::Null, Cell::Null, Cell::Null];

fn rates(from_hz: f64, to_hz: f64) -> DetailCells<'static> {
    [
        Cell::Float(from_hz),
        Cell::Float(to_hz),
        Cell::Null,
        Cell::Null,
    ]
}

fn values<'a>(from: impl Into<Cow<'a, str>>, to: impl Into<Cow<'a, str>>) -> DetailCells<'a> {
    [Cell::Null, Cell::Null, Cell::text(from), Cell::text(to)]
}

/// The kind of a change, what it is about, when it was, and its detail.
fn told<'a>(
    mission: &Mission,
    change: &'a Change,
) -> (&'static str, Element, Option<Stamp>, DetailCells<'a>) {
    let names = |nodes: &[NodeId]| names(mission, nodes);
    match change {
        Change::Added { what, time } => ("added", *what, *time, NO_DETAIL),
        Change::Removed { what, time } => ("removed", *what, *time, NO_DETAIL),
        Change::Rate {
            what,
            from_hz,
            to_hz,
        } => ("rate", *what, None, rates(*from_hz, *to_hz)),
        Change::HandedOver { topic, from, to } => {
            let detail = values(names(from), names(to));
            ("handed_over", Element::Topic(*topic), None, detail)
        }
        Change::Restarted { node, time } => {
            ("restarted", Element::Node(*node), Some(*time), NO_DETAIL)
        }
        Change::Value {
            kind,
            what,
            from,
            to,
        } => (kind.word(), *what, None, values(&**from, &**to)),
    }
}

fn ledger(mission: &Mission, row: Row<'_>) {
    for (id, entry) in mission.ledger.entries.iter().enumerate() {
        let [node, topic] = ends(mission, entry.what);
        let [from_hz, to_hz, from, to] = detail(mission, entry);
        row(&[
            Cell::count(id),
            Cell::text(entry.kind.word()),
            Cell::text(entry.what.word()),
            node,
            topic,
            Cell::Time(entry.time),
            Cell::Time(entry.earliest),
            Cell::Time(entry.latest),
            time(entry.until),
            from_hz,
            to_hz,
            from,
            to,
            Cell::text(entry.degree.word()),
            words(entry.evidence),
            Cell::known(entry.part_of, Cell::count),
            Cell::Flag(entry.quiet),
            Cell::count(entry.weight),
        ]);
    }
}

fn detail<'a>(mission: &Mission, entry: &'a Entry) -> DetailCells<'a> {
    match &entry.detail {
        Detail::None => NO_DETAIL,
        Detail::Rates { from_hz, to_hz } => rates(*from_hz, *to_hz),
        Detail::Senders { from, to } => values(names(mission, from), names(mission, to)),
        Detail::Values { from, to } => values(&**from, &**to),
    }
}

fn phases(mission: &Mission, row: Row<'_>) {
    for (at, phase) in mission.ledger.phases.iter().enumerate() {
        row(&[
            Cell::count(at),
            Cell::Time(phase.span.start),
            Cell::Time(phase.span.end),
            Cell::Int(phase.span.nanos()),
            Cell::text(&*phase.name),
            Cell::count(phase.nodes_added),
            Cell::count(phase.nodes_removed),
            Cell::known(phase.same_as, Cell::count),
        ]);
    }
}

fn names(mission: &Mission, nodes: &[NodeId]) -> String {
    let nodes = nodes.iter().map(|n| &mission.elements.nodes[*n as usize]);
    nodes.map(|n| n.name.as_str()).collect::<Vec<_>>().join(" ")
}

/// The node and the topic of an element; unknown for the one it does not have.
fn ends(mission: &Mission, what: Element) -> [Cell<'_>; 2] {
    let elements = &mission.elements;
    let node = |id: u32| Cell::text(elements.nodes[id as usize].name.as_str());
    let topic = |id: u32| Cell::text(elements.topics[id as usize].name.as_str());
    let both = |edge: &Edge| [node(edge.node), topic(edge.topic)];
    match what {
        Element::Node(id) => [node(id), Cell::Null],
        Element::Topic(id) => [Cell::Null, topic(id)],
        Element::Publish(id) => both(&elements.publishes[id as usize]),
        Element::Subscribe(id) => both(&elements.subscribes[id as usize]),
    }
}

/// `win start_ns end_ns length_ns` of a window.
fn cells_of(window: &Window) -> [Cell<'static>; 4] {
    let span = window.span;
    let (start, end) = (Cell::Time(span.start), Cell::Time(span.end));
    [
        Cell::count(window.index),
        start,
        end,
        Cell::Int(span.nanos()),
    ]
}

pub(super) fn words(evidence: Evidence) -> Cell<'static> {
    Cell::text(evidence.words().collect::<Vec<_>>().join(" "))
}

pub(super) fn text(text: Option<&str>) -> Cell<'_> {
    Cell::known(text, Cell::text)
}

pub(super) fn time(stamp: Option<Stamp>) -> Cell<'static> {
    Cell::known(stamp, Cell::Time)
}
