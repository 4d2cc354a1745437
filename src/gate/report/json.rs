//! The whole verdict as JSON, schema `bagreel.check/1`.

use serde::Serialize;

use super::Subject;
use crate::gate::finding::{Finding, Severity};
use crate::gate::judge::{CheckedFact, Judgement, Verdict};
use crate::mission::info::json;

#[derive(Serialize)]
struct FindingsJson<'a> {
    schema: &'static str,
    bags: &'a [String],
    expectation: &'a str,
    start_ns: i64,
    end_ns: i64,
    period_ns: i64,
    windows: usize,
    errors: usize,
    warnings: usize,
    unknown: usize,
    allowed: usize,
    kept: usize,
    rules: Vec<RuleJson<'a>>,
}

#[derive(Serialize)]
struct RuleJson<'a> {
    #[serde(rename = "rule")]
    title: &'a str,
    line: usize,
    column: usize,
    outcome: &'static str,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    findings: Vec<Found<'a>>,
}

#[derive(Serialize)]
struct Found<'a> {
    id: &'static str,
    severity: &'static str,
    name: &'a str,
    message: &'a str,
    seen: &'a str,
    expected: &'a str,
    line: usize,
    column: usize,
    start_ns: Option<i64>,
    end_ns: Option<i64>,
    details: &'a [String],
    cause: Option<&'a str>,
    why: Option<&'a str>,
    fingerprint: String,
}

/// The report; ends in a new line.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let mission = subject.mission;
    let report = FindingsJson {
        schema: "bagreel.check/1",
        bags: &subject.bags,
        expectation: &subject.file,
        start_ns: mission.span.start.0,
        end_ns: mission.span.end.0,
        period_ns: mission.period.nanos(),
        windows: mission.windows.len(),
        errors: verdict.count(Severity::Error),
        warnings: verdict.count(Severity::Warning),
        unknown: verdict.count(Severity::Unknown),
        allowed: verdict.count(Severity::Allowed),
        kept: verdict.facts(Judgement::Kept),
        rules: verdict.checks.iter().map(rule).collect(),
    };
    json(&report)
}

fn rule(check: &CheckedFact) -> RuleJson<'_> {
    RuleJson {
        title: &check.title,
        line: check.place.line,
        column: check.place.column,
        outcome: match check.judgement() {
            Judgement::Kept => "kept",
            Judgement::Broken => "broken",
            Judgement::Undecidable => "undecidable",
            Judgement::Moot => "moot",
        },
        findings: check.findings.iter().map(found).collect(),
    }
}

fn found(finding: &Finding) -> Found<'_> {
    Found {
        id: finding.kind.word(),
        severity: finding.severity.word(),
        name: &finding.name,
        message: &finding.text,
        seen: &finding.seen,
        expected: &finding.expected,
        line: finding.place.line,
        column: finding.place.column,
        start_ns: finding.when.map(|span| span.start.0),
        end_ns: finding.when.map(|span| span.end.0),
        details: &finding.details,
        cause: finding.cause.as_ref().map(|c| c.text.as_str()),
        why: finding.why.as_deref(),
        fingerprint: finding.fingerprint(),
    }
}
