//! Quality metrics of a layout, for any engine.

#![allow(dead_code, reason = "the properties look at some of the numbers only")]
#![allow(
    clippy::many_single_char_names,
    reason = "formulas of analytic geometry"
)]

use bagreel::internals::base::geometry::{Point, Rect, Size};
use bagreel::internals::layout::{Layout, Outline, Plan, Route};

/// The metrics of one layout.
#[derive(Default)]
pub(crate) struct Measures {
    /// Pairs of boxes that overlap.
    pub(crate) overlaps: usize,
    /// Edges through boxes that are neither of their ends, by more than 2 px.
    pub(crate) through: usize,
    /// Points where two edges cross, except within 3 px of a box that both end at.
    pub(crate) crossings: usize,
    /// Edge labels placed, and pairs of labels, or label and box, that overlap.
    pub(crate) labels: usize,
    pub(crate) label_overlaps: usize,
    /// Labels on another edge that are not on their own.
    pub(crate) strayed: usize,
    /// Labels on another edge.
    pub(crate) crossed: usize,
    /// Vertices inside a cluster that is not theirs.
    pub(crate) foreign: usize,
    /// The number of route segments that are not straight and horizontal.
    pub(crate) bends: usize,
    /// The length of all edges, in pixels.
    pub(crate) length: f64,
}

/// Measures a layout.
pub(crate) fn measure(plan: &Plan, layout: &Layout) -> Measures {
    let lines: Vec<Vec<Point>> = layout.routes.iter().map(flat).collect();
    let labels: Vec<Rect> = layout
        .routes
        .iter()
        .zip(&plan.links)
        .filter_map(|(route, link)| Some(Rect::around(route.label?, link.label?)))
        .collect();
    let pairs = |rects: &[Rect]| {
        let later = |i: usize| {
            rects[i + 1..]
                .iter()
                .filter(|r| r.overlaps(&rects[i]))
                .count()
        };
        (0..rects.len()).map(later).sum::<usize>()
    };
    let on_boxes = labels
        .iter()
        .map(|l| layout.boxes.iter().filter(|b| b.overlaps(l)).count())
        .sum::<usize>();
    Measures {
        overlaps: pairs(&layout.boxes),
        through: through(plan, layout, &lines),
        crossings: crossings(plan, layout, &lines),
        labels: labels.len(),
        label_overlaps: pairs(&labels) + on_boxes,
        strayed: strayed(plan, layout, &lines),
        crossed: crossed(plan, layout, &lines),
        foreign: foreign(plan, layout),
        bends: layout.routes.iter().map(bends).sum(),
        length: lines.iter().flat_map(|line| line.windows(2)).map(far).sum(),
    }
}

fn crossed(plan: &Plan, layout: &Layout, lines: &[Vec<Point>]) -> usize {
    let labels = layout.routes.iter().zip(&plan.links).enumerate();
    // The arcs of self loops are measured in more segments here than in the layout.
    let labels = labels.filter(|(_, (_, link))| link.from != link.to);
    let labels = labels.filter_map(|(i, (route, link))| {
        // Two may touch; `enters` looks 2 px further inside.
        Some((i, Rect::around(route.label?, link.label?).grown(1.5)))
    });
    let is_crossed = |&(own, label): &(usize, Rect)| {
        let mut others = lines.iter().enumerate().filter(|(i, _)| *i != own);
        others.any(|(_, line)| {
            line.windows(2)
                .any(|pair| enters(pair, &label, Outline::Box))
        })
    };
    labels.filter(is_crossed).count()
}

fn strayed(plan: &Plan, layout: &Layout, lines: &[Vec<Point>]) -> usize {
    let mut count = 0;
    for (i, (route, link)) in layout.routes.iter().zip(&plan.links).enumerate() {
        let (Some(middle), Some(size)) = (route.label, link.label) else {
            continue;
        };
        // Lines are measured in more segments here than in the layout.
        let (core, whole) = (Size::new(3.0, 3.0), Size::new(size.w - 3.0, size.h - 3.0));
        let on = |line: &Vec<Point>, size: Size| {
            let area = Rect::around(middle, size);
            line.windows(2)
                .any(|pair| enters(pair, &area.grown(2.0), Outline::Box))
        };
        let others = lines.iter().enumerate().filter(|(k, _)| *k != i);
        let is_on_another = others.into_iter().any(|(_, line)| on(line, whole));
        count += usize::from(is_on_another && !on(&lines[i], core));
    }
    count
}

fn far(pair: &[Point]) -> f64 {
    (pair[0].x - pair[1].x).hypot(pair[0].y - pair[1].y)
}

/// A route as points.
fn flat(route: &Route) -> Vec<Point> {
    let mut points = vec![route.start];
    let mut from = route.start;
    for &[a, b, to] in &route.curves {
        let off =
            |p: Point| ((to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x)).abs();
        let steps = if off(a) + off(b) < 1.0 { 1 } else { 12 };
        for step in 1..=steps {
            let t = f64::from(step) / f64::from(steps);
            let u = 1.0 - t;
            let mix = |f: fn(&Point) -> f64| {
                u * u * u * f(&from)
                    + 3.0 * u * u * t * f(&a)
                    + 3.0 * u * t * t * f(&b)
                    + t * t * t * f(&to)
            };
            points.push(Point::new(mix(|p| p.x), mix(|p| p.y)));
        }
        from = to;
    }
    points
}

fn bends(route: &Route) -> usize {
    let mut from = route.start;
    let mut count = 0;
    for curve in &route.curves {
        let to = curve[2];
        count += usize::from((from.x - to.x).abs() > 0.5 && (from.y - to.y).abs() > 0.5);
        from = to;
    }
    count
}

fn through(plan: &Plan, layout: &Layout, lines: &[Vec<Point>]) -> usize {
    let mut count = 0;
    for (line, link) in lines.iter().zip(&plan.links) {
        for (v, at) in layout.boxes.iter().enumerate() {
            if v != link.from && v != link.to {
                count += usize::from(
                    line.windows(2)
                        .any(|pair| enters(pair, at, plan.vertices[v].outline)),
                );
            }
        }
    }
    count
}

/// Whether a straight segment enters a shape by more than 2 px.
fn enters(pair: &[Point], at: &Rect, outline: Outline) -> bool {
    let inner = at.grown(-2.0);
    let (low, high) = (pair[0].x.min(pair[1].x), pair[0].x.max(pair[1].x));
    if low > inner.right() || high < inner.x || inner.w <= 0.0 || inner.h <= 0.0 {
        return false;
    }
    let centre = inner.centre();
    let unit = |p: Point| {
        Point::new(
            (p.x - centre.x) / (inner.w / 2.0),
            (p.y - centre.y) / (inner.h / 2.0),
        )
    };
    let (a, b) = (unit(pair[0]), unit(pair[1]));
    (0..=40).any(|step| {
        let t = f64::from(step) / 40.0;
        let (x, y) = (a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t);
        match outline {
            Outline::Box | Outline::Capsule => x.abs() < 1.0 && y.abs() < 1.0,
            Outline::Ellipse => x * x + y * y < 1.0,
        }
    })
}

fn crossings(plan: &Plan, layout: &Layout, lines: &[Vec<Point>]) -> usize {
    let mut pieces: Vec<(Point, Point, usize)> = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        pieces.extend(line.windows(2).map(|pair| (pair[0], pair[1], i)));
    }
    let low = |p: &(Point, Point, usize)| p.0.x.min(p.1.x);
    pieces.sort_by(|a, b| low(a).total_cmp(&low(b)));
    let mut count = 0;
    for (i, a) in pieces.iter().enumerate() {
        let end = a.0.x.max(a.1.x);
        for b in pieces[i + 1..].iter().take_while(|b| low(b) <= end) {
            if a.2 == b.2 {
                continue;
            }
            if let Some(at) = crossing(a, b) {
                let (p, q) = (&plan.links[a.2], &plan.links[b.2]);
                let near = |v: usize| {
                    layout.boxes[v]
                        .grown(3.0)
                        .overlaps(&Rect::new(at.x, at.y, 1e-6, 1e-6))
                };
                let shared = [p.from, p.to]
                    .into_iter()
                    .any(|v| (v == q.from || v == q.to) && near(v));
                count += usize::from(!shared);
            }
        }
    }
    count
}

fn crossing(a: &(Point, Point, usize), b: &(Point, Point, usize)) -> Option<Point> {
    let (rx, ry) = (a.1.x - a.0.x, a.1.y - a.0.y);
    let (sx, sy) = (b.1.x - b.0.x, b.1.y - b.0.y);
    let turn = rx * sy - ry * sx;
    let (qx, qy) = (b.0.x - a.0.x, b.0.y - a.0.y);
    let (t, u) = ((qx * sy - qy * sx) / turn, (qx * ry - qy * rx) / turn);
    let inside = |t: f64| (0.0..1.0).contains(&t);
    (turn.abs() > 1e-9 && inside(t) && inside(u))
        .then(|| Point::new(a.0.x + t * rx, a.0.y + t * ry))
}

fn foreign(plan: &Plan, layout: &Layout) -> usize {
    let inside = |v: usize, c: usize| {
        let mut at = plan.vertices[v].cluster;
        while let Some(here) = at {
            if here == c {
                return true;
            }
            at = plan.clusters[here].parent;
        }
        false
    };
    let mut count = 0;
    for (c, frame) in layout.clusters.iter().enumerate() {
        for (v, at) in layout.boxes.iter().enumerate() {
            count += usize::from(at.overlaps(frame) != inside(v, c));
        }
    }
    count
}
