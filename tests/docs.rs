//! The README tells the truth: its commands run, its tables are the code's tables.

use std::path::Path;
use std::process::Command;

use bagreel::internals::evidence::SOURCES;
use bagreel::internals::export::FORMATS;

const README: &str = include_str!("../README.md");

/// The rows of the README's table that begins under this head: each row's first cell without quotes.
fn first_cells(head: &str) -> Vec<String> {
    let table = README.split(head).nth(1).unwrap_or_default();
    let rows = table
        .lines()
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        row.split('|')
            .nth(1)
            .unwrap()
            .trim()
            .replace(['`', '.'], "")
    })
    .collect()
}

#[test]
fn the_readme_begins_with_the_two_commands() {
    let block = README.split("```").nth(1).unwrap();
    let commands: Vec<&str> = block
        .lines()
        .skip(1)
        .map(|line| line.split('#').next().unwrap().trim())
        .collect();
    assert_eq!(
        commands,
        [
            "cargo run --release -- render examples/warehouse.bag",
            "cargo test --release"
        ]
    );
}

#[test]
fn every_output_format_has_its_row() {
    let rows = first_cells("| extension | what |");
    let formats: Vec<&str> = FORMATS.iter().map(|f| f.word).collect();
    assert_eq!(rows, formats);
}

#[test]
fn every_kind_of_evidence_has_its_row() {
    let rows = first_cells("| evidence | what it tells |");
    let sources: Vec<&str> = SOURCES.iter().map(|s| s.word).collect();
    assert_eq!(rows, sources);
}

#[test]
fn every_command_of_the_readme_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let out = tempfile::tempdir().unwrap();
    let block = README
        .split("## Use")
        .nth(1)
        .unwrap()
        .split("```")
        .nth(1)
        .unwrap();
    let lines: Vec<&str> = block
        .lines()
        .filter(|line| line.starts_with("bagreel "))
        .collect();
    assert!(lines.len() >= 6);
    for line in lines {
        let command = line.split(" #").next().unwrap();
        let words = command
            .split_whitespace()
            .skip(1)
            .map(|word| word.trim_matches('\''));
        let words = words.map(|word| match word {
            "run7.bag" => root.join("examples/warehouse.bag").display().to_string(),
            "run7/" => root.join("examples/courier").display().to_string(),
            "run7.mcap" => root.join("examples/courier.mcap").display().to_string(),
            "bags/" => root.join("examples").display().to_string(),
            "/planner" => "/robot1/planner".to_owned(),
            "/plan" => "/robot1/plan".to_owned(),
            other => other.to_owned(),
        });
        let run = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(&out)
            .args(words)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(0), "{command}: {said}");
    }
}
