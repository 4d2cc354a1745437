//! The legend: the meaning of the signs that occur, in one row, or more on a narrow page.

use super::arrows::Tip;
use super::badge::badge;
use super::boxes::hexagon;
use super::{PageFrame, options};
use crate::base::geometry::{Point, Rect};
use crate::base::words;
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Stroke, Text, line};
use crate::draw::style::Style;
use crate::draw::text::{Fonts, Weight};
use crate::evidence::Confidence;
use crate::graph::State;
use crate::view::{ArrowKind, ItemKind, Mark, Shown, ShownRuns, View};

/// A sign with its meaning.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LegendSign {
    Node,
    Topic,
    Service,
    Group,
    Namespace,
    Row,
    Change(Mark),
    Box(State),
    Line(Confidence),
    Starved,
    Width,
}

/// The signs that occur in the view, with their words.
pub(crate) fn signs(view: &View, rate_change: f64) -> Vec<(LegendSign, String)> {
    let kind = |kind| view.items.iter().any(|i| i.kind == kind);
    let any = |is: &dyn Fn(&Shown) -> bool| view.all_shown().any(is);
    let mark = |marks: &[Mark]| any(&|s| s.mark.is_some_and(|m| marks.contains(&m)));
    let change = |own, words| (mark(&[own]), LegendSign::Change(own), words);
    let state = |state, words| {
        let boxes = view.items_shown.iter().chain(&view.arrows_shown);
        let mut looks = boxes.flat_map(ShownRuns::distinct);
        let is_there = looks.any(|s| s.state == state && s.mark.is_none());
        (is_there, LegendSign::Box(state), words)
    };
    let confidence = |confidence, words| {
        let mut looks = view.arrows_shown.iter().flat_map(ShownRuns::distinct);
        let is_there = looks.any(|s| s.confidence == confidence);
        (is_there, LegendSign::Line(confidence), words)
    };
    let (added, removed) = if view.compares {
        ("only in B", "only in A")
    } else {
        ("added", "removed")
    };
    let mut items = view.items.iter();
    let is_topic = items.any(|i| i.kind == ItemKind::Topic && !i.is_service);
    let is_service =
        view.items.iter().any(|i| i.is_service) || view.arrows.iter().any(|a| a.is_service);
    let (namespace, has_rows) = (kind(ItemKind::Namespace), !view.rows.is_empty());
    let is_rate = mark(&[Mark::Faster, Mark::Slower]);
    let rate = format!("rate ± {} %", words::percent(rate_change));
    let is_starved = any(&|s| s.is_starved);
    let is_rated = !view.arrows.is_empty() && any(&|s| s.hz.is_some());
    let unknown = "topic whose other end is unknown";
    let starved = "gets nothing (quality of service)";
    let all = [
        (kind(ItemKind::Node), LegendSign::Node, "node"),
        (is_topic, LegendSign::Topic, "topic"),
        (is_service, LegendSign::Service, "service"),
        (kind(ItemKind::Group), LegendSign::Group, "group"),
        (namespace, LegendSign::Namespace, "namespace"),
        (has_rows, LegendSign::Row, unknown),
        change(Mark::Added, added),
        change(Mark::Removed, removed),
        (is_rate, LegendSign::Change(Mark::Slower), &*rate),
        change(Mark::HandedOver, "handed over"),
        change(Mark::Restarted, "back"),
        change(Mark::Paused, "fell silent"),
        change(Mark::Changed, "changed"),
        change(Mark::Inside, "changed inside"),
        state(State::Silent, "silent"),
        state(State::Latched, "latched"),
        state(State::Declared, "declared only"),
        confidence(Confidence::Stated, "stated"),
        confidence(Confidence::Inferred, "inferred"),
        (is_starved, LegendSign::Starved, starved),
        (is_rated, LegendSign::Width, "thicker = higher rate"),
    ];
    let present = all.into_iter().filter(|(occurs, _, _)| *occurs);
    present
        .map(|(_, sign, words)| (sign, words.to_owned()))
        .collect()
}

/// The widths of a sign (an arrow with its head, or a box that is not a square), of the space before its words, and of the
/// space after them: twice that before, so that words belong to the sign on their left.
const SIGN: f64 = 24.0;
const GAP: f64 = 6.0;
const AFTER: f64 = 14.0;

/// The signs in rows that fit the page's width.
pub(crate) fn rows(
    signs: &[(LegendSign, String)],
    style: &Style,
    fonts: &Fonts,
    unit: f64,
    width: f64,
) -> Vec<Vec<(LegendSign, String, f64)>> {
    let mut rows = vec![Vec::new()];
    let start = style.page.margin * unit;
    let mut x = start;
    for (sign, words) in signs {
        let wide = (SIGN + GAP + AFTER) * unit
            + fonts.width(words, style.legend.size * unit, Weight::Regular);
        if x + wide - AFTER * unit > width - start && x > start {
            rows.push(Vec::new());
            x = start;
        }
        if let Some(row) = rows.last_mut() {
            row.push((sign.clone(), words.clone(), x));
        }
        x += wide;
    }
    rows
}

/// The legend, equal in every frame.
pub(crate) fn legend(
    rows: &[Vec<(LegendSign, String, f64)>],
    style: &Style,
    page: &PageFrame,
) -> Group {
    let mut group = Group::named("legend");
    let place = page.legend;
    let unit = page.unit;
    group.shape(Shape::filled(Form::Rect(place, 0.0), style.legend.fill));
    let right = Point::new(place.right(), place.y);
    let edge = line(Point::new(place.x, place.y), right);
    group.shape(Shape::line(edge, Stroke::solid(style.legend.line, unit)));
    let size = style.legend.size * unit;
    let height = (place.h - 8.0 * unit) / rows.len().max(1) as f64;
    for (at, row) in rows.iter().enumerate() {
        let y = place.y + 7.0 * unit + (at as f64 + 0.5) * height;
        for (sign, words, x) in row {
            let place = Rect::new(*x, y - 6.0 * unit, SIGN * unit, 12.0 * unit);
            draw(&mut group, sign, style, place, unit);
            let at = Point::new(x + (SIGN + GAP) * unit, y);
            let font = Font::new(size, Weight::Regular, style.legend.text);
            group.text(Text::centred(Anchor::Start, at, font, words));
        }
    }
    group
}

fn draw(group: &mut Group, sign: &LegendSign, style: &Style, place: Rect, unit: f64) {
    let arrow_of = |kind, confidence, mark| {
        options::of_arrow(style, &kind, &shown(State::Active, confidence, mark))
            .stroke
            .scaled(unit)
    };
    match sign {
        LegendSign::Node => card(group, style, place, true, State::Active, unit),
        LegendSign::Topic => card(group, style, place, false, State::Active, unit),
        LegendSign::Group => {
            for place in [place, front(place, style, unit)] {
                card(group, style, place, false, State::Active, unit);
            }
        }
        LegendSign::Namespace => {
            let stroke = Stroke::solid(style.node.stroke, style.node.width * unit);
            for place in [place, front(place, style, unit)] {
                let form = Form::Rect(place, 4.0 * unit);
                group.shape(Shape::new(form, style.node.fill, stroke.clone()));
            }
        }
        LegendSign::Row => {
            let size = style.legend.size * unit;
            let font = Font::new(size, Weight::SemiBold, style.page.text);
            group.text(Text::centred(Anchor::Middle, place.centre(), font, "→"));
        }
        LegendSign::Change(mark) => {
            let stroke = arrow_of(ArrowKind::Publish, Confidence::Measured, Some(*mark));
            group.shape(Shape::line(across(place), stroke));
            badge(group, style, *mark, place.centre(), unit * 0.9);
        }
        LegendSign::Box(state) => {
            card(group, style, place, false, *state, unit);
            if *state == State::Latched {
                let inset = style.topic.width * unit / 2.0;
                let mut bar = place.grown(-inset);
                bar.w = style.latched.bar * unit;
                group.shape(Shape::filled(Form::Rect(bar, 0.0), style.latched.stroke));
            }
        }
        LegendSign::Service => {
            let form = hexagon(place, style.topic.pad_x * unit * 0.7);
            let stroke = Stroke::solid(style.topic.stroke, style.topic.width * unit);
            group.shape(Shape::new(form, style.topic.fill, stroke));
        }
        LegendSign::Line(confidence) => {
            let stroke = arrow_of(ArrowKind::Subscribe, *confidence, None);
            arrow(group, place, stroke, Tip::Arrow, style.edge.arrow * unit);
        }
        LegendSign::Starved => {
            let stroke = arrow_of(ArrowKind::Subscribe, Confidence::Stated, None);
            arrow(group, place, stroke, Tip::Stop, style.edge.arrow * unit);
        }
        LegendSign::Width => widths(group, style, place, unit),
    }
}

/// A sample element in this state.
fn shown(state: State, confidence: Confidence, mark: Option<Mark>) -> Shown {
    Shown {
        mark,
        ..Shown::plain(0, state, confidence)
    }
}

fn card(group: &mut Group, style: &Style, place: Rect, round: bool, state: State, unit: f64) {
    let body = if round { &style.node } else { &style.topic };
    let confidence = match state {
        State::Declared => Confidence::Declared,
        _ => Confidence::Measured,
    };
    let look = options::of_box(style, body, &shown(state, confidence, None));
    let form = if round && body.is_capsule() {
        Form::Rect(place, place.h / 2.0)
    } else if round {
        Form::Ellipse(place)
    } else {
        Form::Rect(place, body.radius * unit)
    };
    group.shape(Shape::new(form, look.fill, look.stroke.scaled(unit)));
}

/// The second card of a stack.
fn front(place: Rect, style: &Style, unit: f64) -> Rect {
    let depth = style.stack.depth * 0.7 * unit;
    Rect::new(place.x, place.y + depth, place.w - depth, place.h - depth)
}

/// A thin line and a thick one.
fn widths(group: &mut Group, style: &Style, place: Rect, unit: f64) {
    let edge = &style.edge;
    let y = place.centre().y;
    let wide = edge.width + 2.0 * edge.per_decade;
    for (part, width) in [(0.0, edge.width), (0.55, wide)] {
        let from = Point::new(place.x + place.w * part, y);
        let to = Point::new(from.x + place.w * 0.45, y);
        let stroke = Stroke::solid(edge.stroke, width * unit);
        group.shape(Shape::line(line(from, to), stroke));
    }
}

fn across(place: Rect) -> Form {
    let y = place.centre().y;
    line(Point::new(place.x, y), Point::new(place.right(), y))
}

fn arrow(group: &mut Group, place: Rect, stroke: Stroke, kind: Tip, head: f64) {
    let color = stroke.color;
    let shorter = Rect::new(place.x, place.y, place.w - head * 0.7, place.h);
    group.shape(Shape::line(across(shorter), stroke));
    let tip = Point::new(place.right(), place.centre().y);
    let form = kind.form(tip, Point::new(1.0, 0.0), head);
    group.shape(Shape::filled(form, color));
}
