//! An entry as one sentence: what happened to whom, and what came or went with it.

use std::collections::BTreeSet;

use crate::base::name::is_quiet;
use crate::base::words::{self, visible};
use crate::graph::{Element, Elements, TopicId};
use crate::mission::Mission;
use crate::mission::ledger::{Detail, Entry, EntryId, Kind};

/// So many topics are named; the rest is counted.
const NAMED: usize = 6;

/// The sentence, without a period: `/robot1/planner started: publishes plan; subscribes map, costmap`.
pub(crate) fn sentence(mission: &Mission, id: EntryId, entry: &Entry) -> String {
    let all = (0..).zip(&mission.ledger.entries);
    let parts = all
        .filter(|(_, e)| e.part_of == Some(id))
        .map(|(part, _)| part);
    sentence_with(mission, &parts.collect::<Vec<_>>(), entry)
}

/// The same for whoever knows the entries that are part of it.
pub(crate) fn sentence_with(mission: &Mission, parts: &[EntryId], entry: &Entry) -> String {
    let elements = &mission.elements;
    let name = name(elements, entry);
    let lasted = entry
        .until
        .map(|until| words::duration(until.since(entry.time).max(0)));
    match (&entry.detail, entry.kind) {
        (Detail::Rates { from_hz, to_hz }, _) => {
            format!("{name} {}", words::rate_change(*from_hz, *to_hz))
        }
        (Detail::Senders { from, to }, _) => {
            let names = |nodes: &[u32]| {
                let name =
                    |id: &u32| visible(elements.nodes[*id as usize].name.as_str()).into_owned();
                nodes.iter().map(name).collect::<Vec<_>>().join(", ")
            };
            format!("{name} handed over: {} → {}", names(from), names(to))
        }
        (Detail::Values { from, to }, kind) => {
            let or = |text: &str| {
                let shown = visible(text).into_owned();
                if shown.is_empty() {
                    "unknown".to_owned()
                } else {
                    shown
                }
            };
            let change = format!("{} → {}", or(from), or(to));
            if mission.ledger.compares {
                format!("{name} {change}")
            } else {
                format!("{name} {}: {change}", kind.word())
            }
        }
        (Detail::None, Kind::Restarted) => match lasted {
            Some(lasted) => format!("{name} restarted, away for {lasted}"),
            None => format!("{name} restarted"),
        },
        (Detail::None, Kind::Silent) => match lasted {
            Some(lasted) => format!("{name} silent for {lasted}"),
            None => format!("{name} silent to the end"),
        },
        (Detail::None, kind @ (Kind::Started | Kind::Stopped)) => {
            let word = mission.ledger.word(kind);
            format!("{name} {word}{}", with(mission, parts, entry))
        }
        (Detail::None, kind) => format!("{name} {}", mission.ledger.word(kind)),
    }
}

/// Whom an entry is about: a role where a role restarted.
fn name(elements: &Elements, entry: &Entry) -> String {
    let node = |id: u32| visible(elements.nodes[id as usize].name.as_str());
    let topic = |id: u32| visible(elements.topics[id as usize].name.as_str());
    match entry.what {
        Element::Node(id) if entry.kind == Kind::Restarted => {
            visible(&elements.nodes[id as usize].role).into_owned()
        }
        Element::Node(id) => node(id).into_owned(),
        Element::Topic(id) => topic(id).into_owned(),
        Element::Publish(id) => {
            let edge = &elements.publishes[id as usize];
            format!("{} → {}", node(edge.node), topic(edge.topic))
        }
        Element::Subscribe(id) => {
            let edge = &elements.subscribes[id as usize];
            format!("{} → {}", topic(edge.topic), node(edge.node))
        }
    }
}

/// What a node publishes and subscribes, by the parts of its entry: `: publishes plan; subscribes map`.
fn with(mission: &Mission, parts: &[EntryId], entry: &Entry) -> String {
    let elements = &mission.elements;
    let (mut sends, mut takes) = (BTreeSet::new(), BTreeSet::new());
    let entries = &mission.ledger.entries;
    for part in parts.iter().filter_map(|id| entries.get(*id as usize)) {
        match part.what {
            Element::Publish(edge) => sends.insert(elements.publishes[edge as usize].topic),
            Element::Subscribe(edge) => takes.insert(elements.subscribes[edge as usize].topic),
            _ => false,
        };
    }
    let node = elements.ends(entry.what).0;
    let space = node.map_or("", |id| {
        crate::base::name::namespace(elements.nodes[id as usize].name.as_str())
    });
    let said = [("publishes", sends), ("subscribes", takes)].map(|(verb, topics)| {
        let names = topics_as_said(elements, &topics, space);
        (!names.is_empty()).then(|| format!("{verb} {}", words::some_of(&names, NAMED)))
    });
    let said: Vec<String> = said.into_iter().flatten().collect();
    if said.is_empty() {
        String::new()
    } else {
        format!(": {}", said.join("; "))
    }
}

/// The parts of an action, which are named as one.
const ACTION: [&str; 5] = ["goal", "cancel", "status", "feedback", "result"];

/// The names of topics within a namespace, actions as one, housekeeping left out.
fn topics_as_said(elements: &Elements, topics: &BTreeSet<TopicId>, space: &str) -> Vec<String> {
    let full = |id: &TopicId| elements.topics[*id as usize].name.as_str();
    let parts = |name: &str| {
        let of = |id: &TopicId| {
            full(id)
                .rsplit_once('/')
                .is_some_and(|(a, p)| a == name && ACTION.contains(&p))
        };
        topics.iter().filter(|id| of(id)).count()
    };
    let mut names: Vec<String> = Vec::new();
    for name in topics.iter().map(full).filter(|name| !is_quiet(name)) {
        let within = |name: &str| {
            let inner = name.strip_prefix(space).filter(|_| space != "/");
            let inner = inner.and_then(|rest| rest.strip_prefix('/'));
            visible(inner.unwrap_or(name)).into_owned()
        };
        let said = match name.rsplit_once('/') {
            Some((action, part)) if ACTION.contains(&part) && parts(action) > 1 => {
                format!("{} (action)", within(action.trim_end_matches("/_action")))
            }
            _ => within(name),
        };
        if !names.contains(&said) {
            names.push(said);
        }
    }
    names
}
