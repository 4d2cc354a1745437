//! Events of ROS 2 on topics of their own: parameters that were declared or set, lifecycle transitions, and introspected services.

use std::collections::BTreeSet;

use crate::base::digest::hex_of;
use crate::base::name::SERVICE;
use crate::evidence::message::cursor::{self, PayloadCursor, PayloadResult};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::{Confidence, Observation};
use crate::evidence::source::SourceContext;

/// `rcl_interfaces/msg/ParameterEvent`.
pub(crate) const PARAMETER_EVENT: MessageLayout = MessageLayout::ros2(
    "rcl_interfaces/ParameterEvent",
    "time stamp;string node;Parameter[] new_parameters;Parameter[] changed_parameters;Parameter[] deleted_parameters
     Parameter: string name;ParameterValue value
     ParameterValue: byte type;byte bool_value;int64 integer_value;float64 double_value;string string_value;\
     byte[] byte_array_value;byte[] bool_array_value;int64[] integer_array_value;float64[] double_array_value;\
     string[] string_array_value",
);

/// A parameter that was declared or set.
#[derive(Clone, Copy)]
pub(crate) struct Parameter<'a> {
    pub(crate) name: &'a str,
    /// The value, if Boolean.
    pub(crate) truth: Option<bool>,
}

/// A change of a node's parameters.
pub(crate) struct ParameterEvent<'a> {
    /// The node's full name; empty if not stated.
    pub(crate) node: &'a str,
    /// The new and the changed parameters.
    pub(crate) set: Vec<Parameter<'a>>,
    /// Whether `use_sim_time` is new, which every node declares when it starts.
    pub(crate) is_start: bool,
}

impl<'a> ParameterEvent<'a> {
    /// Reads a whole event.
    ///
    /// # Errors
    /// If the payload has another layout.
    pub(crate) fn read(payload: &mut PayloadCursor<'a>) -> PayloadResult<Self> {
        payload.time()?;
        let node = payload.string()?;
        let mut set = Vec::new();
        let mut is_start = false;
        for list in 0..3 {
            for _ in 0..payload.length(4)? {
                let parameter = parameter(payload)?;
                is_start |= list == 0 && parameter.name == "use_sim_time";
                // The third list contains deleted parameters.
                set.extend((list < 2).then_some(parameter));
            }
        }
        payload.finish()?;
        Ok(Self {
            node,
            set,
            is_start,
        })
    }
}

/// The value of `PARAMETER_BOOL` in `rcl_interfaces/msg/ParameterType`.
const BOOL: u8 = 1;

fn parameter<'a>(payload: &mut PayloadCursor<'a>) -> PayloadResult<Parameter<'a>> {
    let name = payload.string()?;
    let (kind, truth) = (payload.u8()?, payload.u8()?);
    payload.i64()?;
    payload.f64()?;
    payload.skip_string()?;
    for size in [1, 1, 8, 8] {
        let count = payload.length(size)?;
        payload.numbers(count, size)?;
    }
    for _ in 0..payload.length(4)? {
        payload.skip_string()?;
    }
    Ok(Parameter {
        name,
        truth: (kind == BOOL).then_some(truth != 0),
    })
}

// A node is running.

pub(crate) fn read_node(context: &mut SourceContext<'_>, event: &ParameterEvent<'_>) {
    let name = event.node;
    if name.is_empty() {
        return;
    }
    let (node, topic) = (context.name(name), context.stream.topic);
    if event.is_start {
        let begins = || format!("{name} declares `use_sim_time`, as it starts");
        context.states(Observation::Begins(node), begins);
    }
    let reports = || format!("{name} reports its parameters");
    context.states(Observation::Node(node), reports);
    context.states(Observation::Publish(node, topic), reports);
}

// `qos_overrides.<topic>.publisher|subscription.<policy>`: rclcpp declares these parameters when it creates that
// publisher or subscription.

pub(crate) fn read_overrides(context: &mut SourceContext<'_>, event: &ParameterEvent<'_>) {
    let ends: BTreeSet<_> = event.set.iter().filter_map(|p| end_of(p.name)).collect();
    for (topic, publishes) in ends {
        let (node, of) = (context.name(event.node), context.name(topic));
        let word = if publishes {
            "publisher"
        } else {
            "subscription"
        };
        context.states(Observation::edge(publishes, node, of), || {
            format!("{} declares qos_overrides.{topic}.{word}", event.node)
        });
    }
}

/// The topic in the name of a parameter, and whether a publisher is meant. An entity may have its own id
/// (`publisher_front`).
fn end_of(parameter: &str) -> Option<(&str, bool)> {
    let rest = parameter.strip_prefix("qos_overrides.")?;
    let (entity, _policy) = rest.rsplit_once('.')?;
    let (topic, entity) = entity.rsplit_once('.')?;
    let kind = entity.split('_').next()?;
    let publishes = match kind {
        "publisher" => true,
        "subscription" => false,
        _ => return None,
    };
    topic.starts_with('/').then_some((topic, publishes))
}

// `<node>/transition_event` of ROS 2: a node is running, with its lifecycle state.

/// `lifecycle_msgs/msg/TransitionEvent`.
pub(crate) const TRANSITION: MessageLayout = MessageLayout::ros2(
    "lifecycle_msgs/TransitionEvent",
    "uint64 timestamp;Transition transition;State start_state;State goal_state
     Transition: byte id;string label
     State: byte id;string label",
);

pub(crate) fn read_transition(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    payload.u64()?;
    payload.u8()?;
    let transition = payload.string()?;
    payload.u8()?;
    let from = payload.string()?;
    payload.u8()?;
    let to = payload.string()?;
    payload.finish()?;
    let topic = context.stream.connection.topic.shared();
    let Some(name) = topic.strip_suffix("/transition_event") else {
        return Ok(());
    };
    let node = context.name(name);
    let state = context.name(to);
    let words = || format!("{name} goes from {from} to {to} ({transition})");
    context.states(Observation::Publish(node, context.stream.topic), words);
    context.states(Observation::Lifecycle(node, state), words);
    Ok(())
}

// Service introspection (`<service>/_service_event`): requests and replies of a service, and its client and
// its server if the recorder names publishers.

/// `<service type>_Event`: it begins with `service_msgs/msg/ServiceEventInfo`, with any fields after it.
pub(crate) const SERVICE_EVENT: MessageLayout = MessageLayout::ros2("*_Event", "");

pub(crate) fn read_service(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let topic = context.stream.connection.topic.shared();
    let Some(service) = topic.strip_suffix("/_service_event") else {
        return Ok(());
    };
    let kind = payload.u8()?;
    payload.time()?;
    let client = payload.bytes(16)?;
    payload.i64()?;
    let word = match kind {
        0 => "request sent",
        1 => "request received",
        2 => "reply sent",
        3 => "reply received",
        _ => return Err(payload.wrong("a kind of event")),
    };
    let client = hex_of(client);
    let words = || format!("{service}: {word}, client {client}");
    let of = context.stream.topic;
    if !service.contains("/_action/") {
        let kind = context.stream.connection.type_name.clone();
        let kind = context.name(kind.strip_suffix("_Event").unwrap_or(SERVICE));
        let called = context.name(service);
        let end = match (context.stream.publisher, word) {
            (None, _) => Observation::Topic(called),
            (Some(node), "request sent" | "reply received") => Observation::Publish(node, called),
            (Some(node), _) => Observation::Subscribe(node, called),
        };
        context.observation(end, Confidence::Measured, words);
        if context.stream.publisher.is_none() {
            let client = context.name(&client);
            context.states(Observation::Calls(called, client), String::new);
        }
        let known = Observation::Type(called, kind);
        context.observation(known, Confidence::Measured, String::new);
    }
    context.observation(Observation::Topic(of), Confidence::Measured, words);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_names_its_topic_and_end() {
        assert_eq!(
            end_of("qos_overrides./tf.publisher.depth"),
            Some(("/tf", true))
        );
        assert_eq!(
            end_of("qos_overrides./a/scan.subscription_left.history"),
            Some(("/a/scan", false))
        );
        for other in [
            "use_sim_time",
            "qos_overrides./tf.depth",
            "qos_overrides.tf.x.y",
        ] {
            assert_eq!(end_of(other), None);
        }
    }
}
