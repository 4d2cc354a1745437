//! The bar on top and the line below it: the bag, the window, its time, the number of changes, and the changes in
//! words.

use super::page::PageFrame;
use super::{PageOptions, chips};
use crate::base::geometry::{Point, Rect};
use crate::base::words;
use crate::draw::scene::{Anchor, Form, Group, Shape, Stroke, Text, line};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::view::{Frame, View};

/// The room in a chip beside its words, and between two chips.
const CHIP_PAD: f64 = 20.0;
const CHIP_GAP: f64 = 8.0;

/// The usual width of a character, as a share of the size of the text.
const USUAL_WIDTH: f64 = 0.5;

/// The bar's fixed places, decided once for all frames.
pub(crate) struct Title<'a> {
    style: &'a Style,
    fonts: &'a Fonts,
    page: PageFrame,
    name: String,
    /// The x at which the last chip ends.
    right: f64,
    /// The x at which the words on the left must end.
    end: f64,
    /// The width of the widest phase.
    phase: f64,
    /// The text for a window in which nothing changed.
    none: &'static str,
}

impl<'a> Title<'a> {
    pub(crate) fn new(
        style: &'a Style,
        fonts: &'a Fonts,
        page: &PageFrame,
        view: &View,
        options: &PageOptions,
    ) -> Self {
        let unit = page.unit;
        let clock = fonts.width("00:00:00", style.title.clock_size * unit, Weight::SemiBold);
        let date = fonts.width(
            "0000-00-00 UTC",
            style.title.quiet_size * unit,
            Weight::Regular,
        );
        let clock = clock.max(date);
        let right = page.size.w - (style.page.margin + 14.0) * unit - clock;
        let none = if view.compares {
            "no difference"
        } else {
            "no reconfiguration"
        };
        let wide = |text: &str| {
            fonts.width(text, style.chip.size * unit, Weight::SemiBold)
                + (CHIP_PAD + CHIP_GAP) * unit
        };
        let widths = view.frames.iter().map(|frame| {
            let chips = chips::chips(&frame.counts);
            let told = chips.iter().filter(|(text, _)| !text.is_empty());
            told.map(|(text, _)| wide(text)).sum::<f64>()
        });
        let end = right - widths.fold(wide(none), f64::max) - 10.0 * unit;
        let widest = options
            .phases
            .iter()
            .map(|p| fonts.width(&fonts.shown(p), style.caption.size * unit, Weight::SemiBold));
        let phase = widest.fold(0.0, f64::max).min(page.size.w * 0.4);
        Self {
            style,
            fonts,
            page: page.clone(),
            name: fonts.shown(options.title()).into_owned(),
            right,
            end,
            phase,
            none,
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
        let size = style.size * self.page.unit;
        let name = self
            .fonts
            .fit(&self.name, size, Weight::SemiBold, self.end - self.left())
            .into_owned();
        group.text(self.words(name, 0.43, size, Weight::SemiBold, style.text));
        group
    }

    /// The line under the name: the window and its part of the mission.
    pub(crate) fn window(&self, view: &View, frame: &Frame) -> Group {
        let mut group = Group::named("window");
        let start = view
            .frames
            .first()
            .map_or(frame.span.start, |f| f.span.start);
        let end = view.frames.last().map_or(frame.span.end, |f| f.span.end);
        let at = |stamp: crate::base::time::Stamp| words::offset(whole(stamp.since(start)));
        let mut parts = vec![format!(
            "{} – {} of {}",
            at(frame.span.start),
            at(frame.span.end),
            words::offset(whole(end.since(start)))
        )];
        if view.frames.len() > 1 {
            let window = format!("window {} of {}", frame.index + 1, view.frames.len());
            parts.insert(0, window);
        }
        if frame.messages == 0 {
            parts.insert(0, "no message".to_owned());
        }
        if let Some(length) = view.window_nanos() {
            parts.push(format!("{} per window", words::period(whole(length))));
        }
        if frame.partial {
            parts.push("partial".to_owned());
        }
        let size = self.style.title.quiet_size * self.page.unit;
        // On a narrow page the least important part goes first.
        while parts.len() > 1
            && self.fonts.width(&parts.join(" · "), size, Weight::Regular) > self.end - self.left()
        {
            parts.pop();
        }
        group.text(self.words(
            parts.join(" · "),
            0.8,
            size,
            Weight::Regular,
            self.style.title.quiet,
        ));
        group
    }

    /// The line where two missions are compared, in the place of the window's time: the side that is seen, and the
    /// number of differences, but for the first of several windows, which is A alone.
    pub(crate) fn compared(&self, frame: &Frame, windows: usize) -> Vec<Group> {
        let is_alone = windows > 1 && frame.index == 0;
        let mut group = Group::named("window");
        let side = SIDES[usize::from(!is_alone)];
        group.text(self.words(
            side.to_owned(),
            0.8,
            self.style.title.quiet_size * self.page.unit,
            Weight::Regular,
            self.style.title.quiet,
        ));
        let chips = (!is_alone).then(|| self.chips(frame));
        std::iter::once(group).chain(chips).collect()
    }

    fn left(&self) -> f64 {
        self.style.page.margin * self.page.unit
    }

    fn words(&self, text: String, part: f64, size: f64, weight: Weight, color: Color) -> Text {
        let bar = self.page.title;
        Text {
            at: Point::new(self.left(), bar.y + bar.h * part),
            anchor: Anchor::Start,
            size,
            weight,
            color,
            halo: None,
            text,
        }
    }

    /// The UTC time at which the window begins.
    pub(crate) fn clock(&self, frame: &Frame) -> Group {
        let mut group = Group::named("clock");
        let style = &self.style.title;
        let (bar, size) = (self.page.title, style.clock_size * self.page.unit);
        let small = style.quiet_size * self.page.unit;
        group.title = frame.span.start.rfc3339();
        group.text(Text {
            at: Point::new(bar.right() - self.left(), bar.y + bar.h * 0.43),
            anchor: Anchor::End,
            size,
            weight: Weight::SemiBold,
            color: style.text,
            halo: None,
            text: words::clock(frame.span.start.0),
        });
        group.text(Text {
            at: Point::new(bar.right() - self.left(), bar.y + bar.h * 0.8),
            anchor: Anchor::End,
            size: small,
            weight: Weight::Regular,
            color: style.quiet,
            halo: None,
            text: words::date(frame.span.start.0),
        });
        group
    }

    /// The chips with the numbers of what came, went and changed, each at its own place.
    pub(crate) fn chips(&self, frame: &Frame) -> Group {
        let mut group = Group::named("chips");
        let chip = &self.style.chip;
        let texts = chips::chips(&frame.counts);
        group.data = vec![("entries", entries(frame))];
        let paint = [
            (chip.added, chip.added_text),
            (chip.removed, chip.removed_text),
            (chip.changed, chip.changed_text),
        ];
        let mut right = self.right;
        for ((text, _), paint) in texts.iter().zip(paint).rev() {
            if !text.is_empty() {
                right -= self.chip(&mut group, text, right, paint) + self.page.unit * CHIP_GAP;
            }
        }
        if frame.counts.total() == 0 {
            let paint = (chip.none, chip.none_text);
            self.chip(&mut group, self.none, self.right, paint);
        }
        group
    }

    /// Draws a chip that ends at `right`, and returns its width.
    fn chip(&self, group: &mut Group, text: &str, right: f64, paint: (Color, Color)) -> f64 {
        let unit = self.page.unit;
        let size = self.style.chip.size * unit;
        let width = self.fonts.width(text, size, Weight::SemiBold) + CHIP_PAD * unit;
        let bar = self.page.title;
        let place = Rect::new(
            right - width,
            bar.y + bar.h / 2.0 - 11.0 * unit,
            width,
            22.0 * unit,
        );
        group.shape(Shape {
            form: Form::Rect(place, place.h / 2.0),
            fill: paint.0,
            // Of the bar's own colour, as on paper, it would not be seen.
            stroke: Stroke::solid(
                paint.1,
                if paint.0 == self.style.title.fill {
                    unit
                } else {
                    0.0
                },
            ),
        });
        group.text(Text {
            at: Point::new(place.centre().x, place.centre().y + size * 0.36),
            anchor: Anchor::Middle,
            size,
            weight: Weight::SemiBold,
            color: paint.1,
            halo: None,
            text: text.to_owned(),
        });
        width
    }

    /// The line below the bar: the mission's phase, and the changes in words.
    pub(crate) fn caption(&self, frame: &Frame, phase: &str) -> Group {
        let mut group = Group::named("caption");
        "caption headline".clone_into(&mut group.class);
        group.data = vec![("entries", entries(frame))];
        let (style, place) = (&self.style.caption, self.page.caption);
        let size = style.size * self.page.unit;
        if style.fill != self.style.page.background {
            group.shape(Shape::filled(Form::Rect(place, 0.0), style.fill));
        }
        let y = place.centre().y + size * 0.36;
        let text = |x: f64, weight, color, text: String| Text {
            at: Point::new(x, y),
            anchor: Anchor::Start,
            size,
            weight,
            color,
            halo: None,
            text,
        };
        let mut x = self.left();
        if self.phase > 0.0 {
            let phase = self.fonts.shown(phase);
            let phase = self
                .fonts
                .fit(&phase, size, Weight::SemiBold, self.phase)
                .into_owned();
            group.text(text(x, Weight::SemiBold, style.text, phase));
            x += self.phase + 18.0 * self.page.unit;
        }
        let changes = self.sentence(frame, size, place.right() - self.left() - x);
        let color = if self.phase > 0.0 {
            style.quiet
        } else {
            style.text
        };
        group.title = frame.words(usize::MAX);
        group.text(text(x, Weight::Regular, color, changes));
        group
    }

    /// As many of the changes as fit, the most important first.
    fn sentence(&self, frame: &Frame, size: f64, most: f64) -> String {
        let all = frame.caption.len();
        let texts = (1..=all)
            .rev()
            .map(|keep| self.fonts.shown(&frame.words(keep)).into_owned());
        // Where an SVG is shown in another font, its words may be wider.
        let wide = |text: &str| {
            let elsewhere = text.chars().count() as f64 * size * USUAL_WIDTH;
            self.fonts.width(text, size, Weight::Regular).max(elsewhere)
        };
        let mut fitting = texts.filter(|text| wide(text) <= most);
        fitting.next().unwrap_or_else(|| {
            let first = self.fonts.shown(&frame.words(1.min(all))).into_owned();
            self.fonts
                .fit(&first, size, Weight::Regular, most)
                .into_owned()
        })
    }
}

/// The places in the log of a window's headlines, separated by blanks.
fn entries(frame: &Frame) -> String {
    let ids = frame.headlines.iter().map(|h| h.entry.to_string());
    ids.collect::<Vec<_>>().join(" ")
}

/// The titles of the windows of a comparison.
pub(crate) const SIDES: [&str; 2] = ["A alone", "B against A"];

/// The time without fractions of a second where it is a second or more, as on a clock.
pub(crate) fn whole(nanos: i64) -> i64 {
    const MILLI: i64 = 1_000_000;
    let second = 1000 * MILLI;
    // A window that ends 1 ns after the last message ends, to the eye, at it.
    let rounded = nanos.saturating_add(MILLI / 2) / MILLI * MILLI;
    if rounded.abs() > 20 * second {
        (rounded.saturating_add(second / 2)) / second * second
    } else {
        rounded
    }
}
