//! Where the labels of arrows stand: on their arrow or beside it, over no box, no title, no tip and no other label.

use super::place::{Placed, distance, length};
use crate::base::geometry::{Point, Rect, Size};

/// So many places along an arrow are tried on both sides of its middle, so far apart in its length.
const STATIONS: (usize, f64) = (15, 0.028);
/// What it costs to lie on another arrow, to stand beside the own one, and to be an arrow's length off its middle.
const ON_ARROW: f64 = 2.0;
const ASIDE: f64 = 0.8;
const OFF_MIDDLE: f64 = 1.25;
/// How near another arrow may come to a label beside its own before nobody knows whose it is.
const NEAR: f64 = 0.4;

/// What labels are placed among.
struct Room<'a> {
    labels: &'a [Vec<Size>],
    width: f64,
    /// Boxes, titles and tips.
    fixed: Vec<Rect>,
    /// The label of each arrow, where it stands.
    set: Vec<Option<Rect>>,
}

/// A label that has a place: its middle, and which of its alternatives it is.
type Spot = (Point, usize);

/// Places the labels of a drawing, those of short arrows first; one that finds no room may push another one aside.
pub(crate) fn set(placed: &mut Placed, labels: &[Vec<Size>], titles: Vec<Rect>, width: f64) {
    let mut fixed: Vec<Rect> = placed.boxes.iter().map(|b| b.grown(0.25)).collect();
    fixed.extend(titles);
    let tips = placed.routes.iter().filter_map(|r| r.last());
    fixed.extend(tips.map(|p| Rect::around(*p, Size::new(1.0, 1.0))));
    let mut room = Room {
        labels,
        width,
        fixed,
        set: vec![None; labels.len()],
    };
    let mut order: Vec<usize> = (0..labels.len()).filter(|at| !labels[*at].is_empty()).collect();
    let long = |at: &usize| length(&placed.routes[*at]);
    order.sort_by(|a, b| long(a).total_cmp(&long(b)).then(a.cmp(b)));
    let mut spots: Vec<Option<Spot>> = vec![None; labels.len()];
    for at in &order {
        spots[*at] = room.best(&placed.routes, *at);
        room.set[*at] = spots[*at].map(|s| room.rect(*at, s));
    }
    for at in order.iter().filter(|at| room.set[**at].is_none()).copied().collect::<Vec<_>>() {
        room.push_aside(&placed.routes, at, &mut spots);
    }
    for rect in room.set.iter().flatten() {
        placed.size.w = placed.size.w.max(rect.right());
        placed.size.h = placed.size.h.max(rect.bottom());
    }
    let unclear = |at: &&usize| {
        let spot = spots[**at].map(|s| room.rect(**at, s));
        let own = placed.routes.iter().enumerate().filter(|(other, _)| *other != **at);
        spot.is_some_and(|rect| own.clone().any(|(_, r)| crosses(r, &rect.grown(NEAR))))
    };
    placed.unclear = order.iter().filter(unclear).count();
    placed.left_out = order.iter().filter(|at| spots[**at].is_none()).count();
    placed.labels = spots;
}

impl Room<'_> {
    fn rect(&self, at: usize, (middle, which): Spot) -> Rect {
        Rect::around(middle, self.labels[at][which])
    }

    /// The best free place of a label, of its first alternative that has any.
    fn best(&self, routes: &[Vec<Point>], at: usize) -> Option<Spot> {
        let free = |which: usize| {
            let spots = self.spots(routes, at, which).into_iter();
            let free = spots.filter(|(_, s)| self.hit(at, (*s, which)).next().is_none());
            let best = free.min_by(|a, b| a.0.total_cmp(&b.0))?;
            Some((best.1, which))
        };
        (0..self.labels[at].len()).find_map(free)
    }

    /// The labels that one at this place would cover.
    fn hit(&self, at: usize, spot: Spot) -> impl Iterator<Item = usize> + '_ {
        let rect = self.rect(at, spot).grown(0.1);
        let set = self.set.iter().enumerate();
        set.filter_map(move |(other, set)| {
            let hits = other != at && set.is_some_and(|s| s.overlaps(&rect));
            hits.then_some(other)
        })
    }

    /// Every place along an arrow where a label covers nothing that is fixed, with its cost.
    fn spots(&self, routes: &[Vec<Point>], at: usize, which: usize) -> Vec<(f64, Point)> {
        let size = self.labels[at][which];
        let mut all = Vec::new();
        for (off, part) in stations() {
            let Some((on, normal)) = along(&routes[at], part) else {
                continue;
            };
            let reach = f64::midpoint(normal.x.abs() * size.w, normal.y.abs() * size.h) + 0.35;
            for (aside, penalty) in [(0.0, 0.0), (reach, ASIDE), (-reach, ASIDE)] {
                let middle = Point::new(on.x + normal.x * aside, on.y + normal.y * aside);
                let rect = Rect::around(middle, size);
                let outside = rect.x < 0.0 || rect.y < 0.0 || rect.right() > self.width;
                if outside || self.fixed.iter().any(|f| f.overlaps(&rect)) {
                    continue;
                }
                let near = rect.grown(if aside.abs() > 0.0 { NEAR } else { 0.0 });
                let others = routes.iter().enumerate().filter(|(other, _)| *other != at);
                let crossed = others.filter(|(_, r)| crosses(r, &near)).count();
                all.push((crossed as f64 * ON_ARROW + penalty + off * OFF_MIDDLE, middle));
            }
        }
        all
    }

    /// Puts a label where one other stands that has room elsewhere.
    fn push_aside(&mut self, routes: &[Vec<Point>], at: usize, spots: &mut [Option<Spot>]) {
        for which in 0..self.labels[at].len() {
            let mut all = self.spots(routes, at, which);
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (_, middle) in all {
                let hit: Vec<usize> = self.hit(at, (middle, which)).collect();
                let [other] = hit[..] else { continue };
                let before = self.set[other];
                self.set[at] = Some(self.rect(at, (middle, which)));
                self.set[other] = None;
                if let Some(moved) = self.best(routes, other) {
                    self.set[other] = Some(self.rect(other, moved));
                    (spots[at], spots[other]) = (Some((middle, which)), Some(moved));
                    return;
                }
                (self.set[at], self.set[other]) = (None, before);
            }
        }
    }
}

/// Places along an arrow, and how far from its middle each is.
fn stations() -> impl Iterator<Item = (f64, f64)> {
    let (many, step) = STATIONS;
    let off = (0..many).map(move |k| k as f64 * step);
    off.flat_map(|off| [(off, 0.5 - off), (off, 0.5 + off)])
}

/// The point at this part of a line, and the direction across it.
fn along(points: &[Point], part: f64) -> Option<(Point, Point)> {
    let mut left = length(points) * part;
    for pair in points.windows(2) {
        let long = distance(pair[0], pair[1]);
        if long >= left && long > 0.0 {
            let (dx, dy) = (
                (pair[1].x - pair[0].x) / long,
                (pair[1].y - pair[0].y) / long,
            );
            let at = Point::new(pair[0].x + dx * left, pair[0].y + dy * left);
            return Some((at, Point::new(-dy, dx)));
        }
        left -= long;
    }
    None
}

/// Whether a line runs through a rectangle.
fn crosses(points: &[Point], rect: &Rect) -> bool {
    points.windows(2).any(|pair| {
        let touched = Rect::new(
            pair[0].x.min(pair[1].x),
            pair[0].y.min(pair[1].y),
            (pair[0].x - pair[1].x).abs().max(1e-6),
            (pair[0].y - pair[1].y).abs().max(1e-6),
        );
        touched.overlaps(rect)
    })
}
