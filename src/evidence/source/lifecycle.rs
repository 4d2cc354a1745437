//! `<node>/transition_event` of ROS 2: a node is running, with its lifecycle state.

use super::SourceContext;
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::Observation;

/// `lifecycle_msgs/msg/TransitionEvent`.
pub(crate) const SHAPE: MessageLayout = MessageLayout::ros2(
    "lifecycle_msgs/TransitionEvent",
    "uint64 timestamp;Transition transition;State start_state;State goal_state
     Transition: byte id;string label
     State: byte id;string label",
);

pub(crate) fn read(
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
