//! `/rosgraph` of graph-monitor: the whole graph of ROS 2 over time, each message a snapshot.
//!
//! Its definition has moved and grown (`rosgraph_monitor_msgs`, then `rosgraph_msgs`), so a message is parsed by the
//! definition in the bag, or by the built-in one that it fits exactly.

use super::SourceContext;
use crate::bag::Encoding;
use crate::evidence::claim::{Claim, Degree, Statement};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::definition::MessageLayout;
use crate::evidence::message::dynamic::{MessageSchema, MessageValue};

/// `rosgraph_msgs/msg/Graph`.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "rosgraph_msgs/Graph",
    md5: "",
    encoding: Encoding::Cdr,
    fields: &[],
};

/// `rosgraph_monitor_msgs/msg/Graph`.
pub(crate) const OLD_SHAPE: MessageLayout = MessageLayout {
    type_name: "rosgraph_monitor_msgs/Graph",
    ..SHAPE
};

const QOS: &str = "uint32 depth;Duration deadline;Duration lifespan;byte history;byte reliability;byte durability;\
                   byte liveliness;Duration liveliness_lease_duration";
const DESCRIPTOR: &str = "string name;byte type;string description;string additional_constraints;byte read_only;\
                          byte dynamic_typing;FloatingPointRange[] floating_point_range;IntegerRange[] integer_range";
const VALUE: &str = "byte type;byte bool_value;int64 integer_value;float64 double_value;string string_value;\
                     byte[] byte_array_value;byte[] bool_array_value;int64[] integer_array_value;\
                     float64[] double_array_value;string[] string_array_value";
const INTERFACE: &str = "string name;TypeHash hash";
const NODE: &str = "string name;Topic[] publishers;Topic[] subscriptions;ParameterDescriptor[] parameters;\
                    ParameterValue[] parameter_values";
const NODE_2026: &str = "ParameterDescriptor[] parameters;Topic[] publishers;Topic[] subscriptions;\
                         Service[] service_clients;Service[] service_servers;Action[] action_clients;\
                         Action[] action_servers;string name;ParameterValue[] parameter_values";

/// The definitions of `rosgraph_msgs` (2026) and of `rosgraph_monitor_msgs` 0.2 and 0.1.
const KNOWN: [&[(&str, &str)]; 3] = [
    &[
        ("", "Node[] nodes"),
        ("Node", NODE_2026),
        ("Topic", "string name;InterfaceType type;QoSProfile qos"),
        (
            "Service",
            "string name;InterfaceType request_type;InterfaceType response_type",
        ),
        (
            "Action",
            "string name;InterfaceType request_type;InterfaceType response_type;InterfaceType feedback_type",
        ),
        ("InterfaceType", INTERFACE),
        ("TypeHash", "byte version;byte[32] value"),
        ("QoSProfile", QOS),
        ("ParameterDescriptor", DESCRIPTOR),
        (
            "FloatingPointRange",
            "float64 from_value;float64 to_value;float64 step",
        ),
        (
            "IntegerRange",
            "int64 from_value;int64 to_value;uint64 step",
        ),
        ("ParameterValue", VALUE),
    ],
    &[
        ("", "Time timestamp;NodeInfo[] nodes"),
        ("NodeInfo", NODE),
        ("Topic", "string name;string type;QosProfile qos"),
        ("QosProfile", QOS),
        ("ParameterDescriptor", DESCRIPTOR),
        (
            "FloatingPointRange",
            "float64 from_value;float64 to_value;float64 step",
        ),
        (
            "IntegerRange",
            "int64 from_value;int64 to_value;uint64 step",
        ),
        ("ParameterValue", VALUE),
    ],
    &[
        ("", "Time timestamp;NodeInfo[] nodes"),
        ("NodeInfo", NODE),
        ("Topic", "string name;QosProfile qos;string type"),
        ("QosProfile", QOS),
        ("ParameterDescriptor", DESCRIPTOR),
        (
            "FloatingPointRange",
            "float64 from_value;float64 to_value;float64 step",
        ),
        (
            "IntegerRange",
            "int64 from_value;int64 to_value;uint64 step",
        ),
        ("ParameterValue", VALUE),
    ],
];

pub(crate) fn read(
    heard: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let definition = heard.stream.connection.definition.clone();
    let graph = match definition.as_deref() {
        Some(text) if text.contains("nodes") && !text.contains("struct ") => {
            MessageSchema::of_text(text).read(payload)?
        }
        _ => guess(payload)?,
    };
    let topic = heard.stream.connection.topic.shared();
    let group = heard.name(&format!("snapshot {topic}"));
    let now = |claim| Statement {
        claim,
        degree: Degree::Stated,
        snapshot: Some(group),
    };
    for node in graph.list("nodes") {
        let name = node.text("name");
        if name.is_empty() {
            continue;
        }
        let id = heard.name(name);
        heard.say(now(Claim::Node(id)), || format!("{name} is in the graph"));
        for end in node.list("publishers") {
            let (of, kind) = endpoint(heard, end);
            heard.say(now(Claim::Publish(id, of)), || {
                format!("{name} publishes {}", end.text("name"))
            });
            heard.say(now(Claim::Type(of, kind)), String::new);
        }
        for end in node.list("subscriptions") {
            let (of, kind) = endpoint(heard, end);
            heard.say(now(Claim::Subscribe(id, of)), || {
                format!("{name} subscribes to {}", end.text("name"))
            });
            heard.say(now(Claim::Type(of, kind)), String::new);
        }
    }
    heard.claim(Claim::Snapshot(group), Degree::Stated, String::new);
    Ok(())
}

/// The topic of an endpoint, and its type.
fn endpoint(
    heard: &mut SourceContext<'_>,
    end: &MessageValue,
) -> (crate::evidence::claim::Name, crate::evidence::claim::Name) {
    let kind = match end.field("type") {
        Some(MessageValue::Text(kind)) => kind,
        Some(interface) => interface.text("name"),
        None => "",
    };
    let kind = heard.name(kind);
    (heard.name(end.text("name")), kind)
}

/// The graph, parsed by the first definition that uses the payload up exactly.
fn guess(payload: &mut PayloadCursor<'_>) -> cursor::PayloadResult<MessageValue> {
    let fits = |fields: &&[(&str, &str)]| {
        MessageSchema::of_fields(fields)
            .read(&mut payload.clone())
            .ok()
    };
    KNOWN.iter().find_map(fits).ok_or(payload.wrong("a graph"))
}
