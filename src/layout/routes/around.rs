//! Routes between boxes at arbitrary positions: straight if nothing is in the way, else around the corners of
//! boxes.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::base::geometry::{Point, Rect};
use crate::layout::routes::PORTS;
use crate::layout::{Outline, Plan, Route};

/// The distance that an edge keeps from other boxes, and at which it turns around their corners: outside that distance, so
/// that it does not touch them in turning.
const CLEAR: f64 = 3.0;
const TURN: f64 = 5.0;
/// The distance of edges between the same two boxes, that of ports.
const PARALLEL: f64 = 6.0;
/// The number of pairs of line and box that may be checked for all edges together; the remaining edges are
/// straight.
const EFFORT: usize = 40_000_000;
/// The effort of a possible step: as the steps of a path wait together, it also bounds their memory, to 100 MB.
const STEP: usize = 16;

/// A route per link, and the number of them that run through other boxes because no route was found.
pub(crate) fn routes(plan: &Plan, boxes: &[Rect]) -> (Vec<Route>, usize) {
    let mut map = Map::new(boxes);
    let mut met: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut routes = vec![Route::default(); plan.links.len()];
    let mut straight = 0;
    for i in plan.valid_links() {
        let (from, to) = (plan.links[i].from, plan.links[i].to);
        let count = met.entry((from.min(to), from.max(to))).or_insert(0);
        *count += 1;
        let ends = [from, to].map(|at| End {
            at,
            rect: boxes[at],
            outline: plan.vertices[at].outline,
        });
        if from == to {
            routes[i] = ends[0].self_loop(*count);
            continue;
        }
        let (a, b) = shifted(&ends, *count);
        let way = map.way(a, b, (from, to)).unwrap_or_else(|| {
            straight += 1;
            vec![a, b]
        });
        routes[i] = drawn(&ends, &way);
    }
    (routes, straight)
}

/// The distance from a box of a lane that an edge turns into: the length of an arrow's head, and half the space between
/// boxes without lines.
const LANE: f64 = 10.0;
/// The length of the bend of an edge that leaves a frame at another height: less than the space between layers.
const JOG: f64 = 16.0;
/// The difference below which two positions across are the same, in pixels.
const SAME: f64 = 0.05;
/// The radius at which an edge with given points turns: an arrow's head, which needs a straight end.
const BEND: f64 = 9.0;

/// The end of a route: the index of a box, its rectangle and its outline.
#[derive(Clone, Copy)]
pub(crate) struct End {
    pub(crate) at: usize,
    pub(crate) rect: Rect,
    pub(crate) outline: Outline,
}

/// A route along these points with round corners.
fn rounded(way: &[Point]) -> Route {
    let mut route = Route::new(way[0], Vec::new());
    let mut at = way[0];
    for three in way.windows(3) {
        let (corner, next) = (three[1], three[2]);
        let (before, after) = (towards(corner, at), towards(corner, next));
        route.curves.push(straight(at, before));
        route.curves.push([
            before.towards(corner, 2.0 / 3.0),
            after.towards(corner, 2.0 / 3.0),
            after,
        ]);
        at = after;
    }
    route.curves.push(straight(at, way[way.len() - 1]));
    route
}

/// The point at which the turn around a corner begins on the way to another point: half the way at most.
fn towards(corner: Point, other: Point) -> Point {
    let length = corner.distance(other).max(1e-9);
    corner.towards(other, (BEND / length).min(0.5))
}

fn straight(p: Point, q: Point) -> [Point; 3] {
    [p.towards(q, 1.0 / 3.0), p.towards(q, 2.0 / 3.0), q]
}

impl Route {
    /// The route with its start at another height: a first bend becomes higher; a level piece, which may pass between
    /// other boxes, begins with a bend.
    fn raised(&self, y: f64) -> Self {
        let mut raised = self.clone();
        let Some(first) = raised.curves.first_mut() else {
            return raised;
        };
        let (start, end) = (self.start, first[2]);
        raised.start.y = y;
        if (end.y - start.y).abs() > SAME {
            first[0].y = y;
        } else if (y - start.y).abs() > SAME {
            let turn = Point::new(start.x + (end.x - start.x).clamp(-JOG, JOG), start.y);
            let middle = f64::midpoint(start.x, turn.x);
            *first = straight(turn, end);
            let bend = [Point::new(middle, y), Point::new(middle, turn.y), turn];
            raised.curves.insert(0, bend);
        }
        raised
    }

    /// The route with straight pieces along these points before it, and round corners between them.
    fn along(&self, points: &[Point]) -> Self {
        let way: Vec<Point> = points.iter().copied().chain([self.start]).collect();
        let mut led = rounded(&way);
        led.curves.extend(&self.curves);
        led.label = self.label;
        led
    }
}

impl End {
    /// A small arc on top of a box, the later ones around the earlier.
    fn self_loop(&self, count: usize) -> Route {
        let (rect, n) = (self.rect, count as f64);
        let half = (3.0 + 3.0 * n).min(rect.w / 4.0);
        let (x, top) = (rect.centre().x, rect.y - 6.0 - 8.0 * n);
        let foot =
            |x: f64| self.leaves(Point::new(x, rect.centre().y), Point::new(x, rect.y - 1.0));
        let (start, end) = (foot(x - half), foot(x + half));
        let arc = [Point::new(start.x, top), Point::new(end.x, top), end];
        Route::new(start, vec![arc])
    }

    /// A route that starts at a side of the box with its start `aside` of the middle of that side.
    pub(crate) fn moved(&self, route: &Route, aside: f64) -> Route {
        let y = self.rect.centre().y + aside;
        let mut moved = route.raised(y);
        moved.start = self.beside(y, route.start.x);
        moved
    }

    /// The point of the outline at height `y`, on the side of a point at `x`.
    fn beside(&self, y: f64, x: f64) -> Point {
        let middle = self.rect.centre().x;
        let beyond = middle + self.rect.w.copysign(x - middle);
        self.leaves(Point::new(middle, y), Point::new(beyond, y))
    }

    /// The point where the line from a point inside to a point outside leaves the outline.
    fn leaves(&self, inside: Point, outside: Point) -> Point {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = f64::midpoint(low, high);
            if self
                .outline
                .holds(&self.rect, inside.towards(outside, middle))
            {
                low = middle;
            } else {
                high = middle;
            }
        }
        inside.towards(outside, high)
    }
}

/// The ends of the `count`-th edge between two boxes, inside both, beside those of the edges before.
fn shifted([from, to]: &[End; 2], count: usize) -> (Point, Point) {
    let (start, end) = (from.rect.centre(), to.rect.centre());
    let is_even = count.is_multiple_of(2);
    let step = (count / 2) as f64 * if is_even { PARALLEL } else { -PARALLEL };
    // Edges in both directions use the same side.
    let step = if from.at < to.at { step } else { -step };
    let length = start.distance(end).max(1e-9);
    let (x, y) = ((start.y - end.y) / length, (end.x - start.x) / length);
    let inside = |rect: Rect| {
        let (wide, high, centre) = (rect.w / 4.0, rect.h / 4.0, rect.centre());
        let (x, y) = ((x * step).clamp(-wide, wide), (y * step).clamp(-high, high));
        Point::new(centre.x + x, centre.y + y)
    };
    (inside(from.rect), inside(to.rect))
}

/// The route along a path, cut at the outlines, as straight pieces.
fn drawn([a, b]: &[End; 2], way: &[Point]) -> Route {
    let last = way.len() - 1;
    let start = a.leaves(way[0], way[1]);
    let mut points = vec![start];
    points.extend(&way[1..last]);
    points.push(b.leaves(way[last], way[last - 1]));
    let piece = |pair: &[Point]| straight(pair[0], pair[1]);
    Route::new(start, points.windows(2).map(piece).collect())
}

/// The obstacles in the way of edges, and the points where an edge can turn.
#[derive(Default)]
pub(crate) struct Map {
    obstacles: Vec<Rect>,
    corners: Vec<Point>,
    effort: usize,
}

impl Map {
    pub(crate) fn new(boxes: &[Rect]) -> Self {
        // If checking every corner against every box exceeds the effort, no route would be found: all edges
        // are straight.
        if boxes.len().saturating_mul(boxes.len()) > EFFORT {
            return Self::default();
        }
        let obstacles: Vec<Rect> = boxes.iter().map(|rect| rect.grown(CLEAR)).collect();
        let mut corners = Vec::new();
        for rect in boxes.iter().map(|rect| rect.grown(TURN)) {
            for (x, y) in [
                (rect.x, rect.y),
                (rect.right(), rect.y),
                (rect.x, rect.bottom()),
                (rect.right(), rect.bottom()),
            ] {
                let dot = Rect::new(x, y, 1e-6, 1e-6);
                if !obstacles.iter().any(|other| other.overlaps(&dot)) {
                    corners.push(Point::new(x, y));
                }
            }
        }
        Self {
            obstacles,
            corners,
            effort: EFFORT,
        }
    }

    /// A route from one box to another around the boxes between them; its first and last points between the
    /// boxes lie on level lanes and may move along them. `None` if a route is blocked.
    pub(crate) fn via(&mut self, from: End, to: End, points: &[Point]) -> Option<Route> {
        let [first, between @ .., last] = points else {
            return None;
        };
        let mut way = self.way_to_lane(from, *first)?;
        way.extend(between);
        way.extend(self.way_to_lane(to, *last)?.iter().rev());
        let many = way.len();
        way[0] = from.leaves(way[0], way[1]);
        way[many - 1] = to.leaves(way[many - 1], way[many - 2]);
        Some(rounded(&way))
    }

    /// A route that starts at the frame around a box, led on to the box itself, and whether it is level there, `aside`
    /// of its middle: if something is in the way, it turns into the nearest free lane, else around corners. `None` if
    /// it is blocked.
    pub(crate) fn led_on(&mut self, route: &Route, end: End, aside: f64) -> Option<(Route, bool)> {
        let (middle, from) = (end.rect.centre(), route.start);
        let own = (end.at, end.at);
        let level = Point::new(middle.x, middle.y + aside);
        // From above or below, the side of the box may be shorter.
        let most = end.rect.w * PORTS / 2.0;
        let foot = Point::new(middle.x + aside.clamp(-most, most), middle.y);
        let sides = [end.rect.y - LANE, end.rect.bottom() + LANE];
        let mut lanes = sides.map(|y| Point::new(foot.x, y));
        lanes.sort_by(|a, b| (a.y - from.y).abs().total_cmp(&(b.y - from.y).abs()));
        // A route between rows of blocks may start above or below its block.
        let first = route.curves.first();
        let is_level = first.is_some_and(|first| (first[0].y - from.y).abs() < SAME);
        if is_level && self.clear(level, Point::new(from.x, level.y), own) {
            let start = end.leaves(level, Point::new(from.x, level.y));
            return Some((route.raised(level.y).along(&[start]), true));
        }
        for lane in lanes.into_iter().filter(|_| is_level) {
            if self.clear(lane, Point::new(from.x, lane.y), own) && self.clear(foot, lane, own) {
                let start = end.leaves(foot, lane);
                return Some((route.raised(lane.y).along(&[start, lane]), false));
            }
        }
        // The side of the box towards the way from its middle has the port.
        let next = self.way(middle, from, own)?[1];
        let out = end.leaves(middle, next);
        let is_beside = (out.y - middle.y).abs() < end.rect.h / 2.0 - SAME;
        let port = if is_beside {
            end.beside(level.y, next.x)
        } else {
            end.leaves(foot, Point::new(foot.x, next.y))
        };
        let mut way = self.way(port, from, own)?;
        way.pop();
        Some((route.along(&way), false))
    }

    /// The path from a box to a point of a level lane. If it has to turn, it meets the lane vertically from
    /// its last turn: going back to the point itself would be a sharp bend.
    fn way_to_lane(&mut self, end: End, lane: Point) -> Option<Vec<Point>> {
        let own = (end.at, end.at);
        let mut way = self.way(end.rect.centre(), lane, own)?;
        if let [.., _, turn, last] = &mut way[..] {
            let upright = Point::new(turn.x, lane.y);
            if self.clear(*turn, upright, own) {
                *last = upright;
            }
        }
        Some(way)
    }

    /// The shortest path around all boxes but its own.
    fn way(&mut self, a: Point, b: Point, own: (usize, usize)) -> Option<Vec<Point>> {
        if self.effort == 0 {
            return None;
        }
        if self.clear(a, b, own) {
            return Some(vec![a, b]);
        }
        let mut points = vec![a, b];
        points.extend(&self.corners);
        let rest: Vec<f64> = points.iter().map(|point| point.distance(b)).collect();
        // The point before each one on the shortest path to it.
        let mut from = vec![None; points.len()];
        // Steps by the length of a path with them at least. Lengths are not negative, so their bits have the same order. Whether a
        // step is free is checked when it is taken: most never are.
        let mut steps = BinaryHeap::from([(Reverse(rest[0].to_bits()), 0.0_f64.to_bits(), 0, 0)]);
        while let Some((_, length, at, before)) = steps.pop() {
            let is_free = |map: &mut Self| at == 0 || map.clear(points[before], points[at], own);
            if from[at].is_some() || !is_free(self) {
                continue;
            }
            from[at] = Some(before);
            if at == 1 {
                return Some(traced(&points, &from));
            }
            self.effort = self.effort.saturating_sub(STEP * points.len());
            for next in (1..points.len()).filter(|next| from[*next].is_none()) {
                let length = f64::from_bits(length) + points[at].distance(points[next]);
                let whole = length + rest[next];
                steps.push((Reverse(whole.to_bits()), length.to_bits(), next, at));
            }
        }
        None
    }

    /// Whether a line touches no box besides its own; false for every line once the effort is spent.
    fn clear(&mut self, a: Point, b: Point, own: (usize, usize)) -> bool {
        if self.effort < self.obstacles.len() {
            self.effort = 0;
            return false;
        }
        self.effort -= self.obstacles.len();
        let foreign = |v: usize| v != own.0 && v != own.1;
        let mut boxes = self.obstacles.iter().enumerate();
        !boxes.any(|(v, rect)| foreign(v) && meets(a, b, rect))
    }
}

/// The points on the path to the second one.
fn traced(points: &[Point], from: &[Option<usize>]) -> Vec<Point> {
    let mut way = vec![points[1]];
    let mut at = 1;
    while let Some(before) = from[at].filter(|_| at != 0) {
        at = before;
        way.push(points[at]);
    }
    way.reverse();
    way
}

/// Whether a line runs through the inside of a box (Liang and Barsky 1984).
pub(crate) fn meets(a: Point, b: Point, rect: &Rect) -> bool {
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for (start, way, least, most) in [
        (a.x, b.x - a.x, rect.x, rect.right()),
        (a.y, b.y - a.y, rect.y, rect.bottom()),
    ] {
        if way.abs() < 1e-12 {
            if start <= least || start >= most {
                return false;
            }
            continue;
        }
        let (t, u) = ((least - start) / way, (most - start) / way);
        (low, high) = (low.max(t.min(u)), high.min(t.max(u)));
    }
    low < high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::geometry::Size;
    use crate::base::geometry::polyline;
    use crate::layout::tests::{link, vertex};

    #[test]
    fn routes_through_a_crowd_are_straight_and_fast() {
        let n = 20_000;
        let plan = Plan {
            vertices: vec![vertex(None); n],
            links: (1..n).map(|v| link(v - 1, v)).collect(),
            clusters: vec![],
            ..Plan::default()
        };
        let place = |v: usize| {
            Rect::new(
                (v % 141) as f64 * 100.0,
                (v / 141) as f64 * 40.0,
                80.0,
                30.0,
            )
        };
        let boxes: Vec<Rect> = (0..n).map(place).collect();
        let (routes, straight) = routes(&plan, &boxes);
        assert_eq!(straight, n - 1);
        assert!(routes.iter().skip(1).all(|route| route.curves.len() <= 1));
    }

    #[test]
    fn a_route_from_a_lane_has_no_sharp_bend() {
        let boxes = [(400.0, 0.0), (-20.0, 100.0), (0.0, 200.0)];
        let boxes = boxes.map(|(x, y)| Rect::new(x, y, 80.0, 30.0));
        let end = |at: usize| End {
            at,
            rect: boxes[at],
            outline: Outline::Box,
        };
        let ends = [Point::new(440.0, 70.0), Point::new(40.0, 70.0)];
        let route = Map::new(&boxes).via(end(0), end(2), &ends).unwrap();
        let line = polyline(route.start, &route.curves, 4);
        let sharp = line.windows(3).filter(|p| {
            let (a, b) = (
                (p[1].x - p[0].x, p[1].y - p[0].y),
                (p[2].x - p[1].x, p[2].y - p[1].y),
            );
            a.0 * b.0 + a.1 * b.1 < -1e-6
        });
        assert_eq!(sharp.count(), 0, "{line:?}");
        assert!(line.iter().all(|p| {
            !boxes[1]
                .grown(1.0)
                .overlaps(&Rect::around(*p, Size::new(0.1, 0.1)))
        }));
    }

    #[test]
    fn an_edge_goes_around_boxes_in_between() {
        let plan = Plan {
            vertices: vec![vertex(None); 3],
            links: vec![link(0, 2)],
            clusters: vec![],
            ..Plan::default()
        };
        let boxes = [0.0, 150.0, 300.0].map(|x| Rect::new(x, 0.0, 80.0, 30.0));
        let (routes, straight) = routes(&plan, &boxes);
        assert_eq!(straight, 0);
        assert!(routes[0].curves.len() > 1);
        let ends: Vec<Point> = routes[0].points().collect();
        assert!(
            !ends
                .windows(2)
                .any(|pair| meets(pair[0], pair[1], &boxes[1]))
        );
    }
}
