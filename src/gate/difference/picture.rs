//! Two missions as one that is drawn: the elements of both by role, a log of the differences, and below the picture the
//! lifelines of everything that differs, one mission above the other, aligned at the first messages.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{DiffSubject, Difference, Where};
use crate::base::notice::Notices;
use crate::base::time::{Period, Span, Stamp};
use crate::base::words;
use crate::draw::timeline::Timeline;
use crate::draw::timeline::rows::{Level, Row, of_nodes, of_topics};
use crate::draw::timeline::source::FigureSource;
use crate::evidence::{Confidence, Evidence};
use crate::gate::facts::{Facts, Peer, Rate, TopicIn};
use crate::gate::values::Pattern;
use crate::graph::history::Sending;
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

/// The length of a window of the picture in nanoseconds, without meaning.
const SECOND: i64 = 1_000_000_000;
/// The time of all events of the picture, without meaning.
const AT: Stamp = Stamp(SECOND);

/// The elements of one mission, by role and topic.
#[derive(Default)]
struct MissionSide {
    nodes: BTreeMap<String, Seen>,
    topics: BTreeMap<String, TopicSeen>,
    publishes: BTreeMap<EdgeNames, Seen>,
    subscribes: BTreeMap<EdgeNames, Seen>,
}

/// What is known of a node or an edge.
#[derive(Clone, Copy)]
struct Seen {
    confidence: Confidence,
    evidence: Evidence,
}

impl From<Peer> for Seen {
    fn from(peer: Peer) -> Self {
        Self {
            confidence: peer.confidence,
            evidence: peer.evidence,
        }
    }
}

#[derive(Clone)]
struct TopicSeen {
    evidence: Evidence,
    types: BTreeSet<String>,
    count: u64,
    hz: Option<f64>,
}

/// The names of an edge's ends in its direction.
type EdgeNames = [String; 2];

impl MissionSide {
    fn of(mission: &Mission) -> Self {
        let facts = &Facts::new(mission);
        let mut seen = Self::default();
        let elements = &mission.elements;
        for role in facts.roles().filter(|role| !facts.is_tool(role.nodes)) {
            let all = role
                .nodes
                .iter()
                .map(|id| elements.nodes[*id].seen.evidence);
            let confidence = if facts.is_sure(role.nodes) {
                Confidence::Stated
            } else {
                Confidence::Inferred
            };
            let node = Seen {
                confidence,
                evidence: all.fold(Evidence::NONE, Evidence::and),
            };
            seen.nodes.insert(role.name.to_owned(), node);
        }
        for id in facts.topics(&Pattern::new("**")) {
            let own = TopicIn { facts, id };
            let rates = own.rates(true);
            let nanos: i64 = rates.iter().map(|r| r.span.nanos()).sum();
            let topic = TopicSeen {
                evidence: elements.topics[id].seen.evidence,
                types: own.types(),
                count: facts.messages(id),
                hz: (nanos > 0).then(|| Rate::mean_hz(&rates)),
            };
            let name = facts.topic(id);
            for peer in facts.publishers(id) {
                let key = [facts.role(peer.node), name].map(str::to_owned);
                seen.publishes.insert(key, peer.into());
            }
            for peer in facts.subscribers(id) {
                let key = [name, facts.role(peer.node)].map(str::to_owned);
                seen.subscribes.insert(key, peer.into());
            }
            seen.topics.insert(name.to_owned(), topic);
        }
        let nodes = &seen.nodes;
        seen.publishes
            .retain(|[node, _], _| nodes.contains_key(node));
        seen.subscribes
            .retain(|[_, node], _| nodes.contains_key(node));
        seen
    }
}

/// The mission of both. An element without evidence in one mission is drawn as the other has it.
pub(crate) fn union(
    first: &Mission,
    second: &Mission,
    differing: &[Difference],
    side: Side,
) -> Mission {
    let (a, b) = (MissionSide::of(first), MissionSide::of(second));
    let elements = elements(&a, &b);
    let span = |from: i64| Span::new(Stamp(from), Stamp(from + SECOND));
    let window = |index: usize, span: Span, seen: &MissionSide| Window {
        index,
        span,
        partial: false,
        messages: seen.topics.values().map(|t| t.count).sum(),
        changes: Vec::new(),
        events: Vec::new(),
    };
    let shown = match side {
        Side::Each => vec![(span(0), &a), (span(SECOND), &b)],
        Side::Both => vec![(span(SECOND), &b)],
    };
    let windows = shown.iter().enumerate();
    let windows: Vec<Window> = windows
        .map(|(at, (span, seen))| window(at, *span, seen))
        .collect();
    let graphs = shown
        .iter()
        .map(|(span, seen)| (*span, graph(&elements, seen)));
    let graphs = graphs.collect();
    let start = windows.first().map_or(AT, |w| w.span.start);
    let events = UnionLog {
        sides: [&a, &b],
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
            events: sorted(events.all(), &elements).0,
            compares: true,
            ..EventLog::default()
        },
        elements,
        windows,
        graphs,
        sending: Sending::default(),
        undrawn: Vec::new(),
        layout: None,
        notices: Notices::new(),
    }
}

fn elements(a: &MissionSide, b: &MissionSide) -> Elements {
    let nodes = both(&a.nodes, &b.nodes).into_iter();
    let nodes = nodes.map(|(name, evidence)| Node {
        name: name.as_str().into(),
        role: name.as_str().into(),
        seen: Existence::of(evidence),
    });
    let topics: BTreeSet<&String> = a.topics.keys().chain(b.topics.keys()).collect();
    let topics = topics.into_iter().map(|name| {
        let own = [a.topics.get(name), b.topics.get(name)];
        let own = || own.into_iter().flatten();
        let types: BTreeSet<&String> = own().flat_map(|t| &t.types).collect();
        Topic {
            name: name.as_str().into(),
            types: types.into_iter().map(|t| t.as_str().into()).collect(),
            seen: Existence::of(own().fold(Evidence::NONE, |all, t| all.and(t.evidence))),
            ..Topic::default()
        }
    });
    let ends = Elements {
        nodes: nodes.collect(),
        topics: topics.collect(),
        ..Elements::default()
    };
    let edge = |node: &str, topic: &str, evidence: Evidence| {
        Some(Edge {
            node: ends.node(node)?,
            topic: ends.topic(topic)?,
            seen: Existence::of(evidence),
        })
    };
    let publishes = both(&a.publishes, &b.publishes).into_iter();
    let publishes = publishes.filter_map(|([node, topic], e)| edge(node, topic, e));
    let subscribes = both(&a.subscribes, &b.subscribes).into_iter();
    let subscribes = subscribes.filter_map(|([topic, node], e)| edge(node, topic, e));
    Elements {
        publishes: publishes.collect(),
        subscribes: subscribes.collect(),
        ..ends
    }
}

/// The keys of both maps with their combined evidence.
fn both<'a, K: Ord>(
    a: &'a BTreeMap<K, Seen>,
    b: &'a BTreeMap<K, Seen>,
) -> BTreeMap<&'a K, Evidence> {
    let mut all: BTreeMap<&K, Evidence> = BTreeMap::new();
    for (key, seen) in a.iter().chain(b) {
        let slot = all.entry(key).or_insert(Evidence::NONE);
        *slot = slot.and(seen.evidence);
    }
    all
}

fn graph(elements: &Elements, seen: &MissionSide) -> Graph {
    let state = |what: Element| {
        let (node, topic) = elements.names(what);
        let known = match what {
            Element::Node(_) => seen.nodes.get(node?),
            Element::Topic(_) => {
                let topic = seen.topics.get(topic?)?;
                return Some(ElementState {
                    count: Some(topic.count),
                    hz: topic.hz,
                    ..ElementState::new(what, State::default(), Confidence::default())
                });
            }
            Element::Publish(_) => seen.publishes.get(&[node?, topic?].map(str::to_owned)),
            Element::Subscribe(_) => seen.subscribes.get(&[topic?, node?].map(str::to_owned)),
        };
        let confidence = known?.confidence;
        Some(ElementState::new(what, State::default(), confidence))
    };
    Graph {
        states: elements.all().filter_map(state).collect(),
    }
}

/// The log under construction.
struct UnionLog<'a> {
    sides: [&'a MissionSide; 2],
    elements: &'a Elements,
    differing: &'a [Difference],
    turned: Turned<'a>,
    events: ById<EventId, Event>,
}

/// Whether an element appeared (true) or vanished (false), by kind and name.
type Turned<'a> = BTreeMap<(&'static str, &'a str), bool>;

/// The elements in only one mission that would be observable in the other.
fn turned(differing: &[Difference]) -> Turned<'_> {
    let known = differing
        .iter()
        .filter(|d| d.is_known && d.side != Where::Both);
    known
        .map(|d| ((d.kind, d.name.as_str()), d.side == Where::Second))
        .collect()
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
            "rate" => (Kind::Rate, topic),
            "type" => (Kind::Type, topic),
            "qos" => (Kind::Qos, topic),
            "event" | "time" | "begin" | "end" | "lifecycle" | "restarts" => {
                (Kind::Lifecycle, node.or(topic))
            }
            _ => return,
        };
        if let (Some(what), true) = (what, difference.is_known) {
            self.add(kind, what, self.values(difference), None);
        }
    }

    /// The different values.
    fn values(&self, difference: &Difference) -> Detail {
        let topics = self.sides.map(|side| side.topics.get(&difference.element));
        if let ("rate", [Some(from_hz), Some(to_hz)]) =
            (difference.kind, topics.map(|topic| topic?.hz))
        {
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

    fn add(
        &mut self,
        kind: Kind,
        what: Element,
        detail: Detail,
        part_of: Option<EventId>,
    ) -> EventId {
        self.events.push(Event {
            kind,
            what,
            time: AT,
            earliest: AT,
            latest: AT,
            until: None,
            detail,
            confidence: Confidence::Measured,
            evidence: self.elements.evidence(what),
            part_of,
            quiet: false,
            weight: 1,
        })
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
                let hz = row.hz.unwrap_or(0.0);
                rows.push(Row {
                    labels: vec![format!("{side} {subject}")],
                    level: Level::Inside,
                    nodes: drawn
                        .elements
                        .node(&name)
                        .filter(|_| !is_topic)
                        .into_iter()
                        .collect(),
                    marks: Vec::new(),
                    topic: drawn.elements.topic(&name).filter(|_| is_topic),
                    ..moved(
                        row,
                        mission.span.start,
                        if most > 0.0 { hz / most } else { 1.0 },
                    )
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
