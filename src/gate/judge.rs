//! Checks a mission against an expectation: every fact and rule of the file separately, then what is not in the file.

mod node;
mod topic;

use std::cell::Cell;

use super::expectation::{
    At, Demand, Entry, Expectation, Fact, Named, Rule, Unlisted, Within, YamlPlace,
};
use super::facts::Facts;
use super::finding::{Cause, Finding, FindingKind, Severity, number};
use super::values::{During, NamePatterns, Pattern, Range};
use crate::base::nearest::nearest;
use crate::base::time::Span;
use crate::base::words::{self, visible, worded};
use crate::mission::Mission;
use crate::mission::event_log::Kind;
use crate::mission::event_log::sentence;

/// One checked fact of an expectations file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CheckedFact {
    /// Its title: `/scan hz`, or a rule's `id`.
    pub title: String,
    /// Its position in the file.
    pub place: YamlPlace,
    /// The findings; none if it is met.
    pub findings: Vec<Finding>,
    /// Whether there was nothing to check, because its node or topic is absent.
    pub is_moot: bool,
}

worded! {
    /// The judgement of a fact.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Judgement {
        /// The mission meets it.
        Kept = "kept",
        /// It has an error or a warning.
        Broken = "broken",
        /// The bag does not show whether it is met.
        Undecidable = "undecidable",
        /// There is nothing to check.
        Moot = "moot",
    }
}

impl CheckedFact {
    /// The judgement that follows from its findings.
    pub fn judgement(&self) -> Judgement {
        let any = |severity| self.findings.iter().any(|f| f.severity == severity);
        if any(Severity::Error) || any(Severity::Warning) {
            Judgement::Broken
        } else if any(Severity::Unknown) {
            Judgement::Undecidable
        } else if self.is_moot {
            Judgement::Moot
        } else {
            Judgement::Kept
        }
    }
}

/// The result of a check: all facts of the file.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Verdict {
    /// All checked facts, in file order.
    pub checks: Vec<CheckedFact>,
}

impl Verdict {
    /// All findings, the worst first, then in file order.
    pub fn findings(&self) -> Vec<&Finding> {
        let mut all: Vec<&Finding> = self.checks.iter().flat_map(|c| &c.findings).collect();
        all.sort_by_key(|f| f.severity);
        all
    }

    /// The number of findings of this severity.
    pub fn count(&self, severity: Severity) -> usize {
        let all = self.checks.iter().flat_map(|c| &c.findings);
        all.filter(|f| f.severity == severity).count()
    }

    /// The number of facts with this judgement.
    pub fn facts(&self, judgement: Judgement) -> usize {
        let all = self.checks.iter();
        all.filter(|c| c.judgement() == judgement).count()
    }

    /// Turns undecidable findings into errors.
    pub(crate) fn decide(&mut self) {
        let all = self.checks.iter_mut().flat_map(|c| &mut c.findings);
        for finding in all.filter(|f| f.severity == Severity::Unknown) {
            finding.severity = Severity::Error;
        }
    }

    /// Whether nothing at all could be decided.
    pub fn is_blind(&self) -> bool {
        self.facts(Judgement::Undecidable) > 0
            && self.facts(Judgement::Kept) + self.facts(Judgement::Broken) == 0
    }
}

/// Checks a mission. Times since its start are not checked if it `is_part` of a recording.
pub(crate) fn judge(expectation: &Expectation, mission: &Mission, is_part: bool) -> Verdict {
    let facts = Facts::new(mission);
    let mut judge = Judge {
        names_nodes: facts.names_nodes(lost(expectation, &facts)),
        facts: &facts,
        expectation,
        is_part,
        checks: Vec::new(),
        searched: Cell::new(0),
    };
    for named in &expectation.nodes {
        judge.named(named, true);
    }
    for named in &expectation.topics {
        judge.named(named, false);
    }
    for rule in &expectation.rules {
        judge.rule(rule);
    }
    judge.policy();
    let mut checks = judge.checks;
    number(checks.iter_mut().flat_map(|check| &mut check.findings));
    Verdict { checks }
}

/// The number of expected nodes that the bag does not name.
fn lost(expectation: &Expectation, facts: &Facts<'_>) -> usize {
    let wanted = expectation.nodes.iter();
    let wanted = wanted.filter(|named| !named.facts.forbidden && !named.facts.optional);
    let lost = wanted.filter(|named| facts.nodes(&named.name).is_empty());
    lost.count()
}

/// The check in progress.
struct Judge<'a> {
    facts: &'a Facts<'a>,
    /// Whether a node that the bag does not name is absent.
    names_nodes: bool,
    expectation: &'a Expectation,
    is_part: bool,
    checks: Vec<CheckedFact>,
    /// The number of names for which a similar one was searched.
    searched: Cell<usize>,
}

/// The number of events that are written out.
const MOST_LISTED: usize = 6;
/// The number of names that are reported in one line.
const NAMED: usize = 6;

/// The most missing names for which the nearest one is reported; with more, the file is for another robot.
const NEAR: usize = 50;

impl Judge<'_> {
    /// The hint for a missing name: the nearest one.
    fn near<'k>(&self, pattern: &Pattern, known: impl Iterator<Item = &'k str>) -> Option<String> {
        self.searched.set(self.searched.get() + 1);
        let near = (self.searched.get() <= NEAR).then(|| nearest(pattern.as_str(), known));
        Some(format!("the nearest name in the bag is `{}`", near??))
    }

    /// Checks a node of the file, or a topic.
    fn named(&mut self, named: &Named, is_node: bool) {
        let (name, at, entry) = (&named.name, named.at, &named.facts);
        let title = format!("{} {name}", if is_node { "node" } else { "topic" });
        let before = self.checks.len();
        let found = match (is_node, entry.forbidden) {
            (true, true) => self.forbidden_nodes(name, at),
            (true, false) => self.node_presence(name, at, entry),
            (false, true) => self.forbidden_topics(name, at),
            (false, false) => self.topic_presence(name, at, entry),
        };
        if entry.forbidden {
            self.note(title + " forbidden", at, found);
        } else {
            self.note(&title, at, found);
            if is_node {
                self.node_facts(&title, name, entry);
            } else {
                self.topic_facts(&title, name, entry);
            }
        }
        self.complete(before, entry, |finding| {
            finding.accept = Some(name.to_string());
        });
    }

    /// Completes the findings of all checks but the first ones, which are about these facts.
    fn complete(&mut self, before: usize, entry: &Entry, add: impl Fn(&mut Finding)) {
        let checks = self.checks[before..].iter_mut();
        for finding in checks.flat_map(|check| &mut check.findings) {
            add(finding);
            finding.is_open = is_open(finding, entry, self.facts.mission, self.is_part);
        }
    }

    /// Adds the findings of one fact.
    fn note(&mut self, title: impl Into<String>, place: YamlPlace, findings: Vec<Finding>) {
        self.checks.push(CheckedFact {
            title: title.into(),
            place,
            findings,
            is_moot: false,
        });
    }

    /// Checks a fact of each of these nodes or topics, if the file has it; with nothing to check it is moot.
    fn check<S: Copy, T, F: IntoIterator<Item = Finding>>(
        &mut self,
        subjects: &Subjects<'_, S>,
        key: &str,
        wanted: &Fact<T>,
        is_moot: bool,
        found: impl Fn(&Self, S, &Entry, &At<T>) -> F,
    ) {
        let Some(wanted) = &**wanted else { return };
        let all = subjects.all.iter().filter(|_| !is_moot);
        let findings = all.flat_map(|subject| found(self, *subject, subjects.entry, wanted));
        let check = CheckedFact {
            title: format!("{} {key}", subjects.title),
            place: wanted.at,
            findings: findings.collect(),
            is_moot,
        };
        self.checks.push(check);
    }

    /// Checks a rule.
    fn rule(&mut self, rule: &Rule) {
        let (before, nothing) = (self.checks.len(), Entry::default());
        let entry = match &rule.demand {
            Demand::Nodes(names, entry) => {
                for name in names {
                    self.node_rule(rule, name, entry);
                }
                entry
            }
            Demand::Topic(name, entry) => {
                self.topic_rule(rule, name, entry);
                entry
            }
            Demand::Changes { during, many } => {
                let found = self.changes(rule.at, *during, *many);
                self.note(&rule.id, rule.at, found.into_iter().collect());
                &nothing
            }
        };
        let detail = format!("rule {}", visible(&rule.id));
        self.complete(before, entry, |finding| {
            finding.details.push(detail.clone());
        });
    }

    fn node_rule(&mut self, rule: &Rule, name: &At<Pattern>, entry: &Entry) {
        let title = format!("{}: {}", rule.id, name.value);
        // A deadline implies presence.
        let within = entry.within.as_ref();
        let found = if entry.forbidden {
            self.forbidden_nodes(&name.value, name.at)
        } else if let Some(within) = within.filter(|_| self.facts.nodes(&name.value).is_empty()) {
            if within.value.0.is_beyond(self.facts.mission.span) {
                vec![self.too_short(name)]
            } else {
                self.node_presence(&name.value, name.at, &Entry::default())
            }
        } else {
            return self.node_facts(&title, &name.value, entry);
        };
        self.note(title, name.at, found);
    }

    /// The finding that the mission ended before a node had to be present.
    fn too_short(&self, name: &At<Pattern>) -> Finding {
        let (name, at) = (name.value.as_str(), name.at);
        let long = words::duration(self.facts.mission.span.nanos());
        let text = format!("cannot tell whether {name} appears in time: the mission lasts {long}");
        Finding::unknown(FindingKind::NodeLate, name, at, text)
    }

    fn topic_rule(&mut self, rule: &Rule, name: &At<Pattern>, entry: &Entry) {
        let title = format!("{}: {}", rule.id, name.value);
        let topics = self.facts.topics(&name.value);
        let found = if entry.forbidden {
            self.forbidden_topics(&name.value, name.at)
        } else if topics.is_empty() || self.is_owed(entry) && !self.is_sent(&topics) {
            self.topic_presence(&name.value, name.at, entry)
        } else {
            return self.topic_facts(&title, &name.value, entry);
        };
        self.note(title, name.at, found);
    }

    fn changes(&self, at: YamlPlace, during: During, many: Range) -> Option<Finding> {
        let span = during.on(self.facts.mission.span);
        let headlines = self.facts.mission.log.headlines(span);
        let events: Vec<_> = headlines.filter(|(_, e)| !e.kind.is_remark()).collect();
        if many.holds(events.len() as f64) {
            return None;
        }
        let seen = words::count(events.len(), "change");
        let [from, to] = [span.start, span.end].map(|time| self.facts.clock(time));
        let text = format!("{seen} from {from} to {to}, expected {many}");
        let parts = self.facts.mission.log.all_parts();
        let listed = events.iter().take(MOST_LISTED).map(|(id, event)| {
            let text = sentence(self.facts.mission, &parts, *id, event);
            format!("{}  {text}", self.facts.clock(event.time))
        });
        let rest = events.len().saturating_sub(MOST_LISTED);
        let rest = (rest > 0).then(|| format!("and {rest} more"));
        let finding = Finding::new(FindingKind::TooManyChanges, "changes", at, text)
            .saw(events.len(), words::count_range(many.from, many.to))
            .at(span)
            .details(listed.chain(rest));
        Some(finding)
    }

    /// Checks the elements that are not in the file, and the remarks of the event log.
    fn policy(&mut self) {
        let At { at, value: policy } = self.expectation.policy;
        if let Some(severity) = policy.unexpected_nodes.severity() {
            let found = self.strange_nodes(severity);
            self.note("unexpected nodes", at, found);
        }
        if let Some(severity) = policy.unexpected_topics.severity() {
            let found = self.strange_topics(severity);
            self.note("unexpected topics", at, found);
        }
        let (twice, lost) = (policy.duplicate_names, policy.messages_lost);
        let kinds = [Kind::Starved, Kind::Duplicate, Kind::Lost];
        let remarks = [
            ("starved", FindingKind::Starved, policy.starved),
            ("duplicate names", FindingKind::DuplicateName, twice),
            ("messages lost", FindingKind::MessagesLost, lost),
        ];
        for (kind, (title, finding, unlisted)) in kinds.into_iter().zip(remarks) {
            let severity = unlisted.severity();
            let found = severity.map(|severity| self.remarks(kind, finding, severity));
            if let Some(found) = found.filter(|found| !found.is_empty()) {
                self.note(title, at, found);
            }
        }
    }

    /// The findings of one kind of remark in the event log.
    fn remarks(&self, kind: Kind, finding: FindingKind, severity: Severity) -> Vec<Finding> {
        let mission = self.facts.mission;
        let parts = mission.log.all_parts();
        let own = mission.log.events.with_ids();
        let own = own.filter(|(_, event)| event.kind == kind && !event.quiet);
        let found = own.map(|(id, event)| {
            let (node, topic) = mission.elements.names(event.what);
            let text = sentence(mission, &parts, id, event);
            let name = topic.or(node).unwrap_or_default();
            let until = event.until.unwrap_or(event.time).plus(1);
            let place = self.expectation.policy.at;
            let mut found = Finding::new(finding, name, place, text).severe(severity);
            found.is_open = kind == Kind::Starved;
            found.at(Span::new(event.time, until))
        });
        found.collect()
    }

    /// The finding of an element that is not in the file, which `text` names.
    fn strange(&self, kind: FindingKind, name: &str, text: &str, severity: Severity) -> Finding {
        let text = format!("{text} is not in {}", self.expectation.file.display());
        let finding = Finding::new(kind, name, self.expectation.policy.at, text);
        let mut finding = finding.saw("present", "not named").severe(severity);
        finding.accept = Some(name.to_owned());
        finding
    }

    fn strange_nodes(&self, severity: Severity) -> Vec<Finding> {
        let known = self.named_nodes();
        let strange = self.facts.robot_roles().filter(|role| {
            let mut names = role.nodes.iter().map(|id| self.facts.node(*id));
            !known.hold(role.name) && !names.any(|name| known.hold(name))
        });
        let found = strange.map(|role| {
            let node = role.nodes.first();
            let name = node.map_or(role.name, |id| self.facts.node(*id));
            let text = match role.name {
                own if own == name => name.to_owned(),
                own => format!("{name} (role {own})"),
            };
            let mut finding = self.strange(FindingKind::UnexpectedNode, role.name, &text, severity);
            finding.when = self.facts.lives(role.nodes).first().copied();
            finding
        });
        found.collect()
    }

    /// Every node name in the file.
    fn named_nodes(&self) -> NamePatterns<'_> {
        let own = self.expectation.nodes.iter().map(|named| &named.name);
        let topics = self.expectation.topics.iter();
        let peers = topics.flat_map(|topic| topic.facts.named_nodes());
        let rules = self.expectation.rules.iter();
        let rules = rules.filter_map(|rule| match &rule.demand {
            Demand::Nodes(names, _) => Some(names.iter().map(|name| &name.value)),
            _ => None,
        });
        own.chain(peers).chain(rules.flatten()).collect()
    }

    fn strange_topics(&self, severity: Severity) -> Vec<Finding> {
        let known: NamePatterns<'_> = self.expectation.topics.iter().map(|t| &t.name).collect();
        let names = self.facts.robot_topics().map(|topic| topic.name());
        let strange = names.filter(|name| !known.hold(name));
        let finding = |name| self.strange(FindingKind::UnexpectedTopic, name, name, severity);
        strange.map(finding).collect()
    }
}

/// Nodes or topics that are checked, what is expected of them, and the beginning of the titles of their facts.
struct Subjects<'a, S> {
    title: &'a str,
    all: &'a [S],
    entry: &'a Entry,
}

/// Whether more of the same recording may resolve a finding about a name with these facts: what is missing may still come
/// until the end of `within`, and only the end of the recording shows what has ended, a mean and the last state.
fn is_open(finding: &Finding, entry: &Entry, part: &Mission, lacks_start: bool) -> bool {
    let is_over = |within: &At<Within>| !lacks_start && within.value.0.is_over(part.span);
    let is_early = |when: Span| {
        // The last window may be cut, and one that is cut counts only until there are others.
        let period = part.period.nanos();
        when.start.plus(period) > part.span.end || when.nanos() < period
    };
    match finding.kind {
        FindingKind::NodeForbidden
        | FindingKind::TopicForbidden
        | FindingKind::TopicType
        | FindingKind::PublisherUnexpected => false,
        FindingKind::NodeRestarted => entry.restarts.is_some_and(|most| most.value.from.is_some()),
        FindingKind::NodeMissing
        | FindingKind::NodeLate
        | FindingKind::TopicMissing
        | FindingKind::TopicLate => !entry.within.as_ref().is_some_and(is_over),
        FindingKind::TopicGap => {
            finding.when.is_none_or(|when| when.end >= part.span.end) || !entry.is_fixed()
        }
        FindingKind::TopicRateLow
        | FindingKind::TopicRateHigh
        | FindingKind::TopicAge
        | FindingKind::TopicBytes
        | FindingKind::TopicDrops => {
            let is_mean = entry.mean_hz.is_some_and(|mean| mean.at == finding.place);
            is_mean || !entry.is_fixed() || finding.when.is_none_or(is_early)
        }
        _ => true,
    }
}

/// The absence of a node as a cause of findings.
fn absence(name: &str) -> Cause {
    Cause {
        time: None,
        text: format!("{} is not in the bag", visible(name)),
    }
}

impl Unlisted {
    /// The severity of a finding under this policy; `None` for no finding at all.
    fn severity(self) -> Option<Severity> {
        match self {
            Self::Allow => None,
            Self::Warn => Some(Severity::Warning),
            Self::Error => Some(Severity::Error),
        }
    }
}
