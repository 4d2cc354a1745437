//! The facts of a mission by name: its nodes and topics, their times and rates, and whether they are observable.

mod cause;
mod tempo;

use std::collections::{BTreeMap, BTreeSet};

use super::pattern::Pattern;
use crate::base::name::is_quiet;
use crate::base::notice::NoticeKind;
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::Bound;
use crate::graph::{ById, Edge, EdgeId, Element, NodeId, PerElement, State, Topic, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::{Event, Kind};

pub(crate) use tempo::{Rate, TopicSilence};

/// A mission with precomputed facts.
pub(crate) struct Facts<'a> {
    pub(crate) mission: &'a Mission,
    /// The strongest confidence to which each element is known.
    confidences: PerElement<Confidence>,
    /// The number of messages of each topic.
    messages: ById<TopicId, u64>,
    /// Whether a tool rewrote the bag, so that it names wrong publishers.
    is_rewritten: bool,
    /// Present nodes by role.
    roles: BTreeMap<&'a str, Vec<NodeId>>,
    /// The role of each of them.
    names: BTreeMap<&'a str, &'a str>,
    topics: BTreeMap<&'a str, TopicId>,
    /// The publications and the subscriptions of each topic.
    edges: [ById<TopicId, Vec<EdgeId>>; 2],
}

/// Kinds of evidence for what should have run, not for what did. The user's topology file states what did.
const DECLARING: [&str; 2] = ["source", "launch"];
/// Kinds of evidence that name every ROS 1 node with recorded messages.
const NAMING: [&str; 5] = [
    "connection",
    "statistics",
    "rosgraph",
    "discovery",
    "topology",
];
/// Evidence that names every ROS 2 node started during the recording: it declares parameters then.
const STARTING: [&str; 1] = ["parameter_events"];
/// Evidence that lists all subscribers of a topic.
const LISTING: [&str; 4] = ["rosgraph", "discovery", "statistics", "topic_statistics"];

/// Whether an element was observed, not only declared.
fn is_seen(evidence: Evidence) -> bool {
    !evidence.is_guess() && evidence.words().any(|word| !DECLARING.contains(&word))
}

fn has(evidence: Evidence, words: &[&str]) -> bool {
    words.iter().any(|word| evidence.has(word))
}

impl<'a> Facts<'a> {
    /// The facts of a mission.
    pub(crate) fn new(mission: &'a Mission) -> Self {
        let elements = &mission.elements;
        let confidences = mission.graphs.confidences(elements);
        let is_there = |id| confidences.of(Element::Node(id)) < Some(&Confidence::Declared);
        let count = |id| {
            let rows = mission.graphs.rows(Element::Topic(id));
            rows.filter_map(|(_, row)| row.count).sum()
        };
        let topics = elements.topics.with_ids();
        let mut roles: BTreeMap<&str, Vec<NodeId>> = BTreeMap::new();
        let mut names = BTreeMap::new();
        for (id, node) in elements.nodes.with_ids() {
            // Elements in no window are outside the part that is checked.
            if is_there(id) && is_seen(node.seen.evidence) {
                roles.entry(&node.role).or_default().push(id);
                names.insert(node.name.as_str(), &*node.role);
            }
        }
        Self {
            mission,
            confidences,
            messages: elements.topics.ids().map(count).collect(),
            is_rewritten: mission
                .notices
                .iter()
                .any(|n| n.kind == NoticeKind::Rewritten),
            roles,
            names,
            topics: topics
                .map(|(id, topic)| (topic.name.as_str(), id))
                .collect(),
            edges: [&elements.publishes, &elements.subscribes]
                .map(|edges| by_topic(edges, &elements.topics)),
        }
    }

    /// The present roles, each with its nodes.
    pub(crate) fn roles(&self) -> impl Iterator<Item = (&'a str, &[NodeId])> {
        self.roles
            .iter()
            .map(|(role, nodes)| (*role, nodes.as_slice()))
    }

    /// The roles that a pattern matches; a node name matches its role too.
    pub(crate) fn nodes(&self, pattern: &Pattern) -> Vec<(&'a str, &[NodeId])> {
        if pattern.is_name() {
            let name = pattern.as_str();
            let own = self.roles.get_key_value(name).map(|(role, _)| *role);
            let roles: BTreeSet<&str> = own
                .into_iter()
                .chain(self.names.get(name).copied())
                .collect();
            let found = roles
                .into_iter()
                .filter_map(|role| self.roles.get_key_value(role));
            return found
                .map(|(role, nodes)| (*role, nodes.as_slice()))
                .collect();
        }
        let own = |nodes: &[NodeId]| {
            let names = nodes.iter().map(|id| self.node(*id));
            names.into_iter().any(|name| pattern.matches(name))
        };
        self.roles()
            .filter(|(role, nodes)| pattern.matches(role) || own(nodes))
            .collect()
    }

    /// Whether a pattern matches a node.
    pub(crate) fn fits(&self, pattern: &Pattern, node: NodeId) -> bool {
        pattern.matches(self.node(node)) || pattern.matches(self.role(node))
    }

    /// The present topics that a pattern matches.
    pub(crate) fn topics(&self, pattern: &Pattern) -> Vec<TopicId> {
        if pattern.is_name() {
            let own = self.topics.get(pattern.as_str()).copied();
            return own.into_iter().filter(|id| self.is_there(*id)).collect();
        }
        let topics = self.mission.elements.topics.with_ids();
        topics
            .filter(|(id, topic)| pattern.matches(topic.name.as_str()) && self.is_there(*id))
            .map(|(id, _)| id)
            .collect()
    }

    /// Whether a topic was observed, not only declared: with messages, an observed publisher, or no observed
    /// subscriber.
    pub(crate) fn is_there(&self, topic: TopicId) -> bool {
        let elements = &self.mission.elements;
        let any = |of: usize, edges: &ById<EdgeId, Edge>| {
            let mut own = self.edges[of][topic].iter();
            own.any(|id| is_seen(edges[*id].seen.evidence))
        };
        is_seen(elements.topics[topic].seen.evidence)
            && (self.messages[topic] > 0
                || any(0, &elements.publishes)
                || !any(1, &elements.subscribes))
    }

    /// The number of messages of a topic.
    pub(crate) fn messages(&self, topic: TopicId) -> u64 {
        self.messages[topic]
    }

    pub(crate) fn node(&self, id: NodeId) -> &'a str {
        self.mission.elements.nodes[id].name.as_str()
    }

    pub(crate) fn role(&self, id: NodeId) -> &'a str {
        &self.mission.elements.nodes[id].role
    }

    pub(crate) fn topic(&self, id: TopicId) -> &'a str {
        self.mission.elements.topics[id].name.as_str()
    }

    /// Whether a role is housekeeping or the recorder's.
    pub(crate) fn is_tool(&self, nodes: &[NodeId]) -> bool {
        let own = &self.mission.elements.nodes;
        nodes.iter().any(|id| own[*id].is_tool())
    }

    /// Whether a topic is housekeeping.
    pub(crate) fn is_housekeeping(&self, topic: TopicId) -> bool {
        is_quiet(self.topic(topic))
    }

    fn confidence(&self, what: Element) -> Confidence {
        let known = self.confidences.of(what).copied();
        known.unwrap_or(Confidence::Declared)
    }

    /// Whether a role is measured or stated, not only inferred.
    pub(crate) fn is_sure(&self, nodes: &[NodeId]) -> bool {
        let sure = |id: &NodeId| self.confidence(Element::Node(*id)) <= Confidence::Stated;
        nodes.iter().any(sure)
    }

    /// The publishers of a topic: the node, the publication, and its confidence; one known only from code and launch
    /// files is declared.
    pub(crate) fn publishers(&self, topic: TopicId) -> Vec<(NodeId, EdgeId, Confidence)> {
        let own = self.edges[0][topic].iter();
        own.map(|id| {
            let edge = &self.mission.elements.publishes[*id];
            (edge.node, *id, self.confidence(Element::Publish(*id)))
        })
        .collect()
    }

    /// The subscribers of a topic, in the same form.
    pub(crate) fn subscribers(&self, topic: TopicId) -> Vec<(NodeId, EdgeId, Confidence)> {
        let own = self.edges[1][topic].iter();
        own.map(|id| {
            let edge = &self.mission.elements.subscribes[*id];
            (edge.node, *id, self.confidence(Element::Subscribe(*id)))
        })
        .collect()
    }

    /// The roles of the nodes of these edges, without tools and without what is only inferred.
    pub(crate) fn sure_roles(&self, edges: &[(NodeId, EdgeId, Confidence)]) -> BTreeSet<String> {
        let sure = edges
            .iter()
            .filter(|(node, _, known)| *known <= Confidence::Stated && !self.is_tool(&[*node]));
        sure.map(|(node, ..)| self.role(*node).to_owned()).collect()
    }

    /// Whether a tool rewrote the bag, so that merged publishers cannot be distinguished.
    pub(crate) fn is_rewritten(&self) -> bool {
        self.is_rewritten
    }

    /// Whether the bag names nodes reliably, so that an unnamed one is absent; `lost` expected nodes are
    /// unnamed. Rewritten bags do not: publishers are merged, or only a log remains, to which most nodes
    /// never write. ROS 2 bags name nodes that start during the recording: if more are missing than named,
    /// they ran before the recorder.
    pub(crate) fn names_nodes(&self, lost: usize) -> bool {
        let sure = |nodes: &&[NodeId]| self.is_sure(nodes) && !self.is_tool(nodes);
        let named: Vec<&[NodeId]> = self.roles().map(|(_, nodes)| nodes).filter(sure).collect();
        let any = |words: &[&str]| {
            let has_any = |id: &NodeId| has(self.mission.elements.nodes[*id].seen.evidence, words);
            named.iter().any(|nodes| nodes.iter().any(has_any))
        };
        !self.is_rewritten && (any(&NAMING) || any(&STARTING) && lost < named.len())
    }

    /// Whether ROS 1 nodes were recorded, judging by their logs.
    pub(crate) fn is_ros1(&self) -> bool {
        let mut types = self.mission.elements.topics.iter().flat_map(|t| &t.types);
        types.any(|word| &**word == "rosgraph_msgs/Log")
    }

    /// Whether the bag names all publishers of a topic.
    pub(crate) fn lists_publishers(&self, topic: TopicId) -> bool {
        let unknown = self.mission.elements.topics[topic].unknown_publishers;
        let known = self.publishers(topic);
        !self.is_rewritten
            && unknown.unwrap_or(0) == 0
            && known
                .iter()
                .any(|(.., confidence)| *confidence <= Confidence::Stated)
    }

    /// Whether the bag lists all subscribers, in general or for these nodes, so that an unlisted node is not a
    /// subscriber.
    pub(crate) fn lists_subscribers(&self, nodes: &[NodeId]) -> bool {
        self.mission.elements.subscribes.iter().any(|edge| {
            let own = nodes.contains(&edge.node) && has(edge.seen.evidence, &["links"]);
            own || has(edge.seen.evidence, &LISTING) && !self.is_tool(&[edge.node])
        })
    }

    /// The times in which any of these nodes is present; sorted, without overlaps.
    pub(crate) fn lives(&self, nodes: &[NodeId]) -> Vec<Span> {
        let mut all: Vec<Span> = Vec::new();
        for id in nodes {
            let runs = &self.mission.elements.seen(Element::Node(*id)).lives;
            if runs.is_empty() {
                all.extend(self.windows_of(*id));
            } else {
                all.extend(runs);
            }
        }
        Span::joined(all, 0)
    }

    /// The windows that contain a node, for a mission without finer times.
    fn windows_of(&self, node: NodeId) -> impl Iterator<Item = Span> + use<'a> {
        let rows = self.mission.graphs.rows(Element::Node(node));
        rows.filter_map(|(at, _)| Some(self.mission.windows.get(at)?.span))
    }

    /// The time in which a node published a topic, if known, and the number of its messages.
    pub(crate) fn sent(&self, node: NodeId, edge: EdgeId) -> Option<(Span, u64)> {
        let mission = self.mission;
        let runs = match &mission.elements.seen(Element::Publish(edge)).lives[..] {
            [] => self.lives(&[node]),
            runs => runs.to_vec(),
        };
        let span = Span::new(runs.first()?.start, runs.last()?.end);
        let rows = mission.graphs.rows(Element::Publish(edge));
        Some((span, rows.filter_map(|(_, row)| row.count).sum()))
    }

    /// Entries of the event log about any of these nodes, but not about their edges.
    pub(crate) fn events(&self, nodes: &[NodeId], kind: Kind) -> Vec<&'a Event> {
        let own = |e: &&Event| matches!(e.what, Element::Node(id) if nodes.contains(&id));
        let all = self.mission.log.events.iter().filter(own);
        all.filter(|e| e.kind == kind).collect()
    }

    /// The last known lifecycle state of a role.
    pub(crate) fn lifecycle(&self, nodes: &[NodeId]) -> Option<&'a str> {
        let graphs = &self.mission.graphs;
        let last = |node: &NodeId| {
            let rows = graphs.rows(Element::Node(*node));
            let named = rows.filter_map(|(at, row)| Some((at, *node, graphs.lifecycle(&row)?)));
            named.last()
        };
        let last = nodes.iter().filter_map(last).max();
        last.map(|(.., state)| state)
    }

    /// Whether a topic is latched; `None` if unknown.
    pub(crate) fn is_latched(&self, topic: TopicId) -> Option<bool> {
        let own = &self.mission.elements.topics[topic];
        let states = self.mission.graphs.rows(Element::Topic(topic));
        let states: BTreeSet<State> = states.map(|(_, row)| row.state).collect();
        match &own.qos {
            _ if states.contains(&State::Latched) => Some(true),
            Some(qos) => Some(qos.contains("transient_local")),
            // Without a message in the checked time it is unknown.
            None if states.contains(&State::Silent) && self.messages(topic) > 0 => Some(false),
            None => None,
        }
    }

    /// The best estimate of the time at which a role first appeared, with its bounds.
    pub(crate) fn began(&self, nodes: &[NodeId]) -> Option<Bound> {
        let first = self.lives(nodes).first()?.start;
        let started = self.events(nodes, Kind::Started);
        let event = started.into_iter().find(|e| e.time >= first);
        let is_first = |e: &&Event| e.time.since(first) < 1_000_000_000;
        Some(match event.filter(is_first) {
            Some(event) => Bound {
                time: event.time,
                earliest: event.earliest,
                latest: event.latest,
            },
            None => Bound {
                time: first,
                earliest: Stamp::MIN,
                latest: first,
            },
        })
    }

    /// The time at which a role was last present, with its bounds, if more than `closing` before the mission's end.
    pub(crate) fn ended(&self, nodes: &[NodeId], closing: i64) -> Option<Bound> {
        let time = self.lives(nodes).last()?.end;
        if self.mission.span.end.since(time) <= closing {
            return None;
        }
        let stopped = self.events(nodes, Kind::Stopped);
        let bounds = stopped.last().map(|e| (e.earliest, e.latest));
        let (earliest, latest) = bounds.unwrap_or((time, time));
        Some(Bound {
            time,
            earliest,
            latest,
        })
    }

    /// Whether a role is only known from its log: nothing else of it was recorded, and no evidence lists all nodes.
    pub(crate) fn is_logged_only(&self, nodes: &[NodeId]) -> bool {
        let elements = &self.mission.elements;
        let is_listed = |id: &NodeId| {
            let evidence = elements.nodes[*id].seen.evidence;
            has(evidence, &LISTING) || has(evidence, &STARTING) || !has(evidence, &["rosout"])
        };
        !self.is_sender(nodes) && !nodes.iter().any(is_listed)
    }

    /// Whether any of these nodes sent a message on a topic other than housekeeping.
    pub(crate) fn is_sender(&self, nodes: &[NodeId]) -> bool {
        let edges = self.mission.elements.publishes.with_ids();
        let mut own = edges.filter(|(_, e)| nodes.contains(&e.node));
        own.any(|(id, e)| {
            let rows = self.mission.graphs.rows(Element::Publish(id));
            let count: u64 = rows.filter_map(|(_, row)| row.count).sum();
            count > 0 && !self.is_housekeeping(e.topic)
        })
    }

    /// A point in time of the mission as text for people.
    pub(crate) fn clock(&self, at: Stamp) -> String {
        words::offset_seconds(self.mission.offset(at))
    }

    /// A time range of the mission as text for people.
    pub(crate) fn stretch(&self, span: Span) -> String {
        format!("{}–{}", self.clock(span.start), self.clock(span.end))
    }
}

/// The edges of each topic, except those of unnamed nodes.
fn by_topic(
    edges: &ById<EdgeId, Edge>,
    topics: &ById<TopicId, Topic>,
) -> ById<TopicId, Vec<EdgeId>> {
    let mut all = ById::like(topics, Vec::new());
    for (id, edge) in edges
        .with_ids()
        .filter(|(_, edge)| !edge.seen.evidence.is_guess())
    {
        all[edge.topic].push(id);
    }
    all
}
