//! Reads missions in JSON: our own, or a graph over time that another tool wrote with the same keys.
//!
//! Required are `schema`, the windows' times, and the elements' names and windows; other missing values are unknown,
//! unknown keys are ignored. Changes are determined by the events; a mission without any is left for
//! [`Mission::find_changes`].

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::elements::{EdgeJson, ElementJson, NodeJson, TopicJson};
use super::events::{EventJson, InterruptionRow, PhaseRow, events_of, interruptions, phases};
use super::write::{BagJson, NoticeJson};
use super::{SCHEMA, Text};
use crate::bag::{Report, Tier};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Period, Span, Stamp};
use crate::graph::history::{Sender, Sending, Stretch};
use crate::graph::{ById, ColumnWriter, Elements, Graphs, GraphsWriter, NodeId, TopicId};
use crate::mission::{EventLog, Mission, Places, Window};

/// The keys of a mission; all are optional except names, windows and times.
#[derive(Deserialize)]
struct Raw {
    schema: String,
    #[serde(default)]
    bags: Vec<BagJson<'static>>,
    start_ns: Option<Stamp>,
    end_ns: Option<Stamp>,
    messages: Option<u64>,
    period_ns: Option<i64>,
    step_ns: Option<i64>,
    windows: Vec<RawWindow>,
    #[serde(default)]
    elements: Vec<ElementJson<'static>>,
    events: Option<Vec<EventJson<'static>>>,
    #[serde(default)]
    interruptions: Vec<InterruptionRow<'static>>,
    #[serde(default)]
    phases: Vec<PhaseRow<'static>>,
    layout: Option<Places>,
    #[serde(default)]
    notices: Vec<NoticeJson<'static>>,
}

#[derive(Deserialize)]
struct RawWindow {
    start_ns: Stamp,
    end_ns: Stamp,
    partial: Option<bool>,
    messages: Option<u64>,
}

/// Reads a mission in JSON; `path` is only used in errors.
///
/// # Errors
/// [`Error::BadFile`] with the line for text that is not JSON or lacks these keys, for another schema, and for windows
/// that are not in order of time.
pub fn read_json(text: &str, path: &Path) -> Result<Mission> {
    let hint = "`bagreel render BAG -o x.json` writes a mission";
    let bad = |line: usize, reason: String| Error::bad_file(path, line, reason, hint);
    let unread = |e: serde_json::Error| {
        let reason = e.to_string();
        // The error names the place itself.
        let end = reason.rfind(" at line ").unwrap_or(reason.len());
        bad(e.line(), reason[..end].to_owned())
    };
    let raw: Raw = serde_json::from_str(text).map_err(unread)?;
    mission_of(raw).map_err(|reason| bad(0, reason))
}

fn mission_of(mut raw: Raw) -> Result<Mission, String> {
    if raw.schema != SCHEMA {
        return Err(format!("schema `{}` is not `{SCHEMA}`", raw.schema));
    }
    let spans = spans(&raw.windows)?;
    let listed = Listed::of(std::mem::take(&mut raw.elements))?;
    let elements = listed.elements()?;
    let start = spans.iter().map(|s| s.start).min().unwrap_or_default();
    let end = spans.iter().map(|s| s.end).max().unwrap_or_default();
    let longest = spans.iter().map(Span::nanos).max().unwrap_or(1).max(1);
    let period = raw.period_ns.and_then(Period::from_nanos);
    let period = period.or_else(|| Period::from_nanos(longest));
    let period = period.ok_or("its windows have no length")?;
    let windows = raw.windows.iter().zip(&spans).enumerate();
    let windows = windows.map(|(index, (window, span))| Window {
        index,
        span: *span,
        partial: window.partial.unwrap_or(span.nanos() < period.nanos()),
        messages: window.messages.unwrap_or(0),
        ..Window::default()
    });
    let windows: Vec<Window> = windows.collect();
    let messages = windows.iter().map(|w| w.messages);
    let messages = messages.fold(0, u64::saturating_add);
    let mut mission = Mission {
        bags: raw.bags.into_iter().map(report).collect(),
        span: Span::new(start, end).hull(Span::new(
            raw.start_ns.unwrap_or(start),
            raw.end_ns.unwrap_or(end),
        )),
        messages: raw.messages.unwrap_or(messages),
        period,
        step: raw.step_ns.and_then(Period::from_nanos).unwrap_or(period),
        sending: listed.sending(&elements)?,
        graphs: listed.graphs(&elements, spans),
        elements,
        windows,
        log: EventLog::default(),
        undrawn: Vec::new(),
        logged: Vec::new(),
        layout: raw.layout,
        notices: notices(raw.notices),
    };
    if let Some(rows) = raw.events {
        let events = events_of(&rows, &mission.elements);
        mission.log.events = events.ok_or("an event refers to an element that is not listed")?;
        mission.log.phases = phases(raw.phases);
        mission.log.interruptions = interruptions(&raw.interruptions);
        mission.explain();
    }
    Ok(mission)
}

/// The times of the windows, checked.
fn spans(windows: &[RawWindow]) -> Result<Vec<Span>, String> {
    if windows.is_empty() {
        return Err("it has no windows".to_owned());
    }
    let span = |w: &RawWindow| Span::new(w.start_ns, w.end_ns);
    let spans: Vec<Span> = windows.iter().map(span).collect();
    for (index, span) in spans.iter().enumerate() {
        if span.start >= span.end {
            return Err(format!("window {index} ends before it starts"));
        }
        if index > 0 && spans[index - 1].start > span.start {
            return Err(format!("window {index} starts before the previous one"));
        }
    }
    Ok(spans)
}

/// The elements of a file in the order of their ids.
#[derive(Default)]
struct Listed {
    nodes: BTreeMap<Text<'static>, NodeJson<'static>>,
    topics: BTreeMap<Text<'static>, TopicJson<'static>>,
    /// Publications by node and topic.
    publishes: BTreeMap<(Text<'static>, Text<'static>), EdgeJson<'static>>,
    /// Subscriptions by topic and node.
    subscribes: BTreeMap<(Text<'static>, Text<'static>), EdgeJson<'static>>,
}

impl Listed {
    /// # Errors
    /// The name of an element that is listed twice.
    fn of(elements: Vec<ElementJson<'static>>) -> Result<Self, String> {
        let mut all = Self::default();
        for element in elements {
            let twice = match element {
                ElementJson::Node(one) => {
                    let name = one.name.clone();
                    all.nodes.insert(name, one).map(|one| one.name)
                }
                ElementJson::Topic(one) => {
                    let name = one.name.clone();
                    all.topics.insert(name, one).map(|one| one.name)
                }
                ElementJson::Publish(one) => {
                    let ends = (one.node.clone(), one.topic.clone());
                    all.publishes.insert(ends, one).map(|one| one.topic)
                }
                ElementJson::Subscribe(one) => {
                    let ends = (one.topic.clone(), one.node.clone());
                    all.subscribes.insert(ends, one).map(|one| one.topic)
                }
            };
            if let Some(name) = twice {
                return Err(format!("`{name}` is listed twice"));
            }
        }
        Ok(all)
    }

    /// # Errors
    /// The name of an edge's end that is not listed.
    fn elements(&self) -> Result<Elements, String> {
        let mut all = Elements {
            nodes: self.nodes.values().map(NodeJson::node).collect(),
            topics: self.topics.values().map(TopicJson::topic).collect(),
            ..Elements::default()
        };
        let edges = self.publishes.values().map(|one| one.edge(&all));
        let publishes = edges.collect::<Result<_, _>>()?;
        let edges = self.subscribes.values().map(|one| one.edge(&all));
        all.subscribes = edges.collect::<Result<_, _>>()?;
        all.publishes = publishes;
        Ok(all)
    }

    /// The messages of all senders.
    ///
    /// # Errors
    /// The mistake in the stretches.
    fn sending(&self, elements: &Elements) -> Result<Sending, String> {
        let topics = || self.topics.values();
        let unnamed = topics().map(|one| (&one.name, None, &one.sender));
        let named = self.publishes.values();
        let named = named.map(|one| (&one.topic, Some(&one.node), &one.sender));
        let mut all: BTreeMap<(TopicId, Option<NodeId>), Sender> = BTreeMap::new();
        for (name, node, sender) in unnamed.chain(named) {
            let topic = elements.topic(name);
            let Some(topic) = topic.filter(|_| !sender.stretches.is_empty()) else {
                continue;
            };
            let is_whole = |s: &Stretch| s.first <= s.last && s.count > 0 && s.period >= 0;
            let mut pairs = sender.stretches.windows(2);
            let ascend = pairs.all(|pair| pair[0].last <= pair[1].first);
            if !ascend || !sender.stretches.iter().all(is_whole) {
                return Err(format!("the stretches of `{name}` do not ascend"));
            }
            let mut sender = sender.clone().into_owned();
            sender.topic = topic;
            sender.node = node.and_then(|name| elements.node(name));
            all.insert((topic, sender.node), sender);
        }
        let mut pauses = ById::default();
        if topics().any(|one| !one.pauses.is_empty()) {
            // The topics are listed in the order of their ids.
            pauses = topics().map(|one| one.pauses.clone()).collect();
        }
        Ok(Sending {
            senders: all.into_values().collect(),
            pauses,
        })
    }

    /// The graphs of the windows by the elements' columns.
    fn graphs(&self, elements: &Elements, spans: Vec<Span>) -> Graphs {
        let many = spans.len();
        let nodes = self.nodes.values().map(|one| &one.columns);
        let topics = self.topics.values().map(|one| &one.columns);
        let edges = self.publishes.values().chain(self.subscribes.values());
        let columns = nodes.chain(topics).chain(edges.map(|one| &one.columns));
        let mut graphs = GraphsWriter::new(spans);
        for (what, columns) in elements.all().zip(columns) {
            let mut rows = ColumnWriter::default();
            columns.add(&mut rows, many, &mut graphs);
            graphs.element(what, rows);
        }
        graphs.finish()
    }
}

fn report(raw: BagJson<'_>) -> Report {
    Report {
        name: raw.name.into_owned(),
        format: raw.format.into_owned(),
        compression: raw.compression.into_iter().map(Into::into).collect(),
        tier: Tier::from_word(&raw.tier).unwrap_or(Tier::Forward),
        tier_reason: raw.tier_reason.map(Into::into),
        complete: raw.complete.unwrap_or(true),
        bytes_read: 0,
        file_bytes: raw.file_bytes,
        facts: Vec::new(),
    }
}

/// The notices of an earlier run as plain notes: data lost then does not affect this exit code.
fn notices(raw: Vec<NoticeJson<'_>>) -> Notices {
    let mut notices = Notices::new();
    notices.extend(raw.into_iter().map(|n| Notice {
        kind: NoticeKind::from_word(&n.kind).unwrap_or(NoticeKind::Note),
        count: n.count.unwrap_or(1).max(1),
        text: n.text,
    }));
    notices
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::State;
    use crate::mission::write_json;

    const SMALL: &str = r#"{"schema": "bagreel.mission/3", "future": 1,
        "windows": [{"start_ns": 0, "end_ns": 10, "messages": 4}, {"start_ns": 10, "end_ns": 15, "messages": 3}],
        "elements": [
            {"what": "publish", "node": "/b", "topic": "/t", "in": {"windows": [[0, 0]], "count": [4]}},
            {"what": "node", "name": "/b", "in": {"windows": [[0, 1]]}},
            {"what": "node", "name": "/a", "in": {"windows": [[0, 0]], "state": ["silent"]}},
            {"what": "topic", "name": "/t", "in": {"windows": [[0, 1]], "count": [4, 3]}}]}"#;

    fn read(text: &str) -> Result<Mission> {
        read_json(text, Path::new("x.json"))
    }

    fn outcome(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    fn written(mission: &Mission) -> String {
        let mut bytes = Vec::new();
        write_json(mission, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn only_times_names_and_windows_are_required() {
        let mission = read(SMALL).unwrap();
        let nodes = mission.elements.nodes.iter();
        let names: Vec<_> = nodes.map(|n| n.name.as_str()).collect();
        assert_eq!(names, ["/a", "/b"]);
        let first = mission.graphs.get(0).unwrap();
        assert_eq!(first.states[0].state, State::Silent);
        assert_eq!(first.states[1].state, State::Active);
        assert_eq!(mission.graphs.get(1).unwrap().nodes().count(), 1);
        assert_eq!(
            (mission.period.nanos(), mission.windows[1].partial),
            (10, true)
        );
        assert_eq!(mission.messages, 7);
    }

    #[test]
    fn an_error_names_its_line_once() {
        let text = "{\"schema\": \"bagreel.mission/3\",\n\"windows\": 3}";
        let error = outcome(text);
        assert!(
            error.starts_with("`x.json` line 2: invalid type"),
            "{error}"
        );
        assert_eq!(error.matches("line").count(), 1, "{error}");
    }

    #[test]
    fn json_round_trips() {
        let mut mission = read(SMALL).unwrap();
        mission.find_changes(0.25);
        let first = written(&mission);
        let mut again = read(&first).unwrap();
        again.find_changes(0.25);
        assert_eq!(first, written(&again));
    }

    #[test]
    fn lists_of_elements_are_checked() {
        let node = r#"{"what": "node", "name": "/a","#;
        let twice = SMALL.replace(node, r#"{"what": "node", "name": "/b","#);
        assert!(outcome(&twice).contains("`/b` is listed twice"));
        let ends = SMALL.replace(r#""topic": "/t""#, r#""topic": "/u""#);
        assert!(outcome(&ends).contains("`/u` has an edge and is not in `elements`"));
        let windowless = SMALL.replace(
            r#""in": {"windows": [[0, 0]], "state""#,
            r#""at": {"state""#,
        );
        assert!(outcome(&windowless).contains("missing field `in`"));
    }

    #[test]
    fn invalid_json_is_refused_with_its_line() {
        assert!(outcome("{\n\"schema\": 3}").contains("line 2"));
        assert!(outcome(r#"{"schema": "other/9", "windows": []}"#).contains("`other/9`"));
        let back = r#"{"schema": "bagreel.mission/3", "windows": [{"start_ns": 5, "end_ns": 5}]}"#;
        assert!(outcome(back).contains("window 0 ends before it starts"));
    }

    #[test]
    fn impossible_sending_is_refused() {
        let sending = r#""latched": true, "stretches": [[1, 3, 2, 2, 0], [4, 9, 6, 1, 3]], "in""#;
        let good = SMALL.replacen(r#""in""#, sending, 1);
        let read = read(&good).unwrap();
        let [sender] = &read.sending.senders[..] else {
            panic!("{:?}", read.sending);
        };
        assert!(sender.is_latched && sender.stretches[1].is_joined);
        assert!(written(&read).contains(r#""stretches": [[1,3,2,2,0],[4,9,6,1,3]]"#));
        let back = outcome(&good.replace("[4, 9", "[2, 9"));
        assert!(back.contains("`/t` do not ascend"), "{back}");
        assert!(outcome(&good.replace("[1, 3, 2", "[1, 3, 0")).contains("do not ascend"));
    }
}
