//! Tests of the questions that people ask of recordings, each answered by one command of the recipes.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use crate::causes::minute;
use crate::edges::log1;
use crate::pairs::LOG;
use crate::support::rosbag1::{Pack, write};
use crate::support::{Recording, small};

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");

fn bagreel(folder: &Path, command: &str) -> Output {
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    run.current_dir(folder)
        .args(command.split(' '))
        .output()
        .unwrap()
}

pub(crate) fn printed(folder: &Path, command: &str) -> String {
    String::from_utf8(bagreel(folder, command).stdout).unwrap()
}

/// A folder with both examples below `bags/`.
fn bags() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("bags")).unwrap();
    for name in ["warehouse.bag", "courier.mcap"] {
        fs::copy(
            Path::new(EXAMPLES).join(name),
            dir.path().join("bags").join(name),
        )
        .unwrap();
    }
    dir
}

#[test]
fn a_folder_shows_which_bag_has_a_restart() {
    let dir = bags();
    let log = printed(dir.path(), "events bags --format csv");
    let restarts = log.lines().filter(|row| row.contains(",restarted,"));
    let restarts: Vec<&str> = restarts.collect();
    assert!(restarts.iter().all(|row| row.starts_with("warehouse.bag,")));
    let survey = printed(dir.path(), "info bags --format csv");
    let mut rows = survey
        .lines()
        .map(|row| row.split(',').collect::<Vec<&str>>());
    let heads = rows.next().unwrap();
    let column = |name: &str| heads.iter().position(|head| *head == name).unwrap();
    let counts: Vec<[&str; 4]> = rows
        .map(|row| ["path", "restarts", "starts", "rates"].map(|name| row[column(name)]))
        .collect();
    let of = |kinds: &[&str], bag: &str| {
        let own = log.lines().filter(|row| row.starts_with(bag));
        let own = own.filter(|row| kinds.contains(&row.split(',').nth(2).unwrap()));
        own.count().to_string()
    };
    assert_eq!(counts.len(), 2);
    for [bag, restarted, starts, rates] in counts {
        assert_eq!(restarted, of(&["restarted"], bag), "{bag}");
        assert_eq!(starts, of(&["started", "appeared"], bag), "{bag}");
        assert_eq!(rates, of(&["rate"], bag), "{bag}");
    }
    let text = printed(dir.path(), "info bags");
    assert!(text.lines().next().unwrap().contains("restarts"), "{text}");
}

#[test]
fn every_output_of_a_log_can_be_a_file() {
    let dir = bags();
    let here = dir.path();
    for (command, names) in [
        ("events bags/warehouse.bag", "csv ndjson json md txt"),
        ("events bags", "csv ndjson json md txt"),
        ("info bags/courier.mcap", "json csv txt"),
        ("info bags", "json csv txt"),
    ] {
        let outputs: Vec<String> = names
            .split(' ')
            .map(|end| format!("-o out/x.{end}"))
            .collect();
        let done = bagreel(here, &format!("{command} {}", outputs.join(" ")));
        assert!(done.status.success() && done.stdout.is_empty(), "{done:?}");
        for end in names.split(' ') {
            let format = match end {
                "md" => "markdown",
                "txt" => "text",
                end => end,
            };
            let shown = printed(here, &format!("{command} --format {format}"));
            let written = fs::read_to_string(here.join(format!("out/x.{end}"))).unwrap();
            assert_eq!(written, shown, "{command} {end}");
        }
    }
    let done = bagreel(here, "events bags -o x.gif");
    assert_eq!(done.status.code(), Some(2), "{done:?}");
    let done = bagreel(
        here,
        "info bags/courier.mcap -o bags/courier.mcap.json -o ./bags/courier.mcap.json",
    );
    assert_eq!(done.status.code(), Some(2), "{done:?}");
}

#[test]
fn why_begins_with_who_publishes_and_when() {
    let dir = bags();
    let text = printed(dir.path(), "info bags/warehouse.bag --why /robot1/cmd_vel");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[1],
        "  published by /robot1/controller 00:38–02:56, /robot1/emergency_stop 01:37–02:36 and /robot1/dock_controller 04:58–"
    );
    assert_eq!(lines[2], "  received by /robot1/base_driver throughout");
    // The recorder's evidence is the last.
    let recorder = lines
        .iter()
        .position(|line| line.contains("/record_"))
        .unwrap();
    assert!(
        lines[recorder..]
            .iter()
            .all(|line| line.contains("/record_")),
        "{text}"
    );
    let text = printed(dir.path(), "info bags/courier.mcap --why /cmd_vel");
    assert!(text.contains("published by 2 unnamed nodes"), "{text}");
}

#[test]
fn why_of_a_role_explains_every_anonymous_node_of_it() {
    let names = ["/probe_9665_1795171273454", "/probe_9702_1795171300000"];
    let mut bag = minute(&[(names[0], "/heat", 0, 20), (names[1], "/heat", 30, 60)]);
    let log = bag.publisher(names[0], "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut bag.publishers[log].definition);
    let mut record = log1(names[0], "too hot", "probe.cpp", &["/heat"]);
    record[16] = 4;
    bag.send(log, (18_000, 18_001), 1, &record);
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("r.bag"), write(&bag, Pack::None, 20_000)).unwrap();
    for asked in ["/probe", "/probe /heat"] {
        let text = printed(dir.path(), &format!("info r.bag --why {asked}"));
        let titles = text.lines().filter(|line| !line.starts_with(' '));
        let titles: Vec<&str> = titles.collect();
        let expected = match asked {
            "/probe" => names.map(|name| format!("node {name}")),
            _ => names.map(|name| format!("{name} publishes /heat")),
        };
        assert_eq!(titles, expected, "{text}");
        // The one that went away logged why.
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        let restart = lines
            .iter()
            .position(|line| line.contains("/probe restarted"));
        let warning = restart.and_then(|at| lines.get(at + 1));
        assert!(
            asked != "/probe" || warning == Some(&"00:18.0    WARN: too hot"),
            "{text}"
        );
        // Evidence is kept for all of them.
        for name in names {
            let of_name = text.lines().filter(|line| line.contains(name));
            assert!(of_name.count() > 1, "{text}");
        }
    }
    let done = bagreel(dir.path(), "info r.bag --why /prob");
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(said.contains("the nearest name is `/probe`"), "{said}");
    let done = bagreel(dir.path(), "info r.bag --why /x/pro");
    let said = String::from_utf8(done.stderr).unwrap();
    let similar = format!("similar names: /probe, {}", names.join(", "));
    assert!(said.trim_end().ends_with(&similar), "{said}");
}

#[test]
fn why_shows_the_last_errors_before_a_node_stopped() {
    let mut bag = minute(&[("/nav", "/plan", 0, 30)]);
    let log = bag.publisher("/nav", "/rosout", "rosgraph_msgs/Log");
    LOG.clone_into(&mut bag.publishers[log].definition);
    // The byte after the header is the level.
    for (second, level, text) in [(10, 2, "fine"), (28, 4, "no path"), (29, 8, "giving up")] {
        let mut record = log1("/nav", text, "nav.cpp", &["/plan"]);
        record[16] = level;
        bag.send(log, (second * 1_000, second * 1_000 + 1), 1, &record);
    }
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("r.bag"), write(&bag, Pack::None, 20_000)).unwrap();
    let text = printed(dir.path(), "info r.bag --why /nav");
    let (_, answer) = text
        .split_once("00:29.9  /nav stopped: publishes /plan")
        .unwrap();
    let answer: Vec<&str> = answer.lines().map(str::trim).take(3).collect();
    let expected = [
        "",
        "00:28.0    WARN: no path",
        "00:29.0    ERROR: giving up",
    ];
    assert_eq!(answer, expected, "{text}");
    let text = printed(dir.path(), "info r.bag --why /base");
    assert!(!text.contains("stopped"), "{text}");
}

#[test]
fn a_bag_that_cannot_be_read_is_an_error_in_the_test_report() {
    let dir = bags();
    let here = dir.path();
    assert!(
        bagreel(here, "baseline bags/courier.mcap -o g.yaml")
            .status
            .success()
    );
    fs::write(
        here.join("cut.bag"),
        &fs::read(here.join("bags/warehouse.bag")).unwrap()[..3000],
    )
    .unwrap();
    fs::write(here.join("noise.bag"), [7; 100]).unwrap();
    for bag in ["cut.bag", "noise.bag", "gone.bag"] {
        let done = bagreel(
            here,
            &format!("check {bag} --expect g.yaml -o out/{bag}.xml -o out/{bag}.md"),
        );
        assert_eq!(done.status.code(), Some(2), "{done:?}");
        let report = fs::read_to_string(here.join(format!("out/{bag}.xml"))).unwrap();
        assert!(
            report.contains("tests=\"1\" failures=\"0\" errors=\"1\""),
            "{report}"
        );
        assert!(
            report.contains("<error message=") && report.contains(bag),
            "{report}"
        );
        assert!(!here.join(format!("out/{bag}.md")).exists());
    }
}

/// Two minutes: a node that starts at some second, its two topics, and one of a node that it feeds.
fn started(second: i64) -> Recording {
    let mut bag = Recording::default();
    let base = bag.publisher("/base", "/odom", "std_msgs/Empty");
    bag.send(base, (0, 120_000), 100, &[]);
    for topic in ["/map", "/map_updates"] {
        let place = bag.publisher("/mapper", topic, "std_msgs/Empty");
        bag.send(place, (second * 1_000, 120_000), 200, &[]);
    }
    bag
}

#[test]
fn a_late_start_and_its_consequences_are_one_finding() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    for (name, second) in [("good.bag", 20), ("late.bag", 70)] {
        fs::write(here.join(name), write(&started(second), Pack::None, 20_000)).unwrap();
    }
    assert!(
        bagreel(here, "baseline good.bag -o g.yaml")
            .status
            .success()
    );
    let text = printed(here, "check late.bag --expect g.yaml");
    assert!(
        text.starts_with("/mapper started at 01:10: 3 findings\n"),
        "{text}"
    );
    assert_eq!(text.matches("accept: ").count(), 1, "{text}");
    assert!(
        text.contains("--only /map --only /map_updates --only /mapper"),
        "{text}"
    );
}

#[test]
fn a_recording_that_is_not_there_yet_is_awaited() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut follow = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    follow
        .current_dir(here)
        .args(["follow", "r.bag", "--format", "ndjson", "--idle", "20s"]);
    let mut follow = follow
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    let mut notes = BufReader::new(follow.stderr.take().unwrap());
    notes.read_line(&mut said).unwrap();
    assert_eq!(said, "note: waiting for `r.bag`\n");
    fs::write(here.join("new"), write(&small(), Pack::Lz4, 20_000)).unwrap();
    fs::rename(here.join("new"), here.join("r.bag")).unwrap();
    let done = follow.wait_with_output().unwrap();
    assert!(done.status.success(), "{done:?}");
    // Each event keeps its number.
    let mut of_event = std::collections::BTreeMap::new();
    for line in String::from_utf8(done.stdout).unwrap().lines() {
        let row: Value = serde_json::from_str(line).unwrap();
        let what = [&row["kind"], &row["name"], &row["topic"]].map(ToString::to_string);
        let old = of_event.insert(what, row["id"].clone());
        assert!(old.is_none_or(|old| old == row["id"]), "{line}");
    }
    let ids: std::collections::BTreeSet<String> =
        of_event.values().map(ToString::to_string).collect();
    assert_eq!(ids.len(), of_event.len());
    let done = bagreel(here, "follow gone.bag --idle 100ms");
    assert_eq!(done.status.code(), Some(1), "{done:?}");
}

#[test]
fn messages_name_what_was_meant() {
    let dir = bags();
    let said = |command: &str| String::from_utf8(bagreel(dir.path(), command).stderr).unwrap();
    assert!(said("info bags/courier.mcpa").contains("hint: did you mean `bags/courier.mcap`?"));
    assert!(said("tables nosuchdir -o out").contains("cannot read `nosuchdir`"));
    for command in [
        "render bags/courier.mcap --topic-filter /nosuch -o x.gif",
        "render bags/courier.mcap --topic-filter /nosuch -o x.json",
        "figure bags/courier.mcap --topic-filter /nosuch -o x.svg",
        "extract bags/courier.mcap --topic-filter /nosuch -o x.csv",
        "extract bags/courier.mcap --topic-filter /nosuch -o x --fields",
    ] {
        let text = said(command);
        assert!(
            text.contains("error: `--topic-filter` matches none of 14 names"),
            "{command}: {text}"
        );
    }
    let text = said("render bags/courier.mcap --ns-filter /nosuch -o x.gif");
    assert!(text.contains("error: `--ns-filter` matches none"), "{text}");
    let left = fs::read_dir(dir.path()).unwrap().count();
    assert_eq!(left, 1, "no output is left of an error");
    let text = said("render bags/courier.mcap -o /proc/x.gif");
    assert!(
        text.contains("cannot write into `/proc`") && !text.contains(".part"),
        "{text}"
    );
    let info = printed(dir.path(), "info bags/warehouse.bag");
    assert!(
        info.contains("warehouse.bag  rosbag1, 6.9 MB, read by its index"),
        "{info}"
    );
    assert!(info.contains("05:26.464 long, 26719 messages"), "{info}");
    let mut silent = Recording::default();
    let chat = silent.publisher("", "/chat", "std_msgs/msg/Empty");
    silent.send(chat, (0, 5_000), 100, &[]);
    let bytes = crate::support::mcap::write(&silent, &crate::support::mcap::Options::default());
    fs::write(dir.path().join("one.mcap"), bytes).unwrap();
    let info = printed(dir.path(), "info one.mcap");
    assert!(
        info.contains("of 1 topic with messages") && !info.contains("receives"),
        "{info}"
    );
}

#[test]
fn latex_finds_the_picture_and_names_itself() {
    let dir = bags();
    let here = dir.path();
    let command =
        "figure bags/courier.mcap --width 8.8cm -o fig/lives.pdf -o text/parts/one.tex -o two.tex";
    let done = bagreel(here, command);
    assert!(done.status.success(), "{done:?}");
    let read = |name: &str| fs::read_to_string(here.join(name)).unwrap();
    let (one, two) = (read("text/parts/one.tex"), read("two.tex"));
    assert!(
        one.contains("\\includegraphics{../../fig/lives.pdf}"),
        "{one}"
    );
    assert!(one.contains("\\label{fig:one}"), "{one}");
    assert!(two.contains("\\includegraphics{fig/lives.pdf}") && two.contains("\\label{fig:two}"));
    assert!(
        bagreel(here, "figure bags/courier.mcap --width 3.5in -o x.svg")
            .status
            .success()
    );
}
