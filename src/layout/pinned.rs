//! A layout that keeps the positions of an earlier one: known boxes stay, new ones are placed beside them.

use super::{Layout, Orientation, Plan, include};
use crate::base::geometry::{Point, Rect, Size};

/// The space around boxes, and inside the frames of clusters: an edge passes between.
const GAP: f64 = 10.0;
const PADDING: f64 = 8.0;
/// The largest distance from its neighbours at which a new box is tried, in steps of less than half a box: most of a page, beyond
/// which nobody looks for it.
const RINGS: i32 = 30;
const STEP: Size = Size::new(30.0, 20.0);

/// Boxes and clusters with known positions kept; routes are computed later. Boxes that grew keep their
/// middle; of two that would overlap now, the later one counts as new.
pub(crate) fn kept(plan: &Plan, known: &[Option<Rect>], orientation: Orientation) -> Layout {
    let mut table = PinnedBoxes {
        plan,
        boxes: vec![None; plan.vertices.len()],
    };
    for (v, vertex) in plan.vertices.iter().enumerate() {
        let is_sane = |length: f64| length.is_finite() && (0.0..=1e7).contains(&length);
        let old = known.get(v).copied().flatten();
        let old = old.filter(|r| [r.x, r.y, r.w, r.h].into_iter().all(is_sane));
        // It may have grown for its lines.
        let size = |old: Rect| Size::new(vertex.size.w.max(old.w), vertex.size.h.max(old.h));
        let place = old.map(|old| Rect::around(old.centre(), size(old)));
        table.boxes[v] = place.filter(|place| table.is_free(place, 0.0));
    }
    let mut neighbours = vec![Vec::new(); plan.vertices.len()];
    for i in plan.valid_links() {
        let link = &plan.links[i];
        neighbours[link.from].push(link.to);
        neighbours[link.to].push(link.from);
    }
    for (v, neighbours) in neighbours.iter().enumerate() {
        if table.boxes[v].is_none() {
            table.boxes[v] = Some(table.place_for(v, neighbours));
        }
    }
    let clusters = table.frames();
    let boxes = table.boxes.into_iter();
    let boxes: Vec<Rect> = boxes.map(Option::unwrap_or_default).collect();
    let all = boxes.iter().chain(&clusters);
    let whole = all.fold(Rect::default(), |all, rect| all.union(rect));
    Layout {
        orientation,
        size: Size::new(whole.right(), whole.bottom()),
        boxes,
        routes: Vec::new(),
        clusters,
        remarks: Vec::new(),
    }
}

/// The boxes placed so far.
struct PinnedBoxes<'a> {
    plan: &'a Plan,
    boxes: Vec<Option<Rect>>,
}

impl PinnedBoxes<'_> {
    fn is_free(&self, place: &Rect, gap: f64) -> bool {
        let place = place.grown(gap);
        let mut others = self.boxes.iter().flatten();
        !others.any(|other| other.overlaps(&place))
    }

    /// A free position near the neighbours, or else near the cluster, or else below everything.
    fn place_for(&mut self, v: usize, neighbours: &[usize]) -> Rect {
        let size = self.plan.vertices[v].size;
        let bottoms = self.boxes.iter().flatten().map(Rect::bottom);
        let below = bottoms.fold(0.0, f64::max) + 3.0 * GAP;
        let last = Rect::new(PADDING, below, size.w, size.h);
        let near = neighbours.iter().filter_map(|&u| self.boxes[u]);
        let mut near: Vec<Point> = near.map(|rect| rect.centre()).collect();
        if let Some(cluster) = self.plan.vertices[v].cluster {
            let frame = self.frames()[cluster];
            if frame.w > 0.0 {
                near.push(frame.centre());
            }
        }
        if near.is_empty() {
            return last;
        }
        let n = near.len() as f64;
        let goal = near.iter().fold(Point::default(), |sum, p| {
            Point::new(sum.x + p.x / n, sum.y + p.y / n)
        });
        for ring in 0..RINGS {
            for (x, y) in around(ring) {
                let (x, y) = (f64::from(x) * STEP.w, f64::from(y) * STEP.h);
                let place = Rect::around(Point::new(goal.x + x, goal.y + y), size);
                let inside = place.x >= PADDING && place.y >= PADDING;
                if inside && self.is_free(&place, GAP) && self.keeps_clusters(v, place) {
                    return place;
                }
            }
        }
        last
    }

    /// Whether every cluster would still contain its own members only.
    fn keeps_clusters(&mut self, v: usize, place: Rect) -> bool {
        let before = self.foreign();
        self.boxes[v] = Some(place);
        let after = self.foreign();
        self.boxes[v] = None;
        after <= before
    }

    /// The number of boxes and frames that are inside foreign clusters.
    fn foreign(&self) -> usize {
        let frames = self.frames();
        let mut count = 0;
        for (c, frame) in frames.iter().enumerate().filter(|(_, frame)| frame.w > 0.0) {
            for (at, vertex) in self.boxes.iter().zip(&self.plan.vertices) {
                let foreign = !self.holds(c, vertex.cluster);
                count += usize::from(foreign && at.is_some_and(|at| at.overlaps(frame)));
            }
            for (d, other) in frames.iter().enumerate().skip(c + 1) {
                count += usize::from(!self.holds(c, Some(d)) && other.overlaps(frame));
            }
        }
        count
    }

    /// Whether `inner` is `outer` or inside it.
    fn holds(&self, outer: usize, inner: Option<usize>) -> bool {
        let mut cluster = inner;
        while let Some(c) = cluster.filter(|&c| c != outer) {
            cluster = self.plan.clusters[c].parent;
        }
        cluster.is_some()
    }

    /// A frame around each cluster that has members.
    fn frames(&self) -> Vec<Rect> {
        let mut content: Vec<Option<Rect>> = vec![None; self.plan.clusters.len()];
        for (at, vertex) in self.boxes.iter().zip(&self.plan.vertices) {
            if let (Some(at), Some(c)) = (at, vertex.cluster) {
                include(&mut content[c], *at);
            }
        }
        let mut frames = vec![Rect::default(); content.len()];
        for (c, cluster) in self.plan.clusters.iter().enumerate().rev() {
            let Some(inside) = content[c] else {
                continue;
            };
            let frame = cluster.frame(inside, PADDING);
            frames[c] = frame;
            if let Some(parent) = cluster.parent {
                include(&mut content[parent], frame);
            }
        }
        frames
    }
}

/// The steps on the border of a square, nearest to its axes first.
fn around(ring: i32) -> Vec<(i32, i32)> {
    let square = (-ring..=ring).flat_map(|x| (-ring..=ring).map(move |y| (x, y)));
    let border = square.filter(|(x, y)| x.abs().max(y.abs()) == ring);
    let mut steps: Vec<(i32, i32)> = border.collect();
    steps.sort_by_key(|(x, y)| (x.abs() + y.abs(), -x, -y));
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::tests::{cluster, link, vertex};

    #[test]
    fn known_boxes_stay_and_new_ones_are_placed_beside() {
        let plan = Plan {
            vertices: vec![vertex(None), vertex(Some(0)), vertex(Some(0))],
            links: vec![link(0, 2)],
            clusters: vec![cluster(None)],
            ..Plan::default()
        };
        let known = [
            Some(Rect::new(20.0, 40.0, 80.0, 30.0)),
            Some(Rect::new(20.0, 120.0, 80.0, 30.0)),
            None,
        ];
        let layout = kept(&plan, &known, Orientation::LeftRight);
        assert_eq!(layout.boxes[..2], [known[0].unwrap(), known[1].unwrap()]);
        assert!(
            !layout.boxes[2].overlaps(&layout.boxes[0])
                && !layout.boxes[2].overlaps(&layout.boxes[1])
        );
        assert!(!layout.clusters[0].overlaps(&layout.boxes[0]));
    }
}
