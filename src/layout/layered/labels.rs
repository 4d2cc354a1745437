//! The position of each edge's label: on the edge or beside it, without covering a box, a title, another edge
//! or another label.

use std::cell::Cell;
use std::collections::BTreeMap;

use crate::base::cast;
use crate::base::geometry::{Point, Rect, Size, on_cubic};
use crate::layout::{Layout, Plan, Route};

/// The positions that are tried for a label, as fractions of the edge's length, best first.
const STATIONS: [f64; 9] = [0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74, 0.18, 0.82];
/// A straight piece longer than this many cells is looked up in parts: its bounding rectangle is mostly
/// empty.
const LONG: f64 = 4.0;
/// The number of rectangles that may be checked for all labels together; beyond it, the labels of the longest
/// edges are left out. The largest graph that is laid out in layers needs a tenth of it.
const EFFORT: u64 = 20_000_000;
/// The number of cells in which edges may be registered, for all edges together; beyond it, the longest are
/// not avoided. Long edges of a drawing with tens of thousands of boxes in a column pass through thousands
/// each.
const CELLS: usize = 2_000_000;
/// The space between an edge and a label beside it: less than between two edges, so that it is the label of this one.
const ASIDE: f64 = 2.0;
/// The cost of a label that hides most of its own edge: more than that of the last station beside it, 1.3. And of one beside it that
/// touches it: as much as five stations; with none or twice as much, one label in a thousand more or fewer has a place.
const HIDING: f64 = 4.0;
const TOUCHING: f64 = 0.5;

/// Places the labels of all routes, those of short edges first; a label without any free position is omitted.
pub(crate) fn place(plan: &Plan, layout: &mut Layout) {
    let lines: Vec<Segments> = layout.routes.iter().map(Segments::new).collect();
    if plan.links.iter().all(|link| link.label.is_none()) {
        return;
    }
    let mut order: Vec<usize> = (0..lines.len()).collect();
    let length = |i: usize| lines[i].length();
    order.sort_by(|&a, &b| length(a).total_cmp(&length(b)).then(a.cmp(&b)));
    let area = layout.size.w * layout.size.h / layout.boxes.len().max(1) as f64;
    let mut taken = Obstacles::new(area.sqrt().max(40.0));
    for rect in &layout.boxes {
        taken.insert(rect.grown(1.0), 0);
    }
    for (frame, cluster) in layout.clusters.iter().zip(&plan.clusters) {
        let Size { w, h } = cluster.title;
        taken.insert(Rect::new(frame.x + 4.0, frame.y + 2.0, w + 4.0, h), 0);
    }
    for label in layout.labels(plan) {
        taken.insert(label.grown(0.5), 0);
    }
    let mut edges = Obstacles::new(taken.cell);
    for &i in &order {
        if edges.noted > CELLS {
            break;
        }
        for piece in lines[i].points.windows(2) {
            edges.insert_line(piece[0], piece[1], i);
        }
    }
    for i in order {
        if taken.looks.get() + edges.looks.get() > EFFORT {
            break;
        }
        let label = plan.links[i].label;
        let Some(size) = label.filter(|_| layout.routes[i].label.is_none()) else {
            continue;
        };
        layout.routes[i].label = lines[i].spot(size, i, &taken, &edges);
        if let Some(spot) = layout.routes[i].label {
            taken.insert(Rect::around(spot, size).grown(0.5), 0);
        }
    }
}

/// Moves and enlarges the layout if a label is outside of it.
pub(crate) fn make_room(plan: &Plan, layout: &mut Layout) {
    let before = Rect::new(0.0, 0.0, layout.size.w, layout.size.h);
    let labels = layout.labels(plan);
    let whole = labels.fold(before, |all, label| all.union(&label));
    if whole != before {
        layout.cropped(whole);
    }
}

/// A route as a chain of short straight pieces.
struct Segments {
    points: Vec<Point>,
    /// The distance of each point from the start, along the line.
    at: Vec<f64>,
}

impl Segments {
    fn new(route: &Route) -> Self {
        let mut points = vec![route.start];
        for &[a, b, to] in &route.curves {
            let from = points[points.len() - 1];
            let is_level = |along: fn(&Point) -> f64| {
                let apart = |p: &Point| (along(p) - along(&from)).abs();
                [a, b, to].iter().all(|p| apart(p) < 0.1)
            };
            let is_straight = is_level(|p| p.x) || is_level(|p| p.y);
            let steps = if is_straight { 1 } else { 8 };
            let parts = (1..=steps).map(|step| f64::from(step) / f64::from(steps));
            points.extend(parts.map(|t| on_cubic([from, a, b, to], t)));
        }
        let mut at = vec![0.0];
        for piece in points.windows(2) {
            let last = at[at.len() - 1];
            at.push(last + piece[0].distance(piece[1]));
        }
        Self { points, at }
    }

    fn length(&self) -> f64 {
        self.at.last().copied().unwrap_or(0.0)
    }

    /// The point at a fraction of the length, and whether the line is closer to horizontal there.
    fn station(&self, part: f64) -> Option<(Point, bool)> {
        let goal = self.length() * part;
        let is_here = |at: &[f64]| at[0] <= goal && goal <= at[1] && at[0] < at[1];
        let i = self.at.windows(2).position(is_here)?;
        let (a, b) = (self.points[i], self.points[i + 1]);
        let t = (goal - self.at[i]) / (self.at[i + 1] - self.at[i]);
        Some((a.towards(b, t), (b.x - a.x).abs() > (b.y - a.y).abs()))
    }

    /// The best middle for a label of this size on or beside its `own` edge, if one is free and on no other edge.
    fn spot(&self, size: Size, own: usize, taken: &Obstacles, edges: &Obstacles) -> Option<Point> {
        let mut best: Option<(f64, Point)> = None;
        for (turn, &part) in STATIONS.iter().enumerate() {
            let Some((point, sideways)) = self.station(part) else {
                continue;
            };
            for (penalty, spot) in self.around(point, size, sideways) {
                let cost = penalty + 0.1 * turn as f64;
                if best.is_some_and(|(least, _)| least <= cost)
                    || taken.hits(&Rect::around(spot, size)).any(|_| true)
                {
                    continue;
                }
                // A label on another edge would be taken for that edge's label.
                let place = Rect::around(spot, size);
                let hits: Vec<usize> = edges.hits(&place).collect();
                if hits.iter().any(|edge| *edge != own) {
                    continue;
                }
                // One beside its own edge should not hide parts of it.
                let is_touching = spot != point && !hits.is_empty();
                let cost = cost + if is_touching { TOUCHING } else { 0.0 };
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, spot));
                }
            }
        }
        best.map(|(_, spot)| spot)
    }

    /// The middles on and beside a point of the line, each with its cost.
    fn around(&self, point: Point, size: Size, sideways: bool) -> [(f64, Point); 3] {
        let (hidden, away) = if sideways {
            (size.w, Point::new(0.0, size.h / 2.0 + ASIDE))
        } else {
            (size.h, Point::new(size.w / 2.0 + ASIDE, 0.0))
        };
        let is_long = self.length() > 2.5 * hidden;
        let on = if is_long { 0.3 } else { HIDING };
        [
            (on, point),
            (0.4, Point::new(point.x - away.x, point.y - away.y)),
            (0.5, Point::new(point.x + away.x, point.y + away.y)),
        ]
    }
}

/// Rectangles, each with a number, that can be searched by position.
struct Obstacles {
    cell: f64,
    cells: BTreeMap<(i64, i64), Vec<usize>>,
    rects: Vec<(Rect, usize)>,
    /// The number of registered rectangles; each counts once per cell.
    noted: usize,
    /// The number of rectangles that were checked.
    looks: Cell<u64>,
}

impl Obstacles {
    fn new(cell: f64) -> Self {
        Self {
            cell,
            cells: BTreeMap::new(),
            rects: Vec::new(),
            noted: 0,
            looks: Cell::new(0),
        }
    }

    /// The rectangles around a straight line, in parts if it is long.
    fn insert_line(&mut self, a: Point, b: Point, number: usize) {
        let long = (b.x - a.x).abs().max((b.y - a.y).abs());
        let parts = libm::ceil(long / (LONG * self.cell)).max(1.0);
        for k in 0..cast::to_u32(parts) {
            let ends = [k, k + 1].map(|end| a.towards(b, f64::from(end) / parts));
            self.insert(Rect::of_points(ends).unwrap_or_default(), number);
        }
    }

    fn insert(&mut self, rect: Rect, number: usize) {
        for cell in self.cells_of(&rect) {
            self.noted += 1;
            self.cells.entry(cell).or_default().push(self.rects.len());
        }
        self.rects.push((rect, number));
    }

    /// The numbers of the rectangles that share a point with this one; a number may occur more than once.
    fn hits<'a>(&'a self, rect: &'a Rect) -> impl Iterator<Item = usize> + 'a {
        let near = self.cells_of(rect).into_iter();
        let near = near.filter_map(|cell| self.cells.get(&cell)).flatten();
        near.map(|&i| &self.rects[i])
            .inspect(|_| self.looks.set(self.looks.get() + 1))
            .filter(|(other, _)| touches(other, rect))
            .map(|&(_, number)| number)
    }

    fn cells_of(&self, rect: &Rect) -> Vec<(i64, i64)> {
        let cell = |at: f64| cast::to_i64((at / self.cell).floor());
        let rows = cell(rect.y)..=cell(rect.bottom());
        rows.flat_map(|row| (cell(rect.x)..=cell(rect.right())).map(move |column| (row, column)))
            .collect()
    }
}

/// Whether the two share a point; a rectangle may be as thin as a line.
fn touches(a: &Rect, b: &Rect) -> bool {
    a.x < b.right()
        && b.x < a.right().max(a.x + 1e-6)
        && a.y < b.bottom()
        && b.y < a.bottom().max(a.y + 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::tests::{link, vertex};
    use crate::layout::{Link, Orientation};

    fn labelled(w: f64, h: f64) -> Link {
        Link {
            label: Some(Size::new(w, h)),
            ..link(0, 1)
        }
    }

    fn plan(links: Vec<Link>) -> Plan {
        Plan {
            vertices: vec![vertex(None); 2],
            links,
            clusters: vec![],
            ..Plan::default()
        }
    }

    fn straight(from: Point, to: Point) -> Route {
        let at = |part: f64| {
            Point::new(
                from.x + (to.x - from.x) * part,
                from.y + (to.y - from.y) * part,
            )
        };
        Route {
            start: from,
            curves: vec![[at(0.25), at(0.75), to]],
            label: None,
        }
    }

    /// Two boxes of 80 by 30, one in the corner, with these routes.
    fn layout(orientation: Orientation, second: Point, routes: Vec<Route>) -> Layout {
        let second = Rect::new(second.x, second.y, 80.0, 30.0);
        Layout {
            orientation,
            size: Size::new(second.right(), second.bottom()),
            boxes: vec![Rect::new(0.0, 0.0, 80.0, 30.0), second],
            routes,
            ..Layout::default()
        }
    }

    #[test]
    fn labels_on_adjacent_edges_do_not_overlap() {
        let plan = plan(vec![labelled(40.0, 13.0); 2]);
        let level = |y: f64| straight(Point::new(80.0, y), Point::new(200.0, y));
        let routes = vec![level(12.0), level(18.0)];
        let mut layout = layout(Orientation::LeftRight, Point::new(200.0, 0.0), routes);
        place(&plan, &mut layout);
        let [a, b] = [0, 1].map(|i| layout.labels(&plan).nth(i).unwrap());
        assert!(!a.overlaps(&b));
        let free = |boxed: &Rect| !boxed.overlaps(&a) && !boxed.overlaps(&b);
        assert!(layout.boxes.iter().all(free));
    }

    #[test]
    fn a_label_beside_its_edge_does_not_touch_it_if_there_is_space() {
        let plan = plan(vec![labelled(60.0, 13.0)]);
        let [from, to] = [Point::new(80.0, 60.0), Point::new(180.0, 60.0)];
        let bend = [Point::new(110.0, 90.0), Point::new(150.0, 90.0)];
        let route = Route {
            start: from,
            curves: vec![[bend[0], bend[1], to]],
            label: None,
        };
        let end = Point::new(180.0, 45.0);
        let mut layout = layout(Orientation::LeftRight, end, vec![route]);
        place(&plan, &mut layout);
        let label = layout.labels(&plan).next().unwrap();
        let touched = (0..=100).any(|k| {
            let point = on_cubic([from, bend[0], bend[1], to], f64::from(k) / 100.0);
            label.overlaps(&Rect::around(point, Size::new(1.0, 1.0)))
        });
        assert!(!touched, "{label:?}");
    }

    #[test]
    fn labels_do_not_overlap_an_edge_that_bulges_between_ends_above_each_other() {
        let plan = plan(vec![labelled(20.0, 13.0), link(0, 1)]);
        let across = straight(Point::new(80.0, 95.0), Point::new(130.0, 95.0));
        let [top, bottom] = [30.0, 160.0].map(|y| Point::new(40.0, y));
        let bulge = [Point::new(130.0, 95.0); 2];
        let bulging = Route {
            start: top,
            curves: vec![[bulge[0], bulge[1], bottom]],
            label: None,
        };
        let curve = [top, bulge[0], bulge[1], bottom];
        let routes = vec![across, bulging];
        let mut layout = layout(Orientation::TopBottom, Point::new(0.0, 160.0), routes);
        place(&plan, &mut layout);
        let label = layout.labels(&plan).next().unwrap();
        let covered = (0..=100).any(|k| {
            let point = on_cubic(curve, f64::from(k) / 100.0);
            label.overlaps(&Rect::around(point, Size::new(1.0, 1.0)))
        });
        assert!(!covered, "{label:?}");
    }

    #[test]
    fn labels_do_not_overlap_other_edges() {
        let crowded = plan(vec![labelled(40.0, 13.0), link(0, 1), link(0, 1)]);
        let upright = |x: f64| straight(Point::new(x, 30.0), Point::new(x, 160.0));
        let routes = [40.0, 30.0, 50.0].map(upright).to_vec();
        let mut layout = layout(Orientation::TopBottom, Point::new(0.0, 160.0), routes);
        place(&crowded, &mut layout);
        assert_eq!(layout.routes[0].label, None);
        // Without its neighbours it is beside the line, and the layout is enlarged if necessary.
        let alone = plan(vec![labelled(70.0, 50.0)]);
        layout.routes.truncate(1);
        place(&alone, &mut layout);
        make_room(&alone, &mut layout);
        let label = layout.labels(&alone).next().unwrap();
        assert!(label.x >= 0.0 && label.right() <= layout.size.w);
        assert!(layout.boxes.iter().all(|b| !b.overlaps(&label)));
    }
}
