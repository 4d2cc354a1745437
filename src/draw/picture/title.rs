//! The bar on top: the changes of the window in words, with its time.

use super::PageOptions;
use super::page::PageFrame;
use crate::base::geometry::Point;
use crate::base::words;
use crate::draw::scene::{Anchor, Form, Group, Shape, Stroke, Text, line};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::view::{Frame, View};

/// The usual width of a character, as a share of the size of the text.
const USUAL_WIDTH: f64 = 0.5;
/// The space between the words on the left and those on the right.
const GAP: f64 = 24.0;
/// The fraction of the bar that the name of the bag and the date may take.
const MOST_RIGHT: f64 = 0.45;
/// The lines of text, as fractions of the bar's height.
const LINES: (f64, f64) = (0.46, 0.82);

/// The bar on top of every frame.
pub(crate) struct Title<'a> {
    style: &'a Style,
    fonts: &'a Fonts,
    page: PageFrame,
    view: &'a View,
    name: String,
}

impl<'a> Title<'a> {
    pub(crate) fn new(
        style: &'a Style,
        fonts: &'a Fonts,
        page: &PageFrame,
        view: &'a View,
        options: &PageOptions,
    ) -> Self {
        Self {
            style,
            fonts,
            page: page.clone(),
            view,
            name: fonts.shown(options.title()).into_owned(),
        }
    }

    /// The bar without the parts that change from frame to frame.
    pub(crate) fn ground(&self) -> Group {
        let mut group = Group::named("title");
        let (style, bar) = (&self.style.title, self.page.title);
        group.shape(Shape::filled(Form::Rect(bar, 0.0), style.fill));
        if style.line != Color::NONE {
            let y = bar.bottom();
            let edge = line(Point::new(bar.x, y), Point::new(bar.right(), y));
            group.shape(Shape::line(edge, Stroke::solid(style.line, self.page.unit)));
        }
        group
    }

    /// The headline with the line below it, and the window's time, bag and date on the right.
    pub(crate) fn words(&self, frame: &Frame, phase: &str) -> Vec<Group> {
        let (clock, room) = self.clock(frame);
        let mut headline = Group::named("headline");
        headline.data = vec![("entries", events(frame))];
        let mut note = Group::named("note");
        let (style, unit) = (&self.style.title, self.page.unit);
        let (size, small) = (style.size * unit, style.quiet_size * unit);
        let mut below = vec![phase];
        let empty = frame.empty.map_or_else(String::new, |time| {
            format!("{} without a message", words::duration(time.nanos()))
        });
        let fits = |text: &str, size: f64| {
            self.width(&self.fonts.shown(text), size, Weight::SemiBold) <= room.0
        };
        // All words at a slightly smaller size are better than some of them.
        let whole = |text: &str| {
            let mut sizes = SMALLER.map(|part| size * part).into_iter();
            sizes.find(|size| fits(text, *size)).unwrap_or(size)
        };
        if frame.caption.is_empty() {
            let main = match frame.empty {
                Some(_) => &empty,
                None => &frame.note,
            };
            below.extend(frame.empty.map(|_| &*frame.note));
            let size = whole(main);
            let text = self.cut(main, size, Weight::Regular, room.0);
            note.text(self.text(text, LINES.0, (size, Weight::Regular), style.quiet));
        } else {
            headline.title = frame.fitting(|_| true);
            let size = whole(&headline.title);
            let text = frame.fitting(|text| fits(text, size));
            let text = self.cut(&text, size, Weight::SemiBold, room.0);
            headline.text(self.text(text, LINES.0, (size, Weight::SemiBold), self.color(frame)));
            below.extend([&*frame.note, &empty]);
        }
        if frame.messages == 0 && frame.empty.is_none() && !self.view.compares {
            below.push("no messages");
        }
        below.retain(|part| !part.is_empty());
        let text = self.cut(&below.join(" · "), small, Weight::Regular, room.1);
        if !text.is_empty() {
            note.text(self.text(text, LINES.1, (small, Weight::Regular), style.quiet));
        }
        vec![headline, note, clock]
    }

    /// The colour of the most important changes in the headline: ends before beginnings, and these before
    /// other changes.
    fn color(&self, frame: &Frame) -> Color {
        let style = &self.style.title;
        let is_away = frame.lasting.iter().any(|l| l.ended.is_none());
        let is_still = frame.caption.iter().all(|p| p.names.is_empty());
        let has = |sign| frame.caption.iter().any(|p| p.sign == sign);
        match (has('−'), has('+')) {
            (true, true) => style.text,
            (true, false) => style.removed,
            (false, true) => style.added,
            (false, false) if is_away => style.removed,
            (false, false) if is_still => style.text,
            (false, false) => style.changed,
        }
    }

    /// The window's time with the length of the mission, the bag and the date, and the widths that they leave on the two
    /// lines.
    fn clock(&self, frame: &Frame) -> (Group, (f64, f64)) {
        let mut group = Group::named("clock");
        let (style, unit, view) = (&self.style.title, self.page.unit, self.view);
        let span = |k: Option<&Frame>| k.map_or(frame.span, |frame| frame.span);
        let (start, end) = (
            span(view.frames.first()).start,
            span(view.frames.last()).end,
        );
        let at = |stamp: crate::base::time::Stamp| words::moment_rounded(stamp.since(start));
        let mut parts = vec![self.name.clone()];
        let time = if view.compares {
            let is_alone = view.frames.len() > 1 && frame.index == 0;
            SIDES[usize::from(!is_alone)].to_owned()
        } else {
            let shown = frame.shown();
            group.title = shown.start.rfc3339();
            if view.frames.len() > 1 {
                parts.insert(0, format!("of {}", at(end)));
            }
            parts.push(words::date_and_clock(shown.start.0));
            format!("{} – {}", at(shown.start), at(shown.end))
        };
        parts.retain(|part| !part.is_empty());
        let (size, small) = (style.clock_size * unit, style.quiet_size * unit);
        let most = self.page.title.w * MOST_RIGHT;
        let wide = |parts: &[String]| self.width(&parts.join(" · "), small, Weight::Regular);
        // On a narrow page the date is dropped first.
        while parts.len() > 1 && wide(&parts) > most {
            parts.pop();
        }
        let below = self.cut(&parts.join(" · "), small, Weight::Regular, most);
        let all = self.page.title.w - 2.0 * self.left() - GAP * unit;
        let room = (
            (all - self.width(&time, size, Weight::SemiBold)).max(1.0),
            (all - self.width(&below, small, Weight::Regular)).max(1.0),
        );
        let right = |text: Text| Text {
            at: Point::new(self.page.title.right() - self.left(), text.at.y),
            anchor: Anchor::End,
            ..text
        };
        let time = self.text(time, LINES.0, (size, Weight::SemiBold), style.text);
        let below = self.text(below, LINES.1, (small, Weight::Regular), style.quiet);
        group.text(right(time));
        group.text(right(below));
        (group, room)
    }

    fn left(&self) -> f64 {
        self.style.page.margin * self.page.unit
    }

    /// The width of a text, with a margin, as an SVG shown in another font may be wider.
    fn width(&self, text: &str, size: f64, weight: Weight) -> f64 {
        let elsewhere = text.chars().count() as f64 * size * USUAL_WIDTH;
        self.fonts.width(text, size, weight).max(elsewhere)
    }

    fn cut(&self, text: &str, size: f64, weight: Weight, most: f64) -> String {
        let text = self.fonts.shown(text);
        self.fonts.fit(&text, size, weight, most).into_owned()
    }

    fn text(&self, text: String, part: f64, font: (f64, Weight), color: Color) -> Text {
        let bar = self.page.title;
        Text {
            at: Point::new(self.left(), bar.y + bar.h * part),
            anchor: Anchor::Start,
            size: font.0,
            weight: font.1,
            color,
            halo: None,
            text,
        }
    }
}

/// The ids of the events that a window reports, separated by blanks.
fn events(frame: &Frame) -> String {
    let ids = frame.events().map(|event| event.to_string());
    ids.collect::<Vec<_>>().join(" ")
}

/// The sizes of a headline, as parts of the largest.
const SMALLER: [f64; 4] = [1.0, 0.9, 0.8, 0.7];

/// The titles of the windows of a comparison.
pub(crate) const SIDES: [&str; 2] = ["A alone", "B against A"];
