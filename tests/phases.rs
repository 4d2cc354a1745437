//! Compares the phases of real missions with the times at which their scripts changed the running nodes.

use std::path::Path;
use std::process::Command;

use bagreel::internals::base::time::Period;
use bagreel::internals::graph::window::Length;
use bagreel::internals::mission::Mission;
use bagreel::internals::pipeline::{Reading, Unwatched, read};

use crate::support;

fn mission(path: &Path, length: Length) -> Mission {
    let mut reading = Reading::of([path]);
    reading.division.length = length;
    read(&reading, &mut Unwatched).unwrap()
}

/// The seconds at which phases begin, except the first.
fn boundaries(mission: &Mission) -> Vec<f64> {
    let phases = mission.log.phases.iter().skip(1);
    let seconds = phases.map(|p| mission.offset(p.span.start) as f64 / 1e9);
    seconds.map(|s| (s * 10.0).round() / 10.0).collect()
}

/// When the script of the example mission started and stopped whole groups of nodes, in seconds.
const TRUTH: [f64; 6] = [38.0, 97.9, 163.0, 177.8, 200.0, 296.4];

fn example() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag")
}

#[test]
fn the_example_has_the_phases_of_its_script() {
    let mission = mission(&example(), Length::Auto);
    assert_eq!(boundaries(&mission), TRUTH);
    let counts: Vec<(u32, u32)> = mission
        .log
        .phases
        .iter()
        .map(|p| (p.nodes_added, p.nodes_removed))
        .collect();
    let expected = [(11, 0), (4, 0), (3, 0), (4, 3), (4, 4), (4, 0), (1, 4)];
    assert_eq!(counts, expected);
    let name = &mission.log.phases[2].name;
    assert_eq!(
        &**name,
        "+3 nodes: emergency_stop, obstacle_detector and replanner"
    );
}

#[test]
fn phases_do_not_depend_on_the_period() {
    let phases = |length| mission(&example(), length).log.phases;
    let ten = Period::parse("7").map_or(Length::Auto, Length::Fixed);
    assert_eq!(phases(Length::All), phases(ten));
}

#[test]
fn phases_are_the_same_without_the_log_and_with_merged_connections() {
    for file in ["warehouse_norosout.bag", "warehouse_lz4.bag"] {
        let Some(path) = support::shared(&format!("data/warehouse/{file}")) else {
            continue;
        };
        let found = boundaries(&mission(&path, Length::All));
        let near = |truth: f64| found.iter().any(|f| (f - truth).abs() <= 6.0);
        assert!(
            TRUTH.iter().all(|t| near(*t)) && found.len() == 6,
            "{file}: {found:?}"
        );
    }
}

/// The phases in the strip below a frame, and the one that is emphasized.
fn strip(bag: &Path, period: &str, window: usize) -> (Vec<String>, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("{n}.svg");
    let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(["render", "-q", "--mode", "all", "--period", period, "-o"])
        .args([&file, bag])
        .output()
        .unwrap();
    assert!(done.status.success(), "{done:?}");
    let svg = std::fs::read_to_string(folder.path().join(format!("{window}.svg"))).unwrap();
    let texts = |group: &str| -> Vec<String> {
        let (_, rest) = svg.split_once(&format!("<g class=\"{group}\"")).unwrap();
        let (inside, _) = rest.split_once("</g>").unwrap();
        let texts = inside.split("<text ").skip(1);
        let words =
            texts.map(|t| t[t.find('>').unwrap() + 1..t.find("</text>").unwrap()].to_owned());
        words.collect()
    };
    (texts("phases"), texts("past").pop().unwrap())
}

#[test]
fn the_phase_of_a_window_is_the_one_with_most_of_it() {
    let (_, now) = strip(&example(), "60", 4);
    assert!(now.starts_with("+ mission_executor_2"), "{now}");
    let (_, now) = strip(&example(), "60", 5);
    assert_eq!(now, "+ dock_controller");
}

#[test]
fn phases_of_the_same_nodes_are_one_below_a_frame() {
    let bag = support::shared("data/bags/fibonacci/fibonacci_namespaces.bag");
    let Some(bag) = bag else { return };
    let (all, _) = strip(&bag, "20", 4);
    assert!(all.len() > 1, "{all:?}");
    let is_number = |name: &&String| name.chars().all(|c| c.is_ascii_digit());
    assert_eq!(all.iter().skip(1).find(is_number), None, "{all:?}");
}
