//! The strip at the bottom: phases and rows of elements that start or stop (or messages per second if none
//! do), and the playhead at the window.

use super::PageOptions;
use super::course::{CourseSizes, CourseStrip, names_width};
use super::page::PageFrame;
use super::title::whole;
use crate::base::cast;
use crate::base::geometry::{Point, Rect};
use crate::base::time::{Span, Stamp, round_length};
use crate::base::words;
use crate::draw::scene::{Anchor, Form, Group, Shape, Step, Stroke, Text, line};
use crate::draw::style::Style;
use crate::draw::text::{Fonts, Weight};
use crate::draw::timeline::course::Course;
use crate::view::{Frame, View};

/// A bar represents one window, or several if there is not enough space.
struct TimelineBar {
    /// Its time: from the start of its first window to the start of the next bar's, or to the end.
    span: Span,
    /// Messages per second.
    rate: f64,
}

/// The strip's fixed positions.
pub(crate) struct Timeline<'a> {
    style: &'a Style,
    page: PageFrame,
    fonts: &'a Fonts,
    bars: Vec<TimelineBar>,
    /// Windows per bar, ≥ 1.
    per_bar: usize,
    /// The rectangle of the bars.
    plot: Rect,
    /// The time that the axis covers.
    span: Span,
    busiest: f64,
    /// The phases and rows; bars are drawn if there are no rows.
    course: Course,
    sizes: CourseSizes,
}

/// The space above and below everything.
const AROUND: f64 = 7.0;

/// The narrowest bar in pixels.
const NARROWEST: f64 = 2.5;

/// The height of the strip: phases and rows, or bars of messages, above the axis.
pub(crate) fn height(style: &Style, options: &PageOptions, unit: f64) -> f64 {
    let (sizes, course) = (sizes(style, options, unit), &options.course);
    let rows = match course.rows.len() {
        0 => style.timeline.height * unit,
        _ => sizes.rows(course),
    };
    sizes.band(course) + rows + sizes.text * 1.6 + 2.0 * AROUND * unit
}

fn sizes(style: &Style, options: &PageOptions, unit: f64) -> CourseSizes {
    CourseSizes::new(style, unit, options.width_mm.is_some())
}

impl<'a> Timeline<'a> {
    pub(crate) fn new(
        style: &'a Style,
        fonts: &'a Fonts,
        page: &PageFrame,
        view: &View,
        options: &PageOptions,
    ) -> Self {
        let (unit, strip) = (page.unit, page.timeline);
        let (sizes, course) = (sizes(style, options, unit), options.course.clone());
        let margin = style.page.margin * unit;
        let names = match course.rows.len() {
            0 => 0.0,
            _ => names_width(&course, sizes, fonts, strip.w - margin),
        };
        let top = strip.y + AROUND * unit + sizes.band(&course);
        let height = match course.rows.len() {
            0 => style.timeline.height * unit,
            _ => sizes.rows(&course),
        };
        let left = margin + names;
        let plot = Rect::new(left, top, (strip.w - left - margin).max(1.0), height);
        let most = cast::to_usize((plot.w / NARROWEST).max(1.0));
        let per_bar = view.frames.len().div_ceil(most).max(1);
        let span = Span::new(
            view.frames.first().map_or(Stamp(0), |f| f.span.start),
            view.frames.last().map_or(Stamp(1), |f| f.span.end),
        );
        let starts = view.frames.iter().step_by(per_bar).map(|f| f.span.start);
        let ends = starts.skip(1).chain([span.end]);
        let bars = view.frames.chunks(per_bar).zip(ends);
        let bars: Vec<TimelineBar> = bars
            .filter_map(|(frames, end)| TimelineBar::of(frames, end))
            .collect();
        let busiest = bars.iter().map(|b| b.rate).fold(0.0, f64::max);
        Self {
            style,
            page: page.clone(),
            fonts,
            bars,
            per_bar,
            plot,
            span,
            busiest,
            course,
            sizes,
        }
    }

    fn strip(&self) -> CourseStrip<'_> {
        CourseStrip {
            style: self.style,
            fonts: self.fonts,
            course: &self.course,
            sizes: self.sizes,
            plot: self.plot,
            span: self.span,
            unit: self.page.unit,
        }
    }

    fn has_rows(&self) -> bool {
        !self.course.rows.is_empty()
    }

    /// The groups that are equal in every frame: background, phases, rows or bars, axis.
    pub(crate) fn ground(&self) -> Vec<Group> {
        let style = &self.style.timeline;
        let mut bars = Group::named("timeline");
        bars.shape(Shape::filled(
            Form::Rect(self.page.timeline, 0.0),
            self.style.legend.fill,
        ));
        if !self.has_rows() {
            bars.shape(Shape::filled(self.bars(0, self.bars.len()), style.future));
            let y = self.plot.bottom();
            let axis = line(Point::new(self.plot.x, y), Point::new(self.plot.right(), y));
            bars.shape(Shape::line(axis, Stroke::solid(style.axis, self.page.unit)));
        }
        let mut groups = vec![bars, self.axis()];
        groups.extend(self.strip().ground());
        groups
    }

    /// The groups that change from frame to frame: the elements that exist in window `k` (or the bars up to
    /// it), and the playhead over exactly its time.
    pub(crate) fn head(&self, k: usize, frame: &Frame) -> Vec<Group> {
        let style = &self.style.timeline;
        let shown = frame.shown();
        let mut past = self.strip().now(shown);
        if !self.has_rows() {
            let at = k / self.per_bar;
            past.shape(Shape::filled(self.bars(0, at), style.past));
            past.shape(Shape::filled(self.bars(at, at + 1), style.now));
        }
        let mut head = Group::named("playhead");
        let unit = self.page.unit;
        let (left, right) = (self.x(shown.start), self.x(shown.end));
        // Below the names of the phases.
        let top = self.plot.y - 2.0 * unit;
        let place = Rect::new(left, top, right - left, self.plot.bottom() - top);
        head.shape(Shape::line(
            Form::Rect(place, (2.0 * unit).min(place.w / 2.0)),
            Stroke::solid(style.head, 1.5 * unit),
        ));
        let mut groups = vec![past];
        groups.extend(self.strip().events());
        groups.push(head);
        groups
    }

    /// The x of a moment on the axis.
    fn x(&self, at: Stamp) -> f64 {
        self.strip().x(at)
    }

    /// A range of bars as one shape.
    fn bars(&self, from: usize, to: usize) -> Form {
        let mut steps = Vec::new();
        for bar in self.bars.iter().take(to).skip(from) {
            let (x, right) = (self.x(bar.span.start), self.x(bar.span.end));
            let width = right - x;
            let gap = if width > 5.0 {
                self.page.unit.min(width / 5.0)
            } else {
                0.0
            };
            let height = if bar.rate > 0.0 {
                (self.plot.h * bar.rate / self.busiest).max(1.0)
            } else {
                0.0
            };
            let (top, bottom) = (self.plot.bottom() - height, self.plot.bottom());
            steps.extend([
                Step::Move(Point::new(x + gap / 2.0, bottom)),
                Step::Line(Point::new(x + gap / 2.0, top)),
                Step::Line(Point::new(right - gap / 2.0, top)),
                Step::Line(Point::new(right - gap / 2.0, bottom)),
                Step::Close,
            ]);
        }
        Form::Path(steps)
    }

    /// The axis with round times, except those too near to the end, which is always labelled.
    fn axis(&self) -> Group {
        let mut group = Group::named("axis");
        let size = self.sizes.text;
        let width = |text: &str| self.fonts.width(text, size, Weight::Regular);
        let total = self.span.nanos();
        let last = words::moment(whole(total));
        let most = cast::to_i64((self.plot.w / (width(&last) * 2.2).max(1.0)).clamp(1.0, 12.0));
        let step = round_length(total / most.max(1));
        let end = self.plot.right() - width(&last) * 1.4;
        // Multiplied instead of added repeatedly: a span may be as long as the largest number.
        for at in (0..=total / step).map(|tick| tick * step) {
            let text = words::moment(at);
            let wide = width(&text);
            let x = self.x(self.span.start.plus(at)) - wide / 2.0;
            let x = x.max(self.plot.x);
            if x + wide <= end {
                group.text(self.tick(x, Anchor::Start, text));
            }
        }
        group.text(self.tick(self.plot.right(), Anchor::End, last));
        group
    }

    fn tick(&self, x: f64, anchor: Anchor, text: String) -> Text {
        let size = self.sizes.text;
        Text {
            at: Point::new(x, self.plot.bottom() + size * 1.25),
            anchor,
            size,
            weight: Weight::Regular,
            color: self.style.timeline.text,
            halo: None,
            text,
        }
    }
}

impl TimelineBar {
    /// The bar of some windows, up to where the next begins. Messages per second of the windows' own time, so
    /// that short and overlapping windows are not misleading.
    fn of(frames: &[Frame], end: Stamp) -> Option<Self> {
        let start = frames.first()?.span.start;
        let messages: u64 = frames.iter().fold(0, |n, f| n.saturating_add(f.messages));
        let nanos: f64 = frames.iter().map(|f| f.span.nanos() as f64).sum();
        Some(Self {
            span: Span::new(start, end),
            rate: messages as f64 * 1e9 / nanos.max(1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_at_round_times() {
        const SECOND: i64 = 1_000_000_000;
        assert_eq!(round_length(7 * SECOND), 10 * SECOND);
        assert_eq!(round_length(100 * SECOND), 120 * SECOND);
        assert_eq!(round_length(100_000 * SECOND), 172_800 * SECOND);
        assert!(round_length(i64::MAX) > 0);
    }

    #[test]
    fn the_longest_span_has_a_few_ticks_too() {
        for total in [1, 1_000_000_000, i64::MAX] {
            let step = round_length(total / 12);
            assert!(total / step <= 12, "{total}: {step}");
        }
    }
}
