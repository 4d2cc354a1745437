//! Nodes by role: the runs of one anonymous node are one box, named without the part that differs from run to
//! run.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::time::Stamp;
use crate::evidence::Evidence;
use crate::graph::{ById, Elements, Node, NodeId};
use crate::view::{Item, ItemKind};

/// Per node of the mission, the name of its box: its role, if all nodes of that role existed one after the
/// other.
pub(crate) fn boxes(elements: &Elements) -> ById<NodeId, Arc<str>> {
    let mut by_role: BTreeMap<&str, Vec<&Node>> = BTreeMap::new();
    for node in elements.nodes.iter().filter(|n| is_anonymous(n)) {
        by_role.entry(&node.role).or_default().push(node);
    }
    by_role.retain(|role, runs| runs.len() > 1 && follow(runs) && !is_taken(elements, role));
    let name = |node: &Node| {
        let folded = is_anonymous(node) && by_role.contains_key(&*node.role);
        if folded {
            Arc::clone(&node.role)
        } else {
            node.name.shared()
        }
    };
    elements.nodes.iter().map(name).collect()
}

/// Gives each node's box its role as a label, numbered if several of a role exist at once: `/rviz`, `/rviz
/// ~2`.
pub(crate) fn label(items: &mut [Item], elements: &Elements) {
    let mut seen: BTreeMap<Arc<str>, usize> = BTreeMap::new();
    let mut order: Vec<(Stamp, usize, Arc<str>)> = Vec::new();
    for (at, item) in items.iter().enumerate() {
        let Some(node) = single_node(item, elements).filter(|n| is_anonymous(n)) else {
            continue;
        };
        let first = node.seen.first.unwrap_or(Stamp::MIN);
        order.push((first, at, Arc::clone(&node.role)));
    }
    order.sort();
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

/// Labels each box of unnamed publishers with its question mark as a label: `?`, `? ×3`.
pub(crate) fn label_unknown(items: &mut [Item], elements: &Elements) {
    for item in items {
        let node = single_node(item, elements);
        if node.is_some_and(|n| n.seen.evidence == Evidence::of("unknown"))
            && let Some(mark) = item.name.rfind('?')
        {
            item.label = item.name[mark..].into();
        }
    }
}

fn single_node<'a>(item: &Item, elements: &'a Elements) -> Option<&'a Node> {
    match (item.kind, &item.members[..]) {
        (ItemKind::Node, [crate::graph::Element::Node(id)]) => elements.nodes.get(*id),
        _ => None,
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
fn follow(runs: &mut [&Node]) -> bool {
    runs.sort_by_key(|n| n.seen.first);
    runs.windows(2)
        .all(|pair| match (pair[0].seen.last, pair[1].seen.first) {
            (Some(last), Some(first)) => last < first,
            _ => false,
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

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
