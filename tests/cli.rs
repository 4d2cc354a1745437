//! Tests of the command as a process: its exit codes, outputs and leftovers.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::support::windows;

const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");

/// Runs the command in its own folder.
fn bagreel(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

fn errors(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// A file with these bytes, in `folder`.
fn file(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[track_caller]
fn refused(folder: &Path, args: &[&str], with: i32, says: &str, hint: &str) {
    let output = bagreel(folder, args);
    let said = errors(&output);
    assert_eq!(code(&output), Some(with), "{said}");
    assert!(said.contains(says), "no `{says}` in: {said}");
    assert!(said.contains(hint), "no `{hint}` in: {said}");
}

#[test]
fn files_that_are_not_bags_are_refused_with_advice() {
    let dir = folder();
    file(dir.path(), "empty.bag", b"");
    file(dir.path(), "text.bag", b"hello, this is a note\n");
    file(
        dir.path(),
        "lfs.bag",
        b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n",
    );
    file(dir.path(), "old.bag", b"#ROSRECORD V1.2\n0\n");
    refused(
        dir.path(),
        &["render", "gone.bag"],
        1,
        "`gone.bag`",
        "hint: check the spelling",
    );
    refused(dir.path(), &["render", "empty.bag"], 1, "is empty", "hint:");
    refused(
        dir.path(),
        &["render", "text.bag"],
        1,
        "is not a bag",
        "hint:",
    );
    refused(dir.path(), &["render", "lfs.bag"], 1, "LFS", "git lfs pull");
    refused(dir.path(), &["render", "old.bag"], 1, "1.2", "hint:");
}

#[test]
fn invalid_requests_are_usage_errors() {
    let dir = folder();
    refused(dir.path(), &[], 2, "Usage", "");
    refused(
        dir.path(),
        &["render", WAREHOUSE, "-o", "x.gfi"],
        2,
        "unknown format `gfi`",
        "gif, ",
    );
    refused(
        dir.path(),
        &["render", WAREHOUSE, "--period", "never"],
        2,
        "never",
        "30s",
    );
    refused(
        dir.path(),
        &["render", WAREHOUSE, "--period", "1ms"],
        2,
        "more than 100000",
        "--period 100ms",
    );
    refused(
        dir.path(),
        &["render", WAREHOUSE, "--start", "1h"],
        2,
        "select nothing",
        "the bag covers",
    );
    refused(
        dir.path(),
        &["render", WAREHOUSE, "--style", "neon"],
        2,
        "neon",
        "light",
    );
    refused(
        dir.path(),
        &["render", WAREHOUSE, "--layout", "magic"],
        2,
        "magic",
        "layered",
    );
    assert_eq!(
        fs::read_dir(dir.path()).unwrap().count(),
        0,
        "nothing was written"
    );
}

#[test]
fn an_unwritable_output_is_detected_before_the_bag_is_read() {
    let dir = folder();
    file(dir.path(), "wall", b"");
    let output = bagreel(dir.path(), &["render", "gone.bag", "-o", "wall/x.json"]);
    assert_eq!(code(&output), Some(1));
    assert!(errors(&output).contains("wall"), "{}", errors(&output));
}

#[test]
fn an_output_never_replaces_its_own_bag() {
    let dir = folder();
    let bag = dir.path().join("x.json");
    fs::copy(WAREHOUSE, &bag).unwrap();
    let before = fs::read(&bag).unwrap();
    assert_eq!(
        code(&bagreel(dir.path(), &["render", "x.json", "-o", "x.json"])),
        Some(2)
    );
    assert_eq!(fs::read(&bag).unwrap(), before);
}

#[test]
fn a_truncated_bag_is_recovered_and_exits_3() {
    let dir = folder();
    let whole = fs::read(WAREHOUSE).unwrap();
    file(dir.path(), "cut.bag", &whole[..whole.len() / 2]);
    let output = bagreel(dir.path(), &["render", "cut.bag", "-o", "x.json"]);
    assert_eq!(code(&output), Some(3), "{}", errors(&output));
    assert!(errors(&output).contains("warning:"), "{}", errors(&output));
    let text = fs::read_to_string(dir.path().join("x.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["bags"][0]["complete"], false);
    assert!(
        json["messages"].as_u64().unwrap() > 10_000,
        "half of 26,719 messages"
    );
}

/// The outcome with these bytes on standard input.
fn piped(folder: &Path, args: &[&str], bytes: Vec<u8>) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(folder)
        .args(args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let writer = std::thread::spawn(move || stdin.write_all(&bytes));
    let output = child.wait_with_output().unwrap();
    // A bag that is refused is not read to its end.
    let _ = writer.join().unwrap();
    output
}

#[test]
fn standard_input_has_the_same_counts_as_the_file() {
    let dir = folder();
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let json = |input: &str| {
        ["render", input, "-p", "30", "-o", "-", "--format", "json"].map(str::to_owned)
    };
    for name in ["warehouse.bag", "courier.mcap", "courier/courier_0.db3"] {
        let path = examples.join(name);
        let args = json(path.to_str().unwrap());
        let from_file = bagreel(dir.path(), &args.each_ref().map(String::as_str));
        let bytes = fs::read(&path).unwrap();
        // As rosbag2 compresses it.
        let packed = zstd::encode_all(&bytes[..], 1).unwrap();
        let args = json("-");
        let args = args.each_ref().map(String::as_str);
        let all = [Some(bytes).filter(|_| !name.ends_with("db3")), Some(packed)];
        for bytes in all.into_iter().flatten() {
            let from_pipe = piped(dir.path(), &args, bytes);
            assert_eq!(code(&from_pipe), Some(0), "{name}: {}", errors(&from_pipe));
            assert!(
                counts(&from_pipe.stdout) == counts(&from_file.stdout),
                "{name}"
            );
        }
    }
    let database = fs::read(examples.join("courier/courier_0.db3")).unwrap();
    let refused = piped(dir.path(), &["info", "-"], database);
    let said = errors(&refused);
    assert_eq!(code(&refused), Some(1), "{said}");
    assert!(
        said.contains("cannot be read from a pipe") && said.contains("hint: save it to a file"),
        "{said}"
    );
}

/// The count of every topic in every window; payload sizes are only known if payloads are read.
fn counts(json: &[u8]) -> Vec<(String, u64)> {
    let json: serde_json::Value = serde_json::from_slice(json).unwrap();
    let windows = windows::windows(&json);
    assert!(!windows.is_empty());
    let topics = windows.iter().flat_map(|w| w["topics"].as_array().unwrap());
    topics
        .map(|t| (t["name"].to_string(), t["count"].as_u64().unwrap()))
        .collect()
}

#[test]
fn a_closed_pipe_is_not_a_failure() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args([
            "render", WAREHOUSE, "--period", "10", "-o", "-", "--format", "json",
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn output_is_deterministic() {
    let dir = folder();
    let run = |name: &str| {
        let outputs = ["gif", "json", "dot"].map(|e| format!("{name}.{e}"));
        let mut args = vec!["render", WAREHOUSE, "--size", "640x360", "--fit", "none"];
        for output in &outputs {
            args.extend(["-o", output]);
        }
        let output = bagreel(dir.path(), &args);
        assert_eq!(code(&output), Some(0), "{}", errors(&output));
        outputs.map(|o| fs::read(dir.path().join(o)).unwrap())
    };
    assert_eq!(run("a"), run("b"));
}

#[test]
fn no_file_is_created_beside_the_bag() {
    let (beside, away) = (folder(), folder());
    let bag = beside.path().join("w.bag");
    fs::copy(WAREHOUSE, &bag).unwrap();
    let output = bagreel(
        away.path(),
        &["render", bag.to_str().unwrap(), "-o", "x.json"],
    );
    assert_eq!(code(&output), Some(0), "{}", errors(&output));
    assert_eq!(fs::read_dir(beside.path()).unwrap().count(), 1);
}

#[test]
fn quiet_prints_no_messages_and_results_go_to_standard_output() {
    let dir = folder();
    let output = bagreel(dir.path(), &["-q", "info", WAREHOUSE]);
    assert_eq!((code(&output), errors(&output).as_str()), (Some(0), ""));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("/robot1/cmd_vel") && text.contains("26719 messages"),
        "{text}"
    );
}

#[test]
fn a_survey_of_a_folder_includes_broken_bags() {
    let dir = folder();
    fs::copy(WAREHOUSE, dir.path().join("w.bag")).unwrap();
    file(dir.path(), "broken.bag", b"");
    let output = bagreel(dir.path(), &["info", ".", "--format", "csv"]);
    let text = String::from_utf8(output.stdout).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    assert_eq!(rows.len(), 3, "{text}");
    assert!(rows[1].starts_with("broken.bag,") && rows[1].contains("empty"));
    assert!(rows[2].starts_with("w.bag,rosbag1,none,index,true,"));
}

#[test]
fn long_help_shows_the_placeholder_of_windows() {
    let dir = folder();
    let help = bagreel(dir.path(), &["render", "--help"]);
    let help = String::from_utf8(help.stdout).unwrap();
    assert!(help.contains("a drawing per window with `{n}`"), "{help}");
    assert!(help.contains("`{n}` writes one file"), "{help}");
}

#[test]
fn every_command_has_its_manual_page() {
    let dir = folder();
    let page = |args: &[&str]| {
        let output = bagreel(dir.path(), args);
        assert_eq!(code(&output), Some(0), "{}", errors(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let all = page(&["man"]);
    let names = all
        .lines()
        .filter_map(|line| line.strip_prefix("bagreel\\-")?.strip_suffix("(1)"));
    let names: Vec<&str> = names.collect();
    assert!(names.len() >= 10 && names.contains(&"check"), "{names:?}");
    for name in names {
        let page = page(&["man", name]);
        assert!(page.contains(&format!(".TH bagreel-{name} 1")), "{page}");
        let lines: Vec<&str> = page.lines().collect();
        for pair in lines.windows(2) {
            let is_option = pair[0].starts_with("\\fB\\-");
            assert!(!is_option || !pair[1].is_empty(), "{name}: {}", pair[0]);
        }
    }
    refused(
        dir.path(),
        &["man", "no_such"],
        2,
        "no command `no_such`",
        "commands: render,",
    );
}
