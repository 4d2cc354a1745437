//! A summary in Markdown for a pull request or a job: its first line is the outcome, its table lists the findings
//! with their times.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::{Subject, grouped, mermaid};
use crate::base::words;
use crate::export::report::escape::{code, plain};
use crate::gate::facts::Facts;
use crate::gate::finding::{Finding, FindingKind, Severity};
use crate::gate::judge::{Judgement, Verdict};

/// The most bytes of each part; with a chart they stay below 256 KiB, a quarter of the limit of a job's summary.
const MOST_ROWS: usize = 96 << 10;
const MOST_LISTED: usize = 24 << 10;
/// The number of findings that are expanded; the rest is collapsed.
const SHOWN: usize = 12;
/// The largest number of causes that are reported.
const CAUSES: usize = 3;

/// The report; ends in a new line.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let facts = Facts::new(subject.mission);
    let of_severity = |severities: &[Severity]| -> Vec<&Finding> {
        let own = findings.iter().filter(|f| severities.contains(&f.severity));
        own.copied().collect()
    };
    let broken = of_severity(&[Severity::Error, Severity::Warning]);
    let mut out = headline(subject, verdict) + "\n\n";
    // The most severe first, then those with the most consequences.
    let mut groups = grouped(&broken);
    groups.sort_by_key(|(_, group)| (group.first().map(|f| f.severity), Reverse(group.len())));
    causes(&groups, &mut out);
    table(&facts, &groups, &mut out);
    if let Some(chart) = mermaid::chart(&facts, &broken) {
        let open = "<details><summary>Graph around the changes</summary>";
        let _ = writeln!(out, "{open}\n\n```mermaid\n{chart}```\n</details>\n");
    }
    if broken.iter().any(|f| f.accept.is_some()) {
        let open = "<details><summary>Accept these changes</summary>";
        let _ = writeln!(
            out,
            "{open}\n\n{}\n</details>\n",
            command(&subject.accept(None))
        );
    }
    list(
        &of_severity(&[Severity::Unknown]),
        "What this bag cannot tell",
        &mut out,
    );
    list(&of_severity(&[Severity::Allowed]), "Allowed", &mut out);
    let (bag, file) = (mark(&subject.name()), mark(&subject.tracked));
    let _ = writeln!(out, "<!-- bagreel:{bag}:{file} -->");
    out
}

/// The first line: the outcome in short.
fn headline(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let mission = subject.mission;
    let any = |severity| verdict.count(severity) > 0;
    let sign = if any(Severity::Error) {
        "❌"
    } else if any(Severity::Warning) {
        "⚠️"
    } else if verdict.is_blind() {
        "❔"
    } else {
        "✅"
    };
    let kept = words::count(verdict.facts(Judgement::Kept), "rule");
    let unknown = match verdict.count(Severity::Unknown) {
        0 => String::new(),
        unknown => format!("{unknown} unknown"),
    };
    let mut parts = vec![verdict.broken(), unknown, format!("{kept} passed")];
    parts.retain(|words| !words.is_empty());
    format!(
        "### {sign} Graph check: {} · {} against {} · {} in windows of {}",
        parts.join(", "),
        code(&subject.name()),
        code(&subject.file),
        words::duration(mission.span.nanos()),
        words::period(mission.period.nanos())
    )
}

/// Writes the causes of several findings, those of most findings first.
fn causes(groups: &[(Option<&str>, Vec<&Finding>)], out: &mut String) {
    let several = groups.iter().filter(|(_, group)| group.len() > 1);
    let several = several.filter_map(|(cause, group)| Some(((*cause)?, group.len())));
    let several: Vec<(&str, usize)> = several.collect();
    for (cause, many) in several.iter().take(CAUSES) {
        let many = words::count(*many, "finding");
        let _ = writeln!(out, "- **{}**: {many}", plain(cause));
    }
    match several.len() {
        0 => {}
        n if n > CAUSES => {
            let _ = writeln!(out, "- and {} more such causes\n", n - CAUSES);
        }
        _ => out.push('\n'),
    }
}

/// Writes the table of findings, those of one cause one after the other.
fn table(facts: &Facts<'_>, groups: &[(Option<&str>, Vec<&Finding>)], out: &mut String) {
    let rows = groups.iter().flat_map(|(_, group)| {
        let is_alone = group.len() == 1;
        group.iter().map(move |f| row(facts, f, is_alone))
    });
    let mut rows: Vec<String> = rows.collect();
    let all = rows.len();
    let mut room = MOST_ROWS;
    let fitting = rows.iter().take_while(|row| {
        room = room.saturating_sub(row.len());
        room > 0
    });
    rows.truncate(fitting.count());
    let left_out = all - rows.len();
    let (shown, rest) = rows.split_at(rows.len().min(SHOWN));
    let head = "| | what | when | seen | expected |\n|---|---|---|---|---|\n";
    if !shown.is_empty() {
        let _ = writeln!(out, "{head}{}", shown.concat());
    }
    if !rest.is_empty() {
        let open = format!("<details><summary>{} more</summary>", rest.len() + left_out);
        let _ = writeln!(out, "{open}\n\n{head}{}\n</details>\n", rest.concat());
    }
    if left_out > 0 {
        let _ = writeln!(out, "{left_out} left out.\n");
    }
}

fn row(facts: &Facts<'_>, finding: &Finding, is_alone: bool) -> String {
    let sign = if finding.severity == Severity::Error {
        "❌"
    } else {
        "⚠️"
    };
    let when = match finding.when {
        Some(span) => facts.stretch(span),
        None if finding.kind == FindingKind::NodeLifecycle => "at the end".to_owned(),
        None => "–".to_owned(),
    };
    let since = match &finding.cause {
        Some(cause) if is_alone && !cause.is_about(&finding.name) => {
            format!(", since {}", plain(&cause.text))
        }
        _ => String::new(),
    };
    let cell = |text: &str| {
        if text.is_empty() {
            "–".to_owned()
        } else {
            value(text)
        }
    };
    // Pull requests are skimmed: the kind instead of the whole sentence.
    let word = finding.kind.word();
    let short = word.strip_prefix("node-").or(word.strip_prefix("topic-"));
    let what = short.unwrap_or(word).replace('-', " ");
    format!(
        "| {sign} | {} {what} | {when}{since} | {} | {} |\n",
        code(&finding.name),
        cell(&finding.seen),
        cell(&finding.expected)
    )
}

/// A value: names as code, other words unchanged.
fn value(text: &str) -> String {
    if text.starts_with('/') {
        code(text)
    } else {
        plain(text)
    }
}

fn list(findings: &[&Finding], title: &str, out: &mut String) {
    if findings.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "<details><summary>{title}: {}</summary>\n",
        findings.len()
    );
    let start = out.len();
    let mut hinted = BTreeSet::new();
    for (at, finding) in findings.iter().enumerate() {
        let why = finding
            .why
            .as_ref()
            .map_or_else(String::new, |why| format!(": {}", plain(why)));
        // Hints apply to all findings of a kind.
        let mut help = String::new();
        for fresh in finding.help.iter().filter(|help| hinted.insert(*help)) {
            let _ = write!(help, ": {}", plain(fresh));
        }
        let line = format!("- {}{why}{help}\n", plain(&finding.text));
        if out.len() - start + line.len() > MOST_LISTED {
            let _ = writeln!(out, "- {} more left out", findings.len() - at);
            break;
        }
        out.push_str(&line);
    }
    out.push_str("\n</details>\n\n");
}

/// A command that can be copied: a block of code, whose fence is longer than any run of backticks inside.
fn command(text: &str) -> String {
    let mut longest = 0;
    let mut run = 0;
    for c in text.chars() {
        run = if c == '`' { run + 1 } else { 0 };
        longest = longest.max(run);
    }
    let fence = "`".repeat((longest + 1).max(3));
    format!("{fence}sh\n{text}\n{fence}")
}

/// A marker comment by which an action finds its earlier text, without characters that end the comment.
fn mark(name: &str) -> String {
    let harmless = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    let mark: String = name
        .chars()
        .map(|c| if harmless(c) { c } else { '_' })
        .collect();
    let endings = [".mcap", ".bag", ".db3", ".yaml", ".yml"];
    let mark = endings
        .iter()
        .fold(mark.as_str(), |mark, ending| mark.trim_end_matches(ending));
    mark.chars().take(100).collect()
}
