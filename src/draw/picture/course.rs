//! The course of a mission in the strip below the graph: named phases, and named rows with starts, ends and absences.

use crate::base::geometry::{Point, Rect, Size};
use crate::base::time::{Span, Stamp};
use crate::draw::scene::{Anchor, Form, Group, Shape, Step, Stroke, Text, line};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::draw::timeline::canvas::event_data;
use crate::draw::timeline::course::{Course, CourseMark, CoursePhase, CourseRow};
use crate::draw::timeline::marks::Sign;
use crate::mission::EventId;

/// The smallest text on a screen, in pixels.
const SMALLEST_TEXT: f64 = 10.0;
/// The height of a row and of its bar, in pixels at least, and in units of the page.
const ROW: f64 = 14.0;
const BAR: f64 = 7.0;
/// The largest fraction of the width for the names of rows.
const NAMES: f64 = 0.22;
/// The space between names and bars, and around the text of a phase.
const GAP: f64 = 8.0;
/// The most names that are written for a row.
const MOST_NAMES: usize = 3;
/// The name of the row for events without their own row.
const OTHERS: &str = "other changes";

/// The sizes of the course in pixels.
#[derive(Clone, Copy)]
pub(crate) struct CourseSizes {
    pub(crate) text: f64,
    band: f64,
    row: f64,
    bar: f64,
}

impl CourseSizes {
    /// The sizes on a page with this scale of title, legend and timeline; on paper text may be smaller than
    /// on a screen.
    pub(crate) fn new(style: &Style, unit: f64, is_paper: bool) -> Self {
        let least = if is_paper { 0.0 } else { 1.0 };
        let text = (style.timeline.size * unit).max(SMALLEST_TEXT * least);
        let scale = (text / style.timeline.size).max(least);
        Self {
            text,
            band: text * 1.75,
            row: ROW * scale,
            bar: BAR * scale,
        }
    }

    /// The height of the band of phases with the space below it.
    pub(crate) fn band(&self, course: &Course) -> f64 {
        if course.phases.is_empty() {
            0.0
        } else {
            self.band + self.row * 0.2
        }
    }

    /// The height of all rows.
    pub(crate) fn rows(&self, course: &Course) -> f64 {
        self.row * course.rows.len() as f64
    }
}

/// The width of the column of names.
pub(crate) fn names_width(course: &Course, sizes: CourseSizes, fonts: &Fonts, page: f64) -> f64 {
    let wide = |row: &CourseRow| {
        let text = label(row, |_| true);
        fonts.width(&fonts.shown(&text), sizes.text, Weight::SemiBold)
    };
    let widest = course.rows.iter().map(wide).fold(0.0, f64::max);
    widest.min(page * NAMES) + GAP
}

/// The names of a row, as many as fit: `planner, costmap, +2`; the first alone if none do.
fn label(row: &CourseRow, fits: impl Fn(&str) -> bool) -> String {
    if row.names.is_empty() {
        return OTHERS.to_owned();
    }
    let text = |named: usize| {
        let names = row.names[..named].join(", ");
        match row.names.len() - named {
            0 => names,
            more => format!("{names}, +{more}"),
        }
    };
    let most = row.names.len().min(MOST_NAMES);
    let mut texts = (1..=most).rev().map(text);
    texts.find(|text| fits(text)).unwrap_or_else(|| text(1))
}

/// The strip in which the course is drawn, with the position of each point in time.
pub(crate) struct CourseStrip<'a> {
    pub(crate) style: &'a Style,
    pub(crate) fonts: &'a Fonts,
    pub(crate) course: &'a Course,
    pub(crate) sizes: CourseSizes,
    /// The rows, or the bars of messages if there are none.
    pub(crate) plot: Rect,
    pub(crate) span: Span,
    pub(crate) unit: f64,
}

impl CourseStrip<'_> {
    pub(crate) fn x(&self, at: Stamp) -> f64 {
        let part = at.since(self.span.start) as f64 / self.span.nanos().max(1) as f64;
        self.plot.x + self.plot.w * part.clamp(0.0, 1.0)
    }

    /// The top of the band.
    pub(crate) fn top(&self) -> f64 {
        self.plot.y - self.sizes.band(self.course)
    }

    /// The phases and the lifetimes of all rows.
    pub(crate) fn ground(&self) -> Vec<Group> {
        let mut band = Group::named("phases");
        for (k, phase) in self.course.phases.iter().enumerate() {
            let fill = self.style.timeline.future;
            let fill = if k % 2 == 0 {
                fill.towards(self.style.legend.fill, 0.5)
            } else {
                fill
            };
            self.phase(
                &mut band,
                phase,
                fill,
                self.style.legend.text,
                Weight::Regular,
            );
        }
        let mut rows = Group::named("lives");
        for (k, row) in self.course.rows.iter().enumerate() {
            let y = self.y(k);
            let along = line(Point::new(self.plot.x, y), Point::new(self.plot.right(), y));
            let thin = Stroke::solid(self.style.legend.line, 0.5 * self.unit);
            rows.shape(Shape::line(along, thin));
            rows.shape(self.bars(k, row, self.style.timeline.future));
        }
        vec![band, rows]
    }

    /// The events of all rows.
    pub(crate) fn events(&self) -> Vec<Group> {
        let rows = self.course.rows.iter().enumerate();
        rows.flat_map(|(k, row)| self.marks(k, row)).collect()
    }

    /// The names of all rows, the bars of those that exist in a time range, and its phase.
    pub(crate) fn now(&self, time: Span) -> Group {
        let mut group = Group::named("past");
        let style = &self.style.timeline;
        for (k, row) in self.course.rows.iter().enumerate() {
            let lives = |life: &Span| life.start < time.end && time.start < life.end;
            let is_alive = row.lives.iter().any(lives);
            let (color, weight) = if is_alive {
                (self.style.page.text, Weight::SemiBold)
            } else {
                (style.text, Weight::Regular)
            };
            if is_alive {
                group.shape(self.bars(k, row, style.past.towards(style.text, 0.4)));
            }
            self.name(&mut group, (k, row), color, weight);
        }
        let shared = |phase: &&CoursePhase| {
            let (from, to) = (
                phase.span.start.max(time.start),
                phase.span.end.min(time.end),
            );
            to.since(from)
        };
        if let Some(phase) = self.course.phases.iter().max_by_key(shared) {
            let (fill, text) = (self.style.page.text, self.style.page.background);
            self.phase(&mut group, phase, fill, text, Weight::SemiBold);
        }
        group
    }

    fn phase(
        &self,
        group: &mut Group,
        phase: &CoursePhase,
        fill: Color,
        color: Color,
        weight: Weight,
    ) {
        let (left, right) = (self.x(phase.span.start), self.x(phase.span.end));
        let place = Rect::new(left, self.top(), right - left, self.sizes.band);
        group.shape(Shape {
            form: Form::Rect(place, 0.0),
            fill,
            stroke: Stroke::solid(self.style.legend.fill, self.unit),
        });
        let size = self.sizes.text;
        let room = place.w - GAP / 2.0;
        let wide = |text: &str| self.fonts.width(text, size, Weight::SemiBold);
        let names = phase.names.iter().map(|name| self.fonts.shown(name));
        let cut = names.clone().next().map(|name| {
            let text = self.fonts.fit(&name, size, Weight::SemiBold, room);
            text.into_owned()
        });
        let mut fitting = names.filter(|name| wide(name) <= room);
        let text = fitting.next().map(std::borrow::Cow::into_owned);
        // Truncated words are more informative than a number, if enough of them remain.
        let is_number = |text: &&String| text.chars().all(|c| c.is_ascii_digit());
        let text = match (text, cut) {
            (text, Some(cut)) if text.as_ref().is_none_or(|t| is_number(&t)) => {
                text.filter(|_| room < size * 4.0).unwrap_or(cut)
            }
            (text, _) => text.unwrap_or_default(),
        };
        if wide(&text) > room {
            return;
        }
        let font = (size, weight);
        group.text(Text::centred(
            Anchor::Middle,
            place.centre(),
            font,
            color,
            text,
        ));
    }

    fn name(&self, group: &mut Group, (k, row): (usize, &CourseRow), color: Color, weight: Weight) {
        let size = self.sizes.text;
        let room = self.plot.x - GAP - self.style.page.margin * self.unit + 0.1;
        let wide = |text: &str| self.fonts.width(text, size, Weight::SemiBold);
        let text = label(row, |text| wide(&self.fonts.shown(text)) <= room);
        let text = self.fonts.shown(&text);
        let text = self.fonts.fit(&text, size, Weight::SemiBold, room);
        let at = Point::new(self.plot.x - GAP, self.y(k));
        group.text(Text::centred(Anchor::End, at, (size, weight), color, text));
    }

    /// The lifetimes of a row as one shape.
    fn bars(&self, k: usize, row: &CourseRow, color: Color) -> Shape {
        let (y, half) = (self.y(k), self.sizes.bar / 2.0);
        let mut steps = Vec::new();
        for life in &row.lives {
            let left = self.x(life.start);
            let right = self.x(life.end).max(left + 0.5);
            steps.extend([
                Step::Move(Point::new(left, y - half)),
                Step::Line(Point::new(right, y - half)),
                Step::Line(Point::new(right, y + half)),
                Step::Line(Point::new(left, y + half)),
                Step::Close,
            ]);
        }
        Shape::filled(Form::Path(steps), color)
    }

    /// The events of a row: ticks for starts, crosses for ends, and discs for all other events; overlapping
    /// ones are merged.
    fn marks(&self, k: usize, row: &CourseRow) -> Vec<Group> {
        let (y, bar, pen) = (self.y(k), self.sizes.bar, 1.8 * self.unit.max(0.8));
        let mut groups: Vec<Group> = Vec::new();
        let mut last: Option<(f64, Sign, Vec<EventId>)> = None;
        for (
            at,
            CourseMark {
                at: time,
                sign,
                events,
            },
        ) in row.marks.iter().enumerate()
        {
            let x = self.x(*time);
            let shape = match sign {
                Sign::Start => Shape::line(
                    line(Point::new(x, y - bar * 0.75), Point::new(x, y + bar * 0.75)),
                    Stroke::solid(self.style.added.color, pen),
                ),
                Sign::End => {
                    let r = bar * 0.55;
                    let at = |dx: f64, dy: f64| Point::new(x + dx * r, y + dy * r);
                    let both = Form::Path(vec![
                        Step::Move(at(-1.0, -1.0)),
                        Step::Line(at(1.0, 1.0)),
                        Step::Move(at(-1.0, 1.0)),
                        Step::Line(at(1.0, -1.0)),
                    ]);
                    Shape::line(both, Stroke::solid(self.style.removed.color, pen))
                }
                Sign::Dot => {
                    let near = |(other, sign, _): &(f64, Sign, Vec<EventId>)| {
                        *sign == Sign::Dot && (x - other).abs() < bar * 0.7
                    };
                    if let (Some((.., all)), Some(group)) =
                        (last.as_mut().filter(|l| near(l)), groups.last_mut())
                    {
                        all.extend(events);
                        group.data = event_data(all);
                        continue;
                    }
                    let round = Size::new(bar * 0.8, bar * 0.8);
                    let form = Form::Ellipse(Rect::around(Point::new(x, y), round));
                    Shape::filled(form, self.style.changed.color)
                }
            };
            let mut group = Group::named(&format!("mark-{k}-{at}"));
            "mark".clone_into(&mut group.class);
            group.data = event_data(events);
            group.shape(shape);
            groups.push(group);
            last = Some((x, *sign, events.clone()));
        }
        groups
    }

    /// The middle of a row.
    fn y(&self, row: usize) -> f64 {
        self.plot.y + (row as f64 + 0.5) * self.sizes.row
    }
}
