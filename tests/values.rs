//! Tests that a mission read from its own JSON equals the one read from the bag: all outputs are identical byte for
//! byte.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::support::{ORIGIN, Recording, rosbag1};

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
/// Every file that `bagreel render` writes for `input`, by name.
fn files(input: &Path, formats: &[&str], options: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.arg("render").arg(input).arg("-q").args(options);
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

/// A bag, how it is read, the files, how it is drawn, the form of its JSON.
type Case = (
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
    &'static [&'static str],
    &'static str,
);

#[test]
fn rendering_exported_json_gives_the_same_bytes() {
    const FRAMES: [&str; 5] = ["x.svg", "x.html", "x.md", "x.json", "x.png"];
    const TWENTY: [&str; 2] = ["--period", "20"];
    let cases: [Case; 8] = [
        ("courier.mcap", &[], FORMATS, &[], "windows"),
        ("courier.mcap", &[], FORMATS, &[], "runs"),
        ("warehouse.bag", &TWENTY, &FRAMES, &[], "windows"),
        (
            "warehouse.bag",
            &[],
            &["x{n}.svg"],
            &["--view", "board"],
            "runs",
        ),
        (
            "warehouse.bag",
            &[],
            &["x.json", "x.csv"],
            &["--filtered"],
            "windows",
        ),
        (
            "warehouse.bag",
            &[],
            &["x.svg"],
            &["--figure", "lives"],
            "windows",
        ),
        (
            "warehouse.bag",
            &[],
            &["x.pdf"],
            &["--figure", "map"],
            "windows",
        ),
        (
            "warehouse.bag",
            &[],
            &["x.svg"],
            &["--figure", "steps"],
            "runs",
        ),
    ];
    for (bag, reading, formats, drawing, form) in cases {
        let bag = example(bag);
        let first = files(&bag, formats, &[reading, drawing].concat());
        let data = files(&bag, &["y.json"], &[reading, &["--json", form]].concat());
        let folder = tempfile::tempdir().unwrap();
        let mission = folder.path().join("y.json");
        fs::write(&mission, &data["y.json"]).unwrap();
        let second = files(&mission, formats, drawing);
        assert!(first.keys().eq(second.keys()), "{bag:?}: other files");
        for (name, bytes) in &first {
            assert!(
                second[name] == *bytes,
                "{bag:?} {form} {drawing:?}: another {name}"
            );
        }
    }
}

/// A robot that publishes its activity on a topic.
fn telling() -> Vec<u8> {
    let mut bag = Recording::default();
    let odometry = bag.publisher("/base", "/odom", "nav_msgs/Odometry");
    bag.send(odometry, (0, 60_000), 100, &[1; 16]);
    let state = bag.publisher("/executor", "/task", "std_msgs/String");
    for (second, text) in [
        (10, "driving"),
        (20, "driving"),
        (30, "picking"),
        (45, "docking"),
    ] {
        let mut payload = u32::try_from(text.len()).unwrap().to_le_bytes().to_vec();
        payload.extend(text.bytes());
        let at = ORIGIN + second * 1_000_000_000;
        bag.messages.push((state, at, payload));
    }
    bag.messages.sort_by_key(|message| message.1);
    rosbag1::write(&bag, rosbag1::Pack::None, 1 << 16)
}

fn bagreel(arguments: &[&str], input: &[u8]) -> (bool, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.args(arguments).stdin(Stdio::piped());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut pipe = child.stdin.take().unwrap();
    // A command that is refused early leaves its input unread.
    let _ = pipe.write_all(input);
    drop(pipe);
    let done = child.wait_with_output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        done.status.success(),
        text(&done.stdout),
        text(&done.stderr),
    )
}

#[test]
fn captions_are_read_from_a_pipe() {
    let arguments = [
        "render",
        "-",
        "--captions",
        "/task",
        "-o",
        "-",
        "--format",
        "json",
        "-q",
    ];
    let (is_done, text, error) = bagreel(&arguments, &telling());
    assert!(is_done, "{error}");
    let mission: serde_json::Value = serde_json::from_str(&text).unwrap();
    let phases = mission["phases"].as_array().unwrap();
    let shown = phases.iter().skip(1).map(|phase| {
        let start = phase["start_ns"].as_i64().unwrap();
        let second = (start - ORIGIN) / 1_000_000_000;
        (second, phase["name"].as_str().unwrap())
    });
    // A repeated caption is not a new phase, and the time before the first one is a phase of its own.
    let shown: Vec<_> = shown.collect();
    assert_eq!(shown, [(10, "driving"), (30, "picking"), (45, "docking")]);
}

#[test]
fn invalid_captions_are_refused() {
    let bag = telling();
    let asked = |from: &str| {
        bagreel(
            &[
                "render",
                "-",
                "--captions",
                from,
                "-o",
                "-",
                "--format",
                "json",
                "-q",
            ],
            &bag,
        )
    };
    let (is_done, _, error) = asked("/odom");
    assert!(
        !is_done && error.contains("neither a file nor a topic"),
        "{error}"
    );
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("x.json").display().to_string();
    assert!(bagreel(&["render", "-", "-o", &json, "-q"], &bag).0);
    let (is_done, _, error) = bagreel(
        &[
            "render",
            &json,
            "--captions",
            "/task",
            "-o",
            "-",
            "--format",
            "gif",
        ],
        b"",
    );
    assert!(!is_done && error.contains("is a mission's JSON"), "{error}");
}

/// The windows of a mission that is cut, in seconds after its start.
fn windows(arguments: &[&str]) -> Vec<(i64, i64)> {
    let bag = example("warehouse.bag").display().to_string();
    let whole = [
        &["render", &bag, "-q", "-o", "-", "--format", "json"],
        arguments,
    ]
    .concat();
    let (is_done, text, error) = bagreel(&whole, b"");
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
    assert_eq!(starts, [0, 38, 97, 163, 177, 200, 296]);
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
    assert!(bagreel(&["render", &bag, "-o", &json, "-q"], b"").0);
    let refused: [&[&str]; 4] = [
        &[
            "render", &bag, "--cut", "phases", "--period", "5", "-o", "-", "--format", "json",
        ],
        &[
            "render", &bag, "--cut", "phases", "--phases", "none", "-o", "-", "--format", "json",
        ],
        &[
            "render", &json, "--cut", "phases", "-o", "-", "--format", "svg",
        ],
        &[
            "render", &bag, "--json", "runs", "-o", "-", "--format", "svg",
        ],
    ];
    for arguments in refused {
        let (is_done, _, error) = bagreel(arguments, b"");
        assert!(!is_done && error.contains("--"), "{arguments:?}: {error}");
    }
}
