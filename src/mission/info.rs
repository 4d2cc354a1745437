//! The summary of a bag: its contents, the known graph with its evidence, and missing information. In comes a mission,
//! out goes an [`Info`], as JSON or text. Begin with [`info`], which fills it; `text` writes it, `survey` has one per bag,
//! `summary` puts it into one sentence.

mod advice;
mod figure;
pub(crate) mod summary;
mod survey;
mod text;
mod why;

use std::collections::BTreeSet;

use serde::Serialize;

use advice::advice;
pub use figure::FigureInfo;
pub(crate) use figure::figures;
pub(crate) use survey::survey_table;
pub use survey::{SurveyRow, survey_text};
pub(crate) use text::how_many;
pub use text::text;
pub use why::why;

use crate::bag::Report;
use crate::base::name::is_recorder;
use crate::base::words::visible_json;
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::{Sender, Sending};
use crate::graph::{ById, Edge, EdgeId, Element, NodeId, TopicId, mean_rate};
use crate::mission::Mission;
use crate::mission::event_log::Kind;
use crate::mission::rates::Rates;

/// The output of `bagreel info` for one mission. Written as JSON with these names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// Always `bagreel.info/1`.
    pub schema: &'static str,
    /// The mission as one sentence.
    pub summary: String,
    /// The bags of the mission.
    pub bags: Vec<Report>,
    /// The first log time, ns since 1970.
    pub start_ns: i64,
    /// The last log time + 1 ns.
    pub end_ns: i64,
    /// The time from the first to the last message in seconds.
    pub duration_s: f64,
    /// The number of messages.
    pub messages: u64,
    /// The number of nodes by confidence of evidence.
    pub nodes_by_degree: ConfidenceCounts,
    /// The number of publications by confidence of evidence.
    pub publishes_by_degree: ConfidenceCounts,
    /// The number of subscriptions by confidence of evidence.
    pub subscribes_by_degree: ConfidenceCounts,
    /// The number of topics with messages and without a known publisher.
    pub topics_without_publisher: usize,
    /// The number of topics with messages and without a known subscriber, not counting the recorder.
    pub topics_without_subscriber: usize,
    /// Each kind of evidence found, with the number of elements that it supports.
    pub evidence: Vec<EvidenceInfo>,
    /// The number of changes by kind.
    pub changes: ChangeCounts,
    /// Topics, sorted by name.
    pub topics: Vec<TopicInfo>,
    /// Nodes, sorted by name.
    pub nodes: Vec<NodeInfo>,
    /// Advice on recording more information; empty if nothing is missing.
    pub advice: Vec<String>,
    /// The suitable figures for a paper, the best first.
    pub figures: Vec<FigureInfo>,
    /// Edges from source code that were not drawn, and remarks on the code; one per line.
    pub undrawn: Vec<String>,
    /// Problems that did not stop the reading.
    pub notices: Vec<String>,
}

/// The numbers of elements by their best confidence of evidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[expect(missing_docs, reason = "the names are those of `Confidence`")]
pub struct ConfidenceCounts {
    pub measured: usize,
    pub stated: usize,
    pub inferred: usize,
    pub declared: usize,
}

/// The numbers of changes in the event log, as far as they are listed separately.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ChangeCounts {
    /// All of them.
    pub all: usize,
    /// Nodes that started, topics and connections that appeared.
    pub starts: usize,
    /// Nodes that stopped, topics and connections that vanished.
    pub stops: usize,
    /// Nodes that restarted.
    pub restarts: usize,
    /// Rates that changed.
    pub rates: usize,
}

impl ChangeCounts {
    fn of(mission: &Mission) -> Self {
        let kinds = mission.log.headlines(mission.span).map(|(_, e)| e.kind);
        let kinds: Vec<Kind> = kinds.collect();
        let of = |wanted: &[Kind]| kinds.iter().filter(|kind| wanted.contains(kind)).count();
        Self {
            all: kinds.len(),
            starts: of(&[Kind::Started, Kind::Appeared]),
            stops: of(&[Kind::Stopped, Kind::Vanished]),
            restarts: of(&[Kind::Restarted]),
            rates: of(&[Kind::Rate]),
        }
    }
}

impl ConfidenceCounts {
    /// The sum of all confidences.
    pub fn total(&self) -> usize {
        self.measured + self.stated + self.inferred + self.declared
    }
}

impl FromIterator<Confidence> for ConfidenceCounts {
    fn from_iter<T: IntoIterator<Item = Confidence>>(confidences: T) -> Self {
        let mut all = Self::default();
        for confidence in confidences {
            *match confidence {
                Confidence::Measured => &mut all.measured,
                Confidence::Stated => &mut all.stated,
                Confidence::Inferred => &mut all.inferred,
                Confidence::Declared => &mut all.declared,
            } += 1;
        }
        all
    }
}

/// A kind of evidence and the number of elements that it supports.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EvidenceInfo {
    /// The source's word in JSON.
    pub source: &'static str,
    /// The number of nodes that it supports.
    pub nodes: usize,
    /// The number of publications that it supports.
    pub publishes: usize,
    /// The number of subscriptions that it supports.
    pub subscribes: usize,
}

/// A topic over the whole mission.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TopicInfo {
    /// The name.
    pub name: String,
    /// The types, sorted.
    pub types: Vec<String>,
    /// The number of messages.
    pub count: u64,
    /// Messages per second while sending: pauses are left out; `None` with fewer than two messages.
    pub hz: Option<f64>,
    /// Messages per second over the recording: from the first message to the last, pauses included; `None` with fewer than two.
    pub mean_hz: Option<f64>,
    /// The number of payload bytes, if known.
    pub bytes: Option<u64>,
    /// The publishers.
    pub publishers: Vec<String>,
    /// The known subscribers.
    pub subscribers: Vec<String>,
    /// The number of publishers that the bag counts but does not name; `None` if it does not count them.
    pub unknown_publishers: Option<u32>,
    /// Quality of service, if known.
    pub qos: Option<String>,
    /// The coefficient of variation of the rate over the parts of the mission; 0 for an even one, `None` without messages.
    pub skew: Option<f64>,
    /// The number of messages in each equal part of the mission.
    pub activity: Vec<u64>,
}

/// A node over the whole mission.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NodeInfo {
    /// The name.
    pub name: String,
    /// The word of the best confidence of evidence.
    #[serde(rename = "degree")]
    pub confidence: &'static str,
    /// The kinds of evidence for it.
    pub evidence: Vec<&'static str>,
    /// The time from which it is known to exist, as in the log; ns since 1970.
    pub first_ns: Option<i64>,
    /// The last time at which it is known to exist, as in the log; ns since 1970.
    pub last_ns: Option<i64>,
    /// The number of topics that it publishes.
    pub publishes: usize,
    /// The number of topics that it is known to subscribe to.
    pub subscribes: usize,
    /// The number of messages that it sent, if publishers are known.
    pub sent: Option<u64>,
    /// The messages that it sent per second while sending; `None` for fewer than two.
    pub sent_hz: Option<f64>,
    /// The number of messages on topics that it is known to subscribe to; `None` if there are none.
    pub received: Option<u64>,
    /// These messages per second while they were sent; `None` for fewer than two.
    pub received_hz: Option<f64>,
}

/// The summary of a mission; its windows become the parts of each topic's activity.
pub fn info(mission: &Mission) -> Info {
    let elements = &mission.elements;
    let best = mission.graphs.confidences(elements);
    let confidences = |is_kind: fn(&Element) -> bool| -> ConfidenceCounts {
        let own = best.iter().filter(|(what, _)| is_kind(what));
        let known = own.filter(|(what, _)| !elements.evidence(*what).is_guess());
        known.map(|(_, confidence)| *confidence).collect()
    };
    let rates = Rates::new(mission);
    let topics = topics(mission, &rates);
    let traffic = traffic(mission, &topics);
    let senders =
        |of: &[TopicId]| -> Vec<&Sender> { of.iter().flat_map(|id| rates.of_topic(*id)).collect() };
    let named = elements.nodes.with_ids();
    let named = named.filter(|(_, node)| !is_unnamed(node.seen.evidence));
    let nodes = named.map(|(id, node)| {
        let own = &traffic[id];
        let confidence = best.of(Element::Node(id));
        NodeInfo {
            name: node.name.to_string(),
            confidence: confidence.map_or("", |confidence| confidence.word()),
            evidence: node.seen.evidence.words().collect(),
            first_ns: node.seen.lives.first().map(|run| run.start.0),
            last_ns: node.seen.lives.last().map(|run| run.end.0 - 1),
            publishes: own.publishes,
            subscribes: own.subscribes,
            sent: own.sent,
            sent_hz: rates.while_sending(&own.sending),
            received: own.received,
            received_hz: match own.receiving[..] {
                [topic] => topics[topic].hz,
                _ => rates.while_sending(&senders(&own.receiving)),
            },
        }
    });
    let mut info = Info {
        schema: "bagreel.info/1",
        summary: String::new(),
        bags: mission.bags.clone(),
        start_ns: mission.span.start.0,
        end_ns: mission.span.end.0,
        duration_s: (mission.span.nanos() - 1).max(0) as f64 / 1e9,
        messages: mission.messages,
        nodes_by_degree: confidences(Element::is_node),
        publishes_by_degree: confidences(|what| matches!(what, Element::Publish(_))),
        subscribes_by_degree: listeners(mission)
            .filter(|(_, edge)| !edge.seen.evidence.is_guess())
            .filter_map(|(id, _)| best.of(Element::Subscribe(id)).copied())
            .collect(),
        topics_without_publisher: lacking(&topics, &mut elements.publishes.iter()),
        topics_without_subscriber: lacking(&topics, &mut listeners(mission).map(|(_, edge)| edge)),
        evidence: evidence(mission),
        changes: ChangeCounts::of(mission),
        nodes: nodes.collect(),
        topics: topics.into_iter().collect(),
        advice: Vec::new(),
        figures: figures(mission),
        undrawn: mission.undrawn.clone(),
        notices: mission.notices.iter().map(|n| n.text).collect(),
    };
    info.summary = summary::summary(mission, &info);
    info.advice = advice(&info, is_ros1(mission));
    info
}

/// Whether the bags are from ROS 1, in any format; `None` for a mission that was not recorded.
pub(crate) fn is_ros1(mission: &Mission) -> Option<bool> {
    let bag = mission.bags.first()?;
    let mut facts = bag.facts.iter();
    let profile = facts.any(|(key, value)| key == "profile" && value == "ros1");
    Some(bag.format == "rosbag1" || profile)
}

/// Any part of this module as JSON, ending in a new line.
pub fn json(value: &impl Serialize) -> String {
    // Only maps with keys that are not strings fail, and there are none.
    let json = serde_json::to_string_pretty(value).unwrap_or_default();
    visible_json(&json).into_owned() + "\n"
}

/// The name of the evidence for unnamed publishers, which the summary counts per topic.
const UNNAMED: &str = "unknown";

fn is_unnamed(evidence: Evidence) -> bool {
    evidence == Evidence::of(UNNAMED)
}

/// Subscriptions with their ids, without those of the recorder, which is not part of the robot.
fn listeners(mission: &Mission) -> impl Iterator<Item = (EdgeId, &Edge)> {
    let elements = &mission.elements;
    let is_recorder = |edge: &Edge| {
        let node = &elements.nodes[edge.node];
        is_recorder(node.name.as_str()) || node.seen.evidence.has("recorder")
    };
    let edges = elements.subscribes.with_ids();
    edges.filter(move |(_, edge)| !is_recorder(edge))
}

/// The number of topics with messages but none of these edges.
fn lacking(topics: &ById<TopicId, TopicInfo>, edges: &mut dyn Iterator<Item = &Edge>) -> usize {
    let known = edges.filter(|edge| !edge.seen.evidence.is_guess());
    let known: BTreeSet<TopicId> = known.map(|edge| edge.topic).collect();
    let with_messages = topics.with_ids().filter(|(_, t)| t.count > 0);
    with_messages.filter(|(id, _)| !known.contains(id)).count()
}

/// The numbers of edges and messages of one node, and the senders of its messages, in and out, that have rates.
#[derive(Clone, Default)]
struct NodeTraffic<'a> {
    publishes: usize,
    subscribes: usize,
    /// The number of messages sent; `None` where not known.
    sent: Option<u64>,
    sending: Vec<&'a Sender>,
    /// The number of messages received; `None` for a node without subscriptions.
    received: Option<u64>,
    receiving: Vec<TopicId>,
}

/// The traffic of every node, computed in one pass over the edges.
fn traffic<'a>(
    mission: &'a Mission,
    topics: &ById<TopicId, TopicInfo>,
) -> ById<NodeId, NodeTraffic<'a>> {
    let elements = &mission.elements;
    let mut traffic = ById::like(&elements.nodes, NodeTraffic::default());
    for edge in &elements.publishes {
        traffic[edge.node].publishes += 1;
    }
    for (_, edge) in listeners(mission) {
        let own = &mut traffic[edge.node];
        own.subscribes += 1;
        *own.received.get_or_insert(0) += topics[edge.topic].count;
        own.receiving.push(edge.topic);
    }
    let senders = mission.sending.senders.iter();
    for sender in senders.filter(|sender| !sender.is_latched) {
        if let Some(node) = sender.node {
            traffic[node].sending.push(sender);
        }
    }
    for (id, edge) in elements.publishes.with_ids() {
        let rows = mission.graphs.rows(Element::Publish(id));
        for count in rows.filter_map(|(_, row)| row.count) {
            *traffic[edge.node].sent.get_or_insert(0) += count;
        }
    }
    traffic
}

fn topics(mission: &Mission, rates: &Rates<'_>) -> ById<TopicId, TopicInfo> {
    let elements = &mission.elements;
    let all = elements.topics.iter().zip(mission.skews());
    let mut topics: ById<TopicId, TopicInfo> = all
        .map(|(topic, skew)| TopicInfo {
            name: topic.name.to_string(),
            types: topic.types.iter().map(ToString::to_string).collect(),
            unknown_publishers: topic.unknown_publishers,
            qos: topic.qos.as_deref().map(str::to_owned),
            skew,
            activity: vec![0; mission.graphs.len()],
            ..TopicInfo::default()
        })
        .collect();
    for (topic, id) in topics.iter_mut().zip(elements.topics.ids()) {
        for (window, row) in mission.graphs.rows(Element::Topic(id)) {
            let count = row.count.unwrap_or(0);
            topic.count += count;
            if let Some(bytes) = row.bytes {
                *topic.bytes.get_or_insert(0) += bytes;
            }
            topic.activity[window] = count;
        }
        let bounds = Sending::bounds(mission.sending.of_topic(id).iter());
        topic.hz = rates.while_sending(&rates.of_topic(id));
        topic.mean_hz = bounds.and_then(|bounds| mean_rate(topic.count, bounds));
    }
    let name = |node: NodeId| elements.nodes[node].name.to_string();
    let named = elements.publishes.iter();
    for edge in named.filter(|e| !is_unnamed(e.seen.evidence)) {
        topics[edge.topic].publishers.push(name(edge.node));
    }
    for (_, edge) in listeners(mission) {
        topics[edge.topic].subscribers.push(name(edge.node));
    }
    topics
}

fn evidence(mission: &Mission) -> Vec<EvidenceInfo> {
    let elements = &mission.elements;
    let rows = Evidence::all_words().map(|source| {
        let nodes = elements.nodes.iter();
        let has = |edge: &Edge| edge.seen.evidence.has(source);
        EvidenceInfo {
            source,
            nodes: nodes.filter(|n| n.seen.evidence.has(source)).count(),
            publishes: elements.publishes.iter().filter(|e| has(e)).count(),
            subscribes: listeners(mission).filter(|(_, e)| has(e)).count(),
        }
    });
    rows.filter(|row| row.nodes + row.publishes + row.subscribes > 0 && row.source != UNNAMED)
        .collect()
}
