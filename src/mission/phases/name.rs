//! What a phase is called as long as nobody gives it a name: what began, else what ended.

use std::sync::Arc;

use crate::base::name::last_part;

/// The most names that are listed.
const MOST: usize = 3;

/// `11 nodes`, `+4 nodes: controller, costmap, planner and 1 more`, `−3 nodes: replanner, …`, `same nodes`.
pub(crate) fn of_changes(
    is_first: bool,
    added: &[&Arc<str>],
    removed: &[&Arc<str>],
    unit: &str,
) -> Arc<str> {
    let text = match (is_first, added, removed) {
        (true, ..) => counted(added.len(), unit),
        (_, [], []) => format!("same {unit}s"),
        (_, [], removed) => format!("−{}: {}", counted(removed.len(), unit), listed(removed)),
        (_, added, _) => format!("+{}: {}", counted(added.len(), unit), listed(added)),
    };
    Arc::from(text)
}

/// `ramp to 22 nodes`.
pub(crate) fn ramp(nodes: usize, unit: &str) -> Arc<str> {
    Arc::from(format!("ramp to {}", counted(nodes, unit)))
}

fn counted(n: usize, unit: &str) -> String {
    format!("{n} {unit}{}", if n == 1 { "" } else { "s" })
}

fn listed(names: &[&Arc<str>]) -> String {
    let first: Vec<&str> = names.iter().take(MOST).map(|n| last_part(n)).collect();
    match names.len() - first.len() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_is_named_by_what_began() {
        let names: Vec<Arc<str>> = ["/a/x", "/b/y", "/z", "/w"].map(Arc::from).to_vec();
        let all: Vec<&Arc<str>> = names.iter().collect();
        assert_eq!(&*of_changes(true, &all, &[], "node"), "4 nodes");
        let began = of_changes(false, &all, &all[..1], "node");
        assert_eq!(&*began, "+4 nodes: x, y, z and 1 more");
        assert_eq!(&*of_changes(false, &[], &all[..1], "node"), "−1 node: x");
        assert_eq!(&*of_changes(false, &[], &[], "topic"), "same topics");
    }
}
