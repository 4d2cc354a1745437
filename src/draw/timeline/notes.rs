//! Running text around rows on paper: runs of words and signs that wrap at the width, and the names and titles of phases.

use super::FigureSource;
use super::canvas::{PaperCanvas, Type, ink};
use crate::base::geometry::Point;
use crate::base::time::Span;
use crate::draw::style::Color;
use crate::mission::event_log::Phase;

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
    let [name, again] = [name, again].map(Option::unwrap_or_default);
    format!("{name}({counts}){again}")
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
