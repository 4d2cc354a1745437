//! The recordings of a mission: the time that each covers, and the nodes that several contain at the same time. For example, a
//! recording that is split every 60 s is one recording of five files, and `/camera` in two bags of two robots is two nodes.

use std::collections::BTreeSet;

use crate::base::ids::grouped;
use crate::base::name::is_quiet;
use crate::base::rhythm::OUT_OF_ORDER_NS;
use crate::base::time::Stamp;
use crate::evidence::collector::Recorded;
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::observation::Name;
use crate::graph::ById;

/// The first and the last moment of a bag, and its topics.
type Part = ((Stamp, Stamp), BTreeSet<Name>);

/// Each bag with messages.
fn bags(recorded: &Recorded) -> ById<usize, Option<Part>> {
    let mut bags: ById<usize, Option<Part>> = ById::default();
    for stream in &recorded.streams {
        if let Some((from, to)) = recorded.messages.bounds(stream.times) {
            let part = bags.grown(stream.bag);
            let (span, topics) = part.get_or_insert(((from, to), BTreeSet::new()));
            *span = (span.0.min(from), span.1.max(to));
            topics.insert(stream.topic);
        }
    }
    bags
}

/// The bags of each recording, in order: a bag continues the recording that ended just before it, if it has most topics in common with it.
/// Of two recorders that split their recordings, each continues its own.
pub(crate) fn parts(recorded: &Recorded) -> Vec<Vec<usize>> {
    let bags = bags(recorded);
    let mut bags: Vec<_> = bags.somes().collect();
    bags.sort_by_key(|(_, (span, _))| *span);
    let mut all: Vec<(Stamp, BTreeSet<Name>, Vec<usize>)> = Vec::new();
    for (bag, ((from, to), topics)) in bags {
        let goes_on = |(end, others, _): &&mut (Stamp, BTreeSet<Name>, Vec<usize>)| {
            let common = others.intersection(topics).count();
            end.since(*from) <= OUT_OF_ORDER_NS && common * 2 > others.len().min(topics.len())
        };
        let before = all.iter_mut().filter(goes_on);
        match before.min_by_key(|(end, ..)| from.since(*end).abs()) {
            Some((end, others, bags)) => {
                *end = *to.max(end);
                others.extend(topics);
                bags.push(bag);
            }
            None => all.push((*to, topics.clone(), vec![bag])),
        }
    }
    all.into_iter().map(|(.., bags)| bags).collect()
}

/// The first and the last moment of the recording that each bag is a part of, by bag; `None` without messages.
pub(crate) fn recordings(recorded: &Recorded) -> ById<usize, Option<(Stamp, Stamp)>> {
    let mut spans: ById<usize, Option<(Stamp, Stamp)>> = ById::default();
    let found = recorded.parts.is_empty().then(|| parts(recorded));
    let bags = bags(recorded);
    for part in found.as_ref().unwrap_or(&recorded.parts) {
        let own = part.iter().filter_map(|bag| Some(bags.some(*bag)?.0));
        let span = own.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        for bag in part {
            *spans.grown(*bag) = span;
        }
    }
    spans
}

/// The nodes that several recordings contain at the same time as publishers of one topic: of several robots,
/// or recorded twice.
pub(crate) fn doubled(recorded: &Recorded, streams: &[Stream]) -> BTreeSet<Name> {
    let is_named = |s: &&Stream| s.trust == Reliability::Whole && !s.latched;
    let is_quiet = |s: &Stream| is_quiet(s.connection.topic.as_str());
    let seen = |stream: &Stream| {
        let (from, to) = recorded.messages.bounds(stream.times)?;
        let key = (stream.publisher?, stream.topic);
        Some((key, (from, to, stream.bag)))
    };
    let named = streams.iter().filter(is_named).filter(|s| !is_quiet(s));
    let all = grouped(named.filter_map(seen)).into_iter();
    all.filter_map(|((node, _), all)| overlap(all).then_some(node))
        .collect()
}

/// Whether intervals (first and last moment, bag) of different bags overlap.
fn overlap(mut all: Vec<(Stamp, Stamp, usize)>) -> bool {
    all.sort_unstable();
    // The latest end so far with its bag, and the latest end in all other bags.
    let (mut latest, mut other) = ((Stamp::MIN, usize::MAX), Stamp::MIN);
    all.into_iter().any(|(from, to, bag)| {
        let end = if bag == latest.1 { other } else { latest.0 };
        if bag == latest.1 {
            latest.0 = latest.0.max(to);
        } else if to > latest.0 {
            (other, latest) = (latest.0, (to, bag));
        } else {
            other = other.max(to);
        }
        end > from && end.min(to).since(from) > OUT_OF_ORDER_NS
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_of_different_bags_overlap() {
        let shared = |all: &[(i64, i64, usize)]| {
            let second = |s: i64| Stamp(s * 1_000_000_000);
            let all = all
                .iter()
                .map(|(from, to, bag)| (second(*from), second(*to), *bag));
            overlap(all.collect())
        };
        assert!(!shared(&[(0, 90, 0), (10, 80, 0), (90, 200, 1)]));
        assert!(shared(&[(0, 90, 0), (10, 80, 0), (50, 60, 1)]));
        assert!(shared(&[
            (0, 200, 0),
            (10, 100, 1),
            (50, 150, 0),
            (60, 70, 0)
        ]));
        assert!(!shared(&[
            (300, 400, 0),
            (0, 100, 0),
            (100, 200, 1),
            (200, 300, 2)
        ]));
    }
}
