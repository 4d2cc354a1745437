//! Two missions as one that is drawn: the elements of both by role, a log of the differences, and below the picture the
//! lifelines of everything that differs, one mission above the other, aligned at the first messages.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{DiffSubject, Difference, Where};
use crate::base::notice::Notices;
use crate::base::time::{Period, SECOND, Span, Stamp};
use crate::base::words;
use crate::draw::timeline::rows::{Level, Row, of_nodes, of_topics};
use crate::draw::timeline::{FigureSource, Timeline};
use crate::evidence::{Confidence, Evidence};
use crate::gate::facts::{Facts, Peer, TopicIn};
use crate::gate::values::Pattern;
use crate::graph::history::{Bound, Sending};
use crate::graph::{
    ById, Edge, Element, ElementState, Elements, Existence, Graph, Node, NodeId, State, Topic,
};
use crate::mission::event_log::{Detail, Event, EventId, EventLog, Kind, sorted};
use crate::mission::{Mission, Window};
use crate::view::NameFilter;

/// The picture of two missions that is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// One picture with the elements of both.
    Both,
    /// Two windows: first the first mission alone, then both.
    Each,
}

/// The time of all events of the picture, without meaning.
const AT: Stamp = Stamp(SECOND);

/// An element of both missions: a node by its role, a topic, or an edge by both its ends in its direction.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Node(String),
    Topic(String),
    Publish(String, String),
    Subscribe(String, String),
}

/// What is known of it in one mission.
#[derive(Clone, Default)]
struct Known {
    confidence: Confidence,
    evidence: Evidence,
    /// Of a topic.
    types: BTreeSet<String>,
    count: Option<u64>,
    hz: Option<f64>,
}

impl From<Peer> for Known {
    fn from(peer: Peer) -> Self {
        Self {
            confidence: peer.confidence,
            evidence: peer.evidence,
            ..Self::default()
        }
    }
}

/// The elements of one mission, by role and topic.
type MissionSide = BTreeMap<Key, Known>;

fn side_of(mission: &Mission) -> MissionSide {
    let facts = &Facts::new(mission);
    let mut side = MissionSide::new();
    let elements = &mission.elements;
    for role in facts.roles().filter(|role| !facts.is_tool(role.nodes)) {
        let nodes = role.nodes.iter();
        let all = nodes.map(|id| elements.nodes[*id].seen.evidence);
        let node = Known {
            confidence: if facts.is_sure(role.nodes) {
                Confidence::Stated
            } else {
                Confidence::Inferred
            },
            evidence: all.fold(Evidence::NONE, Evidence::and),
            ..Known::default()
        };
        side.insert(Key::Node(role.name.to_owned()), node);
    }
    for id in facts.topics(&Pattern::new("**")) {
        let (own, name) = (TopicIn { facts, id }, facts.topic(id).to_owned());
        let role = |peer: Peer| facts.role(peer.node).to_owned();
        for peer in facts.publishers(id) {
            side.insert(Key::Publish(role(peer), name.clone()), peer.into());
        }
        for peer in facts.subscribers(id) {
            side.insert(Key::Subscribe(name.clone(), role(peer)), peer.into());
        }
        let topic = Known {
            evidence: elements.topics[id].seen.evidence,
            types: own.types(),
            count: Some(facts.messages[id]),
            hz: facts.while_sending(id),
            ..Known::default()
        };
        side.insert(Key::Topic(name), topic);
    }
    let nodes = side.keys().filter(|key| matches!(key, Key::Node(_)));
    let nodes: BTreeSet<Key> = nodes.cloned().collect();
    side.retain(|key, _| match key {
        Key::Publish(node, _) | Key::Subscribe(_, node) => nodes.contains(&Key::Node(node.clone())),
        Key::Node(_) | Key::Topic(_) => true,
    });
    side
}

/// The mission of both. An element without evidence in one mission is drawn as the other has it.
pub(crate) fn union(
    first: &Mission,
    second: &Mission,
    differing: &[Difference],
    side: Side,
) -> Mission {
    let (a, b) = (side_of(first), side_of(second));
    let elements = elements(&a, &b);
    let span = |from: i64| Span::new(Stamp(from), Stamp(from + SECOND));
    let shown = match side {
        Side::Each => vec![(span(0), &a), (span(SECOND), &b)],
        Side::Both => vec![(span(SECOND), &b)],
    };
    let window = |(index, (span, seen)): (usize, &(Span, &MissionSide))| Window {
        index,
        span: *span,
        messages: seen.values().filter_map(|known| known.count).sum(),
        ..Window::default()
    };
    let windows: Vec<Window> = shown.iter().enumerate().map(window).collect();
    let graphs = shown.iter();
    let graphs = graphs.map(|(span, seen)| (*span, graph(&elements, seen)));
    let graphs = graphs.collect();
    let start = windows.first().map_or(AT, |w| w.span.start);
    let events = UnionLog {
        elements: &elements,
        differing,
        turned: turned(differing),
        events: ById::default(),
    };
    let period = Period::from_nanos(SECOND).unwrap_or(first.period);
    Mission {
        bags: first.bags.iter().chain(&second.bags).cloned().collect(),
        span: Span::new(start, Stamp(2 * SECOND)),
        messages: windows.iter().map(|w| w.messages).sum(),
        period,
        step: period,
        log: EventLog {
            events: sorted(events.all(), &elements),
            compares: true,
            ..EventLog::default()
        },
        elements,
        windows,
        graphs,
        sending: Sending::default(),
        undrawn: Vec::new(),
        logged: Vec::new(),
        layout: None,
        notices: Notices::new(),
    }
}

/// The elements of both with their combined evidence.
fn elements(a: &MissionSide, b: &MissionSide) -> Elements {
    let mut both: MissionSide = a.clone();
    for (key, own) in b {
        let known = both.entry(key.clone()).or_default();
        known.evidence = known.evidence.and(own.evidence);
        known.types.extend(own.types.iter().cloned());
    }
    let mut all = Elements::default();
    // Nodes and topics come before edges.
    for (key, known) in both {
        let seen = Existence::of(known.evidence);
        let edge = |elements: &Elements, node: &str, topic: &str| {
            Some(Edge {
                node: elements.node(node)?,
                topic: elements.topic(topic)?,
                seen: seen.clone(),
            })
        };
        match key {
            Key::Node(name) => {
                let role = name.as_str().into();
                let name = name.into();
                all.nodes.push(Node { name, role, seen });
            }
            Key::Topic(name) => {
                let types = known.types.iter().map(|t| t.as_str().into());
                all.topics.push(Topic {
                    name: name.into(),
                    types: types.collect(),
                    seen,
                    ..Topic::default()
                });
            }
            Key::Publish(node, topic) => {
                if let Some(edge) = edge(&all, &node, &topic) {
                    all.publishes.push(edge);
                }
            }
            Key::Subscribe(topic, node) => {
                if let Some(edge) = edge(&all, &node, &topic) {
                    all.subscribes.push(edge);
                }
            }
        }
    }
    all
}

fn graph(elements: &Elements, side: &MissionSide) -> Graph {
    let state = |what: Element| {
        let (node, topic) = elements.names(what);
        let (node, topic) = (node.map(str::to_owned), topic.map(str::to_owned));
        let known = side.get(&match what {
            Element::Node(_) => Key::Node(node?),
            Element::Topic(_) => Key::Topic(topic?),
            Element::Publish(_) => Key::Publish(node?, topic?),
            Element::Subscribe(_) => Key::Subscribe(topic?, node?),
        })?;
        Some(ElementState {
            count: known.count,
            hz: known.hz,
            ..ElementState::new(what, State::default(), known.confidence)
        })
    };
    Graph {
        states: elements.all().filter_map(state).collect(),
    }
}

/// The log under construction.
struct UnionLog<'a> {
    elements: &'a Elements,
    differing: &'a [Difference],
    turned: Turned<'a>,
    events: ById<EventId, Event>,
}

/// Whether an element appeared (true) or vanished (false), by kind and name.
type Turned<'a> = BTreeMap<(&'static str, &'a str), bool>;

/// The elements in only one mission that would be observable in the other.
fn turned(differing: &[Difference]) -> Turned<'_> {
    let known = (differing.iter()).filter(|d| d.is_known && d.side != Where::Both);
    let sides = known.map(|d| ((d.kind, d.name.as_str()), d.side == Where::Second));
    sides.collect()
}

impl UnionLog<'_> {
    fn all(mut self) -> ById<EventId, Event> {
        let mut wholes: BTreeMap<NodeId, EventId> = BTreeMap::new();
        for (id, node) in self.elements.nodes.with_ids() {
            let turned = self.turned("node", node.name.as_str());
            if let Some(kind) = turned.map(|came| if came { Kind::Started } else { Kind::Stopped })
            {
                let place = self.add(kind, Element::Node(id), Detail::None, None);
                wholes.insert(id, place);
            }
        }
        for (id, topic) in self.elements.topics.with_ids() {
            let turned = self.turned("topic", topic.name.as_str());
            if let Some(kind) = turned.map(appeared) {
                let mut of = self.elements.publishes.iter().filter(|e| e.topic == id);
                let whole = of.find_map(|e| wholes.get(&e.node)).copied();
                self.add(kind, Element::Topic(id), Detail::None, whole);
            }
        }
        self.edges(&wholes);
        for difference in self.differing {
            self.change(difference);
        }
        self.events
    }

    /// Whether an element appeared (true) or vanished, according to a difference.
    fn turned(&self, kind: &'static str, name: &str) -> Option<bool> {
        self.turned.get(&(kind, name)).copied()
    }

    /// Adds the events of edges, which appear and vanish with their nodes or alone.
    fn edges(&mut self, wholes: &BTreeMap<NodeId, EventId>) {
        let elements = self.elements;
        for (what, edge) in elements.edges() {
            let node = elements.nodes[edge.node].name.as_str();
            let topic = elements.topics[edge.topic].name.as_str();
            let (kind, label) = match what {
                Element::Publish(_) => ("publishes", format!("{node} → {topic}")),
                _ => ("subscribes", format!("{topic} → {node}")),
            };
            if let Some(whole) = wholes.get(&edge.node).copied() {
                let came = self.events[whole].kind == Kind::Started;
                self.add(appeared(came), what, Detail::None, Some(whole));
            } else if let Some(came) = self.turned(kind, &label) {
                self.add(appeared(came), what, Detail::None, None);
            }
        }
    }

    /// Adds the event of an element with different values, or of an event in only one mission.
    fn change(&mut self, difference: &Difference) {
        let node = self.elements.node(&difference.element).map(Element::Node);
        let topic = self.elements.topic(&difference.element).map(Element::Topic);
        let (kind, what) = match difference.kind {
            "rate" if difference.rates.is_some() => (Kind::Rate, topic),
            "type" => (Kind::Type, topic),
            "qos" => (Kind::Qos, topic),
            "node" | "topic" | "publishes" | "subscribes" => return,
            _ => (Kind::Lifecycle, node.or(topic)),
        };
        if let (Some(what), true) = (what, difference.is_known) {
            self.add(kind, what, values(difference), None);
        }
    }

    fn add(
        &mut self,
        kind: Kind,
        what: Element,
        detail: Detail,
        part_of: Option<EventId>,
    ) -> EventId {
        self.events.push(Event {
            detail,
            evidence: self.elements.evidence(what),
            part_of,
            ..Event::new(kind, what, Bound::new(AT, AT, AT))
        })
    }
}

/// The different values.
fn values(difference: &Difference) -> Detail {
    if let Some([from_hz, to_hz]) = difference.rates {
        return Detail::Rates { from_hz, to_hz };
    }
    let event = difference.name.strip_prefix(&*difference.element);
    let of = |value: &str| match (difference.kind, value.parse::<usize>()) {
        ("restarts", Ok(n)) => words::count(n, "restart").into(),
        ("event", _) if value.is_empty() => "no such event".into(),
        ("begin", _) => format!("begins at {value}").into(),
        ("event" | "time", _) => format!("{} {value}", event.unwrap_or("").trim()).into(),
        _ => value.into(),
    };
    Detail::Values {
        from: of(&difference.first),
        to: of(&difference.second),
    }
}

/// The kind of event for an edge or topic that appeared or vanished.
fn appeared(came: bool) -> Kind {
    if came { Kind::Appeared } else { Kind::Vanished }
}

/// The most nodes and topics that are drawn.
const MOST: usize = 200;

/// A title for each node and topic that differs, and below it a row for each mission; times count from 0. `drawn` is
/// the mission of both.
pub(crate) fn pairs(
    missions: [&Mission; 2],
    subject: &DiffSubject,
    differing: &[Difference],
    drawn: &Mission,
) -> Timeline {
    let known = differing.iter().filter(|d| d.is_known);
    // An edge's name is that of both its ends.
    let names: BTreeSet<&str> = known.flat_map(|d| d.element.split(" → ")).collect();
    let all = NameFilter::default();
    let mut rows = Vec::new();
    for of in [of_nodes, of_topics] {
        let mut pairs: BTreeMap<Arc<str>, [Row; 2]> = BTreeMap::new();
        for (side, mission) in missions.iter().enumerate() {
            for row in of(&FigureSource::new(mission, &all, &all, false)) {
                if names.contains(&*row.name) {
                    let name = Arc::clone(&row.name);
                    pairs.entry(name).or_default()[side] = row;
                }
            }
        }
        for (name, pair) in pairs {
            rows.push(Row {
                labels: vec![name.to_string()],
                level: Level::Title,
                ..Row::default()
            });
            let most = pair.iter().filter_map(|row| row.hz).fold(0.0, f64::max);
            let is_topic = pair.iter().any(|row| row.topic.is_some());
            let subjects = [("A", &subject.first), ("B", &subject.second)];
            for ((row, mission), (side, subject)) in pair.into_iter().zip(missions).zip(subjects) {
                let hz = row.hz.filter(|_| most > 0.0);
                let share = hz.map_or(1.0, |hz| hz / most);
                let node = drawn.elements.node(&name).filter(|_| !is_topic);
                rows.push(Row {
                    labels: vec![format!("{side} {subject}")],
                    level: Level::Inside,
                    nodes: node.into_iter().collect(),
                    marks: Vec::new(),
                    topic: drawn.elements.topic(&name).filter(|_| is_topic),
                    ..moved(row, mission.span.start, share)
                });
            }
        }
    }
    rows.truncate(3 * MOST);
    Timeline {
        rows,
        ..Timeline::default()
    }
}

/// A row with its times counted from `start`, and its highest rate drawn as `share` of all.
fn moved(mut row: Row, start: Stamp, share: f64) -> Row {
    let bars = row.bars.iter_mut().map(|bar| {
        bar.share *= share;
        &mut bar.span
    });
    for span in row.lives.iter_mut().chain(bars) {
        *span = Span::new(Stamp(span.start.since(start)), Stamp(span.end.since(start)));
    }
    row
}
