//! When messages came: for every publication and topic the stretches without a long silence, in continuous time.

use std::io;

use crate::base::error::Result;
use crate::base::time::{Span, Stamp};
use crate::evidence::claim::Name;
use crate::evidence::collector::{Collected, spool_error};
use crate::evidence::proof::Reliability;
use crate::graph::Elements;

/// The shortest silence that is one, whatever the rhythm.
const SILENCE_NS: i64 = 4_000_000_000;
/// The same as a share of the mission: below it nothing is seen on paper.
const SILENCE_SHARE: f64 = 0.012;
/// Periods that make a silence.
const PERIODS: i64 = 4;

/// Stretches of sending, sorted and disjoint, both ends at a message (the end 1 ns after it).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sending {
    /// Per publication, by id; empty where its messages are not known from others'.
    pub publishes: Vec<Vec<Span>>,
    /// Per topic, by id.
    pub topics: Vec<Vec<Span>>,
}

/// The stretches of sending of all `elements`, which are those built from `collected`. A silence lasts at least four
/// usual periods, 4 s and 1.2 % of the mission.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn sending(collected: &mut Collected, elements: &Elements) -> Result<Sending> {
    let mut all = Sending {
        publishes: vec![Vec::new(); elements.publishes.len()],
        topics: vec![Vec::new(); elements.topics.len()],
    };
    let span = collected.span.map_or(0, |s| s.nanos());
    #[expect(clippy::cast_possible_truncation, reason = "a share of an i64")]
    let least = SILENCE_NS.max((span as f64 * SILENCE_SHARE) as i64);
    for (id, topic) in elements.topics.iter().enumerate() {
        let streams = streams(collected, topic.name.as_str());
        let speakers = speakers(collected, &streams);
        let mut runs = vec![Runs::default(); speakers.len() + 1];
        each_message(collected, &streams, |place, time| {
            runs[speakers.len()].hear(time, least);
            let own = speakers.iter().position(|(_, of)| of.contains(&place));
            if let Some(run) = own.and_then(|own| runs.get_mut(own)) {
                run.hear(time, least);
            }
        })
        .map_err(spool_error)?;
        all.topics[id] = runs.pop().unwrap_or_default().stretches();
        for ((node, _), run) in speakers.iter().zip(runs) {
            let name = collected.facts.text(*node);
            if let Some(edge) = publication(elements, &name, id) {
                all.publishes[edge] = run.stretches();
            }
        }
    }
    Ok(all)
}

/// The places of a topic's streams.
fn streams(collected: &Collected, topic: &str) -> Vec<usize> {
    let Some(name) = collected.facts.known(topic) else {
        return Vec::new();
    };
    let of_topic = |s: &usize| collected.streams[*s].topic == name;
    (0..collected.streams.len()).filter(of_topic).collect()
}

/// The publishers that are believed, with the places of theirs among `streams`.
fn speakers(collected: &Collected, streams: &[usize]) -> Vec<(Name, Vec<usize>)> {
    let mut all: Vec<(Name, Vec<usize>)> = Vec::new();
    for (place, stream) in streams.iter().enumerate() {
        let stream = &collected.streams[*stream];
        let trusted = stream.trust != Reliability::First;
        let Some(node) = stream.speaker.filter(|_| trusted) else {
            continue;
        };
        match all.iter_mut().find(|(name, _)| *name == node) {
            Some((_, places)) => places.push(place),
            None => all.push((node, vec![place])),
        }
    }
    all
}

fn each_message(
    collected: &mut Collected,
    streams: &[usize],
    mut each: impl FnMut(usize, Stamp),
) -> io::Result<()> {
    let ids: Vec<_> = streams
        .iter()
        .map(|s| collected.streams[*s].times)
        .collect();
    let believed = collected.believed;
    collected.messages.merge(&ids, |timed| {
        if believed.is_none_or(|span| span.contains(timed.time)) {
            each(timed.series, timed.time);
        }
    })
}

/// The publication of a node on a topic, by name and id.
fn publication(elements: &Elements, node: &str, topic: usize) -> Option<usize> {
    let node = elements
        .nodes
        .binary_search_by(|n| n.name.as_str().cmp(node));
    let key = (u32::try_from(node.ok()?).ok()?, u32::try_from(topic).ok()?);
    let found = elements
        .publishes
        .binary_search_by_key(&key, |e| (e.node, e.topic));
    found.ok()
}

/// What was heard of one sequence of messages.
#[derive(Clone, Debug, Default)]
struct Runs {
    first: Option<Stamp>,
    last: Stamp,
    gaps: i64,
    /// Gaps that may be silences; at most 1 / 1.2 % of them.
    long: Vec<(Stamp, Stamp)>,
}

impl Runs {
    /// Takes the next message; `least` is the shortest silence.
    fn hear(&mut self, time: Stamp, least: i64) {
        if self.first.is_none() {
            self.first = Some(time);
        } else {
            self.gaps += 1;
            if time.since(self.last) >= least {
                self.long.push((self.last, time));
            }
        }
        self.last = time;
    }

    /// The usual time between messages: the mean without long gaps, or the median of these where they are the rule.
    fn usual(&self) -> i64 {
        let long = i64::try_from(self.long.len()).unwrap_or(i64::MAX);
        let mut gaps: Vec<i64> = self.long.iter().map(|(a, b)| b.since(*a)).collect();
        if long * 2 > self.gaps {
            gaps.sort_unstable();
            return gaps[gaps.len() / 2];
        }
        let whole = self.last.since(self.first.unwrap_or(self.last));
        (whole - gaps.iter().sum::<i64>()) / (self.gaps - long).max(1)
    }

    fn stretches(&self) -> Vec<Span> {
        let Some(first) = self.first else {
            return Vec::new();
        };
        let silence = self.usual().saturating_mul(PERIODS);
        let silences = self.long.iter().filter(|(a, b)| b.since(*a) >= silence);
        let mut all = Vec::new();
        let mut start = first;
        for (from, to) in silences {
            all.push(Span {
                start,
                end: from.plus(1),
            });
            start = *to;
        }
        all.push(Span {
            start,
            end: self.last.plus(1),
        });
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stretches in seconds of messages at these seconds, where a silence lasts at least 4 s.
    fn stretches(times: &[i64]) -> Vec<(i64, i64)> {
        let mut runs = Runs::default();
        for time in times {
            runs.hear(Stamp(time * 1_000_000_000), SILENCE_NS);
        }
        let all = runs.stretches();
        let second = |s: Stamp| s.0 / 1_000_000_000;
        all.iter()
            .map(|s| (second(s.start), second(s.end)))
            .collect()
    }

    #[test]
    fn a_long_silence_ends_a_stretch_at_its_last_message() {
        assert_eq!(stretches(&[1, 2, 3, 4, 5, 12, 13, 14]), [(1, 5), (12, 14)]);
        assert_eq!(stretches(&[1, 2, 3, 6]), [(1, 6)]);
        assert_eq!(stretches(&[]), []);
    }

    #[test]
    fn what_is_always_slow_is_not_silent() {
        assert_eq!(stretches(&[0, 10, 20, 30, 40]), [(0, 40)]);
        assert_eq!(stretches(&[0, 10, 20, 30, 90, 100]), [(0, 30), (90, 100)]);
        assert_eq!(stretches(&[7]), [(7, 7)]);
    }
}
