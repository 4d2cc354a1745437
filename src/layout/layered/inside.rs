//! A part inside one namespace: its contents are laid out like a separate page, and framed.

use super::subplan::Subplan;
use super::{Draft, PlacedPart, parts};
use crate::base::geometry::{Point, Rect};
use crate::layout::spacing::PADDING;
use crate::layout::{Orientation, PartTask};

/// The part with its pieces packed inside the frames of the namespaces around all of it; `None` if there is
/// no such namespace, or no benefit: a single piece that is not `long`.
pub(crate) fn inside(task: PartTask<'_>, is_long: bool) -> Option<PlacedPart> {
    let (plan, part) = (task.plan, task.part);
    let root = part.root();
    if root == 0 {
        return None;
    }
    let inner = Subplan::new(plan, part, root, |_| true);
    if !is_long && parts::parts(&inner.plan).len() < 2 {
        return None;
    }
    let draft = Draft::new(&inner.plan, task.options)?;
    let (crossings, layout) = draft.assembled(task.orientation);
    let mut placed = PlacedPart::unplaced(part);
    inner.put(&layout, Point::default(), &mut placed);
    let mut frame = Rect::new(0.0, 0.0, layout.size.w, layout.size.h);
    for cluster in part.around(root) {
        frame = plan.clusters[part.clusters[cluster - 1]].frame(frame, PADDING);
        placed.clusters[cluster - 1] = frame;
    }
    placed.crossings = crossings;
    Some(placed.on_page(Orientation::LeftRight))
}
