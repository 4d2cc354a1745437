//! Snapshots of the graph of ROS 2: `/rosgraph` of graph-monitor, each message a whole graph, `/nodl/observed_node` of nodl, each
//! message one node, and `ros_discovery_info` of DDS, each message one participant.
//!
//! The definitions have moved and grown (`rosgraph_monitor_msgs`, then `rosgraph_msgs`, twice), so a message
//! is parsed by the definition in the bag, or by the built-in one that it matches exactly.

use std::borrow::Cow;
use std::collections::BTreeSet;

use super::SourceContext;
use crate::base::digest::hex_of;
use crate::evidence::inference::{Conclusions, ElementKey, IncidentKind, verb};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::{MessageLayout, MessageSchema, MessageValue};
use crate::evidence::observation::{Name, Observation};

/// `rosgraph_msgs/msg/Graph`.
pub(crate) const SHAPE: MessageLayout = MessageLayout::ros2("rosgraph_msgs/Graph", "");

/// `rosgraph_monitor_msgs/msg/Graph`.
pub(crate) const OLD_SHAPE: MessageLayout = MessageLayout::ros2("rosgraph_monitor_msgs/Graph", "");

/// `rosgraph_msgs/msg/Node`.
pub(crate) const NODE_SHAPE: MessageLayout = MessageLayout::ros2("rosgraph_msgs/Node", "");

/// The definition of a graph in the core interfaces, whose types are those of the other forms unless they differ:
/// <https://github.com/ros2/rcl_interfaces/tree/rolling/rosgraph_msgs/msg>.
const DEFINITION: &str = include_str!("rosgraph.msg");

/// The types of each form, the newest first: of the core interfaces, of nodl, and two of graph-monitor.
const FORMS: [&str; 4] = [
    DEFINITION,
    include_str!("rosgraph_2026.msg"),
    include_str!("rosgraph_monitor.msg"),
    include_str!("rosgraph_monitor_first.msg"),
];

/// Reads a snapshot of the whole graph.
pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let graph = parsed(context, payload, "", "nodes")?;
    snapshot(context, graph.list("nodes"), "");
    Ok(())
}

/// Reads a snapshot of one node.
pub(crate) fn read_node(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let node = parsed(context, payload, "Node", "publishers")?;
    let name = node.text("name").to_owned();
    snapshot(context, &[node], &name);
    Ok(())
}

/// A graph, or the message of a graph with this name, by the definition in the bag or the first form that consumes the payload,
/// preferably exactly.
fn parsed(
    context: &SourceContext<'_>,
    payload: &PayloadCursor<'_>,
    name: &str,
    field: &str,
) -> cursor::PayloadResult<MessageValue> {
    let connection = &context.stream.connection;
    let text = connection.definition.as_deref();
    // Some writers list the outermost fields only.
    let own = text.filter(|text| text.contains(field));
    let own = own.map(|_| MessageSchema::of(connection));
    let forms = FORMS.iter().filter_map(|form| {
        let form = MessageSchema::of_part(form, name)?;
        Some(form.with(MessageSchema::of_text(DEFINITION)))
    });
    let all: Vec<MessageSchema> = own.into_iter().chain(forms).collect();
    let whole = |schema: &MessageSchema| schema.read(&mut payload.clone()).ok();
    // Some serializers reserve more bytes than they write, such as that of `rmw_fastrtps` for messages that
    // programs write to a bag themselves.
    let begun = |schema: &MessageSchema| schema.read_begun(&mut payload.clone()).ok();
    let value = all.iter().find_map(whole);
    let value = value.or_else(|| all.iter().filter_map(begun).find(is_sound));
    value.ok_or(payload.wrong("a graph"))
}

/// Whether every node has a valid ROS name, unlike random bytes.
fn is_sound(value: &MessageValue) -> bool {
    let nodes = match value.list("nodes") {
        [] => std::slice::from_ref(value),
        nodes => nodes,
    };
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '/' | '-');
    let mut names = nodes.iter().map(|node| node.text("name"));
    names.all(|name| name.len() > 1 && name.starts_with('/') && name.chars().all(is_name))
}

/// An end of a topic in a snapshot.
struct SnapshotEnd<'a> {
    node: Name,
    topic: Cow<'a, str>,
    qos: Option<&'a MessageValue>,
}

/// Adds the observations of nodes in one snapshot; `of` distinguishes snapshots of single nodes.
fn snapshot(context: &mut SourceContext<'_>, nodes: &[MessageValue], of: &str) {
    let topic = context.stream.connection.topic.shared();
    let group = context.name(format!("snapshot {topic} {of}").trim_end());
    let (mut offered, mut asked, mut seen) = (Vec::new(), Vec::new(), BTreeSet::new());
    for node in nodes {
        let name = node.text("name");
        if name.is_empty() {
            continue;
        }
        let id = context.name(name);
        context.states_in(group, Observation::Node(id), || {
            format!("{name} is in the graph{}", parameters(node))
        });
        if !seen.insert(name) {
            let twice = || format!("{name} occurs twice in the graph");
            context.states(Observation::Duplicate(id), twice);
        }
        for (is_sent, topic, kind, qos) in ends(node) {
            let (of, kind) = (context.name(&topic), context.name(kind));
            let observation = Observation::edge(is_sent, id, of);
            let quality = qos.and_then(quality);
            context.states_in(group, observation, || {
                let quality = quality.as_ref().map(|quality| format!(" ({quality})"));
                let quality = quality.unwrap_or_default();
                format!("{name} {} {topic}{quality}", verb(is_sent))
            });
            if let Some(quality) = quality.filter(|_| is_sent) {
                let offered = Observation::Quality(of, context.name(&quality));
                context.states(offered, || format!("offered as {quality}"));
            }
            if !context.facts.text(kind).is_empty() {
                context.states_in(group, Observation::Type(of, kind), String::new);
            }
            let all = if is_sent { &mut offered } else { &mut asked };
            all.push(SnapshotEnd {
                node: id,
                topic,
                qos,
            });
        }
    }
    for end in &asked {
        let own = offered.iter().filter(|other| other.topic == end.topic);
        let mut policies = own.map(|other| incompatible(other.qos?, end.qos?));
        if let Some(Some(policy)) = policies.next()
            && policies.all(|p| p.is_some())
        {
            let (topic, policy) = (context.name(&end.topic), context.name(policy));
            let observation = Observation::Starved(end.node, topic, policy);
            context.states(observation, || {
                "no publisher offers the requested quality of service".to_owned()
            });
        }
    }
    context.states(Observation::Snapshot(group), String::new);
}

/// An endpoint in a message: whether it publishes, the topic, its type and its quality of service.
type MessageEnd<'a> = (bool, Cow<'a, str>, &'a str, Option<&'a MessageValue>);

/// The endpoints of a node in the order of the message. A service is a topic that its clients write to and
/// its server reads; feedback and status of an action are topics.
fn ends(node: &MessageValue) -> Vec<MessageEnd<'_>> {
    let mut all: Vec<MessageEnd<'_>> = Vec::new();
    for (field, is_sent) in [("publishers", true), ("subscriptions", false)] {
        let ends = node.list(field).iter();
        all.extend(ends.map(|end| topic(end, is_sent)));
    }
    for (field, is_sent) in [("service_clients", true), ("service_servers", false)] {
        for service in node.list(field) {
            let kind = kind(service, "request_type");
            let kind = kind.strip_suffix("_Request").unwrap_or(kind);
            // Every node has parameter services, which are not evidence about this one.
            let package = kind.split('/').next().unwrap_or_default();
            if !["rcl_interfaces", "type_description_interfaces"].contains(&package) {
                all.push((is_sent, service.text("name").into(), kind, None));
            }
        }
    }
    for (field, is_sent) in [("action_servers", true), ("action_clients", false)] {
        for action in node.list(field) {
            for part in ["feedback", "status"] {
                let named = action.field(part).map(|end| topic(end, is_sent));
                all.push(named.unwrap_or_else(|| {
                    let name = format!("{}/_action/{part}", action.text("name"));
                    (is_sent, name.into(), "", None)
                }));
            }
        }
    }
    all.retain(|(_, name, ..)| !name.is_empty());
    all
}

/// One end of a topic.
fn topic(end: &MessageValue, is_sent: bool) -> MessageEnd<'_> {
    (
        is_sent,
        end.text("name").into(),
        kind(end, "type"),
        end.field("qos"),
    )
}

/// The name of a type, which is a text or has one.
fn kind<'a>(end: &'a MessageValue, field: &str) -> &'a str {
    match end.field(field) {
        Some(MessageValue::Text(kind)) => kind,
        Some(interface) => interface.text("name"),
        None => "",
    }
}

/// A quality of service in the words of recordings: `reliable volatile depth 10`; `None` if unknown.
fn quality(qos: &MessageValue) -> Option<String> {
    let word = |policy, words: [&'static str; 2]| match qos.field(policy) {
        Some(MessageValue::Byte(value @ 1..=2)) => Some(words[usize::from(*value) - 1]),
        _ => None,
    };
    let history = word("history", ["keep_last", "keep_all"]);
    let history = match (history, qos.field("depth")) {
        (Some("keep_last"), Some(MessageValue::Number(Some(depth)))) => format!(" depth {depth}"),
        (Some("keep_all"), _) => " keep_all".to_owned(),
        _ => String::new(),
    };
    let reliability = word("reliability", ["reliable", "best_effort"])?;
    let durability = word("durability", ["transient_local", "volatile"])?;
    Some(format!("{reliability} {durability}{history}"))
}

/// The parameters of a node as text, with their values except floating-point numbers and lists.
fn parameters(node: &MessageValue) -> String {
    let values = node.list("parameter_values").iter().map(Some);
    let values = values.chain(std::iter::repeat(None));
    let word = |value: &MessageValue| match (value.field("type")?, value) {
        (MessageValue::Byte(1), value) => {
            Some((value.field("bool_value")? != &MessageValue::Byte(0)).to_string())
        }
        (MessageValue::Byte(2), value) => match value.field("integer_value")? {
            MessageValue::Number(number) => number.map(|number| number.to_string()),
            _ => None,
        },
        (MessageValue::Byte(4), value) => Some(value.text("string_value").to_owned()),
        _ => None,
    };
    let all = node.list("parameters").iter().zip(values);
    let all = all.map(|(parameter, value)| {
        let value = value.and_then(word).map(|word| format!(" = {word}"));
        format!("{}{}", parameter.text("name"), value.unwrap_or_default())
    });
    let all: Vec<String> = all.collect();
    match all.len() {
        0 => String::new(),
        _ => format!("; parameters: {}", all.join(", ")),
    }
}

/// The policy because of which a subscriber receives nothing: it requests more than is offered (DDS 1.4,
/// section 2.2.3). Unknown policies are compatible.
fn incompatible(offered: &MessageValue, asked: &MessageValue) -> Option<&'static str> {
    let is =
        |qos: &MessageValue, policy, value| qos.field(policy) == Some(&MessageValue::Byte(value));
    let nanos = |qos: &MessageValue, policy| -> Option<i128> {
        let duration = qos.field(policy)?;
        let part = |name| match duration.field(name) {
            Some(MessageValue::Number(number)) => *number,
            _ => None,
        };
        // 0 and the largest number of seconds mean no limit.
        let (sec, nanosec) = (part("sec")?, part("nanosec")?);
        Some(sec * 1_000_000_000 + nanosec).filter(|n| *n > 0 && sec < i128::from(i32::MAX))
    };
    if is(offered, "reliability", 2) && is(asked, "reliability", 1) {
        return Some("reliability");
    }
    if is(offered, "durability", 2) && is(asked, "durability", 1) {
        return Some("durability");
    }
    let asked_for = nanos(asked, "deadline")?;
    let is_late = nanos(offered, "deadline").is_none_or(|offered| offered > asked_for);
    is_late.then_some("deadline")
}

/// Adds the subscribers that receive nothing, and duplicate names.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    for fact in known.observed(known.source) {
        let (what, kind) = match fact.observation {
            Observation::Starved(node, topic, policy) => (
                ElementKey::Subscribe(topic, node),
                IncidentKind::Starved(known.text(policy)),
            ),
            Observation::Duplicate(node) => (ElementKey::Node(node), IncidentKind::Duplicate),
            _ => continue,
        };
        // Each snapshot repeats it.
        if let Some(time) = known.times(&fact).first() {
            known.incident(what, kind, *time);
        }
    }
}

// `ros_discovery_info`: the nodes of each participant of DDS (`rmw_dds_common/msg/ParticipantEntitiesInfo`).

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`; its identifiers have 24 bytes up to Humble, 16 since.
pub(crate) const PARTICIPANT: MessageLayout =
    MessageLayout::ros2("rmw_dds_common/ParticipantEntitiesInfo", "");

/// The nodes of a participant: namespace and name.
type ParticipantNodes<'a> = Vec<(&'a str, &'a str)>;

pub(crate) fn read_participant(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let mut long = payload.clone();
    let (id, nodes) = participant(payload, 16).or_else(|_| participant(&mut long, 24))?;
    let id = hex_of(id);
    let group = context.name(&format!("participant {id}"));
    for (space, name) in nodes {
        let full = format!("{}/{name}", space.trim_end_matches('/'));
        let node = context.name(&full);
        let words = || format!("{full} is a node of participant {id}");
        context.states_in(group, Observation::Node(node), words);
    }
    context.states(Observation::Snapshot(group), String::new);
    Ok(())
}

/// The participant and its nodes, if identifiers of `gid` bytes use the payload up exactly.
fn participant<'a>(
    payload: &mut PayloadCursor<'a>,
    gid: usize,
) -> cursor::PayloadResult<(&'a [u8], ParticipantNodes<'a>)> {
    let id = payload.bytes(gid)?;
    let mut nodes = Vec::new();
    for _ in 0..payload.length(16)? {
        nodes.push((payload.string()?, payload.string()?));
        for _ in 0..2 {
            for _ in 0..payload.length(gid)? {
                payload.bytes(gid)?;
            }
        }
    }
    payload.finish()?;
    Ok((id, nodes))
}
