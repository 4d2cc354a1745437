//! Publications and subscriptions: their routes, rates and signs of change.

use super::options::{self, Paint};
use super::texts::{self, LINE, arrow_label, class, entries};
use super::{GraphFit, GraphPen, badge};
use crate::base::geometry::{Point, Rect, Size, after, on_cubic, polyline};
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Step, Stroke, Text, polygon};
use crate::draw::style::Color;
use crate::draw::text::Weight;
use crate::layout::Route;
use crate::view::{Arrow, ArrowKind, Mark, Shown};

/// The number of straight pieces in which a curve is measured: with ten, its length is exact to a hundredth.
const PIECES: u32 = 10;
/// The number of those in which its exit from a frame is searched: fine enough
/// for the head of an arrow to end on the frame.
const EXIT: u32 = 64;
/// The largest distance of a label from its line in pixels, a line of text: one further away needs a line to it.
const NEAR: f64 = 12.0;

/// The positions of the parts of one arrow on the page, equal in every frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ArrowPath {
    pub(crate) id: String,
    /// The names of its ends.
    pub(crate) ends: [String; 2],
    /// The names of its topics as drawn, if it represents several.
    pub(crate) topics: Vec<String>,
    route: Route,
    /// The position of its label.
    label: Option<LabelPlace>,
    /// The middle of its badge.
    pub(crate) badge: Point,
    /// The positions at which its badge does not cover its label, the best first.
    pub(super) spots: Vec<Point>,
    /// Its approximate length in pixels.
    pub(crate) length: f64,
}

/// The space for an arrow's label, and the side of it on which the arrow runs.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LabelPlace {
    area: Rect,
    side: Anchor,
    /// Where the arrow runs: above (−1), below (1) or at a side (0).
    line: f64,
}

impl LabelPlace {
    /// The position of a label in this space beside an arrow through these points.
    fn new(area: Rect, points: &[Point]) -> Self {
        let centre = area.centre();
        let far = |p: &&Point| p.distance(centre);
        let nearest = points.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        let side = match nearest {
            Some(p) if p.x <= area.x => Anchor::Start,
            Some(p) if p.x >= area.right() => Anchor::End,
            _ => Anchor::Middle,
        };
        let line = match nearest {
            Some(p) if p.y >= area.bottom() => 1.0,
            Some(p) if p.y <= area.y => -1.0,
            _ => 0.0,
        };
        Self { area, side, line }
    }

    /// The middle of words of this width, which are next to the arrow regardless of the width of the space.
    fn middle(&self, width: f64) -> Point {
        let (centre, slack) = (self.area.centre(), (self.area.w - width).max(0.0) / 2.0);
        match self.side {
            Anchor::Start => Point::new(centre.x - slack, centre.y),
            Anchor::Middle => centre,
            Anchor::End => Point::new(centre.x + slack, centre.y),
        }
    }
}

impl ArrowPath {
    /// The route on the page. `room` is the size of its label, if it has one.
    pub(crate) fn new(
        id: String,
        ends: [String; 2],
        route: &Route,
        room: Option<Size>,
        fit: GraphFit,
    ) -> Self {
        let on_page = route.mapped(|p| fit.point(p));
        let points = polyline(on_page.start, &on_page.curves, PIECES);
        let length = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        let area = route.label.zip(room).map(|(label, room)| {
            let room = Size::new(room.w * fit.scale, room.h * fit.scale);
            Rect::around(fit.point(label), room)
        });
        let label = area.map(|area| LabelPlace::new(area, &points));
        // A badge without its halo, and parts of the line, its middle first; the ends are for heads.
        let badge = Size::new(12.0, 12.0);
        let covers = |p: &Point| area.is_some_and(|area| area.overlaps(&Rect::around(*p, badge)));
        let mut spots = [0.5, 0.4, 0.6, 0.3, 0.7, 0.22, 0.78]
            .map(|part| at_part(&points, length, part))
            .to_vec();
        spots.retain(|p| !covers(p));
        Self {
            id,
            ends,
            topics: Vec::new(),
            route: on_page,
            label,
            badge: *spots.first().unwrap_or(&at_part(&points, length, 0.5)),
            spots,
            length,
        }
    }

    /// The space for its label.
    pub(crate) fn label_area(&self) -> Option<Rect> {
        self.label.map(|label| label.area)
    }

    /// Whether it runs down, or to the right.
    fn is_forward(&self, is_upright: bool) -> bool {
        let (start, end) = (self.route.start, self.tip().0);
        if is_upright {
            end.y > start.y
        } else {
            end.x > start.x
        }
    }

    /// The part of it outside of the frame in which it begins or ends; `None` if its label is not at that
    /// part.
    pub(super) fn outside(&self, frame: Rect, begins_inside: bool) -> Option<Self> {
        let label = self.label.filter(|label| !label.area.overlaps(&frame))?;
        let mut path = self.clone();
        path.label = Some(label);
        if !begins_inside {
            path.route = path.route.backwards();
        }
        let is_inside = |p: Point| {
            frame.x <= p.x && p.x <= frame.right() && frame.y <= p.y && p.y <= frame.bottom()
        };
        let starts =
            std::iter::once(path.route.start).chain(path.route.curves.iter().map(|curve| curve[2]));
        let curves = starts
            .zip(&path.route.curves)
            .map(|(from, c)| [from, c[0], c[1], c[2]]);
        let exits = curves.enumerate().filter_map(|(at, curve)| {
            let mut steps = (0..EXIT)
                .rev()
                .map(|step| f64::from(step) / f64::from(EXIT));
            let part = steps.find(|t| is_inside(on_cubic(curve, *t)))?;
            Some((at, after(curve, part)))
        });
        let (at, [start, near, far, end]) = exits.last()?;
        path.route.start = start;
        path.route.curves.drain(..at);
        *path.route.curves.first_mut()? = [near, far, end];
        if !begins_inside {
            path.route = path.route.backwards();
        }
        let near = label.area.grown(NEAR);
        let pieces = path.points();
        let mut pieces = pieces
            .windows(2)
            .filter_map(|p| Rect::of_points(p.iter().copied()));
        pieces.any(|piece| piece.overlaps(&near)).then_some(path)
    }

    /// Its end, and the direction in which it arrives there.
    fn tip(&self) -> (Point, Point) {
        let Some([first, second, end]) = self.route.curves.last().copied() else {
            return (self.route.start, direction(&[], self.route.start));
        };
        let mut before = self.route.curves.iter();
        let before = before.nth_back(1).map_or(self.route.start, |c| c[2]);
        (end, direction(&[before, first, second], end))
    }

    /// Points along it, close enough to be joined by straight lines.
    pub(super) fn points(&self) -> Vec<Point> {
        polyline(self.route.start, &self.route.curves, PIECES)
    }
}

impl GraphPen<'_> {
    /// Its glow, which belongs below all lines, its line, and its rate and badge, which lines must not cover.
    pub(crate) fn arrow_parts(
        &self,
        arrow: &Arrow,
        track: &ArrowPath,
        shown: &Shown,
        ends: [Option<&Shown>; 2],
    ) -> [Group; 3] {
        let look = options::of_arrow(self.style, &arrow.kind, shown);
        let [from, to] = &track.ends;
        let kind = arrow.kind.word();
        let class = class(&format!("edge {}", arrow.class()), shown);
        let is_bundle = arrow.kind == ArrowKind::Bundle;
        let mut data = vec![("from", from.clone()), ("to", to.clone())];
        data.extend(entries(&shown.events));
        data.extend(is_bundle.then(|| ("topics", arrow.topics_in(shown).join(" "))));
        let mut group = Group::new(track.id.clone(), class)
            .with(data)
            .titled(format!("{from} → {to}\n{kind}: {}", texts::facts(shown)));
        let mut over = Group {
            id: format!("{}..over", group.id),
            ..group.clone()
        };
        group.flow = match (&arrow.kind, ends[0]) {
            // The messages of a topic run on to all its subscribers.
            (ArrowKind::Subscribe, Some(topic)) if shown.is_sending() => topic.flow(),
            _ => shown.flow(),
        };
        let glow = Group::new(format!("{}..glow", group.id), "glow");
        let mut glow = glow.with(vec![("of", group.id.clone())]);
        let tip = match arrow.kind {
            _ if shown.is_starved => Tip::Stop,
            ArrowKind::Bundle | ArrowKind::Direct(_) if arrow.is_service => Tip::Service,
            _ => Tip::Arrow,
        };
        let heads = if is_bundle {
            shown.ways()
        } else {
            [true, false]
        };
        self.line([&mut glow, &mut group], track, &look, tip, heads);
        if is_bundle {
            self.rows(&mut over, track, shown, &look);
        }
        // A rate that changed is shown even where there is no space beside the line, unless its topic shows it.
        let is_at_end = ends.into_iter().flatten().any(Shown::has_new_rate);
        if let Some((text, is_badge)) = arrow_label(arrow, shown, ends[0])
            && (is_badge && !is_at_end || track.label.is_some())
        {
            self.label(&mut over, &text, is_badge, track, shown, &look);
        }
        if let Some(mark) = shown.badge().filter(|mark| is_badged(*mark, ends)) {
            let size = self.fit.pen * 0.8;
            badge::badge(&mut over, self.style, mark, track.badge, size);
        }
        [glow, group, over]
    }

    /// The bar at the end of a line of ordinary width through which nothing arrives.
    pub(super) fn stop(&self, track: &ArrowPath) -> Form {
        let edge = &self.style.edge;
        let (tip, along) = track.tip();
        Tip::Stop.form(tip, along, (edge.arrow + edge.width) * self.fit.pen)
    }

    /// The line, and its glow, with a head at its end and at its start, according to `heads`.
    fn line(
        &self,
        [glow, group]: [&mut Group; 2],
        track: &ArrowPath,
        look: &Paint,
        kind: Tip,
        heads: [bool; 2],
    ) {
        let Some(first) = track.route.curves.first() else {
            return;
        };
        let scale = self.fit.pen;
        let stroke = look.stroke.scaled(scale);
        let (end, along) = track.tip();
        let against = direction(&[first[2], first[1], first[0]], track.route.start);
        let head = (self.style.edge.arrow + look.stroke.width) * scale;
        // The line ends inside the head, so that its blunt end is not visible beside the tip, and always at
        // the same point, regardless of its width.
        let short = self.style.edge.arrow * 0.7 * scale;
        let back = |from: Point, along: Point, by: f64| {
            Point::new(from.x - along.x * by, from.y - along.y * by)
        };
        let (mut start, mut curves) = (track.route.start, track.route.curves.clone());
        if let Some(end) = curves.last_mut().filter(|_| heads[0]) {
            end[1] = back(end[1], along, short * 0.5);
            end[2] = back(end[2], along, short);
        }
        if let Some(end) = curves.first_mut().filter(|_| heads[1]) {
            start = back(start, against, short);
            end[0] = back(end[0], against, short * 0.5);
        }
        let mut steps = vec![Step::Move(start)];
        steps.extend(curves.into_iter().map(Step::Curve));
        let color = stroke.color;
        let path = Form::Path(steps);
        if look.glow != Color::NONE {
            let width = stroke.width + 1.2 * self.style.badge.glow * scale;
            glow.shape(Shape::line(path.clone(), Stroke::solid(look.glow, width)));
        }
        group.shape(Shape::line(path, stroke));
        let tips = [(end, along), (track.route.start, against)];
        let tips = tips.into_iter().zip(heads);
        for (tip, along) in tips.filter_map(|(tip, is)| is.then_some(tip)) {
            group.shape(Shape::filled(kind.form(tip, along, head), color));
        }
        if look.dot {
            let dot = Size::new(5.0 * scale, 5.0 * scale);
            let dot = Form::Ellipse(Rect::around(track.route.start, dot));
            group.shape(Shape::filled(dot, color));
        }
    }

    /// The rows of its topics, one below the other.
    fn rows(&self, group: &mut Group, track: &ArrowPath, shown: &Shown, look: &Paint) {
        let Some(place) = track.label else { return };
        let style = &self.style.edge;
        let scale = self.fit.scale;
        let (size, halo) = (style.size * scale, style.halo_width * scale);
        let rows = texts::rows(shown, &track.topics);
        let edge = place.middle(halo);
        let middle = rows.len() as f64 / 2.0 - 0.5;
        // If there are fewer rows than in other windows, they stay next to the line.
        let slack = (place.area.h - size * LINE * rows.len() as f64).max(0.0) / 2.0;
        let y = edge.y + slack * place.line;
        let is_upright = place.side != Anchor::Middle;
        let is_forward = track.is_forward(is_upright);
        for (row, at) in rows.iter().zip(0_u32..) {
            let mark = row.mark.or(shown.mark);
            let color = match row.mark {
                Some(mark) => options::change(self.style, mark).color,
                None if mark.is_some() => look.stroke.color,
                None => look.text,
            };
            let at = Point::new(edge.x, y + size * (0.36 + LINE * (f64::from(at) - middle)));
            let font = Font::new(size, Weight::of(mark.is_some()), color);
            let text = Text::new(place.side, at, font, row.words(is_upright, is_forward));
            group.text(text.with_halo(style.halo, halo));
        }
    }

    fn label(
        &self,
        group: &mut Group,
        text: &str,
        is_badge: bool,
        track: &ArrowPath,
        shown: &Shown,
        look: &Paint,
    ) {
        let text = self.fonts.shown(text);
        let style = &self.style.edge;
        let size = style.size * self.fit.scale;
        if is_badge {
            let paint = (look.stroke.color, self.style.badge.sign);
            let width = badge::label_width(self.fonts, &text, size);
            let centre = track.label.map_or(track.badge, |place| place.middle(width));
            badge::label(group, self.fonts, paint, &text, centre, size);
            return;
        }
        let Some(place) = track.label else { return };
        let edge = place.middle(style.halo_width * self.fit.scale);
        let (weight, color) = match shown.mark {
            Some(_) => (Weight::SemiBold, look.stroke.color),
            None => (Weight::Regular, look.text),
        };
        let text = Text::centred(place.side, edge, Font::new(size, weight, color), text);
        group.text(text.with_halo(style.halo, style.halo_width * self.fit.scale));
    }
}

/// Whether a changed arrow has a badge: not if one of its ends or its rate shows the same change.
pub(crate) fn is_badged(mark: Mark, ends: [Option<&Shown>; 2]) -> bool {
    let rate = matches!(mark, Mark::Faster | Mark::Slower);
    let mut marks = ends.into_iter().flatten().filter_map(|end| end.mark);
    !rate && !marks.any(|m| m.class() == mark.class())
}

/// The sign at the end of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tip {
    /// A triangle: messages.
    Arrow,
    /// A diamond: service calls.
    Service,
    /// A bar before the end: nothing is received.
    Stop,
}

impl Tip {
    /// The sign with its end at a point, along a unit direction.
    pub(crate) fn form(self, tip: Point, along: Point, length: f64) -> Form {
        // Back along the line, and to its left.
        let at = |back: f64, left: f64| {
            let (back, left) = (back * length, left * length);
            let x = tip.x - along.x * back - along.y * left;
            Point::new(x, tip.y - along.y * back + along.x * left)
        };
        match self {
            Self::Arrow => polygon(&[tip, at(1.0, 0.38), at(1.0, -0.38)]),
            Self::Service => polygon(&[tip, at(0.6, 0.42), at(1.2, 0.0), at(0.6, -0.42)]),
            Self::Stop => polygon(&[at(0.5, 0.5), at(0.75, 0.5), at(0.75, -0.5), at(0.5, -0.5)]),
        }
    }
}

/// The direction in which a curve reaches `end`: from its last control that differs from it.
fn direction(controls: &[Point], end: Point) -> Point {
    for from in controls.iter().rev() {
        let length = from.distance(end);
        if length > 0.01 {
            return Point::new((end.x - from.x) / length, (end.y - from.y) / length);
        }
    }
    Point::new(1.0, 0.0)
}

/// The point at `part` (0..=1) of the curve.
fn at_part(points: &[Point], length: f64, part: f64) -> Point {
    let mut left = length * part;
    for pair in points.windows(2) {
        let step = pair[0].distance(pair[1]);
        if step >= left && step > 0.0 {
            return pair[0].towards(pair[1], left / step);
        }
        left -= step;
    }
    points.last().copied().unwrap_or_default()
}
