//! The life lines in the strip below the graph, with phases, starts, stops and hand-overs at their true places.

use crate::base::geometry::{Point, Rect};
use crate::base::time::{Span, Stamp};
use crate::draw::figure::course::Course;
use crate::draw::figure::tracks::SendingBar;
use crate::draw::scene::{Form, Group, Shape, Step, Stroke, line};
use crate::draw::style::{Color, Style};

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

    /// Lives as thin lines, with their starts and ends, and hand-overs.
    pub(crate) fn lives(&self, course: &Course) -> Group {
        let mut group = Group::named("lives");
        let pitch = self.pitch(course);
        let y = |k: usize| self.plot.y + (k as f64 + 0.5) * pitch;
        let thin = Stroke::solid(self.style.timeline.axis, (pitch * 0.12).clamp(0.4, 1.0));
        let tick = |color| Stroke::solid(color, TICK * self.unit);
        for (k, row) in course.rows.iter().enumerate() {
            for life in &row.lives {
                let ends = [life.span.start, life.span.end].map(|at| self.x(at));
                let along = line(Point::new(ends[0], y(k)), Point::new(ends[1], y(k)));
                group.shape(Shape::line(along, thin.clone()));
                let across = |x: f64| {
                    line(
                        Point::new(x, y(k) - pitch * 0.45),
                        Point::new(x, y(k) + pitch * 0.45),
                    )
                };
                if life.begins {
                    group.shape(Shape::line(across(ends[0]), tick(self.style.added.color)));
                }
                if life.ends {
                    group.shape(Shape::line(across(ends[1]), tick(self.style.removed.color)));
                }
            }
        }
        for (at, from, to) in &course.handovers {
            let x = self.x(*at);
            let hand = line(Point::new(x, y(*from)), Point::new(x, y(*to)));
            group.shape(Shape::line(hand, tick(self.style.changed.color)));
        }
        group
    }

    fn pitch(&self, course: &Course) -> f64 {
        self.plot.h / course.rows.len().max(1) as f64
    }
}
