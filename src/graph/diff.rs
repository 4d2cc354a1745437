//! The changes from one graph to the next: exact differences, and the reconfigurations that they amount to.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::base::time::{Span, Stamp};
use crate::base::words::worded;
use crate::graph::{ById, Element, ElementState, Elements, Graph, NodeId, State, TopicId};

/// A reconfiguration, as in JSON and the log of events.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Change {
    /// An element that was not in the previous window.
    Added {
        /// The element.
        what: Element,
        /// The time of its first sign in the window, if known.
        time: Option<Stamp>,
    },
    /// An element that was in the previous window and is not in this one.
    Removed {
        /// The element.
        what: Element,
        /// The time of its last sign, if known.
        time: Option<Stamp>,
    },
    /// The rate of a topic or publication changed by more than the threshold.
    Rate {
        /// The topic or publication.
        what: Element,
        /// Messages per second in the previous window.
        from_hz: f64,
        /// Messages per second in this window.
        to_hz: f64,
    },
    /// All publishers of a topic were replaced by others.
    HandedOver {
        /// The topic.
        topic: TopicId,
        /// The publishers before, sorted.
        from: Vec<NodeId>,
        /// The publishers now, sorted.
        to: Vec<NodeId>,
    },
    /// A node that restarted under the same name.
    Restarted {
        /// The node.
        node: NodeId,
        /// The time at which it was first seen again.
        time: Stamp,
    },
    /// A value of an element changed.
    Value {
        /// The kind of value.
        kind: ValueKind,
        /// The element.
        what: Element,
        /// The value before, empty if none.
        from: Arc<str>,
        /// The value now, empty if none.
        to: Arc<str>,
    },
}

impl Change {
    /// The word for the change's kind in JSON and in the log of events.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Added { .. } => "added",
            Self::Removed { .. } => "removed",
            Self::Rate { .. } => "rate",
            Self::HandedOver { .. } => "handed_over",
            Self::Restarted { .. } => "restarted",
            Self::Value { kind, .. } => kind.word(),
        }
    }
}

worded! {
    /// The kinds of values in [`Change::Value`].
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ValueKind {
        /// The types of a topic.
        Type = "type",
        /// The quality of service of a topic.
        Qos = "qos",
        /// The lifecycle state of a node.
        Lifecycle = "lifecycle",
    }
}

/// The exact difference between two graphs: applied to the first it gives the second. Each list is sorted by element.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diff {
    /// States of new elements.
    pub added: Vec<ElementState>,
    /// Removed elements.
    pub removed: Vec<Element>,
    /// States before and after of elements that differ.
    pub changed: Vec<(ElementState, ElementState)>,
}

/// The difference from `before` to `after`.
pub fn diff(before: &Graph, after: &Graph) -> Diff {
    let mut diff = Diff::default();
    let mut old = before.states.iter().peekable();
    for new in &after.states {
        while let Some(gone) = old.next_if(|old| old.what < new.what) {
            diff.removed.push(gone.what);
        }
        match old.next_if(|old| old.what == new.what) {
            Some(old) if old == new => {}
            Some(old) => diff.changed.push((old.clone(), new.clone())),
            None => diff.added.push(new.clone()),
        }
    }
    diff.removed.extend(old.map(|gone| gone.what));
    diff
}

// Reconfigurations from differences: thresholds for rates, hand-overs, and hints from the evidence.

/// The default share by which a rate must change to count as changed: nodes under load vary by a tenth, and a camera that is switched
/// to another mode changes by a third at least.
pub const RATE_CHANGE: f64 = 0.25;

/// A finder of the reconfigurations of a mission, window by window in order.
#[derive(Debug)]
pub struct Changes<'a> {
    elements: &'a Elements,
    /// The share by which a rate must change, ≥ 0.
    threshold: f64,
    before: Option<(Span, Graph)>,
    /// The interval in which each topic had publishers: from their first sign to the last.
    sent: ById<TopicId, (Option<Stamp>, Option<Stamp>)>,
    /// The nodes that last sent messages on each topic.
    senders: ById<TopicId, BTreeSet<NodeId>>,
}

impl<'a> Changes<'a> {
    /// A finder before the first window.
    pub fn new(elements: &'a Elements, threshold: f64) -> Self {
        Self {
            elements,
            threshold,
            before: None,
            sent: sent(elements),
            senders: ById::like(&elements.topics, BTreeSet::new()),
        }
    }

    /// The changes from the previous window to this one; none in the first, which is the base. `restarts` are
    /// nodes that restarted in it under the same name, and when.
    ///
    /// Order: added, removed, rates, hand-overs, restarts, values; each by kind of element and name.
    pub fn next(&mut self, span: Span, graph: &Graph, restarts: &[(NodeId, Stamp)]) -> Vec<Change> {
        let mut changes = Vec::new();
        if let Some((old_span, old)) = self.before.take() {
            let diff = diff(&old, graph);
            changes.extend(diff.added.iter().map(|state| Change::Added {
                what: state.what,
                time: (self.elements.seen(state.what).first).filter(|t| span.contains(*t)),
            }));
            changes.extend(diff.removed.iter().map(|what| Change::Removed {
                what: *what,
                time: (self.elements.seen(*what).last).filter(|t| *t < span.end),
            }));
            self.rates(&diff, graph, (old_span, span), &mut changes);
            self.handed_over(&old, graph, &mut changes);
            let again = restarts.iter().map(|(node, time)| Change::Restarted {
                node: *node,
                time: *time,
            });
            changes.extend(again);
            lifecycles(&diff, &mut changes);
        } else {
            self.handed_over(graph, graph, &mut Vec::new());
        }
        self.before = Some((span, graph.clone()));
        changes.retain(|change| !self.is_timeless(change));
        changes
    }

    /// Whether none of the evidence for an added or removed element has times.
    fn is_timeless(&self, change: &Change) -> bool {
        match change {
            Change::Added { what, .. } | Change::Removed { what, .. } => {
                self.elements.evidence(*what).is_timeless()
            }
            _ => false,
        }
    }

    fn rates(&self, diff: &Diff, graph: &Graph, spans: (Span, Span), changes: &mut Vec<Change>) {
        let mut steady = BTreeSet::new();
        let shared = self.shared(graph);
        for (old, new) in &diff.changed {
            let is_rated = match new.what {
                Element::Topic(id) => {
                    let secs = [spans.0, spans.1].map(|span| self.present(new.what, span));
                    let is_steady = is_steady(old, secs[0]) && is_steady(new, secs[1]);
                    is_steady && steady.insert(id)
                }
                Element::Publish(id) => {
                    let topic = self.elements.publishes[id].topic;
                    // With one publisher the topic's own change is sufficient.
                    shared.contains(&topic) && steady.contains(&topic)
                }
                Element::Node(_) | Element::Subscribe(_) => false,
            };
            if is_rated {
                changes.extend(self.rate(new.what, (old.hz, new.hz), spans));
            }
        }
    }

    /// The change of a rate, if it is one.
    fn rate(
        &self,
        what: Element,
        hz: (Option<f64>, Option<f64>),
        spans: (Span, Span),
    ) -> Option<Change> {
        let (from_hz, to_hz) = (hz.0?, hz.1?);
        let secs = self.present(what, spans.0).min(self.present(what, spans.1));
        rate_differs(from_hz, to_hz, secs, self.threshold).then_some(Change::Rate {
            what,
            from_hz,
            to_hz,
        })
    }

    /// The number of seconds of a window between an element's first and last sign.
    fn present(&self, what: Element, span: Span) -> f64 {
        let (first, last) = match what {
            Element::Topic(id) => self.sent[id],
            other => {
                let other = self.elements.seen(other);
                (other.first, other.last)
            }
        };
        let start = first.map_or(span.start, |at| at.max(span.start));
        let end = last.map_or(span.end, |at| at.plus(1).min(span.end));
        end.since(start).max(0) as f64 / 1e9
    }

    /// Topics with more than one publisher in this graph.
    fn shared(&self, graph: &Graph) -> BTreeSet<TopicId> {
        let mut seen = BTreeSet::new();
        let topics = graph.publishes();
        let topics = topics.map(|(id, _)| self.elements.publishes[id].topic);
        topics.filter(|topic| !seen.insert(*topic)).collect()
    }

    /// Adds hand-overs: a topic is taken over if none of the nodes that publish it now were the last to
    /// publish it.
    fn handed_over(&mut self, before: &Graph, after: &Graph, changes: &mut Vec<Change>) {
        for (topic, to) in self.sending(after).with_ids() {
            if to.is_empty() {
                continue;
            }
            let from = std::mem::replace(&mut self.senders[topic], to.clone());
            let other = !from.is_empty() && from.is_disjoint(to);
            if other
                && before.get(Element::Topic(topic)).is_some()
                && !self.elements.topics[topic].is_shared()
            {
                let (from, to) = (from.into_iter().collect(), to.iter().copied().collect());
                changes.push(Change::HandedOver { topic, from, to });
            }
        }
    }

    /// The nodes that sent messages on each topic in a window.
    fn sending(&self, graph: &Graph) -> ById<TopicId, BTreeSet<NodeId>> {
        let mut sending = ById::like(&self.elements.topics, BTreeSet::new());
        for (id, _) in graph.publishes().filter(|(_, s)| s.messages() > 0) {
            let edge = &self.elements.publishes[id];
            sending[edge.topic].insert(edge.node);
        }
        sending
    }
}

/// The fewest messages in the busier of two windows for a meaningful rate: of three or fewer, one that falls into the next window is
/// a change by a third.
const FEW: f64 = 3.5;

/// The ratio of the longest gap to the median period from which on a topic counts as irregular: two lost messages in a row make three.
const UNSTEADY: f64 = 4.0;

/// The share of the time that the median period must cover, message by message, for a topic to be regular. Topics that send bursts
/// cover a few hundredths; with a third of the messages lost, an even one still covers two thirds.
const COVERED: f64 = 0.6;

/// Whether a rate changed: by more than the share `threshold` of its earlier value, by more than the two
/// messages that two windows of the same jittering topic may differ by, and not on a topic too slow for
/// windows of `secs` seconds.
fn rate_differs(from: f64, to: f64, secs: f64, threshold: f64) -> bool {
    let by = (to - from).abs();
    by > threshold * from && by * secs > 2.2 && from.max(to) * secs > FEW
}

/// Whether a topic has a steady rate in a window of which it existed for `secs` seconds: not latched, and in
/// even steps all the time, as far as known.
fn is_steady(topic: &ElementState, secs: f64) -> bool {
    let even = match (topic.median_period_s, topic.max_gap_s) {
        (Some(median), Some(gap)) => {
            gap <= UNSTEADY * median && median * topic.messages() as f64 >= COVERED * secs
        }
        _ => true,
    };
    even && topic.state != State::Latched
}

/// The interval from the first to the last sign of each topic's publishers together; of the topic itself if
/// none is known.
fn sent(elements: &Elements) -> ById<TopicId, (Option<Stamp>, Option<Stamp>)> {
    let mut sent = ById::like(&elements.topics, (None, None));
    for edge in elements.publishes.iter().filter(|e| e.seen.first.is_some()) {
        let (first, last): &mut (Option<Stamp>, Option<Stamp>) = &mut sent[edge.topic];
        *first = [*first, edge.seen.first].into_iter().flatten().min();
        *last = (*last).max(edge.seen.last);
    }
    let own = elements.topics.iter().map(|t| (t.seen.first, t.seen.last));
    sent.into_iter()
        .zip(own)
        .map(|(sent, own)| if sent.0.is_some() { sent } else { own })
        .collect()
}

fn lifecycles(diff: &Diff, changes: &mut Vec<Change>) {
    let differs = |(old, new): &&(ElementState, ElementState)| old.lifecycle != new.lifecycle;
    for (old, new) in diff.changed.iter().filter(differs) {
        let word = |state: &Option<Arc<str>>| state.clone().unwrap_or_default();
        changes.push(Change::Value {
            kind: ValueKind::Lifecycle,
            what: new.what,
            from: word(&old.lifecycle),
            to: word(&new.lifecycle),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_must_change_by_the_share_and_by_more_than_two_messages() {
        assert!(rate_differs(15.0, 7.4, 10.0, 0.25));
        assert!(!rate_differs(15.0, 12.0, 10.0, 0.25));
        assert!(
            !rate_differs(0.1, 0.0, 10.0, 0.25),
            "one message of a slow topic"
        );
        assert!(
            !rate_differs(0.3, 0.1, 10.0, 0.25),
            "a topic too slow for the window"
        );
        assert!(
            !rate_differs(1.0, 2.0, 1.0, 0.25),
            "one message more in a short last window"
        );
        assert!(rate_differs(0.0, 1.0, 10.0, 0.25));
    }
}
