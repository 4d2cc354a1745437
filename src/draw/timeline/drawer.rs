//! The drawing of rows over time: names, band of phases, lifetimes, publishing bars, marks and axis, on a canvas in
//! millimetres, at three densities.

use super::Timeline;
use super::canvas::{HAIRLINE, PaperCanvas, Sizes, Type, ink};
use super::marks::{RowMark, Sign};
use super::notes::PhaseLabel;
use super::rows::{Level, Row, SendingBar};
use crate::base::geometry::{Point, Rect};
use crate::base::time::{Span, Stamp, round_length};
use crate::base::{cast, words};
use crate::draw::scene::{Form, Group, Shape, Stroke};
use crate::draw::style::{Color, Style};
use crate::mission::event_log::Interruption;

/// The height of the band of phases, and the space below it, in millimetres.
const BAND: (f64, f64) = (3.3, 0.9);
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
/// The least width of a page with a column beside the rows, in millimetres: a page of a journal (181 mm), not its column (88 mm).
const WIDE: f64 = 150.0;
/// The least share of a page that the time takes beside the types of topics: with less, the types are left out, as the page is about times.
const LEAST_TIME: f64 = 0.45;
/// The largest share of a page that the rates take, if it is more than they have at least: on a column of a journal, `10 → 5 → 10 → 5 Hz` took a
/// third, and the time a quarter.
const MOST_RATES: f64 = 0.24;
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
pub(crate) struct Axis {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) span: Span,
}

impl Axis {
    pub(crate) fn x(&self, at: Stamp) -> f64 {
        self.left + self.span.part(at) * (self.right - self.left)
    }

    /// The rectangle of a time, from `y` on, wide enough to be seen.
    pub(crate) fn rect(&self, time: Span, y: f64, height: f64) -> Rect {
        let left = self.x(time.start);
        Rect::new(left, y, (self.x(time.end) - left).max(0.25), height)
    }

    /// Draws the axis at `y` with round times below, and its end; returns the y at which it ends below. `unit` is
    /// whether the form of the times is written before them.
    fn draw(&self, canvas: &mut PaperCanvas<'_>, y: f64, unit: bool) -> f64 {
        let ruler = Stroke::solid(ink::TEXT, HAIRLINE);
        canvas.line(Point::new(self.left, y), Point::new(self.right, y), &ruler);
        let middle = y + 0.9 + canvas.cap(Type::Small) / 2.0 + 0.35;
        let (of, color) = (Type::Small, ink::QUIET);
        let total = self.span.nanos();
        if unit {
            let is_long = total >= 3_600_000_000_000;
            let unit = if is_long { "h:min:s" } else { "min:s" };
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

/// The fewest letters of a cut name by which an element is recognised.
const FEWEST_LETTERS: usize = 3;

impl PhaseLabel {
    /// Writes the best name that fits, or the beginning of the shortest; nothing if that would be a letter or two.
    fn write(&self, canvas: &mut PaperCanvas<'_>, cell: Rect, of: Type, color: Color) {
        // The text of the current phase is bold, and has the same words.
        let (bold, room) = (of.bold(), cell.w - 0.6);
        let mut names = self.names.iter();
        let name = names.find(|name| canvas.width(name, bold) <= room);
        let name = match name {
            Some(name) => name.clone(),
            None => canvas.cut(self.names.last().map_or("", |n| n), bold, room),
        };
        let letters = name.chars().filter(|c| c.is_alphabetic()).count();
        if letters >= FEWEST_LETTERS || self.names.contains(&name) {
            let at = cell.centre();
            canvas.text_middle(at.x, at.y, of, color, &name);
        }
    }
}

/// As many of `names` as fit, `a, b, +3`; the first alone if none do.
pub(crate) fn fitting(names: &[String], most: usize, fits: impl Fn(&str) -> bool) -> String {
    let text = |named: usize| {
        let text = names[..named].join(", ");
        match names.len() - named {
            0 => text,
            more => format!("{text}, +{more}"),
        }
    };
    let most = names.len().min(most);
    // All of them need no number; fewer than that are tried from one on, as there may be thousands.
    let all = Some(text(most)).filter(|text| fits(text));
    let found = all.or_else(|| (1..most).map(text).take_while(|text| fits(text)).last());
    found.unwrap_or_else(|| text(most.min(1)))
}

/// A timeline at its place on a canvas; all lengths in millimetres.
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
    /// The height of band, rows (at least one) and axis.
    pub(crate) fn height(&self, sizes: Sizes, pitch: f64) -> f64 {
        let has_band = !self.phases.is_empty();
        let band = if has_band { BAND.0 + BAND.1 } else { 0.0 };
        band + self.rows.len().max(1) as f64 * pitch + BELOW + sizes.line() + 1.2
    }
}

impl Row {
    /// The kind of text of its name, if that of usual rows is `of`, and its indentation.
    fn face(&self, of: Type) -> (Type, f64) {
        match self.level {
            Level::Title => (Type::Head, 0.0),
            Level::Outside => (of, 0.0),
            Level::Inside => (of, GAP),
        }
    }
}

impl Density {
    /// The kinds of text of names: usual, and those of rows that are in the window.
    fn names(self) -> [Type; 2] {
        match self {
            Self::Frame => [Type::Small, Type::Strong],
            Self::Page | Self::Paper => [Type::Name; 2],
        }
    }
}

impl Drawer {
    /// A timeline of this width at the top left corner of `place`.
    pub(crate) fn new(
        timeline: Timeline,
        density: Density,
        canvas: &PaperCanvas<'_>,
        place: Rect,
    ) -> Self {
        // The largest width of names, and the widths of rates and of what is beside the rows.
        let (most, mut rates, mut beside) = match density {
            Density::Frame => (place.w * 0.22, 0.0, 0.0),
            // Only band and axis, below a map.
            _ if timeline.rows.is_empty() => (0.0, 0.0, 0.0),
            Density::Page => (place.w.min(WIDE) * 0.36, 12.0, 58.0),
            Density::Paper => (place.w.min(WIDE) * 0.36, 5.1, 68.0),
        };
        if density == Density::Page {
            let width = |text: String| canvas.width(&text, Type::Small) + 1.4;
            let written = timeline.rows.iter().map(Row::rates);
            let widest = written.map(width).fold(rates, f64::max);
            rates = widest.min(rates.max(MOST_RATES * place.w));
            let types = timeline.rows.iter().map(|row| row.beside[1].join(", "));
            beside = types.map(width).fold(0.0, f64::max).min(beside);
        }
        if place.w < WIDE {
            beside = 0.0;
        }
        let one = |row: &Row| {
            let text = fitting(&row.labels, MOST_NAMES.0, |_| true);
            let (of, indent) = row.face(density.names()[1]);
            canvas.width(&text, of) + indent
        };
        let names = timeline.rows.iter().map(one).fold(0.0, f64::max) + GAP;
        let heads = ["min:s", "phase"].map(|head| canvas.width(head, Type::Small) + 1.0);
        let left = place.x + names.min(most).max(heads[0]).max(heads[1]);
        // On a page, the types of topics give way to the time.
        let time = place.right() - beside - rates - left;
        if density == Density::Page && time < LEAST_TIME * place.w {
            beside = 0.0;
        }
        let end = place.right() - beside - if beside > 0.0 { 1.8 } else { 0.0 };
        Self {
            density,
            top: place.y,
            left: place.x,
            axis: Axis {
                left,
                right: (end - rates).max(left + 0.2),
                span: timeline.span,
            },
            pitch: canvas.sizes.pitch(),
            rates: (rates > 0.0).then_some(end),
            beside: (beside > 0.0).then_some((place.right() - beside, beside)),
            timeline,
        }
    }

    /// The timeline without columns of rates and topics, its axis up to `right`.
    pub(crate) fn without_columns(mut self, right: f64) -> Self {
        self.axis.right = right;
        (self.rates, self.beside) = (None, None);
        self
    }

    /// The y at which the rows begin.
    fn begin(&self) -> f64 {
        let has_band = !self.timeline.phases.is_empty();
        let band = BAND.0 + self.gap(BAND.1);
        self.top + if has_band { band } else { 0.0 }
    }

    /// The y at which the rows end, at the axis.
    pub(crate) fn end(&self) -> f64 {
        self.begin() + self.timeline.rows.len() as f64 * self.pitch + self.gap(BELOW)
    }

    /// A space around rows; without rows the axis is the lower edge of the band.
    fn gap(&self, space: f64) -> f64 {
        let has_rows = !self.timeline.rows.is_empty();
        if has_rows { space } else { 0.0 }
    }

    /// The middle of a row.
    pub(crate) fn y(&self, row: usize) -> f64 {
        self.begin() + (row as f64 + 0.5) * self.pitch
    }

    /// The frame around a window.
    pub(crate) fn window(&self, time: Span) -> Rect {
        let top = self.begin() - 0.4;
        self.axis.rect(time, top, self.end() - top)
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
        let (phases, is_paper) = (&self.timeline.phases, self.density == Density::Paper);
        let (small, quiet) = (Type::Small, ink::QUIET);
        let (top, bottom) = (self.top + BAND.0, self.end());
        for (k, phase) in phases.iter().enumerate() {
            let column = self.axis.rect(phase.span, top, bottom - top);
            if k % 2 == 0 {
                canvas.fill(column, ink::TINT);
            }
            if k > 0 {
                let dashed = Stroke::dashed(ink::RULE, HAIRLINE, &[0.7, 0.6]);
                let [from, to] = [top, bottom].map(|y| Point::new(column.x, y));
                canvas.line(from, to, &dashed);
            }
        }
        let interruptions = self.timeline.interruptions.iter();
        for hole in interruptions.filter_map(Interruption::hole) {
            canvas.hatch(self.axis.rect(hole, top, bottom - top));
        }
        for (k, phase) in phases.iter().enumerate() {
            let cell = self.axis.rect(phase.span, self.top, BAND.0);
            canvas.fill(cell, ink::BAND[k % 2]);
            let of = if is_paper { Type::Head } else { small };
            phase.write(canvas, cell, of, ink::TEXT);
        }
        let mut head = self.top + BAND.0 / 2.0;
        if !phases.is_empty() && self.density != Density::Frame {
            canvas.text_end(self.axis.left - 0.9, head, small, quiet, "phase");
        }
        if phases.is_empty() {
            // In the row of the first namespace, or above it.
            head = self.top - canvas.sizes.line() / 2.0;
        }
        if let Some(right) = self.rates.filter(|_| is_paper) {
            canvas.text_end(right, head, small, quiet, "Hz");
        }
        let mut rows = self.timeline.rows.iter();
        let is_of_nodes = rows.any(|row| !row.beside[0].is_empty());
        if let Some((x, _)) = self.beside.filter(|_| is_of_nodes) {
            let text = "→ publishes  ← subscribes, as far as known";
            canvas.text(x, head, small, quiet, text);
        }
    }

    fn row(&self, canvas: &mut PaperCanvas<'_>, y: f64, row: &Row) {
        let (is_folded, is_paper) = (!row.folded.is_empty(), self.density == Density::Paper);
        if row.level == Level::Title || is_folded || is_paper {
            let color = if is_folded { ink::QUIET } else { ink::TEXT };
            self.name(canvas, y, row, self.density.names()[0], color);
        }
        if row.level == Level::Title {
            return;
        }
        let (mut lives, mut stroke) = (&row.lives[..], Stroke::solid(ink::LINE, 0.28));
        if row.is_inferred {
            stroke.dash = vec![0.55, 0.5];
        }
        let guide = [self.axis.span];
        if self.density == Density::Frame {
            (lives, stroke) = (&guide, Stroke::solid(ink::BAND[0], HAIRLINE));
        }
        for life in lives.iter().filter(|_| !is_folded) {
            let [from, to] = [life.start, life.end].map(|at| Point::new(self.axis.x(at), y));
            canvas.line(from, to, &stroke);
        }
        let is_dark = is_paper && !is_folded;
        let color = if is_dark { ink::BAR } else { ink::FOLDED };
        for bar in &row.bars {
            self.bar(canvas, y, bar, color);
        }
        if is_paper {
            let rate = row.hz.map_or("–".to_owned(), number);
            self.rate(canvas, y, &rate, ink::QUIET);
        }
        if let Some((x, width)) = self.beside {
            beside(canvas, row, Point::new(x, y), width);
        }
    }

    /// Draws the name of a row.
    fn name(&self, canvas: &mut PaperCanvas<'_>, y: f64, row: &Row, of: Type, color: Color) {
        // In the widest kind, so that the words are the same in every window.
        let (widest, indent) = row.face(self.density.names()[1]);
        let room = self.axis.left - self.left - GAP - indent + 0.01;
        let fits = |label: &str| canvas.width(label, widest) <= room;
        let label = fitting(&row.labels, MOST_NAMES.0, fits);
        let label = canvas.cut(&label, widest, room);
        canvas.text(self.left + indent, y, row.face(of).0, color, &label);
    }

    /// Writes a rate in its column: of more than two that have no room, the first and the last.
    pub(crate) fn rate(&self, canvas: &mut PaperCanvas<'_>, y: f64, text: &str, color: Color) {
        let Some(right) = self.rates else {
            return;
        };
        let fits = canvas.width(text, Type::Small) <= right - self.axis.right;
        let rates: Vec<&str> = text.split(" → ").collect();
        let ends = match rates[..] {
            [first, _, .., last] if !fits => format!("{first} … {last}"),
            _ => text.to_owned(),
        };
        canvas.text_end(right, y, Type::Small, color, &ends);
    }

    fn bar(&self, canvas: &mut PaperCanvas<'_>, y: f64, bar: &SendingBar, color: Color) {
        let high = (BAR.0 + (BAR.1 - BAR.0) * bar.share) * self.pitch;
        canvas.fill(self.axis.rect(bar.span, y - high / 2.0, high), color);
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
            let of = self.density.names()[usize::from(is_now)];
            self.name(canvas, y, row, of, color);
        }
        let shared = |phase: &&PhaseLabel| {
            let end = phase.span.end.min(time.end);
            end.since(phase.span.start.max(time.start))
        };
        let phase = self.timeline.phases.iter().max_by_key(shared);
        if let Some(phase) = phase.filter(|_| time.nanos() < self.axis.span.nanos()) {
            let cell = self.axis.rect(phase.span, self.top, BAND.0);
            canvas.fill(cell, ink::TEXT);
            phase.write(canvas, cell, Type::Strong, ink::PAPER);
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
        let of = |sign: Sign| all.iter().filter(move |(_, mark)| mark.sign == sign);
        let at = |row: usize, mark: &RowMark| Point::new(self.axis.x(mark.at), self.y(row));
        for &(row, mark) in [Sign::Start, Sign::End, Sign::Dot].into_iter().flat_map(of) {
            self.begin_mark(canvas, mark);
            let is_small = self.density == Density::Frame;
            let size = if is_small { 1.3 } else { 1.0 };
            put(canvas, mark.sign, at(row, mark), size);
        }
        // The places that the next arrows and letters avoid.
        let mut taken: Vec<Rect> = Vec::new();
        let mut named = Vec::new();
        for &(to, mark) in of(Sign::Handover) {
            if let Some(from) = self.timeline.giver(mark).filter(|from| *from != to) {
                self.begin_mark(canvas, mark);
                let (from_y, tip) = (self.y(from), at(to, mark));
                let x = arrow(canvas, from_y, tip, &mut taken);
                let pair = (from.min(to), from.max(to), &mark.text);
                if !named.contains(&pair) {
                    named.push(pair);
                    let y = from_y + (tip.y - from_y) * 0.66;
                    self.topic(canvas, Point::new(x, y), &mark.text, &mut taken);
                }
            }
        }
        let ends = of(Sign::End).map(|(row, mark)| at(*row, mark));
        taken.extend(ends.map(|at| Rect::new(at.x, at.y, 0.0, 0.0)));
        for (k, &(row, mark)) in of(Sign::Letter).enumerate() {
            self.begin_mark(canvas, mark);
            self.letter(canvas, at(row, mark), &letter(k), &mut taken);
        }
    }

    fn begin_mark(&self, canvas: &mut PaperCanvas<'_>, mark: &RowMark) {
        let class = match self.density {
            Density::Paper => mark.sign.word(),
            Density::Frame | Density::Page => "mark",
        };
        canvas.begin_mark(class, &mark.events, mark.title.clone());
    }

    /// Writes the topic of an arrow between two rows, so that it covers none of their marks.
    fn topic(&self, canvas: &mut PaperCanvas<'_>, at: Point, topic: &str, taken: &mut Vec<Rect>) {
        let text = canvas.cut(topic, Type::Small, self.axis.right - self.axis.left);
        let wide = canvas.width(&text, Type::Small);
        let x = (at.x + 0.6).min(self.axis.right - wide) + wide / 2.0;
        let y = self.begin() + libm::round((at.y - self.begin()) / self.pitch) * self.pitch;
        canvas.label(x, y, Type::Small, ink::CHANGED, &text);
        taken.push(Rect::new(x, y - 1.2, 0.0, 2.4));
    }

    /// Draws a circled letter at the nearest free place beside a moment.
    fn letter(&self, canvas: &mut PaperCanvas<'_>, at: Point, text: &str, taken: &mut Vec<Rect>) {
        let radius = LETTER * self.pitch;
        let is_free = |x: &f64| {
            let is_near =
                |t: &Rect| (t.x - x).abs() < APART && t.y - 1.0 < at.y && at.y < t.bottom() + 1.0;
            *x > self.axis.left && *x < self.axis.right - radius && !taken.iter().any(is_near)
        };
        let far = (0..100).map(|step| radius + f64::from(step) * 0.25);
        let x = far.flat_map(|far| [at.x + far, at.x - far]).find(is_free);
        let at = Point::new(x.unwrap_or(at.x), at.y);
        taken.push(Rect::new(at.x, at.y, 0.0, 0.0));
        canvas.disc(at, radius, ink::PAPER, &Stroke::solid(ink::CHANGED, 0.25));
        canvas.text_middle(at.x, at.y, Type::Strong, ink::CHANGED, text);
    }
}

/// Draws the arrow of a topic that is taken over, beside others; returns its x.
fn arrow(canvas: &mut PaperCanvas<'_>, from: f64, to: Point, taken: &mut Vec<Rect>) -> f64 {
    let mut place = Rect::new(to.x, from.min(to.y), 0.0, (to.y - from).abs());
    let is_taken = |place: &Rect, other: &Rect| {
        let is_beside = place.y < other.bottom() && other.y < place.bottom();
        is_beside && (other.x - place.x).abs() < 1.0
    };
    while taken.iter().any(|other| is_taken(&place, other)) {
        place.x += 1.0;
    }
    let (x, side) = (place.x, if to.y > from { -1.0 } else { 1.0 });
    let start = Point::new(x, from);
    let stroke = Stroke::solid(ink::CHANGED, 0.3);
    canvas.line(start, Point::new(x, to.y + side), &stroke);
    canvas.disc(start, 0.55, ink::CHANGED, &Stroke::default());
    canvas.head(start, Point::new(x, to.y + side * 0.15), 1.3, ink::CHANGED);
    taken.push(place);
    x
}

/// Draws a tick, a cross or a small circle; `size` is 1 on paper.
pub(crate) fn put(canvas: &mut PaperCanvas<'_>, sign: Sign, at: Point, size: f64) {
    let (Point { x, y }, r) = (at, size * 0.5);
    match sign {
        Sign::Start => {
            let high = TICK * canvas.sizes.pitch();
            canvas.fill(Rect::new(x - 0.2, y - high / 2.0, 0.4, high), ink::ADDED);
        }
        Sign::End => {
            let stroke = Stroke::solid(ink::REMOVED, 0.38);
            for down in [-1.35 * r, 1.35 * r] {
                let (from, to) = (Point::new(x - r, y - down), Point::new(x + r, y + down));
                canvas.line(from, to, &stroke);
            }
        }
        _ => canvas.disc(at, r, ink::PAPER, &Stroke::solid(ink::CHANGED, 0.25)),
    }
}

/// The letter of an event: a, b, c, …
pub(crate) fn letter(k: usize) -> String {
    ('a'..='z').nth(k).into_iter().collect()
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
    // Something quiet gets a third at least.
    let most = if quiet.is_empty() { room } else { room * 0.66 };
    for (names, color, most) in [(dark, ink::TEXT, most), (quiet, ink::QUIET, room)] {
        let most = most.min(room);
        let fits = |text: &str| canvas.width(text, Type::Small) <= most;
        let text = canvas.cut(&fitting(names, MOST_NAMES.1, fits), Type::Small, most);
        canvas.text(at.x, at.y, Type::Small, color, &text);
        let wide = canvas.width(&text, Type::Small) + if text.is_empty() { 0.0 } else { 1.4 };
        (at.x, room) = (at.x + wide, (room - wide).max(0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn names_that_do_not_fit_are_counted_without_trying_each_of_thousands() {
        let names: Vec<String> = (0..5000).map(|n| format!("/n{n}")).collect();
        let tries = Cell::new(0);
        let fits = |text: &str| {
            tries.set(tries.get() + 1);
            text.len() <= 20
        };
        assert_eq!(fitting(&names, 5000, fits), "/n0, /n1, /n2, +4997");
        assert!(tries.get() < 10, "{tries:?}");
        assert_eq!(
            fitting(&names[..3], 3, |text| text.len() <= 13),
            "/n0, /n1, /n2"
        );
        assert_eq!(fitting(&names[..3], 3, |_| false), "/n0, +2");
    }
}
