//! The parts of the page that a group may touch: a bit per square of the page, never too few.

use std::ops::Range;

use crate::base::cast;
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::scene::{Form, Group, Piece, Shape, Step, Text};
use crate::draw::style::Color;
use crate::draw::text::Fonts;

/// The side of a tile in pixels of the page: about the height of a box.
pub(super) const SIDE: f64 = 32.0;

/// A set of tiles of one page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Tiles {
    columns: usize,
    rows: usize,
    bits: Vec<u64>,
}

impl Tiles {
    /// None of the tiles of a page of this size.
    pub(super) fn none(page: Size) -> Self {
        let count = |length: f64| tile(length.min(1e6)) + 1;
        let (columns, rows) = (count(page.w), count(page.h));
        Self {
            columns,
            rows,
            bits: vec![0; (columns * rows).div_ceil(64)],
        }
    }

    /// The tiles that the group may touch.
    pub(super) fn under(group: &Group, page: Size, fonts: &Fonts) -> Self {
        let mut tiles = Self::none(page);
        for piece in &group.pieces {
            match piece {
                Piece::Shape(shape) => tiles.add_shape(shape),
                Piece::Text(text) => tiles.add(text_box(text, fonts)),
            }
        }
        tiles
    }

    /// Adds all tiles of `other`, which is of the same page.
    pub(super) fn extend(&mut self, other: &Self) {
        for (a, b) in self.bits.iter_mut().zip(&other.bits) {
            *a |= b;
        }
    }

    /// Whether a tile is in both.
    pub(super) fn meets(&self, other: &Self) -> bool {
        self.bits.iter().zip(&other.bits).any(|(a, b)| a & b != 0)
    }

    /// The share of the page that is in it, 0..=1.
    pub(super) fn share(&self) -> f64 {
        let set: u32 = self.bits.iter().map(|b| b.count_ones()).sum();
        f64::from(set) / (self.columns * self.rows) as f64
    }

    /// The tiles in it, row by row: the columns of those side by side, and their row.
    pub(super) fn spans(&self) -> Vec<(Range<usize>, usize)> {
        let mut spans: Vec<(Range<usize>, usize)> = Vec::new();
        for (column, row) in self.iter() {
            match spans.last_mut() {
                Some((columns, at)) if *at == row && columns.end == column => columns.end += 1,
                _ => spans.push((column..column + 1, row)),
            }
        }
        spans
    }

    /// The tiles in it as (column, row), row by row.
    fn iter(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let all = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (column, row)));
        all.filter(|(column, row)| {
            let at = row * self.columns + column;
            self.bits[at / 64] >> (at % 64) & 1 == 1
        })
    }

    fn add(&mut self, area: Rect) {
        let (left, right) = (tile(area.x), tile(area.right()).min(self.columns - 1));
        let (top, bottom) = (tile(area.y), tile(area.bottom()).min(self.rows - 1));
        for row in top..=bottom {
            for at in row * self.columns + left..=row * self.columns + right {
                if left <= right {
                    self.bits[at / 64] |= 1 << (at % 64);
                }
            }
        }
    }

    fn add_shape(&mut self, shape: &Shape) {
        // Half the width, up to four times that at a pointed corner, and more for antialiasing and rounding.
        let reach = shape.stroke.width.max(0.0) * 2.0 + 3.0;
        match &shape.form {
            Form::Rect(rect, _) | Form::Ellipse(rect) => self.add(rect.grown(reach)),
            Form::Path(steps) if shape.fill == Color::NONE => self.add_line(steps, reach),
            Form::Path(steps) => {
                let points = steps.iter().flat_map(Step::points).copied();
                if let Some(area) = Rect::of_points(points) {
                    self.add(area.grown(reach));
                }
            }
        }
    }

    fn add_line(&mut self, steps: &[Step], reach: f64) {
        let (mut first, mut here) = (Point::default(), Point::default());
        for step in steps {
            let end = match step {
                Step::Move(p) => {
                    first = *p;
                    *p
                }
                Step::Line(p) => {
                    self.add_curve([here, between(here, *p), between(here, *p), *p], reach, 5);
                    *p
                }
                Step::Curve([a, b, end]) => {
                    self.add_curve([here, *a, *b, *end], reach, 5);
                    *end
                }
                Step::Close => {
                    self.add_curve([here, here, first, first], reach, 5);
                    first
                }
            };
            here = end;
        }
    }

    /// Adds the tiles of a curve, which lies inside the box of its controls: it is halved until that box is small.
    fn add_curve(&mut self, curve: [Point; 4], reach: f64, depth: u8) {
        let Some(area) = Rect::of_points(curve) else {
            return;
        };
        if depth == 0 || (area.w < SIDE && area.h < SIDE) {
            self.add(area.grown(reach));
            return;
        }
        let [a, b, c, d] = curve;
        let (ab, bc, cd) = (between(a, b), between(b, c), between(c, d));
        let (abc, bcd) = (between(ab, bc), between(bc, cd));
        let middle = between(abc, bcd);
        self.add_curve([a, ab, abc, middle], reach, depth - 1);
        self.add_curve([middle, bcd, cd, d], reach, depth - 1);
    }
}

/// The tile index of a coordinate; coordinates before the page are in the first tile.
fn tile(at: f64) -> usize {
    cast::to_usize((at / SIDE).clamp(0.0, 1e6))
}

fn between(a: Point, b: Point) -> Point {
    Point::new(f64::midpoint(a.x, b.x), f64::midpoint(a.y, b.y))
}

fn text_box(text: &Text, fonts: &Fonts) -> Rect {
    let width = fonts.width(&text.text, text.size, text.weight);
    let left = text.at.x - text.anchor.before(width);
    let halo = text.halo.map_or(0.0, |(_, width)| width);
    // Above and below any letter of our fonts; half an em on each side for overhanging letters.
    Rect::new(left, text.at.y - 1.3 * text.size, width, 1.8 * text.size)
        .grown(0.5 * text.size + halo + 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::scene::Stroke;

    #[test]
    fn a_long_curve_touches_few_tiles() {
        let page = Size::new(1280.0, 720.0);
        let steps = vec![
            Step::Move(Point::new(10.0, 10.0)),
            Step::Curve([
                Point::new(600.0, 10.0),
                Point::new(600.0, 700.0),
                Point::new(1270.0, 700.0),
            ]),
        ];
        let shape = Shape::line(Form::Path(steps), Stroke::solid(Color::NONE, 1.0));
        let mut tiles = Tiles::none(page);
        tiles.add_shape(&shape);
        assert!(
            tiles.share() > 0.03 && tiles.share() < 0.25,
            "{}",
            tiles.share()
        );
        assert_eq!(tiles.iter().next(), Some((0, 0)));
    }

    #[test]
    fn elements_outside_the_page_take_few_tiles() {
        let mut tiles = Tiles::none(Size::new(100.0, 100.0));
        tiles.add(Rect::new(-500.0, -500.0, 10.0, 10.0));
        tiles.add(Rect::new(5000.0, 20.0, 10.0, 10.0));
        tiles.add(Rect::new(f64::NAN, 0.0, 1.0, 1.0));
        assert!(tiles.iter().count() <= 4);
    }
}
