//! The items of a view: every box and arrow of the mission, and the one that shows each element of the graph.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::choose::{Selection, finish, is_debug_label, select};
use super::fold::equal::Fleets;
use super::fold::{self, Groups, ItemKey};
use super::listed::{self, Words};
use super::{Arrow, ArrowId, ArrowKind, Grouping, Item, ItemId, ItemKind, Mode, ViewOptions};
use crate::base::name::last_part;
use crate::graph::{ById, Edge, EdgeId, Element, Elements, Id as _, PerElement, TopicId};
use crate::mission::Mission;

/// The part of the picture that shows an element of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
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
pub(crate) struct Viewed<'a> {
    pub(crate) elements: &'a Elements,
    pub(crate) selection: Selection,
    /// Equal namespaces that are drawn as one.
    pub(crate) fleets: Fleets,
    pub(crate) items: ById<ItemId, Item>,
    pub(crate) arrows: ById<ArrowId, Arrow>,
    /// The part that shows each element. In mode *nodes* an edge may be part of several arrows, which only `pairs` lists.
    places: PerElement<Place>,
    /// Per arrow from node to node, the publications and subscriptions that it joins.
    pub(crate) pairs: ById<ArrowId, Vec<(EdgeId, EdgeId)>>,
    /// Per topic of the mission, its name in a bundle: that of its group, if it is in one.
    pub(crate) bundled: ById<TopicId, Arc<str>>,
    /// Per edge, and per topic with publications, the arrows that carry it; those of a topic from its publishers.
    carriers: PerElement<Vec<ArrowId>>,
    /// Per topic, whether lines are drawn for it.
    drawn: ById<TopicId, bool>,
    /// Per topic, whether a publisher is known.
    is_sent: ById<TopicId, bool>,
    /// The number of items at the end of the list that are listed as words, because no line leads to them.
    pub(crate) in_words: usize,
    /// The number of arrows from node to node that were left out because they were too many.
    pub(crate) dropped: usize,
}

/// The largest number of pairs of publishers and subscribers drawn from node to node. A topic with thousands
/// of both has millions, far too many to read.
const MOST_PAIRS: usize = 200_000;

/// The boxes that an arrow connects, and its kind: edges with the same ends are in one arrow.
type ArrowEnds = (ItemId, ItemId, ArrowKind);

impl<'a> Viewed<'a> {
    pub(crate) fn new(mission: &'a Mission, options: &ViewOptions) -> Self {
        let elements = &mission.elements;
        let mut selection = select(elements, options);
        let grouping = match options.mode {
            // rqt_graph has an arrow for each topic of an action.
            Mode::Nodes if !options.is_bundled => Grouping {
                actions: options.group.actions && !options.exact_names,
                ..Grouping::NONE
            },
            _ => options.group,
        };
        let seen: ById<TopicId, bool> = selection.topics.iter().map(Option::is_none).collect();
        let groups = fold::groups(elements, &seen, grouping);
        let mut grouped = ById::like(&elements.topics, false);
        for id in groups.values().flatten() {
            grouped[*id] = true;
        }
        finish(&mut selection, elements, options, &grouped);
        let mut is_sent = ById::like(&elements.topics, false);
        for edge in &elements.publishes {
            is_sent[edge.topic] = true;
        }
        let mut viewed = Self {
            elements,
            is_sent,
            selection,
            // None if exact names or separate boxes are requested.
            fleets: if options.exact_names || options.group == Grouping::NONE {
                Fleets::default()
            } else {
                Fleets::new(elements, options)
            },
            items: ById::default(),
            arrows: ById::default(),
            places: PerElement::new(elements, |_| Place::Hidden),
            pairs: ById::default(),
            bundled: ById::default(),
            carriers: PerElement::new(elements, |_| Vec::new()),
            drawn: if options.is_bundled {
                listed::drawn(mission, options)
            } else {
                ById::like(&elements.topics, true)
            },
            in_words: 0,
            dropped: 0,
        };
        viewed.set_items(mission, options, &groups);
        if options.mode.is_direct() {
            viewed.bundled = fold::on_lines(elements, &groups);
            viewed.set_direct(options);
        }
        if !options.mode.is_direct() || options.is_bundled {
            viewed.set_arrows(options);
        }
        viewed.set_carriers();
        viewed
    }

    fn set_items(&mut self, mission: &Mission, options: &ViewOptions, groups: &Groups) {
        let elements = self.elements;
        let mut keys = fold::keys(elements, options, &self.fleets, &self.selection, groups);
        let words = Words::new(mission, options, (&self.selection, &self.drawn), &mut keys);
        let shown = keys.iter();
        let shown = shown.filter_map(|(what, key)| Some((key.as_ref()?, what)));
        let is_in_words = |members: &[(&ItemKey, Element)]| {
            let is = |(key, what): &(&ItemKey, Element)| {
                key.kind != ItemKind::Namespace && words.has(*what)
            };
            members.iter().all(is)
        };
        let counted = |members: &[(&ItemKey, Element)]| {
            let nodes = members.iter().filter_map(|(_, what)| match what {
                Element::Node(id) => Some(&words.counted[*id]),
                _ => None,
            });
            let topics = nodes.flatten();
            topics
                .map(|at| elements.topics[*at].name.shared())
                .collect()
        };
        let shown = sorted(shown.collect());
        let (boxes, in_words): (Vec<_>, Vec<_>) = together(&shown).partition(|m| !is_in_words(m));
        self.in_words = in_words.len();
        for members in boxes.into_iter().chain(in_words) {
            let ItemKey { kind, name } = members[0].0;
            let id = self.items.push(Item {
                kind: *kind,
                name: Arc::clone(name),
                label: Arc::clone(name),
                others: Vec::new(),
                is_replica: *kind != ItemKind::Namespace && self.fleets.has(name),
                counted: counted(members),
                is_service: members.iter().all(|(_, what)| elements.is_service(*what)),
                cluster: None,
                members: members.iter().map(|(_, what)| *what).collect(),
            });
            for (_, what) in members {
                self.set_place(*what, Place::Item(id));
            }
        }
        if !options.alike_in.is_empty() {
            let items = self.items.iter_mut();
            for item in items.filter(|item| item.kind == ItemKind::Node) {
                item.others = fold::others(elements, &item.name, &item.members);
            }
        }
        if !options.exact_names {
            fold::label(&mut self.items, elements);
        }
    }

    /// Arrows between nodes and topics; in bundles, only those of topics with a box of their own and the only box that they
    /// are connected to.
    fn set_arrows(&mut self, options: &ViewOptions) {
        let mut lines = Vec::new();
        for (what, edge) in self.elements.edges() {
            let Some((node, topic)) = self.ends(edge) else {
                continue;
            };
            let is_leaf = self.items[topic].kind == ItemKind::Topic
                && self.is_drawn(node)
                && self.is_drawn(topic);
            if options.mode.is_direct() && !is_leaf {
                continue;
            }
            if node == topic {
                self.set_place(what, Place::Inside(node));
            } else if matches!(what, Element::Publish(_)) {
                lines.push(((node, topic, ArrowKind::Publish), what));
            } else {
                lines.push(((topic, node, ArrowKind::Subscribe), what));
            }
        }
        for members in together(&sorted(lines)) {
            let all = members.iter().map(|(_, what)| *what).collect();
            let arrow = self.arrow(members[0].0.clone(), all);
            let id = self.arrows.push(arrow);
            for (_, what) in members {
                self.set_place(*what, Place::Arrow(id));
            }
        }
    }

    fn arrow(&self, (from, to, kind): ArrowEnds, members: Vec<Element>) -> Arrow {
        let is_service = |what: &Element| self.elements.is_service(*what);
        Arrow {
            from,
            to,
            kind,
            is_service: members.iter().all(is_service),
            members,
            topics: Vec::new(),
        }
    }

    fn set_place(&mut self, what: Element, place: Place) {
        if let Some(old) = self.places.of_mut(what) {
            *old = place;
        }
    }

    /// The part that shows an element.
    pub(crate) fn place(&self, what: Element) -> Place {
        self.places.of(what).copied().unwrap_or(Place::Hidden)
    }

    /// The members with which an item lives and dies. A collapsed namespace does so with its nodes, and with topics whose
    /// publishers are unknown: its other topics exist with what is subscribed to them, wherever that is.
    pub(crate) fn body<'i>(&'i self, item: &'i Item) -> impl Iterator<Item = &'i Element> {
        let has_nodes = item.members.first().is_some_and(Element::is_node);
        item.members.iter().filter(move |what| match what {
            Element::Topic(id) => !has_nodes || !self.is_sent[*id],
            _ => true,
        })
    }

    /// The item of a node or topic.
    pub(crate) fn item_of(&self, what: Element) -> Option<ItemId> {
        match self.place(what) {
            Place::Item(id) => Some(id),
            _ => None,
        }
    }

    /// The items of an edge's node and topic.
    fn ends(&self, edge: &Edge) -> Option<(ItemId, ItemId)> {
        let node = self.item_of(Element::Node(edge.node))?;
        Some((node, self.item_of(Element::Topic(edge.topic))?))
    }

    /// Arrows from publishers to subscribers: one per topic or action between two of them, or one for all topics in a bundle.
    fn set_direct(&mut self, options: &ViewOptions) {
        let (elements, is_bundled) = (self.elements, options.is_bundled);
        let mut subscribers = ById::like(&elements.topics, Vec::new());
        for (id, edge) in elements.subscribes.with_ids() {
            if let Some(item) = self.item_of(Element::Node(edge.node)) {
                subscribers[edge.topic].push((id, item));
            }
        }
        let mut arrows: BTreeMap<ArrowEnds, Vec<(EdgeId, EdgeId)>> = BTreeMap::new();
        let mut pairs = 0;
        for (publish, edge) in elements.publishes.with_ids() {
            let Some(from) = self.item_of(Element::Node(edge.node)) else {
                continue;
            };
            let name = &elements.topics[edge.topic].name;
            if self.selection.topics[edge.topic].is_some()
                || !self.drawn[edge.topic]
                || options.hide.debug && is_debug_label(name.as_str())
            {
                continue;
            }
            for (subscribe, to) in &subscribers[edge.topic] {
                if from == *to && self.items[from].kind == ItemKind::Namespace {
                    self.set_place(Element::Publish(publish), Place::Inside(from));
                    self.set_place(Element::Subscribe(*subscribe), Place::Inside(from));
                    continue;
                }
                if !self.is_drawn(from) || !self.is_drawn(*to) {
                    continue;
                }
                pairs += 1;
                if pairs > MOST_PAIRS || is_bundled && from == *to {
                    continue;
                }
                let line = &self.bundled[edge.topic];
                let is_answer =
                    matches!(last_part(name.as_str()), "status" | "result" | "feedback");
                let ends = if is_bundled {
                    // One line for both directions.
                    (from.min(*to), from.max(*to), ArrowKind::Bundle)
                } else {
                    // The arrow of an action begins at its client.
                    let is_back = is_answer && *line != name.shared();
                    let (from, to) = if is_back { (*to, from) } else { (from, *to) };
                    (from, to, ArrowKind::Direct(Arc::clone(line)))
                };
                arrows.entry(ends).or_default().push((publish, *subscribe));
            }
        }
        self.dropped = pairs.saturating_sub(MOST_PAIRS);
        for (mut ends, pairs) in arrows {
            let mut names = BTreeSet::new();
            if is_bundled {
                let [there, back] = [ends.0, ends.1].map(|from| self.names_from(from, &pairs));
                // Most of its topics go along it.
                if back.len() > there.len() {
                    (ends.0, ends.1) = (ends.1, ends.0);
                }
                names = there;
                names.extend(back);
            }
            let publishes = pairs.iter().map(|(p, _)| Element::Publish(*p));
            let others = pairs.iter().map(|(_, s)| Element::Subscribe(*s));
            let members: BTreeSet<Element> = publishes.chain(others).collect();
            self.arrows.push(Arrow {
                topics: names.into_iter().collect(),
                ..self.arrow(ends, members.into_iter().collect())
            });
            self.pairs.push(pairs);
        }
    }

    /// The names of the topics that an item publishes on a line.
    fn names_from(&self, from: ItemId, pairs: &[(EdgeId, EdgeId)]) -> BTreeSet<Arc<str>> {
        let own = pairs.iter().map(|(publish, _)| *publish);
        let own = own.filter(|publish| self.item_of_sender(*publish) == Some(from));
        let topics = own.map(|publish| self.elements.publishes[publish].topic);
        topics
            .map(|topic| Arc::clone(&self.bundled[topic]))
            .collect()
    }

    /// Whether an item has a box.
    fn is_drawn(&self, item: ItemId) -> bool {
        item.at() < self.items.len() - self.in_words
    }

    /// The publications on the lines of bundles, with the names of their topics there.
    pub(crate) fn bundles(&self) -> impl Iterator<Item = (EdgeId, &Arc<str>)> {
        let all = self.arrows.iter().zip(&self.pairs);
        let bundles = all.filter(|(arrow, _)| arrow.kind == ArrowKind::Bundle);
        let publications = bundles.flat_map(|(_, pairs)| pairs.iter().map(|(publish, _)| *publish));
        publications.map(|id| (id, &self.bundled[self.elements.publishes[id].topic]))
    }

    /// The item of the node that publishes.
    pub(crate) fn item_of_sender(&self, publish: EdgeId) -> Option<ItemId> {
        let edge = self.elements.publishes.get(publish)?;
        self.item_of(Element::Node(edge.node))
    }

    /// The topic of a bundle that a pair of edges is part of, and whether it runs against the arrow.
    pub(crate) fn row(
        &self,
        arrow: &Arrow,
        (publish, subscribe): (EdgeId, EdgeId),
    ) -> Option<(u32, usize)> {
        let topic = self.elements.subscribes.get(subscribe)?.topic;
        let name = self.bundled.get(topic)?;
        let at = arrow.topics.binary_search(name).ok()?;
        let is_back = self.item_of_sender(publish) != Some(arrow.from);
        Some((u32::try_from(at).ok()?, usize::from(is_back)))
    }

    /// Records the arrows that each topic's publications are part of.
    fn set_carriers(&mut self) {
        for (id, arrow) in self.arrows.with_ids() {
            for member in &arrow.members {
                let topic = match member {
                    Element::Publish(publish) => Some(self.elements.publishes[*publish].topic),
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
        let (node, topic) = self.elements.ends(what);
        let is_node = node.is_none_or(|id| self.selection.nodes.get(id) == Some(&None));
        let is_topic = topic.is_none_or(|id| self.selection.topics.get(id) == Some(&None));
        (node.is_some() || topic.is_some()) && is_node && is_topic
    }

    /// Whether a single arrow carries a topic from its publishers.
    pub(crate) fn has_single_sender(&self, topic: Element) -> bool {
        self.carriers(topic).len() == 1
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
