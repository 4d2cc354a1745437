//! The facts that runs have in common, by name, widened only by as much as noise requires.

use std::collections::{BTreeMap, BTreeSet};

use super::{length, list, mapping, scalar, two_digits};
use crate::base::rhythm::{CLOSING_NS, FEWEST, FEWEST_OF_MEAN, GAP_NS};
use crate::base::time::Stamp;
use crate::base::words;
use crate::gate::facts::{Facts, Rate};
use crate::gate::pattern::Pattern;
use crate::gate::range::Range;
use crate::graph::{NodeId, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::Kind;

/// The fraction by which a rate may differ between runs.
const SHARE: f64 = 0.1;
/// The fraction by which the mean rate of an uneven topic may differ between runs.
const MEAN_SHARE: f64 = 0.15;
/// The allowed silence, as a multiple of the longest in the runs.
const GAPS: i64 = 2;
/// This many usual intervals are added, since one or two messages are lost now and then.
const INTERVALS: i64 = 4;
/// A rate may also differ by this multiple of the spread between windows.
const SPREADS: f64 = 3.0;

/// What is silent for longer before the end of a run may end: with a little less of it, in the next run, it would be
/// missed.
const ENDED_NS: i64 = CLOSING_NS / 2;

/// The time range for a first message at any time.
const ANY_TIME: &str = "0..";

const SECOND: i64 = 1_000_000_000;

/// The facts that are true in all runs.
#[derive(Debug, Default)]
pub(crate) struct Draft {
    pub(crate) nodes: BTreeMap<String, Line>,
    pub(crate) topics: BTreeMap<String, Line>,
}

/// The common facts of a node or topic: the keys of its line with their values in YAML, and the comment after it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Line {
    facts: Vec<(&'static str, String)>,
    pub(crate) comment: String,
}

impl Line {
    fn of<const N: usize>(facts: [(&'static str, Option<String>); N]) -> Self {
        let facts = facts
            .into_iter()
            .filter_map(|(key, value)| Some((key, value?)));
        Self {
            facts: facts.collect(),
            comment: String::new(),
        }
    }

    /// The value of a key.
    pub(crate) fn get(&self, key: &str) -> Option<String> {
        let own = self.facts.iter().find(|(own, _)| *own == key);
        own.map(|(_, value)| value.clone())
    }

    /// The text after the name: its facts as a mapping of YAML.
    pub(crate) fn text(&self) -> String {
        mapping(&self.facts)
    }
}

/// The value of an optional key.
fn flag(is_set: bool, word: &str) -> Option<String> {
    is_set.then(|| word.to_owned())
}

impl Draft {
    /// The facts that all of these runs have in common; without times if each `is_part` of a recording.
    pub(crate) fn of(runs: &[Mission], is_part: bool) -> Self {
        let runs: Vec<Facts<'_>> = runs.iter().map(Facts::new).collect();
        let times = Times::of(&runs, is_part);
        Self {
            nodes: nodes(&runs, &times),
            topics: topics(&runs, &times),
        }
    }
}

fn nodes(runs: &[Facts<'_>], times: &Times) -> BTreeMap<String, Line> {
    let mut all: BTreeMap<String, Vec<NodeInRun<'_>>> = BTreeMap::new();
    for facts in runs {
        for (role, nodes) in facts.roles() {
            if facts.is_sure(nodes) && !facts.is_tool(nodes) {
                let own = all.entry(role.to_owned()).or_default();
                own.push(NodeInRun { facts, nodes });
            }
        }
    }
    let line = |(name, seen): (String, Vec<NodeInRun<'_>>)| {
        let line = node(&seen, times, seen.len() < runs.len());
        (name, line)
    };
    all.into_iter().map(line).collect()
}

/// A node in one of the runs.
struct NodeInRun<'a> {
    facts: &'a Facts<'a>,
    nodes: &'a [NodeId],
}

fn node(seen: &[NodeInRun<'_>], times: &Times, is_optional: bool) -> Line {
    let since = |run: &NodeInRun<'_>, at: Stamp| at.since(run.facts.mission.span.start);
    let ends = seen
        .iter()
        .filter_map(|s| Some((s, s.facts.ended(s.nodes, ENDED_NS)?)));
    let ends: Vec<(i64, bool)> = ends
        .map(|(s, end)| {
            let doubt = end.latest.since(end.earliest);
            (since(s, end.time), doubt <= CLOSING_NS)
        })
        .collect();
    let is_sure = ends.iter().all(|(_, is_sure)| *is_sure);
    let ends: Vec<i64> = ends.into_iter().map(|(end, _)| end).collect();
    // A start known to within seconds, unlike that of a node that ran before the recorder.
    let began = seen.iter().map(|s| {
        let began = s.facts.began(s.nodes)?;
        let is_sure =
            began.earliest != Stamp::MIN && began.latest.since(began.earliest) <= CLOSING_NS;
        is_sure.then(|| since(s, began.time))
    });
    let began: Option<Vec<i64>> = began.collect();
    let state = |s: &NodeInRun<'_>| s.facts.lifecycle(s.nodes).map(str::to_owned);
    let last = seen.first().and_then(state);
    let restarts = seen
        .iter()
        .map(|s| s.facts.events(s.nodes, Kind::Restarted).len());
    let lifecycle = last.filter(|last| seen.iter().all(|s| state(s).as_ref() == Some(last)));
    let is_logged = seen.iter().all(|s| s.facts.is_logged_only(s.nodes));
    Line::of([
        ("lifecycle", lifecycle.map(|state| scalar(&state))),
        ("within", began.and_then(|began| times.within(&began))),
        ("may_end", times.may_end(&ends, is_sure)),
        ("known_by", flag(is_logged, "log")),
        ("optional", flag(is_optional, "true")),
        (
            "restarts",
            Some(format!("..{}", restarts.max().unwrap_or(0))),
        ),
    ])
}

/// How starts and ends differ between runs.
struct Times {
    /// The shortest of the runs.
    shortest: i64,
    runs: usize,
    /// Whether each run is a part of a recording, whose times are meaningless.
    is_part: bool,
}

impl Times {
    fn of(runs: &[Facts<'_>], is_part: bool) -> Self {
        let lengths = runs.iter().map(|facts| facts.mission.span.nanos());
        Self {
            shortest: lengths.min().unwrap_or(0),
            runs: runs.len(),
            is_part,
        }
    }

    /// The headroom on both sides of these times: a tenth of the time, as runs vary; at least 5 s, less in a short
    /// mission; and the difference between runs, which a single run does not show.
    fn room(&self, times: &[i64]) -> Option<(i64, i64, i64)> {
        let (first, last) = (*times.iter().min()?, *times.iter().max()?);
        let usual = (self.shortest / 10).clamp(SECOND, CLOSING_NS);
        let room = usual.max(last / 10).max(last - first);
        let room = if self.runs > 1 { room } else { 2 * room };
        Some((first, last, room))
    }

    /// The time range for the start of an element that started at these times.
    fn within(&self, times: &[i64]) -> Option<String> {
        let (first, last, room) = self.room(times).filter(|_| !self.is_part)?;
        let to = length((last + room + SECOND - 1) / SECOND * SECOND);
        let from = (first - room) / SECOND * SECOND;
        Some(if from > 0 {
            format!("{}..{to}", length(from))
        } else {
            format!("..{to}")
        })
    }

    /// The time range for the end of an element that was silent for at most `tail` nanoseconds at the end.
    fn stays(&self, tail: i64) -> Option<String> {
        let room = (self.shortest / 10).max(SECOND);
        let room = tail + if self.runs > 1 { room } else { 2 * room };
        let is_some = room < self.shortest / 2 && !self.is_part;
        is_some.then(|| format!("-{}..", length((room + SECOND - 1) / SECOND * SECOND)))
    }

    /// The time range for the end of an element that ended at these times; `None` if it never did.
    fn may_end(&self, times: &[i64], is_sure: bool) -> Option<String> {
        let (first, _, room) = self.room(times)?;
        let from = (first - room) / SECOND * SECOND;
        Some(if is_sure && from > 0 && !self.is_part {
            format!("{}..", length(from))
        } else {
            "true".to_owned()
        })
    }
}

/// A topic in one of the runs.
struct TopicInRun<'a> {
    facts: &'a Facts<'a>,
    id: TopicId,
}

fn topics(runs: &[Facts<'_>], times: &Times) -> BTreeMap<String, Line> {
    let mut all: BTreeMap<String, Vec<TopicInRun<'_>>> = BTreeMap::new();
    for facts in runs {
        for id in facts.topics(&Pattern::new("**")) {
            if !facts.is_housekeeping(id) && facts.messages(id) > 0 {
                let name = facts.topic(id).to_owned();
                all.entry(name).or_default().push(TopicInRun { facts, id });
            }
        }
    }
    let line = |(name, seen): (String, Vec<TopicInRun<'_>>)| {
        let line = topic(&seen, times, seen.len() < runs.len());
        (name, line)
    };
    all.into_iter().map(line).collect()
}

fn topic(seen: &[TopicInRun<'_>], times: &Times, is_optional: bool) -> Line {
    let since = |s: &TopicInRun<'_>, at: Stamp| at.since(s.facts.mission.span.start);
    let received = || {
        seen.iter()
            .filter_map(|s| Some((s, s.facts.received(s.id)?)))
    };
    let ends: Vec<i64> = received()
        .filter(|(s, _)| s.ends())
        .map(|(s, received)| since(s, received.end))
        .collect();
    let began: Vec<i64> = received()
        .map(|(s, received)| since(s, received.start))
        .collect();
    let ends_somewhere = !ends.is_empty();
    let same = |get: &dyn Fn(&TopicInRun<'_>) -> Option<BTreeSet<String>>| {
        let first = seen.first().and_then(get)?;
        seen.iter()
            .all(|s| get(s).as_ref() == Some(&first))
            .then_some(first)
    };
    let mut to = seen.first().map(TopicInRun::to).unwrap_or_default();
    for other in seen.iter().skip(1) {
        let other = other.to();
        to.retain(|name| other.contains(name));
    }
    let judged = |s: &TopicInRun<'_>| s.facts.rates(s.id, ends_somewhere, s.facts.mission.span);
    let rates: Vec<Vec<Rate>> = seen.iter().map(judged).collect();
    let is_rated = rates.iter().all(|own| !own.is_empty());
    let is_even = rates.iter().all(|own| Rate::are_even(own));
    let hz = band(&rates.concat(), is_even).filter(|_| is_rated);
    let is_latched = seen.iter().all(|s| s.facts.is_latched(s.id) == Some(true));
    // Messages sent once, on request or for late subscribers, have no times of their own.
    let is_many = |s: &TopicInRun<'_>| s.facts.messages(s.id) >= FEWEST_OF_MEAN;
    let is_timed = hz.is_some() || !is_latched && seen.iter().all(is_many);
    // An even topic stays; for others, the last message shows whether they do.
    let tails = received().map(|(s, received)| s.facts.mission.span.end.since(received.end));
    let stays = times
        .stays(tails.max().unwrap_or(0))
        .filter(|_| hz.is_none());
    let mean_hz = mean(seen, hz).filter(|_| is_timed);
    let names = |names: BTreeSet<String>| (!names.is_empty()).then(|| list(names.iter()));
    let types = same(&|s| Some(s.types())).unwrap_or_default();
    let types = match types.first() {
        Some(one) if types.len() == 1 => Some(scalar(one)),
        _ => names(types),
    };
    let within = times.within(&began);
    let may_end = times.may_end(&ends, true).or(stays);
    let max_gap = longest(seen, ends_somewhere)
        .map(length)
        .filter(|_| is_timed);
    let within = within.filter(|_| is_timed).or_else(|| {
        // A topic without such a fact is only required to send at all.
        let is_required = hz.is_some() || mean_hz.is_some() || max_gap.is_some();
        (!is_required && !times.is_part).then(|| ANY_TIME.to_owned())
    });
    let mut line = Line::of([
        ("type", types),
        ("by", same(&|s| s.by()).and_then(names)),
        ("to", names(to)),
        ("hz", hz.map(|hz| hz.to_string())),
        ("mean_hz", mean_hz.map(|hz| hz.to_string())),
        ("max_gap", max_gap),
        ("within", within),
        ("may_end", may_end.filter(|_| is_timed)),
        ("latched", flag(is_latched, "true")),
        ("optional", flag(is_optional, "true")),
    ]);
    if hz.is_none() && mean_hz.is_none() && !is_latched {
        line.comment = format!("  # {}: rate not checked", unjudged(seen, &rates.concat()));
    }
    line
}

/// The range of a topic's rate from its first to its last message, if the one for each window is too wide to detect the
/// loss of a fifth of the messages.
fn mean(seen: &[TopicInRun<'_>], hz: Option<Range>) -> Option<Range> {
    let rates = seen.iter().map(|s| s.facts.mean(s.id));
    let rates: Vec<Rate> = rates.collect::<Option<_>>()?;
    let fewest = rates.iter().map(|r| r.count).min()?;
    let values: Vec<f64> = rates.iter().map(Rate::hz).collect();
    let (least, most) = values
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
    let is_shown = hz
        .and_then(|hz| hz.from)
        .is_some_and(|from| from >= least * (1.0 - MEAN_SHARE));
    if is_shown || fewest + 1 < FEWEST_OF_MEAN {
        return None;
    }
    // One run does not show how much runs differ; random variation is the minimum.
    let chance = if rates.len() > 1 {
        0.0
    } else {
        SPREADS / libm::sqrt(fewest as f64)
    };
    let room = (most * MEAN_SHARE.max(chance)).max(SPREADS * (most - least));
    (least > room).then(|| Range {
        from: Some(rounded(least - room, libm::floor)),
        to: Some(rounded(most + room, libm::ceil)),
    })
}

/// The lowest and highest rates of a topic; if they are meaningless, the number of its messages.
fn unjudged(seen: &[TopicInRun<'_>], rates: &[Rate]) -> String {
    let values = || rates.iter().map(Rate::hz);
    let (least, most) = values().fold((f64::MAX, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
    let counts = seen.iter().map(|s| s.facts.messages(s.id));
    let count = counts.max().unwrap_or(0);
    if count < FEWEST || rates.len() < 2 {
        return words::count(count, "message");
    }
    let [least, most] = [least, most].map(|hz| Some(words::significant(hz, 2)));
    words::rate_range(least, most)
}

/// The longest silence of the runs with headroom, in nanoseconds, unless it is too long to be meaningful.
fn longest(seen: &[TopicInRun<'_>], may_end: bool) -> Option<i64> {
    let silence = |s: &TopicInRun<'_>| {
        let all = s.facts.silences(s.id, may_end, s.facts.mission.span);
        all.iter().map(|silence| silence.nanos).max()
    };
    let longest = seen.iter().map(silence).collect::<Option<Vec<i64>>>()?;
    let usual = |s: &TopicInRun<'_>| {
        let mean = s.facts.mean(s.id)?;
        i64::try_from(mean.count)
            .ok()
            .map(|count| mean.span.nanos() / count)
    };
    let usual = seen
        .iter()
        .filter_map(usual)
        .max()?
        .saturating_mul(INTERVALS);
    let longest = longest.into_iter().max()?.saturating_mul(GAPS);
    let gap = longest.max(usual).max(GAP_NS);
    let life = seen
        .iter()
        .filter_map(|s| s.facts.received(s.id))
        .map(|h| h.nanos());
    (gap < life.min()? / 2).then(|| two_digits(gap))
}

impl TopicInRun<'_> {
    fn ends(&self) -> bool {
        let received = self.facts.received(self.id);
        received.is_some_and(|h| self.facts.mission.span.end.since(h.end) > ENDED_NS)
    }

    fn types(&self) -> BTreeSet<String> {
        let own = &self.facts.mission.elements.topics[self.id];
        own.types.iter().map(|t| (**t).to_owned()).collect()
    }

    /// The nodes that publish it; `None` unless all of them are known.
    fn by(&self) -> Option<BTreeSet<String>> {
        let known = self.facts.publishers(self.id);
        let is_listed = self.facts.lists_publishers(self.id);
        is_listed.then(|| self.facts.sure_roles(&known))
    }

    /// The nodes that subscribe to it, if measured or stated.
    fn to(&self) -> BTreeSet<String> {
        self.facts.sure_roles(&self.facts.subscribers(self.id))
    }
}

/// The range around the median rate that covers noise and every window seen; `None` for bursty topics, where it would
/// cover everything. The count of an uneven topic may differ by its square root.
fn band(rates: &[Rate], is_even: bool) -> Option<Range> {
    let count: u64 = rates.iter().map(|r| r.count).sum();
    let mut values: Vec<f64> = rates.iter().map(Rate::hz).collect();
    values.sort_by(f64::total_cmp);
    let (least, most) = (*values.first()?, *values.last()?);
    let median = values[values.len() / 2];
    if count < FEWEST || median <= 0.0 {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    let typical = rates
        .iter()
        .map(|r| r.hz() / (r.count as f64).max(1.0))
        .fold(0.0, f64::max);
    let chance = libm::sqrt(median * typical);
    let spread = libm::sqrt(variance).max(if is_even { 0.0 } else { chance });
    let margin = (median * SHARE).max(spread * SPREADS);
    let (from, to) = ((median - margin).min(least), (median + margin).max(most));
    (from > 0.0).then(|| Range {
        from: Some(rounded(from, libm::floor)),
        to: Some(rounded(to, libm::ceil)),
    })
}

/// The value to three digits, rounded by `round`.
fn rounded(value: f64, round: fn(f64) -> f64) -> f64 {
    let power = 2.0 - libm::floor(libm::log10(value));
    let scale = libm::pow(10.0, libm::fabs(power));
    // A sum of 110.00000000000001 is 110, whichever way it is rounded.
    let whole = |digits: f64| match libm::round(digits) {
        near if (digits - near).abs() < 1e-9 * near => near,
        _ => round(digits),
    };
    // Dividing by a power of ten keeps 0.3 exact.
    if power >= 0.0 {
        whole(value * scale) / scale
    } else {
        whole(value / scale) * scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::{Span, Stamp};

    fn rates(counts: &[u64]) -> Vec<Rate> {
        let rate = |(window, count): (usize, &u64)| Rate {
            window,
            span: Span::new(Stamp(0), Stamp(10_000_000_000)),
            count: *count,
            median_s: None,
        };
        counts.iter().enumerate().map(rate).collect()
    }

    fn written(counts: &[u64], is_even: bool) -> Option<String> {
        band(&rates(counts), is_even).map(|range| range.to_string())
    }

    #[test]
    fn a_steady_rate_has_ten_percent_headroom() {
        assert_eq!(written(&[100, 100, 100], true).as_deref(), Some("9..11"));
        assert_eq!(written(&[10, 10, 10], true).as_deref(), Some("0.9..1.1"));
    }

    #[test]
    fn every_window_seen_is_in_range() {
        assert_eq!(
            written(&[100, 100, 100, 100, 100, 100, 60], true).as_deref(),
            Some("5.8..14.2")
        );
    }

    #[test]
    fn bursts_have_no_rate() {
        assert_eq!(written(&[1, 8, 0, 3], false), None);
        assert_eq!(written(&[2, 2], true), None);
        assert_eq!(written(&[7, 7, 7], false), None);
    }
}
