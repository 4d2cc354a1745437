//! The bar in a box of a still: the mission's time from left to right, filled while the node was there, with its
//! starts, ends and restarts as ticks.

use super::boxes::ItemBox;
use super::options;
use super::page::GraphPen;
use super::texts::{BAR, TICK};
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{Form, Group, Shape, Stroke, line};
use crate::view::{ItemKind, Presence};

impl GraphPen<'_> {
    /// Draws the bar of a box below its name; none for a box of topics.
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
        let bar = Rect::new(
            place.x + aside,
            middle - high / 2.0,
            (place.w - 2.0 * aside).max(1.0),
            high,
        );
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
