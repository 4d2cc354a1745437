//! Findings for people, in the style of compilers: the finding, its position, the observed value, and hints; and for GitHub,
//! whose annotations come first.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::{Subject, grouped, inert_groups};
use crate::base::words;
use crate::gate::finding::{Finding, Severity};
use crate::gate::judge::{Judgement, Verdict};

/// The text; ends in a new line.
pub(super) fn text(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let mut out = String::new();
    let mut hinted = BTreeSet::new();
    for group in grouped(&findings) {
        let is_one = group.findings.len() == 1;
        if let Some(cause) = group.cause.filter(|_| !is_one) {
            let many = words::count(group.findings.len(), "finding");
            let _ = writeln!(out, "{cause}: {many}");
        }
        let known = group.findings.iter();
        let known = known.filter(|f| f.severity != Severity::Unknown);
        let names: BTreeSet<&str> = known.filter_map(|f| f.accept.as_deref()).collect();
        for finding in group.findings {
            let (severity, kind) = (finding.severity.word(), finding.kind.word());
            // Writing into a string does not fail.
            let _ = writeln!(out, "{severity}[{kind}]: {}", finding.text);
            let _ = writeln!(out, "  --> {}:{}", subject.file, finding.place.line);
            for line in &finding.details {
                let _ = writeln!(out, "   |  {line}");
            }
            if let Some(cause) = finding.cause.as_ref().filter(|_| is_one)
                && !cause.is_about(&finding.name)
            {
                let _ = writeln!(out, "   |  since {}", cause.text);
            }
            // Hints apply to all findings of a kind.
            for hint in finding.help.iter().filter(|hint| hinted.insert(*hint)) {
                let _ = writeln!(out, "   =  {hint}");
            }
        }
        // Once per cause.
        if !names.is_empty() {
            let _ = writeln!(out, "   =  accept: {}", subject.accept(&names));
        }
    }
    inert_groups(&(out + &last_line(subject, verdict)))
}

/// The last line: `nav.mcap against graph.yaml: 2 errors, 1 warning, 31 rules passed`.
fn last_line(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let kept = verdict.facts(Judgement::Kept);
    let counts = match verdict.counts() {
        counts if counts.is_empty() => "no findings".to_owned(),
        counts => counts.join(", "),
    };
    format!(
        "{} against {}: {counts}, {} passed\n",
        subject.name(),
        subject.file,
        words::count(kept, "rule")
    )
}

/// The number of annotations of one kind per step; GitHub silently drops more.
const MOST: usize = 10;

/// GitHub's annotations: workflow commands at lines of the expectation, followed by the text, since GitHub drops the
/// annotations beyond its limit. Ends in a new line.
pub(super) fn github(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let mut out = String::new();
    for (severity, command) in [(Severity::Error, "error"), (Severity::Warning, "warning")] {
        let own = findings.iter().filter(|f| f.severity == severity);
        let own: Vec<&&Finding> = own.collect();
        for (at, finding) in own.iter().take(MOST).enumerate() {
            // The last one states how many are not shown.
            let rest = own.len() - at - 1;
            let is_last = at + 1 == MOST && rest > 0;
            let more = is_last.then(|| format!(" (and {rest} more in the log)"));
            let text = finding.text.clone() + &more.unwrap_or_default();
            let text = words::joined([&text].into_iter().chain(&finding.details), "\n");
            let _ = writeln!(
                out,
                "::{command} file={},line={},title={}::{}",
                property(&subject.tracked),
                finding.place.line.max(1),
                property(finding.kind.word()),
                data(&text)
            );
        }
    }
    let text = text(subject, verdict);
    for line in text.lines() {
        let _ = writeln!(out, "{}", inert(line));
    }
    inert_groups(&out)
}

/// Text after a command, escaped.
fn data(text: &str) -> String {
    text.replace('%', "%25")
        .replace('\r', "%0D")
        .replace('\n', "%0A")
}

/// A property of a command, escaped.
fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}

/// A line of the log, escaped so that it is not a command (`::` after spaces).
fn inert(line: &str) -> String {
    if line.trim_start().starts_with("::") {
        format!("\\{line}")
    } else {
        line.to_owned()
    }
}
