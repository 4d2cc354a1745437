//! The graph of each window: who is there, in which state, how busy.

use std::collections::BTreeMap;
use std::io;

use super::history::{Course, History};
use super::rates::{Sums, rates};
use super::senders::sender;
use super::windows::Windows;
use crate::base::error::Result;
use crate::base::time::Span;
use crate::evidence::claim::Name;
use crate::evidence::collector::{Recorded, spool_error};
use crate::evidence::conclude::Findings;
use crate::graph::{EdgeId, EdgeState, Graph, NodeState, State, TopicState};

/// The graphs of the windows of one division of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Windowed {
    /// A graph per window.
    pub graphs: Vec<Graph>,
    /// Messages per window.
    pub messages: Vec<u64>,
}

/// Windows shorter than this have no rates.
const SHORTEST_NS: i64 = 1_000_000;

/// The graph of each window. Windows are sorted by start, none inside another; they may overlap. Somebody who never
/// speaks again counts as gone after `grace` windows of silence.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub fn graphs(
    recorded: &Recorded,
    findings: &Findings,
    history: &History,
    windows: &[Span],
    grace: usize,
) -> Result<Windowed> {
    let mut all = Assembly {
        windowed: Windowed {
            graphs: vec![Graph::default(); windows.len()],
            messages: vec![0; windows.len()],
        },
        windows: Windows(windows),
        grace,
        findings,
        history,
        sent: BTreeMap::new(),
    };
    all.topics(recorded).map_err(spool_error)?;
    all.nodes();
    all.publishes();
    all.subscribes();
    Ok(all.windowed)
}

struct Assembly<'a> {
    windowed: Windowed,
    windows: Windows<'a>,
    /// Windows of silence before somebody who never speaks again counts as gone.
    grace: usize,
    findings: &'a Findings,
    history: &'a History,
    /// Messages of each known publisher: per topic, then per window.
    sent: BTreeMap<Name, BTreeMap<Name, BTreeMap<usize, u64>>>,
}

impl Assembly<'_> {
    /// Counts messages, topic by topic.
    fn topics(&mut self, recorded: &Recorded) -> io::Result<()> {
        let history = self.history;
        for (topic, streams) in &history.streams {
            let sums = rates(recorded, streams, &self.windows)?;
            self.count(*topic, streams, &sums);
            if let Some(id) = history.topic_ids.get(topic) {
                self.topic(*id, Some(&sums));
            }
        }
        let silent = history
            .topic_ids
            .iter()
            .filter(|(name, _)| !history.streams.contains_key(name));
        for (_, id) in silent {
            self.topic(*id, None);
        }
        for graph in &mut self.windowed.graphs {
            graph.topics.sort_by_key(|topic| topic.id);
        }
        Ok(())
    }

    /// Adds up the messages of each publisher.
    fn count(&mut self, topic: Name, streams: &[usize], sums: &[Sums]) {
        for sum in sums {
            self.windowed.messages[sum.window] += sum.count;
        }
        for (place, stream) in streams.iter().enumerate() {
            let Some(node) = sender(&self.findings.streams[*stream]) else {
                continue;
            };
            let of_node = self.sent.entry(node).or_default();
            let of = of_node.entry(topic).or_default();
            for sum in sums.iter().filter(|sum| sum.streams[place] > 0) {
                *of.entry(sum.window).or_default() += sum.streams[place];
            }
        }
    }

    fn topic(&mut self, id: u32, sums: Option<&[Sums]>) {
        let course = &self.history.topics[id as usize];
        let mut list = sums.unwrap_or_default().iter().peekable();
        for (at, window) in self.windows.0.iter().enumerate() {
            let sum = list.next_if(|sum| sum.window == at);
            if !self.sees(course, *window) {
                continue;
            }
            let count = sum.map_or(0, |sum| sum.count);
            self.windowed.graphs[at].topics.push(TopicState {
                id,
                state: course.state(*window, sum.is_some()),
                degree: course.degree,
                count,
                bytes: bytes(sum, sums.is_some()),
                hz: per_second(count, *window),
                median_period_s: sum.and_then(|sum| sum.median_period_s),
                max_gap_s: sum.and_then(|sum| sum.max_gap_s),
            });
        }
    }

    fn nodes(&mut self) {
        for (name, id) in &self.history.node_ids {
            let course = &self.history.nodes[*id as usize];
            let sent = self.sent.get(name);
            for (at, window) in self.windows.0.iter().enumerate() {
                if !self.sees(course, *window) {
                    continue;
                }
                let count = sent.map(|topics| topics.values().filter_map(|w| w.get(&at)).sum());
                self.windowed.graphs[at].nodes.push(NodeState {
                    id: *id,
                    state: course.state(*window, false),
                    degree: course.degree,
                    hz: count.and_then(|n| per_second(n, *window)),
                    lifecycle: self.findings.values.lifecycle(*name, *window),
                });
            }
        }
    }

    fn publishes(&mut self) {
        let names = |ids: &BTreeMap<Name, u32>| -> BTreeMap<u32, Name> {
            ids.iter().map(|(name, id)| (*id, *name)).collect()
        };
        let (nodes, topics) = (
            names(&self.history.node_ids),
            names(&self.history.topic_ids),
        );
        let edges = self.history.elements.publishes.iter();
        for ((id, edge), course) in (0..).zip(edges).zip(&self.history.publishes) {
            let sent = nodes.get(&edge.node).and_then(|node| self.sent.get(node));
            let topic = topics.get(&edge.topic);
            let sent = sent.and_then(|of| of.get(topic?));
            for (at, window) in self.windows.0.iter().enumerate() {
                if !self.sees(course, *window) {
                    continue;
                }
                let count = sent.map(|windows| windows.get(&at).copied().unwrap_or(0));
                let state = course.state(*window, count.is_some_and(|n| n > 0));
                let state = edge_state(id, course, state, *window, count);
                self.windowed.graphs[at].publishes.push(state);
            }
        }
    }

    /// A subscription is as lively as its topic.
    fn subscribes(&mut self) {
        let edges = self.history.elements.subscribes.iter();
        for ((id, edge), course) in (0..).zip(edges).zip(&self.history.subscribes) {
            for (at, window) in self.windows.0.iter().enumerate() {
                if !self.sees(course, *window) {
                    continue;
                }
                let graph = &mut self.windowed.graphs[at];
                let place = graph.topics.binary_search_by_key(&edge.topic, |t| t.id);
                let state = match place.map(|at| graph.topics[at].state) {
                    _ if course.is_declared() => State::Declared,
                    Ok(state) => state,
                    Err(_) => State::Silent,
                };
                let state = edge_state(id, course, state, *window, None);
                graph.subscribes.push(state);
            }
        }
    }

    /// Whether an element is seen in a window.
    fn sees(&self, course: &Course, window: Span) -> bool {
        let last = course.lives.len().saturating_sub(1);
        course.lives.iter().enumerate().any(|(at, life)| {
            let to = if at == last && self.grace > 0 {
                self.windows.last_moment(life.to, self.grace)
            } else {
                life.to
            };
            life.from < window.end && window.start <= to
        })
    }
}

fn edge_state(
    id: EdgeId,
    course: &Course,
    state: State,
    window: Span,
    count: Option<u64>,
) -> EdgeState {
    EdgeState {
        id,
        state,
        degree: course.degree,
        count,
        hz: count.and_then(|n| per_second(n, window)),
    }
}

fn bytes(sum: Option<&Sums>, recorded: bool) -> Option<u64> {
    match sum {
        Some(sum) => sum.bytes,
        None => recorded.then_some(0),
    }
}

fn per_second(count: u64, window: Span) -> Option<f64> {
    let nanos = window.nanos();
    (nanos >= SHORTEST_NS).then(|| count as f64 / (nanos as f64 / 1e9))
}
