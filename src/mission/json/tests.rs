//! Tests that a mission is the same after writing and reading.

use proptest::prelude::*;

use crate::base::notice::Notices;
use crate::base::time::{Period, Span, Stamp};
use crate::evidence::Evidence;
use crate::graph::graphs_for_tests::graph;
use crate::graph::{Edge, Elements, Existence, Graph, Node, NodeId, Topic, TopicId};
use crate::mission::event_log::{Detail, Kind};
use crate::mission::{EventLog, Mission, Sending, Window, read_json, write_json};

fn elements() -> Elements {
    let node = |name: &str| Node {
        name: name.into(),
        role: name.into(),
        seen: Existence {
            evidence: Evidence::of("connection"),
            first: Some(Stamp(3)),
            last: None,
            lives: vec![Span::new(Stamp(3), Stamp(9))],
        },
    };
    let topic = |name: &str| Topic {
        name: name.into(),
        types: vec!["a/B".into()],
        seen: Existence::of(Evidence::of("rosout")),
        qos: Some("reliable".into()),
        unknown_publishers: Some(1),
    };
    let edge = |id| Edge {
        node: NodeId(id),
        topic: TopicId(id),
        seen: Existence::default(),
    };
    Elements {
        nodes: ["/a", "/b", "/c"].map(node).to_vec().into(),
        topics: ["/t", "/u", "/v"].map(topic).to_vec().into(),
        publishes: (0..3).map(edge).collect(),
        subscribes: (0..3).map(edge).collect(),
    }
}

fn mission(graphs: Vec<(Graph, i64)>) -> Mission {
    let mut at = Stamp(0);
    let windows = graphs.into_iter().map(|(graph, length)| {
        let start = at;
        at = at.plus(length);
        (Span::new(start, at), graph)
    });
    let windows: Vec<(Span, Graph)> = windows.collect();
    let one = Period::from_nanos(1).unwrap();
    let window = |(index, (span, _)): (usize, &(Span, Graph))| Window {
        index,
        span: *span,
        partial: false,
        messages: 7,
        changes: Vec::new(),
        events: Vec::new(),
    };
    let list = windows.iter().enumerate().map(window).collect();
    Mission {
        bags: Vec::new(),
        span: Span::new(Stamp(0), at),
        messages: 7,
        period: one,
        step: one,
        elements: elements(),
        windows: list,
        graphs: windows.into_iter().collect(),
        log: EventLog::default(),
        sending: Sending::default(),
        undrawn: Vec::new(),
        logged: Vec::new(),
        layout: None,
        notices: Notices::new(),
    }
}

fn written(mission: &Mission) -> String {
    let mut text = Vec::new();
    write_json(mission, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

fn read(text: &str) -> Mission {
    read_json(text, std::path::Path::new("x.json")).unwrap()
}

proptest! {
    #[test]
    fn a_mission_round_trips(list in proptest::collection::vec((graph(), 1..5_000_000_000_i64), 1..12)) {
        let mission = mission(list);
        let first = read(&written(&mission));
        prop_assert_eq!(&first.graphs, &mission.graphs);
        prop_assert_eq!(&first.elements, &mission.elements);
        let second = read(&written(&first));
        prop_assert_eq!(&first, &second);
        prop_assert_eq!(written(&first), written(&second));
    }
}

#[test]
fn the_first_lifecycle_state_of_a_node_in_windows_is_no_change() {
    let text = r#"{"schema": "bagreel.mission/3", "windows": [{"start_ns": 0, "end_ns": 5}, {"start_ns": 5, "end_ns": 9},
        {"start_ns": 9, "end_ns": 12}, {"start_ns": 12, "end_ns": 20}, {"start_ns": 20, "end_ns": 29}], "elements": [
        {"what": "node", "name": "/a", "in": {"windows": [[0, 1], [3, 4]], "state": [["active", 4]],
        "lifecycle": ["inactive", "active", "inactive", "inactive"]}}]}"#;
    let mut mission = read(text);
    mission.find_changes(0.25);
    let changes = mission.log.events.iter();
    let changes = changes.filter(|event| event.kind == Kind::Lifecycle);
    let changes: Vec<_> = changes.map(|event| (event.time.0, &event.detail)).collect();
    let (from, to) = ("inactive".into(), "active".into());
    assert_eq!(changes, [(5, &Detail::Values { from, to })]);
}

#[test]
fn invalid_columns_are_ignored() {
    let text = r#"{"schema": "bagreel.mission/3", "windows": [{"start_ns": 0, "end_ns": 5},
        {"start_ns": 5, "end_ns": 9}], "elements": [{"what": "topic", "name": "/t", "in": {"windows": [[1, 99999999999], [0, 0]],
        "state": [["silent", 4000000000]], "count": [[3, 4000000000]], "hz": [4000000000]}}]}"#;
    let mission = read(text);
    let counts: Vec<Vec<u64>> = mission
        .graphs
        .iter()
        .map(|g| g.topics().map(|(_, t)| t.messages()).collect())
        .collect();
    assert_eq!(counts, [vec![], vec![3]]);
}
