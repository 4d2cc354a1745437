//! Lifelines: a row per node (or topic), time to the right; when it exists, its rate, and its changes.
//!
//! One drawing at three sizes: a figure on paper ([`crate::draw::figure`]), and, for a caller that has a page
//! already, only the rows. `Lives::new(&source, by_topics)` reads the mission, `lives.height(&canvas)` gives
//! the height of the rows, and `lives.draw(&mut canvas, &place)` draws band, rows, marks and axis there. A
//! canvas in pixels (a timeline below frames, the topic timeline) is `Canvas::new(fonts, sizes, scale)` with
//! pixels per millimetre as its scale; `into_groups` returns its groups.

use super::band::{self, Axis};
use super::canvas::{HAIRLINE, PaperCanvas, Type, ink};
use super::marks::{Letter, Marks, Sign, relative};
use super::rows::{FigureRow, folded_label, rows};
use super::signs::{cross, dot, put_letter, start};
use super::source::FigureSource;
use super::tracks::{SendingBar, Steps, Track, TrackLife, mean, of_nodes, of_topics};
use crate::base::geometry::{Point, Rect};
use crate::base::words;
use crate::draw::scene::Stroke;
use crate::draw::style::Color;
use crate::mission::EventId;
use crate::mission::events::sentence;

/// Lengths as fractions of the pitch of rows, 2.75 mm.
const BAR: (f64, f64) = (0.45 / 2.75, 1.6 / 2.75);
/// The least width of a figure with a column of the topics that each row publishes and subscribes to, and the
/// width of that column; in millimetres.
pub(crate) const WIDE: (f64, f64) = (150.0, 68.0);

/// The content of a figure of lifelines.
pub(crate) struct LivesFigure<'a> {
    pub(crate) source: &'a FigureSource<'a>,
    pub(crate) tracks: Vec<Track>,
    pub(crate) rows: Vec<FigureRow>,
    pub(crate) marks: Marks,
}

/// The positions of the rows of a figure, in millimetres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPlace {
    /// The top of the band.
    pub(crate) top: f64,
    /// The left end of the names.
    pub(crate) left: f64,
    /// The time axis.
    pub(crate) axis: Axis,
    /// The right end of the column of rates, if there is one.
    pub(crate) rates: Option<f64>,
    /// The left end and the width of the column of topics that each row publishes and subscribes to, if it
    /// fits.
    pub(crate) talk: Option<(f64, f64)>,
    /// Whether names and publishing bars are drawn by [`super::live`], frame by frame; the bars here are then
    /// pale.
    pub(crate) is_live: bool,
}

impl<'a> LivesFigure<'a> {
    /// The lifelines of nodes, or of topics.
    pub(crate) fn new(source: &'a FigureSource<'a>, by_topics: bool) -> Self {
        let tracks = if by_topics {
            of_topics(source)
        } else {
            of_nodes(source)
        };
        Self::of(source, tracks)
    }

    /// The lifelines of these rows.
    pub(crate) fn of(source: &'a FigureSource<'a>, tracks: Vec<Track>) -> Self {
        let marks = Marks::new(source, &tracks);
        let rows = rows(&tracks, source.span(), &marks);
        Self {
            source,
            tracks,
            rows,
            marks,
        }
    }

    /// The height of band, rows and axis in millimetres.
    pub(crate) fn height(&self, canvas: &PaperCanvas<'_>) -> f64 {
        let rows = self.rows.len() as f64 * canvas.sizes.pitch();
        self.band() + rows + 0.4 + canvas.sizes.line() + 1.2
    }

    /// The height of the band with the space below it; 0 without phases.
    fn band(&self) -> f64 {
        let has_band = !self.source.phases.is_empty();
        if has_band { band::HEIGHT + 0.9 } else { 0.0 }
    }

    /// The width of the column of names: that of the widest, at most 36 % of `width`.
    pub(crate) fn names_width(&self, canvas: &PaperCanvas<'_>, width: f64) -> f64 {
        let one = |row: &FigureRow| match row {
            FigureRow::Space(name) => canvas.width(name, Type::Head),
            FigureRow::Track(_, label, inside) => {
                canvas.width(label, Type::Name) + if *inside { 1.2 } else { 0.0 }
            }
            FigureRow::Folded(all, _) => {
                canvas.width(&folded_label(&self.tracks, all), Type::Name) + 1.2
            }
        };
        let widest = self.rows.iter().map(one).fold(8.0, f64::max);
        (widest + 1.2).min(width * 0.36)
    }

    /// The y at which the rows begin.
    pub(crate) fn top(&self, place: &RowPlace) -> f64 {
        place.top + self.band()
    }

    /// The y at which the rows end, at the axis.
    pub(crate) fn bottom(&self, canvas: &PaperCanvas<'_>, place: &RowPlace) -> f64 {
        self.top(place) + self.rows.len() as f64 * canvas.sizes.pitch() + 0.4
    }

    /// Draws band, rows, marks and axis; returns the y at which the axis ends below.
    pub(crate) fn draw(&self, canvas: &mut PaperCanvas<'_>, place: &RowPlace) -> f64 {
        let pitch = canvas.sizes.pitch();
        let top = self.top(place);
        let bottom = self.bottom(canvas, place);
        canvas.begin("phases");
        self.columns(canvas, place, bottom);
        canvas.begin("rows");
        for (k, row) in self.rows.iter().enumerate() {
            let y = top + (k as f64 + 0.5) * pitch;
            self.row(canvas, place, y, row);
        }
        let y_of = |track: usize| {
            let at = self.rows.iter().position(|r| r.holds(track))?;
            Some(top + (at as f64 + 0.5) * pitch)
        };
        self.signs(canvas, place, y_of);
        let mut taken = self.arrows(canvas, place, y_of);
        for sign in self.marks.signs.iter().filter(|s| s.sign == Sign::End) {
            if let Some(y) = y_of(sign.track) {
                taken.push((place.axis.x(sign.at), y, y));
            }
        }
        for (k, Letter { mark, .. }) in self.marks.letters.iter().enumerate() {
            if let Some(y) = y_of(mark.track) {
                canvas.begin_mark("letter", &[mark.event], self.sentence(mark.event));
                put_letter(canvas, place, (mark.at, y), k, &mut taken);
            }
        }
        canvas.begin("axis");
        band::axis(canvas, &place.axis, bottom, true)
    }

    /// The band, its columns behind the rows, and the heads of the other columns.
    fn columns(&self, canvas: &mut PaperCanvas<'_>, place: &RowPlace, bottom: f64) {
        let phases = self.source.phases;
        let middle = place.top + band::HEIGHT / 2.0;
        if !phases.is_empty() {
            for (k, phase) in phases.iter().enumerate() {
                let (left, right) = (place.axis.x(phase.span.start), place.axis.x(phase.span.end));
                if k % 2 == 0 {
                    let top = place.top + band::HEIGHT;
                    canvas.fill(Rect::new(left, top, right - left, bottom - top), ink::TINT);
                }
            }
            for phase in &phases[1..] {
                let x = place.axis.x(phase.span.start);
                let dashed = Stroke::dashed(ink::RULE, HAIRLINE, &[0.7, 0.6]);
                let from = Point::new(x, place.top + band::HEIGHT);
                canvas.line(from, Point::new(x, bottom), &dashed);
            }
            band::band(canvas, &place.axis, place.top, phases);
            canvas.text_end(
                place.axis.left - 0.9,
                middle,
                Type::Small,
                ink::QUIET,
                "phase",
            );
        }
        // Without a band the heads are in the row of the first namespace, or above it.
        let head = if phases.is_empty() {
            place.top - canvas.sizes.line() / 2.0
        } else {
            middle
        };
        if let Some(right) = place.rates {
            canvas.text_end(right, head, Type::Small, ink::QUIET, "Hz");
        }
        if let Some((x, _)) = place.talk.filter(|_| !self.is_of_topics()) {
            let text = "→ publishes  ← subscribes, as far as known";
            canvas.text(x, head, Type::Small, ink::QUIET, text);
        }
    }

    pub(crate) fn is_of_topics(&self) -> bool {
        self.tracks.first().is_some_and(|t| t.topic.is_some())
    }

    fn row(&self, canvas: &mut PaperCanvas<'_>, place: &RowPlace, y: f64, row: &FigureRow) {
        let room = place.axis.left - place.left - 1.2;
        match row {
            FigureRow::Space(name) => {
                let name = canvas.cut(name, Type::Head, room);
                canvas.text(place.left, y, Type::Head, ink::TEXT, &name);
            }
            FigureRow::Track(at, label, inside) => {
                let indent = if *inside { 1.2 } else { 0.0 };
                if !place.is_live {
                    let label = canvas.cut(label, Type::Name, room - indent);
                    canvas.text(place.left + indent, y, Type::Name, ink::TEXT, &label);
                }
                let track = &self.tracks[*at];
                lines(canvas, place, y, track);
                rate(canvas, place, y, track.hz);
                if let Some((x, width)) = place.talk {
                    talk(canvas, self.source, track, (x, y, width));
                }
            }
            FigureRow::Folded(all, space) => self.folded(canvas, place, y, all, space),
        }
    }

    /// Draws rows that exist throughout as one light bar.
    fn folded(
        &self,
        canvas: &mut PaperCanvas<'_>,
        place: &RowPlace,
        y: f64,
        all: &[usize],
        space: &str,
    ) {
        let room = place.axis.left - place.left - 2.4;
        let label = canvas.cut(&folded_label(&self.tracks, all), Type::Name, room);
        canvas.text(place.left + 1.2, y, Type::Name, ink::QUIET, &label);
        let high = (BAR.0 + BAR.1) * canvas.sizes.pitch();
        let axis = &place.axis;
        let rect = Rect::new(axis.left, y - high / 2.0, axis.right - axis.left, high);
        canvas.fill(rect, ink::FOLDED);
        let hz = all.iter().filter_map(|at| self.tracks[*at].hz);
        rate(canvas, place, y, hz.reduce(|a, b| a + b));
        if let Some((x, width)) = place.talk {
            let names: Vec<&str> = all
                .iter()
                .map(|at| relative(&self.tracks[*at].name, &format!("{space}/x")))
                .collect();
            let text = canvas.cut(&names.join(", "), Type::Small, width);
            canvas.text(x, y, Type::Small, ink::QUIET, &text);
        }
    }

    /// The text of an event in the log.
    fn sentence(&self, id: EventId) -> String {
        let mission = self.source.mission;
        let event = mission.log.events.get(id);
        let parts = mission.log.all_parts();
        event.map_or_else(String::new, |event| sentence(mission, &parts, id, event))
    }

    /// Draws the ticks, the crosses and the small circles.
    fn signs(
        &self,
        canvas: &mut PaperCanvas<'_>,
        place: &RowPlace,
        y_of: impl Fn(usize) -> Option<f64>,
    ) {
        for mark in &self.marks.signs {
            let Some(y) = y_of(mark.track) else { continue };
            let x = place.axis.x(mark.at);
            let class = match mark.sign {
                Sign::Start => "start",
                Sign::End => "end",
                Sign::Dot => "event",
            };
            canvas.begin_mark(class, &[mark.event], self.sentence(mark.event));
            match mark.sign {
                Sign::Start => start(canvas, x, y),
                Sign::End => cross(canvas, x, y),
                Sign::Dot => dot(canvas, x, y),
            }
        }
    }

    /// Draws the arrows of hand-overs; returns the positions of arrows and labels: x, from y, to y.
    fn arrows(
        &self,
        canvas: &mut PaperCanvas<'_>,
        place: &RowPlace,
        y_of: impl Fn(usize) -> Option<f64>,
    ) -> Vec<(f64, f64, f64)> {
        let mut taken: Vec<(f64, f64, f64)> = Vec::new();
        let mut reported: Vec<((usize, usize), &String)> = Vec::new();
        let stroke = Stroke::solid(ink::CHANGED, 0.3);
        for handover in &self.marks.handovers {
            let (Some(from), Some(to)) = (y_of(handover.from), y_of(handover.to)) else {
                continue;
            };
            let (low, high) = (from.min(to), from.max(to));
            let mut x = place.axis.x(handover.at);
            while taken
                .iter()
                .any(|(o, a, b)| (o - x).abs() < 1.0 && low < *b && *a < high)
            {
                x += 1.0;
            }
            canvas.begin_mark("handover", &[handover.event], self.sentence(handover.event));
            let side = if to > from { -1.0 } else { 1.0 };
            let tip = Point::new(x, to + side * 0.15);
            canvas.line(Point::new(x, from), Point::new(x, to + side * 1.0), &stroke);
            canvas.disc(Point::new(x, from), 0.55, ink::CHANGED, &Stroke::default());
            canvas.head(Point::new(x, from), tip, 1.3, ink::CHANGED);
            taken.push((x, low, high));
            let (a, b) = (handover.from, handover.to);
            let pair = (a.min(b), a.max(b));
            if !reported.contains(&(pair, &handover.topic)) {
                reported.push((pair, &handover.topic));
                let most = place.axis.right - place.axis.left;
                let text = canvas.cut(&handover.topic, Type::Small, most);
                let wide = canvas.width(&text, Type::Small);
                let left = (x + 0.6).min(place.axis.right - wide);
                // Between two rows, so that it covers none of their marks.
                let (top, pitch) = (self.top(place), canvas.sizes.pitch());
                let rows = libm::round((from + (to - from) * 0.66 - top) / pitch);
                let y = top + rows * pitch;
                canvas.label(left + wide / 2.0, y, Type::Small, ink::CHANGED, &text);
                taken.push((left + wide / 2.0, y - 1.2, y + 1.2));
            }
        }
        taken
    }
}

fn rate(canvas: &mut PaperCanvas<'_>, place: &RowPlace, y: f64, hz: Option<f64>) {
    let Some(right) = place.rates else { return };
    // Two digits from 1 Hz on, one below: more are neither known nor needed.
    let digits = |hz: f64| if hz < 0.95 { 1 } else { 2 };
    // Four digits are wider than the column.
    let shown = |hz: f64| match words::significant(hz, digits(hz)) {
        kilo if kilo >= 1000.0 => format!("{}k", words::number(kilo / 1000.0)),
        hz => words::number(hz),
    };
    let text = hz.map_or("–".to_owned(), shown);
    canvas.text_end(right, y, Type::Small, ink::QUIET, &text);
}

/// Draws the lifetimes and the bars of a row.
fn lines(canvas: &mut PaperCanvas<'_>, place: &RowPlace, y: f64, track: &Track) {
    for life in &track.lives {
        thin(canvas, place, y, life);
    }
    let color = if place.is_live { ink::FOLDED } else { ink::BAR };
    for bar in &track.bars {
        thick(canvas, place, y, bar, color);
    }
}

fn thin(canvas: &mut PaperCanvas<'_>, place: &RowPlace, y: f64, life: &TrackLife) {
    let dash: &[f64] = if life.is_inferred { &[0.55, 0.5] } else { &[] };
    let stroke = Stroke::dashed(ink::LINE, 0.28, dash);
    let (from, to) = (place.axis.x(life.span.start), place.axis.x(life.span.end));
    canvas.line(Point::new(from, y), Point::new(to, y), &stroke);
}

/// Draws a publishing interval.
pub(crate) fn thick(
    canvas: &mut PaperCanvas<'_>,
    place: &RowPlace,
    y: f64,
    bar: &SendingBar,
    color: Color,
) {
    let high = (BAR.0 + BAR.1 * bar.share) * canvas.sizes.pitch();
    let (from, to) = (place.axis.x(bar.span.start), place.axis.x(bar.span.end));
    let wide = (to - from).max(0.25);
    canvas.fill(Rect::new(from, y - high / 2.0, wide, high), color);
}

/// Draws as many of the topics that a node publishes, the fastest first, and subscribes to as fit; for a
/// topic, its types.
fn talk(
    canvas: &mut PaperCanvas<'_>,
    source: &FigureSource<'_>,
    track: &Track,
    place: (f64, f64, f64),
) {
    let (x, y, width) = place;
    let name = &track.name;
    if let Some(topic) = track.topic {
        let elements = &source.mission.elements;
        let kind = elements.topics.get(topic).map(|t| t.types.join(", "));
        let text = canvas.cut(&kind.unwrap_or_default(), Type::Small, width);
        canvas.text(x, y, Type::Small, ink::QUIET, &text);
        return;
    }
    let (sends, receives) = (sent_by(source, track), received_by(source, track));
    let list = |topics: &[&str], most: usize| {
        let reported: Vec<&str> = topics
            .iter()
            .take(most)
            .map(|t| relative(t, name))
            .collect();
        match topics.len() - reported.len() {
            0 => reported.join(", "),
            more => format!("{} +{more}", reported.join(", ")),
        }
    };
    let (mut a, mut b) = (sends.len(), receives.len());
    let said = |topics: &[&str], arrow: &str, most: usize| match topics {
        [] => String::new(),
        topics => format!("{arrow} {}", list(topics, most)),
    };
    let between = 1.4;
    loop {
        let (left, right) = (said(&sends, "→", a), said(&receives, "←", b));
        let wide = canvas.width(&left, Type::Small);
        let gap = if left.is_empty() || right.is_empty() {
            0.0
        } else {
            between
        };
        let whole = wide + gap + canvas.width(&right, Type::Small);
        if whole <= width || (a <= 1 && b <= 1) {
            let left = canvas.cut(&left, Type::Small, width);
            canvas.text(x, y, Type::Small, ink::TEXT, &left);
            let rest = canvas.cut(&right, Type::Small, (width - wide - gap).max(0.0));
            canvas.text(x + wide + gap, y, Type::Small, ink::QUIET, &rest);
            return;
        }
        if b >= a && b > 1 {
            b -= 1;
        } else {
            a -= 1;
        }
    }
}

fn sent_by<'s>(source: &'s FigureSource<'_>, track: &Track) -> Vec<&'s str> {
    let mut rated: Vec<(f64, &str)> = Vec::new();
    let steps = Steps::new(source);
    for edge in source.publications(&track.nodes) {
        let senders = source.senders(&[edge]);
        let hz = senders
            .first()
            .and_then(|s| mean(&steps.pieces(s, source.span())));
        if let Some(of) = source.mission.elements.publishes.get(edge)
            && !source.is_hub(of.topic)
        {
            rated.push((hz.unwrap_or(0.0), source.topic(of.topic)));
        }
    }
    rated.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
    let mut names: Vec<&str> = Vec::new();
    for (_, name) in rated {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn received_by<'s>(source: &'s FigureSource<'_>, track: &Track) -> Vec<&'s str> {
    let all = &source.mission.elements.subscribes;
    let own = all.iter().filter(|e| {
        track.nodes.contains(&e.node) && source.shows(e.topic) && !source.is_hub(e.topic)
    });
    let mut names: Vec<&str> = own.map(|e| source.topic(e.topic)).collect();
    names.sort_unstable();
    names.dedup();
    names
}
