//! Rows over time: when each node or topic existed, published and changed, with the phases of the mission.
//!
//! In comes a mission with the filters of a page ([`FigureSource`]); out come [`Timeline`]s, which know nothing of
//! missions, and their drawings. [`rows`] makes a row per node or topic, orders and joins them, [`marks`] puts the events of the log on
//! them, and [`drawer`] draws the outcome at one of three densities: below a
//! frame ([`below`]), as a page of topics ([`crate::draw::topic_timeline`]), and on paper
//! ([`crate::draw::figure`]). The page in a browser draws the same rows itself. Begin with [`drawer`].

pub(crate) mod below;
pub(crate) mod canvas;
pub(crate) mod drawer;
pub(crate) mod legend;
pub(crate) mod marks;
pub(crate) mod notes;
pub(crate) mod rows;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::name::{is_quiet, last_part};
use crate::base::time::Span;
use crate::evidence::Confidence;
use crate::graph::{ById, EdgeId, Element, NodeId, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::{Interruption, Phase};
use crate::mission::phases::knows_publishers;
use crate::view::NameFilter;
use marks::RowMark;
use notes::PhaseLabel;
use rows::Row;

/// Rows over time, in the order in which they are drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// The time that its axis covers.
    pub(crate) span: Span,
    /// The phases; none if there is only one.
    pub(crate) phases: Vec<PhaseLabel>,
    /// What interrupts it.
    pub(crate) interruptions: Vec<Interruption>,
    /// The rows.
    pub(crate) rows: Vec<Row>,
}

impl Timeline {
    /// These rows with numbered phases.
    pub(crate) fn new(source: &FigureSource<'_>, rows: Vec<Row>) -> Self {
        Self {
            span: source.span(),
            phases: notes::numbered(source),
            interruptions: source.mission.log.interruptions.clone(),
            rows,
        }
    }

    /// These rows with named phases.
    pub(crate) fn named(source: &FigureSource<'_>, rows: Vec<Row>) -> Self {
        Self {
            phases: notes::named(source),
            ..Self::new(source, rows)
        }
    }

    /// All marks with the indices of their rows, in order of time.
    pub(crate) fn marks(&self) -> Vec<(usize, &RowMark)> {
        let rows = self.rows.iter().enumerate();
        let marks = rows.flat_map(|(at, row)| row.marks.iter().map(move |mark| (at, mark)));
        let mut marks: Vec<_> = marks.collect();
        marks.sort_by_key(|(at, mark)| (mark.at, *at));
        marks
    }

    /// The row from which a mark's topic is taken over.
    pub(crate) fn giver(&self, mark: &RowMark) -> Option<usize> {
        let from = mark.from?;
        self.rows.iter().position(|row| row.nodes.contains(&from))
    }
}

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
        let rows = self.mission.graphs.rows(what);
        let confidences = rows.map(|(_, row)| row.confidence);
        confidences.min().unwrap_or(Confidence::Declared)
    }
}
