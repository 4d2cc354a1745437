//! The nodes and topics of a picture without a line: those listed as words, and topics beside their only box.

use std::collections::BTreeSet;

use super::bundles;
use super::collapse::headlines;
use super::homes::{ItemKey, NodeKeys, TopicKeys};
use super::items::{EdgePlace, Viewed, arrow};
use super::{ArrowKind, ItemKind, ViewOptions};
use crate::graph::{ById, Element, Elements, TopicId};
use crate::mission::Mission;

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
        for event in bundles::changed(mission) {
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
