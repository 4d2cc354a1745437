//! `JUnit` XML: a test case for every fact of the file, including met ones; undecidable ones are skipped.

use super::Subject;
use crate::draw::paint::xml::Xml;
use crate::gate::finding::{Finding, Severity};
use crate::gate::judge::{CheckedFact, Judgement, Verdict};

/// The report; ends in a new line.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let count = |judgement| verdict.facts(judgement);
    let skipped = count(Judgement::Undecidable) + count(Judgement::Moot);
    let mut xml = Xml::default();
    xml.raw("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    for tag in ["testsuites", "testsuite"] {
        xml.open(tag)
            .attribute("name", subject.name())
            .attribute("tests", verdict.checks.len())
            .attribute(
                "failures",
                verdict.checks.iter().filter(|c| is_failed(c)).count(),
            )
            .attribute("errors", 0);
        if tag == "testsuite" {
            xml.attribute("skipped", skipped);
        }
        xml.raw("\n");
    }
    for check in &verdict.checks {
        case(&mut xml, subject, check);
    }
    xml.finish() + "\n"
}

/// Whether a fact fails: a warning passes, as it does for the exit code.
fn is_failed(check: &CheckedFact) -> bool {
    check.findings.iter().any(|f| f.severity == Severity::Error)
}

fn case(xml: &mut Xml, subject: &Subject<'_>, check: &CheckedFact) {
    xml.open("testcase")
        .attribute("classname", &subject.file)
        .attribute("name", &check.title)
        .attribute("time", 0);
    let of = |severity: Severity| {
        let own = check
            .findings
            .iter()
            .filter(move |f| f.severity == severity);
        own.collect::<Vec<&Finding>>()
    };
    let (errors, unknown) = (of(Severity::Error), of(Severity::Unknown));
    let milder: Vec<&Finding> = [of(Severity::Warning), of(Severity::Allowed)].concat();
    if let Some(first) = errors.first() {
        xml.open("failure")
            .attribute("type", first.kind.word())
            .attribute("message", &first.text)
            .text(&details(subject, &errors))
            .close();
    } else if let Some(first) = unknown.first() {
        xml.open("skipped")
            .attribute("message", &first.text)
            .close_empty();
    } else if check.judgement() == Judgement::Moot {
        let message = "its subject is not in the bag";
        xml.open("skipped")
            .attribute("message", message)
            .close_empty();
    }
    if !milder.is_empty() {
        xml.leaf("system-out", &details(subject, &milder));
    }
    xml.close_empty().raw("\n");
}

fn details(subject: &Subject<'_>, findings: &[&Finding]) -> String {
    let line = |f: &&Finding| {
        let place = format!("{}:{}", subject.file, f.place.line);
        let word = f.severity.word();
        format!("{word}[{}] {place}: {}", f.kind.word(), f.reported("; "))
    };
    findings.iter().map(line).collect::<Vec<_>>().join(" / ")
}
