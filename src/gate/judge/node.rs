//! Checks of nodes: presence, start and end times, restarts, final lifecycle state.

use super::topic::NAMED;
use super::{Judge, absence};
use crate::base::rhythm::CLOSING_NS;
use crate::base::time::Span;
use crate::base::words;
use crate::gate::expectation::{At, Named, NodeFacts, YamlPlace};
use crate::gate::finding::{Cause, Finding, FindingKind};
use crate::gate::pattern::Pattern;
use crate::gate::range::{During, Range};
use crate::graph::NodeId;
use crate::mission::event_log;

/// The roles that a name matches.
type Roles<'a> = [(&'a str, &'a [NodeId])];

/// The times in which an element may end; `None` for any time.
pub(super) fn limited(may_end: Option<&At<During>>) -> Option<&At<During>> {
    may_end.filter(|may_end| may_end.value != During::WHOLE)
}

impl Judge<'_> {
    /// Checks a node of the file.
    pub(super) fn node(&mut self, named: &Named<NodeFacts>) {
        let facts = &named.facts;
        let name = named.name.as_str();
        let before = self.checks.len();
        if facts.forbidden {
            let found = self.forbidden_nodes(&named.name, named.at);
            self.note(format!("node {name} forbidden"), named.at, found);
        } else {
            let found = self.presence(&named.name, named.at, facts);
            let title = format!("node {name}");
            self.note(&title, named.at, found);
            self.node_facts(&title, &named.name, facts);
        }
        for finding in self.found_since(before) {
            finding.accept = Some(name.to_owned());
        }
    }

    /// Checks the facts of a node other than its presence. `title` begins the titles of the facts.
    pub(super) fn node_facts(&mut self, title: &str, pattern: &Pattern, facts: &NodeFacts) {
        let roles = self.facts.nodes(pattern);
        let all = (title, &roles[..]);
        let is_absent = roles.is_empty();
        let is_untimed = is_absent || self.is_part;
        let (within, may_end) = (facts.within.as_ref(), limited(facts.may_end.as_ref()));
        let (restarts, lifecycle) = (facts.restarts.as_ref(), facts.lifecycle.as_ref());
        self.check(all, "within", within, is_untimed, Self::late);
        self.check(all, "may_end", may_end, is_untimed, Self::ended);
        self.check(all, "restarts", restarts, is_absent, Self::restarted);
        self.check(all, "lifecycle", lifecycle, is_absent, Self::lifecycle);
    }

    pub(super) fn forbidden_nodes(&self, pattern: &Pattern, at: YamlPlace) -> Vec<Finding> {
        let roles = self.facts.nodes(pattern);
        if roles.is_empty() && !self.names_nodes {
            return vec![self.unnamed(FindingKind::NodeForbidden, pattern.as_str(), at)];
        }
        let found = roles.into_iter().map(|(role, nodes)| {
            let lives = self.facts.lives(nodes);
            let finding = Finding::new(
                FindingKind::NodeForbidden,
                role,
                at,
                format!("{role} is in the bag, and `{pattern}` is forbidden"),
            );
            match lives.first() {
                Some(life) => finding
                    .saw("present", "absent")
                    .at(*life)
                    .detail(self.facts.stretch(*life)),
                None => finding.saw("present", "absent"),
            }
        });
        found.collect()
    }

    /// The findings on whether a node is present and stays.
    pub(super) fn presence(
        &self,
        pattern: &Pattern,
        at: YamlPlace,
        facts: &NodeFacts,
    ) -> Vec<Finding> {
        let roles = self.facts.nodes(pattern);
        let name = pattern.as_str();
        if roles.is_empty() {
            return match (facts.optional, self.names_nodes) {
                (true, _) => Vec::new(),
                (false, _) if facts.is_logged => {
                    let text = format!(
                        "cannot tell whether {name} is present: only its log would show it"
                    );
                    vec![Finding::new(FindingKind::NodeMissing, name, at, text).unknown()]
                }
                (false, true) => vec![self.missing(pattern, at)],
                (false, false) => vec![self.unnamed(FindingKind::NodeMissing, name, at)],
            };
        }
        if let Some(finding) = self.mute(pattern, at).filter(|_| !facts.optional) {
            return vec![finding];
        }
        if facts.may_end.is_some() {
            return Vec::new();
        }
        roles
            .iter()
            .filter_map(|(role, nodes)| self.gone(role, nodes, "to stay", at))
            .collect()
    }

    /// The finding that a node's presence is not observable.
    fn unnamed(&self, kind: FindingKind, name: &str, at: YamlPlace) -> Finding {
        let (why, hint) = if self.facts.is_rewritten() {
            (
                "a tool merged the senders of this bag",
                "check the bag as it was recorded",
            )
        } else if self.facts.is_ros1() {
            (
                "the connections of this bag name no senders",
                "check the bag as it was recorded",
            )
        } else if self
            .facts
            .roles()
            .any(|(_, nodes)| self.facts.is_sure(nodes))
        {
            (
                "this bag names few nodes, probably because its recorder started late",
                "record /parameter_events from before the nodes start, or /rosgraph",
            )
        } else {
            (
                "this bag names no nodes",
                "record /rosout and /parameter_events, or /rosgraph; see `bagreel info`",
            )
        };
        let text = format!("cannot tell whether {name} is present: {why}");
        Finding::new(kind, name, at, text).unknown().hint(hint)
    }

    /// The finding that a node is named, but none of the topics that only it publishes has messages.
    fn mute(&self, pattern: &Pattern, at: YamlPlace) -> Option<Finding> {
        let own = self.expectation.topics.iter().filter(|topic| {
            let by = topic.facts.by.iter().flat_map(|by| &by.value);
            let by: Vec<&str> = by.map(|by| by.value.as_str()).collect();
            by == [pattern.as_str()] && self.is_owed(&topic.facts)
        });
        let own: Vec<&str> = own.map(|topic| topic.name.as_str()).collect();
        let is_sent = |name: &&str| self.is_sent(&self.facts.topics(&Pattern::new(name)));
        let roles = self.facts.nodes(pattern);
        let sends_others = roles.iter().any(|(_, nodes)| self.facts.is_sender(nodes));
        if own.is_empty() || sends_others || own.iter().any(is_sent) {
            return None;
        }
        let topics = words::some_of(&own, NAMED);
        let text = format!("{pattern} sends nothing: {topics} without a message");
        let finding = Finding::new(FindingKind::NodeMissing, pattern.as_str(), at, text);
        Some(finding.saw("no message", topics))
    }

    fn missing(&self, pattern: &Pattern, at: YamlPlace) -> Finding {
        let name = pattern.as_str();
        let roles = self.facts.roles().map(|(role, _)| role);
        let mut finding = Finding::new(
            FindingKind::NodeMissing,
            name,
            at,
            format!("{name} is not in the bag"),
        )
        .saw("absent", "present");
        finding.cause = Some(absence(name));
        match self.near(pattern, roles) {
            Some(near) => finding.hint(near),
            None => finding,
        }
    }

    /// The findings on whether a node ended in the time in which it may.
    fn ended(&self, roles: &Roles<'_>, may_end: &At<During>) -> Vec<Finding> {
        let allowed = may_end.value.on(self.facts.mission.span);
        let expected = format!("to end within {}", self.facts.stretch(allowed));
        let found = roles.iter().filter_map(|(role, nodes)| {
            let end = self.facts.ended(nodes, CLOSING_NS)?.time;
            let is_off = end < allowed.start || end > allowed.end;
            is_off.then(|| self.gone(role, nodes, &expected, may_end.at))?
        });
        found.collect()
    }

    fn gone(&self, role: &str, nodes: &[NodeId], expected: &str, at: YamlPlace) -> Option<Finding> {
        let whole = self.facts.mission.span;
        let ended = self.facts.ended(nodes, CLOSING_NS)?;
        let end = ended.time;
        let clock = self.facts.clock(end);
        // It may have ended in the robot's shutdown.
        if whole.end.since(ended.latest) <= CLOSING_NS {
            let text = format!("cannot tell when {role} ended: its last sign is at {clock}");
            return Some(Finding::new(FindingKind::NodeGone, role, at, text).unknown());
        }
        let finding = Finding::new(
            FindingKind::NodeGone,
            role,
            at,
            format!("{role} ended at {clock}, expected {expected}"),
        );
        let mut finding = finding
            .saw(format!("ended at {clock}"), expected)
            .at(Span::new(end, whole.end))
            .detail(format!(
                "{} before the end of the mission",
                words::duration(whole.end.since(end))
            ));
        let around = Span::new(end.plus(-CLOSING_NS), end.plus(CLOSING_NS));
        finding.cause = self.facts.cause(&nodes.iter().copied().collect(), around);
        Some(finding)
    }

    fn late(&self, roles: &Roles<'_>, within: &At<During>) -> Vec<Finding> {
        let whole = self.facts.mission.span;
        let allowed = within.value.on(whole);
        let expected = format!("within {}", self.facts.stretch(allowed));
        let late = roles.iter().filter_map(|(role, nodes)| {
            let began = self.facts.began(nodes)?;
            // A node present at the start of the recording has an unknown start time.
            let is_late = began.time > allowed.end;
            let is_early = began.time < allowed.start && began.earliest > whole.start;
            if !is_late && !is_early {
                return None;
            }
            let clock = self.facts.clock(began.time);
            if is_late && began.earliest <= allowed.end {
                let text = format!(
                    "cannot tell whether {role} appeared {expected}: its first sign is at {clock}"
                );
                return Some(Finding::new(FindingKind::NodeLate, role, within.at, text).unknown());
            }
            let text = format!("{role} appeared at {clock}, expected {expected}");
            let finding = Finding::new(FindingKind::NodeLate, role, within.at, text);
            Some(
                finding
                    .saw(format!("at {clock}"), &expected)
                    .at(Span::new(whole.start, began.time)),
            )
        });
        late.collect()
    }

    fn restarted(&self, roles: &Roles<'_>, range: &At<Range>) -> Vec<Finding> {
        let found = roles.iter().filter_map(|(role, nodes)| {
            let events = self.facts.events(nodes, event_log::Kind::Restarted);
            if range.value.holds(events.len() as f64) {
                return None;
            }
            let many = words::count(events.len(), "time");
            let text = format!("{role} restarted {many}, expected {}", range.value);
            let mut finding = Finding::new(FindingKind::NodeRestarted, role, range.at, text)
                .saw(&many, words::count_range(range.value.from, range.value.to));
            for event in events.iter().take(6) {
                let until = event.until.unwrap_or(event.time);
                let away = words::duration(until.since(event.time).max(0));
                let text = format!("at {}, away for {away}", self.facts.clock(event.time));
                finding = finding.detail(text);
            }
            if let Some(first) = events.first() {
                finding.cause = Some(Cause {
                    time: Some(first.time),
                    text: format!("{role} restarted at {}", self.facts.clock(first.time)),
                });
                finding.when = Some(Span::new(first.time, first.until.unwrap_or(first.time)));
            }
            Some(finding)
        });
        found.collect()
    }

    fn lifecycle(&self, roles: &Roles<'_>, state: &At<String>) -> Vec<Finding> {
        let at = state.at;
        let expected = state.value.as_str();
        let found = roles.iter().filter_map(|(role, nodes)| {
            match self.facts.lifecycle(nodes) {
                Some(seen) if *seen == *expected => None,
                Some(seen) => {
                    let text = format!("{role} ends {seen}, expected {expected}");
                    Some(Finding::new(FindingKind::NodeLifecycle, role, at, text).saw(seen, expected))
                }
                None => Some(
                    Finding::new(
                        FindingKind::NodeLifecycle,
                        role,
                        at,
                        format!("cannot tell whether {role} is {expected}: this bag has no transition of it"),
                    ).unknown()
                    .hint(format!("record {role}/transition_event")),
                ),
            }
        });
        found.collect()
    }
}
