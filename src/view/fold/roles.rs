//! Nodes by role: the runs of one anonymous node are one box, named without the part that differs from run to
//! run.
//!
//! `/rviz_1700000000_1` ends before `/rviz_1700000000_2` begins: both are `/rviz`. Side by side they are `/rviz` and
//! `/rviz ~2`.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Fold, ItemKey};
use crate::base::ids::grouped;
use crate::base::time::Stamp;
use crate::evidence::Evidence;
use crate::graph::{Element, Elements, Node, NodeId};
use crate::view::{Item, ItemKind};

/// The runs of each role whose nodes existed one after the other.
pub(crate) fn folds(elements: &Elements) -> Vec<Fold> {
    let nodes = elements.nodes.with_ids();
    let anonymous = nodes.filter(|(_, node)| is_anonymous(node));
    let mut by_role = grouped(anonymous.map(|(id, node)| (&node.role, (id, node))));
    by_role.retain(|role, runs| runs.len() > 1 && follow(runs) && !is_taken(elements, role));
    let folds = by_role.into_iter().flat_map(|(role, runs)| {
        runs.into_iter().map(|(id, _)| Fold {
            what: Element::Node(id),
            key: ItemKey {
                kind: ItemKind::Node,
                name: Arc::clone(role),
            },
        })
    });
    folds.collect()
}

/// Gives each node's box its role as a label, numbered if several of a role exist at once: `/rviz`, `/rviz
/// ~2`; and each box of unnamed publishers its question mark: `?`, `? ×3`.
pub(crate) fn label(items: &mut [Item], elements: &Elements) {
    let mut order: Vec<(Stamp, usize, Arc<str>)> = Vec::new();
    for (at, item) in items.iter_mut().enumerate() {
        let Some(node) = single_node(item, elements) else {
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

fn single_node<'a>(item: &Item, elements: &'a Elements) -> Option<&'a Node> {
    match (item.kind, &item.members[..]) {
        (ItemKind::Node, [Element::Node(id)]) => elements.nodes.get(*id),
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
fn follow(runs: &mut [(NodeId, &Node)]) -> bool {
    runs.sort_by_key(|run| run.1.seen.first);
    runs.windows(2)
        .all(|pair| match (pair[0].1.seen.last, pair[1].1.seen.first) {
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
