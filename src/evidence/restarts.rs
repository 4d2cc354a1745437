//! Restarts of nodes under the same name: their sequence numbers fall back, or their latched messages come again after
//! a silence on all their topics.

use std::collections::BTreeMap;
use std::io;

use crate::base::time::Stamp;
use crate::evidence::claim::Name;
use crate::evidence::collector::Recorded;
use crate::evidence::proof::{ElementKey, Proof, Reliability, Stream, Validity};
use crate::evidence::times::SeriesId;

/// A restart of a node: its last sign before, its first one after.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Restart {
    pub(crate) death: Stamp,
    pub(crate) birth: Stamp,
}

/// Restarts by node, sorted by time.
pub(crate) type Restarts = BTreeMap<Name, Vec<Restart>>;

/// The shortest time of a restart, in nanoseconds: sequence numbers that fall back faster are records out of order.
const OUT_OF_ORDER_NS: i64 = 100_000_000;
/// The shortest silence before a latched message sent again, in nanoseconds: after a shorter one it shows no restart.
const SILENCE_NS: i64 = 1_000_000_000;
/// The fewest messages that show a rhythm.
const RHYTHM: usize = 5;
/// The most messages of a latched topic: one with more is sent again all the time.
const LATCHED: u64 = 20;

/// Finds the restarts of all nodes; `proofs` hold the statements of others about a node, which may lag behind its end.
pub(crate) fn restarts(
    recorded: &Recorded,
    streams: &[Stream],
    proofs: &[Proof],
) -> io::Result<Restarts> {
    let mut all = Restarts::new();
    for (node, own) in own_streams(streams) {
        let mut breaks = fallen_back(recorded, &own)?;
        let own: Vec<&Stream> = own.iter().map(|at| &streams[*at]).collect();
        if breaks.is_empty() && !own.iter().any(|s| may_be_sent_again(recorded, s)) {
            continue;
        }
        let times = own.iter().map(|s| recorded.messages.times(s.times));
        let times = times.collect::<io::Result<Vec<_>>>()?;
        breaks.extend(sent_again(recorded, &own, &times));
        let breaks = narrowed(breaks);
        if !breaks.is_empty() {
            let mut signs: Vec<Stamp> = times.concat();
            signs.extend(said_of(node, proofs));
            signs.sort_unstable();
            let found = breaks
                .iter()
                .filter_map(|(from, to)| widest_gap(&signs, *from, *to));
            all.insert(node, found.collect());
        }
    }
    Ok(all)
}

/// The streams of each publisher with a reliable name.
fn own_streams(streams: &[Stream]) -> BTreeMap<Name, Vec<usize>> {
    let mut of: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
    for (at, stream) in streams.iter().enumerate() {
        if let Some(node) = stream
            .speaker
            .filter(|_| stream.trust == Reliability::Whole)
        {
            of.entry(node).or_default().push(at);
        }
    }
    of
}

/// The times of all statements about a node.
fn said_of(node: Name, proofs: &[Proof]) -> impl Iterator<Item = Stamp> + '_ {
    let of_node = proofs.iter().filter(move |proof| match proof.what {
        ElementKey::Node(name) | ElementKey::Publish(name, _) | ElementKey::Subscribe(_, name) => {
            name == node
        }
        ElementKey::Topic(_) => false,
    });
    of_node
        .flat_map(|proof| match &proof.when {
            Validity::Signs { signs, .. }
            | Validity::Begins { signs, .. }
            | Validity::Moments(signs) => &signs[..],
            _ => &[],
        })
        .copied()
}

/// Stretches of time in which a sequence number of these streams falls back.
fn fallen_back(recorded: &Recorded, streams: &[usize]) -> io::Result<Vec<(Stamp, Stamp)>> {
    let mut topics: BTreeMap<Name, Vec<SeriesId>> = BTreeMap::new();
    let mut ends: BTreeMap<Name, Stamp> = BTreeMap::new();
    for stream in streams {
        let own = &recorded.streams[*stream];
        if let Some((_, last)) = recorded.messages.bounds(own.times) {
            let end = ends.entry(own.topic).or_insert(last);
            *end = last.max(*end);
        }
        if let Some(id) = recorded.facts.sequences.get(stream) {
            let topic = recorded.streams[*stream].topic;
            topics.entry(topic).or_default().push(*id);
        }
    }
    let mut found = Vec::new();
    for (topic, ids) in &topics {
        let end = ends.get(topic).copied().unwrap_or(Stamp::MAX);
        let mut before: Option<(Stamp, u32)> = None;
        recorded.facts.times.merge(ids, |timed| {
            let (time, number) = (timed.time, timed.size);
            // What comes after a stream was divided is another node's.
            if time > end {
                return;
            }
            if let Some((last, highest)) = before
                && number < highest
                && time.since(last) > OUT_OF_ORDER_NS
            {
                found.push((last, time));
            }
            before = Some((time, number));
        })?;
    }
    Ok(found)
}

/// Stretches of time that end with a latched message sent again, and in which no stream with a rhythm had messages.
fn sent_again(
    recorded: &Recorded,
    streams: &[&Stream],
    times: &[Vec<Stamp>],
) -> Vec<(Stamp, Stamp)> {
    let rhythms: Vec<&Vec<Stamp>> = streams
        .iter()
        .zip(times)
        .filter(|(s, times)| !s.latched && times.len() >= RHYTHM)
        .map(|(_, times)| times)
        .collect();
    let mut found = Vec::new();
    for (stream, latched) in streams.iter().zip(times) {
        if !may_be_sent_again(recorded, stream) || rhythms.is_empty() {
            continue;
        }
        for again in latched.iter().skip(1) {
            let silences: Option<Vec<Stamp>> =
                rhythms.iter().map(|r| silent_since(r, *again)).collect();
            if let Some(since) = silences.and_then(|s| s.into_iter().max()) {
                found.push((since, *again));
            }
        }
    }
    found
}

/// Whether a latched stream has few messages, but more than one.
fn may_be_sent_again(recorded: &Recorded, stream: &Stream) -> bool {
    stream.latched && (2..=LATCHED).contains(&recorded.messages.count(stream.times))
}

/// The start of the silence of a stream with a rhythm at `at`; `None` if it is not long for it, or if it has no
/// messages before or after.
fn silent_since(times: &[Stamp], at: Stamp) -> Option<Stamp> {
    let next = times.partition_point(|t| *t < at);
    let last = *times.get(next.checked_sub(1)?)?;
    times.get(next)?;
    let span = times.last()?.since(*times.first()?);
    let usual = span / i64::try_from(times.len() - 1).ok()?.max(1);
    let silence = at.since(last);
    (silence > SILENCE_NS && silence > usual.saturating_mul(3)).then_some(last)
}

/// Joins stretches that overlap, which show the same restart, to the part that they share.
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

/// The longest time between two signs inside a stretch, during which the node was away.
fn widest_gap(signs: &[Stamp], from: Stamp, to: Stamp) -> Option<Restart> {
    let inside = &signs[signs.partition_point(|t| *t < from)..signs.partition_point(|t| *t <= to)];
    let gaps = inside.windows(2).map(|pair| (pair[1].since(pair[0]), pair));
    let (_, pair) = gaps.max_by_key(|(gap, pair)| (*gap, std::cmp::Reverse(pair[0])))?;
    Some(Restart {
        death: pair[0],
        birth: pair[1],
    })
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
        assert_eq!((found.death, found.birth), (signs[2], signs[3]));
    }

    #[test]
    fn what_two_streams_tell_of_one_restart_is_narrowed() {
        let [a, b, c, d] = [1, 2, 3, 4].map(Stamp);
        assert_eq!(narrowed(vec![(b, d), (a, c)]), [(b, c)]);
        assert_eq!(narrowed(vec![(a, b), (c, d)]), [(a, b), (c, d)]);
    }

    #[test]
    fn silence_is_measured_against_the_usual() {
        let steady = stamps(&[0, 10, 20, 30, 40]);
        assert_eq!(silent_since(&steady, stamps(&[25])[0]), None);
        let broken = stamps(&[0, 1, 2, 3, 20, 21, 22]);
        assert_eq!(silent_since(&broken, stamps(&[19])[0]), Some(broken[3]));
        assert_eq!(silent_since(&broken, stamps(&[30])[0]), None);
    }
}
