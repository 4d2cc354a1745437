//! The differences in events: those in only one mission, or at another time.

use std::collections::{BTreeMap, BTreeSet};

use super::{Difference, Where};
use crate::base::rhythm::CLOSING_NS;
use crate::base::time::Stamp;
use crate::gate::facts::Facts;
use crate::graph::Element;
use crate::mission::event_log::{Event, Kind};

/// The difference in nanoseconds up to which times of two runs count as equal: nodes of one launch file start in any
/// order, a second apart.
pub(super) const APART_NS: i64 = 2_000_000_000;
/// The part of the time since the start by which two runs may drift: a fiftieth.
const PACE: i64 = 50;

/// The key of an event: its kind, the name it is about, and its number among the events of both, counted from 1.
type Key = (Kind, String, usize);

/// An event with names instead of ids.
struct NamedEvent {
    key: Key,
    time: Stamp,
    /// The uncertainty of its time, in nanoseconds.
    doubt: i64,
}

/// All differences in events.
pub(super) fn differences(a: &Facts<'_>, b: &Facts<'_>) -> Vec<Difference> {
    let (first, second) = (named_events(a), named_events(b));
    let mut all = only(&first, &second, a, Where::First);
    all.extend(only(&second, &first, b, Where::Second));
    let places: BTreeMap<&Key, &NamedEvent> = second.iter().map(|t| (&t.key, t)).collect();
    let mut shift = 0;
    for one in &first {
        if let Some(other) = places.get(&one.key) {
            all.extend(moved((a, one), (b, other), &mut shift));
        }
    }
    all
}

/// The headlines that two runs can have in common.
fn named_events(facts: &Facts<'_>) -> Vec<NamedEvent> {
    let mission = facts.mission;
    let mut many: BTreeMap<(Kind, String), usize> = BTreeMap::new();
    let mut all = Vec::new();
    for (_, event) in mission.log.headlines(mission.span) {
        let Some(name) = about(facts, event) else {
            continue;
        };
        let count = many.entry((event.kind, name.clone())).or_default();
        *count += 1;
        all.push(NamedEvent {
            key: (event.kind, name, *count),
            time: event.time,
            doubt: event.latest.since(event.earliest),
        });
    }
    all
}

/// The node or topic that an event is about; rates, and connections, are compared elsewhere.
fn about(facts: &Facts<'_>, event: &Event) -> Option<String> {
    match (event.kind, event.what) {
        // The number of restarts is compared, not their times.
        (Kind::Rate | Kind::Type | Kind::Qos | Kind::Restarted, _) => None,
        (_, Element::Node(id)) => Some(facts.role(id).to_owned()),
        (_, Element::Topic(id)) => Some(facts.topic(id).to_owned()),
        _ => None,
    }
}

/// The events in only one mission about elements of both. Starts and stops are reported for the elements.
fn only(
    own: &[NamedEvent],
    other: &[NamedEvent],
    facts: &Facts<'_>,
    side: Where,
) -> Vec<Difference> {
    let known: BTreeSet<&Key> = other.iter().map(|t| &t.key).collect();
    let wanted = [Kind::HandedOver, Kind::Silent, Kind::Lifecycle];
    let alone = own
        .iter()
        .filter(|t| wanted.contains(&t.key.0) && !known.contains(&t.key))
        // Silence at the very end is due to the robot's shutdown, if the other recording lasts that long.
        .filter(|t| facts.mission.span.end.since(t.time) > CLOSING_NS);
    let differences = alone.map(|t| {
        let at = format!("at {}", facts.clock(t.time));
        about_event(&t.key, |name| Difference::only("event", name, side, &at))
    });
    differences.collect()
}

fn name((kind, name, count): &Key) -> String {
    let word = kind.word().replace('_', " ");
    match count {
        1 => format!("{name} {word}"),
        n => format!("{name} {word} ({n})"),
    }
}

/// The difference for an event at another time in the other mission, if any.
fn moved(
    (a, one): (&Facts<'_>, &NamedEvent),
    (b, other): (&Facts<'_>, &NamedEvent),
    shift: &mut i64,
) -> Option<Difference> {
    let moment = |facts: &Facts<'_>, event: &NamedEvent| Moment {
        at: facts.mission.offset(event.time),
        doubt: event.doubt,
    };
    let is_moved = is_moved([moment(a, one), moment(b, other)], shift);
    let times = (a.clock(one.time), b.clock(other.time));
    is_moved.then(|| {
        about_event(&one.key, |name| {
            Difference::changed("time", name, times.0, times.1)
        })
    })
}

/// A time since the start of a mission and its uncertainty, in nanoseconds.
pub(super) struct Moment {
    pub(super) at: i64,
    pub(super) doubt: i64,
}

/// Whether something is at another time in the second mission. If it has the same `shift` as the previous one,
/// everything is delayed, which was reported for the first one.
pub(super) fn is_moved([first, second]: [Moment; 2], shift: &mut i64) -> bool {
    let later = second.at.saturating_sub(first.at);
    let since_before = later.saturating_sub(*shift);
    let doubt = first.doubt.saturating_add(second.doubt);
    if doubt <= APART_NS {
        *shift = later;
    }
    let apart = later.saturating_abs().min(since_before.saturating_abs());
    apart
        > APART_NS
            .saturating_add(doubt)
            .saturating_add(pace(first.at.max(second.at)))
}

/// The drift of two runs in this time since the start.
pub(super) fn pace(since: i64) -> i64 {
    since / PACE
}

/// A difference in an event, with its node or topic.
fn about_event(key: &Key, of: impl FnOnce(String) -> Difference) -> Difference {
    Difference {
        element: key.1.clone(),
        ..of(name(key))
    }
}
