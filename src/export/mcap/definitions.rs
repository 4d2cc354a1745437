//! The definitions of the messages that are written: <https://github.com/ros2/rcl_interfaces/tree/rolling/rosgraph_msgs/msg>
//! and <https://github.com/foxglove/foxglove-sdk/blob/main/schemas/ros2/Log.msg>.

/// Topic, type and definition.
type WrittenChannel = (&'static str, &'static str, fn() -> String);

/// The channels.
pub(super) const CHANNELS: [WrittenChannel; 2] = [
    ("/rosgraph", "rosgraph_msgs/msg/Graph", graph),
    ("/bagreel/events", "foxglove_msgs/msg/Log", log),
];

/// The messages in a graph, each after a line of `=`.
const PARTS: &[(&str, &str)] = &[
    (
        "rosgraph_msgs/Node",
        "string name\nrcl_interfaces/ParameterDescriptor[] parameters\nrcl_interfaces/ParameterValue[] parameter_values\n\
         Topic[] publishers\nTopic[] subscriptions\nService[] service_clients\nService[] service_servers\n\
         Action[] action_clients\nAction[] action_servers\n",
    ),
    (
        "rosgraph_msgs/Topic",
        "string name\nInterfaceType type\nQoSProfile qos\n",
    ),
    (
        "rosgraph_msgs/Service",
        "string name\nInterfaceType request_type\nQoSProfile request_qos\nInterfaceType response_type\n\
         QoSProfile response_qos\n",
    ),
    (
        "rosgraph_msgs/Action",
        "string name\nService send_goal\nService get_result\nService cancel_goal\nTopic feedback\nTopic status\n",
    ),
    (
        "rosgraph_msgs/InterfaceType",
        "string name\nTypeHash hash\n",
    ),
    (
        "rosgraph_msgs/TypeHash",
        "uint8 version 1\nuint8[32] value\n",
    ),
    (
        "rosgraph_msgs/QoSProfile",
        "uint32 depth\nbuiltin_interfaces/Duration deadline\nbuiltin_interfaces/Duration lifespan\nuint8 history\n\
         uint8 reliability\nuint8 durability\nuint8 liveliness\nbuiltin_interfaces/Duration liveliness_lease_duration\n",
    ),
    (
        "rcl_interfaces/ParameterDescriptor",
        "string name\nuint8 type\nstring description\nstring additional_constraints\nbool read_only false\n\
         bool dynamic_typing false\nFloatingPointRange[<=1] floating_point_range\nIntegerRange[<=1] integer_range\n",
    ),
    (
        "rcl_interfaces/FloatingPointRange",
        "float64 from_value\nfloat64 to_value\nfloat64 step\n",
    ),
    (
        "rcl_interfaces/IntegerRange",
        "int64 from_value\nint64 to_value\nuint64 step\n",
    ),
    (
        "rcl_interfaces/ParameterValue",
        "uint8 type\nbool bool_value\nint64 integer_value\nfloat64 double_value\nstring string_value\n\
         byte[] byte_array_value\nbool[] bool_array_value\nint64[] integer_array_value\nfloat64[] double_array_value\n\
         string[] string_array_value\n",
    ),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"),
];

fn graph() -> String {
    with("Node[] nodes\n", PARTS)
}

fn log() -> String {
    let own = "uint8 UNKNOWN=0\nuint8 DEBUG=1\nuint8 INFO=2\nuint8 WARNING=3\nuint8 ERROR=4\nuint8 FATAL=5\n\
               builtin_interfaces/Time timestamp\nuint8 level\nstring message\nstring name\nstring file\nuint32 line\n";
    with(
        own,
        &[("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n")],
    )
}

/// A definition with those of the messages inside it.
fn with(own: &str, parts: &[(&str, &str)]) -> String {
    let line = "=".repeat(80);
    let parts = parts
        .iter()
        .map(|(name, fields)| format!("{line}\nMSG: {name}\n{fields}"));
    std::iter::once(own.to_owned()).chain(parts).collect()
}
