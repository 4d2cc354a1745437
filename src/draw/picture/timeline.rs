//! The strip at the bottom: life lines (or messages per second where there are none), the changes, and the place of the
//! window.

use super::course::CourseStrip;
use super::page::PageFrame;
use super::title::whole;
use crate::base::geometry::{Point, Rect};
use crate::base::time::{Span, Stamp, round_length};
use crate::base::words;
use crate::draw::figure::Course;
use crate::draw::figure::canvas::entry_data;
use crate::draw::scene::{Anchor, Form, Group, Shape, Step, Stroke, Text, line, polygon};
use crate::draw::style::Style;
use crate::draw::text::{Fonts, Weight};
use crate::mission::EntryId;
use crate::mission::ledger::Kind;
use crate::view::{Frame, View};

/// A bar stands for one window, or for several where there are more windows than room.
struct TimelineBar {
    /// Its time: from the start of its first window to the start of the next bar's, or to the end.
    span: Span,
    /// Messages per second.
    rate: f64,
}

/// The strip's fixed places.
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
    /// The life lines; bars are drawn where there are none.
    course: Option<Course>,
}

/// The narrowest bar in pixels.
const NARROWEST: f64 = 2.5;

impl<'a> Timeline<'a> {
    pub(crate) fn new(style: &'a Style, fonts: &'a Fonts, page: &PageFrame, view: &View) -> Self {
        let unit = page.unit;
        let strip = page.timeline;
        let margin = style.page.margin * unit;
        let height = style.timeline.height * unit;
        let top = strip.y + 3.0 * LANE * unit + 6.0 * unit;
        let plot = Rect::new(margin, top, (strip.w - 2.0 * margin).max(1.0), height);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a number of pixels"
        )]
        let most = (plot.w / NARROWEST).max(1.0) as usize;
        let per_bar = view.frames.len().div_ceil(most).max(1);
        let span = Span {
            start: view.frames.first().map_or(Stamp(0), |f| f.span.start),
            end: view.frames.last().map_or(Stamp(1), |f| f.span.end),
        };
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
            course: None,
        }
    }

    /// The same strip with life lines in place of bars, if there are any.
    pub(crate) fn with(mut self, course: Option<Course>) -> Self {
        self.course = course.filter(|c| !c.rows.is_empty());
        self
    }

    fn strip(&self) -> CourseStrip<'_> {
        CourseStrip {
            style: self.style,
            plot: self.plot,
            span: self.span,
            unit: self.page.unit,
        }
    }

    /// The groups that are the same in every frame: ground, all bars, marks, axis.
    pub(crate) fn ground(&self, view: &View) -> Vec<Group> {
        let style = &self.style.timeline;
        let mut bars = Group::named("timeline");
        bars.shape(Shape::filled(
            Form::Rect(self.page.timeline, 0.0),
            self.style.legend.fill,
        ));
        if let Some(course) = &self.course {
            let top = self.page.timeline.y + 2.0 * self.page.unit;
            self.strip().phases(&mut bars, course, top);
        }
        match &self.course {
            None => bars.shape(Shape::filled(self.bars(0, self.bars.len()), style.future)),
            Some(course) => bars.shape(self.strip().bars(course, self.span, style.future)),
        }
        let y = self.plot.bottom();
        let axis = line(Point::new(self.plot.x, y), Point::new(self.plot.right(), y));
        bars.shape(Shape::line(axis, Stroke::solid(style.axis, self.page.unit)));
        let mut groups = vec![bars, self.axis()];
        if let Some(course) = &self.course {
            groups.push(self.strip().lives(course));
            groups.extend(self.strip().events(course));
        }
        groups.extend(self.marks(view));
        groups
    }

    /// The groups that change from frame to frame: the bars up to the window at place `k`, and the head over exactly
    /// its time.
    pub(crate) fn head(&self, k: usize, frame: &Frame) -> Vec<Group> {
        let style = &self.style.timeline;
        let at = k / self.per_bar;
        let mut past = Group::named("past");
        match &self.course {
            None => {
                past.shape(Shape::filled(self.bars(0, at), style.past));
                past.shape(Shape::filled(self.bars(at, at + 1), style.now));
            }
            Some(course) => {
                let before = Span {
                    start: self.span.start,
                    end: frame.span.start,
                };
                past.shape(self.strip().bars(course, before, style.past));
                past.shape(self.strip().bars(course, frame.span, style.now));
            }
        }
        let mut head = Group::named("playhead");
        let unit = self.page.unit;
        let (left, right) = (self.x(frame.span.start), self.x(frame.span.end));
        let top = self.page.timeline.y + 2.0 * unit;
        let place = Rect::new(left, top, right - left, self.plot.bottom() - top);
        head.shape(Shape::line(
            Form::Rect(place, (2.0 * unit).min(place.w / 2.0)),
            Stroke::solid(style.head, 1.5 * unit),
        ));
        vec![past, head]
    }

    /// The x of a moment on the axis.
    fn x(&self, at: Stamp) -> f64 {
        self.strip().x(at)
    }

    /// The bars from one place to before another as one shape.
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

    /// Signs at the times at which something came, changed or went: three lanes, one for each. Signs that would cover
    /// each other are one, as far as they belong to one window; each knows its window and the headlines it stands
    /// for.
    fn marks(&self, view: &View) -> Vec<Group> {
        let mut groups = Vec::new();
        let radius = LANE * 0.42 * self.page.unit;
        for (window, frame) in view.frames.iter().enumerate() {
            for lane in 0..3 {
                let of_lane = frame.headlines.iter().filter(|h| lane_of(h.kind) == lane);
                let mut times: Vec<(f64, EntryId)> =
                    of_lane.map(|h| (self.x(h.time), h.entry)).collect();
                times.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                for (at, some) in times.chunk_by(|a, b| b.0 - a.0 < 2.0 * radius).enumerate() {
                    let x = f64::midpoint(some[0].0, some[some.len() - 1].0);
                    let entries: Vec<EntryId> = some.iter().map(|(_, entry)| *entry).collect();
                    groups.push(self.mark((window, lane, at), x, radius, &entries));
                }
            }
        }
        groups
    }

    fn mark(
        &self,
        (window, lane, at): (usize, usize, usize),
        x: f64,
        radius: f64,
        entries: &[EntryId],
    ) -> Group {
        let mut group = Group::named(&format!("mark-{window}-{lane}-{at}"));
        "mark".clone_into(&mut group.class);
        group.data = vec![("window", window.to_string())];
        group.data.extend(entry_data(entries));
        let paint = [
            self.style.added.color,
            self.style.changed.color,
            self.style.removed.color,
        ];
        let y = self.page.timeline.y + (LANE * (lane as f64 + 0.5) + 4.0) * self.page.unit;
        group.shape(Shape::filled(
            mark(lane, Point::new(x, y), radius),
            paint[lane],
        ));
        group
    }

    /// The axis with round times, as far as they do not come too near to the last, which is the end.
    fn axis(&self) -> Group {
        let mut group = Group::named("axis");
        let size = self.style.timeline.size * self.page.unit;
        let width = |text: &str| self.fonts.width(text, size, Weight::Regular);
        let total = self.span.nanos();
        let last = words::offset(whole(total));
        #[expect(clippy::cast_possible_truncation, reason = "at most a few hundred")]
        let most = (self.plot.w / (width(&last) * 2.2).max(1.0)).clamp(1.0, 12.0) as i64;
        let step = round_length(total / most.max(1));
        let end = self.plot.right() - width(&last) * 1.4;
        // Counted, not added up: a span may be as long as a number can say.
        for at in (0..=total / step).map(|tick| tick * step) {
            let text = words::offset(at);
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
        let size = self.style.timeline.size * self.page.unit;
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

/// The height of a lane of marks.
const LANE: f64 = 8.5;

impl TimelineBar {
    /// The bar of some windows, up to where the next begins. Messages per second of the windows' own time, so that
    /// neither a short nor an overlapping window lies.
    fn of(frames: &[Frame], end: Stamp) -> Option<Self> {
        let start = frames.first()?.span.start;
        let messages: u64 = frames.iter().fold(0, |n, f| n.saturating_add(f.messages));
        let nanos: f64 = frames.iter().map(|f| f.span.nanos() as f64).sum();
        Some(Self {
            span: Span { start, end },
            rate: messages as f64 * 1e9 / nanos.max(1.0),
        })
    }
}

/// The lane of a headline: 0 for what came, 1 for what changed, 2 for what went.
fn lane_of(kind: Kind) -> usize {
    match kind {
        Kind::Started | Kind::Appeared => 0,
        Kind::Stopped | Kind::Vanished => 2,
        _ => 1,
    }
}

/// The sign of a lane: a plus for what came, a diamond for what changed, a minus for what went, as on the badges.
pub(crate) fn mark(lane: usize, c: Point, r: f64) -> Form {
    let at = |x: f64, y: f64| Point::new(c.x + x * r, c.y + y * r);
    match lane {
        0 => polygon(&[
            at(-0.35, -1.0),
            at(0.35, -1.0),
            at(0.35, -0.35),
            at(1.0, -0.35),
            at(1.0, 0.35),
            at(0.35, 0.35),
            at(0.35, 1.0),
            at(-0.35, 1.0),
            at(-0.35, 0.35),
            at(-1.0, 0.35),
            at(-1.0, -0.35),
            at(-0.35, -0.35),
        ]),
        1 => polygon(&[at(0.0, -1.0), at(1.0, 0.0), at(0.0, 1.0), at(-1.0, 0.0)]),
        _ => polygon(&[at(-1.0, -0.4), at(1.0, -0.4), at(1.0, 0.4), at(-1.0, 0.4)]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_stand_at_round_times() {
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
