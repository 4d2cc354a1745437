//! Every node of ROS 1 publishes `/rosout`, mostly silently; the node `/rosout` subscribes to it and
//! publishes `/rosout_agg`.

use crate::base::name::{LOGS, in_space};
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::observation::{Confidence, Name, SourceId};

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    if !known.is_ros1() || known.nodes().is_empty() {
        return;
    }
    // Each recording in a namespace has its own master.
    for space in known.facts.spaces.clone() {
        add(source, known, &space);
    }
}

/// Adds the log of the nodes whose recording lies in a namespace.
fn add(source: SourceId, known: &mut Conclusions<'_>, space: &str) {
    let own = |node: &str| {
        let spaces = known.facts.spaces.iter().map(String::as_str);
        let around = spaces.filter(|of| !of.is_empty() && in_space(of, node) == node);
        around.max_by_key(|of| of.len()).unwrap_or_default() == space
    };
    let nodes = known.nodes().iter().copied();
    let nodes: Vec<Name> = nodes.filter(|node| own(&known.text(*node))).collect();
    let [log, all] = LOGS.map(|name| known.facts.name(&in_space(space, name)));
    let rule = |what, when| Inference::new(source, what, Confidence::Inferred, when);
    for node in nodes {
        if node != log {
            known.add(rule(
                ElementKey::Publish(node, log),
                Validity::Like(ElementKey::Node(node)),
            ));
        }
    }
    known.add(rule(ElementKey::Node(log), Validity::Always));
    known.add(rule(ElementKey::Publish(log, all), Validity::Always));
    known.add(rule(ElementKey::Subscribe(log, log), Validity::Always));
}
