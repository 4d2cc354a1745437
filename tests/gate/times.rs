//! Tests of rules on start and end times, silences and message counts, generated from healthy runs.

use std::fs;

use super::difference::two_minutes;
use super::{bag, findings, run};
use crate::support::Recording;

/// The parameters of a minute and a half of a robot, changed by faults.
#[derive(Clone, Copy)]
struct Mission {
    /// When the arm's node begins to send, in milliseconds.
    arm: (i64, i64),
    /// When the camera sends.
    camera: (i64, i64),
    /// Sends every n-th of the irregular commands.
    every: usize,
    has_map: bool,
    /// A silence of the wheels.
    silence: (i64, i64),
}

const GOOD: Mission = Mission {
    arm: (40_000, 90_000),
    camera: (300, 60_000),
    every: 1,
    has_map: true,
    silence: (90_000, 90_000),
};

/// The recording; nodes of different runs are `shift` milliseconds apart.
fn recording(mission: Mission, shift: i64) -> Recording {
    let mut bag = Recording::default();
    let base = bag.publisher("/base", "/odom", "nav_msgs/Odometry");
    bag.send(base, (0, mission.silence.0), 100, &[1; 48]);
    bag.send(base, (mission.silence.1, 90_000), 100, &[1; 48]);
    let arm = bag.publisher("/arm", "/arm/joints", "sensor_msgs/JointState");
    let (from, to) = mission.arm;
    bag.send(arm, (from + shift, to), 200, &[2; 48]);
    let camera = bag.publisher("/camera", "/image", "sensor_msgs/Image");
    let (from, to) = mission.camera;
    bag.send(camera, (from, to - shift), 200, &[3; 48]);
    let pilot = bag.publisher("/pilot", "/cmd_vel", "geometry_msgs/Twist");
    // Bursts of ten, further and further apart.
    let bursts = (0..12).flat_map(|n| (0..10).map(move |k| 2000 + n * n * 600 + k * 30));
    for at in bursts.step_by(mission.every) {
        bag.send(pilot, (at + shift, at + shift + 1), 1, &[4; 48]);
    }
    if mission.has_map {
        let mapper = bag.publisher("/mapper", "/map", "nav_msgs/OccupancyGrid");
        bag.send(mapper, (1000, 90_000), 1000, &[5; 48]);
    }
    bag
}

#[test]
fn each_timing_fault_is_found_and_a_third_healthy_run_passes() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "a.bag", &recording(GOOD, 0));
    bag(here, "b.bag", &recording(GOOD, 400));
    let (code, said) = run(here, &["baseline", "a.bag", "b.bag", "-o", "g.yaml"]);
    assert_eq!(code, 0, "{said}");
    let text = fs::read_to_string(here.join("g.yaml")).unwrap();
    // Ten percent, at least 5 s, on either side of 0:40 and 1:00.
    for line in [
        "/arm/joints: {type: sensor_msgs/JointState, by: [/arm], hz: 4.5..5.5, max_gap: 1s, within: 35s..46s}",
        "/image: {type: sensor_msgs/Image, by: [/camera], hz: 4.52..5.53, max_gap: 1s, within: ..6s, may_end: 53s..}",
    ] {
        assert!(text.contains(line), "no `{line}` in {text}");
    }
    let faults = [
        ("healthy", GOOD, &[][..]),
        (
            "late",
            Mission {
                arm: (60_000, 90_000),
                ..GOOD
            },
            &["node-late /arm", "topic-late /arm/joints"],
        ),
        (
            "early",
            Mission {
                arm: (20_000, 90_000),
                ..GOOD
            },
            &["node-late /arm", "topic-late /arm/joints"],
        ),
        (
            "ends",
            Mission {
                camera: (300, 40_000),
                ..GOOD
            },
            &["node-gone /camera", "topic-gone /image"],
        ),
        (
            "silent",
            Mission {
                silence: (30_000, 34_000),
                ..GOOD
            },
            &["topic-gap /odom", "topic-rate-low /odom"],
        ),
        (
            "fewer",
            Mission { every: 2, ..GOOD },
            &["topic-rate-low /cmd_vel"],
        ),
        (
            "lost",
            Mission {
                has_map: false,
                ..GOOD
            },
            &["node-missing /mapper", "topic-missing /map"],
        ),
    ];
    for (name, mission, expected) in faults {
        let file = format!("{name}.bag");
        bag(here, &file, &recording(mission, 200));
        let (code, said) = run(here, &["check", &file, "--expect", "g.yaml"]);
        assert_eq!(code, i32::from(!expected.is_empty()), "{name}: {said}");
        for one in expected {
            let (id, about) = one.split_once(' ').unwrap();
            let found = format!("error[{id}]: {about} ");
            assert!(said.contains(&found), "{name}: no `{found}` in {said}");
        }
        let ids = findings(here, &file, "g.yaml");
        assert_eq!(ids.len(), expected.len(), "{name}: {said}");
    }
    // Times are not checked for a part of a recording, as they count from its beginning.
    let part = [
        "check",
        "healthy.bag",
        "--expect",
        "g.yaml",
        "--start",
        "30",
    ];
    let (code, said) = run(here, &part);
    assert_eq!(code, 0, "{said}");
    let again = ["baseline", "late.bag", "--update", "g.yaml"];
    assert_eq!(run(here, &again).0, 0);
    let (code, said) = run(here, &["check", "late.bag", "--expect", "g.yaml"]);
    assert_eq!(code, 0, "{said}");
    let text = fs::read_to_string(here.join("g.yaml")).unwrap();
    assert!(text.contains("within: 48s..73s"), "{text}");
}

#[test]
fn a_listed_topic_without_messages_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    // Its action client advertises it, and never cancels.
    let bag = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
    let name = "/robot1/move_base/cancel";
    for (facts, code) in [
        ("{}", 0),
        ("{hz: 5..}", 1),
        ("{mean_hz: 5..}", 1),
        ("{max_gap: 2s}", 1),
        ("{within: ..20s}", 1),
        ("{hz: 5.., optional: true}", 0),
    ] {
        let text = format!("schema: bagreel.expect/1\ntopics:\n  {name}: {facts}\n");
        fs::write(here.join("g.yaml"), text).unwrap();
        let (got, said) = run(here, &["check", bag, "--expect", "g.yaml"]);
        assert_eq!(got, code, "{facts}: {said}");
        let is_told =
            said.contains("error[topic-missing]: /robot1/move_base/cancel has no message");
        assert_eq!(is_told, code == 1, "{facts}: {said}");
    }
}

#[test]
fn a_node_named_only_by_its_log_is_unknown_without_it() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(GOOD, 0));
    let check = |facts: &str| {
        let text = format!("schema: bagreel.expect/1\nnodes:\n  /quiet: {facts}\n  /arm: {{}}\n");
        fs::write(here.join("g.yaml"), text).unwrap();
        run(here, &["check", "run.bag", "--expect", "g.yaml"])
    };
    let (code, said) = check("{known_by: log}");
    assert!(
        code == 0 && said.contains("unknown[node-missing]"),
        "{said}"
    );
    let (code, said) = check("{}");
    assert!(code == 1 && said.contains("error[node-missing]"), "{said}");
    assert_eq!(check("{known_by: rumour}").0, 2);
}

#[test]
fn two_healthy_runs_do_not_differ_in_order_or_timing() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "a.bag", &recording(GOOD, 0));
    bag(here, "b.bag", &recording(GOOD, 1500));
    let (code, said) = run(here, &["diff", "a.bag", "b.bag"]);
    assert!(code == 0 && said.contains("no differences"), "{said}");
    let late = Mission {
        arm: (50_000, 90_000),
        ..GOOD
    };
    bag(here, "late.bag", &recording(late, 0));
    let (code, said) = run(here, &["diff", "a.bag", "late.bag"]);
    assert!(
        code == 1 && said.contains("~ time       /arm started"),
        "{said}"
    );
}

#[test]
fn a_topic_that_once_sent_and_now_does_not_is_missing_but_not_its_node() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    // The other topics of an action name its result.
    let made = |results: i64| {
        let mut bag = recording(GOOD, 0);
        let client = bag.publisher("/client", "/arm/pick/goal", "actionlib/TestActionGoal");
        let status = "actionlib_msgs/GoalStatusArray";
        let status = bag.publisher("/arm", "/arm/pick/status", status);
        bag.send(status, (40_000, 90_000), 200, &[6; 48]);
        let feedback = "actionlib/TestActionFeedback";
        let feedback = bag.publisher("/arm", "/arm/pick/feedback", feedback);
        bag.send(feedback, (45_000, 88_000), 1000, &[7; 48]);
        let result = "actionlib/TestActionResult";
        let result = (results > 0).then(|| bag.publisher("/arm", "/arm/pick/result", result));
        for n in 0..3 {
            let at = 50_000 + 10_000 * n;
            bag.send(client, (at, at + 1), 1, &[8; 48]);
            if let Some(result) = result {
                bag.send(result, (at + 5000, at + 5001), 1, &[9; 48]);
            }
        }
        bag
    };
    bag(here, "good.bag", &made(3));
    bag(here, "none.bag", &made(0));
    let (code, said) = run(here, &["baseline", "good.bag", "-o", "g.yaml"]);
    assert_eq!(code, 0, "{said}");
    assert_eq!(run(here, &["check", "good.bag", "--expect", "g.yaml"]).0, 0);
    let wanted = "error[topic-missing]: /arm/pick/result has no message in the bag";
    fs::write(
        here.join("one.yaml"),
        "schema: bagreel.expect/1\nnodes: {/arm: {}}\ntopics:\n  /arm/pick/result: {by: [/arm], within: 0..}\n",
    )
    .unwrap();
    for expect in ["g.yaml", "one.yaml"] {
        let (code, said) = run(here, &["check", "none.bag", "--expect", expect]);
        assert!(code == 1 && said.contains(wanted), "{expect}: {said}");
        assert!(!said.contains("sends nothing"), "{expect}: {said}");
    }
}

#[test]
fn a_window_cut_by_the_end_is_checked_with_enough_expected_messages() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let made = |every: i64, shift: i64| {
        let mut bag = Recording::default();
        let base = bag.publisher("/base", "/odom", "nav_msgs/Odometry");
        bag.send(base, (shift, 124_000), 100, &[1; 48]);
        bag.send(base, (124_000, 146_000), 100 * every, &[1; 48]);
        bag
    };
    bag(here, "good.bag", &made(1, 0));
    let learned = ["baseline", "good.bag", "--period", "60", "-o", "g.yaml"];
    assert_eq!(run(here, &learned).0, 0);
    for (every, expected) in [(1, &[][..]), (3, &["topic-rate-low"])] {
        bag(here, "run.bag", &made(every, 30));
        assert_eq!(findings(here, "run.bag", "g.yaml"), expected);
    }
}

#[test]
fn an_update_lets_a_topic_end_that_ended() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "good.bag", &two_minutes((0, 120_000), 1, 0));
    bag(here, "ends.bag", &two_minutes((0, 70_000), 1, 0));
    assert_eq!(run(here, &["baseline", "good.bag", "-o", "g.yaml"]).0, 0);
    let check = ["check", "ends.bag", "--expect", "g.yaml"];
    assert_eq!(run(here, &check).0, 1);
    let update = [
        "baseline", "ends.bag", "--update", "g.yaml", "--only", "/scan",
    ];
    let (code, said) = run(here, &update);
    assert_eq!(code, 0, "{said}");
    let (code, said) = run(here, &check);
    assert_eq!(code, 0, "{said}");
}
