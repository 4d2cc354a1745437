//! The messages of every sender on every topic over the whole mission: even stretches, pauses, first and last
//! messages; and the recordings that they are in.

use std::collections::BTreeSet;
use std::io;

use crate::base::error::Result;
use crate::base::ids::grouped;
use crate::base::name::{is_feedback, is_quiet};
use crate::base::rhythm::{
    EVEN, EVEN_OF_TWO, FEWEST, FEWEST_INTERVALS, GAP, GAP_NS, OUT_OF_ORDER_NS, SAME_RATE, TICK_NS,
};
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::{Recorded, spool_error};
use crate::evidence::conclude::Findings;
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::observation::Name;
use crate::graph::ById;
use crate::graph::history::{LongestPauses, Stretch};

/// The senders of each topic; boxed, since most names may be those of other things.
pub(crate) type Traffic = ById<Name, Option<Box<Senders>>>;

/// The senders of one topic.
pub(crate) struct Senders {
    /// The indices of the topic's streams, sorted.
    pub(crate) streams: Vec<usize>,
    /// The first and the last message of each stream; `None` without messages.
    pub(crate) traces: Vec<Option<(Stamp, Stamp)>>,
    /// The messages of each sender: first the unknown ones together, then the known ones, sorted.
    pub(crate) list: Vec<Sender>,
    /// The index of each stream's sender in `list`.
    pub(crate) of: Vec<usize>,
    /// The longest pauses of all senders together.
    pub(crate) pauses: Vec<Span>,
}

impl Senders {
    /// The place of a stream among those of the topic; there is one per file of a split recording.
    pub(crate) fn place(&self, stream: usize) -> Option<usize> {
        self.streams.binary_search(&stream).ok()
    }

    /// Whether a stream has no messages while others of its sender have.
    pub(crate) fn is_empty_among_others(&self, stream: usize) -> bool {
        let Some(place) = self.place(stream) else {
            return false;
        };
        let mut all = self.of.iter().zip(&self.traces);
        let has_messages = all.any(|(of, trace)| *of == self.of[place] && trace.is_some());
        self.traces[place].is_none() && has_messages
    }
}

/// The messages of one sender on one topic, over all its streams: a split recording has one per part.
pub(crate) struct Sender {
    /// The node; `None` for all unknown senders together.
    pub(crate) node: Option<Name>,
    /// Whether its last message keeps its meaning: it is latched, and is not sent all the time.
    pub(crate) latched: bool,
    pub(crate) stretches: Vec<Stretch>,
    /// The first and the last moment of its recordings.
    pub(crate) recording: (Stamp, Stamp),
}

impl Sender {
    /// Its pauses: from a last message to the next one.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = (Stamp, Stamp)> + '_ {
        let pairs = self.stretches.windows(2);
        let apart = pairs.filter(|pair| !pair[1].is_joined);
        apart.map(|pair| (pair[0].last, pair[1].first))
    }
}

/// The node that sent the messages of a stream, if its name is reliable enough.
pub(crate) fn sender(stream: &Stream) -> Option<Name> {
    stream
        .publisher
        .filter(|_| !matches!(stream.trust, Reliability::First | Reliability::Gone))
}

/// Reads the times of every topic once.
pub(crate) fn traffic(recorded: &Recorded, findings: &Findings) -> Result<Traffic> {
    let recordings = recordings(recorded);
    let mut streams: ById<Name, Vec<usize>> = ById::default();
    for (at, stream) in findings.streams.iter().enumerate() {
        streams.grown(stream.topic).push(at);
    }
    let of_topic = |of: Vec<usize>| {
        let is_topic = !of.is_empty();
        let read = || senders(recorded, findings, &recordings, of).map(Box::new);
        is_topic.then(read).transpose()
    };
    let all: io::Result<Traffic> = streams.into_iter().map(of_topic).collect();
    all.map_err(spool_error)
}

/// Reads the times of some streams, which together are one topic.
fn senders(
    recorded: &Recorded,
    findings: &Findings,
    recordings: &ById<usize, Option<(Stamp, Stamp)>>,
    streams: Vec<usize>,
) -> io::Result<Senders> {
    let of_topic: Vec<&Stream> = streams.iter().map(|at| &findings.streams[*at]).collect();
    let ids: Vec<_> = of_topic.iter().map(|stream| stream.times).collect();
    let mut traces: Vec<Option<(Stamp, Stamp)>> = vec![None; streams.len()];
    let (of, mut received) = places(recorded, &of_topic, recordings);
    let mut pauses = LongestPauses::default();
    recorded.messages.merge(&ids, |timed| {
        let trace = &mut traces[timed.series];
        *trace = Some((trace.map_or(timed.time, |t| t.0), timed.time));
        pauses.add(timed.time);
        received[of[timed.series]].add(timed.time);
    })?;
    let mut list: Vec<Sender> = received.into_iter().map(SenderTimes::into_sender).collect();
    let topic = of_topic.first().map(|stream| &stream.connection.topic);
    if topic.is_some_and(|topic| is_feedback(topic.as_str())) {
        let stretches = list.iter_mut().flat_map(|sender| &mut sender.stretches);
        stretches.for_each(|stretch| stretch.is_even = false);
    }
    Ok(Senders {
        streams,
        traces,
        list,
        of,
        pauses: pauses.spans(),
    })
}

/// The times of one sender.
struct SenderTimes {
    node: Option<Name>,
    latched: bool,
    times: Vec<Stamp>,
    recording: (Stamp, Stamp),
    /// One of this many messages is kept, and every late one.
    every: usize,
    passed: usize,
}

/// The most times kept per sender (32 MB); of more, every second one is dropped: an IMU of 1 kHz reaches it after 70 minutes, and
/// its rate is as clear from half of them.
const MOST_TIMES: usize = 1 << 22;
/// The silence after which a message is kept in any case, and the one before it, in nanoseconds: half of the shortest gap, so
/// that no gap is lost.
const LATE_NS: i64 = 500_000_000;

impl SenderTimes {
    fn add(&mut self, time: Stamp) {
        let last = self.times.last();
        let late = last.is_none_or(|last| time.since(*last) > LATE_NS);
        self.passed += 1;
        if !late && self.passed < self.every {
            return;
        }
        self.passed = 0;
        self.times.push(time);
        if self.times.len() > MOST_TIMES {
            self.every *= 2;
            let mut kept = false;
            self.times.retain(|_| {
                kept = !kept;
                kept
            });
        }
    }

    fn into_sender(self) -> Sender {
        let mut stretches = stretches(&self.times);
        for stretch in &mut stretches {
            stretch.count = (stretch.count - 1) * self.every as u64 + 1;
            stretch.period /= i64::try_from(self.every).unwrap_or(i64::MAX);
        }
        Sender {
            node: self.node,
            latched: self.latched,
            stretches,
            recording: self.recording,
        }
    }
}

/// The most messages of a latched sender in a part of a recording; a map is sent once per start. One with more sends all the
/// time, so that a repetition shows nothing, and neither does its last message: controllers of ROS 2 offer even `/odom` as
/// transient local.
const LATCHED: u64 = 20;

/// The index of each stream's sender, and the senders without times yet.
fn places(
    recorded: &Recorded,
    streams: &[&Stream],
    recordings: &ById<usize, Option<(Stamp, Stamp)>>,
) -> (Vec<usize>, Vec<SenderTimes>) {
    let mut nodes: Vec<Option<Name>> = streams.iter().map(|stream| sender(stream)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let place = |stream: &&Stream| nodes.binary_search(&sender(stream)).unwrap_or(0);
    let received = nodes.iter().map(|node| {
        let own = || streams.iter().filter(|stream| sender(stream) == *node);
        let reached = own().filter_map(|stream| recordings.some(stream.bag).copied());
        let reached = reached.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        SenderTimes {
            node: *node,
            latched: own().all(|s| s.latched && recorded.messages.count(s.times) <= LATCHED),
            recording: reached.unwrap_or((Stamp::MIN, Stamp::MAX)),
            times: Vec::new(),
            every: 1,
            passed: 0,
        }
    });
    (streams.iter().map(place).collect(), received.collect())
}

// Stretches of even messages, from the times of one sender: gaps and rate changes end them.

/// The number of intervals on each side of a gap from which the usual one is taken: enough for a median that a lost message
/// does not change, few enough to follow a changing rate.
const AROUND: usize = 9;
/// The most pieces of a run that are searched for rate changes; intervals of longer runs are summed first, so that the search
/// takes the same time for an hour as for a minute.
const PIECES: usize = 2048;
/// The depth of splitting one sender's messages by rate; each level may double the number of rates, so that there are at most
/// 256.
const DEPTH: usize = 8;
/// The least gain in log likelihood of a rate change over chance: 3 standard deviations of a normal
/// distribution are 3²/2 in log likelihood, doubled because of the many possible positions.
const GAIN: f64 = 9.0;
/// The most gaps of a sender with a rhythm; after more, the rest of its messages is one stretch: it has none, and each stretch is
/// compared with those of all others.
const MOST_GAPS: usize = 4096;

/// Divides sorted times into stretches of even messages.
pub(crate) fn stretches(times: &[Stamp]) -> Vec<Stretch> {
    let mut all = Vec::new();
    let mut from = 0;
    for to in gaps(times) {
        split(&times[from..to], DEPTH, false, &mut all);
        from = to;
    }
    if from < times.len() {
        split(&times[from..], DEPTH, false, &mut all);
    }
    merged(all, times)
}

/// The indices of the first messages after gaps.
fn gaps(times: &[Stamp]) -> Vec<usize> {
    let mut found = Vec::new();
    for at in 1..times.len() {
        let long = times[at].since(times[at - 1]);
        if long <= GAP_NS || found.len() >= MOST_GAPS {
            continue;
        }
        // Stray messages before the first rhythm show none.
        let is_steady = at as u64 >= FEWEST;
        let before = usual(&times[at.saturating_sub(AROUND + 1)..at]).filter(|_| is_steady);
        let longest = before.max(usual(&times[at..times.len().min(at + AROUND + 1)]));
        if longest.is_some_and(|usual| long > usual.saturating_mul(GAP)) {
            found.push(at);
        }
    }
    found
}

/// The lower median of a few intervals.
fn usual(times: &[Stamp]) -> Option<i64> {
    let mut intervals: Vec<i64> = times.windows(2).map(|t| t[1].since(t[0])).collect();
    intervals.sort_unstable();
    intervals.get(intervals.len().checked_sub(1)? / 2).copied()
}

/// Splits a run without gaps where its rate changes most, as long as the change is significant.
fn split(times: &[Stamp], depth: usize, is_joined: bool, all: &mut Vec<Stretch>) {
    let Some(cut) = (depth > 0).then(|| cut(times)).flatten() else {
        all.extend(stretch(times, is_joined));
        return;
    };
    split(&times[..=cut], depth - 1, is_joined, all);
    split(&times[cut..], depth - 1, true, all);
}

/// The message at which the rate changes most; `None` if it does not.
fn cut(times: &[Stamp]) -> Option<usize> {
    let intervals = times.len().checked_sub(1)?;
    if intervals < 2 * FEWEST_INTERVALS {
        return None;
    }
    let step = intervals.div_ceil(PIECES);
    let first = FEWEST_INTERVALS.div_ceil(step) * step;
    let coarse = best(times, step, first..=intervals)?;
    if step == 1 {
        return Some(coarse);
    }
    let from = coarse.saturating_sub(step).max(FEWEST_INTERVALS);
    let to = (coarse + step).min(intervals - FEWEST_INTERVALS);
    // The exact position near the coarse one: where the sum of both sides' deviations is smallest.
    best(times, 1, from..=to).or(Some(coarse))
}

/// The best position in `range`, every `step` messages, by the likelihood of intervals with one mean on each
/// side, in units of the intervals' scatter.
fn best(times: &[Stamp], step: usize, range: std::ops::RangeInclusive<usize>) -> Option<usize> {
    let n = times.len() - 1;
    let whole = times[n].since(times[0]) as f64;
    let scatter = scatter(times, step);
    let cost = |count: f64, nanos: f64| count * libm::log(nanos.max(1.0) / count);
    let unsplit = cost(n as f64, whole);
    let (mut found, mut most) = (None, GAIN * scatter);
    for at in range.step_by(step) {
        if at < FEWEST_INTERVALS || n - at < FEWEST_INTERVALS {
            continue;
        }
        let left = times[at].since(times[0]) as f64;
        let gain = unsplit - cost(at as f64, left) - cost((n - at) as f64, whole - left);
        if gain > most {
            (found, most) = (Some(at), gain);
        }
    }
    found
}

/// The squared variation of neighbouring intervals (of sums of `step` of them), per interval; of random arrivals 1.
fn scatter(times: &[Stamp], step: usize) -> f64 {
    let every = || times.iter().step_by(step);
    let sums = every().zip(every().skip(1));
    let sums: Vec<f64> = sums.map(|(a, b)| b.since(*a) as f64).collect();
    let ratio = |p: &[f64]| libm::fabs(p[1] - p[0]) / (p[0] + p[1]).max(1.0);
    let mut ratios: Vec<f64> = sums.windows(2).map(ratio).collect();
    if ratios.is_empty() {
        return 1.0;
    }
    // The upper quartile: where one message in three is lost, half of the neighbours are still equal.
    let place = ratios.len() * 3 / 4;
    let (_, upper, _) = ratios.select_nth_unstable_by(place, f64::total_cmp);
    // For random arrivals it is 3/4; sums of `step` intervals scatter less in the same proportion.
    let relative = *upper * 4.0 / 3.0;
    (relative * relative * step as f64).clamp(0.01, 4.0)
}

/// The stretch of a run of messages at one rate.
fn stretch(times: &[Stamp], is_joined: bool) -> Option<Stretch> {
    let (first, last) = (*times.first()?, *times.last()?);
    let [lower, median, upper] = quartiles(times, 1);
    let is_even = times.len() > FEWEST_INTERVALS && (upper as f64) < EVEN * lower as f64;
    let is_many = times.len() > 4 * FEWEST_INTERVALS;
    let long = if is_many { times } else { &[] };
    let [low, two, up] = quartiles(if is_even { &[] } else { long }, 2);
    let [few, eight, many] = quartiles(long, 8);
    let (scatter, half) = (upper - lower, median / 2);
    // By a coarse clock, intervals are long or short, and longer sums of them scatter by one tick, too; of lost messages, by more.
    // The clock matters if intervals scatter by more than half of one, or if eight of them take less than 7.5 medians.
    let is_tick = scatter <= TICK_NS && (scatter > half || eight / 15 < half);
    let ticks = if is_tick { long } else { &[] };
    let [shortest, _, longest] = quartiles(ticks, (ticks.len() / 4).clamp(32, 128));
    // Eight intervals take 7.5 to 8.5 medians: the usual interval is no worse than the mean, and lost messages do not count in it.
    let is_usual = (15..=17).contains(&(eight / half.max(1)));
    let is_coarse = longest > 0 && (longest - shortest) / 3 <= half.max(scatter / 2);
    // If less than half of the messages were lost, most intervals are one period, and sums scatter by several.
    let is_scattered = lower > TICK_NS || (many - few) / 3 > scatter / 2;
    let is_even = is_even || is_many && lower > 0 && median - lower <= lower / 4 && is_scattered;
    let are_sums_even = low > 0 && up as f64 <= EVEN_OF_TWO * low as f64 && upper <= lower * 3;
    Some(Stretch {
        first,
        last,
        count: times.len() as u64,
        // Of few intervals the median is closer than a mean with an odd one.
        period: match is_even {
            _ if is_coarse && !(is_even && is_usual) => usual_sum(times, 8, eight) / 8,
            true if is_many => usual_sum(times, 1, median),
            false if are_sums_even => usual_sum(times, 2, two) / 2,
            _ => median,
        },
        is_even: is_even || are_sums_even || is_coarse,
        is_joined,
    })
}

/// The sums of so many consecutive intervals, in order.
fn sums(times: &[Stamp], many: usize) -> impl ExactSizeIterator<Item = i64> + Clone {
    let pairs = times.iter().zip(times.iter().skip(many));
    pairs.map(|(a, b)| b.since(*a))
}

/// The quartiles of the sums of so many intervals; 0 without intervals.
fn quartiles(times: &[Stamp], many: usize) -> [i64; 3] {
    let mut sums: Vec<i64> = sums(times, many).collect();
    let Some(last) = sums.len().checked_sub(1) else {
        return [0; 3];
    };
    let at = |part: usize| (part * (last + 1) / 4).min(last);
    [1, 2, 3].map(|part| *sums.select_nth_unstable(at(part)).1)
}

/// The usual sum of so many intervals, whose median is known: of intervals about as long as the median, and exactly the mean of all if
/// each lasts for as many of these as were lost.
fn usual_sum(times: &[Stamp], many: usize, median: i64) -> i64 {
    let sums = sums(times, many);
    let add = |all: (i64, i64), sum: i64, lasts: i64| (all.0.saturating_add(sum), all.1 + lasts);
    let is_near = |sum: &i64| (median / 2..=median / 2 * 3).contains(sum);
    let near = sums.clone().filter(is_near);
    let (near, count) = near.fold((0, 0), |all, sum| add(all, sum, 1));
    let near = near.checked_div(count).unwrap_or(median).max(1);
    // A coarse clock may lengthen or shorten one by half of it.
    let lasts = |off: i64| 1 + off.saturating_add(off.signum() * (near / 5 * 2)) / near;
    // The first and the last may belong to the rates before and after.
    let (many, ends) = (sums.len(), usize::from(sums.len() > FEWEST_INTERVALS));
    let inner = sums.skip(ends).take(many - 2 * ends);
    let (all, count) = inner.fold((0, 0), |all, sum| add(all, sum, lasts(sum - near)));
    all.checked_div(count).unwrap_or(median)
}

/// Joins neighbours whose rates have the same median.
fn merged(all: Vec<Stretch>, times: &[Stamp]) -> Vec<Stretch> {
    let mut kept: Vec<Stretch> = Vec::new();
    for next in all {
        match kept.last_mut() {
            Some(last) if next.is_joined && is_same(last, &next) => {
                let from = times.partition_point(|t| *t < last.first);
                let to = times.partition_point(|t| *t <= next.last);
                if let Some(both) = stretch(&times[from..to], last.is_joined) {
                    *last = both;
                }
            }
            _ => kept.push(next),
        }
    }
    kept
}

fn is_same(a: &Stretch, b: &Stretch) -> bool {
    a.period.max(b.period) as f64 <= SAME_RATE * a.period.min(b.period) as f64
}

// The recordings of a mission: the time that each covers, and the nodes that several contain at the same time. For example, a
// recording that is split every 60 s is one recording of five files, and `/camera` in two bags of two robots is two nodes.

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

    /// Times from runs of (number, milliseconds apart), with a little jitter.
    fn times(runs: &[(usize, i64)]) -> Vec<Stamp> {
        let (mut at, mut all) = (0, vec![Stamp(0)]);
        let mut noise = 7_i64;
        for (many, apart) in runs {
            for _ in 0..*many {
                noise = (noise * 48_271) % 2_147_483_647;
                at += apart * 1_000_000 + apart * 1_000_000 / 50 * (noise % 7 - 3);
                all.push(Stamp(at));
            }
        }
        all
    }

    fn reported(runs: &[(usize, i64)]) -> Vec<(u64, i64, bool)> {
        let all = stretches(&times(runs));
        all.iter()
            .map(|s| (s.count, s.period / 1_000_000, s.is_joined))
            .collect()
    }

    #[test]
    fn a_steady_sender_sends_one_stretch() {
        assert_eq!(reported(&[(300, 100)]).len(), 1);
        assert_eq!(reported(&[(100_000, 10)]).len(), 1);
    }

    /// These times without this percentage of them from the place `from` on.
    fn without(all: &[Stamp], from: usize, percent: u64, seed: u64) -> Vec<Stamp> {
        let mut dice = seed;
        let kept = all.iter().enumerate().filter(|(at, _)| {
            dice = dice
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_041);
            *at < from || (dice >> 33) % 100 >= percent
        });
        kept.map(|(_, time)| *time).collect()
    }

    #[test]
    fn lost_messages_are_not_a_rate_change() {
        let all = times(&[(300, 500)]);
        for seed in 0..20 {
            let kept = without(&all, 0, 30, seed);
            let joined = stretches(&kept).iter().filter(|s| s.is_joined).count();
            assert_eq!(joined, 0, "seed {seed}");
        }
    }

    #[test]
    fn messages_lost_from_a_moment_on_change_no_rate() {
        for (loss, hz) in [(20, 2), (25, 10), (30, 4), (35, 20)] {
            let all = times(&[(1200, 1000 / hz)]);
            for seed in 0..20 {
                let found = stretches(&without(&all, 600, loss, seed));
                let same = found.iter().all(|s| is_same(s, &found[0]) && !s.is_joined);
                assert!(same, "{loss} {hz} {seed} {found:?}");
            }
        }
    }

    #[test]
    fn a_rate_that_changes_is_cut_where_it_does() {
        let found = reported(&[(300, 33), (60, 200)]);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((300..=302).contains(&found[0].0) && found[1].2, "{found:?}");
        let slow = reported(&[(40, 1000), (12, 5000), (60, 1000)]);
        assert_eq!(slow.len(), 3, "{slow:?}");
        let long = reported(&[(50_000, 10), (30_000, 20)]);
        assert_eq!(long.len(), 2, "{long:?}");
        assert!((49_990..=50_012).contains(&long[0].0), "{long:?}");
    }

    #[test]
    fn a_pause_is_a_gap_and_a_lost_message_is_not() {
        let found = reported(&[(50, 100), (1, 30_000), (50, 100)]);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(!found[1].2);
        assert_eq!(
            reported(&[(50, 100), (1, 300), (50, 100), (1, 900), (50, 100)]).len(),
            1
        );
    }

    #[test]
    fn rates_are_exact_by_a_coarse_clock() {
        // Eight times a second by a clock of 10 ms, and 15, then 30 times a second by one of 25 ms.
        let coarse = |hz: &[(i64, i64)], tick: i64| {
            let mut at = 0;
            let mut all = vec![Stamp(0)];
            for (many, hz) in hz {
                for _ in 0..*many {
                    at += 1_000_000_000 / hz;
                    all.push(Stamp(at / tick * tick));
                }
            }
            stretches(&all)
        };
        let eight = coarse(&[(400, 8)], 10_000_000);
        assert!((eight[0].hz() - 8.0).abs() < 0.01, "{eight:?}");
        let faster = coarse(&[(300, 15), (300, 30)], 25_000_000);
        let rates: Vec<f64> = faster.iter().map(|s| libm::round(s.hz())).collect();
        assert_eq!(rates, [15.0, 30.0], "{faster:?}");
        assert!(faster.iter().all(|s| s.is_even), "{faster:?}");
        // Faster than the clock ticks, and half a period off by one of 10 ms.
        let faster = coarse(&[(600, 15), (900, 30)], 50_000_000);
        let rates: Vec<f64> = faster.iter().map(|s| libm::round(s.hz())).collect();
        assert_eq!(rates, [15.0, 30.0], "{faster:?}");
        assert!(faster.iter().all(|s| s.is_even), "{faster:?}");
        let off = [0, 1, 0, -1, 1].into_iter().cycle();
        let half = (0..400).zip(off).map(|(k, off)| k * 2 + off);
        let half: Vec<Stamp> = half.map(|ticks| Stamp(ticks * 10_000_000)).collect();
        let half = stretches(&half);
        assert!((half[0].hz() - 50.0).abs() < 0.2, "{half:?}");
    }

    #[test]
    fn bursts_and_lost_messages_are_not_a_coarse_clock() {
        // One message in 13 is lost, at random.
        let mut noise = 7_i64;
        let mut is_lost = || {
            noise = (noise * 48_271) % 2_147_483_647;
            noise % 13 == 0
        };
        let lossy = (0..900).filter(|_| !is_lost());
        let lossy: Vec<Stamp> = lossy.map(|k| Stamp(k * 45_000_000)).collect();
        let found = stretches(&lossy);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].hz() - 1000.0 / 45.0).abs() < 0.1, "{found:?}");
        // Three messages at once, every second.
        let bursts: Vec<Stamp> = (0..300).map(|k| Stamp(k / 3 * 1_000_000_000)).collect();
        assert!(stretches(&bursts).iter().all(|s| !s.is_even));
    }

    #[test]
    fn the_interval_between_two_rates_belongs_to_neither() {
        // Once a second, then every five seconds after one of 5.8.
        let seconds = (0..20)
            .map(|s| s * 10)
            .chain((0..12).map(|k| 190 + 58 + k * 50));
        let times: Vec<Stamp> = seconds.map(|tenths| Stamp(tenths * 100_000_000)).collect();
        let rates: Vec<f64> = stretches(&times).iter().map(Stretch::hz).collect();
        assert_eq!(rates.len(), 2, "{rates:?}");
        assert!((rates[1] - 0.2).abs() < 1e-6, "{rates:?}");
    }

    #[test]
    fn random_arrivals_are_not_even() {
        let mut at = 0;
        let mut noise = 12_345_i64;
        let times: Vec<Stamp> = (0..200)
            .map(|_| {
                noise = (noise * 48_271) % 2_147_483_647;
                at += 1_000_000 * (noise % 997 + 1);
                Stamp(at)
            })
            .collect();
        let found = stretches(&times);
        assert!(found.iter().all(|s| !s.is_even), "{found:?}");
    }

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
