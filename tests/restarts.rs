//! Tests that restarts are found across the parts of a recording, and are not inferred from faults of the recorder's
//! clock.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::causes::{at, minute, shown};
use crate::edges::parameters;
use crate::gate::bagreel;
use crate::pairs::loaded;
use crate::support::mission::definition;
use crate::support::rosbag1::{Pack, write};
use crate::support::{ORIGIN, Recording, mcap, shared};

const MILLISECOND: i64 = 1_000_000;

/// The lines of the event log about restarts.
fn restarts(bags: &[PathBuf], stdin: Stdio) -> Vec<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .arg("events")
        .args(bags)
        .stdin(stdin)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let lines = text.lines().skip(1);
    let lines = lines.filter(|line| line.contains(" restarted"));
    lines.map(|line| line.trim().to_owned()).collect()
}

/// The restarts in a copy of a bag with other times, in milliseconds since the first; `None` for messages that are left out.
/// The copy is read as a file and from a pipe.
fn copied(bag: &Path, time: impl Fn(i64) -> Option<i64>) -> [Vec<String>; 2] {
    let mut copy = loaded(bag.to_str().unwrap());
    let begin = copy.messages[0].1;
    copy.messages.retain_mut(|(_, at, _)| {
        let moved = time((*at - begin) / MILLISECOND);
        *at = begin + moved.unwrap_or(0) * MILLISECOND;
        moved.is_some()
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("copy.bag");
    fs::write(&path, write(&copy, Pack::None, 64 * 1024)).unwrap();
    let file = restarts(std::slice::from_ref(&path), Stdio::null());
    let pipe = Stdio::from(File::open(&path).unwrap());
    [file, restarts(&["-".into()], pipe)]
}

#[test]
fn a_node_that_restarts_between_two_parts_of_a_recording_is_found() {
    let (Some(whole), Some(folder)) = (
        shared("data/bags/mission/mission.bag"),
        shared("data/bags/mission"),
    ) else {
        return;
    };
    let parts = (0..4).map(|part| folder.join(format!("split_lz4_{part}.bag")));
    let parts: Vec<PathBuf> = parts.collect();
    let found = restarts(&[whole], Stdio::null());
    assert_eq!(found.len(), 3, "{found:?}");
    assert_eq!(restarts(&parts, Stdio::null()), found);
}

#[test]
fn a_node_that_declares_its_parameters_again_has_restarted() {
    let mut bag = Recording::default();
    let kind = "rcl_interfaces/msg/ParameterEvent";
    let events = bag.publisher("", "/parameter_events", kind);
    let odom = bag.publisher("", "/odom", "std_msgs/msg/Empty");
    bag.publishers[events].definition = definition(kind);
    bag.send(odom, (0, 100_000), 100, &[0, 1, 0, 0]);
    // The second declaration is of the same start.
    for at in [10_000, 11_500, 60_000] {
        let start = parameters("/nav", &[("use_sim_time", false)]);
        bag.messages
            .push((events, ORIGIN + at * MILLISECOND, start));
    }
    bag.messages.sort_by_key(|message| message.1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let options = mcap::Options {
        profile: "ros2",
        ..mcap::Options::default()
    };
    fs::write(&path, mcap::write(&bag, &options)).unwrap();
    let found = restarts(std::slice::from_ref(&path), Stdio::null());
    assert_eq!(found, ["00:59.9  /nav restarted"]);
    // A declaration is as exact for the first start.
    let log = bagreel(folder.path(), &["events", path.to_str().unwrap()]);
    let log = String::from_utf8(log.stdout).unwrap();
    let is_start = |line: &str| line.trim().starts_with("00:10.0  /nav started");
    assert!(log.lines().any(is_start), "{log}");
}

#[test]
fn a_node_that_declares_its_parameters_after_messages_of_its_own_topic_has_restarted() {
    let mut bag = Recording::default();
    let kind = "rcl_interfaces/msg/ParameterEvent";
    let events = bag.publisher("", "/parameter_events", kind);
    bag.publishers[events].definition = definition(kind);
    let path = bag.publisher("", "/nav/path", "std_msgs/msg/Empty");
    let odom = bag.publisher("", "/odom", "std_msgs/msg/Empty");
    bag.send(odom, (0, 100_000), 100, &[0, 1, 0, 0]);
    bag.send(path, (0, 50_000), 100, &[0, 1, 0, 0]);
    bag.send(path, (60_200, 100_000), 100, &[0, 1, 0, 0]);
    let start = parameters("/nav", &[("use_sim_time", false)]);
    bag.messages
        .push((events, ORIGIN + 60_000 * MILLISECOND, start));
    bag.messages.sort_by_key(|message| message.1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let options = mcap::Options {
        profile: "ros2",
        ..mcap::Options::default()
    };
    fs::write(&path, mcap::write(&bag, &options)).unwrap();
    let found = restarts(&[path], Stdio::null());
    assert_eq!(found, ["00:49–01:00  /nav restarted"]);
}

#[test]
fn numbers_that_start_over_at_once_are_a_restart() {
    let found = |times: &[(i64, i64)]| {
        let mut bag = minute(&[]);
        stamped(&mut bag, "/lidar", "/scan", times);
        bag.messages.sort_by_key(|m| m.1);
        shown(&bag)
    };
    let quick = found(&[(0, 30_000), (30_100, 60_000)]);
    assert_eq!(quick, "      00:29.9  /lidar restarted\n");
    // Numbers that were never high are those of messages out of order.
    assert_eq!(found(&[(0, 1_000), (1_100, 60_000)]), "");
}

#[test]
fn a_node_was_away_only_for_as_long_as_rhythms_show() {
    let found = |end: i64, begin: i64| {
        let mut bag = minute(&[]);
        stamped(&mut bag, "/arm", "/state", &[(0, end), (begin, 60_000)]);
        let second = |at: i64| (at - ORIGIN) / (1000 * MILLISECOND);
        bag.messages.retain(|(publisher, at, _)| {
            *publisher == 0
                || !(10..45).contains(&second(*at))
                || *at == ORIGIN + 20_000 * MILLISECOND
        });
        bag.messages.sort_by_key(|m| m.1);
        shown(&bag)
    };
    let regular = found(9_000, 45_000);
    assert!(
        regular.contains("/arm restarted, away for 36.1 s"),
        "{regular}"
    );
    // After its rhythm, it sent a last message at 20 s.
    let unclear = found(21_000, 45_000);
    assert!(
        unclear.contains("00:20–00:45  /arm restarted\n"),
        "{unclear}"
    );
}

#[test]
fn a_pause_of_the_recorder_is_no_restart() {
    if let Some(bag) = shared("data/bags/mission/mission.bag") {
        let holes = [65_100, 130_300, 260_600];
        let is_lost = |at: i64| holes.iter().any(|hole| (*hole..hole + 3_000).contains(&at));
        let [file, _] = copied(&bag, |at| Some(at).filter(|at| !is_lost(*at)));
        assert_eq!(file, restarts(&[bag], Stdio::null()));
    }
}

#[test]
fn runs_that_overlap_show_no_restart() {
    if let Some(bag) = shared("data/warehouse/warehouse.bag") {
        let [file, pipe] = copied(&bag, |at| {
            Some(if at < 163_000 { at } else { at - 163_000 })
        });
        assert!(
            file.iter().any(|line| line.contains("lidar_driver")),
            "{file:?}"
        );
        // The anonymous names of a role show a restart in any order of time.
        assert!(
            pipe.iter().all(|line| line.contains("object_detector")),
            "{pipe:?}"
        );
    }
}

#[test]
fn a_first_log_record_in_a_rewritten_bag_is_no_start() {
    let Some(bag) = shared("data/warehouse/warehouse_lz4.bag") else {
        return;
    };
    let output = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .arg("events")
        .arg(bag)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("/robot1/planner started"), "{text}");
    assert!(!text.contains("lifecycle_manager started"), "{text}");
}

#[test]
fn a_slow_topic_with_the_same_gap_does_not_hide_a_restart() {
    let mut bag = minute(&[]);
    bag.send(0, (60_000, 210_000), 100, &[]);
    stamped(
        &mut bag,
        "/lidar",
        "/scan",
        &[(0, 116_000), (143_000, 210_000)],
    );
    // The interval of 27 s is less than 5 of those before it, but nearly 7 usual ones.
    let rare = bag.publisher("/lidar", "/rare", "std_msgs/Empty");
    let mixed = [4, 8, 4, 4, 8, 4, 8, 4, 4, 8, 4];
    let longer = [8, 4, 8, 4, 8, 8, 4, 8, 4];
    let mut second = 0;
    for apart in [&mixed[..], &longer, &[27], &mixed].concat() {
        at(&mut bag, rare, second, Vec::new());
        second += apart;
    }
    bag.messages.sort_by_key(|m| m.1);
    let text = shown(&bag);
    assert!(text.contains("/lidar restarted"), "{text}");
}

#[test]
fn the_last_goal_in_a_status_is_no_sign_of_its_client() {
    if let Some(bag) = shared("data/bags/fibonacci/fibonacci_namespaces.bag") {
        // The numbers of the clients' log records start over before each goal.
        let found = restarts(&[bag], Stdio::null());
        assert_eq!(found.len(), 4, "{found:?}");
    }
}

#[test]
fn a_restarted_node_is_drawn_with_the_topics_of_its_present_run() {
    let mut bag = minute(&[]);
    bag.send(0, (60_000, 210_000), 100, &[]);
    stamped(
        &mut bag,
        "/lidar",
        "/scan",
        &[(0, 116_000), (143_000, 210_000)],
    );
    for (topic, times) in [("/before", (0, 116_000)), ("/after", (143_000, 210_000))] {
        let own = bag.publisher("/lidar", topic, "std_msgs/Empty");
        bag.send(own, times, 100, &[]);
    }
    bag.messages.sort_by_key(|m| m.1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.bag");
    fs::write(&path, write(&bag, Pack::None, 64 * 1024)).unwrap();
    let args = "render run.bag -p 10 --mode all -o {n}.svg";
    let done = bagreel(folder.path(), &args.split(' ').collect::<Vec<_>>());
    assert!(done.status.success(), "{done:?}");
    // The windows in which a topic is drawn as present.
    let drawn = |topic: &str| {
        let name = format!("data-name=\"{topic}\"");
        let windows = 0..21;
        let is_drawn = |window: &i32| {
            let frame = folder.path().join(format!("{window:02}.svg"));
            let frame = fs::read_to_string(frame).unwrap();
            let mut groups = frame.split("<g ").filter_map(|group| group.split_once('>'));
            let absent = ["removed", "away"];
            groups.any(|(tag, _)| tag.contains(&name) && !absent.iter().any(|a| tag.contains(a)))
        };
        windows.filter(is_drawn).collect::<Vec<i32>>()
    };
    assert_eq!(drawn("/scan"), (0..11).chain(14..21).collect::<Vec<_>>());
    assert_eq!(drawn("/before"), (0..11).collect::<Vec<_>>());
    assert_eq!(drawn("/after"), (14..21).collect::<Vec<_>>());
}

/// Adds messages whose headers are numbered from 1 in each of these times, in milliseconds.
fn stamped(bag: &mut Recording, node: &str, topic: &str, times: &[(i64, i64)]) {
    let own = bag.publisher(node, topic, "test/Scan");
    "Header header\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
        .clone_into(&mut bag.publishers[own].definition);
    for (from, to) in times {
        for (number, millisecond) in (1_u32..).zip((*from..*to).step_by(100)) {
            let mut payload = number.to_le_bytes().to_vec();
            payload.extend([0; 12]);
            let time = ORIGIN + millisecond * MILLISECOND;
            bag.messages.push((own, time, payload));
        }
    }
}
