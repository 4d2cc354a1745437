//! The recordings of a mission: the time that each covers, and the times at which none of its messages was recorded. For
//! example, if 30 of 31 senders at 10 Hz are silent from 80 s to 95 s and go on with their numbers, the recorder was paused, and
//! none of the nodes was silent.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use crate::base::rhythm::{
    FEWEST, GAP, GAP_NS, OUT_OF_ORDER_NS, PAUSE_FEWEST, PAUSE_MOST, PAUSE_MOST_SHARE, PAUSE_SHARE,
};
use crate::base::time::{Span, Stamp};
use crate::evidence::clock::{DAY, FAR_DAYS};
use crate::evidence::collector::Recorded;
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::observation::Name;
use crate::graph::ById;
use crate::graph::history::Stretch;
use crate::graph::history::restarts::Restarts;
use crate::graph::history::senders::{Sender, Traffic};

/// The first and the last moment of the recording that each bag is a part of, by bag; `None` without messages. A bag is a part of
/// another's recording if it precedes or follows it and has most topics in common with it.
#[expect(
    clippy::type_complexity,
    reason = "a short-lived list of each bag's time span and names"
)]
pub(crate) fn recordings(recorded: &Recorded, streams: &[Stream]) -> Vec<Option<(Stamp, Stamp)>> {
    let mut bags: Vec<(Option<(Stamp, Stamp)>, BTreeSet<Name>)> = Vec::new();
    for stream in streams {
        if bags.len() <= stream.bag {
            bags.resize(stream.bag + 1, (None, BTreeSet::new()));
        }
        let Some(bounds) = recorded.messages.bounds(stream.times) else {
            continue;
        };
        let (span, topics) = &mut bags[stream.bag];
        let all = span.get_or_insert(bounds);
        *all = (all.0.min(bounds.0), all.1.max(bounds.1));
        topics.insert(stream.topic);
    }
    let is_part = |a: usize, b: usize| {
        let ((Some(one), topics), (Some(other), others)) = (&bags[a], &bags[b]) else {
            return false;
        };
        let shared = one.1.min(other.1).since(one.0.max(other.0));
        let common = topics.intersection(others).count();
        shared <= OUT_OF_ORDER_NS && common * 2 > topics.len().min(others.len())
    };
    let mut of: Vec<usize> = (0..bags.len()).collect();
    for a in 0..bags.len() {
        for b in 0..a {
            if of[a] != of[b] && is_part(a, b) {
                let (old, new) = (of[a], of[b]);
                of.iter_mut()
                    .filter(|one| **one == old)
                    .for_each(|one| *one = new);
            }
        }
    }
    let mut whole: ById<usize, Option<(Stamp, Stamp)>> = ById::default();
    for ((span, _), one) in bags.iter().zip(&of) {
        if let Some((from, to)) = *span {
            let all = whole.grown(*one).get_or_insert((from, to));
            *all = (all.0.min(from), all.1.max(to));
        }
    }
    of.iter().map(|one| whole.some(*one).copied()).collect()
}

/// The nodes that several recordings contain at the same time as publishers of one topic: of several robots,
/// or recorded twice.
#[expect(
    clippy::type_complexity,
    reason = "a short-lived list of when each bag contains a node and topic"
)]
pub(crate) fn doubled(recorded: &Recorded, streams: &[Stream]) -> BTreeSet<Name> {
    let mut seen: BTreeMap<(Name, Name), Vec<(Stamp, Stamp, usize)>> = BTreeMap::new();
    let named = streams
        .iter()
        .filter(|s| s.trust == Reliability::Whole && !s.latched);
    for stream in named.filter(|s| !crate::base::name::is_quiet(s.connection.topic.as_str())) {
        let times = recorded.messages.bounds(stream.times);
        if let (Some(node), Some((from, to))) = (stream.publisher, times) {
            let all = seen.entry((node, stream.topic)).or_default();
            all.push((from, to, stream.bag));
        }
    }
    let doubled = seen
        .into_iter()
        .filter_map(|((node, _), all)| overlap(all).then_some(node));
    doubled.collect()
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

/// A sender with its recordings.
struct SendingNode<'a> {
    node: Option<Name>,
    stretches: &'a [Stretch],
    bags: BTreeSet<usize>,
}

impl SendingNode<'_> {
    /// The messages around a moment, if the next one is due long before `length` is over.
    fn sending(&self, at: Stamp, length: i64) -> Option<&Stretch> {
        let next = self.stretches.partition_point(|s| s.first <= at);
        let stretch = self.stretches.get(next.checked_sub(1)?)?;
        let late = at.since(stretch.last);
        let is_fast = stretch.period.saturating_mul(GAP) <= length;
        (stretch.count >= FEWEST && is_fast && late <= stretch.period.saturating_mul(2))
            .then_some(stretch)
    }

    /// Whether it begins to publish well inside a gap.
    fn begins_in(&self, gap: Span) -> bool {
        let edge = gap.nanos() / 8;
        let inside = gap.start.plus(edge)..gap.end.plus(-edge);
        self.stretches.iter().any(|s| inside.contains(&s.first))
    }

    /// The gap that begins around a moment, give or take `near` nanoseconds: the last message and the next one.
    fn gap(&self, at: Stamp, near: i64) -> Option<(Stamp, Option<Stamp>)> {
        let place = self.stretches.partition_point(|s| s.last < at.plus(-near));
        let last = self.stretches.get(place)?.last;
        let next = self.stretches.get(place + 1);
        let is_gap = next.is_none_or(|next| !next.is_joined) && last.since(at) <= near;
        is_gap.then(|| (last, next.map(|next| next.first)))
    }
}

/// The most gaps of a sender of which any may be a pause of the recorder: one with more only publishes when
/// needed.
const MOST_GAPS: usize = 64;

/// The times at which nothing was recorded, sorted: nearly all senders of a recording pause together, and
/// resume together without having restarted, and next to nothing else was recorded.
pub(crate) fn pauses(
    recorded: &Recorded,
    traffic: &Traffic,
    restarts: &Restarts,
    streams: &[Stream],
) -> io::Result<Vec<Span>> {
    let mut senders = Vec::new();
    for of_topic in traffic.iter().flatten() {
        for (place, sender) in of_topic.list.iter().enumerate() {
            if sender.latched || sender.stretches.iter().all(|s| s.count < FEWEST) {
                continue;
            }
            let own = of_topic.streams.iter().zip(&of_topic.of);
            let own = own.filter(|(_, of)| **of == place);
            senders.push(SendingNode {
                node: sender.node,
                stretches: &sender.stretches,
                bags: own.map(|(at, _)| streams[*at].bag).collect(),
            });
        }
    }
    let bags: BTreeSet<usize> = senders
        .iter()
        .flat_map(|sender| &sender.bags)
        .copied()
        .collect();
    let mut found: Vec<Span> = Vec::new();
    for bag in bags {
        let of_bag: Vec<&SendingNode<'_>> =
            senders.iter().filter(|v| v.bags.contains(&bag)).collect();
        // Most gaps are of one pause.
        let mut seen = BTreeSet::new();
        for gap in gaps(&of_bag) {
            if found.iter().any(|pause| pause.shared(gap) > 0) {
                continue;
            }
            if let Some((pause, due)) = pause(&of_bag, restarts, gap)
                && seen.insert((pause.start, pause.end))
            {
                let inside = Span::new(pause.start.plus(1), pause.end);
                let mut many = 0;
                for stream in streams.iter().filter(|stream| stream.bag == bag) {
                    many += recorded.messages.count_in(stream.times, inside)?;
                }
                let is_nothing = many as f64 <= PAUSE_MOST.max(due * PAUSE_MOST_SHARE);
                found.extend(is_nothing.then_some(pause));
            }
        }
    }
    found.extend(clock_jumps(traffic));
    found.sort_unstable_by_key(|pause| pause.start);
    found.dedup_by(|one, before| one.shared(*before) > 0);
    Ok(found)
}

/// The times without any message that are too long for a mission: the clock was set in between.
fn clock_jumps(traffic: &Traffic) -> Vec<Span> {
    let senders = traffic.iter().flatten().flat_map(|of| &of.list);
    let stretches = senders.flat_map(|sender| &sender.stretches);
    let mut sending: Vec<Span> = stretches.map(|s| Span::new(s.first, s.last)).collect();
    sending.sort_unstable_by_key(|span| span.start);
    let mut until = Stamp::MAX;
    let mut found = Vec::new();
    for span in sending {
        if span.start.since(until) > FAR_DAYS * DAY {
            found.push(Span::new(until, span.start));
        }
        until = if until == Stamp::MAX {
            span.end
        } else {
            until.max(span.end)
        };
    }
    found
}

/// The gaps of senders that rarely have any, sorted.
fn gaps(senders: &[&SendingNode<'_>]) -> Vec<Span> {
    let steady = senders
        .iter()
        .filter(|sender| sender.stretches.len() <= MOST_GAPS);
    let pairs = steady.flat_map(|sender| sender.stretches.windows(2));
    let apart = pairs.filter(|pair| !pair[1].is_joined);
    let mut gaps: Vec<Span> = apart
        .map(|pair| Span::new(pair[0].last, pair[1].first))
        .collect();
    gaps.sort_unstable_by_key(|gap| (gap.start, gap.end));
    gaps
}

/// The possible pause of the recording around a gap of one sender, if nearly all others that should have sent have that
/// gap too, with the number of messages that were due.
fn pause(senders: &[&SendingNode<'_>], restarts: &Restarts, gap: Span) -> Option<(Span, f64)> {
    let (mut should, mut silent, mut due) = (0, 0, 0.0);
    let mut nodes: BTreeSet<Option<Name>> = BTreeSet::new();
    let mut found = Span::new(Stamp::MIN, Stamp::MAX);
    for sender in senders {
        let Some(stretch) = sender.sending(gap.start, gap.nanos()) else {
            should += u64::from(sender.begins_in(gap));
            continue;
        };
        should += 1;
        due += gap.nanos() as f64 / stretch.period.max(1) as f64;
        // The last messages of two senders lie at most a period of either apart.
        let near = stretch.period.saturating_mul(2).max(GAP_NS / 2);
        let Some((last, next)) = sender.gap(gap.start, near) else {
            continue;
        };
        let of_node = sender.node.map_or(&[][..], |node| restarts.of(node));
        let has_restarted = of_node
            .iter()
            .any(|r| r.death < gap.end && gap.start < r.birth);
        if has_restarted || next.is_some_and(|next| gap.end.since(next) > near) {
            continue;
        }
        silent += 1;
        nodes.insert(sender.node);
        found.start = found.start.max(last);
        found.end = found.end.min(next.unwrap_or(Stamp::MAX));
    }
    let is_most = silent >= PAUSE_FEWEST && silent * 100 >= should * PAUSE_SHARE;
    let is_one_node = nodes.len() == 1 && !nodes.contains(&None);
    (is_most && !is_one_node && found.nanos() >= GAP_NS).then_some((found, due))
}

impl Sender {
    /// The lifetimes of an element within the recordings of some senders.
    pub(crate) fn within<'a>(senders: impl Iterator<Item = &'a Self>, lives: &[Span]) -> Vec<Span> {
        let end = senders.map(|sender| sender.recording.1).max();
        let end = end.map_or(Stamp::MAX, |end| end.plus(1));
        let clipped = lives
            .iter()
            .map(|life| Span::new(life.start, life.end.min(end)));
        clipped.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLI: i64 = 1_000_000;

    #[test]
    fn intervals_of_different_bags_overlap() {
        let shared = |all: &[(i64, i64, usize)]| {
            let second = |s: i64| Stamp(s * 1000 * MILLI);
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

    fn stretch(first: i64, last: i64, period: i64) -> Stretch {
        Stretch {
            first: Stamp(first * MILLI),
            last: Stamp(last * MILLI),
            count: 100,
            period: period * MILLI,
            is_even: true,
            is_joined: false,
        }
    }

    fn reported(all: &[(u32, &[Stretch])]) -> Vec<(i64, i64)> {
        let senders: Vec<SendingNode<'_>> = all
            .iter()
            .map(|(node, stretches)| SendingNode {
                node: Some(Name(*node)),
                stretches,
                bags: BTreeSet::new(),
            })
            .collect();
        let senders: Vec<&SendingNode<'_>> = senders.iter().collect();
        let found = gaps(&senders).into_iter();
        let mut found: Vec<_> = found
            .filter_map(|gap| pause(&senders, &Restarts::default(), gap))
            .map(|(pause, _)| (pause.start.0 / MILLI, pause.end.0 / MILLI))
            .collect();
        found.dedup();
        found
    }

    #[test]
    fn simultaneous_pauses_are_a_recorder_pause() {
        let fast = [stretch(0, 9_990, 10), stretch(15_005, 30_000, 10)];
        let slow = [stretch(0, 9_500, 500), stretch(15_400, 30_000, 500)];
        // Too slow to show it: a message every four seconds.
        let seldom = [stretch(0, 30_000, 4_000)];
        let all: &[(u32, &[Stretch])] = &[(1, &fast), (2, &slow), (3, &fast), (4, &seldom)];
        assert_eq!(reported(all), [(9_990, 15_005)]);
    }

    #[test]
    fn a_pause_of_one_node_is_not_a_recorder_pause() {
        let on = [stretch(0, 30_000, 10)];
        let off = [stretch(0, 9_990, 10), stretch(15_005, 30_000, 10)];
        assert_eq!(reported(&[(1, &off), (1, &off), (1, &off)]), []);
        assert_eq!(
            reported(&[(1, &off), (1, &off), (2, &off), (3, &on), (4, &on)]),
            []
        );
    }
}
