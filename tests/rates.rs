//! Tests of rates: those that begin from about none, and the two numbers of a topic, which are the same in every output.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::causes::shown;
use crate::questions::printed;
use crate::support::cdr::Cdr;
use crate::support::{Recording, mcap};

/// Two minutes and ten seconds in which a topic is sent in these seconds at 25 Hz, and once at each of `strays`.
fn bursts(strays: &[i64], bursts: &[(i64, i64)]) -> Recording {
    let mut bag = Recording::default();
    let odom = bag.publisher("/base", "/odom", "std_msgs/Empty");
    bag.send(odom, (0, 130_000), 100, &[]);
    let speed = bag.publisher("/pilot", "/cmd_vel", "std_msgs/Empty");
    for (from, to) in bursts {
        bag.send(speed, (from * 1_000, to * 1_000), 40, &[]);
    }
    for at in strays {
        bag.send(speed, (*at, at + 1), 1, &[]);
    }
    bag
}

/// The log of a bag whose publishers are unknown.
fn unnamed(bag: &Recording) -> String {
    let dir = tempfile::tempdir().unwrap();
    let options = mcap::Options::default();
    let mut bag = bag.clone();
    bag.publishers.iter_mut().for_each(|own| own.node.clear());
    fs::write(dir.path().join("r.mcap"), mcap::write(&bag, &options)).unwrap();
    printed(dir.path(), "events r.mcap")
}

#[test]
fn a_stray_message_hides_neither_the_start_of_a_rate_nor_its_end() {
    for strays in [&[1_800][..], &[1_800, 1_850], &[200, 20_000, 40_000]] {
        let text = unnamed(&bursts(strays, &[(93, 124)]));
        assert!(text.contains("01:33.0  /cmd_vel 0.0"), "{text}");
        assert!(text.contains("→ 25 Hz"), "{text}");
        assert!(text.contains("02:03.9  /cmd_vel"), "{text}");
        let text = shown(&bursts(strays, &[(93, 124)]));
        assert!(
            text.contains("→ 25 Hz") && text.contains("stopped"),
            "{text}"
        );
    }
}

#[test]
fn the_end_of_a_second_burst_is_an_event() {
    let text = unnamed(&bursts(&[], &[(10, 30), (93, 120)]));
    assert!(
        text.contains("00:30.0  /cmd_vel silent") || text.contains("00:29.9  /cmd_vel silent"),
        "{text}"
    );
    assert!(
        text.contains("01:59.9  /cmd_vel silent to the end"),
        "{text}"
    );
}

#[test]
fn a_burst_after_stray_messages_is_an_event_whatever_came_before() {
    let twice = [(10, 30), (93, 110)];
    for strays in [&[60_000][..], &[1_800, 60_000], &[45_000, 60_000, 80_000]] {
        for text in [
            unnamed(&bursts(strays, &twice)),
            shown(&bursts(strays, &twice)),
        ] {
            let line = text
                .lines()
                .find(|line| line.contains("01:33.0"))
                .unwrap_or_default();
            assert!(
                line.contains("/cmd_vel 0.0") && line.ends_with("→ 25 Hz"),
                "{text}"
            );
        }
    }
    // Enough of them show a rhythm, which changes; and without any the silence between the bursts says it.
    let often: Vec<i64> = (0..8).map(|k| 45_000 + k * 5_000).collect();
    let text = unnamed(&bursts(&often, &twice));
    assert!(text.contains("~01:33  /cmd_vel 0.2 → 25 Hz"), "{text}");
    let text = unnamed(&bursts(&[], &twice));
    assert!(
        text.contains("silent for 1 min 3 s") && !text.contains("→"),
        "{text}"
    );
}

/// A bag in which `/pose` is sent all the time, and `/cmd_vel` by somebody who presses keys, from 7 s to 27 s.
fn keys() -> Recording {
    let mut bag = Recording::default();
    let pose = bag.publisher("/turtle", "/pose", "std_msgs/Empty");
    bag.send(pose, (0, 31_000), 16, &[]);
    let speed = bag.publisher("/keys", "/cmd_vel", "std_msgs/Empty");
    for at in [
        7_000, 7_400, 8_900, 9_000, 9_100, 11_000, 12_300, 14_000, 15_900, 17_000, 18_100, 20_000,
        22_000, 24_000, 27_000,
    ] {
        bag.send(speed, (at, at + 1), 1, &[]);
    }
    bag.publishers.iter_mut().for_each(|own| own.node.clear());
    bag
}

#[test]
fn a_topic_that_is_sent_at_times_is_named_where_nothing_changed() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = mcap::write(&keys(), &mcap::Options::default());
    fs::write(dir.path().join("r.mcap"), bytes).unwrap();
    let text = printed(dir.path(), "events r.mcap --phases auto");
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    // Neither the sentence nor the phases claim a change that no line tells.
    let expected = [
        "31 s: 2 topics, /cmd_vel at times, nothing changed",
        "00:00.0  ── phase 1: 2 topics ──",
    ];
    assert_eq!(lines, expected);
    let info = printed(dir.path(), "info r.mcap");
    assert!(info.starts_with(expected[0]), "{info}");
    for line in info
        .lines()
        .filter(|line| line.contains("bagreel figure --kind"))
    {
        let kind = line.split(' ').nth(6).unwrap().trim_end_matches('`');
        let drawn = printed(
            dir.path(),
            &format!("figure r.mcap --kind {kind} -o {kind}.svg --quiet"),
        );
        assert!(
            dir.path().join(format!("{kind}.svg")).exists(),
            "{line}: {drawn}"
        );
    }
    // Phases of the user remain.
    fs::write(dir.path().join("p.txt"), "0:00 wait\n0:10 drive\n").unwrap();
    let text = printed(dir.path(), "events r.mcap --phases p.txt");
    assert!(text.contains("phase 2: drive"), "{text}");
}

#[test]
fn the_recorder_hides_no_topic() {
    let mut bag = Recording::default();
    let log = bag.publisher("", "/rosout", "rcl_interfaces/msg/Log");
    let odom = bag.publisher("", "/odom", "std_msgs/msg/Empty");
    bag.send(odom, (0, 60_000), 100, &[]);
    let servo = bag.publisher("", "/servo/in/state", "std_msgs/msg/Empty");
    bag.send(servo, (20_000, 60_000), 100, &[]);
    for (at, topic) in [(0, "/odom"), (20_000, "/servo/in/state")] {
        let head = Cdr::default().time(1).u8(20).text("rosbag2_recorder");
        let record = head.text(&format!("Subscribed to topic '{topic}'"));
        let file = "./src/rosbag2_transport/recorder.cpp";
        let record = record.text(file).text("f").u32(7).done();
        bag.send(log, (at, at + 1), 1, &record);
    }
    let text = unnamed(&bag);
    assert!(text.contains("/servo/in/state appeared"), "{text}");
}

/// Both numbers of a topic as JSON of `info`.
fn numbers(folder: &Path, bag: &str) -> Vec<(String, Option<f64>, Option<f64>)> {
    let info: Value =
        serde_json::from_str(&printed(folder, &format!("info {bag} --format json"))).unwrap();
    let topics = info["topics"].as_array().unwrap().iter();
    let topics = topics.map(|one| {
        let name = one["name"].as_str().unwrap().to_owned();
        (name, one["hz"].as_f64(), one["mean_hz"].as_f64())
    });
    topics.collect()
}

#[test]
fn a_few_messages_have_no_rate() {
    let rate = |messages: i64| {
        let mut bag = bursts(&[], &[]);
        bag.send(1, (60_000, 60_000 + 9 * messages), 9, &[]);
        let dir = tempfile::tempdir().unwrap();
        let bytes = mcap::write(&bag, &mcap::Options::default());
        fs::write(dir.path().join("r.mcap"), bytes).unwrap();
        let all = numbers(dir.path(), "r.mcap");
        all.into_iter().find(|one| one.0 == "/cmd_vel").unwrap().1
    };
    assert_eq!(rate(4), None);
    assert!(rate(5).unwrap() > 100.0);
}

#[test]
fn a_topic_has_one_rate_while_sending_in_every_output() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
    fs::copy(example, here.join("w.bag")).unwrap();
    let numbers = numbers(here, "w.bag");
    printed(here, "render w.bag --period all -o w.md -o w.svg");
    printed(
        here,
        "figure w.bag --rows topics --phases none --width 181mm -o lives.svg",
    );
    let read = |name: &str| fs::read_to_string(here.join(name)).unwrap();
    let (report, picture, figure) = (read("w.md"), read("w.svg"), read("lives.svg"));
    let text = printed(here, "info w.bag");
    assert!(text.contains("while sending") && report.contains("Hz while sending"));
    assert!(picture.contains("rates while sending") && figure.contains("while sending"));
    let mut compared = 0;
    for (name, hz, mean_hz) in &numbers {
        let Some(hz) = hz else { continue };
        assert!(
            mean_hz.is_none_or(|mean| mean <= hz * 1.1 + 0.01),
            "{name}: {hz}, {mean_hz:?}"
        );
        let number = bagreel::internals::base::words::number(*hz);
        let row = report
            .lines()
            .find(|line| line.starts_with(&format!("| `{name}` | `")));
        if let Some(row) = row {
            assert!(row.contains(&format!("| {number} |")), "{number}: {row}");
            compared += 1;
        }
        let row = text
            .lines()
            .find(|line| line.split_whitespace().next() == Some(name))
            .unwrap();
        assert!(
            row.contains(&bagreel::internals::base::words::rate(*hz)),
            "{hz}: {row}"
        );
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn a_difference_of_rates_is_one_pair_of_numbers_with_its_word() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let write = |name: &str, bag: &Recording| {
        let bytes =
            crate::support::rosbag1::write(bag, crate::support::rosbag1::Pack::None, 20_000);
        fs::write(here.join(name), bytes).unwrap();
    };
    let steady = |period: i64| {
        let mut bag = Recording::default();
        let scan = bag.publisher("/lidar", "/scan", "std_msgs/Empty");
        bag.send(scan, (0, 120_000), period, &[]);
        bag
    };
    write("a.bag", &steady(100));
    write("b.bag", &steady(200));
    let text = printed(here, "diff a.bag b.bag -o d.html -o d.md");
    assert!(text.contains("10 Hz → 5 Hz while sending"), "{text}");
    let page = fs::read_to_string(here.join("d.html")).unwrap();
    assert!(page.contains("10 → 5 Hz"));
    // The same rate for half of the time.
    let halves: Vec<(i64, i64)> = (0..12).map(|n| (10 * n, 10 * n + 5)).collect();
    let whole: Vec<(i64, i64)> = (0..12).map(|n| (10 * n, 10 * n + 10)).collect();
    write("a.bag", &bursts(&[], &whole));
    write("b.bag", &bursts(&[], &halves));
    let text = printed(here, "diff a.bag b.bag");
    assert!(text.contains("over the recording"), "{text}");
}
