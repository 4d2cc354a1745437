//! Compares the phases of real missions with the times at which their scripts changed the running nodes.

use std::path::Path;

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
const TRUTH: [f64; 6] = [38.2, 97.9, 163.1, 177.8, 200.3, 296.4];

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
