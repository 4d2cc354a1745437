//! The differences in the messages of topics: in their rates, and in the times of the first and the last.

use super::Difference;
use super::elements::topics;
use super::happened::{APART_NS, Moment, is_moved, pace};
use crate::base::rhythm::{CLOSING_NS, FEWEST, FEWEST_OF_MEAN};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::gate::facts::{Facts, Rate};
use crate::graph::TopicId;

/// The number of standard deviations beyond which rates differ significantly.
const SIGMAS: f64 = 3.0;
/// The fraction by which the mean rate of an uneven topic may differ: such a topic depends on what happens in a run.
const UNEVEN_CHANGE: f64 = 0.5;
/// The fewest messages of a topic whose first and last are compared: with fewer, silences do not show a rhythm.
const FEWEST_OF_TIMES: u64 = 20;
/// The longest silence of a topic, times this, is the uncertainty of its first and its last message.
const SILENCES: i64 = 2;

/// The difference in the rate of a topic, if any.
pub(super) fn rates(
    name: &str,
    (a, first): (&Facts<'_>, TopicId),
    (b, second): (&Facts<'_>, TopicId),
    rate_change: f64,
    all: &mut Vec<Difference>,
) {
    let rates = [(a, first), (b, second)].map(|(f, id)| f.rates(id, true, f.mission.span));
    let in_windows = apart(rates.each_ref().map(|own| mean(own)), rate_change);
    let is_uneven = !rates.iter().all(|own| Rate::are_even(own));
    let different = in_windows.or_else(|| {
        let whole = [a.mean(first)?, b.mean(second)?];
        let is_enough = is_uneven && whole.iter().all(|r| r.count + 1 >= FEWEST_OF_MEAN);
        let change = rate_change.max(UNEVEN_CHANGE);
        is_enough.then(|| apart(whole.map(|r| mean(&[r])), change))?
    });
    if let Some((from, to)) = different {
        let (from, to) = (words::rate(from), words::rate(to));
        all.push(Difference::changed("rate", name, from, to));
    }
}

/// The mean rate of a topic and its uncertainty; `None` with too few messages.
fn mean(rates: &[Rate]) -> Option<(f64, f64)> {
    let count: u64 = rates.iter().map(|r| r.count).sum();
    let nanos: i64 = rates.iter().map(|r| r.span.nanos()).sum();
    let (count_f, seconds) = (count as f64, nanos.max(1) as f64 / 1e9);
    // The count of an even topic is exact to a message; a random one varies by its square root, bursts by more.
    let chance = if Rate::are_even(rates) {
        1.0
    } else {
        libm::sqrt(count_f)
    };
    let doubt = (chance / seconds).max(spread(rates));
    (count >= FEWEST).then_some((count_f / seconds, doubt))
}

/// Two rates that differ by more than the fraction `change`, and significantly.
fn apart([one, other]: [Option<(f64, f64)>; 2], change: f64) -> Option<(f64, f64)> {
    let ((from, mine), (to, theirs)) = (one?, other?);
    let noise = SIGMAS * libm::sqrt(mine * mine + theirs * theirs);
    let apart = libm::fabs(to - from);
    (apart > change * from.min(to) && apart > noise).then_some((from, to))
}

/// The standard error of the mean rate, by how windows differ; 0 with fewer than two.
fn spread(rates: &[Rate]) -> f64 {
    let n = rates.len() as f64;
    if rates.len() < 2 {
        return 0.0;
    }
    let mean = rates.iter().map(Rate::hz).sum::<f64>() / n;
    let sum: f64 = rates
        .iter()
        .map(|r| (r.hz() - mean) * (r.hz() - mean))
        .sum();
    libm::sqrt(sum / (n - 1.0) / n)
}

/// A topic of both missions with enough messages, and the times of the first and the last one in each.
struct Sent<'a> {
    name: &'a str,
    facts: [&'a Facts<'a>; 2],
    received: [Span; 2],
    /// The uncertainty of both times, in nanoseconds.
    doubt: i64,
}

/// The topics that begin or end at another time, unless a difference of a publisher, or in an event, shows that.
pub(super) fn times(a: &Facts<'_>, b: &Facts<'_>, known: &[Difference]) -> Vec<Difference> {
    let theirs = topics(b);
    let mut sent: Vec<Sent<'_>> = Vec::new();
    let mut all = Vec::new();
    for (name, first) in topics(a) {
        let Some(second) = theirs.get(name).copied() else {
            continue;
        };
        let is_reported = |kinds: &[&str]| {
            let publishers = a.publishers(first).into_iter();
            let roles: Vec<&str> = publishers.map(|(node, ..)| a.role(node)).collect();
            let own = |d: &&Difference| d.element == name || roles.contains(&&*d.element);
            known.iter().filter(own).any(|d| kinds.contains(&d.kind))
        };
        let Some(one) = Sent::of(name, [(a, first), (b, second)]) else {
            continue;
        };
        if !is_reported(&["end"]) {
            all.extend(one.end());
        }
        if !is_reported(&["time"]) {
            sent.push(one);
        }
    }
    sent.sort_by_key(|s| s.received[0].start);
    let mut shift = 0;
    for one in &sent {
        all.extend(one.begin(&mut shift));
    }
    all.sort_by(|x, y| (x.kind, &x.name).cmp(&(y.kind, &y.name)));
    all
}

impl<'a> Sent<'a> {
    fn of(name: &'a str, sides: [(&'a Facts<'a>, TopicId); 2]) -> Option<Self> {
        let [one, other] = sides.map(|(facts, id)| {
            let is_enough = facts.messages(id) >= FEWEST_OF_TIMES;
            let received = facts.received(id).filter(|_| is_enough)?;
            Some((received, facts.longest_silence(id)))
        });
        let ((first, silence), (second, other_silence)) = (one?, other?);
        Some(Self {
            name,
            facts: sides.map(|(facts, _)| facts),
            received: [first, second],
            doubt: silence.max(other_silence).saturating_mul(SILENCES),
        })
    }

    /// The difference in the first message.
    fn begin(&self, shift: &mut i64) -> Option<Difference> {
        let at = [0, 1].map(|side| self.moment(side, self.received[side].start));
        let [from, to] = [0, 1].map(|side| self.facts[side].clock(self.received[side].start));
        is_moved(at, shift).then(|| Difference::changed("begin", self.name, from, to))
    }

    /// The difference in the last message. One at the end of a recording shows nothing of the time after it.
    fn end(&self) -> Option<Difference> {
        let ends = [0, 1].map(|side| {
            let (end, whole) = (self.received[side].end, self.facts[side].mission.span.end);
            (whole.since(end) > CLOSING_NS.max(self.doubt)).then_some(end)
        });
        let [first, second] = [0, 1].map(|side| self.moment(side, self.received[side].end).at);
        let apart = first.saturating_sub(second).saturating_abs();
        let is_moved = apart > APART_NS.saturating_add(self.doubt) + pace(first.max(second));
        let is_earlier = ends[usize::from(second < first)].is_some();
        let [from, to] = [0, 1].map(|side| match ends[side] {
            Some(end) => format!("ends at {}", self.facts[side].clock(end)),
            None => "stays".to_owned(),
        });
        (is_moved && is_earlier).then(|| Difference::changed("end", self.name, from, to))
    }

    fn moment(&self, side: usize, at: Stamp) -> Moment {
        Moment {
            at: self.facts[side].mission.offset(at),
            doubt: self.doubt / 2,
        }
    }
}
