//! Property tests of graphs and missions.

use bagreel::internals::graph::Graph;
use std::collections::BTreeSet;

use bagreel::values::{Element, Kind, Length, Period};
use bagreel::{Mission, Reading, read};
use proptest::prelude::*;

use crate::support::Recording;
use crate::support::rosbag1::{self, Pack};

/// Some nodes, each of which publishes on a topic for some time and may return.
pub(crate) fn recording() -> impl Strategy<Value = Recording> {
    let times = (0..90_000_i64, 500..60_000_i64);
    let period = prop::sample::select(vec![50_i64, 200, 1000, 7000]);
    let sender = (0..5_u8, 0..4_u8, times, period);
    prop::collection::vec(sender, 1..9).prop_map(|senders| {
        let mut bag = Recording::default();
        for (node, topic, (start, length), period) in senders {
            let (node, topic) = (format!("/n{node}"), format!("/t{topic}"));
            let place = bag
                .publishers
                .iter()
                .position(|p| p.node == node && p.topic == topic);
            let place = place.unwrap_or_else(|| bag.publisher(&node, &topic, "std_msgs/Empty"));
            bag.send(place, (start, start + length), period, &[]);
        }
        bag
    })
}

/// The recording in windows of this many seconds.
fn mission(bag: &std::path::Path, seconds: i64) -> Mission {
    let mut reading = Reading::of([bag]);
    let period = Period::from_nanos(seconds * 1_000_000_000).unwrap();
    reading.division.length = Length::Fixed(period);
    read(&reading).unwrap()
}

fn there(graph: &Graph) -> BTreeSet<Element> {
    graph.states.iter().map(|state| state.what).collect()
}

/// Whether the changes of every window turn the previous window's elements into its own, each with a matching
/// event.
fn follows(mission: &Mission) -> Result<(), TestCaseError> {
    let mut before: Option<BTreeSet<Element>> = None;
    for (window, graph) in mission.each() {
        let mut now = before.unwrap_or_else(|| there(&graph));
        for (change, entry) in window.changes.iter().zip(&window.events) {
            let kind = mission.log.events[*entry].kind;
            let what = change.what;
            if change.is_added() {
                prop_assert!(now.insert(what), "{what:?} came twice");
                let begins = [Kind::Started, Kind::Appeared, Kind::Restarted];
                prop_assert!(begins.contains(&kind), "{kind:?}");
            } else if change.is_removed() {
                prop_assert!(now.remove(&what), "{what:?} was not there");
                let ends = [Kind::Stopped, Kind::Vanished, Kind::Restarted];
                prop_assert!(ends.contains(&kind), "{kind:?}");
            }
        }
        prop_assert_eq!(&now, &there(&graph), "window {}", window.index);
        before = Some(now);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn changes_yield_each_next_window_and_the_event_log_ignores_the_period(bag in recording()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.bag");
        std::fs::write(&path, rosbag1::write(&bag, Pack::None, 4096)).unwrap();
        let first = mission(&path, 1);
        follows(&first)?;
        for seconds in [10, 30, 60] {
            let other = mission(&path, seconds);
            follows(&other)?;
            prop_assert_eq!(&first.log, &other.log, "{} s", seconds);
        }
    }
}

#[test]
fn the_examples_follow_from_their_changes() {
    for bag in ["warehouse.bag", "courier.mcap"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("examples")
            .join(bag);
        let first = mission(&path, 1);
        follows(&first).unwrap();
        for seconds in [10, 30, 60] {
            let other = mission(&path, seconds);
            follows(&other).unwrap();
            assert_eq!(first.log, other.log, "{bag} by {seconds} s");
        }
    }
}
