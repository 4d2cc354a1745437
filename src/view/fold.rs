//! Several elements drawn as one.
//!
//! In come the elements of a mission, the choice of those that are drawn, and the options; out comes the box of each node
//! and topic. [`Boxes::keys`] is the list of rules in their order, and the place to begin: `roles` (runs of one node), `topics`
//! (actions, images, transforms), `equal` (robots of a fleet), `alike` (nodes that are there in the same phases),
//! `namespaces` (collapsed ones). One rule needs the looks of the drawn boxes: `box_rows` (topics as rows of boxes).

pub(crate) mod alike;
pub(crate) mod box_rows;
pub(crate) mod equal;
pub(crate) mod namespaces;
pub(crate) mod roles;
pub(crate) mod topics;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::choose::Selection;
use super::{ItemKind, ViewOptions};
use crate::graph::{Element, Elements, PerElement};
use equal::Fleets;
use namespaces::{Collapse, sent_from, swallows};
use topics::Groups;

/// The kind and name of a box: elements with the same one are in one box.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ItemKey {
    pub(crate) kind: ItemKind,
    pub(crate) name: Arc<str>,
}

/// The box of each node and topic, if it has one; edges have none.
pub(crate) type Keys = PerElement<Option<ItemKey>>;

/// An element that moves to the box of others.
pub(crate) struct Fold {
    pub(crate) what: Element,
    pub(crate) key: ItemKey,
}

/// What determines the boxes.
pub(crate) struct Boxes<'a> {
    pub(crate) elements: &'a Elements,
    pub(crate) options: &'a ViewOptions,
    pub(crate) fleets: &'a Fleets,
    pub(crate) selection: &'a Selection,
    pub(crate) groups: &'a Groups,
}

impl Boxes<'_> {
    /// The box of each node and topic: its own, unless one of the rules moves it to that of others.
    pub(crate) fn keys(&self) -> Keys {
        let is_direct = self.options.mode.is_direct();
        let mut keys = self.own();
        if !self.options.exact_names {
            apply(&mut keys, roles::folds(self.elements));
        }
        if !is_direct {
            let folds = topics::folds(self.groups, &keys);
            apply(&mut keys, folds);
        }
        let mut folds = self.fleets.folds(&keys);
        folds.retain(|fold| fold.what.is_node() || !is_direct);
        apply(&mut keys, folds);
        if !self.options.alike_in.is_empty() {
            let folds = alike::folds(self.elements, &self.options.alike_in, &keys);
            apply(&mut keys, folds);
        }
        let folds = self.collapsed(&keys);
        apply(&mut keys, folds);
        if is_direct {
            let is_inside =
                |key: &ItemKey| self.options.is_bundled && key.kind == ItemKind::Namespace;
            for id in self.elements.topics.ids() {
                if let Some(key) = keys.of_mut(Element::Topic(id)) {
                    *key = key.take().filter(is_inside);
                }
            }
        }
        keys
    }

    /// A box for each chosen element.
    fn own(&self) -> Keys {
        PerElement::new(self.elements, |what| {
            let (kind, name) = match what {
                Element::Node(id) if self.selection.nodes[id].is_none() => {
                    (ItemKind::Node, self.elements.nodes[id].name.shared())
                }
                Element::Topic(id) if self.selection.topics[id].is_none() => {
                    (ItemKind::Topic, self.elements.topics[id].name.shared())
                }
                _ => return None,
            };
            Some(ItemKey { kind, name })
        })
    }

    /// The elements inside collapsed namespaces, except those with a single box.
    fn collapsed(&self, keys: &Keys) -> Vec<Fold> {
        let is_direct = self.options.mode.is_direct();
        let mut collapse = Collapse::new(self.options);
        if collapse.is_empty() {
            return Vec::new();
        }
        let nodes = self.elements.nodes.ids();
        let nodes = nodes.filter_map(|id| of(keys, Element::Node(id)));
        let topics = self.elements.topics.iter().filter(|_| !is_direct);
        collapse.open_single(
            &nodes.map(|key| &*key.name).collect(),
            &topics.map(|topic| topic.name.as_str()).collect(),
        );
        // Of each box of topics, the namespaces of its publishers and of its subscribers.
        let mut ends: BTreeMap<&ItemKey, [Vec<Option<&str>>; 2]> = BTreeMap::new();
        for (what, edge) in self.elements.edges() {
            let (node, topic) = (Element::Node(edge.node), Element::Topic(edge.topic));
            if let (Some(node), Some(topic)) = (of(keys, node), of(keys, topic)) {
                let way = usize::from(matches!(what, Element::Subscribe(_)));
                ends.entry(topic).or_default()[way].push(collapse.of(&node.name));
            }
        }
        let fold = |(what, key): (Element, &Option<ItemKey>)| {
            let key = key.as_ref()?;
            let own = collapse.of(&key.name);
            let [publishers, subscribers] =
                (ends.get(key)).map_or([&[][..]; 2], |[p, s]| [&p[..], &s[..]]);
            let space = match what {
                Element::Node(_) => own,
                _ if is_direct => sent_from(own, publishers),
                _ => swallows(own, publishers, subscribers).filter(|_| !collapse.keeps(&key.name)),
            };
            let (kind, name) = (ItemKind::Namespace, space?.into());
            let key = ItemKey { kind, name };
            Some(Fold { what, key })
        };
        keys.iter().filter_map(fold).collect()
    }
}

/// The box of an element, if it has one.
pub(crate) fn of(keys: &Keys, what: Element) -> Option<&ItemKey> {
    keys.of(what)?.as_ref()
}

/// Moves elements that have a box to those of others.
fn apply(keys: &mut Keys, folds: Vec<Fold>) {
    for fold in folds {
        if let Some(Some(key)) = keys.of_mut(fold.what) {
            *key = fold.key;
        }
    }
}

/// The different names of these boxes.
fn names<'a>(keys: impl Iterator<Item = &'a ItemKey>) -> BTreeSet<Arc<str>> {
    keys.map(|key| Arc::clone(&key.name)).collect()
}
