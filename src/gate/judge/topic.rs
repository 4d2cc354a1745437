//! Checks of topics: presence, type, publishers, subscribers and quality of service.

use super::node::limited;
use super::{Judge, absence};
use crate::base::name::plain_type;
use crate::base::words;
use crate::evidence::Confidence;
use crate::gate::expectation::{At, Named, TopicFacts, YamlPlace};
use crate::gate::finding::{Finding, FindingKind};
use crate::gate::measure::MEASURES;
use crate::gate::pattern::Pattern;
use crate::graph::TopicId;

/// The number of names that are reported in one line.
pub(super) const NAMED: usize = 6;

impl Judge<'_> {
    /// Checks a topic of the file.
    pub(super) fn topic(&mut self, named: &Named<TopicFacts>) {
        let facts = &named.facts;
        let name = named.name.as_str();
        let before = self.checks.len();
        if facts.forbidden {
            let found = self.forbidden_topics(&named.name, named.at);
            self.note(format!("topic {name} forbidden"), named.at, found);
        } else {
            let found = self.topic_presence(&named.name, named.at, facts);
            let title = format!("topic {name}");
            self.note(&title, named.at, found);
            self.topic_facts(&title, &named.name, facts);
        }
        for finding in self.found_since(before) {
            finding.accept = Some(name.to_owned());
        }
    }

    /// Checks the facts of a topic other than its presence.
    pub(super) fn topic_facts(&mut self, title: &str, pattern: &Pattern, facts: &TopicFacts) {
        let topics = self.facts.topics(pattern);
        let all = (title, &topics[..]);
        let is_absent = topics.is_empty();
        let is_unsent = !self.is_sent(&topics);
        let is_untimed = is_unsent || self.is_part;
        let (kinds, by, to) = (facts.kinds.as_ref(), facts.by.as_ref(), facts.to.as_ref());
        self.each(all, "type", kinds, is_absent, Self::kind);
        self.each(all, "by", by, is_absent, Self::publishers);
        self.each(all, "to", to, is_absent, Self::subscribers);
        let (within, may_end) = (facts.within.as_ref(), limited(facts.may_end.as_ref()));
        self.each(all, "within", within, is_untimed, |own, topic, within| {
            own.first(topic, facts, within)
        });
        self.each(
            all,
            "may_end",
            may_end,
            is_untimed,
            |own, topic, may_end| own.last(topic, facts, may_end),
        );
        let (hz, mean_hz) = (facts.hz.as_ref(), facts.mean_hz.as_ref());
        self.each(all, "hz", hz, is_unsent, |own, topic, hz| {
            own.rate(topic, facts, hz)
        });
        self.each(all, "mean_hz", mean_hz, is_untimed, |own, topic, hz| {
            own.mean(topic, facts, hz)
        });
        let max_gap = facts.max_gap.as_ref();
        self.each(all, "max_gap", max_gap, is_unsent, |own, topic, most| {
            own.gap(topic, facts, most)
        });
        let (latched, qos) = (facts.latched.as_ref(), facts.qos.as_ref());
        self.each(all, "latched", latched, is_absent, Self::latched);
        self.each(all, "qos", qos, is_absent, Self::qos);
        for (measure, range) in MEASURES.iter().zip(&facts.measures) {
            let (key, range) = (measure.key, range.as_ref());
            self.each(all, key, range, is_unsent, |own, topic, range| {
                let found = own.measured(topic, measure, range, facts);
                found.into_iter().collect()
            });
        }
    }

    /// Checks a fact of each of these topics.
    fn each<T>(
        &mut self,
        all: (&str, &[TopicId]),
        key: &str,
        wanted: Option<&At<T>>,
        is_moot: bool,
        found: impl Fn(&Self, TopicId, &At<T>) -> Vec<Finding>,
    ) {
        self.check(all, key, wanted, is_moot, |own, topics, wanted| {
            let topics = topics.iter();
            topics
                .flat_map(|topic| found(own, *topic, wanted))
                .collect()
        });
    }

    pub(super) fn forbidden_topics(&self, pattern: &Pattern, at: YamlPlace) -> Vec<Finding> {
        let found = self.facts.topics(pattern).into_iter().map(|topic| {
            let name = self.facts.topic(topic);
            let text = format!("{name} is in the bag, and `{pattern}` is forbidden");
            let many = usize::try_from(self.facts.messages(topic)).unwrap_or(usize::MAX);
            Finding::new(FindingKind::TopicForbidden, name, at, text)
                .saw("present", "absent")
                .detail(words::count(many, "message"))
        });
        found.collect()
    }

    pub(super) fn topic_presence(
        &self,
        pattern: &Pattern,
        at: YamlPlace,
        facts: &TopicFacts,
    ) -> Vec<Finding> {
        let topics = self.facts.topics(pattern);
        let is_there = if self.is_owed(facts) {
            self.is_sent(&topics)
        } else {
            !topics.is_empty()
        };
        if facts.optional || is_there {
            return Vec::new();
        }
        let name = pattern.as_str();
        let is_named = !topics.is_empty();
        let topics = self.facts.mission.elements.topics.iter();
        let names = topics.map(|t| t.name.as_str()).filter(|n| *n != name);
        let near = self.near(pattern, names);
        let (text, seen, expected) = if is_named {
            (
                format!("{name} has no message in the bag"),
                "no message",
                "messages",
            )
        } else {
            (format!("{name} is not in the bag"), "absent", "present")
        };
        let mut finding =
            Finding::new(FindingKind::TopicMissing, name, at, text).saw(seen, expected);
        // A missing publisher is the cause.
        let by = facts.by.iter().flat_map(|by| &by.value);
        let mut lost = by.filter(|by| self.facts.nodes(&by.value).is_empty());
        finding.cause = lost.next().map(|by| absence(by.value.as_str()));
        finding.details.extend(Self::senders(facts));
        vec![match near {
            Some(near) if !is_named => finding.hint(near),
            _ => finding,
        }]
    }

    /// Whether a topic must have messages, because its facts require them and times are checked.
    pub(super) fn is_owed(&self, facts: &TopicFacts) -> bool {
        facts.wants_messages() && !facts.optional && !self.is_part
    }

    /// The publishers of a topic according to the file, as a remark.
    pub(super) fn senders(facts: &TopicFacts) -> Option<String> {
        let by: Vec<&str> = facts
            .by
            .iter()
            .flat_map(|by| &by.value)
            .map(|p| p.value.as_str())
            .collect();
        (!by.is_empty()).then(|| format!("published by {}", words::some_of(&by, NAMED)))
    }

    /// Whether any of these topics has a message.
    pub(super) fn is_sent(&self, topics: &[TopicId]) -> bool {
        topics.iter().any(|topic| self.facts.messages(*topic) > 0)
    }

    fn kind(&self, topic: TopicId, kinds: &At<Vec<At<Pattern>>>) -> Vec<Finding> {
        let types = &self.facts.mission.elements.topics[topic].types;
        let expected: Vec<&str> = kinds.value.iter().map(|k| k.value.as_str()).collect();
        let is_other = |t: &&str| {
            expected
                .iter()
                .all(|kind| plain_type(kind) != plain_type(t))
        };
        let other: Vec<&str> = types.iter().map(|t| &**t).filter(is_other).collect();
        let name = self.facts.topic(topic);
        let expected = words::some_of(&expected, NAMED);
        if types.is_empty() {
            let text = format!("cannot tell whether {name} is a {expected}: its type is unknown");
            return vec![Finding::new(FindingKind::TopicType, name, kinds.at, text).unknown()];
        }
        if other.is_empty() {
            return Vec::new();
        }
        let seen = words::some_of(&other, NAMED);
        let text = format!("{name} is a {seen}, expected {expected}");
        vec![Finding::new(FindingKind::TopicType, name, kinds.at, text).saw(seen, expected)]
    }

    fn publishers(&self, topic: TopicId, by: &At<Vec<At<Pattern>>>) -> Vec<Finding> {
        let name = self.facts.topic(topic);
        let known = self.facts.publishers(topic);
        let expected: Vec<&str> = by.value.iter().map(|p| p.value.as_str()).collect();
        let expected = words::some_of(&expected, NAMED);
        let mut found = Vec::new();
        for wanted in &by.value {
            if known
                .iter()
                .any(|(node, ..)| self.facts.fits(&wanted.value, *node))
            {
                continue;
            }
            found.push(self.no_publisher(topic, wanted));
        }
        let Some(severity) = self.expectation.policy.publishers.severity() else {
            return found;
        };
        for (node, edge, confidence) in known
            .iter()
            .filter(|(.., confidence)| *confidence <= Confidence::Stated)
        {
            let fits = by.value.iter().any(|p| self.facts.fits(&p.value, *node));
            if fits || self.facts.is_tool(&[*node]) {
                continue;
            }
            let role = self.facts.role(*node);
            let text = format!("{name} is also published by {role}, expected only {expected}");
            let mut finding = Finding::new(FindingKind::PublisherUnexpected, name, by.at, text)
                .saw(role, &expected);
            finding.severity = severity;
            if let Some((span, count)) = self.facts.sent(*node, *edge) {
                let many = match usize::try_from(count).unwrap_or(usize::MAX) {
                    0 => String::new(),
                    n => format!(", {}", words::count(n, "message")),
                };
                let stretch = self.facts.stretch(span);
                let detail = format!("{stretch}{many}; {}", confidence.word());
                finding = finding.at(span).detail(detail);
            }
            found.push(finding);
        }
        found
    }

    fn no_publisher(&self, topic: TopicId, wanted: &At<Pattern>) -> Finding {
        let name = self.facts.topic(topic);
        let who = wanted.value.as_str();
        let kind = FindingKind::PublisherMissing;
        if !self.facts.lists_publishers(topic) {
            let text =
                format!("cannot tell whether {who} publishes {name}: its publishers are unknown");
            let hint = "record /rosgraph, or add `--topology FILE`; see `bagreel info`";
            return Finding::new(kind, name, wanted.at, text)
                .unknown()
                .hint(hint);
        }
        let known = self.facts.publishers(topic);
        let roles: Vec<&str> = known
            .iter()
            .map(|(node, ..)| self.facts.role(*node))
            .collect();
        let seen = if roles.is_empty() {
            "nobody".to_owned()
        } else {
            words::some_of(&roles, NAMED)
        };
        let text = format!("{who} does not publish {name}, which is published by {seen}");
        let mut finding = Finding::new(kind, name, wanted.at, text).saw(seen, who);
        if self.facts.nodes(&wanted.value).is_empty() {
            finding.cause = Some(absence(who));
        }
        finding
    }

    fn subscribers(&self, topic: TopicId, to: &At<Vec<At<Pattern>>>) -> Vec<Finding> {
        let wanted = to.value.iter();
        wanted
            .filter_map(|wanted| self.subscriber(topic, wanted))
            .collect()
    }

    fn subscriber(&self, topic: TopicId, wanted: &At<Pattern>) -> Option<Finding> {
        let name = self.facts.topic(topic);
        let who = wanted.value.as_str();
        let known = self.facts.subscribers(topic);
        if known
            .iter()
            .any(|(node, ..)| self.facts.fits(&wanted.value, *node))
        {
            return None;
        }
        let kind = FindingKind::SubscriberMissing;
        let roles = self.facts.nodes(&wanted.value);
        let nodes: Vec<_> = roles
            .iter()
            .flat_map(|(_, nodes)| *nodes)
            .copied()
            .collect();
        // An absent node has no subscriptions.
        let is_absent = roles.is_empty() && self.names_nodes;
        if !is_absent && !self.facts.lists_subscribers(&nodes) {
            let text = format!(
                "cannot tell whether {who} subscribes to {name}: this bag has no evidence of subscribers"
            );
            let hint = "record /rosgraph, or enable statistics; see `bagreel info`";
            return Some(
                Finding::new(kind, name, wanted.at, text)
                    .unknown()
                    .hint(hint),
            );
        }
        let text = format!("{who} does not subscribe to {name}");
        let mut finding = Finding::new(kind, name, wanted.at, text).saw("nothing", who);
        if is_absent {
            finding.cause = Some(absence(who));
        }
        Some(finding)
    }

    fn latched(&self, topic: TopicId, wanted: &At<bool>) -> Vec<Finding> {
        let at = wanted.at;
        let name = self.facts.topic(topic);
        let word = |is: bool| if is { "latched" } else { "not latched" };
        let expected = word(wanted.value);
        match self.facts.is_latched(topic) {
            Some(seen) if seen == wanted.value => Vec::new(),
            Some(seen) => {
                let text = format!("{name} is {}, expected {expected}", word(seen));
                vec![Finding::new(FindingKind::TopicQos, name, at, text).saw(word(seen), expected)]
            }
            None => {
                let text = format!("cannot tell whether {name} is {expected}: unknown in this bag");
                vec![Finding::new(FindingKind::TopicQos, name, at, text).unknown()]
            }
        }
    }

    fn qos(&self, topic: TopicId, wanted: &At<String>) -> Vec<Finding> {
        let at = wanted.at;
        let name = self.facts.topic(topic);
        let expected = &wanted.value;
        let Some(seen) = &self.facts.mission.elements.topics[topic].qos else {
            let text = format!(
                "cannot tell whether {name} is {expected}: this bag has no quality of service"
            );
            return vec![Finding::new(FindingKind::TopicQos, name, at, text).unknown()];
        };
        let has = |word: &str| seen.split_whitespace().any(|own| own == word);
        if expected.split_whitespace().all(has) {
            return Vec::new();
        }
        let text = format!("{name} is {seen}, expected {expected}");
        vec![Finding::new(FindingKind::TopicQos, name, at, text).saw(seen, expected)]
    }
}
