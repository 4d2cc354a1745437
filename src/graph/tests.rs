//! Tests of graphs from hand-made streams.

mod tests_merged;

use super::*;
use crate::bag::{Connection, ConnectionId, Encoding, Sink as _};
use crate::base::time::{Span, Stamp};
use crate::evidence::Confidence;
use crate::evidence::collector::Collector;
use crate::evidence::conclude::ConcludeOptions;
use crate::evidence::given::NamedElement::{Node, Subscribe};

const SECOND: i64 = 1_000_000_000;

/// One connection: topic, publisher, latching, and its messages' times in seconds.
type Talk<'a> = (&'a str, Option<&'a str>, bool, &'a [i64]);

fn connection(id: u32, topic: &str, publisher: Option<&str>, latching: bool) -> Connection {
    Connection {
        id: ConnectionId(id),
        topic: topic.into(),
        type_name: "std_msgs/String".into(),
        definition: None,
        is_idl: false,
        type_hash: None,
        publisher: publisher.map(Into::into),
        latching,
        qos: None,
        encoding: Encoding::Ros1,
    }
}

fn graphs(talks: &[Talk<'_>], period: i64) -> Built {
    built(talks, period, &ConcludeOptions::default())
}

fn built(talks: &[Talk<'_>], period: i64, options: &ConcludeOptions) -> Built {
    let mut collector = Collector::new(crate::evidence::collector::CollectOptions::default());
    let mut progress = |_, _| ();
    let mut bag = collector.bag(&mut progress);
    for (id, (topic, publisher, latching, times)) in (0..).zip(talks) {
        bag.connection(&connection(id, topic, *publisher, *latching));
        let stamps: Vec<_> = times.iter().map(|t| Stamp(t * SECOND)).collect();
        bag.stamps(ConnectionId(id), &stamps, None);
    }
    let recorded = collector.finish().unwrap();
    let span = recorded.span.unwrap();
    let windows: Vec<_> = (0..1000)
        .map(|n| {
            Span::new(
                span.start.plus(n * period * SECOND),
                span.start.plus((n + 1) * period * SECOND),
            )
        })
        .take_while(|w| w.start < span.end)
        .collect();
    build(&recorded, &windows, options).unwrap()
}

/// The state of one node in each window, `-` where it does not exist.
fn states(built: &Built, node: &str) -> Vec<&'static str> {
    let id = built.elements.node(node).unwrap();
    let state = |g: &Graph| g.get(Element::Node(id)).map_or("-", |n| n.state.word());
    built.graphs.iter().map(state).collect()
}

#[test]
fn a_node_lives_until_its_rhythm_breaks() {
    let built = graphs(
        &[
            ("/a", Some("/x"), false, &[12, 14, 16, 18, 20, 22]),
            ("/b", Some("/y"), false, &[0, 49]),
        ],
        10,
    );
    assert_eq!(states(&built, "/x"), ["-", "active", "active", "-", "-"]);
    assert_eq!(built.messages, [1, 4, 2, 0, 1]);
    let life = built.lives.of(Element::Node(NodeId(1))).unwrap()[0];
    let ended = life.ended.unwrap();
    assert_eq!((ended.time.0, ended.latest.0), (22 * SECOND, 24 * SECOND));
    assert_eq!(life.began.unwrap().time.0, 12 * SECOND);
}

#[test]
fn missing_evidence_is_not_absence() {
    let built = graphs(
        &[
            ("/a", Some("/x"), false, &[12, 35]),
            ("/b", Some("/y"), false, &[0, 99]),
        ],
        10,
    );
    assert_eq!(states(&built, "/x")[1..], ["active"; 9]);
    assert_eq!(states(&built, "/y"), ["active"; 10]);
    assert!(
        built.lives.of(Element::Node(NodeId(1))).unwrap()[0]
            .ended
            .is_none()
    );
}

#[test]
fn a_node_starts_only_where_something_shows_that_it_was_absent() {
    let steady: Vec<i64> = (30..100).collect();
    let talks: &[Talk<'_>] = &[
        ("/keys", Some("/teleop"), false, &[31, 32, 39, 41, 66]),
        ("/scan", Some("/lidar"), false, &steady),
        ("/map", Some("/server"), true, &[32]),
        ("/b", Some("/y"), false, &[0, 99]),
    ];
    let all = graphs(talks, 10);
    let first = |node| states(&all, node).iter().position(|s| *s != "-");
    assert_eq!(
        ["/teleop", "/lidar", "/server"].map(first),
        [Some(0), Some(3), Some(3)]
    );
    // Its edge was advertised with it, so it is as old.
    let edge = all
        .elements
        .publishes
        .iter()
        .position(|e| all.elements.topics[e.topic].name.as_str() == "/keys");
    let edge = Id::of(edge.unwrap());
    let life = all.lives.of(Element::Publish(edge)).unwrap()[0];
    assert_eq!((life.span.start, life.began), (Stamp(0), None));
    // Before its first message it is only inferred.
    let confidences = all.graphs.iter().take(5).map(|graph| {
        let state = graph.get(Element::Publish(edge));
        state.map(|state| state.confidence)
    });
    let [before, after] = [Some(Confidence::Inferred), Some(Confidence::Measured)];
    assert_eq!(
        confidences.collect::<Vec<_>>(),
        [before, before, before, after, after]
    );
}

#[test]
fn the_first_record_of_a_process_shows_that_it_starts() {
    let all: Vec<i64> = (0..99).collect();
    let talks: &[Talk<'_>] = &[("/base", Some("/host"), false, &all)];
    let logs = |many| -> Vec<Log<'static>> {
        (0..many)
            .map(|n| (40 + n, "/late", "hello", &[][..]))
            .collect()
    };
    let built = logged(talks, &logs(1), "late.py");
    assert_eq!(there(&built, "/late")[0], 4);
    // Where all records have the same number, it shows nothing.
    let built = logged(talks, &logs(5), "late.py");
    assert_eq!(there(&built, "/late")[0], 0);
}

#[test]
fn one_stream_that_ends_just_before_the_end_does_not_end_its_node() {
    let until = |end: i64| (0..end).map(|n| n / 2).collect::<Vec<i64>>();
    let (all, short) = (until(200), until(192));
    let talks: &[Talk<'_>] = &[
        ("/a", Some("/one"), false, &short),
        ("/b", Some("/two"), false, &short),
        ("/c", Some("/two"), false, &short),
        ("/d", Some("/y"), false, &all),
    ];
    let built = graphs(talks, 10);
    let ended = |node: &str| {
        let id = built
            .elements
            .nodes
            .iter()
            .position(|n| n.name.as_str() == node);
        let id = Id::of(id.unwrap());
        built.lives.of(Element::Node(id)).unwrap()[0]
            .ended
            .is_some()
    };
    assert_eq!(["/one", "/two", "/y"].map(ended), [false, true, false]);
}

#[test]
fn a_topic_with_an_uneven_rhythm_does_not_vanish() {
    let all: Vec<i64> = (0..100).collect();
    let keys = [1, 2, 3, 6, 7, 11, 12, 17, 18, 19];
    let talks: &[Talk<'_>] = &[
        ("/keys", None, false, &keys),
        ("/b", Some("/y"), false, &all),
    ];
    let built = graphs(talks, 10);
    let id = built
        .elements
        .topics
        .iter()
        .position(|t| t.name.as_str() == "/keys");
    let lives = built.lives.of(Element::Topic(Id::of(id.unwrap())));
    assert_eq!(lives.unwrap()[0].ended, None);
}

#[test]
fn a_latched_message_keeps_its_node_alive() {
    let built = graphs(
        &[
            ("/map", Some("/x"), true, &[5]),
            ("/b", Some("/y"), false, &[0, 29]),
        ],
        10,
    );
    assert_eq!(states(&built, "/x"), ["latched", "latched", "latched"]);
}

#[test]
fn a_topic_without_a_publisher_still_counts() {
    let built = graphs(&[("/a", None, false, &[0, 1, 2, 3])], 10);
    assert!(built.elements.nodes.is_empty());
    let (_, topic) = built.graphs[0].topics().next().unwrap();
    assert_eq!((topic.count, topic.median_period_s), (Some(4), Some(1.0)));
}

#[test]
fn elements_are_in_the_order_of_their_names() {
    let built = graphs(
        &[
            ("/z", Some("/b"), false, &[1]),
            ("/a", Some("/c"), false, &[0]),
            ("/m", Some("/a"), false, &[2]),
        ],
        10,
    );
    let all = &built.elements;
    assert!(all.nodes.is_sorted_by_key(|n| n.name.clone()));
    assert!(all.topics.is_sorted_by_key(|t| t.name.clone()));
    let edges: Vec<_> = all.publishes.iter().map(|e| (e.node, e.topic)).collect();
    assert!(edges.is_sorted());
    assert_eq!(all.nodes[NodeId(0)].name.as_str(), "/a");
    assert_eq!(built.graphs[0].states[0].hz, None);
}

#[test]
fn a_node_whose_rhythm_breaks_off_is_not_held_by_its_latched_message() {
    let all = graphs(
        &[
            ("/map", Some("/x"), true, &[0]),
            ("/pose", Some("/x"), false, &[0, 2, 4, 6, 8, 10, 12]),
            ("/b", Some("/y"), false, &[0, 49]),
        ],
        10,
    );
    assert_eq!(states(&all, "/x"), ["active", "active", "-", "-", "-"]);
}

#[test]
fn a_latched_message_sent_again_after_a_silence_is_a_restart() {
    let all = graphs(
        &[
            ("/map", Some("/x"), true, &[0, 31]),
            ("/pose", Some("/x"), false, &[0, 1, 2, 3, 4, 5, 32, 33, 34]),
            ("/b", Some("/y"), false, &[0, 39]),
        ],
        10,
    );
    assert_eq!(states(&all, "/x"), ["active", "-", "-", "active"]);
    let again = all.lives.iter().flat_map(|(what, lives)| {
        let again = lives.iter().skip(1);
        again.map(move |life| (what, life.span.start.0 / SECOND))
    });
    let again = again.filter(|(what, _)| what.is_node());
    let times: Vec<i64> = again.map(|(_, second)| second).collect();
    assert_eq!(times, [31]);
}

#[test]
fn user_topology_is_added_without_overwriting() {
    let entry = |element, from_ns, to_ns| crate::evidence::given::TopologyEntry {
        element,
        from_ns,
        to_ns,
        declared: false,
        place: String::new(),
    };
    let options = ConcludeOptions {
        topology: crate::evidence::given::Topology {
            entries: vec![
                entry(Node("/x".to_owned()), None, None),
                entry(
                    Subscribe("/z".to_owned(), "/a".to_owned()),
                    Some(10 * SECOND),
                    Some(15 * SECOND),
                ),
            ],
            notices: Vec::new(),
            files: Vec::new(),
        },
        ..ConcludeOptions::default()
    };
    let talks: [Talk<'_>; 2] = [
        ("/a", Some("/x"), false, &[0, 1, 2, 3, 4, 5]),
        ("/b", Some("/y"), false, &[0, 29]),
    ];
    let all = built(&talks, 10, &options);
    assert_eq!(states(&all, "/x"), ["active", "-", "-"]);
    assert_eq!(states(&all, "/z"), ["-", "active", "-"]);
    let words: Vec<_> = all.elements.subscribes[EdgeId(0)]
        .seen
        .evidence
        .words()
        .collect();
    assert_eq!(words, ["topology"]);
}

#[test]
fn windows_may_overlap() {
    let mut collector = Collector::new(crate::evidence::collector::CollectOptions::default());
    let mut progress = |_, _| ();
    let mut bag = collector.bag(&mut progress);
    bag.connection(&connection(0, "/a", Some("/x"), false));
    let stamps: Vec<_> = (0..40).map(|n| Stamp(n * SECOND)).collect();
    bag.stamps(ConnectionId(0), &stamps, None);
    let recorded = collector.finish().unwrap();
    let windows: Vec<_> = (0..4)
        .map(|n| {
            Span::new(
                Stamp(n * 10 * SECOND),
                Stamp((n * 10 + 20).min(40) * SECOND),
            )
        })
        .collect();
    let all = build(&recorded, &windows, &ConcludeOptions::default()).unwrap();
    assert_eq!(all.messages, [20, 20, 20, 10]);
}

/// A log record of rospy: its time in seconds, its node, its text, and the topics that it lists.
type Log<'a> = (i64, &'a str, &'a str, &'a [&'a str]);

/// A record of `rosgraph_msgs/Log`.
fn log_record((_, node, text, topics): &Log<'_>, file: &str) -> Vec<u8> {
    let mut bytes = vec![0; 12];
    let put = |bytes: &mut Vec<u8>, text: &str| {
        bytes.extend(u32::try_from(text.len()).unwrap().to_le_bytes());
        bytes.extend(text.as_bytes());
    };
    put(&mut bytes, "");
    bytes.push(2);
    for text in [node, text, file, "f"] {
        put(&mut bytes, text);
    }
    bytes.extend([0; 4]);
    bytes.extend(u32::try_from(topics.len()).unwrap().to_le_bytes());
    for topic in *topics {
        put(&mut bytes, topic);
    }
    bytes
}

/// Graphs of windows of 10 s, of a bag with one log connection, which names `/host` as its publisher.
fn logged(talks: &[Talk<'_>], logs: &[Log<'_>], file: &str) -> Built {
    let mut collector = Collector::new(crate::evidence::collector::CollectOptions::default());
    let mut progress = |_, _| ();
    let mut bag = collector.bag(&mut progress);
    bag.connection(&Connection {
        type_name: "rosgraph_msgs/Log".into(),
        ..connection(0, "/rosout", Some("/host"), false)
    });
    for (id, (topic, publisher, latching, times)) in (1..).zip(talks) {
        bag.connection(&connection(id, topic, *publisher, *latching));
        let stamps: Vec<_> = times.iter().map(|t| Stamp(t * SECOND)).collect();
        bag.stamps(ConnectionId(id), &stamps, None);
    }
    for log in logs {
        let data = log_record(log, file);
        bag.message(crate::bag::Message {
            connection: ConnectionId(0),
            time: Stamp(log.0 * SECOND),
            data: &data,
            size: 0,
        });
    }
    let recorded = collector.finish().unwrap();
    let windows: Vec<_> = (0..10)
        .map(|n| Span::new(Stamp(n * 10 * SECOND), Stamp((n + 1) * 10 * SECOND)))
        .collect();
    build(&recorded, &windows, &ConcludeOptions::default()).unwrap()
}

/// The windows in which a node exists.
fn there(built: &Built, node: &str) -> Vec<usize> {
    let states = states(built, node).into_iter().enumerate();
    states
        .filter(|(_, s)| *s != "-")
        .map(|(at, _)| at)
        .collect()
}
