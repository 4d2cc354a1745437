//! Expectations: written from runs, held against them, and what each fault of a robot breaks.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::rosbag1::{self, Pack};
use crate::support::{ORIGIN, Recording, shared};

const COURIER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");

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

/// The exit code and what was printed.
fn run(folder: &Path, args: &[&str]) -> (i32, String) {
    let output = bagreel(folder, args);
    let errors = String::from_utf8(output.stderr.clone()).unwrap();
    (output.status.code().unwrap(), said(&output) + &errors)
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

/// A robot of three minutes: a lidar, a merger, a controller, and a log that names who subscribes.
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
fn a_run_keeps_the_expectation_written_from_it() {
    let dir = tempfile::tempdir().unwrap();
    let mut bags = vec![PathBuf::from(COURIER), PathBuf::from(WAREHOUSE)];
    bags.push(bag(dir.path(), "robot.bag", &recording(HEALTHY, 0)));
    let more = [
        "data/bags/mission/mission.bag",
        "data/mini/mini_lz4.bag",
        "data/warehouse/warehouse.bag",
    ];
    bags.extend(more.iter().filter_map(|below| shared(below)));
    for bag in bags {
        let bag = bag.to_str().unwrap();
        for period in [&[][..], &["--period", "7"]] {
            let write = |name| {
                let args = [&["baseline", bag, "-o", name][..], period].concat();
                let (code, said) = run(dir.path(), &args);
                assert_eq!(code, 0, "{bag}: {said}");
                fs::read_to_string(dir.path().join(name)).unwrap()
            };
            assert_eq!(write("one.yaml"), write("two.yaml"), "{bag}");
            let (code, said) = run(dir.path(), &["check", bag, "--expect", "one.yaml"]);
            assert_eq!(code, 0, "{bag}: {said}");
            assert!(said.contains("no findings"), "{bag}: {said}");
        }
    }
}

#[test]
fn a_second_healthy_run_keeps_it_too_and_each_fault_breaks_what_it_should() {
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
            &["node-gone", "topic-rate-low"],
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
fn other_recordings_of_one_mission_keep_its_expectation() {
    let pairs = [
        (
            "data/warehouse/warehouse.bag",
            "data/warehouse/warehouse_lz4.bag",
        ),
        (
            "data/bags/mission/mission.bag",
            "data/bags/mission/killed_bz2.bag.active",
        ),
        ("data/mini/mini_lz4.bag", "data/mini/mini_bz2.bag"),
        (
            "data/bags/example/example.bag",
            "data/bags/example/example-lz4.bag",
        ),
    ];
    let dir = tempfile::tempdir().unwrap();
    for (one, other) in pairs {
        let (Some(one), Some(other)) = (shared(one), shared(other)) else {
            continue;
        };
        let (code, said) = run(
            dir.path(),
            &["baseline", one.to_str().unwrap(), "-o", "g.yaml"],
        );
        assert_eq!(code, 0, "{said}");
        let (code, said) = run(
            dir.path(),
            &["check", other.to_str().unwrap(), "--expect", "g.yaml"],
        );
        assert!(matches!(code, 0 | 3) && !said.contains("error["), "{said}");
        assert!(!said.contains("warning["), "{said}");
    }
}

#[test]
fn what_several_runs_have_in_common_holds_in_each() {
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
        text.contains("/teleop: {may_end: true, optional: true"),
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
fn an_update_changes_what_no_longer_holds_and_nothing_else() {
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
            "  /controller:\n  /teleop: {may_end: true, restarts: ..0}\n",
        );
    assert_eq!(text, expected);
    let (code, said) = run(here, &["check", "halved.bag", "--expect", "graph.yaml"]);
    assert_eq!(code, 0, "{said}");
}

/// Each reconfiguration of the mission, the rule that it breaks, and when.
const MISSION: &str = "\
schema: bagreel.expect/1
nodes:
  /camera_driver: {}
  /controller: {}
  /probe: {}
  /camera_backup: {}
rules:
  - {id: localizer-starts, node: /localizer, present_within: 1s}
  - {id: planner-starts, node: /planner, present_within: 50s}
  - {id: controller-starts, node: /controller, present_within: 80s}
  - {id: backup-takes-over, when: {removed: /camera_driver}, expect: {handed_over: /image_small, to: /camera_backup}, within: 20s}
  - {id: probe-starts, node: /probe, present_within: 160s}
  - {id: planner-restarts, node: /planner, restarts: ..0}
  - {id: probe-restarts, node: /probe, restarts: ..0}
  - {id: successor-starts, node: /controller_v2, present_within: 200s}
  - {id: joystick-starts, node: /joystick, present_within: 200s}
  - {id: localizer-restarts, node: /localizer, restarts: ..0}
  - {id: quiet-at-end, during: -30s.., changes: ..0}
  - {id: kept-order, appear_in_order: [/localizer, /planner, /controller]}
  - {id: kept-takeover, when: {removed: /camera_driver}, expect: {added: /camera_backup}, within: 40s}
  - {id: kept-rate, topic: /scan_small, hz: 4..6}
  - {id: kept-restarts, node: /probe, restarts: ..1}
";

#[test]
fn each_reconfiguration_breaks_the_rule_written_for_it() {
    let Some(bag) = shared("data/bags/mission/mission.bag") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("graph.yaml"), MISSION).unwrap();
    let args = [
        "check",
        bag.to_str().unwrap(),
        "--expect",
        "graph.yaml",
        "--format",
        "json",
    ];
    let output = bagreel(dir.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let broken = |rule: &serde_json::Value| {
        let findings = rule["findings"].as_array()?;
        assert_eq!(findings.len(), 1, "{rule}");
        let title = rule["rule"].as_str().unwrap().split(':').next().unwrap();
        let (id, severity) = (&findings[0]["id"], &findings[0]["severity"]);
        assert_eq!(severity, "error", "{rule}");
        Some((title.to_owned(), id.as_str().unwrap().to_owned()))
    };
    let rules = report["rules"].as_array().unwrap();
    let found: Vec<_> = rules.iter().filter_map(broken).collect();
    let found: Vec<_> = found
        .iter()
        .map(|(a, b)| (a.as_str(), b.as_str()))
        .collect();
    let expected = [
        ("/camera_driver", "node-gone"),
        ("/controller", "node-gone"),
        ("/probe", "node-gone"),
        ("/camera_backup", "node-gone"),
        ("localizer-starts", "node-late"),
        ("planner-starts", "node-late"),
        ("controller-starts", "node-late"),
        ("backup-takes-over", "reaction-missing"),
        ("probe-starts", "node-late"),
        ("planner-restarts", "node-restarted"),
        ("probe-restarts", "node-restarted"),
        ("successor-starts", "node-late"),
        ("joystick-starts", "node-late"),
        ("localizer-restarts", "node-restarted"),
        ("quiet-at-end", "too-many-changes"),
    ];
    assert_eq!(found, expected);
}

#[test]
fn every_exit_code_means_what_the_help_says() {
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
        "rules:\n  - {id: x, node: /lidar, lifecycle: active}\n",
    );
    write("wrong.yaml", "nodes:\n  /lidar: {restart: 0}\n");
    let table: [(&[&str], i32, &str); 14] = [
        (&["run.bag", "--expect", "kept.yaml"], 0, "1 rule kept"),
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
    let (code, said) = run(here, &["check", "--help"]);
    assert_eq!(code, 0);
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("Exit codes: 0 kept, 1 broken, 2 could not tell"),
        "{said}"
    );
    assert!(run(here, &["baseline", "gone.bag"]).0 == 1);
    assert!(run(here, &["baseline", "run.bag", "--only", "/a"]).0 == 2);
    assert!(run(here, &["baseline", "cut.bag"]).0 == 3);
}

#[test]
fn allowances_forgive_until_their_day_and_unused_ones_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    assert_eq!(ORIGIN / 86_400_000_000_000, 19_723, "2024-01-01");
    let check = |allow: &str| {
        let text = format!(
            "schema: bagreel.expect/1\ntopics:\n  /scan: {{hz: 20..}}\nallow:\n  - {{{allow}}}\n"
        );
        fs::write(here.join("g.yaml"), text).unwrap();
        run(here, &["check", "run.bag", "--expect", "g.yaml"])
    };
    let (code, said) = check("finding: topic-rate-low, name: /scan, why: on loan");
    assert_eq!(
        (code, said.contains("allowed: on loan")),
        (0, true),
        "{said}"
    );
    let (code, said) = check("finding: topic-rate-low, name: /scan, until: 2024-01-01, why: x");
    assert_eq!(code, 0, "{said}");
    let (code, said) = check("finding: topic-rate-low, name: /scan, until: 2023-12-31, why: x");
    assert_eq!(
        (code, said.contains("held for bags before 2024-01-01")),
        (1, true),
        "{said}"
    );
    let (code, said) = check("finding: topic-rate-high, name: /scan, why: x");
    assert_eq!(
        (code, said.contains("warning[allow-unused]")),
        (1, true),
        "{said}"
    );
}

/// Names as nobody should give them.
const HOSTILE: [&str; 8] = [
    "/]]>&amp;<![CDATA[x",
    "/@team",
    "/a\n::error file=x::forged",
    "/##[error]forged",
    "/</testcase><failure>",
    "/a|b`c`<img src=x>",
    "/-->\"];evil[\"",
    "/\u{1b}[2J\u{202e}%0A::warning::x",
];

#[test]
fn hostile_names_are_inert_in_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut robot = recording(HEALTHY, 0);
    for name in HOSTILE {
        let own = robot.publisher(name, &format!("{name}/topic"), "std_msgs/String");
        robot.send(own, (1_000, 170_000), 1_000, b"\x01\0\0\0a");
    }
    bag(here, "run.bag", &robot);
    let expect = "schema: bagreel.expect/1\npolicy: {unexpected_nodes: error, unexpected_topics: warn}\nnodes:\n  /lidar: {}\n";
    fs::write(here.join("g.yaml"), expect).unwrap();
    let print = |format: &str| {
        said(&bagreel(
            here,
            &["check", "run.bag", "--expect", "g.yaml", "--format", format],
        ))
    };
    let visible = |text: &str| {
        text.chars()
            .all(|c| c == '\n' || !(c.is_control() || c == '\u{202e}'))
    };
    for format in [
        "text", "json", "markdown", "junit", "sarif", "gitlab", "github",
    ] {
        let text = print(format);
        assert!(text.contains("team") && visible(&text), "{format}: {text}");
    }
    let github = print("github");
    let commands: Vec<&str> = github
        .lines()
        .filter(|l| l.trim_start().starts_with("::"))
        .collect();
    assert!(
        commands.iter().all(|l| l.contains(" file=g.yaml,line=")),
        "{github}"
    );
    assert_eq!(
        commands
            .iter()
            .filter(|l| l.starts_with("::error "))
            .count(),
        10
    );
    assert!(
        !github.contains("##[") && !print("text").contains("##["),
        "{github}"
    );
    let markdown = print("markdown");
    let outside: Vec<&str> = markdown.split("```").step_by(2).collect();
    assert!(!outside.concat().contains("@team"), "{markdown}");
    assert!(
        !markdown.contains("<img") && !markdown.contains("</testcase"),
        "{markdown}"
    );
    assert!(!markdown.contains("evil[\""), "{markdown}");
    let junit = print("junit");
    let parsed = roxmltree::Document::parse(&junit).unwrap();
    assert_eq!(
        parsed
            .descendants()
            .filter(|n| n.has_tag_name("testcase"))
            .count(),
        3
    );
    assert_eq!(
        parsed
            .descendants()
            .filter(|n| n.has_tag_name("failure"))
            .count(),
        1
    );
    for format in ["json", "sarif", "gitlab"] {
        serde_json::from_str::<serde_json::Value>(&print(format)).unwrap();
    }
    // What is written from such names reads back, and holds.
    assert_eq!(run(here, &["baseline", "run.bag", "-o", "own.yaml"]).0, 0);
    let (code, said) = run(here, &["check", "run.bag", "--expect", "own.yaml"]);
    assert_eq!((code, said.contains("no findings")), (0, true), "{said}");
}

#[test]
fn every_result_stands_at_a_line_and_annotations_are_few() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    let lines: Vec<String> = (0..30).map(|n| format!("  /gone_{n}: {{}}\n")).collect();
    let lines = lines.concat();
    fs::write(
        here.join("g.yaml"),
        format!("schema: bagreel.expect/1\nnodes:\n{lines}"),
    )
    .unwrap();
    let print = |format: &str| {
        said(&bagreel(
            here,
            &["check", "run.bag", "--expect", "g.yaml", "--format", format],
        ))
    };
    let github = print("github");
    let errors: Vec<&str> = github
        .lines()
        .filter(|l| l.starts_with("::error "))
        .collect();
    assert_eq!(errors.len(), 10);
    assert!(
        errors[9].contains("and 20 more in the log"),
        "{}",
        errors[9]
    );
    assert!(github.contains("error[node-missing]: /gone_29"));
    let sarif: serde_json::Value = serde_json::from_str(&print("sarif")).unwrap();
    let results = sarif["runs"][0]["results"].as_array().unwrap();
    assert_eq!(results.len(), 30);
    let line = |r: &serde_json::Value| {
        r["locations"][0]["physicalLocation"]["region"]["startLine"].as_u64()
    };
    assert!(results.iter().zip(3..).all(|(r, at)| line(r) == Some(at)));
    let gitlab: serde_json::Value = serde_json::from_str(&print("gitlab")).unwrap();
    let prints = gitlab
        .as_array()
        .unwrap()
        .iter()
        .map(|i| i["fingerprint"].as_str().unwrap());
    let prints: std::collections::BTreeSet<&str> = prints.collect();
    assert!(prints.len() == 30 && prints.iter().all(|p| p.len() == 12));
}

#[test]
fn a_difference_is_told_of_what_both_could_have_told() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "a.bag", &recording(HEALTHY, 0));
    bag(here, "same.bag", &recording(HEALTHY, 3));
    let other = Robot {
        scan_ms: 200,
        controller: "/pilot",
        has_teleop: true,
        ..HEALTHY
    };
    bag(here, "b.bag", &recording(other, 3));
    let (code, said) = run(here, &["diff", "a.bag", "same.bag"]);
    assert_eq!((code, said.contains("no differences")), (0, true), "{said}");
    let outputs = [
        "-o", "d.json", "-o", "d.md", "-o", "d.svg", "-o", "d.html", "-o", "d.gif",
    ];
    let (code, said) = run(here, &[&["diff", "a.bag", "b.bag"][..], &outputs].concat());
    assert_eq!(code, 1, "{said}");
    let wanted = [
        "- node       /controller",
        "+ node       /pilot",
        "+ node       /teleop",
        "~ rate       /scan",
        "10 Hz → 5 Hz",
        "a.bag and b.bag: ",
    ];
    for line in wanted {
        assert!(said.contains(line), "no `{line}` in {said}");
    }
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("d.json")).unwrap()).unwrap();
    let rows = json["differences"].as_array().unwrap();
    assert!(
        rows.iter()
            .any(|r| r["kind"] == "rate" && r["name"] == "/scan" && r["in"] == "both")
    );
    let svg = fs::read_to_string(here.join("d.svg")).unwrap();
    for name in ["/controller", "/pilot", "/teleop", "/scan", "/odom"] {
        assert!(svg.contains(name), "{name}");
    }
    assert!(!svg.contains("window 1 of"), "time means nothing here");
    assert!(fs::read(here.join("d.gif")).unwrap().starts_with(b"GIF89a"));
    assert!(
        fs::read_to_string(here.join("d.md"))
            .unwrap()
            .starts_with("### 🔀 ")
    );
    fs::write(
        here.join("g.yaml"),
        "schema: bagreel.expect/1\nnodes:\n  /teleop: {}\n",
    )
    .unwrap();
    let (code, said) = run(here, &["diff", "a.bag", "g.yaml"]);
    assert_eq!(
        (code, said.contains("error[node-missing]: /teleop")),
        (1, true),
        "{said}"
    );
    assert_eq!(run(here, &["diff", "gone.bag", "a.bag"]).0, 2);
    assert_eq!(run(here, &["diff", "a.bag"]).0, 2);
}

#[test]
fn no_report_is_larger_than_its_reader_takes() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut robot = recording(HEALTHY, 0);
    for n in 0..40 {
        let own = robot.publisher(&format!("/new_{n}"), "/odom", "nav_msgs/Odometry");
        robot.send(own, (1_000, 170_000), 60_000, &[2; 48]);
    }
    bag(here, "run.bag", &robot);
    let gone: Vec<String> = (0..5100)
        .map(|n| format!("  \"/gone_{n}_#[x|`@\": {{}}\n"))
        .collect();
    let gone = gone.concat();
    let by: Vec<String> = (0..200)
        .map(|n| format!("\"/lost_{n}_{}\"", "é#".repeat(40)))
        .collect();
    let text = format!(
        "schema: bagreel.expect/1\npolicy: {{unexpected_nodes: warn}}\nnodes:\n{gone}topics:\n  /scan: {{by: [{}]}}\n",
        by.join(", ")
    );
    fs::write(here.join("g.yaml"), text).unwrap();
    let outputs = ["-o", "c.md", "-o", "c.sarif", "-o", "c.xml", "-o", "c.json"];
    let args = [
        "check", "run.bag", "--expect", "g.yaml", "--format", "github",
    ];
    let output = bagreel(here, &[&args[..], &outputs].concat());
    let github = said(&output);
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("c.json")).unwrap()).unwrap();
    let count = |key: &str| json[key].as_u64().unwrap();
    assert!(count("errors") > 5300 && count("warnings") > 40 && count("unknown") == 0);
    // 10 of each kind in a step; more are dropped without a word.
    for (command, key) in [("::error ", "errors"), ("::warning ", "warnings")] {
        let own: Vec<&str> = github.lines().filter(|l| l.starts_with(command)).collect();
        assert_eq!(own.len(), 10, "{command}");
        let rest = format!("and {} more in the log", count(key) - 10);
        assert!(own[9].contains(&rest), "{}", own[9]);
    }
    let read = |name: &str| fs::read_to_string(here.join(name)).unwrap();
    let markdown = read("c.md");
    assert!(
        (100_000..256 << 10).contains(&markdown.len()),
        "{}",
        markdown.len()
    );
    let seen = markdown.split("<details>").next().unwrap();
    assert_eq!(
        seen.lines().filter(|l| l.starts_with("| ❌")).count(),
        12,
        "{seen}"
    );
    assert!(markdown.contains(" left out."), "{seen}");
    let chart = markdown.split("```mermaid\n").nth(1).unwrap();
    let chart = chart.split("```").next().unwrap();
    let edges = chart.lines().filter(|l| l.contains("->")).count();
    assert!(
        edges <= 60 && chart.len() <= 50_000,
        "{edges} edges, {} bytes",
        chart.len()
    );
    assert!(
        chart.lines().filter(|l| l.contains("([\"")).count() > 50,
        "{chart}"
    );
    let sarif: serde_json::Value = serde_json::from_str(&read("c.sarif")).unwrap();
    let run = &sarif["runs"][0];
    assert_eq!(run["results"].as_array().unwrap().len(), 5000);
    let note = &run["invocations"][0]["toolExecutionNotifications"][0]["message"]["text"];
    let rest = count("errors") + count("warnings") - 5000;
    assert_eq!(note, &format!("{rest} more findings left out"));
    roxmltree::Document::parse(&read("c.xml")).unwrap();
}

#[test]
fn an_expectation_that_unfolds_without_end_is_refused() {
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
fn a_silence_across_the_edge_of_a_window_is_told_to_the_millisecond() {
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
    // Only the part in the stretch that a rule means counts.
    let (code, said) = check("rules:\n  - {id: r, topic: /scan, max_gap: 0.5s, during: 20.2..}");
    assert!(code == 1 && said.contains("silent for 800 ms"), "{said}");
    assert_eq!(
        check("rules:\n  - {id: r, topic: /scan, max_gap: 0.5s, during: ..19}").0,
        0
    );
    // What is accepted holds.
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
