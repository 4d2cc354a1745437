//! The strip at the bottom: how busy each window is, where changes are, and where we are.

use super::page::Page;
use crate::base::geometry::{Point, Rect};
use crate::base::words;
use crate::draw::scene::{Anchor, Form, Group, Shape, Step, Stroke, Text, line, polygon};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::view::{Counts, Frame, View};

/// A bar stands for one window, or for several where there are more windows than room.
struct Bar {
    messages: u64,
    marks: [bool; 3],
}

/// The strip's fixed places.
pub(crate) struct Timeline<'a> {
    style: &'a Style,
    page: Page,
    fonts: &'a Fonts,
    bars: Vec<Bar>,
    /// Windows per bar, 1...
    per_bar: usize,
    /// Where bars stand.
    plot: Rect,
    windows: usize,
    busiest: u64,
}

/// The narrowest bar in pixels.
const NARROWEST: f64 = 2.5;

impl<'a> Timeline<'a> {
    pub(crate) fn new(style: &'a Style, fonts: &'a Fonts, page: &Page, view: &View) -> Self {
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
        let bars: Vec<Bar> = view.frames.chunks(per_bar).map(Bar::of).collect();
        let busiest = bars.iter().map(|b| b.messages).max().unwrap_or(0).max(1);
        Self {
            style,
            page: page.clone(),
            fonts,
            bars,
            per_bar,
            plot,
            windows: view.frames.len(),
            busiest,
        }
    }

    /// What is the same in every frame: ground, all bars, marks, axis.
    pub(crate) fn ground(&self, view: &View) -> Vec<Group> {
        let style = &self.style.timeline;
        let mut bars = Group::named("timeline");
        bars.shape(Shape::filled(
            Form::Rect(self.page.timeline, 0.0),
            self.style.legend.fill,
        ));
        bars.shape(Shape::filled(self.bars(0, self.bars.len()), style.future));
        let y = self.plot.bottom();
        let axis = line(Point::new(self.plot.x, y), Point::new(self.plot.right(), y));
        bars.shape(Shape::line(axis, Stroke::solid(style.axis, self.page.unit)));
        vec![bars, self.axis(view), self.marks()]
    }

    /// What moves: the bars up to `frame` and the head.
    pub(crate) fn head(&self, frame: usize) -> Vec<Group> {
        let style = &self.style.timeline;
        let at = frame / self.per_bar;
        let mut past = Group::named("past");
        past.shape(Shape::filled(self.bars(0, at), style.past));
        past.shape(Shape::filled(self.bars(at, at + 1), style.now));
        let mut head = Group::named("playhead");
        let unit = self.page.unit;
        let (x, width) = self.slot(at);
        let wide = width.max(5.0 * unit);
        let top = self.page.timeline.y + 2.0 * unit;
        let place = Rect::new(
            x + (width - wide) / 2.0,
            top,
            wide,
            self.plot.bottom() - top,
        );
        head.shape(Shape::line(
            Form::Rect(place.grown(0.75 * unit), 2.0 * unit),
            Stroke::solid(style.head, 1.5 * unit),
        ));
        vec![past, head]
    }

    /// The left edge and the width of the room of a bar.
    fn slot(&self, at: usize) -> (f64, f64) {
        let width = self.plot.w * self.per_bar as f64 / self.windows.max(1) as f64;
        let x = self.plot.x + at as f64 * width;
        (x, width.min(self.plot.right() - x).max(0.0))
    }

    /// The bars from one place to before another as one shape.
    fn bars(&self, from: usize, to: usize) -> Form {
        let mut steps = Vec::new();
        for (at, bar) in self.bars.iter().enumerate().take(to).skip(from) {
            let (x, width) = self.slot(at);
            let gap = if width > 5.0 {
                self.page.unit.min(width / 5.0)
            } else {
                0.0
            };
            let height = self.plot.h * bar.messages as f64 / self.busiest as f64;
            let height = if bar.messages > 0 {
                height.max(1.0)
            } else {
                0.0
            };
            let (top, bottom) = (self.plot.bottom() - height, self.plot.bottom());
            steps.extend([
                Step::Move(Point::new(x + gap / 2.0, bottom)),
                Step::Line(Point::new(x + gap / 2.0, top)),
                Step::Line(Point::new(x + width - gap / 2.0, top)),
                Step::Line(Point::new(x + width - gap / 2.0, bottom)),
                Step::Close,
            ]);
        }
        Form::Path(steps)
    }

    /// Signs over the windows in which something came, changed or went: three lanes, one for each.
    fn marks(&self) -> Group {
        let mut group = Group::named("marks");
        let unit = self.page.unit;
        let paint = [
            self.style.added.color,
            self.style.changed.color,
            self.style.removed.color,
        ];
        for (at, bar) in self.bars.iter().enumerate() {
            let (x, width) = self.slot(at);
            let r = (LANE * 0.42 * unit).min(width.max(5.0 * unit) * 0.48);
            for lane in (0..3).filter(|lane| bar.marks[*lane]) {
                let y = self.page.timeline.y + (LANE * (lane as f64 + 0.5) + 4.0) * unit;
                group.shape(Shape::filled(
                    mark(lane, Point::new(x + width / 2.0, y), r),
                    paint[lane],
                ));
            }
        }
        group
    }

    fn axis(&self, view: &View) -> Group {
        let mut group = Group::named("axis");
        let (Some(first), Some(last)) = (view.frames.first(), view.frames.last()) else {
            return group;
        };
        let style = &self.style.timeline;
        let size = style.size * self.page.unit;
        let y = self.plot.bottom() + size * 1.25;
        let total = last.span.end.since(first.span.start).max(1);
        let widest = self
            .fonts
            .width(&words::offset_seconds(total), size, Weight::Regular);
        #[expect(clippy::cast_possible_truncation, reason = "at most a few hundred")]
        let most = (self.plot.w / (widest * 2.2).max(1.0)).clamp(1.0, 12.0) as i64;
        let step = nice(total / most.max(1));
        // Counted, not added up: a span may be as long as a number can say.
        for at in (0..=total / step).map(|tick| tick * step) {
            let x = self.plot.x + self.plot.w * (at as f64 / total as f64);
            let text = words::offset(at);
            let width = self.fonts.width(&text, size, Weight::Regular);
            let x =
                (x - width / 2.0).clamp(self.plot.x, (self.plot.right() - width).max(self.plot.x));
            let color: Color = style.text;
            group.text(Text {
                at: Point::new(x, y),
                anchor: Anchor::Start,
                size,
                weight: Weight::Regular,
                color,
                halo: None,
                text,
            });
        }
        group
    }
}

/// The height of a lane of marks.
const LANE: f64 = 8.5;

impl Bar {
    fn of(frames: &[Frame]) -> Self {
        let any = |is: fn(&Counts) -> bool| frames.iter().any(|f| is(&f.tally));
        Self {
            messages: frames
                .iter()
                .map(|f| f.messages)
                .fold(0, u64::saturating_add),
            marks: [
                any(|t| t.nodes_added + t.topics_added + t.edges_added > 0),
                any(|t| t.rates + t.others > 0),
                any(|t| t.nodes_removed + t.topics_removed + t.edges_removed > 0),
            ],
        }
    }
}

/// ▲ for what came, ◆ for what changed, ▼ for what went.
pub(crate) fn mark(lane: usize, c: Point, r: f64) -> Form {
    let at = |x: f64, y: f64| Point::new(c.x + x * r, c.y + y * r);
    match lane {
        0 => polygon(&[at(-1.0, 0.8), at(0.0, -0.9), at(1.0, 0.8)]),
        1 => polygon(&[at(0.0, -1.0), at(1.0, 0.0), at(0.0, 1.0), at(-1.0, 0.0)]),
        _ => polygon(&[at(-1.0, -0.8), at(0.0, 0.9), at(1.0, -0.8)]),
    }
}

/// The smallest length of time that people count in and that is at least `least` nanoseconds.
fn nice(least: i64) -> i64 {
    const SECOND: i64 = 1_000_000_000;
    const STEPS: [i64; 24] = [
        SECOND / 1000,
        SECOND / 500,
        SECOND / 200,
        SECOND / 100,
        SECOND / 50,
        SECOND / 20,
        SECOND / 10,
        SECOND / 5,
        SECOND / 2,
        SECOND,
        2 * SECOND,
        5 * SECOND,
        10 * SECOND,
        20 * SECOND,
        30 * SECOND,
        60 * SECOND,
        120 * SECOND,
        300 * SECOND,
        600 * SECOND,
        1200 * SECOND,
        1800 * SECOND,
        3600 * SECOND,
        7200 * SECOND,
        21_600 * SECOND,
    ];
    let day = 86_400 * SECOND;
    let found = STEPS.iter().copied().find(|step| *step >= least);
    found.unwrap_or_else(|| (least / day + 1).saturating_mul(day))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_stand_at_round_times() {
        const SECOND: i64 = 1_000_000_000;
        assert_eq!(nice(7 * SECOND), 10 * SECOND);
        assert_eq!(nice(100 * SECOND), 120 * SECOND);
        assert_eq!(nice(100_000 * SECOND), 172_800 * SECOND);
        assert!(nice(i64::MAX) > 0);
    }

    #[test]
    fn the_longest_span_has_a_few_ticks_too() {
        for total in [1, 1_000_000_000, i64::MAX] {
            let step = nice(total / 12);
            assert!(total / step <= 12, "{total}: {step}");
        }
    }
}
