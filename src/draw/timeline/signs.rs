//! The signs of a figure of lifelines: ticks, crosses, small circles and letters.

use super::canvas::{PaperCanvas, Type, ink};
use super::lives::RowPlace;
use crate::base::geometry::{Point, Rect};
use crate::base::time::Stamp;
use crate::draw::scene::Stroke;

/// Lengths in millimetres; the height of a tick as a fraction of the pitch of rows, which is 2.75 mm.
const TICK: (f64, f64) = (0.4, 2.24 / 2.75);
const CROSS: f64 = 0.5;
const LETTER: f64 = 1.08;
const DOT: f64 = 0.5;
/// The least distance between letters and arrows in millimetres.
const APART: f64 = 2.3;

/// Draws the mark of a start.
pub(crate) fn start(canvas: &mut PaperCanvas<'_>, x: f64, y: f64) {
    let high = TICK.1 * canvas.sizes.pitch();
    let rect = Rect::new(x - TICK.0 / 2.0, y - high / 2.0, TICK.0, high);
    canvas.fill(rect, ink::ADDED);
}

/// Draws the mark of an end.
pub(crate) fn cross(canvas: &mut PaperCanvas<'_>, x: f64, y: f64) {
    let stroke = Stroke::solid(ink::REMOVED, 0.38);
    let (a, b) = (CROSS, CROSS * 1.35);
    canvas.line(Point::new(x - a, y - b), Point::new(x + a, y + b), &stroke);
    canvas.line(Point::new(x - a, y + b), Point::new(x + a, y - b), &stroke);
}

/// Draws the mark of an event without a letter.
pub(crate) fn dot(canvas: &mut PaperCanvas<'_>, x: f64, y: f64) {
    let stroke = Stroke::solid(ink::CHANGED, 0.25);
    canvas.disc(Point::new(x, y), DOT, ink::PAPER, &stroke);
}

/// Draws a circled letter at a moment of a row, beside existing letters and arrows.
pub(super) fn put_letter(
    canvas: &mut PaperCanvas<'_>,
    place: &RowPlace,
    (at, y): (Stamp, f64),
    k: usize,
    taken: &mut Vec<(f64, f64, f64)>,
) {
    let near = |x: f64, taken: &[(f64, f64, f64)]| {
        let hit = |(o, low, high): &&(f64, f64, f64)| {
            (o - x).abs() < APART && *low - 1.0 < y && y < *high + 1.0
        };
        taken.iter().find(hit).map(|t| t.0)
    };
    // The nearest free position, to the right or to the left.
    let free = |mut x: f64, step: f64| {
        for _ in 0..12 {
            let Some(other) = near(x, taken) else { break };
            x = other + step;
        }
        x
    };
    let at = place.axis.x(at);
    let (right, left) = (free(at + LETTER, APART), free(at - LETTER, -APART));
    let is_left = left > place.axis.left && at - left < right - at;
    let is_left = is_left || right > place.axis.right - LETTER;
    let x = if is_left { left } else { right };
    taken.push((x, y, y));
    let radius = LETTER * canvas.sizes.pitch() / 2.75;
    let stroke = Stroke::solid(ink::CHANGED, 0.25);
    canvas.disc(Point::new(x, y), radius, ink::PAPER, &stroke);
    canvas.text_middle(x, y, Type::Strong, ink::CHANGED, &sign(k));
}

/// The letter of an event: a, b, c, …
pub(crate) fn sign(k: usize) -> String {
    let letters = "abcdefghijklmnopqrstuvwxyz";
    letters
        .chars()
        .nth(k)
        .map_or_else(String::new, String::from)
}
