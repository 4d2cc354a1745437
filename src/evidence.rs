//! Evidence of who publishes and subscribes to what: one file per kind of evidence in `source/`, one row each in [`SOURCES`].
//!
//! A source reads messages whose layout it knows, or the announcement of a connection, or draws conclusions
//! from the whole mission; its findings are observations.

pub(crate) mod clock;
#[cfg(feature = "source")]
pub mod code;
pub mod collector;
pub mod conclude;
pub(crate) mod given;
pub(crate) mod inference;
mod kinds;
pub(crate) mod message;
pub(crate) mod numbers;
pub(crate) mod observation;
pub(crate) mod offsets;
pub(crate) mod publishers;
pub(crate) mod source;
pub(crate) mod spread;
#[cfg(feature = "source")]
pub(crate) mod syntax;
pub(crate) mod texts;
pub(crate) mod times;
pub mod topology;
pub(crate) mod unknown;
pub(crate) mod values;

pub use kinds::Evidence;
pub use observation::{Confidence, EvidenceLine};
pub use source::Source;

use message::{definition, parameters};
use source::Read::{Log, Parameters, Payload};
use source::{
    NOTHING, action, anonymous, bond, connection, contract, diagnostics, discovery, duplicate,
    dynamic_reconfigure, echo, equal_stamps, lifecycle, links, log_text, messages_lost, metrics,
    only_publisher, parameter_events, payload, private_name, qos, qos_overrides, recorder,
    rosgraph, rosout, rosout_ros2, rosout_rule, selected, service_event, sim_time, sister,
    statistics, tf_pair, topic_statistics,
};

/// The row of the source with this word.
pub(crate) fn source_id(word: &str) -> observation::SourceId {
    SOURCES.iter().position(|s| s.word == word).unwrap_or(0)
}

/// The word of the source in this row.
pub(crate) fn source_word(row: observation::SourceId) -> &'static str {
    SOURCES.get(row).map_or("", |s| s.word)
}

/// All kinds of evidence; a set of them ([`Evidence`]) has at most 64 members.
pub const SOURCES: &[Source] = &[
    Source {
        word: "connection",
        about: "ROS 1 connection headers and MCAP channel metadata (`callerid`)",
        conclude: &[connection::conclude],
        ..NOTHING
    },
    Source {
        word: "statistics",
        about: "`/statistics` of ROS 1 (`rosgraph_msgs/TopicStatistics`)",
        reads: &[(&[statistics::SHAPE], Payload(statistics::read))],
        ..NOTHING
    },
    Source {
        word: "topic_statistics",
        about: "`/topic_statistics` of graph-monitor (`rosgraph_monitor_msgs/msg/TopicStatistics`)",
        reads: &[(&[topic_statistics::SHAPE], Payload(topic_statistics::read))],
        ..NOTHING
    },
    Source {
        word: "rosgraph",
        about: "`/rosgraph` of graph-monitor (`rosgraph_msgs/msg/Graph`, `rosgraph_monitor_msgs/msg/Graph`), and single nodes of nodl (`rosgraph_msgs/msg/Node`)",
        reads: &[
            (
                &[rosgraph::SHAPE, rosgraph::OLD_SHAPE],
                Payload(rosgraph::read),
            ),
            (&[rosgraph::NODE_SHAPE], Payload(rosgraph::read_node)),
        ],
        holds: true,
        conclude: &[rosgraph::conclude],
        ..NOTHING
    },
    Source {
        word: "discovery",
        about: "`ros_discovery_info` (`rmw_dds_common/msg/ParticipantEntitiesInfo`)",
        reads: &[(&[discovery::SHAPE], Payload(discovery::read))],
        ..NOTHING
    },
    Source {
        word: "lifecycle",
        about: "`<node>/transition_event` (`lifecycle_msgs/msg/TransitionEvent`)",
        reads: &[(&[lifecycle::SHAPE], Payload(lifecycle::read))],
        own: true,
        ..NOTHING
    },
    Source {
        word: "service_event",
        about: "`<service>/_service_event` of service introspection",
        reads: &[(&[service_event::SHAPE], Payload(service_event::read))],
        ..NOTHING
    },
    Source {
        word: "qos",
        about: "offered quality of service in ROS 2 recordings",
        announced: Some(qos::announced),
        conclude: &[qos::conclude],
        ..NOTHING
    },
    Source {
        word: "parameter_events",
        about: "`rcl_interfaces/msg/ParameterEvent`",
        reads: &[(&[parameters::SHAPE], Parameters(parameter_events::read))],
        ..NOTHING
    },
    Source {
        word: "qos_overrides",
        about: "`qos_overrides.<topic>` in parameter events, which rclcpp declares with each end",
        reads: &[(&[parameters::SHAPE], Parameters(qos_overrides::read))],
        ..NOTHING
    },
    Source {
        word: "sim_time",
        about: "`use_sim_time` in parameter events: such a node subscribes to `/clock`",
        reads: &[(&[parameters::SHAPE], Parameters(sim_time::read))],
        own: true,
        ..NOTHING
    },
    Source {
        word: "links",
        about: "log records of roscpp about its connections",
        reads: &[(definition::ROS1_LOGS, Log(links::read))],
        ..NOTHING
    },
    Source {
        word: "diagnostics",
        about: "statuses are named after their nodes; the publisher of `/diagnostics_agg` subscribes to `/diagnostics`",
        reads: &[(&[diagnostics::SHAPE], Payload(diagnostics::read))],
        conclude: &[diagnostics::conclude],
        ..NOTHING
    },
    Source {
        word: "rosout",
        about: "log records of ROS 1 (`rosgraph_msgs/Log`) and ROS 2 (`rcl_interfaces/msg/Log`)",
        reads: &[
            (definition::ROS1_LOGS, Log(rosout::read)),
            (&[definition::LOG2], Log(rosout_ros2::read)),
        ],
        conclude: &[rosout::conclude, rosout_ros2::conclude],
        own: true,
        ..NOTHING
    },
    Source {
        word: "log_text",
        about: "log messages in which a node names one of its topics",
        reads: &[(definition::LOGS, Log(log_text::read))],
        conclude: &[log_text::conclude],
        ..NOTHING
    },
    Source {
        word: "duplicate",
        about: "log texts about two nodes of one name",
        reads: &[(definition::LOGS, Log(duplicate::read))],
        conclude: &[duplicate::conclude],
        ..NOTHING
    },
    Source {
        word: "messages_lost",
        about: "`/events/rosbag2_messages_lost`: messages that the recorder lost (`rosbag2_interfaces/msg/MessagesLostEvent`)",
        reads: &[(&[messages_lost::SHAPE], Payload(messages_lost::read))],
        conclude: &[messages_lost::conclude],
        ..NOTHING
    },
    Source {
        word: "metrics",
        about: "`/statistics` of ROS 2 (`statistics_msgs/msg/MetricsMessage`)",
        reads: &[(&[metrics::SHAPE], Payload(metrics::read))],
        conclude: &[metrics::conclude],
        own: true,
        ..NOTHING
    },
    Source {
        word: "dynamic_reconfigure",
        about: "`<node>/parameter_descriptions` and `<node>/parameter_updates` of ROS 1 belong to one node",
        conclude: &[dynamic_reconfigure::conclude],
        ..NOTHING
    },
    Source {
        word: "private_name",
        about: "a topic in a node's private namespace with no other publisher",
        conclude: &[private_name::conclude],
        ..NOTHING
    },
    Source {
        word: "action",
        about: "an action's server publishes status, feedback and result and subscribes to goal and cancel; its client does the reverse",
        reads: &[(&[action::SHAPE], Payload(action::read))],
        conclude: &[action::conclude],
        ..NOTHING
    },
    Source {
        word: "bond",
        about: "both ends of a bond (`bond/Status`) publish and subscribe to its topic",
        conclude: &[bond::conclude],
        ..NOTHING
    },
    Source {
        word: "echo",
        about: "log messages that quote a recorded message",
        reads: &[(definition::LOGS, Log(echo::read))],
        conclude: &[echo::conclude],
        ..NOTHING
    },
    Source {
        word: "contract",
        about: "well-known nodes, by name and source file: their topics of the right type",
        reads: &[(definition::LOGS, Log(contract::read))],
        conclude: &[contract::conclude],
        ..NOTHING
    },
    Source {
        word: "only_publisher",
        about: "messages without a publisher, of topics with one known publisher",
        conclude: &[only_publisher::conclude],
        ..NOTHING
    },
    Source {
        word: "payload",
        about: "messages forwarded byte by byte from input to output",
        conclude: &[payload::conclude, selected::conclude],
        ..NOTHING
    },
    Source {
        word: "equal_stamps",
        about: "header stamps copied from input to output (with `--infer stamps`)",
        conclude: &[equal_stamps::conclude],
        ..NOTHING
    },
    Source {
        word: "tf_pair",
        about: "a subscriber of `/tf` also subscribes to `/tf_static`, and vice versa",
        conclude: &[tf_pair::conclude],
        ..NOTHING
    },
    Source {
        word: "sister",
        about: "a node whose twin in another namespace publishes the same and subscribes to more",
        conclude: &[sister::conclude],
        ..NOTHING
    },
    Source {
        word: "anonymous",
        about: "the start inside an anonymous name (`_PID_MILLISECONDS`, `_NANOSECONDS`)",
        conclude: &[anonymous::conclude],
        ..NOTHING
    },
    Source {
        word: "recorder",
        about: "the recorder subscribes to everything it records; its log records name its source file",
        reads: &[(definition::LOGS, Log(recorder::read))],
        conclude: &[recorder::conclude],
        ..NOTHING
    },
    Source {
        word: "rosout_rule",
        about: "every node of ROS 1 publishes `/rosout`; the node `/rosout` forwards it to `/rosout_agg`",
        conclude: &[rosout_rule::conclude],
        ..NOTHING
    },
    Source {
        word: "topology",
        about: "your file of nodes and edges (CSV, YAML, DOT)",
        ..NOTHING
    },
    Source {
        word: "launch",
        about: "your launch file, which declares nodes; Python is parsed and never executed",
        ..NOTHING
    },
    Source {
        word: "source",
        about: "your source code: what it declares for nodes in the bag (with `--source`)",
        ..NOTHING
    },
    Source {
        word: "source_only",
        about: "your source code: the only matching place for a node (with `--infer source`)",
        ..NOTHING
    },
    Source {
        word: "unknown",
        about: "publishers that a ROS 2 recording counts but does not name",
        ..NOTHING
    },
    Source {
        word: "owned_type",
        about: "an unnamed publisher of a type that only one well-known program publishes",
        ..NOTHING
    },
];
