//! The reconfiguration log: every change of a mission as one row with its time, in order.

use crate::base::csv::table;
use crate::base::name::last_part;
use crate::base::time::Stamp;
use crate::base::words;
use crate::graph::diff::Change;
use crate::graph::{Edge, Element};
use crate::mission::Mission;

/// One reconfiguration.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When, as exactly as the bag tells; the start of the window where it does not.
    pub time: Stamp,
    /// Whether `time` is the exact moment, not only the window's start.
    pub exact: bool,
    /// The window that shows it, 0...
    pub window: usize,
    /// What happened: the word of the change in JSON.
    pub kind: &'static str,
    /// To what: `node`, `topic`, `publish` or `subscribe`.
    pub what: &'static str,
    /// Its name; of an edge the node's.
    pub name: String,
    /// The topic of an edge.
    pub topic: Option<String>,
    /// Before: a rate in Hz, nodes, a value.
    pub from: Option<String>,
    /// After.
    pub to: Option<String>,
}

/// Every change of the mission, sorted by time, then as the windows list them.
pub fn events(mission: &Mission) -> Vec<Event> {
    let all = mission.windows.iter().flat_map(|window| {
        window
            .changes
            .iter()
            .map(|change| event(mission, window.index, window.span.start, change))
    });
    let mut events: Vec<Event> = all.collect();
    events.sort_by_key(|e| (e.window, e.time));
    events
}

fn event(mission: &Mission, window: usize, start: Stamp, change: &Change) -> Event {
    let names = |nodes: &[u32]| {
        let names: Vec<&str> = nodes
            .iter()
            .map(|n| mission.elements.nodes[*n as usize].name.as_str())
            .collect();
        Some(names.join(" "))
    };
    let (what, time, from, to) = match change {
        Change::Added { what, time } | Change::Removed { what, time } => (*what, *time, None, None),
        Change::Restarted { node, time } => (Element::Node(*node), Some(*time), None, None),
        Change::Rate {
            what,
            from_hz,
            to_hz,
        } => (
            *what,
            None,
            Some(words::number(*from_hz)),
            Some(words::number(*to_hz)),
        ),
        Change::HandedOver { topic, from, to } => {
            (Element::Topic(*topic), None, names(from), names(to))
        }
        Change::Value { what, from, to, .. } => {
            (*what, None, Some(from.to_string()), Some(to.to_string()))
        }
    };
    let (name, topic) = named(mission, what);
    Event {
        time: time.unwrap_or(start),
        exact: time.is_some(),
        window,
        kind: change.word(),
        what: what.word(),
        name,
        topic,
        from,
        to,
    }
}

/// The name of a node or topic; the node and topic of an edge.
fn named(mission: &Mission, what: Element) -> (String, Option<String>) {
    let elements = &mission.elements;
    let node = |id: u32| elements.nodes[id as usize].name.to_string();
    let topic = |id: u32| elements.topics[id as usize].name.to_string();
    let edge = |edge: &Edge| (node(edge.node), Some(topic(edge.topic)));
    match what {
        Element::Node(id) => (node(id), None),
        Element::Topic(id) => (topic(id), None),
        Element::Publish(id) => edge(&elements.publishes[id as usize]),
        Element::Subscribe(id) => edge(&elements.subscribes[id as usize]),
    }
}

impl Event {
    /// The event as one sentence without a period: `/planner appeared`, `/scan 15 → 7.4 Hz`.
    pub fn sentence(&self) -> String {
        let (from, to) = (
            self.from.as_deref().unwrap_or(""),
            self.to.as_deref().unwrap_or(""),
        );
        let name = match &self.topic {
            Some(topic) if self.what == "publish" => format!("{} → {topic}", self.name),
            Some(topic) => format!("{topic} → {}", self.name),
            None => self.name.clone(),
        };
        match self.kind {
            "added" => format!("{name} appeared"),
            "removed" => format!("{name} vanished"),
            "rate" => format!("{name} {from} → {to} Hz"),
            "handed_over" => format!("{name} handed over from {from} to {to}"),
            "restarted" => format!("{name} restarted"),
            kind => format!("{name} {kind} {} → {}", last_part(from), last_part(to)),
        }
    }

    /// When it happened, counted from the mission's start, such as `07:10.2`; `~` in front where only the window is known.
    pub fn at(&self, mission: &Mission) -> String {
        let about = if self.exact { "" } else { "~" };
        format!("{about}{}", words::offset(mission.offset(self.time)))
    }
}

/// The log as text, a line each.
pub fn text(mission: &Mission) -> String {
    let line = |event: Event| {
        let sentence = event.sentence();
        format!("{:>12}  {}\n", event.at(mission), words::visible(&sentence))
    };
    events(mission).into_iter().map(line).collect()
}

/// The log as a table: a row per event.
pub fn csv(mission: &Mission) -> String {
    let columns = "time_ns is_exact win kind what name topic from_value to_value";
    let columns: Vec<&str> = columns.split(' ').collect();
    let row = |event: Event| {
        vec![
            event.time.0.to_string(),
            event.exact.to_string(),
            event.window.to_string(),
            event.kind.to_owned(),
            event.what.to_owned(),
            event.name,
            event.topic.unwrap_or_default(),
            event.from.unwrap_or_default(),
            event.to.unwrap_or_default(),
        ]
    };
    table(&columns, events(mission).into_iter().map(row))
}

/// The log as JSON, an object a line.
pub fn ndjson(mission: &Mission) -> String {
    let line = |event: Event| {
        let object = serde_json::json!({
            "time_ns": event.time.0,
            "exact": event.exact,
            "window": event.window,
            "kind": event.kind,
            "what": event.what,
            "name": event.name,
            "topic": event.topic,
            "from": event.from,
            "to": event.to,
        });
        words::visible_json(&object.to_string()) + "\n"
    };
    events(mission).into_iter().map(line).collect()
}

/// What Markdown would obey.
const SIGNS: &str = "\\`*_[]<>|#&";

/// The log as a table in Markdown.
pub fn markdown(mission: &Mission) -> String {
    let mut out = "| time | event |\n|---:|---|\n".to_owned();
    for event in events(mission) {
        out.extend(["| ", &event.at(mission), " | "]);
        for c in words::visible(&event.sentence()).chars() {
            out.extend(SIGNS.contains(c).then_some('\\'));
            out.push(c);
        }
        out.push_str(" |\n");
    }
    out
}
