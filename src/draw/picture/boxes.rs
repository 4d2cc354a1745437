//! Nodes, topics, groups and collapsed namespaces, the rows in boxes of nodes, and the boxes around namespaces.

use std::collections::BTreeSet;

use super::options::{self, Paint};
use super::spaces::Space;
use super::texts::{
    BAR, LINE, Label, ShownRates, TICK, called, class, data, fitted, item_id, rate_label,
    second_line, short_name, title,
};
use super::{GraphPen, badge};
use crate::base::geometry::{Point, Rect, Size};
use crate::base::name::namespace;
use crate::draw::scene::{
    Anchor, Font, Form, Group, Piece, Shape, Step, Stroke, Text, line, polygon,
};
use crate::draw::style::{Body, Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::graph::{Id as _, State};
use crate::view::{BoxRow, Item, ItemKind, Mark, Presence, Shown, View};

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
            let bar = self.latch_bar(inner, body);
            group.shape(Shape::filled(bar, style.latched.stroke));
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
        let middle = Point::new(place.centre().x, place.bottom() + size * 0.2);
        (middle, size)
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
        look: &Paint,
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
        let place = match kind {
            ItemKind::Node | ItemKind::Topic => place,
            ItemKind::Group | ItemKind::Namespace => self.front(place),
        };
        self.latch_bar(place, options::body(self.style, kind))
    }

    /// The bar at the left of a latched box.
    fn latch_bar(&self, place: Rect, body: &Body) -> Form {
        let width = self.style.latched.bar * self.fit.scale;
        let inset = body.width * self.fit.pen / 2.0;
        let high = place.h - 2.0 * inset;
        let bar = Rect::new(place.x + inset, place.y + inset, width, high);
        Form::Rect(bar, 0.0)
    }

    fn lines(
        &self,
        group: &mut Group,
        label: &Label,
        [first, second]: [&str; 2],
        place: Rect,
        body: &Body,
        look: &Paint,
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

impl GraphPen<'_> {
    /// Draws the bar of a box of a still below its name: the mission's time from left to right, filled while the node was
    /// there, with its starts, ends and restarts as ticks; none for a box of topics.
    pub(crate) fn presence(
        &self,
        group: &mut Group,
        presence: &Presence,
        card: &ItemBox,
        kind: ItemKind,
    ) {
        if !card.label.has_bar {
            return;
        }
        let (style, scale) = (self.style, self.fit.scale);
        let body = options::body(style, kind);
        let head = card.card.as_ref().map(|rows| rows.head * scale);
        let mut place = card.place;
        place.h = head.unwrap_or(place.h);
        let high = body.size * BAR * scale;
        // A capsule's words end before its round ends.
        let aside = if body.is_capsule() { 0.85 } else { 1.0 } * body.pad_x * scale;
        // Below the name and the smaller line, where `GraphPen::lines` leaves room.
        let middle = place.centre().y + card.label.lines(body) / 2.0 * scale;
        let wide = (place.w - 2.0 * aside).max(1.0);
        let bar = Rect::new(place.x + aside, middle - high / 2.0, wide, high);
        group.shape(Shape::filled(Form::Rect(bar, 0.0), style.timeline.future));
        for (from, to) in &presence.times {
            // At least half a pixel, or a short presence is not seen.
            let wide = ((to - from) * bar.w).max(0.5 * scale);
            let part = Rect::new(bar.x + from * bar.w, bar.y, wide, bar.h);
            group.shape(Shape::filled(Form::Rect(part, 0.0), body.stroke));
        }
        let tick = high * TICK / 2.0;
        for (at, mark) in &presence.marks {
            let x = bar.x + at * bar.w;
            let ends = [Point::new(x, middle - tick), Point::new(x, middle + tick)];
            let stroke = Stroke::solid(options::change(style, *mark).color, 1.6 * self.fit.pen);
            group.shape(Shape::line(line(ends[0], ends[1]), stroke));
        }
    }
}

// Cards: boxes of nodes with a row for each topic without any other known publisher or subscriber.

/// The height of a row, relative to the size of its text: a badge and the frame of a change
/// fit into it.
const STEP: f64 = 1.5;
/// The space before and after the words of a row, and between a name and its rate, relative to the size of
/// the text: a letter's width is half a height, and the gap must be more than one between words.
const PAD: f64 = 1.1;
/// The most names in a row of topics without messages: a row of more would be the widest of its box.
const MOST_SILENT: usize = 3;
/// The most rows of a box of which few are listed, as many as a line between boxes has; of more, the last counts those that
/// are not.
const MOST_ROWS: usize = 3;
/// The size of a badge in a row, relative to that on a box: it fits into the height of the row.
const BADGE: f64 = 0.7;

/// The rows of a box.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Card {
    lines: Vec<Line>,
    /// The space below the name of the node.
    pub(crate) room: Size,
    /// The height of the part with the name of the node.
    pub(crate) head: f64,
}

/// One row: a topic, or several that never carry a message or are hubs.
#[derive(Clone, Debug, PartialEq)]
struct Line {
    /// How its topics are connected; none if they are only counted.
    sign: &'static str,
    /// The indices of the topics in the view's rows, with their names as drawn.
    topics: Vec<(usize, String)>,
}

/// The cards of all boxes; without rows for boxes that have none.
pub(crate) fn cards(view: &View, style: &Style, fonts: &Fonts) -> Vec<Card> {
    let mut cards = vec![Card::default(); view.items.len()];
    for (at, row) in view.rows.iter().enumerate() {
        let card = &mut cards[row.owner.at()];
        let name = (at, name(view, row, fonts, style.topic.size));
        let sign = match row.ways {
            [true, true] => "↔",
            [true, false] => "→",
            _ => "←",
        };
        let same = card.lines.iter_mut().find(|line| {
            let first = &view.rows[line.topics[0].0];
            let is_alike = is_quiet(row)
                && is_quiet(first)
                && row.is_infrastructure == first.is_infrastructure;
            is_alike && line.sign == sign
        });
        match same {
            Some(line) => line.topics.push(name),
            None => card.lines.push(Line {
                sign,
                topics: vec![name],
            }),
        }
    }
    for card in cards.iter_mut().filter(|card| !card.lines.is_empty()) {
        if view.lists_few {
            card.shorten(view);
        }
        let wide = card.lines.iter().map(|line| line.width(view, style, fonts));
        let high = style.topic.size * (STEP * card.lines.len() as f64 + 0.4);
        card.room = Size::new(wide.fold(0.0, f64::max), high);
    }
    cards
}

impl Card {
    /// Counts all but two rows if there are more than [`MOST_ROWS`], besides those that change: the rarest first.
    fn shorten(&mut self, view: &View) {
        if self.lines.len() <= MOST_ROWS {
            return;
        }
        let weighed = |(at, line): (usize, &Line)| {
            let mut rows = line.topics.iter().map(|(at, _)| &view.rows[*at]);
            let rates = rows.clone().flat_map(|row| row.shown.distinct());
            let rate = rates.filter_map(|look| look.hz).fold(0.0, f64::max);
            (rows.any(is_changing), rate, at)
        };
        let mut order: Vec<_> = self.lines.iter().enumerate().map(weighed).collect();
        order.sort_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
        let changing = order.iter().filter(|(changes, ..)| *changes).count();
        let listed = order.iter().take(changing.max(MOST_ROWS - 1));
        let listed: BTreeSet<usize> = listed.map(|(.., at)| *at).collect();
        let mut at = 0..;
        let (stay, rest): (Vec<Line>, Vec<Line>) = std::mem::take(&mut self.lines)
            .into_iter()
            .partition(|_| at.next().is_some_and(|at| listed.contains(&at)));
        self.lines = stay;
        let topics: Vec<_> = rest.into_iter().flat_map(|line| line.topics).collect();
        if !topics.is_empty() {
            self.lines.push(Line { sign: "", topics });
        }
    }
}

/// Whether there is an event about a topic or its connection.
fn is_changing(row: &BoxRow) -> bool {
    row.shown.distinct().iter().any(|look| look.mark.is_some())
}

/// Whether a topic has no events and either never carries a message or is a hub.
fn is_quiet(row: &BoxRow) -> bool {
    let is_silent = |look: &Shown| look.state != State::Latched && look.hz.unwrap_or(0.0) <= 0.0;
    let mut looks = row.shown.distinct().iter();
    !is_changing(row) && looks.all(|look| is_silent(look) || row.is_infrastructure)
}

/// The name of a topic as drawn: relative to the namespace of the node.
fn name(view: &View, row: &BoxRow, fonts: &Fonts, size: f64) -> String {
    let inside = namespace(&view.items[row.owner].name).trim_end_matches('/');
    let name = fitted(short_name(&row.item.label, inside), fonts, size);
    if row.item.is_service {
        called(&name)
    } else {
        name
    }
}

impl Line {
    /// The width of its words with the widest rate.
    fn width(&self, view: &View, style: &Style, fonts: &Fonts) -> f64 {
        let size = style.topic.size;
        let words = fonts.width(&self.words(|_| true), size, Weight::SemiBold);
        let looks = self.topics.iter();
        let looks = looks.flat_map(|(at, _)| view.rows[*at].shown.distinct());
        let rates = looks.filter(|_| self.topics.len() == 1).filter_map(rate);
        let rates = rates.map(|text| fonts.width(&text, style.topic.small, Weight::SemiBold));
        words + rates.fold(0.0, f64::max) + 3.0 * PAD * size
    }

    /// The sign and the names of its existing topics.
    fn words(&self, is_there: impl Fn(usize) -> bool) -> String {
        let names = self.topics.iter().filter(|(at, _)| is_there(*at));
        let names: Vec<&str> = names.map(|(_, name)| name.as_str()).collect();
        if self.sign.is_empty() {
            return format!("+{}", names.len());
        }
        let (first, rest) = names.split_at(names.len().min(MOST_SILENT));
        let rest = match rest.len() {
            0 => String::new(),
            more => format!(", +{more}"),
        };
        format!("{} {}{rest}", self.sign, first.join(", "))
    }
}

/// The rate of a topic as its row shows it.
fn rate(shown: &Shown) -> Option<String> {
    let latched = || (shown.state == State::Latched).then(|| "latched".to_owned());
    second_line(shown, ShownRates::Rates).or_else(latched)
}

impl GraphPen<'_> {
    /// The outline of a card, and its head, which is returned.
    pub(crate) fn card(&self, group: &mut Group, card: &Card, place: Rect, look: &Paint) -> Rect {
        let (scale, stroke) = (self.fit.scale, look.stroke.scaled(self.fit.pen));
        let radius = self.card_radius();
        let (form, fill) = (Form::Rect(place, radius), self.style.page.background);
        group.shape(Shape::new(form, fill, stroke.clone()));
        let head = Rect::new(place.x, place.y, place.w, card.head * scale);
        group.shape(Shape::new(round_top(head, radius), look.fill, stroke));
        head
    }

    /// The radius of a card's corners.
    fn card_radius(&self) -> f64 {
        self.style.node.radius.max(self.style.topic.radius) * self.fit.scale * 0.7
    }

    /// The rows of a card with its outline at `place` that exist in window `k`; `owner` is the id of its group.
    pub(crate) fn card_rows(
        &self,
        card: &Card,
        owner: &str,
        place: Rect,
        view: &View,
        k: usize,
    ) -> Vec<Group> {
        let size = self.style.topic.size * self.fit.scale;
        let top = place.y + card.head * self.fit.scale + size * 0.2;
        let lines = card.lines.iter().zip(0_u32..);
        let row = |(line, at): (&Line, u32)| {
            let y = top + size * STEP * f64::from(at);
            let place = Rect::new(place.x, y, place.w, size * STEP);
            self.row(line, owner, place, view, k)
        };
        lines.filter_map(row).collect()
    }

    fn row(&self, line: &Line, owner: &str, place: Rect, view: &View, k: usize) -> Option<Group> {
        let seen = line.topics.iter().filter_map(|(at, _)| {
            let row = &view.rows[*at];
            Some((row, view.seen_at(&row.shown, k)?))
        });
        let seen: Vec<(&BoxRow, Shown)> = seen.collect();
        let (row, shown) = seen.first()?;
        let id = format!("{owner}..{}", item_id(&row.item));
        let mut group = Group::new(id, class(row.item.class(), shown))
            .with(data(&row.item, shown))
            .titled(title(&row.item, shown));
        if seen.len() > 1 {
            let names: Vec<&str> = seen.iter().map(|(row, _)| &*row.item.name).collect();
            group.data = vec![("names", names.join(" "))];
            group.title = names.join("\n");
        }
        let (style, size) = (self.style, self.style.topic.size * self.fit.scale);
        let look = options::of_box(style, &style.topic, shown);
        let middle = place.centre().y;
        // The colour of the whole card already shows it.
        let owner = view.items_shown.get(row.owner);
        let owner = owner.and_then(|looks| looks.at(k)?.mark);
        let is_new = |mark: &Mark| owner.map(Mark::class) != Some(mark.class());
        if let Some(mark) = shown.mark.filter(is_new) {
            let inset = style.added.width / 2.0 * self.fit.pen;
            let inside = Rect::new(place.x + inset, place.y, place.w - 2.0 * inset, place.h);
            let fill = options::change(style, mark).fill;
            group.shape(Shape::filled(Form::Rect(inside, 0.0), fill));
            if let Some(mark) = shown.badge() {
                let at = Point::new(place.x, middle);
                badge::badge(&mut group, style, mark, at, self.fit.pen * BADGE);
            }
        }
        let (weight, quiet) = look.small;
        let is_there = |at: usize| view.rows[at].shown.at(k).is_some();
        let left = Point::new(place.x + PAD * size, middle);
        let (font, words) = (Font::new(size, weight, look.text), line.words(is_there));
        group.text(Text::centred(Anchor::Start, left, font, words));
        let rate = rate(shown).filter(|_| seen.len() == 1 && !shown.is_ghost());
        let small = style.topic.small * self.fit.scale;
        let right = Point::new(place.right() - PAD * size, middle);
        let (font, rate) = (Font::new(small, weight, quiet), rate.unwrap_or_default());
        group.text(Text::centred(Anchor::End, right, font, rate));
        Some(group)
    }
}

/// A rectangle with round corners at its top.
fn round_top(place: Rect, radius: f64) -> Form {
    let (left, right, top, low) = (place.x, place.right(), place.y, place.bottom());
    // The fraction of a radius at which the control points of a quarter circle are placed.
    let near = radius * 0.45;
    let at = Point::new;
    Form::Path(vec![
        Step::Move(at(left, low)),
        Step::Line(at(left, top + radius)),
        Step::Curve([
            at(left, top + near),
            at(left + near, top),
            at(left + radius, top),
        ]),
        Step::Line(at(right - radius, top)),
        Step::Curve([
            at(right - near, top),
            at(right, top + near),
            at(right, top + radius),
        ]),
        Step::Line(at(right, low)),
        Step::Close,
    ])
}
