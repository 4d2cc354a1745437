//! The life lines in the strip below the graph, with phases, starts, stops and hand-overs at their true places.

use crate::base::geometry::{Point, Rect, Size};
use crate::base::time::{Span, Stamp};
use crate::draw::figure::canvas::entry_data;
use crate::draw::figure::course::Course;
use crate::draw::figure::marks::Sign;
use crate::draw::figure::tracks::SendingBar;
use crate::draw::scene::{Form, Group, Shape, Step, Stroke, line};
use crate::draw::style::{Color, Style};
use crate::mission::EntryId;

/// The strip in which the course is drawn, with the place of each moment.
pub(crate) struct CourseStrip<'a> {
    pub(crate) style: &'a Style,
    pub(crate) plot: Rect,
    pub(crate) span: Span,
    pub(crate) unit: f64,
}

/// The share of a row that its bar takes: when it hardly sends, and the part added when it sends most.
const BAR: (f64, f64) = (0.5, 0.4);
/// The width of a start and of an end.
const TICK: f64 = 1.6;

impl CourseStrip<'_> {
    pub(crate) fn x(&self, at: Stamp) -> f64 {
        let part = at.since(self.span.start) as f64 / self.span.nanos().max(1) as f64;
        self.plot.x + self.plot.w * part.clamp(0.0, 1.0)
    }

    /// Every other phase as a pale column.
    pub(crate) fn phases(&self, group: &mut Group, course: &Course, top: f64) {
        let fill = self.style.legend.fill.towards(self.style.legend.line, 0.5);
        let high = self.plot.bottom() - top;
        for (k, phase) in course.phases.iter().enumerate() {
            let (left, right) = (self.x(phase.start), self.x(phase.end));
            if k % 2 == 0 {
                let form = Form::Rect(Rect::new(left, top, right - left, high), 0.0);
                group.shape(Shape::filled(form, fill));
            }
        }
    }

    /// The bars of sending in a time, as one shape.
    pub(crate) fn bars(&self, course: &Course, time: Span, color: Color) -> Shape {
        let pitch = self.pitch(course);
        let mut steps = Vec::new();
        for (k, row) in course.rows.iter().enumerate() {
            let y = self.plot.y + (k as f64 + 0.5) * pitch;
            let inside = |b: &&SendingBar| b.span.start < time.end && time.start < b.span.end;
            for bar in row.bars.iter().filter(inside) {
                let left = self.x(bar.span.start.max(time.start));
                let right = self.x(bar.span.end.min(time.end));
                let half = pitch * (BAR.0 + BAR.1 * bar.share) / 2.0;
                let right = right.max(left + 0.5);
                steps.extend([
                    Step::Move(Point::new(left, y - half)),
                    Step::Line(Point::new(right, y - half)),
                    Step::Line(Point::new(right, y + half)),
                    Step::Line(Point::new(left, y + half)),
                    Step::Close,
                ]);
            }
        }
        Shape::filled(Form::Path(steps), color)
    }

    /// Lives as thin lines.
    pub(crate) fn lives(&self, course: &Course) -> Group {
        let mut group = Group::named("lives");
        let pitch = self.pitch(course);
        let thin = Stroke::solid(self.style.timeline.axis, (pitch * 0.12).clamp(0.4, 1.0));
        for (k, row) in course.rows.iter().enumerate() {
            for life in &row.lives {
                let ends = [life.span.start, life.span.end].map(|at| self.x(at));
                let y = self.y(course, k);
                let along = line(Point::new(ends[0], y), Point::new(ends[1], y));
                group.shape(Shape::line(along, thin.clone()));
            }
        }
        group
    }

    /// The events of the log on their rows, a group each: starts, ends, small circles for others, and hand-overs.
    pub(crate) fn events(&self, course: &Course) -> Vec<Group> {
        let pitch = self.pitch(course);
        let group = |class: &str, at: usize, entry: EntryId, shape: Shape| {
            let mut group = Group::named(&format!("{class}-{at}"));
            class.clone_into(&mut group.class);
            group.data = entry_data(&[entry]);
            group.shape(shape);
            group
        };
        let tick = |color| Stroke::solid(color, TICK * self.unit);
        let across = |x: f64, y: f64, color| {
            let ends = [y - pitch * 0.45, y + pitch * 0.45].map(|y| Point::new(x, y));
            Shape::line(line(ends[0], ends[1]), tick(color))
        };
        let marks = course.marks.iter().enumerate().map(|(at, mark)| {
            let (x, y) = (self.x(mark.at), self.y(course, mark.track));
            let (class, shape) = match mark.sign {
                Sign::Start => ("start", across(x, y, self.style.added.color)),
                Sign::End => ("end", across(x, y, self.style.removed.color)),
                Sign::Dot => {
                    let wide = (pitch * 0.5).min(4.0 * self.unit);
                    let round = Rect::around(Point::new(x, y), Size::new(wide, wide));
                    let form = Form::Ellipse(round);
                    ("event", Shape::filled(form, self.style.changed.color))
                }
            };
            group(class, at, mark.entry, shape)
        });
        let hands = course.handovers.iter().enumerate().map(|(at, hand)| {
            let x = self.x(hand.at);
            let ends = [hand.from, hand.to].map(|k| Point::new(x, self.y(course, k)));
            let shape = Shape::line(line(ends[0], ends[1]), tick(self.style.changed.color));
            group("handover", at, hand.entry, shape)
        });
        marks.chain(hands).collect()
    }

    /// The middle of a row.
    fn y(&self, course: &Course, row: usize) -> f64 {
        self.plot.y + (row as f64 + 0.5) * self.pitch(course)
    }

    fn pitch(&self, course: &Course) -> f64 {
        self.plot.h / course.rows.len().max(1) as f64
    }
}
