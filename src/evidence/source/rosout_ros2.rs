//! Log records of ROS 2: a node is running. Dots represent slashes; the loggers of a node's parts count as
//! the node.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::SourceContext;
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::message::log::LogRecord;
use crate::evidence::observation::{Confidence, Observation, SourceId};

pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    if record.name.is_empty() {
        return;
    }
    let logger = context.name(&record.logger);
    let topic = context.stream.topic;
    context.states(Observation::Logger(logger, topic), || {
        format!("logger {}: {}", record.name, record.text)
    });
}

/// Parts of ROS 2 itself that log below the name of their node.
const PARTS: [&str; 5] = [
    "rclcpp",
    "rcl",
    "rclcpp_action",
    "rclcpp_lifecycle",
    "tf2_ros",
];

/// A logger is a part of the nearest node or logger above it, and a node if there is none; the node publishes the log.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let observations = known.observations(source);
    let loggers = observations
        .iter()
        .filter_map(|(fact, signs, _)| match fact.observation {
            Observation::Logger(name, topic) => Some((known.text(name), topic, signs.clone())),
            _ => None,
        });
    let mut loggers: Vec<_> = loggers.collect();
    loggers.sort_by(|a, b| a.0.cmp(&b.0));
    let mut nodes: BTreeSet<Arc<str>> = known.nodes().iter().map(|n| known.text(*n)).collect();
    for (logger, topic, signs) in loggers {
        let node = owner(&logger, &nodes);
        nodes.insert(node.into());
        let what = ElementKey::Publish(known.facts.name(node), topic);
        let when = Validity::Signs {
            signs,
            ends: Vec::new(),
        };
        known.add(Inference::new(source, what, Confidence::Stated, when));
    }
}

/// The node that a logger belongs to. Shorter names come first, so that a part finds its node.
fn owner<'a>(logger: &'a str, nodes: &BTreeSet<Arc<str>>) -> &'a str {
    let mut above = logger;
    while !above.is_empty() {
        if nodes.contains(above) {
            return above;
        }
        above = &above[..above.rfind('/').unwrap_or(0)];
    }
    match logger.rsplit_once('/') {
        Some((node, part)) if !node.is_empty() && PARTS.contains(&part) => node,
        _ => logger,
    }
}
