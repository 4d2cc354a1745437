//! The words below rows on paper: the letters explained, notes, and the legend with only the signs that are drawn.

use super::Timeline;
use super::canvas::{PaperCanvas, Type, ink};
use super::drawer::{clock, letter, put};
use super::marks::Sign;
use super::notes::{InlineSign, TextRun, Unbroken, sentence};
use super::rows::{Level, Row};
use crate::base::geometry::{Point, Rect};
use crate::base::name::last_part;
use crate::base::time::Span;
use crate::base::words;
use crate::draw::scene::Stroke;
use crate::mission::event_log::{Interruption, interrupted};

/// The most names of one kind that are reported in a note; the others are counted.
pub(crate) const MOST_NAMED: usize = 60;
/// The width of a bar, a line or an arrow in the legend, in millimetres.
const LONG: f64 = 3.2;

/// The letters explained, in order of time.
pub(crate) fn letters(timeline: &Timeline) -> Vec<Unbroken> {
    let marks = timeline.marks().into_iter().map(|(_, mark)| mark);
    let letters = marks.filter(|mark| mark.sign == Sign::Letter).enumerate();
    let item = |(k, mark): (usize, &super::marks::RowMark)| {
        let at = clock(mark.at.since(timeline.span.start));
        vec![
            TextRun::Words(Type::Strong, ink::CHANGED, format!("{} ", letter(k))),
            TextRun::Words(Type::Small, ink::TEXT, format!("{at} {}", mark.text)),
        ]
    };
    letters.map(item).collect()
}

/// The notes: the interruptions, and the members of collapsed rows, unless they are beside them.
pub(crate) fn notes(timeline: &Timeline, is_beside: bool) -> Vec<Unbroken> {
    let note = |one: &Interruption| {
        let at = clock(one.time.since(timeline.span.start));
        sentence(ink::TEXT, format!("{at} {}.", interrupted(one)))
    };
    let mut items: Vec<Unbroken> = timeline.interruptions.iter().map(note).collect();
    let mut space = "";
    for row in timeline.rows.iter().filter(|_| !is_beside) {
        if row.level == Level::Title {
            space = &row.name;
        }
        if !row.folded.is_empty() {
            let names: Vec<&str> = row.folded.iter().map(|name| last_part(name)).collect();
            let names = words::some_of(&names, MOST_NAMED);
            let within = match space {
                "" => String::new(),
                space => format!(" in {space}"),
            };
            let text = format!("Throughout{within}: {names}.");
            items.push(sentence(ink::QUIET, text));
        }
    }
    items
}

/// Every sign that is drawn, with its label.
pub(crate) fn signs(timeline: &Timeline) -> Vec<Unbroken> {
    let open = timeline.rows.iter();
    let open: Vec<&Row> = open.filter(|r| r.folded.is_empty()).collect();
    let is_silent = |row: &&Row| {
        let busy: i64 = row.bars.iter().map(|b| b.span.nanos()).sum();
        let alive: i64 = row.lives.iter().map(Span::nanos).sum();
        alive - busy > alive / 50
    };
    let marks = || timeline.rows.iter().flat_map(|row| &row.marks);
    let has = |sign| marks().any(|mark| mark.sign == sign);
    let mut items = Vec::new();
    let mut add = |is_drawn: bool, sign: InlineSign, words: &str| {
        let words = TextRun::Words(Type::Small, ink::QUIET, words.to_owned());
        items.extend(is_drawn.then(|| vec![TextRun::Sign(sign), words]));
    };
    let sends = open.iter().any(|row| !row.bars.is_empty());
    let words = "publishes (height: share of the row’s maximum)";
    add(sends, (LONG, bar), words);
    let is_rated = sends && timeline.rows.iter().any(|row| row.hz.is_some());
    add(is_rated, (0.0, |_, _, _| ()), "Hz: while sending");
    let is_silent = open.iter().any(is_silent);
    add(is_silent, (LONG, |c, x, y| line(c, x, y, &[])), "silent");
    let is_inferred = open.iter().any(|row| row.is_inferred);
    let dashed: InlineSign = (LONG, |c, x, y| line(c, x, y, &[0.55, 0.5]));
    add(is_inferred, dashed, "inferred");
    let start: InlineSign = (0.6, |c, x, y| sign(c, Sign::Start, x + 0.3, y));
    add(has(Sign::Start), start, "starts");
    let end: InlineSign = (1.2, |c, x, y| sign(c, Sign::End, x + 0.6, y));
    add(has(Sign::End), end, "ends");
    add(has(Sign::Handover), (LONG, arrow), "topic is taken over");
    let dot: InlineSign = (1.0, |c, x, y| sign(c, Sign::Dot, x + 0.5, y));
    add(has(Sign::Dot), dot, "other change");
    items
}

fn sign(canvas: &mut PaperCanvas<'_>, sign: Sign, x: f64, y: f64) {
    put(canvas, sign, Point::new(x, y), 1.0);
}

fn bar(canvas: &mut PaperCanvas<'_>, x: f64, y: f64) {
    canvas.fill(Rect::new(x, y - 1.0, 1.6, 2.0), ink::BAR);
    canvas.fill(Rect::new(x + 1.6, y - 0.4, 1.6, 0.8), ink::BAR);
}

fn line(canvas: &mut PaperCanvas<'_>, x: f64, y: f64, dash: &[f64]) {
    let stroke = Stroke::dashed(ink::LINE, 0.28, dash);
    canvas.line(Point::new(x, y), Point::new(x + LONG, y), &stroke);
}

fn arrow(canvas: &mut PaperCanvas<'_>, x: f64, y: f64) {
    let stroke = Stroke::solid(ink::CHANGED, 0.3);
    let (from, tip) = (Point::new(x + 0.55, y), Point::new(x + LONG, y));
    canvas.line(from, Point::new(x + 2.2, y), &stroke);
    canvas.disc(from, 0.55, ink::CHANGED, &Stroke::default());
    canvas.head(from, tip, 1.3, ink::CHANGED);
}
