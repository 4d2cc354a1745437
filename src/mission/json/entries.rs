//! The ledger's entries as JSON, written and read back.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::changes::RawElementName;
use super::write::words;
use crate::base::time::{Span, Stamp};
use crate::evidence::{Degree, Evidence};
use crate::graph::{Edge, Element, Elements, NodeId};
use crate::mission::ledger::{
    Detail, Entry, Interruption, InterruptionKind, Kind, Ledger, Phase, sorted,
};

/// An entry in the form for writing.
#[derive(Serialize)]
pub(crate) struct EntryRow<'a> {
    id: u32,
    kind: &'static str,
    #[serde(flatten)]
    named: RawElementName<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    role: Option<&'a str>,
    time_ns: i64,
    earliest_ns: i64,
    latest_ns: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    until_ns: Option<i64>,
    #[serde(flatten)]
    detail: DetailRow<'a>,
    degree: &'static str,
    evidence: Vec<&'static str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    parts: Vec<u32>,
    quiet: bool,
    weight: u32,
}

#[derive(Serialize)]
#[serde(untagged)]
enum DetailRow<'a> {
    None {},
    Rates {
        from_hz: f64,
        to_hz: f64,
    },
    Senders {
        from: Vec<&'a str>,
        to: Vec<&'a str>,
    },
    Count {
        count: u64,
    },
    Values {
        from: &'a str,
        to: &'a str,
    },
}

/// The rows of a ledger, in order.
pub(crate) fn entries<'a>(
    ledger: &'a Ledger,
    elements: &'a Elements,
) -> impl Iterator<Item = EntryRow<'a>> + Clone {
    let parts = ledger.all_parts();
    (0..).zip(&ledger.entries).map(move |(id, entry)| EntryRow {
        id,
        kind: entry.kind.word(),
        named: RawElementName::new(entry.what, elements),
        role: role(entry.what, elements),
        time_ns: entry.time.0,
        earliest_ns: entry.earliest.0,
        latest_ns: entry.latest.0,
        until_ns: entry.until.map(|t| t.0),
        detail: detail(&entry.detail, elements),
        degree: entry.degree.word(),
        evidence: words(entry.evidence),
        parts: parts.get(&id).cloned().unwrap_or_default(),
        quiet: entry.quiet,
        weight: entry.weight,
    })
}

/// A phase in the form for writing and reading.
#[derive(Deserialize, Serialize)]
pub(crate) struct PhaseRow {
    start_ns: i64,
    end_ns: i64,
    #[serde(default)]
    name: String,
    #[serde(default)]
    nodes_added: u32,
    #[serde(default)]
    nodes_removed: u32,
    #[serde(default)]
    ramp: bool,
    #[serde(rename = "as")]
    same_as: Option<u32>,
}

/// An interruption of the recording in the form for writing and reading.
#[derive(Deserialize, Serialize)]
pub(crate) struct InterruptionRow {
    time_ns: i64,
    kind: String,
    length_ns: i64,
}

impl From<&Interruption> for InterruptionRow {
    fn from(one: &Interruption) -> Self {
        Self {
            time_ns: one.time.0,
            kind: one.kind.word().to_owned(),
            length_ns: one.length,
        }
    }
}

/// The interruptions of rows that were read, without those of unknown kinds.
pub(crate) fn interruptions(rows: &[InterruptionRow]) -> Vec<Interruption> {
    let one = |row: &InterruptionRow| {
        let mut kinds = InterruptionKind::ALL.into_iter();
        Some(Interruption {
            time: Stamp(row.time_ns),
            kind: kinds.find(|kind| kind.word() == row.kind)?,
            length: row.length_ns.max(0),
        })
    };
    let mut all: Vec<Interruption> = rows.iter().filter_map(one).collect();
    all.sort_unstable();
    all
}

impl From<&Phase> for PhaseRow {
    fn from(phase: &Phase) -> Self {
        Self {
            start_ns: phase.span.start.0,
            end_ns: phase.span.end.0,
            name: phase.name.to_string(),
            nodes_added: phase.nodes_added,
            nodes_removed: phase.nodes_removed,
            ramp: phase.is_ramp,
            same_as: phase.same_as,
        }
    }
}

/// The phases of rows that were read; a reference to a later phase as the same one is dropped.
pub(crate) fn phases(rows: Vec<PhaseRow>) -> Vec<Phase> {
    let phase = |(at, row): (u32, PhaseRow)| Phase {
        span: Span::new(Stamp(row.start_ns), Stamp(row.end_ns.max(row.start_ns))),
        name: row.name.into(),
        nodes_added: row.nodes_added,
        nodes_removed: row.nodes_removed,
        is_ramp: row.ramp,
        same_as: row.same_as.filter(|earlier| *earlier < at),
    };
    (0..).zip(rows).map(phase).collect()
}

/// Every entry of a ledger as an object on one line.
pub(crate) fn rows<'a>(
    ledger: &'a Ledger,
    elements: &'a Elements,
) -> impl Iterator<Item = String> + 'a {
    // Only maps with keys that are not strings fail, and there are none.
    entries(ledger, elements).map(|row| serde_json::to_string(&row).unwrap_or_default())
}

/// A text in quotes.
pub(crate) fn text(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default()
}

/// The role of the node that an entry is about.
fn role(what: Element, elements: &Elements) -> Option<&str> {
    let (node, _) = elements.ends(what);
    node.map(|id| &*elements.nodes[id as usize].role)
}

fn detail<'a>(detail: &'a Detail, elements: &'a Elements) -> DetailRow<'a> {
    let names = |nodes: &[NodeId]| {
        let name = |id: &NodeId| elements.nodes[*id as usize].name.as_str();
        nodes.iter().map(name).collect()
    };
    match detail {
        Detail::None => DetailRow::None {},
        Detail::Rates { from_hz, to_hz } => DetailRow::Rates {
            from_hz: *from_hz,
            to_hz: *to_hz,
        },
        Detail::Senders { from, to } => DetailRow::Senders {
            from: names(from),
            to: names(to),
        },
        Detail::Count(count) => DetailRow::Count { count: *count },
        Detail::Values { from, to } => DetailRow::Values { from, to },
    }
}

/// An entry in the form for reading: all but its kind, element and time may be missing.
#[derive(Deserialize)]
pub(crate) struct RawEntry {
    kind: String,
    what: String,
    name: Option<String>,
    node: Option<String>,
    topic: Option<String>,
    time_ns: i64,
    earliest_ns: Option<i64>,
    latest_ns: Option<i64>,
    until_ns: Option<i64>,
    from_hz: Option<f64>,
    to_hz: Option<f64>,
    from: Option<OneOrMore>,
    to: Option<OneOrMore>,
    count: Option<u64>,
    degree: Option<String>,
    #[serde(default)]
    evidence: Vec<String>,
    #[serde(default)]
    parts: Vec<u32>,
    #[serde(default)]
    quiet: bool,
    weight: Option<u32>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrMore {
    One(String),
    Many(Vec<String>),
}

/// The ledger of rows that were read; `None` if one of them is about an element that is not in any window.
pub(crate) fn read(rows: &[RawEntry], elements: &Elements) -> Option<Vec<Entry>> {
    let mut list = rows
        .iter()
        .map(|row| entry(row, elements))
        .collect::<Option<Vec<_>>>()?;
    for (id, row) in (0..).zip(rows) {
        for part in &row.parts {
            list.get_mut(*part as usize)?.part_of = Some(id);
        }
    }
    Some(sorted(list, elements).0)
}

fn entry(row: &RawEntry, elements: &Elements) -> Option<Entry> {
    let degree = Degree::ALL
        .into_iter()
        .find(|d| row.degree.as_deref() == Some(d.word()));
    Some(Entry {
        kind: Kind::ALL.into_iter().find(|k| k.word() == row.kind)?,
        what: element(row, elements)?,
        time: Stamp(row.time_ns),
        earliest: Stamp(row.earliest_ns.unwrap_or(row.time_ns)),
        latest: Stamp(row.latest_ns.unwrap_or(row.time_ns)),
        until: row.until_ns.map(Stamp),
        detail: read_detail(row, elements)?,
        degree: degree.unwrap_or(Degree::Stated),
        evidence: row
            .evidence
            .iter()
            .fold(Evidence::NONE, |all, word| all.and(Evidence::of(word))),
        part_of: None,
        quiet: row.quiet,
        weight: row.weight.unwrap_or(1),
    })
}

fn element(row: &RawEntry, elements: &Elements) -> Option<Element> {
    let place = |edges: &[Edge], node_first: bool| {
        let node = node(row.node.as_deref()?, elements)?;
        let topic = topic(row.topic.as_deref()?, elements)?;
        let key = |e: &Edge| {
            if node_first {
                (e.node, e.topic)
            } else {
                (e.topic, e.node)
            }
        };
        let wanted = if node_first {
            (node, topic)
        } else {
            (topic, node)
        };
        let place = edges.binary_search_by_key(&wanted, key).ok()?;
        u32::try_from(place).ok()
    };
    match row.what.as_str() {
        "node" => node(row.name.as_deref()?, elements).map(Element::Node),
        "topic" => topic(row.name.as_deref()?, elements).map(Element::Topic),
        "publish" => place(&elements.publishes, true).map(Element::Publish),
        "subscribe" => place(&elements.subscribes, false).map(Element::Subscribe),
        _ => None,
    }
}

fn node(name: &str, elements: &Elements) -> Option<NodeId> {
    let place = elements
        .nodes
        .binary_search_by(|n| n.name.as_str().cmp(name));
    u32::try_from(place.ok()?).ok()
}

fn topic(name: &str, elements: &Elements) -> Option<u32> {
    let place = elements
        .topics
        .binary_search_by(|t| t.name.as_str().cmp(name));
    u32::try_from(place.ok()?).ok()
}

fn read_detail(row: &RawEntry, elements: &Elements) -> Option<Detail> {
    if let (Some(from_hz), Some(to_hz)) = (row.from_hz, row.to_hz) {
        return Some(Detail::Rates { from_hz, to_hz });
    }
    if let Some(count) = row.count {
        return Some(Detail::Count(count));
    }
    let nodes = |names: &[String]| {
        let all = names.iter().map(|name| node(name, elements));
        all.collect::<Option<Vec<_>>>()
    };
    Some(match (&row.from, &row.to) {
        (Some(OneOrMore::Many(from)), Some(OneOrMore::Many(to))) => Detail::Senders {
            from: nodes(from)?,
            to: nodes(to)?,
        },
        (Some(OneOrMore::One(from)), Some(OneOrMore::One(to))) => Detail::Values {
            from: Arc::from(from.as_str()),
            to: Arc::from(to.as_str()),
        },
        _ => Detail::None,
    })
}
