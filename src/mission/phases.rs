//! Phases: parts of a mission with one configuration, detected by an optimal partition of lifetimes. In come the
//! elements with their lifetimes and the names of their topics, out goes a span and a name for each phase. Open
//! `partition` first: it chooses the boundaries.
//!
//! A boundary must save enough *element-seconds* of wrongly drawn graph, so that crashes, restarts and slow topics do
//! not cause boundaries, and the majority graph of a phase is its configuration. The result depends on the mission
//! alone, never on `--period`.

mod name;
mod partition;
mod presence;
mod ramp;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use self::name::PhaseNames;
use self::partition::partition;
use self::presence::{Presence, is_topics, presences};
pub(crate) use self::presence::{fill, knows_publishers};
use crate::base::time::{SECOND, Span, Stamp, round_length};
use crate::graph::history::Sending;
use crate::graph::window::{between, every};
use crate::graph::{Elements, TopicId};
use crate::mission::event_log::Phase;

/// The distance from a boundary's cell within which its exact time is searched, in nanoseconds and as a part of the
/// mission (one in so many): six cells of a short mission, 6 of at most 200 of a long one. A launch file starts its nodes within
/// that time; farther starts belong to another boundary.
const AROUND: (i64, i64) = (6_000_000_000, 33);

/// The most cells: more would be finer than print, and the cost of phases grows with the square.
const MOST_CELLS: i64 = 200;

/// The configuration of a phase: its majority graph.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Configuration {
    /// Nodes by role, topics by name if publishers are unknown: those that exist for at least half of the time.
    pub(crate) names: BTreeSet<Arc<str>>,
    /// Topics with the role that publishes more than half of their messages.
    pub(crate) senders: BTreeMap<TopicId, Arc<str>>,
}

/// The phases of a mission, in order and without gaps: one for a mission that does not change, none for one without
/// elements. `whole` is the time of the mission.
pub fn phases(elements: &Elements, sending: &Sending, whole: Span) -> Vec<Phase> {
    if elements.all().next().is_none() {
        return Vec::new();
    }
    let present = presences(elements, sending, whole);
    let cells = cells(whole);
    let widths: Vec<i64> = cells.iter().map(Span::nanos).collect();
    let rows: Vec<Vec<bool>> = present.iter().map(|p| p.cells(&cells)).collect();
    let cuts = partition(&widths, &rows);
    let mut starts = vec![whole.start];
    starts.extend(cuts.into_iter().map(|at| cells[at].start));
    let spans = between(&starts, whole.end);
    let found = configurations(elements, sending, &present, &spans);
    let starts = boundaries(elements, &found, &starts, whole, is_topics(&present));
    let spans = between(&starts, whole.end);
    let (spans, found, ramps) = ramp::joined(&spans, &found, whole.nanos());
    reported(&spans, &found, &ramps, &present)
}

/// The phases for given intervals, such as the user's, with the changes between them, by majority.
pub(crate) fn of_spans(
    elements: &Elements,
    sending: &Sending,
    whole: Span,
    spans: &[Span],
) -> Vec<Phase> {
    let present = presences(elements, sending, whole);
    let found = configurations(elements, sending, &present, spans);
    reported(spans, &found, &vec![false; spans.len()], &present)
}

/// The cells that divide `span`: 1 s if possible, as recorders find topics once a second, so that shorter ones would be noise;
/// longer if there would be more than [`MOST_CELLS`]. They do not depend on `--period`.
fn cells(span: Span) -> Vec<Span> {
    let step = round_length((span.nanos().max(1) / MOST_CELLS + 1).max(SECOND));
    every(span, step)
}

/// The configuration of each of these times.
fn configurations(
    elements: &Elements,
    sending: &Sending,
    present: &[Presence],
    spans: &[Span],
) -> Vec<Configuration> {
    let topics = is_topics(present);
    let of = |span: &Span| {
        let there = present
            .iter()
            .filter(|p| p.counts(topics) && p.fills(*span));
        Configuration {
            names: there.map(|p| p.subject.name()).collect(),
            senders: senders(elements, sending, *span),
        }
    };
    spans.iter().map(of).collect()
}

/// The senders of more than half of a topic's messages in this time.
fn senders(elements: &Elements, sending: &Sending, span: Span) -> BTreeMap<TopicId, Arc<str>> {
    let mut main = BTreeMap::new();
    for of in sending.senders.chunk_by(|a, b| a.topic == b.topic) {
        let mut roles: BTreeMap<&Arc<str>, f64> = BTreeMap::new();
        let mut whole = 0.0;
        for sender in of {
            let count = sender.count_in(span);
            whole += count;
            let node = sender.node.and_then(|node| elements.nodes.get(node));
            if let Some(node) = node {
                *roles.entry(&node.role).or_default() += count;
            }
        }
        let is_main = |(_, n): &(&Arc<str>, f64)| *n > 0.0 && *n * 2.0 > whole;
        let found = roles.into_iter().find(is_main);
        main.extend(found.map(|(role, _)| (of[0].topic, Arc::clone(role))));
    }
    main
}

/// The starts of phases: at the median of the exact starts and stops of the elements that differ, near the cell's
/// start.
fn boundaries(
    elements: &Elements,
    found: &[Configuration],
    cells: &[Stamp],
    whole: Span,
    topics: bool,
) -> Vec<Stamp> {
    let mut starts = vec![whole.start];
    let ends = presence::ends(elements, topics);
    for (pair, cell) in found.windows(2).zip(&cells[1..]) {
        let exact = differing(&ends, pair, *cell, whole);
        let last = starts.last().copied().unwrap_or(whole.start);
        starts.push(exact.filter(|at| *at > last).unwrap_or(*cell));
    }
    starts
}

/// The median of the exact times at which the elements that differ between two phases began or ended, near `cell`.
fn differing(
    ends: &BTreeMap<&str, presence::Ends>,
    pair: &[Configuration],
    cell: Stamp,
    whole: Span,
) -> Option<Stamp> {
    let (old, new) = (&pair[0].names, &pair[1].names);
    let around = AROUND.0.max(whole.nanos() / AROUND.1);
    let near = |at: &Stamp| at.since(cell).abs() <= around;
    let of = |name: &Arc<str>| ends.get(&**name).into_iter().flatten();
    let began = new.difference(old).flat_map(of).filter_map(|e| e.0);
    let ended = old.difference(new).flat_map(of).filter_map(|e| e.1);
    let mut times: Vec<Stamp> = began.chain(ended).filter(near).collect();
    times.sort_unstable();
    times.get(times.len() / 2).copied()
}

fn reported(
    spans: &[Span],
    found: &[Configuration],
    ramps: &[bool],
    present: &[Presence],
) -> Vec<Phase> {
    let unit = if is_topics(present) { "topic" } else { "node" };
    let all: BTreeSet<Arc<str>> = found.iter().flat_map(|c| c.names.iter().cloned()).collect();
    let names = PhaseNames::new(unit, all.iter().map(|name| &**name));
    let nothing = BTreeSet::new();
    let phase = |k: usize| {
        let earlier = k.checked_sub(1).map(|b| &found[b].names);
        let before = earlier.unwrap_or(&nothing);
        let added: Vec<&Arc<str>> = found[k].names.difference(before).collect();
        let removed: Vec<&Arc<str>> = before.difference(&found[k].names).collect();
        let same_as = (0..k).find(|earlier| is_same(&found[*earlier], &found[k]));
        let count = |list: &[&Arc<str>]| u32::try_from(list.len()).unwrap_or(u32::MAX);
        Phase {
            span: spans[k],
            name: if ramps[k] {
                names.ramp(found[k].names.len())
            } else {
                names.of_changes(earlier, &added, &removed)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of cells and the length of the first in seconds, for a span of this many seconds.
    fn counted(seconds: i64) -> (usize, i64) {
        let cells = super::cells(Span::new(Stamp(5), Stamp(5 + seconds * SECOND)));
        (cells.len(), cells[0].nanos() / SECOND)
    }

    #[test]
    fn cells_have_the_shortest_step_that_gives_at_most_two_hundred() {
        assert_eq!(counted(66), (66, 1));
        assert_eq!(counted(200), (100, 2));
        assert_eq!(counted(330), (165, 2));
        assert_eq!(counted(3600 * 24), (144, 600));
        let (many, step) = counted(86_400 * 4000);
        assert!(many <= 200 && step % 86_400 == 0, "{many} of {step}");
    }
}
