//! Tests of reading graph data recorded by other tools.

use std::fs;
use std::path::Path;
use std::process::Command;

use bagreel::values::{Element, Length, Period};
use bagreel::{Mission, Reading, read};

use crate::support::cdr::Cdr;
use crate::support::rosbag1::{self, Pack};
use crate::support::{ORIGIN, Recording, mcap};

const SECOND: i64 = 1_000_000_000;

/// Writes a recording as MCAP of ROS 2 with this name.
fn written(bag: &Recording, folder: &Path, name: &str) -> std::path::PathBuf {
    let path = folder.join(name);
    let options = mcap::Options {
        profile: "ros2",
        ..mcap::Options::default()
    };
    fs::write(&path, mcap::write(bag, &options)).unwrap();
    path
}

/// A lidar that is incompatible with reliable subscribers, and of which the recorder loses five seconds.
fn lossy() -> Recording {
    let mut bag = Recording::default();
    let scan = bag.publisher("", "/scan", "sensor_msgs/msg/LaserScan");
    bag.send(scan, (0, 20_000), 100, &Cdr::default().u32(1).done());
    bag.send(scan, (25_000, 40_000), 100, &Cdr::default().u32(1).done());
    let lost = "/events/rosbag2_messages_lost";
    let lost = bag.publisher("", lost, "rosbag2_interfaces/msg/MessagesLostEvent");
    for second in 21..=25_i64 {
        let report = Cdr::default()
            .text("/rec")
            .u32(1)
            .text("/scan")
            .u64(0)
            .u64(10);
        bag.messages
            .push((lost, ORIGIN + second * SECOND, report.done()));
    }
    let rosout = bag.publisher("", "/rosout", "rcl_interfaces/msg/Log");
    for (second, text) in [
        (
            5,
            "New subscription discovered on topic '/scan', requesting incompatible QoS. No messages will be sent to it. \
             Last incompatible policy: RELIABILITY_QOS_POLICY",
        ),
        (
            7,
            "Publisher already registered for node name: 'lidar'. If this is due to",
        ),
    ] {
        let at = ORIGIN + second * SECOND;
        let record = Cdr::default().time(at).u8(30).text("lidar").text(text);
        let record = record.text("lidar.cpp").text("run").u32(1);
        bag.messages.push((rosout, at, record.done()));
    }
    bag.messages.sort_by_key(|m| m.1);
    bag
}

#[test]
fn losses_starved_subscribers_and_duplicate_names_are_events_and_findings() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(&lossy(), folder.path(), "lossy.mcap");
    let run = |args: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .args(args)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stdout).into_owned();
        (run.status.code(), said)
    };
    let (_, log) = run(&["events", path.to_str().unwrap()]);
    for line in [
        "/lidar → /scan a subscriber gets nothing: incompatible reliability",
        "/lidar is the name of two nodes",
        "/scan 50 messages lost by the recorder in 4 s",
    ] {
        assert!(log.contains(line), "{line}: {log}");
    }
    // The recorder caused the gap.
    assert!(!log.contains("silent"), "{log}");
    let expect = folder.path().join("graph.yaml");
    fs::write(
        &expect,
        "schema: bagreel.expect/1\npolicy: {starved: error}\n",
    )
    .unwrap();
    let (code, report) = run(&[
        "check",
        path.to_str().unwrap(),
        "--expect",
        expect.to_str().unwrap(),
    ]);
    assert_eq!(code, Some(1), "{report}");
    for word in ["starved", "duplicate-name", "messages-lost"] {
        assert!(report.contains(word), "{word}: {report}");
    }
}

#[test]
fn any_channel_metadata_key_with_a_node_names_the_publisher() {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/msg/LaserScan");
    bag.send(scan, (0, 5_000), 100, &Cdr::default().u32(1).done());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let options = mcap::Options {
        profile: "ros2",
        publisher_key: Some("node_name"),
        ..mcap::Options::default()
    };
    fs::write(&path, mcap::write(&bag, &options)).unwrap();
    let mission = read(&Reading::of([path])).unwrap();
    let nodes = mission.elements.nodes.iter().map(|n| n.name.as_str());
    assert_eq!(nodes.collect::<Vec<_>>(), ["/lidar"]);
}

/// A payload of ROS 1, packed.
fn packed(parts: &[&[u8]]) -> Vec<u8> {
    parts.concat()
}

fn text(text: &str) -> Vec<u8> {
    let len = u32::try_from(text.len()).unwrap().to_le_bytes();
    packed(&[&len, text.as_bytes()])
}

/// Seconds and nanoseconds, as in times and durations.
fn time(nanos: i64) -> Vec<u8> {
    let part = |n: i64| i32::try_from(n).unwrap().to_le_bytes();
    packed(&[&part(nanos / SECOND), &part(nanos % SECOND)])
}

const STATISTICS: &str = "string topic\nstring node_pub\nstring node_sub\ntime window_start\ntime window_stop\n\
    int32 delivered_msgs\nint32 dropped_msgs\nint32 traffic\nduration period_mean\nduration period_stddev\n\
    duration period_max\nduration stamp_age_mean\nduration stamp_age_stddev\nduration stamp_age_max\n";

/// 40 s of a lidar at 10 Hz: 800 to 1200 bytes a scan, stamped 40 to 60 ms before, every other one 20 ms late; two
/// scans per second are lost on the way to the mapper, where they are 70 ms old.
fn measured() -> Recording {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    let statistics = bag.publisher("/slam", "/statistics", "rosgraph_msgs/TopicStatistics");
    STATISTICS.clone_into(&mut bag.publishers[statistics].definition);
    for n in 0..400_i64 {
        let at = ORIGIN + n * SECOND / 10 + n % 2 * 20_000_000;
        let (age, size) = (40 + n % 5 * 5, 800 + n % 5 * 100);
        let head = packed(&[
            &0_u32.to_le_bytes(),
            &time(at - age * 1_000_000),
            &text("laser"),
        ]);
        let payload = packed(&[&head, &vec![7; usize::try_from(size).unwrap() - head.len()]]);
        bag.messages.push((scan, at, payload));
    }
    for second in 1..=40_i64 {
        let end = ORIGIN + second * SECOND - 1_000_000;
        let number = |n: i32| n.to_le_bytes();
        let report = packed(&[
            &text("/scan"),
            &text("/lidar"),
            &text("/slam"),
            &time(end - SECOND),
            &time(end),
            &number(8),
            &number(2),
            &number(8000),
            &time(100_000_000),
            &time(20_000_000),
            &time(120_000_000),
            &time(70_000_000),
            &time(1_000_000),
            &time(75_000_000),
        ]);
        bag.messages.push((statistics, end, report));
    }
    bag.messages.sort_by_key(|m| m.1);
    bag
}

fn in_windows_of(path: &Path, seconds: i64) -> Mission {
    let mut reading = Reading::of([path]);
    reading.division.length = Length::Fixed(Period::from_nanos(seconds * SECOND).unwrap());
    read(&reading).unwrap()
}

fn near(seen: Option<f64>, truth: f64) -> bool {
    seen.is_some_and(|seen| (seen - truth).abs() <= truth * 0.01)
}

#[test]
fn bytes_drops_jitter_and_age_are_accurate_to_one_percent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    fs::write(&path, rosbag1::write(&measured(), Pack::Lz4, 16_384)).unwrap();
    let mission = in_windows_of(&path, 10);
    let all = &mission.elements;
    let topic = all.topic("/scan").unwrap();
    let graph = mission.graphs.iter().nth(1).unwrap();
    let scan = graph.get(Element::Topic(topic)).unwrap();
    let count = |n: Option<u64>| n.map(|n| n as f64);
    assert!(near(count(scan.bytes), 100_000.0), "{scan:?}");
    assert!(near(count(scan.measures.drops), 20.0), "{scan:?}");
    assert!(near(scan.measures.jitter_s, 0.02), "{scan:?}");
    assert!(near(scan.measures.age_s, 0.05), "{scan:?}");
    let is_scan = |id| all.subscribes[id].topic == topic;
    let (_, edge) = graph.subscribes().find(|e| is_scan(e.0)).unwrap();
    assert!(near(count(edge.count), 80.0), "{edge:?}");
    assert!(near(edge.hz, 8.0), "{edge:?}");
    assert!(near(count(edge.bytes), 80_000.0), "{edge:?}");
    assert!(near(count(edge.measures.drops), 20.0), "{edge:?}");
    assert!(near(edge.measures.jitter_s, 0.02), "{edge:?}");
    assert!(near(edge.measures.age_s, 0.07), "{edge:?}");
    let is_scan = |id| all.publishes[id].topic == topic;
    let (_, edge) = graph.publishes().find(|e| is_scan(e.0)).unwrap();
    assert!(near(count(edge.bytes), 100_000.0), "{edge:?}");
    assert!(near(edge.measures.age_s, 0.05), "{edge:?}");
    let loads = graph.loads(all);
    let of = |name: &str| {
        let is_it = |id| all.nodes[id].name.as_str() == name;
        loads[graph.nodes().position(|n| is_it(n.0)).unwrap()]
    };
    let (lidar, slam) = (of("/lidar"), of("/slam"));
    assert_eq!((lidar.messages_out, lidar.bytes_out), (100, Some(100_000)));
    assert_eq!(
        (slam.messages_in, slam.bytes_in, slam.topics_in),
        (100, Some(100_000), 1)
    );
}

#[test]
fn age_bytes_and_drops_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(
        folder.join("a.bag"),
        rosbag1::write(&measured(), Pack::Lz4, 16_384),
    )
    .unwrap();
    let check = |rules: &str| {
        let text = format!("schema: bagreel.expect/1\nperiod: 10s\ntopics:\n  {rules}\n");
        fs::write(folder.join("graph.yaml"), text).unwrap();
        let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
        run.current_dir(folder);
        let done = run
            .args(["check", "a.bag", "--expect", "graph.yaml"])
            .output();
        let done = done.unwrap();
        let said = String::from_utf8(done.stdout).unwrap();
        (
            done.status.code(),
            said + &String::from_utf8_lossy(&done.stderr),
        )
    };
    let (code, said) = check("/scan: {age: ..0.06s, bytes: 9kB/s..11kB/s, drops: ..20}");
    assert!(code == Some(0) && said.contains("no findings"), "{said}");
    for (rules, finding) in [
        (
            "/scan: {age: ..40ms}",
            "error[topic-age]: /scan has age 50 ms, expected ..40 ms",
        ),
        (
            "/scan: {bytes: ..5kB/s}",
            "error[topic-bytes]: /scan has bytes 10",
        ),
        (
            "/scan: {drops: ..0}",
            "error[topic-drops]: /scan has drops 20, expected ..0",
        ),
    ] {
        let (code, said) = check(rules);
        assert!(code == Some(1) && said.contains(finding), "{rules}: {said}");
    }
    let (_, said) = check("/statistics: {drops: ..0}");
    assert!(
        said.contains("unknown[topic-drops]: cannot tell the drops of /statistics"),
        "{said}"
    );
    let (code, said) = check("/scan: {bytes: ..5 apples}");
    assert!(code == Some(2) && said.contains("..5MB/s"), "{said}");
}
