//! Points, sizes and rectangles in pixels at scale 1, x to the right, y down.

use serde::{Deserialize, Serialize};

/// A point, or a vector between two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Pixels to the right.
    pub x: f64,
    /// Pixels down.
    pub y: f64,
}

impl Point {
    /// The point `(x, y)`.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// How far another point is.
    pub fn distance(self, other: Self) -> f64 {
        libm::hypot(self.x - other.x, self.y - other.y)
    }

    /// The point at this part of the way to another.
    #[must_use]
    pub fn towards(self, other: Self, part: f64) -> Self {
        let mix = |from: f64, to: f64| from + (to - from) * part;
        Self::new(mix(self.x, other.x), mix(self.y, other.y))
    }
}

/// A width and a height, both ≥ 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Size {
    /// Pixels from left to right.
    pub w: f64,
    /// Pixels from top to bottom.
    pub h: f64,
}

impl Size {
    /// `w` by `h`.
    pub const fn new(w: f64, h: f64) -> Self {
        Self { w, h }
    }

    /// `by` times as large.
    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        Self::new(self.w * by, self.h * by)
    }
}

/// An upright rectangle by its top left corner and its size.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Rect {
    /// The left edge.
    pub x: f64,
    /// The top edge.
    pub y: f64,
    /// The width, ≥ 0.
    pub w: f64,
    /// The height, ≥ 0.
    pub h: f64,
}

impl Rect {
    /// The rectangle with its top left corner at `(x, y)`.
    pub const fn new(x: f64, y: f64, w: f64, h: f64) -> Self {
        Self { x, y, w, h }
    }

    /// The rectangle of this size around a centre.
    pub fn around(centre: Point, size: Size) -> Self {
        let Size { w, h } = size;
        Self::new(centre.x - w / 2.0, centre.y - h / 2.0, w, h)
    }

    /// The smallest rectangle around points; `None` without any.
    pub fn of_points(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        let points = points.into_iter().map(|p| Self::new(p.x, p.y, 0.0, 0.0));
        points.reduce(|a, b| a.union(&b))
    }

    /// The right edge.
    pub fn right(&self) -> f64 {
        self.x + self.w
    }

    /// The bottom edge.
    pub fn bottom(&self) -> f64 {
        self.y + self.h
    }

    /// The middle.
    pub fn centre(&self) -> Point {
        Point::new(self.x + self.w / 2.0, self.y + self.h / 2.0)
    }

    /// Whether the two share more than a line.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.x < other.right()
            && other.x < self.right()
            && self.y < other.bottom()
            && other.y < self.bottom()
    }

    /// This rectangle with its corner moved by `by`.
    #[must_use]
    pub fn moved(&self, by: Point) -> Self {
        Self::new(self.x + by.x, self.y + by.y, self.w, self.h)
    }

    /// This rectangle in a drawing `by` times as large.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        Self::new(self.x * by, self.y * by, self.w * by, self.h * by)
    }

    /// Grown by `by` on every side (shrunk if negative).
    #[must_use]
    pub fn grown(&self, by: f64) -> Self {
        let (w, h) = (self.w + 2.0 * by, self.h + 2.0 * by);
        Self::new(self.x - by, self.y - by, w, h)
    }

    /// The smallest rectangle around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let right = self.right().max(other.right());
        let bottom = self.bottom().max(other.bottom());
        Self::new(x, y, right - x, bottom - y)
    }
}

/// The point at `t` of a cubic Bézier curve, by its four points.
pub(crate) fn on_cubic(points: [Point; 4], t: f64) -> Point {
    let u = 1.0 - t;
    let mix = |[start, near, far, end]: [f64; 4]| {
        u * u * u * start + 3.0 * u * u * t * near + 3.0 * u * t * t * far + t * t * t * end
    };
    Point::new(mix(points.map(|p| p.x)), mix(points.map(|p| p.y)))
}

/// The part of a cubic Bézier curve after `t`, by its four points.
pub(crate) fn after([a, b, c, end]: [Point; 4], t: f64) -> [Point; 4] {
    let (ab, bc, cd) = (a.towards(b, t), b.towards(c, t), c.towards(end, t));
    let (abc, bcd) = (ab.towards(bc, t), bc.towards(cd, t));
    [abc.towards(bcd, t), bcd, cd, end]
}

/// The points of a path of cubic Bézier curves, each with its two controls and its end: the start, and then `pieces`
/// points along each curve, the last of them its end.
pub(crate) fn polyline(start: Point, curves: &[[Point; 3]], pieces: u32) -> Vec<Point> {
    let mut points = vec![start];
    let mut here = start;
    for &[a, b, end] in curves {
        let parts = (1..=pieces).map(|piece| f64::from(piece) / f64::from(pieces));
        points.extend(parts.map(|t| on_cubic([here, a, b, end], t)));
        here = end;
    }
    points
}
