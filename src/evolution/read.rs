//! Reads an evolution back: our own JSON, or a graph over time that another tool wrote with our keys.
//!
//! Required are `schema`, the windows' times and the elements' names; what else is missing is unknown, unknown keys are
//! ignored, and changes are left to be computed anew.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;

use super::write::SCHEMA;
use super::{Evolution, Place, Places, Window};
use crate::bag::{Report, Tier};
use crate::error::{Error, Result};
use crate::evidence::{Degree, Evidence};
use crate::geometry::Rect;
use crate::graph::{Edge, EdgeState, Elements, Graph, Node, NodeState, State, Topic, TopicState};
use crate::name::{NodeName, TopicName};
use crate::notice::{Notice, NoticeKind, Notices};
use crate::time::{Period, Span, Stamp};

/// Reads the text of an evolution; `path` is only named in errors.
///
/// # Errors
/// [`Error::BadFile`] with the line for what is no JSON or has no such keys, for another schema, and for windows that
/// are not in order of time.
pub fn read_json(text: &str, path: &Path) -> Result<Evolution> {
    let bad = |line: usize, reason: String| Error::BadFile {
        path: path.to_owned(),
        line,
        reason,
        hint: "an evolution is what `bagreel render BAG -o x.json` writes".to_owned(),
    };
    let raw: Raw = serde_json::from_str(text).map_err(|e| bad(e.line(), e.to_string()))?;
    if raw.schema != SCHEMA {
        return Err(bad(0, format!("schema `{}` is not `{SCHEMA}`", raw.schema)));
    }
    let spans = spans(&raw).map_err(|reason| bad(0, reason))?;
    Ok(build(raw, &spans))
}

#[derive(Deserialize)]
struct Raw {
    schema: String,
    #[serde(default)]
    bags: Vec<RawBag>,
    start_ns: Option<i64>,
    end_ns: Option<i64>,
    messages: Option<u64>,
    period_ns: Option<i64>,
    step_ns: Option<i64>,
    windows: Vec<RawWindow>,
    layout: Option<RawLayout>,
    #[serde(default)]
    notices: Vec<RawNotice>,
}

#[derive(Deserialize)]
struct RawBag {
    #[serde(default)]
    name: String,
    #[serde(default)]
    format: String,
    #[serde(default)]
    compression: Vec<String>,
    #[serde(default)]
    tier: String,
    complete: Option<bool>,
}

#[derive(Deserialize)]
struct RawNotice {
    #[serde(default)]
    kind: String,
    count: Option<u64>,
    #[serde(default)]
    text: String,
}

#[derive(Deserialize)]
struct RawLayout {
    #[serde(default)]
    width: f64,
    #[serde(default)]
    height: f64,
    #[serde(default)]
    orientation: String,
    #[serde(default)]
    boxes: Vec<RawBox>,
}

#[derive(Deserialize)]
struct RawBox {
    what: String,
    name: String,
    x: f64,
    y: f64,
    w: f64,
    h: f64,
}

#[derive(Deserialize)]
struct RawWindow {
    start_ns: i64,
    end_ns: i64,
    partial: Option<bool>,
    messages: Option<u64>,
    #[serde(default)]
    nodes: Vec<RawNode>,
    #[serde(default)]
    topics: Vec<RawTopic>,
    #[serde(default)]
    publishes: Vec<RawEdge>,
    #[serde(default)]
    subscribes: Vec<RawEdge>,
}

/// What every element may say of itself.
#[derive(Deserialize)]
struct RawState {
    state: Option<String>,
    degree: Option<String>,
    #[serde(default)]
    evidence: Vec<String>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    count: Option<u64>,
    hz: Option<f64>,
}

#[derive(Deserialize)]
struct RawNode {
    name: String,
    role: Option<String>,
    lifecycle: Option<String>,
    #[serde(flatten)]
    rest: RawState,
}

#[derive(Deserialize)]
struct RawTopic {
    name: String,
    #[serde(default)]
    types: Vec<String>,
    bytes: Option<u64>,
    median_period_s: Option<f64>,
    max_gap_s: Option<f64>,
    qos: Option<String>,
    #[serde(flatten)]
    rest: RawState,
}

#[derive(Deserialize)]
struct RawEdge {
    node: String,
    topic: String,
    #[serde(flatten)]
    rest: RawState,
}

impl RawState {
    fn state(&self) -> State {
        let known = State::ALL
            .into_iter()
            .find(|s| self.state.as_deref() == Some(s.word()));
        known.unwrap_or(State::Active)
    }

    fn degree(&self) -> Degree {
        let known = Degree::ALL
            .into_iter()
            .find(|d| self.degree.as_deref() == Some(d.word()));
        known.unwrap_or(Degree::Stated)
    }

    fn evidence(&self) -> Evidence {
        self.evidence
            .iter()
            .fold(Evidence::NONE, |all, word| all.and(Evidence::of(word)))
    }

    fn life(&self) -> (Option<Stamp>, Option<Stamp>) {
        (self.first_ns.map(Stamp), self.last_ns.map(Stamp))
    }

    fn edge(&self, id: u32) -> EdgeState {
        EdgeState {
            id,
            state: self.state(),
            degree: self.degree(),
            count: self.count,
            hz: self.hz,
        }
    }
}

/// The windows' times, checked.
fn spans(raw: &Raw) -> Result<Vec<Span>, String> {
    if raw.windows.is_empty() {
        return Err("it has no windows".to_owned());
    }
    let spans: Vec<Span> = raw
        .windows
        .iter()
        .map(|w| Span {
            start: Stamp(w.start_ns),
            end: Stamp(w.end_ns),
        })
        .collect();
    for (index, span) in spans.iter().enumerate() {
        if span.start >= span.end {
            return Err(format!("window {index} ends before it starts"));
        }
        if index > 0 && spans[index - 1].start > span.start {
            return Err(format!(
                "window {index} starts before the one in front of it"
            ));
        }
    }
    Ok(spans)
}

/// Names and what is known of them over all windows, before they have places.
#[derive(Default)]
struct Names {
    nodes: BTreeMap<Arc<str>, Node>,
    topics: BTreeMap<Arc<str>, Topic>,
    /// By (node, topic).
    publishes: BTreeMap<(Arc<str>, Arc<str>), Edge>,
    /// By (topic, node).
    subscribes: BTreeMap<(Arc<str>, Arc<str>), Edge>,
}

impl Names {
    fn node(&mut self, name: &str) -> &mut Node {
        let name: Arc<str> = name.into();
        self.nodes.entry(Arc::clone(&name)).or_insert_with(|| Node {
            name: NodeName::from(Arc::clone(&name)),
            role: name,
            evidence: Evidence::NONE,
            first: None,
            last: None,
        })
    }

    fn topic(&mut self, name: &str) -> &mut Topic {
        let name: Arc<str> = name.into();
        self.topics
            .entry(Arc::clone(&name))
            .or_insert_with(|| Topic {
                name: TopicName::from(name),
                types: Vec::new(),
                evidence: Evidence::NONE,
                first: None,
                last: None,
                qos: None,
            })
    }

    fn window(&mut self, window: &RawWindow) {
        for raw in &window.nodes {
            let node = self.node(&raw.name);
            if let Some(role) = &raw.role {
                node.role = role.as_str().into();
            }
            node.evidence = node.evidence.and(raw.rest.evidence());
            widen(&mut node.first, &mut node.last, raw.rest.life());
        }
        for raw in &window.topics {
            let topic = self.topic(&raw.name);
            topic
                .types
                .extend(raw.types.iter().map(|t| Arc::from(t.as_str())));
            topic.types.sort();
            topic.types.dedup();
            topic.evidence = topic.evidence.and(raw.rest.evidence());
            topic.qos = raw.qos.as_deref().map(Arc::from).or(topic.qos.take());
            widen(&mut topic.first, &mut topic.last, raw.rest.life());
        }
        for raw in &window.publishes {
            self.ends(raw);
            edge(&mut self.publishes, (&raw.node, &raw.topic), raw);
        }
        for raw in &window.subscribes {
            self.ends(raw);
            edge(&mut self.subscribes, (&raw.topic, &raw.node), raw);
        }
    }

    fn ends(&mut self, raw: &RawEdge) {
        self.node(&raw.node);
        self.topic(&raw.topic);
    }

    /// Gives everything its place.
    fn elements(self) -> (Elements, Ids) {
        let places = Ids {
            nodes: numbered(self.nodes.keys().cloned()),
            topics: numbered(self.topics.keys().cloned()),
            publishes: numbered(self.publishes.keys().cloned()),
            subscribes: numbered(self.subscribes.keys().cloned()),
        };
        let settle = |(key, edge): ((Arc<str>, Arc<str>), Edge), node_first: bool| {
            let (node, topic) = if node_first {
                (&key.0, &key.1)
            } else {
                (&key.1, &key.0)
            };
            Edge {
                node: places.nodes[node],
                topic: places.topics[topic],
                ..edge
            }
        };
        let elements = Elements {
            publishes: self
                .publishes
                .into_iter()
                .map(|e| settle(e, true))
                .collect(),
            subscribes: self
                .subscribes
                .into_iter()
                .map(|e| settle(e, false))
                .collect(),
            nodes: self.nodes.into_values().collect(),
            topics: self.topics.into_values().collect(),
        };
        (elements, places)
    }
}

fn edge(edges: &mut BTreeMap<(Arc<str>, Arc<str>), Edge>, key: (&str, &str), raw: &RawEdge) {
    let edge = edges
        .entry((key.0.into(), key.1.into()))
        .or_insert_with(|| Edge {
            node: 0,
            topic: 0,
            evidence: Evidence::NONE,
            first: None,
            last: None,
        });
    edge.evidence = edge.evidence.and(raw.rest.evidence());
    widen(&mut edge.first, &mut edge.last, raw.rest.life());
}

fn widen(
    first: &mut Option<Stamp>,
    last: &mut Option<Stamp>,
    life: (Option<Stamp>, Option<Stamp>),
) {
    *first = [*first, life.0].into_iter().flatten().min();
    *last = (*last).max(life.1);
}

fn numbered<K: Ord>(keys: impl Iterator<Item = K>) -> BTreeMap<K, u32> {
    keys.zip(0..).collect()
}

/// The place of every name in [`Elements`].
struct Ids {
    nodes: BTreeMap<Arc<str>, u32>,
    topics: BTreeMap<Arc<str>, u32>,
    publishes: BTreeMap<(Arc<str>, Arc<str>), u32>,
    subscribes: BTreeMap<(Arc<str>, Arc<str>), u32>,
}

impl Ids {
    /// The graph of a window; an element listed twice counts once, and the ends of an edge are there.
    fn graph(&self, window: &RawWindow) -> Graph {
        let pair = |a: &str, b: &str| (Arc::from(a), Arc::from(b));
        let publishes = by_id(window.publishes.iter().map(|raw| {
            let id = self.publishes[&pair(&raw.node, &raw.topic)];
            (id, raw.rest.edge(id))
        }));
        let subscribes = by_id(window.subscribes.iter().map(|raw| {
            let id = self.subscribes[&pair(&raw.topic, &raw.node)];
            (id, raw.rest.edge(id))
        }));
        let edges = || window.publishes.iter().chain(&window.subscribes);
        let nodes = edges()
            .map(|raw| self.bare_node(raw))
            .chain(window.nodes.iter().map(|raw| self.node(raw)));
        let topics = edges()
            .map(|raw| self.bare_topic(raw))
            .chain(window.topics.iter().map(|raw| self.topic(raw)));
        Graph {
            nodes: by_id(nodes),
            topics: by_id(topics),
            publishes,
            subscribes,
        }
    }

    fn node(&self, raw: &RawNode) -> (u32, NodeState) {
        let state = NodeState {
            id: self.nodes[raw.name.as_str()],
            state: raw.rest.state(),
            degree: raw.rest.degree(),
            hz: raw.rest.hz,
            lifecycle: raw.lifecycle.as_deref().map(Arc::from),
        };
        (state.id, state)
    }

    fn topic(&self, raw: &RawTopic) -> (u32, TopicState) {
        let state = TopicState {
            id: self.topics[raw.name.as_str()],
            state: raw.rest.state(),
            degree: raw.rest.degree(),
            count: raw.rest.count.unwrap_or(0),
            bytes: raw.bytes,
            hz: raw.rest.hz,
            median_period_s: raw.median_period_s,
            max_gap_s: raw.max_gap_s,
        };
        (state.id, state)
    }

    /// A node that only an edge names.
    fn bare_node(&self, raw: &RawEdge) -> (u32, NodeState) {
        let id = self.nodes[raw.node.as_str()];
        (
            id,
            NodeState {
                id,
                state: raw.rest.state(),
                degree: raw.rest.degree(),
                hz: None,
                lifecycle: None,
            },
        )
    }

    /// A topic that only an edge names.
    fn bare_topic(&self, raw: &RawEdge) -> (u32, TopicState) {
        let id = self.topics[raw.topic.as_str()];
        let state = TopicState {
            id,
            state: raw.rest.state(),
            degree: raw.rest.degree(),
            count: 0,
            bytes: None,
            hz: None,
            median_period_s: None,
            max_gap_s: None,
        };
        (id, state)
    }
}

/// Sorted by id; of several with one id the last.
fn by_id<T>(states: impl Iterator<Item = (u32, T)>) -> Vec<T> {
    states.collect::<BTreeMap<_, _>>().into_values().collect()
}

fn build(raw: Raw, spans: &[Span]) -> Evolution {
    let mut names = Names::default();
    raw.windows.iter().for_each(|w| names.window(w));
    let (elements, places) = names.elements();
    let start = spans.iter().map(|s| s.start).min().unwrap_or_default();
    let end = spans.iter().map(|s| s.end).max().unwrap_or_default();
    let span = Span {
        start: raw.start_ns.map_or(start, Stamp).min(start),
        end: raw.end_ns.map_or(end, Stamp).max(end),
    };
    let longest = spans.iter().map(Span::nanos).max().unwrap_or(1);
    let fallback = || Period::from_nanos(longest.max(1));
    let period = raw
        .period_ns
        .and_then(Period::from_nanos)
        .or_else(fallback)
        .unwrap_or(ONE);
    let windows: Vec<Window> = raw
        .windows
        .iter()
        .zip(spans)
        .enumerate()
        .map(|(index, (window, span))| {
            let counts = || {
                window
                    .topics
                    .iter()
                    .filter_map(|t| t.rest.count)
                    .fold(0, u64::saturating_add)
            };
            Window {
                index,
                span: *span,
                partial: window.partial.unwrap_or(span.nanos() < period.nanos()),
                messages: window.messages.unwrap_or_else(counts),
                graph: places.graph(window),
                changes: Vec::new(),
            }
        })
        .collect();
    Evolution {
        bags: raw.bags.into_iter().map(report).collect(),
        span,
        messages: raw.messages.unwrap_or_else(|| {
            windows
                .iter()
                .map(|w| w.messages)
                .fold(0, u64::saturating_add)
        }),
        period,
        step: raw.step_ns.and_then(Period::from_nanos).unwrap_or(period),
        elements,
        windows,
        layout: raw.layout.map(layout),
        notices: notices(raw.notices),
    }
}

const ONE: Period = match Period::from_nanos(1) {
    Some(one) => one,
    None => unreachable!(),
};

fn report(raw: RawBag) -> Report {
    let tiers = [Tier::Index, Tier::Forward, Tier::Verify];
    Report {
        name: raw.name,
        format: raw.format,
        compression: raw.compression,
        tier: tiers
            .into_iter()
            .find(|t| t.word() == raw.tier)
            .unwrap_or(Tier::Forward),
        tier_reason: None,
        complete: raw.complete.unwrap_or(true),
        bytes_read: 0,
        file_bytes: 0,
        facts: Vec::new(),
    }
}

fn layout(raw: RawLayout) -> Places {
    let place = |b: RawBox| Place {
        what: b.what,
        name: b.name,
        rect: Rect::new(b.x, b.y, b.w, b.h),
    };
    Places {
        width: raw.width,
        height: raw.height,
        orientation: raw.orientation,
        boxes: raw.boxes.into_iter().map(place).collect(),
    }
}

/// Notices of an earlier run are kept as notes: what was lost then is not lost now.
fn notices(raw: Vec<RawNotice>) -> Notices {
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
    use crate::evolution::write_json;

    const SMALL: &str = r#"{"schema": "bagreel.evolution/1", "future": 1, "windows": [
        {"start_ns": 0, "end_ns": 10, "nodes": [{"name": "/b"}, {"name": "/a", "state": "silent"}],
         "publishes": [{"node": "/b", "topic": "/t", "count": 4}]},
        {"start_ns": 10, "end_ns": 15, "topics": [{"name": "/t", "count": 3}]}]}"#;

    fn read(text: &str) -> Result<Evolution> {
        read_json(text, Path::new("x.json"))
    }

    #[test]
    fn only_times_and_names_are_required() {
        let evolution = read(SMALL).unwrap();
        let names: Vec<_> = evolution
            .elements
            .nodes
            .iter()
            .map(|n| n.name.as_str())
            .collect();
        assert_eq!(names, ["/a", "/b"]);
        assert_eq!(evolution.windows[0].graph.nodes[0].state, State::Silent);
        assert_eq!(
            evolution.windows[0].graph.topics.len(),
            1,
            "an edge brings its ends"
        );
        assert_eq!(
            (evolution.period.nanos(), evolution.windows[1].partial),
            (10, true)
        );
        assert_eq!(evolution.windows[1].messages, 3);
    }

    #[test]
    fn what_is_written_is_read_back_equal() {
        let mut first = Vec::new();
        let mut evolution = read(SMALL).unwrap();
        evolution.find_changes(0.25, &[]);
        write_json(&evolution, &mut first).unwrap();
        let mut again = read(std::str::from_utf8(&first).unwrap()).unwrap();
        again.find_changes(0.25, &[]);
        let mut second = Vec::new();
        write_json(&again, &mut second).unwrap();
        assert_eq!(
            String::from_utf8(first).unwrap(),
            String::from_utf8(second).unwrap()
        );
    }

    #[test]
    fn nonsense_is_refused_with_its_line() {
        let said = |text| read(text).unwrap_err().to_string();
        assert!(said("{\n\"schema\": 3}").contains("line 2"));
        assert!(said(r#"{"schema": "other/9", "windows": []}"#).contains("`other/9`"));
        let back =
            r#"{"schema": "bagreel.evolution/1", "windows": [{"start_ns": 5, "end_ns": 5}]}"#;
        assert!(said(back).contains("window 0 ends before it starts"));
    }
}
