//! Tests that a mission read from its own JSON equals the one read from the bag: all outputs are identical byte for
//! byte.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn example(name: &str) -> PathBuf {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    examples.join(name)
}

/// All formats that are fast enough; animations consist of the frames.
const FORMATS: &[&str] = &[
    "x.svg",
    "x{n}.svg",
    "x.png",
    "x.pdf",
    "x.html",
    "x.md",
    "x.dot",
    "x.mmd",
    "x.json",
    "x.csv",
    #[cfg(feature = "parquet")]
    "x.parquet",
];
/// Every file that a command writes for `input`, by name.
fn files(
    subcommand: &str,
    input: &Path,
    formats: &[&str],
    options: &[&str],
) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.arg(subcommand).arg(input).arg("-q").args(options);
    for name in formats {
        command.arg("-o").arg(folder.path().join(name));
    }
    assert!(
        command.status().unwrap().success(),
        "{} {options:?}",
        input.display()
    );
    let files = fs::read_dir(folder.path()).unwrap().map(|entry| {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        (name, fs::read(entry.path()).unwrap())
    });
    files.collect()
}

#[test]
fn rendering_exported_json_gives_the_same_bytes() {
    const FRAMES: [&str; 5] = ["x.svg", "x.html", "x.md", "x.json", "x.png"];
    const TWENTY: [&str; 2] = ["--period", "20"];
    let cases: [Case; 7] = [
        ("render", "courier.mcap", &[], FORMATS, &[]),
        ("render", "warehouse.bag", &TWENTY, &FRAMES, &[]),
        (
            "render",
            "warehouse.bag",
            &[],
            &["x{n}.svg"],
            &["--mode", "topics"],
        ),
        (
            "render",
            "warehouse.bag",
            &[],
            &["x.json", "x.csv"],
            &["--hide", "quiet,leaf"],
        ),
        ("figure", "warehouse.bag", &[], &["x.svg"], &[]),
        (
            "figure",
            "warehouse.bag",
            &[],
            &["x.pdf"],
            &["--kind", "graph"],
        ),
        (
            "figure",
            "warehouse.bag",
            &[],
            &["x.svg"],
            &["--kind", "steps"],
        ),
    ];
    for (command, bag, reading, formats, drawing) in cases {
        let bag = example(bag);
        let first = files(command, &bag, formats, &[reading, drawing].concat());
        let data = files("render", &bag, &["y.json"], reading);
        let folder = tempfile::tempdir().unwrap();
        let mission = folder.path().join("y.json");
        fs::write(&mission, &data["y.json"]).unwrap();
        let second = files(command, &mission, formats, drawing);
        assert!(first.keys().eq(second.keys()), "{bag:?}: other files");
        for (name, bytes) in &first {
            assert!(
                without_texts(&second[name]) == without_texts(bytes),
                "{command} {bag:?} {drawing:?}: another {name}"
            );
        }
    }
}

/// A page without the texts that nodes logged, which a mission's JSON does not contain; other files as they are.
fn without_texts(file: &[u8]) -> Vec<u8> {
    const START: &str = "\"lives\":";
    let page = str::from_utf8(file).unwrap_or_default();
    let data = page.find("application/json");
    let Some(at) = data.and_then(|at| Some(at + page[at..].find(START)? + START.len())) else {
        return file.to_vec();
    };
    let mut lives = serde_json::Deserializer::from_str(&page[at..]).into_iter();
    let mut all: serde_json::Value = lives.next().unwrap().unwrap();
    let end = at + lives.byte_offset();
    for life in all.as_array_mut().unwrap().iter_mut() {
        for signs in life[1].as_array_mut().unwrap() {
            signs[3] = serde_json::Value::Null;
        }
    }
    format!("{}{all}{}", &page[..at], &page[end..]).into_bytes()
}

/// A command, a bag, how it is read, the files, how it is drawn.
type Case = (
    &'static str,
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
    &'static [&'static str],
);

fn bagreel(arguments: &[&str]) -> (bool, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    let done = command.args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        done.status.success(),
        text(&done.stdout),
        text(&done.stderr),
    )
}

/// The windows of a mission that is cut, in seconds after its start.
fn windows(arguments: &[&str]) -> Vec<(i64, i64)> {
    let bag = example("warehouse.bag").display().to_string();
    let whole = [
        &["render", &bag, "-q", "-o", "-", "--format", "json"],
        arguments,
    ]
    .concat();
    let (is_done, text, error) = bagreel(&whole);
    assert!(is_done, "{error}");
    let mission: serde_json::Value = serde_json::from_str(&text).unwrap();
    let start = mission["start_ns"].as_i64().unwrap();
    let second = |at: &serde_json::Value| (at.as_i64().unwrap() - start) / 1_000_000_000;
    let windows = mission["windows"].as_array().unwrap();
    assert!(windows.iter().all(|w| w["partial"] == false));
    let spans = windows
        .iter()
        .map(|w| (second(&w["start_ns"]), second(&w["end_ns"])));
    spans.collect()
}

#[test]
fn windows_are_cut_by_phases_or_changes() {
    let phases = windows(&["--cut", "phases"]);
    let starts: Vec<i64> = phases.iter().map(|(start, _)| *start).collect();
    assert_eq!(starts, [0, 37, 97, 162, 177, 200, 296]);
    let changes = windows(&["--cut", "changes"]);
    assert!((15..=40).contains(&changes.len()), "{changes:?}");
    assert!(
        changes.windows(2).all(|pair| pair[0].1 == pair[1].0),
        "{changes:?}"
    );
    // The planner starts at 37 s with its whole group, and stops at 176 s.
    for second in [37, 176] {
        assert!(
            changes.iter().any(|(start, _)| (start - second).abs() <= 1),
            "{changes:?}"
        );
    }
}

#[test]
fn a_cut_is_refused_if_inapplicable() {
    let bag = example("courier.mcap").display().to_string();
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("x.json").display().to_string();
    assert!(bagreel(&["render", &bag, "-o", &json, "-q"]).0);
    let refused: [&[&str]; 3] = [
        &[
            "render", &bag, "--cut", "phases", "--period", "5", "-o", "-", "--format", "json",
        ],
        &[
            "render", &bag, "--cut", "phases", "--phases", "none", "-o", "-", "--format", "json",
        ],
        &[
            "render", &json, "--cut", "phases", "-o", "-", "--format", "svg",
        ],
    ];
    for arguments in refused {
        let (is_done, _, error) = bagreel(arguments);
        assert!(!is_done && error.contains("--"), "{arguments:?}: {error}");
    }
}
