//! An event as one sentence: the change, the element, and the parts that appeared or vanished with it.

use std::collections::BTreeSet;

use super::{Detail, Event, EventId, Interruption, InterruptionKind, Kind, Parts, Switch};
use crate::base::ids::grouped;
use crate::base::name::{is_quiet, namespace};
use crate::base::words::{self, visible};
use crate::graph::history::begins_steadily as begins_steadily_in;
use crate::graph::{Element, Elements, NodeId, TopicId};
use crate::mission::Mission;

/// The most topics that are listed; the rest is counted. Six names of usual length fill a line of the log; with more, events of
/// nodes with many topics are paragraphs.
const NAMED: usize = 6;

/// The sentence, without a period: `/robot1/planner started: publishes plan; subscribes map, costmap`. `parts`: of all
/// events.
pub(crate) fn sentence(mission: &Mission, parts: &Parts, id: EventId, event: &Event) -> String {
    let own = parts.get(&id).map_or(&[][..], Vec::as_slice);
    sentence_with(mission, own, event)
}

/// The sentence for these parts of the event.
pub(crate) fn sentence_with(mission: &Mission, parts: &[EventId], event: &Event) -> String {
    let name = name(&mission.elements, event);
    format!("{name} {}", predicate(mission, parts, event))
}

/// The sentence without the name of the element: `30 → 5 Hz`, `restarted, away for 6.8 s`.
pub(crate) fn predicate(mission: &Mission, parts: &[EventId], event: &Event) -> String {
    let elements = &mission.elements;
    let lasted = event.lasted().map(words::duration);
    match (&event.detail, event.kind) {
        (Detail::Rates { from_hz, to_hz }, _) => {
            let change = words::rates(&[*from_hz, *to_hz]);
            format!("{change}{}", too(mission, parts, event))
        }
        (Detail::Senders { from, to }, _) => {
            let names = |nodes: &[NodeId]| node_names(elements, nodes, ", ");
            // A third node that publishes is the mux between them.
            let mux = match event.what {
                Element::Topic(topic) => mux(elements, topic, from.iter().chain(to)),
                _ => Vec::new(),
            };
            let by = match &mux[..] {
                [] => String::new(),
                mux => format!(", by {}", names(mux)),
            };
            format!("handed over: {} → {}{by}", names(from), names(to))
        }
        (Detail::Count { count: many }, kind) => {
            let over = lasted.map_or_else(String::new, |lasted| format!(" in {lasted}"));
            let times = words::count(*many, "time");
            match kind {
                Kind::Lost => {
                    let messages = words::count(*many, "message");
                    format!("{messages} lost by the recorder{over}")
                }
                Kind::Vanished => format!("vanishes and appears {times}{over}"),
                _ => format!("appears and vanishes {times}{over}"),
            }
        }
        (Detail::Values { to, .. }, Kind::Starved) => starved(event.what, to),
        (Detail::None, Kind::Duplicate) => "is the name of two nodes".to_owned(),
        (Detail::Values { from, to }, kind) => {
            let or = |text: &str| match visible(text) {
                shown if shown.is_empty() => "unknown".to_owned(),
                shown => shown.into_owned(),
            };
            let change = format!("{} → {}", or(from), or(to));
            if mission.log.compares {
                change
            } else {
                format!("{}: {change}", kind.word())
            }
        }
        (Detail::None, Kind::Restarted) => match lasted {
            Some(lasted) => format!("restarted, away for {lasted}{}", too(mission, parts, event)),
            None => format!("restarted{}", too(mission, parts, event)),
        },
        (Detail::None, Kind::Silent) => {
            let lasted = lasted.map_or_else(|| "to the end".to_owned(), |t| format!("for {t}"));
            let together = together(mission, parts, event);
            format!("silent {lasted}{together}{}", too(mission, parts, event))
        }
        (Detail::None, kind @ (Kind::Started | Kind::Stopped)) => {
            let word = mission.log.word(kind);
            let (with, too) = (with(mission, parts, event), too(mission, parts, event));
            format!("{word}{with}{too}")
        }
        (Detail::None, kind) => {
            let is_first = kind == Kind::Appeared
                && !mission.log.compares
                && !begins_steadily(mission, event.what);
            let word = match mission.log.word(kind) {
                _ if is_first => "first message",
                word => word,
            };
            format!("{word}{}", too(mission, parts, event))
        }
    }
}

/// The names of nodes in one text.
pub(super) fn node_names(elements: &Elements, nodes: &[NodeId], between: &str) -> String {
    let name = |id: &NodeId| visible(elements.nodes[*id].name.as_str());
    words::joined(nodes.iter().map(name), between)
}

/// The publishers of a topic, if none of `ends` is one.
fn mux<'a>(
    elements: &Elements,
    topic: TopicId,
    mut ends: impl Iterator<Item = &'a NodeId>,
) -> Vec<NodeId> {
    if ends.any(|node| elements.publication(*node, topic).is_some()) {
        return Vec::new();
    }
    let own = elements.publishes.iter().filter(|edge| edge.topic == topic);
    own.map(|edge| edge.node).collect()
}

/// Whether the first messages of a topic or publication are regular, so that there were none before; always true for a
/// subscription, which has no messages of its own.
fn begins_steadily(mission: &Mission, what: Element) -> bool {
    let (node, topic) = mission.elements.ends(what);
    let of = topic.map_or(&[][..], |topic| mission.sending.of_topic(topic));
    let mut own = of.iter().filter(|s| node.is_none() || s.node == node);
    matches!(what, Element::Subscribe(_)) || own.any(|s| begins_steadily_in(&s.stretches))
}

/// The other elements of an event, and those that are silent since then: `; also /odom`.
fn too(mission: &Mission, parts: &[EventId], event: &Event) -> String {
    let elements = &mission.elements;
    let own = elements.ends(event.what);
    let is_node = event.what.is_node();
    let (mut alike, mut silent) = (BTreeSet::new(), BTreeSet::new());
    for part in parts.iter().filter_map(|id| mission.log.events.get(*id)) {
        let (node, topic) = elements.ends(part.what);
        // The topics of a node that stopped or is silent are implied.
        let sent = |topic| {
            own.0
                .is_some_and(|node| elements.publication(node, topic).is_some())
        };
        let is_own = part.what == event.what || own.1.is_some() && topic == own.1;
        if is_own || is_node && topic.is_some_and(sent) {
            continue;
        }
        let is_edge = node.is_some() && node == own.0;
        let name = match topic.filter(|_| is_edge) {
            Some(topic) => visible(elements.topics[topic].name.as_str()).into_owned(),
            None => name(elements, part),
        };
        match part.kind {
            kind if kind == event.kind && kind != Kind::Restarted => alike.insert(name),
            Kind::Silent => silent.insert(name),
            _ => false,
        };
    }
    let listed = |lead: &str, names: BTreeSet<String>| match words::some_of(names, NAMED) {
        none if none.is_empty() => none,
        some => format!("; {lead} {some}"),
    };
    listed("also", alike) + &listed("silent since then:", silent)
}

/// The number of nodes of an event that are silent, of those that send: `; 8 of 10 nodes silent together`. Empty for one or
/// two, which the event names.
fn together(mission: &Mission, parts: &[EventId], event: &Event) -> String {
    let parts = parts.iter().filter_map(|id| mission.log.events.get(*id));
    let silent = parts.chain([event]).filter(|e| e.kind == Kind::Silent);
    let silent = silent.filter_map(|e| match e.what {
        Element::Node(id) => Some(id),
        _ => None,
    });
    let silent: BTreeSet<NodeId> = silent.collect();
    let is_there = |node: &NodeId| {
        let mut lives = mission.elements.nodes[*node].seen.lives.iter();
        lives.any(|life| life.contains(event.time))
    };
    let senders = mission.sending.senders.iter();
    let senders = senders.filter_map(|sender| sender.node).filter(is_there);
    let all: BTreeSet<NodeId> = senders.chain(silent.iter().copied()).collect();
    match silent.len() {
        0..=2 => String::new(),
        many => format!("; {many} of {} nodes silent together", all.len()),
    }
}

/// The subscriber that receives nothing over an edge, and the incompatible policy.
fn starved(what: Element, policy: &str) -> String {
    let whom = match what {
        Element::Publish(_) => "a subscriber gets nothing",
        _ => "gets nothing from a publisher",
    };
    match policy {
        "" => format!("{whom}: incompatible quality of service"),
        policy => format!("{whom}: incompatible {}", visible(policy)),
    }
}

/// An interruption of the recording as a sentence.
pub(crate) fn interrupted(one: &Interruption) -> String {
    let length = words::duration(one.length);
    match one.kind {
        InterruptionKind::ClockBack => format!("the recorder's clock went back by {length}"),
        InterruptionKind::Nothing => format!("nothing was recorded for {length}"),
        InterruptionKind::SimulationBack => format!("simulated time went back by {length}"),
        InterruptionKind::SimulationPaused => format!("simulation paused for {length}"),
        InterruptionKind::SimulationSpeed => {
            let speed = f64::from(one.percent) / 100.0;
            format!("the simulation runs at {speed} of its speed for {length}")
        }
    }
}

/// A switch to another mode as a sentence.
pub(crate) fn switched(one: &Switch) -> String {
    let stopped = words::count(one.stopped, "node");
    format!("mode switch: {stopped} stopped, {} started", one.started)
}

/// The name of the element of an event: its role if a role restarted.
fn name(elements: &Elements, event: &Event) -> String {
    let (node, topic) = elements.names(event.what);
    match (event.what, node.map(visible), topic.map(visible)) {
        (Element::Node(id), ..) if event.kind == Kind::Restarted => {
            visible(&elements.nodes[id].role).into_owned()
        }
        (Element::Subscribe(_), Some(node), Some(topic)) => format!("{topic} → {node}"),
        (_, Some(node), Some(topic)) => format!("{node} → {topic}"),
        (_, node, topic) => node.or(topic).unwrap_or_default().into_owned(),
    }
}

/// The topics that a node publishes and subscribes, by the parts of its event: `: publishes plan; subscribes map`.
fn with(mission: &Mission, parts: &[EventId], event: &Event) -> String {
    let elements = &mission.elements;
    let (mut sends, mut takes) = (BTreeSet::new(), BTreeSet::new());
    let events = &mission.log.events;
    let node = elements.ends(event.what).0;
    let parts = parts.iter().filter_map(|id| events.get(*id));
    // Others may depend on it, such as its subscribers.
    for part in parts.filter(|part| elements.ends(part.what).0 == node) {
        match part.what {
            Element::Publish(edge) => sends.insert(elements.publishes[edge].topic),
            Element::Subscribe(edge) => takes.insert(elements.subscribes[edge].topic),
            _ => false,
        };
    }
    let space = node.map_or("", |id| namespace(elements.nodes[id].name.as_str()));
    let phrases = [("publishes", sends), ("subscribes to", takes)].map(|(verb, topics)| {
        let names = short_topics(elements, &topics, space);
        (!names.is_empty()).then(|| format!("{verb} {}", words::some_of(names, NAMED)))
    });
    match words::joined(phrases.into_iter().flatten(), "; ") {
        nothing if nothing.is_empty() => nothing,
        phrases => format!(": {phrases}"),
    }
}

/// The topics of an action, which are listed as one.
const ACTION: [&str; 5] = ["goal", "cancel", "status", "feedback", "result"];

/// The names of topics within a namespace, actions as one name, without housekeeping.
fn short_topics(elements: &Elements, topics: &BTreeSet<TopicId>, space: &str) -> Vec<String> {
    let full = |id: &TopicId| elements.topics[*id].name.as_str();
    let action = |name: &str| {
        let (action, part) = name.rsplit_once('/')?;
        ACTION.contains(&part).then(|| action.to_owned())
    };
    let actions = topics.iter().filter_map(|id| action(full(id)));
    let parts = grouped(actions.map(|action| (action, ())));
    let (mut names, mut seen) = (Vec::new(), BTreeSet::new());
    for name in topics.iter().map(full).filter(|name| !is_quiet(name)) {
        let within = |name: &str| {
            let inner = name.strip_prefix(space).filter(|_| space != "/");
            let inner = inner.and_then(|rest| rest.strip_prefix('/'));
            visible(inner.unwrap_or(name)).into_owned()
        };
        let phrase = match action(name).filter(|action| parts[action].len() > 1) {
            Some(action) => format!("{} (action)", within(action.trim_end_matches("/_action"))),
            None => within(name),
        };
        if seen.insert(phrase.clone()) {
            names.push(phrase);
        }
    }
    names
}
