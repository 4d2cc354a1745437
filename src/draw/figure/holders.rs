//! Who sends each topic that changes hands or has several senders, and when nobody does: a lane of bars per topic, and one
//! more for each sender at the same time.

use super::page::{FigureSheet, drawer, nothing};
use crate::base::error::{Error, Result};
use crate::base::geometry::{Point, Rect, Size};
use crate::base::name::ShortNames;
use crate::base::time::Span;
use crate::base::words;
use crate::draw::scene::{Scene, Stroke};
use crate::draw::timeline::Timeline;
use crate::draw::timeline::canvas::{HAIRLINE, PaperCanvas, Type, ink};
use crate::draw::timeline::drawer::{Drawer, clock};
use crate::draw::timeline::notes::{flow, sentence};
use crate::draw::timeline::phases::names;
use crate::draw::timeline::rows::Row;
use crate::draw::timeline::source::FigureSource;
use crate::graph::TopicId;
use crate::mission::rates::{Holder, Rates};

/// The height of a bar as a share of its lane: neighbours in time and in lanes are apart.
const BAR: f64 = 0.84;
/// The space around a name in millimetres.
const AROUND: f64 = 0.5;

/// The topics with several senders, in order of their names, each with its lanes.
fn lanes<'a>(source: &FigureSource<'a>) -> Vec<(TopicId, Vec<Vec<Holder<'a>>>)> {
    let rates = Rates::new(source.mission);
    let of = |topic: TopicId| {
        let holders = rates.holders(topic);
        let mut lanes: Vec<Vec<Holder>> = Vec::new();
        let many = holders.len();
        for holder in holders {
            let is_free = |lane: &&mut Vec<Holder>| {
                lane.last().is_some_and(|last| last.end() <= holder.start())
            };
            match lanes.iter_mut().find(is_free) {
                Some(lane) => lane.push(holder),
                None => lanes.push(vec![holder]),
            }
        }
        (many > 1).then_some((topic, lanes))
    };
    let topics = source.shown_topics().filter(|topic| !source.is_hub(*topic));
    topics.filter_map(of).collect()
}

/// The figure.
///
/// # Errors
/// [`Error::Usage`] if no topic has several senders, or if they do not fit; the hint suggests what would.
pub(crate) fn page(sheet: &FigureSheet<'_>) -> Result<Scene> {
    let (source, width) = (sheet.source, sheet.options.width_mm);
    let topics = lanes(source);
    if topics.is_empty() {
        if source.roles.is_empty() {
            return Err(nothing(source));
        }
        let hint = "draw `--kind lives`, which shows when each node sends";
        return Err(Error::usage("no topic has several known senders", hint));
    }
    let row = |topic: TopicId, at: usize| Row {
        name: source.topic(topic).into(),
        labels: vec![if at == 0 { source.topic(topic) } else { "" }.to_owned()],
        ..Row::default()
    };
    let rows = topics
        .iter()
        .flat_map(|(topic, lanes)| (0..lanes.len()).map(|at| row(*topic, at)));
    let rows: Vec<Row> = rows.collect();
    let mut canvas = sheet.canvas();
    let timeline = Timeline::new(source, rows);
    if timeline.rows.len() > sheet.most_rows() {
        return Err(sheet.too_many(&timeline, &timeline.rows, ("--topic-filter", "lane")));
    }
    let drawer = drawer(timeline, &canvas, width).without_columns(width);
    let end = drawer.ground(&mut canvas);
    let mut first = 0;
    for (topic, lanes) in &topics {
        let all = lanes
            .iter()
            .flatten()
            .flat_map(|holder| holder.times.iter().copied());
        canvas.begin("nobody");
        let (top, bottom) = (drawer.y(first), drawer.y(first + lanes.len() - 1));
        for gap in gaps(source.span(), Span::joined(all.collect(), 0)) {
            let lane = drawer.pitch * BAR;
            canvas.hatch(drawer.axis.rect(gap, top - lane / 2.0, bottom - top + lane));
        }
        if first > 0 {
            let y = top - drawer.pitch / 2.0;
            let rule = Stroke::solid(ink::RULE, HAIRLINE);
            canvas.line(Point::new(0.0, y), Point::new(width, y), &rule);
        }
        let roles = lanes.iter().flatten().map(|holder| holder.role);
        let short: ShortNames = roles.collect();
        for (at, holders) in lanes.iter().enumerate() {
            let lane = Lane {
                drawer: &drawer,
                y: drawer.y(first + at),
                topic: source.topic(*topic),
            };
            lane.draw(&mut canvas, holders, &short);
        }
        first += lanes.len();
    }
    canvas.begin("words");
    let mut y = names(&mut canvas, source, width, end);
    if !sheet.options.is_bare {
        let text = "Bar: the node that sends the topic; bars above each other: several at once; hatched: nobody.";
        y = flow(&mut canvas, width, y + 0.15, &[sentence(ink::QUIET, text)]);
    }
    Ok(canvas.into_scene(Size::new(width, y + 0.3), sheet.title("Senders")))
}

/// A lane at its place.
struct Lane<'a> {
    drawer: &'a Drawer,
    y: f64,
    topic: &'a str,
}

impl Lane<'_> {
    /// Draws the bars of holders one after the other, each with its name once: in its longest bar, else where there is
    /// room behind or before it.
    fn draw(&self, canvas: &mut PaperCanvas<'_>, holders: &[Holder<'_>], names: &ShortNames<'_>) {
        let axis = &self.drawer.axis;
        let high = self.drawer.pitch * BAR;
        let bar = |time: &Span| axis.rect(*time, self.y - high / 2.0, high);
        let start = axis.span.start;
        for (k, holder) in holders.iter().enumerate() {
            let name = names.of(holder.role);
            let times = holder.times.iter().map(|time| {
                let [from, to] = [time.start, time.end].map(|at| clock(at.since(start)));
                format!("{from} to {to}")
            });
            let times = times.collect::<Vec<_>>().join(", ");
            let title = format!("{} sends {} from {times}", holder.role, self.topic);
            canvas.begin_mark("holder", &[], words::visible(&title).into_owned());
            for time in &holder.times {
                canvas.fill(bar(time), ink::LINE);
            }
            let Some(longest) = holder.times.iter().max_by_key(|time| time.nanos()) else {
                continue;
            };
            let (place, wide) = (bar(longest), canvas.width(name, Type::Small) + 2.0 * AROUND);
            let ends = [
                k.checked_sub(1)
                    .map_or(axis.left, |before| axis.x(holders[before].end())),
                holders
                    .get(k + 1)
                    .map_or(axis.right, |next| axis.x(next.start())),
            ];
            let own = [axis.x(holder.start()), axis.x(holder.end())];
            if wide <= place.w {
                self.name(canvas, place.centre().x - wide / 2.0, true, name);
            } else if own[1] + wide <= ends[1] {
                self.name(canvas, own[1], false, name);
            } else if own[0] - wide >= ends[0] {
                self.name(canvas, own[0] - wide, false, name);
            } else {
                let cut = canvas.cut(name, Type::Small, place.w - 2.0 * AROUND);
                self.name(canvas, place.x, true, &cut);
            }
        }
    }

    /// Writes a name from `x` on, inside a bar or beside it.
    fn name(&self, canvas: &mut PaperCanvas<'_>, x: f64, is_inside: bool, name: &str) {
        let color = if is_inside { ink::PAPER } else { ink::TEXT };
        if !is_inside {
            // The hatching ends around words.
            let wide = canvas.width(name, Type::Small) + AROUND;
            let high = canvas.sizes.line();
            let ground = Rect::new(x + AROUND / 2.0, self.y - high / 2.0, wide, high);
            canvas.fill(ground, ink::PAPER);
        }
        canvas.text(x + AROUND, self.y, Type::Small, color, name);
    }
}

/// The parts of `whole` outside of these times, which are sorted and do not overlap.
fn gaps(whole: Span, times: Vec<Span>) -> Vec<Span> {
    let mut gaps = Vec::new();
    let mut from = whole.start;
    for time in times {
        if time.start > from {
            gaps.push(Span::new(from, time.start));
        }
        from = from.max(time.end);
    }
    if from < whole.end {
        gaps.push(Span::new(from, whole.end));
    }
    gaps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

    #[test]
    fn nobody_holds_a_topic_between_its_senders() {
        let span = |from, to| Span::new(Stamp(from), Stamp(to));
        assert_eq!(gaps(span(0, 9), vec![]), [span(0, 9)]);
        assert_eq!(
            gaps(span(0, 9), vec![span(1, 3), span(5, 9)]),
            [span(0, 1), span(3, 5)]
        );
        assert_eq!(gaps(span(0, 9), vec![span(0, 8)]), [span(8, 9)]);
        assert_eq!(gaps(span(0, 9), vec![span(0, 9)]), []);
    }
}
