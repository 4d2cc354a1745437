//! The times at which nothing was recorded. For example, if 30 of 31 senders at 10 Hz are silent from 80 s to 95 s and go on with
//! their numbers, the recorder was paused, and none of the nodes was silent.

use std::collections::BTreeSet;
use std::io;

use crate::base::rhythm::{
    FEWEST, GAP, GAP_NS, PAUSE_FEWEST, PAUSE_MOST, PAUSE_MOST_SHARE, PAUSE_SHARE,
};
use crate::base::time::{DAY, Span, Stamp};
use crate::evidence::clock::FAR_DAYS;
use crate::evidence::collector::Recorded;
use crate::evidence::inference::Stream;
use crate::evidence::observation::Name;
use crate::graph::history::Stretch;
use crate::graph::history::restarts::{Restart, Restarts};
use crate::graph::history::senders::{Sender, Traffic};

/// A sender with its recordings.
struct SendingNode<'a> {
    sender: &'a Sender,
    bags: BTreeSet<usize>,
}

impl SendingNode<'_> {
    /// The messages around a moment, if the next one is due long before `length` is over.
    fn sending(&self, at: Stamp, length: i64) -> Option<&Stretch> {
        let next = self.sender.stretches.partition_point(|s| s.first <= at);
        let stretch = self.sender.stretches.get(next.checked_sub(1)?)?;
        let late = at.since(stretch.last);
        let is_fast = stretch.period.saturating_mul(GAP) <= length;
        (stretch.count >= FEWEST && is_fast && late <= stretch.period.saturating_mul(2))
            .then_some(stretch)
    }

    /// Whether it begins to publish well inside a gap.
    fn begins_in(&self, gap: Span) -> bool {
        let edge = gap.nanos() / 8;
        let inside = gap.start.plus(edge)..gap.end.plus(-edge);
        let mut stretches = self.sender.stretches.iter();
        stretches.any(|s| inside.contains(&s.first))
    }

    /// The gap that begins around a moment, give or take `near` nanoseconds: the last message and the next one.
    fn gap(&self, at: Stamp, near: i64) -> Option<(Stamp, Option<Stamp>)> {
        let all = &self.sender.stretches;
        let place = all.partition_point(|s| s.last < at.plus(-near));
        let last = all.get(place)?.last;
        let next = all.get(place + 1);
        let is_gap = next.is_none_or(|next| !next.is_joined) && last.since(at) <= near;
        is_gap.then(|| (last, next.map(|next| next.first)))
    }
}

/// The most gaps of a sender of which any may be a pause of the recorder: one with more only publishes when
/// needed, and each is compared with all senders. Nobody pauses a recorder more often.
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
                sender,
                bags: own.map(|(at, _)| streams[*at].bag).collect(),
            });
        }
    }
    let bags: BTreeSet<usize> = senders.iter().flat_map(|one| one.bags.clone()).collect();
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
    let sending = stretches.map(|s| Span::new(s.first, s.last)).collect();
    let runs = Span::joined(sending, FAR_DAYS * DAY);
    let jumps = runs
        .windows(2)
        .map(|pair| Span::new(pair[0].end, pair[1].start));
    jumps.collect()
}

/// The gaps of senders that rarely have any, sorted.
fn gaps(senders: &[&SendingNode<'_>]) -> Vec<Span> {
    let senders = senders.iter().map(|one| one.sender);
    let steady = senders.filter(|sender| sender.stretches.len() <= MOST_GAPS);
    let gaps = steady.flat_map(Sender::gaps);
    let mut gaps: Vec<Span> = gaps.map(|(from, to)| Span::new(from, to)).collect();
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
        let of_node = sender.sender.node.map_or(&[][..], |node| restarts.of(node));
        let is_within = |r: &Restart| r.death < gap.end && gap.start < r.birth;
        let has_restarted = of_node.iter().any(is_within);
        if has_restarted || next.is_some_and(|next| gap.end.since(next) > near) {
            continue;
        }
        silent += 1;
        nodes.insert(sender.sender.node);
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
        let clipped = |life: &Span| Span::new(life.start, life.end.min(end));
        lives.iter().map(clipped).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLI: i64 = 1_000_000;

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
        let sender = |(node, stretches): &(u32, &[Stretch])| Sender {
            node: Some(Name(*node)),
            latched: false,
            stretches: stretches.to_vec(),
            recording: (Stamp::MIN, Stamp::MAX),
        };
        let senders: Vec<Sender> = all.iter().map(sender).collect();
        let sending = |sender| SendingNode {
            sender,
            bags: BTreeSet::new(),
        };
        let senders: Vec<SendingNode<'_>> = senders.iter().map(sending).collect();
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
