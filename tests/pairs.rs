//! Tests with pairs of runs of one mission: a second healthy run passes the first one's expectation, and each fault
//! breaks exactly its rules.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use bagreel::bag::Want;
use bagreel::{Reading, read};

use crate::edges::log1;
use crate::gate::bagreel;
use crate::support::rosbag1::{self, Pack};
use crate::support::{self, ORIGIN, Publisher, Recording, mcap, mission};

const SECOND: i64 = 1_000_000_000;

/// A small pseudo-random sequence.
struct Noise(u64);

impl Noise {
    /// The next number of 0..`below`.
    fn next(&mut self, below: i64) -> i64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        i64::try_from(self.0 >> 33).unwrap() % below
    }
}

/// A recorded mission, message by message.
pub(crate) fn loaded(bag: &str) -> Recording {
    let (_, kept) = support::read(Path::new(bag), Want::Payload).unwrap();
    let text = |text: &Option<std::sync::Arc<str>>| text.as_deref().unwrap_or("").to_owned();
    let publishers = kept.connections.iter().map(|own| Publisher {
        node: own
            .publisher
            .as_ref()
            .map_or_else(String::new, ToString::to_string),
        topic: own.topic.to_string(),
        type_name: own.type_name.to_string(),
        latching: own.latching,
        qos: text(&own.qos),
        definition: text(&own.definition),
    });
    let messages = kept.messages.into_iter();
    let messages = messages.map(|(id, at, data)| (id.0 as usize, at.0, data));
    let mut run = Recording {
        publishers: publishers.collect(),
        messages: messages.collect(),
    };
    run.messages.sort_by_key(|m| m.1);
    run
}

/// Another run of the same mission: events are up to a second earlier or later, publishers start a little later, every
/// message has 4 ms of jitter, and one in 500 is lost.
fn again(run: &Recording, seed: u64) -> Recording {
    let mut noise = Noise(seed);
    let start = run.messages[0].1;
    let late: Vec<i64> = run
        .publishers
        .iter()
        .map(|_| noise.next(SECOND / 3))
        .collect();
    let mut last: Vec<i64> = vec![0; run.publishers.len()];
    let mut counted: Vec<u64> = vec![0; run.publishers.len()];
    let mut messages = Vec::new();
    for (place, at, payload) in &run.messages {
        // Slow waves, no jumps: rates differ by 5 % at most.
        let wave = libm::sin((at - start) as f64 / 20e9 + seed as f64) * 0.9e9;
        #[expect(clippy::cast_possible_truncation, reason = "less than a second")]
        let wave = wave as i64;
        let moved = at + wave + SECOND + late[*place] + noise.next(8_000_000) - 4_000_000;
        // Messages of one publisher stay in order.
        let moved = moved.max(last[*place] + 1000);
        last[*place] = moved;
        counted[*place] += 1;
        if noise.next(500) > 0 || counted[*place] == 1 {
            messages.push((*place, moved, payload.clone()));
        }
    }
    messages.sort_by_key(|m| m.1);
    Recording {
        publishers: run.publishers.clone(),
        messages,
    }
}

/// The findings of a check as `id name` with their counts, and the number of rules.
fn found(folder: &Path, bag: &str) -> (Vec<String>, usize) {
    let args = ["check", bag, "--expect", "graph.yaml", "--format", "json"];
    let output = bagreel(folder, &args);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
    let rules = report["rules"].as_array().unwrap();
    let mut all: Vec<String> = rules
        .iter()
        .flat_map(|rule| rule["findings"].as_array().into_iter().flatten())
        .map(|f| {
            format!(
                "{} {}",
                f["id"].as_str().unwrap(),
                f["name"].as_str().unwrap()
            )
        })
        .collect();
    all.sort();
    (all, rules.len())
}

/// The indices of a node's publishers.
fn of(run: &Recording, node: &str) -> Vec<usize> {
    let places = 0..run.publishers.len();
    places
        .filter(|at| run.publishers[*at].node == node)
        .collect()
}

/// Makes a node crash this many seconds after the mission's start.
fn crash(run: &mut Recording, node: &str, second: i64) {
    let own = of(run, node);
    let end = run.messages[0].1 + second * SECOND;
    let is_log = |place: usize| run.publishers[place].topic.starts_with("/rosout");
    let logs: Vec<bool> = (0..run.publishers.len()).map(is_log).collect();
    // Its own messages, and its log as forwarded by others.
    let is_own = |(place, _, payload): &(usize, i64, Vec<u8>)| {
        let shown = || payload.windows(node.len()).any(|w| w == node.as_bytes());
        own.contains(place) || logs[*place] && shown()
    };
    run.messages.retain(|m| m.1 < end || !is_own(m));
}

/// Renames a node, in its log too; the name has the same length.
fn rename(run: &mut Recording, node: &str, name: &str) {
    assert_eq!(node.len(), name.len());
    for place in of(run, node) {
        name.clone_into(&mut run.publishers[place].node);
    }
    let (old, new) = (node.as_bytes(), name.as_bytes());
    for (.., payload) in &mut run.messages {
        let mut at = 0;
        while let Some(next) = payload[at..].windows(old.len()).position(|w| w == old) {
            payload[at + next..at + next + old.len()].copy_from_slice(new);
            at += next + old.len();
        }
    }
}

/// Removes every second message of a topic.
fn halve(run: &mut Recording, topic: &str) {
    let places: Vec<bool> = run.publishers.iter().map(|p| p.topic == topic).collect();
    let mut nth = 0;
    run.messages.retain(|(place, ..)| {
        nth += usize::from(places[*place]);
        !places[*place] || nth % 2 == 0
    });
}

/// Adds another publisher of a topic between two seconds.
fn join(run: &mut Recording, node: &str, topic: &str, (from, to): (i64, i64)) {
    let model = run
        .publishers
        .iter()
        .position(|p| p.topic == topic)
        .unwrap();
    let payload = run
        .messages
        .iter()
        .find(|m| m.0 == model)
        .unwrap()
        .2
        .clone();
    run.publishers.push(Publisher {
        node: node.to_owned(),
        ..run.publishers[model].clone()
    });
    let (place, start) = (run.publishers.len() - 1, run.messages[0].1);
    let times = (from * 10..to * 10).map(|tenth| start + tenth * SECOND / 10);
    run.messages
        .extend(times.map(|at| (place, at, payload.clone())));
    run.messages.sort_by_key(|m| m.1);
}

fn written(folder: &Path, name: &str, run: &Recording) {
    let bytes = rosbag1::write(run, Pack::None, 1 << 20);
    fs::write(folder.join(name), bytes).unwrap();
}

/// Writes the expectation of a run.
fn expected(folder: &Path, bag: &str) {
    let output = bagreel(folder, &["baseline", bag, "-o", "graph.yaml"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// A fault of a run.
type Fault = fn(&mut Recording);

#[test]
fn each_fault_of_the_warehouse_breaks_exactly_its_rules() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let run = loaded(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/examples/warehouse.bag"
    ));
    written(here, "first.bag", &run);
    expected(here, "first.bag");
    let table: [(&str, Fault, &[&str]); 7] = [
        ("healthy", |_| {}, &[]),
        ("healthy too", |run| *run = again(run, 99), &[]),
        (
            "crashed",
            |run| crash(run, "/robot1/imu_driver", 200),
            &[
                "node-gone /robot1/imu_driver",
                "topic-gap /robot1/imu/data",
                "topic-rate-low /bond",
                "topic-rate-low /robot1/imu/data",
            ],
        ),
        (
            "renamed",
            |run| rename(run, "/robot1/scan_throttle", "/robot1/scan_thrattle"),
            &[
                "node-missing /robot1/scan_throttle",
                "publisher-missing /robot1/scan_throttled",
                "publisher-unexpected /robot1/scan_throttled",
                "unexpected-node /robot1/scan_thrattle",
            ],
        ),
        (
            "halved",
            |run| halve(run, "/robot1/odom"),
            &["topic-rate-low /robot1/odom"],
        ),
        (
            "second publisher",
            |run| join(run, "/teleop", "/robot1/cmd_vel", (200, 220)),
            &[
                "publisher-unexpected /robot1/cmd_vel",
                "topic-rate-high /robot1/cmd_vel",
                "unexpected-node /teleop",
            ],
        ),
        (
            "missing, and who subscribed with it",
            |run| {
                rename(
                    run,
                    "/robot1/obstacle_detector",
                    "/robot1/obstacle_detectar",
                );
            },
            &[
                "node-missing /robot1/obstacle_detector",
                "publisher-missing /robot1/obstacle_markers",
                "publisher-missing /robot1/obstacles",
                "publisher-unexpected /robot1/obstacle_markers",
                "publisher-unexpected /robot1/obstacles",
                "subscriber-missing /robot1/scan",
                "unexpected-node /robot1/obstacle_detectar",
            ],
        ),
    ];
    let mut wrong = Vec::new();
    for (seed, (name, fault, wanted)) in (1..).zip(table) {
        let mut other = again(&run, seed);
        fault(&mut other);
        written(here, "other.bag", &other);
        let (all, rules) = found(here, "other.bag");
        if all != wanted {
            wrong.push(format!("{name} ({rules} rules): {all:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_second_run_of_the_courier_passes_the_check() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let run = mission::mission();
    let write = |name: &str, run: &Recording| {
        let options = mcap::Options {
            profile: "ros2",
            ..mcap::Options::default()
        };
        let bytes = mcap::write(run, &options);
        fs::write(here.join(name), bytes).unwrap();
    };
    write("first.mcap", &run);
    expected(here, "first.mcap");
    for seed in 1..4 {
        write("other.mcap", &again(&run, seed));
        let (all, rules) = found(here, "other.mcap");
        assert!(all.is_empty(), "{rules} rules: {all:?}");
    }
}

#[test]
fn second_runs_of_recorded_missions_break_one_rule_of_a_hundred_at_most() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let (mut findings, mut judged) = (Vec::new(), 0);
    for below in [
        "bags/mission/mission.bag",
        "bags/fibonacci/fibonacci_namespaces.bag",
        "bags/guardian/palette_door_bz2.bag",
        "bags/kamir/split_0.bag",
        "bags/lisa/voice_spk80_75db_v2.bag",
        "bags/movebase/movebase_simtime.bag",
        "bags/paper/turtlesim.bag",
        "mini/mini_lz4.bag",
        "mini/nodelet.bag",
        "warehouse/warehouse_norosout.bag",
    ] {
        let Some(bag) = support::shared(&format!("data/{below}")) else {
            continue;
        };
        let run = loaded(bag.to_str().unwrap());
        written(here, "first.bag", &run);
        expected(here, "first.bag");
        for seed in 1..3 {
            written(here, "other.bag", &again(&run, seed));
            let (all, rules) = found(here, "other.bag");
            println!("{below}: {} findings, {rules} rules {all:?}", all.len());
            findings.extend(all.into_iter().map(|one| format!("{below}: {one}")));
            judged += rules;
        }
    }
    assert!(
        findings.len() * 100 <= judged,
        "{judged} rules: {findings:#?}"
    );
}

const STATISTICS: &str = "string topic\nstring node_pub\nstring node_sub\ntime window_start\ntime window_stop\n\
    int32 delivered_msgs\nint32 dropped_msgs\nint32 traffic\nduration period_mean\nduration period_stddev\n\
    duration period_max\nduration stamp_age_mean\nduration stamp_age_stddev\nduration stamp_age_max\n";
pub(crate) const LOG: &str = "std_msgs/Header header\nbyte level\nstring name\nstring msg\nstring file\nstring function\n\
    uint32 line\nstring[] topics\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

/// `rosgraph_msgs/TopicStatistics` for messages from one node to another.
fn statistics(topic: &str, from: &str, to: &str, at: i64) -> Vec<u8> {
    let mut payload = Vec::new();
    for text in [topic, from, to] {
        payload.extend(u32::try_from(text.len()).unwrap().to_le_bytes());
        payload.extend(text.bytes());
    }
    for nanos in [at - SECOND, at] {
        payload.extend(u32::try_from(nanos / SECOND).unwrap().to_le_bytes());
        payload.extend(u32::try_from(nanos % SECOND).unwrap().to_le_bytes());
    }
    // Messages, dropped ones, traffic; then periods and ages.
    for number in [10_u32, 0, 480] {
        payload.extend(number.to_le_bytes());
    }
    payload.extend([0; 48]);
    payload
}

/// A lidar with these subscribers according to statistics.
fn counted(readers: &[&str]) -> Recording {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    let map = bag.publisher("/slam", "/map_updates", "std_msgs/String");
    let pose = bag.publisher("/amcl", "/pose", "geometry_msgs/Pose");
    bag.send(scan, (0, 60_000), 100, &[1; 48]);
    bag.send(map, (0, 60_000), 1000, b"\x01\0\0\0a");
    bag.send(pose, (0, 60_000), 500, &[2; 56]);
    for reader in readers {
        let own = bag.publisher(reader, "/statistics", "rosgraph_msgs/TopicStatistics");
        STATISTICS.clone_into(&mut bag.publishers[own].definition);
        for second in 1..60 {
            let at = ORIGIN + second * SECOND;
            let payload = statistics("/scan", "/lidar", reader, at);
            bag.messages.push((own, at, payload));
        }
    }
    bag.messages.sort_by_key(|m| m.1);
    bag
}

#[test]
fn a_subscriber_that_disappears_from_statistics_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    written(here, "first.bag", &counted(&["/amcl", "/slam"]));
    expected(here, "first.bag");
    let text = fs::read_to_string(here.join("graph.yaml")).unwrap();
    assert!(text.contains("to: [/amcl, /slam]"), "{text}");
    written(here, "same.bag", &again(&counted(&["/amcl", "/slam"]), 5));
    assert_eq!(found(here, "same.bag").0, Vec::<String>::new());
    written(here, "deaf.bag", &again(&counted(&["/amcl"]), 6));
    assert_eq!(found(here, "deaf.bag").0, ["subscriber-missing /scan"]);
}

/// A recorder subscribes to a topic because it exists; any other node may wait for it.
#[test]
fn a_topic_that_only_a_recorder_waits_for_does_not_exist_yet() {
    let dir = tempfile::tempdir().unwrap();
    let first = |reader: &str| {
        let mut bag = counted(&["/record_1", "/record_2"]);
        let joy = bag.publisher("/joystick", "/joy", "std_msgs/String");
        bag.send(joy, (40_000, 60_000), 500, b"\x01\0\0\0a");
        for name in ["/record_1", reader] {
            let own = bag.publisher(name, "/statistics", "rosgraph_msgs/TopicStatistics");
            STATISTICS.clone_into(&mut bag.publishers[own].definition);
            let at = ORIGIN + 42 * SECOND;
            let payload = statistics("/joy", "/joystick", name, at);
            bag.messages.push((own, at, payload));
        }
        bag.messages.sort_by_key(|m| m.1);
        written(dir.path(), "run.bag", &bag);
        let mission = read(&Reading::of([dir.path().join("run.bag")])).unwrap();
        let elements = &mission.elements;
        let mut topics = elements.topics.with_ids();
        let (joy, _) = topics.find(|(_, t)| t.name.as_str() == "/joy").unwrap();
        let subscribes = elements.subscribes.iter();
        let seen = subscribes
            .filter(|edge| edge.topic == joy)
            .map(|edge| &edge.seen);
        let seen = seen.chain([&elements.topics[joy].seen]);
        let firsts = seen.map(|seen| (seen.lives[0].start.0 - ORIGIN) / SECOND);
        firsts.collect::<Vec<_>>()
    };
    assert_eq!(first("/record_2"), [40, 40, 40]);
    assert_eq!(first("/teleop"), [0, 0, 0]);
}

/// A bag whose connections have no node names, with a log of few nodes.
#[test]
fn a_rewritten_bag_without_publishers_proves_no_node_missing() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let run = |named: bool| {
        let mut bag = Recording::default();
        let node = |name: &'static str| if named { name } else { "" };
        let scan = bag.publisher(node("/lidar"), "/scan", "sensor_msgs/LaserScan");
        let cmd = bag.publisher(node("/teleop"), "/cmd_vel", "geometry_msgs/Twist");
        let log = bag.publisher(node("/lidar"), "/rosout", "rosgraph_msgs/Log");
        LOG.clone_into(&mut bag.publishers[log].definition);
        bag.send(scan, (0, 60_000), 100, &[1; 48]);
        bag.send(cmd, (0, 60_000), 100, &[2; 48]);
        let line = log1("/lidar", "spinning", "lidar.cpp", &["/rosout", "/scan"]);
        bag.messages.push((log, ORIGIN + SECOND, line));
        bag.messages.sort_by_key(|m| m.1);
        bag
    };
    written(here, "first.bag", &run(true));
    expected(here, "first.bag");
    written(here, "bare.bag", &run(false));
    let output = bagreel(here, &["check", "bare.bag", "--expect", "graph.yaml"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.contains("/teleop is present: the connections of this bag name no senders"),
        "{said}"
    );
    let output = bagreel(here, &["diff", "first.bag", "bare.bag"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("? node       /teleop"), "{said}");
    let kinds: BTreeMap<&str, usize> = said.lines().fold(BTreeMap::new(), |mut all, line| {
        *all.entry(line.get(..1).unwrap_or("")).or_default() += 1;
        all
    });
    assert!(
        !kinds.contains_key("-") && !kinds.contains_key("+"),
        "{said}"
    );
}
