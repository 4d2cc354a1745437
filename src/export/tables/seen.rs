//! The rows of tables of elements: an element in each window.

use crate::base::time::Span;
use crate::graph::{Element, ElementState, Id, NodeLoad};
use crate::mission::Mission;

/// An element in a window.
pub(super) struct Seen {
    /// The index of the window.
    pub(super) win: usize,
    pub(super) span: Span,
    pub(super) state: ElementState,
    /// The skew of a topic over all windows.
    pub(super) skew: Option<f64>,
    pub(super) load: Option<NodeLoad>,
}

/// A function that takes an element.
pub(super) type SeenTaker<'a> = &'a mut dyn FnMut(&Seen);

/// The elements of a kind in each window.
pub(super) fn each(mission: &Mission, is_kind: fn(&Element) -> bool, take: SeenTaker<'_>) {
    let skews = mission.skews();
    for (window, graph) in mission.each() {
        // Of nodes, which come first.
        let has_loads = is_kind(&Element::Node(Id::of(0)));
        let loads = has_loads.then(|| graph.loads(&mission.elements));
        let mut loads = loads.into_iter().flatten();
        for state in graph.states {
            let load = loads.next();
            if is_kind(&state.what) {
                take(&Seen {
                    win: window.index,
                    span: window.span,
                    skew: match state.what {
                        Element::Topic(id) => skews.get(id).copied().flatten(),
                        _ => None,
                    },
                    load,
                    state,
                });
            }
        }
    }
}
