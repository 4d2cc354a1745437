//! The order of rows: by namespace, as a staircase of beginnings; or joined, a row for all that begin and end together.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::marks::{RowMark, Sign};
use super::rows::{Level, Row, SendingBar};
use super::source::FigureSource;
use crate::base::ids::grouped;
use crate::base::name::{ShortNames, last_part, namespace};
use crate::base::time::Span;
use crate::base::words;
use crate::graph::NodeId;
use crate::mission::EventId;
use crate::mission::event_log::Event;
use crate::mission::rates::same;

/// The part of the mission, one in this many, up to which starts count as one burst of the staircase.
const BURST: i64 = 66;
/// The number of parts of the mission that make the grid on which ends are compared, and within which starts, or ends,
/// of joined rows are one: about the width of a mark.
const NEAR: i64 = 33;
/// The least number of constant rows that are collapsed: of two, it would save a single row.
const FEWEST_FOLDED: usize = 3;
/// The most rows that are drawn separately in a figure without starts and stops: 33 mm of bars that all look the same.
const MOST_OPEN: usize = 12;
/// The name of the row for events without their own row.
const OTHERS: &str = "other changes";
/// The height of the bars of joined rows, as a share of the highest: they have no rate.
const JOINED: f64 = 0.6;

/// The rows below the titles of their namespaces, in the order in which they begin. If `is_folded`, those of a namespace
/// that exist throughout are one row, unless they are marked.
pub(crate) fn by_namespace(rows: Vec<Row>, whole: Span, is_folded: bool) -> Vec<Row> {
    let givers = rows.iter().flat_map(|row| &row.marks);
    let givers: BTreeSet<NodeId> = givers.filter_map(|mark| mark.from).collect();
    let is_fixed = |row: &Row| {
        let is_marked = row.marks.iter().any(|mark| mark.sign != Sign::Start);
        let is_giver = row.nodes.iter().any(|id| givers.contains(id));
        !is_marked && !is_giver && is_throughout(row, whole)
    };
    let many = rows.len();
    let rows = rows.into_iter();
    let spaces = grouped(rows.map(|row| (namespace(&row.name).to_owned(), row)));
    let mut spaces: Vec<(String, Vec<Row>)> = spaces.into_iter().collect();
    let start = |own: &[Row]| own.iter().map(Row::start).min();
    spaces.sort_by_key(|(space, own)| (space != "/", start(own)));
    // If all others are written with their namespaces, a title of those at the root says nothing.
    let is_flat = (spaces.iter()).all(|(space, own)| space == "/" || own.len() == 1);
    let level = if is_flat {
        Level::Outside
    } else {
        Level::Inside
    };
    let mut all = Vec::new();
    for (space, mut own) in spaces {
        if let [only] = &mut own[..] {
            only.labels = vec![only.name.trim_start_matches('/').to_owned()];
            all.append(&mut own);
            continue;
        }
        for row in &mut own {
            row.level = level;
            row.labels = vec![last_part(&row.name).to_owned()];
        }
        if !is_flat {
            all.push(Row {
                name: space.as_str().into(),
                labels: vec![space],
                level: Level::Title,
                ..Row::default()
            });
        }
        let (fixed, open): (Vec<Row>, Vec<Row>) = own.into_iter().partition(&is_fixed);
        // If nothing else is shown, a few rows are more informative than their number.
        let is_all = fixed.len() == many && many <= MOST_OPEN;
        if is_folded && fixed.len() >= FEWEST_FOLDED && !is_all {
            let folded = folded(fixed, whole);
            all.push(Row { level, ..folded });
            all.extend(staircase(open, whole));
        } else {
            all.extend(staircase([fixed, open].concat(), whole));
        }
    }
    all
}

/// The same rows, but topics of one type that are sent alike and whose names differ only in the number at their end are one:
/// `ls0…7 ×8`.
pub(crate) fn numbered(rows: Vec<Row>, whole: Span) -> Vec<Row> {
    let near = whole.nanos() / NEAR;
    let numbered = |row: Row| {
        let stem = row.name.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = row.name[stem.len()..].parse::<u32>().ok();
        (stem.to_owned(), number, row)
    };
    let mut rows: Vec<_> = rows.into_iter().map(numbered).collect();
    rows.sort_by(|a, b| (&a.0, a.1).cmp(&(&b.0, b.1)));
    let mut all = Vec::new();
    for alike in rows.chunk_by(|a, b| a.0 == b.0 && a.2.is_like(&b.2, near)) {
        match alike {
            [(stem, Some(first), row), .., (_, Some(last), _)] if alike.len() >= FEWEST_FOLDED => {
                let mut one = row.clone();
                one.name = format!("{stem}{first}…{last} ×{}", alike.len()).into();
                for (.., other) in &alike[1..] {
                    let marks = one.marks.iter_mut().zip(&other.marks);
                    marks.for_each(|(mark, other)| mark.events.extend_from_slice(&other.events));
                }
                all.push(one);
            }
            _ => all.extend(alike.iter().map(|(.., row)| row.clone())),
        }
    }
    all
}

/// Whether a row exists from (nearly) the first moment to the last, without a gap or a step.
fn is_throughout(row: &Row, whole: Span) -> bool {
    let steady = row.topic.is_none() || row.hz.is_none() || row.bars.len() == 1;
    let start = row.start().since(whole.start);
    row.lives.len() == 1 && start <= whole.nanos() / 20 && steady
}

/// One row for several that exist throughout.
fn folded(rows: Vec<Row>, whole: Span) -> Row {
    let word = match rows.first().and_then(|row| row.topic) {
        Some(_) => "topic",
        None => "node",
    };
    let count = words::count(rows.len(), word);
    let beside = rows.iter().map(|row| last_part(&row.name).to_owned());
    Row {
        labels: vec![format!("{count} throughout")],
        lives: vec![whole],
        bars: vec![SendingBar::new(whole, 1.0)],
        hz: rows.iter().filter_map(|row| row.hz).reduce(|a, b| a + b),
        folded: rows.iter().map(|row| Arc::clone(&row.name)).collect(),
        beside: [Vec::new(), beside.collect()],
        marks: rows.into_iter().flat_map(|row| row.marks).collect(),
        ..Row::default()
    }
}

/// The rows sorted by burst of start, then by end, the latest first, then by name.
fn staircase(mut rows: Vec<Row>, whole: Span) -> Vec<Row> {
    rows.sort_by_key(Row::start);
    let (near, grid) = (whole.nanos() / BURST, (whole.nanos() / NEAR).max(1));
    // Elements that never end come first.
    let end = |row: &Row| {
        let at = row.end().since(whole.start) / grid;
        if row.is_ending() { at } else { i64::MAX }
    };
    let close = |a: &Row, b: &Row| b.start().since(a.start()) <= near;
    for burst in rows.chunk_by_mut(close) {
        burst.sort_by(|a, b| end(b).cmp(&end(a)).then_with(|| a.name.cmp(&b.name)));
    }
    rows
}

/// A row for all that begin and end together, in at most `most` rows; those without events are none, or one if
/// `is_complete`. Events without a row share the last one.
pub(crate) fn together(
    source: &FigureSource<'_>,
    rows: Vec<Row>,
    most: usize,
    is_complete: bool,
) -> Vec<Row> {
    let whole = source.span();
    let near = whole.nanos() / NEAR;
    let begun = whole.start.plus(near);
    let mut rows: Vec<Row> = rows.into_iter().map(Row::plain).collect();
    let names: Vec<Arc<str>> = rows.iter().map(|row| Arc::clone(&row.name)).collect();
    let names: ShortNames = names.iter().map(|name| &**name).collect();
    for row in &mut rows {
        // Elements that start with the recording look as if they existed from the beginning.
        row.marks
            .retain(|mark| mark.sign != Sign::Start || mark.at >= begun);
        row.labels = vec![names.of(&row.name).to_owned()];
    }
    let (open, fixed): (Vec<Row>, Vec<Row>) =
        rows.into_iter().partition(|row| !row.marks.is_empty());
    let mut rows: Vec<Row> = Vec::new();
    for row in open {
        match rows.iter_mut().find(|first| first.is_with(&row, near)) {
            Some(first) => first.join(row),
            None => rows.push(row),
        }
    }
    for row in &mut rows {
        row.lives = Span::joined(std::mem::take(&mut row.lives), 0);
        // Without space for both, lifetimes are drawn instead of times of publishing.
        let spans = match (is_complete, row.labels.len()) {
            (false, _) => row.lives.clone(),
            (true, 1) => continue,
            (true, _) => Span::joined(row.bars.iter().map(|bar| bar.span).collect(), near / 2),
        };
        let bars = spans.into_iter().map(|span| SendingBar::new(span, JOINED));
        row.bars = bars.collect();
    }
    rows.sort_by(|a, b| (a.start(), &a.labels).cmp(&(b.start(), &b.labels)));
    let mut others = unplaced(source, &rows);
    while rows.len() + usize::from(!others.is_empty()) > most.max(1) {
        let few = rows.iter().enumerate().min_by_key(|(at, row)| {
            let members = row.labels.len() * row.marks.len();
            (members, std::cmp::Reverse(*at))
        });
        let Some((at, _)) = few else { break };
        others.extend(rows.remove(at).marks);
    }
    if !others.is_empty() {
        others.sort_by_key(|mark| mark.at);
        rows.push(Row {
            labels: vec![OTHERS.to_owned()],
            marks: others,
            ..Row::default()
        });
    }
    if is_complete && !fixed.is_empty() {
        rows.insert(0, folded(fixed, whole));
    }
    rows
}

impl Row {
    /// Whether it is of the same type as another and sent at the same times and rates, nearly.
    fn is_like(&self, other: &Self, near: i64) -> bool {
        let is_same = |(a, b): (&SendingBar, &SendingBar)| {
            let ends = [(a.span.start, b.span.start), (a.span.end, b.span.end)];
            ends.iter().all(|(a, b)| a.since(*b).abs() <= near)
        };
        self.beside == other.beside
            && self.marks.len() == other.marks.len()
            && self.is_with(other, near)
            && self.hz.zip(other.hz).is_some_and(|(a, b)| same(a, b))
            && self.bars.len() == other.bars.len()
            && self.bars.iter().zip(&other.bars).all(is_same)
    }

    /// Whether it begins and ends as often as another row, each time nearly at the same time.
    fn is_with(&self, other: &Self, near: i64) -> bool {
        let is_same =
            |(a, b): (&RowMark, &RowMark)| a.sign == b.sign && a.at.since(b.at).abs() <= near;
        self.turns().count() == other.turns().count()
            && self.turns().zip(other.turns()).all(is_same)
    }

    /// Takes a row that begins and ends with it, with one sign for each time: the first start, the last end.
    fn join(&mut self, other: Self) {
        self.labels.extend(other.labels);
        self.lives.extend(other.lives);
        self.bars.extend(other.bars);
        self.hz = [self.hz, other.hz]
            .into_iter()
            .flatten()
            .reduce(|a, b| a + b);
        (self.topic, self.beside) = (None, <[Vec<String>; 2]>::default());
        let (turns, dots): (Vec<RowMark>, Vec<RowMark>) =
            other.marks.into_iter().partition(RowMark::is_turn);
        let own = self.marks.iter_mut().filter(|mark| mark.is_turn());
        for (own, other) in own.zip(turns) {
            own.at = match own.sign {
                Sign::Start => own.at.min(other.at),
                _ => own.at.max(other.at),
            };
            own.events.extend(other.events);
            own.title = format!("{}; {}", own.title, other.title);
        }
        self.marks.extend(dots);
    }
}

/// The events of the log without a row.
fn unplaced(source: &FigureSource<'_>, rows: &[Row]) -> Vec<RowMark> {
    let marks = rows.iter().flat_map(|row| &row.marks);
    let placed: BTreeSet<EventId> = marks.flat_map(|mark| mark.events.clone()).collect();
    let parts = source.mission.log.all_parts();
    let all = source.mission.log.headlines(source.span());
    let others = all.filter(|(id, _)| !placed.contains(id));
    let mark = |of: (EventId, &Event)| RowMark::new(source, &parts, of, Sign::of(of.1.kind));
    others.map(mark).collect()
}
