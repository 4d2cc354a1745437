//! Topics that are drawn as one box: actions, service events, image transports, the transform tree.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::name::namespace;
use crate::graph::{ById, Elements, TopicId};
use crate::view::choose::is_tf;
use crate::view::options::Grouping;

/// The groups by name, and the topics in each, sorted. No topic is in two groups.
pub(crate) type Groups = BTreeMap<String, Vec<TopicId>>;

/// Groups the topics that are still `seen`. ROS 1 actions, images and the transform tree follow `rqt_graph`'s
/// rules; ROS 2 actions and service events, which it does not know, are grouped if at least two of their
/// topics are present.
pub(crate) fn groups(elements: &Elements, seen: &ById<TopicId, bool>, wish: Grouping) -> Groups {
    let topics = elements.topics.with_ids().filter(|(id, _)| seen[*id]);
    let topics = topics.map(|(id, topic)| (topic.name.as_str(), id));
    let mut free: BTreeMap<&str, TopicId> = topics.collect();
    let mut groups = Groups::new();
    if wish.actions {
        by_suffix(&mut free, &mut groups, &ACTION);
        by_key(&mut free, &mut groups, action_of_ros2);
        by_key(&mut free, &mut groups, service_events);
    }
    if wish.images {
        by_suffix(&mut free, &mut groups, &IMAGE);
    }
    if wish.tf {
        let found: BTreeSet<&str> = free.keys().copied().filter(|name| is_tf(name)).collect();
        if !found.is_empty() {
            take(&mut free, &mut groups, "/tf".to_owned(), &found);
        }
    }
    groups
}

/// A family of topics with a common prefix.
struct Family {
    /// The suffix of the topic whose presence starts the search for the others.
    sign: &'static str,
    suffixes: &'static [&'static str],
    at_least: usize,
    name: &'static str,
}

const ACTION: Family = Family {
    sign: "/feedback",
    suffixes: &["/status", "/result", "/goal", "/cancel", "/feedback"],
    at_least: 5,
    name: "/action_topics",
};

const IMAGE: Family = Family {
    sign: "/compressed",
    suffixes: &["/compressed", "/compressedDepth", "/theora", ""],
    at_least: 3,
    name: "/image_topics",
};

fn by_suffix<'a>(free: &mut BTreeMap<&'a str, TopicId>, groups: &mut Groups, family: &Family) {
    let names: Vec<&'a str> = free.keys().copied().collect();
    for prefix in names.iter().filter_map(|n| n.strip_suffix(family.sign)) {
        let names = family.suffixes.iter().map(|s| format!("{prefix}{s}"));
        let found: BTreeSet<&'a str> = names
            .filter_map(|name| free.get_key_value(name.as_str()).map(|(key, _)| *key))
            .collect();
        if found.len() >= family.at_least {
            take(free, groups, format!("{prefix}{}", family.name), &found);
        }
    }
}

fn by_key<'a>(
    free: &mut BTreeMap<&'a str, TopicId>,
    groups: &mut Groups,
    key: impl Fn(&'a str) -> Option<String>,
) {
    let mut found: BTreeMap<String, BTreeSet<&'a str>> = BTreeMap::new();
    for name in free.keys().copied() {
        if let Some(key) = key(name) {
            found.entry(key).or_default().insert(name);
        }
    }
    for (key, names) in found.into_iter().filter(|(_, names)| names.len() >= 2) {
        take(free, groups, key, &names);
    }
}

/// The group of `X/_action/feedback`, `X/_action/status` and the events of its hidden services.
fn action_of_ros2(topic: &str) -> Option<String> {
    let (action, _) = topic.split_once("/_action/")?;
    Some(format!("{action}{}", ACTION.name))
}

/// The group of the event topics of the services of one namespace, which is usually a node's name.
fn service_events(topic: &str) -> Option<String> {
    let service = topic.strip_suffix("/_service_event")?;
    let space = namespace(service).trim_end_matches('/');
    Some(format!("{space}/service_events"))
}

/// Moves these topics into the group, which is extended if it exists.
fn take<'a>(
    free: &mut BTreeMap<&'a str, TopicId>,
    groups: &mut Groups,
    group: String,
    names: &BTreeSet<&'a str>,
) {
    let members = groups.entry(group).or_default();
    members.extend(names.iter().filter_map(|name| free.remove(name)));
    members.sort_unstable();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;

    /// The groups of these topics, as `name: members` in order.
    fn grouped(topics: &[&str], wish: Grouping) -> Vec<String> {
        let windows: Vec<String> = topics.iter().map(|t| format!("/n>{t}")).collect();
        let mission = mission(&[&windows.join(" ")]);
        let names = &mission.elements.topics;
        let groups = groups(&mission.elements, &ById::like(names, true), wish);
        let name = |id: &TopicId| names[*id].name.as_str();
        groups
            .iter()
            .map(|(group, ids)| {
                let ids: Vec<&str> = ids.iter().map(name).collect();
                format!("{group}: {}", ids.join(" "))
            })
            .collect()
    }

    #[test]
    fn an_action_needs_all_five() {
        let five = [
            "/go/status",
            "/go/result",
            "/go/goal",
            "/go/cancel",
            "/go/feedback",
        ];
        let want = "/go/action_topics: /go/cancel /go/feedback /go/goal /go/result /go/status";
        assert_eq!(grouped(&five, Grouping::default()), [want]);
        assert!(grouped(&five[1..], Grouping::default()).is_empty());
        assert!(grouped(&five, Grouping::NONE).is_empty());
    }

    #[test]
    fn ros2_actions_and_service_events_are_grouped_too() {
        let topics = [
            "/nav/_action/feedback",
            "/nav/_action/status",
            "/nav/_action/send_goal/_service_event",
            "/n/get_parameters/_service_event",
            "/n/set_parameters/_service_event",
            "/lonely/_service_event",
        ];
        let want = [
            "/n/service_events: /n/get_parameters/_service_event /n/set_parameters/_service_event",
            "/nav/action_topics: /nav/_action/feedback /nav/_action/send_goal/_service_event /nav/_action/status",
        ];
        assert_eq!(grouped(&topics, Grouping::default()), want);
    }

    #[test]
    fn images_need_three_of_four_and_tf_only_itself() {
        let topics = [
            "/i",
            "/i/compressed",
            "/i/theora",
            "/j",
            "/j/compressed",
            "/tf",
            "/r1/tf",
        ];
        let want = ["/i/image_topics: /i /i/compressed /i/theora", "/tf: /tf"];
        assert_eq!(grouped(&topics, Grouping::default()), want);
    }
}
