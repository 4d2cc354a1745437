//! Tests of following growing recordings: the final outputs equal those of the closed recording byte for byte, and the
//! lines that were not revised are its event log.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rusqlite::{Connection, params};
use tempfile::TempDir;

use crate::support::mission::mission;
use crate::support::rosbag1::{self, Pack};
use crate::support::{Recording, browser, mcap, small, sqlite3};

/// Numbers that look random and are the same on every run.
struct Chance(u64);

impl Chance {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        usize::try_from((self.0 >> 33) % n as u64).unwrap()
    }

    /// Waits as a recorder does between two writes.
    fn pause(&mut self) {
        sleep(Duration::from_millis(self.below(60) as u64));
    }

    /// Sorted places in `0..=len`, the last `len` itself.
    fn cuts(&mut self, len: usize) -> Vec<usize> {
        let count = 3 + self.below(12);
        let mut cuts: Vec<usize> = (0..count).map(|_| self.below(len)).collect();
        cuts.extend([40.min(len), len]);
        cuts.sort_unstable();
        cuts
    }
}

/// A way of recording: writes a recording into a folder step by step; `step` is called between two steps. Returns the
/// closed recording.
type Recorder = fn(&Path, &mut Chance, &mut dyn FnMut()) -> PathBuf;

const RECORDERS: &[(&str, &str, Recorder)] = &[
    ("bag", "r.bag.active", |folder, chance, step| {
        rosbag(Pack::None, folder, chance, step)
    }),
    ("bag, lz4", "r.bag.active", |folder, chance, step| {
        rosbag(Pack::Lz4, folder, chance, step)
    }),
    ("mcap", "r.mcap", |folder, chance, step| {
        let bytes = mcap::write(&mission(), &options(true));
        append(&folder.join("r.mcap"), &bytes, chance, step)
    }),
    ("mcap without chunks", "r.mcap", |folder, chance, step| {
        let bytes = mcap::write(&mission(), &options(false));
        append(&folder.join("r.mcap"), &bytes, chance, step)
    }),
    ("folder of mcap", "r", |folder, chance, step| {
        let folder = made(folder);
        for (at, part) in halves().iter().enumerate() {
            let path = folder.join(format!("r_{at}.mcap"));
            append(&path, &mcap::write(part, &options(true)), chance, step);
        }
        closed(folder, ["r_0.mcap", "r_1.mcap"], "mcap")
    }),
    ("db3", "r.db3", |folder, chance, step| {
        database(&mission(), &folder.join("r.db3"), OPTIMISED, chance, step)
    }),
    ("db3 with a log", "r.db3", |folder, chance, step| {
        database(&mission(), &folder.join("r.db3"), RESILIENT, chance, step)
    }),
    ("folder of db3", "r", |folder, chance, step| {
        let folder = made(folder);
        for (at, part) in halves().iter().enumerate() {
            let path = folder.join(format!("r_{at}.db3"));
            database(part, &path, OPTIMISED, chance, step);
        }
        closed(folder, ["r_0.db3", "r_1.db3"], "sqlite3")
    }),
];

/// How rosbag2 opens a database, by default and with `--storage-preset-profile resilient`.
const OPTIMISED: &str = "PRAGMA journal_mode=MEMORY; PRAGMA synchronous=OFF;";
const RESILIENT: &str = "PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;";

fn options(chunked: bool) -> mcap::Options {
    mcap::Options {
        profile: "ros2",
        chunked,
        ..mcap::Options::default()
    }
}

fn made(folder: &Path) -> PathBuf {
    let folder = folder.join("r");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The metadata that rosbag2 writes when it closes a recording.
fn closed(folder: PathBuf, files: [&str; 2], storage: &str) -> PathBuf {
    sqlite3::write_metadata(&mission(), &folder, storage, &files);
    folder
}

/// The two files of a recording that was split.
fn halves() -> [Recording; 2] {
    let whole = mission();
    let middle = whole.messages.len() / 2;
    let part = |messages: &[(usize, i64, Vec<u8>)]| Recording {
        messages: messages.to_vec(),
        ..whole.clone()
    };
    [
        part(&whole.messages[..middle]),
        part(&whole.messages[middle..]),
    ]
}

fn append(path: &Path, bytes: &[u8], chance: &mut Chance, step: &mut dyn FnMut()) -> PathBuf {
    let mut file = File::create(path).unwrap();
    let mut at = 0;
    for cut in chance.cuts(bytes.len()) {
        file.write_all(&bytes[at..cut]).unwrap();
        at = cut;
        step();
        chance.pause();
    }
    path.to_owned()
}

/// Writes as `rosbag record` does: a head without an index, each chunk's lengths when it is closed, the new name last.
fn rosbag(how: Pack, folder: &Path, chance: &mut Chance, step: &mut dyn FnMut()) -> PathBuf {
    let bytes = rosbag1::write(&small(), how, 20_000);
    let path = folder.join("r.bag.active");
    let mut file = OpenOptions::new()
        .create(true)
        .write(true)
        .truncate(true)
        .open(&path)
        .unwrap();
    for cut in chance.cuts(bytes.len()) {
        let now = if cut < bytes.len() {
            active(&bytes, cut)
        } else {
            bytes.clone()
        };
        file.rewind().unwrap();
        file.write_all(&now).unwrap();
        step();
        chance.pause();
    }
    let closed = folder.join("r.bag");
    fs::rename(path, &closed).unwrap();
    closed
}

/// The first `cut` bytes of a bag as they are while it is recorded.
fn active(bytes: &[u8], cut: usize) -> Vec<u8> {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let mut now = bytes.to_vec();
    let index = bytes.windows(10).position(|w| w == b"index_pos=").unwrap() + 10;
    now[index..index + 8].fill(0);
    let mut at = 13;
    while at < cut {
        let header = at + 4..at + 4 + number(at);
        let body = header.end + 4;
        let end = body + number(header.end);
        let is_chunk = bytes[header.clone()].windows(4).any(|w| w == b"op=\x05");
        if is_chunk && cut < end {
            let size = bytes[header.clone()]
                .windows(5)
                .position(|w| w == b"size=")
                .unwrap();
            let size = header.start + size + 5;
            now[size..size + 4].fill(0);
            now[header.end..body].fill(0);
        }
        at = end;
    }
    now.truncate(cut);
    now
}

/// Writes as rosbag2 does: messages in transactions of any size.
fn database(
    recording: &Recording,
    path: &Path,
    pragmas: &str,
    chance: &mut Chance,
    step: &mut dyn FnMut(),
) -> PathBuf {
    let empty = Recording {
        messages: Vec::new(),
        ..recording.clone()
    };
    sqlite3::write(&empty, path);
    let mut db = Connection::open(path).unwrap();
    db.execute_batch(pragmas).unwrap();
    let mut topics = BTreeMap::new();
    for publisher in &recording.publishers {
        let next = i64::try_from(topics.len()).unwrap() + 1;
        topics
            .entry((&publisher.topic, &publisher.type_name))
            .or_insert(next);
    }
    let mut at = 0;
    for cut in chance.cuts(recording.messages.len()) {
        let all = db.transaction().unwrap();
        for (publisher, time, payload) in &recording.messages[at..cut] {
            let publisher = &recording.publishers[*publisher];
            let row = params![
                topics[&(&publisher.topic, &publisher.type_name)],
                time,
                payload
            ];
            all.execute("INSERT INTO messages VALUES (NULL, ?1, ?2, ?3)", row)
                .unwrap();
        }
        all.commit().expect("nobody locks the database");
        at = cut;
        step();
        chance.pause();
    }
    db.close().unwrap();
    path.to_owned()
}

fn bagreel(folder: &Path, args: &[&str]) -> Command {
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    run.current_dir(folder).args(args);
    run.stdout(Stdio::piped()).stderr(Stdio::piped());
    run
}

/// Follows a recording as soon as its format can be detected.
fn follow(folder: &Path, what: &str) -> Child {
    bagreel(
        folder,
        &["follow", what, "--idle", "1500ms", "-o", "f.json"],
    )
    .spawn()
    .unwrap()
}

fn output(folder: &Path, args: &[&str]) -> Output {
    bagreel(folder, args).output().unwrap()
}

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
fn held(printed: &[u8]) -> Vec<String> {
    let printed = String::from_utf8(printed.to_vec()).unwrap();
    let mut held: Vec<(String, bool)> = Vec::new();
    for line in printed.lines() {
        let plain = line
            .trim_end_matches(" (so far)")
            .trim_end_matches(" (withdrawn)");
        let is_open = |shown: &(String, bool)| shown.1 && shown.0 == what(plain);
        if line.ends_with(" (withdrawn)") {
            let shown = held.iter().rposition(|shown| shown.0 == what(plain));
            held.remove(shown.expect("what is withdrawn was told"));
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

/// Records and follows; half of the time the follower is killed on the way and another one begins.
fn holds(name: &str, what: &str, recorder: Recorder, seed: u64) {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let mut chance = Chance(seed);
    let killed = (seed % 2 == 1).then(|| 2 + chance.below(4));
    let mut steps = 0;
    let mut follower: Option<Child> = None;
    let closed = recorder(folder, &mut chance, &mut || {
        steps += 1;
        if Some(steps) == killed
            && let Some(mut old) = follower.take()
        {
            old.kill().unwrap();
            old.wait().unwrap();
        }
        if follower.is_none() && steps > 1 {
            follower = Some(follow(folder, what));
        }
    });
    let done = follower.unwrap().wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(
        matches!(done.status.code(), Some(0 | 3)),
        "{name}, seed {seed}: {said}"
    );
    let closed = closed.to_str().unwrap();
    output(folder, &["render", closed, "-o", "r.json"]);
    let read = |name: &str| fs::read(folder.join(name)).unwrap();
    assert!(
        read("f.json") == read("r.json"),
        "{name}, seed {seed}: the JSON differs"
    );
    let log = output(folder, &["events", closed]);
    assert_eq!(
        held(&done.stdout),
        held(&log.stdout),
        "{name}, seed {seed}: {said}"
    );
}

#[test]
fn following_to_the_end_equals_reading_the_closed_recording() {
    std::thread::scope(|scope| {
        for (seed, (name, what, recorder)) in (0..).zip(RECORDERS) {
            scope.spawn(move || holds(name, what, *recorder, seed));
        }
    });
}

/// `cargo test --release --test tests follow -- --ignored --nocapture`
#[test]
#[ignore = "takes an hour"]
fn a_thousand_followed_recordings_of_each_kind_equal_the_closed_ones() {
    // A recorder and its follower mostly wait.
    for first in (0..1000).step_by(5) {
        std::thread::scope(|scope| {
            for seed in first..first + 5 {
                for (name, what, recorder) in RECORDERS {
                    scope.spawn(move || holds(name, what, *recorder, seed));
                }
            }
        });
        println!("seeds to {}", first + 4);
    }
}

/// The seconds for which a database is written while it is followed; `FOLLOW_SECONDS=600` is the measured ten minutes.
fn seconds() -> u64 {
    let asked = std::env::var("FOLLOW_SECONDS").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(4)
}

#[test]
fn following_a_database_never_locks_it() {
    for pragmas in [OPTIMISED, RESILIENT] {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("r.db3");
        sqlite3::write(&mission(), &path);
        let db = Connection::open(&path).unwrap();
        db.execute_batch(pragmas).unwrap();
        // Like rosbag2, without any timeout.
        db.busy_timeout(Duration::ZERO).unwrap();
        let mut follower = bagreel(folder.path(), &["follow", "r.db3", "--idle", "1s"])
            .spawn()
            .unwrap();
        let begun = Instant::now();
        let mut written = 0_i64;
        while begun.elapsed() < Duration::from_secs(seconds()) {
            let time = 1_704_067_330_000_000_000 + written * 1_000_000;
            db.execute("INSERT INTO messages VALUES (NULL, 3, ?1, x'00')", [time])
                .unwrap();
            written += 1;
        }
        assert!(written > 100, "{written}");
        db.close().unwrap();
        assert!(follower.wait().unwrap().success());
        let left = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 1, "something was left beside the database");
    }
}

#[test]
fn the_served_page_grows_with_the_recording() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/courier.mcap");
    browser::drive(
        "live.py",
        [Path::new(env!("CARGO_BIN_EXE_bagreel")), &example],
    );
}

#[test]
fn a_signal_ends_following_and_writes_the_outputs() {
    let folder = TempDir::new().unwrap();
    let bag = rosbag1::unindexed(&rosbag1::write(&small(), Pack::None, 20_000));
    fs::write(folder.path().join("r.bag.active"), bag).unwrap();
    let mut follower = bagreel(folder.path(), &["follow", "r.bag.active", "-o", "f.json"])
        .spawn()
        .unwrap();
    sleep(Duration::from_millis(1500));
    assert!(follower.try_wait().unwrap().is_none(), "it follows on");
    let kill = Command::new("kill")
        .args(["-INT", &follower.id().to_string()])
        .status();
    if !kill.is_ok_and(|status| status.success()) {
        println!("skipped: no `kill` here");
        follower.kill().unwrap();
        return;
    }
    let done = follower.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&done.stdout).contains("/joystick started"));
    assert!(folder.path().join("f.json").is_file());
}

#[test]
fn findings_are_printed_once_certain_and_set_the_exit_code() {
    let folder = TempDir::new().unwrap();
    fs::write(
        folder.path().join("r.bag"),
        rosbag1::write(&small(), Pack::Lz4, 20_000),
    )
    .unwrap();
    let file = |topic: &str| format!("schema: bagreel.expect/1\ntopics:\n  {topic}: {{}}\n");
    for (topic, code) in [("/scan", 0), ("/lost", 1)] {
        fs::write(folder.path().join("graph.yaml"), file(topic)).unwrap();
        let done = output(
            folder.path(),
            &["follow", "r.bag", "--expect", "graph.yaml"],
        );
        assert_eq!(done.status.code(), Some(code), "{topic}");
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        assert_eq!(said.contains("topic-missing"), code == 1, "{said}");
    }
    let rows = output(folder.path(), &["follow", "r.bag", "--format", "ndjson"]);
    let rows = String::from_utf8_lossy(&rows.stdout).into_owned();
    let rows: Vec<serde_json::Value> = rows
        .lines()
        .map(|row| serde_json::from_str(row).unwrap())
        .collect();
    assert!(
        rows.iter()
            .any(|row| row["state"] == "sure" && row["name"] == "/joystick")
    );
}

#[test]
fn the_newest_recording_of_a_folder_is_followed() {
    let folder = TempDir::new().unwrap();
    let bag = rosbag1::write(&small(), Pack::Lz4, 20_000);
    fs::write(folder.path().join("notes.txt"), "no bag").unwrap();
    let old = made(folder.path());
    fs::write(
        old.join("r_0.mcap"),
        mcap::write(&mission(), &options(true)),
    )
    .unwrap();
    sleep(Duration::from_millis(20));
    fs::write(folder.path().join("new.bag"), bag).unwrap();
    let done = output(folder.path(), &["follow", "."]);
    assert!(String::from_utf8_lossy(&done.stdout).contains("/joystick started"));
    let empty = TempDir::new().unwrap();
    assert_ne!(
        output(empty.path(), &["follow", "."]).status.code(),
        Some(0)
    );
}
