//! Tests that a run passes the expectation generated from it, or from another recording of the same mission.

use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;

use super::{HEALTHY, bag, findings, recording, run};
use crate::edges::log1;
use crate::pairs::LOG;
use crate::support::{ORIGIN, Recording, shared};

const COURIER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");

#[test]
fn a_run_passes_its_own_expectation() {
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
fn a_topic_of_two_types_keeps_both() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let write = |name: &str, types: [&str; 2]| {
        let mut robot = Recording::default();
        for (node, kind) in ["/old", "/new"].into_iter().zip(types) {
            let tf = robot.publisher(node, "/tf", kind);
            robot.send(tf, (0, 60_000), 100, b"\0\0\0\0");
        }
        bag(here, name, &robot);
    };
    write("run.bag", ["tf/tfMessage", "tf2_msgs/TFMessage"]);
    write("other.bag", ["tf/tfMessage", "std_msgs/String"]);
    run(here, &["baseline", "run.bag", "-o", "g.yaml"]);
    let text = fs::read_to_string(here.join("g.yaml")).unwrap();
    assert!(
        text.contains("type: [tf/tfMessage, tf2_msgs/TFMessage]"),
        "{text}"
    );
    assert_eq!(run(here, &["check", "run.bag", "--expect", "g.yaml"]).0, 0);
    let (code, said) = run(here, &["check", "other.bag", "--expect", "g.yaml"]);
    let why = "/tf is a std_msgs/String, expected tf/tfMessage and tf2_msgs/TFMessage";
    assert!(code == 1 && said.contains(why), "{said}");
    run(here, &["baseline", "other.bag", "--update", "g.yaml"]);
    let text = fs::read_to_string(here.join("g.yaml")).unwrap();
    assert!(
        text.contains("type: [std_msgs/String, tf/tfMessage]"),
        "{text}"
    );
}

/// Every recording below a folder: files, and folders with metadata.
fn recordings(folder: &Path, all: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let mut entries: Vec<PathBuf> = entries.collect();
    entries.sort();
    if entries.iter().any(|e| e.ends_with("metadata.yaml")) {
        all.push(folder.to_owned());
        return;
    }
    for entry in entries {
        let name = entry.to_str().unwrap();
        if entry.is_dir() {
            recordings(&entry, all);
        } else if [".bag", ".db3", ".mcap", ".active"]
            .iter()
            .any(|e| name.ends_with(e))
        {
            all.push(entry);
        }
    }
}

#[test]
fn every_available_bag_passes_its_own_expectation() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut bags = Vec::new();
    for folder in ["data/bags", "data/mini"] {
        shared(folder).inspect(|folder| recordings(folder, &mut bags));
    }
    let mut judged = 0;
    for bag in &bags {
        let bag = bag.to_str().unwrap();
        let (code, said) = run(here, &["baseline", bag, "-o", "g.yaml"]);
        // Some bags have no messages, and some files are not bags.
        if code == 1 {
            continue;
        }
        assert!(matches!(code, 0 | 3), "{bag}: {said}");
        let (kept, said) = run(here, &["check", bag, "--expect", "g.yaml"]);
        // Damaged bags fail in both.
        assert!(
            kept == code && said.contains("no findings"),
            "{bag}: {said}"
        );
        judged += 1;
    }
    assert!(bags.is_empty() || judged > 40, "{judged}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_run_passes_its_own_expectation(run_of in crate::properties::recording(), latched: u8) {
        let mut run_of = run_of;
        for (place, publisher) in run_of.publishers.iter_mut().enumerate() {
            publisher.latching = latched >> (place % 8) & 1 == 1;
        }
        let dir = tempfile::tempdir().unwrap();
        let here = dir.path();
        bag(here, "run.bag", &run_of);
        let (code, said) = run(here, &["baseline", "run.bag", "-o", "g.yaml"]);
        prop_assert_eq!(code, 0, "{}", said);
        let (code, said) = run(here, &["check", "run.bag", "--expect", "g.yaml"]);
        prop_assert!(code == 0 && said.contains("no findings"), "{}", said);
    }
}

#[test]
fn a_latched_topic_with_a_rate_may_end_as_it_did() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let until = |end: i64| {
        let mut robot = recording(HEALTHY, 0);
        let pose = robot.publisher("/base", "/pose", "geometry_msgs/Pose");
        robot.publishers[pose].latching = true;
        robot.send(pose, (1_000, end), 100, &[5; 48]);
        robot
    };
    bag(here, "run.bag", &until(90_000));
    bag(here, "early.bag", &until(40_000));
    assert_eq!(run(here, &["baseline", "run.bag", "-o", "g.yaml"]).0, 0);
    assert!(findings(here, "run.bag", "g.yaml").is_empty());
    assert_eq!(findings(here, "early.bag", "g.yaml"), ["topic-gone"]);
}

#[test]
fn a_topic_that_ends_a_little_earlier_than_in_the_only_run_passes() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    for (name, end) in [("run.bag", 175_200), ("next.bag", 174_600)] {
        let mut robot = recording(HEALTHY, 0);
        let keys = robot.publisher("/keys", "/keys", "geometry_msgs/Twist");
        robot.send(keys, (10_000, end), 700, &[5; 48]);
        bag(here, name, &robot);
    }
    assert_eq!(run(here, &["baseline", "run.bag", "-o", "g.yaml"]).0, 0);
    assert_eq!(findings(here, "next.bag", "g.yaml"), [""; 0]);
}

/// The last sign of a refused client does not show when it ended.
#[test]
fn a_node_known_from_one_moment_is_not_gone() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut robot = recording(HEALTHY, 0);
    let log = robot.publisher("/base", "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut robot.publishers[log].definition);
    let refusal =
        "Client [/bad] wants topic /odom to have datatype/md5sum [a/b], but our version has [c/d].";
    let record = log1("/base", refusal, "publication.cpp", &["/odom"]);
    robot.messages.push((log, ORIGIN + 30_000_000_000, record));
    robot.messages.sort_by_key(|m| m.1);
    bag(here, "run.bag", &robot);
    let text = "schema: bagreel.expect/1\nnodes:\n  /bad: {restarts: ..0}\n";
    fs::write(here.join("g.yaml"), text).unwrap();
    let (code, said) = run(here, &["check", "run.bag", "--expect", "g.yaml"]);
    let why = "cannot tell when /bad ended: its last sign is at 00:30";
    assert!(code == 0 && said.contains(why), "{said}");
}

#[test]
fn names_that_are_not_valid_keys_are_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut robot = recording(HEALTHY, 0);
    for name in ["n".repeat(5000), "\u{202e}".repeat(300)] {
        let own = robot.publisher(&format!("/{name}"), "/odd", "std_msgs/String");
        robot.send(own, (1_000, 170_000), 1_000, b"\x01\0\0\0a");
    }
    bag(here, "run.bag", &robot);
    let (code, said) = run(here, &["baseline", "run.bag", "-o", "g.yaml"]);
    assert!(code == 0 && said.contains("2 names do not fit"), "{said}");
    let (code, said) = run(here, &["check", "run.bag", "--expect", "g.yaml"]);
    assert!(code == 0 && said.contains("no findings"), "{said}");
}

#[test]
fn other_recordings_of_one_mission_pass_its_expectation() {
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

/// ROS 2 nodes are named at their start and by their logs.
#[test]
fn a_late_recorder_proves_no_node_missing() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    assert_eq!(run(here, &["baseline", COURIER, "-o", "g.yaml"]).0, 0);
    let late = ["check", COURIER, "--expect", "g.yaml", "--start", "50"];
    let (code, said) = run(here, &late);
    assert!(!said.contains("error[") && code == 0, "{said}");
    assert!(
        said.contains("unknown[node-missing]: cannot tell whether /amcl is present"),
        "{said}"
    );
    // A node absent although all others are named is missing.
    let text = fs::read_to_string(here.join("g.yaml")).unwrap();
    let more = text.replace("nodes:\n", "nodes:\n  /radar: {}\n");
    fs::write(here.join("g.yaml"), more).unwrap();
    let (code, said) = run(here, &["check", COURIER, "--expect", "g.yaml"]);
    assert!(
        code == 1 && said.contains("error[node-missing]: /radar"),
        "{said}"
    );
    let (_, said) = run(here, &["diff", COURIER, COURIER, "--start", "50"]);
    assert!(said.contains("no differences"), "{said}");
}
