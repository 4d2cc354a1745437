use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::*;
use crate::base::notice::Notices;
use crate::mission::events::{LogFormat, LogOptions, log};
use crate::mission::write_json;
use crate::pipeline::{Unwatched, read};

/// Numbers that look random and are the same on every run.
struct Chance(u64);

impl Chance {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 33) % n
    }
}

fn example(name: &str) -> Vec<u8> {
    std::fs::read(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("examples")
            .join(name),
    )
    .unwrap()
}

fn reading(path: &Path) -> Reading {
    let mut reading = Reading::of([path]);
    // The index does not contain everything in the records.
    reading.collect.sizes = true;
    reading.collect.payload_bytes = 0;
    reading
}

/// A mission's JSON, except how its bag was read.
fn json(mut mission: Mission) -> String {
    mission.bags.clear();
    mission.notices = Notices::new();
    let mut json = Vec::new();
    write_json(&mission, &mut json).unwrap();
    String::from_utf8(json).unwrap()
}

/// Follows `bytes` as they are appended in random cuts; returns the final mission, and the lines that were not revised.
fn followed(path: &Path, bytes: &[u8], seed: u64) -> (Mission, Vec<String>) {
    let mut chance = Chance(seed);
    let mut file = std::fs::File::create(path).unwrap();
    let mut at = 64 + usize::try_from(chance.below(5000)).unwrap();
    file.write_all(&bytes[..at]).unwrap();
    let mut follow = Follow::new(reading(path), Period::from_nanos(i64::MAX).unwrap()).unwrap();
    let (mut feed, mut lines) = (Feed::default(), Vec::new());
    let most = bytes.len() as u64 / (2 + chance.below(10)) + 1;
    loop {
        let growth = follow.poll().unwrap();
        if let Some(known) = follow
            .so_far(u64::MAX, Length::All)
            .unwrap()
            .filter(|_| growth == Growth::More)
        {
            for line in feed.news(&known, LogFormat::Text) {
                if let Some(gone) = line.strip_suffix(" (withdrawn)") {
                    let at = lines
                        .iter()
                        .rposition(|line: &String| what(line) == what(gone));
                    lines.remove(at.expect("a line that was told"));
                } else {
                    let same = |printed: &String| {
                        printed.ends_with(" (so far)") && what(printed) == what(&line)
                    };
                    lines.retain(|printed| !same(printed));
                    lines.push(line);
                }
            }
        }
        if growth == Growth::Ended {
            break;
        }
        let next = (at + usize::try_from(chance.below(most)).unwrap() + 1).min(bytes.len());
        file.write_all(&bytes[at..next]).unwrap();
        at = next;
    }
    assert_eq!(at, bytes.len());
    let known = follow.so_far(u64::MAX, Length::Auto).unwrap().unwrap();
    (known.mission, lines)
}

/// A line of the log without time, rates, and length of a silence, which are more precise at the end.
fn what(line: &str) -> &str {
    let line = line.trim_end_matches(" (so far)");
    let (_, words) = line.trim_start().split_once("  ").unwrap();
    let end = [" silent", " from ", " → "]
        .iter()
        .filter_map(|at| words.find(at))
        .min();
    &words[..end.unwrap_or(words.len())]
}

fn holds(name: &str, seeds: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join(name);
    let bytes = example(name);
    std::fs::write(&path, &bytes).unwrap();
    let closed = read(&reading(&path), &mut Unwatched).unwrap();
    let expected = json(closed.clone());
    let log = log(&closed, LogFormat::Text, LogOptions::default());
    // Whether several events are a mode switch is only known at the end.
    let events = log.lines().filter(|line| !line.contains("mode switch"));
    let log: Vec<&str> = events.map(what).collect();
    for seed in seeds {
        let (mission, lines) = followed(&path, &bytes, seed);
        assert!(json(mission) == expected, "{name}, seed {seed}");
        let printed = lines.iter().map(|line| what(line));
        let mut printed: Vec<&str> = printed.collect();
        printed.sort_unstable();
        let mut log = log.clone();
        log.sort_unstable();
        assert_eq!(printed, log, "{name}, seed {seed}");
    }
}

#[test]
fn the_followed_mission_equals_the_closed_recording() {
    for name in ["courier.mcap", "warehouse.bag"] {
        holds(name, 0..4);
    }
}

/// `cargo test --release --lib follow -- --ignored`
#[test]
#[ignore = "takes minutes"]
fn a_thousand_followed_recordings_equal_the_closed_ones() {
    for name in ["courier.mcap", "warehouse.bag"] {
        holds(name, 0..1000);
    }
}

#[test]
fn dropped_messages_keep_their_printed_events() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("courier.mcap");
    std::fs::write(&path, example("courier.mcap")).unwrap();
    let keep = Period::from_nanos(20_000_000_000).unwrap();
    let mut follow = Follow::new(reading(&path), keep).unwrap();
    while follow.poll().unwrap() != Growth::Ended {}
    let known = follow.so_far(u64::MAX, Length::All).unwrap().unwrap();
    assert_eq!(known.from, follow.forgotten.unwrap());
    assert!(known.now.since(known.from) <= 25_000_000_000);
    let topic = |name: &str| {
        known
            .mission
            .elements
            .topics
            .iter()
            .any(|t| t.name.as_str() == name)
    };
    assert!(
        topic("/robot_description"),
        "a latched message is long ago and still holds"
    );
    // Times are still counted from the first message.
    assert_eq!(Some(known.mission.span.start), follow.origin);
}
