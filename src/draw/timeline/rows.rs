//! A row per node or topic: the times at which it existed and published, and its rates. Lifetimes and rates are
//! those of the mission's history; the height of a bar only changes where the log has another rate.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::marks::{RowMark, marked};
use super::source::FigureSource;
use crate::base::name::namespace;
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::evidence::Confidence;
use crate::graph::history::{Sender, Sending, Stretch};
use crate::graph::{ById, EdgeId, Element, NodeId, TopicId};
use crate::mission::rates::{Piece, Rates, silence, steps};

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
