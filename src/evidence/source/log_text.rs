//! Log texts about topics and nodes: in which a node names a topic that it publishes or subscribes to (of rclcpp and rclpy about
//! incompatible quality of service, of Gazebo's plugins, its bridge and rosserial about their endpoints), of two nodes of one name,
//! and of roscpp about its connections.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::ids::grouped;
use crate::base::name::{is_feedback, is_log, resolved};
use crate::base::rhythm::{DISCOVERY_NS, FOUND_NS, REGISTRATION_NS};
use crate::base::time::Stamp;
use crate::evidence::inference::{
    Conclusions, ElementKey, IncidentKind, Reliability, Stream, Validity, verb,
};
use crate::evidence::message::dynamic::{LogRecord, full_name, is_ros1_log};
use crate::evidence::observation::{Confidence, Name, Observation, ObservationRecord};
use crate::evidence::source::{SHARED, SourceContext};
use crate::evidence::source_id;

pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    // Topics in the logs of a recorder or player belong to other nodes.
    if record.logger.is_empty() || ["recorder.cpp", "player.cpp"].contains(&record.file_name()) {
        return;
    }
    let (bridged, named) = (bridged(record.text), named(record.text));
    let Some((_, topic)) = bridged.or(named) else {
        return;
    };
    let (node, of) = (context.name(&record.logger), context.name(topic));
    let observation = match (bridged, named) {
        (Some((false, _)), _) => Observation::Unsubscribe(node, of),
        (None, Some((true, _))) => Observation::SaysPublish(node, of),
        _ => Observation::SaysSubscribe(node, of),
    };
    context.states(observation, String::new);
    if let (None, Some((publishes, _))) = (bridged, named)
        && record.text.contains("incompatible QoS")
    {
        let policy = record.text.split_once("incompatible policy: ");
        let policy = policy.map_or("", |(_, rest)| rest.trim_end_matches(['.', ' ']));
        let policy = policy.trim_end_matches("_QOS_POLICY").to_lowercase();
        let policy = context.name(&policy);
        let observation = if publishes {
            Observation::Starves(node, of, policy)
        } else {
            Observation::Starved(node, of, policy)
        };
        context.states(observation, || {
            format!("{} {}: {}", record.logger, record.logs, record.text)
        });
    }
}

/// The text before a topic, the text after it, and whether the logging node publishes it.
const FORMS: &[(&str, &str, bool)] = &[
    // rclcpp and rclpy: the other end is new, so the logging node has this one.
    (
        "New subscription discovered on topic '",
        "', requesting incompatible QoS",
        true,
    ),
    (
        "New publisher discovered on topic '",
        "', offering incompatible QoS",
        false,
    ),
    // gazebo_ros_pkgs of ROS 2; camera, depth, points, infrared.
    ("Advertise odometry on [", "]", true),
    ("Advertise wheel state on [", "]", true),
    ("Advertise joint states on [", "]", true),
    ("Advertise state on [", "]", true),
    ("Publishing camera info to [", "]", true),
    ("Publishing depth camera info to [", "]", true),
    ("Publishing pointcloud to [", "]", true),
    ("Publishing images to [", "]", true),
    ("Publishing depth images to [", "]", true),
    ("Publishing joint states to [", "]", true),
    ("Publishing contact states to [", "]", true),
    ("Publishing to [", "]", true),
    ("Subscribed to [", "]", false),
    ("Subscribing to [", "]", false),
    ("Subscribing to topic [", "]", false),
    // ros_gz_bridge and ros_ign_bridge: Gazebo on the one side, ROS on the other.
    ("Creating GZ->ROS Bridge: [", "", true),
    ("Creating IGN->ROS Bridge: [", "", true),
    ("Creating ROS->GZ Bridge: [", "", false),
    ("Creating ROS->IGN Bridge: [", "", false),
    // rosserial_python.
    ("Setup publisher on ", " [", true),
    ("Setup subscriber on ", " [", false),
];

/// The topic that a text names, and whether the logging node publishes it.
fn named(text: &str) -> Option<(bool, &str)> {
    let (before, after, publishes) = FORMS.iter().find(|(before, ..)| text.starts_with(before))?;
    let rest = &text[before.len()..];
    let topic = match (after.is_empty(), publishes) {
        (false, _) => rest.split_once(after)?.0,
        // `/gz/name (gz.msgs.Clock) -> /name (rosgraph_msgs/msg/Clock)`: ROS is after the arrow, or before it.
        (true, true) => rest.split_once("-> ")?.1.split(' ').next()?,
        (true, false) => rest.split(' ').next()?,
    };
    let is_name = |c: char| c.is_ascii_alphanumeric() || "/_~".contains(c);
    (!topic.is_empty() && topic.chars().all(is_name)).then_some((*publishes, topic))
}

/// The topic to which rosbridge subscribes for a client, or unsubscribes from: `[Client 0] Subscribed to
/// /odom`.
fn bridged(text: &str) -> Option<(bool, &str)> {
    let (client, text) = text.strip_prefix("[Client ")?.split_once("] ")?;
    let topic = |lead: &str| text.strip_prefix(lead).filter(|t| t.starts_with('/'));
    let named = topic("Subscribed to ").map(|topic| (true, topic));
    let named = named.or_else(|| topic("Unsubscribed from ").map(|topic| (false, topic)));
    named.filter(|_| !client.is_empty())
}

/// Adds edges only for topics of the bag: a text may mean a device or a file.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    for (fact, signs, ends) in known.observations() {
        let (logger, topic, publishes, policy) = match fact.observation {
            Observation::SaysPublish(logger, topic) => (logger, topic, true, None),
            Observation::SaysSubscribe(logger, topic) => (logger, topic, false, None),
            Observation::Starves(logger, topic, policy) => (logger, topic, true, Some(policy)),
            Observation::Starved(logger, topic, policy) => (logger, topic, false, Some(policy)),
            _ => continue,
        };
        let Some(node) = known.owner(&known.text(logger)) else {
            continue;
        };
        let full = resolved(&known.text(topic), &known.text(node));
        let Some(topic) = known.facts.known(&full).filter(|t| known.is_recorded(*t)) else {
            continue;
        };
        let what = ElementKey::edge(publishes, node, topic);
        if known.denies(what) {
            continue;
        }
        if let Some(policy) = policy {
            let starved = IncidentKind::Starved(known.text(policy));
            for time in signs {
                known.incident(what, starved.clone(), time);
            }
            continue;
        }
        let first = signs.first().copied();
        let when = Validity::Signs { signs, ends };
        known.because(what, Confidence::Stated, when, first, |known| {
            let (logger, does) = (known.text(logger), verb(publishes));
            format!("{logger} logs that it {does} {full}")
        });
    }
}

// Two nodes of one name: rcl, where both log over one publisher, and the master of ROS 1, which ends the older one.

pub(crate) fn read_duplicates(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    if let Some(node) = doubled(record) {
        let node = context.name(&node);
        context.states(Observation::Duplicate(node), || {
            format!("{} {}: {}", record.logger, record.logs, record.text)
        });
    }
}

/// The duplicated node according to a text.
fn doubled(record: &LogRecord<'_>) -> Option<String> {
    let text = record.text;
    if let Some((before, _)) = text.split_once("] Reason: new node registered with same name") {
        return Some(before.rsplit_once('[')?.1.to_owned());
    }
    let rest = text.split_once("Publisher already registered for ")?.1;
    // Since Iron the text names the logger; the record's own is `rcl.logging_rosout`, or the node's.
    let named = rest.strip_prefix("node name: '");
    match named.and_then(|rest| rest.split_once('\'')) {
        Some((name, _)) => Some(full_name(name)),
        None => Some(record.logger.clone()).filter(|name| !name.starts_with("/rcl/")),
    }
}

/// Adds the names that are used twice.
pub(crate) fn conclude_duplicates(known: &mut Conclusions<'_>) {
    for fact in known.observed(known.source) {
        let Observation::Duplicate(name) = fact.observation else {
            continue;
        };
        let Some(node) = known.owner(&known.text(name)) else {
            continue;
        };
        for time in known.times(&fact) {
            let what = ElementKey::Node(node);
            known.incident(what, IncidentKind::Duplicate, time);
        }
    }
}

// roscpp about its connections: start and end of subscribers (DEBUG), clients with another type, its own subscriptions;
// and the recorder's `Subscribing to`, which gives the time at which a topic appeared.

/// The topic that a recorder, of ROS 1 or ROS 2, says that it has found.
fn found_topic(text: &str) -> Option<&str> {
    if let Some(topic) = text.strip_prefix("Subscribing to ") {
        return Some(topic.trim());
    }
    let quoted = text.strip_prefix("Subscribed to topic '")?;
    quoted.strip_suffix('\'')
}

/// The topics that recorders found, each with the times.
fn found(known: &mut Conclusions<'_>) -> Vec<(Name, Vec<Stamp>)> {
    let facts = known.observed(source_id("links")).into_iter();
    let of = |fact: ObservationRecord| match fact.observation {
        Observation::Appears(topic) => Some((topic, known.times(&fact))),
        _ => None,
    };
    facts.filter_map(of).collect()
}

/// The topics that a recorder of all topics found when they began, with that time.
fn births(known: &mut Conclusions<'_>) -> Vec<(Name, Stamp)> {
    let mut found = found(known);
    // Another recorder that starts finds all topics again.
    let is_later = |from: Stamp, time: &&Stamp| time.since(from) > DISCOVERY_NS;
    let again = found.iter().flat_map(|(_, times)| {
        let first = times.first().copied().unwrap_or_default();
        times.iter().filter(move |time| is_later(first, time))
    });
    let mut again: Vec<Stamp> = again.copied().collect();
    again.sort_unstable();
    let before = |time: Stamp| again.partition_point(|other| *other <= time);
    let is_again =
        |time: Stamp| before(time.plus(FOUND_NS)) - before(time.plus(-FOUND_NS)) >= FEWEST_AGAIN;
    for (_, times) in &mut found {
        times.retain(|time| !is_again(*time));
    }
    // One that is given a list of topics names all of them when it starts, and need not find any.
    let births = found.iter().filter_map(|(_, times)| times.first());
    let first = births.clone().min();
    let is_list = first.is_none_or(|first| !births.clone().any(|time| is_later(*first, &time)));
    let start = known.mission.0;
    let birth = |(topic, times): (Name, Vec<Stamp>)| {
        let birth = times.first().copied().filter(|_| !is_list)?;
        // A recorder that starts finds what is there in its first seconds.
        let is_unclear = (FOUND_NS..2 * FOUND_NS).contains(&birth.since(start));
        let is_once = !times.iter().any(|time| is_later(birth, &time));
        (is_once && !is_unclear).then_some((topic, birth))
    };
    found.into_iter().filter_map(birth).collect()
}

/// A topic began when the recorder found it, and so did the publications of the only node that publishes it, or of those that send at
/// once. For example, `/manager`, `/crop` and `/resize` send to the topic of their bond within a second after it was found.
pub(crate) fn conclude_births(known: &mut Conclusions<'_>) {
    for (topic, birth) in births(known) {
        let streams = known.streams.iter().filter(|stream| stream.topic == topic);
        let is_whole = |stream: &Stream| stream.trust == Reliability::Whole;
        if !streams.clone().all(is_whole) || !known.is_recorded(topic) || is_log(&known.text(topic))
        {
            continue;
        }
        let publisher = |stream: &Stream| stream.publisher;
        let nodes: BTreeSet<Option<Name>> = streams.clone().map(publisher).collect();
        let is_there = |stream: &&Stream| {
            let bounds = known.bounds(stream);
            nodes.len() == 1 || bounds.is_some_and(|(first, _)| first.since(birth) <= FOUND_NS)
        };
        let there: BTreeSet<_> = streams.filter(is_there).map(publisher).collect();
        for node in there {
            let what = match node {
                Some(node) => ElementKey::Publish(node, topic),
                None => ElementKey::Topic(topic),
            };
            let when = Validity::begin(birth);
            known.because(what, Confidence::Stated, when, Some(birth), |known| {
                format!("the recorder found {} then", known.text(topic))
            });
        }
    }
}

// The log of a node of rospy is latched: a recorder that connects to it gets the last record at once. A node whose first record comes
// long after the recorder has connected to what was there, and is not the node's first, has just started. For example, `/teleop`
// first logs at 101.2 s, with number 2: it sent number 1 before the recorder was connected, and would otherwise have been there at 0 s.

pub(crate) fn conclude_connected(known: &mut Conclusions<'_>) {
    let mut recordings = recordings(known);
    recordings.sort_unstable();
    let Some(&(whole, _)) = recordings.iter().find(|(_, is_whole)| *is_whole) else {
        return;
    };
    // The first log record of each node, and whether it is not its first.
    let mut first: BTreeMap<Name, (Stamp, bool)> = BTreeMap::new();
    for fact in known.observed(source_id("rosout")) {
        if let Observation::Begins(node) | Observation::Continues(node) = fact.observation
            && let Some(time) = known.times(&fact).first()
        {
            let own = (*time, matches!(fact.observation, Observation::Continues(_)));
            let one = first.entry(node).or_insert(own);
            *one = own.min(*one);
        }
    }
    for (node, (time, _)) in first.into_iter().filter(|one| one.1.1) {
        let before = recordings.partition_point(|(start, _)| *start <= time);
        let latest = recordings[..before].last();
        let is_connected = latest.is_some_and(|(start, _)| time.since(*start) > 2 * FOUND_NS);
        if whole <= time && is_connected {
            let (what, when) = (ElementKey::Node(node), Validity::begin(time));
            known.because(what, Confidence::Stated, when, Some(time), |known| {
                let node = known.text(node);
                format!("the recorder connected to the log of {node} then, after its first record")
            });
        }
    }
}

/// The start of each recording, and whether its recorder started then: its log names most of the topics that are in it from the start.
fn recordings(known: &mut Conclusions<'_>) -> Vec<(Stamp, bool)> {
    let found: BTreeMap<Name, Vec<Stamp>> = found(known).into_iter().collect();
    let first = |stream: &Stream| {
        let (first, _) = known.bounds(stream)?;
        Some((stream.bag, (first, stream.topic)))
    };
    let bags = grouped(known.streams.iter().filter_map(first));
    let recording = |topics: &Vec<(Stamp, Name)>| {
        let start = topics.iter().map(|one| one.0).min()?;
        let end = start.plus(FOUND_NS);
        let early = topics.iter().filter(|(first, _)| *first <= end);
        let early: BTreeSet<Name> = early.map(|one| one.1).collect();
        let is_named = |topic: &Name| {
            let times = found.get(topic).map_or(&[][..], Vec::as_slice);
            let next = times.partition_point(|time| *time < start);
            times.get(next).is_some_and(|time| *time <= end)
        };
        let others = early.into_iter().filter(|topic| !known.is_log1(*topic));
        let (named, missed): (Vec<Name>, Vec<Name>) = others.partition(is_named);
        Some((start, named.len() >= missed.len()))
    };
    bags.values().filter_map(recording).collect()
}

// A topic that the recorder finds while a single node starts is of that node. For example, `/teleop` declares its parameters at
// 101.0 s, the recorder finds `/teleop/cmd_vel` at 101.6 s, and no other node starts then.

pub(crate) fn conclude_found(known: &mut Conclusions<'_>) {
    let mut starts: Vec<(Stamp, Name)> = Vec::new();
    for fact in known.observed(source_id("parameter_events")) {
        if let Observation::Begins(node) = fact.observation {
            let times = known.times(&fact).into_iter();
            starts.extend(times.map(|time| (time, node)));
        }
    }
    let early = known.mission.0.plus(2 * FOUND_NS);
    for (topic, birth) in births(known).into_iter().filter(|one| one.1 > early) {
        let near = -REGISTRATION_NS..=DISCOVERY_NS;
        let near = starts.iter().filter(|s| near.contains(&birth.since(s.0)));
        let nodes: BTreeSet<Name> = near.map(|(_, node)| *node).collect();
        let name = known.text(topic);
        // Feedback is found when its first client starts, since it is sent only then.
        let is_of_any = is_feedback(&name) || SHARED.contains(&&*name);
        let is_known = is_of_any || known.publishers(topic).next().is_some();
        if let (Some(node), 1, false) = (nodes.first(), nodes.len(), is_known) {
            known.infer_publisher(*node, topic, |known| {
                let node = known.text(*node);
                format!("the recorder found {name} when {node} started, and no other node")
            });
        }
    }
}

/// The fewest topics that a recorder finds again when it starts: one or two may be those of a node that started.
const FEWEST_AGAIN: usize = 3;

pub(crate) fn read_links(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    let (name, text, file) = (record.name, record.text, record.file);
    if file.ends_with("recorder.cpp")
        && let Some(topic) = found_topic(text)
    {
        let topic = context.name(topic);
        context.states(Observation::Appears(topic), || format!("{name}: {text}"));
    }
    let is_ros1 = is_ros1_log(&context.stream.connection.type_name);
    let roscpp = is_ros1 && file.rsplit('.').next() == Some("cpp");
    if let Some(link) = link(text).filter(|_| roscpp) {
        let node = context.name(link.node.unwrap_or(name));
        let topic = context.name(link.topic);
        let words = || format!("{name} logs: {text}");
        let observation = match link.how {
            How::Begins => Observation::Joins(node, topic),
            How::Lasts => Observation::Subscribe(node, topic),
            How::Refused => Observation::Refused(node, topic),
            How::Ends => {
                // It existed until now.
                context.states(Observation::Node(node), words);
                Observation::Unsubscribe(node, topic)
            }
        };
        context.states(observation, words);
    }
}

/// A subscription in a log text.
#[derive(Debug, PartialEq, Eq)]
struct LoggedSubscription<'a> {
    /// The subscriber; `None` for the logging node.
    node: Option<&'a str>,
    topic: &'a str,
    how: How,
}

/// The change of a subscription.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum How {
    Begins,
    Lasts,
    Refused,
    Ends,
}

/// The subscription in a log text of roscpp.
fn link(text: &str) -> Option<LoggedSubscription<'_>> {
    let between = |from: &str, to: &str| Some(text.split_once(from)?.1.split_once(to)?.0);
    let caller = || between("callerid=[", "]");
    let begins = |start: &str| text.starts_with(start);
    let (node, topic, how) = if begins("Connection: Creating TransportSubscriberLink for topic [") {
        (Some(caller()?), between("for topic [", "]")?, How::Begins)
    } else if begins("Connection to subscriber [callerid=[") && text.contains("dropped") {
        (Some(caller()?), between("to topic [", "]")?, How::Ends)
    } else if begins("Client [") && text.contains("to have datatype/md5sum") {
        let topic = between("] wants topic ", " to have datatype")?;
        (Some(between("Client [", "]")?), topic, How::Refused)
    } else if begins("Connection to publisher [") && text.contains("dropped") {
        (None, between("to topic [", "]")?, How::Lasts)
    } else if begins("Retrying connection to [") {
        (None, between("for topic [", "]")?, How::Lasts)
    } else {
        return None;
    };
    Some(LoggedSubscription { node, topic, how })
}

#[cfg(test)]
mod tests {
    mod topics {
        use super::super::*;

        #[test]
        fn texts_name_their_topic_and_side() {
            let texts = [
                ("Advertise odometry on [/odom]", Some((true, "/odom"))),
                ("Subscribed to [/cmd_vel]", Some((false, "/cmd_vel"))),
                (
                    "New subscription discovered on topic '/scan', requesting incompatible QoS. No messages will be sent to it.",
                    Some((true, "/scan")),
                ),
                (
                    "Creating GZ->ROS Bridge: [/world/clock (gz.msgs.Clock) -> /clock (rosgraph_msgs/msg/Clock)] (Lazy 0)",
                    Some((true, "/clock")),
                ),
                (
                    "Creating ROS->GZ Bridge: [/cmd_vel (geometry_msgs/msg/Twist) -> /model/cmd (gz.msgs.Twist)] (Lazy 0)",
                    Some((false, "/cmd_vel")),
                ),
                (
                    "Setup publisher on chatter [std_msgs/String]",
                    Some((true, "chatter")),
                ),
                ("Publishing odom transforms between [odom] and [base]", None),
                ("Subscribed to topic '/map'", None),
                ("[Client 0] Subscribed to /odom", None),
            ];
            for (text, expected) in texts {
                assert_eq!(named(text), expected, "{text}");
            }
        }

        #[test]
        fn clients_of_rosbridge_subscribe_and_unsubscribe() {
            let stated = |text| bridged(text);
            assert_eq!(
                stated("[Client 0] Subscribed to /odom"),
                Some((true, "/odom"))
            );
            let gone = "[Client 3f-2] Unsubscribed from /odom";
            assert_eq!(stated(gone), Some((false, "/odom")));
            assert_eq!(stated("Subscribed to /odom"), None);
            assert_eq!(stated("[Client 0] Subscribed to nothing"), None);
        }

        #[test]
        fn names_are_resolved_relative_to_their_node() {
            assert_eq!(resolved("odom", "/r1/base"), "/r1/odom");
            assert_eq!(resolved("odom", "/base"), "/odom");
            assert_eq!(resolved("~/odom", "/r1/base"), "/r1/base/odom");
            assert_eq!(resolved("/odom", "/r1/base"), "/odom");
        }
    }

    mod duplicates {
        use super::super::*;

        #[test]
        fn both_texts_name_the_node() {
            let said = |logger: &str, text| {
                doubled(&LogRecord {
                    logger: logger.to_owned(),
                    text,
                    ..LogRecord::default()
                })
            };
            let old = "Publisher already registered for provided node name. If this is due to";
            let new = "Publisher already registered for node name: 'r1.talker'. If this is due to";
            let ros1 =
                "Reason given for shutdown: [[/talker] Reason: new node registered with same name]";
            assert_eq!(said("/talker", old).as_deref(), Some("/talker"));
            assert_eq!(said("/rcl/logging_rosout", old), None);
            assert_eq!(
                said("/rcl/logging_rosout", new).as_deref(),
                Some("/r1/talker")
            );
            assert_eq!(said("/talker", ros1).as_deref(), Some("/talker"));
            assert_eq!(said("/talker", "hello"), None);
        }
    }

    mod links {
        use super::super::*;

        #[test]
        fn a_subscriber_comes_and_goes() {
            let text = "Connection: Creating TransportSubscriberLink for topic [/scan] connected to \
                    [callerid=[/slam] address=[TCPROS connection on port 1 to [127.0.0.1:2 on socket 3]]]";
            let slam = |how| {
                Some(LoggedSubscription {
                    node: Some("/slam"),
                    topic: "/scan",
                    how,
                })
            };
            assert_eq!(link(text), slam(How::Begins));
            let text =
                "Connection to subscriber [callerid=[/slam] address=[…]] to topic [/scan] dropped";
            assert_eq!(link(text), slam(How::Ends));
        }

        #[test]
        fn a_client_of_another_type_wants_to_subscribe() {
            let text = "Client [/bad] wants topic /scan to have datatype/md5sum [a/b], but our version has [c/d].";
            assert_eq!(
                link(text),
                Some(LoggedSubscription {
                    node: Some("/bad"),
                    topic: "/scan",
                    how: How::Refused
                })
            );
        }

        #[test]
        fn a_lost_publisher_reveals_the_loggers_subscription() {
            let text = "Retrying connection to [127.0.0.1:4] for topic [/scan]";
            assert_eq!(
                link(text),
                Some(LoggedSubscription {
                    node: None,
                    topic: "/scan",
                    how: How::Lasts
                })
            );
            assert_eq!(link("Retrying connection to [127.0.0.1:4]"), None);
            assert_eq!(link("hello"), None);
        }
    }
}
