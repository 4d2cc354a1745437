//! Nodes that are there in the same phases: those of one namespace are one box with all their names, where a still has no
//! room for a box each. It hides no change, since they start and stop together.
//!
//! `/robot1/planner`, `/robot1/costmap` and `/robot1/controller` run while robot 1 navigates: one box with three names.

use std::sync::Arc;

use super::{Fold, ItemKey, Keys, of};
use crate::base::ids::grouped;
use crate::base::name::namespace;
use crate::base::time::Span;
use crate::graph::{Element, Elements};
use crate::mission::phases::fill;
use crate::view::ItemKind;

/// The nodes that move to the box of the first of those that are alike in these phases.
pub(crate) fn folds(elements: &Elements, phases: &[Span], keys: &Keys) -> Vec<Fold> {
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
        let fold = move |what| {
            Some(Fold {
                what,
                key: ItemKey::clone(first.as_ref()?),
            })
        };
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
