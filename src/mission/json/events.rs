//! The log's events as JSON, written and read back.

use serde::{Deserialize, Serialize};

use super::elements::{Text, confidence_of, evidence, words};
use crate::base::time::{Span, Stamp};
use crate::graph::{ById, Element, Elements, NodeId};
use crate::mission::event_log::{
    Detail, Event, EventId, EventLog, Interruption, InterruptionKind, Kind, Phase, sorted,
};

/// An element by its name, or an edge by its two names.
#[derive(Deserialize, Serialize)]
pub(crate) struct ElementName<'a> {
    what: Text<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<Text<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<Text<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    topic: Option<Text<'a>>,
}

impl<'a> ElementName<'a> {
    pub(crate) fn new(what: Element, elements: &'a Elements) -> Self {
        let (node, topic) = elements.names(what);
        let is_edge = node.is_some() && topic.is_some();
        Self {
            what: what.word().into(),
            name: node.or(topic).filter(|_| !is_edge).map(Text::from),
            node: node.filter(|_| is_edge).map(Text::from),
            topic: topic.filter(|_| is_edge).map(Text::from),
        }
    }

    fn element(&self, elements: &Elements) -> Option<Element> {
        let node = |name: &Option<Text<'_>>| elements.node(name.as_deref()?);
        let topic = |name: &Option<Text<'_>>| elements.topic(name.as_deref()?);
        let ends = || node(&self.node).zip(topic(&self.topic));
        match &*self.what {
            "node" => node(&self.name).map(Element::Node),
            "topic" => topic(&self.name).map(Element::Topic),
            "publish" => elements.published(ends()?),
            "subscribe" => elements.subscribed(ends()?),
            _ => None,
        }
    }
}

/// An event; when read, everything except kind, element and time is optional.
#[derive(Deserialize, Serialize)]
pub(crate) struct EventJson<'a> {
    #[serde(default)]
    id: EventId,
    kind: Text<'a>,
    #[serde(flatten)]
    named: ElementName<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    role: Option<Text<'a>>,
    time_ns: i64,
    earliest_ns: Option<i64>,
    latest_ns: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    until_ns: Option<i64>,
    #[serde(flatten)]
    detail: DetailJson<'a>,
    degree: Option<Text<'a>>,
    #[serde(default)]
    evidence: Vec<Text<'a>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    parts: Vec<EventId>,
    /// The event that this one follows from: the one that lists it among its parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    cause: Option<EventId>,
    #[serde(default)]
    quiet: bool,
    weight: Option<u32>,
}

#[derive(Deserialize, Serialize)]
#[serde(untagged)]
pub(crate) enum DetailJson<'a> {
    Rates {
        from_hz: f64,
        to_hz: f64,
    },
    Count {
        count: u64,
    },
    Senders {
        from: Vec<Text<'a>>,
        to: Vec<Text<'a>>,
    },
    Values {
        from: Text<'a>,
        to: Text<'a>,
    },
    None {},
}

impl<'a> DetailJson<'a> {
    pub(crate) fn new(detail: &Detail, elements: &'a Elements) -> Self {
        let names = |nodes: &[NodeId]| {
            let name = |id: &NodeId| elements.nodes[*id].name.as_str().into();
            nodes.iter().map(name).collect()
        };
        match detail {
            Detail::None => Self::None {},
            Detail::Rates { from_hz, to_hz } => Self::Rates {
                from_hz: *from_hz,
                to_hz: *to_hz,
            },
            Detail::Senders { from, to } => Self::Senders {
                from: names(from),
                to: names(to),
            },
            Detail::Count(count) => Self::Count { count: *count },
            Detail::Values { from, to } => Self::Values {
                from: from.to_string().into(),
                to: to.to_string().into(),
            },
        }
    }

    fn detail(&self, elements: &Elements) -> Option<Detail> {
        let nodes = |names: &[Text<'_>]| {
            let all = names.iter().map(|name| elements.node(name));
            all.collect::<Option<Vec<_>>>()
        };
        Some(match self {
            Self::None {} => Detail::None,
            Self::Rates { from_hz, to_hz } => Detail::Rates {
                from_hz: *from_hz,
                to_hz: *to_hz,
            },
            Self::Senders { from, to } => Detail::Senders {
                from: nodes(from)?,
                to: nodes(to)?,
            },
            Self::Count { count } => Detail::Count(*count),
            Self::Values { from, to } => Detail::Values {
                from: (&**from).into(),
                to: (&**to).into(),
            },
        })
    }
}

/// The events of a log, in order.
pub(crate) fn events<'a>(
    log: &'a EventLog,
    elements: &'a Elements,
) -> impl Iterator<Item = EventJson<'a>> + Clone {
    let parts = log.all_parts();
    log.events.with_ids().map(move |(id, event)| EventJson {
        id,
        kind: event.kind.word().into(),
        named: ElementName::new(event.what, elements),
        role: role(event.what, elements).map(Text::from),
        time_ns: event.time.0,
        earliest_ns: Some(event.earliest.0),
        latest_ns: Some(event.latest.0),
        until_ns: event.until.map(|t| t.0),
        detail: DetailJson::new(&event.detail, elements),
        degree: Some(event.confidence.word().into()),
        evidence: words(event.evidence),
        parts: parts.get(&id).cloned().unwrap_or_default(),
        cause: event.part_of,
        quiet: event.quiet,
        weight: Some(event.weight),
    })
}

/// Every event of a log as an object on one line.
pub(crate) fn rows<'a>(
    log: &'a EventLog,
    elements: &'a Elements,
) -> impl Iterator<Item = String> + 'a {
    // Only maps with non-string keys fail, and there are none.
    events(log, elements).map(|row| serde_json::to_string(&row).unwrap_or_default())
}

/// A text in quotes.
pub(crate) fn text(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default()
}

/// The role of the node that an event is about.
fn role(what: Element, elements: &Elements) -> Option<&str> {
    let (node, _) = elements.ends(what);
    node.map(|id| &*elements.nodes[id].role)
}

/// The log of rows that were read; `None` if one of them is about an element that is not in any window.
pub(crate) fn read(rows: &[EventJson<'_>], elements: &Elements) -> Option<ById<EventId, Event>> {
    let events = rows.iter().map(|row| row.event(elements));
    let mut list = events.collect::<Option<ById<_, _>>>()?;
    for (id, row) in list.ids().zip(rows) {
        for part in &row.parts {
            list.get_mut(*part)?.part_of = Some(id);
        }
    }
    Some(sorted(list, elements).0)
}

impl EventJson<'_> {
    fn event(&self, elements: &Elements) -> Option<Event> {
        Some(Event {
            kind: Kind::from_word(&self.kind)?,
            what: self.named.element(elements)?,
            time: Stamp(self.time_ns),
            earliest: Stamp(self.earliest_ns.unwrap_or(self.time_ns)),
            latest: Stamp(self.latest_ns.unwrap_or(self.time_ns)),
            until: self.until_ns.map(Stamp),
            detail: self.detail.detail(elements)?,
            confidence: confidence_of(self.degree.as_deref()),
            evidence: evidence(&self.evidence),
            part_of: None,
            quiet: self.quiet,
            weight: self.weight.unwrap_or(1),
        })
    }
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
        Some(Interruption {
            time: Stamp(row.time_ns),
            kind: InterruptionKind::from_word(&row.kind)?,
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
