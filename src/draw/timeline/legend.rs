//! The words around rows on paper: the names of phases above; below, the letters explained, notes, and the legend with only
//! the signs that are drawn.

use super::canvas::{PaperCanvas, Type, ink};
use super::drawer::{clock, letter, put};
use super::marks::Sign;
use super::rows::{Level, Row};
use super::{FigureSource, Timeline};
use crate::base::geometry::{Point, Rect};
use crate::base::name::last_part;
use crate::base::time::Span;
use crate::base::words;
use crate::draw::scene::Stroke;
use crate::draw::style::Color;
use crate::mission::event_log::{Interruption, Phase, interrupted};

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

// Running text below a figure: runs of words and signs that wrap at the width.

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
const LONGEST: usize = 2000;

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
        if text.len() <= LONGEST && canvas.width(text.trim_end(), of) <= room {
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

// The phases of the mission: their names in the band above rows, and their titles below a figure.

/// A phase in the band.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhaseLabel {
    pub(crate) span: Span,
    /// Its names, the best first, the shortest last.
    pub(crate) names: Vec<String>,
}

/// The phases by their numbers, which a figure explains below.
pub(crate) fn numbered(source: &FigureSource<'_>) -> Vec<PhaseLabel> {
    let label = |(k, phase): (usize, &Phase)| PhaseLabel {
        span: phase.span,
        names: vec![(k + 1).to_string()],
    };
    source.phases.iter().enumerate().map(label).collect()
}

/// The phases with their names: the user's, else the elements that begin, else those that end, each name with as many of
/// them as fit. A phase with the same nodes as the previous one is merged with it.
pub(crate) fn named(source: &FigureSource<'_>) -> Vec<PhaseLabel> {
    let mut phases: Vec<PhaseLabel> = Vec::new();
    for (k, phase) in source.phases.iter().enumerate() {
        if let Some(last) = phases.last_mut()
            && !source.is_named
            && counts(k, phase).is_empty()
        {
            last.span.end = phase.span.end;
            continue;
        }
        let names = match phase.name.split_once(": ").filter(|_| !source.is_named) {
            Some((count, those)) => {
                let sign: String = count.chars().take(1).collect();
                shorter(&sign, those, phase.nodes_added.max(phase.nodes_removed))
            }
            None if k == 0 && !source.is_named => {
                let names = [&*phase.name, "start"].map(str::to_owned);
                names[usize::from(phase.nodes_added == 0)..].to_vec()
            }
            None => vec![phase.name.to_string()],
        };
        phases.push(PhaseLabel {
            span: phase.span,
            names,
        });
    }
    phases
}

/// The numbers of elements that a phase adds and removes, `+4 −1`; none in the first.
fn counts(k: usize, phase: &Phase) -> String {
    let counts = [('+', phase.nodes_added), ('−', phase.nodes_removed)];
    let counts = counts.iter().filter(|(_, many)| *many > 0 && k > 0);
    let counts: Vec<String> = counts.map(|(sign, n)| format!("{sign}{n}")).collect();
    counts.join(" ")
}

/// The elements that began or ended, in fewer and fewer words: all that the phase names, two and one of them with the
/// number of the others, the shortest of them.
fn shorter(sign: &str, those: &str, all: u32) -> Vec<String> {
    let mut names = vec![format!("{sign} {those}")];
    let (first, last) = those.rsplit_once(" and ").unwrap_or((those, ""));
    let last = Some(last).filter(|last| !last.is_empty() && !last.ends_with(" more"));
    let each: Vec<&str> = first.split(", ").chain(last).collect();
    for most in [2, 1] {
        let rest = (all as usize).saturating_sub(most);
        if each.len() > most && rest > 0 {
            names.push(format!("{sign} {}, +{rest}", each[..most].join(", ")));
        }
    }
    let short = each.iter().min_by_key(|name| name.chars().count());
    names.extend(short.map(|name| format!("{sign} {name}")));
    names
}

/// The title of a phase in a figure: `navigation (+4)`, `picking (+4 −4)`, `boot (11)`, `row (=)`, `(+2) as 3`.
pub(crate) fn title(source: &FigureSource<'_>, k: usize) -> String {
    let Some(phase) = source.phases.get(k) else {
        return String::new();
    };
    let counts = match counts(k, phase) {
        _ if k == 0 => phase.nodes_added.to_string(),
        none if none.is_empty() => "=".to_owned(),
        counts => counts,
    };
    let is_said = source.is_named || phase.is_ramp;
    let name = is_said.then(|| format!("{} ", phase.name));
    let again = phase.same_as.map(|k| format!(" as {}", k + 1));
    [name, Some(format!("({counts})")), again]
        .into_iter()
        .flatten()
        .collect()
}

/// Draws the titles of the phases as running text from `y` on; returns the y at which they end.
pub(crate) fn names(
    canvas: &mut PaperCanvas<'_>,
    source: &FigureSource<'_>,
    width: f64,
    y: f64,
) -> f64 {
    let item = |k: usize| {
        vec![
            TextRun::Words(Type::Strong, ink::TEXT, format!("{} ", k + 1)),
            TextRun::Words(Type::Small, ink::TEXT, title(source, k)),
        ]
    };
    let items: Vec<Unbroken> = (0..source.phases.len()).map(item).collect();
    flow(canvas, width, y, &items)
}
