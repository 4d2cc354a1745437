//! Named rules: about several nodes, order, reactions, and times without changes.

use super::{Judge, absence};
use crate::base::time::Span;
use crate::base::words;
use crate::gate::expectation::{
    At, Demand, EventKind, ExpectedEvent, NodeFacts, Rule, TopicFacts, YamlPlace,
};
use crate::gate::finding::{Cause, Finding, FindingKind};
use crate::gate::pattern::Pattern;
use crate::gate::range::{During, Range};
use crate::graph::history::Bound;
use crate::mission::event_log::Event;
use crate::mission::events::sentence;

/// The time in nanoseconds by which a reaction may precede its cause: the last sign of a node that ended is a period
/// before its end.
const BEFORE_NS: i64 = 1_000_000_000;
/// The number of events that are written out.
const MOST_LISTED: usize = 6;

impl Judge<'_> {
    /// Checks a rule.
    pub(super) fn rule(&mut self, rule: &Rule) {
        let before = self.checks.len();
        match &rule.demand {
            Demand::Nodes(names, facts) => self.node_rule(rule, names, facts),
            Demand::Topic(name, facts) => self.topic_rule(rule, name, facts),
            Demand::Order(names) => {
                let found = self.order(names);
                self.note(&rule.id, rule.at, found);
            }
            Demand::Reaction {
                when,
                expect,
                within,
            } => {
                let found = self.reaction(rule, when, expect, *within);
                self.note(&rule.id, rule.at, found);
            }
            Demand::Changes { during, many } => {
                let found = self.changes(rule.at, *during, *many);
                self.note(&rule.id, rule.at, found);
            }
        }
        for finding in self.found_since(before) {
            finding
                .details
                .push(format!("rule {}", words::visible(&rule.id)));
        }
    }

    fn node_rule(&mut self, rule: &Rule, names: &[At<Pattern>], facts: &NodeFacts) {
        for name in names {
            let title = format!("{}: {}", rule.id, name.value);
            if facts.forbidden {
                let found = self.forbidden_nodes(&name.value, name.at);
                self.note(title, name.at, found);
                continue;
            }
            // A deadline implies presence.
            if let Some(within) = &facts.within
                && self.facts.nodes(&name.value).is_empty()
            {
                let span = self.facts.mission.span;
                if within.value.is_beyond(span) {
                    self.note(title, name.at, vec![self.too_short(name)]);
                    continue;
                }
                let is_there = NodeFacts {
                    may_end: Some(At {
                        at: name.at,
                        value: During::WHOLE,
                    }),
                    ..NodeFacts::default()
                };
                let found = self.presence(&name.value, name.at, &is_there);
                self.note(title, name.at, found);
                continue;
            }
            self.node_facts(&title, &name.value, facts);
        }
    }

    /// The finding that the mission ended before a node had to be present.
    fn too_short(&self, name: &At<Pattern>) -> Finding {
        let (name, at) = (name.value.as_str(), name.at);
        let long = words::duration(self.facts.mission.span.nanos());
        let text = format!("cannot tell whether {name} appears in time: the mission lasts {long}");
        Finding::new(FindingKind::NodeLate, name, at, text).unknown()
    }

    fn topic_rule(&mut self, rule: &Rule, name: &At<Pattern>, facts: &TopicFacts) {
        let title = format!("{}: {}", rule.id, name.value);
        if facts.forbidden {
            let found = self.forbidden_topics(&name.value, name.at);
            self.note(title, name.at, found);
            return;
        }
        let topics = self.facts.topics(&name.value);
        let needs = facts.whilst.is_none() && self.is_owed(facts);
        if topics.is_empty() || needs && !self.is_sent(&topics) {
            let found = self.topic_presence(&name.value, name.at, facts);
            self.note(title, name.at, found);
            return;
        }
        self.topic_facts(&title, &name.value, facts);
    }

    fn order(&self, names: &[At<Pattern>]) -> Vec<Finding> {
        let mut found = Vec::new();
        let mut before: Option<(&At<Pattern>, Bound)> = None;
        for name in names {
            let roles = self.facts.nodes(&name.value);
            let began = roles
                .iter()
                .filter_map(|(_, nodes)| self.facts.began(nodes));
            let Some(began) = began.min_by_key(|bound| bound.time) else {
                let text = format!("{} never appeared, expected in order", name.value);
                let mut finding =
                    Finding::new(FindingKind::OrderBroken, name.value.as_str(), name.at, text)
                        .saw("absent", order_of(names));
                finding.cause = Some(absence(name.value.as_str()));
                found.push(finding);
                continue;
            };
            if let Some((other, earlier)) = before
                && began.time < earlier.time
            {
                found.push(self.swapped((other, earlier), (name, began), names));
            }
            before = Some((name, began));
        }
        found
    }

    fn swapped(
        &self,
        (first, earlier): (&At<Pattern>, Bound),
        (second, began): (&At<Pattern>, Bound),
        names: &[At<Pattern>],
    ) -> Finding {
        let (one, other) = (first.value.as_str(), second.value.as_str());
        let at = |bound: Bound| self.facts.clock(bound.time);
        if began.latest >= earlier.earliest {
            let text =
                format!("cannot tell whether {other} appeared after {one}: the times overlap");
            return Finding::new(FindingKind::OrderBroken, other, second.at, text).unknown();
        }
        let text = format!(
            "{other} appeared at {}, expected after {one} at {}",
            at(began),
            at(earlier)
        );
        let seen = format!("{other} at {}, {one} at {}", at(began), at(earlier));
        Finding::new(FindingKind::OrderBroken, other, second.at, text)
            .saw(seen, order_of(names))
            .at(Span::new(began.time, earlier.time))
    }

    fn reaction(
        &self,
        rule: &Rule,
        when: &ExpectedEvent,
        expect: &ExpectedEvent,
        within: i64,
    ) -> Vec<Finding> {
        let answers = self.events(expect);
        let mut found = Vec::new();
        for cause in self.events(when) {
            let from = cause.earliest.plus(-BEFORE_NS);
            let to = cause.latest.plus(within);
            if answers.iter().any(|e| from <= e.time && e.time <= to) {
                continue;
            }
            // A hand-over is complete when the new sender publishes, even if its start is uncertain.
            let may = |e: &&&Event| {
                expect.kind != EventKind::HandedOver && e.earliest <= to && from <= e.latest
            };
            let doubt = if answers.iter().any(|e| may(&e)) {
                Some("the times overlap")
            } else if to > self.facts.mission.span.end {
                Some("the mission ended before")
            } else {
                None
            };
            found.push(self.no_answer(rule.at, (when, cause), expect, within, doubt));
        }
        found
    }

    fn no_answer(
        &self,
        at: YamlPlace,
        (when, cause): (&ExpectedEvent, &Event),
        expect: &ExpectedEvent,
        within: i64,
        doubt: Option<&str>,
    ) -> Finding {
        let name = expect.name.as_str();
        let expected = format!(
            "{} within {}",
            expected_text(expect),
            words::duration(within)
        );
        let what = format!("{} {}", when.name, past(when));
        let clock = self.facts.clock(cause.time);
        if let Some(doubt) = doubt {
            let text = format!(
                "cannot tell whether {name} {} in time after {what} at {clock}: {doubt}",
                past(expect)
            );
            return Finding::new(FindingKind::ReactionMissing, name, at, text).unknown();
        }
        let text = format!("{what} at {clock}, and {expected} did not follow");
        let mut finding = Finding::new(FindingKind::ReactionMissing, name, at, text)
            .saw("nothing", expected)
            .at(Span::new(cause.time, cause.latest.plus(within)));
        let after = self
            .events(expect)
            .into_iter()
            .find(|e| e.time > cause.time);
        if let Some(after) = after {
            let late = words::duration(after.time.since(cause.time));
            finding = finding.detail(format!("it followed after {late}"));
        }
        finding.cause = Some(Cause {
            time: Some(cause.time),
            text: format!("{what} at {clock}"),
        });
        finding
    }

    fn changes(&self, at: YamlPlace, during: Option<During>, many: Range) -> Vec<Finding> {
        let whole = self.facts.mission.span;
        let span = during.map_or(whole, |d| d.on(whole));
        let headlines = self.facts.mission.log.headlines(span);
        let events: Vec<_> = headlines.filter(|(_, e)| !e.kind.is_remark()).collect();
        if many.holds(events.len() as f64) {
            return Vec::new();
        }
        let seen = words::count(events.len(), "reconfiguration");
        let text = format!(
            "{seen} from {} to {}, expected {many}",
            self.facts.clock(span.start),
            self.facts.clock(span.end)
        );
        let mut finding = Finding::new(FindingKind::TooManyChanges, "reconfigurations", at, text)
            .saw(events.len(), words::count_range(many.from, many.to))
            .at(span);
        let parts = self.facts.mission.log.all_parts();
        for (id, event) in events.iter().take(MOST_LISTED) {
            let text = sentence(self.facts.mission, &parts, *id, event);
            finding = finding.detail(format!("{}  {text}", self.facts.clock(event.time)));
        }
        if events.len() > MOST_LISTED {
            finding = finding.detail(format!("and {} more", events.len() - MOST_LISTED));
        }
        vec![finding]
    }
}

fn order_of(names: &[At<Pattern>]) -> String {
    let names: Vec<&str> = names.iter().map(|n| n.value.as_str()).collect();
    names.join(", ")
}

/// The predicate for an event that happened: `was removed`.
fn past(event: &ExpectedEvent) -> String {
    match event.kind {
        EventKind::Added => "appeared".to_owned(),
        EventKind::Removed => "was removed".to_owned(),
        EventKind::Restarted => "restarted".to_owned(),
        EventKind::Silent => "fell silent".to_owned(),
        EventKind::HandedOver => "was handed over".to_owned(),
        EventKind::Rate => "changed its rate".to_owned(),
        EventKind::Lifecycle => "changed its state".to_owned(),
    }
}

/// The text for an expected event: `/cmd_vel handed over to /teleop`.
fn expected_text(event: &ExpectedEvent) -> String {
    let name = &event.name;
    match (event.kind, &event.to) {
        (EventKind::HandedOver, Some(to)) => format!("{name} handed over to {to}"),
        (EventKind::HandedOver, None) => format!("{name} handed over"),
        (EventKind::Lifecycle, Some(to)) => format!("{name} becoming {to}"),
        (EventKind::Lifecycle, None) => format!("{name} in another state"),
        (EventKind::Rate, _) => format!("{name} at another rate"),
        (kind, _) => format!("{name} {}", kind.word()),
    }
}
