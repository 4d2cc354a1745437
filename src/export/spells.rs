//! Every node, topic and edge of a mission with the times at which it exists, for the graph formats of other tools.

use crate::base::time::Span;
use crate::base::words::visible;
use crate::evidence::Confidence;
use crate::graph::Element;
use crate::mission::Mission;

/// A node, a topic or an edge.
pub(super) struct SpellOf {
    /// Its unique name in the file.
    pub(super) id: String,
    /// The label for people.
    pub(super) label: String,
    /// `node`, `topic`, `publish` or `subscribe`.
    pub(super) kind: &'static str,
    /// The names of both ends of an edge; empty for others.
    pub(super) ends: (String, String),
    /// Its best confidence.
    pub(super) confidence: Confidence,
    /// Its kinds of evidence, separated by spaces.
    pub(super) evidence: String,
    /// Messages in all windows; `None` if unknown.
    pub(super) messages: Option<u64>,
    /// Its lifetimes, in order.
    pub(super) spells: Vec<Span>,
    /// Its rate in messages per second over each run of windows of one rate.
    pub(super) rates: Vec<(Span, f64)>,
}

/// Nodes and topics, then edges, all in the order of the mission's elements.
pub(super) fn parts(mission: &Mission) -> (Vec<SpellOf>, Vec<SpellOf>) {
    let all = mission.elements.all();
    let all = all.map(|what| SpellOf::new(mission, what));
    all.partition(|part| part.ends.0.is_empty())
}

impl SpellOf {
    fn new(mission: &Mission, what: Element) -> Self {
        let elements = &mission.elements;
        let (node, topic) = elements.ends(what);
        let node = node.map(|id| visible(elements.nodes[id].name.as_str()));
        let topic = topic.map(|id| visible(elements.topics[id].name.as_str()));
        let node_id = format!("node:{}", node.as_deref().unwrap_or_default());
        let topic_id = format!("topic:{}", topic.as_deref().unwrap_or_default());
        let (id, label, ends) = match what {
            Element::Node(_) => (node_id, node.unwrap_or_default().into_owned(), None),
            Element::Topic(_) => (topic_id, topic.unwrap_or_default().into_owned(), None),
            Element::Publish(_) => (
                format!("publish:{node_id} {topic_id}"),
                "publishes".to_owned(),
                Some((node_id, topic_id)),
            ),
            Element::Subscribe(_) => (
                format!("subscribe:{topic_id} {node_id}"),
                "is subscribed by".to_owned(),
                Some((topic_id, node_id)),
            ),
        };
        let inside = |life: &Span| {
            Span::new(
                life.start.max(mission.span.start),
                life.end.min(mission.span.end),
            )
        };
        let lives = elements.seen(what).lives.iter().map(inside);
        let mut all = Self {
            id,
            label,
            kind: what.word(),
            ends: ends.unwrap_or_default(),
            confidence: Confidence::Declared,
            evidence: elements
                .evidence(what)
                .words()
                .collect::<Vec<_>>()
                .join(" "),
            messages: None,
            spells: lives.filter(|life| life.start < life.end).collect(),
            rates: Vec::new(),
        };
        for (at, row) in mission.graphs.rows(what) {
            let span = mission.graphs.spans()[at];
            all.confidence = all.confidence.min(row.confidence);
            // A node's count is that of its topics' messages.
            if let (Some(count), false) = (row.count, what.is_node()) {
                *all.messages.get_or_insert(0) += count;
            }
            if let Some(hz) = row.hz(span) {
                all.sends(span, hz);
            }
        }
        all
    }

    /// Adds the rate in one more window, later than all before.
    fn sends(&mut self, span: Span, hz: f64) {
        match self.rates.last_mut() {
            // Compares bits, as the numbers must be identical.
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
