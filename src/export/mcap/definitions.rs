//! The channels that are written, with the definitions of their messages.

use crate::evidence::source::rosgraph;

/// A topic, its type and definition.
type WrittenChannel = (&'static str, &'static str, &'static str);

/// <https://github.com/foxglove/foxglove-sdk/blob/main/schemas/ros2/Log.msg>.
const LOG: &str = include_str!("log.msg");

/// The channels.
pub(super) const CHANNELS: [WrittenChannel; 2] = [
    ("/rosgraph", "rosgraph_msgs/msg/Graph", rosgraph::DEFINITION),
    ("/bagreel/events", "foxglove_msgs/msg/Log", LOG),
];
