//! The windows' differences, each with the entry that explains it; and the other way round, entries from differences
//! where nothing but windows is known.

use std::collections::BTreeMap;

use super::make::{is_housekeeping, sorted};
use super::{Detail, Entry, EntryId, Kind, Ledger};
use crate::base::time::{Span, Stamp};
use crate::evidence::Degree;
use crate::graph::diff::{Change, ValueKind, diff};
use crate::graph::{Element, Elements, Graph};

/// What is different in each window from the one before, with the places of the entries that tell why.
pub(crate) fn explain<'g>(
    windows: impl Iterator<Item = (Span, &'g Graph)>,
    elements: &Elements,
    ledger: &Ledger,
) -> Vec<(Vec<Change>, Vec<EntryId>)> {
    let turns = Turns::new(ledger);
    let mut before: Option<(Span, &Graph)> = None;
    let mut all = Vec::new();
    for (span, graph) in windows {
        let mut list = Vec::new();
        if let Some((old_span, old)) = before {
            structure(old, graph, span, elements, &turns, &mut list);
            let news = Span {
                start: old_span.end.max(span.start),
                end: span.end,
            };
            list.extend(values(ledger, news));
        }
        all.push(list.into_iter().unzip());
        before = Some((span, graph));
    }
    all
}

/// When entries say that elements begin or end, sorted.
struct Turns {
    begins: BTreeMap<Element, Vec<(Stamp, EntryId)>>,
    ends: BTreeMap<Element, Vec<(Stamp, EntryId)>>,
}

impl Turns {
    fn new(ledger: &Ledger) -> Self {
        let (mut begins, mut ends) = (BTreeMap::new(), BTreeMap::new());
        let add = |to: &mut BTreeMap<Element, Vec<_>>, what, time, id| {
            to.entry(what).or_default().push((time, id));
        };
        for (id, entry) in (0..).zip(&ledger.entries) {
            match entry.kind {
                Kind::Started | Kind::Appeared => add(&mut begins, entry.what, entry.time, id),
                Kind::Stopped | Kind::Vanished => add(&mut ends, entry.what, entry.time, id),
                Kind::Restarted => {
                    let until = entry.until.unwrap_or(entry.time);
                    add(&mut begins, entry.what, until, id);
                    add(&mut ends, entry.what, entry.time, id);
                }
                _ => {}
            }
        }
        for list in begins.values_mut().chain(ends.values_mut()) {
            list.sort_unstable();
        }
        Self { begins, ends }
    }

    /// The last entry of a list before `end`, else its first.
    fn find(
        list: &BTreeMap<Element, Vec<(Stamp, EntryId)>>,
        what: Element,
        end: Stamp,
    ) -> Option<(Stamp, EntryId)> {
        let list = list.get(&what)?;
        let next = list.partition_point(|(time, _)| *time < end);
        list.get(next.saturating_sub(1)).copied()
    }
}

fn structure(
    old: &Graph,
    new: &Graph,
    span: Span,
    elements: &Elements,
    turns: &Turns,
    list: &mut Vec<(Change, EntryId)>,
) {
    let diff = diff(old, new);
    let added = ids(&diff.nodes.added, |s| Element::Node(s.id))
        .chain(ids(&diff.topics.added, |s| Element::Topic(s.id)))
        .chain(ids(&diff.publishes.added, |s| Element::Publish(s.id)))
        .chain(ids(&diff.subscribes.added, |s| Element::Subscribe(s.id)));
    for what in added {
        let time = elements.life(what).0.filter(|t| span.contains(*t));
        if let Some((at, id)) = Turns::find(&turns.begins, what, span.end) {
            let time = time.or(Some(at).filter(|at| span.contains(*at)));
            list.push((Change::Added { what, time }, id));
        }
    }
    let removed = ids(&diff.nodes.removed, |id| Element::Node(*id))
        .chain(ids(&diff.topics.removed, |id| Element::Topic(*id)))
        .chain(ids(&diff.publishes.removed, |id| Element::Publish(*id)))
        .chain(ids(&diff.subscribes.removed, |id| Element::Subscribe(*id)));
    for what in removed {
        if let Some((at, id)) = Turns::find(&turns.ends, what, span.end) {
            let time = Some(at).filter(|at| *at < span.end);
            list.push((Change::Removed { what, time }, id));
        }
    }
}

fn ids<'s, T>(
    list: &'s [T],
    element: impl Fn(&T) -> Element + 's,
) -> impl Iterator<Item = Element> + 's {
    list.iter().map(element)
}

/// What entries tell of a window beside what is there: rates, hand-overs, restarts, values.
fn values(ledger: &Ledger, news: Span) -> impl Iterator<Item = (Change, EntryId)> + '_ {
    let inside = (0..).zip(&ledger.entries).filter(move |(_, e)| {
        news.contains(
            e.until
                .filter(|_| e.kind == Kind::Restarted)
                .unwrap_or(e.time),
        )
    });
    inside.filter_map(|(id, entry)| Some((change(entry)?, id)))
}

/// The change that an entry tells of, but for what comes and goes.
fn change(entry: &Entry) -> Option<Change> {
    let what = entry.what;
    match (&entry.detail, entry.kind) {
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
                time: entry.until.unwrap_or(entry.time),
            }),
            _ => None,
        },
        (Detail::None, _) => None,
    }
}

/// Entries made of windows' differences, for missions of which only windows are known; answers also the places of the
/// entries by window and change. What happened in a window happened from the start of the one before to its end.
pub(crate) fn of_changes(
    windows: &[(Span, &[Change])],
    elements: &Elements,
) -> (Vec<Entry>, Vec<Vec<EntryId>>) {
    let mut list: Vec<Entry> = Vec::new();
    for (at, (span, changes)) in windows.iter().enumerate() {
        let before = at.checked_sub(1).map_or(*span, |at| windows[at].0);
        let first = list.len();
        list.extend(changes.iter().map(|c| entry(c, (before, *span), elements)));
        attach(&mut list, first, elements);
    }
    let (entries, new) = sorted(list, elements);
    let mut new = new.into_iter();
    let places = windows
        .iter()
        .map(|w| new.by_ref().take(w.1.len()).collect());
    let places = places.collect();
    (entries, places)
}

fn entry(change: &Change, (before, span): (Span, Span), elements: &Elements) -> Entry {
    let (kind, what, time, detail) = match change {
        Change::Added { what, time } => {
            let kind = match what {
                Element::Node(_) => Kind::Started,
                _ => Kind::Appeared,
            };
            (kind, *what, *time, Detail::None)
        }
        Change::Removed { what, time } => {
            let kind = match what {
                Element::Node(_) => Kind::Stopped,
                _ => Kind::Vanished,
            };
            (kind, *what, *time, Detail::None)
        }
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
            let what = Element::Topic(*topic);
            (Kind::HandedOver, what, None, Detail::Senders { from, to })
        }
        Change::Restarted { node, time } => (
            Kind::Restarted,
            Element::Node(*node),
            Some(*time),
            Detail::None,
        ),
        Change::Value {
            kind,
            what,
            from,
            to,
        } => {
            let kind = match kind {
                ValueKind::Type => Kind::Type,
                ValueKind::Qos => Kind::Qos,
                ValueKind::Lifecycle => Kind::Lifecycle,
            };
            let (from, to) = (from.clone(), to.clone());
            (kind, *what, None, Detail::Values { from, to })
        }
    };
    Entry {
        kind,
        what,
        time: time.unwrap_or(span.start),
        earliest: time.unwrap_or(before.start).min(time.unwrap_or(span.start)),
        latest: time.unwrap_or(span.end),
        until: None,
        detail,
        degree: Degree::Stated,
        evidence: elements.evidence(what),
        part_of: None,
        quiet: is_housekeeping(elements, what),
        weight: 1,
    }
}

/// Makes the edges and topics of a window's entries, from `first` on, parts of what their nodes did.
fn attach(list: &mut [Entry], first: usize, elements: &Elements) {
    let id = |at: usize| EntryId::try_from(at).unwrap_or(EntryId::MAX);
    let mut nodes = BTreeMap::new();
    for (at, entry) in list.iter().enumerate().skip(first) {
        if let (Element::Node(node), Kind::Started | Kind::Stopped) = (entry.what, entry.kind) {
            nodes.insert((node, entry.kind == Kind::Started), id(at));
        }
    }
    let mut topics = BTreeMap::new();
    for (at, entry) in list.iter_mut().enumerate().skip(first) {
        let (Some(node), Some(topic)) = elements.ends(entry.what) else {
            continue;
        };
        if let Kind::Appeared | Kind::Vanished = entry.kind {
            let begins = entry.kind == Kind::Appeared;
            let whole = nodes.get(&(node, begins)).copied();
            entry.part_of = whole;
            topics
                .entry((topic, begins))
                .or_insert(whole.unwrap_or(id(at)));
        }
    }
    for entry in &mut list[first..] {
        if let (Element::Topic(topic), Kind::Appeared | Kind::Vanished) = (entry.what, entry.kind) {
            entry.part_of = topics.get(&(topic, entry.kind == Kind::Appeared)).copied();
        }
    }
}
