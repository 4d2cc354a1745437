//! Tests of edges that no header names: hand-made missions and the conclusions from each.

use std::collections::BTreeSet;

use bagreel::bag::{Connection, ConnectionId, Encoding, Message, Sink as _};
use bagreel::internals::base::time::{Span, Stamp};
use bagreel::internals::evidence::collector::{CollectOptions, Collector, Recorded};
use bagreel::internals::evidence::conclude;
use bagreel::internals::evidence::topology::{NamedElement, Topology, TopologyEntry};
use bagreel::internals::evidence::{Confidence, EvidenceLine};
use bagreel::internals::graph::{self, Built};
use bagreel::internals::mission::event_log::{LogFormat, LogOptions, log};
use bagreel::values::{EdgeId, TopicId};

use crate::support::cdr::Cdr;
use crate::support::rosbag1::{Pack, write};
use crate::support::{ORIGIN, Recording, windows};

const SECOND: i64 = 1_000_000_000;

/// Everything in a recording.
fn recorded(bag: &Recording, options: CollectOptions) -> Recorded {
    let mut collector = Collector::new(options);
    let mut progress = |_, _| ();
    let mut sink = collector.bag(&mut progress);
    for (id, publisher) in (0..).zip(&bag.publishers) {
        let is_ros2 = publisher.type_name.contains("/msg/");
        let some = |text: &str| (!text.is_empty()).then(|| text.into());
        sink.connection(&Connection {
            id: ConnectionId(id),
            topic: publisher.topic.as_str().into(),
            type_name: publisher.type_name.as_str().into(),
            definition: some(&publisher.definition),
            is_idl: false,
            type_hash: None,
            publisher: (!publisher.node.is_empty()).then(|| publisher.node.as_str().into()),
            latching: publisher.latching,
            qos: some(&publisher.qos),
            encoding: if is_ros2 {
                Encoding::Cdr
            } else {
                Encoding::Ros1
            },
        });
    }
    for (publisher, time, data) in &bag.messages {
        let id = ConnectionId(u32::try_from(*publisher).unwrap());
        sink.stamps(id, &[Stamp(*time)], None);
        sink.message(Message {
            connection: id,
            time: Stamp(*time),
            data,
            size: u32::try_from(data.len()).unwrap(),
        });
    }
    collector.finish().unwrap()
}

/// The conclusions from a recording, with the evidence for `why`.
fn concluded(bag: &Recording, options: CollectOptions) -> (Built, Vec<EvidenceLine>) {
    let recorded = recorded(bag, options);
    let span = recorded.span.unwrap();
    let built = graph::build(&recorded, &[span], &conclude::ConcludeOptions::default()).unwrap();
    let lines = built.lines.clone();
    (built, lines)
}

/// Every edge supported by a kind of evidence: `/node > /topic confidence` or `/topic > /node confidence`.
fn proved(bag: &Recording, by: &str, options: CollectOptions) -> Vec<String> {
    let (built, _) = concluded(bag, options);
    let all = &built.elements;
    let by =
        |evidence: bagreel::internals::evidence::Evidence| evidence.words().any(|word| word == by);
    let node = |id| all.nodes[id].name.as_str();
    let topic = |id| all.topics[id].name.as_str();
    let graph = &built.graphs[0];
    let confidence = |what| graph.get(what).map_or("never", |s| s.confidence.word());
    let publishes = all
        .publishes
        .with_ids()
        .filter(|(_, e)| by(e.seen.evidence));
    let subscribes = all
        .subscribes
        .with_ids()
        .filter(|(_, e)| by(e.seen.evidence));
    let mut lines: Vec<String> = publishes
        .map(|(id, e)| {
            let confidence = confidence(graph::Element::Publish(id));
            format!("{} > {} {confidence}", node(e.node), topic(e.topic))
        })
        .collect();
    lines.extend(subscribes.map(|(id, e)| {
        let confidence = confidence(graph::Element::Subscribe(id));
        format!("{} > {} {confidence}", topic(e.topic), node(e.node))
    }));
    lines
}

fn edges(bag: &Recording, by: &str) -> Vec<String> {
    proved(bag, by, CollectOptions::default())
}

impl Recording {
    fn at(&mut self, publisher: usize, millis: i64, payload: Vec<u8>) {
        self.messages
            .push((publisher, ORIGIN + millis * 1_000_000, payload));
    }

    /// A topic of ROS 2, whose messages name no publisher.
    fn topic2(&mut self, topic: &str, kind: &str) -> usize {
        self.publisher("", topic, kind)
    }
}

pub(crate) fn text1(text: &str) -> Vec<u8> {
    let length = u32::try_from(text.len()).unwrap();
    [&length.to_le_bytes(), text.as_bytes()].concat()
}

/// `rosgraph_msgs/Log`.
pub(crate) fn log1(node: &str, text: &str, file: &str, topics: &[&str]) -> Vec<u8> {
    let header = [vec![0; 12], text1("")].concat();
    let parts = [
        header,
        vec![2],
        text1(node),
        text1(text),
        text1(file),
        text1("f"),
    ];
    let mut payload = parts.concat();
    payload.extend(7_u32.to_le_bytes());
    payload.extend(u32::try_from(topics.len()).unwrap().to_le_bytes());
    for topic in topics {
        payload.extend(text1(topic));
    }
    payload
}

/// `rcl_interfaces/msg/Log`.
fn log2(logger: &str, text: &str, file: &str) -> Vec<u8> {
    let head = Cdr::default().time(SECOND).u8(20);
    let record = head.text(logger).text(text).text(file).text("f");
    record.u32(7).done()
}

/// `rcl_interfaces/msg/ParameterEvent` with new parameters, all of them Boolean.
pub(crate) fn parameters(node: &str, set: &[(&str, bool)]) -> Vec<u8> {
    let mut event = Cdr::default().time(SECOND).text(node);
    event = event.u32(u32::try_from(set.len()).unwrap());
    for (name, value) in set {
        event = event.text(name).u8(1).u8(u8::from(*value)).u64(0).f64(0.0);
        event = event.text("").u32(0).u32(0).u32(0).u32(0).u32(0);
    }
    event.u32(0).u32(0).done()
}

/// A camera at 10 Hz; a throttle that forwards every second image.
fn throttled() -> Recording {
    let mut bag = Recording::default();
    let input = bag.publisher("/camera", "/image", "sensor_msgs/Image");
    let output = bag.publisher("/throttle", "/image_slow", "sensor_msgs/Image");
    let other = bag.publisher("/other", "/image_other", "sensor_msgs/Image");
    for n in 0..60_u32 {
        let at = i64::from(n) * 100;
        bag.at(input, at, n.to_le_bytes().repeat(50));
        if n % 2 == 0 {
            bag.at(output, at + 3, n.to_le_bytes().repeat(50));
        }
        bag.at(other, at + 3, (n + 1000).to_le_bytes().repeat(50));
    }
    bag
}

/// The edges by equal payloads, if requested.
fn copies(bag: &Recording) -> Vec<String> {
    let options = CollectOptions {
        payload_bytes: u64::MAX,
        ..CollectOptions::default()
    };
    proved(bag, "payload", options)
}

#[test]
fn payloads_are_compared_by_default_if_others_are_read_anyway() {
    let mut bag = throttled();
    assert!(edges(&bag, "payload").is_empty());
    bag.publisher("/camera", "/rosout", "rosgraph_msgs/Log");
    assert_eq!(edges(&bag, "payload"), copies(&throttled()));
}

#[test]
fn a_publisher_of_copies_subscribes_to_the_originals() {
    assert_eq!(copies(&throttled()), ["/image > /throttle inferred"]);
}

#[test]
fn payloads_are_not_read_if_none_can_be_compared() {
    let options = CollectOptions {
        payload_bytes: 0,
        ..CollectOptions::default()
    };
    assert!(proved(&throttled(), "payload", options).is_empty());
}

#[test]
fn a_mux_subscribes_to_all_its_inputs() {
    let mut bag = Recording::default();
    let teleop = bag.publisher("/teleop", "/cmd_teleop", "geometry_msgs/Twist");
    let nav = bag.publisher("/nav", "/cmd_nav", "geometry_msgs/Twist");
    let mux = bag.publisher("/mux", "/cmd_vel", "geometry_msgs/Twist");
    for n in 0..60_u32 {
        let from = if n < 30 { teleop } else { nav };
        let payload = n.to_le_bytes().repeat(12);
        bag.at(from, i64::from(n) * 100, payload.clone());
        bag.at(mux, i64::from(n) * 100 + 2, payload);
    }
    assert_eq!(
        copies(&bag),
        ["/cmd_nav > /mux inferred", "/cmd_teleop > /mux inferred"]
    );
}

#[test]
fn a_mux_switching_its_input_is_a_hand_over_and_not_a_rate_change() {
    let mut bag = Recording::default();
    let teleop = bag.publisher("/teleop", "/cmd_teleop", "geometry_msgs/Twist");
    let nav = bag.publisher("/nav", "/cmd_nav", "geometry_msgs/Twist");
    let mux = bag.publisher("/mux", "/cmd_vel", "geometry_msgs/Twist");
    for n in 0..600_u32 {
        let at = i64::from(n) * 100;
        for (from, is_its_turn) in [(teleop, n < 300 && n % 2 == 0), (nav, n >= 300)] {
            let sent = (n + 1000 * u32::try_from(from).unwrap()).to_le_bytes();
            if from == nav || n % 2 == 0 {
                bag.at(from, at, sent.repeat(12));
            }
            if is_its_turn {
                bag.at(mux, at + 2, sent.repeat(12));
            }
        }
    }
    bag.messages.sort_by_key(|m| m.1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mux.bag");
    std::fs::write(&path, write(&bag, Pack::None, 768 * 1024)).unwrap();
    let mut reading = bagreel::Reading::of([path]);
    reading.collect.payload_bytes = u64::MAX;
    let mission = bagreel::read(&reading).unwrap();
    let text = log(&mission, LogFormat::Text, LogOptions::default());
    assert_eq!(
        text,
        "      00:30.0  /cmd_vel handed over: /teleop → /nav, by /mux\n"
    );
}

#[test]
fn equal_constants_are_not_copies() {
    let mut bag = Recording::default();
    for (node, topic, from) in [("/a", "/beat_a", 0), ("/b", "/beat_b", 3)] {
        let beat = bag.publisher(node, topic, "std_msgs/Bool");
        bag.send(beat, (from, 9000), 100, &[1]);
    }
    assert!(copies(&bag).is_empty());
}

/// A ROS 2 talker and listener that log what they send and receive, and a node that counts.
fn chatter(says: &str, hears: &str) -> Recording {
    let mut bag = Recording::default();
    let topic = bag.topic2("/chatter", "std_msgs/msg/String");
    let log = bag.topic2("/rosout", "rcl_interfaces/msg/Log");
    for n in 0..6 {
        let at = n * 1000;
        let hello = format!("Hello {n}");
        bag.at(
            log,
            at,
            log2("speaker", &says.replace('%', &hello), "a.cpp"),
        );
        bag.at(topic, at + 1, Cdr::default().text(&hello).done());
        bag.at(
            log,
            at + 2,
            log2("hearer", &hears.replace('%', &hello), "b.cpp"),
        );
        bag.at(log, at + 2, log2("counter", &format!("{n} done"), "c.cpp"));
    }
    bag
}

#[test]
fn log_texts_that_repeat_a_message_reveal_its_publisher_and_subscriber() {
    let expected = ["/speaker > /chatter stated", "/chatter > /hearer stated"];
    assert_eq!(
        edges(&chatter("Publishing: '%'", "I heard: [%]"), "echo"),
        expected
    );
    // Without a verb, the first to log is the publisher.
    assert_eq!(edges(&chatter("say %", "and %"), "echo"), expected);
    // Without a verb, the later node's role is unknown unless the publisher is known.
    assert!(edges(&chatter("idle", "and %"), "echo").is_empty());
}

#[test]
fn log_texts_name_topics() {
    let mut bag = Recording::default();
    let log = bag.topic2("/rosout", "rcl_interfaces/msg/Log");
    for (topic, kind) in [
        ("/odom", "nav_msgs/msg/Odometry"),
        ("/scan", "sensor_msgs/msg/LaserScan"),
    ] {
        let topic = bag.topic2(topic, kind);
        bag.at(topic, 10, vec![0, 1, 0, 0]);
    }
    let scan =
        "New subscription discovered on topic '/scan', requesting incompatible QoS. No messages …";
    for text in [
        "Advertise odometry on [/odom]",
        scan,
        "Subscribed to [/nowhere]",
    ] {
        bag.at(log, 20, log2("base", text, "plugin.cpp"));
    }
    bag.at(
        log,
        20,
        log2(
            "rosbag2_recorder",
            "Subscribed to [/odom]",
            "x/recorder.cpp",
        ),
    );
    assert_eq!(
        edges(&bag, "log_text"),
        ["/base > /odom stated", "/base > /scan stated"]
    );
}

#[test]
fn parameters_reveal_topics_and_clock_of_their_node() {
    let mut bag = Recording::default();
    let events = bag.topic2("/parameter_events", "rcl_interfaces/msg/ParameterEvent");
    let set = [
        ("qos_overrides./tf.publisher.depth", false),
        ("qos_overrides./scan.subscription.reliability", false),
        ("use_sim_time", true),
    ];
    bag.at(events, 0, parameters("/r1/nav", &set));
    bag.at(
        events,
        5,
        parameters("/r1/other", &[("use_sim_time", false)]),
    );
    bag.at(events, 900, parameters("/r1/nav", &[]));
    assert_eq!(
        edges(&bag, "qos_overrides"),
        ["/r1/nav > /tf stated", "/scan > /r1/nav stated"]
    );
    assert_eq!(edges(&bag, "sim_time"), ["/clock > /r1/nav inferred"]);
}

/// A mission of ROS 2 whose nodes only log.
fn logging(nodes: &[(&str, &str)], topics: &[(&str, &str)]) -> Recording {
    let mut bag = Recording::default();
    let log = bag.topic2("/rosout", "rcl_interfaces/msg/Log");
    for (node, file) in nodes {
        let logger = node.trim_start_matches('/').replace('/', ".");
        bag.at(log, 0, log2(&logger, "up", file));
    }
    for (topic, kind) in topics {
        let topic = bag.topic2(topic, kind);
        bag.at(topic, 500, vec![0, 1, 0, 0, 9]);
    }
    bag
}

#[test]
fn a_topic_in_a_private_namespace_belongs_to_its_node() {
    let bag = logging(
        &[("/arm", "a.cpp"), ("/r1/nav", "b.cpp")],
        &[
            ("/arm/state", "a/msg/State"),
            ("/arm/command", "a/msg/Command"),
            ("/r1/scan", "a/msg/Scan"),
            ("/r1/nav", "a/msg/Path"),
        ],
    );
    let expected = ["/arm > /arm/state inferred", "/r1/nav > /r1/nav inferred"];
    assert_eq!(edges(&bag, "private_name"), expected);
}

#[test]
fn a_topic_found_while_one_node_starts_is_its_own() {
    let found = |others: &[i64]| {
        let mut bag = Recording::default();
        let events = bag.topic2("/parameter_events", "rcl_interfaces/msg/ParameterEvent");
        let log = bag.topic2("/rosout", "rcl_interfaces/msg/Log");
        for (topic, at) in [
            ("/odom", 100),
            ("/plan", 20_600),
            ("/plan/feedback", 20_700),
        ] {
            let file = "/ws/src/rosbag2_transport/recorder.cpp";
            let text = format!("Subscribed to topic '{topic}'");
            bag.at(log, at, log2("rosbag2_recorder", &text, file));
            let topic = bag.topic2(topic, "a/msg/A");
            bag.send(topic, (at, 60_000), 500, &[0, 1, 0, 0, 1]);
        }
        for (at, node) in others
            .iter()
            .map(|at| (*at, "/other"))
            .chain([(20_000, "/planner")])
        {
            bag.at(events, at, parameters(node, &[("use_sim_time", false)]));
        }
        edges(&bag, "found")
    };
    assert_eq!(found(&[10_000]), ["/planner > /plan inferred"]);
    assert!(found(&[19_000]).is_empty());
}

#[test]
fn log_texts_that_come_with_the_messages_of_one_topic_show_its_publisher() {
    let found = |late: i64| {
        let mut bag = Recording::default();
        let log = bag.topic2("/rosout", "rcl_interfaces/msg/Log");
        let [speed, odom] = ["/cmd_vel", "/odom"].map(|topic| bag.topic2(topic, "a/msg/A"));
        bag.send(odom, (0, 20_000), 200, &[0, 1, 0, 0, 1]);
        for n in 0..12_u8 {
            let at = i64::from(n) * 1000 + i64::from(n) * i64::from(n) * 7;
            bag.at(log, at, log2("walker", &format!("speed -{n}.25"), "w.cpp"));
            bag.at(speed, at + late, vec![0, 1, 0, 0, n]);
        }
        edges(&bag, "beside")
    };
    assert_eq!(found(4), ["/walker > /cmd_vel inferred"]);
    assert!(found(-4).is_empty() && found(80).is_empty());
}

#[test]
fn a_service_has_its_clients_and_its_server() {
    let mut bag = Recording::default();
    let events = bag.topic2("/add/_service_event", "a/srv/Add_Event");
    for at in 0..20_u8 {
        let event = Cdr::default().u8(at % 4).time(SECOND).raw(&[at % 2; 16]);
        bag.at(events, i64::from(at) * 100, event.u64(1).done());
    }
    let expected = [
        "/add client ? ×2 > /add declared",
        "/add > /add server ? declared",
    ];
    assert_eq!(edges(&bag, "unknown"), expected);
}

#[test]
fn well_known_nodes_keep_their_contracts() {
    let topics = [
        ("/r1/joint_states", "sensor_msgs/msg/JointState"),
        ("/r1/scan", "sensor_msgs/msg/PointCloud2"),
        ("/tf", "tf2_msgs/msg/TFMessage"),
    ];
    let nodes = [
        ("/r1/robot_state_publisher", "robot_state_publisher.cpp"),
        ("/r1/amcl", "amcl_node.cpp"),
    ];
    let bag = logging(&nodes, &topics);
    assert_eq!(
        edges(&bag, "contract"),
        [
            "/r1/robot_state_publisher > /tf inferred",
            "/r1/joint_states > /r1/robot_state_publisher inferred"
        ]
    );
    // A node of that name from another file is another program.
    let bag = logging(&[("/r1/robot_state_publisher", "mine.py")], &topics);
    assert!(edges(&bag, "contract").is_empty());
}

#[test]
fn a_contract_claims_no_more_publishers_than_the_bag_counts() {
    let nodes = [
        ("/rplidar_node", "rplidar_node.cpp"),
        ("/urg_node", "urg_node.cpp"),
    ];
    let mut bag = logging(&nodes, &[("/scan", "sensor_msgs/msg/LaserScan")]);
    let offer =
        "- history: keep_last\n  depth: 1\n  reliability: reliable\n  durability: volatile\n";
    bag.publishers[1].qos = offer.to_owned();
    assert!(edges(&bag, "contract").is_empty());
    bag.publishers[1].qos = offer.repeat(2);
    assert_eq!(edges(&bag, "contract").len(), 2);
}

#[test]
fn unnamed_publishers_are_counted() {
    let mut bag = logging(
        &[("/rplidar_node", "rplidar_node.cpp")],
        &[("/scan", "sensor_msgs/msg/LaserScan")],
    );
    let offer =
        "- history: keep_last\n  depth: 1\n  reliability: reliable\n  durability: volatile\n";
    bag.publishers[1].qos = offer.repeat(3);
    let (built, _) = concluded(&bag, CollectOptions::default());
    let unknown: Vec<_> = built
        .elements
        .topics
        .iter()
        .map(|t| t.unknown_publishers)
        .collect();
    assert_eq!(unknown, [None, Some(2)]);
    assert_eq!(edges(&bag, "unknown"), ["/scan ? ×2 > /scan declared"]);
    // The box implies nothing about its topic's lifetime.
    let mut bag = logging(&[("/boss", "rplidar_node.cpp")], &[]);
    let scan = bag.topic2("/scan", "sensor_msgs/msg/LaserScan");
    bag.publishers[scan].qos = offer.to_owned();
    bag.at(scan, 30_000, vec![0, 1, 0, 0, 9]);
    assert_eq!(edges(&bag, "unknown"), ["/scan ? > /scan declared"]);
    let (built, _) = concluded(&bag, CollectOptions::default());
    let begins = |id: u32| {
        built.lives.of(graph::Element::Topic(TopicId(id))).unwrap()[0]
            .span
            .start
    };
    assert_eq!(begins(1), Stamp(ORIGIN + 30 * SECOND));
}

#[test]
fn unnamed_publishers_have_a_box_only_while_counted() {
    let topics = [("/scan", "sensor_msgs/msg/LaserScan")];
    let mut bag = logging(&[("/rplidar_node", "rplidar_node.cpp")], &topics);
    assert!(edges(&bag, "unknown").is_empty());
    let offer =
        "- history: keep_last\n  depth: 1\n  reliability: reliable\n  durability: volatile\n";
    bag.publishers[1].qos = offer.to_owned();
    assert!(edges(&bag, "unknown").is_empty());
}

#[test]
fn a_unique_type_identifies_its_program() {
    let topics = [
        ("/turtle1/pose", "turtlesim/msg/Pose"),
        ("/turtle1/color_sensor", "turtlesim/msg/Color"),
    ];
    let bag = logging(&[("/boss", "a.cpp")], &topics);
    assert_eq!(
        edges(&bag, "owned_type"),
        [
            "/turtlesim ? > /turtle1/color_sensor declared",
            "/turtlesim ? > /turtle1/pose declared"
        ]
    );
    let with = [topics[0], ("/turtle1/cmd_vel", "geometry_msgs/msg/Twist")];
    assert_eq!(
        edges(&logging(&[("/boss", "a.cpp")], &with), "owned_type"),
        [
            "/turtlesim ? > /turtle1/pose declared",
            "/turtle1/cmd_vel > /turtlesim ? declared"
        ]
    );
    let bag = logging(&[("/turtlesim", "turtle_frame.cpp")], &topics);
    assert!(edges(&bag, "owned_type").is_empty());
}

#[test]
fn complete_lists_override_conventions() {
    let mut bag = Recording::default();
    let goal = bag.publisher("/boss", "/go/goal", "test_msgs/GoActionGoal");
    let log = bag.publisher("/boss", "/rosout", "rosgraph_msgs/Log");
    bag.at(goal, 50, vec![0; 4]);
    let own = &["/go/goal", "/go/cancel", "/go/result", "/rosout"];
    bag.at(log, 40, log1("/boss", "up", "boss.py", own));
    let of_boss = |bag: &Recording| {
        let edges = edges(bag, "action");
        edges.contains(&"/go/status > /boss inferred".to_owned())
    };
    // A list at a node's start may lack later topics.
    assert!(of_boss(&bag));
    bag.at(log, 9000, log1("/boss", "still up", "boss.py", own));
    assert!(!of_boss(&bag));
    assert!(edges(&bag, "action").contains(&"/go/result > /boss inferred".to_owned()));
}

/// A mission of ROS 1 with a rospy node that names its topics.
fn listed(node: &str, topics: &[&str]) -> Recording {
    let mut bag = Recording::default();
    let tf = bag.publisher("/base", "/tf", "tf2_msgs/TFMessage");
    let fixed = bag.publisher("/base", "/tf_static", "tf2_msgs/TFMessage");
    let log = bag.publisher(node, "/rosout", "rosgraph_msgs/Log");
    bag.send(tf, (0, 3000), 100, &[0; 4]);
    bag.send(fixed, (0, 1), 1, &[0; 4]);
    bag.at(log, 50, log1(node, "up", "node.py", topics));
    bag
}

#[test]
fn a_complete_list_contradicts_rules() {
    // The node's own list contains `/tf_static` but not `/tf`.
    assert!(edges(&listed("/amcl", &["/rosout", "/tf_static"]), "tf_pair").is_empty());
    // roscpp's list contains no subscriptions, so it does not contradict them.
    let mut bag = listed("/amcl", &["/rosout"]);
    let log = bag.publishers.len() - 1;
    bag.messages.retain(|m| m.0 != log);
    let text = "Retrying connection to [127.0.0.1:4] for topic [/tf_static]";
    bag.at(log, 50, log1("/amcl", text, "a.cpp", &["/rosout"]));
    assert_eq!(edges(&bag, "tf_pair"), ["/tf > /amcl inferred"]);
}

#[test]
fn an_anonymous_node_starts_at_the_time_in_its_name() {
    let mut bag = Recording::default();
    let start = ORIGIN / 1_000_000 + 2_000;
    let beat = bag.publisher("/base", "/beat", "std_msgs/Empty");
    let found = bag.publisher(&format!("/probe_77_{start}"), "/found", "std_msgs/Empty");
    bag.send(beat, (0, 9000), 100, &[]);
    bag.send(found, (8000, 9000), 100, &[]);
    let (built, _) = concluded(&bag, CollectOptions::default());
    let mut nodes = built.elements.nodes.iter();
    let probe = nodes
        .find(|n| n.name.as_str().starts_with("/probe"))
        .unwrap();
    assert_eq!(probe.seen.first, Some(Stamp(ORIGIN + 2 * SECOND)));
}

#[test]
fn the_recorder_is_recognized_by_its_file_in_any_folder() {
    for file in [
        "/tmp/ros-noetic-rosbag-1.16.0/src/recorder.cpp",
        "/ws/src/rosbag/src/recorder.cpp",
    ] {
        let mut bag = Recording::default();
        let log = bag.publisher("/my_recording", "/rosout", "rosgraph_msgs/Log");
        bag.at(
            log,
            0,
            log1(
                "/my_recording",
                "Subscribing to /rosout",
                file,
                &["/rosout"],
            ),
        );
        assert_eq!(edges(&bag, "recorder"), ["/rosout > /my_recording stated"]);
    }
}

#[test]
fn a_status_named_after_no_known_node_shows_none() {
    let of = |has_log: bool| {
        let mut bag = Recording::default();
        let diagnostics = bag.topic2("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray");
        let log = bag.topic2("/rosout", "rcl_interfaces/msg/Log");
        for (at, name) in ["lidar: rate", "battery: voltage"].iter().enumerate() {
            let status = Cdr::default().header(ORIGIN, "").u32(1).u8(0).text(name);
            let status = status.text("").text("").u32(0);
            bag.at(diagnostics, 60 + i64::try_from(at).unwrap(), status.done());
        }
        if has_log {
            bag.at(log, 100, log2("lidar", "up", "lidar.cpp"));
        }
        edges(&bag, "diagnostics")
    };
    assert!(of(false).is_empty());
    assert_eq!(of(true), ["/lidar > /diagnostics inferred"]);
}

#[test]
fn diagnostics_count_before_lists_are_read() {
    let mut bag = Recording::default();
    // One connection for all, as tools that merge connections leave it.
    let log = bag.publisher("/a", "/rosout", "rosgraph_msgs/Log");
    let diagnostics = bag.publisher("/a", "/diagnostics", "diagnostic_msgs/DiagnosticArray");
    for node in ["/a", "/b"] {
        bag.at(
            log,
            50,
            log1(node, "up", "node.py", &["/rosout", "/diagnostics"]),
        );
        let name = format!("{}: rate", &node[1..]);
        let status = [
            vec![0; 12],
            text1(""),
            1_u32.to_le_bytes().to_vec(),
            vec![0],
            text1(&name),
        ];
        let rest = [text1(""), text1(""), 0_u32.to_le_bytes().to_vec()];
        bag.at(diagnostics, 60, [status.concat(), rest.concat()].concat());
    }
    let (built, _) = concluded(&bag, CollectOptions::default());
    let topics = &built.elements.topics;
    let subscribed = built
        .elements
        .subscribes
        .iter()
        .map(|e| topics[e.topic].name.as_str());
    assert!(subscribed.into_iter().all(|topic| topic != "/diagnostics"));
}

#[test]
fn only_measured_edges_depend_on_messages() {
    let bag = logging(&[("/arm", "a.cpp")], &[("/arm/state", "a/msg/State")]);
    let (built, _) = concluded(&bag, CollectOptions::default());
    let confidences: Vec<_> = built.graphs[0]
        .publishes()
        .map(|(_, s)| s.confidence)
        .collect();
    assert_eq!(confidences, [Confidence::Inferred, Confidence::Stated]);
}

#[test]
fn why_lists_conclusions_as_evidence() {
    let options = CollectOptions {
        why: vec!["/throttle".to_owned(), "/image".to_owned()],
        payload_bytes: u64::MAX,
        ..CollectOptions::default()
    };
    let (_, pieces) = concluded(&throttled(), options);
    let texts: Vec<_> = pieces.iter().map(|p| (p.source, p.text.as_str())).collect();
    assert_eq!(
        texts,
        [(
            "payload",
            "30 of 30 different messages of /image_slow are byte by byte those of /image just before"
        )]
    );
}

/// A robot of two nodes, with additional entries from the user.
fn shown(entries: Vec<TopologyEntry>, windows: &[(i64, i64)]) -> Built {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    bag.send(scan, (0, 10_001), 100, &[1; 8]);
    let recorded = recorded(&bag, CollectOptions::default());
    let second = |s: i64| recorded.span.unwrap().start.plus(s * SECOND);
    let windows: Vec<Span> = windows
        .iter()
        .map(|(from, to)| Span {
            start: second(*from),
            end: second(*to),
        })
        .collect();
    let topology = Topology {
        entries,
        notices: Vec::new(),
        files: Vec::new(),
    };
    let options = conclude::ConcludeOptions {
        topology,
        ..conclude::ConcludeOptions::default()
    };
    graph::build(&recorded, &windows, &options).unwrap()
}

fn entry(element: NamedElement, to_s: Option<i64>) -> TopologyEntry {
    TopologyEntry {
        element,
        from_ns: to_s.map(|_| 0),
        to_ns: to_s.map(|s| s * SECOND),
        declared: false,
        place: "robot.csv line 2".to_owned(),
    }
}

#[test]
fn an_end_given_by_the_user_is_exclusive() {
    let node = || NamedElement::Node("/slam".to_owned());
    let there = |end| {
        let built = shown(vec![entry(node(), Some(end))], &[(0, 5), (5, 10)]);
        let nodes = built.graphs.iter().map(|g| g.nodes().count());
        nodes.collect::<Vec<_>>()
    };
    // Including the node `/rosout`, which every ROS 1 mission has.
    assert_eq!(there(5), [3, 2]);
    assert_eq!(there(6), [3, 3]);
}

#[test]
fn unknown_names_are_reported_with_the_nearest() {
    let entries = vec![
        entry(
            NamedElement::Subscribe("/slam".to_owned(), "/scna".to_owned()),
            None,
        ),
        entry(NamedElement::Node("/lidra".to_owned()), None),
        entry(
            NamedElement::Subscribe("/viewer".to_owned(), "/scan".to_owned()),
            None,
        ),
    ];
    let built = shown(entries, &[(0, 10)]);
    let notices: Vec<_> = built.notices.iter().map(|n| n.text).collect();
    assert_eq!(
        notices,
        [
            "robot.csv line 2: the bag has no node `/lidra`; the nearest name is `/lidar`",
            "robot.csv line 2: the bag has no topic `/scna`; the nearest name is `/scan`"
        ]
    );
}

#[test]
fn topology_files_and_headers_are_listed_as_evidence() {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    bag.send(scan, (0, 1000), 100, &[1; 8]);
    let options = CollectOptions {
        why: vec!["/scan".to_owned()],
        ..CollectOptions::default()
    };
    let recorded = recorded(&bag, options);
    let whole = recorded.span.unwrap();
    let topology = Topology {
        entries: vec![entry(
            NamedElement::Subscribe("/slam".to_owned(), "/scan".to_owned()),
            None,
        )],
        notices: Vec::new(),
        files: Vec::new(),
    };
    let options = conclude::ConcludeOptions {
        topology,
        ..conclude::ConcludeOptions::default()
    };
    let built = graph::build(&recorded, &[whole], &options).unwrap();
    let sources: BTreeSet<_> = built.lines.into_iter().map(|piece| piece.source).collect();
    assert_eq!(sources, ["connection", "topology"].into());
}

#[test]
fn publishers_without_messages_in_the_range_are_left_out() {
    let bag = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("x.json");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.args(["render", bag, "--end", "30", "--period", "10", "-q", "-o"]);
    assert!(command.arg(&json).status().unwrap().success());
    let mission: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let first = &windows::windows(&mission)[0];
    let nodes = first["nodes"].as_array().unwrap();
    let is_there = |name: &str| nodes.iter().any(|node| node["name"] == name);
    // It starts in the fifth minute and is named in the bag's headers.
    assert!(!is_there("/robot1/dock_controller") && is_there("/robot1/amcl"));
    // Conclusions from a node's name still apply to its topic.
    let topics = first["topics"].as_array().unwrap();
    let joints = topics.iter().find(|t| t["name"] == "/robot1/joint_states");
    let evidence = joints.unwrap()["evidence"].as_array().unwrap();
    assert!(evidence.contains(&"contract".into()), "{evidence:?}");
}

#[test]
fn the_aggregated_log_is_only_read_without_another() {
    let mut bag = Recording::default();
    let beat = bag.publisher("/base", "/beat", "std_msgs/Empty");
    bag.send(beat, (0, 30_000), 100, &[]);
    let log = bag.publisher("/boss", "/rosout", "rosgraph_msgs/Log");
    let again = bag.publisher("/rosout", "/rosout_agg", "rosgraph_msgs/Log");
    let list = |topics| log1("/boss", "up", "boss.py", topics);
    bag.at(log, 50, list(&["/rosout"]));
    bag.at(again, 20_000, list(&["/rosout", "/beat"]));
    let subscribes =
        |bag: &Recording| edges(bag, "rosout").contains(&"/beat > /boss stated".to_owned());
    assert!(!subscribes(&bag));
    bag.messages.retain(|m| m.0 != log);
    bag.publishers[log].topic = "/other".to_owned();
    assert!(subscribes(&bag));
}

#[test]
fn rosbridge_subscribes_for_its_clients() {
    let mut bag = Recording::default();
    let odom = bag.topic2("/odom", "nav_msgs/msg/Odometry");
    bag.send(odom, (0, 30_000), 100, &[0, 1, 0, 0]);
    let log = bag.topic2("/rosout", "rcl_interfaces/msg/Log");
    let says = |text| log2("bridge", text, "protocol.py");
    bag.at(log, 50, says("[Client 0] Subscribed to /odom"));
    bag.at(log, 9000, says("[Client 0] Unsubscribed from /odom"));
    assert_eq!(edges(&bag, "log_text"), ["/odom > /bridge stated"]);
    let (built, _) = concluded(&bag, CollectOptions::default());
    let end = built
        .lives
        .of(graph::Element::Subscribe(EdgeId(0)))
        .unwrap()[0]
        .span
        .end;
    assert_eq!(end, Stamp(ORIGIN + 9 * SECOND + 1));
}

#[test]
fn a_complete_list_decides_between_two_copies() {
    let bag = |listed: bool| {
        let mut bag = Recording::default();
        let input = bag.publisher("/camera", "/image", "sensor_msgs/Image");
        let output = bag.publisher("/relay", "/again", "sensor_msgs/Image");
        let log = bag.publisher("/camera", "/rosout", "rosgraph_msgs/Log");
        for n in 0..60_u32 {
            // The recorder receives every second copy before its original.
            let (at, early) = (i64::from(n) * 100, n % 2 == 0);
            let payload = n.to_le_bytes().repeat(50);
            bag.at(input, at, payload.clone());
            bag.at(output, if early { at - 2 } else { at + 2 }, payload);
        }
        if listed {
            bag.at(log, 50, log1("/camera", "up", "camera.py", &["/image"]));
        }
        bag.messages.sort_by_key(|m| m.1);
        bag
    };
    assert!(copies(&bag(false)).is_empty());
    assert_eq!(copies(&bag(true)), ["/image > /relay inferred"]);
}

#[test]
fn a_mux_reports_its_selected_input() {
    let mut bag = Recording::default();
    for (node, topic) in [
        ("/teleop", "/cmd_teleop"),
        ("/nav", "/cmd_nav"),
        ("/mux", "/cmd_vel"),
    ] {
        let twist = bag.publisher(node, topic, "geometry_msgs/Twist");
        bag.send(twist, (0, 30_000), 100, &[1; 48]);
    }
    // Not an input: of another type.
    let battery = bag.publisher("/base", "/battery", "std_msgs/Float32");
    bag.send(battery, (0, 30_000), 100, &[0; 4]);
    let rosout = bag.publisher("/mux", "/rosout", "rosgraph_msgs/Log");
    bag.at(
        rosout,
        1,
        log1("/mux", "up", "mux.cpp", &["/cmd_vel", "/mux/selected"]),
    );
    let selected = bag.publisher("/mux", "/mux/selected", "std_msgs/String");
    bag.publishers[selected].latching = true;
    for (at, topic) in [
        (5, "__none"),
        (10, "/cmd_nav"),
        (15_000, "/cmd_teleop"),
        (20_000, "/battery"),
    ] {
        bag.at(selected, at, text1(topic));
    }
    bag.messages.sort_by_key(|m| m.1);
    assert_eq!(
        edges(&bag, "payload"),
        ["/cmd_nav > /mux inferred", "/cmd_teleop > /mux inferred"]
    );
}

/// The windows that contain a node declared by a launch file beside two robots: `/r1/base` from 0 to 10 s,
/// and `/r2/base` and a viewer with an anonymous name from 5 to 10 s.
fn launched(element: NamedElement, node: &str) -> (Vec<bool>, Vec<String>) {
    let mut bag = Recording::default();
    for (node, topic, from) in [
        ("/r1/base", "/r1/odom", 0),
        ("/r2/base", "/r2/odom", 5_000),
        ("/viewer_robot_47_1234", "/view", 5_000),
    ] {
        let odom = bag.publisher(node, topic, "nav_msgs/Odometry");
        bag.send(odom, (from, 10_001), 100, &[1; 8]);
    }
    let recorded = recorded(&bag, CollectOptions::default());
    let start = recorded.span.unwrap().start;
    let window = |n: i64| Span::new(start.plus(n * 2 * SECOND), start.plus((n + 1) * 2 * SECOND));
    let windows: Vec<Span> = (0..5).map(window).collect();
    let declared = TopologyEntry {
        declared: true,
        ..entry(element, None)
    };
    let options = conclude::ConcludeOptions {
        topology: Topology {
            entries: vec![declared],
            ..Topology::default()
        },
        ..conclude::ConcludeOptions::default()
    };
    let built = graph::build(&recorded, &windows, &options).unwrap();
    let names: Vec<String> = built
        .elements
        .nodes
        .iter()
        .map(|n| n.name.to_string())
        .collect();
    let id = names.iter().position(|name| name == node);
    let is_there = |g: &graph::Graph| g.nodes().any(|(n, _)| Some(n.0 as usize) == id);
    (built.graphs.iter().map(is_there).collect(), names)
}

#[test]
fn a_declared_node_exists_as_long_as_its_namespace() {
    let lives = |node: &str| launched(NamedElement::Node(node.to_owned()), node).0;
    assert_eq!(lives("/r1/planner"), [true; 5]);
    assert_eq!(lives("/r2/planner"), [false, false, true, true, true]);
    assert_eq!(lives("/planner"), [true; 5]);
}

#[test]
fn an_anonymous_node_of_a_launch_file_is_the_one_of_the_bag() {
    let (seen, topic) = ("/viewer_robot_47_1234", "/r1/odom".to_owned());
    let (there, names) = launched(
        NamedElement::Subscribe("/viewer*".to_owned(), topic.clone()),
        seen,
    );
    assert_eq!(there, [false, false, true, true, true]);
    assert!(!names.contains(&"/viewer".to_owned()));
    // Without one in the bag, it has the name without its number.
    let (_, names) = launched(NamedElement::Subscribe("/monitor*".to_owned(), topic), seen);
    assert!(names.contains(&"/monitor".to_owned()));
}

#[test]
fn a_twin_in_another_namespace_has_the_same_subscriptions() {
    let mut bag = Recording::default();
    for robot in ["/r1", "/r2"] {
        for topic in ["plan", "costmap"] {
            let node = format!("{robot}/planner");
            let place = bag.publisher(&node, &format!("{robot}/{topic}"), "nav_msgs/Path");
            bag.send(place, (0, 5000), 100, &[1; 8]);
        }
        let odom = bag.publisher(
            &format!("{robot}/base"),
            &format!("{robot}/odom"),
            "nav_msgs/Odometry",
        );
        bag.send(odom, (0, 5000), 100, &[2; 8]);
    }
    let log = bag.publisher("/r1/planner", "/rosout", "rosgraph_msgs/Log");
    let text = "Retrying connection to [127.0.0.1:4] for topic [/r1/odom]";
    bag.at(
        log,
        50,
        log1(
            "/r1/planner",
            text,
            "p.cpp",
            &["/rosout", "/r1/plan", "/r1/costmap"],
        ),
    );
    assert_eq!(edges(&bag, "sister"), ["/r2/odom > /r2/planner inferred"]);
}
