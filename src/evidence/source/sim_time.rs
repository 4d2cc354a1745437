//! `use_sim_time` in parameter events of ROS 2: a node that runs by simulated time subscribes to `/clock`.

use super::SourceContext;
use crate::evidence::message::parameters::ParameterEvent;
use crate::evidence::observation::{Confidence, Observation};

pub(crate) fn read(context: &mut SourceContext<'_>, event: &ParameterEvent<'_>) {
    let set = event.set.iter().rev().find(|p| p.name == "use_sim_time");
    let Some(simulated) = set.and_then(|p| p.truth).filter(|_| !event.node.is_empty()) else {
        return;
    };
    let (node, clock) = (context.name(event.node), context.name("/clock"));
    let observation = if simulated {
        Observation::Subscribe(node, clock)
    } else {
        Observation::Unsubscribe(node, clock)
    };
    context.observation(observation, Confidence::Inferred, || {
        let then = if simulated {
            ""
        } else {
            ", so it does not subscribe to /clock"
        };
        format!("{} sets use_sim_time to {simulated}{then}", event.node)
    });
}
