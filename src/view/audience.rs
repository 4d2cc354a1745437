//! The nodes that lack messages while a node is away: the subscribers of topics that only that node
//! publishes.

use std::collections::BTreeMap;

use crate::base::name::is_quiet;
use crate::graph::{Elements, NodeId, TopicId};

/// The subscribers of topics with one publisher.
pub(super) struct Audience<'a> {
    elements: &'a Elements,
    publishers: BTreeMap<TopicId, Vec<NodeId>>,
    subscribers: BTreeMap<TopicId, Vec<NodeId>>,
    published: BTreeMap<NodeId, Vec<TopicId>>,
}

impl<'a> Audience<'a> {
    pub(super) fn new(elements: &'a Elements) -> Self {
        let mut all = Self {
            elements,
            publishers: BTreeMap::new(),
            subscribers: BTreeMap::new(),
            published: BTreeMap::new(),
        };
        for edge in &elements.publishes {
            all.publishers
                .entry(edge.topic)
                .or_default()
                .push(edge.node);
            all.published.entry(edge.node).or_default().push(edge.topic);
        }
        for edge in &elements.subscribes {
            all.subscribers
                .entry(edge.topic)
                .or_default()
                .push(edge.node);
        }
        all
    }

    /// Of the topics that only this node (or other runs of it) publishes, the one with most subscribers, and
    /// these subscribers.
    pub(super) fn of(&self, node: NodeId) -> Option<(TopicId, &[NodeId])> {
        let topics = self.published.get(&node)?.iter().copied();
        let name = |topic: TopicId| self.elements.topics.get(topic).map(|t| &t.name);
        let role = |id: NodeId| self.elements.nodes.get(id).map(|n| &n.role);
        let own = topics.filter(|topic| {
            let is_shown = name(*topic).is_some_and(|name| !is_quiet(name.as_str()));
            let mut publishers = self.publishers.get(topic).into_iter().flatten();
            is_shown && publishers.all(|other| role(*other) == role(node))
        });
        let missed = own.filter_map(|topic| Some((topic, &self.subscribers.get(&topic)?[..])));
        missed.max_by_key(|(topic, nodes)| (nodes.len(), std::cmp::Reverse(*topic)))
    }
}
