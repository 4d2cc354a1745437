//! The log of a mission with known windows only: each change belongs to its window.

use std::collections::BTreeMap;

use super::make::sorted_by;
use super::{Detail, Event, EventId, EventLog, Kind};
use crate::base::time::{Span, Stamp};
use crate::evidence::{Confidence, Evidence};
use crate::graph::diff::{Change, ValueKind};
use crate::graph::{ById, Edge, Element, Elements, Id as _, NodeId, TopicId};
use crate::mission::Window;

/// The log from the changes between windows. A change without a time inside its window is put at the window's start.
pub(crate) fn from_changes(elements: &Elements, windows: &[Window]) -> EventLog {
    let mut events = ById::default();
    for window in windows {
        let offset = events.len();
        let owners = WindowTurns::new(elements, window);
        let all: ById<EventId, Event> = owners.events().collect();
        for event in &all {
            let whole = event.part_of.map(|id| whole(&all, id));
            let part_of = whole.map(|id| EventId::of(offset + id.at()));
            events.push(Event {
                part_of,
                ..event.clone()
            });
        }
    }
    EventLog {
        events: sorted_by(events, |event| event.what).0,
        ..EventLog::default()
    }
}

/// The outermost event that explains this one: parts have no parts.
fn whole(events: &ById<EventId, Event>, mut id: EventId) -> EventId {
    // A topic may belong to a publication, and that to a node or a hand-over.
    for _ in 0..3 {
        id = events[id].part_of.unwrap_or(id);
    }
    id
}

/// The elements that appeared or vanished in one window, and their relations.
struct WindowTurns<'a> {
    elements: &'a Elements,
    window: &'a Window,
    /// The elements that appeared, with the indices of their changes; `went` has those that vanished.
    came: BTreeMap<Element, usize>,
    went: BTreeMap<Element, usize>,
    restarted: BTreeMap<NodeId, usize>,
    handed: BTreeMap<TopicId, usize>,
    /// The publications that appeared or vanished, per topic.
    senders: BTreeMap<TopicId, Vec<(Element, NodeId)>>,
}

impl<'a> WindowTurns<'a> {
    fn new(elements: &'a Elements, window: &'a Window) -> Self {
        let mut owners = Self {
            elements,
            window,
            came: BTreeMap::new(),
            went: BTreeMap::new(),
            restarted: BTreeMap::new(),
            handed: BTreeMap::new(),
            senders: BTreeMap::new(),
        };
        for (at, change) in window.changes.iter().enumerate() {
            match change {
                Change::Added { what, .. } => owners.came.insert(*what, at),
                Change::Removed { what, .. } => owners.went.insert(*what, at),
                Change::Restarted { node, .. } => owners.restarted.insert(*node, at),
                Change::HandedOver { topic, .. } => owners.handed.insert(*topic, at),
                Change::Rate { .. } | Change::Value { .. } => None,
            };
            if let Change::Added { what, .. } | Change::Removed { what, .. } = change
                && let (Element::Publish(_), Some((node, topic))) = (what, owners.edge(*what))
            {
                let all = owners.senders.entry(topic).or_default();
                all.push((*what, node));
            }
        }
        owners
    }

    fn edge(&self, what: Element) -> Option<(NodeId, TopicId)> {
        let (node, topic) = self.elements.ends(what);
        node.zip(topic)
    }

    fn events(&self) -> impl Iterator<Item = Event> + '_ {
        let changes = self.window.changes.iter().enumerate();
        changes.map(|(at, change)| self.event(at, change))
    }

    fn event(&self, at: usize, change: &Change) -> Event {
        let (kind, what, time, detail) = described(change);
        // The last sign of a node is not its end.
        let time = time.filter(|_| !matches!(change, Change::Removed { .. }));
        let time = time.filter(|t| self.window.span.contains(*t));
        let whole = self.whole(change).filter(|whole| *whole != at);
        let Span { start, end } = self.window.span;
        let time = time.unwrap_or(start);
        Event {
            kind,
            what,
            time,
            earliest: start,
            latest: end,
            until: None,
            detail,
            confidence: Confidence::Measured,
            evidence: Evidence::NONE,
            part_of: whole.map(EventId::of),
            quiet: false,
            weight: 1,
        }
    }

    /// The index of the change that explains this one, if any.
    fn whole(&self, change: &Change) -> Option<usize> {
        match change {
            Change::Added { what, .. } => self.mover(*what, &self.came),
            Change::Removed { what, .. } => self.mover(*what, &self.went),
            Change::Rate { what, .. } => self.sender(*what),
            Change::HandedOver { .. } | Change::Restarted { .. } | Change::Value { .. } => None,
        }
    }

    /// The place of the change that explains an added or removed element: a node its edges and topics, a hand-over its
    /// publications.
    fn mover(&self, what: Element, moved: &BTreeMap<Element, usize>) -> Option<usize> {
        match what {
            Element::Node(_) => None,
            Element::Publish(_) | Element::Subscribe(_) => {
                let (node, topic) = self.edge(what)?;
                let handed = || self.handed.get(&topic).copied();
                let restarted = || self.restarted.get(&node).copied();
                let with_topic = || {
                    let has_moved = moved.contains_key(&Element::Topic(topic));
                    has_moved.then(|| self.topic_mover(topic, moved)).flatten()
                };
                let with_node = moved.get(&Element::Node(node)).copied();
                with_node
                    .or_else(handed)
                    .or_else(restarted)
                    .or_else(|| match what {
                        Element::Subscribe(_) => with_topic(),
                        _ => None,
                    })
            }
            Element::Topic(topic) => self.topic_mover(topic, moved),
        }
    }

    /// The index of the change of the node with which a topic appeared or vanished, else of the publication.
    fn topic_mover(&self, topic: TopicId, moved: &BTreeMap<Element, usize>) -> Option<usize> {
        let senders = self.senders.get(&topic).into_iter().flatten();
        let mut senders = senders.filter(|(edge, _)| moved.contains_key(edge));
        if let Some((edge, node)) = senders.next() {
            let node = moved.get(&Element::Node(*node));
            return node.or_else(|| moved.get(edge)).copied();
        }
        let listeners = moved.keys().filter_map(|what| match what {
            Element::Subscribe(_) => self.edge(*what).filter(|edge| edge.1 == topic),
            _ => None,
        });
        let nodes = listeners.filter_map(|edge| moved.get(&Element::Node(edge.0)));
        nodes.copied().next()
    }

    /// The index of the change that explains a rate change: a publisher that started, stopped or restarted, or other
    /// publishers.
    fn sender(&self, what: Element) -> Option<usize> {
        let topic = match what {
            Element::Topic(topic) => topic,
            _ => self.edge(what)?.1,
        };
        if let Some(at) = self.handed.get(&topic) {
            return Some(*at);
        }
        let again = |edge: &Edge| {
            self.restarted
                .get(&edge.node)
                .filter(|_| edge.topic == topic)
        };
        if let Some(at) = self.elements.publishes.iter().find_map(again) {
            return Some(*at);
        }
        let (edge, node) = self.senders.get(&topic).and_then(|all| all.first())?;
        let moved = if self.came.contains_key(edge) {
            &self.came
        } else {
            &self.went
        };
        let node = moved.get(&Element::Node(*node));
        node.or_else(|| moved.get(edge)).copied()
    }
}

/// The event for a change: its element, its time if known, and its values.
pub(crate) fn described(change: &Change) -> (Kind, Element, Option<Stamp>, Detail) {
    let is_node = |what: &Element| what.is_node();
    match change {
        Change::Added { what, time } if is_node(what) => {
            (Kind::Started, *what, *time, Detail::None)
        }
        Change::Added { what, time } => (Kind::Appeared, *what, *time, Detail::None),
        Change::Removed { what, time } if is_node(what) => {
            (Kind::Stopped, *what, *time, Detail::None)
        }
        Change::Removed { what, time } => (Kind::Vanished, *what, *time, Detail::None),
        Change::Rate {
            what,
            from_hz,
            to_hz,
        } => {
            let (from_hz, to_hz) = (*from_hz, *to_hz);
            (Kind::Rate, *what, None, Detail::Rates { from_hz, to_hz })
        }
        Change::HandedOver { topic, from, to } => {
            let (from, to) = (from.clone(), to.clone());
            let detail = Detail::Senders { from, to };
            (Kind::HandedOver, Element::Topic(*topic), None, detail)
        }
        Change::Restarted { node, time } => {
            let node = Element::Node(*node);
            (Kind::Restarted, node, Some(*time), Detail::None)
        }
        Change::Value {
            kind,
            what,
            from,
            to,
        } => {
            let (from, to) = (from.clone(), to.clone());
            (value(*kind), *what, None, Detail::Values { from, to })
        }
    }
}

fn value(kind: ValueKind) -> Kind {
    match kind {
        ValueKind::Lifecycle => Kind::Lifecycle,
        ValueKind::Type => Kind::Type,
        ValueKind::Qos => Kind::Qos,
    }
}
