//! Topics that are drawn as one box: actions, service events, image transports, the transform tree.
//!
//! `/go/goal`, `/go/cancel`, `/go/status`, `/go/feedback` and `/go/result` are the box `/go/action_topics`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Fold, ItemKey, Keys, names};
use crate::base::ids::grouped;
use crate::base::name::namespace;
use crate::graph::{ById, Element, Elements, TopicId};
use crate::view::choose::is_tf;
use crate::view::{Grouping, ItemKind};

/// The groups by name, and the topics in each, sorted. No topic is in two groups.
pub(crate) type Groups = BTreeMap<String, Vec<TopicId>>;

/// The topics that are still free, by name.
type Free<'a> = BTreeMap<&'a str, TopicId>;

/// Groups the topics that are still `seen`. ROS 1 actions, images and the transform tree follow `rqt_graph`'s
/// rules: all five topics of an action, three of the four of an image. ROS 2 actions and service events, which it does not
/// know, are grouped if at least two of their topics are present.
pub(crate) fn groups(elements: &Elements, seen: &ById<TopicId, bool>, wish: Grouping) -> Groups {
    let topics = elements.topics.with_ids().filter(|(id, _)| seen[*id]);
    let mut free: Free<'_> = topics
        .map(|(id, topic)| (topic.name.as_str(), id))
        .collect();
    let mut groups = Groups::new();
    if wish.actions {
        take(&mut free, &mut groups, 5, |_, name| action(name));
        take(&mut free, &mut groups, 2, |_, name| action_of_ros2(name));
        take(&mut free, &mut groups, 2, |_, name| service_events(name));
    }
    if wish.images {
        take(&mut free, &mut groups, 3, image);
    }
    if wish.tf {
        let tf = |_: &Free<'_>, name: &str| is_tf(name).then(|| "/tf".to_owned());
        take(&mut free, &mut groups, 1, tf);
    }
    groups
}

/// Moves the topics with the same group into it if they are at least so many.
fn take<'a>(
    free: &mut Free<'a>,
    groups: &mut Groups,
    at_least: usize,
    group: impl Fn(&Free<'a>, &'a str) -> Option<String>,
) {
    let names = free.keys().copied();
    let found = grouped(names.filter_map(|name| Some((group(free, name)?, name))));
    for (group, names) in found.into_iter().filter(|f| f.1.len() >= at_least) {
        let members = groups.entry(group).or_default();
        members.extend(names.iter().filter_map(|name| free.remove(name)));
        members.sort_unstable();
    }
}

/// The group of an action's topic.
fn action(topic: &str) -> Option<String> {
    const SUFFIXES: [&str; 5] = ["/status", "/result", "/goal", "/cancel", "/feedback"];
    let action = SUFFIXES.iter().find_map(|end| topic.strip_suffix(end))?;
    Some(format!("{action}/action_topics"))
}

/// The group of `X/_action/feedback`, `X/_action/status` and the events of its hidden services.
fn action_of_ros2(topic: &str) -> Option<String> {
    let (action, _) = topic.split_once("/_action/")?;
    Some(format!("{action}/action_topics"))
}

/// The group of the event topics of the services of one namespace, which is usually a node's name.
fn service_events(topic: &str) -> Option<String> {
    let service = topic.strip_suffix("/_service_event")?;
    let space = namespace(service).trim_end_matches('/');
    Some(format!("{space}/service_events"))
}

/// The group of an image or of one of its transports; only if there is a compressed one.
fn image(free: &Free<'_>, topic: &str) -> Option<String> {
    const SUFFIXES: [&str; 4] = ["/compressed", "/compressedDepth", "/theora", ""];
    let images = SUFFIXES.iter().filter_map(|end| topic.strip_suffix(end));
    let mut images = images.map(|image| (image, format!("{image}/compressed")));
    let (image, _) = images.find(|(_, compressed)| free.contains_key(compressed.as_str()))?;
    Some(format!("{image}/image_topics"))
}

/// The topics of each group, whose name is made different from those of all other boxes of topics.
pub(crate) fn folds(groups: &Groups, keys: &Keys) -> Vec<Fold> {
    let grouped = groups.values();
    let grouped: BTreeSet<Element> = grouped.flatten().map(|id| Element::Topic(*id)).collect();
    let others = keys
        .iter()
        .filter(|(what, _)| what.is_topic() && !grouped.contains(what));
    let mut taken = names(others.filter_map(|(_, key)| key.as_ref()));
    let mut folds = Vec::new();
    for (name, ids) in groups {
        let mut name = name.clone();
        while taken.contains(name.as_str()) {
            name.push_str("_2");
        }
        let (kind, name): (_, Arc<str>) = (ItemKind::Group, name.into());
        taken.insert(Arc::clone(&name));
        let key = ItemKey { kind, name };
        folds.extend(ids.iter().map(|id| Fold {
            what: Element::Topic(*id),
            key: key.clone(),
        }));
    }
    folds
}

/// The name of each topic on a line: that of its group, if it is in one.
pub(crate) fn on_lines(elements: &Elements, groups: &Groups) -> ById<TopicId, Arc<str>> {
    let names = elements.topics.iter().map(|t| t.name.shared());
    let mut names: ById<TopicId, Arc<str>> = names.collect();
    for (name, ids) in groups {
        let name: Arc<str> = name.as_str().into();
        for id in ids {
            names[*id] = Arc::clone(&name);
        }
    }
    names
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
