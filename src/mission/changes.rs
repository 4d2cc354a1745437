//! The changes from each window to the next, each with the event that explains it; and, for missions of which only windows are
//! known, the changes between their graphs, and the log made from these.
//!
//! For example, `/nav` starts at 12.4 s and publishes `/plan`: in the window from 10 s to 20 s three elements were added, and
//! all three belong to the event of the node.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::Window;
use super::event_log::{Detail, Event, EventId, EventLog, Kind, sorted_by};
use crate::base::time::{Span, Stamp};
use crate::graph::diff::{Diff, diff};
use crate::graph::history::Bound;
use crate::graph::{
    ById, Element, ElementState, Elements, Graph, Graphs, Id as _, NodeId, State, TopicId,
};

/// A change from one window to the next: that of the event to which it belongs, as far as the window shows it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Change {
    /// The kind of the event; of edges and topics that begin or end with a node, [`Kind::Appeared`] or [`Kind::Vanished`].
    pub kind: Kind,
    /// The element.
    pub what: Element,
    /// The time of an appeared element's first sign in the window, of a vanished one's last sign, or of a node's first sign
    /// after a restart, if known.
    pub time: Option<Stamp>,
    /// The values before and after.
    pub detail: Detail,
}

impl Change {
    fn new(kind: Kind, what: Element, time: Option<Stamp>) -> Self {
        Self {
            kind,
            what,
            time,
            detail: Detail::None,
        }
    }

    /// An element that was not in the previous window.
    fn added(what: Element, time: Option<Stamp>) -> Self {
        let kind = if what.is_node() {
            Kind::Started
        } else {
            Kind::Appeared
        };
        Self::new(kind, what, time)
    }

    /// An element that was in the previous window and is not in this one.
    fn removed(what: Element, time: Option<Stamp>) -> Self {
        let kind = if what.is_node() {
            Kind::Stopped
        } else {
            Kind::Vanished
        };
        Self::new(kind, what, time)
    }

    fn with(self, detail: Detail) -> Self {
        Self { detail, ..self }
    }

    /// Whether the element was not in the previous window.
    pub fn is_added(&self) -> bool {
        matches!(self.kind, Kind::Started | Kind::Appeared)
    }

    /// Whether the element was in the previous window and is not in this one.
    pub fn is_removed(&self) -> bool {
        matches!(self.kind, Kind::Stopped | Kind::Vanished)
    }

    /// The word for its kind in JSON and tables: `added` and `removed` for any element, else that of the event.
    pub fn word(&self) -> &'static str {
        match self.kind {
            _ if self.is_added() => "added",
            _ if self.is_removed() => "removed",
            kind => kind.word(),
        }
    }
}

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
            list.push((Change::added(what, time), id));
        }
    }
    for what in differ.removed.iter().copied() {
        if let Some((at, id)) = times.find(&times.ends, what, span.end) {
            let time = Some(at).filter(|at| *at < span.end);
            list.push((Change::removed(what, time), id));
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
    let is_change = match (&event.detail, event.what) {
        (Detail::Count { .. }, _) => false,
        (Detail::Rates { .. } | Detail::Values { .. }, _) => true,
        (Detail::Senders { .. }, what) => what.is_topic(),
        (Detail::None, what) => event.kind == Kind::Restarted && what.is_node(),
    };
    let back = event.until.unwrap_or(event.time);
    let time = Some(back).filter(|_| event.kind == Kind::Restarted);
    let change = Change::new(event.kind, event.what, time).with(event.detail.clone());
    (is_change && !event.kind.is_remark()).then_some(change)
}

// The log of a mission with known windows only: each change belongs to its window.

/// The log from the changes between windows, and the event of each of a window's changes. A change without a time inside its
/// window is put at the window's start.
pub(crate) fn logged(elements: &Elements, windows: &[Window]) -> (EventLog, Vec<Vec<EventId>>) {
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
    let (events, ids) = sorted_by(events, |event| event.what);
    let mut ids = ids.into_iter();
    let of_windows = windows.iter().map(|window| window.changes.len());
    let of_windows = of_windows.map(|many| ids.by_ref().take(many).collect());
    let of_windows = of_windows.collect();
    let log = EventLog {
        events,
        ..EventLog::default()
    };
    (log, of_windows)
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
            handed: BTreeMap::new(),
            senders: BTreeMap::new(),
        };
        for (at, change) in window.changes.iter().enumerate() {
            let what = change.what;
            match (change.kind, what) {
                _ if change.is_added() => owners.came.insert(what, at),
                _ if change.is_removed() => owners.went.insert(what, at),
                (Kind::HandedOver, Element::Topic(topic)) => owners.handed.insert(topic, at),
                _ => None,
            };
            if (change.is_added() || change.is_removed())
                && let (Element::Publish(_), Some((node, topic))) = (what, owners.edge(what))
            {
                let all = owners.senders.entry(topic).or_default();
                all.push((what, node));
            }
        }
        owners
    }

    fn edge(&self, what: Element) -> Option<(NodeId, TopicId)> {
        let (node, topic) = self.elements.ends(what);
        node.zip(topic)
    }

    fn event(&self, at: usize, change: &Change) -> Event {
        let Span { start, end } = self.window.span;
        // The last sign of a node is not its end.
        let time = change.time.filter(|_| !change.is_removed());
        let time = time.filter(|t| self.window.span.contains(*t));
        let bound = Bound {
            time: time.unwrap_or(start),
            earliest: start,
            latest: end,
        };
        let whole = self.whole(change).filter(|whole| *whole != at);
        Event {
            detail: change.detail.clone(),
            part_of: whole.map(EventId::of),
            ..Event::new(change.kind, change.what, bound)
        }
    }

    /// The index of the change that explains this one, if any.
    fn whole(&self, change: &Change) -> Option<usize> {
        match change.kind {
            _ if change.is_added() => self.mover(change.what, &self.came),
            _ if change.is_removed() => self.mover(change.what, &self.went),
            Kind::Rate => self.sender(change.what),
            _ => None,
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
                let cause = cause.or_else(|| self.handed.get(&topic)).copied();
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

    /// The index of the change that explains a rate change: other publishers, or one that started or stopped.
    fn sender(&self, what: Element) -> Option<usize> {
        let topic = match what {
            Element::Topic(topic) => topic,
            _ => self.edge(what)?.1,
        };
        if let Some(at) = self.handed.get(&topic) {
            return Some(*at);
        }
        let (edge, node) = self.senders.get(&topic)?.first()?;
        let has_come = self.came.contains_key(edge);
        let moved = if has_come { &self.came } else { &self.went };
        let node = moved.get(&Element::Node(*node));
        node.or_else(|| moved.get(edge)).copied()
    }
}

// Reconfigurations from differences: thresholds for rates, hand-overs, and hints from the evidence.

/// The default share by which a rate must change to count as changed: nodes under load vary by a tenth, and a camera that is switched
/// to another mode changes by a third at least.
pub(crate) const RATE_CHANGE: f64 = 0.25;

/// A finder of the reconfigurations of a mission, window by window in order.
#[derive(Debug)]
pub(crate) struct Changes<'a> {
    elements: &'a Elements,
    /// The share by which a rate must change, ≥ 0.
    threshold: f64,
    before: Option<(Span, Graph)>,
    /// The interval in which each topic had publishers: from their first sign to the last.
    sent: ById<TopicId, (Option<Stamp>, Option<Stamp>)>,
    /// The nodes that last sent messages on each topic.
    senders: ById<TopicId, BTreeSet<NodeId>>,
}

impl<'a> Changes<'a> {
    /// A finder before the first window.
    pub(crate) fn new(elements: &'a Elements, threshold: f64) -> Self {
        Self {
            elements,
            threshold,
            before: None,
            sent: sent(elements),
            senders: ById::like(&elements.topics, BTreeSet::new()),
        }
    }

    /// The changes from the previous window to this one; none in the first, which is the base.
    ///
    /// Order: added, removed, rates, hand-overs, values; each by kind of element and name.
    pub(crate) fn next(&mut self, span: Span, graph: &Graph) -> Vec<Change> {
        let mut changes = Vec::new();
        if let Some((old_span, old)) = self.before.take() {
            let diff = diff(&old, graph);
            let seen = |what| self.elements.seen(what);
            changes.extend(diff.added.iter().map(|state| {
                let first = seen(state.what).first.filter(|t| span.contains(*t));
                Change::added(state.what, first)
            }));
            changes.extend(diff.removed.iter().map(|what| {
                let last = seen(*what).last.filter(|t| *t < span.end);
                Change::removed(*what, last)
            }));
            self.rates(&diff, graph, (old_span, span), &mut changes);
            self.handed_over(&old, graph, &mut changes);
            lifecycles(&diff, &mut changes);
        } else {
            self.handed_over(graph, graph, &mut Vec::new());
        }
        self.before = Some((span, graph.clone()));
        changes.retain(|change| !self.is_timeless(change));
        changes
    }

    /// Whether none of the evidence for an added or removed element has times.
    fn is_timeless(&self, change: &Change) -> bool {
        let is_existence = change.is_added() || change.is_removed();
        is_existence && self.elements.evidence(change.what).is_timeless()
    }

    fn rates(&self, diff: &Diff, graph: &Graph, spans: (Span, Span), changes: &mut Vec<Change>) {
        let mut steady = BTreeSet::new();
        let shared = self.shared(graph);
        for (old, new) in &diff.changed {
            let is_rated = match new.what {
                Element::Topic(id) => {
                    let secs = [spans.0, spans.1].map(|span| self.present(new.what, span));
                    let is_steady = is_steady(old, secs[0]) && is_steady(new, secs[1]);
                    is_steady && steady.insert(id)
                }
                Element::Publish(id) => {
                    let topic = self.elements.publishes[id].topic;
                    // With one publisher the topic's own change is sufficient.
                    shared.contains(&topic) && steady.contains(&topic)
                }
                Element::Node(_) | Element::Subscribe(_) => false,
            };
            if is_rated {
                changes.extend(self.rate(new.what, (old.hz, new.hz), spans));
            }
        }
    }

    /// The change of a rate, if it is one.
    fn rate(
        &self,
        what: Element,
        hz: (Option<f64>, Option<f64>),
        spans: (Span, Span),
    ) -> Option<Change> {
        let (from_hz, to_hz) = (hz.0?, hz.1?);
        let secs = self.present(what, spans.0).min(self.present(what, spans.1));
        let change = Change::new(Kind::Rate, what, None);
        let change = change.with(Detail::Rates { from_hz, to_hz });
        rate_differs(from_hz, to_hz, secs, self.threshold).then_some(change)
    }

    /// The number of seconds of a window between an element's first and last sign.
    fn present(&self, what: Element, span: Span) -> f64 {
        let (first, last) = match what {
            Element::Topic(id) => self.sent[id],
            other => {
                let other = self.elements.seen(other);
                (other.first, other.last)
            }
        };
        let start = first.map_or(span.start, |at| at.max(span.start));
        let end = last.map_or(span.end, |at| at.plus(1).min(span.end));
        end.since(start).max(0) as f64 / 1e9
    }

    /// Topics with more than one publisher in this graph.
    fn shared(&self, graph: &Graph) -> BTreeSet<TopicId> {
        let mut seen = BTreeSet::new();
        let topics = graph.publishes();
        let topics = topics.map(|(id, _)| self.elements.publishes[id].topic);
        topics.filter(|topic| !seen.insert(*topic)).collect()
    }

    /// Adds hand-overs: a topic is taken over if none of the nodes that publish it now were the last to
    /// publish it.
    fn handed_over(&mut self, before: &Graph, after: &Graph, changes: &mut Vec<Change>) {
        for (topic, to) in self.sending(after).with_ids() {
            if to.is_empty() {
                continue;
            }
            let from = std::mem::replace(&mut self.senders[topic], to.clone());
            let other = !from.is_empty() && from.is_disjoint(to);
            if other
                && before.get(Element::Topic(topic)).is_some()
                && !self.elements.topics[topic].is_shared()
            {
                let (from, to) = (from.into_iter().collect(), to.iter().copied().collect());
                let change = Change::new(Kind::HandedOver, Element::Topic(topic), None);
                changes.push(change.with(Detail::Senders { from, to }));
            }
        }
    }

    /// The nodes that sent messages on each topic in a window.
    fn sending(&self, graph: &Graph) -> ById<TopicId, BTreeSet<NodeId>> {
        let mut sending = ById::like(&self.elements.topics, BTreeSet::new());
        for (id, _) in graph.publishes().filter(|(_, s)| s.messages() > 0) {
            let edge = &self.elements.publishes[id];
            sending[edge.topic].insert(edge.node);
        }
        sending
    }
}

/// The fewest messages in the busier of two windows for a meaningful rate: of three or fewer, one that falls into the next window is
/// a change by a third.
const FEW: f64 = 3.5;

/// The ratio of the longest gap to the median period from which on a topic counts as irregular: two lost messages in a row make three.
const UNSTEADY: f64 = 4.0;

/// The share of the time that the median period must cover, message by message, for a topic to be regular. Topics that send bursts
/// cover a few hundredths; with a third of the messages lost, an even one still covers two thirds.
const COVERED: f64 = 0.6;

/// Whether a rate changed: by more than the share `threshold` of its earlier value, by more than the two
/// messages that two windows of the same jittering topic may differ by, and not on a topic too slow for
/// windows of `secs` seconds.
fn rate_differs(from: f64, to: f64, secs: f64, threshold: f64) -> bool {
    let by = (to - from).abs();
    by > threshold * from && by * secs > 2.2 && from.max(to) * secs > FEW
}

/// Whether a topic has a steady rate in a window of which it existed for `secs` seconds: not latched, and in
/// even steps all the time, as far as known.
fn is_steady(topic: &ElementState, secs: f64) -> bool {
    let even = match (topic.median_period_s, topic.max_gap_s) {
        (Some(median), Some(gap)) => {
            gap <= UNSTEADY * median && median * topic.messages() as f64 >= COVERED * secs
        }
        _ => true,
    };
    even && topic.state != State::Latched
}

/// The interval from the first to the last sign of each topic's publishers together; of the topic itself if
/// none is known.
fn sent(elements: &Elements) -> ById<TopicId, (Option<Stamp>, Option<Stamp>)> {
    let mut sent = ById::like(&elements.topics, (None, None));
    for edge in elements.publishes.iter().filter(|e| e.seen.first.is_some()) {
        let (first, last): &mut (Option<Stamp>, Option<Stamp>) = &mut sent[edge.topic];
        *first = [*first, edge.seen.first].into_iter().flatten().min();
        *last = (*last).max(edge.seen.last);
    }
    let own = elements.topics.iter().map(|t| (t.seen.first, t.seen.last));
    sent.into_iter()
        .zip(own)
        .map(|(sent, own)| if sent.0.is_some() { sent } else { own })
        .collect()
}

fn lifecycles(diff: &Diff, changes: &mut Vec<Change>) {
    let differs = |(old, new): &&(ElementState, ElementState)| old.lifecycle != new.lifecycle;
    for (old, new) in diff.changed.iter().filter(differs) {
        let word = |state: &Option<Arc<str>>| state.clone().unwrap_or_default();
        let (from, to) = (word(&old.lifecycle), word(&new.lifecycle));
        let change = Change::new(Kind::Lifecycle, new.what, None);
        changes.push(change.with(Detail::Values { from, to }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_must_change_by_the_share_and_by_more_than_two_messages() {
        assert!(rate_differs(15.0, 7.4, 10.0, 0.25));
        assert!(!rate_differs(15.0, 12.0, 10.0, 0.25));
        assert!(
            !rate_differs(0.1, 0.0, 10.0, 0.25),
            "one message of a slow topic"
        );
        assert!(
            !rate_differs(0.3, 0.1, 10.0, 0.25),
            "a topic too slow for the window"
        );
        assert!(
            !rate_differs(1.0, 2.0, 1.0, 0.25),
            "one message more in a short last window"
        );
        assert!(rate_differs(0.0, 1.0, 10.0, 0.25));
    }
}
