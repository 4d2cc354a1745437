//! One headline per cause: consequences of another event, repeated appearances, and simultaneous events of many
//! elements become parts of one event. Each rule below has an example.

use std::collections::BTreeMap;

use super::drafts::{Drafts, LogInput};
use super::{Detail, Event, EventId, Kind};
use crate::base::ids::grouped;
use crate::base::rhythm::{CLOSE_NS, CROWD_NS, FLAPS, SAME_STEP, TOGETHER_NS};
use crate::base::time::Stamp;
use crate::graph::{Element, NodeId, Wiring};

/// Makes events with a known cause parts of it.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    hand_overs(context, drafts);
    let wiring = wiring(context);
    subscribers(context, &wiring, drafts);
    follow_inputs(context, &wiring, drafts);
    flaps(drafts);
    simultaneous(context, drafts);
    drafts.flatten();
}

/// The ids of the headlines of some kinds, sorted by time.
fn headlines(drafts: &Drafts, kinds: &[Kind]) -> Vec<EventId> {
    let all = drafts.list.with_ids();
    let wanted = all.filter(|(_, e)| e.is_headline() && kinds.contains(&e.kind));
    let mut places: Vec<EventId> = wanted.map(|(id, _)| id).collect();
    places.sort_by_key(|id| (drafts.get(*id).time, *id));
    places
}

/// The ids of events about nodes or topics, by what `key` finds in them.
fn by<K: Ord>(
    drafts: &Drafts,
    ids: impl IntoIterator<Item = EventId>,
    key: impl Fn(&Event) -> Option<K>,
) -> BTreeMap<K, Vec<EventId>> {
    let ids = ids.into_iter();
    grouped(ids.filter_map(|id| Some((key(drafts.get(id))?, id))))
}

/// The publications of a topic that another node takes over end and begin with that. A node that is known only from one topic's
/// messages need not have stopped or started, and falls silent: if `/joystick` is known from `/cmd_vel` alone and `/nav` takes it
/// over, `/joystick` is still there.
fn hand_overs(context: &LogInput<'_>, drafts: &mut Drafts) {
    let limits = headlines(
        drafts,
        &[
            Kind::Started,
            Kind::Stopped,
            Kind::Silent,
            Kind::Appeared,
            Kind::Vanished,
        ],
    );
    let limits = by(drafts, limits, |event| Some((event.what, event.kind)));
    let steps = by(drafts, headlines(drafts, &[Kind::Rate]), |event| {
        let (node, topic) = context.elements.ends(event.what);
        topic.filter(|_| node.is_some())
    });
    let sent = context.elements.wiring(|_, _| true).published;
    // Whether a node is known only from the messages of a topic.
    let is_only_sender = |node: NodeId, topic| {
        let mut words = context.elements.nodes[node].seen.evidence.words();
        let mut others = sent[node].iter().filter(|other| **other != topic);
        // Every node publishes `/rosout`.
        words.all(|word| ["connection", "links", "rosout_rule"].contains(&word))
            && others.all(|other| context.is_by_the_way(*other))
    };
    for hand in headlines(drafts, &[Kind::HandedOver]) {
        let event = drafts.get(hand).clone();
        let (Detail::Senders { from, to }, Element::Topic(topic)) = (&event.detail, event.what)
        else {
            continue;
        };
        for step in steps.get(&topic).into_iter().flatten() {
            let other = drafts.get(*step);
            let node = context.elements.ends(other.what).0;
            // A mux has the rate of the sender that it selects.
            let is_mux = node.is_some_and(|node| !from.contains(&node) && !to.contains(&node));
            if is_mux && is_within(other.time, event.time, TOGETHER_NS) {
                drafts.fold(*step, hand);
            }
        }
        let ends = [
            (from, Kind::Stopped, event.earliest),
            (from, Kind::Silent, event.earliest),
            (from, Kind::Vanished, event.earliest),
            (to, Kind::Started, event.time),
            (to, Kind::Appeared, event.time),
        ];
        for (nodes, kind, at) in ends {
            let own = nodes.iter().filter_map(|node| match kind {
                Kind::Vanished | Kind::Appeared => context.elements.published((*node, topic)),
                _ => Some(Element::Node(*node)).filter(|_| is_only_sender(*node, topic)),
            });
            for id in own.filter_map(|what| limits.get(&(what, kind))).flatten() {
                if is_within(drafts.get(*id).time, at, TOGETHER_NS) {
                    drafts.fold(*id, hand);
                }
            }
        }
    }
}

/// Subscriptions that appear or vanish with the topic's publisher are consequences: `/viewer` subscribes to `/map` again when
/// `/map_server` has restarted.
fn subscribers(context: &LogInput<'_>, wiring: &Wiring, drafts: &mut Drafts) {
    let limits = by(drafts, drafts.list.ids(), |event| match event.what {
        Element::Node(node) => Some(node),
        _ => None,
    });
    for id in headlines(drafts, &[Kind::Appeared, Kind::Vanished]) {
        let event = drafts.get(id);
        let (Element::Subscribe(_), (_, Some(topic))) =
            (event.what, context.elements.ends(event.what))
        else {
            continue;
        };
        let is_cause = |cause: &Event| {
            let at = match (event.kind, cause.kind) {
                (Kind::Appeared, Kind::Restarted) => cause.until.unwrap_or(cause.time),
                (Kind::Appeared, Kind::Started)
                | (Kind::Vanished, Kind::Stopped | Kind::Restarted) => cause.time,
                _ => return false,
            };
            is_within(at, event.time, TOGETHER_NS)
        };
        let senders = wiring.publishers[topic].iter();
        let mut of = senders.filter_map(|node| limits.get(node)).flatten();
        if let Some(cause) = of.find(|id| is_cause(drafts.get(**id))).copied() {
            drafts.fold(id, cause);
        }
    }
}

/// The ends of each topic, without housekeeping.
fn wiring(context: &LogInput<'_>) -> Wiring {
    context.elements.wiring(|node, topic| {
        !context.is_by_the_way(topic) && !context.elements.nodes[node].is_tool()
    })
}

/// The publishers of an event's element.
fn senders(context: &LogInput<'_>, wiring: &Wiring, what: Element) -> Vec<NodeId> {
    match (context.elements.ends(what), what) {
        ((_, Some(topic)), Element::Topic(_)) => wiring.publishers[topic].clone(),
        ((node, _), _) => node.into_iter().collect(),
    }
}

/// A silence that begins within an input's pause is a part of it, and so is a rate change that an input has too: `/detector` is
/// silent while `/camera` is, and sends at half its rate when `/camera` does.
fn follow_inputs(context: &LogInput<'_>, wiring: &Wiring, drafts: &mut Drafts) {
    let pauses = by(drafts, drafts.list.ids(), |event| {
        let is_pause = matches!(event.kind, Kind::Silent | Kind::Stopped | Kind::Restarted);
        is_pause.then_some(event.what)
    });
    let steps = by(drafts, drafts.list.ids(), |event| {
        let topic = context.elements.ends(event.what).1;
        topic.filter(|_| event.kind == Kind::Rate)
    });
    for id in headlines(drafts, &[Kind::Silent, Kind::Rate]) {
        let event = drafts.get(id);
        let own = senders(context, wiring, event.what);
        let inputs = own.iter().map(|node| &wiring.subscribed[*node]);
        let cause = inputs.flatten().find_map(|input| {
            if event.kind == Kind::Rate {
                let mut of = steps.get(input).into_iter().flatten().copied();
                return of.find(|step| is_same_step(event, drafts.get(*step), CROWD_NS));
            }
            let senders = wiring.publishers[*input].iter();
            let whose = senders.map(|node| Element::Node(*node));
            let whose = whose.chain([Element::Topic(*input)]);
            let mut of = whose
                .filter_map(|what| pauses.get(&what))
                .flatten()
                .copied();
            of.find(|pause| follows(event, drafts.get(*pause)))
        });
        if let Some(cause) = cause {
            drafts.fold(id, cause);
        }
    }
}

/// Whether a silence begins within a pause of its input.
fn follows(silence: &Event, pause: &Event) -> bool {
    let until = match pause.kind {
        Kind::Stopped => pause.time.plus(TOGETHER_NS),
        _ => pause.until.unwrap_or(Stamp::MAX),
    };
    pause.what != silence.what && pause.time <= silence.time.plus(CROWD_NS) && silence.time <= until
}

/// Whether two rate changes are about equal, and at most `within` nanoseconds from each other.
fn is_same_step(one: &Event, other: &Event, within: i64) -> bool {
    let ratio = |event: &Event| match event.detail {
        Detail::Rates { from_hz, to_hz } => to_hz / from_hz,
        _ => f64::NAN,
    };
    let between = ratio(one) / ratio(other);
    let is_near =
        one.earliest <= other.latest.plus(within) && other.earliest <= one.latest.plus(within);
    one.what != other.what && is_near && (1.0 / SAME_STEP..=SAME_STEP).contains(&between)
}

/// An edge or topic that appears and vanishes repeatedly is one event: a viewer that subscribes to `/image` ten times.
fn flaps(drafts: &mut Drafts) {
    let all = headlines(drafts, &[Kind::Appeared, Kind::Vanished]);
    for own in by(drafts, all, |event| Some(event.what)).values() {
        let is_begin = |id: &&EventId| drafts.get(**id).kind == Kind::Appeared;
        let many = own.iter().filter(is_begin).count();
        let [first, rest @ .., last] = &own[..] else {
            continue;
        };
        if many < FLAPS {
            continue;
        }
        let until = drafts.get(*last).time;
        let event = &mut drafts.list[*first];
        event.detail = Detail::Count { count: many as u64 };
        event.until = Some(until);
        for id in rest.iter().chain([last]) {
            drafts.fold(*id, *first);
        }
    }
}

/// Simultaneous events of many elements are one event: connections of one node or topics of unknown publishers that
/// appear or vanish, silences that begin and end together, equal rate changes. For example, a switch of the network fails, and
/// twelve topics are silent from 40 s to 43 s.
fn simultaneous(context: &LogInput<'_>, drafts: &mut Drafts) {
    for kind in [Kind::Appeared, Kind::Vanished, Kind::Silent, Kind::Rate] {
        // The silences of several nodes have one cause, and so have equal rate changes.
        let is_of_any = matches!(kind, Kind::Silent | Kind::Rate);
        let of = by(drafts, headlines(drafts, &[kind]), |event| {
            let node = context.elements.ends(event.what).0;
            Some(node.filter(|_| !is_of_any))
        });
        for places in of.values() {
            for (at, first) in places.iter().enumerate() {
                let one = drafts.get(*first).clone();
                if !one.is_headline() {
                    continue;
                }
                let rest = places[at + 1..].iter().map(|id| (*id, drafts.get(*id)));
                let soon = rest.take_while(|(_, other)| is_within(other.time, one.time, CLOSE_NS));
                let alike = soon.filter(|(_, other)| is_alike(&one, other));
                let alike: Vec<EventId> = alike.map(|(id, _)| id).collect();
                for id in alike {
                    drafts.fold(id, *first);
                }
            }
        }
    }
}

/// Whether two headlines of a kind are about the same moment, and the same change.
fn is_alike(first: &Event, other: &Event) -> bool {
    let ends = match (first.until, other.until) {
        (Some(a), Some(b)) => is_within(a, b, CROWD_NS),
        (a, b) => a.is_none() && b.is_none(),
    };
    other.is_headline()
        && match first.kind {
            Kind::Rate => is_same_step(first, other, 0),
            _ => is_within(other.time, first.time, CROWD_NS) && ends,
        }
}

fn is_within(a: Stamp, b: Stamp, within: i64) -> bool {
    a.since(b).abs() <= within
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::TopicId;
    use crate::graph::history::Bound;

    const SECOND: i64 = 1_000_000_000;

    fn event(kind: Kind, topic: u32, from: i64, until: Option<i64>) -> Event {
        let time = Stamp(from * SECOND);
        let at = Bound {
            time,
            earliest: time,
            latest: time,
        };
        Event {
            until: until.map(|at| Stamp(at * SECOND)),
            ..Event::new(kind, Element::Topic(TopicId(topic)), at)
        }
    }

    fn step(topic: u32, at: i64, from_hz: f64, to_hz: f64) -> Event {
        Event {
            detail: Detail::Rates { from_hz, to_hz },
            ..event(Kind::Rate, topic, at, None)
        }
    }

    #[test]
    fn a_silence_follows_an_input_only_within_its_pause() {
        let pause = event(Kind::Silent, 1, 10, Some(15));
        let silence = |from| event(Kind::Silent, 2, from, Some(16));
        assert!(follows(&silence(10), &pause) && follows(&silence(14), &pause));
        assert!(!follows(&silence(16), &pause) && !follows(&silence(8), &pause));
        assert!(!follows(&pause, &pause));
    }

    #[test]
    fn equal_simultaneous_rate_changes_are_merged() {
        let camera = step(1, 60, 30.0, 5.0);
        assert!(is_same_step(&step(2, 60, 6.0, 1.0), &camera, 0));
        assert!(!is_same_step(&step(2, 60, 6.0, 3.0), &camera, 0));
        assert!(!is_same_step(&step(2, 64, 6.0, 1.0), &camera, CROWD_NS));
    }

    #[test]
    fn parts_are_flattened_and_never_cyclic() {
        let mut drafts = Drafts::default();
        for topic in 0..3 {
            drafts.add(event(Kind::Silent, topic, 1, None));
        }
        drafts.fold(EventId(2), EventId(1));
        drafts.fold(EventId(1), EventId(0));
        drafts.fold(EventId(0), EventId(2));
        drafts.flatten();
        let wholes: Vec<_> = drafts.list.iter().map(|e| e.part_of).collect();
        assert_eq!(wholes, [None, Some(EventId(0)), Some(EventId(0))]);
    }
}
