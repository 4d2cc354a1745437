//! The rows of a figure of lives: the times at which each node or topic was there and sent, and how busily.

use std::sync::Arc;

use super::levels::levels;
use super::source::{FigureSource, merged};
use crate::base::time::{Span, Stamp};
use crate::evidence::Degree;
use crate::graph::{Element, NodeId, TopicId};

/// The length from which on a silence interrupts a bar: in nanoseconds, and as one in so many parts of the mission.
const SILENCE: (i64, i64) = (4_000_000_000, 83);
/// The price of a step of a rate: as much as an octave held for one in this many parts of the mission.
const STEP: f64 = 20.0;
/// The least time that a step holds: one in this many parts of the mission.
const SHORTEST_STEP: usize = 25;
/// The time from the start within which a node first seen counts as there before: in nanoseconds, and as one in so many
/// parts of the mission.
const PRESENT: (i64, i64) = (1_000_000_000, 330);
/// The last part of the mission, one in this many: a node that ends in it was cut off by the end of the recording.
const CUT: i64 = 50;
/// The number of messages that make a rate; cells are put together until they hold as many.
const ENOUGH: f64 = 6.0;

/// One life of a row: a time in which it was there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrackLife {
    pub(crate) span: Span,
    /// Whether it began during the recording.
    pub(crate) begins: bool,
    /// Whether it ended during the recording.
    pub(crate) ends: bool,
    /// Whether it is known by inference only.
    pub(crate) is_inferred: bool,
}

/// A stretch of sending at one rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SendingBar {
    pub(crate) span: Span,
    /// Its share of the row's highest rate, above 0 to 1.
    pub(crate) share: f64,
}

/// One row of a figure of lives.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Track {
    /// The full name: a role, or a topic.
    pub(crate) name: Arc<str>,
    pub(crate) nodes: Vec<NodeId>,
    pub(crate) topic: Option<TopicId>,
    pub(crate) lives: Vec<TrackLife>,
    pub(crate) bars: Vec<SendingBar>,
    /// Messages per second while it sends; `None` where it never does, or where that is not known.
    pub(crate) hz: Option<f64>,
}

impl Track {
    pub(crate) fn start(&self) -> Stamp {
        self.lives.first().map_or(Stamp::MAX, |l| l.span.start)
    }

    pub(crate) fn end(&self) -> Stamp {
        self.lives.last().map_or(Stamp::MIN, |l| l.span.end)
    }
}

/// A row per role.
pub(crate) fn of_nodes(source: &FigureSource<'_>) -> Vec<Track> {
    let roles = source.roles.iter();
    let tracks = roles.map(|(role, nodes)| node(source, role, nodes));
    tracks.filter(|t| !t.lives.is_empty()).collect()
}

/// A row per topic that carried a message.
pub(crate) fn of_topics(source: &FigureSource<'_>) -> Vec<Track> {
    let tracks = source.shown_topics().map(|t| topic(source, t));
    tracks.filter(|t| !t.lives.is_empty()).collect()
}

fn node(source: &FigureSource<'_>, role: &Arc<str>, nodes: &[NodeId]) -> Track {
    let edges = source.publications(nodes);
    let whole = source.span();
    let mut spans = Vec::new();
    let mut sent = vec![0.0; source.mission.activity.cells().len()];
    let mut rates = Vec::new();
    for edge in edges {
        let sending = source.sending(edge);
        if sending.is_empty() {
            continue;
        }
        let own = source.sent(edge);
        for (sum, count) in sent.iter_mut().zip(&own) {
            *sum += count;
        }
        rates.extend(rate(&own, &sending));
        spans.extend(sending);
    }
    let sends = merged(spans, silence(whole));
    let lives = lives(source, nodes, &sends);
    let mut bars = bars(source, &sends, &sent);
    if let (Some(life), Some(bar)) = (lives.last(), bars.last_mut())
        && !life.ends
        && life.span.end.since(bar.span.end) <= silence(whole)
    {
        // The recording ended between two messages.
        bar.span.end = life.span.end;
    }
    Track {
        name: Arc::clone(role),
        nodes: nodes.to_vec(),
        topic: None,
        lives,
        bars,
        hz: rates.into_iter().reduce(|a, b| a + b),
    }
}

fn topic(source: &FigureSource<'_>, id: TopicId) -> Track {
    let whole = source.span();
    let sends = merged(source.topic_sending(id), silence(whole));
    let sent = source.topic_sent(id);
    let kept = source.topic_kept(id);
    let all = sends.first().zip(sends.last()).map(|(first, last)| Span {
        start: first.start,
        end: kept.map_or(last.end, |kept| kept.max(last.end)),
    });
    let life = |span: Span| capped(span, whole, false);
    Track {
        name: source.topic(id).into(),
        nodes: Vec::new(),
        topic: Some(id),
        lives: all.into_iter().map(life).collect(),
        hz: rate(&sent, &sends),
        bars: bars(source, &sends, &sent),
    }
}

pub(crate) fn silence(whole: Span) -> i64 {
    SILENCE.0.max(whole.nanos() / SILENCE.1)
}

/// Messages per second while they came; `None` where there are fewer than two or no time passes.
fn rate(sent: &[f64], spans: &[Span]) -> Option<f64> {
    let seconds: f64 = spans.iter().map(|s| s.nanos() as f64 / 1e9).sum();
    let count: f64 = sent.iter().sum();
    (count >= 2.0 && seconds > 1e-3).then(|| count / seconds)
}

fn capped(span: Span, whole: Span, is_inferred: bool) -> TrackLife {
    let present = PRESENT.0.max(whole.nanos() / PRESENT.1);
    TrackLife {
        span,
        begins: span.start.since(whole.start) > present,
        ends: whole.end.since(span.end) > whole.nanos() / CUT,
        is_inferred,
    }
}

/// The lives of some nodes that are one role: runs of cells, their ends sharpened by exact signs.
fn lives(source: &FigureSource<'_>, nodes: &[NodeId], sends: &[Span]) -> Vec<TrackLife> {
    let activity = &source.mission.activity;
    let cells = activity.cells();
    let mut known: Vec<Option<Degree>> = vec![None; cells.len()];
    for (at, row) in nodes
        .iter()
        .flat_map(|id| activity.graphs.rows(Element::Node(*id)))
    {
        known[at] = known[at].into_iter().chain([row.degree]).min();
    }
    let elements = &source.mission.elements;
    let of = |id: &NodeId| elements.nodes.get(*id as usize);
    let firsts = nodes.iter().filter_map(of).filter_map(|n| n.first);
    let lasts = nodes.iter().filter_map(of).filter_map(|n| n.last);
    let starts: Vec<Stamp> = firsts.chain(sends.iter().map(|s| s.start)).collect();
    let ends: Vec<Stamp> = lasts.chain(sends.iter().map(|s| s.end)).collect();
    let step = activity.step();
    let whole = source.span();
    let runs = source.runs(known.iter().map(Option::is_some));
    let sharpened = runs.into_iter().map(|run| {
        let near = |at: &&Stamp| at.since(run.start) >= 0 && at.since(run.start) <= step;
        let start = starts.iter().filter(near).min().copied();
        let near = |at: &&Stamp| run.end.since(**at) >= 0 && run.end.since(**at) <= step;
        let end = ends.iter().filter(near).max().copied();
        let span = Span {
            start: start.unwrap_or(run.start),
            end: end.unwrap_or(run.end),
        };
        let inside = cells
            .iter()
            .zip(&known)
            .filter(|(cell, _)| run.contains(cell.start));
        let (mut all, mut inferred) = (0, 0);
        for (_, degree) in inside {
            all += 1;
            inferred += usize::from(degree.is_some_and(|d| d >= Degree::Inferred));
        }
        capped(span, whole, inferred * 2 > all && sends.is_empty())
    });
    sharpened.filter(|l| l.span.nanos() > 0).collect()
}

/// The bars of a row: its stretches of sending, cut where the rate makes a step.
fn bars(source: &FigureSource<'_>, sends: &[Span], sent: &[f64]) -> Vec<SendingBar> {
    let mut all: Vec<SendingBar> = Vec::new();
    for stretch in sends {
        all.extend(steps(source, *stretch, sent));
    }
    let most = all.iter().map(|b| b.share).fold(0.0, f64::max);
    for bar in &mut all {
        bar.share = if most > 0.0 { bar.share / most } else { 1.0 };
    }
    all
}

/// One stretch of sending as pieces of one rate each; their `share` is that rate.
pub(crate) fn steps(source: &FigureSource<'_>, stretch: Span, sent: &[f64]) -> Vec<SendingBar> {
    let cells = source.mission.activity.cells();
    let from = cells.partition_point(|cell| cell.end <= stretch.start);
    let to = cells.partition_point(|cell| cell.start < stretch.end);
    let cells = &cells[from.min(to)..to];
    let sent = &sent[from.min(to)..to];
    let seconds = |k: usize| overlap(cells[k], stretch).max(1) as f64 / 1e9;
    let count: f64 = sent.iter().sum();
    let reach = libm::ceil(ENOUGH / (count / cells.len().max(1) as f64).max(1e-6));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most the cells"
    )]
    let reach = (reach.clamp(1.0, cells.len().max(1) as f64) as usize - 1) / 2;
    let rates: Vec<f64> = (0..cells.len())
        .map(|k| {
            let around = k.saturating_sub(reach)..(k + reach + 1).min(cells.len());
            let time: f64 = around.clone().map(seconds).sum();
            (sent[around].iter().sum::<f64>() / time).max(1e-3)
        })
        .collect();
    let all = source.mission.activity.cells().len();
    let level = levels(&rates, all as f64 / STEP, (all / SHORTEST_STEP).max(1));
    let mut at = 0;
    let mut bars = Vec::new();
    for run in level.chunk_by(|a, b| a.total_cmp(b).is_eq()) {
        let end = at + run.len();
        let time: f64 = (at..end).map(seconds).sum();
        bars.push(SendingBar {
            span: Span {
                start: cells[at].start.max(stretch.start),
                end: cells[end - 1].end.min(stretch.end),
            },
            share: sent[at..end].iter().sum::<f64>() / time,
        });
        at = end;
    }
    bars
}

fn overlap(a: Span, b: Span) -> i64 {
    a.end.min(b.end).since(a.start.max(b.start))
}
