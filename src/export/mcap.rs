//! The graph over time for other tools: an MCAP file with `/rosgraph` (`rosgraph_msgs/msg/Graph`, a message per
//! change) and the event log on `/bagreel/events` (`foxglove_msgs/msg/Log`), both CDR with their definitions.
//!
//! Reading it yields the same elements in every window. The node [`UNKNOWN_NODE`] publishes every topic without a known
//! end, and those of publishers that the recorder counts but does not name, once per publisher.

mod cdr;
mod definitions;
mod graph_file;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Cursor, Write as _};

pub(crate) use self::graph_file::{GRAPH, GraphEnd, GraphFile, GraphNode, LOG, graph, log};
use super::{Sequence, Started, one_file};
use crate::base::name::UNKNOWN_NODE;
use crate::base::time::Stamp;
use crate::evidence::unknown::unnamed as boxed;
use crate::export::target::Target;
use crate::graph::{Edge, Element, NodeId, Topic, TopicId};
use crate::mission::Mission;
use crate::mission::events::sentence;

/// Begins the file.
///
/// # Errors
/// [`Error::Usage`](crate::base::error::Error::Usage) for a name with `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    one_file(target, "the graphs of all windows are one file", |sink| {
        let bytes = written(sequence.data)?;
        sink.write_all(&bytes).map(|()| Vec::new())
    })
}

/// The whole file.
fn written(mission: &Mission) -> io::Result<Vec<u8>> {
    let mut to = GraphFile::new(Cursor::new(Vec::new()), true)?;
    let ends = Ends::new(mission);
    let turns = ends.turns(mission);
    let graphs = turns
        .into_iter()
        .map(|at| (at, GRAPH, ends.graph(mission, at)));
    let mut all: Vec<(Stamp, usize, Vec<u8>)> = graphs.collect();
    let last = mission.span.end.plus(-1);
    let parts = mission.log.all_parts();
    for (id, event) in mission.log.events.with_ids() {
        if event.is_headline() {
            let at = event.time.max(mission.span.start).min(last);
            let text = sentence(mission, &parts, id, event);
            all.push((at, LOG, log(event.time, &text, event.kind.is_remark())));
        }
    }
    all.push((last, LOG, log(last, "the recording ends", false)));
    all.sort_by_key(|(at, channel, _)| (*at, *channel));
    for (at, channel, payload) in &all {
        to.write(*channel, *at, payload)?;
    }
    Ok(to.finish()?.into_inner())
}

/// The written elements: the ends of every node.
struct Ends<'a> {
    /// By node: publications and subscriptions.
    of: BTreeMap<NodeId, [Vec<(Element, &'a Edge)>; 2]>,
    /// The publications of unnamed nodes, with the number of those.
    unnamed: Vec<(Element, &'a Edge, usize)>,
}

impl<'a> Ends<'a> {
    /// Excludes inferences from source code, and the names of boxes for unnamed nodes.
    fn new(mission: &'a Mission) -> Self {
        let all = &mission.elements;
        let is_known = |what| !all.evidence(what).is_guess();
        let mut of: BTreeMap<NodeId, [Vec<(Element, &Edge)>; 2]> = BTreeMap::new();
        for id in all.nodes.ids().filter(|id| is_known(Element::Node(*id))) {
            of.insert(id, Default::default());
        }
        let mut unnamed = Vec::new();
        for (what, edge) in all.edges() {
            if !is_known(what) {
                let is_source = all.evidence(what).has("source_only");
                let is_box = !is_source && matches!(what, Element::Publish(_));
                let node = all.nodes.get(edge.node).filter(|_| is_box);
                unnamed.extend(node.map(|node| (what, edge, boxed(node.name.as_str()))));
                continue;
            }
            let side = usize::from(matches!(what, Element::Subscribe(_)));
            if let Some(ends) = of.get_mut(&edge.node) {
                ends[side].push((what, edge));
            }
        }
        Self { of, unnamed }
    }

    /// The times at which the graph changes, from the mission's start on.
    fn turns(&self, mission: &Mission) -> BTreeSet<Stamp> {
        let nodes = self.of.keys().map(|id| Element::Node(*id));
        let edges = self.of.values().flatten().flatten().map(|(what, _)| *what);
        let all = mission.elements.all();
        let topics = all.filter(Element::is_topic);
        let runs = nodes.chain(edges).chain(topics);
        let runs = runs.flat_map(|what| &mission.elements.seen(what).lives);
        let turns = runs.flat_map(|run| [run.start, run.end]);
        let inside = turns.filter(|at| mission.span.contains(*at));
        inside.chain([mission.span.start]).collect()
    }

    /// The graph at a time.
    fn graph(&self, mission: &Mission, at: Stamp) -> Vec<u8> {
        let elements = &mission.elements;
        let is_there = |what: Element| elements.seen(what).lives.iter().any(|run| run.contains(at));
        let nodes = self
            .of
            .iter()
            .filter(|(id, _)| is_there(Element::Node(**id)));
        let topics = elements.topics.ids();
        let topics = topics.filter(|id| is_there(Element::Topic(*id)));
        let mut alone: BTreeSet<TopicId> = topics.collect();
        let topic = |id: TopicId| elements.topics.get(id);
        let mut there = Vec::new();
        for (id, ends) in nodes {
            let name = elements.nodes.get(*id);
            let mut node = GraphNode::new(name.map_or("", |node| node.name.as_str()));
            for (side, ends) in ends.iter().enumerate() {
                for (_, edge) in ends.iter().filter(|(what, _)| is_there(*what)) {
                    alone.remove(&edge.topic);
                    if let Some(topic) = topic(edge.topic) {
                        node.ends[side + 2 * usize::from(topic.is_service())].push(end(topic));
                    }
                }
            }
            there.push(node);
        }
        let mut node = GraphNode::new(UNKNOWN_NODE);
        for (_, edge, many) in self.unnamed.iter().filter(|(what, ..)| is_there(*what)) {
            alone.remove(&edge.topic);
            let ends = topic(edge.topic).into_iter().map(end);
            node.ends[0].extend(ends.cycle().take(*many));
        }
        // Without a quality of service: there may be no publisher.
        for topic in alone.into_iter().filter_map(topic) {
            let qos = None;
            node.ends[2 * usize::from(topic.is_service())].push(GraphEnd { qos, ..end(topic) });
        }
        if node.ends.iter().any(|ends| !ends.is_empty()) {
            there.push(node);
        }
        graph(&there)
    }
}

fn end(topic: &Topic) -> GraphEnd<'_> {
    GraphEnd {
        name: topic.name.as_str(),
        kind: topic.types.first().map_or("", |kind| kind),
        qos: topic.qos.as_deref(),
    }
}
