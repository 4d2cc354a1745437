//! Log records of ROS 1: a node is running, and the topics it names as its own.
//!
//! roscpp lists the topics that the node publishes, rospy also those it subscribes to; a node uses rospy if
//! any of its records comes from a Python file.

use std::collections::BTreeSet;

use super::SourceContext;
use crate::base::name::is_log;
use crate::base::rhythm::FIRST_RECORD;
use crate::base::role::role;
use crate::base::time::Stamp;
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Reliability, Validity};
use crate::evidence::message::log::LogRecord;
use crate::evidence::observation::{Confidence, Name, Observation, Observations, SourceId};

pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    let (name, text) = (record.name, record.text);
    if name.is_empty() {
        return;
    }
    let node = context.name(name);
    let logs = || format!("{name} logs: {text}");
    context.states(Observation::Node(node), logs);
    let log = context.stream.topic;
    if is_log(context.stream.connection.topic.as_str()) {
        if record.number.is_some_and(|number| number <= FIRST_RECORD) {
            let begins = || format!("{name} logs its first record: {text}");
            context.states(Observation::Begins(node), begins);
        }
        context.states(Observation::Publish(node, log), logs);
        if let Some(publisher) = context.stream.publisher.filter(|p| *p != node) {
            context.states(Observation::Carries(publisher, node), String::new);
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

/// A topic in a rospy node's list that it is known to publish is a publication; one that others publish is a
/// subscription. If no publisher is known, a recorder of all topics shows whether there is one.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let advertised = advertised(known);
    for (fact, signs, ends) in known.observations(source) {
        let Observation::Lists(node, topic) = fact.observation else {
            continue;
        };
        let own = known.publishers(topic).any(|p| p == node) || has_twin(known, node, topic);
        // A player's messages were published by other nodes.
        let mut streams = known.streams.iter().filter(|s| s.topic == topic);
        let is_played = streams.any(|s| s.trust == Reliability::Player);
        let others = is_played || known.publishers(topic).any(|p| p != node);
        if !own && is_broadcaster(known, node, topic) {
            continue;
        }
        let stated = is_reported(known, topic);
        let silent = advertised.as_ref().is_some_and(|all| !all.contains(&topic));
        let what = match (own, others || silent) {
            (true, _) => ElementKey::Publish(node, topic),
            (false, true) => ElementKey::Subscribe(topic, node),
            (false, false) => continue,
        };
        // If headers do not name all publishers, a node that names a topic may be one of them.
        let confidence = if stated {
            Confidence::Stated
        } else {
            Confidence::Inferred
        };
        let when = Validity::Signs { signs, ends };
        known.add(Inference::new(source, what, confidence, when));
    }
}

/// Whether headers name all publishers of a topic.
fn is_reported(known: &Conclusions<'_>, topic: Name) -> bool {
    let mut of_topic = known.streams.iter().filter(|s| s.topic == topic);
    of_topic.all(|s| s.publisher.is_some() && s.trust == Reliability::Whole)
}

/// Whether a node that differs only in an anonymous suffix publishes a topic whose headers do not name all publishers.
fn has_twin(known: &Conclusions<'_>, node: Name, topic: Name) -> bool {
    let own = known.text(node);
    let base = role(&own);
    let mut publishers = known.publishers(topic);
    base.len() < own.len()
        && !is_reported(known, topic)
        && publishers.any(|p| role(&known.text(p)) == base)
}

/// Whether a node that names `/tf` as its own publishes it rather than subscribes to it: a tf2 listener also
/// names `/tf_static`. Used only if headers do not name all publishers.
fn is_broadcaster(known: &mut Conclusions<'_>, node: Name, topic: Name) -> bool {
    let stated = is_reported(known, topic);
    let text = known.text(topic);
    let twin = match text.strip_suffix("/tf_static") {
        Some(space) => format!("{space}/tf"),
        None if text.ends_with("/tf") => format!("{text}_static"),
        None => return false,
    };
    let twin = known.facts.known(&twin);
    let names = |twin| {
        let facts = known.facts.list.iter();
        facts
            .map(|f| f.observation)
            .any(|c| c == Observation::Lists(node, twin))
    };
    !stated && !twin.is_some_and(names)
}

/// Every topic that a recorder of all topics has seen advertised; `None` without such a recorder. It
/// continues to subscribe long after its start, unlike one that was given topic names.
fn advertised(known: &mut Conclusions<'_>) -> Option<BTreeSet<Name>> {
    let mut topics: BTreeSet<_> = known.streams.iter().map(|s| s.topic).collect();
    let mut seen: Option<(Stamp, Stamp)> = None;
    for fact in known.facts.list.clone() {
        if let Observation::Appears(topic) = fact.observation {
            topics.insert(topic);
            for time in known.times(&fact) {
                let (first, last) = seen.unwrap_or((time, time));
                seen = Some((first.min(time), last.max(time)));
            }
        }
    }
    let all = seen.is_some_and(|(first, last)| last.since(first) > LATE_NS);
    all.then_some(topics)
}

/// The time within which a recorder subscribes to the topics given by name, in nanoseconds.
const LATE_NS: i64 = 5_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;

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
