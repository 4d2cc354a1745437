//! Tests of following growing recordings: the final outputs equal those of the closed recording byte for byte, and the
//! lines that were not revised are its event log.

mod law;
mod recorders;

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

use rusqlite::Connection;
use tempfile::TempDir;

use self::law::held;
use self::recorders::{Chance, OPTIMISED, RECORDERS, RESILIENT, Recorder, made, options};
use crate::support::mission::mission;
use crate::support::rosbag1::{self, Pack};
use crate::support::{Recording, mcap, small, sqlite3};

fn bagreel(folder: &Path, args: &[&str]) -> Command {
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    run.current_dir(folder).args(args);
    run.stdout(Stdio::piped()).stderr(Stdio::piped());
    run
}

/// Longer than a busy machine lets a recorder wait between two writes.
const IDLE: &str = "4s";

/// Follows a recording as soon as its format can be detected.
fn follow(folder: &Path, what: &str) -> Child {
    bagreel(folder, &["follow", what, "--idle", IDLE, "-o", "f.json"])
        .spawn()
        .unwrap()
}

/// What a follower prints; its first line is read at once. From then on it notes signals.
fn begun(follower: &mut Child) -> (BufReader<ChildStdout>, String) {
    let mut lines = BufReader::new(follower.stdout.take().unwrap());
    let mut first = String::new();
    lines.read_line(&mut first).unwrap();
    (lines, first)
}

fn output(folder: &Path, args: &[&str]) -> Output {
    bagreel(folder, args).output().unwrap()
}

/// Records and follows; half of the time the follower is killed on the way and another one begins, and now and then the
/// recorder is.
fn holds(name: &str, what: &str, recorder: Recorder, seed: u64) {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    let mut chance = Chance(seed);
    let killed = (seed % 2 == 1).then(|| 2 + chance.below(4));
    let end = (seed % 5 == 4).then(|| 2 + chance.below(10));
    let mut steps = 0;
    let mut follower: Option<Child> = None;
    let closed = recorder(folder, &mut chance, &mut |chance| {
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
        // The time that a recorder waits between two writes.
        sleep(Duration::from_millis(chance.below(60) as u64));
        (Some(steps) != end).then_some(())
    });
    let done = follower.unwrap().wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(
        matches!(done.status.code(), Some(0 | 3)),
        "{name}, seed {seed}: {said}"
    );
    let whole = closed.is_some();
    let closed = closed.unwrap_or_else(|| folder.join(what));
    let closed = closed.to_str().unwrap();
    output(folder, &["render", closed, "-o", "r.json"]);
    let read = |name: &str| fs::read(folder.join(name)).unwrap();
    assert!(
        read("f.json") == read("r.json"),
        "{name}, seed {seed}: the JSON differs"
    );
    let log = output(folder, &["events", closed]);
    // The first line is a sentence about the whole mission.
    let first = log.stdout.iter().position(|byte| *byte == b'\n');
    let events = &log.stdout[first.map_or(0, |at| at + 1)..];
    assert!(
        !whole || held(&done.stdout) == held(events),
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

/// `cargo test --release --test tests follow::fifty -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn fifty_followed_recordings_of_each_kind_equal_the_closed_ones() {
    // A recorder and its follower mostly wait.
    for first in (0..50).step_by(5) {
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
        let follower = bagreel(folder.path(), &["follow", "r.db3", "--idle", IDLE])
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
        let done = follower.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success(), "{said}");
        // If the follower reads while the recorder closes, SQLite leaves its journal until the database is
        // opened again.
        let db = Connection::open(&path).unwrap();
        let rows = db.query_row("SELECT count(*) FROM messages", [], |row| row.get(0));
        assert!(rows.is_ok_and(|rows: i64| rows > written));
        db.close().unwrap();
        let left = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 1, "something was left beside the database");
    }
}

#[test]
fn a_signal_ends_following_and_writes_the_outputs() {
    let folder = TempDir::new().unwrap();
    let bag = rosbag1::unindexed(&rosbag1::write(&small(), Pack::None, 20_000));
    fs::write(folder.path().join("r.bag.active"), bag).unwrap();
    let mut follower = bagreel(folder.path(), &["follow", "r.bag.active", "-o", "f.json"])
        .spawn()
        .unwrap();
    let (mut lines, mut said) = begun(&mut follower);
    assert!(follower.try_wait().unwrap().is_none(), "it follows on");
    // Twice, as `timeout` does.
    let id = follower.id().to_string();
    let kill = Command::new("kill").args(["-INT", &id, &id]).status();
    if !kill.is_ok_and(|status| status.success()) {
        println!("skipped: no `kill` here");
        follower.kill().unwrap();
        return;
    }
    lines.read_to_string(&mut said).unwrap();
    assert_eq!(follower.wait().unwrap().code(), Some(0));
    assert!(said.contains("/planner → /joystick"), "{said}");
    assert!(folder.path().join("f.json").is_file());
}

#[cfg(unix)]
#[test]
fn a_second_signal_ends_the_writing_of_outputs() {
    let folder = TempDir::new().unwrap();
    let bag = rosbag1::unindexed(&rosbag1::write(&small(), Pack::None, 20_000));
    fs::write(folder.path().join("r.bag.active"), bag).unwrap();
    // A pipe that is never read: the page does not fit in it, so that its writing never ends.
    let pipe = folder.path().join("f.html");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let args = ["follow", "r.bag.active", "-o", "f.html"];
    let mut follower = bagreel(folder.path(), &args).spawn().unwrap();
    let id = follower.id().to_string();
    let interrupt = || Command::new("kill").args(["-INT", &id]).status().unwrap();
    let _lines = begun(&mut follower);
    assert!(interrupt().success() && follower.try_wait().unwrap().is_none());
    // Opens when it is written to.
    let unread = fs::File::open(&pipe).unwrap();
    let begun = Instant::now();
    // A signal soon after another counts as the same, and a busy system may deliver both together.
    while follower.try_wait().unwrap().is_none() {
        assert!(begun.elapsed() < Duration::from_mins(1));
        assert!(interrupt().success());
        sleep(Duration::from_millis(500));
    }
    assert_eq!(follower.wait().unwrap().code(), Some(130));
    drop(unread);
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
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(said.contains("/planner → /joystick"), "{said}");
    let empty = TempDir::new().unwrap();
    assert_ne!(
        output(empty.path(), &["follow", "."]).status.code(),
        Some(0)
    );
}

#[test]
fn an_empty_log_is_said_to_be_empty() {
    let folder = TempDir::new().unwrap();
    let mut steady = Recording::default();
    let place = steady.publisher("/talker", "/chat", "std_msgs/String");
    steady.send(place, (0, 30_000), 100, b"\x05\0\0\0hello");
    fs::write(
        folder.path().join("r.bag"),
        rosbag1::write(&steady, Pack::None, 20_000),
    )
    .unwrap();
    let said = output(folder.path(), &["events", "r.bag"]);
    assert!(said.stdout.ends_with(b", nothing changed\n"), "{said:?}");
    for args in [
        &["events", "r.bag", "--format", "ndjson"][..],
        &["follow", "r.bag"],
        &["follow", "r.bag", "--format", "ndjson"],
    ] {
        let said = output(folder.path(), args);
        assert!(
            said.status.success() && said.stdout.is_empty(),
            "{args:?}: {said:?}"
        );
        assert_eq!(
            String::from_utf8_lossy(&said.stderr),
            "note: no events: nothing started, stopped or changed\n"
        );
        let quiet = output(folder.path(), &[args, &["-q"]].concat());
        assert!(quiet.stderr.is_empty(), "{args:?}: {quiet:?}");
    }
}

#[test]
fn the_newest_recording_below_a_folder_is_followed_and_named() {
    let folder = TempDir::new().unwrap();
    let bag = rosbag1::write(&small(), Pack::None, 20_000);
    for (age, name) in [(30, "day1/a.bag"), (10, "day2/deep/b.bag"), (20, "c.bag")] {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, &bag).unwrap();
        let file = fs::File::options().write(true).open(&path).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(age))
            .unwrap();
    }
    let said = output(folder.path(), &["follow", "."]);
    let errors = String::from_utf8_lossy(&said.stderr);
    assert_eq!(
        errors.lines().next(),
        Some("note: following `./day2/deep/b.bag`, the newest recording in `.`"),
        "{errors}"
    );
    assert!(said.status.success() && !said.stdout.is_empty());
    // Two files of other names are two recordings.
    for name in ["e/one.mcap", "e/two.mcap"] {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, mcap::write(&small(), &mcap::Options::default())).unwrap();
    }
    let said = output(folder.path(), &["follow", "e", "--idle", "1s"]);
    let errors = String::from_utf8_lossy(&said.stderr);
    assert!(errors.contains("following `e/"), "{errors}");
    fs::create_dir(folder.path().join("empty")).unwrap();
    let said = output(folder.path(), &["follow", "empty"]);
    let errors = String::from_utf8_lossy(&said.stderr);
    assert!(
        said.status.code() == Some(1) && errors.contains("a folder without a recording"),
        "{errors}"
    );
}
