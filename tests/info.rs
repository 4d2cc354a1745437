//! Tests of the summary and the advice of `info`.

use std::path::{Path, PathBuf};

use bagreel::internals::mission::info::{Info, info};
use bagreel::internals::pipeline::{Reading, Unwatched, explain, read};

use crate::support::cdr::Cdr;
use crate::support::{ORIGIN, Recording, mcap};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(name)
}

fn shown(bag: PathBuf) -> Info {
    let reading = Reading::of([bag]);
    info(&read(&reading, &mut Unwatched).unwrap())
}

/// A ROS 2 recording by a recorder that logs, as a file in its own folder.
fn recorded() -> (tempfile::TempDir, PathBuf) {
    let mut bag = Recording::default();
    let log = bag.publisher("", "/rosout", "rcl_interfaces/msg/Log");
    let scan = bag.publisher("", "/scan", "sensor_msgs/msg/LaserScan");
    let file = "./src/rosbag2_transport/recorder.cpp";
    let text = "Subscribed to topic '/scan'";
    let record = Cdr::default().time(1).u8(20).text("my_recorder").text(text);
    let record = record.text(file).text("f").u32(7).done();
    bag.messages.push((log, ORIGIN, record));
    bag.messages
        .push((scan, ORIGIN + 1_000_000_000, vec![0, 1, 0, 0, 9]));
    let options = mcap::Options {
        profile: "ros2",
        ..mcap::Options::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, mcap::write(&bag, &options)).unwrap();
    (folder, path)
}

#[test]
fn the_recorder_is_not_a_subscriber_and_suppresses_no_advice() {
    let (_folder, inputs) = recorded();
    let info = shown(inputs);
    assert_eq!(info.subscribes_by_degree.total(), 0);
    assert!(info.topics.iter().all(|t| t.subscribers.is_empty()));
    assert_eq!(info.topics_without_subscriber, 2);
    let recorder = info
        .evidence
        .iter()
        .find(|e| e.source == "recorder")
        .unwrap();
    assert_eq!((recorder.nodes, recorder.subscribes), (1, 0));
    assert!(
        info.advice.iter().any(|line| line.contains("`/rosgraph`")),
        "{:?}",
        info.advice
    );
}

#[test]
fn advice_on_ros2_lists_gaps_files_and_record_options() {
    let info = shown(example("courier.mcap"));
    let missing = format!(
        "{} without a known publisher, {} without a known subscriber",
        info.topics_without_publisher, info.topics_without_subscriber
    );
    assert!(info.topics_without_publisher > 0);
    assert!(info.advice[0].ends_with(&missing), "{:?}", info.advice);
    assert!(
        info.advice
            .iter()
            .any(|line| line.starts_with("`--topology FILE`"))
    );
    let last = info.advice.last().unwrap();
    assert!(last.contains("rosgraph_monitor_node") && last.contains("ros2 bag record --all"));
}

#[test]
fn the_evidence_of_an_edge_includes_conclusions() {
    let mut reading = Reading::of([example("warehouse.bag")]);
    let mut why = |names: [&str; 2]| {
        reading.collect.why = names.map(str::to_owned).to_vec();
        let (_, pieces) = explain(&reading, &mut Unwatched).unwrap();
        pieces
            .into_iter()
            .map(|piece| piece.source)
            .collect::<Vec<_>>()
    };
    assert_eq!(why(["/robot1/scan_throttle", "/robot1/scan"]), ["payload"]);
    assert!(why(["/robot1/amcl", "/tf"]).contains(&"connection"));
    assert!(why(["/robot1/amcl", "/tf"]).contains(&"tf_pair"));
}

#[test]
fn info_suggests_a_figure_that_fits() {
    let words = |inputs| -> Vec<&str> { shown(inputs).figures.iter().map(|f| f.figure).collect() };
    assert_eq!(
        words(example("warehouse.bag")),
        ["lives", "graph", "holders", "steps"]
    );
    // One log record and one scan: no connection is known.
    let (_folder, inputs) = recorded();
    let info = shown(inputs);
    assert_eq!(info.figures.len(), 1);
    assert!(
        info.figures[0].shows.contains("without a known publisher"),
        "{:?}",
        info.figures
    );
}
