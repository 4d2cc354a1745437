//! The times of messages: for every publication and topic the intervals without a long silence, in continuous time.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::base::time::{Span, Stamp};

/// The shortest silence, whatever the rhythm, in nanoseconds.
const SILENCE_NS: i64 = 4_000_000_000;
/// The shortest silence as a share of the mission: shorter ones are invisible on paper.
const SILENCE_SHARE: f64 = 0.012;
/// The number of usual periods that make a silence.
const PERIODS: i64 = 4;
/// The most pauses that are kept of each topic: any part of the mission contains one of them, or none that is longer
/// than those within windows.
const PAUSES: usize = 32;

/// The intervals of sending, sorted and disjoint, both ends at a message (the end 1 ns after it).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sending {
    /// Per publication, by id; empty where its messages are not known apart from others'.
    pub publishes: Vec<Vec<Span>>,
    /// Per topic, by id.
    pub topics: Vec<Vec<Span>>,
    /// The longest pauses per topic, by id, at most 32, in order: each from one message to the next.
    pub pauses: Vec<Vec<Span>>,
}

/// The shortest silence in a mission of this length, both in nanoseconds: 4 s, or 1.2 % of it.
pub(crate) fn shortest_silence(mission: i64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a share of an i64")]
    let share = (mission as f64 * SILENCE_SHARE) as i64;
    SILENCE_NS.max(share)
}

/// The intervals and gaps of one sequence of messages.
#[derive(Clone, Debug, Default)]
pub(crate) struct SendingRuns {
    first: Option<Stamp>,
    last: Stamp,
    gaps: i64,
    /// Gaps that may be silences; at most 1 / 1.2 % of them.
    long: Vec<(Stamp, Stamp)>,
}

impl SendingRuns {
    /// Adds the next message; `least` is the shortest silence.
    pub(crate) fn hear(&mut self, time: Stamp, least: i64) {
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

    /// The intervals without a silence, which lasts at least four usual periods and `least`.
    pub(crate) fn stretches(&self) -> Vec<Span> {
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

/// The longest pauses of one sequence of messages, collected message by message.
#[derive(Clone, Debug, Default)]
pub(crate) struct LongestPauses {
    last: Option<Stamp>,
    /// The longest so far, by length; the shortest is replaced first.
    longest: BinaryHeap<Reverse<(i64, Stamp)>>,
}

impl LongestPauses {
    /// Adds the next message.
    pub(crate) fn hear(&mut self, time: Stamp) {
        let Some(last) = self.last.replace(time) else {
            return;
        };
        let pause = time.since(last);
        if self.longest.len() < PAUSES {
            self.longest.push(Reverse((pause, last)));
        } else if let Some(mut shortest) = self.longest.peek_mut()
            && shortest.0.0 < pause
        {
            *shortest = Reverse((pause, last));
        }
    }

    /// All pauses in order.
    pub(crate) fn spans(self) -> Vec<Span> {
        let longest = self.longest.into_iter();
        let span = |Reverse((pause, start)): Reverse<(i64, Stamp)>| Span {
            start,
            end: start.plus(pause),
        };
        let mut all: Vec<Span> = longest.map(span).collect();
        all.sort_unstable_by_key(|span| span.start);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stretches in seconds of messages at these seconds, where a silence lasts at least 4 s.
    fn stretches(times: &[i64]) -> Vec<(i64, i64)> {
        let mut runs = SendingRuns::default();
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
    fn the_longest_pauses_are_kept_in_order() {
        let mut pauses = LongestPauses::default();
        let mut at = 0;
        // 1 to 40 ns, the long ones early.
        for pause in (1..=40).rev() {
            pauses.hear(Stamp(at));
            at += pause;
        }
        pauses.hear(Stamp(at));
        let spans = pauses.spans();
        let lengths: Vec<i64> = spans.iter().map(Span::nanos).collect();
        assert_eq!(lengths, (9..=40).rev().collect::<Vec<_>>());
        assert_eq!((spans[1].start, spans[1].end), (Stamp(40), Stamp(79)));
    }

    #[test]
    fn what_is_always_slow_is_not_silent() {
        assert_eq!(stretches(&[0, 10, 20, 30, 40]), [(0, 40)]);
        assert_eq!(stretches(&[0, 10, 20, 30, 90, 100]), [(0, 30), (90, 100)]);
        assert_eq!(stretches(&[7]), [(7, 7)]);
    }
}
