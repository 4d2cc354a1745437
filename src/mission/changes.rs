//! The changes from each window to the next, each with the event that explains it.
//!
//! For example, `/nav` starts at 12.4 s and publishes `/plan`: in the window from 10 s to 20 s three elements were added, and
//! all three belong to the event of the node.

use std::collections::BTreeMap;

use super::event_log::{Detail, Event, EventId, EventLog, Kind};
use crate::base::time::{Span, Stamp};
use crate::graph::{Element, Elements, Graphs};

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
    /// An element that only this window has, or only the one before it: its kind if it is a node, and that of others.
    fn of([node, other]: [Kind; 2], what: Element, time: Option<Stamp>) -> Self {
        Self {
            kind: if what.is_node() { node } else { other },
            what,
            time,
            detail: Detail::None,
        }
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
        let mut list: Vec<(Change, EventId)> = Vec::new();
        if let Some(old) = at.checked_sub(1).map(|old| spans[old]) {
            let span = spans[at];
            list.extend(times.changes(differ, span));
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

/// The events of each element with their times, sorted.
type Timed = BTreeMap<Element, Vec<(Stamp, EventId)>>;

/// The times at which elements begin or end according to events.
struct EventTimes<'a> {
    elements: &'a Elements,
    begins: Timed,
    ends: Timed,
    /// Unnamed publishers and their publications, with their topics: they appear and vanish with the topic.
    unnamed: BTreeMap<Element, Element>,
}

impl<'a> EventTimes<'a> {
    fn new(log: &EventLog, elements: &'a Elements) -> Self {
        let (mut begins, mut ends) = (Timed::new(), Timed::new());
        let add = |to: &mut Timed, what, time, id| {
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
            elements,
            begins,
            ends,
            unnamed: unnamed(elements),
        }
    }

    /// The last event of a list before `end`, else its first.
    fn find(&self, list: &Timed, what: Element, end: Stamp) -> Option<(Stamp, EventId)> {
        let topic = || list.get(self.unnamed.get(&what)?);
        let list = list.get(&what).or_else(topic)?;
        let next = list.partition_point(|(time, _)| *time < end);
        list.get(next.saturating_sub(1)).copied()
    }

    /// The changes in which elements exist, of a window with this time.
    fn changes(&self, differ: &Differing, span: Span) -> Vec<(Change, EventId)> {
        let mut list = Vec::new();
        for what in differ.added.iter().copied() {
            let time = self.elements.seen(what).first;
            if let Some((at, id)) = self.find(&self.begins, what, span.end) {
                let mut times = [time, Some(at)].into_iter().flatten();
                let time = times.find(|time| span.contains(*time));
                list.push((Change::of([Kind::Started, Kind::Appeared], what, time), id));
            }
        }
        for what in differ.removed.iter().copied() {
            if let Some((at, id)) = self.find(&self.ends, what, span.end) {
                let time = Some(at).filter(|at| *at < span.end);
                list.push((Change::of([Kind::Stopped, Kind::Vanished], what, time), id));
            }
        }
        list
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
    (is_change && !event.kind.is_remark()).then(|| Change {
        kind: event.kind,
        what: event.what,
        time: Some(back).filter(|_| event.kind == Kind::Restarted),
        detail: event.detail.clone(),
    })
}

/// The default share by which a rate must change to count as changed: nodes under load vary by a tenth, and a camera that is switched
/// to another mode changes by a third at least.
pub(crate) const RATE_CHANGE: f64 = 0.25;
