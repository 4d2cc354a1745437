//! Several elements drawn as one.
//!
//! In come the elements of a mission, the choice of those that are drawn, and the options; out comes the box of each node
//! and topic. [`keys`] is the list of rules in their order, and the place to begin: runs of one node, topics that belong
//! together (actions, images, transforms), `equal` (robots of a fleet), nodes that are there in the same phases, `namespaces`
//! (collapsed ones). One rule needs the looks of the drawn boxes: `box_rows` (topics as rows of boxes).

pub(crate) mod box_rows;
pub(crate) mod equal;
pub(crate) mod namespaces;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::choose::{Selection, is_tf};
use super::{Grouping, Item, ItemKind, ViewOptions};
use crate::base::ids::grouped;
use crate::base::name::namespace;
use crate::base::time::{Span, Stamp};
use crate::evidence::Evidence;
use crate::graph::{ById, Element, Elements, Node, NodeId, PerElement, TopicId};
use crate::mission::phases::fill;
use equal::Fleets;
use namespaces::{Collapse, sent_from, swallows};

/// The kind and name of a box: elements with the same one are in one box.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ItemKey {
    pub(crate) kind: ItemKind,
    pub(crate) name: Arc<str>,
}

/// The box of each node and topic, if it has one; edges have none.
pub(crate) type Keys = PerElement<Option<ItemKey>>;

/// An element that moves to the box of others.
pub(crate) type Fold = (Element, ItemKey);

/// The box of each node and topic: its own, unless one of the rules moves it to that of others.
pub(crate) fn keys(
    elements: &Elements,
    options: &ViewOptions,
    fleets: &Fleets,
    selection: &Selection,
    groups: &Groups,
) -> Keys {
    let is_direct = options.mode.is_direct();
    let mut keys = own(elements, selection);
    if !options.exact_names {
        apply(&mut keys, runs_of_roles(elements));
    }
    if !is_direct {
        let folds = grouped_topics(groups, &keys);
        apply(&mut keys, folds);
    }
    let mut folds = fleets.folds(&keys);
    folds.retain(|(what, _)| what.is_node() || !is_direct);
    apply(&mut keys, folds);
    if !options.alike_in.is_empty() {
        let folds = alike_nodes(elements, &options.alike_in, &keys);
        apply(&mut keys, folds);
    }
    let folds = collapsed(elements, options, &keys);
    apply(&mut keys, folds);
    if is_direct {
        let is_inside = |key: &ItemKey| options.is_bundled && key.kind == ItemKind::Namespace;
        for id in elements.topics.ids() {
            if let Some(key) = keys.of_mut(Element::Topic(id)) {
                *key = key.take().filter(is_inside);
            }
        }
    }
    keys
}

/// A box for each chosen element.
fn own(elements: &Elements, selection: &Selection) -> Keys {
    PerElement::new(elements, |what| {
        let (kind, name) = match what {
            Element::Node(id) if selection.nodes[id].is_none() => {
                (ItemKind::Node, elements.nodes[id].name.shared())
            }
            Element::Topic(id) if selection.topics[id].is_none() => {
                (ItemKind::Topic, elements.topics[id].name.shared())
            }
            _ => return None,
        };
        Some(ItemKey { kind, name })
    })
}

/// The elements inside collapsed namespaces, except those with a single box.
fn collapsed(elements: &Elements, options: &ViewOptions, keys: &Keys) -> Vec<Fold> {
    let is_direct = options.mode.is_direct();
    let mut collapse = Collapse::new(options);
    if collapse.collapse.is_empty() {
        return Vec::new();
    }
    let nodes = elements.nodes.ids();
    let nodes = nodes.filter_map(|id| of(keys, Element::Node(id)));
    let topics = elements.topics.iter().filter(|_| !is_direct);
    let topics = topics.map(|topic| topic.name.as_str());
    collapse.open_single(&nodes.map(|key| &*key.name).collect(), &topics.collect());
    // Of each box of topics, the namespaces of its publishers and of its subscribers.
    let mut ends: BTreeMap<&ItemKey, [Vec<Option<&str>>; 2]> = BTreeMap::new();
    for (what, edge) in elements.edges() {
        let (node, topic) = (Element::Node(edge.node), Element::Topic(edge.topic));
        if let (Some(node), Some(topic)) = (of(keys, node), of(keys, topic)) {
            let way = usize::from(matches!(what, Element::Subscribe(_)));
            ends.entry(topic).or_default()[way].push(collapse.of(&node.name));
        }
    }
    let fold = |(what, key): (Element, &Option<ItemKey>)| {
        let key = key.as_ref()?;
        let own = collapse.of(&key.name);
        let [publishers, subscribers] =
            (ends.get(key)).map_or([&[][..]; 2], |[p, s]| [&p[..], &s[..]]);
        let is_open = || collapse.expand.contains(&*key.name);
        let space = match what {
            Element::Node(_) => own,
            _ if is_direct => sent_from(own, publishers),
            _ => swallows(own, publishers, subscribers).filter(|_| !is_open()),
        };
        let (kind, name) = (ItemKind::Namespace, space?.into());
        Some((what, ItemKey { kind, name }))
    };
    keys.iter().filter_map(fold).collect()
}

/// The box of an element, if it has one.
pub(crate) fn of(keys: &Keys, what: Element) -> Option<&ItemKey> {
    keys.of(what)?.as_ref()
}

/// Moves elements that have a box to those of others.
fn apply(keys: &mut Keys, folds: Vec<Fold>) {
    for (what, new) in folds {
        if let Some(Some(key)) = keys.of_mut(what) {
            *key = new;
        }
    }
}

// Topics that are drawn as one box: actions, service events, image transports, the transform tree.
//
// `/go/goal`, `/go/cancel`, `/go/status`, `/go/feedback` and `/go/result` are the box `/go/action_topics`.

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
        // `X/_action/feedback`, `X/_action/status` and the events of its hidden services.
        let of_ros2 =
            |name: &str| Some(name.split_once("/_action/")?.0.to_owned() + "/action_topics");
        take(&mut free, &mut groups, 2, |_, name| of_ros2(name));
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
fn grouped_topics(groups: &Groups, keys: &Keys) -> Vec<Fold> {
    let grouped = groups.values();
    let grouped: BTreeSet<Element> = grouped.flatten().map(|id| Element::Topic(*id)).collect();
    let others = keys
        .iter()
        .filter(|(what, _)| what.is_topic() && !grouped.contains(what));
    let taken = others.filter_map(|(_, key)| Some(Arc::clone(&key.as_ref()?.name)));
    let mut taken: BTreeSet<Arc<str>> = taken.collect();
    let mut folds = Vec::new();
    for (name, ids) in groups {
        let mut name = name.clone();
        while taken.contains(name.as_str()) {
            name.push_str("_2");
        }
        let (kind, name): (_, Arc<str>) = (ItemKind::Group, name.into());
        taken.insert(Arc::clone(&name));
        let key = ItemKey { kind, name };
        folds.extend(ids.iter().map(|id| (Element::Topic(*id), key.clone())));
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

// Nodes by role: the runs of one anonymous node are one box, named without the part that differs from run to
// run.
//
// `/rviz_1700000000_1` ends before `/rviz_1700000000_2` begins: both are `/rviz`. Side by side they are `/rviz` and
// `/rviz ~2`.

/// The runs of each role whose nodes existed one after the other.
fn runs_of_roles(elements: &Elements) -> Vec<Fold> {
    let nodes = elements.nodes.with_ids();
    let anonymous = nodes.filter(|(_, node)| is_anonymous(node));
    let mut by_role = grouped(anonymous.map(|(id, node)| (&node.role, (id, node))));
    by_role.retain(|role, runs| runs.len() > 1 && follow(runs) && !is_taken(elements, role));
    let folds = by_role.into_iter().flat_map(|(role, runs)| {
        let (kind, name) = (ItemKind::Node, Arc::clone(role));
        let key = ItemKey { kind, name };
        runs.into_iter()
            .map(move |(id, _)| (Element::Node(id), key.clone()))
    });
    folds.collect()
}

/// Gives each node's box its role as a label, numbered if several of a role exist at once: `/rviz`, `/rviz
/// ~2`; and each box of unnamed publishers its question mark: `?`, `? ×3`.
pub(crate) fn label(items: &mut [Item], elements: &Elements) {
    let mut order: Vec<(Stamp, usize, Arc<str>)> = Vec::new();
    for (at, item) in items.iter_mut().enumerate() {
        let (ItemKind::Node, [Element::Node(id)]) = (item.kind, &item.members[..]) else {
            continue;
        };
        let Some(node) = elements.nodes.get(*id) else {
            continue;
        };
        let mark = item.name.rfind('?');
        let is_unknown = node.seen.evidence == Evidence::of("unknown");
        if let Some(mark) = mark.filter(|_| is_unknown) {
            item.label = item.name[mark..].into();
        } else if is_anonymous(node) {
            let first = node.seen.first.unwrap_or(Stamp::MIN);
            order.push((first, at, Arc::clone(&node.role)));
        }
    }
    order.sort();
    let mut seen: BTreeMap<Arc<str>, usize> = BTreeMap::new();
    for (_, at, role) in order {
        let count = seen
            .entry(Arc::clone(&role))
            .or_insert_with(|| usize::from(is_taken(elements, &role)));
        *count += 1;
        items[at].label = match count {
            1 => role,
            n => format!("{role} ~{n}").into(),
        };
    }
}

fn is_anonymous(node: &Node) -> bool {
    *node.role != *node.name.as_str()
}

/// Whether a node has this role as its real name.
fn is_taken(elements: &Elements, role: &str) -> bool {
    elements.nodes.iter().any(|n| n.name.as_str() == role)
}

/// Whether each run was last seen before the next was first seen.
fn follow(runs: &mut [(NodeId, &Node)]) -> bool {
    runs.sort_by_key(|run| run.1.seen.first);
    runs.windows(2)
        .all(|pair| match (pair[0].1.seen.last, pair[1].1.seen.first) {
            (Some(last), Some(first)) => last < first,
            _ => false,
        })
}

// Nodes that are there in the same phases: those of one namespace are one box with all their names, where a still has no
// room for a box each. It hides no change, since they start and stop together.
//
// `/robot1/planner`, `/robot1/costmap` and `/robot1/controller` run while robot 1 navigates: one box with three names.

/// The nodes that move to the box of the first of those that are alike in these phases.
fn alike_nodes(elements: &Elements, phases: &[Span], keys: &Keys) -> Vec<Fold> {
    // Nodes outside of all namespaces have nothing else in common.
    let is_inside = |key: &&ItemKey| key.kind == ItemKind::Node && namespace(&key.name) != "/";
    let alike = |what| {
        let key = of(keys, what).filter(is_inside)?;
        let lives = &elements.seen(what).lives;
        let there: Vec<bool> = phases.iter().map(|phase| fill(lives, *phase)).collect();
        Some(((namespace(&key.name), there), what))
    };
    let nodes = elements.nodes.ids().map(Element::Node);
    let alike = grouped(nodes.filter_map(alike));
    let folds = alike.into_values().flat_map(|nodes| {
        let first = nodes.first().and_then(|what| of(keys, *what)).cloned();
        let fold = move |what| Some((what, first.clone()?));
        nodes.into_iter().filter_map(fold)
    });
    folds.collect()
}

/// The names of the nodes in a box beside its own, without those of runs of the same node.
pub(crate) fn others(elements: &Elements, name: &Arc<str>, members: &[Element]) -> Vec<Arc<str>> {
    let roles = members.iter().filter_map(|what| match what {
        Element::Node(id) => elements.nodes.get(*id).map(|node| Arc::clone(&node.role)),
        _ => None,
    });
    let mut roles: Vec<Arc<str>> = roles.filter(|role| role != name).collect();
    roles.sort_unstable();
    roles.dedup();
    roles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

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

    /// The labels of the boxes if these nodes exist in these seconds.
    fn labels(lives: &[(&str, i64, i64)]) -> Vec<String> {
        let names: Vec<&str> = lives.iter().map(|l| l.0).collect();
        let mut mission = mission(&[&names.join(" ")]);
        for (name, first, last) in lives {
            let node = mission
                .elements
                .nodes
                .iter_mut()
                .find(|n| n.name.as_str() == *name);
            let node = node.unwrap();
            node.role = name
                .trim_end_matches(|c: char| c == '_' || c.is_ascii_digit())
                .into();
            (node.seen.first, node.seen.last) = (Some(Stamp(*first)), Some(Stamp(*last)));
        }
        let (view, _) = view(&mission, &ViewOptions::default());
        view.items.iter().map(|i| i.label.to_string()).collect()
    }

    #[test]
    fn publishers_without_a_name_are_question_marks() {
        let mut mission = mission(&["/boss /scan"]);
        mission.elements.nodes[NodeId(1)].name = "/scan ? ×3".into();
        mission.elements.nodes[NodeId(1)].role = "/scan ? ×3".into();
        mission.elements.nodes[NodeId(1)].seen.evidence = Evidence::of("unknown");
        let (view, _) = view(&mission, &ViewOptions::default());
        let labels: Vec<_> = view.items.iter().map(|i| &*i.label).collect();
        assert_eq!(labels, ["/boss", "? ×3"]);
    }

    #[test]
    fn runs_that_follow_are_one_box_and_those_side_by_side_are_counted() {
        assert_eq!(labels(&[("/det_1", 0, 4), ("/det_2", 5, 9)]), ["/det"]);
        assert_eq!(
            labels(&[("/det_1", 3, 6), ("/det_2", 1, 9)]),
            ["/det ~2", "/det"]
        );
        assert_eq!(
            labels(&[("/det_1", 0, 4), ("/det", 0, 9)]),
            ["/det", "/det ~2"]
        );
    }
}
