//! The tables of a mission: their columns, and the functions that fill them.

use std::borrow::Cow;

use super::runs;
use crate::base::table::{ColumnKind, TableCell};
use crate::base::time::Stamp;
use crate::evidence::Evidence;
use crate::graph::diff::Change;
use crate::graph::{Edge, EdgeState, Element, Measures, NodeId, NodeLoad};
use crate::mission::ledger::{Detail, Entry};
use crate::mission::{Mission, Window};

/// A function that takes a row.
pub(super) type RowTaker<'a> = &'a mut dyn FnMut(&[TableCell<'_>]);

/// A table: its word in the file's name, its columns, and the function that fills it.
pub(super) struct Table {
    pub(super) word: &'static str,
    pub(super) columns: &'static [(&'static str, ColumnKind)],
    pub(super) fill: fn(&Mission, RowTaker<'_>),
    /// The function that fills it by runs of equal windows, where it is about windows.
    pub(super) fill_runs: Option<fn(&Mission, RowTaker<'_>)>,
}

/// The first columns of every table about windows.
const WIN: (&str, ColumnKind) = ("win", ColumnKind::I64);
const START: (&str, ColumnKind) = ("start_ns", ColumnKind::Time);
const END: (&str, ColumnKind) = ("end_ns", ColumnKind::Time);
const LENGTH: (&str, ColumnKind) = ("length_ns", ColumnKind::I64);

/// All tables of a mission.
pub(super) const TABLES: &[Table] = &[
    Table {
        word: "edges",
        columns: &[
            WIN,
            START,
            END,
            LENGTH,
            ("what", ColumnKind::Text),
            ("node", ColumnKind::Text),
            ("topic", ColumnKind::Text),
            ("state", ColumnKind::Text),
            ("degree", ColumnKind::Text),
            ("evidence", ColumnKind::Text),
            ("n", ColumnKind::I64),
            ("hz", ColumnKind::F64),
            ("bytes", ColumnKind::I64),
            ("drops", ColumnKind::I64),
            ("jitter_s", ColumnKind::F64),
            ("age_s", ColumnKind::F64),
            ("first_ns", ColumnKind::Time),
            ("last_ns", ColumnKind::Time),
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
            ("topic", ColumnKind::Text),
            ("types", ColumnKind::Text),
            ("state", ColumnKind::Text),
            ("degree", ColumnKind::Text),
            ("evidence", ColumnKind::Text),
            ("n", ColumnKind::I64),
            ("bytes", ColumnKind::I64),
            ("hz", ColumnKind::F64),
            ("median_period_s", ColumnKind::F64),
            ("max_gap_s", ColumnKind::F64),
            ("drops", ColumnKind::I64),
            ("jitter_s", ColumnKind::F64),
            ("age_s", ColumnKind::F64),
            ("qos", ColumnKind::Text),
            ("first_ns", ColumnKind::Time),
            ("last_ns", ColumnKind::Time),
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
            ("node", ColumnKind::Text),
            ("node_role", ColumnKind::Text),
            ("state", ColumnKind::Text),
            ("degree", ColumnKind::Text),
            ("evidence", ColumnKind::Text),
            ("hz", ColumnKind::F64),
            ("messages_in", ColumnKind::I64),
            ("messages_out", ColumnKind::I64),
            ("bytes_in", ColumnKind::I64),
            ("bytes_out", ColumnKind::I64),
            ("topics_in", ColumnKind::I64),
            ("topics_out", ColumnKind::I64),
            ("lifecycle", ColumnKind::Text),
            ("first_ns", ColumnKind::Time),
            ("last_ns", ColumnKind::Time),
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
            ("kind", ColumnKind::Text),
            ("what", ColumnKind::Text),
            ("node", ColumnKind::Text),
            ("topic", ColumnKind::Text),
            ("time_ns", ColumnKind::Time),
            ("from_hz", ColumnKind::F64),
            ("to_hz", ColumnKind::F64),
            ("from_value", ColumnKind::Text),
            ("to_value", ColumnKind::Text),
        ],
        fill: changes,
        fill_runs: None,
    },
    Table {
        word: "ledger",
        columns: &[
            ("entry", ColumnKind::I64),
            ("kind", ColumnKind::Text),
            ("what", ColumnKind::Text),
            ("node", ColumnKind::Text),
            ("topic", ColumnKind::Text),
            ("time_ns", ColumnKind::Time),
            ("earliest_ns", ColumnKind::Time),
            ("latest_ns", ColumnKind::Time),
            ("until_ns", ColumnKind::Time),
            ("from_hz", ColumnKind::F64),
            ("to_hz", ColumnKind::F64),
            ("from_value", ColumnKind::Text),
            ("to_value", ColumnKind::Text),
            ("degree", ColumnKind::Text),
            ("evidence", ColumnKind::Text),
            ("part_of", ColumnKind::I64),
            ("is_quiet", ColumnKind::Flag),
            ("weight", ColumnKind::I64),
        ],
        fill: ledger,
        fill_runs: None,
    },
    Table {
        word: "phases",
        columns: &[
            ("phase", ColumnKind::I64),
            START,
            END,
            LENGTH,
            ("phase_name", ColumnKind::Text),
            ("nodes_added", ColumnKind::I64),
            ("nodes_removed", ColumnKind::I64),
            ("same_as", ColumnKind::I64),
        ],
        fill: phases,
        fill_runs: None,
    },
    Table {
        word: "bags",
        columns: &[
            ("bag", ColumnKind::Text),
            ("bag_format", ColumnKind::Text),
            ("compression", ColumnKind::Text),
            ("tier", ColumnKind::Text),
            ("tier_reason", ColumnKind::Text),
            ("is_complete", ColumnKind::Flag),
            ("file_bytes", ColumnKind::I64),
        ],
        fill: bags,
        fill_runs: None,
    },
];

fn bags(mission: &Mission, row: RowTaker<'_>) {
    for bag in &mission.bags {
        row(&[
            TableCell::text(&bag.name),
            TableCell::text(&bag.format),
            TableCell::text(bag.compression.join(" ")),
            TableCell::text(bag.tier.word()),
            text(bag.tier_reason.as_deref()),
            TableCell::Flag(bag.complete),
            TableCell::count(bag.file_bytes),
        ]);
    }
}

fn nodes(mission: &Mission, row: RowTaker<'_>) {
    for (window, graph) in mission.each() {
        let [win, start, end, length] = cells_of(window);
        for (state, load) in graph.nodes.iter().zip(graph.loads(&mission.elements)) {
            let [
                messages_in,
                messages_out,
                bytes_in,
                bytes_out,
                topics_in,
                topics_out,
            ] = load_cells(Some(load));
            let node = &mission.elements.nodes[state.id as usize];
            row(&[
                win.clone(),
                start.clone(),
                end.clone(),
                length.clone(),
                TableCell::text(node.name.as_str()),
                TableCell::text(&*node.role),
                TableCell::text(state.state.word()),
                TableCell::text(state.degree.word()),
                words(node.evidence),
                TableCell::known(state.hz, TableCell::Float),
                messages_in,
                messages_out,
                bytes_in,
                bytes_out,
                topics_in,
                topics_out,
                text(state.lifecycle.as_deref()),
                time(node.first),
                time(node.last),
            ]);
        }
    }
}

fn topics(mission: &Mission, row: RowTaker<'_>) {
    for (window, graph) in mission.each() {
        let [win, start, end, length] = cells_of(window);
        for state in &graph.topics {
            let topic = &mission.elements.topics[state.id as usize];
            let [drops, jitter, age] = measure_cells(state.measures);
            row(&[
                win.clone(),
                start.clone(),
                end.clone(),
                length.clone(),
                TableCell::text(topic.name.as_str()),
                TableCell::text(topic.types.join(" ")),
                TableCell::text(state.state.word()),
                TableCell::text(state.degree.word()),
                words(topic.evidence),
                TableCell::count(state.count),
                TableCell::known(state.bytes, TableCell::count),
                TableCell::known(state.hz, TableCell::Float),
                TableCell::known(state.median_period_s, TableCell::Float),
                TableCell::known(state.max_gap_s, TableCell::Float),
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

fn edges(mission: &Mission, row: RowTaker<'_>) {
    let elements = &mission.elements;
    for (window, graph) in mission.each() {
        let [win, start, end, length] = cells_of(window);
        let mut edge = |what: &'static str, edge: &Edge, state: &EdgeState| {
            let [drops, jitter, age] = measure_cells(state.measures);
            row(&[
                win.clone(),
                start.clone(),
                end.clone(),
                length.clone(),
                TableCell::text(what),
                TableCell::text(elements.nodes[edge.node as usize].name.as_str()),
                TableCell::text(elements.topics[edge.topic as usize].name.as_str()),
                TableCell::text(state.state.word()),
                TableCell::text(state.degree.word()),
                words(edge.evidence),
                TableCell::known(state.count, TableCell::count),
                TableCell::known(state.hz, TableCell::Float),
                TableCell::known(state.bytes, TableCell::count),
                drops,
                jitter,
                age,
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

fn changes(mission: &Mission, row: RowTaker<'_>) {
    for window in &mission.windows {
        for change in &window.changes {
            let (kind, what, at, detail) = told(mission, change);
            let [node, topic] = ends(mission, what);
            let [from_hz, to_hz, from, to] = detail;
            let [win, start, end, length] = cells_of(window);
            let (kind, what) = (TableCell::text(kind), TableCell::text(what.word()));
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

/// The cells of a change beside its time: `from_hz to_hz from_value to_value`.
type DetailCells<'a> = [TableCell<'a>; 4];

const NO_DETAIL: DetailCells<'static> = [
    TableCell::Null,
    TableCell::Null,
    TableCell::Null,
    TableCell::Null,
];

fn rates(from_hz: f64, to_hz: f64) -> DetailCells<'static> {
    [
        TableCell::Float(from_hz),
        TableCell::Float(to_hz),
        TableCell::Null,
        TableCell::Null,
    ]
}

fn values<'a>(from: impl Into<Cow<'a, str>>, to: impl Into<Cow<'a, str>>) -> DetailCells<'a> {
    [
        TableCell::Null,
        TableCell::Null,
        TableCell::text(from),
        TableCell::text(to),
    ]
}

/// The kind of a change, its element, its time, and its detail.
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

fn ledger(mission: &Mission, row: RowTaker<'_>) {
    for (id, entry) in mission.ledger.entries.iter().enumerate() {
        let [node, topic] = ends(mission, entry.what);
        let [from_hz, to_hz, from, to] = detail(mission, entry);
        row(&[
            TableCell::count(id),
            TableCell::text(entry.kind.word()),
            TableCell::text(entry.what.word()),
            node,
            topic,
            TableCell::Time(entry.time),
            TableCell::Time(entry.earliest),
            TableCell::Time(entry.latest),
            time(entry.until),
            from_hz,
            to_hz,
            from,
            to,
            TableCell::text(entry.degree.word()),
            words(entry.evidence),
            TableCell::known(entry.part_of, TableCell::count),
            TableCell::Flag(entry.quiet),
            TableCell::count(entry.weight),
        ]);
    }
}

fn detail<'a>(mission: &Mission, entry: &'a Entry) -> DetailCells<'a> {
    match &entry.detail {
        Detail::None => NO_DETAIL,
        Detail::Rates { from_hz, to_hz } => rates(*from_hz, *to_hz),
        Detail::Count(many) => values("", many.to_string()),
        Detail::Senders { from, to } => values(names(mission, from), names(mission, to)),
        Detail::Values { from, to } => values(&**from, &**to),
    }
}

fn phases(mission: &Mission, row: RowTaker<'_>) {
    for (at, phase) in mission.ledger.phases.iter().enumerate() {
        row(&[
            TableCell::count(at),
            TableCell::Time(phase.span.start),
            TableCell::Time(phase.span.end),
            TableCell::Int(phase.span.nanos()),
            TableCell::text(&*phase.name),
            TableCell::count(phase.nodes_added),
            TableCell::count(phase.nodes_removed),
            TableCell::known(phase.same_as, TableCell::count),
        ]);
    }
}

fn names(mission: &Mission, nodes: &[NodeId]) -> String {
    let nodes = nodes.iter().map(|n| &mission.elements.nodes[*n as usize]);
    nodes.map(|n| n.name.as_str()).collect::<Vec<_>>().join(" ")
}

/// The node and the topic of an element; unknown for the one it does not have.
fn ends(mission: &Mission, what: Element) -> [TableCell<'_>; 2] {
    let (node, topic) = mission.elements.names(what);
    [node, topic].map(|name| TableCell::known(name, TableCell::text))
}

/// `win start_ns end_ns length_ns` of a window.
fn cells_of(window: &Window) -> [TableCell<'static>; 4] {
    let span = window.span;
    let (start, end) = (TableCell::Time(span.start), TableCell::Time(span.end));
    [
        TableCell::count(window.index),
        start,
        end,
        TableCell::Int(span.nanos()),
    ]
}

/// `drops jitter_s age_s`.
pub(super) fn measure_cells(measures: Measures) -> [TableCell<'static>; 3] {
    [
        TableCell::known(measures.drops, TableCell::count),
        TableCell::known(measures.jitter_s, TableCell::Float),
        TableCell::known(measures.age_s, TableCell::Float),
    ]
}

/// `messages_in messages_out bytes_in bytes_out topics_in topics_out`.
pub(super) fn load_cells(load: Option<NodeLoad>) -> [TableCell<'static>; 6] {
    let cell = |value: fn(NodeLoad) -> Option<u64>| {
        TableCell::known(load.and_then(value), TableCell::count)
    };
    [
        cell(|load| Some(load.messages_in)),
        cell(|load| Some(load.messages_out)),
        cell(|load| load.bytes_in),
        cell(|load| load.bytes_out),
        cell(|load| Some(load.topics_in.into())),
        cell(|load| Some(load.topics_out.into())),
    ]
}

pub(super) fn words(evidence: Evidence) -> TableCell<'static> {
    TableCell::text(evidence.words().collect::<Vec<_>>().join(" "))
}

pub(super) fn text(text: Option<&str>) -> TableCell<'_> {
    TableCell::known(text, TableCell::text)
}

pub(super) fn time(stamp: Option<Stamp>) -> TableCell<'static> {
    TableCell::known(stamp, TableCell::Time)
}
