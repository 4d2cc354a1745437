//! Generates an expectation from healthy runs: the strictest one that all of them meet, one line per element.

mod update;

use std::collections::{BTreeMap, BTreeSet};

use super::expectation::SCHEMA;
use super::facts::{Facts, Rate, Role, TopicIn};
use super::values::{Pattern, Range};
use crate::base::budget;
use crate::base::ids::grouped;
use crate::base::rhythm::{CLOSING_NS, FEWEST, FEWEST_OF_MEAN, GAP_NS};
use crate::base::time::{Period, SECOND, Stamp};
use crate::base::words::{self, visible_json};
use crate::graph::history::Bound;
use crate::mission::Mission;
use crate::mission::event_log::Kind;

pub(crate) use update::update;

/// The longest name in the file, in bytes; longer ones are left out: YAML allows no longer keys, and ROS allows 255.
const LONGEST: usize = 1000;
/// The share of a document's limits reserved for the lines before the first name.
const HEAD: usize = 1 << 16;

/// The fraction by which a rate may differ between runs.
pub(super) const SHARE: f64 = 0.1;
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

/// A generated or updated expectation.
#[derive(Debug, Default)]
pub(crate) struct Written {
    /// The whole file.
    pub(crate) text: String,
    /// The numbers of nodes and topics written, and of both that did not fit, of a generated one.
    pub(crate) nodes: usize,
    pub(crate) topics: usize,
    pub(crate) left_out: usize,
    /// The number of rewritten facts of an updated one, and of findings that only the author of a rule can resolve.
    pub(crate) changed: usize,
    pub(crate) left: usize,
}

/// The expectation that all of these runs meet, which were read with one period; without times if each `is_part` of a
/// recording. `from` names them in a comment.
pub(crate) fn write(runs: &[Mission], is_part: bool, from: &str) -> Written {
    let written = |first: &Mission| written(&Draft::of(runs, is_part), from, first.period);
    runs.first().map(written).unwrap_or_default()
}

fn written(draft: &Draft, from: &str, period: Period) -> Written {
    let mut room = Room {
        bytes: budget::YAML - HEAD,
        values: budget::YAML_VALUES - HEAD / 16,
        left_out: 0,
    };
    let nodes = draft.nodes.iter().map(|(name, line)| (name, line.text()));
    let nodes = room.section("nodes", nodes);
    // Elements that were left out must not be reported as unexpected.
    let others = if room.left_out == 0 { "warn" } else { "allow" };
    let topics = draft.topics.iter();
    let topics = topics.map(|(name, line)| (name, line.text() + &line.comment));
    let topics = room.section("topics", topics);
    let note = match room.left_out {
        0 => String::new(),
        n => format!("# {} did not fit.\n", words::count(n, "more name")),
    };
    let (from, period) = (scalar(from), length(period.nanos()));
    let text = format!(
        "schema: {SCHEMA}\nfrom: {from}\nperiod: {period}\n\
         policy: {{unexpected_nodes: {others}, unexpected_topics: allow, unexpected_publishers: error}}\n\
         {note}{nodes}{topics}"
    );
    let entries = |section: &str| section.lines().count().saturating_sub(1);
    Written {
        text,
        nodes: entries(&nodes),
        topics: entries(&topics),
        left_out: room.left_out,
        ..Written::default()
    }
}

/// The remaining limits within which the document can be read back.
struct Room {
    bytes: usize,
    values: usize,
    left_out: usize,
}

impl Room {
    /// A section with a line per name, without those that do not fit; empty if none fits.
    fn section<'a>(
        &mut self,
        key: &str,
        lines: impl Iterator<Item = (&'a String, String)>,
    ) -> String {
        let mut out = String::new();
        for (name, line) in lines {
            let name = scalar(&Pattern::text_of(name));
            let line = format!("  {name}: {line}\n");
            if name.len() > LONGEST || !self.takes(&line) {
                self.left_out += 1;
                continue;
            }
            if out.is_empty() {
                out = format!("{key}:\n");
            }
            out.push_str(&line);
        }
        out
    }

    /// Reserves space for a line; returns whether it fits.
    fn takes(&mut self, line: &str) -> bool {
        // A pair is two values, and so is a mapping or list with its first member; a comma begins another.
        let is_sign = |b: &u8| matches!(b, b':' | b',' | b'[' | b'{');
        let values = 2 * line.bytes().filter(is_sign).count();
        let fits = line.len() <= self.bytes && values <= self.values;
        if fits {
            self.bytes -= line.len();
            self.values -= values;
        }
        fits
    }
}

/// The facts that are true in all runs.
#[derive(Debug, Default)]
struct Draft {
    nodes: BTreeMap<String, Line>,
    topics: BTreeMap<String, Line>,
}

/// The common facts of a node or topic: the keys of its line with their values in YAML, and the comment after it.
#[derive(Clone, Debug, Default)]
struct Line {
    facts: Vec<(&'static str, String)>,
    comment: String,
}

impl Line {
    fn of<const N: usize>(facts: [(&'static str, Option<String>); N]) -> Self {
        let facts = facts.into_iter();
        let facts = facts.filter_map(|(key, value)| Some((key, value?)));
        Self {
            facts: facts.collect(),
            comment: String::new(),
        }
    }

    /// The value of a key.
    fn get(&self, key: &str) -> Option<String> {
        let own = self.facts.iter().find(|(own, _)| *own == key);
        own.map(|(_, value)| value.clone())
    }

    /// The text after the name: its facts as a mapping of YAML.
    fn text(&self) -> String {
        let pairs = self.facts.iter();
        let pairs = pairs.map(|(key, value)| format!("{key}: {value}"));
        format!("{{{}}}", words::joined(pairs, ", "))
    }
}

/// The value of an optional key.
fn flag(is_set: bool, word: &str) -> Option<String> {
    is_set.then(|| word.to_owned())
}

impl Draft {
    /// The facts that all of these runs have in common; without times if each `is_part` of a recording.
    fn of(runs: &[Mission], is_part: bool) -> Self {
        let runs: Vec<Facts<'_>> = runs.iter().map(Facts::new).collect();
        let times = Times::of(&runs, is_part);
        let nodes = runs.iter().flat_map(Facts::robot_roles);
        let topics = runs.iter().flat_map(Facts::robot_topics);
        Self {
            nodes: lines(nodes.map(|one| (one.name, one)), |seen| node(seen, &times)),
            topics: lines(topics.map(|one| (one.name(), one)), |seen| {
                topic(seen, &times)
            }),
        }
    }
}

/// The line of each name by all that was seen of it.
fn lines<'a, S>(
    seen: impl Iterator<Item = (&'a str, S)>,
    line: impl Fn(&[S]) -> Line,
) -> BTreeMap<String, Line> {
    let all = grouped(seen).into_iter();
    all.map(|(name, seen)| (name.to_owned(), line(&seen)))
        .collect()
}

fn node(seen: &[Role<'_>], times: &Times) -> Line {
    let since = |run: &Role<'_>, at| run.facts.mission.offset(at);
    // Known to within seconds.
    let is_sure = |bound: &Bound| bound.latest.since(bound.earliest) <= CLOSING_NS;
    let ended = |s: &Role<'_>| s.facts.ended(s.nodes, ENDED_NS);
    let are_ends_sure = seen.iter().filter_map(ended).all(|end| is_sure(&end));
    let ends = seen.iter().filter_map(|s| Some(since(s, ended(s)?.time)));
    let ends: Vec<i64> = ends.collect();
    let began = seen.iter().map(|s| {
        let began = s.facts.began(s.nodes)?;
        // A node may have run before the recorder.
        let is_sure = began.earliest != Stamp::MIN && is_sure(&began);
        is_sure.then(|| since(s, began.time))
    });
    let began: Option<Vec<i64>> = began.collect();
    let state = |s: &Role<'_>| s.facts.lifecycle(s.nodes).map(str::to_owned);
    let restarted = |s: &Role<'_>| s.facts.events(s.nodes, Kind::Restarted).len();
    let restarts = seen.iter().map(restarted).max().unwrap_or(0);
    let is_logged = seen.iter().all(|s| s.facts.is_logged_only(s.nodes));
    Line::of([
        ("lifecycle", common(seen, state).map(|state| scalar(&state))),
        ("within", began.and_then(|began| times.within(&began))),
        ("may_end", times.may_end(&ends, are_ends_sure)),
        ("known_by", flag(is_logged, "log")),
        ("optional", flag(seen.len() < times.runs, "true")),
        ("restarts", Some(format!("..{restarts}"))),
    ])
}

/// The value that all runs have in common.
fn common<R, T: PartialEq>(runs: &[R], value: impl Fn(&R) -> Option<T>) -> Option<T> {
    let first = runs.first().and_then(&value)?;
    let is_same = runs.iter().all(|run| value(run).as_ref() == Some(&first));
    is_same.then_some(first)
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

    /// These times with headroom on both sides: a tenth of the time, as runs vary; at least 5 s, less in a short
    /// mission; and the difference between runs, which a single run does not show. The start is in whole seconds unless it is
    /// open, the end in nanoseconds.
    fn wide(&self, times: &[i64]) -> Option<(Option<String>, i64)> {
        let (first, last) = (*times.iter().min()?, *times.iter().max()?);
        let usual = (self.shortest / 10).clamp(SECOND, CLOSING_NS);
        let room = usual.max(last / 10).max(last - first);
        let room = if self.runs > 1 { room } else { 2 * room };
        let from = (first - room) / SECOND * SECOND;
        Some(((from > 0).then(|| length(from)), last + room))
    }

    /// The time range for the start of an element that started at these times.
    fn within(&self, times: &[i64]) -> Option<String> {
        let (from, to) = self.wide(times).filter(|_| !self.is_part)?;
        let (from, to) = (from.unwrap_or_default(), length(whole(to)));
        Some(format!("{from}..{to}"))
    }

    /// The time range for the end of an element that was silent for at most `tail` nanoseconds at the end.
    fn stays(&self, tail: i64) -> Option<String> {
        let room = (self.shortest / 10).max(SECOND);
        let room = tail + if self.runs > 1 { room } else { 2 * room };
        let is_some = room < self.shortest / 2 && !self.is_part;
        is_some.then(|| format!("-{}..", length(whole(room))))
    }

    /// The time range for the end of an element that ended at these times; `None` if it never did.
    fn may_end(&self, times: &[i64], is_sure: bool) -> Option<String> {
        let (from, _) = self.wide(times)?;
        let from = from.filter(|_| is_sure && !self.is_part);
        Some(from.map_or_else(|| "true".to_owned(), |from| format!("{from}..")))
    }
}

fn topic(seen: &[TopicIn<'_>], times: &Times) -> Line {
    let since = |s: &TopicIn<'_>, at| s.facts.mission.offset(at);
    let received = seen.iter();
    let received = received.filter_map(|s| Some((s, s.facts.received(s.id)?)));
    let ends = received.clone().filter(|(s, _)| s.ends(ENDED_NS));
    let ends: Vec<i64> = ends.map(|(s, own)| since(s, own.end)).collect();
    let began = received.clone().map(|(s, own)| since(s, own.start));
    let began: Vec<i64> = began.collect();
    let ends_somewhere = !ends.is_empty();
    let mut to = seen.first().map(TopicIn::to).unwrap_or_default();
    for other in seen.iter().skip(1) {
        let other = other.to();
        to.retain(|name| other.contains(name));
    }
    let judged = |s: &TopicIn<'_>| s.rates(ends_somewhere);
    let rates: Vec<Vec<Rate>> = seen.iter().map(judged).collect();
    let is_rated = rates.iter().all(|own| !own.is_empty());
    let is_even = rates.iter().all(|own| Rate::are_even(own));
    let pauses = seen.iter().filter_map(|s| {
        let longest = s.facts.longest_of(s.id, true)?;
        Some(longest as f64 / s.facts.mission.period.nanos().max(1) as f64)
    });
    let pause = pauses.fold(0.0, f64::max);
    let hz = band(&rates.concat(), is_even, pause).filter(|_| is_rated);
    let is_latched = seen.iter().all(|s| s.facts.is_latched(s.id) == Some(true));
    // Messages sent once, on request or for late subscribers, have no times of their own.
    let is_many = |s: &TopicIn<'_>| s.facts.messages[s.id] >= FEWEST_OF_MEAN;
    let is_timed = hz.is_some() || !is_latched && seen.iter().all(is_many);
    // An even topic stays; for others, the last message shows whether they do.
    let tails = received.map(|(s, own)| s.facts.mission.span.end.since(own.end));
    let stays = times.stays(tails.max().unwrap_or(0));
    let stays = stays.filter(|_| hz.is_none());
    let mean_hz = mean(seen, hz).filter(|_| is_timed);
    let names = |names: BTreeSet<String>| (!names.is_empty()).then(|| list(&names));
    let nodes =
        |nodes: BTreeSet<String>| names(nodes.iter().map(|name| Pattern::text_of(name)).collect());
    let types = common(seen, |s| Some(s.types())).unwrap_or_default();
    let types = match types.first() {
        Some(one) if types.len() == 1 => Some(scalar(one)),
        _ => names(types),
    };
    let within = times.within(&began);
    let may_end = times.may_end(&ends, true).or(stays);
    let max_gap = longest(seen, ends_somewhere).filter(|_| is_timed);
    let max_gap = max_gap.map(length);
    let within = within.filter(|_| is_timed).or_else(|| {
        // A topic without such a fact is only required to send at all.
        let is_required = hz.is_some() || mean_hz.is_some() || max_gap.is_some();
        (!is_required && !times.is_part).then(|| ANY_TIME.to_owned())
    });
    let mut line = Line::of([
        ("type", types),
        ("by", common(seen, TopicIn::by).and_then(nodes)),
        ("to", nodes(to)),
        ("hz", hz.map(|hz| hz.to_string())),
        ("mean_hz", mean_hz.map(|hz| hz.to_string())),
        ("max_gap", max_gap),
        ("within", within),
        ("may_end", may_end.filter(|_| is_timed)),
        ("latched", flag(is_latched, "true")),
        ("optional", flag(seen.len() < times.runs, "true")),
    ]);
    if hz.is_none() && mean_hz.is_none() && !is_latched {
        line.comment = format!("  # {}: rate not checked", unjudged(seen, &rates.concat()));
    }
    line
}

/// The range of a topic's rate from its first to its last message, if the one for each window is too wide to detect the
/// loss of a fifth of the messages.
fn mean(seen: &[TopicIn<'_>], hz: Option<Range>) -> Option<Range> {
    let rates = seen.iter().map(|s| s.facts.mean(s.id));
    let rates: Vec<Rate> = rates.collect::<Option<_>>()?;
    let fewest = rates.iter().map(|r| r.count).min()?;
    let (least, most) = extremes(&rates);
    let shown = hz.and_then(|hz| hz.from);
    let is_shown = shown.is_some_and(|from| from >= least * (1.0 - MEAN_SHARE));
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

/// The lowest and the highest of these rates.
fn extremes(rates: &[Rate]) -> (f64, f64) {
    let values = rates.iter().map(Rate::hz);
    values.fold((f64::MAX, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)))
}

/// The lowest and highest rates of a topic; if they are meaningless, the number of its messages.
fn unjudged(seen: &[TopicIn<'_>], rates: &[Rate]) -> String {
    let (least, most) = extremes(rates);
    let counts = seen.iter().map(|s| s.facts.messages[s.id]);
    let count = counts.max().unwrap_or(0);
    if count < FEWEST || rates.len() < 2 {
        return words::count(count, "message");
    }
    let [least, most] = [least, most].map(|hz| Some(words::significant(hz, 2)));
    words::rate_range(least, most)
}

/// The longest silence of the runs with headroom, in nanoseconds, unless it is too long to be meaningful.
fn longest(seen: &[TopicIn<'_>], may_end: bool) -> Option<i64> {
    let silence = |s: &TopicIn<'_>| s.facts.longest_of(s.id, may_end);
    let longest = seen.iter().map(silence).collect::<Option<Vec<i64>>>()?;
    let usual = |s: &TopicIn<'_>| {
        let mean = s.facts.mean(s.id)?;
        Some(mean.span.nanos() / i64::try_from(mean.count).ok()?)
    };
    let usual = seen.iter().filter_map(usual).max()?;
    let longest = longest.into_iter().max()?.saturating_mul(GAPS);
    let gap = longest.max(usual.saturating_mul(INTERVALS)).max(GAP_NS);
    let life = |s: &TopicIn<'_>| Some(s.facts.received(s.id)?.nanos());
    let life = seen.iter().filter_map(life).min()?;
    (gap < life / 2).then(|| two_digits(gap))
}

/// The range around the median rate that covers noise and every window seen; `None` for bursty topics, where it would
/// cover everything. The count of an uneven topic may differ by its square root, and the longest pause, a share of a window,
/// may lie in one window as well as in two.
fn band(rates: &[Rate], is_even: bool, pause: f64) -> Option<Range> {
    let count = Rate::count(rates);
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
    let typical = rates.iter().map(|r| r.hz() / (r.count as f64).max(1.0));
    let chance = libm::sqrt(median * typical.fold(0.0, f64::max));
    let spread = libm::sqrt(variance).max(if is_even { 0.0 } else { chance });
    let margin = (median * SHARE).max(spread * SPREADS);
    let seconds = rates.iter().map(Rate::seconds).fold(0.0, f64::max);
    let missed = median * (pause - 1.0 / (median * seconds)).max(0.0);
    let least = least.min(median - missed);
    let (from, to) = ((median - margin).min(least), (median + margin).max(most));
    (from > 0.0).then(|| Range {
        from: Some(rounded(from, libm::floor)),
        to: Some(rounded(to, libm::ceil)),
    })
}

/// The value to three digits, rounded by `round`.
fn rounded(value: f64, round: fn(f64) -> f64) -> f64 {
    words::to_digits(value, 3, |digits| match libm::round(digits) {
        // A sum of 110.00000000000001 is 110, whichever way it is rounded.
        near if (digits - near).abs() < 1e-9 * near => near,
        _ => round(digits),
    })
}

/// A length of time in the command line's syntax.
fn length(nanos: i64) -> String {
    format!("{}s", nanos as f64 / 1e9)
}

/// The nanoseconds rounded up to a whole second.
fn whole(nanos: i64) -> i64 {
    rounded_up(nanos, SECOND)
}

fn rounded_up(nanos: i64, step: i64) -> i64 {
    nanos.saturating_add(step - 1) / step * step
}

/// The nanoseconds rounded up to two digits.
fn two_digits(nanos: i64) -> i64 {
    let mut step = 1;
    while nanos / step >= 100 {
        step *= 10;
    }
    rounded_up(nanos, step)
}

/// Text as YAML: plain if YAML reads it as text, otherwise quoted.
fn scalar(text: &str) -> String {
    const WORDS: [&str; 9] = ["true", "false", "null", "yes", "no", "on", "off", "y", "n"];
    let harmless = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '_' | '-' | '.');
    let begins = text.starts_with(|c: char| c == '/' || c.is_ascii_alphabetic());
    let is_word = WORDS.contains(&text.to_ascii_lowercase().as_str());
    if begins && !is_word && text.chars().all(harmless) {
        return text.to_owned();
    }
    visible_json(&serde_json::to_string(text).unwrap_or_default()).into_owned()
}

/// Names as a list on one line.
fn list(names: &BTreeSet<String>) -> String {
    let names = names.iter().map(|name| scalar(name));
    format!("[{}]", words::joined(names, ", "))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::base::time::Span;
    use crate::gate::read;

    /// An expectation of `nodes` nodes, and of topics with these names, which must be readable.
    fn file_of(nodes: usize, topics: &[String]) -> (Written, usize) {
        let mut draft = Draft::default();
        for n in 0..nodes {
            draft.nodes.insert(format!("/n{n}"), Line::default());
        }
        for name in topics {
            draft.topics.insert(name.clone(), Line::default());
        }
        let written = super::written(
            &draft,
            "run.bag",
            Period::from_nanos(1_000_000_000).unwrap(),
        );
        let read = read(&written.text, Path::new("graph.yaml")).unwrap();
        let kept = read.nodes.len() + read.topics.len();
        (written, kept)
    }

    #[test]
    fn expectations_with_any_number_of_names_can_be_read() {
        let (small, kept) = file_of(2, &["/a".to_owned()]);
        assert_eq!((small.left_out, kept), (0, 3));
        assert!(small.text.contains("unexpected_nodes: warn") && !small.text.contains("no room"));
        let (large, kept) = file_of(1 << 17, &[]);
        assert!(kept > 20_000 && large.left_out + kept == 1 << 17, "{kept}");
        assert!(large.text.contains("unexpected_nodes: allow"));
        assert!(large.text.contains(" more names did not fit.\n"));
    }

    #[test]
    fn unusual_names_round_trip() {
        let signs = "\u{fffe}\u{ffff}\u{feff}\u{2028}\u{85}\u{7f}\u{1}\u{9b}\u{a0}\u{202e}\u{e0001}\u{1f600}\u{10ffff}\t\n\r\"'\\:#&*!|>%@`,[]{}?-~=<^$+ ß";
        for sign in signs.chars() {
            let name = format!("/a{sign}b");
            let (written, kept) = file_of(0, std::slice::from_ref(&name));
            assert_eq!((written.left_out, kept), (0, 1), "{name:?}");
            let read = read(&written.text, Path::new("graph.yaml")).unwrap();
            let back = format!("{:?}", read.topics);
            assert!(back.contains(&format!("{name:?}")), "{name:?} in {back}");
        }
    }

    #[test]
    fn names_that_are_not_valid_keys_are_left_out() {
        // Of their length when written.
        let names = [
            "/a".repeat(495),
            "/a".repeat(505),
            format!("/{}", "\u{202e}".repeat(300)),
        ];
        let (written, kept) = file_of(0, &names);
        assert_eq!((written.left_out, kept), (2, 1));
    }

    #[test]
    fn text_is_quoted_if_yaml_would_read_another_value() {
        assert_eq!(scalar("/nav/amcl_1"), "/nav/amcl_1");
        assert_eq!(
            scalar("sensor_msgs/msg/LaserScan"),
            "sensor_msgs/msg/LaserScan"
        );
        assert_eq!(scalar("true"), "\"true\"");
        assert_eq!(scalar("/a: {b}"), "\"/a: {b}\"");
        assert_eq!(scalar("12"), "\"12\"");
        assert_eq!(scalar("/a\u{202e}\n"), "\"/a\\u202e\\n\"");
        assert_eq!(
            (length(60_000_000_000), length(500_000_000)),
            ("60s".to_owned(), "0.5s".to_owned())
        );
    }

    fn rates(counts: &[u64]) -> Vec<Rate> {
        let rate = |(window, count): (usize, &u64)| Rate {
            window,
            span: Span::new(Stamp(0), Stamp(10_000_000_000)),
            count: *count,
            median_s: None,
        };
        counts.iter().enumerate().map(rate).collect()
    }

    fn band_of(counts: &[u64], is_even: bool) -> Option<String> {
        band(&rates(counts), is_even, 0.0).map(|range| range.to_string())
    }

    #[test]
    fn a_steady_rate_has_ten_percent_headroom() {
        assert_eq!(band_of(&[100, 100, 100], true).as_deref(), Some("9..11"));
        assert_eq!(band_of(&[10, 10, 10], true).as_deref(), Some("0.9..1.1"));
    }

    #[test]
    fn every_window_seen_is_in_range() {
        assert_eq!(
            band_of(&[100, 100, 100, 100, 100, 100, 60], true).as_deref(),
            Some("5.8..14.2")
        );
    }

    #[test]
    fn bursts_have_no_rate() {
        assert_eq!(band_of(&[1, 8, 0, 3], false), None);
        assert_eq!(band_of(&[2, 2], true), None);
        assert_eq!(band_of(&[7, 7, 7], false), None);
    }
}
