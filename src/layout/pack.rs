//! The packing of blocks side by side: shelves, tallest first, towards the page's aspect; and the layout that packs all boxes,
//! for graphs too large for layers.

use super::routes::around;
use super::{Layout, LayoutOptions, Orientation, Plan};
use crate::base::geometry::{Point, Rect, Size};

/// Top left corners for blocks of these sizes, `gap` apart, and the size of the whole. Several widths are
/// tried, and the one with the largest scale on the page is used.
pub(crate) fn pack(sizes: &[Size], page: Size, gap: f64) -> (Vec<Point>, Size) {
    let widest = sizes.iter().map(|size| size.w).fold(0.0, f64::max);
    let area: f64 = sizes.iter().map(|s| (s.w + gap) * (s.h + gap)).sum();
    let ideal = (area * page.w / page.h).sqrt();
    let tried = (0..24).map(|step| {
        let width = widest.max(ideal * (0.8 + 0.05 * f64::from(step)));
        let (places, whole) = shelves(sizes, width, gap);
        (fit(whole, page), (places, whole))
    });
    let best = tried.reduce(|best, next| if next.0 > best.0 { next } else { best });
    best.map(|(_, packed)| packed).unwrap_or_default()
}

/// Top left corners for blocks of these sizes, at least `gap` from what the others take (`taken`, for each block relative
/// to its corner), and the size of the whole: the largest block first, each further one where the whole stays largest on
/// the page, in a gap of an earlier one if it fits.
pub(crate) fn nested(
    sizes: &[Size],
    taken: &[Vec<Rect>],
    page: Size,
    gap: f64,
) -> (Vec<Point>, Size) {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    let area = |i: &usize| sizes[*i].w * sizes[*i].h;
    order.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
    let mut places = vec![Point::default(); sizes.len()];
    let (mut whole, mut full) = (Size::default(), Vec::<Rect>::new());
    for i in order {
        let starts = |end: fn(&Rect) -> f64| {
            let ends = full.iter().map(|taken| end(taken) + gap);
            let mut starts: Vec<f64> = std::iter::once(0.0).chain(ends).collect();
            starts.sort_by(f64::total_cmp);
            starts.dedup_by(|a, b| (*a - *b).abs() < SAME);
            starts
        };
        let (xs, ys) = (starts(Rect::right), starts(Rect::bottom));
        let mut best: Option<(f64, Point, Size)> = None;
        let corners = ys.iter();
        for at in corners.flat_map(|y| xs.iter().map(|x| Point::new(*x, *y))) {
            let (right, bottom) = (at.x + sizes[i].w, at.y + sizes[i].h);
            let size = Size::new(whole.w.max(right), whole.h.max(bottom));
            let scale = fit(size, page);
            if best.as_ref().is_some_and(|best| best.0 >= scale) {
                continue;
            }
            let own = Rect::new(at.x, at.y, sizes[i].w, sizes[i].h).grown(gap - SAME);
            if !full.iter().any(|other| other.overlaps(&own)) {
                best = Some((scale, at, size));
            }
        }
        if let Some((_, at, size)) = best {
            (places[i], whole) = (at, size);
            full.extend(taken[i].iter().map(|rect| rect.moved(at)));
        }
    }
    (places, whole)
}

/// The difference below which two positions are the same, in pixels.
const SAME: f64 = 0.5;

/// The scale at which a drawing fills the page.
pub(crate) fn fit(whole: Size, page: Size) -> f64 {
    (page.w / whole.w.max(1.0)).min(page.h / whole.h.max(1.0))
}

/// The corners of blocks on shelves of this width, the highest blocks first, and the total size; `gap` is the
/// space between blocks side by side, and between shelves.
fn shelves(sizes: &[Size], width: f64, gap: f64) -> (Vec<Point>, Size) {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[b].h.total_cmp(&sizes[a].h).then(a.cmp(&b)));
    let mut places = vec![Point::default(); sizes.len()];
    let (mut x, mut y, mut shelf, mut whole) = (0.0, 0.0, 0.0_f64, Size::default());
    for i in order {
        if x > 0.0 && x + sizes[i].w > width {
            (x, y) = (0.0, y + shelf + gap);
            shelf = 0.0;
        }
        places[i] = Point::new(x, y);
        whole = Size::new(whole.w.max(x + sizes[i].w), whole.h.max(y + sizes[i].h));
        x += sizes[i].w + gap;
        shelf = shelf.max(sizes[i].h);
    }
    (places, whole)
}

/// The space between boxes, and between a frame and its boxes: no lines run there.
const GAP: f64 = 14.0;
const PADDING: f64 = 8.0;

/// The layout with all boxes packed by namespace, edges as straight as possible.
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
        let (width, height) = (inside.w.max(cluster.title.w), inside.h + cluster.title.h);
        sizes[n + c] = Size::new(width + 2.0 * PADDING, height + 2.0 * PADDING);
        members[cluster.parent.unwrap_or(k)].push(n + c);
    }
    let size = packed(&members[k], &sizes, options.page, &mut corners);
    for (c, cluster) in plan.clusters.iter().enumerate() {
        let Point { x, y } = corners[n + c];
        let (x, y) = (x + PADDING, y + cluster.title.h + PADDING);
        for &member in &members[c] {
            corners[member] = Point::new(corners[member].x + x, corners[member].y + y);
        }
    }
    let rects = corners.iter().zip(&sizes);
    let rects = rects.map(|(at, size)| Rect::new(at.x, at.y, size.w, size.h));
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
    fn twelve_squares_fill_a_wide_page() {
        let (places, whole) = pack(
            &[Size::new(100.0, 100.0); 12],
            Size::new(1600.0, 900.0),
            10.0,
        );
        assert_eq!(places.len(), 12);
        assert!((1.2..2.5).contains(&(whole.w / whole.h)), "{whole:?}");
    }

    #[test]
    fn an_empty_graph_has_no_size() {
        assert_eq!(
            pack(&[], Size::new(1.0, 1.0), 10.0),
            (Vec::new(), Size::default())
        );
    }

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
