//! Checks of nodes: presence, start and end times, restarts, final lifecycle state.

use super::{Judge, NAMED, Subjects, absence};
use crate::base::rhythm::CLOSING_NS;
use crate::base::time::Span;
use crate::base::words;
use crate::gate::expectation::{At, Entry, MayEnd, Within, YamlPlace};
use crate::gate::facts::{ENDS, Role};
use crate::gate::finding::{Cause, Finding, FindingKind};
use crate::gate::values::{Pattern, Range};
use crate::mission::event_log::{Event, Kind};

impl Judge<'_> {
    /// Checks the facts of a node other than its presence. `title` begins the titles of the facts.
    pub(super) fn node_facts(&mut self, title: &str, pattern: &Pattern, entry: &Entry) {
        let facts = self.facts;
        let all = &Subjects {
            title,
            all: &facts.nodes(pattern),
            entry,
        };
        let is_absent = all.all.is_empty();
        let is_untimed = is_absent || self.is_part;
        self.check(all, "within", &entry.within, is_untimed, Self::late);
        self.check(all, "may_end", &entry.limit(), is_untimed, Self::ended);
        self.check(all, "restarts", &entry.restarts, is_absent, Self::restarted);
        let state = &entry.lifecycle;
        self.check(all, "lifecycle", state, is_absent, Self::lifecycle);
    }

    pub(super) fn forbidden_nodes(&self, pattern: &Pattern, at: YamlPlace) -> Vec<Finding> {
        let roles = self.facts.nodes(pattern);
        if roles.is_empty() && !self.names_nodes {
            return vec![self.unnamed(FindingKind::NodeForbidden, pattern.as_str(), at)];
        }
        let found = roles.into_iter().map(|role| {
            let text = format!("{} is in the bag, and `{pattern}` is forbidden", role.name);
            let finding = Finding::new(FindingKind::NodeForbidden, role.name, at, text);
            let finding = finding.saw("present", "absent");
            match self.facts.lives(role.nodes).first() {
                Some(life) => finding.at(*life).details([self.facts.stretch(*life)]),
                None => finding,
            }
        });
        found.collect()
    }

    /// The findings on whether a node is present and stays.
    pub(super) fn node_presence(
        &self,
        pattern: &Pattern,
        at: YamlPlace,
        entry: &Entry,
    ) -> Vec<Finding> {
        let roles = self.facts.nodes(pattern);
        let name = pattern.as_str();
        if roles.is_empty() {
            let finding = if entry.optional {
                return Vec::new();
            } else if entry.known_by.is_some() {
                let text =
                    format!("cannot tell whether {name} is present: only its log would show it");
                Finding::unknown(FindingKind::NodeMissing, name, at, text)
            } else if self.names_nodes {
                self.missing(pattern, at)
            } else {
                self.unnamed(FindingKind::NodeMissing, name, at)
            };
            return vec![finding];
        }
        if let Some(finding) = self.mute(pattern, &roles, at).filter(|_| !entry.optional) {
            return vec![finding];
        }
        if entry.may_end.is_some() {
            return Vec::new();
        }
        let gone = |role| self.gone(role, "to stay", at);
        roles.into_iter().filter_map(gone).collect()
    }

    /// The finding that a node's presence is not observable.
    fn unnamed(&self, kind: FindingKind, name: &str, at: YamlPlace) -> Finding {
        let is_sure = |role: Role<'_>| self.facts.is_sure(role.nodes);
        let as_recorded = "check the bag as it was recorded";
        let (why, hint) = if self.facts.is_rewritten {
            ("a tool merged the senders of this bag", as_recorded)
        } else if self.facts.is_ros1() {
            ("the connections of this bag name no senders", as_recorded)
        } else if self.facts.roles().any(is_sure) {
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
        Finding::unknown(kind, name, at, text).hints([hint])
    }

    /// The finding that a node is named, but none of the topics that only it publishes has messages.
    fn mute(&self, pattern: &Pattern, roles: &[Role<'_>], at: YamlPlace) -> Option<Finding> {
        let own = self.expectation.topics.iter().filter(|topic| {
            let by: Vec<&Pattern> = topic.facts.publishers().collect();
            by == [pattern] && self.is_owed(&topic.facts)
        });
        let own: Vec<&Pattern> = own.map(|topic| &topic.name).collect();
        let is_sent = |name: &&Pattern| self.is_sent(&self.facts.topics(name));
        let sends_others = roles.iter().any(|role| self.facts.is_sender(role.nodes));
        if own.is_empty() || sends_others || own.iter().any(is_sent) {
            return None;
        }
        let topics = words::some_of(own.into_iter().map(Pattern::as_str), NAMED);
        let text = format!("{pattern} sends nothing: {topics} without a message");
        let finding = Finding::new(FindingKind::NodeMissing, pattern.as_str(), at, text);
        Some(finding.saw("no message", topics))
    }

    fn missing(&self, pattern: &Pattern, at: YamlPlace) -> Finding {
        let name = pattern.as_str();
        let text = format!("{name} is not in the bag");
        Finding::new(FindingKind::NodeMissing, name, at, text)
            .saw("absent", "present")
            .because(Some(absence(name)))
            .hints(self.near(pattern, self.facts.roles().map(|role| role.name)))
    }

    /// The finding on whether a node ended in the time in which it may.
    fn ended(&self, role: Role<'_>, _: &Entry, may_end: &At<MayEnd>) -> Option<Finding> {
        let allowed = may_end.value.0.on(self.facts.mission.span);
        let end = self.facts.ended(role.nodes, CLOSING_NS)?.time;
        let expected = format!("to end within {}", self.facts.stretch(allowed));
        let is_off = end < allowed.start || end > allowed.end;
        is_off.then(|| self.gone(role, &expected, may_end.at))?
    }

    fn gone(&self, role: Role<'_>, expected: &str, at: YamlPlace) -> Option<Finding> {
        let (kind, name) = (FindingKind::NodeGone, role.name);
        let whole = self.facts.mission.span;
        let ended = self.facts.ended(role.nodes, CLOSING_NS)?;
        let end = ended.time;
        let clock = self.facts.clock(end);
        // It may have ended in the robot's shutdown.
        if whole.end.since(ended.latest) <= CLOSING_NS {
            let text = format!("cannot tell when {name} ended: its last sign is at {clock}");
            return Some(Finding::unknown(kind, name, at, text));
        }
        let text = format!("{name} ended at {clock}, expected {expected}");
        let rest = words::duration(whole.end.since(end));
        let around = Span::new(end.plus(-CLOSING_NS), end.plus(CLOSING_NS));
        let nodes = role.nodes.iter().copied().collect();
        let finding = Finding::new(kind, name, at, text)
            .saw(format!("ended at {clock}"), expected)
            .at(Span::new(end, whole.end))
            .details([format!("{rest} before the end of the mission")])
            .because(self.facts.cause(&nodes, ENDS, around));
        Some(finding)
    }

    fn late(&self, role: Role<'_>, _: &Entry, within: &At<Within>) -> Option<Finding> {
        let (kind, name, at) = (FindingKind::NodeLate, role.name, within.at);
        let whole = self.facts.mission.span;
        let allowed = within.value.0.on(whole);
        let expected = format!("within {}", self.facts.stretch(allowed));
        let began = self.facts.began(role.nodes)?;
        // A node present at the start of the recording has an unknown start time.
        let is_late = began.time > allowed.end;
        let is_early = began.time < allowed.start && began.earliest > whole.start;
        if !is_late && !is_early {
            return None;
        }
        let clock = self.facts.clock(began.time);
        if is_late && began.earliest <= allowed.end {
            let text = format!(
                "cannot tell whether {name} appeared {expected}: its first sign is at {clock}"
            );
            return Some(Finding::unknown(kind, name, at, text));
        }
        let text = format!("{name} appeared at {clock}, expected {expected}");
        let finding = Finding::new(kind, name, at, text).saw(format!("at {clock}"), expected);
        let at = Span::new(began.time, began.time.plus(1));
        let nodes = role.nodes.iter().copied().collect();
        let cause = self.facts.cause(&nodes, &[Kind::Started], at);
        let finding = finding.at(Span::new(whole.start, began.time));
        Some(finding.because(cause))
    }

    fn restarted(&self, role: Role<'_>, _: &Entry, range: &At<Range>) -> Option<Finding> {
        let events = self.facts.events(role.nodes, Kind::Restarted);
        let At { at, value: range } = *range;
        if range.holds(events.len() as f64) {
            return None;
        }
        let name = role.name;
        let many = words::count(events.len(), "time");
        let text = format!("{name} restarted {many}, expected {range}");
        let details = events.iter().take(6).map(|event| {
            let until = event.until.unwrap_or(event.time);
            let away = words::duration(until.since(event.time).max(0));
            format!("at {}, away for {away}", self.facts.clock(event.time))
        });
        let cause = events.first().map(|first| Cause {
            time: Some(first.time),
            text: format!("{name} restarted at {}", self.facts.clock(first.time)),
        });
        let mut finding = Finding::new(FindingKind::NodeRestarted, name, at, text)
            .saw(&many, words::count_range(range.from, range.to))
            .details(details)
            .because(cause);
        let when = |first: &&Event| Span::new(first.time, first.until.unwrap_or(first.time));
        finding.when = events.first().map(when);
        Some(finding)
    }

    fn lifecycle(&self, role: Role<'_>, _: &Entry, state: &At<String>) -> Option<Finding> {
        let (kind, name, at) = (FindingKind::NodeLifecycle, role.name, state.at);
        let expected = state.value.as_str();
        let Some(seen) = self.facts.lifecycle(role.nodes) else {
            let text = format!(
                "cannot tell whether {name} is {expected}: this bag has no transition of it"
            );
            let hint = format!("record {name}/transition_event");
            return Some(Finding::unknown(kind, name, at, text).hints([hint]));
        };
        let text = format!("{name} ends {seen}, expected {expected}");
        let finding = Finding::new(kind, name, at, text).saw(seen, expected);
        (seen != expected).then_some(finding)
    }
}
