//! Phases: parts of a mission that one graph describes, found by an optimal partition of its activity.
//!
//! A boundary must save enough *element-seconds* of wrongly drawn graph, so that crashes, restarts and slow topics do
//! not cause boundaries, and the majority graph of a phase is the configuration that the mission was in. The result
//! depends on the mission alone, never on `--period`.

mod name;
mod partition;
mod presence;
mod ramp;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use self::partition::partition;
pub(crate) use self::presence::knows_publishers;
use self::presence::{Presence, is_topics, presences};
use crate::base::time::{Span, Stamp};
use crate::graph::{Element, Elements, TopicId};
use crate::mission::activity::Activity;
use crate::mission::ledger::Phase;

/// The distance from a boundary's cell within which its exact time is searched, in nanoseconds and as a part of the
/// mission (one in so many).
const AROUND: (i64, i64) = (6_000_000_000, 33);

/// The configuration of a phase: its majority graph.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Configuration {
    /// Nodes by role, topics by name where publishers are unknown: those that exist for at least half of the time.
    pub(crate) names: BTreeSet<Arc<str>>,
    /// Topics with a role that sends more than half of their messages.
    pub(crate) senders: BTreeMap<TopicId, Arc<str>>,
}

/// The phases of a mission, in order and without gaps: one for a mission that does not change, none for one without
/// activity.
pub fn phases(elements: &Elements, activity: &Activity) -> Vec<Phase> {
    let present = presences(elements, activity);
    let cells: Vec<i64> = activity.cells().iter().map(Span::nanos).collect();
    let cuts = partition(&cells, &present);
    let starts: Vec<usize> = std::iter::once(0).chain(cuts).collect();
    let ends = starts[1..].iter().copied().chain([cells.len()]);
    let ranges: Vec<(usize, usize)> = starts.iter().copied().zip(ends).collect();
    if cells.is_empty() {
        return Vec::new();
    }
    let found: Vec<Configuration> = ranges
        .iter()
        .map(|(from, to)| configuration(elements, activity, &present, *from, *to))
        .collect();
    let bounds = boundaries(elements, activity, &present, &ranges);
    let spans = bounds.windows(2).map(|pair| Span {
        start: pair[0],
        end: pair[1],
    });
    let spans: Vec<Span> = spans.collect();
    let (spans, found, ramps) = ramp::joined(&spans, &found, activity.span().nanos());
    let unit = if is_topics(&present) { "topic" } else { "node" };
    told(&spans, &found, &ramps, unit)
}

/// The phases for intervals chosen elsewhere, such as by the user, with the changes between them, by majority.
pub(crate) fn of_spans(elements: &Elements, activity: &Activity, spans: &[Span]) -> Vec<Phase> {
    let present = presences(elements, activity);
    let found: Vec<Configuration> = spans
        .iter()
        .map(|span| {
            let (from, to) = cells_of(activity, *span);
            configuration(elements, activity, &present, from, to)
        })
        .collect();
    let unit = if is_topics(&present) { "topic" } else { "node" };
    told(spans, &found, &vec![false; spans.len()], unit)
}

/// The majority graph of a phase or of any other interval, by the cells whose middle lies in it.
pub(crate) fn configuration_of(
    elements: &Elements,
    activity: &Activity,
    span: Span,
) -> Configuration {
    let present = presences(elements, activity);
    let (from, to) = cells_of(activity, span);
    configuration(elements, activity, &present, from, to)
}

/// The cells whose middle lies in `span`, as a range; at least one if there is any.
pub(crate) fn cells_of(activity: &Activity, span: Span) -> (usize, usize) {
    let cells = activity.cells();
    let middle = |cell: &Span| cell.start.plus(cell.nanos() / 2);
    let from = cells.partition_point(|cell| middle(cell) < span.start);
    let to = cells.partition_point(|cell| middle(cell) < span.end);
    let from = from.min(cells.len().saturating_sub(1));
    (from, to.max(from + 1).min(cells.len()))
}

fn configuration(
    elements: &Elements,
    activity: &Activity,
    present: &[Presence],
    from: usize,
    to: usize,
) -> Configuration {
    Configuration {
        names: majority(activity, present, (from, to)),
        senders: senders(elements, activity, from..to),
    }
}

/// The elements that exist in at least half of these cells.
fn majority(
    activity: &Activity,
    present: &[Presence],
    (from, to): (usize, usize),
) -> BTreeSet<Arc<str>> {
    let topics = is_topics(present);
    let cells = &activity.cells()[from..to];
    let whole: i64 = cells.iter().map(Span::nanos).sum();
    let is_there = |p: &&Presence| {
        let there = cells.iter().zip(&p.cells[from..to]).filter(|(_, is)| **is);
        let nanos: i64 = there.map(|(cell, _)| cell.nanos()).sum();
        nanos * 2 >= whole
    };
    let counted = |p: &&Presence| p.counts(topics);
    let names = present.iter().filter(counted).filter(is_there);
    names.map(|p| p.subject.name()).collect()
}

/// The senders of more than half of a topic's messages in these cells.
fn senders(
    elements: &Elements,
    activity: &Activity,
    cells: Range<usize>,
) -> BTreeMap<TopicId, Arc<str>> {
    let count = |what: Element| {
        let rows = activity.graphs.rows(what);
        let inside = rows.filter(|(at, _)| cells.contains(at));
        let counts = inside.map(|(_, row)| row.count.unwrap_or(0));
        counts.fold(0, u64::saturating_add)
    };
    let mut sent: BTreeMap<TopicId, BTreeMap<Arc<str>, u64>> = BTreeMap::new();
    for (id, edge) in (0..).zip(&elements.publishes) {
        let count = count(Element::Publish(id));
        let node = elements.nodes.get(edge.node as usize);
        if let Some(node) = node.filter(|_| count > 0) {
            let of = sent.entry(edge.topic).or_default();
            *of.entry(Arc::clone(&node.role)).or_default() += count;
        }
    }
    let main = |(topic, of): (TopicId, BTreeMap<Arc<str>, u64>)| {
        let whole = count(Element::Topic(topic));
        let found = of.into_iter().find(|(_, n)| n * 2 > whole);
        found.map(|(role, _)| (topic, role))
    };
    sent.into_iter().filter_map(main).collect()
}

/// The boundaries of phases: at the median of the exact starts and stops of the elements that differ, near the cell's
/// start.
fn boundaries(
    elements: &Elements,
    activity: &Activity,
    present: &[Presence],
    ranges: &[(usize, usize)],
) -> Vec<Stamp> {
    let whole = activity.span();
    let mut bounds = vec![whole.start];
    for pair in ranges.windows(2) {
        let (before, after) = (pair[0], pair[1]);
        let cell = activity.cells()[after.0].start;
        let exact = differing(elements, activity, present, (before, after), cell);
        let last = bounds.last().copied().unwrap_or(whole.start);
        bounds.push(exact.filter(|at| *at > last).unwrap_or(cell));
    }
    bounds.push(whole.end);
    bounds
}

/// The median of the exact times at which the elements that differ between two phases began or ended, near `cell`.
fn differing(
    elements: &Elements,
    activity: &Activity,
    present: &[Presence],
    (before, after): ((usize, usize), (usize, usize)),
    cell: Stamp,
) -> Option<Stamp> {
    let old = majority(activity, present, before);
    let new = majority(activity, present, after);
    let around = AROUND.0.max(activity.span().nanos() / AROUND.1);
    let near = |at: &Stamp| at.since(cell).abs() <= around;
    let ends = presence::ends(elements, is_topics(present));
    let of = |name: &Arc<str>| ends.get(&**name).into_iter().flatten();
    let began = new.difference(&old).flat_map(of).filter_map(|e| e.0);
    let ended = old.difference(&new).flat_map(of).filter_map(|e| e.1);
    let mut times: Vec<Stamp> = began.chain(ended).filter(near).collect();
    times.sort_unstable();
    times.get(times.len() / 2).copied()
}

fn told(spans: &[Span], found: &[Configuration], ramps: &[bool], unit: &str) -> Vec<Phase> {
    let nothing = BTreeSet::new();
    let phase = |k: usize| {
        let before = k.checked_sub(1).map_or(&nothing, |b| &found[b].names);
        let added: Vec<&Arc<str>> = found[k].names.difference(before).collect();
        let removed: Vec<&Arc<str>> = before.difference(&found[k].names).collect();
        let same_as = (0..k).find(|earlier| is_same(&found[*earlier], &found[k]));
        let count = |list: &[&Arc<str>]| u32::try_from(list.len()).unwrap_or(u32::MAX);
        Phase {
            span: spans[k],
            name: if ramps[k] {
                name::ramp(found[k].names.len(), unit)
            } else {
                name::of_changes(k == 0, &added, &removed, unit)
            },
            nodes_added: count(&added),
            nodes_removed: count(&removed),
            is_ramp: ramps[k],
            same_as: same_as.and_then(|at| u32::try_from(at).ok()),
        }
    };
    (0..spans.len()).map(phase).collect()
}

/// Whether two phases have the same nodes, and each topic the same main sender.
fn is_same(a: &Configuration, b: &Configuration) -> bool {
    let agree = |(topic, sender): (&TopicId, &Arc<str>)| {
        b.senders.get(topic).is_none_or(|other| other == sender)
    };
    a.names == b.names && a.senders.iter().all(agree)
}
