//! Verdicts and differences in formats for people, for programs, and for CI services.

mod data;
mod differences;
mod summary;
mod text;

use std::collections::{BTreeMap, BTreeSet};

pub(crate) use data::unchecked;

use super::difference::{DiffSubject, Difference};
use super::finding::{Finding, FindingKind, KINDS, Severity};
use super::judge::Verdict;
use crate::base::columns::hang;
use crate::base::error::{Error, Result};
use crate::base::nearest::suggestion;
use crate::base::words::{self, visible};
use crate::mission::Mission;

/// The subject of a report: the mission, with the names as given.
#[derive(Clone, Debug)]
pub(crate) struct Subject<'a> {
    pub(crate) mission: &'a Mission,
    /// The bags, as given.
    pub(crate) bags: Vec<String>,
    /// The expectation, as given.
    pub(crate) file: String,
    /// The path of the expectation from the root of its repository, which services compare with changed files.
    pub(crate) tracked: String,
}

/// A format of verdicts, and perhaps of differences.
#[derive(Clone, Copy, Debug)]
pub struct ReportFormat {
    /// Its name in `--format` and before a colon in `-o`.
    pub(crate) word: &'static str,
    /// Its file extensions.
    pub(crate) endings: &'static [&'static str],
    /// Its description, for the help.
    pub(crate) what: &'static str,
    pub(crate) verdict: fn(&Subject<'_>, &Verdict) -> String,
    pub(crate) differences: Option<fn(&DiffSubject, &[Difference]) -> String>,
}

/// All formats.
pub(crate) const FORMATS: &[ReportFormat] = &[
    ReportFormat {
        word: "text",
        endings: &[".txt"],
        what: "for people: findings with file and line, grouped by cause",
        verdict: text::text,
        differences: Some(differences::text),
    },
    ReportFormat {
        word: "gitlab",
        endings: &[
            "codequality.json",
            "code-quality-report.json",
            "code-quality.json",
        ],
        what: "GitLab's code quality; also called codequality",
        verdict: data::gitlab,
        differences: None,
    },
    ReportFormat {
        word: "json",
        endings: &[".json"],
        what: "everything, for programs",
        verdict: data::json,
        differences: Some(differences::json),
    },
    ReportFormat {
        word: "markdown",
        endings: &[".md", ".markdown"],
        what: "a summary for a pull request, with the graph around the changes",
        verdict: summary::write,
        differences: Some(differences::markdown),
    },
    ReportFormat {
        word: "junit",
        endings: &[".xml"],
        what: "a test case for every fact of the file",
        verdict: data::junit,
        differences: None,
    },
    ReportFormat {
        word: "sarif",
        endings: &[".sarif", ".sarif.json"],
        what: "SARIF 2.1.0, for code scanning",
        verdict: data::sarif,
        differences: None,
    },
    ReportFormat {
        word: "github",
        endings: &[],
        what: "GitHub's annotations, then the text",
        verdict: text::github,
        differences: None,
    },
];

impl ReportFormat {
    /// The format of a word: `text`, `json` and `markdown`; of verdicts also `junit`, `sarif`, `github` and `gitlab`.
    pub fn from_word(word: &str) -> Option<&'static Self> {
        let word = match word {
            "codequality" => "gitlab",
            "md" => "markdown",
            word => word,
        };
        FORMATS.iter().find(|f| f.word == word)
    }

    /// The format of a file name, among these: the one with the longest matching extension.
    pub(crate) fn of_name(name: &str, fits: fn(&Self) -> bool) -> Option<&'static Self> {
        let name = name.to_ascii_lowercase();
        let endings = |f: &'static Self| f.endings.iter().map(move |ending| (*ending, f));
        let all = FORMATS.iter().filter(|f| fits(f)).flat_map(endings);
        let fitting = all.filter(|(ending, _)| name.ends_with(ending));
        let longest = fitting.max_by_key(|(ending, _)| ending.len());
        longest.map(|(_, format)| format)
    }
}

/// A text without GitHub's commands: its runners interpret this anywhere in a line.
fn inert_groups(text: &str) -> String {
    text.replace("##[", "#\\#[")
}

/// A cell of a table in Markdown.
fn cell(text: &str, escaped: fn(&str) -> String) -> String {
    match text {
        "" => "–".to_owned(),
        text => escaped(text),
    }
}

impl Subject<'_> {
    /// The bags by their names, without folders.
    fn name(&self) -> String {
        let names = self.mission.bags.iter();
        let names = names.map(|bag| visible(&bag.name));
        match words::some_of(names, 2) {
            none if none.is_empty() => words::some_of(&self.bags, 2),
            some => some,
        }
    }

    /// The command that accepts the findings about these names; all findings without one.
    fn accept(&self, names: &BTreeSet<&str>) -> String {
        let bags = words::joined(self.bags.iter().map(|bag| quoted(bag)), " ");
        let only = names.iter().map(|name| format!(" --only {}", quoted(name)));
        let (only, file) = (only.collect::<String>(), quoted(&self.file));
        format!("bagreel baseline {bags} --update {file}{only}")
    }
}

impl Verdict {
    /// The numbers of findings as text: `2 errors`, `1 warning`, `1 unknown`.
    fn counts(&self) -> Vec<String> {
        let counts = Severity::ALL.map(|severity| (severity, self.count(severity)));
        let some = counts.into_iter().filter(|(_, count)| *count > 0);
        some.map(|(severity, count)| match severity {
            Severity::Unknown => format!("{count} unknown"),
            severity => words::count(count, severity.word()),
        })
        .collect()
    }
}

/// Text quoted for a shell, if necessary.
fn quoted(text: &str) -> String {
    let text = visible(text);
    let harmless = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '_' | '-' | '.' | ':');
    if !text.is_empty() && text.chars().all(harmless) {
        return text.into_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// The meaning of a kind of finding, for `--explain`, in lines of at most `width` characters.
///
/// # Errors
/// [`Error::Usage`] for an unknown word.
pub(crate) fn explain(word: &str, width: usize) -> Result<String> {
    let words = || KINDS.iter().map(|row| row.word);
    let Some(kind) = FindingKind::from_word(word) else {
        let near = suggestion(word, words());
        let what = format!("unknown kind of finding `{word}`{near}");
        let hint = format!("choose one of {}", words::joined(words(), ", "));
        return Err(Error::usage(what, hint));
    };
    let row = kind.row();
    let [meaning, more] = [row.meaning, row.more].map(|text| hang("", text, 0, Some(width)));
    Ok(format!("{word}\n\n{meaning}\n{more}"))
}

/// Findings with one cause, or one without.
struct Group<'a> {
    cause: Option<&'a str>,
    findings: Vec<&'a Finding>,
}

/// The findings, the worst first, grouped by cause; those without a cause are separate.
fn grouped<'a>(findings: &[&'a Finding]) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for finding in findings {
        let cause = finding.cause.as_ref().map(|c| c.text.as_str());
        let place = cause.map(|cause| *places.entry(cause).or_insert(groups.len()));
        match place.and_then(|place| groups.get_mut(place)) {
            Some(group) => group.findings.push(finding),
            None => groups.push(Group {
                cause,
                findings: vec![finding],
            }),
        }
    }
    groups
}
