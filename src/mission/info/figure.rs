//! The choice of figures for a paper: the first fits the mission best, the others complement it.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::base::name::is_quiet;
use crate::base::time::Span;
use crate::base::words;
use crate::graph::{Edge, Element, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::{Detail, Phase};
use crate::mission::phases::knows_publishers;

/// A figure that fits a mission.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FigureInfo {
    /// The word of `bagreel figure --kind`.
    pub figure: &'static str,
    /// The content of the figure, and its amount.
    pub shows: String,
}

impl FigureInfo {
    fn of(figure: &'static str, shows: String) -> Self {
        Self { figure, shows }
    }
}

/// The figures that fit, best first: lifelines if elements start or stop, else the graph if edges are known.
pub(crate) fn figures(mission: &Mission) -> Vec<FigureInfo> {
    let many = mission.log.phases.len();
    let fitting = [
        lives(mission),
        graph(mission),
        holders(mission),
        steps(mission),
    ];
    let mut all: Vec<FigureInfo> = fitting.into_iter().flatten().collect();
    if many <= 1 {
        all.sort_by_key(|f| f.figure != "graph");
    }
    all
}

fn lives(mission: &Mission) -> Option<FigureInfo> {
    let elements = &mission.elements;
    let shown = elements.nodes.iter().filter(|n| !n.is_tool());
    let roles: BTreeSet<&str> = shown.map(|n| &*n.role).collect();
    let topics = elements.topics.iter();
    let topics = topics.filter(|t| !is_quiet(t.name.as_str())).count();
    let lives = if knows_publishers(elements, &mission.sending) && !roles.is_empty() {
        format!(
            "when each element was running: {}",
            words::count(roles.len(), "node")
        )
    } else {
        let topics = words::count(topics, "topic");
        format!("when each topic carried messages: {topics}, most without a known publisher")
    };
    (topics > 0).then(|| FigureInfo::of("lives", lives))
}

fn graph(mission: &Mission) -> Option<FigureInfo> {
    let elements = &mission.elements;
    let is_shown = |topic: &TopicId| !is_quiet(elements.topics[*topic].name.as_str());
    let topics = |edges: &[Edge]| -> BTreeSet<TopicId> {
        let shown = edges.iter().filter(|e| !elements.nodes[e.node].is_tool());
        shown.map(|e| e.topic).filter(is_shown).collect()
    };
    let (sent, subscribed) = (topics(&elements.publishes), topics(&elements.subscribes));
    let both = sent.intersection(&subscribed).count();
    let many = words::count(both, "topic");
    let shows = format!("who publishes to whom, and when: over {many}");
    (both > 0).then(|| FigureInfo::of("graph", shows))
}

fn holders(mission: &Mission) -> Option<FigureInfo> {
    let events = mission.log.events.iter().filter(|event| !event.quiet);
    let topics = events.filter_map(|event| match &event.detail {
        Detail::Senders { from, to } if !from.is_empty() && !to.is_empty() => Some(event.what),
        _ => None,
    });
    let topics: BTreeSet<Element> = topics.collect();
    let many = words::count(topics.len(), "topic");
    let shows = format!("who sends what, and when nobody does: {many} that change hands");
    (!topics.is_empty()).then(|| FigureInfo::of("holders", shows))
}

/// A step lasts from the middle of a phase to that of the next one, and shows the nodes that start, stop or take over in it.
fn steps(mission: &Mission) -> Option<FigureInfo> {
    let middle = |phase: &Phase| phase.span.start.plus(phase.span.nanos() / 2);
    let is_step = |pair: &&[Phase]| {
        let span = Span::new(middle(&pair[0]), middle(&pair[1]));
        let mut all = mission.log.headlines(span).map(|(_, event)| event);
        all.any(|e| e.what.is_node() || matches!(e.detail, Detail::Senders { .. }))
    };
    let many = mission.log.phases.windows(2).filter(is_step).count();
    let words = words::count(many, "step");
    let shows = format!("the reconfigurations one by one: {words}");
    (many > 0).then(|| FigureInfo::of("steps", shows))
}
