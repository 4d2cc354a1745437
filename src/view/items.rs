//! The items of a view: every box and arrow of the mission, and the one that shows each element of the graph.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::bundles;
use super::collapse::Collapse;
use super::group::{Groups, groups};
use super::homes::{ItemKey, inside, set_groups, swallow};
use super::names::is_debug_label;
use super::replicas::Fleets;
use super::roles;
use super::select::{Selection, finish, select};
use super::{Arrow, ArrowKind, Item, ItemKind, LineWidth, Mode, ViewOptions};
use crate::graph::{Edge, EdgeId, Element, Elements, NodeId, TopicId};
use crate::mission::Mission;

/// The part of the picture that shows an edge of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EdgePlace {
    /// It is not drawn.
    Hidden,
    /// It is this item, or part of it.
    Item(u32),
    /// It is part of this arrow.
    Arrow(u32),
    /// It is inside this item.
    Inside(u32),
}

/// Every box and arrow, and the mapping from the graph's elements to them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Viewed {
    pub(crate) selection: Selection,
    /// Equal namespaces that are drawn as one.
    pub(crate) fleets: Fleets,
    pub(crate) items: Vec<Item>,
    pub(crate) arrows: Vec<Arrow>,
    /// Per node of the mission, its item.
    pub(crate) node: Vec<Option<u32>>,
    /// Per topic of the mission, its item.
    pub(crate) topic: Vec<Option<u32>>,
    /// The part that shows each publication. In mode *nodes* a publication may be part of several arrows,
    /// which only `pairs` lists.
    pub(crate) publish: Vec<EdgePlace>,
    /// The part that shows each subscription.
    pub(crate) subscribe: Vec<EdgePlace>,
    /// Per arrow from node to node, the publications and subscriptions that it joins.
    pub(crate) pairs: Vec<Vec<(EdgeId, EdgeId)>>,
    /// Per topic of the mission, its name in a bundle: that of its group, if it is in one.
    pub(crate) bundled: Vec<Arc<str>>,
    /// Node and topic of each publication.
    pub(crate) published: Vec<(NodeId, TopicId)>,
    /// Node and topic of each subscription.
    pub(crate) subscribed: Vec<(NodeId, TopicId)>,
    /// Per edge, and per topic with publications, the arrows that carry it; those of a topic from its publishers.
    pub(crate) carriers: BTreeMap<Element, Vec<u32>>,
    /// Per topic, whether bundles draw it.
    pub(super) drawn: Vec<bool>,
    /// The number of items at the end of the list that are listed as words, because no line leads to them.
    pub(crate) in_words: usize,
    /// Whether each node is in one of these, and whether each topic is.
    pub(super) is_in_words: [Vec<bool>; 2],
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

pub(super) type ArrowEnds = (u32, u32, ArrowKind);

impl Viewed {
    pub(crate) fn new(mission: &Mission, options: &ViewOptions) -> Self {
        let elements = &mission.elements;
        let mut selection = select(elements, options);
        let grouping = match options.mode {
            Mode::Nodes => super::Grouping::NONE,
            _ => options.group,
        };
        let seen: Vec<bool> = selection.topics.iter().map(Option::is_none).collect();
        let groups = groups(elements, &seen, grouping);
        let mut grouped = vec![false; elements.topics.len()];
        for id in groups.values().flatten() {
            if let Some(grouped) = grouped.get_mut(*id as usize) {
                *grouped = true;
            }
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
        viewed.drawn = vec![true; elements.topics.len()];
        viewed.is_in_words[0] = vec![false; elements.nodes.len()];
        if options.mode == Mode::Bundles {
            viewed.drawn = bundles::drawn(mission, options);
        }
        // Outputs that are files of data or can be expanded have a box for each.
        if options.mode == Mode::Bundles && options.is_picture {
            viewed.is_in_words[0] = bundles::nodes_in_words(
                mission,
                (&viewed.selection, &viewed.drawn),
                options.are_leaves_in_words,
            );
        }
        viewed.set_items(mission, options, &groups);
        if options.mode.is_direct() {
            viewed.bundled = bundles::names(elements, &groups);
            viewed.set_direct(elements, options);
            if options.mode == Mode::Bundles {
                viewed.set_leaves(elements);
            }
        } else {
            viewed.set_arrows(elements);
        }
        if options.line_width == LineWidth::Bytes {
            let sizes = sizes(mission);
            for arrow in &mut viewed.arrows {
                let topics = arrow
                    .members
                    .iter()
                    .filter_map(|what| elements.ends(*what).1);
                let topics: BTreeSet<TopicId> = topics.collect();
                let sizes = topics.iter().map(|topic| sizes[*topic as usize]);
                let (count, bytes) = sizes.fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
                arrow.kilobytes = Some(bytes as f64 / 1000.0 / count.max(1) as f64);
            }
        }
        viewed.set_carriers(elements);
        viewed
    }

    fn set_items(&mut self, mission: &Mission, options: &ViewOptions, groups: &Groups) {
        let elements = &mission.elements;
        let mut collapse = Collapse::new(options);
        let seen = |reasons: &[Option<_>], at: usize| reasons.get(at) == Some(&None);
        let mut names: Vec<Arc<str>> = if options.exact_names {
            elements.nodes.iter().map(|n| n.name.shared()).collect()
        } else {
            roles::boxes(elements)
        };
        for name in &mut names {
            if let Some(stand_in) = self.fleets.stand_in(name) {
                *name = stand_in;
            }
        }
        if !collapse.is_empty() {
            let shown = |(at, name)| seen(&self.selection.nodes, at).then_some(name);
            let folded = names
                .iter()
                .map(|name| &**name)
                .enumerate()
                .filter_map(shown);
            let topics = elements.topics.iter().map(|topic| topic.name.as_str());
            let topics = topics.filter(|_| !options.mode.is_direct());
            collapse.open_single(&folded.collect(), &topics.collect());
        }
        let nodes: Vec<Option<ItemKey>> = (elements.nodes.iter().zip(&names).enumerate())
            .map(|(at, (_, name))| {
                let plain = || (ItemKind::Node, Arc::clone(name));
                seen(&self.selection.nodes, at).then(|| {
                    let space = collapse.of(name);
                    space.map_or_else(plain, |s| (ItemKind::Namespace, s.into()))
                })
            })
            .collect();
        let mut topics: Vec<Option<ItemKey>> = vec![None; elements.topics.len()];
        if options.mode == Mode::Bundles {
            topics = inside(elements, &collapse, &nodes, &self.selection);
        } else if options.mode != Mode::Nodes {
            for (at, topic) in elements.topics.iter().enumerate() {
                if seen(&self.selection.topics, at) {
                    topics[at] = Some((ItemKind::Topic, topic.name.shared()));
                }
            }
            set_groups(&mut topics, groups);
            for key in topics.iter_mut().flatten() {
                if let Some(stand_in) = self.fleets.stand_in(&key.1) {
                    key.1 = stand_in;
                }
            }
            if !collapse.is_empty() {
                swallow(elements, (&collapse, &names), &nodes, &mut topics);
            }
        }
        self.is_in_words[1] = vec![false; topics.len()];
        if options.is_picture {
            self.set_apart(mission, options, (&nodes, &mut topics));
        }
        let mut members: BTreeMap<&ItemKey, Vec<Element>> = BTreeMap::new();
        let own = nodes.iter().zip((0..).map(Element::Node));
        for (key, what) in own.chain(topics.iter().zip((0..).map(Element::Topic))) {
            if let Some(key) = key {
                members.entry(key).or_default().push(what);
            }
        }
        let [node_words, topic_words] = &self.is_in_words;
        let is_in_words = |key: &ItemKey, members: &[Element]| {
            let is = |what: &Element| match what {
                Element::Node(id) => node_words[*id as usize],
                Element::Topic(id) => topic_words[*id as usize],
                Element::Publish(_) | Element::Subscribe(_) => false,
            };
            key.0 != ItemKind::Namespace && members.iter().all(is)
        };
        let (mut members, in_words): (Vec<_>, Vec<_>) = members
            .into_iter()
            .partition(|(key, members)| !is_in_words(key, members));
        self.in_words = in_words.len();
        members.extend(in_words);
        let places: BTreeMap<&ItemKey, u32> =
            members.iter().map(|(key, _)| *key).zip(0..).collect();
        let place = |key: &Option<ItemKey>| key.as_ref().and_then(|key| places.get(key).copied());
        self.node = nodes.iter().map(place).collect();
        self.topic = topics.iter().map(place).collect();
        self.items = members
            .into_iter()
            .map(|((kind, name), members)| Item {
                kind: *kind,
                name: Arc::clone(name),
                label: Arc::clone(name),
                is_replica: *kind != ItemKind::Namespace && self.fleets.of(name).is_some(),
                is_service: members.iter().all(|what| elements.is_service(*what)),
                cluster: None,
                members,
            })
            .collect();
        if !options.exact_names {
            roles::label(&mut self.items, elements);
            roles::label_unknown(&mut self.items, elements);
        }
    }

    fn set_arrows(&mut self, elements: &Elements) {
        let mut arrows: BTreeMap<ArrowEnds, Vec<Element>> = BTreeMap::new();
        let publish: Vec<Option<ArrowEnds>> = elements
            .publishes
            .iter()
            .map(|edge| {
                let (node, topic) = self.ends(edge)?;
                Some((node, topic, ArrowKind::Publish))
            })
            .collect();
        let subscribe: Vec<Option<ArrowEnds>> = elements
            .subscribes
            .iter()
            .map(|edge| {
                let (node, topic) = self.ends(edge)?;
                Some((topic, node, ArrowKind::Subscribe))
            })
            .collect();
        let all = publish.iter().zip((0..).map(Element::Publish));
        let all = all.chain(subscribe.iter().zip((0..).map(Element::Subscribe)));
        for (ends, element) in all {
            if let Some(ends) = ends.as_ref().filter(|(from, to, _)| from != to) {
                arrows.entry(ends.clone()).or_default().push(element);
            }
        }
        let places: BTreeMap<&ArrowEnds, u32> = arrows.keys().zip(0..).collect();
        let place = |ends: &Option<ArrowEnds>| match ends {
            None => EdgePlace::Hidden,
            Some((from, to, _)) if from == to => EdgePlace::Inside(*from),
            Some(ends) => places
                .get(ends)
                .map_or(EdgePlace::Hidden, |at| EdgePlace::Arrow(*at)),
        };
        self.publish = publish.iter().map(place).collect();
        self.subscribe = subscribe.iter().map(place).collect();
        let arrows = arrows.into_iter();
        self.arrows = arrows.map(|(ends, m)| arrow(elements, ends, m)).collect();
    }

    /// The items of an edge's node and topic.
    pub(super) fn ends(&self, edge: &Edge) -> Option<(u32, u32)> {
        Some((
            self.item_of_node(edge.node)?,
            *self.topic.get(edge.topic as usize)?.as_ref()?,
        ))
    }

    fn item_of_node(&self, node: NodeId) -> Option<u32> {
        self.node.get(node as usize).copied().flatten()
    }

    /// Arrows from publishers to subscribers: one per topic between two of them, or one for all topics in a bundle.
    fn set_direct(&mut self, elements: &Elements, options: &ViewOptions) {
        let is_bundled = options.mode == Mode::Bundles;
        let mut subscribers: Vec<Vec<(EdgeId, u32)>> = vec![Vec::new(); elements.topics.len()];
        for (edge, id) in elements.subscribes.iter().zip(0..) {
            let item = self.item_of_node(edge.node);
            if let (Some(list), Some(item)) = (subscribers.get_mut(edge.topic as usize), item) {
                list.push((id, item));
            }
        }
        let mut arrows: BTreeMap<ArrowEnds, Vec<(EdgeId, EdgeId)>> = BTreeMap::new();
        let mut pairs = 0;
        self.publish = vec![EdgePlace::Hidden; elements.publishes.len()];
        self.subscribe = vec![EdgePlace::Hidden; elements.subscribes.len()];
        for (edge, publish) in elements.publishes.iter().zip(0..) {
            let at = edge.topic as usize;
            let (Some(from), Some(topic)) = (self.item_of_node(edge.node), elements.topics.get(at))
            else {
                continue;
            };
            let name = topic.name.as_str();
            if self.selection.topics.get(at) != Some(&None)
                || !self.drawn[at]
                || options.hide.debug && is_debug_label(name)
            {
                continue;
            }
            for (subscribe, to) in subscribers.get(at).into_iter().flatten() {
                if from == *to && self.is_namespace(from) {
                    self.publish[publish as usize] = EdgePlace::Inside(from);
                    self.subscribe[*subscribe as usize] = EdgePlace::Inside(from);
                    continue;
                }
                if !self.is_drawn(from) || !self.is_drawn(*to) {
                    continue;
                }
                pairs += 1;
                if pairs > MOST_PAIRS || is_bundled && from == *to {
                    continue;
                }
                let kind = match options.mode {
                    Mode::Bundles => ArrowKind::Bundle,
                    _ => ArrowKind::Direct(topic.name.shared()),
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
                    .map(|(_, s)| &self.bundled[self.subscribed[*s as usize].1 as usize]);
                let topics: BTreeSet<&Arc<str>> = topics.collect();
                arrow.topics = topics.into_iter().cloned().collect();
            }
            self.arrows.push(arrow);
            self.pairs.push(pairs);
        }
    }

    /// Gives a bundle the direction of most of its topics.
    fn turn(&self, ends: &mut ArrowEnds, pairs: &[(EdgeId, EdgeId)]) {
        let topics = |from: u32| {
            let of = pairs
                .iter()
                .filter(|(p, _)| self.item_of_sender(*p) == Some(from));
            let topics = of.map(|(p, _)| &self.bundled[self.published[*p as usize].1 as usize]);
            topics.collect::<BTreeSet<_>>().len()
        };
        if topics(ends.1) > topics(ends.0) {
            (ends.0, ends.1) = (ends.1, ends.0);
        }
    }

    /// Whether an item has a box.
    pub(super) fn is_drawn(&self, item: u32) -> bool {
        (item as usize) < self.items.len() - self.in_words
    }

    /// The item of the node that publishes.
    fn item_of_sender(&self, publish: EdgeId) -> Option<u32> {
        self.item_of_node(self.published.get(publish as usize)?.0)
    }

    /// The topic of a bundle that a pair of edges is part of, and whether it runs against the arrow.
    pub(crate) fn row(
        &self,
        arrow: &Arrow,
        (publish, subscribe): (EdgeId, EdgeId),
    ) -> Option<(u32, usize)> {
        let topic = self.subscribed.get(subscribe as usize)?.1;
        let name = self.bundled.get(topic as usize)?;
        let at = arrow.topics.binary_search(name).ok()?;
        let is_back = self.item_of_sender(publish) != Some(arrow.from);
        Some((u32::try_from(at).ok()?, usize::from(is_back)))
    }

    /// The node and the topic of an element: both of an edge, one of the others.
    fn both_of(&self, what: Element) -> (Option<NodeId>, Option<TopicId>) {
        match what {
            Element::Node(id) => (Some(id), None),
            Element::Topic(id) => (None, Some(id)),
            Element::Publish(id) => self.published.get(id as usize).copied().unzip(),
            Element::Subscribe(id) => self.subscribed.get(id as usize).copied().unzip(),
        }
    }

    /// The topic of an element: that of an edge, or itself.
    pub(crate) fn topic_of(&self, what: Element) -> Option<TopicId> {
        self.both_of(what).1
    }

    /// Records the arrows that each topic's publications are part of.
    fn set_carriers(&mut self, elements: &Elements) {
        for (arrow, id) in self.arrows.iter().zip(0..) {
            for member in &arrow.members {
                self.carriers.entry(*member).or_default().push(id);
                let edge = match member {
                    Element::Publish(publish) => elements.publishes.get(*publish as usize),
                    _ => None,
                };
                if let Some(edge) = edge {
                    let topic = self.carriers.entry(Element::Topic(edge.topic)).or_default();
                    topic.push(id);
                }
            }
        }
    }

    /// Whether the picture shows this or a box that it is part of. Elements that a filter leaves out are not reported
    /// either.
    pub(crate) fn sees(&self, what: Element) -> bool {
        let is = |reasons: &[Option<_>], id: u32| reasons.get(id as usize) == Some(&None);
        let (node, topic) = self.both_of(what);
        let is_node = node.is_none_or(|id| is(&self.selection.nodes, id));
        let is_topic = topic.is_none_or(|id| is(&self.selection.topics, id));
        (node.is_some() || topic.is_some()) && is_node && is_topic
    }

    /// Whether a single arrow carries a topic from its publishers.
    pub(crate) fn has_single_sender(&self, topic: Element) -> bool {
        self.carriers.get(&topic).is_some_and(|all| all.len() == 1)
    }

    fn is_namespace(&self, item: u32) -> bool {
        let item = self.items.get(item as usize);
        item.is_some_and(|item| item.kind == ItemKind::Namespace)
    }
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
        kilobytes: None,
    }
}

/// The messages and the payload bytes of each topic in all windows in which its bytes are known.
fn sizes(mission: &Mission) -> Vec<(u64, u64)> {
    let mut sizes = vec![(0_u64, 0_u64); mission.elements.topics.len()];
    for state in mission.graphs.iter().flat_map(|graph| graph.topics) {
        if let Some(bytes) = state.bytes {
            let size = &mut sizes[state.id as usize];
            *size = (
                size.0.saturating_add(state.count),
                size.1.saturating_add(bytes),
            );
        }
    }
    sizes
}
