//! The union of all windows, drawn once in the layout's own pixels, for pages on which classes determine the
//! look of each window.

use std::collections::{BTreeMap, BTreeSet};

use super::arrows::{ArrowPath, is_badged};
use super::boxes::ItemBox;
use super::texts::{self, ShownRates};
use super::{GraphFit, GraphPen, Picture, badge, encoded, places};
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Text};
use crate::draw::style::{Color, Style};
use crate::draw::text::Weight;
use crate::evidence::Confidence;
use crate::graph::{ById, Id as _, State};
use crate::view::{Arrow, ArrowId, DrawnPart, ItemId, ItemKind, Mark, Shown, ShownRuns, View};

/// The whole graph, every element once, drawn as active; a painter omits the colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Union {
    /// The total size.
    pub size: Size,
    /// The boxes around namespaces, outer ones first.
    pub spaces: Vec<Group>,
    /// The arrows in painting order.
    pub order: Vec<ArrowId>,
    /// A part per arrow of the view. Its last text, if there is one, is its rate.
    pub arrows: Vec<UnionElement>,
    /// A part per item of the view.
    pub items: Vec<UnionElement>,
}

/// One element of the union.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnionElement {
    /// Its shapes and texts.
    pub group: Group,
    /// Whether its last text differs between windows: a rate or a lifecycle state.
    pub is_live: bool,
    /// Whether that text is shown only in windows in which its rate changed.
    pub shows_changes: bool,
    /// The rectangle of an item; empty for an arrow.
    pub rect: Rect,
    /// Its name if the drawing's font lacks some characters, for viewers with more fonts.
    pub name: Option<String>,
    /// A shape of some windows only: a box's bar for a latched last message, an arrow's end where nothing arrives.
    pub bar: Option<Form>,
    /// The middle of its badge.
    pub badge: Point,
    /// The marks for which it has a badge in some window.
    pub marks: BTreeSet<Mark>,
}

/// The rate of an element in a window as drawn, after the topics that an arrow between nodes carries; empty
/// for none.
pub fn rate_label(shown: &Shown, arrow: Option<&Arrow>) -> String {
    // What changes in a window is written once, not as long as the rate is the same.
    let rate = match shown.mark {
        Some(_) => texts::plain_rate(shown),
        None => texts::rate_in(shown),
    };
    let rate = rate.unwrap_or_default();
    match arrow.and_then(|arrow| arrow.carries(shown)) {
        Some(topic) => format!("{topic} {rate}").trim_end().to_owned(),
        _ => rate,
    }
}

/// The badge of a mark around (0, 0).
pub fn sign(style: &Style, mark: Mark) -> Group {
    let mut group = Group::default();
    badge::badge(&mut group, style, mark, Point::default(), 1.0);
    group
}

impl Picture<'_> {
    /// The style of the picture.
    pub fn style(&self) -> &Style {
        self.measured.style
    }

    /// Its title, such as the bag's name.
    pub fn title_text(&self) -> &str {
        self.measured.options.title()
    }

    /// The union of all windows of the picture.
    pub fn union(&self) -> Union {
        let (measured, layout) = (&self.measured, &self.layout);
        let fit = GraphFit {
            scale: 1.0,
            pen: 1.0,
            origin: Point::default(),
        };
        let pen = GraphPen { fit, ..self.pen() };
        let spaces = measured.graph.spaces.iter().zip(&layout.clusters);
        let (cards, tracks, _) = places(measured, layout, fit);
        Union {
            size: layout.size,
            spaces: spaces
                .map(|(space, place)| pen.space(space, *place, &encoded(&space.name), None))
                .collect(),
            order: self.order.clone(),
            arrows: self.union_arrows(tracks, &pen),
            items: self.union_items(cards, &pen),
        }
    }

    fn union_items(&self, cards: Vec<ItemBox>, pen: &GraphPen<'_>) -> Vec<UnionElement> {
        let view = self.measured.view;
        let mut marks = vec![BTreeSet::new(); view.items.len()];
        let mut latched = BTreeSet::new();
        for shown in view.items_shown.iter().flat_map(ShownRuns::distinct) {
            if shown.state == State::Latched {
                latched.insert(shown.id as usize);
            }
            if let (Some(mark), Some(marks)) = (shown.mark, marks.get_mut(shown.id as usize)) {
                marks.insert(mark);
            }
        }
        let items = view.items.iter().zip(cards).zip(marks).enumerate();
        items
            .map(|(at, ((item, card), marks))| {
                let label = &card.label;
                let is_latched = item.kind != ItemKind::Node && latched.contains(&at);
                let is_live = label.second;
                let mut shown = plain(is_live.then_some(1.0));
                // The line is filled in regardless of its content.
                shown.lifecycle = is_live.then(|| "-".into());
                let mut group = pen.item(item, &card, &shown);
                let is_rate = |m: &Mark| matches!(m, Mark::Faster | Mark::Slower);
                let shows_changes =
                    card.shown_rates == ShownRates::Changes && marks.iter().any(is_rate);
                if shows_changes {
                    group.text(pen.rate_label_text(card.place, "-"));
                }
                UnionElement {
                    group,
                    is_live: is_live || shows_changes,
                    shows_changes,
                    rect: card.place,
                    name: label.unshown.clone(),
                    bar: is_latched.then(|| pen.latch_of(item.kind, card.place)),
                    badge: card.badge,
                    marks,
                }
            })
            .collect()
    }

    fn union_arrows(&self, tracks: Vec<ArrowPath>, pen: &GraphPen<'_>) -> Vec<UnionElement> {
        let (view, plan) = (self.measured.view, &self.measured.graph.plan);
        let mut marks = vec![BTreeSet::new(); view.arrows.len()];
        for ((arrow, looks), marks) in view.arrows.iter().zip(&view.arrows_shown).zip(&mut marks) {
            for (window, shown) in looks.runs() {
                let Some(mark) = shown.and_then(|shown| shown.mark) else {
                    continue;
                };
                let item = |id: ItemId| view.items_shown.get(id)?.at(window as usize);
                if is_badged(mark, [arrow.from, arrow.to].map(item)) {
                    marks.insert(mark);
                }
            }
        }
        let arrows_shown = view.arrows.iter().zip(&view.arrows_shown);
        let parts = arrows_shown.zip(tracks).zip(&plan.links).zip(marks);
        parts
            .map(|((((arrow, looks), track), link), marks)| {
                let shown = plain(link.label.map(|_| 1.0));
                let is_starved = looks.distinct().iter().any(|look| look.is_starved);
                let [glow, mut group, over] = pen.arrow_parts(arrow, &track, &shown, [None; 2]);
                group.pieces.splice(..0, glow.pieces);
                group.pieces.extend(over.pieces);
                UnionElement {
                    group,
                    is_live: link.label.is_some(),
                    bar: is_starved.then(|| pen.stop(&track)),
                    badge: track.badge,
                    marks,
                    ..UnionElement::default()
                }
            })
            .collect()
    }
}

/// An element without a change, with or without a rate.
fn plain(hz: Option<f64>) -> Shown {
    Shown {
        hz,
        ..Shown::plain(0, State::Active, Confidence::Measured)
    }
}

// The union of a view that is drawn in part: the other items are words in their namespaces, without lines.

impl Picture<'_> {
    /// The union of the view of which this picture's view is a part.
    pub(crate) fn union_with_words(&self, whole: &View, part: &DrawnPart) -> Union {
        let mut union = self.union();
        let arrows: ById<ArrowId, ArrowId> = indices(&part.arrows, true).collect();
        union.order = union.order.iter().map(|at| arrows[*at]).collect();
        union.order.extend(indices(&part.arrows, false));
        union.arrows = spread(union.arrows, &part.arrows);
        union.items = spread(union.items, &part.items);
        let items: BTreeMap<(ItemKind, &str), usize> = (whole.items.iter().enumerate())
            .map(|(at, item)| ((item.kind, &*item.name), at))
            .collect();
        for (footer, also) in self.measured.graph.footers.iter().zip(&part.view.also) {
            let place = match footer.cluster {
                Some(at) => self.layout.clusters.get(at),
                None => self.layout.boxes.get(part.view.items.len()),
            };
            let place = place.copied().unwrap_or_default();
            let mut words = self.pen().footer_words(footer, place).into_iter();
            let (first, mut around) = words.next().unwrap_or_default();
            let first = self.word(first, around);
            for ((word, rect), item) in words.zip(&also.items) {
                around = around.union(&rect);
                if let Some(at) = items.get(&(item.kind, &*item.name)) {
                    let looks = whole.items_shown.get(ItemId::of(*at));
                    let looks = looks.map_or(&[][..], ShownRuns::distinct);
                    union.items[*at] = UnionElement {
                        group: self.word(word, rect),
                        rect,
                        badge: Point::new(rect.right(), rect.y),
                        marks: looks.iter().filter_map(|look| look.mark).collect(),
                        ..UnionElement::default()
                    };
                }
            }
            let mut frame = Group::new("", "also");
            frame.shape(Shape::filled(Form::Rect(around, 0.0), Color::NONE));
            frame.pieces.extend(first.pieces);
            union.spaces.push(frame);
        }
        union
    }

    fn word(&self, text: String, rect: Rect) -> Group {
        let style = self.measured.style;
        let mut group = Group::default();
        let at = Point::new(rect.x, rect.bottom() - style.edge.size * 0.3);
        let font = Font::new(style.edge.size, Weight::Regular, style.page.quiet);
        group.text(Text::new(Anchor::Start, at, font, text));
        group
    }
}

/// The indices of the elements that are drawn, or of the others.
fn indices(drawn: &ById<ArrowId, bool>, is_drawn: bool) -> impl Iterator<Item = ArrowId> {
    let all = drawn.with_ids();
    all.filter(move |(_, drawn)| **drawn == is_drawn)
        .map(|(at, _)| at)
}

/// The drawn elements among all; the others are empty.
fn spread(elements: Vec<UnionElement>, drawn: &[bool]) -> Vec<UnionElement> {
    let mut elements = elements.into_iter();
    let element = |drawn: &bool| drawn.then(|| elements.next()).flatten();
    let elements = drawn.iter().map(element);
    elements.map(Option::unwrap_or_default).collect()
}
