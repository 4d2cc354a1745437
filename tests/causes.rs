//! Tests that one cause is one headline: related events in the log of a recording, and events without
//! evidence.

use std::io::Write as _;
use std::process::{Command, Stdio};

use bagreel::internals::mission::event_log::{LogFormat, LogOptions, log};
use bagreel::internals::mission::info::info;
use bagreel::{Mission, Reading, read};

use crate::edges::{log1, text1};
use crate::pairs::LOG;
use crate::support::rosbag1::{Pack, write};
use crate::support::{ORIGIN, Recording};

/// The mission of a recording, with its payloads compared.
pub(crate) fn mission(bag: &Recording) -> Mission {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.bag");
    std::fs::write(&path, write(bag, Pack::None, 768 * 1024)).unwrap();
    let mut reading = Reading::of([path]);
    reading.collect.payload_bytes = u64::MAX;
    read(&reading).unwrap()
}

pub(crate) fn shown(bag: &Recording) -> String {
    log(&mission(bag), LogFormat::Text, LogOptions::default())
}

/// A minute in which one node sends to the end, and others send ten times a second from one second to another.
pub(crate) fn minute(senders: &[(&str, &str, i64, i64)]) -> Recording {
    let mut bag = Recording::default();
    let all = [("/base", "/beat", 0, 60)];
    for (node, topic, from, to) in all.iter().chain(senders) {
        let place = bag.publisher(node, topic, "std_msgs/Empty");
        bag.send(place, (from * 1000, to * 1000), 100, &[]);
    }
    bag
}

pub(crate) fn at(bag: &mut Recording, publisher: usize, second: i64, payload: Vec<u8>) {
    let time = ORIGIN + second * 1_000_000_000;
    bag.messages.push((publisher, time, payload));
}

#[test]
fn a_flapping_connection_is_one_line() {
    let mut bag = minute(&[("/view", "/state", 0, 60)]);
    let log = bag.publisher("/base", "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut bag.publishers[log].definition);
    for second in [10, 20, 30, 40] {
        let begins = "Connection: Creating TransportSubscriberLink for topic [/beat] connected to [callerid=[/view] address=[x]]";
        let ends =
            "Connection to subscriber [callerid=[/view] address=[x]] to topic [/beat] dropped";
        for (text, late) in [(begins, 0), (ends, 4)] {
            let record = log1("/base", text, "connection.cpp", &["/beat"]);
            at(&mut bag, log, second + late, record);
        }
    }
    bag.messages.sort_by_key(|m| m.1);
    let text = shown(&bag);
    assert!(
        text.contains("/beat → /view appears and vanishes 4 times"),
        "{text}"
    );
    assert_eq!(text.lines().count(), 1, "{text}");
}

#[test]
fn nodes_silent_together_beside_others_are_no_pause_of_the_recording() {
    let names: Vec<(String, String)> = (0..8)
        .map(|n| (format!("/n{n}"), format!("/t{n}")))
        .collect();
    let of = |(from, to)| {
        names
            .iter()
            .map(move |(node, topic)| (&node[..], &topic[..], from, to))
    };
    let senders: Vec<_> = of((0, 20)).chain(of((35, 60))).collect();
    let bag = minute(&senders);
    let text = shown(&bag);
    assert!(!text.contains("nothing was recorded"), "{text}");
    assert!(
        text.contains("; 8 of 9 nodes silent together; also /n1"),
        "{text}"
    );
}

#[test]
fn a_client_refused_at_one_moment_did_not_restart() {
    let mut bag = minute(&[("/view", "/state", 0, 60)]);
    let log = bag.publisher("/base", "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut bag.publishers[log].definition);
    let refusal =
        "Client [/bad] wants topic /beat to have datatype/md5sum [a/b], but our version has [c/d].";
    let record = log1("/base", refusal, "publication.cpp", &["/beat"]);
    at(&mut bag, log, 30, record);
    bag.messages.sort_by_key(|m| m.1);
    let text = shown(&bag);
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    assert_eq!(
        lines,
        [
            "00:00–00:30  /bad started: subscribes to /beat",
            "00:30–00:59  /bad stopped: subscribes to /beat",
        ],
    );
}

#[test]
fn topics_that_a_node_begins_together_are_one_line() {
    let text = shown(&minute(&[
        ("/base", "/a", 30, 60),
        ("/base", "/b", 30, 60),
        ("/base", "/c", 30, 60),
    ]));
    assert!(
        text.contains("/base → /a appeared; also /b and /c"),
        "{text}"
    );
    assert_eq!(text.lines().count(), 1, "{text}");
}

#[test]
fn nodes_that_stop_and_start_together_are_a_switch() {
    let text = shown(&minute(&[
        ("/a", "/a1", 0, 30),
        ("/b", "/b1", 0, 30),
        ("/c", "/c1", 0, 30),
        ("/d", "/d1", 32, 60),
        ("/e", "/e1", 32, 60),
    ]));
    let lines: Vec<&str> = text.lines().collect();
    assert!(
        lines[0].ends_with("mode switch: 3 nodes stopped, 2 started"),
        "{text}"
    );
    assert_eq!(lines.len(), 6, "{text}");
}

#[test]
fn the_end_of_an_input_does_not_end_its_relay() {
    let mut bag = minute(&[]);
    let camera = bag.publisher("/camera", "/image", "std_msgs/String");
    let relay = bag.publisher("/relay", "/again", "std_msgs/String");
    for second in 0..30 {
        let payload = (1000 + second).to_string().into_bytes();
        at(&mut bag, camera, second, payload.clone());
        let late = ORIGIN + second * 1_000_000_000 + 1_000_000;
        bag.messages.push((relay, late, payload));
    }
    bag.messages.sort_by_key(|m| m.1);
    let text = shown(&bag);
    assert!(text.contains("/camera stopped"), "{text}");
    assert!(!text.contains("/relay stopped"), "{text}");
}

#[test]
fn a_mux_that_reports_another_input_hands_over() {
    let mut bag = minute(&[
        ("/nav", "/cmd_nav", 0, 60),
        ("/teleop", "/cmd_teleop", 0, 60),
        ("/mux", "/cmd_vel", 0, 60),
    ]);
    let selected = bag.publisher("/mux", "/mux/selected", "std_msgs/String");
    bag.publishers[selected].latching = true;
    for (second, topic) in [(0, "/cmd_nav"), (30, "/cmd_teleop")] {
        at(&mut bag, selected, second, text1(topic));
    }
    bag.messages.sort_by_key(|m| m.1);
    let text = shown(&bag);
    assert!(
        text.contains("/cmd_vel handed over: /nav → /teleop"),
        "{text}"
    );
}

#[test]
fn rare_messages_do_not_make_a_topic_appear() {
    let mut bag = minute(&[]);
    let goal = bag.publisher("", "/goal", "std_msgs/Empty");
    let keys = bag.publisher("/teleop", "/keys", "std_msgs/Empty");
    for second in [20, 31, 33] {
        at(&mut bag, goal, second, Vec::new());
        at(&mut bag, keys, second, Vec::new());
    }
    bag.messages.sort_by_key(|m| m.1);
    let mission = mission(&bag);
    let text = |all| {
        let options = LogOptions {
            all,
            ..LogOptions::default()
        };
        log(&mission, LogFormat::Text, options)
    };
    assert_eq!(text(false), "");
    let all = text(true);
    assert!(all.contains("/goal first message"), "{all}");
    assert!(!all.contains("/teleop"), "{all}");
    // The summary shows the same lifetime of the node.
    let info = info(&mission);
    let teleop = info.nodes.iter().find(|node| node.name == "/teleop");
    assert_eq!(teleop.unwrap().first_ns, Some(info.start_ns));
}

#[test]
fn the_note_about_a_clock_set_back_is_correct_for_a_pipe() {
    let mut bag = Recording::default();
    let places = ["/a", "/b"].map(|topic| bag.publisher("/base", topic, "std_msgs/Empty"));
    for second in (0..60).chain(30..90) {
        for place in places {
            at(&mut bag, place, second, vec![0; 100]);
        }
    }
    let bytes = write(&bag, Pack::None, 800);
    let mut child = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(["events", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(&bytes).unwrap();
    let output = child.wait_with_output().unwrap();
    let notes = String::from_utf8(output.stderr).unwrap();
    assert!(notes.contains("the two runs overlap"), "{notes}");
}
