//! The fallback for graphs too large for layers: boxes packed by namespace, edges as straight as possible.

use super::pack::pack;
use super::routes::around;
use super::{Layout, LayoutOptions, Orientation, Plan};
use crate::base::geometry::{Point, Rect, Size};

/// The space between boxes, and between a frame and its boxes: no lines run there.
const GAP: f64 = 14.0;
const PADDING: f64 = 8.0;

/// The layout with all boxes packed, clusters around their members; it uses the sibling modules for packing
/// and routing.
pub(crate) fn lay_out(plan: &Plan, options: &LayoutOptions) -> Layout {
    let (n, k) = (plan.vertices.len(), plan.clusters.len());
    // Indices `n..` are clusters; the last group contains vertices in none.
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); k + 1];
    for (v, vertex) in plan.vertices.iter().enumerate() {
        members[vertex.cluster.unwrap_or(k)].push(v);
    }
    let mut sizes: Vec<Size> = plan.vertices.iter().map(|vertex| vertex.size).collect();
    sizes.resize(n + k, Size::default());
    let mut corners = vec![Point::default(); n + k];
    for (c, cluster) in plan.clusters.iter().enumerate().rev() {
        if members[c].is_empty() {
            continue;
        }
        let inside = packed(&members[c], &sizes, options.page, &mut corners);
        let width = inside.w.max(cluster.title.w);
        sizes[n + c] = Size::new(
            width + 2.0 * PADDING,
            inside.h + cluster.title.h + 2.0 * PADDING,
        );
        members[cluster.parent.unwrap_or(k)].push(n + c);
    }
    let size = packed(&members[k], &sizes, options.page, &mut corners);
    for (c, cluster) in plan.clusters.iter().enumerate() {
        let corner = Point::new(
            corners[n + c].x + PADDING,
            corners[n + c].y + cluster.title.h + PADDING,
        );
        for &member in &members[c] {
            corners[member] =
                Point::new(corners[member].x + corner.x, corners[member].y + corner.y);
        }
    }
    let rects = corners
        .iter()
        .zip(&sizes)
        .map(|(at, size)| Rect::new(at.x, at.y, size.w, size.h));
    let mut boxes: Vec<Rect> = rects.collect();
    let clusters = boxes.split_off(n);
    let (routes, _) = around::routes(plan, &boxes);
    Layout {
        orientation: options.orientation.unwrap_or(Orientation::LeftRight),
        size,
        boxes,
        routes,
        clusters,
        remarks: vec![
            "too large for layers: packed by namespace; edges may cross boxes".to_owned(),
        ],
    }
}

/// Packs some members and records their corners; returns the total size.
fn packed(members: &[usize], sizes: &[Size], page: Size, corners: &mut [Point]) -> Size {
    let own: Vec<Size> = members.iter().map(|&member| sizes[member]).collect();
    let (places, whole) = pack(&own, page, GAP);
    for (&member, place) in members.iter().zip(places) {
        corners[member] = place;
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::tests::{cluster, link, vertex};

    #[test]
    fn clusters_hold_their_members_only() {
        let plan = Plan {
            vertices: vec![vertex(Some(1)), vertex(None), vertex(Some(0))],
            links: vec![link(0, 1)],
            clusters: vec![cluster(None), cluster(Some(0))],
            ..Plan::default()
        };
        let page = Size::new(800.0, 450.0);
        let layout = lay_out(
            &plan,
            &LayoutOptions {
                page,
                ..LayoutOptions::default()
            },
        );
        let inside = |v: usize, c: usize| layout.boxes[v].overlaps(&layout.clusters[c]);
        assert!(inside(0, 1) && inside(0, 0) && inside(2, 0));
        assert!(!inside(2, 1) && !inside(1, 0));
    }
}
