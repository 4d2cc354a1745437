//! Compares the graph reconstructed from bags with the ground truth, if known.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use bagreel::bag::{
    self, Connection, ConnectionId, Encoding, Input, Message, OpenOptions, Sink, Want,
};
use bagreel::internals::base::notice::Notice;
use bagreel::internals::base::time::{Span, Stamp};
use bagreel::internals::evidence::collector::{CollectOptions, Collector};
use bagreel::internals::evidence::{Confidence, conclude};
use bagreel::internals::graph::{self, Built};

use crate::support::cdr::Cdr;

const SECOND: i64 = 1_000_000_000;

/// A file of the project or of the shared data; otherwise prints why the test is skipped.
fn shared(file: &str) -> Option<PathBuf> {
    let below = match file {
        "warehouse/warehouse.bag" => "examples/warehouse.bag",
        "warehouse/truth_windows.json" => "tests/data/warehouse.truth.json",
        _ => &format!("../shared/data/{file}"),
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(below);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {file} is not there");
    None
}

fn windows(span: Span, period: i64) -> Vec<Span> {
    let starts = (0..10_000).map(|n| span.start.plus(n * period));
    let starts = starts.take_while(|start| *start < span.end);
    starts
        .map(|start| Span {
            start,
            end: start.plus(period).min(span.end),
        })
        .collect()
}

/// The graphs of a bag in windows of ten seconds.
fn graphs(path: &Path) -> (Built, Vec<Span>) {
    let mut collector = Collector::new(CollectOptions::default());
    let mut progress = |_, _| ();
    let mut reader = bag::open(&Input::Path(path.to_owned()), &OpenOptions::default()).unwrap();
    reader
        .read(None, &mut collector.bag(&mut progress))
        .unwrap();
    built(collector)
}

fn built(collector: Collector) -> (Built, Vec<Span>) {
    let recorded = collector.finish().unwrap();
    let windows = windows(recorded.span.unwrap(), 10 * SECOND);
    let options = conclude::ConcludeOptions::default();
    (
        graph::build(&recorded, &windows, &options).unwrap(),
        windows,
    )
}

/// Names of nodes, or of both ends of edges, in one window.
type Names = BTreeSet<Vec<String>>;

/// Nodes, publications and subscriptions of one window, in the ground truth's notation.
fn names(built: &Built, window: usize) -> [Names; 3] {
    let (all, graph) = (&built.elements, &built.graphs[window]);
    let node = |id| all.nodes[id].name.as_str().to_owned();
    let topic = |id| all.topics[id].name.as_str().to_owned();
    let publishes = graph.publishes().map(|(id, _)| &all.publishes[id]);
    let subscribes = graph.subscribes().map(|(id, _)| &all.subscribes[id]);
    [
        graph.nodes().map(|(id, _)| vec![node(id)]).collect(),
        publishes
            .map(|e| vec![node(e.node), topic(e.topic)])
            .collect(),
        subscribes
            .map(|e| vec![topic(e.topic), node(e.node)])
            .collect(),
    ]
}

/// Right and wrong states of each confidence, over all kinds and all windows of ten seconds.
fn by_degree(bag: &str, truth: &str) -> Option<[[u32; 2]; 4]> {
    let (bag, truth) = (shared(bag)?, shared(truth)?);
    Some(confidences(&graphs(&bag), &truth))
}

fn confidences((built, windows): &(Built, Vec<Span>), truth: &Path) -> [[u32; 2]; 4] {
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(truth).unwrap()).unwrap();
    let all = &built.elements;
    let node = |id| all.nodes[id].name.as_str();
    let topic = |id| all.topics[id].name.as_str();
    let mut counts = [[0; 2]; 4];
    for real in truth["periods"]["10"].as_array().unwrap() {
        let start = Stamp(real["start_ns"].as_i64().unwrap());
        let near = |w: &Span| w.start.since(start).abs() <= 5 * SECOND;
        let Some(window) = windows.iter().position(near) else {
            continue;
        };
        let graph = &built.graphs[window];
        let nodes = graph
            .nodes()
            .map(|(id, s)| (s.confidence, "nodes", node(id), serde_json::json!(node(id))));
        let publishes = graph.publishes().map(|(id, s)| {
            let edge = &all.publishes[id];
            let names = serde_json::json!([node(edge.node), topic(edge.topic)]);
            (s.confidence, "publishes", node(edge.node), names)
        });
        let subscribes = graph.subscribes().map(|(id, s)| {
            let edge = &all.subscribes[id];
            let names = serde_json::json!([topic(edge.topic), node(edge.node)]);
            (s.confidence, "subscribes", node(edge.node), names)
        });
        for (confidence, kind, node, names) in nodes.chain(publishes).chain(subscribes) {
            if !node.starts_with("/record_") {
                let is_right = real[kind].as_array().unwrap().contains(&names);
                counts[confidence as usize][usize::from(!is_right)] += 1;
            }
        }
    }
    counts
}

/// Asserts that each confidence has its stated precision.
fn assert_promise(counts: &[[u32; 2]; 4], of: &str) {
    for (confidence, least) in [(0, 0.98), (1, 0.98), (2, 0.95), (3, 0.95)] {
        let [right, wrong] = counts[confidence].map(f64::from);
        assert!(
            right >= least * (right + wrong),
            "{of}, {confidence}: {counts:?}"
        );
    }
    assert!(
        counts[..3].iter().all(|[right, _]| *right > 80),
        "{of}: {counts:?}"
    );
}

#[test]
fn every_confidence_has_its_stated_precision() {
    let (warehouse, mini) = ("warehouse/truth_windows.json", "mini/truth_windows.json");
    let recordings = [
        ("warehouse/warehouse.bag", warehouse),
        ("warehouse/warehouse_norosout.bag", warehouse),
        ("warehouse/warehouse_lz4.bag", warehouse),
        ("mini/mini_lz4.bag", mini),
        ("mini/mini_bz2.bag", mini),
    ];
    let mut counts = [[0; 2]; 4];
    for (bag, truth) in recordings {
        let Some(more) = by_degree(bag, truth) else {
            return;
        };
        // The windows of `mini_bz2.bag` begin a quarter of a second after the truth's.
        if !bag.ends_with("norosout.bag") && !bag.ends_with("mini_bz2.bag") {
            assert_promise(&more, bag);
        }
        for (sum, more) in counts.iter_mut().flatten().zip(more.iter().flatten()) {
            *sum += more;
        }
    }
    assert_promise(&counts, "all");
}

/// One connection per topic, with the header of the first, as in bags rewritten by tools.
fn merged(tape: &mut Tape) {
    let mut first: BTreeMap<String, ConnectionId> = BTreeMap::new();
    let mut order: Vec<_> = tape
        .stamps
        .iter()
        .map(|(id, time, _)| (*time, *id))
        .collect();
    order.sort_unstable();
    for (_, id) in order {
        let topic = tape.connections[id.0 as usize].topic.as_str().to_owned();
        first.entry(topic).or_insert(id);
    }
    let connections = tape.connections.clone();
    let to = |id: &ConnectionId| first[connections[id.0 as usize].topic.as_str()];
    for (id, ..) in &mut tape.stamps {
        *id = to(id);
    }
    for (id, ..) in &mut tape.messages {
        *id = to(id);
    }
}

#[test]
fn a_node_ends_although_its_topic_continues() {
    let (Some(bag), Some(truth)) = (
        shared("warehouse/warehouse.bag"),
        shared("warehouse/truth_windows.json"),
    ) else {
        return;
    };
    let mut tape = taped(&bag);
    merged(&mut tape);
    let used: BTreeSet<ConnectionId> = tape.stamps.iter().map(|(id, ..)| *id).collect();
    let found = replayed(&tape, |connection| used.contains(&connection.id));
    assert_promise(&confidences(&found, &truth), "merged");
    let (built, _) = &found;
    // It was stopped after three minutes; half a minute later another node took over its status topic.
    let windows: Vec<usize> = (0..33)
        .filter(|w| names(built, *w)[0].contains(&vec!["/mission_executor".to_owned()]))
        .collect();
    assert_eq!(windows, (4..18).collect::<Vec<_>>());
    let status = |w: &usize| {
        let edge = vec!["/mission_executor".to_owned(), "/fleet/status".to_owned()];
        names(built, *w)[1].contains(&edge)
    };
    assert_eq!((0..33).filter(status).collect::<Vec<_>>(), windows);
}

/// Precision and F1 of nodes, publications and subscriptions over all windows of ten seconds.
fn scores(bag: &str, truth: &str) -> Option<[(f64, f64); 3]> {
    let (bag, truth) = (shared(bag)?, shared(truth)?);
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(truth).unwrap()).unwrap();
    let (built, windows) = graphs(&bag);
    let is_tool = |names: &Vec<String>| names.iter().any(|name| name.starts_with("/record_"));
    let mut counts = [(0_u32, 0_u32, 0_u32); 3];
    for real in truth["periods"]["10"].as_array().unwrap() {
        let start = real["start_ns"].as_i64().unwrap();
        let near = |w: &Span| w.start.since(Stamp(start)).abs() <= 5 * SECOND;
        let found = windows
            .iter()
            .position(near)
            .map(|w| names(&built, w))
            .unwrap_or_default();
        for ((found, kind), count) in found
            .iter()
            .zip(["nodes", "publishes", "subscribes"])
            .zip(&mut counts)
        {
            let name = |value: &serde_json::Value| match value.as_array() {
                Some(list) => list
                    .iter()
                    .map(|v| v.as_str().unwrap().to_owned())
                    .collect(),
                None => vec![value.as_str().unwrap().to_owned()],
            };
            let real: Names = real[kind].as_array().unwrap().iter().map(name).collect();
            let sift = |names: &Names| {
                names
                    .iter()
                    .filter(|n| !is_tool(n))
                    .cloned()
                    .collect::<Names>()
            };
            let (found, real) = (sift(found), sift(&real));
            count.0 += u32::try_from(found.intersection(&real).count()).unwrap();
            count.1 += u32::try_from(found.difference(&real).count()).unwrap();
            count.2 += u32::try_from(real.difference(&found).count()).unwrap();
        }
    }
    Some(counts.map(|(hits, wrong, missed)| {
        let [hits, wrong, missed] = [hits, wrong, missed].map(f64::from);
        (
            hits / (hits + wrong),
            2.0 * hits / (2.0 * hits + wrong + missed),
        )
    }))
}

#[test]
fn a_real_mission_is_reconstructed() {
    let score = scores("warehouse/warehouse.bag", "warehouse/truth_windows.json");
    let Some([nodes, publishes, subscribes]) = score else {
        return;
    };
    assert!(
        nodes.0 >= 0.98 && publishes.0 >= 0.98 && subscribes.0 >= 0.99,
        "{score:?}"
    );
    assert!(
        nodes.1 >= 0.97 && publishes.1 >= 0.99 && subscribes.1 >= 0.90,
        "{score:?}"
    );
}

#[test]
fn compressed_recordings_have_the_same_evidence() {
    for bag in ["mini/mini_lz4.bag", "mini/mini_bz2.bag"] {
        let score = scores(bag, "mini/truth_windows.json");
        let Some([nodes, publishes, subscribes]) = score else {
            return;
        };
        // Errors in one of the two come from its windows, which begin a quarter of a second after the truth's: two nodes start in
        // that time.
        assert!(
            nodes.0 >= 0.97 && nodes.1 >= 0.979 && publishes.0 >= 0.95 && publishes.1 >= 0.97,
            "{bag}: {score:?}"
        );
        assert!(
            subscribes.0 >= 0.94 && subscribes.1 >= 0.85,
            "{bag}: {score:?}"
        );
    }
}

#[test]
fn a_recording_without_log_records_still_has_evidence() {
    let score = scores(
        "warehouse/warehouse_norosout.bag",
        "warehouse/truth_windows.json",
    );
    let Some([nodes, publishes, subscribes]) = score else {
        return;
    };
    assert!(nodes.1 > 0.61 && publishes.1 > 0.51, "{score:?}");
    assert!(
        nodes.0 >= 0.98 && publishes.0 >= 0.98 && subscribes.0 >= 0.98,
        "{score:?}"
    );
}

#[test]
fn headers_of_a_rewritten_bag_are_not_trusted() {
    for bag in ["warehouse/warehouse_lz4.bag", "warehouse/warehouse_bz2.bag"] {
        let score = scores(bag, "warehouse/truth_windows.json");
        let Some([nodes, publishes, subscribes]) = score else {
            return;
        };
        assert!(
            nodes.0 >= 0.97 && publishes.0 >= 0.97 && subscribes.0 >= 0.95,
            "{bag}: {score:?}"
        );
        assert!(
            nodes.1 >= 0.91 && publishes.1 >= 0.92 && subscribes.1 >= 0.87,
            "{bag}: {score:?}"
        );
    }
}

/// The windows in which a node is running.
fn life(built: &Built, node: &str) -> Vec<usize> {
    let there = |window: &usize| {
        names(built, *window)[0]
            .iter()
            .any(|n| n[0].starts_with(node))
    };
    (0..built.graphs.len()).filter(there).collect()
}

#[test]
fn starts_stops_crashes_and_restarts_are_detected_exactly() {
    let Some(path) = shared("bags/mission/mission.bag") else {
        return;
    };
    let (built, _) = graphs(&path);
    // From `timeline.json`, whose clock began 3 s before the bag.
    let expected = [
        ("/lidar", (0..33).collect()),
        ("/map_server", (0..33).collect()),
        ("/camera_driver", (0..12).collect()),
        ("/localizer", (0..27).chain(28..33).collect()),
        ("/planner", (5..18).chain(20..33).collect()),
        ("/controller_v2", (23..33).collect()),
        ("/camera_backup", (14..32).collect()),
        ("/probe_9665", (16..19).collect()),
        ("/probe_11696", (21..25).collect()),
        ("/joystick", (24..33).collect::<Vec<usize>>()),
    ];
    for (node, windows) in expected {
        assert_eq!(life(&built, node), windows, "{node}");
    }
    let name = |id| built.elements.nodes[id].name.as_str();
    let again = built.lives.iter().flat_map(|(what, lives)| {
        let again = lives.iter().skip(1);
        again.map(move |life| (life.span.start, what))
    });
    let mut restarts: Vec<_> = again
        .filter_map(|(time, what)| match what {
            graph::Element::Node(id) => Some((time, name(id))),
            _ => None,
        })
        .collect();
    restarts.sort_unstable();
    let restarts: Vec<&str> = restarts.into_iter().map(|(_, name)| name).collect();
    assert_eq!(restarts, ["/planner", "/localizer"]);
}

/// Records a reader's calls, so that they can be replayed in another order.
#[derive(Default)]
struct Tape {
    connections: Vec<Connection>,
    wants: Collector,
    stamps: Vec<(ConnectionId, Stamp, Option<u32>)>,
    messages: Vec<(ConnectionId, Stamp, Vec<u8>)>,
}

impl Sink for Tape {
    fn connection(&mut self, connection: &Connection) -> Want {
        self.connections.push(connection.clone());
        self.wants.bag(&mut |_, _| ()).connection(connection)
    }

    fn stamps(&mut self, id: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let size = |at: usize| sizes.map(|s| s[at]);
        self.stamps
            .extend(stamps.iter().enumerate().map(|(at, t)| (id, *t, size(at))));
    }

    fn message(&mut self, message: Message<'_>) {
        self.messages
            .push((message.connection, message.time, message.data.to_vec()));
    }

    fn notice(&mut self, _: Notice) {}
}

/// A deterministic shuffle.
fn shuffle<T>(list: &mut [T]) {
    let mut seed = 1_u64;
    for at in (1..list.len()).rev() {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let other = usize::try_from(seed >> 33).unwrap() % (at + 1);
        list.swap(at, other);
    }
}

#[test]
fn the_order_of_messages_in_the_file_does_not_matter() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
    let (expected, _) = graphs(&path);
    let mut tape = taped(&path);
    shuffle(&mut tape.stamps);
    shuffle(&mut tape.messages);
    let (shuffled, _) = replayed(&tape, |_| true);
    assert_eq!(shuffled.elements, expected.elements);
    assert!(shuffled.graphs == expected.graphs, "some graph differs");
    assert_eq!(shuffled.lives, expected.lives);
    assert_eq!(shuffled.sending, expected.sending);
}

fn taped(path: &Path) -> Tape {
    let mut tape = Tape::default();
    let input = Input::Path(path.to_owned());
    let mut reader = bag::open(&input, &OpenOptions::default()).unwrap();
    reader.read(None, &mut tape).unwrap();
    tape
}

/// The graphs of the recorded calls, for the wanted connections.
fn replayed(tape: &Tape, wanted: impl Fn(&Connection) -> bool) -> (Built, Vec<Span>) {
    let mut collector = Collector::new(CollectOptions::default());
    let mut progress = |_, _| ();
    let mut sink = collector.bag(&mut progress);
    let mut ids = BTreeMap::new();
    for connection in tape.connections.iter().filter(|c| wanted(c)) {
        ids.insert(
            connection.id,
            ConnectionId(u32::try_from(ids.len()).unwrap()),
        );
        sink.connection(connection);
    }
    for (connection, time, data) in &tape.messages {
        let size = u32::try_from(data.len()).unwrap();
        sink.message(Message {
            connection: ids[connection],
            time: *time,
            data,
            size,
        });
    }
    for (id, time, size) in &tape.stamps {
        sink.stamps(ids[id], &[*time], size.as_ref().map(std::slice::from_ref));
    }
    built(collector)
}

impl Tape {
    /// Keeps the messages that `keep` accepts, by connection, time and payload.
    fn retain(&mut self, keep: impl Fn(&Connection, Stamp, &[u8]) -> bool) {
        let connections = &self.connections;
        let of = |id: &ConnectionId| &connections[id.0 as usize];
        let mut dropped = BTreeSet::new();
        self.messages.retain(|(id, time, data)| {
            let kept = keep(of(id), *time, data);
            if !kept {
                dropped.insert((*id, *time));
            }
            kept
        });
        self.stamps
            .retain(|(id, time, _)| !dropped.contains(&(*id, *time)) && keep(of(id), *time, &[]));
        let used: BTreeSet<ConnectionId> = self.stamps.iter().map(|(id, ..)| *id).collect();
        self.connections
            .iter_mut()
            .filter(|connection| !used.contains(&connection.id))
            .for_each(|connection| connection.topic = "".into());
    }

    /// Leaves out topics as `rosbag record -a -x` does: its log does not name them either.
    fn exclude(&mut self, is_out: impl Fn(&str) -> bool) {
        self.retain(|connection, _, data| {
            let logged = data.windows(TAKES.len()).position(|part| part == TAKES);
            let named = logged.map(|at| {
                let rest = &data[at + TAKES.len()..];
                let length = data[at - 4..at].try_into().map(u32::from_le_bytes).unwrap() as usize;
                String::from_utf8_lossy(&rest[..length - TAKES.len()]).into_owned()
            });
            !is_out(connection.topic.as_str()) && !named.is_some_and(|topic| is_out(topic.trim()))
        });
    }
}

/// What the recorder logs of each topic.
const TAKES: &[u8] = b"Subscribing to ";

/// How a recording is changed, in words and as a function, and the fewest subscriptions that are still found.
type Changed<'a> = (&'static str, &'a dyn Fn(&mut Tape), usize);

/// Every subscription in a window, with whether it is stated; except those of recorders and players.
fn subscriptions(built: &Built) -> BTreeMap<Vec<String>, bool> {
    let all = &built.elements;
    let mut found: BTreeMap<Vec<String>, bool> = BTreeMap::new();
    for (id, state) in built.graphs.iter().flat_map(bagreel::Graph::subscribes) {
        let edge = &all.subscribes[id];
        let [node, topic] = [
            all.nodes[edge.node].name.as_str(),
            all.topics[edge.topic].name.as_str(),
        ];
        if !node.starts_with("/record_") && !node.starts_with("/play_") {
            let is_stated = state.confidence == Confidence::Stated;
            *found
                .entry(vec![topic.to_owned(), node.to_owned()])
                .or_default() |= is_stated;
        }
    }
    found
}

#[test]
fn lists_of_topics_are_read_with_care_unless_everything_was_recorded() {
    let (Some(bag), Some(truth)) = (
        shared("warehouse/warehouse.bag"),
        shared("warehouse/truth_windows.json"),
    ) else {
        return;
    };
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(truth).unwrap()).unwrap();
    let windows = truth["periods"]["10"].as_array().unwrap().iter();
    let real = windows.flat_map(|window| window["subscribes"].as_array().unwrap());
    let real: BTreeSet<Vec<String>> = real
        .map(|edge| serde_json::from_value(edge.clone()).unwrap())
        .collect();
    let start = taped(&bag)
        .stamps
        .iter()
        .map(|(_, time, _)| *time)
        .min()
        .unwrap();
    let after = |tape: &mut Tape, seconds: i64| {
        tape.retain(|_, time, _| time.since(start) >= seconds * SECOND);
    };
    let played = |tape: &mut Tape| {
        for connection in &mut tape.connections {
            connection.publisher = Some("/play_1795170682045".into());
        }
    };
    let cases: [Changed<'_>; 9] = [
        ("whole", &|_| (), 69),
        ("begun after 100 s", &|tape| after(tape, 100), 60),
        ("begun after 200 s", &|tape| after(tape, 200), 35),
        (
            "without transforms",
            &|tape| tape.exclude(|topic| topic.starts_with("/tf")),
            55,
        ),
        (
            "without parameters",
            &|tape| tape.exclude(|topic| topic.contains("/parameter_")),
            65,
        ),
        (
            "without diagnostics",
            &|tape| tape.exclude(|topic| topic.starts_with("/diagnostics")),
            60,
        ),
        (
            "without commands",
            &|tape| tape.exclude(|topic| topic.ends_with("/cmd_vel")),
            60,
        ),
        (
            "few topics",
            &|tape| tape.exclude(|topic| !["/rosout", "/robot1/odom", "/map"].contains(&topic)),
            3,
        ),
        ("played", &played, 10),
    ];
    for (how, change, fewest) in cases {
        let mut tape = taped(&bag);
        change(&mut tape);
        let (built, _) = replayed(&tape, |c| !c.topic.as_str().is_empty());
        let found = subscriptions(&built);
        let wrong: Vec<_> = found
            .iter()
            .filter(|(edge, _)| !real.contains(*edge))
            .collect();
        let right = found.len() - wrong.len();
        assert!(right >= fewest, "{how}: {right}");
        assert!(wrong.len() * 20 <= found.len(), "{how}: {wrong:?}");
        // What only follows from the absence of a publisher is not stated.
        assert!(
            wrong.iter().all(|(_, is_stated)| !**is_stated),
            "{how}: {wrong:?}"
        );
    }
}

/// The record in a payload of `rosgraph_msgs/Log`, in the encoding of ROS 2: without the number in the header.
fn converted(payload: &[u8]) -> Vec<u8> {
    let mut rest = &payload[12..];
    let number = |rest: &mut &[u8]| {
        let (first, others) = rest.split_at(4);
        *rest = others;
        u32::from_le_bytes(first.try_into().unwrap())
    };
    let text = |rest: &mut &[u8]| {
        let (first, others) = {
            let length = number(rest) as usize;
            rest.split_at(length)
        };
        *rest = others;
        String::from_utf8(first.to_vec()).unwrap()
    };
    let mut cdr = Cdr::default()
        .raw(&payload[4..12])
        .text(&text(&mut rest))
        .u8(rest[0]);
    rest = &rest[1..];
    for _ in 0..4 {
        cdr = cdr.text(&text(&mut rest));
    }
    let (line, topics) = (number(&mut rest), number(&mut rest));
    cdr = cdr.u32(line).u32(topics);
    for _ in 0..topics {
        cdr = cdr.text(&text(&mut rest));
    }
    cdr.done()
}

#[test]
fn a_recording_converted_to_ros2_keeps_the_evidence_of_its_log() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
    let mut tape = taped(&path);
    let log = tape
        .connections
        .iter()
        .filter(|c| c.topic.as_str() == "/rosout");
    let log: BTreeSet<ConnectionId> = log.map(|c| c.id).collect();
    for connection in &mut tape.connections {
        connection.publisher = None;
    }
    // The log of a bag whose headers name nobody.
    tape.retain(|connection, _, _| log.contains(&connection.id));
    let ever = |tape: &Tape| {
        let (built, windows) = replayed(tape, |c| !c.topic.as_str().is_empty());
        let mut all = [Names::new(), Names::new(), Names::new()];
        for window in 0..windows.len() {
            let names = names(&built, window);
            all.iter_mut()
                .zip(names)
                .for_each(|(all, names)| all.extend(names));
        }
        all
    };
    let [nodes, publishes, subscribes] = ever(&tape);
    assert!(
        nodes.len() > 20 && publishes.len() > 25,
        "{nodes:?} {publishes:?}"
    );
    for (_, _, data) in &mut tape.messages {
        *data = converted(data);
    }
    for connection in &mut tape.connections {
        connection.encoding = Encoding::Cdr;
        connection.type_name = connection.type_name.replace("s/", "s/msg/").into();
        connection.definition = None;
        connection.type_hash = None;
    }
    assert_eq!(ever(&tape), [nodes, publishes, subscribes]);
}
