//! The choices of bundles: the topics that draw no line, the names of the others, and the nodes that are listed as words.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::group::Groups;
use super::names::is_infrastructure;
use super::select::Selection;
use super::{AlsoHere, Item, Looks, Namespace, ViewOptions};
use crate::base::name::lies_in;
use crate::base::time::Stamp;
use crate::graph::window::default_period;
use crate::graph::{ById, Elements, NodeId, Topic, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::{Event, Kind};

/// The name of each topic in a bundle: that of its group, if it is in one.
pub(crate) fn names(elements: &Elements, groups: &Groups) -> ById<TopicId, Arc<str>> {
    let names = elements.topics.iter().map(|t| t.name.shared());
    let mut names: ById<TopicId, Arc<str>> = names.collect();
    for (name, ids) in groups {
        let name: Arc<str> = name.as_str().into();
        for id in ids {
            names[*id] = Arc::clone(&name);
        }
    }
    names
}

/// Whether bundles draw each topic: those that half the system is connected to are not drawn, unless one of
/// their connections changes or there is no other topic.
pub(crate) fn drawn(mission: &Mission, options: &ViewOptions) -> ById<TopicId, bool> {
    let elements = &mission.elements;
    let drawn = plain(elements, options);
    let mut connected = ById::like(&drawn, 0_u8);
    let both = [(&elements.publishes, 1), (&elements.subscribes, 2)];
    for (edges, end) in both {
        for edge in edges {
            connected[edge.topic] |= end;
        }
    }
    if !drawn
        .iter()
        .zip(&connected)
        .any(|(drawn, ends)| *drawn && *ends == 3)
    {
        return ById::like(&drawn, true);
    }
    with_changing(mission, drawn)
}

/// Whether pages draw each topic: all but infrastructure without a connection that changes.
pub(super) fn drawn_in_pages(mission: &Mission, options: &ViewOptions) -> ById<TopicId, bool> {
    with_changing(mission, plain(&mission.elements, options))
}

/// Whether each topic is no infrastructure.
fn plain(elements: &Elements, options: &ViewOptions) -> ById<TopicId, bool> {
    let plain = |topic: &Topic| !options.hide.quiet || !is_infrastructure(topic.name.as_str());
    elements.topics.iter().map(plain).collect()
}

/// These topics, and those with a connection that changes.
fn with_changing(mission: &Mission, mut drawn: ById<TopicId, bool>) -> ById<TopicId, bool> {
    let events = mission.log.events.iter();
    for event in events.filter(|event| event.is_headline()) {
        if let (Some(_), Some(topic)) = mission.elements.ends(event.what) {
            drawn[topic] = true;
        }
    }
    drawn
}

/// Whether each node has no line to another, or, if leaves are listed as words, only one whose two ends never
/// change; no node if fewer than half of the nodes have a line.
pub(crate) fn nodes_in_words(
    mission: &Mission,
    (selection, drawn): (&Selection, &ById<TopicId, bool>),
    are_leaves_in_words: bool,
) -> ById<NodeId, bool> {
    let elements = &mission.elements;
    let wiring = elements.wiring(|node, _| selection.nodes[node].is_none());
    let ends: ById<TopicId, [Vec<NodeId>; 2]> = wiring
        .publishers
        .into_iter()
        .zip(wiring.subscribers)
        .map(<[_; 2]>::from)
        .collect();
    let (changes, changes_itself) = changing_nodes(mission, drawn, &ends);
    let is_drawn = drawn.iter().zip(&selection.topics);
    let is_drawn = is_drawn.map(|(drawn, reason)| *drawn && reason.is_none());
    // The only partner of each node; itself where there are several.
    let mut partner: ById<NodeId, Option<NodeId>> = ById::like(&elements.nodes, None);
    for (ends, _) in ends.iter().zip(is_drawn).filter(|(_, drawn)| *drawn) {
        for (these, others) in [(&ends[0], &ends[1]), (&ends[1], &ends[0])] {
            for node in these {
                // Two are enough to know that there are several.
                for other in others.iter().filter(|other| *other != node).take(2) {
                    let partner = &mut partner[*node];
                    *partner = Some(if partner.is_none_or(|old| old == *other) {
                        *other
                    } else {
                        *node
                    });
                }
            }
        }
    }
    let seen = selection
        .nodes
        .iter()
        .filter(|reason| reason.is_none())
        .count();
    if 2 * partner.iter().flatten().count() < seen {
        return ById::like(&partner, false);
    }
    let is_hub = |node: NodeId| partner[node] == Some(node);
    let is_in_words = |(node, changes): (NodeId, &bool)| match partner[node] {
        None => true,
        Some(other) if other != node && are_leaves_in_words => {
            is_hub(other) && !changes && !changes_itself[other]
        }
        Some(_) => false,
    };
    changes.with_ids().map(is_in_words).collect()
}

/// For each node, whether there is an event about it, its connections or a topic of its own, and whether
/// there is one about it or its connections. A start in the first window is not a change, as the node exists
/// in most of the picture.
fn changing_nodes(
    mission: &Mission,
    drawn: &ById<TopicId, bool>,
    ends: &ById<TopicId, [Vec<NodeId>; 2]>,
) -> (ById<NodeId, bool>, ById<NodeId, bool>) {
    let mut changes = ById::like(&mission.elements.nodes, false);
    let mut changes_itself = changes.clone();
    for event in changed(mission) {
        let nodes = match mission.elements.ends(event.what) {
            (Some(node), _) => {
                changes_itself[node] = true;
                vec![node]
            }
            (None, Some(topic)) if drawn[topic] => ends[topic].concat(),
            (None, _) => Vec::new(),
        };
        for node in nodes {
            changes[node] = true;
        }
    }
    (changes, changes_itself)
}

/// If the mission is one window: the time until which elements that begin appear to have been there from the
/// beginning.
pub(crate) fn beginning(mission: &Mission) -> Option<Stamp> {
    let first = default_period(mission.span.nanos());
    let end = mission.span.start.plus(first.nanos());
    (mission.windows.len() == 1 && !mission.log.compares).then_some(end)
}

/// The headlines except starts in the first window, or at the beginning of the only one.
pub(crate) fn changed(mission: &Mission) -> impl Iterator<Item = &Event> {
    let first = mission.windows.first().map(|window| window.span.end);
    let first = beginning(mission).or(first);
    let is_first =
        move |e: &Event| e.kind == Kind::Started && first.is_some_and(|end| e.time < end);
    let events = mission.log.events.iter();
    events.filter(move |event| event.is_headline() && !is_first(event))
}

/// These nodes with their looks, by the innermost namespace with a box.
pub(super) fn also_here(
    items: Vec<Item>,
    shown: Vec<Looks>,
    namespaces: &[Namespace],
) -> Vec<AlsoHere> {
    let mut also: BTreeMap<Option<usize>, AlsoHere> = BTreeMap::new();
    let shown = shown.into_iter().map(Some).chain(std::iter::repeat(None));
    for (item, shown) in items.into_iter().zip(shown) {
        let is_around = |space: &Namespace| lies_in(&item.name, &space.name);
        // Children come after their parents.
        let cluster = namespaces.iter().rposition(is_around);
        let also = also.entry(cluster).or_default();
        also.cluster = cluster;
        also.items.push(item);
        also.shown.extend(shown);
    }
    also.into_values().collect()
}
