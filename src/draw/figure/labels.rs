//! The positions of arrow labels: on their arrow or beside it, without covering boxes, titles, arrowheads or
//! other labels.

use crate::base::geometry::{Point, Rect, Size};

/// The number of positions along an arrow that are tried on each side of its middle, and their distance as a
/// fraction of its length.
const STATIONS: (usize, f64) = (15, 0.028);
/// The cost of a label on another arrow, of one beside its own, of one with its own between two rows, and of one that is
/// an arrow's length off its middle.
const ON_ARROW: f64 = 2.0;
const ASIDE: f64 = 0.8;
const BETWEEN: f64 = 1.2;
const OFF_MIDDLE: f64 = 1.25;
/// The distance in millimetres that a label keeps from other arrows, so that it is clear which one it belongs
/// to.
const NEAR: f64 = 0.4;

/// The shapes among which labels are placed.
pub(crate) struct Room<'a> {
    /// The arrows as chains of short straight pieces.
    pub(crate) routes: &'a [Vec<Point>],
    /// Per arrow the sizes of the texts that may be written on it, the best first.
    pub(crate) labels: &'a [Vec<Size>],
    /// The height of a row of text.
    pub(crate) row: f64,
    /// The width of the page.
    pub(crate) width: f64,
    /// The rectangles that no label may cover.
    pub(crate) fixed: Vec<Rect>,
}

/// The position of a label: its middle, and the index of its text among the alternatives.
pub(crate) type Spot = (Point, usize);

/// The labels of a drawing while they are being placed.
struct Labels<'a> {
    room: &'a Room<'a>,
    spots: Vec<Option<Spot>>,
}

/// A position for each label that fits, those of short arrows first; one that does not fit may displace
/// another one.
pub(crate) fn set(room: &Room<'_>) -> Vec<Option<Spot>> {
    let mut order: Vec<usize> = (0..room.labels.len()).collect();
    order.retain(|at| !room.labels[*at].is_empty());
    let long = |at: &usize| length(&room.routes[*at]);
    order.sort_by(|a, b| long(a).total_cmp(&long(b)).then(a.cmp(b)));
    let mut labels = Labels {
        room,
        spots: vec![None; room.labels.len()],
    };
    for at in &order {
        labels.spots[*at] = labels.best(*at);
    }
    order.retain(|at| labels.spots[*at].is_none());
    for at in order {
        labels.push_aside(at);
    }
    labels.spots
}

impl Room<'_> {
    /// The rectangle of a label at a spot.
    pub(crate) fn rect(&self, at: usize, (middle, which): Spot) -> Rect {
        Rect::around(middle, self.labels[at][which])
    }

    /// Whether a label is on or near another arrow than its own.
    pub(crate) fn is_unclear(&self, at: usize, spot: Spot) -> bool {
        self.crossed(at, &self.rect(at, spot).grown(NEAR)) > 0
    }

    /// The number of other arrows that run through a rectangle.
    fn crossed(&self, at: usize, rect: &Rect) -> usize {
        let others = self.routes.iter().enumerate().filter(|(o, _)| *o != at);
        others.filter(|(_, route)| crosses(route, rect)).count()
    }

    /// Every position along an arrow at which a label covers nothing fixed, with its cost.
    fn spots(&self, at: usize, which: usize) -> Vec<(f64, Spot)> {
        let size = self.labels[at][which];
        let mut all = Vec::new();
        for (off, part) in stations() {
            let Some((on, normal)) = along(&self.routes[at], part) else {
                continue;
            };
            let reach = f64::midpoint(normal.x.abs() * size.w, normal.y.abs() * size.h) + 0.35;
            // A level arrow would run between two rows.
            let is_between = size.h > 1.5 * self.row && normal.y.abs() > normal.x.abs();
            let between = if is_between { BETWEEN } else { 0.0 };
            for (aside, penalty, near) in [
                (0.0, between, 0.0),
                (reach, ASIDE, NEAR),
                (-reach, ASIDE, NEAR),
            ] {
                let middle = Point::new(on.x + normal.x * aside, on.y + normal.y * aside);
                let rect = Rect::around(middle, size);
                let outside = rect.x < 0.0 || rect.y < 0.0 || rect.right() > self.width;
                if outside || self.fixed.iter().any(|f| f.overlaps(&rect)) {
                    continue;
                }
                let crossed = self.crossed(at, &rect.grown(near)) as f64;
                let cost = crossed * ON_ARROW + penalty + off * OFF_MIDDLE;
                all.push((cost, (middle, which)));
            }
        }
        all
    }
}

impl Labels<'_> {
    /// The best free position of a label, for its first alternative that has one.
    fn best(&self, at: usize) -> Option<Spot> {
        let free = |which: usize| {
            let spots = self.room.spots(at, which).into_iter();
            let free = spots.filter(|(_, spot)| self.hit(at, *spot).next().is_none());
            free.min_by(|a, b| a.0.total_cmp(&b.0))
                .map(|(_, spot)| spot)
        };
        (0..self.room.labels[at].len()).find_map(free)
    }

    /// The labels that a label at this spot would cover.
    fn hit(&self, at: usize, spot: Spot) -> impl Iterator<Item = usize> + '_ {
        let rect = self.room.rect(at, spot).grown(0.1);
        let others = self.spots.iter().enumerate().filter(move |(o, _)| *o != at);
        others.filter_map(move |(other, spot)| {
            let hits = self.room.rect(other, (*spot)?).overlaps(&rect);
            hits.then_some(other)
        })
    }

    /// Puts a label at the position of one other label that fits elsewhere.
    fn push_aside(&mut self, at: usize) {
        for which in 0..self.room.labels[at].len() {
            let mut all = self.room.spots(at, which);
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (_, spot) in all {
                let hit: Vec<usize> = self.hit(at, spot).collect();
                let [other] = hit[..] else { continue };
                let before = self.spots[other].take();
                self.spots[at] = Some(spot);
                self.spots[other] = self.best(other);
                if self.spots[other].is_some() {
                    return;
                }
                (self.spots[at], self.spots[other]) = (None, before);
            }
        }
    }
}

/// The distances from the middle of an arrow at which a label is tried, each with its position along the
/// arrow; both are fractions of its length.
fn stations() -> impl Iterator<Item = (f64, f64)> {
    let (many, step) = STATIONS;
    let off = (0..many).map(move |k| k as f64 * step);
    off.flat_map(|off| [(off, 0.5 - off), (off, 0.5 + off)])
}

/// The point at this fraction of a line, and the direction across it.
fn along(points: &[Point], part: f64) -> Option<(Point, Point)> {
    let mut left = length(points) * part;
    for pair in points.windows(2) {
        let long = pair[0].distance(pair[1]);
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

fn length(points: &[Point]) -> f64 {
    points.windows(2).map(|w| w[0].distance(w[1])).sum()
}
