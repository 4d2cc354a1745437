//! Generates an expectation from healthy runs: the strictest one that all of them meet, one line per element.

mod draft;
mod edit;
mod update;

use super::expectation::SCHEMA;
use crate::base::budget;
use crate::base::time::Period;
use crate::base::words::{self, visible_json};
use crate::mission::Mission;

pub(super) use draft::{Draft, Line};
pub(crate) use update::update;

/// The longest name in the file, in bytes; longer ones are left out: YAML allows no longer keys, and ROS allows 255.
const LONGEST: usize = 1000;
/// The share of a document's limits reserved for the lines before the first name.
const HEAD: usize = 1 << 16;

/// A generated expectation.
#[derive(Debug, Default)]
pub(crate) struct Written {
    pub(crate) text: String,
    /// The numbers of nodes and topics written, and of both that did not fit.
    pub(crate) nodes: usize,
    pub(crate) topics: usize,
    pub(crate) left_out: usize,
}

/// The expectation that all of these runs meet, which were read with one period; without times if each `is_part` of a
/// recording. `from` names them in a comment.
pub(crate) fn write(runs: &[Mission], is_part: bool, from: &str) -> Written {
    let written = |first: &Mission| written(&Draft::of(runs, is_part), from, first.period);
    runs.first().map(written).unwrap_or_default()
}

fn written(draft: &Draft, from: &str, period: Period) -> Written {
    let mut room = Room {
        bytes: budget::YAML - HEAD,
        values: budget::YAML_VALUES - HEAD / 16,
        left_out: 0,
    };
    let nodes = draft.nodes.iter().map(|(name, line)| (name, line.text()));
    let nodes = room.section("nodes", nodes);
    // Elements that were left out must not be reported as unexpected.
    let others = if room.left_out == 0 { "warn" } else { "allow" };
    let topics = draft.topics.iter();
    let topics = topics.map(|(name, line)| (name, line.text() + &line.comment));
    let topics = room.section("topics", topics);
    let note = match room.left_out {
        0 => String::new(),
        n => format!("# {} did not fit.\n", words::count(n, "more name")),
    };
    let (from, period) = (scalar(from), length(period.nanos()));
    let text = format!(
        "schema: {SCHEMA}\nfrom: {from}\nperiod: {period}\n\
         policy: {{unexpected_nodes: {others}, unexpected_topics: allow, unexpected_publishers: error}}\n\
         {note}{nodes}{topics}"
    );
    let entries = |section: &str| section.lines().count().saturating_sub(1);
    Written {
        text,
        nodes: entries(&nodes),
        topics: entries(&topics),
        left_out: room.left_out,
    }
}

/// The remaining limits within which the document can be read back.
struct Room {
    bytes: usize,
    values: usize,
    left_out: usize,
}

impl Room {
    /// A section with a line per name, without those that do not fit; empty if none fits.
    fn section<'a>(
        &mut self,
        key: &str,
        lines: impl Iterator<Item = (&'a String, String)>,
    ) -> String {
        let mut out = String::new();
        for (name, line) in lines {
            let name = scalar(name);
            let line = format!("  {name}: {line}\n");
            if name.len() > LONGEST || !self.takes(&line) {
                self.left_out += 1;
                continue;
            }
            if out.is_empty() {
                out = format!("{key}:\n");
            }
            out.push_str(&line);
        }
        out
    }

    /// Reserves space for a line; returns whether it fits.
    fn takes(&mut self, line: &str) -> bool {
        // A pair is two values, and so is a mapping or list with its first member; a comma begins another.
        let signs = line
            .bytes()
            .filter(|b| matches!(b, b':' | b',' | b'[' | b'{'));
        let values = 2 * signs.count();
        let (Some(bytes), Some(values)) = (
            self.bytes.checked_sub(line.len()),
            self.values.checked_sub(values),
        ) else {
            return false;
        };
        (self.bytes, self.values) = (bytes, values);
        true
    }
}

/// A length of time in the command line's syntax.
fn length(nanos: i64) -> String {
    const SECOND: i64 = 1_000_000_000;
    if nanos % SECOND == 0 {
        format!("{}s", nanos / SECOND)
    } else {
        format!("{}s", nanos as f64 / 1e9)
    }
}

/// The nanoseconds rounded up to two digits.
fn two_digits(nanos: i64) -> i64 {
    let mut step = 1;
    while nanos / step >= 100 {
        step *= 10;
    }
    nanos
        .div_euclid(step)
        .saturating_add(i64::from(nanos % step > 0))
        .saturating_mul(step)
}

/// Text as YAML: plain if YAML reads it as text, otherwise quoted.
fn scalar(text: &str) -> String {
    const WORDS: [&str; 9] = ["true", "false", "null", "yes", "no", "on", "off", "y", "n"];
    let harmless = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '_' | '-' | '.');
    let begins = text.starts_with(|c: char| c == '/' || c.is_ascii_alphabetic());
    let is_word = WORDS.contains(&text.to_ascii_lowercase().as_str());
    if begins && !is_word && text.chars().all(harmless) {
        return text.to_owned();
    }
    visible_json(&serde_json::to_string(text).unwrap_or_default()).into_owned()
}

/// Pairs as a mapping on one line.
fn mapping(pairs: &[(&str, String)]) -> String {
    let pairs: Vec<String> = pairs
        .iter()
        .map(|(key, value)| format!("{key}: {value}"))
        .collect();
    format!("{{{}}}", pairs.join(", "))
}

/// Names as a list on one line.
fn list<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<String> = names.map(|name| scalar(name)).collect();
    format!("[{}]", names.join(", "))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::gate::read;

    /// An expectation of `nodes` nodes, and of topics with these names, which must be readable.
    fn of(nodes: usize, topics: &[String]) -> (Written, usize) {
        let mut draft = Draft::default();
        for n in 0..nodes {
            draft.nodes.insert(format!("/n{n}"), Line::default());
        }
        for name in topics {
            draft.topics.insert(name.clone(), Line::default());
        }
        let written = written(
            &draft,
            "run.bag",
            Period::from_nanos(1_000_000_000).unwrap(),
        );
        let read = read(&written.text, Path::new("graph.yaml")).unwrap();
        let kept = read.nodes.len() + read.topics.len();
        (written, kept)
    }

    #[test]
    fn expectations_with_any_number_of_names_can_be_read() {
        let (small, kept) = of(2, &["/a".to_owned()]);
        assert_eq!((small.left_out, kept), (0, 3));
        assert!(small.text.contains("unexpected_nodes: warn") && !small.text.contains("no room"));
        let (large, kept) = of(1 << 17, &[]);
        assert!(kept > 20_000 && large.left_out + kept == 1 << 17, "{kept}");
        assert!(large.text.contains("unexpected_nodes: allow"));
        assert!(large.text.contains(" more names did not fit.\n"));
    }

    #[test]
    fn unusual_names_round_trip() {
        let signs = "\u{fffe}\u{ffff}\u{feff}\u{2028}\u{85}\u{7f}\u{1}\u{9b}\u{a0}\u{202e}\u{e0001}\u{1f600}\u{10ffff}\t\n\r\"'\\:#&*!|>%@`,[]{}?-~=<^$+ ß";
        for sign in signs.chars() {
            let name = format!("/a{sign}b");
            let (written, kept) = of(0, std::slice::from_ref(&name));
            assert_eq!((written.left_out, kept), (0, 1), "{name:?}");
            let read = read(&written.text, Path::new("graph.yaml")).unwrap();
            let back = format!("{:?}", read.topics);
            assert!(back.contains(&format!("{name:?}")), "{name:?} in {back}");
        }
    }

    #[test]
    fn names_that_are_not_valid_keys_are_left_out() {
        // Of their length when written.
        let names = [
            "/a".repeat(495),
            "/a".repeat(505),
            format!("/{}", "\u{202e}".repeat(300)),
        ];
        let (written, kept) = of(0, &names);
        assert_eq!((written.left_out, kept), (2, 1));
    }

    #[test]
    fn text_is_quoted_if_yaml_would_read_another_value() {
        assert_eq!(scalar("/nav/amcl_1"), "/nav/amcl_1");
        assert_eq!(
            scalar("sensor_msgs/msg/LaserScan"),
            "sensor_msgs/msg/LaserScan"
        );
        assert_eq!(scalar("true"), "\"true\"");
        assert_eq!(scalar("/a: {b}"), "\"/a: {b}\"");
        assert_eq!(scalar("12"), "\"12\"");
        assert_eq!(scalar("/a\u{202e}\n"), "\"/a\\u202e\\n\"");
        assert_eq!(
            (length(60_000_000_000), length(500_000_000)),
            ("60s".to_owned(), "0.5s".to_owned())
        );
    }
}
