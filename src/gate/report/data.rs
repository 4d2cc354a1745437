//! Verdicts for programs and CI services: the whole verdict as JSON, GitLab's code quality, SARIF, and `JUnit` XML.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde::Serialize;
use serde_json::{Value, json};

use super::Subject;
use crate::base::error::Error;
use crate::base::words;
use crate::draw::paint::xml::Xml;
use crate::gate::finding::{Finding, FindingKind, Severity};
use crate::gate::judge::{CheckedFact, Judgement, Verdict};
use crate::mission::info;

/// The whole verdict.
#[derive(Serialize)]
struct VerdictJson<'a> {
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
    findings: Vec<FindingJson<'a>>,
}

#[derive(Serialize)]
struct FindingJson<'a> {
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
    fingerprint: String,
}

/// The whole verdict as JSON, schema `bagreel.check/1`; ends in a new line.
pub(super) fn json(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let mission = subject.mission;
    let rules = verdict.checks.iter().map(|check| RuleJson {
        title: &check.title,
        line: check.place.line,
        column: check.place.column,
        outcome: check.judgement().word(),
        findings: check.findings.iter().map(finding_json).collect(),
    });
    info::json(&VerdictJson {
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
        kept: verdict.facts(Judgement::Kept),
        rules: rules.collect(),
    })
}

fn finding_json(finding: &Finding) -> FindingJson<'_> {
    FindingJson {
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
        fingerprint: finding.fingerprint(),
    }
}

/// GitLab's code quality: a list of findings, each with a fingerprint that is independent of lines; ends in a new line.
pub(super) fn gitlab(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let issues = findings.iter().map(|finding| {
        let severity = match finding.severity {
            Severity::Error => "major",
            Severity::Warning => "minor",
            Severity::Unknown => "info",
        };
        json!({
            "description": finding.text,
            "check_name": finding.kind.word(),
            "fingerprint": finding.fingerprint(),
            "severity": severity,
            "location": {"path": subject.tracked, "lines": {"begin": finding.place.line.max(1)}},
        })
    });
    info::json(&issues.collect::<Vec<Value>>())
}

/// The number of results of a run that GitHub shows; it rejects a file with more than five times as many.
const MOST: usize = 5000;

/// SARIF 2.1.0; ends in a new line. Every result has a line of the expectation, otherwise GitHub rejects the whole file.
/// Undecidable findings are notes.
pub(super) fn sarif(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let found: BTreeSet<FindingKind> = findings.iter().map(|f| f.kind).collect();
    let rules = found.into_iter().map(|kind| {
        json!({
            "id": kind.word(),
            "shortDescription": {"text": kind.row().meaning},
            "help": {"text": kind.row().more},
        })
    });
    let shown = findings.iter().take(MOST);
    let results: Vec<Value> = shown.map(|f| result(subject, f)).collect();
    let notes: Vec<Value> = match findings.len() - results.len() {
        0 => Vec::new(),
        rest => {
            let text = format!("{} left out", words::count(rest, "more finding"));
            vec![json!({"level": "note", "message": {"text": text}})]
        }
    };
    info::json(&json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": {"driver": {
                "name": "bagreel",
                "version": env!("CARGO_PKG_VERSION"),
                "rules": rules.collect::<Vec<Value>>(),
            }},
            "invocations": [{
                "executionSuccessful": true,
                "toolExecutionNotifications": notes,
            }],
            "results": results,
        }],
    }))
}

fn result(subject: &Subject<'_>, finding: &Finding) -> Value {
    let level = match finding.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Unknown => "note",
    };
    json!({
        "ruleId": finding.kind.word(),
        "level": level,
        "message": {"text": finding.reported("\n")},
        "locations": [{"physicalLocation": {
            "artifactLocation": {"uri": address(&subject.tracked)},
            "region": {
                "startLine": finding.place.line.max(1),
                "startColumn": finding.place.column.max(1),
            },
        }}],
        "partialFingerprints": {"bagreel/v1": finding.fingerprint()},
    })
}

/// A path as a relative reference of a URI.
fn address(path: &str) -> String {
    let mut out = String::new();
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' => {
                out.push(char::from(byte));
            }
            b'\\' => out.push('/'),
            // Writing into a string does not fail.
            byte => drop(write!(out, "%{byte:02X}")),
        }
    }
    out
}

/// `JUnit` XML: a test case for every fact of the file, including met ones; undecidable ones are skipped. Ends in a new
/// line.
pub(super) fn junit(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let skipped = verdict.facts(Judgement::Undecidable) + verdict.facts(Judgement::Moot);
    // A warning passes, as it does for the exit code.
    let is_failed = |check: &&CheckedFact| !of_severity(check, Severity::Error).is_empty();
    let failures = verdict.checks.iter().filter(is_failed).count();
    let counts = [verdict.checks.len(), failures, 0, skipped];
    let mut xml = suites(&subject.name(), counts);
    for check in &verdict.checks {
        case(&mut xml, subject, check);
    }
    xml.finish() + "\n"
}

/// `JUnit` XML of a recording that could not be checked: one test case with an error. Ends in a new line.
pub(crate) fn unchecked(name: &str, file: &str, error: &Error) -> String {
    let mut xml = suites(name, [1, 0, 1, 0]);
    xml.open("testcase")
        .attribute("classname", file)
        .attribute("name", "the recording can be checked")
        .attribute("time", 0);
    xml.open("error")
        .attribute("message", error)
        .text(&error.hint())
        .close()
        .close();
    xml.finish() + "\n"
}

/// The beginning of both, with the numbers of tests, failures, errors and skipped tests.
fn suites(name: &str, [tests, failures, errors, skipped]: [usize; 4]) -> Xml {
    let mut xml = Xml::default();
    xml.raw("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    for tag in ["testsuites", "testsuite"] {
        xml.open(tag)
            .attribute("name", name)
            .attribute("tests", tests)
            .attribute("failures", failures)
            .attribute("errors", errors);
        if tag == "testsuite" {
            xml.attribute("skipped", skipped);
        }
        xml.raw("\n");
    }
    xml
}

fn of_severity(check: &CheckedFact, severity: Severity) -> Vec<&Finding> {
    let own = check.findings.iter();
    own.filter(|f| f.severity == severity).collect()
}

fn case(xml: &mut Xml, subject: &Subject<'_>, check: &CheckedFact) {
    xml.open("testcase")
        .attribute("classname", &subject.tracked)
        .attribute("name", &check.title)
        .attribute("time", 0);
    let [errors, warnings, unknown] = [Severity::Error, Severity::Warning, Severity::Unknown]
        .map(|severity| of_severity(check, severity));
    let skipped = match unknown.first() {
        Some(first) => Some(first.text.as_str()),
        None if check.judgement() == Judgement::Moot => Some("its subject is not in the bag"),
        None => None,
    };
    if let Some(first) = errors.first() {
        xml.open("failure")
            .attribute("type", first.kind.word())
            .attribute("message", &first.text)
            .text(&details(subject, &errors))
            .close();
    } else if let Some(message) = skipped {
        xml.open("skipped")
            .attribute("message", message)
            .close_empty();
    }
    if !warnings.is_empty() {
        xml.leaf("system-out", &details(subject, &warnings));
    }
    xml.close_empty().raw("\n");
}

fn details(subject: &Subject<'_>, findings: &[&Finding]) -> String {
    let line = |f: &&Finding| {
        let place = format!("{}:{}", subject.tracked, f.place.line);
        let word = f.severity.word();
        format!("{word}[{}] {place}: {}", f.kind.word(), f.reported("; "))
    };
    findings.iter().map(line).collect::<Vec<_>>().join(" / ")
}
