//! GitLab's code quality: a list of findings, each with a fingerprint that is independent of lines.

use serde::Serialize;

use super::Subject;
use crate::gate::finding::{Finding, Severity};
use crate::gate::judge::Verdict;
use crate::mission::info::json;

#[derive(Serialize)]
struct Issue<'a> {
    description: &'a str,
    check_name: &'static str,
    fingerprint: String,
    severity: &'static str,
    location: Location<'a>,
}

#[derive(Serialize)]
struct Location<'a> {
    path: &'a str,
    lines: Lines,
}

#[derive(Serialize)]
struct Lines {
    begin: usize,
}

/// The report; ends in a new line. Accepted findings are left out.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings().into_iter();
    let shown = findings.filter(|f| f.severity != Severity::Allowed);
    let issues: Vec<Issue<'_>> = shown.map(|f| issue(subject, f)).collect();
    json(&issues)
}

fn issue<'a>(subject: &'a Subject<'_>, finding: &'a Finding) -> Issue<'a> {
    Issue {
        description: &finding.text,
        check_name: finding.kind.word(),
        fingerprint: finding.fingerprint(),
        severity: match finding.severity {
            Severity::Error => "major",
            Severity::Warning => "minor",
            Severity::Unknown | Severity::Allowed => "info",
        },
        location: Location {
            path: &subject.tracked,
            lines: Lines {
                begin: finding.place.line.max(1),
            },
        },
    }
}
