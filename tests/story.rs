//! The ledger of real missions: what is told, when, and that it is one story everywhere.

use std::collections::BTreeMap;
use std::path::Path;

use bagreel::internals::base::time::Period;
use bagreel::internals::graph::diff::{apply, diff};
use bagreel::internals::graph::window::Length;
use bagreel::internals::mission::events::{LogFormat, LogOptions, log};
use bagreel::internals::mission::ledger::Kind;
use bagreel::internals::mission::{Mission, read_json, write_json};
use bagreel::{Reading, read};

/// A mission of ours, in windows of so many seconds.
fn mission(file: &str, seconds: i64) -> Mission {
    let bag = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(file);
    let period = Period::from_nanos(seconds * 1_000_000_000).unwrap();
    let mut reading = Reading::of([bag]);
    reading.division.length = Length::Fixed(period);
    read(&reading).unwrap()
}

const ALL: LogOptions = LogOptions {
    parts: true,
    all: true,
    phases: true,
};

/// Every headline of a kind: whom it is about, and when in seconds.
fn told(mission: &Mission, kind: Kind) -> Vec<(String, i64)> {
    let headlines = mission.ledger.entries.iter();
    let of_kind = headlines.filter(|e| e.kind == kind && e.is_headline());
    let name = |e: &bagreel::internals::mission::ledger::Entry| match mission.elements.ends(e.what)
    {
        (Some(node), _) => mission.elements.nodes[node as usize].role.to_string(),
        (None, Some(topic)) => mission.elements.topics[topic as usize].name.to_string(),
        (None, None) => String::new(),
    };
    of_kind
        .map(|e| (name(e), mission.offset(e.time) / 1_000_000_000))
        .collect()
}

fn near(told: &[(String, i64)], name: &str, second: i64) -> bool {
    told.iter()
        .any(|(n, at)| n == name && (at - second).abs() <= 2)
}

#[test]
fn the_warehouse_tells_its_crashes_restarts_and_rates() {
    // Times from the scripts that ran the mission; every line was compared with the master's own state.
    let mission = mission("warehouse.bag", 60);
    let restarted = told(&mission, Kind::Restarted);
    assert!(
        near(&restarted, "/robot2/lidar_driver", 246),
        "{restarted:?}"
    );
    assert!(
        near(&restarted, "/robot1/object_detector", 266),
        "{restarted:?}"
    );
    assert_eq!(restarted.len(), 2);
    let stopped = told(&mission, Kind::Stopped);
    for (node, second) in [
        ("/robot1/replanner", 156),
        ("/robot1/planner", 176),
        ("/robot1/camera_driver", 296),
    ] {
        assert!(near(&stopped, node, second), "{stopped:?}");
    }
    assert_eq!(told(&mission, Kind::Vanished), []);
    let rates = told(&mission, Kind::Rate);
    assert!(near(&rates, "/robot1/camera_driver", 236), "{rates:?}");
    let handed = told(&mission, Kind::HandedOver);
    assert!(near(&handed, "/robot1/cmd_vel", 299), "{handed:?}");
    let headlines = mission.ledger.entries.iter().filter(|e| e.is_headline());
    assert!(headlines.count() <= 60);
}

#[test]
fn the_log_is_the_same_for_every_period() {
    for format in [
        LogFormat::Text,
        LogFormat::Csv,
        LogFormat::Ndjson,
        LogFormat::Markdown,
    ] {
        let short = log(&mission("warehouse.bag", 5), format, ALL);
        let long = log(&mission("warehouse.bag", 60), format, ALL);
        assert!(short == long, "{format:?}");
    }
}

#[test]
fn a_mission_read_back_tells_the_same() {
    for file in ["warehouse.bag", "courier.mcap"] {
        let first = mission(file, 10);
        let mut text = Vec::new();
        write_json(&first, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let again = read_json(&text, Path::new("x.json")).unwrap();
        assert!(first.ledger == again.ledger, "{file}: another ledger");
        for (a, b) in first.windows.iter().zip(&again.windows) {
            assert_eq!(
                (&a.changes, &a.entries),
                (&b.changes, &b.entries),
                "window {}",
                a.index
            );
        }
        let mut written = Vec::new();
        write_json(&again, &mut written).unwrap();
        assert!(text.as_bytes() == written, "{file} is written otherwise");
    }
}

#[test]
fn every_difference_of_two_windows_points_at_its_entry() {
    for seconds in [1, 10, 60] {
        let mission = mission("warehouse.bag", seconds);
        for pair in mission.windows.windows(2) {
            let [before, after] = pair else { continue };
            let difference = diff(&before.graph, &after.graph);
            assert_eq!(apply(&before.graph, &difference), after.graph);
            let moved = difference.nodes.added.len()
                + difference.topics.added.len()
                + difference.publishes.added.len()
                + difference.subscribes.added.len()
                + difference.nodes.removed.len()
                + difference.topics.removed.len()
                + difference.publishes.removed.len()
                + difference.subscribes.removed.len();
            let mut words = BTreeMap::new();
            for change in &after.changes {
                *words.entry(change.word()).or_insert(0) += 1;
            }
            let told = words.get("added").unwrap_or(&0) + words.get("removed").unwrap_or(&0);
            assert_eq!(moved, told, "window {} of {seconds} s", after.index);
            assert_eq!(after.changes.len(), after.entries.len());
            let places = after.entries.iter().map(|id| *id as usize);
            assert!(
                places
                    .max()
                    .is_none_or(|id| id < mission.ledger.entries.len())
            );
        }
    }
}

#[test]
fn the_log_never_runs_backwards_and_parts_have_no_parts() {
    let mission = mission("warehouse.bag", 60);
    let entries = &mission.ledger.entries;
    assert!(entries.is_sorted_by_key(|e| e.time));
    for entry in entries {
        assert!(entry.earliest <= entry.time && entry.time <= entry.latest);
        if let Some(whole) = entry.part_of {
            assert_eq!(entries[whole as usize].part_of, None);
        }
    }
}
