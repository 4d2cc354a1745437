//! Events and windows: the changes between windows, each with the event that explains it; and, for missions of which only
//! windows are known, the log made from these changes.
//!
//! For example, `/nav` starts at 12.4 s and publishes `/plan`: in the window from 10 s to 20 s three elements were added, and
//! all three belong to the event of the node.

use std::collections::BTreeMap;

use super::drafts::sorted_by;
use super::{Detail, Event, EventId, EventLog, Kind};
use crate::base::time::{Span, Stamp};
use crate::graph::diff::{Change, ValueKind};
use crate::graph::history::Bound;
use crate::graph::{ById, Edge, Element, Elements, Graphs, Id as _, NodeId, TopicId};
use crate::mission::Window;

/// The changes of each window since the previous one, with the ids of the events that explain them.
pub(crate) fn explain(
    graphs: &Graphs,
    elements: &Elements,
    log: &EventLog,
) -> Vec<(Vec<Change>, Vec<EventId>)> {
    let times = EventTimes::new(log, elements);
    let spans = graphs.spans();
    let mut differ = vec![Differing::default(); spans.len()];
    for what in elements.all() {
        for (at, exists) in graphs.presence_changes(what) {
            let Differing { added, removed } = &mut differ[at];
            if exists { added } else { removed }.push(what);
        }
    }
    let window = |(at, differ): (usize, &Differing)| {
        let mut list = Vec::new();
        if let Some(old) = at.checked_sub(1).map(|old| spans[old]) {
            let span = spans[at];
            structure(differ, span, elements, &times, &mut list);
            let added = Span::new(old.end.max(span.start), span.end);
            list.extend(values(log, added));
        }
        list.into_iter().unzip()
    };
    differ.iter().enumerate().map(window).collect()
}

/// The elements that only this window has, and those that only the previous one has.
#[derive(Clone, Default)]
struct Differing {
    added: Vec<Element>,
    removed: Vec<Element>,
}

/// The times at which elements begin or end according to events, sorted.
struct EventTimes {
    begins: BTreeMap<Element, Vec<(Stamp, EventId)>>,
    ends: BTreeMap<Element, Vec<(Stamp, EventId)>>,
    /// Unnamed publishers and their publications, with their topics: they appear and vanish with the topic.
    unnamed: BTreeMap<Element, Element>,
}

impl EventTimes {
    fn new(log: &EventLog, elements: &Elements) -> Self {
        let (mut begins, mut ends) = (BTreeMap::new(), BTreeMap::new());
        let add = |to: &mut BTreeMap<Element, Vec<_>>, what, time, id| {
            to.entry(what).or_default().push((time, id));
        };
        for (id, event) in log.events.with_ids() {
            match event.kind {
                Kind::Started | Kind::Appeared => add(&mut begins, event.what, event.time, id),
                Kind::Stopped | Kind::Vanished => add(&mut ends, event.what, event.time, id),
                Kind::Restarted => {
                    let until = event.until.unwrap_or(event.time);
                    add(&mut begins, event.what, until, id);
                    add(&mut ends, event.what, event.time, id);
                }
                _ => {}
            }
        }
        for list in begins.values_mut().chain(ends.values_mut()) {
            list.sort_unstable();
        }
        Self {
            begins,
            ends,
            unnamed: unnamed(elements),
        }
    }

    /// The last event of a list before `end`, else its first.
    fn find(
        &self,
        list: &BTreeMap<Element, Vec<(Stamp, EventId)>>,
        what: Element,
        end: Stamp,
    ) -> Option<(Stamp, EventId)> {
        let topic = || list.get(self.unnamed.get(&what)?);
        let list = list.get(&what).or_else(topic)?;
        let next = list.partition_point(|(time, _)| *time < end);
        list.get(next.saturating_sub(1)).copied()
    }
}

/// The topics of unnamed publishers, and of their publications.
fn unnamed(elements: &Elements) -> BTreeMap<Element, Element> {
    let mut unnamed = BTreeMap::new();
    for (id, edge) in elements.publishes.with_ids() {
        for what in [Element::Publish(id), Element::Node(edge.node)] {
            if elements.evidence(what).is_timeless() {
                unnamed.insert(what, Element::Topic(edge.topic));
            }
        }
    }
    unnamed
}

fn structure(
    differ: &Differing,
    span: Span,
    elements: &Elements,
    times: &EventTimes,
    list: &mut Vec<(Change, EventId)>,
) {
    for what in differ.added.iter().copied() {
        let time = elements.seen(what).first.filter(|t| span.contains(*t));
        if let Some((at, id)) = times.find(&times.begins, what, span.end) {
            let time = time.or(Some(at).filter(|at| span.contains(*at)));
            list.push((Change::Added { what, time }, id));
        }
    }
    for what in differ.removed.iter().copied() {
        if let Some((at, id)) = times.find(&times.ends, what, span.end) {
            let time = Some(at).filter(|at| *at < span.end);
            list.push((Change::Removed { what, time }, id));
        }
    }
}

/// The changes of a window in events that are not about existence: rates, hand-overs, restarts, values.
fn values(log: &EventLog, added: Span) -> impl Iterator<Item = (Change, EventId)> + '_ {
    let inside = log.events.with_ids().filter(move |(_, e)| {
        let back = e.until.filter(|_| e.kind == Kind::Restarted);
        added.contains(back.unwrap_or(e.time))
    });
    inside.filter_map(|(id, event)| Some((change(event)?, id)))
}

/// The change in an event, unless it is about existence.
fn change(event: &Event) -> Option<Change> {
    let what = event.what;
    match (&event.detail, event.kind) {
        (Detail::Count(_), _) => None,
        (_, kind) if kind.is_remark() => None,
        (Detail::Rates { from_hz, to_hz }, _) => Some(Change::Rate {
            what,
            from_hz: *from_hz,
            to_hz: *to_hz,
        }),
        (Detail::Senders { from, to }, _) => match what {
            Element::Topic(topic) => Some(Change::HandedOver {
                topic,
                from: from.clone(),
                to: to.clone(),
            }),
            _ => None,
        },
        (Detail::Values { from, to }, kind) => Some(Change::Value {
            kind: ValueKind::from_word(kind.word()).unwrap_or(ValueKind::Lifecycle),
            what,
            from: from.clone(),
            to: to.clone(),
        }),
        (Detail::None, Kind::Restarted) => match what {
            Element::Node(node) => Some(Change::Restarted {
                node,
                time: event.until.unwrap_or(event.time),
            }),
            _ => None,
        },
        (Detail::None, _) => None,
    }
}

/// The ids of the events that explain the windows' changes, in a log that was made from them: for each change, the
/// nearest in time with the same kind and element.
pub(crate) fn places(log: &EventLog, windows: &[Window]) -> Vec<Vec<EventId>> {
    let mut of: BTreeMap<(Kind, Element), Vec<EventId>> = BTreeMap::new();
    for (id, event) in log.events.with_ids() {
        of.entry((event.kind, event.what)).or_default().push(id);
    }
    let time = |id: EventId| log.events[id].time;
    let place = |change: &Change, start: Stamp| {
        let (kind, what, ..) = described(change);
        let all = of.get(&(kind, what))?;
        let next = all.partition_point(|id| time(*id) < start);
        let near = all[next.saturating_sub(1)..].iter().take(2).copied();
        near.min_by_key(|id| time(*id).since(start).abs())
    };
    let of_window = |window: &Window| {
        let changes = window.changes.iter();
        changes
            .map(|c| place(c, window.span.start).unwrap_or_default())
            .collect()
    };
    windows.iter().map(of_window).collect()
}

// The log of a mission with known windows only: each change belongs to its window.

/// The log from the changes between windows. A change without a time inside its window is put at the window's start.
pub(crate) fn from_changes(elements: &Elements, windows: &[Window]) -> EventLog {
    let mut events = ById::default();
    for window in windows {
        let offset = events.len();
        let owners = WindowChanges::new(elements, window);
        let changes = window.changes.iter().enumerate();
        let all: ById<EventId, Event> = changes.map(|(at, one)| owners.event(at, one)).collect();
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
struct WindowChanges<'a> {
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

impl<'a> WindowChanges<'a> {
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

    fn event(&self, at: usize, change: &Change) -> Event {
        let (kind, what, time, detail) = described(change);
        let Span { start, end } = self.window.span;
        // The last sign of a node is not its end.
        let time = time.filter(|_| !matches!(change, Change::Removed { .. }));
        let time = time.filter(|t| self.window.span.contains(*t));
        let bound = Bound {
            time: time.unwrap_or(start),
            earliest: start,
            latest: end,
        };
        let whole = self.whole(change).filter(|whole| *whole != at);
        Event {
            detail,
            part_of: whole.map(EventId::of),
            ..Event::new(kind, what, bound)
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
                let cause = moved.get(&Element::Node(node));
                let cause = cause.or_else(|| self.handed.get(&topic));
                let cause = cause.or_else(|| self.restarted.get(&node)).copied();
                let is_subscribed = matches!(what, Element::Subscribe(_));
                let has_moved = is_subscribed && moved.contains_key(&Element::Topic(topic));
                cause.or_else(|| has_moved.then(|| self.topic_mover(topic, moved)).flatten())
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
        let again = |edge: &Edge| {
            let restarted = self.restarted.get(&edge.node);
            restarted.filter(|_| edge.topic == topic)
        };
        let other = self.handed.get(&topic);
        if let Some(at) = other.or_else(|| self.elements.publishes.iter().find_map(again)) {
            return Some(*at);
        }
        let (edge, node) = self.senders.get(&topic)?.first()?;
        let has_come = self.came.contains_key(edge);
        let moved = if has_come { &self.came } else { &self.went };
        let node = moved.get(&Element::Node(*node));
        node.or_else(|| moved.get(edge)).copied()
    }
}

/// The event for a change: its element, its time if known, and its values.
pub(crate) fn described(change: &Change) -> (Kind, Element, Option<Stamp>, Detail) {
    match change.clone() {
        Change::Added { what, time } if what.is_node() => (Kind::Started, what, time, Detail::None),
        Change::Added { what, time } => (Kind::Appeared, what, time, Detail::None),
        Change::Removed { what, time } if what.is_node() => {
            (Kind::Stopped, what, time, Detail::None)
        }
        Change::Removed { what, time } => (Kind::Vanished, what, time, Detail::None),
        Change::Rate {
            what,
            from_hz,
            to_hz,
        } => (Kind::Rate, what, None, Detail::Rates { from_hz, to_hz }),
        Change::HandedOver { topic, from, to } => {
            let detail = Detail::Senders { from, to };
            (Kind::HandedOver, Element::Topic(topic), None, detail)
        }
        Change::Restarted { node, time } => {
            let node = Element::Node(node);
            (Kind::Restarted, node, Some(time), Detail::None)
        }
        Change::Value {
            kind,
            what,
            from,
            to,
        } => {
            let kind = Kind::from_word(kind.word()).unwrap_or(Kind::Lifecycle);
            (kind, what, None, Detail::Values { from, to })
        }
    }
}
