//! The box of each node and topic: its own, that of its role or group, or the collapsed namespace that it is part of.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::equal::Fleets;
use super::namespaces::{Collapse, swallows};
use super::roles;
use super::topics::Groups;
use crate::graph::{ById, Edge, Elements, NodeId, Topic, TopicId};
use crate::view::choose::Selection;
use crate::view::{ItemKind, Mode, ViewOptions};

/// The kind and name of a box.
pub(crate) type ItemKey = (ItemKind, Arc<str>);

/// The box of each node, if it has one.
pub(crate) type NodeKeys = ById<NodeId, Option<ItemKey>>;
/// The box of each topic, if it has one.
pub(crate) type TopicKeys = ById<TopicId, Option<ItemKey>>;

/// What determines the boxes.
pub(crate) struct Boxes<'a> {
    pub(crate) elements: &'a Elements,
    pub(crate) options: &'a ViewOptions,
    pub(crate) fleets: &'a Fleets,
    pub(crate) selection: &'a Selection,
    pub(crate) groups: &'a Groups,
}

impl Boxes<'_> {
    /// The box of each node and of each topic.
    pub(crate) fn keys(&self) -> (NodeKeys, TopicKeys) {
        let names = self.names();
        let collapse = self.collapse(&names);
        let nodes = self.nodes(&names, &collapse);
        let topics = match self.options.mode {
            Mode::Nodes if self.options.is_bundled => {
                inside(self.elements, &collapse, &nodes, self.selection)
            }
            Mode::Nodes => ById::like(&self.elements.topics, None),
            Mode::All => self.topics((&collapse, &names), &nodes),
        };
        (nodes, topics)
    }

    /// Per node, the name of its role, in the first of several equal namespaces.
    fn names(&self) -> ById<NodeId, Arc<str>> {
        let mut names: ById<NodeId, Arc<str>> = if self.options.exact_names {
            let nodes = self.elements.nodes.iter();
            nodes.map(|node| node.name.shared()).collect()
        } else {
            roles::boxes(self.elements)
        };
        for name in names.iter_mut() {
            if let Some(stand_in) = self.fleets.stand_in(name) {
                *name = stand_in;
            }
        }
        names
    }

    /// The namespaces to collapse, except those with a single box.
    fn collapse(&self, names: &ById<NodeId, Arc<str>>) -> Collapse<'_> {
        let mut collapse = Collapse::new(self.options);
        if !collapse.is_empty() {
            let folded = names.iter().zip(&self.selection.nodes);
            let folded = folded.filter_map(|(name, reason)| reason.is_none().then_some(&**name));
            let topics = self.elements.topics.iter();
            let topics = topics.map(|topic| topic.name.as_str());
            let topics = topics.filter(|_| !self.options.mode.is_direct());
            collapse.open_single(&folded.collect(), &topics.collect());
        }
        collapse
    }

    fn nodes(&self, names: &ById<NodeId, Arc<str>>, collapse: &Collapse<'_>) -> NodeKeys {
        let all = names.iter().zip(&self.selection.nodes);
        let keys = all.map(|(name, reason)| {
            reason.is_none().then(|| match collapse.of(name) {
                Some(space) => (ItemKind::Namespace, space.into()),
                None => (ItemKind::Node, Arc::clone(name)),
            })
        });
        keys.collect()
    }

    fn topics(
        &self,
        (collapse, names): (&Collapse<'_>, &ById<NodeId, Arc<str>>),
        nodes: &NodeKeys,
    ) -> TopicKeys {
        let all = self.elements.topics.iter().zip(&self.selection.topics);
        let own = |(topic, reason): (&Topic, &Option<_>)| {
            let is_selected = reason.is_none();
            is_selected.then(|| (ItemKind::Topic, topic.name.shared()))
        };
        let mut topics: TopicKeys = all.map(own).collect();
        set_groups(&mut topics, self.groups);
        for key in topics.iter_mut().flatten() {
            if let Some(stand_in) = self.fleets.stand_in(&key.1) {
                key.1 = stand_in;
            }
        }
        if !collapse.is_empty() {
            swallow(self.elements, (collapse, names), nodes, &mut topics);
        }
        topics
    }
}

/// The collapsed namespaces that topics are part of: that of all their publishers; without any, that of their
/// name. Changes of topics that several boxes publish are only shown on the arrows, so these topics are in
/// none.
fn inside(
    elements: &Elements,
    collapse: &Collapse<'_>,
    nodes: &NodeKeys,
    selection: &Selection,
) -> TopicKeys {
    let mut homes: ById<TopicId, BTreeSet<Option<&ItemKey>>> =
        ById::like(&elements.topics, BTreeSet::new());
    for edge in &elements.publishes {
        if let Some(node) = &nodes[edge.node] {
            homes[edge.topic].insert((node.0 == ItemKind::Namespace).then_some(node));
        }
    }
    let topics = elements.topics.iter().zip(&homes).zip(&selection.topics);
    let home = |((topic, homes), hidden): ((&Topic, &BTreeSet<Option<&ItemKey>>), &Option<_>)| {
        let mut homes = homes.iter();
        match (hidden, homes.next(), homes.next()) {
            (None, Some(home), None) => home.cloned(),
            (None, None, _) => {
                let space = collapse.of(topic.name.as_str())?;
                Some((ItemKind::Namespace, space.into()))
            }
            _ => None,
        }
    };
    topics.map(home).collect()
}

/// Puts the topics of each group into its box, whose name is made different from that of every topic.
fn set_groups(topics: &mut TopicKeys, groups: &Groups) {
    for ids in groups.values() {
        for id in ids {
            topics[*id] = None;
        }
    }
    let mut taken: BTreeSet<Arc<str>> = topics
        .iter()
        .flatten()
        .map(|key| Arc::clone(&key.1))
        .collect();
    for (name, ids) in groups {
        let mut name = name.clone();
        while taken.contains(name.as_str()) {
            name.push_str("_2");
        }
        let name: Arc<str> = name.into();
        taken.insert(Arc::clone(&name));
        for id in ids {
            topics[*id] = Some((ItemKind::Group, Arc::clone(&name)));
        }
    }
}

/// Moves topics and groups that belong inside a collapsed namespace into it.
fn swallow(
    elements: &Elements,
    (collapse, names): (&Collapse<'_>, &ById<NodeId, Arc<str>>),
    nodes: &NodeKeys,
    topics: &mut TopicKeys,
) {
    type Spaces<'a> = Vec<Option<&'a str>>;
    let mut ends: BTreeMap<ItemKey, (Spaces<'_>, Spaces<'_>)> = BTreeMap::new();
    for key in topics.iter().flatten() {
        ends.entry(key.clone()).or_default();
    }
    let space = |edge: &Edge| {
        nodes[edge.node].as_ref()?;
        Some(collapse.of(&names[edge.node]))
    };
    let publishes = elements.publishes.iter().map(|e| (e, true));
    let subscribes = elements.subscribes.iter().map(|e| (e, false));
    for (edge, publishes) in publishes.chain(subscribes) {
        let key = topics.get(edge.topic).and_then(Option::as_ref);
        let lists = key.and_then(|key| ends.get_mut(key));
        if let (Some((p, s)), Some(space)) = (lists, space(edge)) {
            if publishes {
                p.push(space);
            } else {
                s.push(space);
            }
        }
    }
    let inside: BTreeMap<ItemKey, Arc<str>> = ends
        .into_iter()
        .filter_map(|(key, (p, s))| {
            let space = swallows(collapse.of(&key.1), &p, &s)?;
            (!collapse.keeps(&key.1)).then(|| (key, space.into()))
        })
        .collect();
    for topic in topics.iter_mut().flatten() {
        if let Some(space) = inside.get(topic) {
            *topic = (ItemKind::Namespace, Arc::clone(space));
        }
    }
}
