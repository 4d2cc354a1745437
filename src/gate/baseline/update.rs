//! Updates an expectation: rewrites facts that are no longer true and keeps every other character.

use std::collections::BTreeSet;
use std::path::Path;

use super::edit::EditedText;
use super::{Draft, Line, length, scalar, two_digits};
use crate::base::error::{Error, Result};
use crate::base::nearest::suggestion;
use crate::base::words;
use crate::base::yaml::BadYaml;
use crate::gate::facts::Facts;
use crate::gate::finding::{Finding, FindingKind, Severity};
use crate::gate::pattern::Pattern;
use crate::gate::{Expectation, judge, read};
use crate::mission::Mission;

/// The most facts that are rewritten: each requires parsing the whole file, and beyond that, little of the
/// file would remain.
const MOST: usize = 1000;

/// An updated expectation.
#[derive(Debug)]
pub(crate) struct Update {
    /// The whole file.
    pub(crate) text: String,
    /// The number of rewritten facts.
    pub(crate) changed: usize,
    /// The number of findings that only the author of a rule can resolve.
    pub(crate) left: usize,
}

/// Rewrites the facts that these runs, or parts of runs, break: for all names, or for those in `only`.
///
/// # Errors
/// As [`read`], and if the file cannot be edited in place.
pub(crate) fn update(
    text: &str,
    path: &Path,
    (runs, is_part): (&[Mission], bool),
    only: &[String],
) -> Result<Update> {
    let expectation = read(text, path)?;
    let draft = Draft::of(runs, is_part);
    for name in only {
        known(name, &expectation, &draft)?;
    }
    let mut work = Work {
        text: EditedText(text.to_owned()),
        expectation: &expectation,
        draft: &draft,
        runs,
    };
    let findings = broken(&expectation, runs, is_part);
    let left = findings.iter().filter(|f| f.accept.is_none()).count();
    let mut seen = BTreeSet::new();
    let named = findings
        .iter()
        .filter_map(|f| Some((f.accept.as_deref()?, f)));
    let wanted = named.filter(|(name, finding)| {
        let is_meant = |o: &String| o == name || *o == finding.name;
        (only.is_empty() || only.iter().any(is_meant)) && seen.insert((*name, fact(finding.kind)))
    });
    let wanted: Vec<(&str, &Finding)> = wanted.collect();
    if wanted.len() > MOST {
        return Err(Error::usage(
            format!(
                "{} of `{}` no longer match, as if it described another robot",
                words::count(wanted.len(), "fact"),
                path.display()
            ),
            "generate a new one with `bagreel baseline BAG -o graph.yaml`, or update single names with `--only NAME`",
        ));
    }
    let mut changed = 0;
    for (name, finding) in &wanted {
        let before = work.text.0.clone();
        work.accept(name, finding)
            .map_err(|bad| unchanged(path, &bad))?;
        changed += usize::from(work.text.0 != before);
    }
    let text = work.text.0;
    read(&text, path)?;
    Ok(Update {
        text,
        changed,
        left,
    })
}

/// Refuses a name that is neither in the file nor in the bags.
fn known(name: &str, expectation: &Expectation, draft: &Draft) -> Result<()> {
    let nodes = expectation.nodes.iter().map(|n| n.name.as_str());
    let topics = expectation.topics.iter().map(|t| t.name.as_str());
    let seen = draft.nodes.keys().chain(draft.topics.keys());
    let all: BTreeSet<&str> = nodes
        .chain(topics)
        .chain(seen.map(String::as_str))
        .collect();
    if all.contains(name) {
        return Ok(());
    }
    let near = suggestion(name, all.into_iter());
    Err(Error::usage(
        format!("`--only {name}` is neither in the file nor in the bag{near}"),
        "use the exact name of a node or topic",
    ))
}

fn unchanged(path: &Path, bad: &BadYaml) -> Error {
    Error::BadFile {
        path: path.to_owned(),
        line: bad.at.line,
        column: bad.at.column,
        reason: format!("this cannot be changed in place: {}", bad.reason),
        hint: "write the element as `/name: {key: value}` on one line".to_owned(),
    }
}

/// The findings of these runs.
fn broken(expectation: &Expectation, runs: &[Mission], is_part: bool) -> Vec<Finding> {
    let verdicts = runs.iter().map(|run| judge(expectation, run, is_part));
    let findings = verdicts
        .flat_map(|verdict| verdict.checks)
        .flat_map(|check| check.findings);
    let is_broken = |f: &Finding| {
        matches!(f.severity, Severity::Error | Severity::Warning)
            && f.kind != FindingKind::AllowUnused
    };
    findings.filter(is_broken).collect()
}

/// The key that a finding is about; empty for the element itself.
fn fact(kind: FindingKind) -> &'static str {
    match kind {
        FindingKind::NodeGone | FindingKind::TopicGone => "may_end",
        FindingKind::NodeLate | FindingKind::TopicLate => "within",
        FindingKind::NodeRestarted => "restarts",
        FindingKind::NodeLifecycle => "lifecycle",
        FindingKind::TopicType => "type",
        FindingKind::TopicQos => "qos",
        FindingKind::TopicRateLow | FindingKind::TopicRateHigh => "hz",
        FindingKind::TopicGap => "max_gap",
        FindingKind::PublisherMissing | FindingKind::PublisherUnexpected => "by",
        FindingKind::SubscriberMissing => "to",
        _ => "",
    }
}

/// An update in progress.
struct Work<'a> {
    text: EditedText,
    expectation: &'a Expectation,
    draft: &'a Draft,
    runs: &'a [Mission],
}

impl Work<'_> {
    /// Rewrites the fact that a finding is about; `name` is the entry's.
    fn accept(&mut self, name: &str, finding: &Finding) -> Result<(), BadYaml> {
        let key = fact(finding.kind);
        let (section, lines) = if finding.kind.is_about_node() {
            ("nodes", &self.draft.nodes)
        } else {
            ("topics", &self.draft.topics)
        };
        match finding.kind {
            FindingKind::UnexpectedNode | FindingKind::UnexpectedTopic => {
                match lines.get(name).map(Line::text) {
                    Some(line) => self.text.insert(section, name, &scalar(name), &line),
                    None => Ok(()),
                }
            }
            // One that is in some of the runs is optional.
            FindingKind::NodeMissing | FindingKind::TopicMissing if lines.contains_key(name) => {
                self.text.set(section, name, "optional", "true")
            }
            FindingKind::NodeMissing
            | FindingKind::TopicMissing
            | FindingKind::NodeForbidden
            | FindingKind::TopicForbidden => self.text.drop_entry(section, name),
            FindingKind::NodeGone
            | FindingKind::NodeLate
            | FindingKind::NodeRestarted
            | FindingKind::NodeLifecycle => {
                let value = self.of_node(name, key);
                if key == "within" {
                    self.text.unset("nodes", name, "present_within")?;
                }
                self.write("nodes", name, key, value)
            }
            FindingKind::TopicRateLow | FindingKind::TopicRateHigh => {
                let mut own = self.expectation.topics.iter();
                let own = own
                    .find(|own| own.name.as_str() == name)
                    .map(|own| &own.facts);
                let is_there = [
                    ("hz", own.is_some_and(|own| own.hz.is_some())),
                    ("mean_hz", own.is_some_and(|own| own.mean_hz.is_some())),
                ];
                for (key, _) in is_there.into_iter().filter(|(_, is_there)| *is_there) {
                    let value = self.of_topic(name, key);
                    self.write("topics", name, key, value)?;
                }
                self.let_end(name)
            }
            FindingKind::TopicGap => {
                let value = self.of_topic(name, key);
                self.write("topics", name, key, value)?;
                self.let_end(name)
            }
            FindingKind::TopicQos => {
                self.text.unset("topics", name, "qos")?;
                self.text.unset("topics", name, "latched")
            }
            _ => {
                let value = self.of_topic(name, key);
                self.write("topics", name, key, value)
            }
        }
    }

    fn write(
        &mut self,
        section: &str,
        name: &str,
        key: &str,
        value: Option<String>,
    ) -> Result<(), BadYaml> {
        match value {
            Some(value) => self.text.set(section, name, key, &value),
            None => self.text.unset(section, name, key),
        }
    }

    /// The value of a node's key common to all runs; for a pattern, common to all matching nodes.
    fn of_node(&self, name: &str, key: &str) -> Option<String> {
        let pattern = Pattern::new(name);
        let lines = self
            .draft
            .nodes
            .iter()
            .filter(|(role, _)| pattern.matches(role));
        let lines: Vec<&Line> = lines.map(|(_, line)| line).collect();
        match (key, &lines[..]) {
            ("within", [line]) => line.get(key).or_else(|| self.began(&pattern)),
            ("within", _) => self.began(&pattern),
            (_, [line]) => line.get(key),
            ("may_end", _) => Some("true".to_owned()),
            ("restarts", all) => {
                let values = all.iter().filter_map(|line| line.get(key));
                // Of `..2` and `..10` the longer text is the larger number.
                values.max_by_key(|text| (text.len(), text.clone()))
            }
            (_, all) => {
                let first = all.first()?.get(key);
                first.filter(|own| all.iter().all(|line| line.get(key).as_ref() == Some(own)))
            }
        }
    }

    /// The time range in whole seconds in which a node appeared in all runs.
    fn began(&self, pattern: &Pattern) -> Option<String> {
        let mut latest = 0;
        for run in self.runs {
            let facts = Facts::new(run);
            for (_, nodes) in facts.nodes(pattern) {
                let began = facts.began(nodes)?;
                latest = latest.max(began.time.since(run.span.start));
            }
        }
        Some(format!("..{}", length(whole(latest))))
    }

    /// The value of a topic's key common to all runs.
    fn of_topic(&self, name: &str, key: &str) -> Option<String> {
        let pattern = Pattern::new(name);
        if key == "max_gap" {
            return self.longest(&pattern);
        }
        // A value that differs between the topics of a pattern is not used.
        let lines = self
            .draft
            .topics
            .iter()
            .filter(|(topic, _)| pattern.matches(topic));
        let [line] = lines.map(|(_, line)| line).collect::<Vec<_>>()[..] else {
            return None;
        };
        line.get(key)
    }

    fn longest(&self, pattern: &Pattern) -> Option<String> {
        let mut longest = 0;
        for run in self.runs {
            let facts = Facts::new(run);
            for topic in facts.topics(pattern) {
                let silences = facts.silences(topic, self.may_end(pattern), run.span);
                longest = silences.iter().map(|s| s.nanos).fold(longest, i64::max);
            }
        }
        (longest > 0).then(|| length(two_digits(longest)))
    }

    /// Whether the file lets a topic end, or it ended in these runs.
    fn may_end(&self, pattern: &Pattern) -> bool {
        let mut topics = self.expectation.topics.iter();
        topics.any(|own| own.name == *pattern && own.facts.may_end.is_some())
            || self.ended(pattern.as_str()).is_some()
    }

    /// The time range in which a topic ended in these runs, the draft's; `None` if it stayed.
    fn ended(&self, name: &str) -> Option<String> {
        let may_end = self.of_topic(name, "may_end")?;
        (!may_end.starts_with('-')).then_some(may_end)
    }

    /// Lets a topic end that ended in these runs: its rate and gaps are checked until then.
    fn let_end(&mut self, name: &str) -> Result<(), BadYaml> {
        match self.ended(name) {
            Some(value) => self.text.set("topics", name, "may_end", &value),
            None => Ok(()),
        }
    }
}

/// The nanoseconds rounded up to a whole second.
fn whole(nanos: i64) -> i64 {
    const SECOND: i64 = 1_000_000_000;
    nanos.saturating_add(SECOND - 1) / SECOND * SECOND
}
