//! Nodes, topics, groups and collapsed namespaces, and the boxes around namespaces.

use super::badge;
use super::card::Card;
use super::ids::{class, data, title};
use super::options::{self, BoxLook};
use super::page::GraphPen;
use super::spaces::Space;
use super::texts::{LINE, Label, ShownRates, rate_label, second_line};
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{Anchor, Font, Form, Group, Piece, Shape, Stroke, Text, polygon};
use crate::draw::style::{Body, Color};
use crate::draw::text::Weight;
use crate::graph::State;
use crate::view::{Item, ItemKind, Shown};

/// The dashes of an empty namespace: dots, as dashes stand for what is inferred.
const EMPTY: [f64; 2] = [1.0, 4.0];

/// The parts of an item that are equal in every window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ItemBox {
    pub(crate) id: String,
    pub(crate) label: Label,
    pub(crate) shown_rates: ShownRates,
    /// Its rows, if it has any.
    pub(crate) card: Option<Card>,
    /// Its box on the page.
    pub(crate) place: Rect,
    /// The middle of its badge.
    pub(crate) badge: Point,
}

impl GraphPen<'_> {
    /// The box around a namespace; faint and dotted, with these words, while it has no content.
    pub(crate) fn space(&self, space: &Space, place: Rect, id: &str, empty: Option<&str>) -> Group {
        let style = &self.style.cluster;
        let scale = self.fit.scale;
        let place = self.fit.rect(place);
        let group = Group::new(format!("s{id}"), "namespace");
        let mut group = group.with(vec![("name", space.name.clone())]);
        group.title.clone_from(&space.name);
        let (dash, fill, text) = match empty {
            Some(words) => (&EMPTY[..], Color::NONE, format!("{} {words}", space.title)),
            None => (&style.dash[..], style.fill, space.title.clone()),
        };
        let stroke = Stroke::dashed(style.stroke, style.width, dash).scaled(self.fit.pen);
        let form = Form::Rect(place, style.radius * scale);
        group.shape(Shape::new(form, fill, stroke));
        // Beside the corner, and below it as far as a capital is high.
        let (x, y) = (place.x + 8.0 * scale, 4.0 + style.size * 0.9);
        let at = Point::new(x, place.y + y * scale);
        let weight = Weight::of(empty.is_none());
        let font = Font::new(style.size * scale, weight, style.text);
        group.text(Text::new(Anchor::Start, at, font, text));
        group
    }

    /// Takes the title out of a namespace's box, to be painted over the lines that cross it, and moves it.
    pub(crate) fn title_of(&self, space: &mut Group, by: Point) -> Group {
        let title = Group::new(format!("{}..title", space.id), "namespace-title");
        let mut title = title.with(space.data.clone());
        if let Some(Piece::Text(text)) = space.pieces.pop() {
            let plate = match self.style.cluster.fill {
                Color::NONE => self.style.page.background,
                fill => fill,
            };
            let at = Point::new(text.at.x + by.x, text.at.y + by.y);
            let halo = self.style.edge.halo_width * self.fit.scale * 1.5;
            title.text(Text { at, ..text }.with_halo(plate, halo));
        }
        title
    }

    /// One item in one window.
    pub(crate) fn item(&self, item: &Item, card: &ItemBox, shown: &Shown) -> Group {
        let style = self.style;
        let body = options::body(self.style, item.kind);
        let look = options::of_box(style, body, shown);
        let place = card.place;
        let mut group = Group::new(card.id.clone(), class(item.class(), shown))
            .with(data(item, shown))
            .titled(title(item, shown));
        let inner = match &card.card {
            Some(rows) => self.card(&mut group, rows, place, &look),
            None => self.outline(&mut group, item, body, place, &look),
        };
        if shown.state == State::Latched && item.kind != ItemKind::Node && !shown.is_ghost() {
            self.latch(&mut group, inner, body);
        }
        let second = second_line(shown, card.shown_rates);
        let second =
            second.unwrap_or_else(|| card.label.silence(shown, card.shown_rates).to_owned());
        let words = [&*card.label.first(shown), &*second];
        self.lines(&mut group, &card.label, words, inner, body, &look);
        if let Some(text) = rate_label(shown, card.shown_rates) {
            let (below, size) = self.below(place);
            let paint = (look.stroke.color, style.badge.sign);
            badge::label(&mut group, self.fonts, paint, &text, below, size);
        }
        if let Some(mark) = shown.badge() {
            badge::badge(&mut group, style, mark, card.badge, self.fit.pen);
        }
        group
    }

    /// The middle of the rate label of a box and its font size: on the lower edge, without covering the name,
    /// and within the gap between boxes.
    fn below(&self, place: Rect) -> (Point, f64) {
        let size = self.style.edge.size * self.fit.scale * 0.95;
        (
            Point::new(place.centre().x, place.bottom() + size * 0.2),
            size,
        )
    }

    /// The text of the rate label of a box, without its outline.
    pub(crate) fn rate_label_text(&self, place: Rect, text: &str) -> Text {
        let (below, size) = self.below(place);
        let font = Font::new(size, Weight::SemiBold, self.style.changed.color);
        let (halo, width) = (self.style.edge.halo, self.style.edge.halo_width);
        Text::centred(Anchor::Middle, below, font, text).with_halo(halo, width)
    }

    /// The outline, and the part inside it for the label.
    fn outline(
        &self,
        group: &mut Group,
        item: &Item,
        body: &Body,
        place: Rect,
        look: &BoxLook,
    ) -> Rect {
        let stroke = look.stroke.scaled(self.fit.pen);
        let form = self.form(item, body, place);
        group.shape(Shape::new(form, look.fill, stroke.clone()));
        if matches!(item.kind, ItemKind::Node | ItemKind::Topic) {
            return place;
        }
        // Several in one: a second card behind the first.
        let front = self.front(place);
        let form = Form::Rect(front, body.radius * self.fit.scale);
        group.shape(Shape::new(form, look.fill, stroke));
        front
    }

    /// The form of a box without rows.
    fn form(&self, item: &Item, body: &Body, place: Rect) -> Form {
        let (scale, radius) = (self.fit.scale, body.radius * self.fit.scale);
        match item.kind {
            _ if item.is_service => hexagon(place, radius.max(body.pad_x * scale)),
            ItemKind::Node if !item.others.is_empty() => Form::Rect(place, radius),
            ItemKind::Node if body.is_capsule() => Form::Rect(place, place.w.min(place.h) / 2.0),
            ItemKind::Node => Form::Ellipse(place),
            _ => Form::Rect(place, radius),
        }
    }

    /// The glow around an item that changed in one window. It belongs below the lines, so that it covers no arrowhead.
    pub(crate) fn glow(&self, item: &Item, card: &ItemBox, shown: &Shown) -> Option<Group> {
        let body = options::body(self.style, item.kind);
        let look = options::of_box(self.style, body, shown);
        if look.glow == Color::NONE {
            return None;
        }
        let stroke = look.stroke.scaled(self.fit.pen);
        let width = stroke.width + 2.0 * self.style.badge.glow * self.fit.pen;
        let group = Group::new(format!("{}..glow", card.id), "glow");
        let mut group = group.with(vec![("of", card.id.clone())]);
        let form = match card.card {
            Some(_) => Form::Rect(card.place, self.card_radius()),
            None => self.form(item, body, card.place),
        };
        group.shape(Shape::new(form, look.glow, Stroke::solid(look.glow, width)));
        Some(group)
    }

    fn front(&self, place: Rect) -> Rect {
        let depth = self.style.stack.depth * self.fit.scale;
        Rect::new(place.x, place.y + depth, place.w - depth, place.h - depth)
    }

    /// The bar of a box of this kind that is latched.
    pub(crate) fn latch_of(&self, kind: ItemKind, place: Rect) -> Form {
        match kind {
            ItemKind::Node => self.latch_bar(place, &self.style.node),
            ItemKind::Topic => self.latch_bar(place, &self.style.topic),
            ItemKind::Group => self.latch_bar(self.front(place), &self.style.topic),
            ItemKind::Namespace => self.latch_bar(self.front(place), &self.style.node),
        }
    }

    fn latch(&self, group: &mut Group, place: Rect, body: &Body) {
        group.shape(Shape::filled(
            self.latch_bar(place, body),
            self.style.latched.stroke,
        ));
    }

    /// The bar at the left of a latched box.
    fn latch_bar(&self, place: Rect, body: &Body) -> Form {
        let width = self.style.latched.bar * self.fit.scale;
        let inset = body.width * self.fit.pen / 2.0;
        let bar = Rect::new(
            place.x + inset,
            place.y + inset,
            width,
            place.h - 2.0 * inset,
        );
        Form::Rect(bar, 0.0)
    }

    fn lines(
        &self,
        group: &mut Group,
        label: &Label,
        [first, second]: [&str; 2],
        place: Rect,
        body: &Body,
        look: &BoxLook,
    ) {
        let scale = self.fit.scale;
        let middle = place.centre();
        // A line that is missing in this window keeps its space, so that the name does not move.
        let mut top = middle.y - label.height(body) * scale / 2.0;
        let line = |y: f64, size: f64, weight, color, text: &str| {
            let font = Font::new(size * scale, weight, color);
            Text::new(Anchor::Middle, Point::new(middle.x, y), font, text)
        };
        let y = top + body.size * (LINE / 2.0 + 0.35) * scale;
        group.text(line(y, body.size, body.weight(), look.text, first));
        for other in &label.others {
            top += body.size * LINE * scale;
            let y = top + body.size * (LINE / 2.0 + 0.35) * scale;
            group.text(line(y, body.size, Weight::Regular, look.text, other));
        }
        let y = top + (body.size * LINE + body.small * (LINE / 2.0 + 0.28)) * scale;
        let (weight, color) = look.small;
        group.text(line(y, body.small, weight, color, second));
    }
}

/// The outline of a service: a box whose left and right ends are points of this length.
pub(super) fn hexagon(place: Rect, point: f64) -> Form {
    let (left, right, middle) = (place.x, place.right(), place.centre().y);
    let at = Point::new;
    polygon(&[
        at(left, middle),
        at(left + point, place.y),
        at(right - point, place.y),
        at(right, middle),
        at(right - point, place.bottom()),
        at(left + point, place.bottom()),
    ])
}

/// The positions at the corners of a box at which its badge may be placed without covering its name, the best
/// first: at its top right.
pub(super) fn corners(place: Rect, scale: f64) -> [Point; 4] {
    let middle = place.centre();
    let (x, y) = (place.w / 2.0 - 4.0 * scale, place.h / 2.0 - scale);
    [(x, -y), (-x, -y), (x, y), (-x, y)].map(|(x, y)| Point::new(middle.x + x, middle.y + y))
}
