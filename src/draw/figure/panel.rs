//! One step as a panel: its boxes by their states, its arrows, its words.

use super::place::PlacedPanel;
use super::talks::Talk;
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::scene::Stroke;
use crate::draw::style::Color;
use crate::draw::timeline::canvas::{HAIRLINE, PaperCanvas, Type, ink};
use crate::draw::timeline::notes::{Unbroken, flow_at, sentence};
use crate::mission::EventId;

/// The space inside a panel's border in millimetres.
pub(crate) const INSIDE: f64 = 1.3;

/// The state of a box in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BoxState {
    Began,
    Ended,
    ChangedHands,
    Neighbour,
}

/// One box of a panel.
pub(crate) struct PanelBox {
    pub(crate) state: BoxState,
    /// The namespace of its names, `/robot2`; empty for that of the whole panel.
    pub(crate) space: String,
    pub(crate) lines: Vec<String>,
    /// The events of the log in it.
    pub(crate) events: Vec<EventId>,
}

impl PanelBox {
    /// Whether the namespace has a separate line, because it is long or shared by several names.
    fn has_head(&self) -> bool {
        match self.space.as_str() {
            "" => false,
            "/" => self.lines.len() > 1,
            _ => true,
        }
    }

    /// Its size in millimetres.
    pub(crate) fn size(&self, canvas: &PaperCanvas<'_>) -> Size {
        let names = self
            .lines
            .iter()
            .map(|l| canvas.width(l, type_of(self.state)));
        let widest = names.fold(0.0, f64::max);
        let space = canvas.width(&self.space, Type::Small);
        let (wide, rows) = if self.has_head() {
            (widest.max(space), self.lines.len() + 1)
        } else {
            (widest + space, self.lines.len())
        };
        Size::new(wide + 2.0, canvas.sizes.line() * rows as f64 + 0.9)
    }
}

/// A panel laid out, its top left corner at (0, 0).
pub(crate) struct Panel {
    /// The events of the log in it.
    pub(crate) events: Vec<EventId>,
    /// Its number and its words.
    pub(crate) heading: (String, String),
    /// The namespace of the names that have none before them; empty if there is none.
    pub(crate) home: String,
    pub(crate) looks: Vec<PanelBox>,
    pub(crate) talks: Vec<(Talk, BoxState)>,
    pub(crate) labels: Vec<Vec<Vec<String>>>,
    pub(crate) placed: PlacedPanel,
    pub(crate) notes: Vec<(Color, String)>,
    pub(crate) height: f64,
    /// The height of the notes in millimetres.
    pub(crate) foot: f64,
    /// The number of nodes that exist before or after the step and are not drawn.
    pub(crate) undrawn: usize,
}

impl Panel {
    /// The nodes that began and ended, without namespaces and numbers, sorted: equal for steps that repeat each other.
    pub(crate) fn changes(&self) -> Vec<(bool, String)> {
        let changed = self.looks.iter().filter(|look| {
            let states = [BoxState::Began, BoxState::Ended];
            states.contains(&look.state)
        });
        let names = changed.flat_map(|look| {
            let is_digit = |c: char| c.is_ascii_digit() || c == '_';
            let plain = move |line: &String| line.trim_end_matches(is_digit).to_owned();
            let names = look.lines.iter().map(plain);
            names.map(|name| (look.state == BoxState::Began, name))
        });
        let mut names: Vec<_> = names.collect();
        names.sort();
        names
    }
}

/// Notes as running text.
pub(crate) fn items(notes: &[(Color, String)]) -> Vec<Unbroken> {
    let item = |(color, text): &(Color, String)| sentence(*color, text.as_str());
    notes.iter().map(item).collect()
}

pub(crate) fn type_of(state: BoxState) -> Type {
    if state == BoxState::Neighbour {
        Type::Small
    } else {
        Type::Strong
    }
}

/// Draws a panel into its frame.
pub(crate) fn paint(canvas: &mut PaperCanvas<'_>, panel: &Panel, rect: Rect) {
    canvas.frame(rect, 0.4, ink::PAPER, &Stroke::solid(ink::FOLDED, HAIRLINE));
    let (x, width) = (rect.x + INSIDE, rect.w - 2.0 * INSIDE);
    let y = rect.y + INSIDE * 0.8 + canvas.cap(Type::Head) / 2.0 + 0.2;
    canvas.text(x, y, Type::Head, ink::TEXT, &panel.heading.0);
    let at = canvas.width(&panel.heading.0, Type::Head) + 1.4;
    canvas.text_end(x + width, y, Type::Small, ink::QUIET, &panel.home);
    let room = width - at - canvas.width(&panel.home, Type::Small) - 1.4;
    let words = canvas.cut(&panel.heading.1, Type::Name, room);
    canvas.text(x + at, y, Type::Name, ink::TEXT, &words);
    let top = rect.bottom() - INSIDE * 0.8 - panel.foot + 0.3;
    flow_at(canvas, Point::new(x, top), width, &items(&panel.notes));
    let aside = x + 0.4 + ((width - 1.2 - panel.placed.size.w) / 2.0).max(0.0);
    let placed = panel
        .placed
        .clone()
        .moved(aside, rect.y + INSIDE * 0.8 + canvas.sizes.pitch() + 0.6);
    for (at, (talk, state)) in panel.talks.iter().enumerate() {
        let color = match state {
            BoxState::Ended => ink::REMOVED,
            BoxState::Neighbour => ink::LINE,
            BoxState::Began | BoxState::ChangedHands => ink::ADDED,
        };
        let dash: &[f64] = if *state == BoxState::Ended {
            &[0.9, 0.6]
        } else {
            &[]
        };
        placed.arrow(canvas, at, color, talk.pen(), dash);
    }
    for (at, lines) in panel.labels.iter().enumerate() {
        placed.label(canvas, at, lines);
    }
    for (look, rect) in panel.looks.iter().zip(&placed.boxes) {
        canvas.begin_mark("box", &look.events, String::new());
        boxed(canvas, look, *rect);
    }
}

fn boxed(canvas: &mut PaperCanvas<'_>, look: &PanelBox, rect: Rect) {
    let (fill, color, dash, width) = match look.state {
        BoxState::Began => (ink::ADDED_FILL, ink::ADDED, &[][..], 0.38),
        BoxState::Ended => (ink::PAPER, ink::REMOVED, &[1.1, 0.7][..], 0.38),
        BoxState::ChangedHands => (ink::CHANGED_FILL, ink::CHANGED, &[][..], 0.3),
        BoxState::Neighbour => (ink::TINT, ink::RULE, &[][..], HAIRLINE),
    };
    canvas.frame(rect, 0.6, fill, &Stroke::dashed(color, width, dash));
    if look.state == BoxState::ChangedHands {
        // A double frame, to be distinguishable in greyscale print.
        let inner = Stroke::solid(ink::CHANGED, HAIRLINE);
        canvas.frame(rect.grown(-0.45), 0.3, Color::NONE, &inner);
    }
    let line = canvas.sizes.line();
    let y = |k: usize| rect.y + 0.45 + line * (k as f64 + 0.5);
    canvas.text(rect.x + 1.0, y(0), Type::Small, ink::QUIET, &look.space);
    let (below, aside) = if look.has_head() {
        (1, 0.0)
    } else {
        (0, canvas.width(&look.space, Type::Small))
    };
    for (k, text) in look.lines.iter().enumerate() {
        let x = rect.x + 1.0 + aside;
        canvas.text(x, y(k + below), type_of(look.state), ink::TEXT, text);
    }
    if matches!(look.state, BoxState::Began | BoxState::Ended) {
        badge(canvas, Point::new(rect.right(), rect.y), look.state, color);
    }
}

/// Draws a disc with a plus or a minus at a corner.
fn badge(canvas: &mut PaperCanvas<'_>, at: Point, state: BoxState, color: Color) {
    canvas.disc(at, 0.75, color, &Stroke::default());
    let sign = Stroke::solid(ink::PAPER, 0.26);
    let (x, y, half) = (at.x, at.y, 0.42);
    canvas.line(Point::new(x - half, y), Point::new(x + half, y), &sign);
    if state == BoxState::Began {
        canvas.line(Point::new(x, y - half), Point::new(x, y + half), &sign);
    }
}
