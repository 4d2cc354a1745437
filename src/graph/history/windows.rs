//! The history of a mission of which only the graphs of its windows are known, because another tool wrote it.
//!
//! For example, windows last 10 s, and `/nav` is in those from 20 s to 60 s: it started between 20 s and 30 s and ended between
//! 50 s and 60 s.

use std::sync::Arc;

use super::{Bound, History, Life, Record, Sender, Sending, Stretch, Transition};
use crate::base::cast;
use crate::base::rhythm::SAME_RATE;
use crate::base::time::Span;
use crate::evidence::Confidence;
use crate::graph::{ById, Element, Elements, Graphs, PerElement, State};

/// The lifetimes, messages and lifecycle states by these windows.
pub(crate) fn history(elements: &Elements, graphs: &Graphs) -> History {
    let confidences = graphs.confidences(elements);
    let record = |what| {
        let known = confidences.of(what).copied();
        let confidence = known.unwrap_or(Confidence::Declared);
        Record::of_lives(confidence, lives(what, graphs))
    };
    History {
        records: PerElement::new(elements, record),
        sending: sending(elements, graphs),
        transitions: transitions(elements, graphs),
        ..History::default()
    }
}

/// The lifetimes of an element, from window to window.
fn lives(what: Element, graphs: &Graphs) -> Vec<Life> {
    let spans = graphs.spans();
    let changes = graphs.presence_changes(what);
    let life = |run: &[(usize, bool)]| {
        let from = run.first()?.0;
        let to = run.get(1).map_or(spans.len(), |(at, _)| *at);
        let (first, last) = (spans.get(from)?, spans.get(to.checked_sub(1)?)?);
        let bound = |time, window: &Span| Bound::new(time, window.start, window.end);
        Some(Life {
            span: Span::new(first.start, last.end),
            began: (from > 0).then(|| bound(first.start, first)),
            ended: (to < spans.len()).then(|| bound(last.end, last)),
        })
    };
    changes.chunks(2).filter_map(life).collect()
}

/// The lifecycle states of all nodes, each from the window in which it is first.
fn transitions(elements: &Elements, graphs: &Graphs) -> Vec<Transition> {
    let mut all = Vec::new();
    for node in elements.nodes.ids() {
        let mut before = None;
        for (at, row) in graphs.rows(Element::Node(node)) {
            let state = graphs.lifecycle(&row);
            if let Some(state) = state.filter(|_| state != before) {
                all.push(Transition {
                    node,
                    time: graphs.spans()[at].start,
                    state: Arc::clone(state),
                });
            }
            before = state;
        }
    }
    all.sort_by_key(|change| (change.time, change.node));
    all
}

/// The messages of every sender: stretches of consecutive windows with about the same rate.
pub(crate) fn sending(elements: &Elements, graphs: &Graphs) -> Sending {
    let publishers = elements.wiring(|_, _| true).publishers;
    let mut senders = Vec::new();
    for topic in elements.topics.ids() {
        let mut rest = sent(Element::Topic(topic), graphs);
        let mut own = Vec::new();
        for node in &publishers[topic] {
            let Some(edge) = elements.published((*node, topic)) else {
                continue;
            };
            let of_node = sent(edge, graphs);
            for (rest, sent) in rest.iter_mut().zip(&of_node).filter(|(_, s)| s.count > 0) {
                rest.count = rest.count.saturating_sub(sent.count);
                rest.hz = None;
            }
            let mut rows = graphs.rows(edge);
            let is_latched = rows.any(|(_, row)| row.state == State::Latched);
            own.push((Some(*node), is_latched, of_node));
        }
        let all = std::iter::once((None, false, rest)).chain(own);
        senders.extend(all.filter_map(|(node, is_latched, sent)| {
            let stretches = stretches(&sent, graphs.spans());
            (!stretches.is_empty()).then_some(Sender {
                topic,
                node,
                is_latched,
                stretches,
            })
        }));
    }
    Sending {
        senders,
        pauses: ById::default(),
    }
}

/// The messages of a sender in one window.
#[derive(Clone, Copy, Default)]
struct Sent {
    count: u64,
    /// The rate, if it differs from the count divided by the window's length.
    hz: Option<f64>,
}

/// The messages of a topic or publication in each window.
fn sent(what: Element, graphs: &Graphs) -> Vec<Sent> {
    let mut all = vec![Sent::default(); graphs.len()];
    for (at, row) in graphs.rows(what) {
        all[at] = Sent {
            count: row.count.unwrap_or(0),
            hz: row.hz(graphs.spans()[at]),
        };
    }
    all
}

/// The most messages by which two windows of one rate differ, since their edges fall between messages: one more or less in each of
/// them, and a little for the rounding of rates.
const JITTER: f64 = 2.2;

/// The stretches of a sender: consecutive windows with about the same rate are one.
fn stretches(sent: &[Sent], spans: &[Span]) -> Vec<Stretch> {
    let mut all: Vec<Stretch> = Vec::new();
    let mut before = 0;
    for (at, (Sent { count, hz }, span)) in sent.iter().zip(spans).enumerate() {
        let next = spans.get(at + 1).map_or(span.end, |next| next.start);
        let last = span.end.min(next).max(span.start.plus(1)).plus(-1);
        let seconds = span.nanos() as f64 / 1e9;
        let hz = hz.filter(|hz| *hz > 0.0).unwrap_or(*count as f64 / seconds);
        let is_same = |s: &Stretch| {
            let usual = 1e9 / s.period.max(1) as f64;
            let (low, high) = (hz.min(usual), hz.max(usual));
            high <= SAME_RATE * low || (high - low) * seconds <= JITTER
        };
        match all.last_mut() {
            _ if *count == 0 => {}
            Some(stretch) if before > 0 && is_same(stretch) => {
                stretch.count = stretch.count.saturating_add(*count);
                stretch.last = last;
            }
            _ => all.push(Stretch {
                first: span.start,
                last,
                count: *count,
                period: cast::to_i64(1e9 / hz),
                is_even: true,
                is_joined: before > 0,
            }),
        }
        before = *count;
    }
    all
}
