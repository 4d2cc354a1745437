//! Tests of what shows a start or an end, and what does not.

use crate::causes::{at, minute, shown};
use crate::edges::log1;
use crate::pairs::LOG;
use crate::support::{ORIGIN, Recording};

fn sorted(mut bag: Recording) -> String {
    bag.messages.sort_by_key(|m| m.1);
    shown(&bag)
}

/// A minute in which a node publishes a latched message at these seconds.
fn latched(seconds: impl IntoIterator<Item = i64>) -> String {
    let mut bag = minute(&[]);
    let map = bag.publisher("/map_server", "/map", "std_msgs/String");
    bag.publishers[map].latching = true;
    for second in seconds {
        at(&mut bag, map, second, vec![7; 30]);
    }
    sorted(bag)
}

#[test]
fn a_latched_message_that_may_be_a_repetition_is_no_start() {
    assert!(latched([8]).contains("/map_server started"));
    assert_eq!(latched((4..60).step_by(5)), "");
    assert!(latched((14..60).step_by(5)).contains("/map_server started"));
}

#[test]
fn a_latched_topic_that_is_sent_all_the_time_is_a_topic_like_any_other() {
    let text = |step: usize| latched((0..25).chain(45..60).step_by(step));
    assert!(
        text(1).contains("/map_server silent for 21 s"),
        "{}",
        text(1)
    );
    assert_eq!(text(3), "");
}

#[test]
fn a_first_message_within_its_period_is_no_beginning() {
    let text = |late: i64| {
        let mut bag = minute(&[]);
        for (topic, first) in [("/wake", 0), ("/sleep", late)] {
            let place = bag.publisher("/cycle", topic, "std_msgs/Empty");
            bag.send(place, (first, 60_000), 7_000, &[]);
        }
        sorted(bag)
    };
    assert_eq!(text(6_900), "");
    assert!(text(20_900).contains("/cycle → /sleep appeared"));
}

#[test]
fn the_start_of_an_input_is_not_that_of_its_relay() {
    let text = |camera: i64, relay: i64| {
        let mut bag = minute(&[]);
        let image = bag.publisher("/camera", "/image", "std_msgs/String");
        let again = bag.publisher("/relay", "/again", "std_msgs/String");
        for tenth in camera * 10..600 {
            let payload = (1000 + tenth).to_string().into_bytes();
            let time = ORIGIN + tenth * 100_000_000;
            bag.messages.push((image, time, payload.clone()));
            if tenth >= relay * 10 {
                bag.messages.push((again, time + 1_000_000, payload));
            }
        }
        // A relay of ROS 1 advertises its topic then, and logs that; the recorder's log finds the topic.
        let mut log = |node: &str, text: &str, file, second| {
            let log = bag.publisher(node, "/rosout", "rosgraph_msgs/Log");
            LOG.clone_into(&mut bag.publishers[log].definition);
            at(&mut bag, log, second, log1(node, text, file, &[]));
        };
        let [record, recorder] = ["/record_1", "/src/recorder.cpp"];
        log(record, "Subscribing to /view", recorder, 0);
        log(record, "Subscribing to /again", recorder, relay);
        log("/relay", "advertised as /again\n", "/src/relay.cpp", relay);
        sorted(bag)
    };
    let both = text(20, 20);
    assert!(both.contains("/camera started"), "{both}");
    assert!(!both.contains("/relay started"), "{both}");
    let later = text(0, 20);
    assert!(later.contains("/relay started"), "{later}");
}

#[test]
fn a_node_that_answers_at_once_was_there() {
    let text = |topic: &str| {
        let mut bag = minute(&[]);
        let goal = bag.publisher("/client", topic, "std_msgs/String");
        at(&mut bag, goal, 20, b"\x02\0\0\0go".to_vec());
        let speed = bag.publisher("/nav", "/speed", "std_msgs/Empty");
        bag.send(speed, (20_300, 60_000), 100, &[]);
        sorted(bag)
    };
    assert!(text("/other/goal").contains("/nav started"));
    for topic in ["/nav/goal", "nav/goal"] {
        assert!(!text(topic).contains("/nav started"), "{topic}");
    }
}

#[test]
fn an_action_server_offers_its_feedback_from_the_start() {
    let mut bag = minute(&[]);
    let status = bag.publisher("/arm", "/lift/status", "actionlib_msgs/GoalStatusArray");
    bag.send(status, (0, 60_000), 200, &[]);
    let feedback = bag.publisher("/arm", "/lift/feedback", "std_msgs/Empty");
    bag.send(feedback, (30_000, 60_000), 1_000, &[]);
    assert_eq!(sorted(bag), "");
}

#[test]
fn the_feedback_of_an_action_is_no_rhythm() {
    let mut bag = minute(&[]);
    let feedback = bag.publisher("/arm", "/lift/feedback", "std_msgs/Empty");
    for span in [(10_000, 25_000), (40_000, 45_000)] {
        bag.send(feedback, span, 500, &[]);
    }
    assert_eq!(sorted(bag), "");
}

#[test]
fn a_node_that_only_stands_in_for_another_waits_before_and_after() {
    let mut bag = Recording::default();
    let usual = bag.publisher("/controller", "/command", "std_msgs/Empty");
    let other = bag.publisher("/servo", "/command", "std_msgs/Empty");
    bag.send(usual, (0, 20_000), 100, &[]);
    bag.send(other, (20_300, 40_000), 100, &[]);
    bag.send(usual, (40_300, 60_000), 100, &[]);
    let text = sorted(bag);
    assert!(text.contains("/controller → /servo"), "{text}");
    let others = ["started", "stopped", "silent"];
    assert!(!others.iter().any(|word| text.contains(word)), "{text}");
}

#[test]
fn a_pause_of_the_recorder_does_not_hide_an_end() {
    let mut bag = Recording::default();
    for (node, end) in [
        ("/a", 45_000),
        ("/b", 60_000),
        ("/c", 60_000),
        ("/d", 60_000),
    ] {
        let place = bag.publisher(node, &format!("{node}/beat"), "std_msgs/Empty");
        bag.send(place, (0, 20_000), 100, &[]);
        bag.send(place, (30_000, end), 100, &[]);
    }
    let text = sorted(bag);
    assert!(text.contains("nothing was recorded for 10.1 s"), "{text}");
    assert!(text.contains("/a stopped"), "{text}");
}

#[test]
fn a_recorder_of_all_topics_dates_the_birth_of_each() {
    let text = |found: &[(i64, &str)]| {
        let mut bag = minute(&[]);
        let log = bag.publisher("/record_1", "/rosout", "rosgraph_msgs/Log");
        LOG.clone_into(&mut bag.publishers[log].definition);
        for (second, topic) in found {
            let text = format!("Subscribing to {topic}");
            let record = log1("/record_1", &text, "/src/recorder.cpp", &[]);
            at(&mut bag, log, *second, record);
        }
        for (node, from) in [("/early", 30_000), ("/late", 40_000)] {
            let place = bag.publisher(node, &format!("{node}/out"), "std_msgs/Empty");
            bag.send(place, (from, 60_000), 100, &[]);
        }
        sorted(bag)
    };
    let known = text(&[(0, "/early/out"), (20, "/late/out")]);
    assert!(!known.contains("/early started"), "{known}");
    assert!(known.contains("00:20.0  /late started"), "{known}");
    // One that is given a list names all topics at once.
    let listed = text(&[(0, "/early/out"), (0, "/late/out")]);
    assert!(listed.contains("00:30.0  /early started"), "{listed}");
    assert!(listed.contains("00:40.0  /late started"), "{listed}");
}

#[test]
fn a_node_starts_when_the_recorder_connects_to_its_log() {
    let text = |found: &[i64], number: u32, second: i64, latching: bool| {
        let mut bag = minute(&[("/base", "/odom", 0, 60)]);
        let mut record = |node: &str, second, number: u32, text: &str, file| {
            let log = bag.publisher(node, "/rosout", "rosgraph_msgs/Log");
            bag.publishers[log].latching = latching;
            LOG.clone_into(&mut bag.publishers[log].definition);
            let mut record = log1(node, text, file, &[]);
            record[..4].copy_from_slice(&number.to_le_bytes());
            at(&mut bag, log, second, record);
        };
        for second in found {
            let text = "Subscribing to /odom";
            record("/record_1", *second, 7, text, "/src/recorder.cpp");
        }
        record("/teleop", second, number, "ready", "teleop.py");
        sorted(bag)
    };
    let started = text(&[0], 2, 30, true);
    assert!(started.contains("00:30.0  /teleop started"), "{started}");
    // Without the log of the recorder's start, this may be a part of a longer recording, and so may what comes at once.
    assert_eq!(text(&[], 2, 30, true), "");
    assert_eq!(text(&[20], 2, 30, true), "");
    assert_eq!(text(&[0], 2, 3, true), "");
    // The log of roscpp is not latched: the first record may be from before the recording.
    assert_eq!(text(&[0], 2, 30, false), "");
}

#[test]
fn publishers_that_send_at_once_begin_with_a_topic_of_several() {
    let mut bag = minute(&[]);
    let log = bag.publisher("/record_1", "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut bag.publishers[log].definition);
    for (second, topic) in [(0, "/view"), (20, "/bond")] {
        let text = format!("Subscribing to {topic}");
        let record = log1("/record_1", &text, "/src/recorder.cpp", &[]);
        at(&mut bag, log, second, record);
    }
    for (node, second) in [("/crop", 21), ("/resize", 21), ("/later", 40)] {
        let place = bag.publisher(node, "/bond", "std_msgs/String");
        at(&mut bag, place, second, vec![7; 30]);
        at(&mut bag, place, second + 13, vec![8; 30]);
    }
    let text = sorted(bag);
    assert!(text.contains("00:20.0  /crop started"), "{text}");
    assert!(text.contains("00:20.0  /resize started"), "{text}");
    assert!(!text.contains("/later started"), "{text}");
}

#[test]
fn a_topic_of_unnamed_senders_begins_only_with_many_messages() {
    let text = |sent: (i64, i64), period: i64| {
        let mut bag = Recording::default();
        for (topic, span, period) in [("/beat", (0, 60_000), 100), ("/keys", sent, period)] {
            let place = bag.publisher("", topic, "std_msgs/msg/Empty");
            bag.send(place, span, period, &[0, 1, 0, 0]);
        }
        shown(&bag)
    };
    assert_eq!(text((20_000, 25_000), 100), "");
    assert!(text((20_000, 60_000), 100).contains("/keys appeared"));
}
