//! The default name of a phase: the elements that began, else those that ended.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::base::name::{ShortNames, lies_in, namespace};
use crate::base::words::{count, some_of};

/// The names of what exists in a phase.
type Existing = BTreeSet<Arc<str>>;

/// The most names listed: with more, the name of a phase is longer than its band in a figure.
const MOST: usize = 3;

/// The names of the phases of a mission.
pub(crate) struct PhaseNames<'a> {
    /// What is counted: `node` or `topic`.
    unit: &'static str,
    short: ShortNames<'a>,
}

impl<'a> PhaseNames<'a> {
    /// Names for phases in which these elements exist.
    pub(crate) fn new(unit: &'static str, all: impl Iterator<Item = &'a str>) -> Self {
        let short = all.collect();
        Self { unit, short }
    }

    /// The name by the changes: `11 nodes`, `+4 nodes: controller, costmap, planner and 1 more`, `+4 −1 nodes: …`,
    /// `−1 node: replanner`, `same nodes`.
    pub(crate) fn of_changes(
        &self,
        before: Option<&Existing>,
        added: &[&Arc<str>],
        removed: &[&Arc<str>],
    ) -> Arc<str> {
        let unit = self.unit;
        let text = match (before, added, removed) {
            (None, ..) => count(added.len(), unit),
            (_, [], []) => format!("same {unit}s"),
            (_, [], removed) => {
                format!("−{}: {}", count(removed.len(), unit), self.listed(removed))
            }
            (Some(before), added, gone) => {
                let names = began(before, added).unwrap_or_else(|| self.listed(added));
                let changed = match gone.len() {
                    0 => count(added.len(), unit),
                    gone => format!("{} −{gone} {unit}s", added.len()),
                };
                format!("+{changed}: {names}")
            }
        };
        Arc::from(text)
    }

    /// The name of a ramp: `ramp to 22 nodes`.
    pub(crate) fn ramp(&self, nodes: usize) -> Arc<str> {
        Arc::from(format!("ramp to {}", count(nodes, self.unit)))
    }

    fn listed(&self, names: &[&Arc<str>]) -> String {
        some_of(names.iter().map(|name| self.short.of(name)), MOST)
    }
}

/// The namespace that begins as a whole, if all that is added is in one in which nothing was before: `robot2`.
fn began(before: &Existing, added: &[&Arc<str>]) -> Option<String> {
    let first = namespace(added.first()?);
    let end = first.match_indices('/').nth(1);
    let space = end.map_or(first, |(at, _)| &first[..at]);
    let all_in = added.iter().all(|name| lies_in(name, space));
    let is_new = !before.iter().any(|name| lies_in(name, space));
    (space.len() > 1 && added.len() > 1 && all_in && is_new).then(|| space[1..].to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_is_named_after_elements_that_began() {
        let names: Vec<Arc<str>> = ["/a/x", "/b/y", "/c/y", "/w"].map(Arc::from).to_vec();
        let all: Vec<&Arc<str>> = names.iter().collect();
        let before: Existing = names[..1].iter().cloned().collect();
        let phases = PhaseNames::new("node", names.iter().map(|name| &**name));
        let of = |added: &[&Arc<str>], removed: &[&Arc<str>]| {
            phases.of_changes(Some(&before), added, removed).to_string()
        };
        assert_eq!(&*phases.of_changes(None, &all, &[]), "4 nodes");
        assert_eq!(of(&all, &[]), "+4 nodes: x, b/y, c/y and 1 more");
        assert_eq!(of(&all[..1], &all[1..3]), "+1 −2 nodes: x");
        assert_eq!(of(&[], &all[..1]), "−1 node: x");
        let topics = PhaseNames::new("topic", [].into_iter());
        assert_eq!(&*topics.of_changes(Some(&before), &[], &[]), "same topics");
    }

    #[test]
    fn a_namespace_that_begins_as_a_whole_names_its_phase() {
        let names: Vec<Arc<str>> = ["/b/nav/x", "/b/y", "/c/y"].map(Arc::from).to_vec();
        let all: Vec<&Arc<str>> = names.iter().collect();
        let phases = PhaseNames::new("node", names.iter().map(|name| &**name));
        let of = |before: &[Arc<str>], added: &[&Arc<str>]| {
            let before = before.iter().cloned().collect();
            phases.of_changes(Some(&before), added, &[]).to_string()
        };
        assert_eq!(of(&[], &all[..2]), "+2 nodes: b");
        assert_eq!(of(&[], &all), "+3 nodes: x, b/y and c/y");
        assert_eq!(of(&[Arc::from("/b/z")], &all[..2]), "+2 nodes: x and b/y");
    }
}
