//! Writes a mission as JSON, schema `bagreel.mission/3`, window by window without a second copy in memory.

use std::cell::RefCell;
use std::io::{BufWriter, Write};

use serde::Serialize;
use serde::ser::{SerializeMap, SerializeSeq as _, Serializer};

use super::changes::ChangeRow;
use super::elements::{ElementJson, Text, pairs};
use super::events::{InterruptionRow, PhaseRow, events};
use super::lines::LineFormatter;
use super::raw::{BagJson, NodeJson, NoticeJson, PublishJson, SubscribeJson, TopicJson};
use super::runs::JsonColumns;
use super::sending::{SendingJson, senders};
use crate::bag::Report;
use crate::graph::{Element, Elements, GraphsIter};
use crate::mission::{Mission, Places, Window};

/// The schema that is written and read.
pub(crate) const SCHEMA: &str = "bagreel.mission/3";
/// Earlier schemas, which are still read: without events, and without a list of elements.
pub(crate) const OLD_SCHEMAS: [&str; 2] = ["bagreel.evolution/1", "bagreel.evolution/2"];

/// Writes the whole mission as JSON, ending in a new line. Lists are sorted by name, times are nanoseconds since 1970,
/// unknown values are `null`.
///
/// # Errors
/// The errors of `out`.
pub fn write_json(mission: &Mission, out: &mut dyn Write) -> std::io::Result<()> {
    let json = Json {
        mission,
        places: mission.layout.as_ref(),
        form: JsonForm::Auto,
    };
    json.write(out)
}

/// The form of a mission's windows in JSON.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JsonForm {
    /// Chosen by the number of windows: as windows up to 2000, as runs beyond.
    #[default]
    Auto,
    /// Each window with all elements in it.
    Windows,
    /// Each element once, with its states and their windows.
    Runs,
}

/// The most windows in the form of windows, which tools read one by one; with more the file would be larger than the
/// bag.
const MOST_WINDOWS: usize = 2000;
/// The word of the form of runs.
pub(crate) const RUNS: &str = "runs";

/// A mission in the form for writing.
pub(crate) struct Json<'a> {
    /// The mission.
    pub mission: &'a Mission,
    /// The positions of the drawing, if one was made.
    pub places: Option<&'a Places>,
    /// The form of its windows.
    pub form: JsonForm,
}

impl Json<'_> {
    fn is_runs(&self) -> bool {
        match self.form {
            JsonForm::Auto => self.mission.windows.len() > MOST_WINDOWS,
            JsonForm::Windows => false,
            JsonForm::Runs => true,
        }
    }

    /// Writes the mission, as [`write_json`] does.
    ///
    /// # Errors
    /// The errors of `out`.
    pub(crate) fn write(&self, out: &mut dyn Write) -> std::io::Result<()> {
        let lines = LineFormatter::down_to(if self.is_runs() { 3 } else { 4 });
        // Buffered here, because the serializer writes a few bytes at a time.
        let mut out = BufWriter::with_capacity(1 << 16, out);
        let mut serializer = serde_json::Serializer::with_formatter(&mut out, lines);
        self.serialize(&mut serializer)?;
        out.write_all(b"\n")?;
        out.flush()
    }
}

impl Serialize for Json<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self {
            mission, places, ..
        } = *self;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("schema", SCHEMA)?;
        if self.is_runs() {
            map.serialize_entry("form", RUNS)?;
        }
        map.serialize_entry("bags", &List(mission.bags.iter().map(BagJson::new)))?;
        map.serialize_entry("start_ns", &mission.span.start.0)?;
        map.serialize_entry("end_ns", &mission.span.end.0)?;
        map.serialize_entry("messages", &mission.messages)?;
        map.serialize_entry("period_ns", &mission.period.nanos())?;
        map.serialize_entry("step_ns", &mission.step.nanos())?;
        // Also under the old key, for one release.
        let rows = List(events(&mission.log, &mission.elements));
        map.serialize_entry("events", &rows)?;
        map.serialize_entry("ledger", &rows)?;
        if !mission.log.interruptions.is_empty() {
            let all = mission.log.interruptions.iter();
            map.serialize_entry("interruptions", &List(all.map(InterruptionRow::from)))?;
        }
        let phases = mission.log.phases.iter().map(PhaseRow::from);
        map.serialize_entry("phases", &List(phases))?;
        let elements = elements(mission, self.is_runs());
        map.serialize_entry("elements", &List(elements))?;
        map.serialize_entry("windows", &Windows(self))?;
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

/// All windows.
struct Windows<'a>(&'a Json<'a>);

impl Serialize for Windows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mission = self.0.mission;
        let mut seq = serializer.serialize_seq(None)?;
        // Not a `List`, which would need a second iterator over the graphs: each has a cursor for every element.
        let graphs = (!self.0.is_runs()).then(|| RefCell::new(mission.graphs.iter()));
        for window in &mission.windows {
            seq.serialize_element(&WindowOf {
                window,
                graphs: graphs.as_ref(),
                elements: &mission.elements,
            })?;
        }
        seq.end()
    }
}

/// A window, with its elements unless they are in columns.
struct WindowOf<'a> {
    window: &'a Window,
    /// The graphs, of which the next one is that of this window.
    graphs: Option<&'a RefCell<GraphsIter<'a>>>,
    elements: &'a Elements,
}

impl Serialize for WindowOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (window, elements) = (self.window, self.elements);
        let mut map = serializer.serialize_map(None)?;
        head(window, &mut map)?;
        if let Some(graphs) = self.graphs {
            let keys = ["nodes", "topics", "publishes", "subscribes"];
            for (kind, key) in keys.into_iter().enumerate() {
                let states = States {
                    graphs,
                    kind,
                    elements,
                };
                map.serialize_entry(key, &states)?;
            }
            graphs.borrow_mut().pass();
        }
        let changes = window.changes.iter().zip(&window.events);
        let changes = changes.map(|(change, event)| ChangeRow::new(change, *event, elements));
        map.serialize_entry("changes", &List(changes))?;
        map.end()
    }
}

/// The elements of one kind in a window. They are written one by one, since a graph of very many takes more memory than
/// the mission.
struct States<'a> {
    graphs: &'a RefCell<GraphsIter<'a>>,
    kind: usize,
    elements: &'a Elements,
}

impl Serialize for States<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let all = self.elements;
        let mut seq = serializer.serialize_seq(None)?;
        for state in self.graphs.borrow_mut().of_kind(self.kind) {
            let seen = Some(&state);
            match state.what {
                Element::Node(id) => seq.serialize_element(&NodeJson::new(&all.nodes[id], seen)),
                Element::Topic(id) => seq.serialize_element(&TopicJson::new(&all.topics[id], seen)),
                Element::Publish(id) => {
                    seq.serialize_element(&PublishJson::new(&all.publishes[id], all, seen))
                }
                Element::Subscribe(id) => {
                    let edge = PublishJson::new(&all.subscribes[id], all, seen);
                    seq.serialize_element(&SubscribeJson::from(edge))
                }
            }?;
        }
        seq.end()
    }
}

/// All elements over the whole mission, with their windows as columns if these are wanted.
fn elements(mission: &Mission, is_runs: bool) -> impl Iterator<Item = ElementJson<'_>> + Clone {
    let (all, senders) = (&mission.elements, senders(&mission.sending));
    let columns = move |what| is_runs.then(|| Box::new(JsonColumns::of(&mission.graphs, what)));
    let sent = move |topic, node| senders.get(&(topic, node)).copied().into();
    let edge = move |what, edge, sending| {
        let mut json = PublishJson::new(edge, all, None);
        json.edge.columns = columns(what);
        json.edge.sending = sending;
        json
    };
    let nodes = all.nodes.with_ids().map(move |(id, node)| {
        ElementJson::Node(NodeJson {
            columns: columns(Element::Node(id)),
            ..NodeJson::new(node, None)
        })
    });
    let unnamed = sent.clone();
    let topics = all.topics.with_ids().map(move |(id, topic)| {
        let pauses = mission.sending.pauses.get(id);
        ElementJson::Topic(TopicJson {
            columns: columns(Element::Topic(id)),
            sending: unnamed(id, None),
            pauses: pauses.map_or_else(Vec::new, |spans| pairs(spans)),
            ..TopicJson::new(topic, None)
        })
    });
    let publishes = all.publishes.with_ids().map(move |(id, one)| {
        let sending = sent(one.topic, Some(one.node));
        ElementJson::Publish(edge(Element::Publish(id), one, sending))
    });
    let subscribes = all.subscribes.with_ids().map(move |(id, one)| {
        ElementJson::Subscribe(edge(Element::Subscribe(id), one, SendingJson::default()))
    });
    nodes.chain(topics).chain(publishes).chain(subscribes)
}

fn head<M: SerializeMap>(window: &Window, map: &mut M) -> Result<(), M::Error> {
    map.serialize_entry("index", &window.index)?;
    map.serialize_entry("start_ns", &window.span.start.0)?;
    map.serialize_entry("end_ns", &window.span.end.0)?;
    map.serialize_entry("length_ns", &window.span.nanos())?;
    map.serialize_entry("partial", &window.partial)?;
    map.serialize_entry("messages", &window.messages)
}
