//! Compares the example mission with an independent reader's counts and with the ground truth.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use bagreel::internals::base::time::{Moment, Period};
use bagreel::internals::graph::window::Length;
use bagreel::internals::mission::Mission;
use bagreel::internals::pipeline::{Reading, Unwatched, read};

/// The mission in 10-second windows.
fn mission() -> Mission {
    part(None, None)
}

/// The mission between two times.
fn part(start: Option<&str>, end: Option<&str>) -> Mission {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
    let length = Period::parse("10").map_or(Length::Auto, Length::Fixed);
    let mut reading = Reading::of([path]);
    reading.division.length = length;
    reading.division.start = start.and_then(Moment::parse);
    reading.division.end = end.and_then(Moment::parse);
    read(&reading, &mut Unwatched).unwrap()
}

/// The counts that Python's `rosbags` finds: topics by name, windows in order.
fn counted_by_others() -> serde_json::Value {
    serde_json::from_str(include_str!("data/warehouse.counts.json")).unwrap()
}

#[test]
fn all_counts_match_an_independent_reader() {
    let (mission, expected) = (mission(), counted_by_others());
    assert_eq!(mission.span.start.0, expected["start_ns"].as_i64().unwrap());
    assert_eq!(mission.messages, expected["messages"].as_u64().unwrap());
    for ((window, graph), expected) in mission.each().zip(expected["windows"].as_array().unwrap()) {
        let counted = graph.topics().filter(|(_, t)| t.messages() > 0);
        let counted: BTreeMap<&str, u64> = counted
            .map(|(id, t)| (mission.elements.topics[id].name.as_str(), t.messages()))
            .collect();
        let expected: BTreeMap<&str, u64> = expected
            .as_object()
            .unwrap()
            .iter()
            .map(|(k, v)| (k.as_str(), v.as_u64().unwrap()))
            .collect();
        assert_eq!(counted, expected, "window {}", window.index);
    }
    assert_eq!(
        mission.windows.len(),
        expected["windows"].as_array().unwrap().len()
    );
}

/// Whether a node is running in the window that begins at this second of the mission.
fn alive(mission: &Mission, node: &str, second: usize) -> bool {
    let graph = mission.graphs.get(second / 10).unwrap();
    graph
        .nodes()
        .any(|(id, _)| mission.elements.nodes[id].name.as_str().starts_with(node))
}

#[test]
fn nodes_start_and_stop_at_the_true_times() {
    let mission = mission();
    let life = |node: &str| -> Vec<usize> {
        (0..330)
            .step_by(10)
            .filter(|s| alive(&mission, node, *s))
            .collect()
    };
    let seconds = |from: usize, to: usize| -> Vec<usize> { (from..=to).step_by(10).collect() };
    assert_eq!(life("/robot1/base_driver"), seconds(0, 320));
    assert_eq!(life("/robot1/planner"), seconds(30, 170));
    assert_eq!(life("/robot1/emergency_stop"), seconds(90, 150));
    assert_eq!(life("/robot2/base_driver"), seconds(160, 320));
    // Killed at 4:26 and back at 4:41 under another anonymous name: running in every window of ten seconds
    // but one.
    assert_eq!(
        life("/robot1/object_detector_"),
        [seconds(170, 260), seconds(280, 290)].concat()
    );
    assert_eq!(life("/robot1/dock_controller"), seconds(290, 320));
}

/// The headers of connections name all nodes, also those that stop before the part begins.
#[test]
fn nodes_of_another_part_of_the_recording_are_not_in_the_graph() {
    let names = |mission: &Mission, window: usize| -> BTreeSet<String> {
        let graph = mission.graphs.get(window).unwrap();
        let node = |id| mission.elements.nodes[id].name.to_string();
        graph.nodes().map(|(id, _)| node(id)).collect()
    };
    let (whole, part) = (mission(), part(Some("280"), None));
    let (alive, drawn) = (names(&whole, 28), names(&part, 0));
    let strangers: Vec<_> = drawn.difference(&alive).collect();
    assert!(strangers.is_empty(), "{strangers:?}");
    assert!(drawn.contains("/map_server") && drawn.contains("/robot2/planner"));
    let is_stopped = |name: &str| name == "/robot1/emergency_stop";
    let mut all = part.elements.nodes.iter();
    assert!(!all.any(|node| is_stopped(node.name.as_str())));
    let part = self::part(None, Some("20"));
    let (alive, drawn) = (names(&whole, 0), names(&part, 0));
    let strangers: Vec<_> = drawn.difference(&alive).collect();
    assert!(strangers.is_empty(), "{strangers:?}");
}
