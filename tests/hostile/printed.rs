//! Tests of standard output: every `--format` is respected, and no name can control a terminal, a GitHub job, a
//! spreadsheet or a JSON reader.

use std::path::Path;

use super::{COURIER, bagreel, crafted, errors};
use crate::support::{self, Recording, rosbag1};

fn printed(folder: &Path, args: &[&str]) -> String {
    let output = bagreel(folder, args);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{args:?}: {}",
        errors(&output)
    );
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn every_format_of_every_command_is_honoured() {
    let dir = tempfile::tempdir().unwrap();
    for (command, formats) in [
        ("info", &["text", "json", "csv"][..]),
        ("events", &["text", "csv", "ndjson", "markdown"]),
    ] {
        let all: Vec<String> = formats
            .iter()
            .map(|format| printed(dir.path(), &[command, COURIER, "--format", format]))
            .collect();
        for (at, text) in all.iter().enumerate() {
            assert!(
                !text.is_empty() && !all[..at].contains(text),
                "{command} {}",
                formats[at]
            );
        }
    }
}

#[test]
fn events_are_printed_in_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let events = |format: &str| printed(dir.path(), &["events", COURIER, "--format", format]);
    // The first line is the sentence about the mission.
    let many = events("text").lines().count() - 1;
    assert!(many > 5);
    let csv = events("csv");
    assert!(
        csv.starts_with("time_ns,") && csv.lines().count() == many + 1,
        "{csv}"
    );
    let ndjson = events("ndjson");
    for line in ndjson.lines() {
        let event: serde_json::Value = serde_json::from_str(line).unwrap();
        assert!(
            event["time_ns"].is_i64() && (event["name"].is_string() || event["node"].is_string()),
            "{line}"
        );
    }
    assert_eq!(ndjson.lines().count(), many);
    assert_eq!(events("markdown").lines().count(), many + 2);
}

/// Whether a terminal or another reader would interpret a character.
fn is_obeyed(c: char) -> bool {
    c.is_control() && c != '\n' || ('\u{202a}'..='\u{202e}').contains(&c)
}

/// A bag with names that try to control their reader.
fn steering(folder: &Path) -> String {
    let mut recording = Recording::default();
    for name in [
        "/a\u{1b}[2Jb",
        "/c\n::error::forged",
        "/d\u{202e}e\u{9b}f\u{7}",
        "=cmd|'/c calc'!A1",
    ] {
        let place = recording.publisher(&format!("/node{name}"), name, "std_msgs/String");
        recording.send(place, (0, 9000), 500, b"\x01\0\0\0x");
    }
    let path = folder.join("x\n::error::file.bag");
    std::fs::write(&path, rosbag1::write(&recording, rosbag1::Pack::None, 1000)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn no_name_is_printed_raw() {
    let dir = tempfile::tempdir().unwrap();
    for bag in [crafted("01_escapes.bag"), steering(dir.path())] {
        for args in [
            &["info", &bag][..],
            &["info", &bag, "--format", "json"],
            &["info", &bag, "--format", "csv"],
            &["info", &bag, "--why", "/c\n::error::forged"],
            &["info", dir.path().to_str().unwrap()],
            &["events", &bag],
            &["events", &bag, "--format", "csv"],
            &["events", &bag, "--format", "ndjson"],
            &["events", &bag, "--format", "markdown"],
            &["render", &bag, "-o", "x.gif"],
            &["render", "gone\n::error::", "-o", "x.gif"],
        ] {
            let output = bagreel(dir.path(), args);
            for text in [output.stdout, output.stderr] {
                let text = String::from_utf8(text).unwrap();
                assert!(!text.contains(is_obeyed), "{args:?}: {text:?}");
                assert!(
                    !text.lines().any(|l| l.starts_with("::")),
                    "{args:?}: {text}"
                );
            }
        }
    }
}

/// Every text format that `render` writes to a single file.
const TEXTS: &[&str] = &["json", "dot", "mmd", "md", "svg", "html"];

#[test]
fn no_name_is_raw_in_a_text_on_standard_output() {
    let dir = tempfile::tempdir().unwrap();
    let bag = steering(dir.path());
    for format in TEXTS {
        let args = ["render", &bag, "-p", "all", "-o", "-", "--format", format];
        let text = printed(dir.path(), &args);
        assert!(!text.contains(is_obeyed), "{args:?}: {text:?}");
        assert!(!text.lines().any(|l| l.starts_with("::")), "{args:?}");
    }
}

#[test]
fn arguments_cannot_control_the_terminal() {
    let dir = tempfile::tempdir().unwrap();
    let bad = "\u{1b}[2J\u{202e}\n::error::x\u{9b}";
    let option = format!("--{bad}");
    let period = format!("--period={bad}");
    for args in [
        &[bad][..],
        &["render", COURIER, &option],
        &["render", COURIER, &period],
        &["info", COURIER, "--format", bad],
        &["completions", bad],
        &["styles", "light", bad],
        &["styles", bad],
        &["render", COURIER, "--hide", bad],
        &["render", COURIER, "--strip", bad],
        &["render", COURIER, "--link", bad],
    ] {
        let output = bagreel(dir.path(), args);
        let said = errors(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(!said.contains(is_obeyed), "{args:?}: {said:?}");
        assert!(!said.lines().any(|l| l.starts_with("::")), "{args:?}");
    }
}

#[test]
fn printed_json_contains_the_exact_names() {
    let dir = tempfile::tempdir().unwrap();
    let bag = steering(dir.path());
    let json: serde_json::Value =
        serde_json::from_str(&printed(dir.path(), &["info", &bag, "--format", "json"])).unwrap();
    let topics = json["topics"].as_array().unwrap();
    let names: Vec<&str> = topics.iter().map(|t| t["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"/d\u{202e}e\u{9b}f\u{7}"), "{names:?}");
}

#[test]
fn tables_contain_no_formulas() {
    let dir = tempfile::tempdir().unwrap();
    let bag = steering(dir.path());
    let output = bagreel(dir.path(), &["render", &bag, "-o", "x.csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let topics = std::fs::read_to_string(dir.path().join("x.topics.csv")).unwrap();
    assert!(topics.contains(",'=cmd|'/c calc'!A1,"), "{topics}");
    assert!(!topics.contains(is_obeyed), "{topics}");
}

#[test]
fn a_damaged_font_is_refused() {
    let (Some(bag), Some(font)) = (
        support::shared("data/hostile/cyr.bag"),
        support::shared("data/hostile/font_244.ttf"),
    ) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let (bag, font) = (bag.to_str().unwrap(), font.to_str().unwrap());
    let output = bagreel(
        dir.path(),
        &["render", bag, "--font", font, "-p", "5", "-o", "x.pdf"],
    );
    let said = errors(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("malformed font"), "{said}");
}
