//! The bar on top: the changes of the window in words, with its time.

use super::{PageFrame, PageOptions};
use crate::base::geometry::Point;
use crate::base::words;
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Stroke, Text, line};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::view::{BETWEEN_PHRASES, Frame, View, Words, joined};

/// The usual width of a character, as a share of the size of the text.
const USUAL_WIDTH: f64 = 0.5;
/// The space between the words on the left and those on the right.
const GAP: f64 = 24.0;
/// The fraction of the bar that the name of the bag and the date may take: the headline has more than half.
const MOST_RIGHT: f64 = 0.45;
/// The lines of text, as fractions of the bar's height.
const LINES: (f64, f64) = (0.46, 0.82);
/// Those of a headline of two lines.
const TWO_LINES: (f64, f64) = (0.41, 0.8);
/// What separates the parts of the line below the headline.
const NOTES: &str = " · ";

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

    /// The headline with the line below it, and the window's time, bag and date on the right. A headline that does not
    /// fit into one line takes both.
    pub(crate) fn words(&self, frame: &Frame, phase: &str) -> Vec<Group> {
        let (clock, room) = self.clock(frame);
        let mut headline = Group::named("headline");
        headline.data = vec![("entries", events(frame))];
        let mut note = Group::named("note");
        let (style, unit) = (&self.style.title, self.page.unit);
        let (size, small) = (style.size * unit, style.quiet_size * unit);
        let empty = frame.empty.map_or_else(String::new, |time| {
            format!("{} without a message", words::duration(time.nanos()))
        });
        let mut below = vec![phase.to_owned()];
        let mut second = Point::new(self.left(), LINES.1);
        if frame.caption.is_empty() {
            let (main, other) = match frame.empty {
                Some(_) => (&empty, Some(&frame.note)),
                None => (&frame.note, None),
            };
            below.extend(other.cloned());
            let found = self.largest(main, size, Weight::Regular, room.0);
            let font = (found.unwrap_or(size), Weight::Regular);
            let text = self.cut(main, font.0, font.1, room.0);
            let at = Point::new(self.left(), LINES.0);
            note.text(self.text(text, at, font, style.quiet));
        } else {
            let all = frame.fitting(|_| true);
            headline.title = joined(&all);
            let (lines, size) = self.lines(frame, all, room, size);
            let mut first = Point::new(self.left(), LINES.0);
            if lines.len() > 1 {
                (first.y, second.y) = TWO_LINES;
            }
            let ats = [(&mut first, room.0), (&mut second, room.1)];
            for (line, (at, most)) in lines.iter().zip(ats) {
                self.line(&mut headline, line, at, most, size);
            }
            below.extend(frame.note.split(NOTES).map(str::to_owned));
            below.push(empty);
        }
        if frame.messages == 0 && frame.empty.is_none() && !self.view.compares {
            below.push("no messages".to_owned());
        }
        below.retain(|part| !part.is_empty());
        // Behind words there is room for whole parts only.
        let rest = room.1 - (second.x - self.left());
        let is_behind = second.x > self.left();
        let gap = if is_behind { small } else { 0.0 };
        let fits =
            |below: &[String]| self.width(&below.join(NOTES), small, Weight::Regular) + gap <= rest;
        while is_behind && !below.is_empty() && !fits(&below) {
            below.pop();
        }
        let text = self.cut(&below.join(NOTES), small, Weight::Regular, rest);
        if !text.is_empty() {
            second.x += gap;
            note.text(self.text(text, second, (small, Weight::Regular), style.quiet));
        }
        vec![headline, note, clock]
    }

    /// The largest size at which a text fits; all words at a slightly smaller size are better than some of them.
    fn largest(&self, text: &str, size: f64, weight: Weight, most: f64) -> Option<f64> {
        let mut sizes = SMALLER.map(|part| size * part).into_iter();
        sizes.find(|size| self.width(text, *size, weight) <= most)
    }

    /// The headline in as many words as fit, in one line or in two, and their size; `all` are all of its words.
    fn lines(
        &self,
        frame: &Frame,
        all: Vec<Words>,
        room: (f64, f64),
        size: f64,
    ) -> (Vec<Vec<Words>>, f64) {
        if let Some(size) = self.largest(&joined(&all), size, Weight::SemiBold, room.0) {
            return (vec![all], size);
        }
        let size = size * SMALLEST;
        let fits =
            |words: &[Words], most: f64| self.width(&joined(words), size, Weight::SemiBold) <= most;
        // The number of phrases in the first line.
        let first = |words: &[Words]| {
            let ends: Vec<usize> = (1..=words.len()).collect();
            let first = ends.partition_point(|end| fits(&words[..*end], room.0));
            (first > 0 && fits(&words[first..], room.1)).then_some(first)
        };
        let mut words = frame.fitting(|words| first(words).is_some());
        let mut second = words.split_off(first(&words).unwrap_or(words.len()));
        if let ([long], []) = (&words[..], &second[..])
            && !fits(&words, room.0)
        {
            // An enumeration goes on in the second line.
            let part = |text: &str| {
                vec![Words {
                    sign: long.sign,
                    text: text.to_owned(),
                }]
            };
            let commas = long.text.rmatch_indices(", ");
            let mut halves = commas.map(|(at, comma)| long.text.split_at(at + comma.len()));
            if let Some((begin, rest)) = halves.find(|(begin, _)| fits(&part(begin), room.0)) {
                (words, second) = (part(begin.trim_end()), part(rest));
            }
        }
        let lines = [words, second].into_iter().filter(|line| !line.is_empty());
        (lines.collect(), size)
    }

    /// Writes a line of the headline from `at` on, each of its words in the colour of their change, and moves `at` to its
    /// end. If it is wider than `most`, its first words are cut.
    fn line(&self, headline: &mut Group, line: &[Words], at: &mut Point, most: f64, size: f64) {
        let style = &self.style.title;
        let end = at.x + most;
        for (k, words) in line.iter().enumerate() {
            let is_last = k + 1 == line.len();
            let between = if is_last { "" } else { BETWEEN_PHRASES };
            let color = match words.sign {
                Some('+') => style.added,
                Some('−') => style.removed,
                Some(_) => style.changed,
                None => style.text,
            };
            let text = format!("{}{between}", words.text);
            let wide = |text: &str| self.fonts.width(text, size, Weight::SemiBold);
            let most = end - at.x - wide(&joined(&line[k + 1..]));
            let text = self.cut(&text, size, Weight::SemiBold, most);
            let wide = wide(&text);
            headline.text(self.text(text, *at, (size, Weight::SemiBold), color));
            at.x += wide;
        }
    }

    /// The window's time with the length of the mission, the bag and the date, and the widths that they leave on the two
    /// lines.
    fn clock(&self, frame: &Frame) -> (Group, (f64, f64)) {
        let mut group = Group::named("clock");
        let (style, unit, view) = (&self.style.title, self.page.unit, self.view);
        let span = |k: Option<&Frame>| k.map_or(frame.span, |frame| frame.span);
        let start = span(view.frames.first()).start;
        let end = span(view.frames.last()).end;
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
            parts.extend(words::date_and_clock(shown.start.0));
            format!("{} – {}", at(shown.start), at(shown.end))
        };
        parts.retain(|part| !part.is_empty());
        let (size, small) = (style.clock_size * unit, style.quiet_size * unit);
        let most = self.page.title.w * MOST_RIGHT;
        let wide = |parts: &[String]| self.width(&parts.join(NOTES), small, Weight::Regular);
        // On a narrow page the date is dropped first.
        while parts.len() > 1 && wide(&parts) > most {
            parts.pop();
        }
        let below = self.cut(&parts.join(NOTES), small, Weight::Regular, most);
        let all = self.page.title.w - 2.0 * self.left() - GAP * unit;
        let first = self.width(&time, size, Weight::SemiBold);
        let second = self.width(&below, small, Weight::Regular);
        let room = ((all - first).max(1.0), (all - second).max(1.0));
        let right = |text: Text| Text {
            at: Point::new(self.page.title.right() - self.left(), text.at.y),
            anchor: Anchor::End,
            ..text
        };
        let at = |part| Point::new(self.left(), part);
        let time = self.text(time, at(LINES.0), (size, Weight::SemiBold), style.text);
        let below = self.text(below, at(LINES.1), (small, Weight::Regular), style.quiet);
        group.text(right(time));
        group.text(right(below));
        (group, room)
    }

    fn left(&self) -> f64 {
        self.style.page.margin * self.page.unit
    }

    /// The width of a text, with a margin, as an SVG shown in another font may be wider.
    fn width(&self, text: &str, size: f64, weight: Weight) -> f64 {
        let text = self.fonts.shown(text);
        let elsewhere = text.chars().count() as f64 * size * USUAL_WIDTH;
        self.fonts.width(&text, size, weight).max(elsewhere)
    }

    fn cut(&self, text: &str, size: f64, weight: Weight, most: f64) -> String {
        let text = self.fonts.shown(text);
        self.fonts.fit(&text, size, weight, most).into_owned()
    }

    /// A text from `at` on, whose height is a part of the bar's.
    fn text(&self, text: String, at: Point, font: (f64, Weight), color: Color) -> Text {
        let bar = self.page.title;
        let at = Point::new(at.x, bar.y + bar.h * at.y);
        Text::new(Anchor::Start, at, Font::new(font.0, font.1, color), text)
    }
}

/// The ids of the events that a window reports, separated by blanks.
fn events(frame: &Frame) -> String {
    let ids = frame.events().map(|event| event.to_string());
    ids.collect::<Vec<_>>().join(" ")
}

/// The sizes of a headline in one line, as parts of the largest.
const SMALLER: [f64; 3] = [1.0, 0.9, 0.8];
/// The size of a headline in two lines: both fit into the bar, and are larger than the line below a headline.
const SMALLEST: f64 = 0.8;

/// The titles of the windows of a comparison.
pub(crate) const SIDES: [&str; 2] = ["A alone", "B against A"];
