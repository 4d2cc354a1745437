//! Writes down what healthy runs have in common: the smallest expectation that holds in all of them, a line per element.

mod draft;
mod edit;
mod update;

use std::fmt::Write as _;

use super::expectation::SCHEMA;
use crate::base::time::Period;
use crate::base::words::visible_json;
use crate::mission::Mission;

pub(super) use draft::{Draft, NodeLine, TopicLine};
pub(crate) use update::{Update, update};

/// Names longer than this are not written: YAML takes no longer keys, and ROS allows 255 bytes.
const LONGEST: usize = 900;

/// The expectation that holds in all of these runs, which were read with windows of this length. `from` names them, for
/// the reader only.
pub(crate) fn write(runs: &[Mission], from: &str, period: Period) -> String {
    let draft = Draft::of(runs);
    let mut out = format!("schema: {SCHEMA}\n");
    // Writing into a string does not fail.
    let _ = writeln!(out, "from: {}", scalar(from));
    let _ = writeln!(out, "period: {}", length(period.nanos()));
    out.push_str(
        "policy: {unexpected_nodes: warn, unexpected_topics: allow, unexpected_publishers: error}\n",
    );
    let nodes = draft.nodes.iter();
    section(
        &mut out,
        "nodes",
        nodes.map(|(name, line)| (name.as_str(), line.text())),
    );
    let topics = draft.topics.iter();
    section(
        &mut out,
        "topics",
        topics.map(|(name, line)| (name.as_str(), line.text())),
    );
    out
}

fn section<'a>(out: &mut String, key: &str, lines: impl Iterator<Item = (&'a str, String)>) {
    let mut lines = lines.filter(|(name, _)| name.len() <= LONGEST).peekable();
    if lines.peek().is_some() {
        let _ = writeln!(out, "{key}:");
    }
    for (name, line) in lines {
        let _ = writeln!(out, "  {}: {line}", scalar(name));
    }
}

/// A length of time as the command line takes it.
fn length(nanos: i64) -> String {
    const SECOND: i64 = 1_000_000_000;
    if nanos % SECOND == 0 {
        format!("{}s", nanos / SECOND)
    } else {
        format!("{}s", nanos as f64 / 1e9)
    }
}

/// Text as YAML: as it is where it can be nothing else, in quotes otherwise.
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
    use super::*;

    #[test]
    fn text_is_quoted_where_yaml_would_read_something_else() {
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
