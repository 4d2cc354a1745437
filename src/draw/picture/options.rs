//! The paint of an element: its mark takes precedence over its state, and that over its confidence.

use std::borrow::Cow;
use std::collections::BTreeSet;

use super::Measured;
use crate::draw::scene::{Group, Stroke};
use crate::draw::style::{Body, Change, Color, Quiet, Style};
use crate::draw::text::Weight;
use crate::evidence::Confidence;
use crate::graph::State;
use crate::view::{Arrow, ArrowKind, Frame, ItemId, ItemKind, Mark, SeenWindow, Shown, ShownRuns};

/// The paint of a box or an arrow.
pub(crate) struct Paint {
    pub(crate) fill: Color,
    pub(crate) stroke: Stroke,
    pub(crate) text: Color,
    /// The smaller line of a box.
    pub(crate) small: (Weight, Color),
    /// Whether an arrow begins with a dot: active through a latched message.
    pub(crate) dot: bool,
    /// A glow around it, to draw attention.
    pub(crate) glow: Color,
}

/// The section of the style for a mark.
pub(crate) fn change(style: &Style, mark: Mark) -> &Change {
    match mark {
        Mark::Added => &style.added,
        Mark::Removed | Mark::Away => &style.removed,
        _ => &style.changed,
    }
}

/// The glow of a change, which would show nothing around each of many.
fn glow(change: &Change, shown: &Shown) -> Color {
    if shown.is_one_of_many {
        Color::NONE
    } else {
        change.glow
    }
}

/// The look of a box of this kind without a change.
pub(crate) fn body(style: &Style, kind: ItemKind) -> &Body {
    match kind {
        ItemKind::Node | ItemKind::Namespace => &style.node,
        ItemKind::Topic | ItemKind::Group => &style.topic,
    }
}

/// The paint of a box.
pub(crate) fn of_box(style: &Style, body: &Body, shown: &Shown) -> Paint {
    let plain = Paint {
        fill: body.fill,
        stroke: Stroke::dashed(body.stroke, body.width, dash(style, shown)),
        text: body.text,
        small: (Weight::Regular, style.page.quiet),
        dot: false,
        glow: Color::NONE,
    };
    paint(style, shown, plain)
}

/// The paint of what would be `plain` without a change and with activity of its own.
fn paint(style: &Style, shown: &Shown, plain: Paint) -> Paint {
    if let Some(quiet) = quiet(style, shown) {
        return Paint {
            fill: quiet.fill,
            stroke: Stroke::dashed(quiet.stroke, quiet.width, &quiet.dash),
            text: quiet.text,
            small: (Weight::Regular, quiet.text),
            dot: false,
            ..plain
        };
    }
    let Some(mark) = shown.mark else { return plain };
    let change = change(style, mark);
    Paint {
        fill: change.fill,
        stroke: Stroke::dashed(change.color, change.width, &change.dash),
        text: change.text,
        small: (Weight::SemiBold, change.color),
        glow: glow(change, shown),
        ..plain
    }
}

/// The look of what is there without activity of its own, if a box or an arrow is; `None` for a change.
fn quiet<'a>(style: &'a Style, shown: &Shown) -> Option<Cow<'a, Quiet>> {
    let quiet = match (shown.mark, shown.state, shown.confidence) {
        (Some(Mark::Away), ..) => return Some(Cow::Owned(style.away())),
        (None, State::Declared, _) | (None, _, Confidence::Declared) => &style.declared,
        (None, State::Silent, _) => &style.silent,
        _ => return None,
    };
    Some(Cow::Borrowed(quiet))
}

/// The dashes of what is only inferred; of everything else none.
fn dash<'a>(style: &'a Style, shown: &Shown) -> &'a [f64] {
    match shown.confidence {
        Confidence::Inferred => &style.inferred.dash,
        _ => &[],
    }
}

/// The paint of an arrow.
pub(crate) fn of_arrow(style: &Style, kind: &ArrowKind, shown: &Shown) -> Paint {
    let edge = &style.edge;
    let by_rate = width_of(style, shown.steady_hz);
    let known = shown.steady_hz.is_some() || *kind == ArrowKind::Publish;
    let width = match shown.confidence {
        Confidence::Stated if !known => style.stated.width,
        _ => by_rate,
    };
    let plain = Paint {
        fill: Color::NONE,
        stroke: Stroke::dashed(edge.stroke, width, dash(style, shown)),
        text: edge.text,
        small: (Weight::Regular, edge.text),
        dot: shown.state == State::Latched,
        glow: Color::NONE,
    };
    let mut paint = paint(style, shown, plain);
    // The style's width of a change is that of a box; a line between boxes is noticed with two thirds of it.
    let width = &mut paint.stroke.width;
    match shown.mark {
        None | Some(Mark::Away) => {}
        // A full line in this color would stand out more than one that is there.
        Some(Mark::Removed) => *width *= 0.8,
        // As wide as its rate requires, but never narrower than a visible change.
        Some(_) => *width = (*width * 0.65).max(by_rate),
    }
    paint
}

/// The width of an arrow: thicker for higher rates, by their logarithm.
fn width_of(style: &Style, hz: Option<f64>) -> f64 {
    let hz = hz.filter(|hz| hz.is_finite()).unwrap_or(0.0).max(0.0);
    let edge = &style.edge;
    (edge.width + edge.per_decade * libm::log10(1.0 + hz)).min(edge.most)
}

// The spotlight: in a window with news, boxes and lines that have no part in them are drawn paler.

/// The fewest boxes of a picture that is not seen at a glance.
const FEWEST: usize = 5;

/// What has a part in the news of a window.
pub(super) struct Spotlight<'a> {
    style: &'a Style,
    /// The boxes that changed, or list something that did.
    news: BTreeSet<ItemId>,
    /// These, and those at the other ends of their lines and of lines that changed.
    pub(super) lit: BTreeSet<ItemId>,
}

impl<'a> Spotlight<'a> {
    /// The spotlight of window `k`; none in a picture of few boxes, on paper, and without news.
    pub(super) fn new(
        measured: &Measured<'a>,
        (k, frame): (usize, &Frame),
        seen: &SeenWindow,
    ) -> Option<Self> {
        let (view, options) = (measured.view, &measured.options);
        let is_film = view.has_time() && !options.bare && options.width_mm.is_none();
        if !is_film || frame.caption.is_empty() || seen.items.len() < FEWEST {
            return None;
        }
        let changed = seen.items.iter().filter(|shown| is_news(shown));
        let is_new = |looks: &ShownRuns| looks.at(k).is_some_and(is_news);
        let rows = view.rows.iter().filter(|row| is_new(&row.shown));
        let rows = rows.map(|row| row.owner);
        let news: BTreeSet<ItemId> = changed.map(Shown::item).chain(rows).collect();
        let mut spot = Self {
            style: measured.style,
            lit: news.clone(),
            news,
        };
        for shown in &seen.arrows {
            let arrow = &view.arrows[shown.arrow()];
            if spot.has_line(arrow, shown) {
                spot.lit.extend([arrow.from, arrow.to]);
            }
        }
        (!spot.lit.is_empty()).then_some(spot)
    }

    /// Whether a line has a part in the news.
    pub(super) fn has_line(&self, arrow: &Arrow, shown: &Shown) -> bool {
        is_news(shown)
            || [arrow.from, arrow.to]
                .iter()
                .any(|end| self.news.contains(end))
    }

    /// The group in paler colours.
    pub(super) fn pale(&self, group: &mut Group) {
        group.fade(self.style.background(), 1.0 - self.style.page.spotlight);
    }
}

/// Whether something changed in this window.
fn is_news(shown: &Shown) -> bool {
    shown.mark.is_some_and(|mark| mark != Mark::Away)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(state: State, confidence: Confidence, mark: Option<Mark>, hz: f64) -> Shown {
        Shown {
            mark,
            steady_hz: Some(hz),
            ..Shown::plain(0, state, confidence)
        }
    }

    #[test]
    fn faster_arrows_are_thicker_up_to_a_limit() {
        let style = Style::builtin("light").unwrap();
        let width = |hz| {
            let shown = shown(State::Active, Confidence::Measured, None, hz);
            of_arrow(&style, &ArrowKind::Publish, &shown).stroke.width
        };
        assert!(width(0.0) < width(1.0) && width(1.0) < width(50.0) && width(50.0) < width(1e3));
        assert!(width(1e300) <= style.edge.most && width(f64::NAN) <= width(0.0));
    }

    #[test]
    fn differences_are_visible_in_greyscale() {
        for name in ["light", "dark", "paper", "rqt"] {
            let style = Style::builtin(name).unwrap();
            let active = (State::Active, Confidence::Measured, None);
            let looks = [
                active,
                (State::Silent, Confidence::Measured, None),
                (State::Declared, Confidence::Declared, None),
                (State::Active, Confidence::Inferred, None),
                (State::Active, Confidence::Measured, Some(Mark::Added)),
                (State::Active, Confidence::Measured, Some(Mark::Removed)),
            ];
            let shape = |(state, confidence, mark)| {
                let look = of_box(&style, &style.topic, &shown(state, confidence, mark, 1.0));
                (look.stroke.dash, (look.stroke.width * 100.0).to_string())
            };
            let mut shapes: Vec<_> = looks.map(shape).to_vec();
            shapes.sort_by(|a, b| a.partial_cmp(b).unwrap());
            shapes.dedup();
            assert_eq!(shapes.len(), looks.len(), "{name}");
        }
    }
}
