//! Differences as text, JSON and Markdown.

use std::fmt::Write as _;

use serde::Serialize;

use super::{Difference, Where};
use crate::base::words::{self, visible};
use crate::export::report::escape::{code, plain};

/// The two missions as given.
#[derive(Clone, Debug)]
pub struct DiffSubject {
    /// The name of the first.
    pub first: String,
    /// The name of the second.
    pub second: String,
}

/// A format of differences.
#[derive(Clone, Copy, Debug)]
pub struct DiffFormat {
    pub(crate) word: &'static str,
    pub(crate) endings: &'static [&'static str],
    pub(crate) write: fn(&DiffSubject, &[Difference]) -> String,
}

impl DiffFormat {
    /// The format of a word: `text`, `json` or `markdown`.
    pub fn from_word(word: &str) -> Option<&'static Self> {
        let word = if word == "md" { "markdown" } else { word };
        DIFF_FORMATS.iter().find(|f| f.word == word)
    }

    /// The format of a file name, by its extension.
    pub(crate) fn of_name(name: &str) -> Option<&'static Self> {
        let name = name.to_ascii_lowercase();
        let is_end = |f: &&Self| f.endings.iter().any(|end| name.ends_with(end));
        DIFF_FORMATS.iter().find(is_end)
    }
}

/// All formats.
const DIFF_FORMATS: &[DiffFormat] = &[
    DiffFormat {
        word: "text",
        endings: &[".txt"],
        write: text,
    },
    DiffFormat {
        word: "json",
        endings: &[".json"],
        write: json,
    },
    DiffFormat {
        word: "markdown",
        endings: &[".md", ".markdown"],
        write: markdown,
    },
];

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
    let value = |text: &str| {
        if text == "present" {
            String::new()
        } else {
            format!(", {text}")
        }
    };
    let (in_one, other, what) = match difference.side {
        Where::First => (&subject.first, &subject.second, &difference.first),
        Where::Second => (&subject.second, &subject.first, &difference.second),
        Where::Both => return format!("{} → {}", difference.first, difference.second),
    };
    let doubt = if difference.is_known {
        String::new()
    } else {
        format!("; unknown in {other}")
    };
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

fn text(subject: &DiffSubject, all: &[Difference]) -> String {
    let long = all.iter().map(|d| visible(&d.name).chars().count()).max();
    let width = long.unwrap_or(0).min(MOST_ALIGNED);
    let mut out = String::new();
    for one in known_first(all) {
        let (sign, kind, name) = (sign(one), one.kind, visible(&one.name));
        let how = how(subject, one);
        // Writing into a string does not fail.
        let _ = writeln!(out, "{sign} {kind:<10} {name:<width$}  {}", visible(&how));
    }
    let out = out + &visible(&summary(subject, all)) + "\n";
    // GitHub's runners interpret this as a command anywhere in a line.
    out.replace("##[", "#\\#[")
}

#[derive(Serialize)]
struct DifferenceJson<'a> {
    schema: &'static str,
    first: &'a str,
    second: &'a str,
    differences: Vec<&'a Difference>,
}

fn json(subject: &DiffSubject, all: &[Difference]) -> String {
    let report = DifferenceJson {
        schema: "bagreel.diff/1",
        first: &subject.first,
        second: &subject.second,
        differences: known_first(all).collect(),
    };
    crate::mission::info::json(&report)
}

fn markdown(subject: &DiffSubject, all: &[Difference]) -> String {
    let known = all.iter().any(|d| d.is_known);
    let sign_of_all = if known { "🔀" } else { "✅" };
    let mut out = format!("### {sign_of_all} {}\n\n", plain(&summary(subject, all)));
    if all.is_empty() {
        return out;
    }
    let (known, unknown): (Vec<_>, Vec<_>) = all.iter().partition(|d| d.is_known);
    table(subject, &known, &mut out);
    if !unknown.is_empty() {
        let many = words::count(unknown.len(), "row");
        let _ = writeln!(
            out,
            "<details><summary>{many} unknown in one of them</summary>\n"
        );
        table(subject, &unknown, &mut out);
        out.push_str("</details>\n");
    }
    out
}

/// Writes a table of differences, up to the size limit.
fn table(subject: &DiffSubject, rows: &[&Difference], out: &mut String) {
    if rows.is_empty() {
        return;
    }
    let (first, second) = (code(&subject.first), code(&subject.second));
    let _ = writeln!(
        out,
        "| | what | name | {first} | {second} |\n|---|---|---|---|---|"
    );
    let cell = |text: &str| {
        if text.is_empty() {
            "–".to_owned()
        } else {
            plain(text)
        }
    };
    for (at, one) in rows.iter().enumerate() {
        let (sign, name) = (sign(one), code(&one.name));
        let (first, second) = (cell(&one.first), cell(&one.second));
        let row = format!("| {sign} | {} | {name} | {first} | {second} |\n", one.kind);
        if out.len() + row.len() > MOST {
            let _ = writeln!(out, "\n{} more left out.", rows.len() - at);
            break;
        }
        out.push_str(&row);
    }
    out.push('\n');
}
