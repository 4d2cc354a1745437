//! A row per node or topic: the times at which it existed and published, and its rates. Lifetimes and rates are
//! those of the mission's history; the height of a bar only changes where the log has another rate. Rows are ordered by
//! namespace, or joined.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::FigureSource;
use super::marks::{RowMark, Sign, marked};
use crate::base::ids::grouped;
use crate::base::name::{ShortNames, last_part, namespace};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::evidence::Confidence;
use crate::graph::history::{Sender, Sending, Stretch};
use crate::graph::{ById, EdgeId, Element, NodeId, TopicId};
use crate::mission::EventId;
use crate::mission::event_log::Event;
use crate::mission::rates::{Piece, Rates, same, silence, steps};

/// An interval of publishing at one rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SendingBar {
    pub(crate) span: Span,
    /// Its share of the row's highest rate, 0 to 1.
    pub(crate) share: f64,
}

impl SendingBar {
    pub(crate) fn new(span: Span, share: f64) -> Self {
        Self { span, share }
    }
}

/// The place of a row's name in the column of names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Level {
    /// The title of a namespace, above its rows.
    Title,
    /// A row by itself.
    #[default]
    Outside,
    /// A row below the title of its namespace.
    Inside,
}

/// A node, a topic, or several that are drawn as one; or a title.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Row {
    /// The full name: a role, a topic, or a namespace.
    pub(crate) name: Arc<str>,
    /// Its nodes: those of a role, or of several.
    pub(crate) nodes: Vec<NodeId>,
    /// Its topic.
    pub(crate) topic: Option<TopicId>,
    /// The times in which it exists.
    pub(crate) lives: Vec<Span>,
    /// Whether it is known by inference only.
    pub(crate) is_inferred: bool,
    /// The times in which it publishes.
    pub(crate) bars: Vec<SendingBar>,
    /// Messages per second while it publishes; `None` if it never does, or too rarely for a rate.
    pub(crate) hz: Option<f64>,
    /// The number of messages that it publishes.
    pub(crate) count: u64,
    /// Its rates in order, if there are several.
    pub(crate) steps: Vec<f64>,
    /// Its events, in order of the log.
    pub(crate) marks: Vec<RowMark>,
    /// The names before it, of which as many as fit are written.
    pub(crate) labels: Vec<String>,
    pub(crate) level: Level,
    /// The full names of the elements that are drawn as one because they exist throughout.
    pub(crate) folded: Vec<Arc<str>>,
    /// What is written beside it: the topics that it publishes, the fastest first; and in a quiet colour those that
    /// it subscribes to, or the types of a topic.
    pub(crate) beside: [Vec<String>; 2],
}

impl Row {
    pub(crate) fn start(&self) -> Stamp {
        self.lives.first().map_or(Stamp::MAX, |life| life.start)
    }

    pub(crate) fn end(&self) -> Stamp {
        self.lives.last().map_or(Stamp::MIN, |life| life.end)
    }

    /// Whether it exists at any moment of `time`.
    pub(crate) fn is_in(&self, time: Span) -> bool {
        let shared = |life: &Span| life.start < time.end && time.start < life.end;
        self.lives.iter().any(shared)
    }

    /// Its rates while it publishes, in words: `10 → 5 → 10 Hz`; without one, the number of its messages.
    pub(crate) fn rates(&self) -> String {
        match (&self.steps[..], self.hz) {
            ([], Some(hz)) => words::rate(hz),
            ([], None) => words::rate_of(self.count, 0.0),
            (steps, _) => words::rates(steps),
        }
    }

    /// The node or the topic of the row; `None` for a title.
    pub(crate) fn what(&self) -> Option<Element> {
        let node = self.nodes.last().map(|id| Element::Node(*id));
        node.or(self.topic.map(Element::Topic))
    }
}

/// A row per topic, or per role, with its events.
pub(crate) fn of(source: &FigureSource<'_>, by_topics: bool) -> Vec<Row> {
    if by_topics {
        of_topics(source)
    } else {
        of_nodes(source)
    }
}

/// A row per role, with its events.
pub(crate) fn of_nodes(source: &FigureSource<'_>) -> Vec<Row> {
    let (rates, elements) = (Rates::new(source.mission), &source.mission.elements);
    let mut received = ById::like(&elements.nodes, BTreeSet::new());
    for edge in &elements.subscribes {
        if source.shows(edge.topic) && !source.is_hub(edge.topic) {
            received[edge.node].insert(source.topic(edge.topic));
        }
    }
    let row = |(role, nodes): (&Arc<str>, &Vec<NodeId>)| {
        let publications = source.publications(nodes);
        let elements: Vec<Element> = nodes.iter().map(|id| Element::Node(*id)).collect();
        let own = row(source, &rates, &elements, &rates.senders(&publications));
        let sent = sent_by(source, &rates, &publications);
        Row {
            name: Arc::clone(role),
            nodes: nodes.clone(),
            beside: [
                arrowed("→", role, sent.into_iter()),
                arrowed("←", role, nodes.iter().flat_map(|id| received[*id].clone())),
            ],
            ..own
        }
    };
    let rows = source.roles.iter().map(row);
    marked(source, rows.filter(|row| !row.lives.is_empty()).collect())
}

/// A row per topic that carried a message, with its events.
pub(crate) fn of_topics(source: &FigureSource<'_>) -> Vec<Row> {
    let rates = Rates::new(source.mission);
    let row = |id: TopicId| {
        let senders: Vec<&Sender> = source.mission.sending.of_topic(id).iter().collect();
        let topic = source.mission.elements.topics.get(id);
        let types = topic.map(|topic| topic.types.iter().map(ToString::to_string).collect());
        Row {
            name: source.topic(id).into(),
            topic: Some(id),
            beside: [Vec::new(), types.unwrap_or_default()],
            ..row(source, &rates, &[Element::Topic(id)], &senders)
        }
    };
    let rows = source.shown_topics().map(row);
    let rows = rows.filter(|row| !row.lives.is_empty() && !row.bars.is_empty());
    marked(source, rows.collect())
}

/// The row of some elements drawn as one, without its name.
fn row(
    source: &FigureSource<'_>,
    rates: &Rates<'_>,
    elements: &[Element],
    senders: &[&Sender],
) -> Row {
    let whole = source.span();
    let lives = elements.iter().flat_map(|what| source.lives(*what));
    let lives = Span::joined(lives.collect(), 0);
    let confidence = elements.iter().map(|what| source.confidence(*what)).min();
    let pieces = rates.of(senders);
    let hz = rates.while_sending(senders);
    let most = pieces.iter().map(|piece| piece.hz).fold(0.0, f64::max);
    let share = |hz: f64| if most > 0.0 { hz / most } else { 1.0 };
    let bar = |piece: &Piece| SendingBar::new(piece.span, share(piece.hz));
    let stretches = senders.iter().flat_map(|sender| &sender.stretches);
    // The few messages of a sender without a rate are moments.
    let moment = |at: Stamp| SendingBar::new(Span::new(at, at.plus(1)), 1.0);
    let moments = |s: &Stretch| [s.first, s.last].map(moment);
    let mut bars: Vec<SendingBar> = match hz {
        Some(_) => pieces.iter().map(bar).collect(),
        None => stretches.flat_map(moments).collect(),
    };
    if let (Some(life), Some(bar), Some(_)) = (lives.last(), bars.last_mut(), hz)
        && life.end.since(bar.span.end) <= silence(whole)
        && life.end == whole.end
    {
        // The recording ended between two messages.
        bar.span.end = life.end;
    }
    Row {
        lives,
        is_inferred: senders.is_empty() && confidence.is_some_and(|c| c >= Confidence::Inferred),
        bars,
        hz,
        count: Sending::count(senders.iter().copied()),
        steps: hz.map_or(Vec::new(), |_| steps(&pieces)),
        ..Row::default()
    }
}

/// The topics of some publications that tell something about their nodes, the fastest first.
fn sent_by<'s>(source: &'s FigureSource<'_>, rates: &Rates<'_>, edges: &[EdgeId]) -> Vec<&'s str> {
    let sent = |edge: &EdgeId| {
        let topic = source.mission.elements.publishes.get(*edge)?.topic;
        let hz = rates.while_sending(&rates.senders(&[*edge]));
        (!source.is_hub(topic)).then_some((hz.unwrap_or(0.0), source.topic(topic)))
    };
    let mut all: Vec<(f64, &str)> = edges.iter().filter_map(sent).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
    all.into_iter().map(|(_, name)| name).collect()
}

/// The names of topics as a node of this name sees them, each once, an arrow before the first.
fn arrowed<'t>(arrow: &str, node: &str, topics: impl Iterator<Item = &'t str>) -> Vec<String> {
    let mut seen = BTreeSet::new();
    let topics = topics.filter(|topic| seen.insert(*topic));
    let mut names: Vec<String> = topics
        .map(|topic| relative(topic, node).to_owned())
        .collect();
    if let Some(first) = names.first_mut() {
        first.insert_str(0, &format!("{arrow} "));
    }
    names
}

/// A topic's name inside the namespace of a node.
pub(crate) fn relative<'t>(topic: &'t str, node: &str) -> &'t str {
    let inside = topic.strip_prefix(namespace(node).trim_end_matches('/'));
    let inside = inside.and_then(|inside| inside.strip_prefix('/'));
    inside.unwrap_or_else(|| topic.strip_prefix('/').unwrap_or(topic))
}

// The order of rows: by namespace, as a staircase of beginnings; or joined, a row for all that begin and end together.

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
        self.hz = self.hz.into_iter().chain(other.hz).reduce(|a, b| a + b);
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
