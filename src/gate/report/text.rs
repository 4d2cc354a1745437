//! Findings for people, in the style of compilers: the finding, its position, the observed value, and hints.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::{Subject, grouped};
use crate::base::words;
use crate::gate::finding::{Finding, Severity};
use crate::gate::judge::{Judgement, Verdict};

/// The report; ends in a new line.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let mut out = String::new();
    let mut hinted = BTreeSet::new();
    for (cause, group) in grouped(&findings) {
        let is_one = group.len() == 1;
        if let Some(cause) = cause.filter(|_| !is_one) {
            let _ = writeln!(out, "{cause}: {}", words::count(group.len(), "finding"));
        }
        for one in group {
            finding(subject, one, is_one, &mut hinted, &mut out);
        }
    }
    out.push_str(&last_line(subject, verdict));
    // GitHub's runners interpret this as a command anywhere in a line.
    out.replace("##[", "#\\#[")
}

/// The last line: `nav.mcap against graph.yaml: 2 errors, 1 warning, 31 rules passed`.
fn last_line(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let kept = verdict.facts(Judgement::Kept);
    format!(
        "{} against {}: {}, {} passed\n",
        subject.name(),
        subject.file,
        verdict.summary(),
        words::count(kept, "rule")
    )
}

fn finding(
    subject: &Subject<'_>,
    finding: &Finding,
    is_alone: bool,
    hinted: &mut BTreeSet<String>,
    out: &mut String,
) {
    let (severity, kind) = (finding.severity.word(), finding.kind.word());
    // Writing into a string does not fail.
    let _ = writeln!(out, "{severity}[{kind}]: {}", finding.text);
    let _ = writeln!(out, "  --> {}:{}", subject.file, finding.place.line);
    for line in &finding.details {
        let _ = writeln!(out, "   |  {line}");
    }
    if let Some(cause) = finding.cause.as_ref().filter(|_| is_alone)
        && !cause.is_about(&finding.name)
    {
        let _ = writeln!(out, "   |  since {}", cause.text);
    }
    if let Some(why) = &finding.why {
        let _ = writeln!(out, "   =  allowed: {why}");
    }
    // Hints apply to all findings of a kind.
    for hint in finding.help.iter().filter(|h| hinted.insert((*h).clone())) {
        let _ = writeln!(out, "   =  {hint}");
    }
    if let Some(name) = &finding.accept
        && matches!(finding.severity, Severity::Error | Severity::Warning)
    {
        let _ = writeln!(out, "   =  accept: {}", subject.accept(Some(name)));
    }
}
