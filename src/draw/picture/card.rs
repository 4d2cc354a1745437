//! Cards: boxes of nodes with a row for each topic without any other known publisher or subscriber.

use std::collections::BTreeSet;

use super::badge;
use super::ids::{class, data, item_id, title};
use super::options::{self, BoxLook};
use super::page::GraphPen;
use super::texts::{ShownRates, second_line, short_name};
use super::topics::{called, fitted};
use crate::base::geometry::{Point, Rect, Size};
use crate::base::name::namespace;
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Step, Text};
use crate::draw::style::Style;
use crate::draw::text::{Fonts, Weight};
use crate::graph::{Id as _, State};
use crate::view::{BoxRow, Mark, Shown, View};

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
        card.room = Size::new(
            wide.fold(0.0, f64::max),
            style.topic.size * (STEP * card.lines.len() as f64 + 0.4),
        );
    }
    cards
}

impl Card {
    /// Counts all but two rows if there are more than [`MOST_ROWS`], besides those that change: the rarest first.
    fn shorten(&mut self, view: &View) {
        if self.lines.len() <= MOST_ROWS {
            return;
        }
        let weight = |line: &Line| {
            let rows = line.topics.iter().map(|(at, _)| &view.rows[*at]);
            let rates = rows.clone().flat_map(|row| row.shown.distinct());
            let rate = rates.filter_map(|look| look.hz).fold(0.0, f64::max);
            (rows.clone().any(is_changing), rate)
        };
        let mut order: Vec<(bool, f64, usize)> = Vec::new();
        for (at, line) in self.lines.iter().enumerate() {
            let (changes, rate) = weight(line);
            order.push((changes, rate, at));
        }
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
    pub(crate) fn card(&self, group: &mut Group, card: &Card, place: Rect, look: &BoxLook) -> Rect {
        let (scale, stroke) = (self.fit.scale, look.stroke.scaled(self.fit.pen));
        let radius = self.card_radius();
        let (form, fill) = (Form::Rect(place, radius), self.style.page.background);
        group.shape(Shape::new(form, fill, stroke.clone()));
        let head = Rect::new(place.x, place.y, place.w, card.head * scale);
        group.shape(Shape::new(round_top(head, radius), look.fill, stroke));
        head
    }

    /// The radius of a card's corners.
    pub(crate) fn card_radius(&self) -> f64 {
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
