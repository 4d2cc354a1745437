//! Private names: a topic below a node's own full name belongs to the node, so it publishes it if no other
//! publisher is known.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::evidence::inference::Conclusions;
use crate::evidence::observation::{Name, SourceId};

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

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let nodes: NodesByName = known.nodes().iter().map(|n| (known.text(*n), *n)).collect();
    let spaces = spaces(&nodes);
    for topic in known.topics_of(|_| true) {
        let name = known.text(topic);
        let last = name.rsplit('/').next().unwrap_or_default();
        let is_taken = TAKEN.iter().any(|taken| last.starts_with(taken));
        if known.publishers(topic).next().is_some() || is_taken || is_hidden(&name) {
            continue;
        }
        if let Some(node) = owner(&name, &nodes, &spaces) {
            known.infer_publisher(source, node, topic, |known| {
                format!(
                    "{} is below the name of {}",
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

/// Nodes by name.
type NodesByName = BTreeMap<Arc<str>, Name>;

/// The names that are namespaces of other nodes.
fn spaces(nodes: &NodesByName) -> BTreeSet<&str> {
    nodes.keys().flat_map(|node| above(node)).collect()
}

/// The namespaces of a name, the nearest first, without the root.
fn above(name: &str) -> impl Iterator<Item = &str> {
    let slashes = name.rmatch_indices('/');
    slashes
        .map(|(at, _)| &name[..at])
        .filter(|space| !space.is_empty())
}

/// The node with the longest name above a topic, unless that name is also a namespace of other nodes.
fn owner(topic: &str, nodes: &NodesByName, spaces: &BTreeSet<&str>) -> Option<Name> {
    let name = above(topic).find(|name| nodes.contains_key(*name))?;
    nodes.get(name).copied().filter(|_| !spaces.contains(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_in_a_private_namespace_belongs_to_its_node() {
        let names = ["/amcl", "/r1", "/r1/nav"].into_iter().map(Arc::from);
        let nodes: NodesByName = names.zip((0..).map(Name)).collect();
        let owner = |topic| owner(topic, &nodes, &spaces(&nodes));
        assert_eq!(owner("/amcl/pose"), Some(Name(0)));
        assert_eq!(owner("/r1/nav/plan"), Some(Name(2)));
        assert_eq!(owner("/r1/scan"), None);
        assert_eq!(owner("/amcl_pose"), None);
        assert_eq!(owner("/amcl"), None);
    }
}
