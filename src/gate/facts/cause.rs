//! The causes of findings in the event log.

use std::collections::BTreeSet;

use super::Facts;
use crate::base::time::Span;
use crate::gate::finding::Cause;
use crate::graph::{Element, NodeId, TopicId};
use crate::mission::event_log::Kind;

impl Facts<'_> {
    /// The cause in the event log for the change of a topic around a time: an event of its publishers, or of the nodes
    /// that feed them.
    pub(crate) fn cause_for_topic(&self, topic: TopicId, around: Span) -> Option<Cause> {
        let direct: BTreeSet<NodeId> = self.publishers(topic).iter().map(|p| p.0).collect();
        let fed: BTreeSet<TopicId> = {
            let edges = self.mission.elements.subscribes.iter();
            let own = edges.filter(|e| direct.contains(&e.node) && e.topic != topic);
            own.map(|e| e.topic).collect()
        };
        let feeders: BTreeSet<NodeId> = fed
            .iter()
            .flat_map(|topic| self.publishers(*topic))
            .map(|p| p.0)
            .filter(|node| !direct.contains(node))
            .collect();
        self.cause(&direct, around)
            .or_else(|| self.cause(&feeders, around))
    }

    /// The first event of one of these nodes in a time range.
    pub(crate) fn cause(&self, nodes: &BTreeSet<NodeId>, around: Span) -> Option<Cause> {
        let wanted = [Kind::Stopped, Kind::Restarted, Kind::Silent];
        let events = self.mission.log.inside(around).map(|(_, event)| event);
        let mut events = events.filter(|e| wanted.contains(&e.kind));
        let event = events.find(|e| matches!(e.what, Element::Node(id) if nodes.contains(&id)))?;
        self.mission.elements.ends(event.what).0.map(|node| Cause {
            time: Some(event.time),
            text: format!(
                "{} {} at {}",
                self.role(node),
                event.kind.word(),
                self.clock(event.time)
            ),
        })
    }
}
