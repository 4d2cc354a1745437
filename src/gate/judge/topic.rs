//! Checks of topics: presence, type, publishers, subscribers, quality of service; rates, gaps and measures in every whole window.

use std::collections::BTreeSet;

use super::{Judge, NAMED, Subjects, absence};
use crate::base::name::plain_type;
use crate::base::rhythm::{CLOSING_NS, DISCOVERY_NS};
use crate::base::time::Span;
use crate::base::words;
use crate::gate::expectation::{At, Entry, Length, MayEnd, Names, Within, YamlPlace};
use crate::gate::facts::{ENDS, Peer, Rate, Role, TopicGap};
use crate::gate::finding::{Finding, FindingKind};
use crate::gate::values::{Measure, Pattern, Range};
use crate::graph::{NodeId, TopicId};
use crate::mission::Window;
use crate::mission::event_log::Kind;

/// The names of a list, in short.
fn listed(names: &Names) -> String {
    words::some_of(names.0.iter().map(|name| name.value.as_str()), NAMED)
}

impl Judge<'_> {
    /// Checks the facts of a topic other than its presence.
    pub(super) fn topic_facts(&mut self, title: &str, pattern: &Pattern, entry: &Entry) {
        let topics = self.facts.topics(pattern);
        let is_absent = topics.is_empty();
        let is_unsent = !self.is_sent(&topics);
        let is_untimed = is_unsent || self.is_part;
        let all = &Subjects {
            title,
            all: &topics,
            entry,
        };
        self.check(all, "type", &entry.kinds, is_absent, Self::kind);
        self.check(all, "by", &entry.by, is_absent, Self::by);
        self.check(all, "to", &entry.to, is_absent, Self::to);
        self.check(all, "within", &entry.within, is_untimed, Self::first);
        self.check(all, "may_end", &entry.limit(), is_untimed, Self::last);
        self.check(all, "hz", &entry.hz, is_unsent, Self::rate);
        self.check(all, "mean_hz", &entry.mean_hz, is_untimed, Self::mean);
        self.check(all, "max_gap", &entry.max_gap, is_unsent, Self::gap);
        self.check(all, "latched", &entry.latched, is_absent, Self::latched);
        self.check(all, "qos", &entry.qos, is_absent, Self::qos);
        for (measure, range) in entry.measures() {
            let found = |own: &Self, topic, entry: &Entry, range: &At<Range>| {
                own.measured(topic, entry, range, measure)
            };
            self.check(all, measure.key, &range, is_unsent, found);
        }
    }

    pub(super) fn forbidden_topics(&self, pattern: &Pattern, at: YamlPlace) -> Vec<Finding> {
        let found = self.facts.topics(pattern).into_iter().map(|topic| {
            let name = self.facts.topic(topic);
            let text = format!("{name} is in the bag, and `{pattern}` is forbidden");
            Finding::new(FindingKind::TopicForbidden, name, at, text)
                .saw("present", "absent")
                .details([words::count(self.facts.messages[topic], "message")])
        });
        found.collect()
    }

    pub(super) fn topic_presence(
        &self,
        pattern: &Pattern,
        at: YamlPlace,
        entry: &Entry,
    ) -> Vec<Finding> {
        let topics = self.facts.topics(pattern);
        let is_named = !topics.is_empty();
        let is_there = is_named && !self.is_owed(entry) || self.is_sent(&topics);
        if entry.optional || is_there {
            return Vec::new();
        }
        let name = pattern.as_str();
        let (what, seen, expected) = if is_named {
            ("has no message in the bag", "no message", "messages")
        } else {
            ("is not in the bag", "absent", "present")
        };
        let kind = FindingKind::TopicMissing;
        // A missing publisher is the cause.
        let is_lost = |by: &&Pattern| self.facts.nodes(by).is_empty();
        let cause = entry.publishers().find(is_lost);
        let topics = self.facts.mission.elements.topics.iter();
        let names = topics.map(|t| t.name.as_str()).filter(|n| *n != name);
        let near = self.near(pattern, names).filter(|_| !is_named);
        let finding = Finding::new(kind, name, at, format!("{name} {what}"))
            .saw(seen, expected)
            .because(cause.map(|by| absence(by.as_str())))
            .details(Self::senders(entry))
            .hints(near);
        vec![finding]
    }

    /// Whether a topic must have messages, because its facts require them and times are checked.
    pub(super) fn is_owed(&self, entry: &Entry) -> bool {
        entry.wants_messages() && !entry.optional && !self.is_part
    }

    /// The publishers of a topic according to the file, as a remark.
    fn senders(entry: &Entry) -> Option<String> {
        let by = entry.by.as_ref().map(|by| listed(&by.value));
        let by = by.filter(|by| !by.is_empty())?;
        Some(format!("published by {by}"))
    }

    /// Whether any of these topics has a message.
    pub(super) fn is_sent(&self, topics: &[TopicId]) -> bool {
        topics.iter().any(|topic| self.facts.messages[*topic] > 0)
    }

    fn kind(&self, topic: TopicId, _: &Entry, kinds: &At<Names>) -> Option<Finding> {
        let (kind, name, at) = (FindingKind::TopicType, self.facts.topic(topic), kinds.at);
        let types = &self.facts.mission.elements.topics[topic].types;
        let expected = listed(&kinds.value);
        if types.is_empty() {
            let text = format!("cannot tell whether {name} is a {expected}: its type is unknown");
            return Some(Finding::unknown(kind, name, at, text));
        }
        let is_other = |own: &&str| {
            let mut kinds = kinds.value.0.iter();
            kinds.all(|kind| plain_type(kind.value.as_str()) != plain_type(own))
        };
        let other: Vec<&str> = types.iter().map(|t| &**t).filter(is_other).collect();
        let seen = words::some_of(&other, NAMED);
        let text = format!("{name} is a {seen}, expected {expected}");
        (!other.is_empty()).then(|| Finding::new(kind, name, at, text).saw(seen, expected))
    }

    /// The findings on whether the publishers of a topic are these and no others.
    fn by(&self, topic: TopicId, _: &Entry, by: &At<Names>) -> Vec<Finding> {
        let known = self.facts.publishers(topic);
        let names = || by.value.0.iter();
        let fits = |name: &Pattern, peer: &Peer| self.facts.fits(name, peer.node);
        let lost = names().filter(|name| !known.iter().any(|peer| fits(&name.value, peer)));
        let found = lost.map(|name| self.no_publisher(topic, &known, name));
        let mut found: Vec<Finding> = found.collect();
        let policy = self.expectation.policy.value;
        let Some(severity) = policy.unexpected_publishers.severity() else {
            return found;
        };
        let expected = listed(&by.value);
        let strange = known.iter().filter(|peer| {
            let is_listed = names().any(|name| fits(&name.value, peer));
            peer.is_sure() && !is_listed && !self.facts.is_tool(&[peer.node])
        });
        found.extend(strange.map(|peer| {
            let (name, role) = (self.facts.topic(topic), self.facts.role(peer.node));
            let text = format!("{name} is also published by {role}, expected only {expected}");
            let finding = Finding::new(FindingKind::PublisherUnexpected, name, by.at, text)
                .saw(role, &expected)
                .severe(severity);
            let Some((span, count)) = self.facts.sent(peer.node, peer.edge) else {
                return finding;
            };
            let many = match count {
                0 => String::new(),
                n => format!(", {}", words::count(n, "message")),
            };
            let stretch = self.facts.stretch(span);
            let word = peer.confidence.word();
            let detail = format!("{stretch}{many}; {word}");
            finding.at(span).details([detail])
        }));
        found
    }

    fn no_publisher(&self, topic: TopicId, known: &[Peer], wanted: &At<Pattern>) -> Finding {
        let name = self.facts.topic(topic);
        let who = wanted.value.as_str();
        let kind = FindingKind::PublisherMissing;
        if !self.facts.lists_publishers(topic) {
            let text =
                format!("cannot tell whether {who} publishes {name}: its publishers are unknown");
            let hint = "record /rosgraph, or add `--topology FILE`; see `bagreel info`";
            return Finding::unknown(kind, name, wanted.at, text).hints([hint]);
        }
        let roles = known.iter().map(|peer| self.facts.role(peer.node));
        let seen = match words::some_of(roles, NAMED) {
            nobody if nobody.is_empty() => "nobody".to_owned(),
            some => some,
        };
        let text = format!("{who} does not publish {name}, which is published by {seen}");
        let is_absent = self.facts.nodes(&wanted.value).is_empty();
        let finding = Finding::new(kind, name, wanted.at, text).saw(seen, who);
        finding.because(is_absent.then(|| absence(who)))
    }

    /// The findings on whether these nodes subscribe to a topic.
    fn to(&self, topic: TopicId, _: &Entry, to: &At<Names>) -> Vec<Finding> {
        let known = self.facts.subscribers(topic);
        let is_known = |name: &Pattern| known.iter().any(|peer| self.facts.fits(name, peer.node));
        let lost = to.value.0.iter().filter(|name| !is_known(&name.value));
        lost.map(|name| self.no_subscriber(topic, name)).collect()
    }

    fn no_subscriber(&self, topic: TopicId, wanted: &At<Pattern>) -> Finding {
        let name = self.facts.topic(topic);
        let who = wanted.value.as_str();
        let kind = FindingKind::SubscriberMissing;
        let roles = self.facts.nodes(&wanted.value);
        let nodes = |role: &Role<'_>| role.nodes.to_vec();
        let nodes: Vec<NodeId> = roles.iter().flat_map(nodes).collect();
        // An absent node has no subscriptions.
        let is_absent = roles.is_empty() && self.names_nodes;
        if !is_absent && !self.facts.lists_subscribers(&nodes) {
            let text = format!(
                "cannot tell whether {who} subscribes to {name}: this bag has no evidence of subscribers"
            );
            let hint = "record /rosgraph, or enable statistics; see `bagreel info`";
            return Finding::unknown(kind, name, wanted.at, text).hints([hint]);
        }
        let text = format!("{who} does not subscribe to {name}");
        let finding = Finding::new(kind, name, wanted.at, text).saw("nothing", who);
        finding.because(is_absent.then(|| absence(who)))
    }

    fn latched(&self, topic: TopicId, _: &Entry, wanted: &At<bool>) -> Option<Finding> {
        let (kind, name) = (FindingKind::TopicQos, self.facts.topic(topic));
        let word = |is: bool| if is { "latched" } else { "not latched" };
        let expected = word(wanted.value);
        let Some(seen) = self.facts.is_latched(topic) else {
            let text = format!("cannot tell whether {name} is {expected}: unknown in this bag");
            return Some(Finding::unknown(kind, name, wanted.at, text));
        };
        let text = format!("{name} is {}, expected {expected}", word(seen));
        let finding = Finding::new(kind, name, wanted.at, text).saw(word(seen), expected);
        (seen != wanted.value).then_some(finding)
    }

    fn qos(&self, topic: TopicId, _: &Entry, wanted: &At<String>) -> Option<Finding> {
        let (kind, name) = (FindingKind::TopicQos, self.facts.topic(topic));
        let expected = &wanted.value;
        let Some(seen) = &self.facts.mission.elements.topics[topic].qos else {
            let text = format!(
                "cannot tell whether {name} is {expected}: this bag has no quality of service"
            );
            return Some(Finding::unknown(kind, name, wanted.at, text));
        };
        let has = |word: &str| seen.split_whitespace().any(|own| own == word);
        let text = format!("{name} is {seen}, expected {expected}");
        let finding = Finding::new(kind, name, wanted.at, text).saw(seen, expected);
        (!expected.split_whitespace().all(has)).then_some(finding)
    }

    /// The findings on whether a topic's rate is in its range in the required share of windows.
    fn rate(&self, topic: TopicId, entry: &Entry, hz: &At<Range>) -> Vec<Finding> {
        let rates = self.judged(topic, entry);
        if rates.is_empty() {
            return vec![self.no_window(topic, hz.at)];
        }
        let are = |is_off: &dyn Fn(&Rate) -> bool| -> Vec<Rate> {
            rates.iter().filter(|rate| is_off(rate)).copied().collect()
        };
        let low = are(&|rate| hz.value.is_above(rate.at_most()));
        let high = are(&|rate| hz.value.is_below(rate.at_least()));
        if entry.tolerates(low.len() + high.len(), rates.len()) {
            return Vec::new();
        }
        let lines = [
            (FindingKind::TopicRateLow, low),
            (FindingKind::TopicRateHigh, high),
        ];
        let judged = words::count(rates.len(), "window");
        let found = lines.into_iter();
        let found = found.filter_map(|(kind, bad)| self.off(topic, kind, &bad, &judged, hz));
        found.collect()
    }

    /// The finding for the `bad` windows, of those `judged`, in which a rate was out of range.
    fn off(
        &self,
        topic: TopicId,
        kind: FindingKind,
        bad: &[Rate],
        judged: &str,
        hz: &At<Range>,
    ) -> Option<Finding> {
        let At { at, value: range } = *hz;
        let (first, last) = (bad.first()?, bad.last()?);
        let name = self.facts.topic(topic);
        let span = Span::new(first.span.start, last.span.end);
        let seen = words::rate(Rate::mean_hz(bad));
        let by = |a: &&Rate, b: &&Rate| a.hz().total_cmp(&b.hz());
        let (word, worst) = if kind == FindingKind::TopicRateLow {
            ("lowest", bad.iter().min_by(by)?)
        } else {
            ("highest", bad.iter().max_by(by)?)
        };
        let text = format!("{name} at {seen}, expected {range}");
        let detail = format!(
            "{} ({} of {judged}), {word} {} at {}, {}",
            self.facts.stretch(span),
            bad.len(),
            words::rate(worst.hz()),
            self.facts.clock(worst.span.start),
            words::count(Rate::count(bad), "message"),
        );
        let before = first.span.start.plus(-first.span.nanos() / 2);
        let around = Span::new(before, first.span.end);
        let finding = Finding::new(kind, name, at, text)
            .saw(seen, words::rate_range(range.from, range.to))
            .at(span)
            .details([detail])
            .because(self.facts.cause_for_topic(topic, ENDS, around));
        Some(finding)
    }

    /// The finding on whether a topic's rate from its first to its last message is in its range.
    fn mean(&self, topic: TopicId, entry: &Entry, hz: &At<Range>) -> Option<Finding> {
        let At { at, value: range } = *hz;
        let in_windows = entry.hz.as_ref().map(|hz| self.rate(topic, entry, hz));
        if in_windows.is_some_and(|found| !found.is_empty()) {
            return None;
        }
        let rates = if entry.during.is_none() {
            self.facts.mean(topic).into_iter().collect()
        } else {
            self.judged(topic, entry)
        };
        let (Some(first), Some(last)) = (rates.first(), rates.last()) else {
            return Some(self.no_window(topic, at));
        };
        let mean = Rate::mean_hz(&rates);
        if range.holds(mean) {
            return None;
        }
        let kind = if range.is_above(mean) {
            FindingKind::TopicRateLow
        } else {
            FindingKind::TopicRateHigh
        };
        let name = self.facts.topic(topic);
        let hz = words::rate(mean);
        let span = Span::new(first.span.start, last.span.end);
        let text = format!("{name} at {hz} over the recording, expected {range}");
        let finding = Finding::new(kind, name, at, text)
            .saw(&hz, words::rate_range(range.from, range.to))
            .at(span)
            .details([self.facts.stretch(span)]);
        Some(finding)
    }

    /// The finding that a rate is undecidable, because no window is checked.
    fn no_window(&self, topic: TopicId, at: YamlPlace) -> Finding {
        let name = self.facts.topic(topic);
        let text = format!("cannot tell the rate of {name}: it has no whole window to check");
        let finding = Finding::unknown(FindingKind::TopicRateLow, name, at, text);
        finding.hints(["use a shorter period in the expectations file: `period: 5s`"])
    }

    /// The windows in which a topic is checked.
    fn judged(&self, topic: TopicId, entry: &Entry) -> Vec<Rate> {
        let during = self.during(entry);
        self.facts.rates(topic, entry.may_end.is_some(), during)
    }

    /// The time in which a topic is checked.
    fn during(&self, entry: &Entry) -> Span {
        let whole = self.facts.mission.span;
        let during = entry.during.as_ref();
        during.map_or(whole, |during| during.value.on(whole))
    }

    /// The finding on whether a topic's first message was in time.
    fn first(&self, topic: TopicId, entry: &Entry, within: &At<Within>) -> Option<Finding> {
        let whole = self.facts.mission.span;
        let active = self.facts.received(topic)?;
        let allowed = within.value.0.on(whole);
        // A topic present when the recorder starts has an unknown start time.
        let is_early =
            active.start < allowed.start && active.start.since(whole.start) > DISCOVERY_NS;
        if active.start <= allowed.end && !is_early {
            return None;
        }
        let name = self.facts.topic(topic);
        let clock = self.facts.clock(active.start);
        let expected = format!("within {}", self.facts.stretch(allowed));
        let text = format!("{name} began at {clock}, expected {expected}");
        let finding = Finding::new(FindingKind::TopicLate, name, within.at, text)
            .saw(format!("at {clock}"), expected)
            .at(Span::new(whole.start, active.start))
            .details(Self::senders(entry));
        // A publisher that started when the topic was due, or a moment before its first message.
        let due = allowed.end.min(active.start.plus(-CLOSING_NS));
        let around = Span::new(due, active.start.plus(1));
        let cause = self.facts.cause_for_topic(topic, &[Kind::Started], around);
        Some(finding.because(cause))
    }

    /// The finding on whether a topic ended in the time in which it may.
    fn last(&self, topic: TopicId, entry: &Entry, may_end: &At<MayEnd>) -> Option<Finding> {
        let whole = self.facts.mission.span;
        let end = self.facts.received(topic)?.end;
        let allowed = may_end.value.0.on(whole);
        let is_over = whole.end.since(end) <= CLOSING_NS;
        if is_over || allowed.start <= end && end <= allowed.end {
            return None;
        }
        let name = self.facts.topic(topic);
        let clock = self.facts.clock(end);
        let expected = format!("to end within {}", self.facts.stretch(allowed));
        let text = format!("{name} ended at {clock}, expected {expected}");
        let around = Span::new(end.plus(-CLOSING_NS), end.plus(CLOSING_NS));
        let finding = Finding::new(FindingKind::TopicGone, name, may_end.at, text)
            .saw(format!("ended at {clock}"), expected)
            .at(Span::new(end, whole.end))
            .details(Self::senders(entry))
            .because(self.facts.cause_for_topic(topic, ENDS, around));
        Some(finding)
    }

    /// The finding on whether a topic was never silent for too long.
    fn gap(&self, topic: TopicId, entry: &Entry, most: &At<Length>) -> Option<Finding> {
        let during = self.during(entry);
        let silences = self.facts.silences(topic, entry.may_end.is_some(), during);
        let longest = silences.into_iter().max_by_key(|silence| silence.nanos)?;
        let TopicGap { span, nanos } = longest;
        let At { at, value: most } = *most;
        if nanos <= most.0 {
            return None;
        }
        let name = self.facts.topic(topic);
        let (seen, expected) = (words::duration(nanos), words::duration(most.0));
        let text = format!("{name} was silent for {seen}, expected at most {expected}");
        let finding = Finding::new(FindingKind::TopicGap, name, at, text)
            .saw(seen, format!("at most {expected}"))
            .at(span)
            .details([format!("within {}", self.facts.stretch(span))])
            .because(self.facts.cause_for_topic(topic, ENDS, span));
        Some(finding)
    }

    /// The finding on whether a measure of a topic is in its range in the required share of windows.
    fn measured(
        &self,
        topic: TopicId,
        entry: &Entry,
        range: &At<Range>,
        measure: &Measure,
    ) -> Option<Finding> {
        let At { at, value: range } = *range;
        let (key, name) = (measure.key, self.facts.topic(topic));
        let judged = self.judged(topic, entry);
        let judged: BTreeSet<usize> = judged.iter().map(|rate| rate.window).collect();
        let rows = self.facts.rows(topic);
        let rows = rows.filter(|(window, _)| judged.contains(&window.index));
        let known = rows.filter_map(|(window, row)| {
            let Window { span, .. } = *window;
            Some((span, (measure.of)(&row, span)?))
        });
        let known: Vec<(Span, f64)> = known.collect();
        if known.is_empty() {
            let text = format!("cannot tell the {key} of {name}: this bag does not record it");
            let hint = "enable topic statistics, or record `/statistics`";
            return Some(Finding::unknown(measure.kind, name, at, text).hints([hint]));
        }
        let bad: Vec<&(Span, f64)> = known.iter().filter(|(_, v)| !range.holds(*v)).collect();
        if entry.tolerates(bad.len(), known.len()) {
            return None;
        }
        let (from, to) = (range.from.unwrap_or(0.0), range.to.unwrap_or(f64::INFINITY));
        let off = |value: f64| (value - to).max(from - value);
        let worst = bad.iter().max_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
        let span = Span::new(bad.first()?.0.start, bad.last()?.0.end);
        let (seen, expected) = ((measure.shown)(worst.1), range.shown(measure.shown));
        let text = format!("{name} has {key} {seen}, expected {expected}");
        let detail = format!(
            "{} ({} of {}), worst at {}",
            self.facts.stretch(span),
            bad.len(),
            words::count(known.len(), "window"),
            self.facts.clock(worst.0.start),
        );
        let around = Span::new(span.start, span.start);
        let finding = Finding::new(measure.kind, name, at, text)
            .saw(seen, expected)
            .at(span)
            .details([detail])
            .because(self.facts.cause_for_topic(topic, ENDS, around));
        Some(finding)
    }
}
