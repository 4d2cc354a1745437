//! The items of a view: every box and arrow of the mission, and the one that shows each element of the graph.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::choose::{Selection, finish, is_debug_label, select};
use super::fold::equal::Fleets;
use super::fold::keys::{Boxes, ItemKey, NodeKeys, TopicKeys};
use super::fold::namespaces::headlines;
use super::fold::roles;
use super::fold::topics::{Groups, groups};
use super::{Arrow, ArrowId, ArrowKind, Item, ItemId, ItemKind, Mode, ViewOptions, listed};
use crate::graph::{ById, Edge, EdgeId, Element, Elements, Id as _, NodeId, PerElement, TopicId};
use crate::mission::Mission;

/// The part of the picture that shows an edge of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EdgePlace {
    /// It is not drawn.
    Hidden,
    /// It is this item, or part of it.
    Item(ItemId),
    /// It is part of this arrow.
    Arrow(ArrowId),
    /// It is inside this item.
    Inside(ItemId),
}

/// Every box and arrow, and the mapping from the graph's elements to them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Viewed {
    pub(crate) selection: Selection,
    /// Equal namespaces that are drawn as one.
    pub(crate) fleets: Fleets,
    pub(crate) items: ById<ItemId, Item>,
    pub(crate) arrows: ById<ArrowId, Arrow>,
    /// Per node of the mission, its item.
    pub(crate) node: ById<NodeId, Option<ItemId>>,
    /// Per topic of the mission, its item.
    pub(crate) topic: ById<TopicId, Option<ItemId>>,
    /// The part that shows each publication. In mode *nodes* a publication may be part of several arrows,
    /// which only `pairs` lists.
    pub(crate) publish: ById<EdgeId, EdgePlace>,
    /// The part that shows each subscription.
    pub(crate) subscribe: ById<EdgeId, EdgePlace>,
    /// Per arrow from node to node, the publications and subscriptions that it joins.
    pub(crate) pairs: ById<ArrowId, Vec<(EdgeId, EdgeId)>>,
    /// Per topic of the mission, its name in a bundle: that of its group, if it is in one.
    pub(crate) bundled: ById<TopicId, Arc<str>>,
    /// Node and topic of each publication.
    pub(crate) published: ById<EdgeId, (NodeId, TopicId)>,
    /// Node and topic of each subscription.
    pub(crate) subscribed: ById<EdgeId, (NodeId, TopicId)>,
    /// Per edge, and per topic with publications, the arrows that carry it; those of a topic from its publishers.
    carriers: PerElement<Vec<ArrowId>>,
    /// Per topic, whether bundles draw it.
    pub(super) drawn: ById<TopicId, bool>,
    /// The number of items at the end of the list that are listed as words, because no line leads to them.
    pub(crate) in_words: usize,
    /// Whether each node is in one of these, and each topic.
    pub(super) nodes_in_words: ById<NodeId, bool>,
    pub(super) topics_in_words: ById<TopicId, bool>,
    /// The number of arrows from node to node that were left out because they were too many.
    pub(crate) dropped: usize,
}

/// The largest number of pairs of publishers and subscribers drawn from node to node. A topic with thousands
/// of both has millions, far too many to read.
const MOST_PAIRS: usize = 200_000;

/// The fleets to draw as one: none if exact names or separate boxes are requested.
fn fleets(elements: &Elements, options: &ViewOptions) -> Fleets {
    if options.exact_names || options.group == super::Grouping::NONE {
        return Fleets::default();
    }
    Fleets::new(elements, options)
}

pub(super) type ArrowEnds = (ItemId, ItemId, ArrowKind);

impl Viewed {
    pub(crate) fn new(mission: &Mission, options: &ViewOptions) -> Self {
        let elements = &mission.elements;
        let mut selection = select(elements, options);
        let grouping = match options.mode {
            Mode::Nodes if !options.is_bundled => super::Grouping::NONE,
            _ => options.group,
        };
        let seen: ById<TopicId, bool> = selection.topics.iter().map(Option::is_none).collect();
        let groups = groups(elements, &seen, grouping);
        let mut grouped = ById::like(&elements.topics, false);
        for id in groups.values().flatten() {
            grouped[*id] = true;
        }
        finish(&mut selection, elements, options, &grouped);
        let pair = |edge: &Edge| (edge.node, edge.topic);
        let mut viewed = Self {
            selection,
            fleets: fleets(elements, options),
            published: elements.publishes.iter().map(pair).collect(),
            subscribed: elements.subscribes.iter().map(pair).collect(),
            ..Self::default()
        };
        viewed.drawn = ById::like(&elements.topics, true);
        viewed.nodes_in_words = ById::like(&elements.nodes, false);
        if options.is_bundled {
            viewed.drawn = listed::drawn(mission, options);
        }
        // Outputs that are files of data or can be expanded have a box for each.
        if options.is_bundled && options.is_picture {
            viewed.nodes_in_words = listed::nodes_in_words(
                mission,
                (&viewed.selection, &viewed.drawn),
                options.are_leaves_in_words,
            );
        }
        viewed.set_items(mission, options, &groups);
        if options.mode.is_direct() {
            viewed.bundled = listed::names(elements, &groups);
            viewed.set_direct(elements, options);
            if options.is_bundled {
                viewed.set_leaves(elements);
            }
        } else {
            viewed.set_arrows(elements);
        }
        viewed.set_carriers(elements);
        viewed
    }

    fn set_items(&mut self, mission: &Mission, options: &ViewOptions, groups: &Groups) {
        let elements = &mission.elements;
        let (nodes, mut topics) = Boxes {
            elements,
            options,
            fleets: &self.fleets,
            selection: &self.selection,
            groups,
        }
        .keys();
        self.topics_in_words = ById::like(&topics, false);
        if options.is_picture {
            self.set_apart(mission, options, (&nodes, &mut topics));
        }
        let own = nodes.with_ids().map(|(id, key)| (key, Element::Node(id)));
        let others = topics.with_ids().map(|(id, key)| (key, Element::Topic(id)));
        let shown = own.chain(others);
        let shown = shown.filter_map(|(key, what)| Some((key.as_ref()?, what)));
        let is_in_words = |members: &[(&ItemKey, Element)]| {
            let is = |(key, what): &(&ItemKey, Element)| match what {
                _ if key.0 == ItemKind::Namespace => false,
                Element::Node(id) => self.nodes_in_words[*id],
                Element::Topic(id) => self.topics_in_words[*id],
                Element::Publish(_) | Element::Subscribe(_) => false,
            };
            members.iter().all(is)
        };
        let shown = sorted(shown.collect());
        let (boxes, in_words): (Vec<_>, Vec<_>) = together(&shown).partition(|m| !is_in_words(m));
        self.in_words = in_words.len();
        self.node = ById::like(&elements.nodes, None);
        self.topic = ById::like(&elements.topics, None);
        for members in boxes.into_iter().chain(in_words) {
            let (kind, name) = members[0].0;
            let id = self.items.push(Item {
                kind: *kind,
                name: Arc::clone(name),
                label: Arc::clone(name),
                is_replica: *kind != ItemKind::Namespace && self.fleets.of(name).is_some(),
                is_service: members.iter().all(|(_, what)| elements.is_service(*what)),
                cluster: None,
                members: members.iter().map(|(_, what)| *what).collect(),
            });
            for (_, what) in members {
                match what {
                    Element::Node(node) => self.node[*node] = Some(id),
                    Element::Topic(topic) => self.topic[*topic] = Some(id),
                    Element::Publish(_) | Element::Subscribe(_) => {}
                }
            }
        }
        if !options.exact_names {
            roles::label(&mut self.items, elements);
            roles::label_unknown(&mut self.items, elements);
        }
    }

    fn set_arrows(&mut self, elements: &Elements) {
        self.publish = ById::like(&elements.publishes, EdgePlace::Hidden);
        self.subscribe = ById::like(&elements.subscribes, EdgePlace::Hidden);
        let mut lines = Vec::new();
        for (what, edge) in elements.edges() {
            match self.ends(edge) {
                None => {}
                Some((node, topic)) if node == topic => {
                    self.set_place(what, EdgePlace::Inside(node));
                }
                Some((node, topic)) if matches!(what, Element::Publish(_)) => {
                    lines.push(((node, topic, ArrowKind::Publish), what));
                }
                Some((node, topic)) => lines.push(((topic, node, ArrowKind::Subscribe), what)),
            }
        }
        for members in together(&sorted(lines)) {
            let all = members.iter().map(|(_, what)| *what).collect();
            let id = self.arrows.push(arrow(elements, members[0].0.clone(), all));
            for (_, what) in members {
                self.set_place(*what, EdgePlace::Arrow(id));
            }
        }
    }

    fn set_place(&mut self, edge: Element, place: EdgePlace) {
        match edge {
            Element::Publish(id) => self.publish[id] = place,
            Element::Subscribe(id) => self.subscribe[id] = place,
            Element::Node(_) | Element::Topic(_) => {}
        }
    }

    /// The items of an edge's node and topic.
    pub(super) fn ends(&self, edge: &Edge) -> Option<(ItemId, ItemId)> {
        Some((self.item_of_node(edge.node)?, self.topic[edge.topic]?))
    }

    fn item_of_node(&self, node: NodeId) -> Option<ItemId> {
        self.node.get(node).copied().flatten()
    }

    /// Arrows from publishers to subscribers: one per topic between two of them, or one for all topics in a bundle.
    fn set_direct(&mut self, elements: &Elements, options: &ViewOptions) {
        let is_bundled = options.is_bundled;
        let mut subscribers = ById::like(&elements.topics, Vec::new());
        for (id, edge) in elements.subscribes.with_ids() {
            if let Some(item) = self.item_of_node(edge.node) {
                subscribers[edge.topic].push((id, item));
            }
        }
        let mut arrows: BTreeMap<ArrowEnds, Vec<(EdgeId, EdgeId)>> = BTreeMap::new();
        let mut pairs = 0;
        self.publish = ById::like(&elements.publishes, EdgePlace::Hidden);
        self.subscribe = ById::like(&elements.subscribes, EdgePlace::Hidden);
        for (publish, edge) in elements.publishes.with_ids() {
            let Some(from) = self.item_of_node(edge.node) else {
                continue;
            };
            let topic = &elements.topics[edge.topic];
            let name = topic.name.as_str();
            if self.selection.topics[edge.topic].is_some()
                || !self.drawn[edge.topic]
                || options.hide.debug && is_debug_label(name)
            {
                continue;
            }
            for (subscribe, to) in &subscribers[edge.topic] {
                if from == *to && self.is_namespace(from) {
                    self.publish[publish] = EdgePlace::Inside(from);
                    self.subscribe[*subscribe] = EdgePlace::Inside(from);
                    continue;
                }
                if !self.is_drawn(from) || !self.is_drawn(*to) {
                    continue;
                }
                pairs += 1;
                if pairs > MOST_PAIRS || is_bundled && from == *to {
                    continue;
                }
                let kind = if is_bundled {
                    ArrowKind::Bundle
                } else {
                    ArrowKind::Direct(topic.name.shared())
                };
                // One line for both directions.
                let ends = if is_bundled {
                    (from.min(*to), from.max(*to))
                } else {
                    (from, *to)
                };
                let ends = (ends.0, ends.1, kind);
                arrows.entry(ends).or_default().push((publish, *subscribe));
            }
        }
        self.dropped = pairs.saturating_sub(MOST_PAIRS);
        for (mut ends, pairs) in arrows {
            if is_bundled {
                self.turn(&mut ends, &pairs);
            }
            let publishes = pairs.iter().map(|(p, _)| Element::Publish(*p));
            let others = pairs.iter().map(|(_, s)| Element::Subscribe(*s));
            let members: BTreeSet<Element> = publishes.chain(others).collect();
            let mut arrow = arrow(elements, ends, members.into_iter().collect());
            if is_bundled {
                let topics = pairs
                    .iter()
                    .map(|(_, s)| &self.bundled[self.subscribed[*s].1]);
                let topics: BTreeSet<&Arc<str>> = topics.collect();
                arrow.topics = topics.into_iter().cloned().collect();
            }
            self.arrows.push(arrow);
            self.pairs.push(pairs);
        }
    }

    /// Gives a bundle the direction of most of its topics.
    fn turn(&self, ends: &mut ArrowEnds, pairs: &[(EdgeId, EdgeId)]) {
        let topics = |from: ItemId| {
            let of = pairs
                .iter()
                .filter(|(p, _)| self.item_of_sender(*p) == Some(from));
            let topics = of.map(|(p, _)| &self.bundled[self.published[*p].1]);
            topics.collect::<BTreeSet<_>>().len()
        };
        if topics(ends.1) > topics(ends.0) {
            (ends.0, ends.1) = (ends.1, ends.0);
        }
    }

    /// Whether an item has a box.
    pub(super) fn is_drawn(&self, item: ItemId) -> bool {
        item.at() < self.items.len() - self.in_words
    }

    /// The item of the node that publishes.
    fn item_of_sender(&self, publish: EdgeId) -> Option<ItemId> {
        self.item_of_node(self.published.get(publish)?.0)
    }

    /// The topic of a bundle that a pair of edges is part of, and whether it runs against the arrow.
    pub(crate) fn row(
        &self,
        arrow: &Arrow,
        (publish, subscribe): (EdgeId, EdgeId),
    ) -> Option<(u32, usize)> {
        let topic = self.subscribed.get(subscribe)?.1;
        let name = self.bundled.get(topic)?;
        let at = arrow.topics.binary_search(name).ok()?;
        let is_back = self.item_of_sender(publish) != Some(arrow.from);
        Some((u32::try_from(at).ok()?, usize::from(is_back)))
    }

    /// The node and the topic of an element: both of an edge, one of the others.
    pub(crate) fn ends_of(&self, what: Element) -> (Option<NodeId>, Option<TopicId>) {
        match what {
            Element::Node(id) => (Some(id), None),
            Element::Topic(id) => (None, Some(id)),
            Element::Publish(id) => self.published.get(id).copied().unzip(),
            Element::Subscribe(id) => self.subscribed.get(id).copied().unzip(),
        }
    }

    /// The topic of an element: that of an edge, or itself.
    pub(crate) fn topic_of(&self, what: Element) -> Option<TopicId> {
        self.ends_of(what).1
    }

    /// Records the arrows that each topic's publications are part of.
    fn set_carriers(&mut self, elements: &Elements) {
        self.carriers = PerElement::new(elements, |_| Vec::new());
        for (id, arrow) in self.arrows.with_ids() {
            for member in &arrow.members {
                let topic = match member {
                    Element::Publish(publish) => Some(self.published[*publish].1),
                    _ => None,
                };
                for what in [Some(*member), topic.map(Element::Topic)] {
                    if let Some(all) = what.and_then(|what| self.carriers.of_mut(what)) {
                        all.push(id);
                    }
                }
            }
        }
    }

    /// The arrows that carry an edge; those that carry a topic from its publishers.
    pub(crate) fn carriers(&self, what: Element) -> &[ArrowId] {
        self.carriers.of(what).map_or(&[], Vec::as_slice)
    }

    /// Whether the picture shows this or a box that it is part of. Elements that a filter leaves out are not reported
    /// either.
    pub(crate) fn sees(&self, what: Element) -> bool {
        let (node, topic) = self.ends_of(what);
        let is_node = node.is_none_or(|id| self.selection.nodes.get(id) == Some(&None));
        let is_topic = topic.is_none_or(|id| self.selection.topics.get(id) == Some(&None));
        (node.is_some() || topic.is_some()) && is_node && is_topic
    }

    /// Whether a single arrow carries a topic from its publishers.
    pub(crate) fn has_single_sender(&self, topic: Element) -> bool {
        self.carriers(topic).len() == 1
    }

    fn is_namespace(&self, item: ItemId) -> bool {
        let item = self.items.get(item);
        item.is_some_and(|item| item.kind == ItemKind::Namespace)
    }
}

/// Elements by the item or arrow that shows them, those of one in their order.
fn sorted<K: Ord>(mut shown: Vec<(K, Element)>) -> Vec<(K, Element)> {
    shown.sort_by(|a, b| a.0.cmp(&b.0));
    shown
}

/// The elements of each item or arrow.
fn together<K: Eq>(shown: &[(K, Element)]) -> impl Iterator<Item = &[(K, Element)]> {
    shown.chunk_by(|a, b| a.0 == b.0)
}

pub(super) fn arrow(
    elements: &Elements,
    (from, to, kind): ArrowEnds,
    members: Vec<Element>,
) -> Arrow {
    Arrow {
        from,
        to,
        kind,
        is_service: members.iter().all(|what| elements.is_service(*what)),
        members,
        topics: Vec::new(),
    }
}

impl Viewed {
    /// Finds the topics to list as words: those without a known endpoint, and in bundles those with an event
    /// although no line carries them; of the latter, those with one known endpoint get a box beside it
    /// instead.
    pub(super) fn set_apart(
        &mut self,
        mission: &Mission,
        options: &ViewOptions,
        (nodes, topics): (&NodeKeys, &mut TopicKeys),
    ) {
        let elements = &mission.elements;
        let mut ends: ById<TopicId, [BTreeSet<&ItemKey>; 2]> =
            ById::like(topics, Default::default());
        for (edges, way) in [(&elements.publishes, 0), (&elements.subscribes, 1)] {
            for edge in edges {
                ends[edge.topic][way].extend(&nodes[edge.node]);
            }
        }
        let is_bundled = options.is_bundled;
        let reported: BTreeSet<TopicId> = headlines(mission)
            .filter_map(|what| elements.ends(what).1)
            .collect();
        let is_anything = nodes.iter().any(Option::is_some);
        if !is_bundled {
            self.set_nodes_apart(mission);
        }
        for (key, (at, ends)) in topics.iter_mut().zip(ends.with_ids()) {
            let [senders, receivers] = ends;
            let all: BTreeSet<&ItemKey> = senders.union(receivers).copied().collect();
            if !is_bundled {
                self.topics_in_words[at] = is_anything && all.is_empty();
                continue;
            }
            let is_seen = self.selection.topics[at].is_none() && reported.contains(&at);
            let is_carried =
                self.drawn[at] && all.len() > 1 && !senders.is_empty() && !receivers.is_empty();
            if key.is_some() || !is_seen || is_carried {
                continue;
            }
            *key = Some((ItemKind::Topic, elements.topics[at].name.shared()));
            self.topics_in_words[at] = all.len() != 1;
            if let Some(owner) = all.first().filter(|_| all.len() == 1) {
                for (node, words) in nodes.iter().zip(self.nodes_in_words.iter_mut()) {
                    *words &= node.as_ref() != Some(owner);
                }
            }
        }
    }

    /// Finds the nodes to list as words: those without a connection and without an event, if most nodes have a connection.
    fn set_nodes_apart(&mut self, mission: &Mission) {
        let mut is_busy = ById::like(&mission.elements.nodes, false);
        for (_, edge) in mission.elements.edges() {
            is_busy[edge.node] |= self.selection.topics[edge.topic].is_none();
        }
        let seen = self
            .selection
            .nodes
            .iter()
            .filter(|reason| reason.is_none());
        let is_rule = 2 * is_busy.iter().filter(|busy| **busy).count() >= seen.count();
        for event in listed::changed(mission) {
            if let (Some(node), _) = mission.elements.ends(event.what) {
                is_busy[node] = true;
            }
        }
        self.nodes_in_words = is_busy.iter().map(|busy| is_rule && !busy).collect();
    }

    /// The arrows between the topics with a box of their own and the only box that they are connected to.
    pub(super) fn set_leaves(&mut self, elements: &Elements) {
        for (edges, publishes) in [(&elements.publishes, true), (&elements.subscribes, false)] {
            for (id, edge) in edges.with_ids() {
                let Some((node, topic)) = self.ends(edge).filter(|(node, topic)| {
                    let kind = self.items[*topic].kind;
                    kind == ItemKind::Topic && self.is_drawn(*node) && self.is_drawn(*topic)
                }) else {
                    continue;
                };
                let (ends, element, places) = if publishes {
                    (
                        (node, topic, ArrowKind::Publish),
                        Element::Publish(id),
                        &mut self.publish,
                    )
                } else {
                    (
                        (topic, node, ArrowKind::Subscribe),
                        Element::Subscribe(id),
                        &mut self.subscribe,
                    )
                };
                let arrow = self.arrows.push(arrow(elements, ends, vec![element]));
                places[id] = EdgePlace::Arrow(arrow);
            }
        }
    }
}
