//! The log's events in JSON, written and read back, and the changes from window to window that they explain.

use serde::{Deserialize, Serialize};

use super::{Text, text};
use crate::base::time::{Span, Stamp};
use crate::evidence::{Confidence, Evidence};
use crate::graph::{ById, Element, Elements, NodeId};
use crate::mission::Change;
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
    time_ns: Stamp,
    earliest_ns: Option<Stamp>,
    latest_ns: Option<Stamp>,
    #[serde(skip_serializing_if = "Option::is_none")]
    until_ns: Option<Stamp>,
    #[serde(flatten)]
    detail: Option<DetailJson<'a>>,
    degree: Option<Text<'a>>,
    #[serde(default)]
    evidence: Evidence,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    parts: Vec<EventId>,
    /// The event that this one follows from: the one that lists it among its parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    cause: Option<EventId>,
    #[serde(default)]
    quiet: bool,
    weight: Option<u32>,
}

/// The values of an event with the names of nodes; `None` if there are none.
type DetailJson<'a> = Detail<Text<'a>, Text<'a>>;

fn detail_json<'a>(detail: &'a Detail, elements: &'a Elements) -> Option<DetailJson<'a>> {
    let name = |id: &NodeId| Some(elements.nodes[*id].name.as_str().into());
    let detail = detail.mapped(name, |text| Text::from(&**text));
    detail.filter(|detail| *detail != Detail::None)
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
        role: elements
            .ends(event.what)
            .0
            .map(|id| (&*elements.nodes[id].role).into()),
        time_ns: event.time,
        earliest_ns: Some(event.earliest),
        latest_ns: Some(event.latest),
        until_ns: event.until,
        detail: detail_json(&event.detail, elements),
        degree: Some(event.confidence.word().into()),
        evidence: event.evidence,
        parts: parts.get(&id).cloned().unwrap_or_default(),
        cause: event.part_of,
        quiet: event.quiet,
        weight: Some(event.weight),
    })
}

/// Every event of a log as an object on one line.
pub(crate) fn event_rows<'a>(
    log: &'a EventLog,
    elements: &'a Elements,
) -> impl Iterator<Item = String> + 'a {
    events(log, elements).map(|row| text(&row))
}

/// The log of rows that were read; `None` if one of them is about an element that is not in any window.
pub(crate) fn events_of(
    rows: &[EventJson<'_>],
    elements: &Elements,
) -> Option<ById<EventId, Event>> {
    let events = rows.iter().map(|row| row.event(elements));
    let mut list = events.collect::<Option<ById<_, _>>>()?;
    for (id, row) in list.ids().zip(rows) {
        for part in &row.parts {
            list.get_mut(*part)?.part_of = Some(id);
        }
    }
    Some(sorted(list, elements))
}

impl EventJson<'_> {
    fn event(&self, elements: &Elements) -> Option<Event> {
        Some(Event {
            kind: Kind::from_word(&self.kind)?,
            what: self.named.element(elements)?,
            time: self.time_ns,
            earliest: self.earliest_ns.unwrap_or(self.time_ns),
            latest: self.latest_ns.unwrap_or(self.time_ns),
            until: self.until_ns,
            detail: match &self.detail {
                Some(detail) => {
                    detail.mapped(|name| elements.node(name), |text| (&**text).into())?
                }
                None => Detail::None,
            },
            confidence: (self.degree.as_deref())
                .and_then(Confidence::from_word)
                .unwrap_or(Confidence::Stated),
            evidence: self.evidence,
            part_of: None,
            quiet: self.quiet,
            weight: self.weight.unwrap_or(1),
        })
    }
}

/// A phase in the form for writing and reading.
#[derive(Deserialize, Serialize)]
pub(crate) struct PhaseRow<'a> {
    start_ns: Stamp,
    end_ns: Stamp,
    #[serde(default)]
    name: Text<'a>,
    #[serde(default)]
    nodes_added: u32,
    #[serde(default)]
    nodes_removed: u32,
    #[serde(default)]
    ramp: bool,
    #[serde(rename = "as")]
    same_as: Option<u32>,
}

impl<'a> From<&'a Phase> for PhaseRow<'a> {
    fn from(phase: &'a Phase) -> Self {
        Self {
            start_ns: phase.span.start,
            end_ns: phase.span.end,
            name: (&*phase.name).into(),
            nodes_added: phase.nodes_added,
            nodes_removed: phase.nodes_removed,
            ramp: phase.is_ramp,
            same_as: phase.same_as,
        }
    }
}

/// The phases of rows that were read; a reference to a later phase as the same one is dropped.
pub(crate) fn phases(rows: Vec<PhaseRow<'_>>) -> Vec<Phase> {
    let phase = |(at, row): (u32, PhaseRow<'_>)| Phase {
        span: Span::from([row.start_ns, row.end_ns]),
        name: row.name.into(),
        nodes_added: row.nodes_added,
        nodes_removed: row.nodes_removed,
        is_ramp: row.ramp,
        same_as: row.same_as.filter(|earlier| *earlier < at),
    };
    (0..).zip(rows).map(phase).collect()
}

/// An interruption of the recording in the form for writing and reading.
#[derive(Deserialize, Serialize)]
pub(crate) struct InterruptionRow<'a> {
    time_ns: Stamp,
    kind: Text<'a>,
    length_ns: i64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    percent: Option<u32>,
}

/// The speed, in percent, of everything but a simulation.
const USUAL: u32 = 100;

impl From<&Interruption> for InterruptionRow<'_> {
    fn from(one: &Interruption) -> Self {
        Self {
            time_ns: one.time,
            kind: one.kind.word().into(),
            length_ns: one.length,
            percent: Some(one.percent).filter(|percent| *percent != USUAL),
        }
    }
}

/// The interruptions of rows that were read, without those of unknown kinds.
pub(crate) fn interruptions(rows: &[InterruptionRow<'_>]) -> Vec<Interruption> {
    let one = |row: &InterruptionRow<'_>| {
        Some(Interruption {
            time: row.time_ns,
            kind: InterruptionKind::from_word(&row.kind)?,
            length: row.length_ns.max(0),
            percent: row.percent.unwrap_or(USUAL),
        })
    };
    let mut all: Vec<Interruption> = rows.iter().filter_map(one).collect();
    all.sort_unstable();
    all
}

// The changes from window to window, which are written only.

#[derive(Serialize)]
pub(crate) struct ChangeRow<'a> {
    kind: &'static str,
    event: EventId,
    #[serde(flatten)]
    named: ElementName<'a>,
    #[serde(flatten)]
    values: ChangeValues<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum ChangeValues<'a> {
    /// The time at which the element appeared, vanished or restarted, if known.
    Time {
        time_ns: Option<Stamp>,
    },
    Detail(DetailJson<'a>),
}

impl<'a> ChangeRow<'a> {
    pub(crate) fn new(change: &'a Change, event: EventId, elements: &'a Elements) -> Self {
        let time_ns = change.time;
        let detail = detail_json(&change.detail, elements);
        Self {
            kind: change.word(),
            event,
            named: ElementName::new(change.what, elements),
            values: detail.map_or(ChangeValues::Time { time_ns }, ChangeValues::Detail),
        }
    }
}
