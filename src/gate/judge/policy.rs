//! Checks of elements that are not in the file: allowed, or findings if the policy forbids them.

use super::Judge;
use crate::base::time::Span;
use crate::gate::expectation::{Demand, REMARKS};
use crate::gate::finding::{Finding, FindingKind, Severity};
use crate::gate::pattern::{NamePatterns, Pattern};
use crate::graph::NodeId;
use crate::mission::event_log::Kind;
use crate::mission::events::sentence;

impl Judge<'_> {
    /// Checks the elements that are not in the file.
    pub(super) fn policy(&mut self) {
        let policy = self.expectation.policy;
        if policy.nodes.severity().is_some() {
            let found = self.strange_nodes();
            self.note("unexpected nodes", policy.at, found);
        }
        if policy.topics.severity().is_some() {
            let found = self.strange_topics();
            self.note("unexpected topics", policy.at, found);
        }
        for ((title, kind, finding), severity) in REMARKS.iter().zip(policy.remarks) {
            let found = severity
                .severity()
                .map(|severity| self.remarks(*kind, *finding, severity));
            if let Some(found) = found.filter(|found| !found.is_empty()) {
                self.note(title.replace('_', " "), policy.at, found);
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
            let mut found = Finding::new(finding, name, self.expectation.policy.at, text);
            found.severity = severity;
            found.at(Span::new(
                event.time,
                event.until.unwrap_or(event.time).plus(1),
            ))
        });
        found.collect()
    }

    fn strange_nodes(&self) -> Vec<Finding> {
        let known = self.named_nodes();
        let mut found = Vec::new();
        for (role, nodes) in self.facts.roles() {
            let own = |id: &NodeId| known.hold(self.facts.node(*id));
            let is_named = known.hold(role) || nodes.iter().any(own);
            if is_named || self.facts.is_tool(nodes) || !self.facts.is_sure(nodes) {
                continue;
            }
            let file = self.expectation.file.display();
            let name = nodes.first().map_or(role, |id| self.facts.node(*id));
            let text = if name == role {
                format!("{role} is not in {file}")
            } else {
                format!("{name} (role {role}) is not in {file}")
            };
            let policy = self.expectation.policy;
            let mut finding = Finding::new(FindingKind::UnexpectedNode, role, policy.at, text)
                .saw("present", "not named");
            finding.severity = policy.nodes.severity().unwrap_or(finding.severity);
            finding.accept = Some(role.to_owned());
            finding.when = self.facts.lives(nodes).first().copied();
            found.push(finding);
        }
        found
    }

    /// Every node name in the file.
    fn named_nodes(&self) -> NamePatterns<'_> {
        let mut all: Vec<&Pattern> = self.expectation.nodes.iter().map(|n| &n.name).collect();
        for topic in &self.expectation.topics {
            let lists = topic.facts.by.iter().chain(&topic.facts.to);
            all.extend(lists.flat_map(|list| &list.value).map(|name| &name.value));
        }
        for rule in &self.expectation.rules {
            if let Demand::Nodes(names, _) | Demand::Order(names) = &rule.demand {
                all.extend(names.iter().map(|name| &name.value));
            }
        }
        all.into_iter().collect()
    }

    fn strange_topics(&self) -> Vec<Finding> {
        let known: NamePatterns<'_> = self.expectation.topics.iter().map(|t| &t.name).collect();
        let policy = self.expectation.policy;
        let mut found = Vec::new();
        for topic in self.facts.topics(&Pattern::new("**")) {
            let name = self.facts.topic(topic);
            if known.hold(name)
                || self.facts.is_housekeeping(topic)
                || self.facts.messages(topic) == 0
            {
                continue;
            }
            let text = format!("{name} is not in {}", self.expectation.file.display());
            let mut finding = Finding::new(FindingKind::UnexpectedTopic, name, policy.at, text)
                .saw("present", "not named");
            finding.severity = policy.topics.severity().unwrap_or(finding.severity);
            finding.accept = Some(name.to_owned());
            found.push(finding);
        }
        found
    }
}
