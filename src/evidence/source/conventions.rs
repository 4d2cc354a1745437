//! Conventions of ROS that complete what is known, without messages of their own: bonds, transforms, anonymous and private names,
//! single publishers, dynamic reconfiguration, twins in other namespaces.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::base::ids::Few;
use crate::base::name::{is_log, start};
use crate::evidence::inference::{Conclusions, ElementKey, Validity};
use crate::evidence::observation::{Confidence, Name};
use crate::evidence::source::SHARED;

// Bonds: a node that publishes a bond topic (`bond/Status`) also subscribes to it.

pub(crate) fn bond(known: &mut Conclusions<'_>) {
    for topic in known.topics_of(|kind| kind == "bond/Status") {
        for node in known.publishers(topic).collect::<Vec<_>>() {
            let basis = ElementKey::Publish(node, topic);
            known.like(ElementKey::Subscribe(topic, node), basis);
        }
    }
}

// A subscriber of `/tf` also subscribes to `/tf_static`, and vice versa: tf2 always subscribes to both.

pub(crate) fn tf_pair(known: &mut Conclusions<'_>) {
    let listened: Vec<(Name, Name)> = known.subscriptions().collect();
    for (topic, node) in listened {
        let text = known.text(topic);
        let twin = match text.rsplit_once('/') {
            Some((space, "tf")) => format!("{space}/tf_static"),
            Some((space, "tf_static")) => format!("{space}/tf"),
            _ => continue,
        };
        let twin = known.facts.known(&twin);
        if let Some(twin) = twin.filter(|t| known.kind(*t) == "tf2_msgs/TFMessage") {
            let basis = ElementKey::Subscribe(topic, node);
            known.infer(ElementKey::Subscribe(twin, node), basis, |known| {
                let node = known.text(node);
                format!("{node} subscribes to {text}, and tf2 always subscribes to both")
            });
        }
    }
}

// The start time inside an anonymous name: rospy appends its process and the milliseconds since 1970, roscpp the
// nanoseconds.

/// The longest time from a start in a name to the recording, in nanoseconds (30 days); if it is longer, the clock was
/// not set, or the number is not a time. With less, nodes of a robot that is never shut down would lose their start.
const LONGEST_NS: i64 = 30 * 86_400_000_000_000;

pub(crate) fn anonymous(known: &mut Conclusions<'_>) {
    let (first, last) = known.mission;
    for node in known.nodes().clone() {
        let Some(start) = start(&known.text(node)) else {
            continue;
        };
        if known.gone.contains(&Some(node)) || start > last || first.since(start) > LONGEST_NS {
            continue;
        }
        let what = ElementKey::Node(node);
        let when = Validity::begin(start.max(first));
        known.because(what, Confidence::Stated, when, Some(start), |known| {
            format!("the name {} contains this start time", known.text(node))
        });
    }
}

// The publisher of a topic with messages that name none: if only one node is known to publish it, the messages are from
// that node. For example, if only `/gps` is known to publish `/fix` from its log, it sent all messages of `/fix`.

pub(crate) fn only_publisher(known: &mut Conclusions<'_>) {
    for (at, stream) in known.streams.iter().enumerate() {
        if stream.publisher.is_some() || SHARED.contains(&stream.connection.topic.as_str()) {
            continue;
        }
        if let Some(only) = known.only_publisher(stream.topic) {
            let what = ElementKey::Publish(only, stream.topic);
            known.add(what, Confidence::Inferred, Validity::Messages(at));
        }
    }
}

// `dynamic_reconfigure` of ROS 1: `<node>/parameter_descriptions` and `<node>/parameter_updates` belong to
// one node. A caller of another name, unless the topic is below it, runs that node as a nodelet.

const CONFIGS: [&str; 2] = [
    "dynamic_reconfigure/ConfigDescription",
    "dynamic_reconfigure/Config",
];
const TOPICS: [&str; 2] = ["/parameter_descriptions", "/parameter_updates"];

pub(crate) fn dynamic_reconfigure(known: &mut Conclusions<'_>) {
    for topic in known.topics_of(|kind| CONFIGS.contains(&kind)) {
        let text = known.text(topic);
        let Some(node) = TOPICS.iter().find_map(|end| text.strip_suffix(end)) else {
            continue;
        };
        let pair = TOPICS.map(|end| known.facts.name(&format!("{node}{end}")));
        let callers: Vec<_> = known.publishers(topic).collect();
        for caller in &callers {
            for other in pair.iter().filter(|t| **t != topic) {
                let basis = ElementKey::Publish(*caller, topic);
                known.like(ElementKey::Publish(*caller, *other), basis);
            }
            if is_nodelet(&known.text(*caller), node) {
                let node = known.facts.name(node);
                known.like(ElementKey::Node(node), ElementKey::Node(*caller));
            }
        }
        if callers.is_empty() {
            let node = known.facts.name(node);
            let what = ElementKey::Publish(node, topic);
            for (at, _) in (0..).zip(known.streams).filter(|(_, s)| s.topic == topic) {
                known.add(what, Confidence::Inferred, Validity::Messages(at));
            }
        }
    }
}

/// Whether a topic of `node` that `caller` publishes shows a nodelet, not a part of the caller.
fn is_nodelet(caller: &str, node: &str) -> bool {
    caller != node && !node.starts_with(&format!("{caller}/"))
}

// Private names: a topic below a node's own full name, or of that name, belongs to the node, so it publishes it if no other
// publisher is known. For example, `/move_base/status` is by `/move_base`, and `/nav/costmap` by the node of that name.

/// Beginnings of the last part of names that others publish: goals for an action, commands for a controller.
const TAKEN: &str = "\
    goal cancel cmd command set input target desired reference request trigger enable disable reset \
    joint_trajectory sub_";

pub(crate) fn private_name(known: &mut Conclusions<'_>) {
    let nodes: NodesByName = known.nodes().iter().map(|n| (known.text(*n), *n)).collect();
    let spaces = spaces(&nodes);
    for topic in known.topics_of(|_| true) {
        let name = known.text(topic);
        let last = name.rsplit('/').next().unwrap_or_default();
        let is_taken = TAKEN.split(' ').any(|taken| last.starts_with(taken));
        // As those of actions and of service introspection are.
        let is_hidden = name.split('/').any(|part| part.starts_with('_'));
        let is_other = is_taken || is_hidden || is_log(&name);
        if known.publishers(topic).next().is_some() || is_other {
            continue;
        }
        if let Some(node) = owner(&name, &nodes, &spaces) {
            known.infer_publisher(node, topic, |known| {
                let [topic, node] = [topic, node].map(|name| known.text(name));
                format!("{topic} is in the private namespace of {node}")
            });
        }
    }
}

/// Nodes by name.
type NodesByName = BTreeMap<Arc<str>, Name>;

/// The names that are namespaces of other nodes.
fn spaces(nodes: &NodesByName) -> BTreeSet<&str> {
    nodes.keys().flat_map(|node| above(node)).collect()
}

/// The namespaces of a name, the nearest first, without the root.
fn above(name: &str) -> impl Iterator<Item = &str> {
    let spaces = name.rmatch_indices('/').map(|(at, _)| &name[..at]);
    spaces.filter(|space| !space.is_empty())
}

/// The node of a topic's name, or with the longest name above it, unless that name is also a namespace of other nodes.
fn owner(topic: &str, nodes: &NodesByName, spaces: &BTreeSet<&str>) -> Option<Name> {
    let mut names = std::iter::once(topic).chain(above(topic));
    let name = names.find(|name| nodes.contains_key(*name))?;
    nodes.get(name).copied().filter(|_| !spaces.contains(name))
}

// Sister namespaces: if a node's twin in another namespace publishes the same topics there and is known to
// subscribe to one, the node subscribes to it too. For example, `/r1/nav` and `/r2/nav` publish `plan` and `status` in their
// namespaces, and `/r1/nav` is known to subscribe to `/r1/scan`: `/r2/nav` subscribes to `/r2/scan`.

/// The fewest topics of their namespace that twins publish: one alone may be chance.
const FEWEST: usize = 2;
/// The most twins that are compared one by one, since the work is the square of it: larger than any fleet in one recording.
const MOST: usize = 200;

/// A node with its namespace, and the topics it publishes inside it.
struct Twin {
    node: Name,
    space: String,
    own: BTreeSet<String>,
}

pub(crate) fn sister(known: &mut Conclusions<'_>) {
    let families = families(known).into_values();
    for twins in families.filter(|twins| twins.len() <= MOST) {
        for one in &twins {
            let is_alike = |other: &&Twin| other.node != one.node && other.own == one.own;
            for other in twins.iter().filter(is_alike) {
                copy(known, one, other);
            }
        }
    }
}

/// The nodes that share their last part, each with its namespace and publications.
fn families(known: &Conclusions<'_>) -> BTreeMap<String, Vec<Twin>> {
    let mut published: Few<Name, Vec<Name>> = Few::default();
    for (node, topic) in known.publications() {
        published.grown(node).push(topic);
    }
    let mut families: BTreeMap<String, Vec<Twin>> = BTreeMap::new();
    for (node, topics) in published.with_ids() {
        let name = known.text(node);
        let Some((space, last)) = name.rsplit_once('/').filter(|(space, _)| !space.is_empty())
        else {
            continue;
        };
        let own = topics.iter();
        let own = own.filter_map(|topic| inside(&known.text(*topic), space));
        let own: BTreeSet<String> = own.collect();
        if own.len() >= FEWEST {
            families.entry(last.to_owned()).or_default().push(Twin {
                node,
                space: space.to_owned(),
                own,
            });
        }
    }
    for twins in families.values_mut() {
        twins.sort_by(|a, b| a.space.cmp(&b.space));
    }
    families
}

/// A topic's name inside a namespace.
fn inside(topic: &str, space: &str) -> Option<String> {
    let rest = topic.strip_prefix(space)?;
    rest.starts_with('/').then(|| rest.to_owned())
}

/// Adds for `to` the subscriptions of `from`, if the bag has the topics.
fn copy(known: &mut Conclusions<'_>, from: &Twin, to: &Twin) {
    let subscribed = known.subscriptions().filter(|(_, node)| *node == from.node);
    let topics: Vec<Name> = subscribed.map(|(topic, _)| topic).collect();
    for topic in topics {
        let twin = match inside(&known.text(topic), &from.space) {
            Some(rest) => known.facts.known(&format!("{}{rest}", to.space)),
            None => Some(topic),
        };
        let own = |twin| known.knows(ElementKey::Publish(to.node, twin));
        if let Some(twin) = twin.filter(|t| known.is_recorded(*t) && !own(*t)) {
            let what = ElementKey::Subscribe(twin, to.node);
            known.infer(what, ElementKey::Node(to.node), |known| {
                format!(
                    "{} publishes the same topics in its namespace and subscribes to {}",
                    known.text(from.node),
                    known.text(topic)
                )
            });
        }
    }
}

#[cfg(test)]
mod tests {
    mod dynamic_reconfigure {
        use super::super::*;

        #[test]
        fn a_nodelet_is_not_part_of_its_caller() {
            assert!(is_nodelet("/mgr", "/decim"));
            assert!(!is_nodelet("/move_base", "/move_base"));
            assert!(!is_nodelet("/move_base", "/move_base/costmap"));
        }
    }

    mod private_name {
        use super::super::*;

        #[test]
        fn a_topic_in_a_private_namespace_belongs_to_its_node() {
            let names = ["/amcl", "/r1", "/r1/nav"].into_iter().map(Arc::from);
            let nodes: NodesByName = names.zip((0..).map(Name)).collect();
            let owner = |topic| owner(topic, &nodes, &spaces(&nodes));
            assert_eq!(owner("/amcl/pose"), Some(Name(0)));
            assert_eq!(owner("/r1/nav/plan"), Some(Name(2)));
            assert_eq!(owner("/r1/scan"), None);
            assert_eq!(owner("/amcl_pose"), None);
            assert_eq!(owner("/amcl"), Some(Name(0)));
        }
    }
}
