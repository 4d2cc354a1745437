//! A mission in continuous time: the lifetimes of each element with their uncertainty, and the messages of
//! every sender as stretches of one rate.
//!
//! In: everything recorded, and the findings. Out: a [`History`], made once, from which windows, events, phases and figures
//! are derived; nothing here depends on windows. Begin with `records`, which calls the others in order: `senders` reads the
//! times of every topic and recording, `restarts`, `pauses` and `simulation` find restarts and the pauses of recorders and simulators
//! in them, `liveness` collects the signs of each element, `lifetimes` decides when it existed.

mod lifetimes;
mod liveness;
mod pauses;
pub(crate) mod records;
mod restarts;
pub(crate) mod senders;
pub(crate) mod simulation;
pub(crate) mod windows;

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{ById, NodeId, TopicId};
use crate::base::cast::to_i64;
use crate::base::rhythm::{
    ALIKE, FEWEST, FEWEST_OF_RATE, GONE_NS, LONGER, OFTEN, RATE_HOLDS_NS, STEADY, STEADY_NS,
    broken_after,
};
use crate::base::time::{Span, Stamp};

pub(crate) use records::{History, Record, made};
pub(crate) use restarts::unread;
pub(crate) use senders::{parts, traffic};

/// A moment with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The time of the sign on which it is based.
    pub time: Stamp,
    /// The earliest possible time.
    pub earliest: Stamp,
    /// The latest possible time.
    pub latest: Stamp,
}

impl Bound {
    /// A time between an earliest and a latest one.
    pub(crate) fn new(time: Stamp, earliest: Stamp, latest: Stamp) -> Self {
        Self {
            time,
            earliest,
            latest,
        }
    }
}

/// One lifetime of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Life {
    /// The interval in which it exists, half-open.
    pub span: Span,
    /// The beginning; `None` if it may have existed before the mission began.
    pub began: Option<Bound>,
    /// The end; `None` if no end is known.
    pub ended: Option<Bound>,
}

/// A run of messages of one sender at one rate, without a gap.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(from = "StretchNumbers", into = "StretchNumbers")]
pub struct Stretch {
    /// The time of the first message.
    pub first: Stamp,
    /// The time of the last message.
    pub last: Stamp,
    /// The number of messages, ≥ 1.
    pub count: u64,
    /// The usual time between messages in nanoseconds, without lost ones; 0 with fewer than two.
    pub period: i64,
    /// Whether the messages come at even intervals.
    pub is_even: bool,
    /// Whether the previous stretch ends where this one begins: a change of rate, not a gap.
    pub is_joined: bool,
}

/// A stretch in JSON: first and last message, their number, the usual period, and 1 for even intervals, plus 2 if it begins
/// where the previous stretch ends.
type StretchNumbers = (Stamp, Stamp, u64, i64, u8);

impl From<StretchNumbers> for Stretch {
    fn from((first, last, count, period, flags): StretchNumbers) -> Self {
        Self {
            first,
            last,
            count,
            period,
            is_even: flags & 1 > 0,
            is_joined: flags & 2 > 0,
        }
    }
}

impl From<Stretch> for StretchNumbers {
    fn from(s: Stretch) -> Self {
        let flags = u8::from(s.is_even) + 2 * u8::from(s.is_joined);
        (s.first, s.last, s.count, s.period, flags)
    }
}

impl Stretch {
    /// Messages per second; 0 with fewer than two.
    pub fn hz(&self) -> f64 {
        let nanos = self.last.since(self.first);
        if nanos <= 0 {
            return 0.0;
        }
        let mean = nanos as f64 / (self.count - 1).max(1) as f64;
        // Lost messages do not affect the usual time, which uneven messages do not have.
        let period = if self.is_even {
            self.period as f64
        } else {
            mean
        };
        1e9 / period.max(1.0)
    }

    /// The time in which a message is expected, in nanoseconds: the usual one, and longer by the square of what was lost, since five in a
    /// row are lost by chance where one in three is.
    fn expected(&self) -> i64 {
        let mean = self.last.since(self.first) as f64 / (self.count - 1).max(1) as f64;
        let lost = (mean / self.period.max(1) as f64).max(1.0);
        to_i64(self.period as f64 * lost * lost)
    }

    /// Whether it has a rate that is an event: even, and for long enough.
    pub(crate) fn has_rate(&self) -> bool {
        let lasts = self.last.since(self.first) >= RATE_HOLDS_NS;
        self.is_even && self.count >= FEWEST_OF_RATE && lasts
    }
}

/// All messages of one sender on one topic.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Sender {
    /// The topic.
    #[serde(skip)]
    pub topic: TopicId,
    /// The publishing node; `None` for all unknown senders together.
    #[serde(skip)]
    pub node: Option<NodeId>,
    /// Whether its last message is latched.
    #[serde(rename = "latched", skip_serializing_if = "std::ops::Not::not")]
    pub is_latched: bool,
    /// The stretches of even messages, in order, without overlaps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stretches: Vec<Stretch>,
}

impl Sender {
    /// The number of messages in an interval, in proportion where it cuts a stretch.
    pub(crate) fn count_in(&self, span: Span) -> f64 {
        let inside = |s: &Stretch| {
            let all = s.last.since(s.first);
            let shared = s.last.min(span.end.plus(-1)).since(s.first.max(span.start));
            match (shared, all) {
                (..0, _) => 0.0,
                (_, 0) => s.count as f64,
                _ => s.count as f64 * shared as f64 / all as f64,
            }
        };
        self.stretches.iter().map(inside).sum()
    }
}

/// The messages of a mission in continuous time.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Sending {
    /// The messages of every sender, sorted by topic and node.
    pub senders: Vec<Sender>,
    /// The longest pauses per topic, by id, at most 32, in order: each from one message to the next. Empty if
    /// single messages are unknown.
    pub pauses: ById<TopicId, Vec<Span>>,
}

impl Sending {
    /// Whether single messages are known, not only their number in each window.
    pub(crate) fn knows_messages(&self) -> bool {
        !self.pauses.is_empty()
    }

    /// The senders of a topic.
    pub(crate) fn of_topic(&self, topic: TopicId) -> &[Sender] {
        let from = self.senders.partition_point(|s| s.topic < topic);
        let to = self.senders.partition_point(|s| s.topic <= topic);
        &self.senders[from..to]
    }

    /// The number of messages of some senders.
    pub(crate) fn count<'a>(senders: impl Iterator<Item = &'a Sender>) -> u64 {
        let stretches = senders.flat_map(|sender| &sender.stretches);
        stretches.fold(0, |n, stretch| n.saturating_add(stretch.count))
    }

    /// The time of the first message of some senders, and that of the last.
    pub(crate) fn bounds<'a>(senders: impl Iterator<Item = &'a Sender>) -> Option<(Stamp, Stamp)> {
        let stretches = senders.flat_map(|sender| &sender.stretches);
        let bounds = stretches.map(|s| (s.first, s.last));
        bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// The messages of a publication, if they can be distinguished from those of others.
    pub(crate) fn of_edge(&self, node: NodeId, topic: TopicId) -> Option<&Sender> {
        let of = self.of_topic(topic);
        let at = of.binary_search_by_key(&Some(node), |s| s.node).ok()?;
        of.get(at)
    }
}

/// Whether a sender begins with a rhythm, so that there were no messages before: even messages, or many
/// without a gap.
pub(crate) fn begins_steadily(stretches: &[Stretch]) -> bool {
    let Some((first, rest)) = stretches.split_first() else {
        return false;
    };
    let joined = rest.iter().take_while(|s| s.is_joined);
    let (count, last) = joined.fold((first.count, first.last), |(count, _), s| {
        (count + s.count, s.last)
    });
    first.is_even && first.count >= FEWEST
        || count >= STEADY && last.since(first.first) >= STEADY_NS
}

/// The number of stretches before a sender's rhythm begins: stray messages, fewer than show a rhythm, such as one zero command
/// when a node starts.
pub(crate) fn strays(stretches: &[Stretch]) -> usize {
    let mut count = 0;
    let is_stray = |s: &&Stretch| {
        count += s.count;
        count < FEWEST
    };
    stretches.iter().take_while(is_stray).count()
}

/// A transition of a node to a lifecycle state.
pub(crate) struct Transition {
    pub(crate) node: NodeId,
    pub(crate) time: Stamp,
    /// The new state.
    pub(crate) state: Arc<str>,
}

/// A silence of a sender, from its last message to the next one; `None` if there is none.
pub(crate) type Silence = (Stamp, Option<Stamp>);

/// Whether most of a silence lies in pauses of the recording.
pub(crate) fn hide(pauses: &[Span], (from, to): Silence) -> bool {
    let Some(to) = to else { return false };
    let silence = Span::new(from, to);
    let shared = pauses.iter().map(|pause| pause.shared(silence).max(0));
    shared.sum::<i64>() > silence.nanos() / 2
}

/// The silences of a sender with a rhythm during its lifetimes (`lives`, half-open) and not in pauses of the recording:
/// from the last message to the next, or `None` if there is none. A sender of bursts is never silent.
pub(crate) fn silences(stretches: &[Stretch], lives: &[Span], pauses: &[Span]) -> Vec<Silence> {
    let mut found = Vec::new();
    let gaps = stretches.windows(2).map(|p| (p[0].last, p[1].first));
    let gaps = gaps.filter(|(from, to)| !hide(pauses, (*from, Some(*to))));
    let gaps: Vec<i64> = gaps.map(|(from, to)| to.since(from)).collect();
    for life in lives {
        let inside = |s: &&Stretch| life.start <= s.first && s.first < life.end;
        let own: Vec<&Stretch> = stretches.iter().filter(inside).collect();
        let mut count = 0;
        // The two longest pauses so far: a single one is not a habit.
        let mut longest = [0; 2];
        for (at, stretch) in own.iter().enumerate() {
            let next = own.get(at + 1).map(|next| next.first);
            if hide(pauses, (stretch.last, next)) {
                continue;
            }
            let silence = next.unwrap_or(life.end).since(stretch.last);
            let usual = broken_after(stretch.expected()).max(LONGER.saturating_mul(longest[1]));
            let is_alike = |gap: &&i64| gap.saturating_mul(LONGER) >= silence;
            // After a pause, a short silence to the end may be another one.
            let is_open = next.is_none() && longest[0] > 0;
            let least = usual.max(if is_open { GONE_NS } else { 0 });
            let long = silence > least && gaps.iter().filter(is_alike).nth(ALIKE).is_none();
            count += stretch.count;
            if count >= FEWEST {
                longest = [
                    longest[0].max(silence),
                    longest[1].max(silence.min(longest[0])),
                ];
            }
            if stretch.is_even && stretch.count >= FEWEST && long {
                found.push((stretch.last, next));
            }
        }
    }
    let sending: i64 = stretches.iter().map(|s| s.last.since(s.first)).sum();
    let ended = found
        .iter()
        .filter_map(|(from, to)| Some((*to)?.since(*from)));
    let (ended, quiet) = ended.fold((0, 0), |(many, all), own| (many + 1, all + own));
    // Between bursts, of which two are not a habit.
    if found.len() > OFTEN && quiet > sending / 4 || ended > 1 && quiet > sending {
        found.clear();
    }
    found
}

/// The times at which all of several senders are silent, if at least one has a rhythm that stopped.
pub(crate) fn all_silent(senders: &[&[Stretch]], lives: &[Span], pauses: &[Span]) -> Vec<Silence> {
    let found = senders.iter().flat_map(|own| silences(own, lives, pauses));
    let mut found: Vec<Silence> = found.collect();
    found.sort_unstable();
    let mut all: Vec<Silence> = Vec::new();
    for (from, to) in found {
        // From the last message of any of them to the next of any.
        let sends = |s: &Stretch| s.last > from && to.is_none_or(|to| s.first < to);
        let is_over = |last: &Silence| last.1.is_some_and(|end| end <= from);
        if !senders.iter().any(|own| own.iter().any(sends)) && all.last().is_none_or(is_over) {
            all.push((from, to));
        }
    }
    all
}

/// The most pauses that are kept for each topic; any part of the mission contains one of them, or no pause
/// longer than those within windows. They are in the JSON of every topic, so that more would make files larger.
const PAUSES: usize = 32;

/// The longest pauses of one sequence of messages, collected message by message.
#[derive(Default)]
pub(crate) struct LongestPauses {
    last: Option<Stamp>,
    /// The longest so far, by length; the shortest is replaced first.
    longest: BinaryHeap<Reverse<(i64, Stamp)>>,
}

impl LongestPauses {
    /// Adds the next message.
    pub(crate) fn add(&mut self, time: Stamp) {
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
        let span =
            |Reverse((pause, start)): Reverse<(i64, Stamp)>| Span::new(start, start.plus(pause));
        let mut all: Vec<Span> = longest.map(span).collect();
        all.sort_unstable_by_key(|span| span.start);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The silences, in seconds, of a sender that sends at 10 Hz for these seconds.
    fn silent(sent: &[(i64, i64)]) -> Vec<i64> {
        let second = |s: i64| Stamp(s * 1_000_000_000);
        let stretch = |(from, to): &(i64, i64)| Stretch {
            first: second(*from),
            last: second(*to),
            count: 10 * to.abs_diff(*from) + 1,
            period: 100_000_000,
            is_even: true,
            is_joined: false,
        };
        let all: Vec<Stretch> = sent.iter().map(stretch).collect();
        let whole = Span::new(all[0].first, all[all.len() - 1].last);
        let found = silences(&all, &[whole], &[]).into_iter();
        found.map(|(from, _)| from.0 / 1_000_000_000).collect()
    }

    #[test]
    fn a_silence_is_none_among_others_as_long() {
        assert_eq!(silent(&[(0, 100), (105, 300)]), [100]);
        assert_eq!(silent(&[(0, 100), (105, 200), (220, 400)]), [100, 200]);
        let often = [(0, 100), (105, 200), (204, 300), (305, 400), (404, 500)];
        assert!(silent(&often).is_empty());
        // Bursts.
        assert!(silent(&[(0, 10), (60, 70), (190, 200)]).is_empty());
    }

    #[test]
    fn the_longest_pauses_are_kept_in_order() {
        let mut pauses = LongestPauses::default();
        let mut at = 0;
        // 1 to 40 ns, the long ones early.
        for pause in (1..=40).rev() {
            pauses.add(Stamp(at));
            at += pause;
        }
        pauses.add(Stamp(at));
        let spans = pauses.spans();
        let lengths: Vec<i64> = spans.iter().map(Span::nanos).collect();
        assert_eq!(lengths, (9..=40).rev().collect::<Vec<_>>());
        assert_eq!((spans[1].start, spans[1].end), (Stamp(40), Stamp(79)));
    }

    #[test]
    fn messages_are_counted_in_proportion() {
        let stretch = |first: i64, last: i64, count| Stretch {
            first: Stamp(first),
            last: Stamp(last),
            count,
            period: 1,
            is_even: true,
            is_joined: false,
        };
        let sender = Sender {
            topic: TopicId(0),
            node: None,
            is_latched: false,
            stretches: vec![stretch(0, 100, 50), stretch(200, 200, 3)],
        };
        let count = |start: i64, end: i64| {
            let span = Span::new(Stamp(start), Stamp(end));
            libm::round(sender.count_in(span))
        };
        assert!((count(0, 51) - 25.0).abs() < 0.1);
        assert!((count(150, 201) - 3.0).abs() < 0.1);
        assert!(count(110, 190).abs() < 0.1);
    }
}
