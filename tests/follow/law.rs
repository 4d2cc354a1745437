//! Tests of following in one process: the mission collected from a growing recording equals that of the
//! closed one byte for byte, and so do the printed lines, even if the follower or the recorder was killed.

use std::ffi::OsStr;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use bagreel::commands::{LogFormat, LogOptions, log};
use bagreel::internals::base::notice::Notices;
use bagreel::internals::base::time::Period;
use bagreel::internals::graph::window::Length;
use bagreel::internals::mission::{Mission, write_json};
use bagreel::internals::pipeline::follow::{Feed, FindingFeed, Follow, Growth};
use bagreel::internals::pipeline::{Reading, Unwatched, read};
use tempfile::TempDir;

use super::recorders::{Chance, EXAMPLES, RECORDERS, Recorder, active};

/// A line of the log without time, rates, and length of a silence, which are more precise at the end, as is whether the
/// first message of a topic is a beginning.
fn what(line: &str) -> &str {
    let (_, words) = line.trim_start().split_once("  ").unwrap();
    let end = [" silent", " from ", " → ", " first message", " appeared"]
        .iter()
        .filter_map(|at| words.find(at))
        .min();
    &words[..end.unwrap_or(words.len())]
}

/// The lines that were not revised, sorted.
pub(super) fn held(printed: &[u8]) -> Vec<String> {
    let printed = String::from_utf8(printed.to_vec()).unwrap();
    let mut held: Vec<(String, bool)> = Vec::new();
    for line in printed.lines() {
        let plain = line
            .trim_end_matches(" (so far)")
            .trim_end_matches(" (withdrawn)");
        let is_open = |shown: &(String, bool)| shown.1 && shown.0 == what(plain);
        if line.ends_with(" (withdrawn)") {
            let shown = held.iter().rposition(|shown| shown.0 == what(plain));
            held.remove(shown.expect("what is withdrawn was printed"));
        } else if let Some(shown) = held.iter_mut().find(|shown| is_open(shown)) {
            shown.1 = false;
        } else {
            held.push((what(plain).to_owned(), line.ends_with(" (so far)")));
        }
    }
    let mut held: Vec<String> = held.into_iter().map(|(words, _)| words).collect();
    held.sort();
    held
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

/// A follower and its printed lines.
struct Follower {
    follow: Follow,
    feed: Feed,
    printed: String,
}

impl Follower {
    /// `None` as long as there is no recording.
    fn new(path: &Path) -> Option<Self> {
        let forever = Period::from_nanos(i64::MAX).unwrap();
        Some(Self {
            follow: Follow::new(reading(path), forever).ok()?,
            feed: Feed::default(),
            printed: String::new(),
        })
    }

    fn poll(&mut self) -> Growth {
        let growth = self.follow.poll().unwrap();
        if growth == Growth::More
            && let Some(known) = self.follow.so_far(u64::MAX, Length::All).unwrap()
        {
            for line in self.feed.new_lines(&known, LogFormat::Text) {
                self.printed += &line.text(None);
            }
        }
        growth
    }
}

/// The polls after which a growing database and a folder have been read to their end.
const LAST_POLLS: usize = 24;

/// Records, and polls a few times between two writes; half of the time the follower is killed on the way and another
/// one begins; every fifth time the recorder is killed.
fn holds(name: &str, what: &str, recorder: Recorder, seed: u64) {
    let folder = TempDir::new().unwrap();
    let (path, mut chance) = (folder.path().join(what), Chance(seed));
    let killed = (seed % 2 == 1).then(|| 1 + chance.below(8));
    let end = (seed % 5 == 4).then(|| 1 + chance.below(10));
    let (mut steps, mut follower) = (0, None);
    let closed = recorder(folder.path(), &mut chance, &mut |chance| {
        steps += 1;
        if Some(steps) == killed {
            follower = None;
        }
        if follower.is_none() {
            follower = Follower::new(&path);
        }
        for _ in 0..chance.below(6) {
            follower.as_mut().map(Follower::poll);
        }
        (Some(steps) != end).then_some(())
    });
    let mut follower = follower.or_else(|| Follower::new(&path)).unwrap();
    let polls = (0..LAST_POLLS).map(|_| follower.poll());
    let ended = polls.filter(|growth| *growth == Growth::Ended).count();
    let known = follower.follow.so_far(u64::MAX, Length::Auto).unwrap();
    let closed = closed.unwrap_or(path);
    let Ok(expected) = read(&reading(&closed), &mut Unwatched) else {
        assert!(known.is_none() && end.is_some(), "{name}, seed {seed}");
        return;
    };
    let log = log(&expected, LogFormat::Text, LogOptions::default());
    let known = known.unwrap().mission;
    // Only the reader of the closed recording tries to recover a part of a compressed chunk that was never
    // closed.
    if end.is_none() || name != "bag, lz4" {
        assert!(json(known) == json(expected), "{name}, seed {seed}: JSON");
        let printed = follower.printed.as_bytes();
        assert_eq!(held(printed), held(log.as_bytes()), "{name}, seed {seed}");
    }
    // A recorder may be killed after its last write.
    let must_end = end.is_none() && !name.starts_with("db3");
    assert!(ended > 0 || !must_end, "{name}, seed {seed}: its end");
}

#[test]
fn the_followed_mission_equals_the_closed_recording() {
    std::thread::scope(|scope| {
        for (name, what, recorder) in RECORDERS {
            scope.spawn(move || (0..10).for_each(|seed| holds(name, what, *recorder, seed)));
        }
        for (name, what, recorder) in EXAMPLES {
            scope.spawn(move || (0..2).for_each(|seed| holds(name, what, *recorder, seed)));
        }
    });
}

/// The lines about findings of a growing copy of a bag.
fn found(bag: &Path, expect: &Path) -> Vec<String> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(bag.file_name().unwrap());
    let bytes = std::fs::read(bag).unwrap();
    let is_rosbag = bytes.starts_with(b"#ROSBAG");
    let mut findings = FindingFeed::new(expect).unwrap();
    let length = findings.length();
    let (mut follow, mut printed) = (None, Vec::new());
    for step in 1..=STEPS {
        let cut = bytes.len() * step / STEPS;
        let now = if cut < bytes.len() && is_rosbag {
            active(&bytes, cut)
        } else {
            bytes[..cut].to_vec()
        };
        // As by a recorder, in the same file.
        let mut file = std::fs::OpenOptions::new();
        let file = file.create(true).truncate(false).write(true).open(&path);
        file.unwrap().write_all(&now).unwrap();
        let forever = Period::from_nanos(i64::MAX).unwrap();
        follow = follow.or_else(|| Follow::new(reading(&path), forever).ok());
        let Some(follow) = &mut follow else { continue };
        while follow.poll().unwrap() == Growth::More {}
        if let Some(known) = follow.so_far(u64::MAX, length).unwrap() {
            let lines = findings.new_lines(&known, LogFormat::Text);
            printed.extend(
                lines
                    .iter()
                    .map(|line| format!("{step}: {}", line.text(None))),
            );
        }
    }
    printed
}

/// The parts in which a recording grows.
const STEPS: usize = 60;

#[test]
fn following_a_healthy_run_prints_no_finding() {
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (examples, shared) = (project.join("examples"), project.join("../shared/data"));
    let bags = [
        examples.join("warehouse.bag"),
        examples.join("courier.mcap"),
        shared.join("mini/mini_late.bag"),
        shared.join("mini/mini_lz4.bag"),
        shared.join("bags/example/example.bag"),
        shared.join("bags/movebase/movebase_simtime.bag"),
        shared.join("bags/paper/mcap1/mcap1_0.mcap"),
        shared.join("bags/docker_mcap/test/test_0.mcap"),
        shared.join("mini/mini_bz2.bag"),
        shared.join("bags/mission/mission.bag"),
        shared.join("bags/paper/turtlesim.bag"),
        shared.join("bags/derived/mission_ros1_lz4.mcap"),
        shared.join("inspect/inspect.bag"),
        shared.join("inspect/inspect_chosen.bag"),
    ];
    std::thread::scope(|scope| {
        for bag in bags.iter().filter(|bag| bag.exists()) {
            scope.spawn(move || {
                let folder = TempDir::new().unwrap();
                let own = folder.path().join("graph.yaml");
                let args = [
                    OsStr::new("baseline"),
                    bag.as_os_str(),
                    OsStr::new("-o"),
                    own.as_os_str(),
                ];
                let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
                    .args(args)
                    .output();
                assert!(done.unwrap().status.success());
                assert_eq!(found(bag, &own), [""; 0], "{}", bag.display());
            });
        }
    });
}

#[test]
fn what_is_missing_is_printed_once_its_time_is_over() {
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("graph.yaml");
    let text = "schema: bagreel.expect/1\ntopics:\n  /lost: {within: ..5s}\n  /later: {}\n";
    std::fs::write(&file, text).unwrap();
    let lines = found(&bag, &file);
    assert!(
        lines.len() == 1 && lines[0].contains("/lost is not in the bag"),
        "{lines:?}"
    );
}

/// `cargo test --release --test tests follow::law -- --ignored --nocapture`
#[test]
#[ignore = "takes half an hour"]
fn a_thousand_followed_recordings_of_each_kind_equal_the_closed_ones() {
    std::thread::scope(|scope| {
        for (name, what, recorder) in RECORDERS {
            scope.spawn(move || {
                for seed in 0..1000 {
                    holds(name, what, *recorder, seed);
                    if seed % 100 == 99 {
                        println!("{name}: {} seeds", seed + 1);
                    }
                }
            });
        }
    });
}
