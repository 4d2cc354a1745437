//! Parameter events of ROS 2: a node is running.

use super::SourceContext;
use crate::evidence::message::parameters::ParameterEvent;
use crate::evidence::observation::Observation;

pub(crate) fn read(context: &mut SourceContext<'_>, event: &ParameterEvent<'_>) {
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
