//! The default name of a phase: the elements that began, else those that ended.

use std::sync::Arc;

use crate::base::name::last_part;
use crate::base::words::{count, some_of};

/// The most names listed: with more, the name of a phase is longer than its band in a figure.
const MOST: usize = 3;

/// The name by the changes: `11 nodes`, `+4 nodes: controller, costmap, planner and 1 more`, `+4 −1 nodes: …`,
/// `−1 node: replanner`, `same nodes`.
pub(crate) fn of_changes(
    is_first: bool,
    added: &[&Arc<str>],
    removed: &[&Arc<str>],
    unit: &str,
) -> Arc<str> {
    let text = match (is_first, added, removed) {
        (true, ..) => count(added.len(), unit),
        (_, [], []) => format!("same {unit}s"),
        (_, [], removed) => format!("−{}: {}", count(removed.len(), unit), listed(removed)),
        (_, added, []) => format!("+{}: {}", count(added.len(), unit), listed(added)),
        (_, added, gone) => {
            let changed = format!("+{} −{} {unit}s", added.len(), gone.len());
            format!("{changed}: {}", listed(added))
        }
    };
    Arc::from(text)
}

/// The name of a ramp: `ramp to 22 nodes`.
pub(crate) fn ramp(nodes: usize, unit: &str) -> Arc<str> {
    Arc::from(format!("ramp to {}", count(nodes, unit)))
}

fn listed(names: &[&Arc<str>]) -> String {
    let names: Vec<&str> = names.iter().map(|n| last_part(n)).collect();
    some_of(&names, MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_is_named_after_elements_that_began() {
        let names: Vec<Arc<str>> = ["/a/x", "/b/y", "/z", "/w"].map(Arc::from).to_vec();
        let all: Vec<&Arc<str>> = names.iter().collect();
        assert_eq!(&*of_changes(true, &all, &[], "node"), "4 nodes");
        let began = of_changes(false, &all, &[], "node");
        assert_eq!(&*began, "+4 nodes: x, y, z and 1 more");
        let both = of_changes(false, &all[..1], &all[1..3], "node");
        assert_eq!(&*both, "+1 −2 nodes: x");
        assert_eq!(&*of_changes(false, &[], &all[..1], "node"), "−1 node: x");
        assert_eq!(&*of_changes(false, &[], &[], "topic"), "same topics");
    }
}
