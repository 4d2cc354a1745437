//! Simulated time: `/clock`, and the nodes that run by it, by their parameters in ROS 2 and by their stamps in ROS 1. For example,
//! `/clock` is at 104 s when `/planner` sends a message with the stamp 103.98 s: `/planner` subscribes to `/clock`.

use std::collections::BTreeMap;

use crate::base::time::{DAY, Stamp};
use crate::evidence::clock::UNSET_DAYS;
use crate::evidence::inference::{Conclusions, ElementKey, Reliability};
use crate::evidence::message::cursor::{PayloadCursor, PayloadResult};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::numbers::Number;
use crate::evidence::observation::{Confidence, Name, Observation};
use crate::evidence::source::{ParameterEvent, SourceContext};

/// `rosgraph_msgs/Clock`.
pub(crate) const CLOCK: MessageLayout = MessageLayout {
    type_name: "rosgraph_msgs/Clock",
    md5: "a9c97c1d230cfc112e270351a944ee47",
    fields: "time clock",
};

/// The largest difference between a stamp and the simulated time at which it was recorded: a map or a plan may be seconds old. With
/// more, sensors whose stamps count from their own start would be near.
const NEAR_NS: i64 = 10_000_000_000;
/// The fewest stamps of a node in simulated time: one may be near by chance.
const FEWEST: u32 = 2;

pub(crate) fn read_clock(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> PayloadResult<()> {
    let simulated = payload.time()?;
    payload.finish()?;
    if let Some(time) = context.time {
        let (place, bag) = (context.place, context.stream.bag);
        context.facts.tick((place, bag), time, simulated);
    }
    Ok(())
}

/// Counts the messages of a stream whose stamps are in simulated time, and not in wall time too.
pub(crate) fn stamped(context: &mut SourceContext<'_>, payload: &[u8]) {
    let (Some((bag, clock)), Some(time)) = (context.facts.clock, context.time) else {
        return;
    };
    let is_wall = clock.0 > UNSET_DAYS * DAY && time.since(clock).abs() <= DAY;
    let stamp = Number::of(payload).map_or(Stamp(0), Number::time);
    let is_near = stamp != Stamp(0) && clock.since(stamp).abs() <= NEAR_NS;
    if bag == context.stream.bag && is_near && !is_wall {
        *context.facts.simulated.entry(context.place).or_default() += 1;
    }
}

/// A node of ROS 1 whose stamps are in simulated time subscribes to `/clock`: it reads the time nowhere else.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let Some(clock) = known.facts.known("/clock") else {
        return;
    };
    let mut of: BTreeMap<Name, u32> = BTreeMap::new();
    for (at, many) in &known.facts.simulated {
        let stream = &known.streams[*at];
        let is_own = stream.trust == Reliability::Whole && !stream.is_outside;
        if let Some(node) = stream.publisher.filter(|_| is_own) {
            *of.entry(node).or_default() += many;
        }
    }
    for (node, many) in of.into_iter().filter(|(_, many)| *many >= FEWEST) {
        let what = ElementKey::Subscribe(clock, node);
        known.infer(what, ElementKey::Node(node), |known| {
            let node = known.text(node);
            format!("{many} messages of {node} have stamps in the simulated time of /clock")
        });
    }
}

/// Reads `use_sim_time`: a node that runs by simulated time subscribes to `/clock`.
pub(crate) fn read_parameters(context: &mut SourceContext<'_>, event: &ParameterEvent<'_>) {
    let set = event.set.iter().rev().find(|p| p.name == "use_sim_time");
    let Some(simulated) = set.and_then(|p| p.truth).filter(|_| !event.node.is_empty()) else {
        return;
    };
    let (node, clock) = (context.name(event.node), context.name("/clock"));
    let (observation, then) = if simulated {
        (Observation::Subscribe(node, clock), "")
    } else {
        let then = ", so it does not subscribe to /clock";
        (Observation::Unsubscribe(node, clock), then)
    };
    context.observation(observation, Confidence::Inferred, || {
        format!("{} sets use_sim_time to {simulated}{then}", event.node)
    });
}
