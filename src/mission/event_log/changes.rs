//! The changes between windows, each with the event that explains it.

use std::collections::BTreeMap;

use super::{Detail, Event, EventId, EventLog, Kind, described};
use crate::base::time::{Span, Stamp};
use crate::graph::diff::{Change, ValueKind};
use crate::graph::{Element, Elements, Graphs};
use crate::mission::Window;

/// The changes of each window since the previous one, with the ids of the events that explain them.
pub(crate) fn explain(
    graphs: &Graphs,
    elements: &Elements,
    log: &EventLog,
) -> Vec<(Vec<Change>, Vec<EventId>)> {
    let turns = EventTurns::new(log, elements);
    let spans = graphs.spans();
    let mut differ = vec![Turned::default(); spans.len()];
    for what in elements.all() {
        for (at, exists) in graphs.turns(what) {
            let Turned { added, removed } = &mut differ[at];
            if exists { added } else { removed }.push(what);
        }
    }
    let window = |(at, differ): (usize, &Turned)| {
        let mut list = Vec::new();
        if let Some(old) = at.checked_sub(1).map(|old| spans[old]) {
            let span = spans[at];
            structure(differ, span, elements, &turns, &mut list);
            let added = Span::new(old.end.max(span.start), span.end);
            list.extend(values(log, added));
        }
        list.into_iter().unzip()
    };
    differ.iter().enumerate().map(window).collect()
}

/// The elements that only this window has, and those that only the previous one has.
#[derive(Clone, Default)]
struct Turned {
    added: Vec<Element>,
    removed: Vec<Element>,
}

/// The times at which elements begin or end according to events, sorted.
struct EventTurns {
    begins: BTreeMap<Element, Vec<(Stamp, EventId)>>,
    ends: BTreeMap<Element, Vec<(Stamp, EventId)>>,
    /// Unnamed publishers and their publications, with their topics: they appear and vanish with the topic.
    unnamed: BTreeMap<Element, Element>,
}

impl EventTurns {
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
    differ: &Turned,
    span: Span,
    elements: &Elements,
    turns: &EventTurns,
    list: &mut Vec<(Change, EventId)>,
) {
    for what in differ.added.iter().copied() {
        let time = elements.seen(what).first.filter(|t| span.contains(*t));
        if let Some((at, id)) = turns.find(&turns.begins, what, span.end) {
            let time = time.or(Some(at).filter(|at| span.contains(*at)));
            list.push((Change::Added { what, time }, id));
        }
    }
    for what in differ.removed.iter().copied() {
        if let Some((at, id)) = turns.find(&turns.ends, what, span.end) {
            let time = Some(at).filter(|at| *at < span.end);
            list.push((Change::Removed { what, time }, id));
        }
    }
}

/// The changes of a window in events that are not about existence: rates, hand-overs, restarts, values.
fn values(log: &EventLog, added: Span) -> impl Iterator<Item = (Change, EventId)> + '_ {
    let inside = log.events.with_ids().filter(move |(_, e)| {
        added.contains(
            e.until
                .filter(|_| e.kind == Kind::Restarted)
                .unwrap_or(e.time),
        )
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
            kind: match kind {
                Kind::Type => ValueKind::Type,
                Kind::Qos => ValueKind::Qos,
                _ => ValueKind::Lifecycle,
            },
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
