//! Tests of expectations: generated from runs, checked against them, and broken by each fault of a robot.

mod difference;
mod kept;
mod mission;
mod reports;
mod times;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::Recording;
use crate::support::rosbag1::{self, Pack};

pub(crate) fn bagreel(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(folder)
        .env_remove("GITHUB_STEP_SUMMARY")
        .args(args)
        .output()
        .unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// The exit code and the output.
fn run(folder: &Path, args: &[&str]) -> (i32, String) {
    let output = bagreel(folder, args);
    let errors = String::from_utf8(output.stderr.clone()).unwrap();
    (output.status.code().unwrap(), said(&output) + &errors)
}

#[test]
fn commands_name_the_files_that_they_wrote_once() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    bag(here, "again.bag", &recording(HEALTHY, 1));
    for (args, wrote) in [
        (
            "baseline run.bag again.bag -o g.yaml",
            "wrote g.yaml: 3 nodes, 4 topics, in ",
        ),
        (
            "check run.bag --expect g.yaml -o c.xml -o md/c.md",
            "wrote c.xml, md/c.md: 0 findings, in ",
        ),
        (
            "diff run.bag again.bag -o d.json -o d.svg",
            "wrote d.json, d.svg: 0 differences, in ",
        ),
    ] {
        let args: Vec<&str> = args.split(' ').collect();
        let said = String::from_utf8(bagreel(here, &args).stderr).unwrap();
        let last = said.lines().last().unwrap_or_default();
        assert!(last.starts_with(wrote), "{args:?}: {said}");
        let lines: BTreeSet<&str> = said.lines().collect();
        assert_eq!(
            lines.len(),
            said.lines().count(),
            "a line is repeated: {said}"
        );
        let quiet = bagreel(here, &[&args[..], &["-q"]].concat());
        assert!(quiet.stderr.is_empty(), "{args:?}");
    }
}

#[test]
fn an_expectation_without_rules_is_noted() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    let check = |rules: &str| {
        let text = format!("schema: bagreel.expect/1\n{rules}");
        fs::write(here.join("g.yaml"), text).unwrap();
        run(here, &["check", "run.bag", "--expect", "g.yaml"])
    };
    let (code, said) = check("topics:\n");
    assert!(
        code == 0 && said.contains("`g.yaml` contains no rule that applies"),
        "{said}"
    );
    let (_, said) = check("topics:\n  /scan: {}\n");
    assert!(!said.contains("contains no rule"), "{said}");
}

#[test]
fn reversed_ranges_are_refused_with_their_line() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    for fact in [
        "hz: 5..4",
        "mean_hz: 5..4",
        "within: 2m..1:30",
        "may_end: -10s..-20s",
    ] {
        let text = format!("schema: bagreel.expect/1\ntopics:\n  /scan: {{{fact}}}\n");
        fs::write(here.join("g.yaml"), &text).unwrap();
        let (code, said) = run(here, &["check", "run.bag", "--expect", "g.yaml"]);
        let is_named = said.contains("`g.yaml` line 3, column ") && said.contains(fact);
        assert!(code == 2 && is_named && said.contains("first"), "{said}");
    }
}

#[test]
fn an_expectation_of_another_robot_is_not_updated() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    let gone = (0..1500).map(|n| format!("  /gone_{n}: {{}}\n"));
    let gone = gone.collect::<Vec<_>>().concat();
    let text = format!("schema: bagreel.expect/1\nnodes:\n{gone}");
    fs::write(here.join("g.yaml"), &text).unwrap();
    let (code, said) = run(here, &["baseline", "run.bag", "--update", "g.yaml"]);
    assert!(
        code == 2 && said.contains("1500 facts of `g.yaml`"),
        "{said}"
    );
    assert_eq!(fs::read_to_string(here.join("g.yaml")).unwrap(), text);
    let only = [
        "baseline", "run.bag", "--update", "g.yaml", "--only", "/gone_7",
    ];
    assert_eq!(run(here, &only).0, 0);
    let left = fs::read_to_string(here.join("g.yaml")).unwrap();
    assert_eq!(left, text.replace("  /gone_7: {}\n", ""));
}

/// The ids of all findings of a check, in the order of the file.
fn findings(folder: &Path, bag: &str, expect: &str) -> Vec<String> {
    let output = bagreel(
        folder,
        &["check", bag, "--expect", expect, "--format", "json"],
    );
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rules = report["rules"].as_array().unwrap().iter();
    let findings = rules.flat_map(|rule| rule["findings"].as_array().into_iter().flatten());
    findings
        .map(|f| f["id"].as_str().unwrap().to_owned())
        .collect()
}

/// A robot of three minutes: a lidar, a merger, a controller, and a log that names the subscribers.
#[derive(Clone, Copy)]
struct Robot {
    /// Milliseconds between scans.
    scan_ms: i64,
    /// When the lidar crashes, in milliseconds.
    crash_ms: i64,
    controller: &'static str,
    has_teleop: bool,
}

const HEALTHY: Robot = Robot {
    scan_ms: 100,
    crash_ms: 180_000,
    controller: "/controller",
    has_teleop: false,
};

/// The robot's recording; `shift` moves every message, as from run to run.
fn recording(robot: Robot, shift: i64) -> Recording {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    let odom = bag.publisher("/base", "/odom", "nav_msgs/Odometry");
    let cmd = bag.publisher(robot.controller, "/cmd_vel", "geometry_msgs/Twist");
    let goal = bag.publisher("/base", "/goal", "std_msgs/String");
    bag.send(odom, (0, 180_000), 50, &[2; 48]);
    bag.send(
        scan,
        (300 + shift, robot.crash_ms),
        robot.scan_ms,
        &[1; 400],
    );
    bag.send(cmd, (20_000 + 7 * shift, 180_000), 50, &[3; 48]);
    for at in [30_000, 95_000, 96_000, 150_000] {
        bag.send(
            goal,
            (at + 100 * shift, at + 100 * shift + 1),
            1,
            b"\x01\0\0\0a",
        );
    }
    if robot.has_teleop {
        let teleop = bag.publisher("/teleop", "/cmd_vel", "geometry_msgs/Twist");
        bag.send(teleop, (100_000, 140_000), 100, &[4; 48]);
    }
    bag
}

fn bag(folder: &Path, name: &str, recording: &Recording) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, rosbag1::write(recording, Pack::None, 1 << 16)).unwrap();
    path
}

#[test]
fn a_second_healthy_run_passes_and_each_fault_breaks_its_rules() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "first.bag", &recording(HEALTHY, 0));
    let (code, said) = run(here, &["baseline", "first.bag", "-o", "graph.yaml"]);
    assert_eq!(code, 0, "{said}");
    let table: [(&str, Robot, &[&str]); 5] = [
        ("healthy", HEALTHY, &[]),
        (
            "halved",
            Robot {
                scan_ms: 200,
                ..HEALTHY
            },
            &["topic-rate-low"],
        ),
        (
            "crashed",
            Robot {
                crash_ms: 90_000,
                ..HEALTHY
            },
            &["node-gone", "topic-gap", "topic-rate-low"],
        ),
        (
            "renamed",
            Robot {
                controller: "/pilot",
                ..HEALTHY
            },
            &[
                "node-missing",
                "publisher-missing",
                "publisher-unexpected",
                "unexpected-node",
            ],
        ),
        (
            "second",
            Robot {
                has_teleop: true,
                ..HEALTHY
            },
            &["publisher-unexpected", "topic-rate-high", "unexpected-node"],
        ),
    ];
    for (name, robot, expected) in table {
        let file = format!("{name}.bag");
        bag(here, &file, &recording(robot, 3));
        let mut found = findings(here, &file, "graph.yaml");
        found.sort();
        found.dedup();
        assert_eq!(found, expected, "{name}");
        let (code, said) = run(here, &["check", &file, "--expect", "graph.yaml"]);
        assert_eq!(code, i32::from(!expected.is_empty()), "{name}: {said}");
    }
}

#[test]
fn a_baseline_of_several_runs_passes_on_each() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let runs = [
        ("a.bag", HEALTHY),
        (
            "b.bag",
            Robot {
                scan_ms: 130,
                ..HEALTHY
            },
        ),
        (
            "c.bag",
            Robot {
                has_teleop: true,
                ..HEALTHY
            },
        ),
    ];
    for (name, robot) in runs {
        bag(here, name, &recording(robot, 5));
    }
    let (code, said) = run(
        here,
        &["baseline", "a.bag", "b.bag", "c.bag", "-o", "graph.yaml"],
    );
    assert_eq!(code, 0, "{said}");
    let text = fs::read_to_string(here.join("graph.yaml")).unwrap();
    assert!(
        text.contains("/teleop: {within: 90s..110s, may_end: 125s.., optional: true"),
        "{text}"
    );
    assert!(
        !text.contains("/cmd_vel: {type: geometry_msgs/Twist, by"),
        "{text}"
    );
    for (name, _) in runs {
        assert_eq!(
            findings(here, name, "graph.yaml"),
            Vec::<String>::new(),
            "{name}"
        );
    }
}

#[test]
fn an_update_only_changes_broken_rules() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(
        here,
        "halved.bag",
        &recording(
            Robot {
                scan_ms: 200,
                has_teleop: true,
                ..HEALTHY
            },
            0,
        ),
    );
    let old = "\
# The robot of the second floor.
schema: bagreel.expect/1
policy: {unexpected_nodes: warn}

nodes:
  /base: {} # wheels
  /gone: {restarts: ..0} # sold
  /lidar:   {restarts: ..3}   # may restart
  /controller:
topics:
  # fast enough for the merger
  /scan: {hz: 9..11, by: [/lidar]} # 10 Hz nominal
  /cmd_vel:
    hz: 15..40   # wide
    by: [/controller]
rules:
  - {id: quiet, during: -5s.., changes: ..0}
";
    fs::write(here.join("graph.yaml"), old).unwrap();
    let only = [
        "baseline",
        "halved.bag",
        "--update",
        "graph.yaml",
        "--only",
        "/scan",
    ];
    let (code, said) = run(here, &only);
    assert_eq!(code, 0, "{said}");
    let text = fs::read_to_string(here.join("graph.yaml")).unwrap();
    assert_eq!(text, old.replace("9..11", "4.5..5.5"));
    let (code, said) = run(here, &["baseline", "halved.bag", "--update", "graph.yaml"]);
    assert_eq!(code, 0, "{said}");
    let text = fs::read_to_string(here.join("graph.yaml")).unwrap();
    let expected = old
        .replace("9..11", "4.5..5.5")
        .replace("  /gone: {restarts: ..0} # sold\n", "")
        .replace("    by: [/controller]", "    by: [/controller, /teleop]")
        .replace(
            "  /controller:\n",
            "  /controller:\n  /teleop: {within: 80s..120s, may_end: 111s.., restarts: ..0}\n",
        );
    assert_eq!(text, expected);
    let (code, said) = run(here, &["check", "halved.bag", "--expect", "graph.yaml"]);
    assert_eq!(code, 0, "{said}");
}

#[test]
fn rules_about_times_after_the_mission_are_not_broken() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let crashed = Robot {
        crash_ms: 90_000,
        ..HEALTHY
    };
    bag(here, "run.bag", &recording(crashed, 0));
    let check = |rule: &str, end: &str| {
        let text = format!("schema: bagreel.expect/1\nrules:\n  - {{id: r, {rule}}}\n");
        fs::write(here.join("g.yaml"), text).unwrap();
        run(
            here,
            &["check", "run.bag", "--expect", "g.yaml", "--end", end],
        )
    };
    let presence = "nodes: /spare, within: 20s";
    let (code, said) = check(presence, "15");
    assert!(
        code == 2 && said.contains("the mission lasts 15 s"),
        "{said}"
    );
    assert_eq!(check(presence, "25").0, 1);
}

/// A run, a truncated copy of it, and expectations for every outcome.
fn outcomes() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    let whole = fs::read(here.join("run.bag")).unwrap();
    fs::write(here.join("cut.bag"), &whole[..whole.len() * 2 / 3]).unwrap();
    let write = |name: &str, text: &str| {
        fs::write(here.join(name), format!("schema: bagreel.expect/1\n{text}")).unwrap();
    };
    write("kept.yaml", "nodes:\n  /lidar: {}\n");
    write("broken.yaml", "nodes:\n  /radar: {}\n");
    write(
        "warned.yaml",
        "policy: {unexpected_nodes: warn}\nnodes:\n  /lidar: {}\n",
    );
    write("unknown.yaml", "topics:\n  /scan: {to: [/base]}\n");
    write(
        "blind.yaml",
        "rules:\n  - {id: x, nodes: /lidar, lifecycle: active}\n",
    );
    write("wrong.yaml", "nodes:\n  /lidar: {restart: 0}\n");
    dir
}

#[test]
fn exit_codes_of_check_match_its_help() {
    let dir = outcomes();
    let here = dir.path();
    let table: [(&[&str], i32, &str); 14] = [
        (&["run.bag", "--expect", "kept.yaml"], 0, "1 rule passed"),
        (
            &["run.bag", "--expect", "warned.yaml"],
            0,
            "warning[unexpected-node]: /base",
        ),
        (
            &["run.bag", "--expect", "broken.yaml"],
            1,
            "error[node-missing]: /radar",
        ),
        (
            &["run.bag", "--expect", "unknown.yaml"],
            0,
            "unknown[subscriber-missing]: cannot tell",
        ),
        (
            &[
                "run.bag",
                "--expect",
                "unknown.yaml",
                "--undecidable",
                "error",
            ],
            1,
            "error[subscriber-missing]: cannot tell",
        ),
        (
            &["run.bag", "--expect", "blind.yaml"],
            2,
            "unknown[node-lifecycle]",
        ),
        (
            &[
                "run.bag",
                "--expect",
                "blind.yaml",
                "--undecidable",
                "error",
            ],
            1,
            "error[node-lifecycle]: cannot tell",
        ),
        (
            &["run.bag", "--expect", "wrong.yaml"],
            2,
            "line 3, column 12: unknown key `restart`; the nearest is `restarts`",
        ),
        (&["run.bag", "--expect", "gone.yaml"], 2, "gone.yaml"),
        (&["gone.bag", "--expect", "kept.yaml"], 2, "gone.bag"),
        (&["cut.bag", "--expect", "kept.yaml"], 3, "warning"),
        (&["cut.bag", "--expect", "broken.yaml"], 1, "error["),
        (
            &["--explain", "topic-rate-low"],
            0,
            "fewer messages per second",
        ),
        (
            &["--explain", "topic-rate-lo"],
            2,
            "the nearest is `topic-rate-low`",
        ),
    ];
    for (args, code, says) in table {
        let (got, said) = run(here, &[&["check"], args].concat());
        assert_eq!(got, code, "{args:?}: {said}");
        assert!(said.contains(says), "{args:?}: {said}");
    }
    help_begins(
        here,
        "check",
        "0 passed, 1 failed, 2 not checked",
        "3 passed but data was skipped",
    );
}

#[test]
fn exit_codes_of_diff_and_baseline_match_their_help() {
    let dir = outcomes();
    let here = dir.path();
    bag(here, "same.bag", &recording(HEALTHY, 3));
    let halved = Robot {
        scan_ms: 200,
        ..HEALTHY
    };
    bag(here, "halved.bag", &recording(halved, 0));
    let table: [(&[&str], i32); 11] = [
        (&["diff", "run.bag", "same.bag"], 0),
        (&["diff", "run.bag", "halved.bag"], 1),
        (&["diff", "cut.bag", "halved.bag"], 1),
        (&["diff", "gone.bag", "run.bag"], 2),
        (&["diff", "run.bag"], 2),
        (&["diff", "cut.bag", "cut.bag"], 3),
        (&["baseline", "run.bag", "-o", "new.yaml"], 0),
        (&["baseline", "gone.bag"], 1),
        (&["baseline", "run.bag", "-o", "run.bag"], 2),
        (&["baseline", "run.bag", "--only", "/a"], 2),
        (&["baseline", "cut.bag"], 3),
    ];
    for (args, code) in table {
        let (got, said) = run(here, args);
        assert_eq!(got, code, "{args:?}: {said}");
    }
    help_begins(
        here,
        "diff",
        "0 equal, 1 different, 2 not compared",
        "3 equal but data was skipped",
    );
    help_begins(
        here,
        "baseline",
        "0 written, 1 failed, 2 usage",
        "3 written but data was skipped",
    );
}

/// Checks the exit codes in a command's help: how they begin, and a part of them.
fn help_begins(here: &Path, command: &str, first: &str, holds: &str) {
    let (code, said) = run(here, &[command, "--help"]);
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let codes = said.split("Exit codes: ").nth(1).unwrap_or_default();
    assert!(
        code == 0 && codes.starts_with(first) && codes.contains(holds),
        "{said}"
    );
}

#[test]
fn an_expectation_with_an_alias_bomb_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    let mut bomb = String::from("schema: bagreel.expect/1\nfrom: x\nnodes: &a0 {/a: {}}\n");
    for n in 1..30 {
        let before = n - 1;
        writeln!(bomb, "l{n}: &a{n} [*a{before}, *a{before}]").unwrap();
    }
    let deep = format!("schema: bagreel.expect/1\nnodes: {}", "[".repeat(100_000));
    for text in [bomb, deep] {
        fs::write(here.join("g.yaml"), text).unwrap();
        let (code, said) = run(here, &["check", "run.bag", "--expect", "g.yaml"]);
        assert_eq!(code, 2, "{said}");
        assert!(
            said.starts_with("error: `g.yaml`") && said.contains("line "),
            "{said}"
        );
    }
}

#[test]
fn a_silence_across_windows_is_reported_to_the_millisecond() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut robot = Recording::default();
    let scan = robot.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    // Windows of 10 s; silent from 19.2 s to 21 s.
    robot.send(scan, (0, 19_250), 50, &[1; 48]);
    robot.send(scan, (21_000, 60_000), 50, &[1; 48]);
    bag(here, "run.bag", &robot);
    let check = |rule: &str| {
        let text = format!("schema: bagreel.expect/1\nperiod: 10s\n{rule}\n");
        fs::write(here.join("g.yaml"), text).unwrap();
        run(here, &["check", "run.bag", "--expect", "g.yaml"])
    };
    let (code, said) = check("topics:\n  /scan: {max_gap: 1.7s}");
    assert_eq!(code, 1, "{said}");
    assert!(
        said.contains("/scan was silent for 1.8 s") && said.contains("within 00:19–00:21"),
        "{said}"
    );
    assert_eq!(check("topics:\n  /scan: {max_gap: 1.9s}").0, 0);
    // Only the part within the rule's time range counts.
    let (code, said) = check("rules:\n  - {id: r, topic: /scan, max_gap: 0.5s, during: 20.2..}");
    assert!(code == 1 && said.contains("silent for 800 ms"), "{said}");
    assert_eq!(
        check("rules:\n  - {id: r, topic: /scan, max_gap: 0.5s, during: ..19}").0,
        0
    );
    // Accepted findings do not fail.
    fs::write(
        here.join("g.yaml"),
        "schema: bagreel.expect/1\ntopics:\n  /scan: {max_gap: 0.2s}\n",
    )
    .unwrap();
    assert_eq!(
        run(here, &["baseline", "run.bag", "--update", "g.yaml"]).0,
        0
    );
    assert!(
        fs::read_to_string(here.join("g.yaml"))
            .unwrap()
            .contains("max_gap: 1.8s")
    );
    assert_eq!(run(here, &["check", "run.bag", "--expect", "g.yaml"]).0, 0);
}

#[test]
fn two_runs_a_day_apart_are_not_one_mission() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let day = recording(HEALTHY, 0);
    let (mut next, mut soon) = (recording(HEALTHY, 0), recording(HEALTHY, 0));
    let later = |recording: &mut Recording, seconds: i64| {
        for (_, time, _) in &mut recording.messages {
            *time += seconds * 1_000_000_000;
        }
    };
    later(&mut next, 86_400);
    later(&mut soon, 190);
    bag(here, "day.bag", &day);
    bag(here, "next.bag", &next);
    bag(here, "soon.bag", &soon);
    run(here, &["baseline", "day.bag", "-o", "graph.yaml"]);
    let check = ["check", "day.bag", "next.bag", "--expect", "graph.yaml"];
    let (code, said) = run(here, &check);
    assert!(
        code == 2 && said.contains("`next.bag` begins 23 h 57 min after `day.bag` ends"),
        "{code} {said}"
    );
    // Years apart, one of the clocks is taken to be wrong.
    let mut old = recording(HEALTHY, 0);
    later(&mut old, -90_000_000);
    bag(here, "old.bag", &old);
    let check = ["check", "day.bag", "old.bag", "--expect", "graph.yaml"];
    let (code, said) = run(here, &check);
    assert!(
        code == 2 && said.contains("--offset old.bag="),
        "{code} {said}"
    );
    for command in ["info", "events"] {
        let (code, said) = run(here, &[command, "day.bag", "next.bag"]);
        let first = said.lines().find(|line| line.starts_with("note: "));
        assert!(
            code == 0 && first.is_some_and(|line| line.contains("`bagreel diff`")),
            "{said}"
        );
        assert!(said.contains(", recordings far apart: "), "{said}");
        let (_, said) = run(here, &[command, "day.bag", "soon.bag"]);
        let is_one = !said.contains("longer than the recordings") && !said.contains("far apart");
        assert!(is_one, "{said}");
    }
}
