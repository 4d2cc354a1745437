//! The clocks of recorders: credible times, as a few messages far from all others were recorded with a clock that was not set;
//! and the messages that several recorders have in common, which show by how much their clocks differ.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;

use crate::base::budget;
use crate::base::ids::{ById, grouped};
use crate::base::name::{NodeName, start};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::rhythm::GAP_NS;
use crate::base::time::{DAY, Span, Stamp};
use crate::evidence::inference::Stream;
use crate::evidence::observation::Observations;
use crate::evidence::times::{Calendar, Timed};

/// The distance in days beyond which times count as far from all others: no mission has a pause of a year.
pub(crate) const FAR_DAYS: i64 = 365;
/// The most far messages that are set aside, as one in so many messages: more are no accident, but a clock that jumped. Accidents
/// are single messages before a clock was set; with a half, the shorter part of a mission across a jump would be lost.
const RARE: u64 = 10;
/// The days after 1970, ten years, that count as an unset clock: without a battery it begins there, and no robot
/// recorded then.
pub(crate) const UNSET_DAYS: i64 = 3652;

/// Days without a gap of more than [`FAR_DAYS`] between them.
#[derive(Clone, Copy, PartialEq, Eq)]
struct DayCluster {
    first: i64,
    last: i64,
    messages: u64,
}

/// The assessment of the times of a mission.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Belief {
    /// The credible times, if some messages are far from the bulk; `None` if all are credible.
    pub(crate) span: Option<Span>,
    /// Sentences about clock jumps, if too many messages of a bag to be an accident are far apart and stay on one axis.
    pub(crate) jumps: Vec<String>,
    /// The bags of which no message is at a credible time: those of another clock.
    pub(crate) others: Vec<usize>,
}

/// Assesses the times of a mission by the messages of each bag: first each bag's, since each recorder has its own clock,
/// then those of all clocks.
pub(crate) fn believed(bags: &ById<usize, Calendar>) -> Belief {
    let mut belief = Belief::default();
    let own = bags.with_ids().filter_map(|(bag, all)| {
        let (kept, jump) = of_bag(all)?;
        belief.jumps.extend(jump);
        Some((bag, kept))
    });
    let mut own: Vec<(usize, DayCluster)> = own.collect();
    own.sort_by_key(|(_, kept)| kept.first);
    let eras = clusters(own.iter().map(|(_, kept)| *kept));
    let Some(bulk) = eras.iter().max_by_key(|era| era.messages) else {
        return belief;
    };
    let bulk = limited(*bulk);
    let is_kept = |kept: &DayCluster| kept.first <= bulk.last && bulk.first <= kept.last;
    let (kept, others): (Vec<_>, Vec<_>) = own.into_iter().partition(|(_, own)| is_kept(own));
    belief.others = others.into_iter().map(|(bag, _)| bag).collect();
    let start = bulk.first.saturating_mul(DAY);
    let begins_at_0 = kept.iter().any(|(bag, _)| begins_at_0(&bags[*bag]));
    let span = Span::new(
        Stamp(if start == 0 && !begins_at_0 { 1 } else { start }),
        Stamp(bulk.last.saturating_add(1).saturating_mul(DAY)),
    );
    let is_inside = |day: &i64| (bulk.first..=bulk.last).contains(day);
    let is_whole = |bag: &Calendar| {
        bag.days.keys().all(is_inside) && (bag.zeros == 0 || span.contains(Stamp(0)))
    };
    belief.span = (!bags.iter().all(is_whole)).then_some(span);
    belief
}

/// What is said of the `aside` messages outside of the credible times of these bags.
pub(crate) fn set_aside(bags: &ById<usize, Calendar>, span: Span, aside: u64) -> [Notice; 2] {
    let zeros = bags.iter().map(|bag| bag.zeros).sum();
    let zeros = if span.contains(Stamp(0)) { 0 } else { zeros };
    let early = "message at time 0, before the clock was known, set aside";
    let far = "message at an impossible time, set aside";
    [
        Notice::counted(NoticeKind::Note, zeros.min(aside), early),
        Notice::counted(NoticeKind::ImpossibleTime, aside.saturating_sub(zeros), far),
    ]
}

/// Whether the clock of a bag begins at 0: with a single message, or it goes on from there. Otherwise messages at exactly
/// 0, however many, are from before a simulation's clock was known.
fn begins_at_0(bag: &Calendar) -> bool {
    bag.zeros == 1 || bag.zeros > 0 && bag.next.is_none_or(|next| next.0 <= GAP_NS)
}

/// Whether all times between the first and the last of some bags may be credible, as far as these show.
pub(crate) fn is_sure(bags: Span) -> bool {
    bags.start != Stamp(0) && bags.nanos() <= FAR_DAYS * DAY
}

/// The credible days of a bag, and a sentence about clock jumps between them; `None` for a bag without messages.
fn of_bag(bag: &Calendar) -> Option<(DayCluster, Option<String>)> {
    let mut days = bag.days.clone();
    if begins_at_0(bag) {
        *days.entry(0).or_default() += bag.zeros;
    }
    let clusters = clusters(days.into_iter().map(|(day, messages)| DayCluster {
        first: day,
        last: day,
        messages,
    }));
    let bulk = *clusters.iter().max_by_key(|c| c.messages)?;
    let all: u64 = clusters.iter().map(|c| c.messages).sum();
    let outliers = all - bulk.messages;
    let is_rare = outliers <= (all / RARE).max(1);
    let others = || clusters.iter().filter(|c| **c != bulk);
    let is_unset = bulk.first > UNSET_DAYS && others().all(|c| (0..=UNSET_DAYS).contains(&c.last));
    let whole = DayCluster {
        first: clusters.first()?.first,
        last: clusters.last()?.last,
        messages: all,
    };
    if outliers < bulk.messages && (is_rare || is_unset) || limited(whole) != whole {
        return Some((limited(bulk), None));
    }
    Some((whole, (clusters.len() > 1).then(|| stated(&clusters))))
}

/// The first days of a cluster, if it is longer than any mission.
fn limited(all: DayCluster) -> DayCluster {
    let last = all.first.saturating_add(budget::SPAN_DAYS - 1);
    DayCluster {
        last: all.last.min(last),
        ..all
    }
}

/// Joins clusters, sorted by their first days.
fn clusters(all: impl Iterator<Item = DayCluster>) -> Vec<DayCluster> {
    let mut clusters: Vec<DayCluster> = Vec::new();
    for one in all {
        match clusters.last_mut() {
            Some(before) if one.first.saturating_sub(before.last) <= FAR_DAYS => {
                before.last = before.last.max(one.last);
                before.messages += one.messages;
            }
            _ => clusters.push(one),
        }
    }
    clusters
}

/// The number of clusters that are listed: a notice is one line.
const NAMED: usize = 3;

fn stated(clusters: &[DayCluster]) -> String {
    let one = |c: &DayCluster| {
        let date = Stamp(c.first.saturating_mul(DAY)).to_string();
        let date = date.split('T').next().unwrap_or_default();
        format!("{} messages from {date}", c.messages)
    };
    let mut parts: Vec<String> = clusters.iter().take(NAMED).map(one).collect();
    if clusters.len() > NAMED {
        parts.push(format!("{} more such jumps", clusters.len() - NAMED));
    }
    format!(
        "the recorder's clock jumps by more than a year: {}; select a part with `--start` and `--end`",
        parts.join(", ")
    )
}

// Messages that two recorders have in common: how far their clocks are apart, and whether they recorded one robot. For example, 900 of
// 1,000 messages of `/odom` in one bag are in another, each 2.50 s later: the second recorder's clock is 2.50 s ahead. Their stamps are
// equal, too, so that no second robot can have sent them.

/// The fewest common messages that are significant: a few short ones may be equal by chance, and ten take a second at 10 Hz.
const FEWEST: usize = 10;
/// The fewest topics that must agree, unless their messages carry stamps: a node may send the same sequence again.
const TOPICS: usize = 2;
/// The share, in per cent, of the messages in common that must agree about the offset; the others were delayed on their way. With a
/// half, two recordings of one robot whose messages repeat would have an offset.
const SHARE: usize = 80;
/// The largest difference between the offsets of two messages, in nanoseconds: they take different paths to
/// the recorders, over a network within some ten milliseconds. Smaller offsets than this do not change a window.
pub(crate) const NEAR_NS: i64 = 50_000_000;
/// The most recorders that run at once: what more bags contain is a constant that a node sends whenever the recording is split.
const RECORDERS: usize = 8;
/// The longest time after which a merged recording repeats a message, in nanoseconds: a simulation that is set back repeats its messages
/// later, and the clocks of most computers are less apart.
const MERGED_NS: i64 = 5_000_000_000;

/// The messages that two recordings have in common, and the offset of a recorder's clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClockOffset {
    /// The index of the bag among the inputs, and that of the one that it is compared with.
    pub(crate) bag: usize,
    pub(crate) other: usize,
    /// The time by which its clock is ahead, in nanoseconds.
    pub(crate) ahead: i64,
    /// The number of messages that show it.
    pub(crate) messages: usize,
    /// Whether both recorded one robot: they have messages of most topics in common, with stamps or on several topics, and in wall time or
    /// with a node of the same start in its name. Otherwise two runs of a simulation may have equal messages at equal times, or two robots
    /// of one fleet receive the same.
    pub(crate) is_one_robot: bool,
}

impl ClockOffset {
    /// Whether the clocks differ.
    pub(crate) fn is_apart(&self) -> bool {
        self.ahead.abs() > NEAR_NS
    }
}

/// The messages of one topic and publisher: two cameras may send the same numbers.
struct Contents<'a> {
    topic: &'a str,
    /// Whether they carry stamps.
    stamped: bool,
    /// The hash of each content, its time, and its stream; sorted.
    messages: Vec<(u32, Stamp, usize)>,
}

/// The messages of some streams, those of the topics with the fewest first.
fn contents<'a>(
    streams: &'a [Stream],
    facts: &'a Observations,
    of: impl Iterator<Item = usize>,
) -> impl ExactSizeIterator<Item = io::Result<Contents<'a>>> {
    let all = of.filter_map(|at| Some((at, *facts.payloads.some(at)?)));
    let all = grouped(all.map(|(at, own)| {
        let of = &streams[at].connection;
        let publisher = of.publisher.as_ref().map(NodeName::as_str);
        ((of.topic.as_str(), publisher), (at, own))
    }));
    let many = |own: &[(usize, _)]| own.iter().map(|of| facts.times.count(of.1)).sum::<u64>();
    let mut all: Vec<_> = all.into_iter().collect();
    all.sort_by_cached_key(|(_, own)| many(own));
    all.into_iter().map(|((topic, _), own)| {
        let (of, series): (Vec<usize>, Vec<_>) = own.into_iter().unzip();
        let mut messages = Vec::new();
        let add = |timed: Timed| messages.push((timed.size, timed.time, of[timed.series]));
        facts.times.merge(&series, add)?;
        // Those of one content stay in order of time.
        messages.sort_by_key(|message| message.0);
        let stamped = of.iter().any(|at| facts.ages.some(*at).is_some());
        Ok(Contents {
            topic,
            stamped,
            messages,
        })
    })
}

/// The nanoseconds between a message in two bags, its topic, its time in the first, and whether it carries a stamp and is in wall time.
type Lag<'a> = (i64, &'a str, Stamp, [bool; 2]);

/// The pairs of bags that have messages in common, each bag with those before it.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn offsets(streams: &[Stream], facts: &Observations) -> io::Result<Vec<ClockOffset>> {
    if streams.iter().all(|stream| stream.bag == 0) {
        return Ok(Vec::new());
    }
    let mut lags: BTreeMap<[usize; 2], Vec<Lag<'_>>> = BTreeMap::new();
    // By topic and bag, the times of the messages whose contents are in it once.
    let mut once: BTreeMap<&str, BTreeMap<usize, Vec<Stamp>>> = BTreeMap::new();
    let of = (0..streams.len()).filter(|at| !streams[*at].latched);
    for of in contents(streams, facts, of) {
        let of = of?;
        let once = once.entry(of.topic).or_default();
        for same in of.messages.chunk_by(|a, b| a.0 == b.0) {
            // What a bag contains more often is a constant.
            let mut times: BTreeMap<usize, Option<Stamp>> = BTreeMap::new();
            for (_, time, at) in same {
                let own = times.entry(streams[*at].bag).or_insert(Some(*time));
                *own = own.filter(|own| own == time);
            }
            let times = times.into_iter();
            let times = times.filter_map(|(bag, time)| Some((bag, time?)));
            let times: Vec<(usize, Stamp)> = times.collect();
            if times.len() > RECORDERS {
                continue;
            }
            for (at, (bag, time)) in times.iter().enumerate() {
                once.entry(*bag).or_default().push(*time);
                for (other, before) in &times[..at] {
                    let is = [of.stamped, time.min(before).0 > UNSET_DAYS * DAY];
                    let lags = lags.entry([*bag, *other]).or_default();
                    lags.push((time.since(*before), of.topic, *time, is));
                }
            }
        }
    }
    // No other run has a node with the time of its start in its name.
    let started = streams.iter().filter_map(|stream| {
        let name = stream.connection.publisher.as_ref()?.as_str();
        start(name).map(|_| (stream.bag, name))
    });
    let started: BTreeSet<(usize, &str)> = started.collect();
    let is_one_run = |[one, other]: [usize; 2]| {
        let mut all = started.range((one, "")..(one + 1, ""));
        all.any(|(_, name)| started.contains(&(other, name)))
    };
    let all = lags.into_iter();
    let found = all.filter_map(|(bags, lags)| offset(bags, lags, &once, is_one_run(bags)));
    Ok(found.collect())
}

/// The common messages of two bags with these times between them; `None` without agreement. `once`: as in `offsets`.
fn offset(
    [bag, other]: [usize; 2],
    mut lags: Vec<Lag<'_>>,
    once: &BTreeMap<&str, BTreeMap<usize, Vec<Stamp>>>,
    is_one_run: bool,
) -> Option<ClockOffset> {
    lags.sort_unstable();
    let ahead = lags.get(lags.len() / 2)?.0;
    let near = lags.iter().filter(|lag| (lag.0 - ahead).abs() <= NEAR_NS);
    let messages = near.clone().count();
    let is_stamped = near.clone().filter(|lag| lag.3[0]).count() >= FEWEST;
    let is_set = near.clone().all(|lag| lag.3[1]);
    let topics: BTreeSet<&str> = near.clone().map(|lag| lag.1).collect();
    let times = near.map(|lag| Span::new(lag.2, lag.2.plus(1)));
    let common = times.reduce(|a, b| a.hull(b))?;
    // Two robots may receive the same messages of their fleet, and send others on topics of one name.
    let has_many = |of: &BTreeMap<usize, Vec<Stamp>>, bag: usize, by: i64| {
        let times = of.get(&bag).into_iter().flatten();
        let within = times.filter(|time| common.contains(time.plus(by)));
        within.count() >= FEWEST
    };
    let compared = once
        .iter()
        .filter(|(_, of)| has_many(of, bag, 0) && has_many(of, other, ahead));
    let differ = compared
        .filter(|(topic, _)| !topics.contains(*topic))
        .count();
    let is_clear = messages >= FEWEST && messages * 100 >= lags.len() * SHARE;
    (is_clear && (is_stamped || topics.len() >= TOPICS)).then_some(ClockOffset {
        bag,
        other,
        ahead,
        messages,
        is_one_robot: differ <= topics.len()
            && (is_one_run || is_set && (is_stamped || topics.len() > TOPICS)),
    })
}

/// The messages of a bag that repeat others, by stream and time, each as an interval, since the recordings of two recorders were
/// merged: on more than two topics, and a quarter of all, most contents that are not constant occur twice, with one difference of
/// time. If a script appended one recording to another, time goes back in the file (`seams` times), and it is enough that messages of
/// one topic were recorded again at once. `of`: the bag's streams.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn merged(
    (streams, facts): (&[Stream], &Observations),
    of: &[usize],
    seams: usize,
) -> io::Result<Vec<(usize, Span)>> {
    let mut rest = contents(streams, facts, of.iter().copied());
    let (mut all, mut topics, mut many_topics) = (Vec::new(), Vec::new(), 0);
    while let Some(of) = rest.next().transpose()? {
        let (mut many, mut lags) = (0, Vec::new());
        let same = of.messages.chunk_by(|a, b| a.0 == b.0);
        for same in same.filter(|same| same.len() <= (seams + 1).max(2)) {
            many += 1;
            lags.extend(same.windows(2).map(|two| two[1].1.since(two[0].1)));
        }
        many_topics += usize::from(many >= FEWEST);
        if many >= FEWEST && lags.len() >= FEWEST && lags.len() * 4 >= many {
            topics.push((all.len(), lags));
        }
        all.push(of);
        // If too few topics occur twice even with all that are left, those with most messages need not be read.
        if seams == 0 && topics.len() * 4 + rest.len() * 3 < many_topics {
            return Ok(Vec::new());
        }
    }
    let mut lags: Vec<i64> = topics.iter().flat_map(|(_, lags)| lags).copied().collect();
    lags.sort_unstable();
    let usual = lags.get(lags.len() / 2).copied().unwrap_or(i64::MAX);
    topics.retain(|(_, lags)| {
        let near = lags.iter().filter(|lag| (**lag - usual).abs() <= NEAR_NS);
        near.count() * 100 >= lags.len() * SHARE
    });
    let is_merged = if seams > 0 {
        // Two runs of a simulation may have equal messages at equal times.
        let messages = topics.iter().flat_map(|(at, _)| &all[*at].messages);
        let first = messages.map(|message| message.1).min();
        usual <= NEAR_NS && first.is_some_and(|at| at.0 > UNSET_DAYS * DAY)
    } else {
        let is_some = topics.len() > TOPICS && topics.len() * 4 >= many_topics;
        is_some && usual <= MERGED_NS
    };
    if !is_merged {
        return Ok(Vec::new());
    }
    // The messages of a fast topic may be constant.
    let mut late: Vec<i64> = lags.iter().map(|lag| (lag - usual).abs()).collect();
    late.sort_unstable();
    let near = late[late.len() * 9 / 10].saturating_mul(3);
    let near = near.clamp(NEAR_NS / 50, NEAR_NS);
    let contents = all.iter();
    let contents = contents.flat_map(|of| of.messages.chunk_by(|a, b| a.0 == b.0));
    let mut again = Vec::new();
    for same in contents {
        // Those before that none repeats yet.
        let mut first: VecDeque<Stamp> = VecDeque::new();
        for (_, time, at) in same.iter().copied() {
            let is_gone = |first: &Stamp| time.since(*first) > usual + near;
            while first.front().is_some_and(is_gone) {
                first.pop_front();
            }
            let before = first.front().copied();
            match before.filter(|before| time.since(*before) >= usual - near) {
                Some(before) => {
                    // Of two messages at one time, one stays.
                    again.push((at, Span::new(time, time.plus(i64::from(before < time)))));
                    first.pop_front();
                }
                None => first.push_back(time),
            }
        }
    }
    again.sort_unstable_by_key(|(at, span)| (*at, span.start));
    Ok(again)
}

#[cfg(test)]
mod tests {
    mod clock {
        use super::super::*;

        fn bag(days: &[(i64, u64)]) -> Calendar {
            Calendar {
                days: days.iter().copied().collect(),
                ..Calendar::default()
            }
        }

        fn all(bags: &[Calendar]) -> Belief {
            believed(&bags.iter().cloned().collect())
        }

        fn kept(days: &[(i64, u64)]) -> Option<(i64, i64)> {
            let span = all(&[bag(days)]).span?;
            Some((span.start.0.div_euclid(DAY), span.end.0 / DAY))
        }

        #[test]
        fn each_bag_has_its_own_clock_and_most_messages_decide() {
            let wall = bag(&[(20_000, 30)]);
            let simulated = |many| bag(&[(0, many)]);
            let span = |first: i64, last: i64| Some(Span::new(Stamp(first), Stamp(last * DAY)));
            let found = all(&[wall.clone(), simulated(29)]);
            assert_eq!(
                (found.span, found.others),
                (span(20_000 * DAY, 20_001), vec![1])
            );
            assert_eq!(all(&[wall.clone(), simulated(30)]).others, [1]);
            let found = all(&[wall.clone(), simulated(31)]);
            assert_eq!((found.span, found.others), (span(1, 1), vec![0]));
            assert_eq!(found.jumps, [] as [&str; 0]);
            assert_eq!(all(&[wall, bag(&[(20_300, 900)])]), Belief::default());
        }

        #[test]
        fn messages_at_0_are_from_before_the_clock_unless_it_begins_there() {
            let at_0 = |zeros, next| Calendar {
                zeros,
                next: Some(Stamp(next)),
                ..bag(&[(0, 5)])
            };
            let late = at_0(900, 2 * GAP_NS);
            assert_eq!(
                all(std::slice::from_ref(&late)).span.unwrap().start,
                Stamp(1)
            );
            assert_eq!(
                all(&[late.clone(), bag(&[(0, 9)])]).span.unwrap().start,
                Stamp(1)
            );
            assert_eq!(all(&[at_0(2, GAP_NS / 10)]), Belief::default());
            assert_eq!(all(&[at_0(1, 2 * GAP_NS)]), Belief::default());
            assert_eq!(all(&[late, at_0(2, 1)]), Belief::default());
            let only = Calendar {
                zeros: 3,
                ..Calendar::default()
            };
            assert_eq!(all(&[only]), Belief::default());
        }

        #[test]
        fn a_few_messages_far_from_the_bulk_are_set_aside() {
            assert_eq!(kept(&[(0, 3), (20_000, 500)]), Some((20_000, 20_001)));
            assert_eq!(kept(&[(0, 1), (20_000, 2)]), Some((20_000, 20_001)));
            assert_eq!(kept(&[(0, 500), (20_000, 3)]), Some((0, 1)));
        }

        #[test]
        fn a_bag_in_one_or_two_parts_is_kept_completely() {
            assert_eq!(kept(&[(0, 500)]), None);
            assert_eq!(kept(&[(20_000, 2), (20_006, 3)]), None);
            assert_eq!(kept(&[(0, 250), (20_000, 250)]), None);
            assert_eq!(kept(&[(0, 1), (20_000, 1)]), None);
            assert_eq!(kept(&[]), None);
        }

        #[test]
        fn messages_before_the_clock_was_set_are_set_aside() {
            assert_eq!(kept(&[(0, 249), (20_000, 250)]), Some((20_000, 20_001)));
            assert_eq!(kept(&[(10_957, 249), (20_000, 250)]), None);
            assert_eq!(kept(&[(0, 250), (20_000, 249)]), None);
        }

        #[test]
        fn missions_are_limited_to_a_hundred_years() {
            assert_eq!(kept(&[(0, 2), (100_000, 2)]), Some((100_000, 100_001)));
            assert_eq!(kept(&[(0, 3), (100_000, 2)]), Some((0, 1)));
            let yearly: Vec<_> = (0..200).map(|year| (year * 365, 1)).collect();
            assert_eq!(kept(&yearly), Some((0, budget::SPAN_DAYS)));
        }

        #[test]
        fn a_plausible_clock_jump_is_reported() {
            let stated = &all(&[bag(&[(10_957, 249), (20_000, 250)])]).jumps[0];
            assert!(
                stated.contains("249 messages from 2000-01-01, 250 messages from 2024-10-04"),
                "{stated}"
            );
            let one = all(&[bag(&[(20_000, 249), (20_001, 250)])]);
            assert_eq!(one, Belief::default());
        }
    }

    mod offsets {
        use super::super::*;

        /// The times between messages of two topics at these times, in milliseconds.
        fn lags(one: &[i64], other: &[i64], stamped: bool) -> Vec<Lag<'static>> {
            let all = one
                .iter()
                .zip(other)
                .zip(["/tf", "/odom"].into_iter().cycle());
            let lag = |((before, time), topic): ((&i64, &i64), _)| {
                let nanos = |ms| ms * 1_000_000;
                (
                    nanos(time - before),
                    topic,
                    Stamp(nanos(*time)),
                    [stamped, false],
                )
            };
            all.map(lag).collect()
        }

        fn found(lags: Vec<Lag<'_>>, is_one_run: bool) -> Option<(i64, usize, bool)> {
            let found = offset([1, 0], lags, &BTreeMap::new(), is_one_run)?;
            Some((found.ahead, found.messages, found.is_one_robot))
        }

        #[test]
        fn an_offset_needs_messages_that_agree() {
            let one: Vec<i64> = (0..20).map(|n| n * 100).collect();
            let later: Vec<i64> = one.iter().map(|t| t + 350 + t % 7).collect();
            let (ahead, messages, _) = found(lags(&one, &later, false), false).unwrap();
            assert_eq!((ahead / 10_000_000, messages), (35, 20));
            let wild: Vec<i64> = one.iter().map(|t| t * 2).collect();
            assert_eq!(found(lags(&one, &wild, false), false), None);
            assert_eq!(found(lags(&one[..5], &later, false), false), None);
            let only = |stamped| {
                let mut all = lags(&one, &later, stamped);
                all.retain(|lag| lag.1 == "/tf");
                all
            };
            assert_eq!(found(only(false), false), None);
            // In simulated time, which may be another run, unless a node in both started once.
            let both = [false, true].map(|is_one_run| found(only(true), is_one_run).unwrap());
            assert_eq!(
                both.map(|found| (found.1, found.2)),
                [(10, false), (10, true)]
            );
        }
    }
}
