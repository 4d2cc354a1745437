//! Tests of every source with single messages.

mod tests_ros2;

use super::*;
use crate::bag::Encoding;
use crate::evidence::observation::{Confidence, Observation, Observations, Statement};

/// A payload under construction.
pub(super) struct Payload {
    bytes: Vec<u8>,
    cdr: bool,
}

impl Payload {
    pub(super) fn ros1() -> Self {
        Self {
            bytes: Vec::new(),
            cdr: false,
        }
    }

    pub(super) fn cdr() -> Self {
        Self {
            bytes: vec![0, 1, 0, 0],
            cdr: true,
        }
    }

    /// An empty payload in each encoding.
    pub(super) fn both() -> [Self; 2] {
        [Self::ros1(), Self::cdr()]
    }

    pub(super) fn number<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        while self.cdr && !(self.bytes.len() - 4).is_multiple_of(N) {
            self.bytes.push(0);
        }
        self.bytes.extend(bytes);
        self
    }

    pub(super) fn byte(self, value: u8) -> Self {
        self.number([value])
    }

    pub(super) fn u32(self, value: u32) -> Self {
        self.number(value.to_le_bytes())
    }

    pub(super) fn u64(self, value: u64) -> Self {
        self.number(value.to_le_bytes())
    }

    pub(super) fn time(self) -> Self {
        self.u32(1).u32(2)
    }

    pub(super) fn raw(mut self, bytes: &[u8]) -> Self {
        self.bytes.extend(bytes);
        self
    }

    pub(super) fn text(self, text: &str) -> Self {
        let zero = if self.cdr { "\0" } else { "" };
        let text = format!("{text}{zero}");
        self.u32(u32::try_from(text.len()).unwrap())
            .raw(text.as_bytes())
    }

    pub(super) fn header(self, seq: u32) -> Self {
        let start = if self.cdr { self } else { self.u32(seq) };
        start.time().text("")
    }

    pub(super) fn log(name: &str, message: &str, file: &str, topics: &[&str]) -> Self {
        Self::ros1().header(7).logged(name, message, file, topics)
    }

    /// The rest of a log record after its header.
    fn logged(self, name: &str, message: &str, file: &str, topics: &[&str]) -> Self {
        let record = self
            .byte(2)
            .text(name)
            .text(message)
            .text(file)
            .text("f")
            .u32(3);
        let record = record.u32(u32::try_from(topics.len()).unwrap());
        topics
            .iter()
            .fold(record, |record, topic| record.text(topic))
    }
}

/// A collector that has read one message of a connection, with the payload that it wanted.
pub(super) fn receive(
    topic: &str,
    kind: &str,
    publisher: Option<&str>,
    payload: &Payload,
) -> (Collector, Want) {
    receive_defined(&connection(topic, kind, publisher), payload)
}

/// A connection without a definition.
fn connection(topic: &str, kind: &str, publisher: Option<&str>) -> Connection {
    Connection {
        id: ConnectionId(0),
        topic: topic.into(),
        type_name: kind.into(),
        definition: None,
        is_idl: false,
        type_hash: None,
        publisher: publisher.map(Into::into),
        latching: false,
        qos: None,
        encoding: Encoding::Ros1,
    }
}

/// As [`receive`], for a connection in the payload's encoding.
fn receive_defined(connection: &Connection, payload: &Payload) -> (Collector, Want) {
    let mut collector = Collector::new(CollectOptions::default());
    let mut progress = |_, _| ();
    let mut bag = collector.bag(&mut progress);
    let want = bag.connection(&Connection {
        encoding: if payload.cdr {
            Encoding::Cdr
        } else {
            Encoding::Ros1
        },
        ..connection.clone()
    });
    bag.message(Message {
        connection: ConnectionId(0),
        time: Stamp(5),
        data: &payload.bytes,
        size: 0,
    });
    (collector, want)
}

/// The observations of one message, a line each, sorted.
pub(super) fn observations(
    topic: &str,
    kind: &str,
    publisher: Option<&str>,
    payload: &Payload,
) -> Vec<String> {
    let (collector, want) = receive(topic, kind, publisher, payload);
    assert_eq!(want, Want::Payload);
    lines(collector)
}

/// All observations, a line each, sorted.
fn lines(mut collector: Collector) -> Vec<String> {
    source::rosout::interpret_lists(&mut collector.facts);
    assert!(collector.notices.is_empty(), "{:?}", collector.notices);
    let facts = &collector.facts;
    let line = |observation: Observation| {
        let debug = format!("{observation:?}");
        let kind = debug.split('(').next().unwrap().to_owned();
        let names = observation.names().into_iter().flatten();
        names.fold(kind, |line, name| format!("{line} {}", facts.text(name)))
    };
    let mut lines: Vec<_> = facts
        .list
        .iter()
        .map(|fact| line(fact.observation))
        .collect();
    lines.sort();
    lines
}

#[test]
fn roscpp_names_what_it_publishes() {
    for empty in Payload::both() {
        let record = empty
            .header(7)
            .logged("/a", "hello", "src/a.cpp", &["/scan"]);
        assert_eq!(
            observations("/rosout", "rosgraph_msgs/Log", Some("/a"), &record),
            [
                "LogsFrom /a a.cpp",
                "Node /a",
                "Publish /a /rosout",
                "Publish /a /scan",
                "Snapshot topics of /a"
            ]
        );
    }
}

#[test]
fn headers_in_converted_recordings_may_have_a_number() {
    let fields = "std_msgs/Header header\nbyte level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n\
                  string[] topics\n===\nMSG: std_msgs/Header\n";
    let time = "===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let stamp = "builtin_interfaces/Time stamp\nstring frame_id\n";
    let of = |header: String, payload: Payload| {
        let definition = format!("{fields}{header}{time}");
        let connection = Connection {
            definition: Some(definition.into()),
            type_hash: Some("RIHS01_56c2".into()),
            ..connection("/rosout", "rosgraph_msgs/msg/Log", None)
        };
        let record = payload
            .time()
            .text("")
            .logged("/a", "up", "a.py", &["/scan"]);
        lines(receive_defined(&connection, &record).0)
    };
    let plain = of(stamp.to_owned(), Payload::cdr());
    assert!(plain.contains(&"Lists /a /scan".to_owned()), "{plain:?}");
    let mut numbered = of(format!("uint32 seq\n{stamp}"), Payload::cdr().u32(1));
    // The number is the first record's.
    numbered.retain(|line| line != "Begins /a");
    assert_eq!(numbered, plain);
}

#[test]
fn a_player_shows_nothing_about_the_nodes_in_its_log() {
    let record = Payload::ros1().header(1).logged("/b", "up", "a.py", &[]);
    let by = |node| observations("/rosout", "rosgraph_msgs/Log", Some(node), &record);
    assert!(by("/a").contains(&"Carries /a /b".to_owned()));
    assert_eq!(
        by("/play_1795170682045"),
        [
            "Begins /b",
            "LogsFrom /b a.py",
            "Node /b",
            "Publish /b /rosout",
            "Snapshot topics of /b"
        ]
    );
}

#[test]
fn rospy_names_what_it_publishes_and_subscribes() {
    let record = Payload::log("/a", "hello", "a.py", &["/scan"]);
    assert_eq!(
        observations("/rosout_agg", "rosgraph_msgs/Log", Some("/rosout"), &record),
        [
            "Lists /a /scan",
            "LogsFrom /a a.py",
            "Node /a",
            "Snapshot topics of /a"
        ]
    );
}

#[test]
fn one_python_record_makes_a_node_one_of_rospy() {
    let mut facts = Observations::default();
    let [script, driver, topic] = ["/a", "/b", "/scan"].map(|name| facts.name(name));
    for node in [script, driver] {
        let said = Statement::new(Observation::Lists(node, topic), Confidence::Stated);
        facts.add(0, said, Some(Stamp(5)));
    }
    facts.rospy.insert(script);
    source::rosout::interpret_lists(&mut facts);
    let observations: Vec<Observation> = facts.list.iter().map(|fact| fact.observation).collect();
    assert_eq!(
        observations,
        [
            Observation::Lists(script, topic),
            Observation::Publish(driver, topic)
        ]
    );
}

#[test]
fn a_log_connection_of_another_node_was_merged() {
    let record = Payload::log("/b", "hello", "a.py", &[]);
    let all = observations("/rosout", "rosgraph_msgs/Log", Some("/a"), &record);
    assert!(all.contains(&"Carries /a /b".to_owned()), "{all:?}");
}

#[test]
fn roscpp_log_messages_reveal_subscribers() {
    let text = "Connection to subscriber [callerid=[/c] address=[x]] to topic [/scan] dropped";
    let record = Payload::log("/a", text, "link.cpp", &[]);
    let all = observations("/rosout", "rosgraph_msgs/Log", Some("/a"), &record);
    assert!(all.contains(&"Unsubscribe /c /scan".to_owned()), "{all:?}");
}

#[test]
fn the_recorder_dates_a_topic() {
    let record = Payload::log("/record_1", "Subscribing to /map", "recorder.cpp", &[]);
    let all = observations("/rosout", "rosgraph_msgs/Log", Some("/record_1"), &record);
    assert!(all.contains(&"Appears /map".to_owned()), "{all:?}");
}

#[test]
fn statistics_name_both_ends() {
    for empty in Payload::both() {
        let ends = empty.text("/scan").text("/lidar").text("/slam");
        let message = ends.time().time().u32(10).u32(0).u32(999).raw(&[0; 48]);
        assert_eq!(
            observations(
                "/statistics",
                "rosgraph_msgs/TopicStatistics",
                Some("/slam"),
                &message
            ),
            ["Publish /lidar /scan", "Subscribe /slam /scan"]
        );
    }
}

#[test]
fn diagnostics_name_their_node() {
    for empty in Payload::both() {
        let status = empty.header(1).u32(1).byte(0).text("r1/lidar: Rate");
        let message = status.text("").text("").u32(1).text("k").text("v");
        assert_eq!(
            observations(
                "/diagnostics",
                "diagnostic_msgs/DiagnosticArray",
                None,
                &message
            ),
            ["Reports /r1/lidar /diagnostics"]
        );
    }
}

#[test]
fn the_status_of_a_goal_names_its_client() {
    for empty in Payload::both() {
        let goal = empty.header(1).u32(1).time().text("/boss-1-1795170744.123");
        let message = goal.byte(1).text("");
        assert_eq!(
            observations(
                "/move/status",
                "actionlib_msgs/GoalStatusArray",
                None,
                &message
            ),
            ["Publish /boss /move/goal"]
        );
    }
}

#[test]
fn a_payload_of_another_layout_is_a_notice_and_no_claim() {
    let message = Payload::log("/a", "hello", "a.py", &[]).byte(1);
    let (collector, _) = receive("/rosout", "rosgraph_msgs/Log", None, &message);
    assert!(collector.facts.list.is_empty());
    let kinds: Vec<_> = collector.notices.iter().map(|n| n.kind).collect();
    assert_eq!(kinds, [NoticeKind::Undecodable]);
}

#[test]
fn every_layout_survives_any_cut() {
    let record = Payload::log("/a", "hello", "a.py", &["/b", "/c"]);
    for len in 0..record.bytes.len() {
        let cut = Payload {
            bytes: record.bytes[..len].to_vec(),
            cdr: false,
        };
        let (collector, _) = receive("/rosout", "rosgraph_msgs/Log", None, &cut);
        assert!(collector.facts.list.is_empty(), "{len}");
    }
}

/// A collector with a camera, a detector that copies its stamps, and a lidar that does not.
fn flow() -> Collector {
    let mut collector = Collector::new(CollectOptions {
        infer_stamps: true,
        payload_bytes: 0,
        why: vec!["/detector".into(), "/image".into()],
        ..CollectOptions::default()
    });
    let mut progress = |_, _| ();
    let mut bag = collector.bag(&mut progress);
    let talks = [
        ("/image", "/camera", 0),
        ("/boxes", "/detector", 30),
        ("/scan", "/lidar", 40),
    ];
    for (id, (topic, node, _)) in (0..).zip(talks) {
        let want = bag.connection(&Connection {
            id: ConnectionId(id),
            topic: topic.into(),
            type_name: "sensor_msgs/Image".into(),
            definition: None,
            is_idl: false,
            type_hash: None,
            publisher: Some(node.into()),
            latching: false,
            qos: None,
            encoding: Encoding::Ros1,
        });
        assert_eq!(want, Want::Head(equal_stamps::HEAD));
    }
    for n in 0..20_u32 {
        for (id, (_, node, delay_ms)) in (0..).zip(talks) {
            let own = u32::from(node == "/lidar");
            let head = Payload::ros1().u32(n).u32(100 + n).u32(own).u32(0);
            let time = Stamp::from_ros(100 + n, delay_ms * 1_000_000);
            bag.stamps(ConnectionId(id), &[time], None);
            bag.message(Message {
                connection: ConnectionId(id),
                time,
                data: &head.bytes,
                size: 99,
            });
        }
    }
    collector
}

#[test]
fn a_node_that_forwards_stamps_subscribes_to_their_source() {
    let recorded = flow().finish().unwrap();
    let span = recorded.span.unwrap();
    let options = crate::evidence::conclude::ConcludeOptions::default();
    let built = crate::graph::build(&recorded, &[span], &options).unwrap();
    let all = &built.elements;
    let inferred = all
        .subscribes
        .iter()
        .filter(|e| e.seen.evidence.has("equal_stamps"));
    let names = inferred.map(|e| {
        let (topic, node) = (&all.topics[e.topic], &all.nodes[e.node]);
        format!("{} {}", topic.name, node.name)
    });
    assert_eq!(names.collect::<Vec<_>>(), ["/image /detector"]);
    let texts: Vec<_> = built.lines.into_iter().map(|line| line.text).collect();
    let text = "20 of 20 messages of /boxes carry the stamp of a message of /image just before";
    assert!(texts.iter().any(|t| t == text), "{texts:?}");
}
