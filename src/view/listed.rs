//! The nodes and topics that are listed as words, because a line for each would tell nothing.
//!
//! `/rosout`, a node that only publishes it, and a topic without any known node are words. Pictures decide it before their
//! boxes are made ([`Words`]); pages draw all of a view or a part of it ([`drawn_part`]).

use std::collections::{BTreeMap, BTreeSet};

use super::choose::{Selection, is_infrastructure};
use super::fold::namespaces::{clusters, headlines};
use super::fold::{self, ItemKey, Keys};
use super::{AlsoHere, ArrowId, Item, ItemId, ItemKind, Namespace, ShownRuns, View, ViewOptions};
use crate::base::time::Stamp;
use crate::graph::window::default_period;
use crate::graph::{ById, Element, Elements, NodeId, Topic, TopicId, Wiring};
use crate::mission::Mission;
use crate::mission::event_log::{Event, Kind};

/// Whether bundles draw each topic: those that half the system is connected to are not drawn, unless one of
/// their connections changes or there is no other topic.
pub(crate) fn drawn(mission: &Mission, options: &ViewOptions) -> ById<TopicId, bool> {
    let drawn = plain(&mission.elements, options);
    let wiring = mission.elements.wiring(|_, topic| drawn[topic]);
    let ends = wiring.publishers.iter().zip(&wiring.subscribers);
    let mut lines = ends.filter(|(from, to)| !from.is_empty() && !to.is_empty());
    if lines.next().is_none() {
        return ById::like(&drawn, true);
    }
    with_changing(mission, drawn)
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

/// Whether each node and each topic of a picture is listed as a word; outputs that are files of data or can be expanded
/// have a box for each.
pub(crate) struct Words {
    nodes: ById<NodeId, bool>,
    topics: ById<TopicId, bool>,
    /// The topics of each node that are only counted.
    pub(crate) counted: ById<NodeId, Vec<TopicId>>,
}

impl Words {
    /// The words among the elements with a box: nodes without a line, and topics without a known endpoint. In bundles, the
    /// topics are those with an event although no line carries them; if they have one known endpoint, they get a box beside
    /// it instead, and so do those that it sends.
    pub(crate) fn new(
        mission: &Mission,
        options: &ViewOptions,
        (selection, drawn): (&Selection, &ById<TopicId, bool>),
        keys: &mut Keys,
    ) -> Self {
        let elements = &mission.elements;
        let mut words = Self {
            nodes: ById::like(&elements.nodes, false),
            topics: ById::like(&elements.topics, false),
            counted: ById::like(&elements.nodes, Vec::new()),
        };
        if !options.is_picture {
            return words;
        }
        let wiring = elements.wiring(|node, _| selection.nodes[node].is_none());
        let changing = changing_nodes(mission, drawn, &wiring);
        words.nodes = nodes(elements, options, (selection, drawn), &wiring, &changing);
        let reported: BTreeSet<TopicId> = headlines(mission)
            .filter_map(|what| elements.ends(what).1)
            .collect();
        let is_anything = selection.nodes.iter().any(Option::is_none);
        for at in elements.topics.ids() {
            let boxes = |nodes: &[NodeId]| -> BTreeSet<ItemKey> {
                let keys = nodes.iter().map(|id| fold::of(keys, Element::Node(*id)));
                keys.flatten().cloned().collect()
            };
            let ends = [&wiring.publishers[at], &wiring.subscribers[at]].map(|nodes| boxes(nodes));
            let all: BTreeSet<&ItemKey> = ends.iter().flatten().collect();
            if !options.is_bundled {
                words.topics[at] = is_anything && all.is_empty();
                continue;
            }
            // What a single node sends is a row of it, and what several send and nobody reads is a word.
            let is_sent = (all.len() == 1 || ends[1].is_empty())
                && drawn[at]
                && !ends[0].is_empty()
                && elements.topics[at].seen.first.is_some();
            let is_seen = selection.topics[at].is_none() && (is_sent || reported.contains(&at));
            let is_carried = drawn[at] && all.len() > 1 && !ends.iter().any(BTreeSet::is_empty);
            let is_inside = fold::of(keys, Element::Topic(at)).is_some();
            if is_inside || !is_seen || is_carried {
                continue;
            }
            words.topics[at] = all.len() != 1;
            let is_counted =
                options.counts_rows && is_sent && all.len() == 1 && !reported.contains(&at);
            if let Some(owner) = all.first().filter(|_| all.len() == 1)
                && !(is_counted && options.are_unlinked_in_words)
            {
                for (node, word) in words.nodes.ids().zip(words.nodes.iter_mut()) {
                    *word &= fold::of(keys, Element::Node(node)) != Some(*owner);
                }
            }
            if is_counted {
                for node in &wiring.publishers[at] {
                    words.counted[*node].push(at);
                }
                continue;
            }
            if let Some(key) = keys.of_mut(Element::Topic(at)) {
                let name = elements.topics[at].name.shared();
                let kind = ItemKind::Topic;
                *key = Some(ItemKey { kind, name });
            }
        }
        words
    }

    /// Whether an element is one of them.
    pub(crate) fn has(&self, what: Element) -> bool {
        match what {
            Element::Node(id) => self.nodes[id],
            Element::Topic(id) => self.topics[id],
            Element::Publish(_) | Element::Subscribe(_) => false,
        }
    }
}

/// Whether each node is a word: without a connection and an event; in bundles without a line to another node, or, if leaves
/// are words, with only one whose two ends never change. No node if fewer than half of the nodes have a line.
fn nodes(
    elements: &Elements,
    options: &ViewOptions,
    (selection, drawn): (&Selection, &ById<TopicId, bool>),
    wiring: &Wiring,
    changing: &ById<NodeId, NodeChanges>,
) -> ById<NodeId, bool> {
    let is_seen = |topic: &TopicId| selection.topics[*topic].is_none();
    let partners = if options.is_bundled {
        partners(wiring, |topic| drawn[topic] && is_seen(&topic))
    } else {
        let edges = elements.edges().filter(|(_, edge)| is_seen(&edge.topic));
        let mut connected = ById::like(changing, None);
        for (_, edge) in edges {
            connected[edge.node] = Some(edge.node);
        }
        connected
    };
    let seen = selection.nodes.iter().filter(|reason| reason.is_none());
    if 2 * partners.iter().flatten().count() < seen.count() {
        return ById::like(&partners, false);
    }
    let is_hub = |node: NodeId| partners[node] == Some(node);
    let is_word = |(node, partner): (NodeId, &Option<NodeId>)| match *partner {
        None => options.are_unlinked_in_words || !changing[node].itself,
        Some(other) if other != node && options.are_leaves_in_words => {
            is_hub(other) && !changing[node].any && !changing[other].itself
        }
        Some(_) => false,
    };
    partners.with_ids().map(is_word).collect()
}

/// The only node that each node has a line to, over the topics that are drawn; itself where there are several.
fn partners(wiring: &Wiring, is_drawn: impl Fn(TopicId) -> bool) -> ById<NodeId, Option<NodeId>> {
    let mut partners: ById<NodeId, Option<NodeId>> = ById::like(&wiring.published, None);
    for topic in wiring.publishers.ids().filter(|topic| is_drawn(*topic)) {
        let ends = [&wiring.publishers[topic], &wiring.subscribers[topic]];
        for (these, others) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            for node in these {
                // Two are enough to know that there are several.
                for other in others.iter().filter(|other| *other != node).take(2) {
                    let partner = &mut partners[*node];
                    let is_only = partner.is_none_or(|old| old == *other);
                    *partner = Some(if is_only { *other } else { *node });
                }
            }
        }
    }
    partners
}

/// Whether there is an event about a node or its connections, and whether there is one about these or a topic of its own.
#[derive(Clone, Copy, Default)]
struct NodeChanges {
    itself: bool,
    any: bool,
}

/// The changes of each node. A start in the first window is not a change, as the node exists in most of the picture.
fn changing_nodes(
    mission: &Mission,
    drawn: &ById<TopicId, bool>,
    wiring: &Wiring,
) -> ById<NodeId, NodeChanges> {
    let mut changes = ById::like(&mission.elements.nodes, NodeChanges::default());
    for event in changed(mission) {
        match mission.elements.ends(event.what) {
            (Some(node), _) => {
                let (itself, any) = (true, true);
                changes[node] = NodeChanges { itself, any };
            }
            (None, Some(topic)) if drawn[topic] => {
                for node in wiring.publishers[topic]
                    .iter()
                    .chain(&wiring.subscribers[topic])
                {
                    changes[*node].any = true;
                }
            }
            (None, _) => {}
        }
    }
    changes
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
pub(crate) fn also_here(
    items: impl IntoIterator<Item = Item>,
    shown: impl IntoIterator<Item = ShownRuns>,
    namespaces: &[Namespace],
) -> Vec<AlsoHere> {
    let places: BTreeMap<&str, usize> = namespaces.iter().map(|s| &*s.name).zip(0..).collect();
    let mut also: BTreeMap<Option<usize>, AlsoHere> = BTreeMap::new();
    let shown = shown.into_iter().map(Some).chain(std::iter::repeat(None));
    for (item, shown) in items.into_iter().zip(shown) {
        let mut ends = item.name.rmatch_indices('/');
        let cluster = ends.find_map(|(end, _)| places.get(&item.name[..end]).copied());
        let also = also.entry(cluster).or_default();
        also.cluster = cluster;
        also.items.push(item);
        also.shown.extend(shown);
    }
    also.into_values().collect()
}

/// The drawn part of a view. Its windows are left out.
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
    // Infrastructure with a connection that changes is drawn.
    let topics = with_changing(mission, plain(&mission.elements, options));
    let is_hidden = |what: &Element| match what {
        Element::Topic(id) => !topics[*id],
        _ => false,
    };
    let is_hidden = |item: &Item| item.members.iter().all(is_hidden);
    let hidden: ById<ItemId, bool> = view.items.iter().map(is_hidden).collect();
    let arrows = view.arrows.iter();
    let ends = arrows.map(|arrow| [arrow.from, arrow.to]);
    let drawn = ends.clone().map(|ends| !ends.iter().any(|at| hidden[*at]));
    let arrows: ById<ArrowId, bool> = drawn.collect();
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
    let (mut words, mut shown) = (view.items.clone(), view.items_shown.clone());
    words.retain(|at| !items[at]);
    shown.retain(|at| !items[at]);
    let mut part = View {
        items: view.items.clone(),
        arrows: view.arrows.clone(),
        items_shown: view.items_shown.clone(),
        arrows_shown: view.arrows_shown.clone(),
        compares: view.compares,
        ..View::default()
    };
    part.keep_arrows(&arrows);
    part.keep_items(&items);
    part.namespaces = clusters(&mut part.items, options.group.namespaces, &BTreeSet::new());
    part.also = also_here(words, shown, &part.namespaces);
    Some(DrawnPart {
        view: part,
        items,
        arrows,
    })
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
    fn what_a_single_node_sends_is_a_row_of_it_where_there_is_room() {
        let rows = |counts_rows| {
            let options = ViewOptions {
                mode: crate::view::Mode::Nodes,
                is_picture: true,
                is_bundled: true,
                counts_rows,
                ..ViewOptions::default()
            };
            let windows = ["/a>/t@5 /b</t /a>/scan@9 /c>/log@1 /c>/never"; 2];
            let mut mission = mission(&windows);
            let topics = mission.elements.topics.iter_mut();
            for topic in topics.filter(|topic| topic.name.as_str() != "/never") {
                topic.seen.first = Some(mission.span.start);
            }
            let view = view(&mission, &options).0;
            let rows = view.rows.iter();
            let rows = rows.map(|row| format!("{} {}", view.items[row.owner].name, row.item.name));
            let counted = view.items.iter().flat_map(|item| {
                let names = item.counted.iter();
                names.map(|name| format!("{} +1 {name}", item.name))
            });
            rows.chain(counted).collect::<Vec<_>>()
        };
        assert_eq!(rows(false), ["/a /scan", "/c /log"]);
        assert_eq!(rows(true), ["/a +1 /scan", "/c +1 /log"]);
    }

    #[test]
    fn a_view_of_infrastructure_is_drawn_as_a_whole() {
        assert_eq!(words(&["/a>/tf@5 /b</tf"]), None);
        assert_eq!(words(&["/a>/x@1 /b</x /c>/tf@1 /d>/tf@1 /e>/tf@1"]), None);
    }
}
