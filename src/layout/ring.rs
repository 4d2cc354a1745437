//! A third engine, for few boxes with many edges among them: the boxes around the page's rim, the edges across its
//! middle.
//!
//! With layers, most of these edges would pass most of the boxes. On a rim no box lies between two others.

use super::layered::labels;
use super::{Engine, Layout, LayoutOptions, Orientation, Plan, Route, Vertex};
use crate::base::error::{Error, Result};
use crate::base::geometry::{Point, Rect, Size};

/// The largest number of boxes; more would crowd the rim.
pub(crate) const MOST: usize = 16;
/// The least space between consecutive boxes on the rim, for the labels between them.
const GAP: f64 = 60.0;
/// The distances, relative to its length, by which an edge may bend to its right, so that the two directions
/// between two boxes are separate. If it would touch a third box, the next one is tried.
const BENDS: [f64; 7] = [0.1, 0.06, 0.16, 0.22, 0.02, -0.06, -0.14];
/// The space between an edge and a box that it passes.
const CLEAR: f64 = 4.0;
/// The number of pieces in which a curve is checked.
const PIECES: u32 = 48;

/// The engine behind `--layout ring`.
pub(crate) struct Ring;

impl Engine for Ring {
    fn lay_out(&self, plan: &Plan, options: &LayoutOptions) -> Result<Layout> {
        if plan.vertices.len() > MOST {
            return Err(Error::usage(
                format!("a ring has at most {MOST} boxes"),
                "use `--layout layered`, or show fewer elements",
            ));
        }
        let boxes = around(plan, options.page);
        let routes = plan.links.iter().map(|link| {
            let ends = (plan.vertices.get(link.from), plan.vertices.get(link.to));
            match ends {
                (Some(from), Some(to)) => route([link.from, link.to], [from, to], &boxes),
                _ => Route::default(),
            }
        });
        let mut layout = Layout {
            orientation: Orientation::LeftRight,
            size: Size::default(),
            routes: routes.collect(),
            clusters: vec![Rect::default(); plan.clusters.len()],
            boxes,
            remarks: Vec::new(),
        };
        labels::place(&plan.without_clusters(), &mut layout);
        Ok(moved_to_corner(layout, plan))
    }
}

/// The boxes on a rounded rim of the page's aspect, in an order that keeps those with edges between them near.
fn around(plan: &Plan, page: Size) -> Vec<Rect> {
    let n = plan.vertices.len();
    let widest = plan.vertices.iter().map(|v| v.size.w).fold(0.0, f64::max);
    let highest = plan.vertices.iter().map(|v| v.size.h).fold(0.0, f64::max);
    let aspect = (page.w / page.h).clamp(0.5, 3.0);
    // The rim is about five times its half height long on a square page.
    let each = f64::midpoint(widest, highest) + GAP;
    let half = (n as f64 * each / (2.8 * (1.0 + aspect))).max(highest + GAP);
    let order = order(plan);
    let mut boxes = vec![Rect::default(); n];
    for (at, v) in order.into_iter().enumerate() {
        let angle = std::f64::consts::TAU * (at as f64 + 0.5) / n.max(1) as f64;
        let centre = Point::new(
            half * aspect * rounded(libm::cos(angle)),
            half * rounded(libm::sin(angle)),
        );
        boxes[v] = Rect::around(centre, plan.vertices[v].size);
    }
    boxes
}

/// Pulls a coordinate of the unit circle outwards, so that the rim fills the corners of the page too.
fn rounded(part: f64) -> f64 {
    libm::copysign(libm::pow(part.abs(), 0.75), part)
}

/// The order of the vertices along the rim: swapped pairwise as long as that shortens edges.
fn order(plan: &Plan) -> Vec<usize> {
    let n = plan.vertices.len();
    let mut order: Vec<usize> = (0..n).collect();
    let far = |order: &[usize]| -> usize {
        let mut at = vec![0; n];
        order.iter().enumerate().for_each(|(i, v)| at[*v] = i);
        let links = plan.valid_links().map(|i| plan.links[i]);
        let apart = links.map(|l| at[l.from].abs_diff(at[l.to]));
        apart.map(|d| d.min(n - d)).sum()
    };
    let mut best = far(&order);
    let mut is_better = true;
    while is_better {
        is_better = false;
        for i in 0..n {
            for j in i + 1..n {
                order.swap(i, j);
                let now = far(&order);
                if now < best {
                    (best, is_better) = (now, true);
                } else {
                    order.swap(i, j);
                }
            }
        }
    }
    order
}

/// The route from box to box that touches no other box: with the first bend that allows it, or else with the
/// last.
fn route(places: [usize; 2], ends: [&Vertex; 2], boxes: &[Rect]) -> Route {
    let [from, to] = places.map(|v| boxes[v]);
    if places[0] == places[1] {
        return turn(from);
    }
    let others: Vec<Rect> = (0..boxes.len())
        .filter(|v| !places.contains(v))
        .map(|v| boxes[v].grown(CLEAR))
        .collect();
    let is_clear = |curve: &[Point; 4]| {
        let points = (0..=PIECES).map(|k| on(curve, f64::from(k) / f64::from(PIECES)));
        let mut met = points.filter(|p| others.iter().any(|b| holds(b, *p)));
        met.next().is_none()
    };
    let curves = BENDS.map(|bend| swung(from.centre(), to.centre(), bend));
    let curve = curves.iter().find(|c| is_clear(c)).unwrap_or(&curves[0]);
    let inside = |rect: &Rect, vertex: &Vertex, p: Point| vertex.outline.holds(rect, p);
    let start = border(|t| inside(&from, ends[0], on(curve, t)));
    let end = 1.0 - border(|t| inside(&to, ends[1], on(curve, 1.0 - t)));
    let [a, b, c, d] = part(curve, start, end.max(start + 1e-3));
    Route {
        start: a,
        curves: vec![[b, c, d]],
        label: None,
    }
}

/// A loop beside the right side of a box.
fn turn(rect: Rect) -> Route {
    let at = |dx: f64, part: f64| Point::new(rect.right() + dx, rect.y + rect.h * part);
    Route {
        start: at(0.0, 0.3),
        curves: vec![[at(26.0, 0.1), at(26.0, 0.9), at(0.0, 0.7)]],
        label: None,
    }
}

/// A curve to the right of the straight line, by `bend` times its length.
fn swung(a: Point, b: Point, bend: f64) -> [Point; 4] {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    // A cubic reaches three quarters of the way to its controls.
    let aside = bend / 0.75;
    let at = |t: f64| Point::new(a.x + dx * t - dy * aside, a.y + dy * t + dx * aside);
    [a, at(0.3), at(0.7), b]
}

fn holds(rect: &Rect, p: Point) -> bool {
    p.x > rect.x && p.x < rect.right() && p.y > rect.y && p.y < rect.bottom()
}

/// The parameter, from 0 to about a half, at which a curve leaves its box: the last one that is inside.
fn border(is_inside: impl Fn(f64) -> bool) -> f64 {
    let (mut inside, mut outside) = (0.0, 0.5);
    for _ in 0..30 {
        let middle = f64::midpoint(inside, outside);
        if is_inside(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    outside
}

/// The two parts of a curve: up to `at`, and from there on.
fn split(curve: &[Point; 4], at: f64) -> [[Point; 4]; 2] {
    let [a, b, c, d] = *curve;
    let (ab, bc, cd) = (a.towards(b, at), b.towards(c, at), c.towards(d, at));
    let (abc, bcd) = (ab.towards(bc, at), bc.towards(cd, at));
    let middle = abc.towards(bcd, at);
    [[a, ab, abc, middle], [middle, bcd, cd, d]]
}

fn on(curve: &[Point; 4], t: f64) -> Point {
    split(curve, t)[1][0]
}

/// The curve between two of its parameters.
fn part(curve: &[Point; 4], start: f64, end: f64) -> [Point; 4] {
    let rest = split(curve, start)[1];
    split(&rest, (end - start) / (1.0 - start).max(1e-6))[0]
}

/// Everything moved so that its top left corner is (0, 0), labels included.
fn moved_to_corner(mut layout: Layout, plan: &Plan) -> Layout {
    let routes = Rect::of_points(layout.routes.iter().flat_map(Route::points));
    let all = layout
        .boxes
        .iter()
        .copied()
        .chain(routes)
        .chain(layout.labels(plan));
    let whole = all.reduce(|a, b| a.union(&b)).unwrap_or_default();
    layout.cropped(whole);
    layout
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::tests::{link, vertex};

    fn plan(n: usize) -> Plan {
        let mut plan = Plan {
            vertices: vec![vertex(None); n],
            ..Plan::default()
        };
        for from in 0..n {
            for to in 0..n {
                plan.links.push(link(from, to));
            }
        }
        plan
    }

    fn page() -> LayoutOptions {
        LayoutOptions {
            page: Size::new(1280.0, 560.0),
            ..LayoutOptions::default()
        }
    }

    #[test]
    fn edges_avoid_other_boxes_and_boxes_do_not_overlap() {
        for n in 1..=MOST {
            let plan = plan(n);
            let layout = Ring.lay_out(&plan, &page()).unwrap();
            for (link, route) in plan.links.iter().zip(&layout.routes) {
                let curve = [
                    route.start,
                    route.curves[0][0],
                    route.curves[0][1],
                    route.curves[0][2],
                ];
                for k in 0..=100 {
                    let p = on(&curve, f64::from(k) / 100.0);
                    for (v, rect) in layout.boxes.iter().enumerate() {
                        let is_end = [link.from, link.to].contains(&v);
                        assert!(is_end || !holds(rect, p), "{n} boxes, {link:?} meets {v}");
                    }
                }
            }
            for (i, a) in layout.boxes.iter().enumerate() {
                let mut rest = layout.boxes[i + 1..].iter();
                assert!(!rest.any(|b| a.overlaps(b)), "{n} boxes");
            }
        }
    }

    #[test]
    fn edges_end_at_the_outlines() {
        let plan = plan(5);
        let layout = Ring.lay_out(&plan, &page()).unwrap();
        let distance = |rect: &Rect, p: Point| {
            let (x, y) = (p.x - rect.centre().x, p.y - rect.centre().y);
            (x.abs() / rect.w * 2.0).max(y.abs() / rect.h * 2.0)
        };
        for (link, route) in plan.links.iter().zip(&layout.routes) {
            if link.from != link.to {
                let end = route.curves[0][2];
                assert!((distance(&layout.boxes[link.from], route.start) - 1.0).abs() < 0.01);
                assert!((distance(&layout.boxes[link.to], end) - 1.0).abs() < 0.01);
            }
        }
    }

    #[test]
    fn too_many_boxes_are_refused() {
        assert!(Ring.lay_out(&plan(MOST + 1), &page()).is_err());
    }
}
