//! The lines of a window: those of a namespace merged while they are unchanged, and one label for each fork.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::spotlight::Spotlight;
use super::{Picture, measured};
use crate::draw::scene::{Group, Piece};
use crate::graph::Id as _;
use crate::view::{ArrowId, SeenWindow};

impl Picture<'_> {
    /// The glows of the lines of a window, which cover no head of another, the lines, and their labels; changed ones last, so
    /// that they are on top.
    pub(super) fn lines(
        &self,
        seen: &SeenWindow,
        spotlight: Option<&Spotlight<'_>>,
    ) -> [Vec<Group>; 3] {
        let measured = &self.measured;
        let links = &measured.graph.plan.links;
        let look = |id: ArrowId| measured::find(&seen.arrows, id.at());
        let mut drawn = Vec::new();
        let mut in_gates = BTreeSet::new();
        for (gate, path) in &self.gates {
            if let Some((shown, lines)) = gate.shown(measured.view, look) {
                in_gates.extend(lines);
                drawn.push((
                    &gate.arrow,
                    path,
                    Cow::Owned(shown),
                    links[gate.lead.at()].fork,
                ));
            }
        }
        for &id in self.order.iter().filter(|id| !in_gates.contains(id)) {
            let (arrow, path) = (&measured.view.arrows[id], &self.tracks[id.at()]);
            if let Some(shown) = look(id) {
                drawn.push((arrow, path, Cow::Borrowed(shown), links[id.at()].fork));
            }
        }
        drawn.sort_by_key(|(.., shown, _)| shown.mark.is_some());
        // The lines of a fork have one label: that of a line that changed, which is on top.
        let mut last: BTreeMap<usize, usize> = BTreeMap::new();
        for (k, (.., fork)) in drawn.iter().enumerate() {
            last.extend(fork.map(|fork| (fork, k)));
        }
        let pen = self.pen();
        let mut groups = [(); 3].map(|()| Vec::new());
        for (arrow, path, shown, fork) in &drawn {
            let ends = [arrow.from, arrow.to].map(|id| measured::find(&seen.items, id.at()));
            let mut parts = pen.arrow_parts(arrow, path, shown, ends);
            let spot = spotlight.filter(|spot| !spot.has_line(arrow, shown));
            for part in &mut parts {
                spot.inspect(|spot| spot.pale(part));
            }
            let named = fork.and_then(|fork| last.get(&fork)).map(|at| drawn[*at].1);
            if named.is_some_and(|other| {
                !std::ptr::eq(other, *path) && other.label_area() == path.label_area()
            }) {
                let label = &mut parts[2].pieces;
                label.retain(|piece| !matches!(piece, Piece::Text(_)));
            }
            for (group, part) in groups.iter_mut().zip(parts) {
                group.extend(Some(part).filter(|part| !part.pieces.is_empty()));
            }
        }
        groups
    }
}
