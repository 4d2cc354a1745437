//! Checks a mission against an expectation: every fact of the file separately.

mod allow;
mod event;
mod measure;
mod node;
mod policy;
mod rate;
mod rule;
mod topic;

use std::cell::Cell;

use super::expectation::{At, Expectation, Unlisted, YamlPlace};
use super::facts::Facts;
use super::finding::{Cause, Finding, Severity, number};
use super::pattern::Pattern;
use crate::base::nearest::nearest;
use crate::base::words::visible;
use crate::mission::Mission;

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

/// The judgement of a fact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Judgement {
    /// The mission meets it.
    Kept,
    /// It has an error or a warning.
    Broken,
    /// The bag does not show whether it is met.
    Undecidable,
    /// There is nothing to check.
    Moot,
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
        judge.node(named);
    }
    for named in &expectation.topics {
        judge.topic(named);
    }
    for rule in &expectation.rules {
        judge.rule(rule);
    }
    judge.policy();
    judge.allow();
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

/// The most missing names for which the nearest one is reported; with more, the file is for another robot.
const NEAR: usize = 50;

impl Judge<'_> {
    /// The hint for a missing name: the nearest one.
    fn near<'k>(&self, pattern: &Pattern, known: impl Iterator<Item = &'k str>) -> Option<String> {
        self.searched.set(self.searched.get() + 1);
        let near = (self.searched.get() <= NEAR).then(|| nearest(pattern.as_str(), known));
        Some(format!("the nearest name in the bag is `{}`", near??))
    }

    /// The findings of all checks but the first ones.
    fn found_since(&mut self, before: usize) -> impl Iterator<Item = &mut Finding> {
        let checks = self.checks[before..].iter_mut();
        checks.flat_map(|check| &mut check.findings)
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

    /// Checks a fact of these nodes or topics, if the file has it; with nothing to check it is moot.
    fn check<S: ?Sized, T>(
        &mut self,
        (title, all): (&str, &S),
        key: &str,
        wanted: Option<&At<T>>,
        is_moot: bool,
        found: impl Fn(&Self, &S, &At<T>) -> Vec<Finding>,
    ) {
        let Some(wanted) = wanted else { return };
        let title = format!("{title} {key}");
        if is_moot {
            self.moot(title, wanted.at);
        } else {
            let found = found(self, all, wanted);
            self.note(title, wanted.at, found);
        }
    }

    /// Adds a fact about an absent element.
    fn moot(&mut self, title: impl Into<String>, place: YamlPlace) {
        self.checks.push(CheckedFact {
            title: title.into(),
            place,
            findings: Vec::new(),
            is_moot: true,
        });
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
