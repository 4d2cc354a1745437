//! The legend of a figure of lifelines, with only the signs that are drawn.

use super::canvas::{PaperCanvas, Type, ink};
use super::lives::LivesFigure;
use super::marks::Sign;
use super::notes::{InlineSign, TextRun, Unbroken};
use super::rows::FigureRow;
use super::signs::{cross, dot, start};
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::Stroke;

/// Every sign that `lives` draws, with its label.
pub(crate) fn items(lives: &LivesFigure<'_>) -> Vec<Unbroken> {
    let open: Vec<_> = lives
        .rows
        .iter()
        .filter_map(|row| match row {
            FigureRow::Track(at, ..) => lives.tracks.get(*at),
            _ => None,
        })
        .collect();
    let all_lives = || open.iter().flat_map(|t| &t.lives);
    let silent = open.iter().any(|t| {
        let busy: i64 = t.bars.iter().map(|b| b.span.nanos()).sum();
        let alive: i64 = t.lives.iter().map(|l| l.span.nanos()).sum();
        alive - busy > alive / 50
    });
    let has = |sign| lives.marks.signs.iter().any(|m| m.sign == sign);
    let all: [(bool, InlineSign, &str); 7] = [
        (
            open.iter().any(|t| !t.bars.is_empty()),
            (3.2, bar),
            "publishes (height: share of the row’s maximum)",
        ),
        (silent, (3.2, |c, x, y| line(c, x, y, &[])), "silent"),
        (
            all_lives().any(|l| l.is_inferred),
            (3.2, |c, x, y| line(c, x, y, &[0.55, 0.5])),
            "inferred",
        ),
        (
            has(Sign::Start),
            (0.6, |c, x, y| start(c, x + 0.3, y)),
            "starts",
        ),
        (
            has(Sign::End),
            (1.2, |c, x, y| cross(c, x + 0.6, y)),
            "ends",
        ),
        (
            !lives.marks.handovers.is_empty(),
            (3.2, arrow),
            "topic is taken over",
        ),
        (
            has(Sign::Dot),
            (1.0, |c, x, y| dot(c, x + 0.5, y)),
            "other change",
        ),
    ];
    let drawn = all.into_iter().filter(|(is, ..)| *is);
    let item = |(_, sign, words): (bool, InlineSign, &str)| {
        let words = TextRun::Words(Type::Small, ink::QUIET, words.to_owned());
        vec![TextRun::Sign(sign), words]
    };
    drawn.map(item).collect()
}

fn bar(canvas: &mut PaperCanvas<'_>, x: f64, y: f64) {
    canvas.fill(Rect::new(x, y - 1.0, 1.6, 2.0), ink::BAR);
    canvas.fill(Rect::new(x + 1.6, y - 0.4, 1.6, 0.8), ink::BAR);
}

fn line(canvas: &mut PaperCanvas<'_>, x: f64, y: f64, dash: &[f64]) {
    let stroke = Stroke::dashed(ink::LINE, 0.28, dash);
    canvas.line(Point::new(x, y), Point::new(x + 3.2, y), &stroke);
}

fn arrow(canvas: &mut PaperCanvas<'_>, x: f64, y: f64) {
    let stroke = Stroke::solid(ink::CHANGED, 0.3);
    let (from, tip) = (Point::new(x + 0.55, y), Point::new(x + 3.2, y));
    canvas.line(from, Point::new(x + 2.2, y), &stroke);
    canvas.disc(from, 0.55, ink::CHANGED, &Stroke::default());
    canvas.head(from, tip, 1.3, ink::CHANGED);
}
