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

/// The first and the last moment of the recording that each bag is a part of, by bag; `None` without messages. A bag is a part of
/// another's recording if it precedes or follows it and has most topics in common with it.
pub(crate) fn recordings(recorded: &Recorded, streams: &[Stream]) -> Vec<Option<(Stamp, Stamp)>> {
    let mut spans: ById<usize, Option<(Stamp, Stamp)>> = ById::default();
    let mut of_bags: ById<usize, BTreeSet<Name>> = ById::default();
    for stream in streams {
        let span = spans.grown(stream.bag);
        if let Some((first, last)) = recorded.messages.bounds(stream.times) {
            let all = span.get_or_insert((first, last));
            *all = (all.0.min(first), all.1.max(last));
            of_bags.grown(stream.bag).insert(stream.topic);
        }
    }
    let is_part = |a: usize, b: usize| {
        let (Some(one), Some(other)) = (spans[a], spans[b]) else {
            return false;
        };
        let (topics, others) = (&of_bags[a], &of_bags[b]);
        let shared = one.1.min(other.1).since(one.0.max(other.0));
        let common = topics.intersection(others).count();
        shared <= OUT_OF_ORDER_NS && common * 2 > topics.len().min(others.len())
    };
    let mut of: Vec<usize> = (0..spans.len()).collect();
    for a in 0..spans.len() {
        for b in 0..a {
            if of[a] != of[b] && is_part(a, b) {
                let (old, new) = (of[a], of[b]);
                let own = of.iter_mut().filter(|one| **one == old);
                own.for_each(|one| *one = new);
            }
        }
    }
    let mut whole: ById<usize, Option<(Stamp, Stamp)>> = ById::default();
    for (span, one) in spans.iter().zip(&of) {
        if let Some((from, to)) = *span {
            let all = whole.grown(*one).get_or_insert((from, to));
            *all = (all.0.min(from), all.1.max(to));
        }
    }
    of.iter().map(|one| whole.some(*one).copied()).collect()
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
