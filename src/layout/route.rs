//! The route of one edge.

use crate::base::geometry::Point;

/// The route of one edge: a start point, then cubic pieces `(control, control, end)`; straight pieces have
/// their controls on the line. It runs from the outline of `from` to the outline of `to`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Route {
    /// Its start point.
    pub start: Point,
    /// The cubic pieces `(control, control, end)`.
    pub curves: Vec<[Point; 3]>,
    /// The middle of its label, if it has one and it could be placed.
    pub label: Option<Point>,
}

impl Route {
    /// All its points and controls, from its start on.
    pub(crate) fn points(&self) -> impl DoubleEndedIterator<Item = Point> {
        std::iter::once(self.start).chain(self.curves.iter().flatten().copied())
    }

    /// This route with every point moved.
    pub(crate) fn mapped(&self, f: impl Fn(Point) -> Point) -> Self {
        Self {
            start: f(self.start),
            curves: self.curves.iter().map(|curve| curve.map(&f)).collect(),
            label: self.label.map(&f),
        }
    }

    /// This route moved by `by`.
    pub(crate) fn moved(&self, by: Point) -> Self {
        self.mapped(|p| Point::new(p.x + by.x, p.y + by.y))
    }

    /// Its approximate length: that of the straight lines between the points that its pieces join.
    pub(crate) fn length(&self) -> f64 {
        let ends = self.curves.iter().map(|curve| curve[2]);
        let far = |(length, from): (f64, Point), to: Point| (length + from.distance(to), to);
        ends.fold((0.0, self.start), far).0
    }

    /// This route from its end to its start.
    pub(crate) fn backwards(&self) -> Self {
        let points: Vec<Point> = self.points().rev().collect();
        let pieces = points[1..].chunks_exact(3);
        Self {
            start: points[0],
            curves: pieces.map(|piece| [piece[0], piece[1], piece[2]]).collect(),
            label: self.label,
        }
    }
}
