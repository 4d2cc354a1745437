//! Writes a mission as JSON, schema `bagreel.mission/3`, element by element without a second copy in memory.

use std::collections::BTreeMap;
use std::io::{BufWriter, Write};

use serde::ser::{SerializeMap as _, SerializeSeq as _, Serializer};
use serde::{Deserialize, Serialize};

use super::columns::JsonColumns;
use super::elements::{EdgeJson, ElementJson, NodeJson, TopicJson};
use super::events::{ChangeRow, InterruptionRow, PhaseRow, events};
use super::formatter::LineFormatter;
use super::{SCHEMA, Text};
use crate::bag::Report;
use crate::graph::history::Sender;
use crate::graph::{Element, NodeId, TopicId};
use crate::mission::{Mission, Places, Window};

/// Writes the whole mission as JSON, ending in a new line. Lists are sorted by name, times are nanoseconds since 1970,
/// unknown values are `null`.
///
/// # Errors
/// The errors of `out`.
pub fn write_json(mission: &Mission, out: &mut dyn Write) -> std::io::Result<()> {
    let json = Json {
        mission,
        places: mission.layout.as_ref(),
    };
    json.write(out)
}

/// A mission in the form for writing.
pub(crate) struct Json<'a> {
    /// The mission.
    pub mission: &'a Mission,
    /// The positions of the drawing, if one was made.
    pub places: Option<&'a Places>,
}

impl Json<'_> {
    /// Writes the mission, as [`write_json`] does.
    ///
    /// # Errors
    /// The errors of `out`.
    pub(crate) fn write(&self, out: &mut dyn Write) -> std::io::Result<()> {
        // Buffered here, because the serializer writes a few bytes at a time.
        let mut out = BufWriter::with_capacity(1 << 16, out);
        let mut serializer =
            serde_json::Serializer::with_formatter(&mut out, LineFormatter::default());
        self.serialize(&mut serializer)?;
        out.write_all(b"\n")?;
        out.flush()
    }
}

impl Serialize for Json<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { mission, places } = *self;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("schema", SCHEMA)?;
        map.serialize_entry("bags", &List(mission.bags.iter().map(BagJson::new)))?;
        map.serialize_entry("start_ns", &mission.span.start)?;
        map.serialize_entry("end_ns", &mission.span.end)?;
        map.serialize_entry("messages", &mission.messages)?;
        map.serialize_entry("period_ns", &mission.period.nanos())?;
        map.serialize_entry("step_ns", &mission.step.nanos())?;
        map.serialize_entry("events", &List(events(&mission.log, &mission.elements)))?;
        if !mission.log.interruptions.is_empty() {
            let all = mission.log.interruptions.iter();
            map.serialize_entry("interruptions", &List(all.map(InterruptionRow::from)))?;
        }
        map.serialize_entry(
            "phases",
            &List(mission.log.phases.iter().map(PhaseRow::from)),
        )?;
        map.serialize_entry("elements", &List(elements(mission)))?;
        let window = |window| WindowOf { window, mission };
        map.serialize_entry("windows", &List(mission.windows.iter().map(window)))?;
        if let Some(places) = places {
            map.serialize_entry("layout", places)?;
        }
        let notices = mission.notices.iter().map(|notice| NoticeJson {
            kind: notice.kind.word().into(),
            count: Some(notice.count),
            text: notice.text,
        });
        map.serialize_entry("notices", &List(notices))?;
        map.end()
    }
}

/// A list serialised from an iterator.
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

#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct BagJson<'a> {
    pub(crate) name: Text<'a>,
    pub(crate) format: Text<'a>,
    pub(crate) compression: Vec<Text<'a>>,
    pub(crate) tier: Text<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tier_reason: Option<Text<'a>>,
    pub(crate) complete: Option<bool>,
    pub(crate) file_bytes: u64,
}

impl<'a> BagJson<'a> {
    fn new(bag: &'a Report) -> Self {
        Self {
            name: (&*bag.name).into(),
            format: (&*bag.format).into(),
            compression: bag.compression.iter().map(Text::from).collect(),
            tier: bag.tier.word().into(),
            tier_reason: bag.tier_reason.as_deref().map(Text::from),
            complete: Some(bag.complete),
            file_bytes: bag.file_bytes,
        }
    }
}

#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct NoticeJson<'a> {
    pub(crate) kind: Text<'a>,
    pub(crate) count: Option<u64>,
    pub(crate) text: String,
}

/// A window with its changes.
struct WindowOf<'a> {
    window: &'a Window,
    mission: &'a Mission,
}

impl Serialize for WindowOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let window = self.window;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("index", &window.index)?;
        map.serialize_entry("start_ns", &window.span.start)?;
        map.serialize_entry("end_ns", &window.span.end)?;
        map.serialize_entry("length_ns", &window.span.nanos())?;
        map.serialize_entry("partial", &window.partial)?;
        map.serialize_entry("messages", &window.messages)?;
        let elements = &self.mission.elements;
        let changes = window.changes.iter().zip(&window.events);
        let changes = changes.map(|(change, event)| ChangeRow::new(change, *event, elements));
        map.serialize_entry("changes", &List(changes))?;
        map.end()
    }
}

/// All elements over the whole mission, with their windows as columns.
fn elements(mission: &Mission) -> impl Iterator<Item = ElementJson<'_>> + Clone {
    let all = &mission.elements;
    let senders = mission.sending.senders.iter();
    // `None` means all unknown senders of a topic.
    let senders: BTreeMap<(TopicId, Option<NodeId>), &Sender> =
        senders.map(|one| ((one.topic, one.node), one)).collect();
    all.all().map(move |what| {
        let sender = |topic, node| senders.get(&(topic, node)).copied();
        let columns = JsonColumns::of(&mission.graphs, what);
        match what {
            Element::Node(id) => ElementJson::Node(NodeJson::new(&all.nodes[id], columns)),
            Element::Topic(id) => {
                let pauses = mission.sending.pauses.of(id).to_vec();
                let topic = &all.topics[id];
                ElementJson::Topic(TopicJson::new(topic, sender(id, None), pauses, columns))
            }
            Element::Publish(id) => {
                let edge = &all.publishes[id];
                let sender = sender(edge.topic, Some(edge.node));
                ElementJson::Publish(EdgeJson::new(edge, all, sender, columns))
            }
            Element::Subscribe(id) => {
                let edge = &all.subscribes[id];
                ElementJson::Subscribe(EdgeJson::new(edge, all, None, columns))
            }
        }
    })
}
