//! Private names: a topic below a node's own full name is that node's, so it publishes it where nobody else is known to.

use std::sync::Arc;

use crate::evidence::claim::{Name, SourceId};
use crate::evidence::proof::Findings;

/// Beginnings of the last part of names that others publish: goals for an action, commands for a controller.
const TAKEN: [&str; 16] = [
    "goal",
    "cancel",
    "cmd",
    "command",
    "set",
    "input",
    "target",
    "desired",
    "reference",
    "request",
    "trigger",
    "enable",
    "disable",
    "reset",
    "joint_trajectory",
    "sub_",
];

pub(crate) fn conclude(source: SourceId, known: &mut Findings<'_>) {
    let nodes: Vec<(Name, Arc<str>)> = known.nodes().iter().map(|n| (*n, known.text(*n))).collect();
    for topic in known.topics_of(|_| true) {
        let name = known.text(topic);
        let last = name.rsplit('/').next().unwrap_or_default();
        let is_taken = TAKEN.iter().any(|taken| last.starts_with(taken));
        if known.publishers(topic).next().is_some() || is_taken || is_hidden(&name) {
            continue;
        }
        if let Some(node) = owner(&name, &nodes) {
            known.infer_publisher(source, node, topic, |known| {
                format!(
                    "{} lies below the name of {}",
                    known.text(topic),
                    known.text(node)
                )
            });
        }
    }
}

/// Whether a part of a name is hidden, as those of actions and of service introspection are.
fn is_hidden(topic: &str) -> bool {
    topic.split('/').any(|part| part.starts_with('_'))
}

/// The node with the longest name that a topic lies below, unless that name is a namespace of other nodes too.
fn owner(topic: &str, nodes: &[(Name, Arc<str>)]) -> Option<Name> {
    let below = |name: &str, above: &str| {
        name.strip_prefix(above)
            .is_some_and(|rest| above.len() > 1 && rest.starts_with('/'))
    };
    let above = nodes.iter().filter(|(_, node)| below(topic, node));
    let (node, name) = above.max_by_key(|(_, node)| node.len())?;
    let is_space = nodes.iter().any(|(_, other)| below(other, name));
    (!is_space).then_some(*node)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_belongs_to_the_node_it_lies_below() {
        let nodes: Vec<(Name, Arc<str>)> = ["/amcl", "/r1", "/r1/nav"]
            .iter()
            .zip(0..)
            .map(|(name, at)| (Name(at), (*name).into()))
            .collect();
        assert_eq!(owner("/amcl/pose", &nodes), Some(Name(0)));
        assert_eq!(owner("/r1/nav/plan", &nodes), Some(Name(2)));
        assert_eq!(owner("/r1/scan", &nodes), None);
        assert_eq!(owner("/amcl_pose", &nodes), None);
        assert_eq!(owner("/amcl", &nodes), None);
    }
}
