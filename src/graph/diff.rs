//! The exact difference between two graphs.

use crate::graph::{Element, ElementState, Graph};

/// The exact difference between two graphs: applied to the first it gives the second. Each list is sorted by element.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diff {
    /// States of new elements.
    pub added: Vec<ElementState>,
    /// Removed elements.
    pub removed: Vec<Element>,
    /// States before and after of elements that differ.
    pub changed: Vec<(ElementState, ElementState)>,
}

/// The difference from `before` to `after`.
pub fn diff(before: &Graph, after: &Graph) -> Diff {
    let mut diff = Diff::default();
    let mut old = before.states.iter().peekable();
    for new in &after.states {
        while let Some(gone) = old.next_if(|old| old.what < new.what) {
            diff.removed.push(gone.what);
        }
        match old.next_if(|old| old.what == new.what) {
            Some(old) if old == new => {}
            Some(old) => diff.changed.push((old.clone(), new.clone())),
            None => diff.added.push(new.clone()),
        }
    }
    diff.removed.extend(old.map(|gone| gone.what));
    diff
}
