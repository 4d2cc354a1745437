//! The canvas that figures are drawn on: lengths in millimetres, four kinds of type, one palette; it becomes a scene.

use crate::base::geometry::{Point, Rect, Size};
use crate::draw::scene::{
    Anchor, Font, Form, Group, Piece, Scene, Shape, Step, Stroke, Text, polygon,
};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::mission::EventId;

/// The most characters of a text that are measured: no line of a page fits more.
const LONGEST: usize = 1000;

/// Pixels per millimetre of a page on paper, 96 to the inch.
pub(crate) const PX_PER_MM: f64 = 96.0 / 25.4;
/// Millimetres per point.
pub(crate) const MM_PER_PT: f64 = 25.4 / 72.0;
/// The distance of the lines of a hatching in millimetres: the eye sees an area, not lines.
const HATCH: f64 = 1.1;
/// The thinnest line in millimetres: 0.5 pt, as printers require.
pub(crate) const HAIRLINE: f64 = 0.18;

/// The colours of a figure, which is on white paper. Every mark also has its own shape, so that nothing is
/// lost in greyscale print; the three colours of change are those of the pictures, distinguished by
/// colour-blind readers.
pub(crate) mod ink {
    use crate::draw::style::Color;

    pub(crate) const PAPER: Color = Color::of([0xff, 0xff, 0xff]);
    pub(crate) const TEXT: Color = Color::of([0x1f, 0x29, 0x37]);
    pub(crate) const QUIET: Color = Color::of([0x6b, 0x72, 0x80]);
    pub(crate) const BAR: Color = Color::of([0x8e, 0x9c, 0xb5]);
    pub(crate) const FOLDED: Color = Color::of([0xc3, 0xcb, 0xd8]);
    pub(crate) const LINE: Color = Color::of([0x4a, 0x5b, 0x78]);
    pub(crate) const BAND: [Color; 2] =
        [Color::of([0xd5, 0xdb, 0xe5]), Color::of([0xe6, 0xea, 0xf0])];
    pub(crate) const TINT: Color = Color::of([0xee, 0xf1, 0xf5]);
    pub(crate) const RULE: Color = Color::of([0xa3, 0xab, 0xb8]);
    pub(crate) const ADDED: Color = Color::of([0x00, 0x79, 0x5c]);
    pub(crate) const REMOVED: Color = Color::of([0xc4, 0x49, 0x00]);
    pub(crate) const CHANGED: Color = Color::of([0x6a, 0x35, 0xc9]);
}

/// The kind of a text, which determines its size and weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    /// A node, a topic.
    Name,
    /// A namespace, the number of a phase.
    Head,
    /// Everything else.
    Small,
    /// Everything else, in bold.
    Strong,
}

impl Type {
    /// The same size in bold.
    pub(crate) fn bold(self) -> Self {
        match self {
            Self::Name | Self::Head => Self::Head,
            Self::Small | Self::Strong => Self::Strong,
        }
    }
}

/// The sizes of type in points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sizes {
    pub(crate) name: f64,
    pub(crate) small: f64,
}

impl Sizes {
    /// The sizes on a screen, where the scale of the canvas determines those in pixels.
    pub(crate) const SCREEN: Self = Self::of_names(7.0);

    /// The sizes with names of `names` points (at least 7) and all other text one point smaller.
    pub(crate) const fn of_names(names: f64) -> Self {
        Self {
            name: names,
            small: names - 1.0,
        }
    }

    /// The distance from one row to the next in millimetres: 2.75 at 7 pt, 3.15 at 8 pt.
    pub(crate) fn pitch(&self) -> f64 {
        2.75 + 0.4 * (self.name - 7.0)
    }

    /// The distance from one line of notes to the next in millimetres.
    pub(crate) fn line(&self) -> f64 {
        self.small * MM_PER_PT * 1.18
    }
}

/// A drawing in progress. All lengths are in millimetres, y down.
pub(crate) struct PaperCanvas<'a> {
    pub(crate) fonts: &'a Fonts,
    pub(crate) sizes: Sizes,
    /// Pixels of the scene per millimetre.
    scale: f64,
    groups: Vec<Group>,
}

impl<'a> PaperCanvas<'a> {
    pub(crate) fn new(fonts: &'a Fonts, sizes: Sizes, scale: f64) -> Self {
        Self {
            fonts,
            sizes,
            scale,
            groups: vec![Group::named("ground")],
        }
    }

    /// Begins a group, which contains everything drawn next.
    pub(crate) fn begin(&mut self, id: &str) {
        self.groups.push(Group::named(id));
    }

    /// Begins the group of a mark: its class, and the events of the log that it shows. The log's sentence about
    /// them is its title.
    pub(crate) fn begin_mark(&mut self, class: &str, events: &[EventId], title: String) {
        let id = format!("{class}-{}", self.groups.len());
        self.open(&id, class, event_data(events));
        if let Some(group) = self.group() {
            group.title = title;
        }
    }

    /// Begins the group of a step: its number, counted from 1, and the events of the log in it.
    pub(crate) fn begin_step(&mut self, number: usize, events: &[EventId]) {
        let id = format!("step-{number}");
        let step = vec![("step", number.to_string())];
        self.open(&id, &id, [step, event_data(events)].concat());
    }

    fn open(&mut self, id: &str, class: &str, data: Vec<(&'static str, String)>) {
        self.groups.push(Group::new(id, class).with(data));
    }

    fn group(&mut self) -> Option<&mut Group> {
        self.groups.last_mut()
    }

    fn size(&self, of: Type) -> (f64, Weight) {
        match of {
            Type::Name => (self.sizes.name, Weight::Regular),
            Type::Head => (self.sizes.name, Weight::SemiBold),
            Type::Small => (self.sizes.small, Weight::Regular),
            Type::Strong => (self.sizes.small, Weight::SemiBold),
        }
    }

    /// The height of capital letters in millimetres.
    pub(crate) fn cap(&self, of: Type) -> f64 {
        self.size(of).0 * MM_PER_PT * 0.727
    }

    pub(crate) fn width(&self, text: &str, of: Type) -> f64 {
        let (size, weight) = self.size(of);
        let shown = self.fonts.shown(text);
        self.fonts.width(&shown, size * MM_PER_PT, weight)
    }

    /// `text` cut at its end with … until it is at most `most` wide.
    pub(crate) fn cut(&self, text: &str, of: Type, most: f64) -> String {
        let end = text.char_indices().nth(LONGEST).map(|(end, _)| end);
        let shown = self.fonts.shown(&text[..end.unwrap_or(text.len())]);
        if end.is_none() && self.width(&shown, of) <= most {
            return shown.into_owned();
        }
        let mut kept: Vec<char> = shown.chars().collect();
        while kept.pop().is_some() {
            let cut: String = kept.iter().chain(&['\u{2026}']).collect();
            if self.width(&cut, of) <= most {
                return cut;
            }
        }
        String::new()
    }

    /// Draws a line of text that begins at `x`; its capitals are centred on `y`.
    pub(crate) fn text(&mut self, x: f64, y: f64, of: Type, color: Color, text: &str) {
        self.put(Anchor::Start, Point::new(x, y), of, color, None, text);
    }

    /// As [`PaperCanvas::text`], ending at `x`.
    pub(crate) fn text_end(&mut self, x: f64, y: f64, of: Type, color: Color, text: &str) {
        self.put(Anchor::End, Point::new(x, y), of, color, None, text);
    }

    /// As [`PaperCanvas::text`], its middle at `x`.
    pub(crate) fn text_middle(&mut self, x: f64, y: f64, of: Type, color: Color, text: &str) {
        self.put(Anchor::Middle, Point::new(x, y), of, color, None, text);
    }

    /// As [`PaperCanvas::text_middle`], on a white halo, over lines.
    pub(crate) fn label(&mut self, x: f64, y: f64, of: Type, color: Color, text: &str) {
        let halo = Some((ink::PAPER, 1.2 * self.scale));
        self.put(Anchor::Middle, Point::new(x, y), of, color, halo, text);
    }

    fn put(
        &mut self,
        anchor: Anchor,
        at: Point,
        of: Type,
        color: Color,
        halo: Option<(Color, f64)>,
        text: &str,
    ) {
        let (size, weight) = self.size(of);
        let baseline = at.y + self.cap(of) / 2.0;
        let at = Point::new(at.x * self.scale, baseline * self.scale);
        let font = Font::new(size * MM_PER_PT * self.scale, weight, color);
        let text = Text::new(anchor, at, font, self.fonts.shown(text));
        let text = Text { halo, ..text };
        if let Some(group) = self.group() {
            group.text(text);
        }
    }

    /// Draws a filled rectangle.
    pub(crate) fn fill(&mut self, rect: Rect, color: Color) {
        let form = Form::Rect(rect.scaled(self.scale), 0.0);
        self.shape(Shape::filled(form, color));
    }

    /// Draws a rectangle with round corners, a line around and a filling.
    pub(crate) fn frame(&mut self, rect: Rect, radius: f64, fill: Color, stroke: &Stroke) {
        let form = Form::Rect(rect.scaled(self.scale), radius * self.scale);
        let stroke = stroke.scaled(self.scale);
        self.shape(Shape::new(form, fill, stroke));
    }

    /// Draws a disc with a line around.
    pub(crate) fn disc(&mut self, at: Point, radius: f64, fill: Color, stroke: &Stroke) {
        let rect = Rect::around(at, Size::new(2.0 * radius, 2.0 * radius));
        let form = Form::Ellipse(rect.scaled(self.scale));
        let stroke = stroke.scaled(self.scale);
        self.shape(Shape::new(form, fill, stroke));
    }

    /// Draws a straight line.
    pub(crate) fn line(&mut self, from: Point, to: Point, stroke: &Stroke) {
        self.path(&[Step::Move(from), Step::Line(to)], Color::NONE, stroke);
    }

    /// Draws a closed shape without a line around.
    pub(crate) fn polygon(&mut self, points: &[Point], color: Color) {
        let points = points
            .iter()
            .map(|p| Point::new(p.x * self.scale, p.y * self.scale));
        let form = polygon(&points.collect::<Vec<_>>());
        self.shape(Shape::filled(form, color));
    }

    /// Draws a path.
    pub(crate) fn path(&mut self, steps: &[Step], fill: Color, stroke: &Stroke) {
        let at = |p: Point| Point::new(p.x * self.scale, p.y * self.scale);
        let form = Form::Path(steps.iter().map(|step| step.mapped(at)).collect());
        let stroke = stroke.scaled(self.scale);
        self.shape(Shape::new(form, fill, stroke));
    }

    /// Hatches a rectangle; one that is narrower than the distance of the lines is filled.
    pub(crate) fn hatch(&mut self, rect: Rect) {
        if rect.w < HATCH {
            return self.fill(rect, ink::RULE);
        }
        let mut steps = Vec::new();
        let mut at = HATCH / 2.0;
        while at < rect.w + rect.h {
            let right = (at - rect.w).max(0.0);
            let left = (at - rect.h).max(0.0);
            steps.push(Step::Move(Point::new(rect.x + at - right, rect.y + right)));
            steps.push(Step::Line(Point::new(rect.x + left, rect.y + at - left)));
            at += HATCH;
        }
        self.path(&steps, Color::NONE, &Stroke::solid(ink::RULE, HAIRLINE));
    }

    /// Draws a filled head of an arrow that ends at `tip`, coming from `from`.
    pub(crate) fn head(&mut self, from: Point, tip: Point, length: f64, color: Color) {
        let (dx, dy) = (tip.x - from.x, tip.y - from.y);
        let far = tip.distance(from).max(1e-9);
        let (dx, dy) = (dx / far * length, dy / far * length);
        let base = Point::new(tip.x - dx, tip.y - dy);
        let side = |by: f64| Point::new(base.x - dy * by, base.y + dx * by);
        self.polygon(&[tip, side(0.36), side(-0.36)], color);
    }

    fn shape(&mut self, shape: Shape) {
        if let Some(group) = self.group() {
            group.shape(shape);
        }
    }

    /// The groups, for a page of the caller.
    pub(crate) fn into_groups(self) -> Vec<Group> {
        let drawn = self.groups.into_iter();
        drawn.filter(|g| !g.pieces.is_empty()).collect()
    }

    /// The groups in the colours of a style, for a page on a screen.
    pub(crate) fn into_styled(self, style: &Style) -> Vec<Group> {
        let band = style.timeline.future.towards(style.legend.fill, 0.5);
        let bar = style.timeline.past.towards(style.timeline.text, 0.4);
        let table = [
            (ink::PAPER, style.page.background),
            (ink::TEXT, style.page.text),
            (ink::QUIET, style.timeline.text),
            // Darker than a bar of messages that are past, to be distinguished from pale ones.
            (ink::BAR, bar),
            (ink::FOLDED, style.timeline.future),
            (ink::LINE, style.timeline.axis),
            (ink::RULE, style.timeline.axis),
            (ink::TINT, style.cluster.fill),
            (ink::BAND[0], style.timeline.future),
            (ink::BAND[1], band),
            (ink::ADDED, style.added.color),
            (ink::REMOVED, style.removed.color),
            (ink::CHANGED, style.changed.color),
        ];
        let styled = |of: &mut Color| {
            let found = table.iter().find(|(ink, _)| ink == of);
            *of = found.map_or(*of, |(_, color)| *color);
        };
        let mut groups = self.into_groups();
        for piece in groups.iter_mut().flat_map(|group| &mut group.pieces) {
            match piece {
                Piece::Shape(Shape { fill, stroke, .. }) => {
                    styled(fill);
                    styled(&mut stroke.color);
                }
                Piece::Text(text) => styled(&mut text.color),
            }
        }
        groups
    }

    /// The page as a scene, `size` in millimetres; its width is exact.
    pub(crate) fn into_scene(self, size: Size, title: String) -> Scene {
        let by = self.scale;
        Scene {
            size: Size::new(size.w * by, size.h * by),
            width_mm: Some(size.w),
            background: ink::PAPER,
            title,
            groups: self.into_groups(),
        }
    }
}

/// The attribute of a mark that names the events of the log that it shows: `data-entry` for one, `data-entries` for
/// several.
pub(crate) fn event_data(events: &[EventId]) -> Vec<(&'static str, String)> {
    match events {
        [] => Vec::new(),
        [one] => vec![("entry", one.to_string())],
        all => {
            let all: Vec<String> = all.iter().map(ToString::to_string).collect();
            vec![("entries", all.join(" "))]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortened_text_always_fits() {
        let fonts = Fonts::bundled();
        let canvas = PaperCanvas::new(&fonts, Sizes::of_names(7.0), PX_PER_MM);
        // Measuring every prefix would take hours.
        let names = "/robot1/planner, ".repeat(50_000);
        let cut = canvas.cut(&names, Type::Small, 30.0);
        assert!(cut.ends_with('\u{2026}') && canvas.width(&cut, Type::Small) <= 30.0);
        assert!(cut.starts_with("/robot1/planner, "));
        assert_eq!(canvas.cut("/robot1", Type::Small, 30.0), "/robot1");
    }
}
