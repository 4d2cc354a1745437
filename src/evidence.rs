//! Evidence of who publishes and subscribes to what: a row per kind in [`SOURCES`], read and concluded in `source/`.
//!
//! In: the messages of bags, what the user gives (`given`) and source code (`code`). Out: [`conclude::Findings`], the
//! inferences about every node, topic and edge. Begin with `collector`, which makes observations of messages, then
//! `conclude`, which makes inferences of these.
//!
//! A source reads messages whose layout it knows, or the announcement of a connection, or draws conclusions
//! from the whole mission; its findings are observations.

pub(crate) mod clock;
#[cfg(feature = "source")]
pub mod code;
pub mod collector;
pub mod conclude;
pub mod given;
pub(crate) mod inference;
pub(crate) mod message;
pub(crate) mod numbers;
pub(crate) mod observation;
pub(crate) mod publishers;
pub(crate) mod source;
pub(crate) mod spread;
#[cfg(feature = "source")]
pub(crate) mod syntax;
pub(crate) mod times;
pub(crate) mod unknown;

pub use observation::{Confidence, EvidenceLine};
pub use source::Source;

use message::dynamic;
use serde::{Deserialize, Serialize};
use source::Read::{Log, Parameters, Payload};
use source::{
    NOTHING, action, connection, contract, conventions, diagnostics, echo, equal_stamps, events,
    log_text, payload, recorder, rosgraph, rosout, sim_time, statistics,
};

/// A set of kinds of evidence: bits at the indices of rows in [`SOURCES`].
#[derive(
    Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize,
)]
#[serde(from = "Vec<String>", into = "Vec<&'static str>")]
pub struct Evidence(u64);

/// In JSON: the words; unknown ones are ignored.
impl From<Vec<String>> for Evidence {
    fn from(words: Vec<String>) -> Self {
        let all = words.iter().map(|word| Self::of(word));
        all.fold(Self::NONE, Self::and)
    }
}

impl From<Evidence> for Vec<&'static str> {
    fn from(evidence: Evidence) -> Self {
        evidence.words().collect()
    }
}

impl Evidence {
    /// No evidence.
    pub const NONE: Self = Self(0);

    /// The set of the source with this word; empty for an unknown word.
    pub fn of(word: &str) -> Self {
        SOURCES
            .iter()
            .position(|s| s.word == word)
            .map_or(Self::NONE, Self::row)
    }

    /// The set of the source in this row.
    pub(crate) fn row(source: observation::SourceId) -> Self {
        let bit = u32::try_from(source).unwrap_or(u32::MAX);
        Self(1_u64.checked_shl(bit).unwrap_or(0))
    }

    /// The union of both sets.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of it is evidence without times: source code, launch files, and stand-ins for nodes without a name.
    pub fn is_timeless(self) -> bool {
        self.is_within(&["source", "source_only", "launch", "unknown", "owned_type"])
    }

    /// Whether all of it is evidence of stand-ins for nodes that the bag does not name.
    pub fn is_guess(self) -> bool {
        self.is_within(&["source_only", "unknown", "owned_type"])
    }

    /// Whether the set is not empty and has only these kinds.
    fn is_within(self, words: &[&str]) -> bool {
        let all = words.iter().map(|word| Self::of(word));
        let all = all.fold(Self::NONE, Self::and);
        !self.is_empty() && self.0 & !all.0 == 0
    }

    /// Whether the set is empty.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the set has the kind with this word.
    pub fn has(self, word: &str) -> bool {
        self.0 & Self::of(word).0 != 0
    }

    /// The words of all kinds, in the order of [`SOURCES`].
    pub fn all_words() -> impl Iterator<Item = &'static str> {
        SOURCES.iter().map(|source| source.word)
    }

    /// A description of each kind in the set, in a line of plain words, in the order of [`SOURCES`].
    pub(crate) fn lines(self) -> impl Iterator<Item = String> {
        let line = |source: &Source| format!("{}: {}", source.word, source.about.replace('`', ""));
        self.rows().map(line)
    }

    /// The words of the set, in the order of [`SOURCES`].
    pub fn words(self) -> impl Iterator<Item = &'static str> {
        self.rows().map(|source| source.word)
    }

    /// The rows of the set.
    fn rows(self) -> impl Iterator<Item = &'static Source> {
        let rows = SOURCES.iter().enumerate();
        let rows = rows.filter(move |(at, _)| self.0 >> at & 1 == 1);
        rows.map(|(_, source)| source)
    }
}

/// The row of the source with this word.
pub(crate) fn source_id(word: &str) -> observation::SourceId {
    SOURCES.iter().position(|s| s.word == word).unwrap_or(0)
}

/// The word of the source in this row.
pub(crate) fn source_word(row: observation::SourceId) -> &'static str {
    SOURCES.get(row).map_or("", |s| s.word)
}

/// Rows of [`SOURCES`]: a word, a description, and what differs from [`NOTHING`].
macro_rules! sources {
    ($($word:literal $about:literal { $($field:ident: $value:expr),* })*) => {
        &[$(Source { word: $word, about: $about, $($field: $value,)* ..NOTHING }),*]
    };
}

/// All kinds of evidence; a set of them ([`Evidence`]) has at most 64 members.
pub const SOURCES: &[Source] = sources! {
    "connection" "ROS 1 connection headers and MCAP channel metadata (`callerid`)"
        { conclude: &[connection::conclude] }
    "statistics" "`/statistics` of ROS 1 (`rosgraph_msgs/TopicStatistics`)"
        { reads: &[(&[statistics::SHAPE], Payload(statistics::read))] }
    "topic_statistics" "`/topic_statistics` of graph-monitor (`rosgraph_monitor_msgs/msg/TopicStatistics`)"
        { reads: &[(&[statistics::MONITOR], Payload(statistics::read_monitor))] }
    "rosgraph" "`/rosgraph` of graph-monitor (`rosgraph_msgs/msg/Graph`, `rosgraph_monitor_msgs/msg/Graph`), and single nodes of nodl (`rosgraph_msgs/msg/Node`)"
        { reads: &[(&[rosgraph::SHAPE, rosgraph::OLD_SHAPE], Payload(rosgraph::read)),
                   (&[rosgraph::NODE_SHAPE], Payload(rosgraph::read_node))],
          holds: true,
          conclude: &[rosgraph::conclude] }
    "discovery" "`ros_discovery_info` (`rmw_dds_common/msg/ParticipantEntitiesInfo`)"
        { reads: &[(&[rosgraph::PARTICIPANT], Payload(rosgraph::read_participant))] }
    "lifecycle" "`<node>/transition_event` (`lifecycle_msgs/msg/TransitionEvent`)"
        { reads: &[(&[events::TRANSITION], Payload(events::read_transition))], own: true }
    "service_event" "`<service>/_service_event` of service introspection"
        { reads: &[(&[events::SERVICE_EVENT], Payload(events::read_service))] }
    "qos" "offered quality of service in ROS 2 recordings"
        { conclude: &[connection::conclude_offers] }
    "parameter_events" "`rcl_interfaces/msg/ParameterEvent`"
        { reads: &[(&[events::PARAMETER_EVENT], Parameters(events::read_node))] }
    "qos_overrides" "`qos_overrides.<topic>` in parameter events, which rclcpp declares with each end"
        { reads: &[(&[events::PARAMETER_EVENT], Parameters(events::read_overrides))] }
    "sim_time" "`use_sim_time` in parameter events, in ROS 1 stamps in the time of `/clock`: such a node subscribes to it"
        { reads: &[(&[events::PARAMETER_EVENT], Parameters(sim_time::read_parameters)), (&[sim_time::CLOCK], Payload(sim_time::read_clock))],
          conclude: &[sim_time::conclude],
          own: true }
    "links" "log records of roscpp about its connections, and of recorders about the topics they find"
        { reads: &[(dynamic::LOGS, Log(log_text::read_links))], conclude: &[log_text::conclude_births, log_text::conclude_connected] }
    "diagnostics" "statuses are named after their nodes; the publisher of `/diagnostics_agg` subscribes to `/diagnostics`"
        { reads: &[(&[diagnostics::SHAPE], Payload(diagnostics::read))], conclude: &[diagnostics::conclude] }
    "rosout" "log records of ROS 1 (`rosgraph_msgs/Log`) and ROS 2 (`rcl_interfaces/msg/Log`)"
        { reads: &[(dynamic::ROS1_LOGS, Log(rosout::read)), (&[dynamic::LOG2], Log(rosout::read_ros2))],
          conclude: &[rosout::conclude, rosout::conclude_ros2],
          own: true }
    "log_text" "log messages in which a node names one of its topics"
        { reads: &[(dynamic::LOGS, Log(log_text::read))], conclude: &[log_text::conclude] }
    "duplicate" "log texts about two nodes of one name"
        { reads: &[(dynamic::LOGS, Log(log_text::read_duplicates))], conclude: &[log_text::conclude_duplicates] }
    "messages_lost" "`/events/rosbag2_messages_lost`: messages that the recorder lost (`rosbag2_interfaces/msg/MessagesLostEvent`)"
        { reads: &[(&[recorder::LOST], Payload(recorder::read_lost))], conclude: &[recorder::conclude_lost] }
    "metrics" "`/statistics` of ROS 2 (`statistics_msgs/msg/MetricsMessage`)"
        { reads: &[(&[statistics::METRICS], Payload(statistics::read_metrics))],
          conclude: &[statistics::conclude_metrics],
          own: true }
    "dynamic_reconfigure" "`<node>/parameter_descriptions` and `<node>/parameter_updates` of ROS 1 belong to one node"
        { conclude: &[conventions::dynamic_reconfigure] }
    "private_name" "a topic in a node's private namespace with no other publisher"
        { conclude: &[conventions::private_name] }
    "action" "an action's server publishes status, feedback and result and subscribes to goal and cancel; its client does the reverse"
        { reads: &[(&[action::SHAPE], Payload(action::read))], conclude: &[action::conclude] }
    "bond" "both ends of a bond (`bond/Status`) publish and subscribe to its topic"
        { conclude: &[conventions::bond] }
    "echo" "log messages that quote a recorded message"
        { reads: &[(dynamic::LOGS, Log(echo::read))], conclude: &[echo::conclude] }
    "contract" "well-known nodes, by name and source file: their topics of the right type"
        { reads: &[(dynamic::LOGS, Log(contract::read))], conclude: &[contract::conclude] }
    "beside" "log messages that come with the messages of one topic"
        { conclude: &[echo::conclude_beside] }
    "found" "a topic that the recorder finds while a single node starts"
        { conclude: &[log_text::conclude_found] }
    "only_publisher" "messages without a publisher, of topics with one known publisher"
        { conclude: &[conventions::only_publisher] }
    "payload" "messages forwarded byte by byte from input to output"
        { conclude: &[payload::conclude, payload::conclude_selected] }
    "equal_stamps" "header stamps copied from input to output (with `--infer stamps`)"
        { conclude: &[equal_stamps::conclude] }
    "tf_pair" "a subscriber of `/tf` also subscribes to `/tf_static`, and vice versa"
        { conclude: &[conventions::tf_pair] }
    "sister" "a node whose twin in another namespace publishes the same and subscribes to more"
        { conclude: &[conventions::sister] }
    "anonymous" "the start inside an anonymous name (`_PID_MILLISECONDS`, `_NANOSECONDS`)"
        { conclude: &[conventions::anonymous] }
    "recorder" "the recorder subscribes to everything it records; its log records name its source file"
        { reads: &[(dynamic::LOGS, Log(recorder::read))], conclude: &[recorder::conclude] }
    "rosout_rule" "every node of ROS 1 publishes `/rosout`; the node `/rosout` forwards it to `/rosout_agg`"
        { conclude: &[rosout::conclude_rule] }
    "topology" "your file of nodes and edges (CSV, YAML, DOT)" {}
    "launch" "your launch file, which declares nodes; Python is parsed and never executed" {}
    "source" "your source code: what it declares for nodes in the bag (with `--source`)" {}
    "source_only" "your source code: the only matching place for a node (with `--infer source`)" {}
    "unknown" "publishers that a ROS 2 recording counts but does not name" {}
    "owned_type" "an unnamed publisher of a type that only one well-known program publishes" {}
};
