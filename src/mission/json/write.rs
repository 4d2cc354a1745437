//! Writes an evolution as JSON, schema `bagreel.evolution/2`, window by window without a second copy in memory.

use std::io::Write;

use serde::Serialize;
use serde::ser::{SerializeMap as _, SerializeSeq as _, Serializer};

use super::entries::{PhaseRow, entries};
use super::lines::Lines;
use crate::bag::Report;
use crate::base::time::{Span, Stamp};
use crate::evidence::Evidence;
use crate::graph::diff::Change;
use crate::graph::{Edge, EdgeState, Element, Elements, NodeState, TopicState};
use crate::mission::{EntryId, Mission, Place, Places, Window};

/// The schema that is written, and read.
pub(crate) const SCHEMA: &str = "bagreel.evolution/2";
/// The schema without a ledger, which is still read.
pub(crate) const OLD_SCHEMA: &str = "bagreel.evolution/1";

/// Writes the whole mission as JSON, ending in a new line. Lists are sorted by name, times are nanoseconds since 1970,
/// what is not known is `null`.
///
/// # Errors
/// Whatever `out` refuses.
pub fn write_json(mission: &Mission, out: &mut dyn Write) -> std::io::Result<()> {
    let places = mission.layout.as_ref();
    Json { mission, places }.write(out)
}

/// A mission as it is written.
pub struct Json<'a> {
    /// The data.
    pub mission: &'a Mission,
    /// Where everything was drawn, if it was.
    pub places: Option<&'a Places>,
}

impl Json<'_> {
    /// Writes it, as [`write_json`] does.
    ///
    /// # Errors
    /// Whatever `out` refuses.
    pub fn write(&self, out: &mut dyn Write) -> std::io::Result<()> {
        let mut serializer = serde_json::Serializer::with_formatter(&mut *out, Lines::default());
        self.serialize(&mut serializer)?;
        out.write_all(b"\n")
    }
}

impl Serialize for Json<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { mission, places } = *self;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("schema", SCHEMA)?;
        map.serialize_entry("bags", &List(mission.bags.iter().map(BagRow::new)))?;
        map.serialize_entry("start_ns", &mission.span.start.0)?;
        map.serialize_entry("end_ns", &mission.span.end.0)?;
        map.serialize_entry("messages", &mission.messages)?;
        map.serialize_entry("period_ns", &mission.period.nanos())?;
        map.serialize_entry("step_ns", &mission.step.nanos())?;
        let windows = mission.windows.iter().map(|window| WindowOf {
            window,
            elements: &mission.elements,
        });
        map.serialize_entry("ledger", &List(entries(&mission.ledger, &mission.elements)))?;
        let phases = mission.ledger.phases.iter().map(PhaseRow::from);
        map.serialize_entry("phases", &List(phases))?;
        map.serialize_entry("windows", &List(windows))?;
        if let Some(places) = places {
            map.serialize_entry("layout", &LayoutRow::new(places))?;
        }
        map.serialize_entry(
            "notices",
            &List(mission.notices.iter().map(|n| NoticeRow {
                kind: n.kind.word(),
                count: n.count,
                text: n.text,
            })),
        )?;
        map.end()
    }
}

/// A list made while it is written.
pub(crate) struct List<I>(pub(crate) I);

impl<I: Iterator<Item: Serialize> + Clone> Serialize for List<I> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut seq = serializer.serialize_seq(None)?;
        for item in self.0.clone() {
            seq.serialize_element(&item)?;
        }
        seq.end()
    }
}

#[derive(Serialize)]
struct BagRow<'a> {
    name: &'a str,
    format: &'a str,
    compression: &'a [String],
    tier: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    tier_reason: Option<&'a str>,
    complete: bool,
}

impl<'a> BagRow<'a> {
    fn new(bag: &'a Report) -> Self {
        Self {
            name: &bag.name,
            format: &bag.format,
            compression: &bag.compression,
            tier: bag.tier.word(),
            tier_reason: bag.tier_reason.as_deref(),
            complete: bag.complete,
        }
    }
}

#[derive(Serialize)]
struct NoticeRow {
    kind: &'static str,
    count: u64,
    text: String,
}

#[derive(Serialize)]
struct LayoutRow<'a> {
    width: f64,
    height: f64,
    orientation: &'a str,
    boxes: Vec<BoxRow<'a>>,
}

#[derive(Serialize)]
struct BoxRow<'a> {
    what: &'a str,
    name: &'a str,
    x: f64,
    y: f64,
    w: f64,
    h: f64,
}

impl<'a> LayoutRow<'a> {
    fn new(places: &'a Places) -> Self {
        let row = |Place { what, name, rect }: &'a Place| BoxRow {
            what,
            name,
            x: rect.x,
            y: rect.y,
            w: rect.w,
            h: rect.h,
        };
        Self {
            width: places.width,
            height: places.height,
            orientation: &places.orientation,
            boxes: places.boxes.iter().map(row).collect(),
        }
    }
}

struct WindowOf<'a> {
    window: &'a Window,
    elements: &'a Elements,
}

impl Serialize for WindowOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (window, elements) = (self.window, self.elements);
        let graph = &window.graph;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("index", &window.index)?;
        map.serialize_entry("start_ns", &window.span.start.0)?;
        map.serialize_entry("end_ns", &window.span.end.0)?;
        map.serialize_entry("length_ns", &window.span.nanos())?;
        map.serialize_entry("partial", &window.partial)?;
        map.serialize_entry("messages", &window.messages)?;
        map.serialize_entry(
            "nodes",
            &List(graph.nodes.iter().map(|s| NodeRow::new(s, elements))),
        )?;
        map.serialize_entry(
            "topics",
            &List(graph.topics.iter().map(|s| TopicRow::new(s, elements))),
        )?;
        map.serialize_entry(
            "publishes",
            &List(graph.publishes.iter().map(|s| PublishRow::new(s, elements))),
        )?;
        map.serialize_entry(
            "subscribes",
            &List(
                graph
                    .subscribes
                    .iter()
                    .map(|s| SubscribeRow::new(s, elements)),
            ),
        )?;
        map.serialize_entry(
            "changes",
            &List(
                window
                    .changes
                    .iter()
                    .zip(&window.entries)
                    .map(|(c, entry)| ChangeRow::new(c, *entry, elements)),
            ),
        )?;
        map.end()
    }
}

/// When an element is there, as pairs of nanoseconds.
struct Runs<'a>(&'a [Span]);

impl Serialize for Runs<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|run| [run.start.0, run.end.0]))
    }
}

pub(crate) fn words(evidence: Evidence) -> Vec<&'static str> {
    evidence.words().collect()
}

fn nanos(stamp: Option<Stamp>) -> Option<i64> {
    stamp.map(|s| s.0)
}

#[derive(Serialize)]
struct NodeRow<'a> {
    name: &'a str,
    role: &'a str,
    state: &'a str,
    degree: &'a str,
    evidence: Vec<&'static str>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: Runs<'a>,
    hz: Option<f64>,
    lifecycle: Option<&'a str>,
}

impl<'a> NodeRow<'a> {
    fn new(state: &'a NodeState, elements: &'a Elements) -> Self {
        let node = &elements.nodes[state.id as usize];
        Self {
            name: node.name.as_str(),
            role: &node.role,
            state: state.state.word(),
            degree: state.degree.word(),
            evidence: words(node.evidence),
            first_ns: nanos(node.first),
            last_ns: nanos(node.last),
            runs: Runs(&node.runs),
            hz: state.hz,
            lifecycle: state.lifecycle.as_deref(),
        }
    }
}

#[derive(Serialize)]
struct TopicRow<'a> {
    name: &'a str,
    types: Vec<&'a str>,
    state: &'a str,
    degree: &'a str,
    evidence: Vec<&'static str>,
    count: u64,
    bytes: Option<u64>,
    hz: Option<f64>,
    median_period_s: Option<f64>,
    max_gap_s: Option<f64>,
    qos: Option<&'a str>,
    unknown_publishers: Option<u32>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: Runs<'a>,
}

impl<'a> TopicRow<'a> {
    fn new(state: &'a TopicState, elements: &'a Elements) -> Self {
        let topic = &elements.topics[state.id as usize];
        Self {
            name: topic.name.as_str(),
            types: topic.types.iter().map(AsRef::as_ref).collect(),
            state: state.state.word(),
            degree: state.degree.word(),
            evidence: words(topic.evidence),
            count: state.count,
            bytes: state.bytes,
            hz: state.hz,
            median_period_s: state.median_period_s,
            max_gap_s: state.max_gap_s,
            qos: topic.qos.as_deref(),
            unknown_publishers: topic.unknown_publishers,
            first_ns: nanos(topic.first),
            last_ns: nanos(topic.last),
            runs: Runs(&topic.runs),
        }
    }
}

#[derive(Serialize)]
struct PublishRow<'a> {
    node: &'a str,
    topic: &'a str,
    #[serde(flatten)]
    rest: EdgeRow<'a>,
}

#[derive(Serialize)]
struct SubscribeRow<'a> {
    topic: &'a str,
    node: &'a str,
    #[serde(flatten)]
    rest: EdgeRow<'a>,
}

#[derive(Serialize)]
struct EdgeRow<'a> {
    state: &'a str,
    degree: &'a str,
    evidence: Vec<&'static str>,
    count: Option<u64>,
    hz: Option<f64>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    runs: Runs<'a>,
}

impl<'a> EdgeRow<'a> {
    fn new(state: &'a EdgeState, edge: &'a Edge) -> Self {
        Self {
            state: state.state.word(),
            degree: state.degree.word(),
            evidence: words(edge.evidence),
            count: state.count,
            hz: state.hz,
            first_ns: nanos(edge.first),
            last_ns: nanos(edge.last),
            runs: Runs(&edge.runs),
        }
    }
}

fn ends<'a>(edge: &Edge, elements: &'a Elements) -> (&'a str, &'a str) {
    let node = elements.nodes[edge.node as usize].name.as_str();
    (node, elements.topics[edge.topic as usize].name.as_str())
}

impl<'a> PublishRow<'a> {
    fn new(state: &'a EdgeState, elements: &'a Elements) -> Self {
        let edge = &elements.publishes[state.id as usize];
        let (node, topic) = ends(edge, elements);
        Self {
            node,
            topic,
            rest: EdgeRow::new(state, edge),
        }
    }
}

impl<'a> SubscribeRow<'a> {
    fn new(state: &'a EdgeState, elements: &'a Elements) -> Self {
        let edge = &elements.subscribes[state.id as usize];
        let (node, topic) = ends(edge, elements);
        Self {
            topic,
            node,
            rest: EdgeRow::new(state, edge),
        }
    }
}

/// An element by its name, or an edge by its two.
#[derive(Serialize)]
pub(crate) struct Named<'a> {
    what: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    topic: Option<&'a str>,
}

impl<'a> Named<'a> {
    pub(crate) fn new(what: Element, elements: &'a Elements) -> Self {
        let alone = |name: &'a str| Self {
            what: what.word(),
            name: Some(name),
            node: None,
            topic: None,
        };
        let between = |edge: &Edge| {
            let (node, topic) = ends(edge, elements);
            Self {
                what: what.word(),
                name: None,
                node: Some(node),
                topic: Some(topic),
            }
        };
        match what {
            Element::Node(id) => alone(elements.nodes[id as usize].name.as_str()),
            Element::Topic(id) => alone(elements.topics[id as usize].name.as_str()),
            Element::Publish(id) => between(&elements.publishes[id as usize]),
            Element::Subscribe(id) => between(&elements.subscribes[id as usize]),
        }
    }
}

#[derive(Serialize)]
struct ChangeRow<'a> {
    kind: &'static str,
    entry: EntryId,
    #[serde(flatten)]
    named: Named<'a>,
    #[serde(flatten)]
    rest: ChangeValues<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum ChangeValues<'a> {
    Time {
        time_ns: Option<i64>,
    },
    Rate {
        from_hz: f64,
        to_hz: f64,
    },
    Hands {
        from: Vec<&'a str>,
        to: Vec<&'a str>,
    },
    Value {
        from: String,
        to: String,
    },
}

impl<'a> ChangeRow<'a> {
    fn new(change: &Change, entry: EntryId, elements: &'a Elements) -> Self {
        let names = |nodes: &[u32]| {
            nodes
                .iter()
                .map(|n| elements.nodes[*n as usize].name.as_str())
                .collect()
        };
        let time = |time: Option<Stamp>| ChangeValues::Time {
            time_ns: nanos(time),
        };
        let (what, rest) = match change {
            Change::Added { what, time: at } | Change::Removed { what, time: at } => {
                (*what, time(*at))
            }
            Change::Restarted { node, time: at } => (Element::Node(*node), time(Some(*at))),
            Change::Rate {
                what,
                from_hz,
                to_hz,
            } => (
                *what,
                ChangeValues::Rate {
                    from_hz: *from_hz,
                    to_hz: *to_hz,
                },
            ),
            Change::HandedOver { topic, from, to } => (
                Element::Topic(*topic),
                ChangeValues::Hands {
                    from: names(from),
                    to: names(to),
                },
            ),
            Change::Value { what, from, to, .. } => (
                *what,
                ChangeValues::Value {
                    from: from.to_string(),
                    to: to.to_string(),
                },
            ),
        };
        Self {
            kind: change.word(),
            entry,
            named: Named::new(what, elements),
            rest,
        }
    }
}
