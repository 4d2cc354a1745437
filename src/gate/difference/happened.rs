//! The differences in events: those in one mission only, in another order, or at another time of their phase.

use std::collections::{BTreeMap, BTreeSet};

use super::{Difference, Where};
use crate::base::time::Stamp;
use crate::base::words;
use crate::gate::facts::Facts;
use crate::graph::Element;
use crate::mission::ledger::{Entry, Kind};

/// The difference in nanoseconds up to which times of two runs count as the same.
const APART_NS: i64 = 5_000_000_000;
/// The largest number of entries that are put in order: the work is their square.
const MOST: usize = 2000;

/// The key of an entry: its kind, the name it is about, and its number among the entries of both, counted from 1.
type Key = (Kind, String, usize);

/// An entry, told without the mission.
struct ToldEntry {
    key: Key,
    time: Stamp,
    /// The uncertainty of its time, in nanoseconds.
    doubt: i64,
    /// The place of its phase.
    phase: usize,
}

/// All differences in events.
pub(super) fn differences(a: &Facts<'_>, b: &Facts<'_>) -> Vec<Difference> {
    let (first, second) = (told(a), told(b));
    let mut all = only(&first, &second, a, Where::First);
    all.extend(only(&second, &first, b, Where::Second));
    let place: BTreeMap<&Key, usize> = second.iter().zip(0..).map(|(t, at)| (&t.key, at)).collect();
    let pairs = first.iter().filter_map(|t| Some((t, *place.get(&t.key)?)));
    let pairs: Vec<(&ToldEntry, usize)> = pairs.take(MOST).collect();
    let kept = in_order(&pairs.iter().map(|(_, at)| *at).collect::<Vec<_>>());
    for (at, (one, other)) in pairs.iter().enumerate() {
        let Some(other) = second.get(*other) else {
            continue;
        };
        if kept.contains(&at) {
            all.extend(moved((a, one), (b, other)));
        } else {
            let (first, second) = (a.clock(one.time), b.clock(other.time));
            all.push(Difference::changed("order", name(&one.key), first, second));
        }
    }
    all
}

/// The headlines that two runs can have in common.
fn told(facts: &Facts<'_>) -> Vec<ToldEntry> {
    let mission = facts.mission;
    let mut many: BTreeMap<(Kind, String), usize> = BTreeMap::new();
    let mut all = Vec::new();
    for (_, entry) in mission.ledger.headlines(mission.span) {
        let Some(name) = about(facts, entry) else {
            continue;
        };
        let count = many.entry((entry.kind, name.clone())).or_default();
        *count += 1;
        let phases = &mission.ledger.phases;
        all.push(ToldEntry {
            key: (entry.kind, name, *count),
            time: entry.time,
            doubt: entry.latest.since(entry.earliest),
            phase: phases
                .partition_point(|p| p.span.start <= entry.time)
                .saturating_sub(1),
        });
    }
    all
}

/// The node or topic that an entry is about; rates, and connections, are compared elsewhere.
fn about(facts: &Facts<'_>, entry: &Entry) -> Option<String> {
    match (entry.kind, entry.what) {
        (Kind::Rate | Kind::Type | Kind::Qos, _) => None,
        (_, Element::Node(id)) => Some(facts.role(id).to_owned()),
        (_, Element::Topic(id)) => Some(facts.topic(id).to_owned()),
        _ => None,
    }
}

/// The events that one mission tells and the other does not, about elements of both. Starts and stops are told of the
/// elements.
fn only(own: &[ToldEntry], other: &[ToldEntry], facts: &Facts<'_>, side: Where) -> Vec<Difference> {
    let known: BTreeSet<&Key> = other.iter().map(|t| &t.key).collect();
    let wanted = [Kind::HandedOver, Kind::Silent, Kind::Lifecycle];
    let alone = own
        .iter()
        .filter(|t| wanted.contains(&t.key.0) && !known.contains(&t.key));
    let told = alone.map(|t| {
        Difference::only(
            "event",
            name(&t.key),
            side,
            &format!("at {}", facts.clock(t.time)),
        )
    });
    told.collect()
}

fn name((kind, name, count): &Key) -> String {
    let word = kind.word().replace('_', " ");
    match count {
        1 => format!("{name} {word}"),
        n => format!("{name} {word} ({n})"),
    }
}

/// The difference of an entry that stands at another time of its phase in the other mission, if it does.
fn moved(
    (a, one): (&Facts<'_>, &ToldEntry),
    (b, other): (&Facts<'_>, &ToldEntry),
) -> Option<Difference> {
    let since = |facts: &Facts<'_>, told: &ToldEntry| {
        // The first thing of a phase begins it, so that only what follows can be early or late in it.
        let phase = facts.mission.ledger.phases.get(told.phase);
        let start = phase.map_or(facts.mission.span.start, |p| p.span.start);
        told.time.since(start)
    };
    let apart = since(a, one)
        .saturating_sub(since(b, other))
        .saturating_abs();
    let whole = |facts: &Facts<'_>, told: &ToldEntry| facts.mission.offset(told.time);
    let overall = whole(a, one)
        .saturating_sub(whole(b, other))
        .saturating_abs();
    // Phases of two runs need not be the same: what is at one time of the mission is not moved.
    let apart = apart.min(overall);
    let doubt = one.doubt.saturating_add(other.doubt);
    (apart > APART_NS.saturating_add(doubt)).then(|| {
        let at = |facts: &Facts<'_>, told: &ToldEntry| {
            let phase = told.phase + 1;
            format!(
                "{} (phase {phase} + {})",
                facts.clock(told.time),
                words::duration(since(facts, told))
            )
        };
        Difference::changed("time", name(&one.key), at(a, one), at(b, other))
    })
}

/// The places of a longest rising part of these numbers.
fn in_order(numbers: &[usize]) -> BTreeSet<usize> {
    let mut best: Vec<(usize, Option<usize>)> = Vec::with_capacity(numbers.len());
    for (at, number) in numbers.iter().enumerate() {
        let before = (0..at).filter(|k| numbers[*k] < *number);
        let before = before.max_by_key(|k| (best[*k].0, std::cmp::Reverse(*k)));
        best.push((before.map_or(1, |k| best[k].0 + 1), before));
    }
    let mut kept = BTreeSet::new();
    let mut next = (0..best.len()).max_by_key(|k| (best[*k].0, std::cmp::Reverse(*k)));
    while let Some(at) = next {
        kept.insert(at);
        next = best[at].1;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_order_is_left_out() {
        let kept: Vec<usize> = in_order(&[0, 3, 1, 2, 4]).into_iter().collect();
        assert_eq!(kept, [0, 2, 3, 4]);
        assert_eq!(in_order(&[]).len(), 0);
    }
}
