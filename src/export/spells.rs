//! Every node, topic and edge of a mission with the times in which it is there, for the graph formats of other tools.

use crate::base::time::Span;
use crate::base::words::visible;
use crate::evidence::{Degree, Evidence};
use crate::graph::Edge;
use crate::mission::{Mission, Window};

/// A node, a topic or an edge.
pub(super) struct SpellOf {
    /// Its name in the file, which no other one has.
    pub(super) id: String,
    /// The label for people.
    pub(super) label: String,
    /// `node`, `topic`, `publish` or `subscribe`.
    pub(super) kind: &'static str,
    /// The names of both ends of an edge; empty for others.
    pub(super) ends: (String, String),
    /// The strongest degree to which it is known.
    pub(super) degree: Degree,
    /// The words of its evidence, separated by blanks.
    pub(super) evidence: String,
    /// Messages in all windows; `None` where not known.
    pub(super) messages: Option<u64>,
    /// The times in which it is there: runs of windows, in order.
    pub(super) spells: Vec<Span>,
    /// Its rate in messages per second over each run of windows of one rate.
    pub(super) rates: Vec<(Span, f64)>,
}

/// The state of an element in one window.
struct SeenInWindow {
    id: u32,
    degree: Degree,
    count: Option<u64>,
    hz: Option<f64>,
}

/// Nodes and topics, then edges, all in the order of the mission's elements.
pub(super) fn parts(mission: &Mission) -> (Vec<SpellOf>, Vec<SpellOf>) {
    let elements = &mission.elements;
    let node = |name: &str| format!("node:{}", visible(name));
    let topic = |name: &str| format!("topic:{}", visible(name));
    let ends = |edge: &Edge| {
        (
            node(elements.nodes[edge.node as usize].name.as_str()),
            topic(elements.topics[edge.topic as usize].name.as_str()),
        )
    };
    let plain = |id: String, name: &str, kind, evidence| {
        let label = visible(name).into_owned();
        SpellOf::new(id, label, kind, Default::default(), evidence)
    };
    let nodes = elements.nodes.iter().map(|n| {
        let name = n.name.as_str();
        plain(node(name), name, "node", n.evidence)
    });
    let topics = elements.topics.iter().map(|t| {
        let name = t.name.as_str();
        plain(topic(name), name, "topic", t.evidence)
    });
    let publishes = elements.publishes.iter().map(|edge| {
        let (node, topic) = ends(edge);
        let id = format!("publish:{node} {topic}");
        let label = "publishes".to_owned();
        SpellOf::new(id, label, "publish", (node, topic), edge.evidence)
    });
    let subscribes = elements.subscribes.iter().map(|edge| {
        let (node, topic) = ends(edge);
        let id = format!("subscribe:{topic} {node}");
        let label = "is subscribed by".to_owned();
        SpellOf::new(id, label, "subscribe", (topic, node), edge.evidence)
    });
    let mut nodes: Vec<SpellOf> = nodes.collect();
    let mut topics: Vec<SpellOf> = topics.collect();
    let mut publishes: Vec<SpellOf> = publishes.collect();
    let mut subscribes: Vec<SpellOf> = subscribes.collect();
    for (window, graph) in mission.each() {
        let seen = |id, degree, count, hz| SeenInWindow {
            id,
            degree,
            count,
            hz,
        };
        add(
            &mut nodes,
            window,
            graph.nodes.iter().map(|s| seen(s.id, s.degree, None, s.hz)),
        );
        add(
            &mut topics,
            window,
            graph
                .topics
                .iter()
                .map(|s| seen(s.id, s.degree, Some(s.count), s.hz)),
        );
        add(
            &mut publishes,
            window,
            graph
                .publishes
                .iter()
                .map(|s| seen(s.id, s.degree, s.count, s.hz)),
        );
        add(
            &mut subscribes,
            window,
            graph
                .subscribes
                .iter()
                .map(|s| seen(s.id, s.degree, s.count, s.hz)),
        );
    }
    nodes.extend(topics);
    publishes.extend(subscribes);
    (nodes, publishes)
}

fn add(parts: &mut [SpellOf], window: &Window, seen: impl Iterator<Item = SeenInWindow>) {
    for seen in seen {
        parts[seen.id as usize].add(window.span, &seen);
    }
}

impl SpellOf {
    fn new(
        id: String,
        label: String,
        kind: &'static str,
        ends: (String, String),
        evidence: Evidence,
    ) -> Self {
        Self {
            id,
            label,
            kind,
            ends,
            degree: Degree::Declared,
            evidence: evidence.words().collect::<Vec<_>>().join(" "),
            messages: None,
            spells: Vec::new(),
            rates: Vec::new(),
        }
    }

    /// Adds one more window in which it is there, later than all before.
    fn add(&mut self, span: Span, seen: &SeenInWindow) {
        self.degree = self.degree.min(seen.degree);
        if let Some(count) = seen.count {
            *self.messages.get_or_insert(0) += count;
        }
        match self.spells.last_mut() {
            Some(last) if span.start <= last.end => last.end = span.end,
            _ => self.spells.push(span),
        }
        let Some(hz) = seen.hz else { return };
        match self.rates.last_mut() {
            // The bits, since equal means the same number here.
            Some((last, rate)) if rate.to_bits() == hz.to_bits() && span.start <= last.end => {
                last.end = span.end;
            }
            Some((last, _)) if span.start < last.end => {
                last.end = span.start;
                self.rates.push((span, hz));
            }
            _ => self.rates.push((span, hz)),
        }
    }
}
