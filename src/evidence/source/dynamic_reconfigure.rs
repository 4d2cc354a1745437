//! `dynamic_reconfigure` of ROS 1: `<node>/parameter_descriptions` and `<node>/parameter_updates` belong to
//! one node. A caller of another name, unless the topic is below it, runs that node as a nodelet.

use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::observation::{Confidence, Name, SourceId};

const TOPICS: [&str; 2] = ["/parameter_descriptions", "/parameter_updates"];

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let is_config = |kind: &str| {
        matches!(
            kind,
            "dynamic_reconfigure/ConfigDescription" | "dynamic_reconfigure/Config"
        )
    };
    for topic in known.topics_of(is_config) {
        let text = known.text(topic);
        let Some(node) = TOPICS.iter().find_map(|end| text.strip_suffix(end)) else {
            continue;
        };
        let pair = TOPICS.map(|end| known.facts.name(&format!("{node}{end}")));
        let callers: Vec<_> = known.publishers(topic).collect();
        for caller in &callers {
            for other in pair.iter().filter(|t| **t != topic) {
                let basis = ElementKey::Publish(*caller, topic);
                known.like(source, ElementKey::Publish(*caller, *other), basis);
            }
            if is_nodelet(&known.text(*caller), node) {
                let node = known.facts.name(node);
                known.like(source, ElementKey::Node(node), ElementKey::Node(*caller));
            }
        }
        if callers.is_empty() {
            let node = known.facts.name(node);
            own(source, known, node, topic);
        }
    }
}

/// Whether a topic of `node` that `caller` publishes shows a nodelet, not a part of the caller.
fn is_nodelet(caller: &str, node: &str) -> bool {
    caller != node && !node.starts_with(&format!("{caller}/"))
}

/// Adds the publication of a node whose topic has no known publisher.
fn own(source: SourceId, known: &mut Conclusions<'_>, node: Name, topic: Name) {
    for (at, stream) in known.streams.iter().enumerate() {
        if stream.topic == topic {
            let what = ElementKey::Publish(node, topic);
            let when = Validity::Messages(at);
            known.add(Inference::new(source, what, Confidence::Inferred, when));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nodelet_is_not_part_of_its_caller() {
        assert!(is_nodelet("/mgr", "/decim"));
        assert!(!is_nodelet("/move_base", "/move_base"));
        assert!(!is_nodelet("/move_base", "/move_base/costmap"));
    }
}
