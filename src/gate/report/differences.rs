//! Differences as text, JSON and Markdown.

use std::fmt::Write as _;

use serde::Serialize;

use super::{cell, inert_groups};
use crate::base::words::{self, visible};
use crate::export::markdown::{self, code, plain, row};
use crate::gate::difference::{DiffSubject, Difference, Where};

/// The most bytes of a table, half of the limit of a summary.
const MOST: usize = 128 << 10;

/// The longest name in characters to which the values of other lines are aligned.
const MOST_ALIGNED: usize = 32;

fn sign(difference: &Difference) -> char {
    match (difference.is_known, difference.side) {
        (false, _) => '?',
        (_, Where::First) => '-',
        (_, Where::Second) => '+',
        (_, Where::Both) => '~',
    }
}

/// A difference as text: `only in a.bag`, or `15 Hz → 7.4 Hz`.
fn how(subject: &DiffSubject, difference: &Difference) -> String {
    let value = |text: &str| match text {
        "present" => String::new(),
        text => format!(", {text}"),
    };
    let (in_one, other, what) = match difference.side {
        Where::First => (&subject.first, &subject.second, &difference.first),
        Where::Second => (&subject.second, &subject.first, &difference.second),
        Where::Both => return format!("{} → {}", difference.first, difference.second),
    };
    let doubt = format!("; unknown in {other}");
    let doubt = if difference.is_known { "" } else { &doubt };
    format!("only in {in_one}{}{doubt}", value(what))
}

/// The summary: `a.bag and b.bag: 4 differences, 1 unknown`.
fn summary(subject: &DiffSubject, all: &[Difference]) -> String {
    let known = all.iter().filter(|d| d.is_known).count();
    let unknown = match all.len() - known {
        0 => String::new(),
        n => format!(", {n} unknown"),
    };
    let many = match known {
        0 => "no differences".to_owned(),
        n => words::count(n, "difference"),
    };
    format!("{} and {}: {many}{unknown}", subject.first, subject.second)
}

/// The differences observable in both missions, then the others.
fn known_first(all: &[Difference]) -> impl Iterator<Item = &Difference> {
    let (known, unknown): (Vec<_>, Vec<_>) = all.iter().partition(|d| d.is_known);
    known.into_iter().chain(unknown)
}

pub(super) fn text(subject: &DiffSubject, all: &[Difference]) -> String {
    let long = all.iter().map(|d| visible(&d.name).chars().count()).max();
    let width = long.unwrap_or(0).min(MOST_ALIGNED);
    let mut out = String::new();
    for one in known_first(all) {
        let (sign, kind, name) = (sign(one), one.kind, visible(&one.name));
        let how = how(subject, one);
        // Writing into a string does not fail.
        let _ = writeln!(out, "{sign} {kind:<10} {name:<width$}  {}", visible(&how));
    }
    inert_groups(&(out + &visible(&summary(subject, all)) + "\n"))
}

#[derive(Serialize)]
struct DifferenceJson<'a> {
    schema: &'static str,
    first: &'a str,
    second: &'a str,
    differences: Vec<&'a Difference>,
}

pub(super) fn json(subject: &DiffSubject, all: &[Difference]) -> String {
    let report = DifferenceJson {
        schema: "bagreel.diff/1",
        first: &subject.first,
        second: &subject.second,
        differences: known_first(all).collect(),
    };
    crate::mission::info::json(&report)
}

pub(super) fn markdown(subject: &DiffSubject, all: &[Difference]) -> String {
    let known = all.iter().any(|d| d.is_known);
    let sign_of_all = if known { "🔀" } else { "✅" };
    let mut out = format!("### {sign_of_all} {}\n\n", plain(&summary(subject, all)));
    if all.is_empty() {
        return out;
    }
    let (known, unknown): (Vec<_>, Vec<_>) = all.iter().partition(|d| d.is_known);
    if !known.is_empty() {
        out += &table(subject, &known, MOST.saturating_sub(out.len()));
        out.push('\n');
    }
    if !unknown.is_empty() {
        let many = words::count(unknown.len(), "row");
        let rest = table(subject, &unknown, MOST.saturating_sub(out.len()));
        out += markdown::folded(&format!("{many} unknown in one of them"), &rest).trim_end();
        out.push('\n');
    }
    out
}

/// A table of differences, up to `most` bytes.
fn table(subject: &DiffSubject, all: &[&Difference], most: usize) -> String {
    let (first, second) = (code(&subject.first), code(&subject.second));
    let heads = ["", "what", "name", &first, &second];
    let rows = all.iter().map(|one| {
        let [first, second] = [&one.first, &one.second].map(|value| cell(value, plain));
        let (sign, name) = (sign(one).to_string(), code(&one.name));
        row(&[sign, one.kind.to_owned(), name, first, second])
    });
    let mut rows: Vec<String> = rows.collect();
    let cut = markdown::cut(&mut rows, most);
    let left_out = match cut {
        0 => String::new(),
        n => format!("\n{n} more left out.\n"),
    };
    markdown::table(&heads, &rows) + &left_out
}
