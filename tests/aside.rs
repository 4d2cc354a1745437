//! Tests with messages that are set aside, as their times are impossible: they prove nothing, neither lives nor restarts,
//! and no rate contains them.

use std::fs;
use std::path::{Path, PathBuf};

use bagreel::internals::base::notice::NoticeKind;
use bagreel::internals::base::time::{Moment, Stamp};
use bagreel::internals::mission::event_log::Kind;
use bagreel::internals::mission::info::{Info, info};
use bagreel::{Mission, Reading, read};

use crate::damaged::bagreel;
use crate::edges::log1;
use crate::pairs::LOG;
use crate::support::rosbag1::{Pack, write};
use crate::support::{ORIGIN, Recording};

const SECOND: i64 = 1_000_000_000;

/// Three seconds of a driver, in this year.
fn wall() -> Recording {
    let mut bag = Recording::default();
    let odom = bag.publisher("/driver", "/odom", "std_msgs/Empty");
    bag.send(odom, (0, 3_000), 100, &[]);
    bag
}

/// Adds log records of a node in 1970, at these seconds with these numbers.
fn simulated(bag: &mut Recording, records: &[(i64, u32)]) {
    let log = bag.publisher("/lift", "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut bag.publishers[log].definition);
    for (second, number) in records {
        let mut record = log1("/lift", "floor", "lift.cpp", &["/lift/state", "/rosout"]);
        record[..4].copy_from_slice(&number.to_le_bytes());
        bag.messages.push((log, second * SECOND, record));
    }
    bag.messages.sort_by_key(|m| m.1);
}

fn written(folder: &Path, bags: &[(&str, &Recording)]) -> Vec<PathBuf> {
    let place = |(name, bag): &(&str, &Recording)| {
        let path = folder.join(name);
        fs::write(&path, write(bag, Pack::None, 768 * 1024)).unwrap();
        path
    };
    bags.iter().map(place).collect()
}

/// The mission, of which nothing lies outside of its time.
fn sound(reading: &Reading) -> Mission {
    let mission = read(reading).unwrap();
    let inside = |at: Stamp| mission.span.start <= at && at <= mission.span.end;
    let elements = &mission.elements;
    let edges = elements.publishes.iter().chain(&elements.subscribes);
    let seen = edges.map(|edge| &edge.seen);
    let seen = seen.chain(elements.nodes.iter().map(|node| &node.seen));
    let seen = seen.chain(elements.topics.iter().map(|topic| &topic.seen));
    for life in seen.flat_map(|seen| &seen.lives) {
        assert!(life.start < life.end, "{life:?}");
        assert!(inside(life.start) && inside(life.end), "{life:?}");
    }
    for event in &mission.log.events {
        assert!(inside(event.time), "{event:?}");
        assert!(event.until.is_none_or(inside), "{event:?}");
    }
    assert!(mission.log.interruptions.iter().all(|one| inside(one.time)));
    mission
}

fn warnings(mission: &Mission) -> Vec<String> {
    let all = mission.notices.iter();
    let all = all.filter(|notice| notice.kind == NoticeKind::ImpossibleTime);
    all.map(|notice| notice.text).collect()
}

#[test]
fn messages_before_a_simulated_clock_are_noted_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let mut bag = wall();
    let odom = bag.messages[0].clone();
    bag.messages
        .splice(0..0, (0..150).map(|_| (odom.0, 0, odom.2.clone())));
    let path = written(folder.path(), &[("one.bag", &bag)]).remove(0);
    let mission = sound(&Reading::of([&path]));
    assert_eq!(mission.messages, 30);
    assert!(mission.log.events.is_empty(), "{:?}", mission.log.events);
    assert_eq!(warnings(&mission), [] as [&str; 0]);
    let (code, said) = bagreel(&["info", path.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains("message at time 0, before the clock was known, set aside (150 times)"),
        "{said}"
    );
}

#[test]
fn a_restart_before_the_clock_was_set_is_none() {
    let folder = tempfile::tempdir().unwrap();
    for records in [&[(100, 2), (111, 1)][..], &[(0, 9), (100, 2), (111, 1)]] {
        let mut bag = wall();
        simulated(&mut bag, records);
        let mission = sound(&Reading::of(written(folder.path(), &[("one.bag", &bag)])));
        assert_eq!(mission.messages, 30);
        assert!(mission.log.events.is_empty(), "{:?}", mission.log.events);
        assert_eq!(
            warnings(&mission),
            ["message at an impossible time, set aside"]
        );
    }
}

#[test]
fn a_bag_in_simulated_time_beside_one_in_wall_time_is_set_aside_until_it_is_moved() {
    let folder = tempfile::tempdir().unwrap();
    let mut other = Recording::default();
    simulated(&mut other, &[(100, 2), (111, 1)]);
    let paths = written(folder.path(), &[("wall.bag", &wall()), ("sim.bag", &other)]);
    let offset = ORIGIN - 100 * SECOND;
    for paths in [paths.clone(), paths.iter().rev().cloned().collect()] {
        let mut reading = Reading::of(paths);
        let mission = sound(&reading);
        assert_eq!((mission.messages, mission.log.events.len()), (30, 0));
        assert_eq!(warnings(&mission).len(), 1);
        let advice = format!("`--offset sim.bag={:+}.000s` puts", offset / SECOND);
        let mut said = mission.notices.iter();
        assert!(
            said.any(|notice| notice.text.contains(&advice)),
            "{:?}",
            mission.notices
        );
        reading.offsets.push(("sim.bag".into(), offset));
        let mission = sound(&reading);
        assert_eq!((mission.messages, warnings(&mission).len()), (32, 0));
        let restarts = mission.log.events.iter();
        let restarts = restarts.filter(|event| event.kind == Kind::Restarted);
        assert_eq!(restarts.count(), 1);
    }
}

#[test]
fn messages_before_a_simulation_runs_are_set_aside_however_many() {
    let folder = tempfile::tempdir().unwrap();
    let joints = |at: i64| {
        let mut bag = Recording::default();
        let joint = bag.publisher("/arm", "/joint", "std_msgs/Empty");
        let times = std::iter::repeat_n(0, 150).chain((0..50).map(|n| at + n * SECOND / 10));
        bag.messages.extend(times.map(|at| (joint, at, Vec::new())));
        bag
    };
    for (begin, messages) in [(1234 * SECOND, 50), (SECOND / 100, 200)] {
        let paths = written(folder.path(), &[("sim.bag", &joints(begin))]);
        let mission = sound(&Reading::of(paths));
        assert_eq!(mission.messages, messages);
        assert!(mission.span.nanos() < 6 * SECOND);
        assert_eq!(warnings(&mission), [] as [&str; 0]);
    }
}

#[test]
fn a_part_is_cut_out_by_the_times_that_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let of = |reading: &Reading| {
        let mission = sound(reading);
        (mission.messages, mission.span.nanos() / SECOND)
    };
    let part = |bag: &Recording, change: &dyn Fn(&mut Reading)| {
        let mut reading = Reading::of(written(folder.path(), &[("one.bag", bag)]));
        change(&mut reading);
        of(&reading)
    };
    let late = |reading: &mut Reading| reading.division.start = Some(Moment::AfterStart(SECOND));
    let early = |reading: &mut Reading| reading.division.end = Some(Moment::AfterStart(SECOND));
    let mut bag = wall();
    simulated(&mut bag, &[(100, 1)]);
    assert_eq!(part(&bag, &late), (20, 1));
    assert_eq!(part(&bag, &early), (10, 1));
    // The clock goes back by two seconds after three.
    let mut bag = wall();
    let again = |n| (0, ORIGIN + SECOND + n * SECOND / 10, Vec::new());
    bag.messages.extend((0..100).map(again));
    let other = bag.publisher("/other", "/other", "std_msgs/Empty");
    let beside: Vec<_> = bag
        .messages
        .iter()
        .map(|m| (other, m.1, Vec::new()))
        .collect();
    bag.messages.extend(beside);
    assert_eq!(part(&bag, &early).1, 1);
    assert_eq!(part(&bag, &|_| ()).0, 260);
}

/// The summary of one bag.
fn summed(bag: &Recording) -> Info {
    let folder = tempfile::tempdir().unwrap();
    info(&sound(&Reading::of(written(
        folder.path(),
        &[("one.bag", bag)],
    ))))
}

/// The rate of a topic with one decimal.
fn hz(info: &Info, name: &str) -> Option<String> {
    let topic = info.topics.iter().find(|topic| topic.name == name).unwrap();
    topic.hz.map(|hz| format!("{hz:.1}"))
}

#[test]
fn a_rate_is_that_from_the_first_message_to_the_last() {
    let mut bag = Recording::default();
    let late = bag.publisher("/talker", "/chatter", "std_msgs/Empty");
    let other = bag.publisher("/other", "/other", "std_msgs/Empty");
    let once = bag.publisher("/other", "/once", "std_msgs/Empty");
    let log = bag.publisher("/talker", "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut bag.publishers[log].definition);
    bag.send(late, (50_000, 60_000), 100, &[]);
    bag.send(other, (0, 60_000), 100, &[]);
    bag.send(once, (30_000, 30_001), 100, &[]);
    // It names the topic all the time.
    let record = log1("/talker", "alive", "talker.cpp", &["/chatter", "/rosout"]);
    bag.send(log, (0, 60_000), 5_000, &record);
    let info = summed(&bag);
    assert_eq!(
        (hz(&info, "/chatter"), hz(&info, "/other")),
        (Some("10.0".into()), Some("10.0".into()))
    );
    assert_eq!(
        (hz(&info, "/once"), hz(&info, "/rosout")),
        (None, Some("0.2".into()))
    );
}

#[test]
fn a_single_message_has_no_rate() {
    let mut bag = Recording::default();
    let once = bag.publisher("/node", "/once", "std_msgs/Empty");
    bag.send(once, (0, 1), 1, &[]);
    let info = summed(&bag);
    assert_eq!(hz(&info, "/once"), None);
    let node = info.nodes.iter().find(|node| node.name == "/node").unwrap();
    assert_eq!((node.sent, node.sent_hz), (Some(1), None));
    // Both at one time.
    bag.messages.push(bag.messages[0].clone());
    assert_eq!(hz(&summed(&bag), "/once"), None);
}
