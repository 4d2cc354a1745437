//! The differences between two missions: in nodes, topics and edges, in rates and times of messages, and in events.

mod picture;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Serialize;

use super::baseline::{self, SHARE};
use super::expectation;
use super::facts::{Facts, Role, TopicIn};
use super::finding::{Finding, FindingKind, Severity};
use super::judge::judge;
use super::values::Pattern;
use crate::base::rhythm::{CLOSING_NS, DISCOVERY_NS};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::graph::history::Bound;
use crate::graph::{Element, NodeId};
use crate::mission::Mission;
use crate::mission::event_log::{Event, Kind};

pub(crate) use picture::{Side, pairs, union};

/// An end is certain if the silence after it is this many times its uncertainty.
const DOUBTS: i64 = 8;
/// The difference in nanoseconds up to which times of two runs count as equal: nodes of one launch file start in any
/// order, a second apart.
const APART_NS: i64 = 2_000_000_000;
/// The part of the time since the start by which two runs may drift: a fiftieth.
const PACE: i64 = 50;
/// The fewest messages of a topic whose first and last are compared: with fewer, silences do not show a rhythm.
const FEWEST_OF_TIMES: u64 = 20;

/// The two missions as given.
#[derive(Clone, Debug)]
pub struct DiffSubject {
    /// The name of the first.
    pub first: String,
    /// The name of the second.
    pub second: String,
}

/// Which of two missions contain an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Where {
    /// Only in the first.
    First,
    /// Only in the second.
    Second,
    /// In both, but different.
    Both,
}

impl Where {
    /// The side of what only the first mission has, or only the second.
    fn only(is_first: bool) -> Self {
        if is_first { Self::First } else { Self::Second }
    }
}

/// One difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Difference {
    /// The kind of thing: `node`, `topic`, `publishes`, `subscribes`, `type`, `rate`, …
    pub kind: &'static str,
    /// The name of the node or topic it is about, or both names of an edge.
    pub name: String,
    /// The node or topic, or both as in `name`; the name of an event contains more.
    #[serde(skip)]
    pub element: String,
    /// The missions that contain it.
    #[serde(rename = "in")]
    pub side: Where,
    /// The value in the first mission; empty for none.
    pub first: String,
    /// The value in the second mission; empty for none.
    pub second: String,
    /// Both rates in messages per second, of a difference in them.
    #[serde(skip)]
    pub(crate) rates: Option<[f64; 2]>,
    /// Whether it is observable in both missions. An element without evidence in one is not absent from it.
    #[serde(rename = "known")]
    pub is_known: bool,
}

impl Difference {
    /// A difference in something that only one mission has.
    fn only(kind: &'static str, name: impl Into<String>, side: Where, what: &str) -> Self {
        let (first, second) = match side {
            Where::Second => ("", what),
            _ => (what, ""),
        };
        Self {
            side,
            ..Self::changed(kind, name, [first, second])
        }
    }

    /// A difference in something that both missions have with different values.
    fn changed(
        kind: &'static str,
        name: impl Into<String>,
        values: [impl Into<String>; 2],
    ) -> Self {
        let name = name.into();
        let [first, second] = values.map(Into::into);
        Self {
            kind,
            element: name.clone(),
            name,
            side: Where::Both,
            first,
            second,
            rates: None,
            is_known: true,
        }
    }
}

/// All differences: elements, then events, then times of topics, then what only a check finds with a baseline of the first. Rates
/// differ if a check finds so, and by more than the fraction `rate_change`, if one is given. Times since the start count unless a
/// mission `is_part` of a recording.
pub(crate) fn differences(
    first: &Mission,
    second: &Mission,
    rate_change: Option<f64>,
    is_part: bool,
) -> Vec<Difference> {
    let facts = &[Facts::new(first), Facts::new(second)];
    let found = findings(first, second, is_part);
    // Few messages have no range that many could exceed.
    let lower = findings(second, first, is_part);
    let lower = lower.iter().filter(|f| f.kind == FindingKind::TopicRateLow);
    let off = found.iter().filter(|f| is_rate(f)).chain(lower);
    let off: BTreeSet<&str> = off.map(|f| &*f.name).collect();
    let change = rate_change.unwrap_or(SHARE);
    let rate = |name: &str, both| rate(name, both, change).filter(|_| off.contains(name));
    let mut all = elements(facts, rate);
    all.extend(events(facts));
    if facts.iter().any(|facts| facts.is_rewritten) {
        // Senders are unknown there, and so are ends and restarts of nodes.
        let lost = ["publishes", "end", "restarts", "event"];
        for one in all.iter_mut().filter(|d| lost.contains(&d.kind)) {
            one.is_known = false;
        }
    }
    let times = times(facts, &all);
    // A topic that ends earlier is also silent.
    let ends = |d: &Difference| {
        let mut ends = times.iter().filter(|t| t.kind == "end");
        ends.any(|t| t.element == d.element)
    };
    all.retain(|d| !(d.kind == "event" && d.name.ends_with(" silent") && ends(d)));
    all.extend(times);
    let counted = found.iter();
    let counted = counted.filter(|f| rate_change.is_none() || !is_rate(f));
    let more = unshown(facts, counted, &all);
    all.extend(more);
    all
}

/// What is wrong about the second mission by a baseline of the first.
fn findings(first: &Mission, second: &Mission, is_part: bool) -> Vec<Finding> {
    let written = baseline::write(std::slice::from_ref(first), is_part, "");
    let read = expectation::read(&written.text, Path::new("baseline"));
    let checks = read.map(|read| judge(&read, second, is_part).checks);
    let all = checks.into_iter().flatten().flat_map(|c| c.findings);
    all.filter(|f| f.severity == Severity::Error).collect()
}

fn is_rate(finding: &Finding) -> bool {
    let kinds = [FindingKind::TopicRateLow, FindingKind::TopicRateHigh];
    kinds.contains(&finding.kind)
}

/// The findings that no difference of the same name or of a publisher shows.
fn unshown<'a>(
    facts: &[Facts<'_>; 2],
    found: impl Iterator<Item = &'a Finding>,
    known: &[Difference],
) -> Vec<Difference> {
    let known = || known.iter().filter(|d| d.is_known);
    let shown: BTreeSet<&str> = known().flat_map(|d| d.element.split(" → ")).collect();
    // If everything is delayed, one difference shows it.
    let is_moved = known().any(|d| ["time", "begin"].contains(&d.kind));
    let topics = topics(&facts[0]);
    let own = found.filter(|f| {
        let publishers = topics.get(&*f.name).map(TopicIn::publishers);
        let mut senders = publishers.iter().flatten();
        let is_shown =
            shown.contains(&*f.name) || senders.any(|role| shown.contains(role.as_str()));
        let late = [FindingKind::NodeLate, FindingKind::TopicLate];
        !(is_shown || is_moved && late.contains(&f.kind))
    });
    let own = own.map(|f| {
        let kind = f.kind.word().split('-').nth(1).unwrap_or_default();
        Difference::changed(kind, &*f.name, [&*f.expected, &*f.seen])
    });
    own.collect()
}

/// The nodes, topics and edges in only one mission, and the differences between those in both.
fn elements<'a>(
    facts: &'a [Facts<'a>; 2],
    rate: impl Fn(&str, [TopicIn<'a>; 2]) -> Option<Difference>,
) -> Vec<Difference> {
    let nodes = facts.each_ref().map(|facts| {
        let roles = facts.robot_roles().map(|role| (role.name, role));
        roles.collect::<BTreeMap<&str, Role<'_>>>()
    });
    let mut all = presence("node", &nodes);
    // Whether the mission that lacks a node would name it.
    let lost = |side| all.iter().filter(|one| one.side == side).count();
    let second = facts[1].names_nodes(lost(Where::First));
    let first = facts[0].names_nodes(lost(Where::Second));
    for one in &mut all {
        let is_own = one.side == Where::First;
        one.is_known = if is_own { second } else { first };
    }
    let topics = facts.each_ref().map(topics);
    all.extend(presence("topic", &topics));
    for (name, first) in &nodes[0] {
        if let Some(second) = nodes[1].get(name) {
            node(name, [*first, *second], &mut all);
        }
    }
    let in_both = |role: &str| nodes.iter().all(|own| own.contains_key(role));
    for (name, first) in &topics[0] {
        if let Some(second) = topics[1].get(name) {
            let both = [*first, *second];
            values(name, both, &mut all);
            all.extend(rate(name, both));
            edges(name, both, in_both, &mut all);
        }
    }
    all
}

/// The topics with messages, without housekeeping.
fn topics<'a>(facts: &'a Facts<'a>) -> BTreeMap<&'a str, TopicIn<'a>> {
    let all = facts.robot_topics();
    all.map(|topic| (topic.name(), topic)).collect()
}

/// The names in only one of these.
fn presence<T>(kind: &'static str, both: &[BTreeMap<&str, T>; 2]) -> Vec<Difference> {
    let names = both.each_ref().map(|own| own.keys().copied());
    let [first, second]: [BTreeSet<&str>; 2] = names.map(Iterator::collect);
    let only = first.symmetric_difference(&second).map(|name| {
        let side = Where::only(first.contains(name));
        Difference::only(kind, *name, side, "present")
    });
    only.collect()
}

/// The differences of a node in both missions.
fn node(name: &str, both: [Role<'_>; 2], all: &mut Vec<Difference>) {
    let restarts = both.map(|own| own.facts.events(own.nodes, Kind::Restarted).len());
    if restarts[0] != restarts[1] {
        let restarts = restarts.map(|many| many.to_string());
        all.push(Difference::changed("restarts", name, restarts));
    }
    let states = both.map(|own| own.facts.lifecycle(own.nodes));
    if let [Some(first), Some(second)] = states
        && first != second
    {
        all.push(Difference::changed("lifecycle", name, [first, second]));
    }
    let ends = both.map(|own| own.facts.ended(own.nodes, CLOSING_NS));
    // An intermittent topic may be silent at the end: it only ended if the silence far exceeds the uncertainty.
    let is_over = |side: usize, end: Bound| {
        let rest = both[side].facts.mission.span.end.since(end.time);
        let doubt = end.latest.since(end.earliest);
        doubt <= CLOSING_NS || doubt.saturating_mul(DOUBTS) <= rest
    };
    // The other one may have ended, too, if it sends nothing from then on.
    let sends_on = |side: usize, end: Bound| {
        let [ended, other] = [both[1 - side], both[side]];
        let at = ended.facts.mission.offset(end.time);
        let last = other.facts.last_sent(other.nodes);
        last.is_none_or(|last| other.facts.mission.offset(last) - at > tolerance(0, at))
    };
    let has_ended = match ends {
        [Some(end), None] => is_over(0, end) && sends_on(1, end),
        [None, Some(end)] => is_over(1, end) && sends_on(0, end),
        _ => false,
    };
    if has_ended {
        let ends = [0, 1].map(|side| outcome(both[side].facts, ends[side].map(|end| end.time)));
        all.push(Difference::changed("end", name, ends));
    }
}

/// How something ends in a mission, as text.
fn outcome(facts: &Facts<'_>, end: Option<Stamp>) -> String {
    match end {
        Some(end) => format!("ends at {}", facts.clock(end)),
        None => "stays".to_owned(),
    }
}

/// The different types and quality of service of a topic in both missions.
fn values(name: &str, both: [TopicIn<'_>; 2], all: &mut Vec<Difference>) {
    let topics = both.map(|own| &own.facts.mission.elements.topics[own.id]);
    let types = topics.map(|topic| {
        let types: Vec<&str> = topic.types.iter().map(|t| &**t).collect();
        types.join(", ")
    });
    let [first, second] = types.each_ref().map(|types| types.replace("/msg/", "/"));
    if first != second {
        all.push(Difference::changed("type", name, types));
    }
    if let [Some(first), Some(second)] = topics.map(|topic| topic.qos.as_deref())
        && first != second
    {
        all.push(Difference::changed("qos", name, [first, second]));
    }
}

/// The publications and subscriptions of a topic in only one mission, by nodes in both.
fn edges(
    name: &str,
    both: [TopicIn<'_>; 2],
    in_both: impl Fn(&str) -> bool,
    all: &mut Vec<Difference>,
) {
    let kinds = [
        ("publishes", both.map(|own| own.publishers())),
        ("subscribes", both.map(|own| own.to())),
    ];
    for (kind, [first, second]) in kinds {
        let roles = first.symmetric_difference(&second);
        for role in roles.filter(|role| in_both(role)) {
            let is_first = first.contains(role);
            // Whether the edge would be observable in the mission that lacks it.
            let TopicIn { facts, id } = both[usize::from(is_first)];
            let (edge, is_known) = if kind == "publishes" {
                (format!("{role} → {name}"), facts.lists_publishers(id))
            } else {
                let roles = facts.nodes(&Pattern::new(role));
                let nodes: Vec<NodeId> =
                    roles.iter().flat_map(|role| role.nodes.to_vec()).collect();
                (format!("{name} → {role}"), facts.lists_subscribers(&nodes))
            };
            all.push(Difference {
                is_known,
                ..Difference::only(kind, edge, Where::only(is_first), "present")
            });
        }
    }
}

/// The rates of a topic that differ by more than the fraction `change`, if any: while sending, or over the recording.
fn rate(name: &str, both: [TopicIn<'_>; 2], change: f64) -> Option<Difference> {
    let sending = both.map(|own| own.facts.while_sending(own.id));
    let whole = both.map(|own| Some(own.facts.mean(own.id)?.hz()));
    let known = [(sending, "while sending"), (whole, "over the recording")].into_iter();
    let mut known = known.filter_map(|([a, b], word)| Some(([a?, b?], word)));
    let differs = |[a, b]: [f64; 2]| (a - b).abs() > change * a.min(b);
    let (rates, word) = known.find(|(rates, _)| differs(*rates))?;
    let texts = rates.map(words::rate);
    let texts = [texts[0].clone(), format!("{} {word}", texts[1])];
    Some(Difference {
        rates: Some(rates),
        ..Difference::changed("rate", name, texts)
    })
}

/// The key of an event: its kind, the name it is about, and its number among the events of both, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct EventKey {
    kind: Kind,
    name: String,
    nth: usize,
}

impl EventKey {
    fn text(&self) -> String {
        let word = self.kind.word().replace('_', " ");
        match self.nth {
            1 => format!("{} {word}", self.name),
            n => format!("{} {word} ({n})", self.name),
        }
    }
}

/// An event that two runs can have in common.
type NamedEvent<'a> = (EventKey, &'a Event);

/// A time since the start of a mission and its uncertainty, in nanoseconds.
#[derive(Clone, Copy)]
struct Moment {
    at: i64,
    doubt: i64,
}

/// All differences in events: those in only one mission, or at another time.
fn events(facts: &[Facts<'_>; 2]) -> Vec<Difference> {
    let [first, second] = &facts.each_ref().map(named_events);
    let mut all = only(&facts[0], first, second, Where::First);
    all.extend(only(&facts[1], second, first, Where::Second));
    let places: BTreeMap<&EventKey, &Event> = second.iter().map(|(key, e)| (key, *e)).collect();
    let mut shift = 0;
    for (key, one) in first {
        // One that is a headline may be a part of another event in the other run.
        let other = places.get(key).filter(|other| other.is_headline());
        let Some(other) = other.filter(|_| one.is_headline()) else {
            continue;
        };
        let both = [(&facts[0], *one), (&facts[1], *other)];
        let moments = both.map(|(facts, event)| Moment {
            at: facts.mission.offset(event.time),
            doubt: event.latest.since(event.earliest),
        });
        if is_moved(moments, &mut shift) {
            let clocks = both.map(|(facts, event)| facts.clock(event.time));
            all.push(Difference {
                element: key.name.clone(),
                ..Difference::changed("time", key.text(), clocks)
            });
        }
    }
    all
}

/// The events that two runs can have in common.
fn named_events<'a>(facts: &Facts<'a>) -> Vec<NamedEvent<'a>> {
    let mission = facts.mission;
    let mut many: BTreeMap<(Kind, &str), usize> = BTreeMap::new();
    let mut all = Vec::new();
    let events = mission.log.inside(mission.span).map(|(_, event)| event);
    for event in events.filter(|event| !event.quiet) {
        let Some(name) = about(facts, event) else {
            continue;
        };
        let nth = many.entry((event.kind, name)).or_default();
        *nth += 1;
        let key = EventKey {
            kind: event.kind,
            name: name.to_owned(),
            nth: *nth,
        };
        all.push((key, event));
    }
    all
}

/// The node or topic that an event is about; rates, and connections, are compared elsewhere.
fn about<'a>(facts: &Facts<'a>, event: &Event) -> Option<&'a str> {
    match (event.kind, event.what) {
        // The number of restarts is compared, not their times.
        (Kind::Rate | Kind::Type | Kind::Qos | Kind::Restarted, _) => None,
        (_, Element::Node(id)) => Some(facts.role(id)),
        (_, Element::Topic(id)) => Some(facts.topic(id)),
        _ => None,
    }
}

/// The events in only one mission about elements of both. Starts and stops are reported for the elements.
fn only(
    facts: &Facts<'_>,
    own: &[NamedEvent<'_>],
    other: &[NamedEvent<'_>],
    side: Where,
) -> Vec<Difference> {
    let known: BTreeSet<&EventKey> = other.iter().map(|(key, _)| key).collect();
    let wanted = [Kind::HandedOver, Kind::Silent, Kind::Lifecycle];
    let alone = own.iter().filter(|(key, event)| {
        // Silence at the very end is due to the robot's shutdown, if the other recording lasts that long.
        let is_closing = facts.mission.span.end.since(event.time) <= CLOSING_NS;
        let is_shown = event.is_headline() && wanted.contains(&key.kind) && !is_closing;
        is_shown && !known.contains(key)
    });
    let differences = alone.map(|(key, event)| {
        let clock = format!("at {}", facts.clock(event.time));
        Difference {
            element: key.name.clone(),
            ..Difference::only("event", key.text(), side, &clock)
        }
    });
    differences.collect()
}

/// Whether something is at another time in the second mission. If it has the same `shift` as the previous one,
/// everything is delayed, which was reported for the first one.
fn is_moved([first, second]: [Moment; 2], shift: &mut i64) -> bool {
    let later = second.at.saturating_sub(first.at);
    let since_before = later.saturating_sub(*shift);
    let doubt = first.doubt.saturating_add(second.doubt);
    if doubt <= APART_NS {
        *shift = later;
    }
    let apart = later.saturating_abs().min(since_before.saturating_abs());
    apart > tolerance(doubt, first.at.max(second.at))
}

/// The nanoseconds by which times of this uncertainty, this long since the start, may differ between two runs.
fn tolerance(doubt: i64, since: i64) -> i64 {
    let tolerance = APART_NS.saturating_add(doubt);
    tolerance.saturating_add(since / PACE)
}

/// A topic of both missions with enough messages, and the times of the first and the last one in each.
struct Sent<'a> {
    name: &'a str,
    facts: [&'a Facts<'a>; 2],
    received: [Span; 2],
    /// The uncertainty of both times, in nanoseconds: its longest silence.
    doubt: i64,
}

/// The topics that begin or end at another time, unless a difference of a publisher, or in an event, shows that.
fn times(facts: &[Facts<'_>; 2], known: &[Difference]) -> Vec<Difference> {
    let theirs = topics(&facts[1]);
    let mut sent: Vec<Sent<'_>> = Vec::new();
    let mut all = Vec::new();
    for (name, first) in topics(&facts[0]) {
        let second = theirs.get(name).copied();
        let Some(one) = second.and_then(|second| Sent::of(name, [first, second])) else {
            continue;
        };
        let publishers = first.facts.publishers(first.id).into_iter();
        let roles: Vec<&str> = publishers.map(|peer| first.facts.role(peer.node)).collect();
        let is_reported = |kind: &str| {
            let own = |d: &&Difference| d.element == name || roles.contains(&&*d.element);
            known.iter().filter(own).any(|d| d.kind == kind)
        };
        if !is_reported("end") {
            all.extend(one.end());
        }
        if !is_reported("time") {
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
    fn of(name: &'a str, both: [TopicIn<'a>; 2]) -> Option<Self> {
        let received = both.map(|TopicIn { facts, id }| {
            let is_enough = facts.messages[id] >= FEWEST_OF_TIMES;
            facts.received(id).filter(|_| is_enough)
        });
        let [Some(first), Some(second)] = received else {
            return None;
        };
        let silences = both.map(|own| own.facts.longest_silence(own.id));
        Some(Self {
            name,
            facts: both.map(|own| own.facts),
            received: [first, second],
            doubt: silences[0].max(silences[1]),
        })
    }

    /// The difference in the first message. One at the start of the second recording shows nothing of the time before it.
    fn begin(&self, shift: &mut i64) -> Option<Difference> {
        let starts = self.received.map(|span| span.start);
        let moments = [0, 1].map(|side| Moment {
            at: self.facts[side].mission.offset(starts[side]),
            doubt: self.doubt / 2,
        });
        if moments[1].at <= DISCOVERY_NS {
            return None;
        }
        let clocks = [0, 1].map(|side| self.facts[side].clock(starts[side]));
        is_moved(moments, shift).then(|| Difference::changed("begin", self.name, clocks))
    }

    /// The difference in the last message. One at the end of a recording shows nothing of the time after it.
    fn end(&self) -> Option<Difference> {
        let received = self.received.map(|span| span.end);
        let missions = self.facts.map(|facts| facts.mission);
        let ends = [0, 1].map(|side| {
            let rest = missions[side].span.end.since(received[side]);
            (rest > CLOSING_NS.max(self.doubt)).then_some(received[side])
        });
        let [first, second] = [0, 1].map(|side| missions[side].offset(received[side]));
        let apart = first.saturating_sub(second).saturating_abs();
        let is_moved = apart > tolerance(self.doubt, first.max(second));
        let is_earlier = ends[usize::from(second < first)].is_some();
        let texts = [0, 1].map(|side| outcome(self.facts[side], ends[side]));
        (is_moved && is_earlier).then(|| Difference::changed("end", self.name, texts))
    }
}
