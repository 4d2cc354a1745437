//! Two missions as one that can be drawn: the elements of both by role, and a log of the differences.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::notice::Notices;
use crate::base::time::{Period, Span, Stamp};
use crate::base::words;
use crate::evidence::{Confidence, Evidence};
use crate::gate::facts::Facts;
use crate::gate::pattern::Pattern;
use crate::graph::history::Sending;
use crate::graph::{
    ById, Edge, Element, ElementState, Elements, Existence, Graph, Node, NodeId, State, Topic,
};
use crate::mission::event_log::{Detail, Event, EventId, EventLog, Kind, sorted};
use crate::mission::{Mission, Window};

use super::{Difference, Where};

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

/// The elements of one mission, by role and topic.
#[derive(Default)]
struct MissionSide {
    nodes: BTreeMap<String, (Confidence, Evidence)>,
    topics: BTreeMap<String, TopicSeen>,
    publishes: BTreeMap<(String, String), (Confidence, Evidence)>,
    subscribes: BTreeMap<(String, String), (Confidence, Evidence)>,
}

#[derive(Clone)]
struct TopicSeen {
    evidence: Evidence,
    types: BTreeSet<String>,
    count: u64,
    hz: Option<f64>,
}

impl MissionSide {
    fn of(mission: &Mission) -> Self {
        let facts = Facts::new(mission);
        let mut seen = Self::default();
        let elements = &mission.elements;
        for (role, nodes) in facts.roles().filter(|(_, nodes)| !facts.is_tool(nodes)) {
            let evidence = nodes.iter().fold(Evidence::NONE, |all, id| {
                all.and(elements.nodes[*id].seen.evidence)
            });
            let confidence = if facts.is_sure(nodes) {
                Confidence::Stated
            } else {
                Confidence::Inferred
            };
            seen.nodes.insert(role.to_owned(), (confidence, evidence));
        }
        for id in facts.topics(&Pattern::new("**")) {
            let own = &elements.topics[id];
            let rates = facts.rates(id, true, mission.span);
            let count: u64 = rates.iter().map(|r| r.count).sum();
            let nanos: i64 = rates.iter().map(|r| r.span.nanos()).sum();
            let topic = TopicSeen {
                evidence: own.seen.evidence,
                types: own.types.iter().map(|t| (**t).to_owned()).collect(),
                count: facts.messages(id),
                hz: (nanos > 0).then(|| count as f64 / (nanos as f64 / 1e9)),
            };
            let name = facts.topic(id).to_owned();
            for (node, edge, confidence) in facts.publishers(id) {
                let evidence = elements.publishes[edge].seen.evidence;
                let key = (facts.role(node).to_owned(), name.clone());
                seen.publishes.insert(key, (confidence, evidence));
            }
            for (node, edge, confidence) in facts.subscribers(id) {
                let evidence = elements.subscribes[edge].seen.evidence;
                let key = (name.clone(), facts.role(node).to_owned());
                seen.subscribes.insert(key, (confidence, evidence));
            }
            seen.topics.insert(name, topic);
        }
        let nodes = &seen.nodes;
        seen.publishes
            .retain(|(node, _), _| nodes.contains_key(node));
        seen.subscribes
            .retain(|(_, node), _| nodes.contains_key(node));
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
    let at = Stamp(SECOND);
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
    let whole = Span::new(
        windows.first().map_or(at, |w| w.span.start),
        Stamp(2 * SECOND),
    );
    let events = UnionLog {
        a: &a,
        b: &b,
        elements: &elements,
        differing,
        turned: turned(differing),
        at,
        events: ById::default(),
    };
    let period = Period::from_nanos(SECOND).unwrap_or(first.period);
    Mission {
        bags: first.bags.iter().chain(&second.bags).cloned().collect(),
        span: whole,
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
    let nodes: BTreeMap<&String, Evidence> = both(&a.nodes, &b.nodes);
    let topics: BTreeSet<&String> = a.topics.keys().chain(b.topics.keys()).collect();
    let nodes = nodes.into_iter().map(|(name, evidence)| Node {
        name: name.as_str().into(),
        role: name.as_str().into(),
        seen: Existence::of(evidence),
    });
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
    let edge = |node: &String, topic: &String, evidence: Evidence| {
        Some(Edge {
            node: ends.node(node)?,
            topic: ends.topic(topic)?,
            seen: Existence::of(evidence),
        })
    };
    let publishes = both(&a.publishes, &b.publishes).into_iter();
    let publishes = publishes.filter_map(|((node, topic), e)| edge(node, topic, e));
    let subscribes = both(&a.subscribes, &b.subscribes).into_iter();
    let subscribes = subscribes.filter_map(|((topic, node), e)| edge(node, topic, e));
    Elements {
        publishes: publishes.collect(),
        subscribes: subscribes.collect(),
        ..ends
    }
}

/// The keys of both maps with their combined evidence.
fn both<'a, K: Ord>(
    a: &'a BTreeMap<K, (Confidence, Evidence)>,
    b: &'a BTreeMap<K, (Confidence, Evidence)>,
) -> BTreeMap<&'a K, Evidence> {
    let mut all: BTreeMap<&K, Evidence> = BTreeMap::new();
    for (key, (_, evidence)) in a.iter().chain(b) {
        let slot = all.entry(key).or_insert(Evidence::NONE);
        *slot = slot.and(*evidence);
    }
    all
}

fn graph(elements: &Elements, seen: &MissionSide) -> Graph {
    let state = |what: Element| {
        let (node, topic) = elements.names(what);
        let names = |a: Option<&str>, b: Option<&str>| Some((a?.to_owned(), b?.to_owned()));
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
            Element::Publish(_) => seen.publishes.get(&names(node, topic)?),
            Element::Subscribe(_) => seen.subscribes.get(&names(topic, node)?),
        };
        Some(ElementState::new(what, State::default(), known?.0))
    };
    Graph {
        states: elements.all().filter_map(state).collect(),
    }
}

/// The log under construction.
struct UnionLog<'a> {
    a: &'a MissionSide,
    b: &'a MissionSide,
    elements: &'a Elements,
    differing: &'a [Difference],
    turned: Turned<'a>,
    at: Stamp,
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
        let hz = |seen: &MissionSide| seen.topics.get(&difference.element).and_then(|t| t.hz);
        if let ("rate", Some(from_hz), Some(to_hz)) = (difference.kind, hz(self.a), hz(self.b)) {
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
            time: self.at,
            earliest: self.at,
            latest: self.at,
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
