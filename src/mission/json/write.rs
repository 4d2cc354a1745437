//! Writes an evolution as JSON, schema `bagreel.evolution/2`, window by window without a second copy in memory.

use std::io::{BufWriter, Write};

use serde::Serialize;
use serde::ser::{SerializeMap, SerializeSeq as _, Serializer};

use super::changes::ChangeRow;
use super::entries::{InterruptionRow, PhaseRow, entries};
use super::lines::LineFormatter;
use super::rows::{NodeRow, PublishRow, SubscribeRow, TopicRow};
use super::runs;
use super::sending::SendingOf;
use crate::bag::Report;
use crate::evidence::Evidence;
use crate::graph::{Elements, Graph};
use crate::mission::{Mission, Place, Places, Window};

/// The schema that is written and read.
pub(crate) const SCHEMA: &str = "bagreel.evolution/2";
/// The schema without a ledger, which is still read.
pub(crate) const OLD_SCHEMA: &str = "bagreel.evolution/1";

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
    /// The places of the drawing, if one was made.
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
        // Its own buffer: the serializer writes a few bytes at a time.
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
        map.serialize_entry("bags", &List(mission.bags.iter().map(BagRow::new)))?;
        map.serialize_entry("start_ns", &mission.span.start.0)?;
        map.serialize_entry("end_ns", &mission.span.end.0)?;
        map.serialize_entry("messages", &mission.messages)?;
        map.serialize_entry("period_ns", &mission.period.nanos())?;
        map.serialize_entry("step_ns", &mission.step.nanos())?;
        map.serialize_entry("ledger", &List(entries(&mission.ledger, &mission.elements)))?;
        if !mission.ledger.interruptions.is_empty() {
            let all = mission.ledger.interruptions.iter();
            map.serialize_entry("interruptions", &List(all.map(InterruptionRow::from)))?;
        }
        let phases = mission.ledger.phases.iter().map(PhaseRow::from);
        map.serialize_entry("phases", &List(phases))?;
        let elements = &mission.elements;
        if self.is_runs() {
            let windows = mission.windows.iter();
            let windows = windows.map(|window| WindowRow { window, elements });
            map.serialize_entry("windows", &List(windows))?;
            runs::elements(mission, &mut map)?;
        } else {
            let windows = mission.windows.iter().zip(&mission.graphs);
            let windows = windows.map(|(window, graph)| WindowOf {
                window,
                graph,
                elements,
            });
            map.serialize_entry("windows", &List(windows))?;
        }
        let sending = &mission.sending;
        map.serialize_entry("sending", &SendingOf { sending, elements })?;
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

#[derive(Serialize)]
struct BagRow<'a> {
    name: &'a str,
    format: &'a str,
    compression: &'a [String],
    tier: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    tier_reason: Option<&'a str>,
    complete: bool,
    file_bytes: u64,
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
            file_bytes: bag.file_bytes,
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
    graph: Graph,
    elements: &'a Elements,
}

impl Serialize for WindowOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (window, elements) = (self.window, self.elements);
        let graph = &self.graph;
        let mut map = serializer.serialize_map(None)?;
        head(window, &mut map)?;
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
        map.serialize_entry("changes", &changes(window, elements))?;
        map.end()
    }
}

/// A window without its elements.
struct WindowRow<'a> {
    window: &'a Window,
    elements: &'a Elements,
}

impl Serialize for WindowRow<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        head(self.window, &mut map)?;
        map.serialize_entry("changes", &changes(self.window, self.elements))?;
        map.end()
    }
}

fn head<M: SerializeMap>(window: &Window, map: &mut M) -> Result<(), M::Error> {
    map.serialize_entry("index", &window.index)?;
    map.serialize_entry("start_ns", &window.span.start.0)?;
    map.serialize_entry("end_ns", &window.span.end.0)?;
    map.serialize_entry("length_ns", &window.span.nanos())?;
    map.serialize_entry("partial", &window.partial)?;
    map.serialize_entry("messages", &window.messages)
}

fn changes<'a>(
    window: &'a Window,
    elements: &'a Elements,
) -> List<impl Iterator<Item = ChangeRow<'a>> + Clone> {
    let changes = window.changes.iter().zip(&window.entries);
    List(changes.map(|(change, entry)| ChangeRow::new(change, *entry, elements)))
}

pub(crate) fn words(evidence: Evidence) -> Vec<&'static str> {
    evidence.words().collect()
}
