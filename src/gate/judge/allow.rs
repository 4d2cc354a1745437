//! Accepted known findings, which expire on a date compared with the bag's time.

use super::{CheckedFact, Judge};
use crate::base::time::Stamp;
use crate::base::words;
use crate::gate::expectation::AllowedFinding;
use crate::gate::finding::{Finding, FindingKind, Severity};

impl Judge<'_> {
    /// Accepts allowed findings, and adds findings for unused allowances.
    pub(super) fn allow(&mut self) {
        let start = self.facts.mission.span.start;
        let mut unused = Vec::new();
        for allowance in &self.expectation.allow {
            if !forgive(&mut self.checks, allowance, start) {
                let name = allowance.name.as_str();
                let word = allowance.finding.word();
                let text = format!("the allowance of {word} for {name} matched no finding");
                let mut finding = Finding::new(FindingKind::AllowUnused, name, allowance.at, text)
                    .saw("nothing", word)
                    .hint("remove it");
                finding.severity = Severity::Warning;
                unused.push((format!("allow {word} {name}"), allowance.at, vec![finding]));
            }
        }
        for (title, place, found) in unused {
            self.note(title, place, found);
        }
    }
}

/// Accepts the findings that an allowance matches; returns whether there were any.
fn forgive(checks: &mut [CheckedFact], allowance: &AllowedFinding, start: Stamp) -> bool {
    let mut is_used = false;
    let all = checks.iter_mut().flat_map(|c| &mut c.findings);
    for finding in all.filter(|f| f.kind == allowance.finding && allowance.name.matches(&f.name)) {
        is_used = true;
        if finding.severity == Severity::Unknown {
            continue;
        }
        let over = allowance
            .until
            .as_ref()
            .filter(|until| start >= until.value);
        if let Some(until) = over {
            let at = allowance.at.line;
            let day = words::date_and_clock(until.value.0);
            let text = format!("the allowance in line {at} applied to bags before {day}");
            finding.details.push(text);
            continue;
        }
        finding.severity = Severity::Allowed;
        finding.why = Some(words::visible(&allowance.why).into_owned());
    }
    is_used
}
