//! Actions: the publisher of status, feedback or result is the server and subscribes to goals; a publisher of
//! goals is a client and subscribes to the rest. Goal ids name clients of ROS 1 (`/client-N-time`).

use super::SourceContext;
use crate::evidence::inference::{Conclusions, ElementKey};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::{Confidence, Name, Observation, SourceId};
use std::collections::BTreeMap;

/// `actionlib_msgs/GoalStatusArray`.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "actionlib_msgs/GoalStatusArray",
    md5: "8b2b82f13216d0a8ea88bd3af735e619",
    fields: &[
        ("", "Header header;GoalStatus[] status_list"),
        ("GoalStatus", "GoalID goal_id;byte status;string text"),
        ("GoalID", "time stamp;string id"),
    ],
};

/// The states of goals that their clients wait for: pending, active, preempting, recalling.
const OPEN: [u8; 4] = [0, 1, 6, 7];
/// The time after a goal was sent in which it shows its client in any state, in nanoseconds: a short one is done before
/// the next status.
const JUST_NS: i64 = 1_000_000_000;

pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let now = payload.header()?.stamp;
    let mut ids = Vec::new();
    for _ in 0..payload.length(17)? {
        let sent = payload.time()?;
        let id = payload.string()?;
        // The last goal is listed until the next one, perhaps long after its client ended.
        let is_open = OPEN.contains(&payload.u8()?);
        if is_open || now.since(sent) <= JUST_NS {
            ids.push(id);
        }
        payload.skip_string()?;
    }
    payload.finish()?;
    let topic = context.stream.connection.topic.shared();
    let Some(action) = topic.strip_suffix("/status") else {
        return Ok(());
    };
    for id in ids {
        if let Some(client) = client(id) {
            let node = context.name(client);
            let goal = context.name(&format!("{action}/goal"));
            let words = || format!("goal `{id}` on {action}");
            context.observation(
                Observation::Publish(node, goal),
                Confidence::Inferred,
                words,
            );
        }
    }
    Ok(())
}

/// The node in a goal's id `/client-N-time`.
fn client(id: &str) -> Option<&str> {
    let (rest, time) = id.rsplit_once('-')?;
    let (node, number) = rest.rsplit_once('-')?;
    let digits = |t: &str| !t.is_empty() && t.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    (node.starts_with('/') && digits(number) && digits(time)).then_some(node)
}

/// The suffixes of the topics that a server publishes; a client publishes the others.
const SENDS: [&str; 3] = ["status", "feedback", "result"];
const TAKES: [&str; 2] = ["goal", "cancel"];

/// The parts of an action that a bag contains or a source names, by the action's name.
type Actions = BTreeMap<String, BTreeMap<&'static str, Name>>;

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    for (action, parts) in ros1_actions(known) {
        let mut all = BTreeMap::new();
        for part in SENDS.iter().chain(&TAKES) {
            all.insert(*part, known.facts.name(&format!("{action}/{part}")));
        }
        tie(source, known, &parts, &all);
    }
    for (_, parts) in ros2_actions(known) {
        tie(source, known, &parts, &parts);
    }
}

/// Adds all edges that follow from the known ones.
fn tie(
    source: SourceId,
    known: &mut Conclusions<'_>,
    parts: &BTreeMap<&'static str, Name>,
    all: &BTreeMap<&'static str, Name>,
) {
    for (own, other) in [(&SENDS[..], &TAKES[..]), (&TAKES[..], &SENDS[..])] {
        let mut basis: BTreeMap<Name, ElementKey> = BTreeMap::new();
        for topic in own.iter().filter_map(|part| parts.get(part)) {
            for node in known.publishers(*topic).collect::<Vec<_>>() {
                basis
                    .entry(node)
                    .or_insert(ElementKey::Publish(node, *topic));
            }
        }
        for (node, basis) in basis {
            for topic in own.iter().filter_map(|part| all.get(part)) {
                if ElementKey::Publish(node, *topic) != basis {
                    known.like(source, ElementKey::Publish(node, *topic), basis);
                }
            }
            for topic in other.iter().filter_map(|part| all.get(part)) {
                known.like(source, ElementKey::Subscribe(*topic, node), basis);
            }
        }
    }
}

/// Actions of ROS 1: a status topic, or a goal topic of a goal's type.
fn ros1_actions(known: &mut Conclusions<'_>) -> Actions {
    let status = known.topics_of(|kind| kind == "actionlib_msgs/GoalStatusArray");
    let goals = known.topics_of(|kind| kind.ends_with("ActionGoal"));
    let mut actions = Actions::new();
    for (topic, part) in status
        .iter()
        .map(|t| (t, "/status"))
        .chain(goals.iter().map(|t| (t, "/goal")))
    {
        if let Some(action) = known.text(*topic).strip_suffix(part) {
            actions.insert(action.to_owned(), BTreeMap::new());
        }
    }
    for (action, parts) in &mut actions {
        for part in SENDS.iter().chain(&TAKES) {
            parts.extend(
                known
                    .facts
                    .known(&format!("{action}/{part}"))
                    .map(|t| (*part, t)),
            );
        }
    }
    actions
}

/// Actions of ROS 2: a status or feedback topic below `_action`.
fn ros2_actions(known: &mut Conclusions<'_>) -> Actions {
    let mut actions = Actions::new();
    for topic in
        known.topics_of(|kind| kind.contains("/action/") || kind == "action_msgs/GoalStatusArray")
    {
        if let Some((action, part)) = known.text(topic).rsplit_once("/_action/")
            && let Some(part) = SENDS.iter().find(|p| **p == part)
        {
            actions
                .entry(action.to_owned())
                .or_default()
                .insert(part, topic);
        }
    }
    actions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_id_of_a_goal_names_its_client() {
        assert_eq!(
            client("/mission_executor-3-1795170744.123"),
            Some("/mission_executor")
        );
        assert_eq!(client("/my-node-1-1.5"), Some("/my-node"));
        assert_eq!(client("goal 7"), None);
        assert_eq!(client("a-b-c"), None);
    }
}
