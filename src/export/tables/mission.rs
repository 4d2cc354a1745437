//! The tables of a mission: their columns, each with its cell, and their rows.

use crate::base::table::{Batch, ColumnKind, ColumnOf, TableCell, columns};
use crate::base::time::{Span, Stamp};
use crate::graph::{Element, ElementState, Id as _, Node, NodeId, NodeLoad, Topic};
use crate::mission::event_log::{Detail, Event, EventId};
use crate::mission::{Change, Mission};

/// A function that takes a row.
pub(super) type RowTaker<'a> = &'a mut dyn FnMut(&[TableCell<'_>]);

/// A table: its name in the file's name, an empty batch, and the function that fills it.
pub(super) struct Table {
    pub(super) word: &'static str,
    pub(super) batch: fn() -> Batch,
    pub(super) fill: fn(&Mission, RowTaker<'_>),
}

type Column<R> = ColumnOf<Mission, R>;

/// All tables of a mission.
pub(super) const TABLES: &[Table] = &[
    Table {
        word: "edges",
        batch: || Batch::with(EDGES),
        fill: |all, row| elements(all, Element::is_edge, EDGES, row),
    },
    Table {
        word: "topics",
        batch: || Batch::with(TOPICS),
        fill: |all, row| elements(all, Element::is_topic, TOPICS, row),
    },
    Table {
        word: "nodes",
        batch: || Batch::with(NODES),
        fill: |all, row| elements(all, Element::is_node, NODES, row),
    },
    Table {
        word: "changes",
        batch: || Batch::with(CHANGES),
        fill: |all, row| {
            for (at, window) in all.windows.iter().enumerate() {
                let changes = window.changes.iter();
                changes.for_each(|one| put(all, CHANGES, &(at, one.clone()), row));
            }
        },
    },
    Table {
        word: "events",
        batch: || Batch::with(EVENTS),
        fill: |all, row| {
            let ids = all.log.events.ids();
            ids.for_each(|id| put(all, EVENTS, &id, row));
        },
    },
    Table {
        word: "phases",
        batch: || Batch::with(PHASES),
        fill: |all, row| (0..all.log.phases.len()).for_each(|at| put(all, PHASES, &at, row)),
    },
    Table {
        word: "bags",
        batch: || Batch::with(BAGS),
        fill: |all, row| (0..all.bags.len()).for_each(|at| put(all, BAGS, &at, row)),
    },
];

fn put<R>(mission: &Mission, columns: &[Column<R>], one: &R, row: RowTaker<'_>) {
    let cells = columns.iter();
    let cells: Vec<_> = cells.map(|column| (column.cell)(mission, one)).collect();
    row(&cells);
}

/// The columns of a table of elements, including those common to all such tables.
macro_rules! of_elements {
    ($($column:ident)*) => { &[$($column),*] };
}

const EDGES: &[Column<Seen>] = of_elements! {
    WIN START END LENGTH WHAT NODE TOPIC STATE DEGREE EVIDENCE N HZ BYTES DROPS JITTER AGE FIRST LAST
};
const TOPICS: &[Column<Seen>] = of_elements! {
    WIN START END LENGTH TOPIC TYPES STATE DEGREE EVIDENCE N BYTES HZ MEDIAN GAP DROPS JITTER AGE SKEW QOS FIRST LAST
};
const NODES: &[Column<Seen>] = of_elements! {
    WIN START END LENGTH NODE ROLE STATE DEGREE EVIDENCE HZ MESSAGES_IN MESSAGES_OUT BYTES_IN BYTES_OUT TOPICS_IN
    TOPICS_OUT LIFECYCLE FIRST LAST
};

macro_rules! element_columns {
    ($($column:ident $name:literal $kind:ident $cell:expr;)*) => {
        $(const $column: Column<Seen> = ColumnOf { name: $name, kind: ColumnKind::$kind, cell: $cell };)*
    };
}

element_columns! {
    WIN "win" I64 |_, one| TableCell::count(one.win);
    START "start_ns" Time |_, one| start(one.span);
    END "end_ns" Time |_, one| end(one.span);
    LENGTH "length_ns" I64 |_, one| length(one.span);
    WHAT "what" Text |_, one| what(one.state.what);
    NODE "node" Text |all, one| node(all, one.state.what);
    ROLE "node_role" Text |all, one| text(node_of(all, one).map(|node| &*node.role));
    TOPIC "topic" Text |all, one| topic(all, one.state.what);
    TYPES "types" Text |all, one| words(topic_of(all, one).iter().flat_map(|topic| &topic.types).map(|kind| &**kind));
    QOS "qos" Text |all, one| text(topic_of(all, one).and_then(|topic| topic.qos.as_deref()));
    STATE "state" Text |_, one| TableCell::text(one.state.state.word());
    DEGREE "degree" Text |_, one| TableCell::text(one.state.confidence.word());
    EVIDENCE "evidence" Text |all, one| words(all.elements.evidence(one.state.what).words());
    LIFECYCLE "lifecycle" Text |_, one| text(one.state.lifecycle.as_deref());
    N "n" I64 |_, one| count(one.state.count);
    HZ "hz" F64 |_, one| float(one.state.hz);
    BYTES "bytes" I64 |_, one| count(one.state.bytes);
    MEDIAN "median_period_s" F64 |_, one| float(one.state.median_period_s);
    GAP "max_gap_s" F64 |_, one| float(one.state.max_gap_s);
    DROPS "drops" I64 |_, one| count(one.state.measures.drops);
    JITTER "jitter_s" F64 |_, one| float(one.state.measures.jitter_s);
    AGE "age_s" F64 |_, one| float(one.state.measures.age_s);
    SKEW "skew" F64 |_, one| float(one.skew);
    MESSAGES_IN "messages_in" I64 |_, one| count(one.load.map(|load| load.messages_in));
    MESSAGES_OUT "messages_out" I64 |_, one| count(one.load.map(|load| load.messages_out));
    BYTES_IN "bytes_in" I64 |_, one| count(one.load.and_then(|load| load.bytes_in));
    BYTES_OUT "bytes_out" I64 |_, one| count(one.load.and_then(|load| load.bytes_out));
    TOPICS_IN "topics_in" I64 |_, one| count(one.load.map(|load| load.topics_in.into()));
    TOPICS_OUT "topics_out" I64 |_, one| count(one.load.map(|load| load.topics_out.into()));
    FIRST "first_ns" Time |all, one| time(all.elements.seen(one.state.what).first);
    LAST "last_ns" Time |all, one| time(all.elements.seen(one.state.what).last);
}

/// The elements of a kind in each window.
fn elements(
    all: &Mission,
    is_kind: fn(&Element) -> bool,
    columns: &[Column<Seen>],
    row: RowTaker<'_>,
) {
    let skews = all.skews();
    for (window, graph) in all.each() {
        // Of nodes, which come first.
        let has_loads = is_kind(&Element::Node(NodeId::of(0)));
        let loads = has_loads.then(|| graph.loads(&all.elements));
        let mut loads = loads.into_iter().flatten();
        for state in graph.states {
            let load = loads.next();
            if !is_kind(&state.what) {
                continue;
            }
            let skew = match state.what {
                Element::Topic(id) => skews.get(id).copied().flatten(),
                _ => None,
            };
            let (win, span) = (window.index, window.span);
            let one = Seen {
                win,
                span,
                state,
                skew,
                load,
            };
            put(all, columns, &one, row);
        }
    }
}

/// An element in a window.
struct Seen {
    /// The index of the window.
    win: usize,
    span: Span,
    state: ElementState,
    /// The skew of a topic over all windows.
    skew: Option<f64>,
    load: Option<NodeLoad>,
}

fn node_of<'a>(mission: &'a Mission, one: &Seen) -> Option<&'a Node> {
    match one.state.what {
        Element::Node(id) => mission.elements.nodes.get(id),
        _ => None,
    }
}

fn topic_of<'a>(mission: &'a Mission, one: &Seen) -> Option<&'a Topic> {
    match one.state.what {
        Element::Topic(id) => mission.elements.topics.get(id),
        _ => None,
    }
}

/// A change, and the index of its window.
type WindowChange = (usize, Change);

const CHANGES: &[Column<WindowChange>] = columns! {
    "win" I64 |all, one| TableCell::count(all.windows[one.0].index);
    "start_ns" Time |all, one| start(all.windows[one.0].span);
    "end_ns" Time |all, one| end(all.windows[one.0].span);
    "length_ns" I64 |all, one| length(all.windows[one.0].span);
    "kind" Text |_, one| TableCell::text(one.1.word());
    "what" Text |_, one| what(one.1.what);
    "node" Text |all, one| node(all, one.1.what);
    "topic" Text |all, one| topic(all, one.1.what);
    "time_ns" Time |_, one| time(one.1.time);
    "from_hz" F64 |_, one| float(rates(&one.1.detail).0);
    "to_hz" F64 |_, one| float(rates(&one.1.detail).1);
    "from_value" Text |all, one| values(all, &one.1.detail).0;
    "to_value" Text |all, one| values(all, &one.1.detail).1;
};

const EVENTS: &[Column<EventId>] = columns! {
    "id" I64 |_, id| TableCell::count(id.0);
    "kind" Text |all, id| TableCell::text(event(all, *id).kind.word());
    "what" Text |all, id| what(event(all, *id).what);
    "node" Text |all, id| node(all, event(all, *id).what);
    "topic" Text |all, id| topic(all, event(all, *id).what);
    "time_ns" Time |all, id| TableCell::Time(event(all, *id).time);
    "earliest_ns" Time |all, id| TableCell::Time(event(all, *id).earliest);
    "latest_ns" Time |all, id| TableCell::Time(event(all, *id).latest);
    "until_ns" Time |all, id| time(event(all, *id).until);
    "from_hz" F64 |all, id| float(rates(&event(all, *id).detail).0);
    "to_hz" F64 |all, id| float(rates(&event(all, *id).detail).1);
    "from_value" Text |all, id| values(all, &event(all, *id).detail).0;
    "to_value" Text |all, id| values(all, &event(all, *id).detail).1;
    "degree" Text |all, id| TableCell::text(event(all, *id).confidence.word());
    "evidence" Text |all, id| words(event(all, *id).evidence.words());
    "part_of" I64 |all, id| count(event(all, *id).part_of.map(|id| id.0.into()));
    "is_quiet" FLAG |all, id| TableCell::Flag(event(all, *id).quiet);
    "weight" I64 |all, id| TableCell::count(event(all, *id).weight);
};

const PHASES: &[Column<usize>] = columns! {
    "phase" I64 |_, at| TableCell::count(*at);
    "start_ns" Time |all, at| start(all.log.phases[*at].span);
    "end_ns" Time |all, at| end(all.log.phases[*at].span);
    "length_ns" I64 |all, at| length(all.log.phases[*at].span);
    "phase_name" Text |all, at| TableCell::text(&*all.log.phases[*at].name);
    "nodes_added" I64 |all, at| TableCell::count(all.log.phases[*at].nodes_added);
    "nodes_removed" I64 |all, at| TableCell::count(all.log.phases[*at].nodes_removed);
    "same_as" I64 |all, at| count(all.log.phases[*at].same_as.map(u64::from));
};

const BAGS: &[Column<usize>] = columns! {
    "bag" Text |all, at| TableCell::text(&all.bags[*at].name);
    "bag_format" Text |all, at| TableCell::text(&all.bags[*at].format);
    "compression" Text |all, at| TableCell::text(all.bags[*at].compression.join(" "));
    "tier" Text |all, at| TableCell::text(all.bags[*at].tier.word());
    "tier_reason" Text |all, at| text(all.bags[*at].tier_reason.as_deref());
    "is_complete" FLAG |all, at| TableCell::Flag(all.bags[*at].complete);
    "file_bytes" I64 |all, at| TableCell::count(all.bags[*at].file_bytes);
};

fn event(mission: &Mission, id: EventId) -> &Event {
    &mission.log.events[id]
}

fn rates(detail: &Detail) -> (Option<f64>, Option<f64>) {
    match detail {
        Detail::Rates { from_hz, to_hz } => (Some(*from_hz), Some(*to_hz)),
        _ => (None, None),
    }
}

fn values<'a>(mission: &Mission, detail: &'a Detail) -> (TableCell<'a>, TableCell<'a>) {
    let names = |nodes: &[NodeId]| {
        let nodes = nodes.iter().map(|n| &mission.elements.nodes[*n]);
        words(nodes.map(|n| n.name.as_str()))
    };
    match detail {
        Detail::None | Detail::Rates { .. } => (TableCell::Null, TableCell::Null),
        Detail::Count { count } => (TableCell::text(""), TableCell::text(count.to_string())),
        Detail::Senders { from, to } => (names(from), names(to)),
        Detail::Values { from, to } => (TableCell::text(&**from), TableCell::text(&**to)),
    }
}

fn start(span: Span) -> TableCell<'static> {
    TableCell::Time(span.start)
}

fn end(span: Span) -> TableCell<'static> {
    TableCell::Time(span.end)
}

fn length(span: Span) -> TableCell<'static> {
    TableCell::Int(span.nanos())
}

fn what(what: Element) -> TableCell<'static> {
    TableCell::text(what.word())
}

/// The node of an element; unknown for a topic.
fn node(mission: &Mission, what: Element) -> TableCell<'_> {
    text(mission.elements.names(what).0)
}

/// The topic of an element; unknown for a node.
fn topic(mission: &Mission, what: Element) -> TableCell<'_> {
    text(mission.elements.names(what).1)
}

fn words<'a>(words: impl Iterator<Item = &'a str>) -> TableCell<'static> {
    TableCell::text(words.collect::<Vec<_>>().join(" "))
}

fn text(text: Option<&str>) -> TableCell<'_> {
    TableCell::known(text, TableCell::text)
}

fn count(count: Option<u64>) -> TableCell<'static> {
    TableCell::known(count, TableCell::count)
}

fn float(number: Option<f64>) -> TableCell<'static> {
    TableCell::known(number, TableCell::Float)
}

fn time(stamp: Option<Stamp>) -> TableCell<'static> {
    TableCell::known(stamp, TableCell::Time)
}
