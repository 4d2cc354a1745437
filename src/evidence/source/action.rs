//! Actions: the publisher of status, feedback or result is the server and subscribes to goals; a publisher of
//! goals is a client and subscribes to the rest. Goal ids name clients of ROS 1 (`/client-N-time`).

use super::SourceContext;
use crate::evidence::inference::{Conclusions, ElementKey};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::{Confidence, Name, Observation};
use std::collections::{BTreeMap, BTreeSet};

/// `actionlib_msgs/GoalStatusArray`.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "actionlib_msgs/GoalStatusArray",
    md5: "8b2b82f13216d0a8ea88bd3af735e619",
    fields: "Header header;GoalStatus[] status_list
             GoalStatus: GoalID goal_id;byte status;string text
             GoalID: time stamp;string id",
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
            let stated = Observation::Publish(node, goal);
            context.observation(stated, Confidence::Inferred, words);
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

/// The parts of an action, each with a topic: a server publishes the first [`SENT`] and subscribes to the others; a client
/// does the reverse. For example, a publisher of `/dock/goal` is a client, so it also publishes `/dock/cancel` and subscribes
/// to `/dock/status`, `/dock/feedback` and `/dock/result`.
const PARTS: [&str; 5] = ["status", "feedback", "result", "goal", "cancel"];
const SENT: usize = 3;

/// The topics of an action by part, as far as the bag contains them or a source names them.
type Parts = [Option<Name>; 5];

pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    for action in ros1_actions(known) {
        let topics = PARTS.map(|part| format!("{action}/{part}"));
        let parts = topics.each_ref().map(|topic| known.facts.known(topic));
        let all = topics.map(|topic| Some(known.facts.name(&topic)));
        tie(known, &parts, &all);
    }
    for parts in ros2_actions(known).into_values() {
        tie(known, &parts, &parts);
    }
}

/// Adds all edges that follow from the known ones.
fn tie(known: &mut Conclusions<'_>, parts: &Parts, all: &Parts) {
    for is_server in [true, false] {
        let (own, other): (Vec<usize>, Vec<usize>) =
            (0..PARTS.len()).partition(|part| (*part < SENT) == is_server);
        let mut basis: BTreeMap<Name, ElementKey> = BTreeMap::new();
        for topic in own.iter().filter_map(|part| parts[*part]) {
            for node in known.publishers(topic) {
                let what = ElementKey::Publish(node, topic);
                basis.entry(node).or_insert(what);
            }
        }
        for (node, basis) in basis {
            for topic in own.iter().filter_map(|part| all[*part]) {
                let what = ElementKey::Publish(node, topic);
                if what != basis {
                    known.like(what, basis);
                }
            }
            for topic in other.iter().filter_map(|part| all[*part]) {
                known.like(ElementKey::Subscribe(topic, node), basis);
            }
        }
    }
}

/// Actions of ROS 1: a status topic, or a goal topic of a goal's type.
fn ros1_actions(known: &Conclusions<'_>) -> BTreeSet<String> {
    let status = known.topics_of(|kind| kind == SHAPE.type_name);
    let goals = known.topics_of(|kind| kind.ends_with("ActionGoal"));
    let status = status.iter().map(|topic| (topic, "/status"));
    let topics = status.chain(goals.iter().map(|topic| (topic, "/goal")));
    let actions =
        topics.filter_map(|(topic, end)| Some(known.text(*topic).strip_suffix(end)?.to_owned()));
    actions.collect()
}

/// Actions of ROS 2: a status or feedback topic below `_action`.
fn ros2_actions(known: &Conclusions<'_>) -> BTreeMap<String, Parts> {
    let is_part = |kind: &str| kind.contains("/action/") || kind == "action_msgs/GoalStatusArray";
    let mut actions: BTreeMap<String, Parts> = BTreeMap::new();
    for topic in known.topics_of(is_part) {
        if let Some((action, part)) = known.text(topic).rsplit_once("/_action/")
            && let Some(part) = PARTS[..SENT].iter().position(|own| *own == part)
        {
            actions.entry(action.to_owned()).or_default()[part] = Some(topic);
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
