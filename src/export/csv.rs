//! The evolution as tidy tables: a row per element and window, in files beside each other.
//!
//! Column names are in snake case and reserved in no dialect of SQL; empty fields are unknown.

use csv::Writer;

use super::{Encoder, Written};
use crate::base::csv::cell;
use crate::base::error::{Error, Result};
use crate::base::time::Stamp;
use crate::evidence::Evidence;
use crate::export::sequence::Sequence;
use crate::export::sink::Sink;
use crate::export::target::{Target, is_special};
use crate::graph::diff::Change;
use crate::graph::{Edge, EdgeState, Element};
use crate::mission::{Mission, Window};

/// A table: its word in the file's name, its columns, and what fills it.
struct Table {
    word: &'static str,
    columns: &'static str,
    fill: fn(&Mission, &mut dyn FnMut(Vec<String>)),
}

/// Columns separated by blanks; `WINDOW` stands in front of all but the bags.
const TABLES: &[Table] = &[
    Table {
        word: "edges",
        columns: "what node topic state degree evidence n hz first_ns last_ns",
        fill: edges,
    },
    Table {
        word: "topics",
        columns: "topic types state degree evidence n bytes hz median_period_s max_gap_s qos first_ns last_ns",
        fill: topics,
    },
    Table {
        word: "nodes",
        columns: "node node_role state degree evidence hz lifecycle first_ns last_ns",
        fill: nodes,
    },
    Table {
        word: "changes",
        columns: "kind what node topic time_ns from_hz to_hz from_value to_value",
        fill: changes,
    },
    Table {
        word: "bags",
        columns: "bag bag_format compression tier tier_reason is_complete file_bytes",
        fill: bags,
    },
];

/// The first columns of every table about windows.
const WINDOW: &str = "win start_ns end_ns length_ns";

struct Tables<'a> {
    mission: &'a Mission,
    target: Target,
}

/// Whether several files can be made of this name.
///
/// # Errors
/// [`Error::Usage`] for standard output, devices, and a name with `{n}`.
pub(crate) fn check(target: &Target) -> Result<()> {
    let what = match target {
        Target::Stdout => "standard output is one".to_owned(),
        Target::Path(path) if is_special(path) => format!("`{}` is one", path.display()),
        Target::Path(_) => return target.must_be_one("the tables hold all windows"),
    };
    Err(Error::usage(
        format!("CSV is several tables, {what}"),
        "name a file: `-o x.csv` writes `x.edges.csv` and others",
    ))
}

/// The files of all tables.
pub(crate) fn files(target: &Target) -> Vec<Target> {
    let file = |table: &Table| target.with_word(table.word, "csv");
    TABLES.iter().map(file).collect()
}

/// Begins the tables.
///
/// # Errors
/// As [`check`].
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    check(target)?;
    Ok(Box::new(Tables {
        mission: sequence.data,
        target: target.clone(),
    }))
}

impl Encoder for Tables<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let each = TABLES.iter().zip(files(&self.target));
        let write = |(table, file): (_, Target)| write(self.mission, table, &file);
        // All of them are whole before the first one gets its name.
        let sinks: Vec<Sink> = each.map(write).collect::<Result<_>>()?;
        let mut written = Written::to(&self.target);
        for sink in sinks {
            written.add(sink.commit()?);
        }
        Ok(written)
    }
}

fn write(mission: &Mission, table: &Table, target: &Target) -> Result<Sink> {
    let sink = Sink::create(target, None)?;
    let failed = Error::io("write", sink.path());
    rows(mission, table, sink).map_err(failed)
}

fn rows(mission: &Mission, table: &Table, sink: Sink) -> std::io::Result<Sink> {
    let mut writer = Writer::from_writer(sink);
    let before = if table.word == "bags" { "" } else { WINDOW };
    let columns = before.split_whitespace().chain(table.columns.split(' '));
    writer.write_record(columns)?;
    let mut result = Ok(());
    (table.fill)(mission, &mut |row| {
        if result.is_ok() {
            result = writer.write_record(row.iter().map(|text| cell(text).into_owned()));
        }
    });
    result?;
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}

fn bags(mission: &Mission, row: &mut dyn FnMut(Vec<String>)) {
    for bag in &mission.bags {
        row(vec![
            bag.name.clone(),
            bag.format.clone(),
            bag.compression.join(" "),
            bag.tier.word().to_owned(),
            bag.tier_reason.clone().unwrap_or_default(),
            bag.complete.to_string(),
            bag.file_bytes.to_string(),
        ]);
    }
}

fn nodes(mission: &Mission, row: &mut dyn FnMut(Vec<String>)) {
    for window in &mission.windows {
        for state in &window.graph.nodes {
            let node = &mission.elements.nodes[state.id as usize];
            let mut fields = window_fields(window);
            fields.extend([
                node.name.to_string(),
                node.role.to_string(),
                state.state.word().to_owned(),
                state.degree.word().to_owned(),
                words(node.evidence),
                known(state.hz),
                known(state.lifecycle.as_deref()),
                nanos(node.first),
                nanos(node.last),
            ]);
            row(fields);
        }
    }
}

fn topics(mission: &Mission, row: &mut dyn FnMut(Vec<String>)) {
    for window in &mission.windows {
        for state in &window.graph.topics {
            let topic = &mission.elements.topics[state.id as usize];
            let mut fields = window_fields(window);
            fields.extend([
                topic.name.to_string(),
                topic.types.join(" "),
                state.state.word().to_owned(),
                state.degree.word().to_owned(),
                words(topic.evidence),
                state.count.to_string(),
                known(state.bytes),
                known(state.hz),
                known(state.median_period_s),
                known(state.max_gap_s),
                known(topic.qos.as_deref()),
                nanos(topic.first),
                nanos(topic.last),
            ]);
            row(fields);
        }
    }
}

fn edges(mission: &Mission, row: &mut dyn FnMut(Vec<String>)) {
    let elements = &mission.elements;
    for window in &mission.windows {
        let mut edge = |what: &str, edge: &Edge, state: &EdgeState| {
            let mut fields = window_fields(window);
            fields.extend([
                what.to_owned(),
                elements.nodes[edge.node as usize].name.to_string(),
                elements.topics[edge.topic as usize].name.to_string(),
                state.state.word().to_owned(),
                state.degree.word().to_owned(),
                words(edge.evidence),
                known(state.count),
                known(state.hz),
                nanos(edge.first),
                nanos(edge.last),
            ]);
            row(fields);
        };
        for state in &window.graph.publishes {
            edge("publish", &elements.publishes[state.id as usize], state);
        }
        for state in &window.graph.subscribes {
            edge("subscribe", &elements.subscribes[state.id as usize], state);
        }
    }
}

fn changes(mission: &Mission, row: &mut dyn FnMut(Vec<String>)) {
    for window in &mission.windows {
        for change in &window.changes {
            let mut fields = window_fields(window);
            fields.extend(change_fields(mission, change));
            row(fields);
        }
    }
}

/// `kind what node topic time_ns from_hz to_hz from_value to_value` of a change.
fn change_fields(mission: &Mission, change: &Change) -> Vec<String> {
    let names = |nodes: &[u32]| {
        let names = nodes
            .iter()
            .map(|n| mission.elements.nodes[*n as usize].name.as_str());
        names.collect::<Vec<_>>().join(" ")
    };
    let no = String::new;
    let (kind, what, values) = match change {
        Change::Added { what, time } => ("added", *what, [nanos(*time), no(), no(), no(), no()]),
        Change::Removed { what, time } => {
            ("removed", *what, [nanos(*time), no(), no(), no(), no()])
        }
        Change::Rate {
            what,
            from_hz,
            to_hz,
        } => (
            "rate",
            *what,
            [no(), from_hz.to_string(), to_hz.to_string(), no(), no()],
        ),
        Change::HandedOver { topic, from, to } => {
            let values = [no(), no(), no(), names(from), names(to)];
            ("handed_over", Element::Topic(*topic), values)
        }
        Change::Restarted { node, time } => {
            let values = [nanos(Some(*time)), no(), no(), no(), no()];
            ("restarted", Element::Node(*node), values)
        }
        Change::Value {
            kind,
            what,
            from,
            to,
        } => (
            kind.word(),
            *what,
            [no(), no(), no(), from.to_string(), to.to_string()],
        ),
    };
    let (node, topic) = ends(mission, what);
    let mut fields = vec![kind.to_owned(), what.word().to_owned(), node, topic];
    fields.extend(values);
    fields
}

/// The node and the topic of an element; empty for the one it does not have.
fn ends(mission: &Mission, what: Element) -> (String, String) {
    let elements = &mission.elements;
    let node = |id: u32| elements.nodes[id as usize].name.to_string();
    let topic = |id: u32| elements.topics[id as usize].name.to_string();
    let both = |edge: &Edge| (node(edge.node), topic(edge.topic));
    match what {
        Element::Node(id) => (node(id), String::new()),
        Element::Topic(id) => (String::new(), topic(id)),
        Element::Publish(id) => both(&elements.publishes[id as usize]),
        Element::Subscribe(id) => both(&elements.subscribes[id as usize]),
    }
}

fn window_fields(window: &Window) -> Vec<String> {
    let span = window.span;
    let numbers = [span.start.0, span.end.0, span.nanos()].map(|n| n.to_string());
    std::iter::once(window.index.to_string())
        .chain(numbers)
        .collect()
}

fn words(evidence: Evidence) -> String {
    evidence.words().collect::<Vec<_>>().join(" ")
}

fn nanos(stamp: Option<Stamp>) -> String {
    known(stamp.map(|s| s.0))
}

fn known(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}
