//! Running text below a figure: runs of words and signs that wrap at the width.

use super::canvas::{PaperCanvas, Type};
use crate::base::geometry::Point;
use crate::draw::style::Color;

/// A small drawing inside a text: its width in millimetres, and the function that draws it from its left end and its
/// middle line.
pub(crate) type InlineSign = (f64, fn(&mut PaperCanvas<'_>, f64, f64));

/// A part of a text.
pub(crate) enum TextRun {
    Words(Type, Color, String),
    Sign(InlineSign),
}

/// Runs of text that are kept on one line if possible.
pub(crate) type Unbroken = Vec<TextRun>;

/// The most bytes of a text that is measured as a whole: no line fits a longer one.
const LONG: usize = 2000;

/// The space between items in millimetres: as high as the text, so that it is more than a space between words.
const GAP: f64 = 2.6;

/// Writes items one after another from `y`, the top, on; wraps before an item that does not fit, and inside one that is
/// wider than a line. Returns the y at which the next line would begin.
pub(crate) fn flow(canvas: &mut PaperCanvas<'_>, width: f64, y: f64, items: &[Unbroken]) -> f64 {
    flow_at(canvas, Point::new(0.0, y), width, items)
}

/// As [`flow`], from a top left corner on.
pub(crate) fn flow_at(
    canvas: &mut PaperCanvas<'_>,
    corner: Point,
    width: f64,
    items: &[Unbroken],
) -> f64 {
    let line = canvas.sizes.line();
    let mut pen = NotePlace {
        left: corner.x,
        x: 0.0,
        y: corner.y + line / 2.0,
        width,
        line,
    };
    for item in items {
        let whole: f64 = item.iter().map(|run| run_width(canvas, run)).sum();
        if pen.x > 0.0 && pen.x + GAP + whole > width {
            pen.wrap();
        } else if pen.x > 0.0 {
            pen.x += GAP;
        }
        for run in item {
            pen.put(canvas, run);
        }
    }
    if items.is_empty() {
        corner.y
    } else {
        pen.y + line / 2.0
    }
}

/// A sentence of ordinary words.
pub(crate) fn sentence(color: Color, text: impl Into<String>) -> Unbroken {
    vec![TextRun::Words(Type::Small, color, text.into())]
}

struct NotePlace {
    left: f64,
    /// The distance of the next text from the left end of the line.
    x: f64,
    y: f64,
    width: f64,
    line: f64,
}

impl NotePlace {
    fn wrap(&mut self) {
        self.x = 0.0;
        self.y += self.line;
    }

    fn put(&mut self, canvas: &mut PaperCanvas<'_>, run: &TextRun) {
        match run {
            TextRun::Sign((width, draw)) => {
                draw(canvas, self.left + self.x, self.y);
                self.x += width + 0.8;
            }
            TextRun::Words(of, color, text) => {
                let mut rest = text.as_str();
                while !rest.is_empty() {
                    let (now, after) = self.split(canvas, *of, rest);
                    let x = self.left + self.x;
                    canvas.text(x, self.y, *of, *color, now.trim_end());
                    self.x += canvas.width(now, *of);
                    rest = after;
                    if !rest.is_empty() {
                        self.wrap();
                    }
                }
            }
        }
    }

    /// The text split after the words that fit on this line, at least one word on an empty line.
    fn split<'t>(&self, canvas: &PaperCanvas<'_>, of: Type, text: &'t str) -> (&'t str, &'t str) {
        let room = self.width - self.x + 0.01;
        if text.len() <= LONG && canvas.width(text.trim_end(), of) <= room {
            return (text, "");
        }
        let breaks = text.match_indices(' ').map(|(at, _)| at + 1);
        let fits = |at: &usize| canvas.width(text[..*at].trim_end(), of) <= room;
        let at = breaks.clone().take_while(fits).last();
        // A first word that is too long for the rest of the line goes to the next one; one that is too long for any
        // line is conspicuous.
        let at = at.or_else(|| (self.x > 0.0).then_some(0));
        let at = at.or_else(|| breaks.clone().next()).unwrap_or(text.len());
        (&text[..at], &text[at..])
    }
}

fn run_width(canvas: &PaperCanvas<'_>, run: &TextRun) -> f64 {
    match run {
        TextRun::Sign((width, _)) => width + 0.8,
        TextRun::Words(of, _, text) => canvas.width(text, *of),
    }
}
