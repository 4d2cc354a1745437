//! SARIF 2.1.0: every result has a line of the expectation, otherwise GitHub rejects the whole file.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::{Subject, kinds};
use crate::base::words;
use crate::gate::finding::{Finding, KINDS, Severity};
use crate::gate::judge::Verdict;

/// The number of results of a run that GitHub shows; it rejects a file with more than five times as many.
const MOST: usize = 5000;

/// The report; ends in a new line. Undecidable findings are notes; accepted ones are suppressed.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let found = kinds(&findings);
    let rules: Vec<Value> = KINDS
        .iter()
        .filter(|(kind, ..)| found.contains(kind))
        .map(|(_, word, meaning, more)| {
            json!({
                "id": word,
                "shortDescription": {"text": meaning},
                "help": {"text": more},
            })
        })
        .collect();
    let shown = findings.iter().take(MOST);
    let results: Vec<Value> = shown.map(|f| result(subject, f)).collect();
    let notes: Vec<Value> = match findings.len() - results.len() {
        0 => Vec::new(),
        rest => {
            let text = format!("{} left out", words::count(rest, "more finding"));
            vec![json!({"level": "note", "message": {"text": text}})]
        }
    };
    let report = json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": {"driver": {
                "name": "bagreel",
                "version": env!("CARGO_PKG_VERSION"),
                "rules": rules,
            }},
            "invocations": [{
                "executionSuccessful": true,
                "toolExecutionNotifications": notes,
            }],
            "results": results,
        }],
    });
    crate::mission::info::json(&report)
}

fn result(subject: &Subject<'_>, finding: &Finding) -> Value {
    let level = match finding.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Unknown | Severity::Allowed => "note",
    };
    let mut result = json!({
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
    });
    if let (Some(why), Some(result)) = (&finding.why, result.as_object_mut()) {
        let why = json!([{"kind": "external", "justification": why}]);
        result.insert("suppressions".to_owned(), why);
    }
    result
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
            byte => {
                let _ = write!(out, "%{byte:02X}");
            }
        }
    }
    out
}
