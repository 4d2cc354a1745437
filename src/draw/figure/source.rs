//! The source of a figure: the mission, the parts of it that are shown, and whether its phases have names.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::name::{is_quiet, last_part};
use crate::base::time::{Span, Stamp};
use crate::graph::{EdgeId, Element, NodeId, State, TopicId};
use crate::mission::Mission;
use crate::mission::activity::is_hidden_node;
use crate::mission::ledger::Phase;
use crate::mission::phases::knows_publishers;
use crate::view::NameFilter;

/// The mission as figures see it: by roles, without housekeeping, recorders, and nodes and topics that filters leave
/// out.
pub(crate) struct FigureSource<'a> {
    pub(crate) mission: &'a Mission,
    /// Roles with their nodes.
    pub(crate) roles: BTreeMap<Arc<str>, Vec<NodeId>>,
    /// Per topic, whether it is shown.
    topics: Vec<bool>,
    /// Per node, its publications on shown topics.
    published: Vec<Vec<EdgeId>>,
    /// Per publication, whether it is ever latched.
    latched: Vec<bool>,
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
        for (id, node) in (0..).zip(&mission.elements.nodes) {
            if !is_hidden_node(node) && nodes.passes(node.name.as_str()) {
                roles.entry(Arc::clone(&node.role)).or_default().push(id);
            }
        }
        let shown = mission.elements.topics.iter().map(|t| {
            let name = t.name.as_str();
            !is_quiet(name) && topics.passes(name)
        });
        let topics: Vec<bool> = shown.collect();
        let mut published = vec![Vec::new(); mission.elements.nodes.len()];
        for (id, edge) in (0..).zip(&mission.elements.publishes) {
            if topics[edge.topic as usize] {
                published[edge.node as usize].push(id);
            }
        }
        let latched = (0..).zip(&mission.elements.publishes).map(|(id, _)| {
            let mut rows = mission.activity.graphs.rows(Element::Publish(id));
            rows.any(|(_, row)| row.state == State::Latched)
        });
        let phases = &mission.ledger.phases[..];
        Self {
            mission,
            roles,
            topics,
            published,
            latched: latched.collect(),
            phases: if phases.len() > 1 { phases } else { &[] },
            is_named,
        }
    }

    /// The time of the whole mission.
    pub(crate) fn span(&self) -> Span {
        let whole = self.mission.activity.span();
        if whole.nanos() > 0 {
            whole
        } else {
            self.mission.span
        }
    }

    /// Whether at least half of the messages have a known publisher; else rows are topics.
    pub(crate) fn knows_publishers(&self) -> bool {
        knows_publishers(&self.mission.elements, &self.mission.activity)
    }

    /// Whether the mission has no nodes but recorders and players, without regard to filters.
    pub(crate) fn knows_no_node(&self) -> bool {
        self.mission.elements.nodes.iter().all(is_hidden_node)
    }

    pub(crate) fn shows(&self, topic: TopicId) -> bool {
        self.topics.get(topic as usize) == Some(&true)
    }

    /// Whether nearly every node uses this topic, so that arrows and lists of it say nothing: transforms, diagnostics,
    /// bonds.
    pub(crate) fn is_hub(&self, topic: TopicId) -> bool {
        let last = last_part(self.topic(topic));
        matches!(last, "tf" | "tf_static" | "bond") || last.starts_with("diagnostics")
    }

    pub(crate) fn topic(&self, id: TopicId) -> &str {
        let topic = self.mission.elements.topics.get(id as usize);
        topic.map_or("", |t| t.name.as_str())
    }

    /// The topics that are shown.
    pub(crate) fn shown_topics(&self) -> impl Iterator<Item = TopicId> + '_ {
        (0..)
            .zip(&self.topics)
            .filter(|(_, is)| **is)
            .map(|(id, _)| id)
    }

    /// The publications of some nodes on shown topics.
    pub(crate) fn publications(&self, nodes: &[NodeId]) -> Vec<EdgeId> {
        let own = nodes.iter().flat_map(|id| &self.published[*id as usize]);
        let mut own: Vec<EdgeId> = own.copied().collect();
        own.sort_unstable();
        own
    }

    /// The times at which a publication carried messages. One that is ever latched stands for its node by its message,
    /// and is not busy: it has no such time.
    pub(crate) fn sending(&self, edge: EdgeId) -> Vec<Span> {
        let activity = &self.mission.activity;
        if self.latched.get(edge as usize) == Some(&true) {
            return Vec::new();
        }
        if let Some(exact) = activity.sending.publishes.get(edge as usize) {
            return exact.clone();
        }
        let is_active = activity.presence(Element::Publish(edge), |e| e.state == State::Active);
        self.runs(is_active)
    }

    /// The times at which a topic carried messages.
    pub(crate) fn topic_sending(&self, topic: TopicId) -> Vec<Span> {
        let activity = &self.mission.activity;
        if let Some(exact) = activity.sending.topics.get(topic as usize) {
            return exact.clone();
        }
        self.runs(activity.presence(Element::Topic(topic), |t| t.count > Some(0)))
    }

    /// The time until which a topic's last message is kept for late subscribers; `None` if it is not.
    pub(crate) fn topic_kept(&self, topic: TopicId) -> Option<Stamp> {
        let activity = &self.mission.activity;
        let rows = activity.graphs.rows(Element::Topic(topic));
        let kept = rows.filter(|(_, row)| row.state == State::Latched).last();
        kept.map(|(at, _)| activity.cells()[at].end)
    }

    /// Messages of a publication per cell.
    pub(crate) fn sent(&self, edge: EdgeId) -> Vec<f64> {
        let activity = &self.mission.activity;
        let cells = activity.cells();
        let mut sent = vec![0.0; cells.len()];
        for (at, row) in activity.graphs.rows(Element::Publish(edge)) {
            let seconds = cells[at].nanos() as f64 / 1e9;
            sent[at] = match (row.count, row.hz(cells[at])) {
                (Some(count), _) => count as f64,
                (None, Some(hz)) => hz * seconds,
                (None, None) => 0.0,
            };
        }
        sent
    }

    /// Messages of a topic per cell.
    pub(crate) fn topic_sent(&self, topic: TopicId) -> Vec<f64> {
        let activity = &self.mission.activity;
        let mut sent = vec![0.0; activity.cells().len()];
        for (at, row) in activity.graphs.rows(Element::Topic(topic)) {
            sent[at] = row.count.unwrap_or(0) as f64;
        }
        sent
    }

    /// The stretches of consecutive cells for which `is` holds.
    pub(crate) fn runs(&self, is: impl IntoIterator<Item = bool>) -> Vec<Span> {
        let mut runs: Vec<Span> = Vec::new();
        let mut before = false;
        for (cell, is) in self.mission.activity.cells().iter().zip(is) {
            match runs.last_mut() {
                Some(run) if is && before => run.end = cell.end,
                _ if is => runs.push(*cell),
                _ => {}
            }
            before = is;
        }
        runs
    }

    /// The number of the phase that a moment lies in, counted from 0.
    pub(crate) fn phase_at(&self, at: Stamp) -> usize {
        let next = self.phases.partition_point(|p| p.span.start <= at);
        next.saturating_sub(1)
    }
}

/// The spans, sorted, with those joined that overlap or are at most `gap` nanoseconds apart.
pub(crate) fn merged(mut spans: Vec<Span>, gap: i64) -> Vec<Span> {
    spans.sort_unstable_by_key(|s| (s.start, s.end));
    let mut out: Vec<Span> = Vec::new();
    for span in spans {
        match out.last_mut() {
            Some(last) if span.start.since(last.end) <= gap => last.end = last.end.max(span.end),
            _ => out.push(span),
        }
    }
    out
}
