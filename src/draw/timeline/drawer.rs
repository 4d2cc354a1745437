//! The drawing of rows over time: names, band of phases, lifetimes, publishing bars, marks and axis, on a canvas in
//! millimetres, at three densities.

use super::Timeline;
use super::canvas::{HAIRLINE, PaperCanvas, Sizes, Type, ink};
use super::marks::{RowMark, Sign};
use super::phases::PhaseLabel;
use super::rows::{Level, Row, SendingBar};
use crate::base::cast;
use crate::base::geometry::{Point, Rect};
use crate::base::time::{Span, Stamp, round_length};
use crate::base::words;
use crate::draw::scene::{Form, Group, Shape, Stroke};
use crate::draw::style::{Color, Style};

/// The height of the band of phases, and the space below it, in millimetres.
pub(crate) const BAND: (f64, f64) = (3.3, 0.9);
/// The space between the rows and the axis, in millimetres.
const BELOW: f64 = 0.4;
/// The space between the names and the rows, and the indentation of rows below a title, in millimetres.
const GAP: f64 = 1.2;
/// The heights of bars without and with the highest rate, and of a tick, as fractions of the pitch of rows: 0.45, 2.05
/// and 2.24 mm of 2.75 mm.
const BAR: (f64, f64) = (0.45 / 2.75, 2.05 / 2.75);
const TICK: f64 = 2.24 / 2.75;
/// The radius of a letter's circle as a fraction of the pitch, and the least distance of letters and arrows in
/// millimetres.
const LETTER: f64 = 1.08 / 2.75;
const APART: f64 = 2.3;
/// The most names that are written for a row, and beside it.
const MOST_NAMES: (usize, usize) = (3, 12);

/// The space for a timeline, which determines what is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Density {
    /// Below the graph of a frame, as small as text can be: bars of all rows that exist in the window are dark.
    Frame,
    /// On a page of its own: bars up to the window are dark.
    Page,
    /// On paper, without a window: all bars are dark, and events have letters and arrows.
    Paper,
}

/// The time axis: a line from `left` to `right`, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) span: Span,
}

impl Axis {
    pub(crate) fn x(&self, at: Stamp) -> f64 {
        let whole = self.span.nanos().max(1) as f64;
        let part = (at.since(self.span.start) as f64 / whole).clamp(0.0, 1.0);
        self.left + part * (self.right - self.left)
    }

    /// Draws the axis at `y` with round times below, and its end; returns the y at which it ends below. `unit` is
    /// whether the form of the times is written before them.
    pub(crate) fn draw(&self, canvas: &mut PaperCanvas<'_>, y: f64, unit: bool) -> f64 {
        let ruler = Stroke::solid(ink::TEXT, HAIRLINE);
        canvas.line(Point::new(self.left, y), Point::new(self.right, y), &ruler);
        let middle = y + 0.9 + canvas.cap(Type::Small) / 2.0 + 0.35;
        let (of, color) = (Type::Small, ink::QUIET);
        let total = self.span.nanos();
        if unit {
            let hours = total >= 3_600_000_000_000;
            let unit = if hours { "h:min:s" } else { "min:s" };
            canvas.text_end(self.left - 0.9, middle, of, color, unit);
        }
        let last = words::moment_rounded(total);
        let wide = canvas.width(&last, Type::Small);
        // Space for a text and a half per tick; more than twelve are not read.
        let most = ((self.right - self.left) / (wide + 3.5)).clamp(1.0, 12.0);
        let step = round_length(total / cast::to_i64(most).max(1)).max(1);
        // Multiplied instead of added repeatedly: a span may be as long as the largest number.
        for at in (0..=total / step).map(|tick| tick * step) {
            let x = self.x(self.span.start.plus(at));
            canvas.line(Point::new(x, y), Point::new(x, y + 0.8), &ruler);
            let moment = words::moment(at);
            let half = canvas.width(&moment, Type::Small) / 2.0;
            let x = x.max(self.left + half);
            if x + half < self.right - wide * 1.4 {
                canvas.text_middle(x, middle, of, color, &moment);
            }
        }
        canvas.text_end(self.right, middle, of, color, &last);
        middle + canvas.cap(Type::Small) / 2.0 + 0.7
    }
}

/// A moment in the words of figures, to the nearest second: `4:56`, `1:02:03`.
pub(crate) fn clock(nanos: i64) -> String {
    let second = nanos.saturating_add(500_000_000) / 1_000_000_000;
    words::moment(second * 1_000_000_000)
}

/// Draws the band from `y` down; phases of an odd number are darker, ramps are hatched.
pub(crate) fn band(
    canvas: &mut PaperCanvas<'_>,
    axis: &Axis,
    y: f64,
    phases: &[PhaseLabel],
    of: Type,
) {
    for (k, phase) in phases.iter().enumerate() {
        phase_cell(canvas, axis, y, phase, (ink::BAND[k % 2], of, ink::TEXT));
    }
}

fn phase_cell(
    canvas: &mut PaperCanvas<'_>,
    axis: &Axis,
    y: f64,
    phase: &PhaseLabel,
    (fill, of, color): (Color, Type, Color),
) {
    let (left, right) = (axis.x(phase.span.start), axis.x(phase.span.end));
    let cell = Rect::new(left, y, right - left, BAND.0);
    canvas.fill(cell, fill);
    if phase.is_ramp {
        hatch(canvas, cell);
    }
    // The text of the current phase is bold, and has the same words.
    let wide = |canvas: &PaperCanvas<'_>, name: &str| canvas.width(name, of.bold());
    let room = cell.w - 0.6;
    let name = phase.names.iter().find(|name| wide(canvas, name) <= room);
    let is_number = |name: &String| name.chars().all(|c| c.is_ascii_digit());
    // Truncated words are more informative than a number, if enough of them remain.
    let name = match name.filter(|name| room < 9.0 || !is_number(name)) {
        Some(name) => name.clone(),
        None => canvas.cut(phase.names.first().map_or("", |n| n), of.bold(), room),
    };
    let middle = cell.centre();
    canvas.text_middle(middle.x, middle.y, of, color, &name);
}

fn hatch(canvas: &mut PaperCanvas<'_>, rect: Rect) {
    let stroke = Stroke::solid(ink::RULE, HAIRLINE);
    let mut x = rect.x + 1.0;
    while x < rect.right() {
        let top = Point::new((x + rect.h * 0.5).min(rect.right()), rect.y);
        canvas.line(Point::new(x, rect.bottom()), top, &stroke);
        x += 1.4;
    }
}

/// As many of `names` as fit, `a, b, +3`; the first alone if none do.
fn fitting(names: &[String], most: usize, fits: impl Fn(&str) -> bool) -> String {
    let text = |named: usize| {
        let text = names[..named].join(", ");
        match names.len() - named {
            0 => text,
            more => format!("{text}, +{more}"),
        }
    };
    let most = names.len().min(most);
    let found = (1..=most).rev().map(text).find(|text| fits(text));
    found.unwrap_or_else(|| text(most.min(1)))
}

/// A timeline at its place on a canvas; all lengths in millimetres.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Drawer {
    pub(crate) timeline: Timeline,
    pub(crate) density: Density,
    /// The top of the band.
    pub(crate) top: f64,
    /// The left end of the names.
    pub(crate) left: f64,
    pub(crate) axis: Axis,
    /// The distance from row to row.
    pub(crate) pitch: f64,
    /// The right end of the column of rates, if there is one.
    pub(crate) rates: Option<f64>,
    /// The left end and the width of the column beside the rows, if it fits.
    pub(crate) beside: Option<(f64, f64)>,
}

impl Timeline {
    /// The height of band, rows and axis.
    pub(crate) fn height(&self, sizes: Sizes, pitch: f64) -> f64 {
        let rows = self.rows.len() as f64 * pitch;
        self.band() + rows + BELOW + sizes.line() + 1.2
    }

    /// The height of the band with the space below it; 0 without phases.
    pub(crate) fn band(&self) -> f64 {
        let has_band = !self.phases.is_empty();
        if has_band { BAND.0 + BAND.1 } else { 0.0 }
    }

    /// The width of the column of names in text of this kind: that of the widest, at most `most`.
    pub(crate) fn names_width(&self, canvas: &PaperCanvas<'_>, of: Type, most: f64) -> f64 {
        let one = |row: &Row| {
            let of = if row.level == Level::Title {
                Type::Head
            } else {
                of
            };
            let text = fitting(&row.labels, MOST_NAMES.0, |_| true);
            canvas.width(&text, of) + indent(row)
        };
        let widest = self.rows.iter().map(one).fold(0.0, f64::max);
        (widest + GAP).min(most)
    }
}

fn indent(row: &Row) -> f64 {
    if row.level == Level::Inside { GAP } else { 0.0 }
}

impl Drawer {
    /// The kinds of text of names: usual, and those of rows that are in the window.
    fn names(&self) -> [Type; 2] {
        match self.density {
            Density::Frame => [Type::Small, Type::Strong],
            Density::Page | Density::Paper => [Type::Name; 2],
        }
    }

    /// The y at which the rows begin.
    pub(crate) fn begin(&self) -> f64 {
        self.top + self.timeline.band()
    }

    /// The y at which the rows end, at the axis.
    pub(crate) fn end(&self) -> f64 {
        self.begin() + self.timeline.rows.len() as f64 * self.pitch + BELOW
    }

    /// The middle of a row.
    pub(crate) fn y(&self, row: usize) -> f64 {
        self.begin() + (row as f64 + 0.5) * self.pitch
    }

    /// The frame around a window.
    pub(crate) fn window(&self, time: Span) -> Rect {
        let (left, right) = (self.axis.x(time.start), self.axis.x(time.end));
        let top = self.begin() - 0.4;
        Rect::new(left, top, (right - left).max(0.3), self.end() - top)
    }

    /// Draws what is the same in every window: band, bars and axis; returns the y at which the axis ends below.
    pub(crate) fn ground(&self, canvas: &mut PaperCanvas<'_>) -> f64 {
        canvas.begin("phases");
        self.columns(canvas);
        canvas.begin("rows");
        for (k, row) in self.timeline.rows.iter().enumerate() {
            self.row(canvas, self.y(k), row);
        }
        canvas.begin("axis");
        let has_unit = self.density != Density::Frame;
        self.axis.draw(canvas, self.end(), has_unit)
    }

    /// The band, its columns behind the rows, and the heads of the other columns.
    fn columns(&self, canvas: &mut PaperCanvas<'_>) {
        let (phases, bottom) = (&self.timeline.phases, self.end());
        let (small, quiet) = (Type::Small, ink::QUIET);
        let middle = self.top + BAND.0 / 2.0;
        let top = self.top + BAND.0;
        for (k, phase) in phases.iter().enumerate() {
            let (left, right) = (self.axis.x(phase.span.start), self.axis.x(phase.span.end));
            if k % 2 == 0 {
                canvas.fill(Rect::new(left, top, right - left, bottom - top), ink::TINT);
            }
        }
        for phase in phases.iter().skip(1) {
            let x = self.axis.x(phase.span.start);
            let dashed = Stroke::dashed(ink::RULE, HAIRLINE, &[0.7, 0.6]);
            canvas.line(Point::new(x, top), Point::new(x, bottom), &dashed);
        }
        let of = if self.density == Density::Paper {
            Type::Head
        } else {
            Type::Small
        };
        band(canvas, &self.axis, self.top, phases, of);
        if !phases.is_empty() && self.density != Density::Frame {
            canvas.text_end(self.axis.left - 0.9, middle, small, quiet, "phase");
        }
        if self.density != Density::Paper {
            return;
        }
        // Without a band the heads are in the row of the first namespace, or above it.
        let head = if phases.is_empty() {
            self.top - canvas.sizes.line() / 2.0
        } else {
            middle
        };
        if let Some(right) = self.rates {
            canvas.text_end(right, head, small, quiet, "Hz");
        }
        let is_of_nodes = self.timeline.rows.iter().all(|row| row.topic.is_none());
        if let Some((x, _)) = self.beside.filter(|_| is_of_nodes) {
            let text = "→ publishes  ← subscribes, as far as known";
            canvas.text(x, head, small, quiet, text);
        }
    }

    fn row(&self, canvas: &mut PaperCanvas<'_>, y: f64, row: &Row) {
        let is_folded = !row.folded.is_empty();
        if row.level == Level::Title || is_folded || self.density == Density::Paper {
            let color = if is_folded { ink::QUIET } else { ink::TEXT };
            self.name(canvas, y, row, (self.names()[0], color));
        }
        if row.level == Level::Title {
            return;
        }
        if self.density == Density::Frame {
            let guide = Stroke::solid(ink::BAND[0], HAIRLINE);
            let (left, right) = (self.axis.left, self.axis.right);
            canvas.line(Point::new(left, y), Point::new(right, y), &guide);
        } else if !is_folded {
            let dash: &[f64] = if row.is_inferred { &[0.55, 0.5] } else { &[] };
            let stroke = Stroke::dashed(ink::LINE, 0.28, dash);
            for life in &row.lives {
                let [from, to] = [life.start, life.end].map(|at| Point::new(self.axis.x(at), y));
                canvas.line(from, to, &stroke);
            }
        }
        let is_dark = self.density == Density::Paper && !is_folded;
        let color = if is_dark { ink::BAR } else { ink::FOLDED };
        for bar in &row.bars {
            self.bar(canvas, y, bar, color);
        }
        if self.density == Density::Paper {
            self.rate(
                canvas,
                y,
                &row.hz.map_or("–".to_owned(), number),
                ink::QUIET,
            );
        }
        if let Some((x, width)) = self.beside {
            beside(canvas, row, Point::new(x, y), width);
        }
    }

    /// Draws the name of a row.
    fn name(&self, canvas: &mut PaperCanvas<'_>, y: f64, row: &Row, (of, color): (Type, Color)) {
        let of = if row.level == Level::Title {
            Type::Head
        } else {
            of
        };
        let room = self.axis.left - self.left - GAP - indent(row);
        // In the widest kind, so that the words are the same in every window.
        let widest = if row.level == Level::Title {
            of
        } else {
            self.names()[1]
        };
        let fits = |label: &str| canvas.width(label, widest) <= room + 0.01;
        let label = fitting(&row.labels, MOST_NAMES.0, fits);
        let label = canvas.cut(&label, widest, room + 0.01);
        canvas.text(self.left + indent(row), y, of, color, &label);
    }

    /// Draws a text in the column of rates.
    pub(crate) fn rate(&self, canvas: &mut PaperCanvas<'_>, y: f64, text: &str, color: Color) {
        if let Some(right) = self.rates {
            canvas.text_end(right, y, Type::Small, color, text);
        }
    }

    fn bar(&self, canvas: &mut PaperCanvas<'_>, y: f64, bar: &SendingBar, color: Color) {
        let high = (BAR.0 + (BAR.1 - BAR.0) * bar.share) * self.pitch;
        let (from, to) = (self.axis.x(bar.span.start), self.axis.x(bar.span.end));
        let wide = (to - from).max(0.25);
        canvas.fill(Rect::new(from, y - high / 2.0, wide, high), color);
    }

    /// Draws what a window adds to the ground: dark bars, the current phase, and the names, those for which `is_now`
    /// is true emphasized.
    pub(crate) fn now(
        &self,
        canvas: &mut PaperCanvas<'_>,
        time: Span,
        is_now: &dyn Fn(&Row) -> bool,
    ) {
        canvas.begin("past");
        for (k, row) in self.timeline.rows.iter().enumerate() {
            if !row.folded.is_empty() || row.level == Level::Title {
                continue;
            }
            let (y, is_now) = (self.y(k), is_now(row));
            // The bars of a row in a frame are its lifetimes, unless it counts all messages.
            let until = match self.density {
                Density::Frame if is_now && !row.lives.is_empty() => Stamp::MAX,
                Density::Frame if !row.lives.is_empty() => Stamp::MIN,
                _ => time.end,
            };
            for bar in row.bars.iter().filter(|bar| bar.span.start < until) {
                let mut bar = *bar;
                bar.span.end = bar.span.end.min(until);
                self.bar(canvas, y, &bar, ink::BAR);
            }
            let color = if is_now { ink::TEXT } else { ink::QUIET };
            let text = (self.names()[usize::from(is_now)], color);
            self.name(canvas, y, row, text);
        }
        let shared = |phase: &&PhaseLabel| {
            let (from, to) = (
                phase.span.start.max(time.start),
                phase.span.end.min(time.end),
            );
            to.since(from)
        };
        if let Some(phase) = self.timeline.phases.iter().max_by_key(shared) {
            let looks = (ink::TEXT, Type::Strong, ink::PAPER);
            phase_cell(canvas, &self.axis, self.top, phase, looks);
        }
    }

    /// The frame around a window, on a canvas with `scale` pixels per millimetre.
    pub(crate) fn playhead(&self, time: Span, scale: f64, style: &Style) -> Group {
        let place = self.window(time).scaled(scale);
        let form = Form::Rect(place, (0.4 * scale).min(place.w / 2.0));
        let stroke = Stroke::solid(style.timeline.head, 0.32 * scale);
        let mut group = Group::named("playhead");
        group.shape(Shape::line(form, stroke));
        group
    }

    /// Draws the marks: ticks, crosses and small circles, then arrows, then letters beside them.
    pub(crate) fn marks(&self, canvas: &mut PaperCanvas<'_>) {
        let all = self.timeline.marks();
        let mut taken: Vec<TakenPlace> = Vec::new();
        let of = |sign: Sign| all.iter().filter(move |(_, mark)| mark.sign == sign);
        for sign in [Sign::Start, Sign::End, Sign::Dot] {
            for &(row, mark) in of(sign) {
                let at = Point::new(self.axis.x(mark.at), self.y(row));
                self.begin_mark(canvas, mark);
                put(canvas, sign, at, self.pitch);
                if sign == Sign::End {
                    taken.push(TakenPlace::at(at));
                }
            }
        }
        let mut named: Vec<([usize; 2], &str)> = Vec::new();
        for &(to, mark) in of(Sign::Handover) {
            if let Some(from) = self.timeline.giver(mark).filter(|from| *from != to) {
                let pair = ([from.min(to), from.max(to)], mark.text.as_str());
                let is_named = named.contains(&pair);
                named.push(pair);
                self.arrow(canvas, (from, to), mark, is_named, &mut taken);
            }
        }
        for (k, &(row, mark)) in of(Sign::Letter).enumerate() {
            self.begin_mark(canvas, mark);
            let at = Point::new(self.axis.x(mark.at), self.y(row));
            self.letter(canvas, at, &letter(k), &mut taken);
        }
    }

    fn begin_mark(&self, canvas: &mut PaperCanvas<'_>, mark: &RowMark) {
        let class = match mark.sign {
            Sign::Start => "start",
            Sign::End => "end",
            Sign::Dot => "event",
            Sign::Letter => "letter",
            Sign::Handover => "handover",
        };
        canvas.begin_mark(class, &mark.events, mark.title.clone());
    }

    /// Draws the arrow of a topic that is taken over, with the topic unless it `is_named` already.
    fn arrow(
        &self,
        canvas: &mut PaperCanvas<'_>,
        (from, to): (usize, usize),
        mark: &RowMark,
        is_named: bool,
        taken: &mut Vec<TakenPlace>,
    ) {
        let (from, to) = (self.y(from), self.y(to));
        let (low, high) = (from.min(to), from.max(to));
        let mut x = self.axis.x(mark.at);
        let is_free = |x: f64| {
            !taken
                .iter()
                .any(|t| (t.x - x).abs() < 1.0 && low < t.low && t.high < high)
        };
        while !is_free(x) {
            x += 1.0;
        }
        self.begin_mark(canvas, mark);
        let stroke = Stroke::solid(ink::CHANGED, 0.3);
        let side = if to > from { -1.0 } else { 1.0 };
        let tip = Point::new(x, to + side * 0.15);
        canvas.line(Point::new(x, from), Point::new(x, to + side), &stroke);
        canvas.disc(Point::new(x, from), 0.55, ink::CHANGED, &Stroke::default());
        canvas.head(Point::new(x, from), tip, 1.3, ink::CHANGED);
        taken.push(TakenPlace { x, low, high });
        if is_named {
            return;
        }
        let text = canvas.cut(&mark.text, Type::Small, self.axis.right - self.axis.left);
        let wide = canvas.width(&text, Type::Small);
        let x = (x + 0.6).min(self.axis.right - wide) + wide / 2.0;
        // Between two rows, so that it covers none of their marks.
        let rows = libm::round((from + (to - from) * 0.66 - self.begin()) / self.pitch);
        let y = self.begin() + rows * self.pitch;
        canvas.label(x, y, Type::Small, ink::CHANGED, &text);
        let (low, high) = (y - 1.2, y + 1.2);
        taken.push(TakenPlace { x, low, high });
    }

    /// Draws a circled letter beside a moment, at the nearest free place to the right or to the left.
    fn letter(
        &self,
        canvas: &mut PaperCanvas<'_>,
        at: Point,
        text: &str,
        taken: &mut Vec<TakenPlace>,
    ) {
        let radius = LETTER * self.pitch;
        let near = |x: f64, taken: &[TakenPlace]| {
            let hit = |t: &&TakenPlace| {
                (t.x - x).abs() < APART && t.low - 1.0 < at.y && at.y < t.high + 1.0
            };
            taken.iter().find(hit).map(|t| t.x)
        };
        let free = |mut x: f64, step: f64| {
            for _ in 0..12 {
                let Some(other) = near(x, taken) else { break };
                x = other + step;
            }
            x
        };
        let (right, left) = (free(at.x + radius, APART), free(at.x - radius, -APART));
        let is_left = left > self.axis.left && at.x - left < right - at.x;
        let is_left = is_left || right > self.axis.right - radius;
        let at = Point::new(if is_left { left } else { right }, at.y);
        taken.push(TakenPlace::at(at));
        canvas.disc(at, radius, ink::PAPER, &Stroke::solid(ink::CHANGED, 0.25));
        canvas.text_middle(at.x, at.y, Type::Strong, ink::CHANGED, text);
    }
}

/// A place that letters and arrows avoid.
struct TakenPlace {
    x: f64,
    low: f64,
    high: f64,
}

impl TakenPlace {
    fn at(at: Point) -> Self {
        Self {
            x: at.x,
            low: at.y,
            high: at.y,
        }
    }
}

/// Draws a tick, a cross or a small circle.
pub(crate) fn put(canvas: &mut PaperCanvas<'_>, sign: Sign, at: Point, pitch: f64) {
    let Point { x, y } = at;
    match sign {
        Sign::Start => {
            let high = TICK * pitch;
            canvas.fill(Rect::new(x - 0.2, y - high / 2.0, 0.4, high), ink::ADDED);
        }
        Sign::End => {
            let stroke = Stroke::solid(ink::REMOVED, 0.38);
            for down in [-0.675, 0.675] {
                canvas.line(
                    Point::new(x - 0.5, y - down),
                    Point::new(x + 0.5, y + down),
                    &stroke,
                );
            }
        }
        _ => canvas.disc(at, 0.5, ink::PAPER, &Stroke::solid(ink::CHANGED, 0.25)),
    }
}

/// The letter of an event: a, b, c, …
pub(crate) fn letter(k: usize) -> String {
    let letter = ('a'..='z').nth(k);
    letter.map_or_else(String::new, String::from)
}

/// A rate without its unit: two digits from 1 Hz on, one below; more are neither known nor needed. Four digits are wider
/// than the column.
fn number(hz: f64) -> String {
    match words::significant(hz, if hz < 0.95 { 1 } else { 2 }) {
        kilo if kilo >= 1000.0 => format!("{}k", words::number(kilo / 1000.0)),
        hz => words::number(hz),
    }
}

/// Draws as many of the names beside a row as fit, first the dark ones.
fn beside(canvas: &mut PaperCanvas<'_>, row: &Row, mut at: Point, mut room: f64) {
    let [dark, quiet] = &row.beside;
    let one = |names: &[String]| canvas.width(&fitting(names, 1, |_| true), Type::Small);
    let least = if quiet.is_empty() {
        0.0
    } else {
        one(quiet) + 1.4
    };
    for (names, color, least) in [(dark, ink::TEXT, least), (quiet, ink::QUIET, 0.0)] {
        let fits = |text: &str| canvas.width(text, Type::Small) <= room - least;
        let text = canvas.cut(&fitting(names, MOST_NAMES.1, fits), Type::Small, room);
        canvas.text(at.x, at.y, Type::Small, color, &text);
        let wide = canvas.width(&text, Type::Small) + if text.is_empty() { 0.0 } else { 1.4 };
        (at.x, room) = (at.x + wide, (room - wide).max(0.0));
    }
}
