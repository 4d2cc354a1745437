//! Restarts of nodes under the same name: after a gap the sequence numbers of a stream start over, or latched
//! messages are sent again. For example, `/scan` counts to 4711, is silent for 3 s and continues with 0, while no other topic of
//! `/lidar` had a message in the gap: `/lidar` ended at the last message and began again with the next.

use std::collections::BTreeSet;
use std::io;

use crate::base::error::Result;
use crate::base::ids::{Few, grouped};
use crate::base::name::is_log;
use crate::base::rhythm::{BEGUN_LONG, DECLARED_NS, FEWEST, GAP, GAP_NS, broken_after};
use crate::base::time::Stamp;
use crate::evidence::collector::{Recorded, spool_error};
use crate::evidence::conclude::Findings;
use crate::evidence::inference::{Inference, Reliability, Validity};
use crate::evidence::numbers::{Number, Numbers};
use crate::evidence::observation::Name;
use crate::evidence::source_word;
use crate::graph::history::Stretch;
use crate::graph::history::senders::{Sender, Traffic};

/// A restart of a node: its last sign before, its first one after. If it is not known when it was last there, one is just before
/// the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Restart {
    pub(crate) death: Stamp,
    pub(crate) birth: Stamp,
    /// Whether rhythms show that it was away from one to the other, not only unseen.
    pub(crate) is_proved: bool,
}

impl Restart {
    /// Whether it is known when the node was last there.
    pub(crate) fn is_timed(&self) -> bool {
        self.birth.since(self.death) > 1
    }
}

/// Restarts by node, sorted by time.
pub(crate) type Restarts = Few<Name, Vec<Restart>>;

/// The most gaps, of all nodes together, around which numbers are requested: each requires reading two
/// chunks, so that so many take a second. Missions have a few dozen gaps.
const MOST_ASKED: usize = 256;

/// A stream of a node, and the messages on its topic.
struct Own<'a> {
    topic: Name,
    sender: &'a Sender,
    /// The indices of the streams of this sender.
    streams: Vec<usize>,
}

impl Own<'_> {
    /// Whether this stream shows that its node was there in a gap of another one. `times` are those of its messages, read on
    /// demand, and only if they are few.
    fn goes_on(
        &self,
        (from, to): (Stamp, Stamp),
        recorded: &Recorded,
        times: &mut Option<Vec<Stamp>>,
    ) -> io::Result<bool> {
        let middle = middle((from, to));
        let spans = |s: &&Stretch| s.first < middle && middle < s.last;
        let period = self.sender.stretches.iter().find(spans).map(|s| s.period);
        let is_below =
            |times: i64| period.is_some_and(|p| p.saturating_mul(times) < to.since(from));
        // Its usual interval is so short that it cannot contain the gap.
        let is_fast = is_below(GAP * GAP);
        // It shows nothing if it is too slow, or has no messages on both sides.
        if is_fast || !is_below(GAP) {
            return Ok(is_fast);
        }
        if times.is_none() {
            *times = Some(self.times(recorded)?);
        }
        Ok(is_in_middle(
            times.as_deref().unwrap_or_default(),
            (from, to),
        ))
    }

    /// Whether a rhythm ends at the one time and another begins at the other, as far as their intervals show.
    fn beats(&self, death: Stamp, birth: Stamp) -> [bool; 2] {
        let away = birth.since(death);
        let is_near = |late: i64, s: &Stretch| (0..=broken_after(s.period)).contains(&late);
        let all = self.sender.stretches.iter();
        let all = all.filter(|_| !self.sender.latched);
        let mut even = all.filter(|s| s.is_even && s.count >= FEWEST && s.period * 2 <= away);
        let ends = even
            .clone()
            .any(|s| s.first <= death && is_near(death.since(s.last), s));
        [ends, even.any(|s| is_near(s.first.since(birth), s))]
    }

    /// The times of its messages, sorted.
    fn times(&self, recorded: &Recorded) -> io::Result<Vec<Stamp>> {
        let of = |at: &usize| recorded.messages.times(recorded.streams[*at].times);
        let times = self.streams.iter().map(of);
        let mut times = times.collect::<io::Result<Vec<_>>>()?.concat();
        times.sort_unstable();
        Ok(times)
    }
}

/// The streams of each publisher with a reliable name.
fn own_streams<'a>(findings: &Findings, traffic: &'a Traffic) -> Few<Name, Vec<Own<'a>>> {
    let mut own: Few<Name, Vec<Own<'a>>> = Few::default();
    for (topic, all) in traffic.somes() {
        let mut streams: Vec<Vec<usize>> = vec![Vec::new(); all.list.len()];
        for (at, of) in all.streams.iter().zip(&all.of) {
            streams[*of].push(*at);
        }
        for (sender, streams) in all.list.iter().zip(streams) {
            let is_whole = |at: &usize| findings.streams[*at].trust == Reliability::Whole;
            if let Some(node) = sender.node.filter(|_| streams.iter().all(is_whole)) {
                own.grown(node).push(Own {
                    topic,
                    sender,
                    streams,
                });
            }
        }
    }
    own
}

/// The gaps in any of a node's streams during which none of its other streams continued.
fn gaps(recorded: &Recorded, own: &[Own<'_>]) -> io::Result<BTreeSet<(Stamp, Stamp)>> {
    let steady = own.iter().filter(|own| !own.sender.latched);
    let mut gaps: BTreeSet<_> = steady.flat_map(|own| own.sender.gaps()).collect();
    for one in own {
        let mut times = None;
        let mut open = BTreeSet::new();
        for gap in gaps {
            if !one.goes_on(gap, recorded, &mut times)? {
                open.insert(gap);
            }
        }
        gaps = open;
    }
    Ok(gaps)
}

/// Whether one of these times lies in the middle half of a gap.
fn is_in_middle(times: &[Stamp], (from, to): (Stamp, Stamp)) -> bool {
    let edge = to.since(from) / 4;
    let next = times.partition_point(|time| *time < from.plus(edge));
    times.get(next).is_some_and(|time| *time <= to.plus(-edge))
}

fn middle((from, to): (Stamp, Stamp)) -> Stamp {
    from.plus(to.since(from) / 2)
}

/// A message: its time and the index of its stream.
type Place = (Stamp, usize);

/// The numbered streams of a sender, with the times of their messages. A split recording has one for each part.
fn numbered(recorded: &Recorded, own: &Own<'_>) -> io::Result<Vec<(usize, Vec<Stamp>)>> {
    let is_numbered = |at: &&usize| recorded.numbers.some(**at).is_some();
    let times = |at: &usize| Ok((*at, recorded.messages.times(recorded.streams[*at].times)?));
    own.streams.iter().filter(is_numbered).map(times).collect()
}

/// The last message of several streams before the middle of a gap, and the first one after it.
fn around_all(streams: &[(usize, Vec<Stamp>)], gap: (Stamp, Stamp)) -> Option<(Place, Place)> {
    let middle = middle(gap);
    let cut = |times: &[Stamp]| times.partition_point(|time| *time <= middle);
    let all = || {
        streams
            .iter()
            .map(|(at, times)| (times.split_at(cut(times)), *at))
    };
    let before = all().filter_map(|((before, _), at)| Some((*before.last()?, at)));
    let after = all().filter_map(|((_, after), at)| Some((*after.first()?, at)));
    Some((before.max()?, after.min()?))
}

/// The unread messages, by stream and time, that could reveal more restarts by their numbers.
pub(crate) fn unread(
    recorded: &Recorded,
    findings: &Findings,
    traffic: &Traffic,
) -> Result<BTreeSet<(usize, Stamp)>> {
    let mut asked = BTreeSet::new();
    for (_, own) in own_streams(findings, traffic).with_ids() {
        let is_unread = |at: &&usize| {
            let read = recorded.numbers.some(**at).map(|numbers| numbers.read);
            read.is_some_and(|read| read < recorded.messages.count(recorded.streams[**at].times))
        };
        let is_known = |own: &Own<'_>| !own.streams.iter().any(|at| is_unread(&at));
        if own.iter().all(is_known) {
            continue;
        }
        let gaps = gaps(recorded, own).map_err(spool_error)?;
        for one in own.iter().filter(|one| !gaps.is_empty() && !is_known(one)) {
            let streams = numbered(recorded, one).map_err(spool_error)?;
            let around = gaps.iter().filter_map(|gap| around_all(&streams, *gap));
            let places = around.flat_map(|(before, after)| [before, after]);
            asked.extend(places.map(|(time, at)| (at, time)));
            if asked.len() > 2 * MOST_ASKED {
                return Ok(asked);
            }
        }
    }
    Ok(asked)
}

/// Finds the restarts of all nodes, except those that several recordings or runs show at the same time.
pub(crate) fn restarts(
    recorded: &Recorded,
    findings: &Findings,
    traffic: &Traffic,
    doubled: &BTreeSet<Name>,
) -> io::Result<Restarts> {
    if recorded.overlaps {
        return Ok(Restarts::default());
    }
    let mut nodes = own_streams(findings, traffic);
    // The messages of two robots under one name overlap in time.
    for node in doubled {
        nodes.grown(*node).clear();
    }
    let falls = nodes.with_ids();
    let falls = falls.map(|(node, own)| Ok((node, falls_of(recorded, findings, node, own)?)));
    let falls: Few<Name, Vec<Fall>> = falls.collect::<io::Result<_>>()?;
    let of_all = falls.with_ids();
    let of_all = of_all.flat_map(|(node, of)| of.iter().map(move |fall| (node, fall)));
    let stamped = of_all.filter(|(_, fall)| fall.first.stamp != 0);
    let alike = grouped(stamped.map(|(node, fall)| (fall.header(), (node, fall))));
    let said = said(&findings.inferences);
    let mut all = declared(recorded, &said)?;
    for (node, own) in nodes.with_ids() {
        let is_copy = |fall: &&Fall| {
            let mut alike = alike.get(&fall.header()).into_iter().flatten();
            // A throttle drops messages, and the recorder may receive the copy first.
            alike.any(|(other, of)| *other != node && (of.before, fall.to) > (fall.before, of.to))
        };
        let own_falls = falls.of(node).iter().filter(|fall| !is_copy(fall));
        let mut breaks: Vec<_> = own_falls.map(|fall| (fall.from, fall.to)).collect();
        breaks.extend(sent_again(recorded, own)?);
        let mut breaks = narrowed(breaks);
        for log in own.iter().filter(|own| logs(recorded, own)) {
            breaks.retain(|gap| !counts_on(recorded, log, *gap));
        }
        if breaks.is_empty() {
            continue;
        }
        let times = own.iter().map(|own| own.times(recorded));
        let mut signs = times.collect::<io::Result<Vec<_>>>()?.concat();
        let inferences = said.of(node).iter();
        signs.extend(inferences.copied().flat_map(signs_of));
        signs.sort_unstable();
        let away = breaks.iter().filter_map(|(from, to)| {
            if to.since(*from) < GAP_NS {
                return Some((*from, *to));
            }
            widest_gap(&signs, *from, *to)
        });
        all.grown(node).extend(away.map(|(death, birth)| {
            let beats = own.iter().map(|own| own.beats(death, birth));
            let [ends, begins] = beats.fold([false; 2], |all, [a, b]| [all[0] | a, all[1] | b]);
            Restart {
                death,
                birth,
                is_proved: ends && begins,
            }
        }));
    }
    Ok(all)
}

/// Whether a process continues to number its log records across a gap in its other messages, so that it did
/// not end.
fn counts_on(recorded: &Recorded, log: &Own<'_>, gap: (Stamp, Stamp)) -> bool {
    // An error of reading recurs.
    let streams = numbered(recorded, log).unwrap_or_default();
    streams.iter().any(|stream| {
        let around = around_all(std::slice::from_ref(stream), gap);
        let both = around.zip(recorded.numbers.some(stream.0));
        both.is_some_and(|((from, to), numbers)| numbers.count_on(from.0, to.0))
    })
}

/// A gap after which the sequence numbers of a stream started over.
struct Fall {
    from: Stamp,
    to: Stamp,
    /// The type of the messages, the last number before, and the first header after the gap.
    kind: std::sync::Arc<str>,
    before: u32,
    first: Number,
}

impl Fall {
    /// The key that it shares with copies: messages of another stream that are forwarded with their headers,
    /// whose numbers say nothing about the forwarding node.
    fn header(&self) -> (u64, u32, &str) {
        (self.first.stamp, self.first.number, &self.kind)
    }
}

/// The gaps after which the numbers of a node's streams started over; without streams that forward another's
/// messages.
fn falls_of(
    recorded: &Recorded,
    findings: &Findings,
    node: Name,
    own: &[Own<'_>],
) -> io::Result<Vec<Fall>> {
    let mut falls = Vec::new();
    let gaps = gaps(recorded, own)?;
    for one in own {
        if findings.copies.contains(&(node, one.topic)) {
            continue;
        }
        let streams = numbered(recorded, one)?;
        // Between two messages, possibly of two parts of a recording, and the gaps between them.
        let around = |gap: &_| Some((around_all(&streams, *gap)?, *gap));
        let mut breaks = grouped(gaps.iter().filter_map(around));
        // The numbers of log records are those of all of a process, which have no rhythm; of other messages, those may start
        // over at once.
        let is_log = logs(recorded, one);
        let is_quick = |from: Place, to: Place| {
            let numbers = recorded.numbers.some(from.1);
            let is_high = |numbers: &Numbers| {
                let many = recorded.messages.count(recorded.streams[from.1].times);
                let has_begun = |before: Number| before.number > BEGUN_LONG;
                numbers.at(from.0).is_some_and(has_begun) && numbers.is_one_counter(many)
            };
            to.0.since(from.0) < GAP_NS && from.1 == to.1 && numbers.is_some_and(is_high)
        };
        let between = between_records(recorded, &streams);
        let between = between
            .filter(|(from, to)| is_log && to.0.since(from.0) >= GAP_NS || is_quick(*from, *to));
        breaks.extend(between.map(|places| (places, Vec::new())));
        for (((last, before), (next, after)), gaps) in breaks {
            let number = |at: usize, time| recorded.numbers.some(at)?.at(time);
            let numbers = number(before, last).zip(number(after, next));
            let common = gaps.iter().fold((last, next), |all, gap| {
                (all.0.max(gap.0), all.1.min(gap.1))
            });
            // Which of several gaps the restart was in, this stream does not show.
            let is_one = common.0 < common.1;
            let (from, to) = if is_one { common } else { (last, next) };
            let begun = numbers.filter(|(before, first)| first.begins_after(*before));
            falls.extend(begun.map(|(number, first)| Fall {
                from,
                to,
                kind: recorded.streams[after].connection.type_name.clone(),
                before: number.number,
                first,
            }));
        }
    }
    Ok(falls)
}

/// Whether a node publishes its log records there.
fn logs(recorded: &Recorded, own: &Own<'_>) -> bool {
    let mut streams = own.streams.iter().map(|at| &recorded.streams[*at]);
    streams.any(|stream| is_log(stream.connection.topic.as_str()))
}

/// The log records between which numbers start over after a gap, or may do so between two parts of a recording.
fn between_records(
    recorded: &Recorded,
    streams: &[(usize, Vec<Stamp>)],
) -> impl Iterator<Item = (Place, Place)> {
    let ends =
        |(at, times): &(usize, Vec<Stamp>)| Some(((*times.first()?, *at), (*times.last()?, *at)));
    let mut parts: Vec<(Place, Place)> = streams.iter().filter_map(ends).collect();
    parts.sort_unstable();
    let next = parts.windows(2).map(|pair| (pair[0].1, pair[1].0));
    let next: Vec<_> = next.filter(|(last, first)| last.0 < first.0).collect();
    let inside = streams.iter().flat_map(|(at, _)| {
        let numbers = recorded.numbers.some(*at).into_iter();
        let falls = numbers.flat_map(|own| &own.falls);
        falls.map(|(from, to)| ((*from, *at), (*to, *at)))
    });
    next.into_iter().chain(inside)
}

/// The starts that nodes of ROS 2 declare after other signs of them, or messages of their own topics, by the source of parameter
/// events.
fn declared(recorded: &Recorded, said: &Few<Name, Vec<&Inference>>) -> io::Result<Restarts> {
    let mut all = Restarts::default();
    for (node, of) in said.with_ids() {
        let mut starts: Vec<Stamp> = Vec::new();
        let (mut signs, mut sent): (BTreeSet<Stamp>, BTreeSet<Stamp>) = Default::default();
        for one in of {
            match (source_word(one.source), &one.when) {
                ("parameter_events", Validity::Begins { signs, .. }) => starts.extend(signs),
                ("private_name", Validity::Messages(at)) => {
                    sent.extend(recorded.messages.times(recorded.streams[*at].times)?);
                }
                // The start in an anonymous name is that of the process.
                ("anonymous", _) => {}
                _ => signs.extend(signs_of(one)),
            }
        }
        starts.sort_unstable();
        signs.extend(&starts);
        let mut before = signs.first().copied().unwrap_or(Stamp::MAX);
        for birth in starts {
            let is_over = |last: &&Stamp| birth.since(**last) > DECLARED_NS;
            let last = sent.range(..birth).next_back().filter(is_over);
            if last.is_some() || birth.since(before) > DECLARED_NS {
                // Only its messages show when it was last there.
                let last = last.max(signs.range(..birth).next_back().filter(|_| last.is_some()));
                all.grown(node).push(Restart {
                    death: last.copied().unwrap_or(birth.plus(-1)),
                    birth,
                    is_proved: false,
                });
            }
            before = birth;
        }
    }
    Ok(all)
}

/// All statements about each node.
fn said(inferences: &[Inference]) -> Few<Name, Vec<&Inference>> {
    let nodes = inferences.iter().filter_map(|inference| {
        let [node, _] = inference.what.ends();
        Some((node?, inference))
    });
    grouped(nodes).into_iter().collect()
}

/// The times of a statement.
fn signs_of(inference: &Inference) -> &[Stamp] {
    match &inference.when {
        Validity::Signs { signs, .. }
        | Validity::Begins { signs, .. }
        | Validity::Moments(signs) => signs,
        _ => &[],
    }
}

/// Intervals that end with a latched message sent again, and in which no stream with a rhythm had messages.
fn sent_again(recorded: &Recorded, own: &[Own<'_>]) -> io::Result<Vec<(Stamp, Stamp)>> {
    let rhythms = || {
        let all = own.iter().filter(|own| !own.sender.latched);
        let stretches = all.map(|own| &own.sender.stretches[..]);
        stretches.filter(|all| all.iter().map(|s| s.count).sum::<u64>() >= FEWEST)
    };
    let mut found = Vec::new();
    if rhythms().next().is_none() {
        return Ok(found);
    }
    let latched = own.iter().filter(|own| own.sender.latched);
    for at in latched.flat_map(|own| &own.streams) {
        let times = recorded.messages.times(recorded.streams[*at].times)?;
        for again in times.into_iter().skip(1) {
            let silences: Option<Vec<Stamp>> = rhythms().map(|r| silent_since(r, again)).collect();
            let since = silences.and_then(|s| s.into_iter().max());
            found.extend(since.map(|since| (since, again)));
        }
    }
    Ok(found)
}

/// The start of the gap at `at`; `None` if there is none.
fn silent_since(stretches: &[Stretch], at: Stamp) -> Option<Stamp> {
    let next = stretches.partition_point(|s| s.first < at);
    let (before, after) = (stretches.get(next.checked_sub(1)?)?, stretches.get(next)?);
    (!after.is_joined && before.last < at && at.since(before.last) >= GAP_NS).then_some(before.last)
}

/// Intersects intervals that overlap, which show the same restart.
fn narrowed(mut breaks: Vec<(Stamp, Stamp)>) -> Vec<(Stamp, Stamp)> {
    breaks.sort_unstable();
    let mut narrow: Vec<(Stamp, Stamp)> = Vec::new();
    for (from, to) in breaks {
        match narrow.last_mut() {
            Some(last) if from < last.1 => *last = (last.0.max(from), last.1.min(to)),
            _ => narrow.push((from, to)),
        }
    }
    narrow
}

/// The longest time between two signs inside an interval, during which the node was away.
fn widest_gap(signs: &[Stamp], from: Stamp, to: Stamp) -> Option<(Stamp, Stamp)> {
    let inside = &signs[signs.partition_point(|t| *t < from)..signs.partition_point(|t| *t <= to)];
    let gaps = inside.windows(2).map(|pair| (pair[1].since(pair[0]), pair));
    let (gap, pair) = gaps.max_by_key(|(gap, pair)| (*gap, std::cmp::Reverse(pair[0])))?;
    (gap >= GAP_NS).then(|| (pair[0], pair[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamps(times: &[i64]) -> Vec<Stamp> {
        times.iter().map(|t| Stamp(t * 1_000_000_000)).collect()
    }

    #[test]
    fn the_node_was_away_in_the_widest_gap() {
        let signs = stamps(&[1, 2, 3, 20, 21, 22]);
        let found = widest_gap(&signs, signs[1], signs[4]).unwrap();
        assert_eq!(found, (signs[2], signs[3]));
    }

    #[test]
    fn a_node_without_gaps_was_not_away() {
        let signs: Vec<Stamp> = (0..100).map(|n| Stamp(n * 90_000_000)).collect();
        assert_eq!(widest_gap(&signs, signs[1], signs[90]), None);
    }

    #[test]
    fn restart_times_from_two_streams_are_intersected() {
        let [a, b, c, d] = [1, 2, 3, 4].map(Stamp);
        assert_eq!(narrowed(vec![(b, d), (a, c)]), [(b, c)]);
        assert_eq!(narrowed(vec![(a, b), (c, d)]), [(a, b), (c, d)]);
    }
}
