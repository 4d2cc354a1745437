//! A row per node or topic: the times at which it existed and published, and its rates. Lifetimes and rates are
//! those of the mission's history; the height of a bar only changes where the log has another rate.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::marks::{RowMark, marked};
use super::source::FigureSource;
use crate::base::name::namespace;
use crate::base::time::{Span, Stamp};
use crate::evidence::Confidence;
use crate::graph::history::{Sender, Stretch};
use crate::graph::{ById, EdgeId, Element, NodeId, TopicId};
use crate::mission::event_log::Kind;

/// The length above which a silence visibly interrupts a bar: in nanoseconds, and as a fraction of the
/// mission (one in so many).
const SILENCE: (i64, i64) = (4_000_000_000, 83);
/// The shortest visible piece of a bar, as a fraction of the mission (one in so many). Shorter ones join the
/// previous one.
const SEEN: i64 = 400;

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
    /// Messages per second while it publishes; `None` if it never does, or if that is unknown.
    pub(crate) hz: Option<f64>,
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
    let (steps, elements) = (Steps::new(source), &source.mission.elements);
    let mut received = ById::like(&elements.nodes, BTreeSet::new());
    for edge in &elements.subscribes {
        if source.shows(edge.topic) && !source.is_hub(edge.topic) {
            received[edge.node].insert(source.topic(edge.topic));
        }
    }
    let row = |(role, nodes): (&Arc<str>, &Vec<NodeId>)| {
        let publications = source.publications(nodes);
        let elements: Vec<Element> = nodes.iter().map(|id| Element::Node(*id)).collect();
        let own = row(source, &steps, &elements, &source.senders(&publications));
        Row {
            name: Arc::clone(role),
            nodes: nodes.clone(),
            beside: [
                arrowed(
                    "→",
                    role,
                    sent_by(source, &steps, &publications).into_iter(),
                ),
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
    let steps = Steps::new(source);
    let row = |id: TopicId| {
        let senders: Vec<&Sender> = source.mission.sending.of_topic(id).iter().collect();
        let topic = source.mission.elements.topics.get(id);
        let types = topic.map(|topic| topic.types.iter().map(ToString::to_string).collect());
        Row {
            name: source.topic(id).into(),
            topic: Some(id),
            beside: [Vec::new(), types.unwrap_or_default()],
            ..row(source, &steps, &[Element::Topic(id)], &senders)
        }
    };
    let rows = source.shown_topics().map(row);
    let rows = rows.filter(|row| !row.lives.is_empty() && !row.bars.is_empty());
    marked(source, rows.collect())
}

/// The row of some elements drawn as one, without its name.
fn row(source: &FigureSource<'_>, steps: &Steps, elements: &[Element], senders: &[&Sender]) -> Row {
    let whole = source.span();
    let lives = elements.iter().flat_map(|what| source.lives(*what));
    let lives = Span::joined(lives.collect(), 0);
    let confidence = elements.iter().map(|what| source.confidence(*what)).min();
    let rates: Vec<Vec<Piece>> = senders.iter().map(|s| steps.pieces(s, whole)).collect();
    let hz = rates.iter().filter_map(|pieces| mean(pieces));
    let hz = hz.reduce(|a, b| a + b);
    let pieces = summed(&rates, whole);
    let most = pieces.iter().map(|piece| piece.hz).fold(0.0, f64::max);
    let share = |hz: f64| if most > 0.0 { hz / most } else { 1.0 };
    let bar = |piece: &Piece| SendingBar::new(piece.span, share(piece.hz));
    let mut bars: Vec<SendingBar> = pieces.iter().map(bar).collect();
    if let (Some(life), Some(bar)) = (lives.last(), bars.last_mut())
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
        ..Row::default()
    }
}

/// The topics of some publications that tell something about their nodes, the fastest first.
fn sent_by<'s>(source: &'s FigureSource<'_>, steps: &Steps, edges: &[EdgeId]) -> Vec<&'s str> {
    let rated = |edge: &EdgeId| {
        let topic = source.mission.elements.publishes.get(*edge)?.topic;
        let senders = source.senders(&[*edge]);
        let hz = senders
            .first()
            .and_then(|s| mean(&steps.pieces(s, source.span())));
        (!source.is_hub(topic)).then_some((hz.unwrap_or(0.0), source.topic(topic)))
    };
    let mut rated: Vec<(f64, &str)> = edges.iter().filter_map(rated).collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
    rated.into_iter().map(|(_, name)| name).collect()
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

fn silence(whole: Span) -> i64 {
    SILENCE.0.max(whole.nanos() / SILENCE.1)
}

/// An interval at one rate, in messages per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    pub(crate) span: Span,
    pub(crate) hz: f64,
}

/// The times at which the log has steps of rates, by topic and node.
pub(crate) struct Steps(BTreeSet<(TopicId, Option<NodeId>, Stamp)>);

impl Steps {
    pub(crate) fn new(source: &FigureSource<'_>) -> Self {
        let events = source.mission.log.events.iter();
        let steps = events.filter(|e| e.kind == Kind::Rate).filter_map(|e| {
            let (node, topic) = source.mission.elements.ends(e.what);
            Some((topic?, node, e.time))
        });
        Self(steps.collect())
    }

    fn has(&self, sender: &Sender, at: Stamp) -> bool {
        let is = |node| self.0.contains(&(sender.topic, node, at));
        is(sender.node) || is(None)
    }

    /// The rates of a sender: its stretches, joined unless a step of the log or a long silence separates
    /// them.
    pub(crate) fn pieces(&self, sender: &Sender, whole: Span) -> Vec<Piece> {
        let least = silence(whole);
        let parts =
            |a: &Stretch, b: &Stretch| !self.has(sender, b.first) && b.first.since(a.last) < least;
        let runs = sender.stretches.chunk_by(parts);
        let piece = |run: &[Stretch]| {
            let (start, end) = (run.first()?.first, run.last()?.last);
            let nanos = end.since(start);
            let count: u64 = run.iter().fold(0, |n, s| n.saturating_add(s.count));
            let mean = count.saturating_sub(1) as f64 * 1e9 / nanos.max(1) as f64;
            Some(Piece {
                span: Span::new(start, end.plus(1)),
                hz: match run {
                    [one] => one.hz(),
                    _ if nanos > 0 => mean,
                    _ => 0.0,
                },
            })
        };
        runs.filter_map(piece).collect()
    }
}

/// The mean rate over the bars; `None` if they have no length.
pub(crate) fn mean(pieces: &[Piece]) -> Option<f64> {
    let seconds = |p: &Piece| (p.span.nanos() - 1) as f64 / 1e9;
    let time: f64 = pieces.iter().map(seconds).sum();
    let count: f64 = pieces.iter().map(|p| p.hz * seconds(p)).sum();
    (time > 1e-3).then(|| count / time)
}

/// The sum of several rates over time. Pieces too short to be visible belong to their neighbours, and so do silences.
fn summed(rates: &[Vec<Piece>], whole: Span) -> Vec<Piece> {
    // The changes of the rate, and of the number of senders.
    let mut turns: BTreeMap<Stamp, (f64, i64)> = BTreeMap::new();
    for piece in rates.iter().flatten() {
        for (at, sign) in [(piece.span.start, 1), (piece.span.end, -1)] {
            let turn = turns.entry(at).or_default();
            *turn = (turn.0 + piece.hz * sign as f64, turn.1 + sign);
        }
    }
    let is_short = |span: Span| span.nanos() < whole.nanos() / SEEN;
    let mut found: Vec<Piece> = Vec::new();
    let (mut hz, mut many) = (0.0, 0);
    for ((at, turn), end) in turns.iter().zip(turns.keys().skip(1)) {
        (hz, many) = (hz + turn.0, many + turn.1);
        let new = Piece {
            span: Span::new(*at, *end),
            hz: f64::max(hz, 0.0),
        };
        let before = found.last_mut();
        match before.filter(|last| at.since(last.span.end) < silence(whole)) {
            _ if many == 0 => {}
            Some(last) if same(last.hz, new.hz) || is_short(new.span) => last.span.end = *end,
            Some(last) if is_short(last.span) => (last.span.end, last.hz) = (*end, new.hz),
            Some(last) => {
                last.span.end = *at;
                found.push(new);
            }
            None => found.push(new),
        }
    }
    found
}

/// Whether two rates cannot be distinguished as heights of bars.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 0.01 * a.max(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn span(from: i64, to: i64) -> Span {
        Span::new(Stamp(from * SECOND), Stamp(to * SECOND))
    }

    fn reported(rates: &[&[(i64, i64, f64)]]) -> Vec<(i64, i64, f64)> {
        let pieces = |all: &&[(i64, i64, f64)]| {
            let piece = |(from, to, hz): &(i64, i64, f64)| Piece {
                span: span(*from, *to),
                hz: *hz,
            };
            all.iter().map(piece).collect::<Vec<Piece>>()
        };
        let rates: Vec<Vec<Piece>> = rates.iter().map(pieces).collect();
        let second = |at: Stamp| at.0 / SECOND;
        let all = summed(&rates, span(0, 800)).into_iter();
        all.map(|p| (second(p.span.start), second(p.span.end), libm::round(p.hz)))
            .collect()
    }

    #[test]
    fn rates_add_up_while_they_overlap() {
        let found = reported(&[&[(0, 100, 10.0)], &[(50, 200, 5.0)]]);
        assert_eq!(found, [(0, 50, 10.0), (50, 100, 15.0), (100, 200, 5.0)]);
    }

    #[test]
    fn invisibly_short_runs_are_not_steps() {
        let found = reported(&[&[(0, 100, 10.0)], &[(1, 100, 5.0)]]);
        assert_eq!(found, [(0, 100, 15.0)]);
        let found = reported(&[&[(0, 100, 10.0), (103, 200, 10.0)]]);
        assert_eq!(found, [(0, 200, 10.0)]);
        let found = reported(&[&[(0, 100, 10.0), (150, 200, 10.0)]]);
        assert_eq!(found, [(0, 100, 10.0), (150, 200, 10.0)]);
    }
}
