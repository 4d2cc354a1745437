//! Tests of the command in hostile conditions: signals, full disks, pipes, endless files, foreign file names.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const COURIER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");

fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.current_dir(folder).args(args);
    command
}

fn bagreel(folder: &Path, args: &[&str]) -> Output {
    command(folder, args).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let name = |e: std::io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = entries.map(name).collect();
    names.sort();
    names
}

/// Every command that prints results.
const PRINTING: &[&[&str]] = &[
    &["info", COURIER],
    &["info", COURIER, "--format", "json"],
    &["info", COURIER, "--format", "csv"],
    &["info", COURIER, "--why", "/tf"],
    &["info", concat!(env!("CARGO_MANIFEST_DIR"), "/examples")],
    &["events", COURIER],
    &["events", COURIER, "--format", "ndjson"],
    &["styles"],
    &["styles", "light"],
    &["man"],
    &["completions", "bash"],
    &["--help"],
    &["render", "--help"],
    &["--version"],
    &["render", COURIER, "-o", "-", "--format", "json"],
    &["render", COURIER, "-o", "-", "--format", "dot"],
];

#[test]
fn a_closed_pipe_is_not_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for args in PRINTING {
        let mut child = command(dir.path(), args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(
            output.status.code(),
            Some(0),
            "{args:?}: {}",
            errors(&output)
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure_of_every_command() {
    let dir = tempfile::tempdir().unwrap();
    for args in PRINTING {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let output = command(dir.path(), args).stdout(full).output().unwrap();
        assert_eq!(
            output.status.code(),
            Some(1),
            "{args:?}: {}",
            errors(&output)
        );
        // clap's own output has no message for this.
        if !args.iter().any(|a| ["--help", "--version"].contains(a)) {
            let said = errors(&output);
            assert!(
                said.contains("No space left") && said.contains("hint: free some space"),
                "{said}"
            );
        }
    }
}

#[test]
fn user_files_are_not_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    fs::create_dir(path("bag")).unwrap();
    fs::copy(COURIER, path("bag/bag_0.mcap")).unwrap();
    fs::write(path("bag/metadata.yaml"), "rosbag2_bagfile_information:\n  version: 4\n  storage_identifier: mcap\n  relative_file_paths: [bag_0.mcap]\n  message_count: 1\n").unwrap();
    fs::write(path("t.dot"), "digraph {}").unwrap();
    fs::write(path("g.nodes.csv"), "Name\n/a\n").unwrap();
    fs::write(path("c.md"), "0|start\n").unwrap();
    fs::write(path("s.toml"), "").unwrap();
    fs::write(path("x.json"), "{}").unwrap();
    let before: Vec<Vec<u8>> = [
        "bag/bag_0.mcap",
        "bag/metadata.yaml",
        "t.dot",
        "g.nodes.csv",
        "c.md",
        "s.toml",
        "x.json",
    ]
    .map(|name| fs::read(path(name)).unwrap())
    .into();
    let refused: &[&[&str]] = &[
        &["render", "bag", "-o", "bag/bag_0.mcap", "--format", "json"],
        &["render", "bag", "-o", "bag/bag_{n}.mcap", "--format", "svg"],
        &[
            "render",
            "bag",
            "-o",
            "bag/metadata.yaml",
            "--format",
            "json",
        ],
        &["render", COURIER, "--topology", "t.dot", "-o", "t.dot"],
        &[
            "render",
            COURIER,
            "--topology",
            "g.nodes.csv",
            "-o",
            "g.csv",
        ],
        &["render", COURIER, "--phases", "c.md", "-o", "c.md"],
        &[
            "render", COURIER, "--style", "s.toml", "-o", "s.toml", "--format", "json",
        ],
        &["render", COURIER, "--layout-from", "x.json", "-o", "x.json"],
        &["render", COURIER, "-o", "a{n}.svg", "-o", "a0.svg"],
        &["render", COURIER, "-o", "a.gif", "-o", "new/../a.gif"],
        &[
            "render", COURIER, "--source", ".", "-o", "s.toml", "--format", "json",
        ],
    ];
    for args in refused {
        let output = bagreel(dir.path(), args);
        let said = errors(&output);
        // Inputs that are read before the outputs are checked may fail first.
        assert!(
            matches!(output.status.code(), Some(1 | 2)),
            "{args:?}: {said}"
        );
    }
    let after: Vec<Vec<u8>> = [
        "bag/bag_0.mcap",
        "bag/metadata.yaml",
        "t.dot",
        "g.nodes.csv",
        "c.md",
        "s.toml",
        "x.json",
    ]
    .map(|name| fs::read(path(name)).unwrap())
    .into();
    assert_eq!(before, after);
    assert_eq!(
        names(dir.path()),
        ["bag", "c.md", "g.nodes.csv", "s.toml", "t.dot", "x.json"]
    );
}

#[test]
fn tables_in_a_folder_do_not_replace_input_bags() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    let first = bagreel(dir.path(), &["tables", COURIER, "-o", "fleet"]);
    assert_eq!(first.status.code(), Some(0), "{}", errors(&first));
    let counts = "fleet/courier.mcap.csv".to_owned();
    let by_fields = ["extract", "--fields", "--format", "csv", COURIER, "-o", "f"];
    let first = bagreel(dir.path(), &by_fields);
    assert!(
        matches!(first.status.code(), Some(0 | 3)),
        "{}",
        errors(&first)
    );
    let table = format!("f/{}", names(&path("f"))[0]);
    fs::copy(COURIER, path(&counts)).unwrap();
    fs::copy(WAREHOUSE, path(&table)).unwrap();
    let refused: &[&[&str]] = &[
        &["tables", COURIER, &counts, "-o", "fleet"],
        &["tables", COURIER, &counts, "-o", "new/../fleet"],
        &[
            "extract", "--fields", "--format", "csv", COURIER, &table, "-o", "f",
        ],
        &["extract", COURIER, &table, "-o", &table],
    ];
    for args in refused {
        let output = bagreel(dir.path(), args);
        let said = errors(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains("overwrite"), "{args:?}: {said}");
    }
    let kept = |name: &String, bag: &str| fs::read(path(name)).unwrap() == fs::read(bag).unwrap();
    assert!(kept(&counts, COURIER) && kept(&table, WAREHOUSE));
    assert_eq!(names(dir.path()), ["f", "fleet"]);
}

#[test]
fn tables_without_an_extension_get_csv() {
    let dir = tempfile::tempdir().unwrap();
    let output = bagreel(
        dir.path(),
        &["render", COURIER, "--format", "csv", "-o", "x"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let tables = [
        "bags", "changes", "edges", "events", "nodes", "phases", "topics",
    ];
    assert_eq!(names(dir.path()), tables.map(|t| format!("x.{t}.csv")));
}

#[cfg(target_os = "linux")]
#[test]
fn tables_are_not_written_to_devices() {
    let dir = tempfile::tempdir().unwrap();
    let output = bagreel(
        dir.path(),
        &["render", COURIER, "--format", "csv", "-o", "/dev/full"],
    );
    assert_eq!(output.status.code(), Some(2), "{}", errors(&output));
    assert!(
        errors(&output).contains("several files"),
        "{}",
        errors(&output)
    );
}

#[cfg(target_os = "linux")]
#[test]
fn an_output_may_have_any_name() {
    use std::os::unix::ffi::OsStrExt as _;
    let dir = tempfile::tempdir().unwrap();
    let name = std::ffi::OsStr::from_bytes(b"a\xff.json");
    let output = command(dir.path(), &["render", COURIER, "-o"])
        .arg(name)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(dir.path().join(name).exists());
}

#[cfg(unix)]
#[test]
fn endless_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let zero = |name: &str| std::os::unix::fs::symlink("/dev/zero", dir.path().join(name)).unwrap();
    zero("zero.yaml");
    zero("zero.txt");
    let no_text = "not UTF-8 text";
    for (option, says) in [
        (["--style", "zero.txt"], no_text),
        (["--font", "zero.txt"], "not supported"),
        (["--topology", "zero.yaml"], "not supported"),
        (["--layout-from", "zero.txt"], no_text),
    ] {
        let args = [&["render", COURIER, "-o", "x.gif"][..], &option].concat();
        let output = bagreel(dir.path(), &args);
        let said = errors(&output);
        assert_eq!(output.status.code(), Some(1), "{option:?}: {said}");
        assert!(said.contains(says), "{option:?}: {said}");
    }
}

/// A crafted input of this name.
fn crafted(name: &str) -> String {
    format!("{}/tests/data/hostile/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// The exit code of `info`, and its message count, if any.
fn counted(path: &str) -> (Option<i32>, Option<u64>) {
    let output = bagreel(Path::new("."), &["info", "--format", "json", path]);
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.code(), said["messages"].as_u64())
}

#[test]
fn damaged_recordings_terminate_and_report_all_losses() {
    // The number of messages before the damage; `None` if there never were any, or none is left.
    for (name, all) in [
        ("n0_hang.bag", None),
        ("n0_slow.bag", None),
        ("n2_front_op.bag", Some(40)),
        ("n3_alloc_3g.mcap", None),
        ("n6_mcap_op04.mcap", Some(30)),
        ("n13_half_index.mcap", Some(98)),
    ] {
        let (code, found) = counted(&crafted(name));
        let fine: &[_] = if all.is_none() {
            &[Some(0), Some(1), Some(3)]
        } else if found == all {
            &[Some(0), Some(3)]
        } else {
            &[Some(3)]
        };
        assert!(
            fine.contains(&code),
            "{name}: {found:?} of {all:?}, exit {code:?}"
        );
    }
}

#[test]
fn a_survey_reads_connections_that_are_described_after_time_went_back() {
    let folder = tempfile::tempdir().unwrap();
    for (name, messages) in [
        ("p1_duplicate_record.mcap", 53),
        ("p1_late_channel.mcap", 74),
        ("p1_swapped_chunks.bag", 48),
    ] {
        let (code, found) = counted(&crafted(name));
        assert!(matches!(code, Some(0 | 3)), "{name}: {code:?}");
        assert_eq!(found, Some(messages), "{name}");
        fs::copy(crafted(name), folder.path().join(name)).unwrap();
    }
    let output = bagreel(Path::new("."), &["info", &folder.path().to_string_lossy()]);
    let rows = String::from_utf8(output.stdout).unwrap();
    assert_eq!(rows.lines().count(), 4, "{rows}");
}

#[test]
fn a_recording_cut_after_a_chunk_head_terminates() {
    let whole = fs::read(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/warehouse.bag"
    ))
    .unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("cut.bag");
    let head = whole.windows(4).position(|w| w == b"op=\x05").unwrap();
    let sizes = whole[head..]
        .windows(5)
        .position(|w| w == b"size=")
        .unwrap()
        + head
        + 9;
    for more in 0..5 {
        fs::write(&path, &whole[..sizes + more]).unwrap();
        let (code, _) = counted(&path.to_string_lossy());
        assert!(matches!(code, Some(1 | 3)), "{more}: {code:?}");
    }
}

#[test]
fn a_mission_of_three_hundred_years_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let bag = crafted("06_span292.mcap");
    for args in [
        &["render", &bag, "-p", "all", "-o", "x.svg"][..],
        &["render", &bag, "-o", "x.gif"],
        &["info", &bag],
        &["events", &bag],
    ] {
        let output = bagreel(dir.path(), args);
        let said = errors(&output);
        // Skipped messages set the exit code too.
        assert_eq!(output.status.code(), Some(3), "{args:?}: {said}");
        assert!(said.contains("impossible time, set aside"), "{said}");
    }
    for command in ["info", "events", "render"] {
        let output = bagreel(dir.path(), &[command, &crafted("06_span292.json")]);
        let said = errors(&output);
        assert_eq!(output.status.code(), Some(1), "{command}: {said}");
        assert!(said.contains("cover more than 36525 days"), "{said}");
    }
}

#[test]
fn a_clock_set_late_does_not_create_fifty_years_of_windows() {
    let dir = tempfile::tempdir().unwrap();
    let args = ["render", &crafted("08_jump1970.bag"), "-o", "x.json"];
    let output = bagreel(dir.path(), &args);
    let said = errors(&output);
    assert!(
        said.contains("impossible time, set aside (300 times)"),
        "{said}"
    );
    assert!(said.contains(" 6 windows of 20 s"), "{said}");
}

mod printed;
#[cfg(unix)]
mod unix;
