//! The source of a figure: the mission, the parts of it that are shown, and whether its phases have names.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::name::{is_quiet, last_part};
use crate::base::time::Span;
use crate::evidence::Confidence;
use crate::graph::{ById, EdgeId, Element, Node, NodeId, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::Phase;
use crate::mission::phases::knows_publishers;
use crate::view::NameFilter;

/// The mission as figures show it: by roles, without housekeeping, recorders, and nodes and topics excluded
/// by filters.
pub(crate) struct FigureSource<'a> {
    pub(crate) mission: &'a Mission,
    /// Roles with their nodes.
    pub(crate) roles: BTreeMap<Arc<str>, Vec<NodeId>>,
    /// Per topic, whether it is shown.
    topics: ById<TopicId, bool>,
    /// Per node, its publications on shown topics.
    published: ById<NodeId, Vec<EdgeId>>,
    /// The phases; none if there is only one.
    pub(crate) phases: &'a [Phase],
    /// Whether their names are the user's.
    pub(crate) is_named: bool,
}

impl<'a> FigureSource<'a> {
    /// The source of the nodes and topics that pass both filters.
    pub(crate) fn new(
        mission: &'a Mission,
        nodes: &NameFilter,
        topics: &NameFilter,
        is_named: bool,
    ) -> Self {
        let mut roles: BTreeMap<Arc<str>, Vec<NodeId>> = BTreeMap::new();
        for (id, node) in mission.elements.nodes.with_ids() {
            if !node.is_tool() && nodes.passes(node.name.as_str()) {
                roles.entry(Arc::clone(&node.role)).or_default().push(id);
            }
        }
        let shown = mission.elements.topics.iter().map(|t| {
            let name = t.name.as_str();
            !is_quiet(name) && topics.passes(name)
        });
        let topics: ById<TopicId, bool> = shown.collect();
        let mut published = ById::like(&mission.elements.nodes, Vec::new());
        for (id, edge) in mission.elements.publishes.with_ids() {
            if topics[edge.topic] {
                published[edge.node].push(id);
            }
        }
        let phases = &mission.log.phases[..];
        Self {
            mission,
            roles,
            topics,
            published,
            phases: if phases.len() > 1 { phases } else { &[] },
            is_named,
        }
    }

    /// The time of the whole mission.
    pub(crate) fn span(&self) -> Span {
        self.mission.span
    }

    /// Whether at least half of the messages have a known publisher; else rows are topics.
    pub(crate) fn knows_publishers(&self) -> bool {
        knows_publishers(&self.mission.elements, &self.mission.sending)
    }

    /// Whether the mission has no nodes but recorders and players, without regard to filters.
    pub(crate) fn knows_no_node(&self) -> bool {
        self.mission.elements.nodes.iter().all(Node::is_tool)
    }

    pub(crate) fn shows(&self, topic: TopicId) -> bool {
        self.topics.get(topic) == Some(&true)
    }

    /// Whether nearly every node uses this topic, so that its arrows and lists are not informative: transforms, diagnostics,
    /// bonds.
    pub(crate) fn is_hub(&self, topic: TopicId) -> bool {
        let last = last_part(self.topic(topic));
        matches!(last, "tf" | "tf_static" | "bond") || last.starts_with("diagnostics")
    }

    pub(crate) fn topic(&self, id: TopicId) -> &str {
        let topic = self.mission.elements.topics.get(id);
        topic.map_or("", |t| t.name.as_str())
    }

    /// The topics that are shown.
    pub(crate) fn shown_topics(&self) -> impl Iterator<Item = TopicId> + '_ {
        let topics = self.topics.with_ids();
        topics.filter(|(_, is)| **is).map(|(id, _)| id)
    }

    /// The publications of some nodes on shown topics.
    pub(crate) fn publications(&self, nodes: &[NodeId]) -> Vec<EdgeId> {
        let own = nodes.iter().flat_map(|id| &self.published[*id]);
        let mut own: Vec<EdgeId> = own.copied().collect();
        own.sort_unstable();
        own
    }

    /// The times in which an element exists.
    pub(crate) fn lives(&self, what: Element) -> impl Iterator<Item = Span> + '_ {
        let whole = self.span();
        let lives = self.mission.elements.seen(what).lives.iter();
        let inside =
            lives.map(move |life| Span::new(life.start.max(whole.start), life.end.min(whole.end)));
        inside.filter(|life| life.start < life.end)
    }

    /// The strongest confidence to which an element is known.
    pub(crate) fn confidence(&self, what: Element) -> Confidence {
        let rows = self
            .mission
            .graphs
            .rows(what)
            .map(|(_, row)| row.confidence);
        rows.min().unwrap_or(Confidence::Declared)
    }
}
