//! The union of a view that is drawn in part: the other items are words in their namespaces, without lines.

use std::collections::BTreeMap;

use super::Picture;
use super::union::{Union, UnionElement};
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Text};
use crate::draw::style::Color;
use crate::draw::text::Weight;
use crate::graph::{ById, Id as _};
use crate::view::DrawnPart;
use crate::view::{ArrowId, ItemId, ItemKind, ShownRuns, View};

impl Picture<'_> {
    /// The union of the view of which this picture's view is a part.
    pub(crate) fn union_with_words(&self, whole: &View, part: &DrawnPart) -> Union {
        let mut union = self.union();
        let arrows: ById<ArrowId, ArrowId> = places(&part.arrows, true).collect();
        union.order = union.order.iter().map(|at| arrows[*at]).collect();
        union.order.extend(places(&part.arrows, false));
        union.arrows = spread(union.arrows, &part.arrows);
        union.items = spread(union.items, &part.items);
        let indices: BTreeMap<(ItemKind, &str), usize> = (whole.items.iter().enumerate())
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
                if let Some(at) = indices.get(&(item.kind, &*item.name)) {
                    let looks = whole
                        .items_shown
                        .get(ItemId::of(*at))
                        .map_or(&[][..], ShownRuns::distinct);
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
fn places(drawn: &ById<ArrowId, bool>, is_drawn: bool) -> impl Iterator<Item = ArrowId> {
    let all = drawn.with_ids();
    all.filter(move |(_, drawn)| **drawn == is_drawn)
        .map(|(at, _)| at)
}

/// The drawn elements among all; the others are empty.
fn spread(elements: Vec<UnionElement>, drawn: &[bool]) -> Vec<UnionElement> {
    let mut elements = elements.into_iter();
    let element = |drawn: &bool| drawn.then(|| elements.next()).flatten();
    drawn
        .iter()
        .map(element)
        .map(Option::unwrap_or_default)
        .collect()
}
