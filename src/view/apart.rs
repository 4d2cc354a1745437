//! The nodes and topics of a picture without a line: those listed as words, and topics beside their only box.

use std::collections::BTreeSet;

use super::bundles;
use super::collapse::headlines;
use super::homes::ItemKey;
use super::items::{EdgePlace, Viewed, arrow};
use super::{ArrowKind, ItemKind, Mode, ViewOptions};
use crate::graph::{Element, Elements, TopicId};
use crate::mission::Mission;

impl Viewed {
    /// Finds the topics to list as words: those without a known endpoint, and in bundles those with an event
    /// although no line carries them; of the latter, those with one known endpoint get a box beside it
    /// instead.
    pub(super) fn set_apart(
        &mut self,
        mission: &Mission,
        options: &ViewOptions,
        (nodes, topics): (&[Option<ItemKey>], &mut [Option<ItemKey>]),
    ) {
        let elements = &mission.elements;
        let mut ends: Vec<[BTreeSet<&ItemKey>; 2]> = vec![Default::default(); topics.len()];
        for (edges, way) in [(&elements.publishes, 0), (&elements.subscribes, 1)] {
            for edge in edges {
                ends[edge.topic as usize][way].extend(&nodes[edge.node as usize]);
            }
        }
        let is_bundled = options.mode == Mode::Bundles;
        let reported: BTreeSet<TopicId> = headlines(mission)
            .filter_map(|what| elements.ends(what).1)
            .collect();
        let is_anything = nodes.iter().any(Option::is_some);
        if !is_bundled {
            self.set_nodes_apart(mission);
        }
        for ((key, ends), id) in topics.iter_mut().zip(&ends).zip(0_u32..) {
            let at = id as usize;
            let [senders, receivers] = ends;
            let all: BTreeSet<&ItemKey> = senders.union(receivers).copied().collect();
            if !is_bundled {
                self.is_in_words[1][at] = is_anything && all.is_empty();
                continue;
            }
            let is_seen = self.selection.topics[at].is_none() && reported.contains(&id);
            let is_carried =
                self.drawn[at] && all.len() > 1 && !senders.is_empty() && !receivers.is_empty();
            if key.is_some() || !is_seen || is_carried {
                continue;
            }
            *key = Some((ItemKind::Topic, elements.topics[at].name.shared()));
            self.is_in_words[1][at] = all.len() != 1;
            if let Some(owner) = all.first().filter(|_| all.len() == 1) {
                for (node, words) in nodes.iter().zip(&mut self.is_in_words[0]) {
                    *words &= node.as_ref() != Some(owner);
                }
            }
        }
    }

    /// Finds the nodes to list as words: those without a connection and without an event, if most nodes have a connection.
    fn set_nodes_apart(&mut self, mission: &Mission) {
        let mut is_busy = vec![false; mission.elements.nodes.len()];
        for (_, edge) in mission.elements.edges() {
            let is_seen = self.selection.topics[edge.topic as usize].is_none();
            is_busy[edge.node as usize] |= is_seen;
        }
        let seen = self
            .selection
            .nodes
            .iter()
            .filter(|reason| reason.is_none());
        let is_rule = 2 * is_busy.iter().filter(|busy| **busy).count() >= seen.count();
        for event in bundles::changed(mission) {
            if let (Some(node), _) = mission.elements.ends(event.what) {
                is_busy[node as usize] = true;
            }
        }
        self.is_in_words[0] = is_busy.iter().map(|busy| is_rule && !busy).collect();
    }

    /// The arrows between the topics with a box of their own and the only box that they are connected to.
    pub(super) fn set_leaves(&mut self, elements: &Elements) {
        for (edges, publishes) in [(&elements.publishes, true), (&elements.subscribes, false)] {
            for (edge, id) in edges.iter().zip(0_u32..) {
                let Some((node, topic)) = self.ends(edge).filter(|(node, topic)| {
                    let kind = self.items[*topic as usize].kind;
                    kind == ItemKind::Topic && self.is_drawn(*node) && self.is_drawn(*topic)
                }) else {
                    continue;
                };
                let place = u32::try_from(self.arrows.len()).unwrap_or(u32::MAX);
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
                places[id as usize] = EdgePlace::Arrow(place);
                self.arrows.push(arrow(elements, ends, vec![element]));
            }
        }
    }
}
