//! Log records: a node is running, and the topics it names as its own.
//!
//! roscpp lists the topics that the node publishes, rospy also those it subscribes to; a node uses rospy if
//! any of its records comes from a Python file. Records of ROS 2 name loggers only.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::base::name::{LOGS, in_space, is_log, is_player, role, with_spaces};
use crate::base::rhythm::FIRST_RECORD;
use crate::evidence::inference::{Conclusions, ElementKey, Reliability, Validity};
use crate::evidence::message::dynamic::LogRecord;
use crate::evidence::observation::{Confidence, Name, Observation, Observations};
use crate::evidence::source::SourceContext;

pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    let (name, text, verb) = (record.name, record.text, record.logs);
    if name.is_empty() {
        return;
    }
    let node = context.name(name);
    let logs = || format!("{name} {verb}: {text}");
    context.states(Observation::Node(node), logs);
    let stream = context.stream;
    let log = stream.topic;
    if is_log(stream.connection.topic.as_str()) {
        // A relay of `topic_tools` logs this when its input begins, however long it has waited.
        let is_relay = text.starts_with("advertised as ");
        let number = record.number.filter(|_| !is_relay);
        if number.is_some_and(|number| number <= FIRST_RECORD) {
            let begins = || format!("{name} logs its first record: {text}");
            context.states(Observation::Begins(node), begins);
        } else if number.is_some() && stream.connection.latching && stream.publisher == Some(node) {
            context.states(Observation::Continues(node), String::new);
        }
        context.states(Observation::Publish(node, log), logs);
        let is_host = |host: &Name| *host != node && !is_player(&context.facts.text(*host));
        if let Some(host) = stream.publisher.filter(is_host) {
            context.states(Observation::Carries(host, node), String::new);
        }
    }
    if is_rospy(record.file) {
        context.facts.rospy.insert(node);
    }
    list(context, record);
}

/// Interprets the lists of roscpp nodes as lists of publications.
pub(crate) fn interpret_lists(facts: &mut Observations) {
    let rospy = std::mem::take(&mut facts.rospy);
    for fact in &mut facts.list {
        if let Observation::Lists(node, topic) = fact.observation
            && !rospy.contains(&node)
        {
            fact.observation = Observation::Publish(node, topic);
        }
    }
}

/// Whether a record is of rospy, which names the file without its folder; a script need not end in `.py`.
fn is_rospy(file: &str) -> bool {
    const CPP: [&str; 7] = ["c", "cc", "cpp", "cxx", "h", "hh", "hpp"];
    match file.rsplit_once('.') {
        Some((_, "py")) => true,
        Some((_, ending)) if CPP.contains(&ending) => false,
        _ => !file.is_empty() && !file.contains(['/', '\\']),
    }
}

/// Takes the list of topics in a log record of a node. The list is complete: topics in an
/// earlier list and not in this one no longer belong to the node.
fn list(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    let (name, text) = (record.name, record.text);
    let node = context.name(name);
    let list = format!("topics of {}", context.facts.text(node));
    let list = context.name(&list);
    for topic in &record.topics {
        let words = || format!("{name} logs with {topic} in its list of topics: {text}");
        let topic = context.name(topic);
        context.states_in(list, Observation::Lists(node, topic), words);
    }
    context.states(Observation::Snapshot(list), String::new);
}

/// A topic in a rospy node's list that it is known to publish is a publication; one that others publish, or that nobody
/// advertises, is a subscription.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let unadvertised = unadvertised(known);
    for (fact, signs, ends) in known.observations() {
        let Observation::Lists(node, topic) = fact.observation else {
            continue;
        };
        let own = known.publishers(topic).any(|p| p == node) || has_twin(known, node, topic);
        let others = known.publishers(topic).any(|p| p != node);
        if !own && (is_of_all(known, topic) || is_broadcaster(known, node, topic)) {
            continue;
        }
        let what = match (own, others || unadvertised.contains(&topic)) {
            (true, _) => ElementKey::Publish(node, topic),
            (false, true) => ElementKey::Subscribe(topic, node),
            (false, false) => continue,
        };
        // If headers do not name all publishers, a node that names a topic may be one of them.
        let confidence = if known.is_reported(topic) {
            Confidence::Stated
        } else {
            Confidence::Inferred
        };
        let when = Validity::Signs { signs, ends };
        known.add(what, confidence, when);
    }
}

/// Whether every node of ROS 1 may publish a topic, to which only tools subscribe.
fn is_of_all(known: &Conclusions<'_>, topic: Name) -> bool {
    let text = known.text(topic);
    let is_in = |space: &String| OF_ALL.iter().any(|name| in_space(space, name) == *text);
    known.facts.spaces.iter().any(is_in)
}

/// The topics that every node of ROS 1 may publish.
const OF_ALL: [&str; 2] = ["/rosout", "/statistics"];

/// Whether a node that differs only in an anonymous suffix publishes a topic whose headers do not name all publishers.
fn has_twin(known: &Conclusions<'_>, node: Name, topic: Name) -> bool {
    let own = known.text(node);
    let base = role(&own);
    let mut publishers = known.publishers(topic);
    base.len() < own.len()
        && !known.is_reported(topic)
        && publishers.any(|p| role(&known.text(p)) == base)
}

/// Whether a node that names `/tf` as its own publishes it rather than subscribes to it: a tf2 listener also
/// names `/tf_static`. Used only if headers do not name all publishers.
fn is_broadcaster(known: &Conclusions<'_>, node: Name, topic: Name) -> bool {
    let stated = known.is_reported(topic);
    let text = known.text(topic);
    let twin = match text.strip_suffix("/tf_static") {
        Some(space) => format!("{space}/tf"),
        None if text.ends_with("/tf") => format!("{text}_static"),
        None => return false,
    };
    let twin = known.facts.known(&twin);
    let names = |twin| {
        let listed = Observation::Lists(node, twin);
        let mut facts = known.facts.list.iter();
        facts.any(|fact| fact.observation == listed)
    };
    !stated && !twin.is_some_and(names)
}

/// The topics in rospy's lists that nobody advertised; none if the recorder may have left out topics, began after the
/// nodes, or recorded a playback, so that others could have advertised them.
fn unadvertised(known: &Conclusions<'_>) -> BTreeSet<Name> {
    let (mut named, mut published) = (BTreeSet::new(), BTreeSet::new());
    let mut listed: BTreeMap<Name, BTreeSet<String>> = BTreeMap::new();
    for fact in &known.facts.list {
        match fact.observation {
            Observation::Appears(topic) => named.insert(topic),
            Observation::Publish(_, topic) if fact.snapshot.is_some() => published.insert(topic),
            Observation::Lists(node, topic) => {
                let runs = listed.entry(topic).or_default();
                runs.insert(role(&known.text(node)).to_owned())
            }
            _ => false,
        };
    }
    let is_advertised = |topic: &Name| known.is_recorded(*topic) || named.contains(topic);
    let silent = listed.iter().filter(|(topic, _)| !is_advertised(topic));
    let few = silent.clone().count() * 100 <= listed.len() * MOST_SILENT;
    if !few || !names_all(known, &named) || !published.iter().all(is_advertised) {
        return BTreeSet::new();
    }
    // If several nodes name a topic, one of them may publish it.
    let silent = silent.filter(|(_, nodes)| nodes.len() == 1);
    silent.map(|(topic, _)| *topic).collect()
}

/// The largest share, in per cent, of the topics in rospy's lists that nobody advertises: 0 to 4 in whole recordings, over
/// 10 in most of those without some topics.
const MOST_SILENT: usize = 10;

/// Whether the recorder's log is whole, because it names all recorded topics, and the messages are not played back. The
/// recorder receives no records of its own from before it subscribes to the log, and may lose one more.
fn names_all(known: &Conclusions<'_>, named: &BTreeSet<Name>) -> bool {
    let unnamed = |topic: &Name| !named.contains(topic) && !known.is_log1(*topic);
    let recorded: BTreeSet<Name> = known.streams.iter().map(|s| s.topic).collect();
    let is_played = known.streams.iter().any(|s| s.trust == Reliability::Player);
    !named.is_empty() && !is_played && recorded.into_iter().filter(unnamed).count() <= 1
}

// Log records of ROS 2: a node is running. Dots represent slashes; the loggers of a node's parts count as the node.

pub(crate) fn read_ros2(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    if record.name.is_empty() {
        return;
    }
    let logger = context.name(&record.logger);
    let topic = context.stream.topic;
    context.states(Observation::Logger(logger, topic), || {
        format!("{} {}: {}", record.logger, record.logs, record.text)
    });
}

/// A logger is a part of the nearest node or logger above it, and a node if there is none; the node publishes the log.
pub(crate) fn conclude_ros2(known: &mut Conclusions<'_>) {
    let observations = known.observations().into_iter();
    let loggers = observations.filter_map(|(fact, signs, _)| match fact.observation {
        Observation::Logger(name, topic) => Some((known.text(name), topic, signs)),
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
        let confidence = match generated(&logger) {
            Some(above) if above == node => Confidence::Inferred,
            _ => Confidence::Stated,
        };
        known.add(what, confidence, when);
    }
}

/// The node of a generated name above a logger, such as `/moveit_3408157914`, since namespaces have no such numbers; `None` if the
/// logger is the node itself, or there is none.
fn generated(logger: &str) -> Option<&str> {
    let mut ends = logger.match_indices('/').map(|(at, _)| &logger[..at]);
    ends.find(|above| {
        let number = above.rsplit_once('_').map_or("", |(_, number)| number);
        number.len() >= 4
            && number.bytes().all(|b| b.is_ascii_hexdigit())
            && number.contains(|c: char| c.is_ascii_digit())
    })
}

/// The node that a logger belongs to. Shorter names come first, so that a part finds its node.
fn owner<'a>(logger: &'a str, nodes: &BTreeSet<Arc<str>>) -> &'a str {
    if let Some(node) = with_spaces(logger).find(|name| nodes.contains(*name)) {
        return node;
    }
    match logger.rsplit_once('/') {
        // Parts of ROS 2 itself log below the name of their node.
        Some((node, "rclcpp" | "rcl" | "rclcpp_action" | "rclcpp_lifecycle" | "tf2_ros"))
            if !node.is_empty() =>
        {
            node
        }
        _ => generated(logger).unwrap_or(logger),
    }
}

// Every node of ROS 1 publishes `/rosout`, mostly silently; the node `/rosout` subscribes to it and publishes
// `/rosout_agg`.

pub(crate) fn conclude_rule(known: &mut Conclusions<'_>) {
    if !known.is_ros1() || known.nodes().is_empty() {
        return;
    }
    // Each recording in a namespace has its own master.
    for space in known.facts.spaces.clone() {
        add_rule(known, &space);
    }
}

/// Adds the log of the nodes whose recording lies in a namespace.
fn add_rule(known: &mut Conclusions<'_>, space: &str) {
    let own = |node: &str| {
        let spaces = known.facts.spaces.iter().map(String::as_str);
        let around = spaces.filter(|of| !of.is_empty() && in_space(of, node) == node);
        around.max_by_key(|of| of.len()).unwrap_or_default() == space
    };
    let nodes = known.nodes().iter().copied();
    let nodes: Vec<Name> = nodes.filter(|node| own(&known.text(*node))).collect();
    let [log, all] = LOGS.map(|name| known.facts.name(&in_space(space, name)));
    for node in nodes.into_iter().filter(|node| *node != log) {
        let when = Validity::Like(ElementKey::Node(node));
        known.add(ElementKey::Publish(node, log), Confidence::Inferred, when);
    }
    let own = [
        ElementKey::Node(log),
        ElementKey::Publish(log, all),
        ElementKey::Subscribe(log, log),
    ];
    for what in own {
        known.add(what, Confidence::Inferred, Validity::Always);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_generated_name_above_a_logger_is_a_node() {
        let moveit = "/moveit_3408157914/moveit/ros/manager";
        assert_eq!(generated(moveit), Some("/moveit_3408157914"));
        for other in [
            "/robot_1/camera",
            "/camera_5580",
            "/map_face/tf2",
            "/local_costmap/local_costmap",
        ] {
            assert_eq!(generated(other), None, "{other}");
        }
    }

    #[test]
    fn rospy_is_recognized_by_a_file_without_folder() {
        for file in ["node.py", "lib/node.py", "follow_wall", "<stdin>"] {
            assert!(is_rospy(file), "{file}");
        }
        for file in ["/src/node.cpp", "node.cpp", "/opt/ros/lib/node", ""] {
            assert!(!is_rospy(file), "{file}");
        }
    }
}
