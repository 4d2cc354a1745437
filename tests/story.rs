//! Tests of the event log of real missions: events, times, and consistency.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use bagreel::internals::base::time::Period;
use bagreel::internals::graph::Graph;
use bagreel::internals::graph::window::Length;
use bagreel::internals::mission::event_log::Kind;
use bagreel::internals::mission::event_log::{LogFormat, LogOptions, log};
use bagreel::internals::mission::{Mission, read_json, write_json};
use bagreel::{Reading, read};

/// An example mission in windows of this many seconds.
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

/// Every headline of a kind: its element and its time in seconds.
fn shown(mission: &Mission, kind: Kind) -> Vec<(String, i64)> {
    let headlines = mission.log.events.iter();
    let of_kind = headlines.filter(|e| e.kind == kind && e.is_headline());
    let name =
        |e: &bagreel::internals::mission::event_log::Event| match mission.elements.ends(e.what) {
            (Some(node), _) => mission.elements.nodes[node].role.to_string(),
            (None, Some(topic)) => mission.elements.topics[topic].name.to_string(),
            (None, None) => String::new(),
        };
    of_kind
        .map(|e| (name(e), mission.offset(e.time) / 1_000_000_000))
        .collect()
}

fn near(shown: &[(String, i64)], name: &str, second: i64) -> bool {
    shown
        .iter()
        .any(|(n, at)| n == name && (at - second).abs() <= 2)
}

#[test]
fn crashes_restarts_and_rates_of_the_warehouse_are_logged() {
    // Times from the scripts that ran the mission; every line was compared with the master's own state.
    let mission = mission("warehouse.bag", 60);
    let restarted = shown(&mission, Kind::Restarted);
    assert!(
        near(&restarted, "/robot2/lidar_driver", 246),
        "{restarted:?}"
    );
    assert!(
        near(&restarted, "/robot1/object_detector", 266),
        "{restarted:?}"
    );
    assert_eq!(restarted.len(), 2);
    let stopped = shown(&mission, Kind::Stopped);
    for (node, second) in [
        ("/robot1/replanner", 156),
        ("/robot1/planner", 176),
        ("/robot1/camera_driver", 296),
    ] {
        assert!(near(&stopped, node, second), "{stopped:?}");
    }
    assert_eq!(shown(&mission, Kind::Vanished), []);
    let rates = shown(&mission, Kind::Rate);
    assert!(near(&rates, "/robot1/camera_driver", 236), "{rates:?}");
    let handed = shown(&mission, Kind::HandedOver);
    assert!(near(&handed, "/robot1/cmd_vel", 299), "{handed:?}");
    let headlines = mission.log.events.iter().filter(|e| e.is_headline());
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
fn a_mission_read_from_json_has_the_same_log() {
    for file in ["warehouse.bag", "courier.mcap"] {
        let first = mission(file, 10);
        let mut text = Vec::new();
        write_json(&first, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let again = read_json(&text, Path::new("x.json")).unwrap();
        assert!(first.log == again.log, "{file}: another ledger");
        for (a, b) in first.windows.iter().zip(&again.windows) {
            assert_eq!(
                (&a.changes, &a.events),
                (&b.changes, &b.events),
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
fn every_window_difference_refers_to_its_event() {
    for seconds in [1, 10, 60] {
        let mission = mission("warehouse.bag", seconds);
        let later = mission.graphs.iter().skip(1);
        let pairs = mission.graphs.iter().zip(later);
        for ((old, new), after) in pairs.zip(&mission.windows[1..]) {
            let elements = |graph: &Graph| graph.states.iter().map(|s| s.what).collect();
            let (old, new): (BTreeSet<_>, BTreeSet<_>) = (elements(&old), elements(&new));
            let moved = old.symmetric_difference(&new).count();
            let mut words = BTreeMap::new();
            for change in &after.changes {
                *words.entry(change.word()).or_insert(0) += 1;
            }
            let shown = words.get("added").unwrap_or(&0) + words.get("removed").unwrap_or(&0);
            assert_eq!(moved, shown, "window {} of {seconds} s", after.index);
            assert_eq!(after.changes.len(), after.events.len());
            let mut events = after.events.iter();
            assert!(events.all(|id| mission.log.events.get(*id).is_some()));
        }
    }
}

#[test]
fn the_log_is_sorted_and_parts_are_not_nested() {
    let mission = mission("warehouse.bag", 60);
    let entries = &mission.log.events;
    assert!(entries.is_sorted_by_key(|e| e.time));
    for entry in entries {
        assert!(entry.earliest <= entry.time && entry.time <= entry.latest);
        if let Some(whole) = entry.part_of {
            assert_eq!(entries[whole].part_of, None);
        }
    }
}

/// The ground truth from the scripts that ran the mission and the nodes' own counters, by the same rules for every
/// mission.
fn truth() -> Vec<serde_json::Value> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/warehouse.story.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Starts or stops of nodes by role, including restarts, with seconds and the interval that should contain the truth.
fn turns(mission: &Mission, kind: Kind) -> Vec<(String, f64, (f64, f64))> {
    let second = |at| mission.offset(at) as f64 / 1e9;
    let mut all = Vec::new();
    for (id, entry) in mission.log.events.with_ids() {
        let bagreel::values::Element::Node(node) = entry.what else {
            continue;
        };
        let role = mission.elements.nodes[node].role.to_string();
        let has_part = mission.log.parts(id).any(|part| part.kind == kind);
        let interval = (second(entry.earliest), second(entry.latest));
        match entry.kind {
            found if found == kind => all.push((role, second(entry.time), interval)),
            Kind::Restarted if !has_part && kind == Kind::Stopped => {
                all.push((role, second(entry.time), interval));
            }
            Kind::Restarted if !has_part => {
                let until = second(entry.until.unwrap_or(entry.time));
                all.push((role, until, (f64::MIN, f64::MAX)));
            }
            _ => {}
        }
    }
    all
}

#[test]
fn starts_and_stops_are_timed_independent_of_the_period() {
    let truth = truth();
    for seconds in [1, 10, 30, 60] {
        let mission = mission("warehouse.bag", seconds);
        let (mut errors, mut inside, mut missed) = (Vec::new(), 0, Vec::new());
        for (word, kind) in [("started", Kind::Started), ("stopped", Kind::Stopped)] {
            let mut shown = turns(&mission, kind);
            for event in truth.iter().filter(|e| e["kind"] == word) {
                let (node, at) = (
                    event["node"].as_str().unwrap(),
                    event["time_s"].as_f64().unwrap(),
                );
                let near = shown
                    .iter()
                    .enumerate()
                    .filter(|(_, (name, ..))| name == node);
                let nearest = near.min_by(|a, b| (a.1.1 - at).abs().total_cmp(&(b.1.1 - at).abs()));
                let Some((place, (_, time, (earliest, latest)))) = nearest else {
                    missed.push(format!("{word} {node} {at}"));
                    continue;
                };
                let [from, to] = ["earliest_s", "latest_s"].map(|key| event[key].as_f64().unwrap());
                errors.push((from - time).max(time - to).max(0.0));
                inside += usize::from(*earliest <= to && from <= *latest);
                shown.remove(place);
            }
            // Additional events are within two seconds of the bag's ends, or concern the recorder.
            let end = mission.offset(mission.span.end) as f64 / 1e9;
            shown.retain(|(name, at, (earliest, latest))| {
                let is_edge = *at < 5.0 && *earliest < 2.0 || *latest > end - 2.0;
                !is_edge && !name.contains("record")
            });
            assert!(shown.is_empty(), "{word} by {seconds} s: {shown:?}");
        }
        assert!(missed.is_empty(), "{missed:?}");
        errors.sort_by(f64::total_cmp);
        let (median, worst) = (errors[errors.len() / 2], errors[errors.len() * 95 / 100]);
        assert!(median <= 0.5 && worst <= 2.0, "{errors:?}");
        assert!(
            inside * 100 >= errors.len() * 95,
            "{inside} of {}",
            errors.len()
        );
    }
}

#[test]
fn commanded_rates_and_take_overs_are_logged_with_numbers() {
    let (mission, truth) = (mission("warehouse.bag", 60), truth());
    let second = |at| mission.offset(at) as f64 / 1e9;
    let name = |what| match mission.elements.ends(what) {
        (_, Some(topic)) => mission.elements.topics[topic].name.as_str(),
        _ => "",
    };
    let near = |from: f64, to: f64, at: f64| from - 5.0 <= at && at <= to + 5.0;
    let shown = |entry: &&bagreel::internals::mission::event_log::Event| !entry.quiet;
    let mut explained = 0;
    for event in &truth {
        let topic = event["topic"].as_str().unwrap_or_default();
        let number = |key: &str| event[key].as_f64().unwrap();
        let of = |kind: Kind| {
            let entries = mission.log.events.iter().filter(shown);
            entries.filter(move |e| e.kind == kind && name(e.what) == topic)
        };
        match event["kind"].as_str().unwrap() {
            "rate" => {
                let at = number("time_s");
                let close = |a: f64, b: f64| (a - b).abs() <= 0.1 * b;
                let found = of(Kind::Rate).filter(|e| near(at, at, second(e.time))).filter(|e| {
                    matches!(e.detail, bagreel::internals::mission::event_log::Detail::Rates { from_hz, to_hz }
                        if close(from_hz, number("from_hz")) && close(to_hz, number("to_hz")))
                });
                let found = found.count();
                assert!(found == 1 || event["doubtful"] == true, "{event}: {found}");
                explained += found;
            }
            "handed_over" => {
                let (from, to) = (number("earliest_s"), number("latest_s"));
                let found = of(Kind::HandedOver)
                    .filter(|e| near(from, to, second(e.time)))
                    .count();
                assert!(found == 1 || event["doubtful"] == true, "{event}: {found}");
                explained += found;
            }
            _ => {}
        }
    }
    let all = mission.log.events.iter().filter(shown);
    let all = all.filter(|e| matches!(e.kind, Kind::Rate | Kind::HandedOver));
    let of_parts = |e: &&bagreel::internals::mission::event_log::Event| e.part_of.is_none();
    assert!(all.filter(of_parts).count() <= explained, "a false line");
}
