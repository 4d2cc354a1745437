//! Named rules: facts of nodes and topics, reactions to events, and times without changes.

use super::Judge;
use crate::base::time::Span;
use crate::base::words;
use crate::gate::expectation::{
    At, Demand, Entry, EventKind, ExpectedEvent, Reaction, Rule, YamlPlace,
};
use crate::gate::finding::{Cause, Finding, FindingKind};
use crate::gate::values::{During, Pattern, Range};
use crate::graph::{Element, NodeId};
use crate::mission::event_log::{Detail, Event, Kind};
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
            Demand::Nodes(names, entry) => {
                for name in names {
                    self.node_rule(rule, name, entry);
                }
            }
            Demand::Topic(name, entry) => self.topic_rule(rule, name, entry),
            Demand::Reaction(reaction) => {
                let found = self.reaction(rule.at, reaction);
                self.note(&rule.id, rule.at, found);
            }
            Demand::Changes { during, many } => {
                let found = self.changes(rule.at, *during, *many);
                self.note(&rule.id, rule.at, found.into_iter().collect());
            }
        }
        let detail = format!("rule {}", words::visible(&rule.id));
        for finding in self.found_since(before) {
            finding.details.push(detail.clone());
        }
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

    fn reaction(&self, at: YamlPlace, reaction: &Reaction) -> Vec<Finding> {
        let answers = self.events(&reaction.expect);
        let mut found = Vec::new();
        for cause in self.events(&reaction.when) {
            let from = cause.earliest.plus(-BEFORE_NS);
            let to = cause.latest.plus(reaction.within);
            if answers.iter().any(|e| from <= e.time && e.time <= to) {
                continue;
            }
            // A hand-over is complete when the new sender publishes, even if its start is uncertain.
            let is_exact = reaction.expect.kind == EventKind::HandedOver;
            let may = |e: &&Event| !is_exact && e.earliest <= to && from <= e.latest;
            let doubt = if answers.iter().any(may) {
                Some("the times overlap")
            } else if to > self.facts.mission.span.end {
                Some("the mission ended before")
            } else {
                None
            };
            let late = answers.iter().find(|e| e.time > cause.time);
            let missing = MissingReaction {
                reaction,
                cause,
                late: late.copied(),
                doubt,
            };
            found.push(self.no_answer(at, &missing));
        }
        found
    }

    fn no_answer(&self, at: YamlPlace, missing: &MissingReaction<'_>) -> Finding {
        let (kind, cause) = (FindingKind::ReactionMissing, missing.cause);
        let Reaction {
            when,
            expect,
            within,
        } = missing.reaction;
        let name = expect.name.as_str();
        let clock = self.facts.clock(cause.time);
        let what = format!("{} {} at {clock}", when.name, past(when));
        if let Some(doubt) = missing.doubt {
            let past = past(expect);
            let text = format!("cannot tell whether {name} {past} in time after {what}: {doubt}");
            return Finding::unknown(kind, name, at, text);
        }
        let within_words = words::duration(*within);
        let expected = format!("{} within {within_words}", expected_text(expect));
        let text = format!("{what}, and {expected} did not follow");
        let mut finding = Finding::new(kind, name, at, text)
            .saw("nothing", expected)
            .at(Span::new(cause.time, cause.latest.plus(*within)));
        if let Some(after) = missing.late {
            let late = words::duration(after.time.since(cause.time));
            finding = finding.detail(format!("it followed after {late}"));
        }
        finding.cause = Some(Cause {
            time: Some(cause.time),
            text: what,
        });
        finding
    }

    fn changes(&self, at: YamlPlace, during: During, many: Range) -> Option<Finding> {
        let span = during.on(self.facts.mission.span);
        let headlines = self.facts.mission.log.headlines(span);
        let events: Vec<_> = headlines.filter(|(_, e)| !e.kind.is_remark()).collect();
        if many.holds(events.len() as f64) {
            return None;
        }
        let seen = words::count(events.len(), "reconfiguration");
        let [from, to] = [span.start, span.end].map(|time| self.facts.clock(time));
        let text = format!("{seen} from {from} to {to}, expected {many}");
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
        Some(finding)
    }

    /// The events that match an event, in order.
    fn events(&self, wanted: &ExpectedEvent) -> Vec<&Event> {
        let all = self.facts.mission.log.events.iter();
        all.filter(|event| self.is_event(wanted, event)).collect()
    }

    fn is_event(&self, wanted: &ExpectedEvent, event: &Event) -> bool {
        let kinds: &[Kind] = match wanted.kind {
            EventKind::Added => &[Kind::Started, Kind::Appeared],
            EventKind::Removed => &[Kind::Stopped, Kind::Restarted, Kind::Vanished],
            EventKind::Restarted => &[Kind::Restarted],
            EventKind::Silent => &[Kind::Silent],
            EventKind::HandedOver => &[Kind::HandedOver],
            EventKind::Rate => &[Kind::Rate],
            EventKind::Lifecycle => &[Kind::Lifecycle],
        };
        kinds.contains(&event.kind) && self.is_about(wanted, event) && self.has_ends(wanted, event)
    }

    fn is_about(&self, wanted: &ExpectedEvent, event: &Event) -> bool {
        match event.what {
            Element::Node(id) => self.facts.fits(&wanted.name, id),
            Element::Topic(id) => wanted.name.matches(self.facts.topic(id)),
            Element::Publish(id) if wanted.kind == EventKind::Rate => {
                let topic = self.facts.mission.elements.publishes[id].topic;
                wanted.name.matches(self.facts.topic(topic))
            }
            Element::Publish(_) | Element::Subscribe(_) => false,
        }
    }

    fn has_ends(&self, wanted: &ExpectedEvent, event: &Event) -> bool {
        let any = |wanted: &Option<Pattern>, nodes: &[NodeId]| {
            let fits = |p: &Pattern| nodes.iter().any(|id| self.facts.fits(p, *id));
            wanted.as_ref().is_none_or(fits)
        };
        let is = |wanted: &Option<Pattern>, value: &str| {
            wanted.as_ref().is_none_or(|p| p.matches(value))
        };
        match &event.detail {
            Detail::Senders { from, to } => any(&wanted.from, from) && any(&wanted.to, to),
            Detail::Values { from, to } => is(&wanted.from, from) && is(&wanted.to, to),
            _ => wanted.from.is_none() && wanted.to.is_none(),
        }
    }
}

/// An event that an expected event did not follow in time.
struct MissingReaction<'a> {
    reaction: &'a Reaction,
    cause: &'a Event,
    /// The expected event after it, too late.
    late: Option<&'a Event>,
    /// The reason why it may have followed in time.
    doubt: Option<&'static str>,
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
