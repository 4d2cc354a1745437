//! The bar in a box of a still: the mission's time from left to right, filled while the node was there, with its
//! starts, ends and restarts as ticks.

use super::boxes::{Boxes, ItemBox};
use super::options;
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{Form, Group, Shape, Stroke, line};
use crate::view::{ItemKind, Presence};

/// The height of the bar, as a share of that of the name: half a stroke of a letter thicker than a line, so that it is
/// not taken for one.
const BAR: f64 = 0.3;
/// The height of a tick over that of the bar: less is no tick, and more touches the name.
const TICK: f64 = 1.7;

/// The height that a bar adds to a box whose name has this size.
pub(crate) fn room(size: f64) -> f64 {
    size * BAR * TICK
}

impl Boxes<'_> {
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
        let place = Rect::new(
            card.place.x,
            card.place.y,
            card.place.w,
            head.unwrap_or(card.place.h),
        );
        let high = body.size * BAR * scale;
        let aside = if body.is_capsule() {
            0.85 * body.pad_x
        } else {
            body.pad_x
        } * scale;
        // Below the name and the smaller line, where `Boxes::lines` leaves room.
        let middle = place.centre().y + card.label.lines(body) / 2.0 * scale;
        let bar = Rect::new(
            place.x + aside,
            middle - high / 2.0,
            (place.w - 2.0 * aside).max(1.0),
            high,
        );
        group.shape(Shape::filled(Form::Rect(bar, 0.0), style.timeline.future));
        for (from, to) in &presence.times {
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
