//! The band of phases with its running numbers, the time axis, and the phases' names, which all figures share.

use super::canvas::{HAIRLINE, PaperCanvas, Type, ink};
use super::notes::{TextRun, Unbroken, flow};
use super::source::FigureSource;
use crate::base::geometry::{Point, Rect};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::draw::scene::Stroke;
use crate::mission::event_log::Phase;

/// The height of the band in millimetres.
pub(crate) const HEIGHT: f64 = 3.3;
/// Steps of the axis in seconds.
const STEPS: [i64; 22] = [
    1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10_800, 21_600, 43_200, 86_400,
    172_800, 604_800, 2_592_000, 31_536_000,
];

/// The time axis: a line from `left` to `right`, in millimetres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) span: Span,
}

impl Axis {
    pub(crate) fn x(&self, at: Stamp) -> f64 {
        let whole = self.span.nanos().max(1) as f64;
        let part = (at.since(self.span.start) as f64 / whole).clamp(0.0, 1.0);
        self.left + part * (self.right - self.left)
    }
}

/// A point in time as text in figures: `4:56`, `1:02:03`.
pub(crate) fn clock(nanos: i64) -> String {
    // To the nearest second.
    let text = words::offset_seconds(nanos.saturating_add(500_000_000));
    text.strip_prefix('0').map_or(text.clone(), str::to_owned)
}

/// Draws the band from `y` down; phases of an odd number are darker, ramps are hatched.
pub(crate) fn band(canvas: &mut PaperCanvas<'_>, axis: &Axis, y: f64, phases: &[Phase]) {
    for (k, phase) in phases.iter().enumerate() {
        let (left, right) = (axis.x(phase.span.start), axis.x(phase.span.end));
        let rect = Rect::new(left, y, right - left, HEIGHT);
        canvas.fill(rect, ink::BAND[k % 2]);
        if phase.is_ramp {
            hatch(canvas, rect);
        }
        let middle = f64::midpoint(left, right);
        let number = (k + 1).to_string();
        if canvas.width(&number, Type::Head) < right - left {
            canvas.text_middle(middle, y + HEIGHT / 2.0, Type::Head, ink::TEXT, &number);
        }
    }
}

fn hatch(canvas: &mut PaperCanvas<'_>, rect: Rect) {
    let stroke = Stroke::solid(ink::RULE, HAIRLINE);
    let mut x = rect.x + 1.0;
    while x < rect.right() {
        let top = Point::new((x + rect.h * 0.5).min(rect.right()), rect.y);
        canvas.line(Point::new(x, rect.bottom()), top, &stroke);
        x += 1.4;
    }
}

/// Draws the axis at `y` with its times below; returns the y at which it ends below.
pub(crate) fn axis(canvas: &mut PaperCanvas<'_>, axis: &Axis, y: f64, has_unit: bool) -> f64 {
    let ruler = Stroke::solid(ink::TEXT, HAIRLINE);
    canvas.line(Point::new(axis.left, y), Point::new(axis.right, y), &ruler);
    let whole = axis.span.nanos();
    let per_mm = whole as f64 / (axis.right - axis.left).max(1.0);
    let widest = canvas.width(&clock(whole), Type::Small) + 3.5;
    let fits = |s: &i64| *s as f64 * 1e9 / per_mm >= widest;
    let step = STEPS.into_iter().find(fits).unwrap_or(STEPS[21]) * 1_000_000_000;
    let middle = y + 0.9 + canvas.cap(Type::Small) / 2.0 + 0.35;
    if has_unit {
        let unit = if whole >= 3_600_000_000_000 {
            "h:min:s"
        } else {
            "min:s"
        };
        canvas.text_end(axis.left - 0.9, middle, Type::Small, ink::QUIET, unit);
    }
    let mut at = 0_i64;
    while at <= whole {
        let x = axis.x(axis.span.start.plus(at));
        canvas.line(Point::new(x, y), Point::new(x, y + 0.8), &ruler);
        let text = clock(at);
        let half = canvas.width(&text, Type::Small) / 2.0;
        let centre = x.max(axis.left + half).min(axis.right - half);
        canvas.text_middle(centre, middle, Type::Small, ink::QUIET, &text);
        at += step;
    }
    middle + canvas.cap(Type::Small) / 2.0 + 0.7
}

/// The title of a phase in a figure: `navigation (+4)`, `picking (+4 −4)`, `boot (11)`, `row (=)`, `(+2) as 3`.
pub(crate) fn title(source: &FigureSource<'_>, k: usize) -> String {
    let Some(phase) = source.phases.get(k) else {
        return String::new();
    };
    let counts = match (k, phase.nodes_added, phase.nodes_removed) {
        (0, all, _) => format!("({all})"),
        (_, 0, 0) => "(=)".to_owned(),
        (_, added, 0) => format!("(+{added})"),
        (_, 0, removed) => format!("(−{removed})"),
        (_, added, removed) => format!("(+{added} −{removed})"),
    };
    let name = if source.is_named || phase.is_ramp {
        format!("{} ", phase.name)
    } else {
        String::new()
    };
    let again = phase.same_as.map(|k| format!(" as {}", k + 1));
    format!("{name}{counts}{}", again.unwrap_or_default())
}

/// Draws the names of the phases from `y` on: at their positions on at most two lines if `axis` is long
/// enough, else as running text. Returns the y at which they end.
pub(crate) fn names(
    canvas: &mut PaperCanvas<'_>,
    source: &FigureSource<'_>,
    width: f64,
    y: f64,
    at: Option<&Axis>,
) -> f64 {
    let titles: Vec<String> = (0..source.phases.len()).map(|k| title(source, k)).collect();
    if let Some(end) = at.and_then(|axis| staircase(canvas, source, axis, y, &titles)) {
        return end;
    }
    let items: Vec<Unbroken> = titles
        .iter()
        .enumerate()
        .map(|(k, title)| {
            vec![
                TextRun::Words(Type::Strong, ink::TEXT, format!("{} ", k + 1)),
                TextRun::Words(Type::Small, ink::TEXT, title.clone()),
            ]
        })
        .collect();
    flow(canvas, width, y, &items)
}

/// Draws the titles of the phases, set from the right: each is placed a line lower than every later one that
/// it overlaps, so that no leader crosses a text. Returns the y at which they end; `None` if that takes more
/// than three lines.
fn staircase(
    canvas: &mut PaperCanvas<'_>,
    source: &FigureSource<'_>,
    axis: &Axis,
    y: f64,
    titles: &[String],
) -> Option<f64> {
    let line = canvas.sizes.line();
    let mut placed: Vec<(f64, f64, usize)> = Vec::new();
    for (phase, title) in source.phases.iter().zip(titles).rev() {
        let wide = canvas.width(title, Type::Small) + 0.7;
        let left = axis.x(phase.span.start).min(axis.right - wide);
        let under = placed
            .iter()
            .filter(|(other, ..)| left + wide + 1.2 > *other);
        let row = under.map(|(.., row)| row + 1).max().unwrap_or(0);
        placed.push((left, wide, row));
    }
    let rows = placed.iter().map(|(.., row)| row + 1).max()?;
    if rows > 3 {
        return None;
    }
    placed.reverse();
    let leader = Stroke::solid(ink::RULE, HAIRLINE);
    for ((phase, title), (left, _, row)) in source.phases.iter().zip(titles).zip(&placed) {
        let middle = y + 0.5 + line * (*row as f64 + 0.5);
        let x = axis.x(phase.span.start).max(axis.left + 0.1);
        canvas.line(
            Point::new(x, y),
            Point::new(x, middle + line / 2.0),
            &leader,
        );
        canvas.text(left + 0.7, middle, Type::Small, ink::TEXT, title);
    }
    Some(y + 0.5 + line * rows as f64)
}
