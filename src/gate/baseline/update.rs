//! Updates an expectation: rewrites facts that are no longer true and keeps every other character.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::{Draft, Line, Written, length, scalar, two_digits, whole};
use crate::base::error::{Error, Result};
use crate::base::nearest::suggestion;
use crate::base::words;
use crate::base::yaml::{self, BadYaml, YamlData, YamlNode, YamlPair};
use crate::gate::facts::{Facts, Role};
use crate::gate::finding::{Finding, FindingKind, Severity};
use crate::gate::values::Pattern;
use crate::gate::{Expectation, judge, read};
use crate::mission::Mission;

/// The most facts that are rewritten: each requires parsing the whole file, and beyond that, little of the
/// file would remain.
const MOST: usize = 1000;

/// Rewrites the facts that these runs break: for all names, or for those in `only`. Times do not count if each run `is_part` of a
/// recording.
///
/// # Errors
/// As [`read`], and if the file cannot be edited in place.
pub(crate) fn update(
    text: &str,
    path: &Path,
    runs: &[Mission],
    is_part: bool,
    only: &[String],
) -> Result<Written> {
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
    let checks = |run| judge(&expectation, run, is_part).checks;
    let found = runs.iter().flat_map(checks);
    let found = found.flat_map(|check| check.findings);
    let findings: Vec<Finding> = found.filter(|f| f.severity != Severity::Unknown).collect();
    let left = findings.iter().filter(|f| f.accept.is_none()).count();
    let mut seen = BTreeSet::new();
    let named = findings.iter();
    let named = named.filter_map(|f| Some((f.accept.as_deref()?, f)));
    let wanted = named.filter(|(name, finding)| {
        let is_meant = |o: &String| o == name || *o == finding.name;
        (only.is_empty() || only.iter().any(is_meant))
            && seen.insert((*name, finding.kind.row().key))
    });
    let wanted: Vec<(&str, &Finding)> = wanted.collect();
    if wanted.len() > MOST {
        let (facts, path) = (words::count(wanted.len(), "fact"), path.display());
        return Err(Error::usage(
            format!("{facts} of `{path}` no longer match, as if it described another robot"),
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
    Ok(Written {
        text,
        changed,
        left,
        ..Written::default()
    })
}

/// Refuses a name that is neither in the file nor in the bags.
fn known(name: &str, expectation: &Expectation, draft: &Draft) -> Result<()> {
    let nodes = expectation.nodes.iter().map(|n| n.name.as_str());
    let topics = expectation.topics.iter().map(|t| t.name.as_str());
    let seen = draft.nodes.keys().chain(draft.topics.keys());
    let all = nodes.chain(topics).chain(seen.map(String::as_str));
    let all: BTreeSet<&str> = all.collect();
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
    let reason = format!("this cannot be changed in place: {}", bad.reason);
    let hint = "write the element as `/name: {key: value}` on one line";
    Error::bad_place(path, [bad.at.line, bad.at.column], &reason, hint)
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
        let key = finding.kind.row().key;
        let (section, lines) = if finding.kind.is_about_node() {
            ("nodes", &self.draft.nodes)
        } else {
            ("topics", &self.draft.topics)
        };
        match finding.kind {
            FindingKind::UnexpectedNode | FindingKind::UnexpectedTopic => {
                match lines.get(name).map(Line::text) {
                    Some(line) => self.text.insert(section, name, &line),
                    None => Ok(()),
                }
            }
            // One that is in some of the runs is optional.
            FindingKind::NodeMissing | FindingKind::TopicMissing if lines.contains_key(name) => {
                self.text.write(section, name, "optional", Some("true"))
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
                self.text.write("nodes", name, key, value.as_deref())
            }
            FindingKind::TopicRateLow | FindingKind::TopicRateHigh => {
                let mut topics = self.expectation.topics.iter();
                let own = topics.find(|own| own.name.as_str() == name);
                let own = own.map(|own| &own.facts);
                if own.is_some_and(|own| own.hz.is_some()) {
                    self.write_topic(name, "hz")?;
                }
                if own.is_some_and(|own| own.mean_hz.is_some()) {
                    self.write_topic(name, "mean_hz")?;
                }
                self.let_end(name)
            }
            FindingKind::TopicGap => {
                self.write_topic(name, key)?;
                self.let_end(name)
            }
            FindingKind::TopicQos => {
                self.text.write("topics", name, "qos", None)?;
                self.text.write("topics", name, "latched", None)
            }
            _ => self.write_topic(name, key),
        }
    }

    fn write_topic(&mut self, name: &str, key: &str) -> Result<(), BadYaml> {
        let value = self.of_topic(name, key);
        self.text.write("topics", name, key, value.as_deref())
    }

    /// The value of a node's key common to all runs; for a pattern, common to all matching nodes.
    fn of_node(&self, name: &str, key: &str) -> Option<String> {
        let pattern = Pattern::new(name);
        match (key, &matching(&self.draft.nodes, &pattern)[..]) {
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
            for Role { nodes, .. } in facts.nodes(pattern) {
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
        match matching(&self.draft.topics, &pattern)[..] {
            [line] => line.get(key),
            // A value that differs between the topics of a pattern is not used.
            _ => None,
        }
    }

    fn longest(&self, pattern: &Pattern) -> Option<String> {
        let mut longest = 0;
        for run in self.runs {
            let facts = Facts::new(run);
            for topic in facts.topics(pattern) {
                let own = facts.longest_of(topic, self.may_end(pattern));
                longest = longest.max(own.unwrap_or(0));
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
            Some(value) => self.text.write("topics", name, "may_end", Some(&value)),
            None => Ok(()),
        }
    }
}

/// The lines of the names that a pattern matches.
fn matching<'a>(lines: &'a BTreeMap<String, Line>, pattern: &Pattern) -> Vec<&'a Line> {
    let own = lines.iter().filter(|(name, _)| pattern.matches(name));
    own.map(|(_, line)| line).collect()
}

/// A YAML text in which single values are changed; every other character stays as it is.
#[derive(Clone, Debug)]
struct EditedText(String);

impl EditedText {
    /// Sets `key` of an entry to `value`, both as YAML, or removes it; does nothing without such an entry.
    fn write(
        &mut self,
        section: &str,
        entry: &str,
        key: &str,
        value: Option<&str>,
    ) -> Result<(), BadYaml> {
        let whole: YamlNode = yaml::read(&self.0)?;
        let Some(pair) = find(&whole, section).and_then(|s| find(&s.value, entry)) else {
            return Ok(());
        };
        match (&pair.value.data, find(&pair.value, key), value) {
            (_, Some(own), Some(value)) => self.replace(own, value),
            (_, Some(own), None) => self.remove(&pair.value, own),
            (YamlData::Map(pairs), None, Some(value)) => self.add(&pair.value, pairs, key, value),
            (_, None, Some(value)) => {
                let colon = self.after_key(pair);
                self.0.insert_str(colon, &format!(" {{{key}: {value}}}"));
            }
            (_, None, None) => {}
        }
        Ok(())
    }

    /// Removes an entry.
    fn drop_entry(&mut self, section: &str, entry: &str) -> Result<(), BadYaml> {
        let whole: YamlNode = yaml::read(&self.0)?;
        if let Some(section) = find(&whole, section)
            && let Some(pair) = find(&section.value, entry)
        {
            self.remove(&section.value, pair);
        }
        Ok(())
    }

    /// Adds an entry in sorted position.
    fn insert(&mut self, section: &str, entry: &str, value: &str) -> Result<(), BadYaml> {
        let whole: YamlNode = yaml::read(&self.0)?;
        let key = &scalar(entry);
        let Some(part) = find(&whole, section) else {
            let end = self.0.len();
            self.insert_line(end, &format!("{section}:\n  {key}: {value}\n"));
            return Ok(());
        };
        let YamlData::Map(pairs) = &part.value.data else {
            let end = self.line_end(self.after_key(part));
            self.insert_line(end, &format!("  {key}: {value}\n"));
            return Ok(());
        };
        let ends = pairs.first().zip(pairs.last());
        let Some((first, last)) = ends.filter(|_| !self.is_flow(&part.value)) else {
            self.add(&part.value, pairs, key, value);
            return Ok(());
        };
        let next = pairs.iter().find(|pair| pair.key.as_str() > entry);
        let line = format!("{}{key}: {value}\n", self.indent(first));
        let at = match next {
            Some(next) => self.line_start(next.bytes.start),
            None => self.line_end(self.end(last)),
        };
        self.insert_line(at, &line);
        Ok(())
    }

    /// Puts a whole line at `at`, which begins one.
    fn insert_line(&mut self, at: usize, line: &str) {
        let open = at > 0 && !self.0[..at].ends_with('\n');
        let before = if open { "\n" } else { "" };
        self.0.insert_str(at, &format!("{before}{line}"));
    }

    fn replace(&mut self, pair: &YamlPair, value: &str) {
        let colon = self.after_key(pair);
        let start = pair.value.bytes.start.max(colon);
        let end = self.end(pair).max(colon);
        // An inline value stays inline; a block list becomes inline.
        let is_inline = start <= end && !self.0[colon..start].contains('\n');
        let start = if is_inline { start } else { colon };
        let gap = if start == colon { " " } else { "" };
        self.0.replace_range(start..end, &format!("{gap}{value}"));
    }

    fn add(&mut self, body: &YamlNode, pairs: &[YamlPair], key: &str, value: &str) {
        if self.is_flow(body) {
            let close = self.end_of(body).saturating_sub(1);
            let comma = if pairs.is_empty() { "" } else { ", " };
            self.0.insert_str(close, &format!("{comma}{key}: {value}"));
        } else if let Some(first) = pairs.first() {
            let line = format!("{}{key}: {value}\n", self.indent(first));
            let start = self.line_start(first.bytes.start);
            self.0.insert_str(start, &line);
        }
    }

    fn remove(&mut self, body: &YamlNode, pair: &YamlPair) {
        let (start, end) = (pair.bytes.start, self.end(pair));
        let range = if !self.is_flow(body) {
            self.line_start(start)..self.line_end(end)
        } else if let Some(after) = self.0[end..].trim_start().strip_prefix(',') {
            start..self.0.len() - after.trim_start().len()
        } else {
            let before = self.0[..start].trim_end();
            before.strip_suffix(',').map_or(start, str::len)..end
        };
        self.0.replace_range(range, "");
    }

    /// The byte at which the value of a pair ends.
    fn end(&self, pair: &YamlPair) -> usize {
        self.end_of(&pair.value).max(self.after_key(pair))
    }

    /// The byte at which a value ends; 0 for none.
    fn end_of(&self, value: &YamlNode) -> usize {
        let inside = match &value.data {
            YamlData::Scalar if value.bytes.is_empty() => return 0,
            YamlData::Scalar => return value.bytes.end,
            YamlData::List(list) => list.last().map(|last| self.end_of(last)),
            YamlData::Map(pairs) => pairs.last().map(|last| self.end(last)),
        };
        let inside = inside.unwrap_or(value.bytes.start);
        if !self.is_flow(value) {
            return inside;
        }
        // After the last member come only a comma and comments.
        let mut is_comment = false;
        let bracket = self.0[inside..].char_indices().find(|(at, c)| {
            is_comment = match c {
                '#' => is_comment || self.0[..inside + at].ends_with([' ', '\n']),
                '\n' => false,
                _ => is_comment,
            };
            !is_comment && matches!(c, ']' | '}')
        });
        bracket.map_or(self.0.len(), |(at, _)| inside + at + 1)
    }

    fn is_flow(&self, part: &YamlNode) -> bool {
        self.0[part.bytes.start..].starts_with(['{', '['])
    }

    /// The byte after the colon of a key.
    fn after_key(&self, pair: &YamlPair) -> usize {
        let colon = self.0[pair.bytes.end..].find(':');
        colon.map_or(self.0.len(), |at| pair.bytes.end + at + 1)
    }

    fn indent(&self, pair: &YamlPair) -> String {
        let start = self.line_start(pair.bytes.start);
        " ".repeat(self.0[start..pair.bytes.start].chars().count())
    }

    fn line_start(&self, at: usize) -> usize {
        self.0[..at].rfind('\n').map_or(0, |end| end + 1)
    }

    /// The beginning of the line after `at`.
    fn line_end(&self, at: usize) -> usize {
        let end = self.0[at..].find('\n');
        end.map_or(self.0.len(), |end| at + end + 1)
    }
}

fn find<'a>(part: &'a YamlNode, key: &str) -> Option<&'a YamlPair> {
    match &part.data {
        YamlData::Map(pairs) => pairs.iter().find(|pair| pair.key == key),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "\
# ours
nodes:
  /a: {} # first
  /c:   {restarts: ..0}   # kept

topics:
  /scan: {hz: 9..11, by: [/a, \"/b: x\"]} # fast
  /block:
    # slow, but even
    hz: 1..2   # rate
    by:
      - /a
      - /c
  /null:
";

    fn edited(edit: impl Fn(&mut EditedText) -> Result<(), BadYaml>) -> String {
        let mut text = EditedText(FILE.to_owned());
        edit(&mut text).unwrap();
        yaml::read::<YamlNode>(&text.0).unwrap();
        text.0
    }

    /// The lines that are not in both.
    fn differing(text: &str) -> (Vec<&str>, Vec<&str>) {
        let gone = FILE.lines().filter(|l| !text.lines().any(|o| o == *l));
        let new = text.lines().filter(|l| !FILE.lines().any(|o| o == *l));
        (gone.collect(), new.collect())
    }

    /// Checks that an edit replaces only this part of the file.
    fn replaces(edit: impl Fn(&mut EditedText) -> Result<(), BadYaml>, old: &str, new: &str) {
        assert_eq!(edited(edit), FILE.replace(old, new));
    }

    #[test]
    fn only_the_value_is_changed() {
        let topic =
            |name, key, value| move |t: &mut EditedText| t.write("topics", name, key, Some(value));
        replaces(topic("/scan", "hz", "5..6"), "9..11", "5..6");
        replaces(topic("/scan", "by", "[/z]"), "[/a, \"/b: x\"]", "[/z]");
        replaces(topic("/block", "hz", "5..6"), "1..2", "5..6");
        let list = "by:\n      - /a\n      - /c";
        replaces(topic("/block", "by", "[/z]"), list, "by: [/z]");
    }

    #[test]
    fn keys_are_added_to_entries_with_or_without_keys() {
        let ends = |name| move |t: &mut EditedText| t.write("nodes", name, "may_end", Some("true"));
        replaces(ends("/a"), "/a: {} #", "/a: {may_end: true} #");
        replaces(ends("/c"), "..0}", "..0, may_end: true}");
        let rate = |t: &mut EditedText| t.write("topics", "/null", "hz", Some("1.."));
        replaces(rate, "/null:", "/null: {hz: 1..}");
        let text = edited(|t| t.write("topics", "/block", "latched", Some("true")));
        let added = differing(&text);
        assert_eq!(added, (vec![], vec!["    latched: true"]));
    }

    #[test]
    fn entries_are_added_and_removed_with_their_lines() {
        replaces(|t| t.drop_entry("nodes", "/a"), "  /a: {} # first\n", "");
        replaces(|t| t.drop_entry("topics", "/null"), "  /null:\n", "");
        replaces(
            |t| t.write("topics", "/scan", "hz", None),
            "hz: 9..11, ",
            "",
        );
        let by = ", by: [/a, \"/b: x\"]";
        replaces(|t| t.write("topics", "/scan", "by", None), by, "");
        let insert = |name| move |t: &mut EditedText| t.insert("nodes", name, "{}");
        replaces(insert("/b"), "  /c:  ", "  /b: {}\n  /c:  ");
        replaces(insert("/d"), "# kept\n", "# kept\n  /d: {}\n");
        let text = edited(|t| t.insert("rules", "/d", "{}"));
        assert_eq!(text, format!("{FILE}rules:\n  /d: {{}}\n"));
    }
}
