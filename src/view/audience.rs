//! The nodes that lack messages while a node is away: the subscribers of topics that only that node
//! publishes.

use crate::base::name::is_quiet;
use crate::graph::{Elements, NodeId, TopicId, Wiring};

/// The subscribers of topics with one publisher.
pub(super) struct Audience<'a> {
    elements: &'a Elements,
    wiring: Wiring,
}

impl<'a> Audience<'a> {
    pub(super) fn new(elements: &'a Elements) -> Self {
        let wiring = elements.wiring(|_, _| true);
        Self { elements, wiring }
    }

    /// Of the topics that only this node (or other runs of it) publishes, the one with most subscribers, and
    /// these subscribers.
    pub(super) fn of(&self, node: NodeId) -> Option<(TopicId, &[NodeId])> {
        let topics = self.wiring.published.get(node)?.iter().copied();
        let name = |topic: TopicId| self.elements.topics.get(topic).map(|t| &t.name);
        let role = |id: NodeId| self.elements.nodes.get(id).map(|n| &n.role);
        let own = topics.filter(|topic| {
            let is_shown = name(*topic).is_some_and(|name| !is_quiet(name.as_str()));
            let mut publishers = self.wiring.publishers[*topic].iter();
            is_shown && publishers.all(|other| role(*other) == role(node))
        });
        let missed = own.map(|topic| (topic, &self.wiring.subscribers[topic][..]));
        let missed = missed.filter(|(_, nodes)| !nodes.is_empty());
        missed.max_by_key(|(topic, nodes)| (nodes.len(), std::cmp::Reverse(*topic)))
    }
}
