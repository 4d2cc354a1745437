//! The signs of change: a round badge at a corner, and a rate label.

use super::options;
use super::texts::{BADGE_HEIGHT, BADGE_PAD};
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Step, Stroke, Text, polygon};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::view::Mark;

/// Draws the badge of `mark` around `centre`, `scale` times its size in the style.
pub(crate) fn badge(group: &mut Group, style: &Style, mark: Mark, centre: Point, scale: f64) {
    // Its text shows how long it has been away.
    if mark == Mark::Away {
        return;
    }
    let radius = style.badge.radius * scale;
    let around = |r: f64| Form::Ellipse(Rect::around(centre, Size::new(2.0 * r, 2.0 * r)));
    let color = options::change(style, mark).color;
    let halo = Stroke::solid(style.badge.halo, 1.2 * scale);
    group.shape(Shape::new(around(radius), color, halo));
    sign(group, style.badge.sign, mark, centre, radius * 0.56);
}

/// The sign of a mark inside a circle of radius `r`: plus, minus, triangles, two arrows, a turn, a pause, a diamond, a dot.
fn sign(group: &mut Group, color: Color, mark: Mark, centre: Point, r: f64) {
    let at = |x: f64, y: f64| Point::new(centre.x + x * r, centre.y + y * r);
    let stroke = |form| Shape::line(form, Stroke::solid(color, r * 0.5));
    let lines = |points: &[(f64, f64)]| {
        let steps = points.chunks(2).flat_map(|pair| {
            [
                Step::Move(at(pair[0].0, pair[0].1)),
                Step::Line(at(pair[1].0, pair[1].1)),
            ]
        });
        Form::Path(steps.collect())
    };
    let filled = |points: &[Point]| Shape::filled(polygon(points), color);
    match mark {
        Mark::Added => {
            let cross = lines(&[(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)]);
            group.shape(stroke(cross));
        }
        Mark::Removed => group.shape(stroke(lines(&[(-1.0, 0.0), (1.0, 0.0)]))),
        Mark::Faster => group.shape(filled(&[at(-1.0, 0.7), at(0.0, -0.95), at(1.0, 0.7)])),
        Mark::Slower => group.shape(filled(&[at(-1.0, -0.7), at(0.0, 0.95), at(1.0, -0.7)])),
        Mark::HandedOver => {
            let both = lines(&[(-1.1, -0.45), (0.6, -0.45), (1.1, 0.5), (-0.6, 0.5)]);
            group.shape(stroke(both));
            let mut head = |tip: Point, back: f64| {
                let foot = |aside: f64| Point::new(tip.x + back, tip.y + aside * r);
                group.shape(filled(&[tip, foot(-0.6), foot(0.6)]));
            };
            head(at(1.3, -0.45), -0.8 * r);
            head(at(-1.3, 0.5), 0.8 * r);
        }
        Mark::Restarted => {
            // Three quarters of a circle, open at the top right, where its arrow points.
            const K: f64 = 0.5523;
            group.shape(stroke(Form::Path(vec![
                Step::Move(at(0.0, -0.9)),
                Step::Curve([at(-0.9 * K, -0.9), at(-0.9, -0.9 * K), at(-0.9, 0.0)]),
                Step::Curve([at(-0.9, 0.9 * K), at(-0.9 * K, 0.9), at(0.0, 0.9)]),
                Step::Curve([at(0.9 * K, 0.9), at(0.9, 0.9 * K), at(0.9, 0.0)]),
            ])));
            group.shape(filled(&[at(0.0, -1.6), at(0.95, -0.9), at(0.0, -0.2)]));
        }
        Mark::Paused => {
            let bars = lines(&[(-0.45, -0.9), (-0.45, 0.9), (0.45, -0.9), (0.45, 0.9)]);
            group.shape(stroke(bars));
        }
        Mark::Changed => {
            let corners = [at(0.0, -1.1), at(1.1, 0.0), at(0.0, 1.1), at(-1.1, 0.0)];
            group.shape(filled(&corners));
        }
        Mark::Away | Mark::Inside => {
            let dot = Rect::around(centre, Size::new(1.1 * r, 1.1 * r));
            group.shape(Shape::filled(Form::Ellipse(dot), color));
        }
    }
}

/// The width of a rate label with this text.
pub(crate) fn label_width(fonts: &Fonts, text: &str, size: f64) -> f64 {
    fonts.width(text, size, Weight::SemiBold) + size * BADGE_PAD
}

/// A rate label with `text` and its middle at `centre`; `size` is its font size.
pub(crate) fn label(
    group: &mut Group,
    fonts: &Fonts,
    paint: (Color, Color),
    text: &str,
    centre: Point,
    size: f64,
) {
    let height = size * BADGE_HEIGHT;
    let area = Rect::around(centre, Size::new(label_width(fonts, text, size), height));
    let form = Form::Rect(area, height / 2.0);
    group.shape(Shape::filled(form, paint.0));
    let font = Font::new(size, Weight::SemiBold, paint.1);
    group.text(Text::centred(Anchor::Middle, centre, font, text));
}
