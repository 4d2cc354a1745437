//! Checks a bag against an expectations file and prints the findings; the exit code is 1 if there are errors.
//!
//! `cargo run --release --example check -- examples/courier.mcap examples/ci/minimal.yaml`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::process::ExitCode;

use bagreel::Reading;
use bagreel::commands::{Check, check};
use bagreel::values::{Judgement, Severity, Unwatched};

fn main() -> Result<ExitCode, Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let bag = arguments.next().ok_or("give a bag")?;
    let expect = arguments.next().ok_or("give an expectations file")?;
    let job = Check::new(Reading::of([bag]), &expect);
    let verdict = check(&job, &mut Unwatched)?.verdict;
    for finding in verdict.findings() {
        println!(
            "{expect}:{}: {} {}: {}",
            finding.place.line,
            finding.severity.word(),
            finding.kind.word(),
            finding.text
        );
    }
    println!(
        "{} of {} facts met",
        verdict.facts(Judgement::Kept),
        verdict.checks.len()
    );
    let is_failed = verdict.count(Severity::Error) > 0;
    Ok(ExitCode::from(u8::from(is_failed)))
}
