//! The nodes and topics that are listed as words, because a line for each would tell nothing.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::choose::{Selection, is_infrastructure};
use super::fold::namespaces;
use super::fold::rows::Drawn;
use super::fold::topics::Groups;
use super::{AlsoHere, ArrowId, Item, ItemId, ItemKind, Looks, Namespace, View, ViewOptions};
use crate::base::name::lies_in;
use crate::base::time::Stamp;
use crate::graph::window::default_period;
use crate::graph::{ById, Element, Elements, NodeId, Topic, TopicId};
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

/// The drawn part of a view. Its windows are left out.
#[derive(Debug)]
pub(crate) struct DrawnPart {
    /// The boxes and arrows that are drawn, and the other items as words.
    pub(crate) view: View,
    /// Whether each item, and each arrow, of the view is drawn.
    pub(crate) items: ById<ItemId, bool>,
    pub(crate) arrows: ById<ArrowId, bool>,
}

/// The part of a mission's view that is drawn; `None` for all of it, which includes views most of whose nodes would be
/// words.
pub(crate) fn drawn_part(
    view: &View,
    mission: &Mission,
    options: &ViewOptions,
) -> Option<DrawnPart> {
    let topics = drawn_in_pages(mission, options);
    let is_hidden = |what: &Element| match what {
        Element::Topic(id) => !topics[*id],
        _ => false,
    };
    let is_hidden = |item: &Item| item.members.iter().all(is_hidden);
    let hidden: ById<ItemId, bool> = view.items.iter().map(is_hidden).collect();
    let arrows = view.arrows.iter();
    let ends = arrows.map(|arrow| [arrow.from, arrow.to]);
    let arrows: ById<ArrowId, bool> = ends
        .clone()
        .map(|ends| !ends.iter().any(|at| hidden[*at]))
        .collect();
    let lined = ends.zip(&arrows).filter(|(_, drawn)| **drawn);
    let lined: BTreeSet<ItemId> = lined.flat_map(|(ends, _)| ends).collect();
    let is_node = |at: ItemId| view.items[at].kind == ItemKind::Node;
    let items: ById<ItemId, bool> = (hidden.ids())
        .map(|at| !hidden[at] && (!is_node(at) || lined.contains(&at)))
        .collect();
    let nodes = |is_drawn: bool| {
        (items.ids())
            .filter(|at| is_node(*at) && items[*at] == is_drawn)
            .count()
    };
    if items.iter().all(|drawn| *drawn) || nodes(false) > nodes(true) {
        return None;
    }
    let mut part = Drawn {
        items: view.items.clone(),
        arrows: view.arrows.clone(),
        items_shown: view.items_shown.clone(),
        arrows_shown: view.arrows_shown.clone(),
    };
    let is_word: Vec<bool> = items.iter().map(|drawn| !drawn).collect();
    let words = filtered(&view.items, &is_word);
    let shown = filtered(&view.items_shown, &is_word);
    part.keep_arrows(&arrows);
    part.keep_items(&items);
    let namespaces =
        namespaces::clusters(&mut part.items, options.group.namespaces, &BTreeSet::new());
    Some(DrawnPart {
        view: View {
            also: also_here(words, shown, &namespaces),
            items: part.items,
            arrows: part.arrows,
            namespaces,
            items_shown: part.items_shown,
            arrows_shown: part.arrows_shown,
            compares: view.compares,
            ..View::default()
        },
        items,
        arrows,
    })
}

fn filtered<T: Clone>(all: &[T], kept: &[bool]) -> Vec<T> {
    let kept = all.iter().zip(kept).filter(|(_, kept)| **kept);
    kept.map(|(one, _)| one.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::view;

    /// The names in words; `None` if all is drawn.
    fn words(windows: &[&str]) -> Option<Vec<String>> {
        let (mission, options) = (mission(windows), ViewOptions::default());
        let whole = view(&mission, &options).0;
        let part = drawn_part(&whole, &mission, &options)?;
        let drawn = whole
            .items
            .iter()
            .zip(&part.items)
            .filter(|(_, drawn)| **drawn);
        let drawn: Vec<&str> = drawn.map(|(item, _)| &*item.name).collect();
        let kept: Vec<&str> = part.view.items.iter().map(|item| &*item.name).collect();
        assert_eq!(drawn, kept);
        for arrow in &part.view.arrows {
            assert!(
                [arrow.from, arrow.to]
                    .iter()
                    .all(|end| part.view.items.get(*end).is_some())
            );
        }
        let also = part.view.also.iter().flat_map(|also| &also.items);
        Some(also.map(|item| item.name.to_string()).collect())
    }

    #[test]
    fn infrastructure_and_the_nodes_that_only_it_connects_are_words() {
        let found =
            words(&["/b/driver>/b/odom@5 /b/ekf</b/odom /b/camera_tf>/tf@5 /b/driver>/tf@9"]);
        assert_eq!(found.unwrap(), ["/tf", "/b/camera_tf"]);
    }

    #[test]
    fn topics_without_a_subscriber_are_drawn() {
        let found = words(&["/driver>/odom@5 /driver>/tf@9"]);
        assert_eq!(found.unwrap(), ["/tf"]);
    }

    #[test]
    fn a_view_of_infrastructure_is_drawn_as_a_whole() {
        assert_eq!(words(&["/a>/tf@5 /b</tf"]), None);
        assert_eq!(words(&["/a>/x@1 /b</x /c>/tf@1 /d>/tf@1 /e>/tf@1"]), None);
    }
}
