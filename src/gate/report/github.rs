//! GitHub's annotations: workflow commands at lines of the expectation, followed by the text, since GitHub drops the
//! annotations beyond its limit.

use std::fmt::Write as _;

use super::{Subject, text};
use crate::gate::finding::{Finding, Severity};
use crate::gate::judge::Verdict;

/// The number of annotations of one kind per step; GitHub silently drops more.
const MOST: usize = 10;

/// The report; ends in a new line.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let mut out = String::new();
    for (severity, command) in [(Severity::Error, "error"), (Severity::Warning, "warning")] {
        let own = findings.iter().filter(|f| f.severity == severity);
        let own: Vec<&&Finding> = own.collect();
        // The last one shown states how many are not.
        let shown = if own.len() > MOST {
            MOST - 1
        } else {
            own.len()
        };
        for finding in own.iter().take(shown) {
            annotation(subject, command, finding, &finding.text, &mut out);
        }
        if let Some(next) = own.get(shown) {
            let rest = own.len() - shown - 1;
            let text = format!("{} (and {rest} more in the log)", next.text);
            annotation(subject, command, next, &text, &mut out);
        }
    }
    let text = text::write(subject, verdict);
    for line in text.lines() {
        let _ = writeln!(out, "{}", inert(line));
    }
    // Runners interpret this as a command anywhere in a line.
    out.replace("##[", "#\\#[")
}

fn annotation(
    subject: &Subject<'_>,
    command: &str,
    finding: &Finding,
    text: &str,
    out: &mut String,
) {
    let details = finding.details.iter().map(String::as_str);
    let text: Vec<&str> = std::iter::once(text).chain(details).collect();
    let _ = writeln!(
        out,
        "::{command} file={},line={},title={}::{}",
        property(&subject.tracked),
        finding.place.line.max(1),
        property(finding.kind.word()),
        data(&text.join("\n"))
    );
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
