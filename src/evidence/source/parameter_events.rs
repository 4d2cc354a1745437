//! Parameter events of ROS 2: a node is running.

use super::SourceContext;
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::parameters::ParameterEvent;
use crate::evidence::observation::{Confidence, Observation};

pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let event = ParameterEvent::read(payload)?;
    let name = event.node;
    if event.is_start && !name.is_empty() {
        let node = context.name(name);
        context.observation(Observation::Begins(node), Confidence::Stated, || {
            format!("{name} declares `use_sim_time`, as it starts")
        });
    }
    if !name.is_empty() {
        let node = context.name(name);
        context.observation(Observation::Node(node), Confidence::Stated, || {
            format!("{name} reports its parameters")
        });
        let topic = context.stream.topic;
        context.observation(
            Observation::Publish(node, topic),
            Confidence::Stated,
            || format!("{name} reports its parameters"),
        );
    }
    Ok(())
}
