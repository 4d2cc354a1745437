//! The graph of each window: the elements in it, their states and rates.

use std::collections::BTreeMap;
use std::io;

use super::history::{History, Record};
use super::measures::WindowMeasures;
use super::rates::{Arrivals, Sums, rates};
use super::senders::sender;
use super::windows::SortedWindows;
use crate::base::error::Result;
use crate::base::time::Span;
use crate::evidence::Confidence;
use crate::evidence::collector::{Recorded, spool_error};
use crate::evidence::conclude::Findings;
use crate::evidence::observation::Name;
use crate::graph::{
    ById, Column, ColumnCursor, ColumnWriter, Element, Graphs, GraphsWriter, Measures, NodeId,
    Number, Row, State, TopicId, per_second,
};

/// The graphs of the windows of one division of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Windowed {
    /// A graph per window.
    pub graphs: Graphs,
    /// The number of messages of each window.
    pub messages: Vec<u64>,
}

/// Builds the graph of each window. Windows are sorted by start, none inside another; they may overlap.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn graphs(
    recorded: &Recorded,
    findings: &Findings,
    history: &History,
    windows: &[Span],
) -> Result<Windowed> {
    let sorted = SortedWindows(windows);
    let measures = WindowMeasures::new(recorded, findings, history, &sorted);
    let mut all = GraphAssembly {
        measures: measures.map_err(spool_error)?,
        graphs: GraphsWriter::new(windows.to_vec()),
        messages: vec![0; windows.len()],
        windows: sorted,
        findings,
        history,
        published: BTreeMap::new(),
        sent: BTreeMap::new(),
    };
    all.topics(recorded).map_err(spool_error)?;
    all.nodes();
    all.publishes();
    all.subscribes();
    Ok(Windowed {
        graphs: all.graphs.finish(),
        messages: all.messages,
    })
}

struct GraphAssembly<'a> {
    /// Numbers from statistics and header stamps.
    measures: WindowMeasures,
    graphs: GraphsWriter,
    messages: Vec<u64>,
    windows: SortedWindows<'a>,
    findings: &'a Findings,
    history: &'a History,
    /// The messages of each known publisher on each topic, in windows with any.
    published: BTreeMap<(Name, Name), Column>,
    /// The messages of each known publisher per window.
    sent: BTreeMap<Name, Vec<Sent>>,
}

/// The messages of a node in one window.
#[derive(Clone, Copy, Debug, Default)]
struct Sent {
    count: u64,
    /// Those of topics that it sends throughout the window.
    throughout: u64,
    /// The rate of the other topics.
    others_hz: Option<f64>,
}

impl Sent {
    fn add(&mut self, arrivals: &Arrivals, window: Span) {
        self.count = self.count.saturating_add(arrivals.count);
        if arrivals.fills_window() {
            self.throughout = self.throughout.saturating_add(arrivals.count);
        } else if let Some(hz) = arrivals.hz(window) {
            self.others_hz = Some(self.others_hz.unwrap_or(0.0) + hz);
        }
    }

    /// The sum of the rates of its topics; 0 in a window without messages.
    fn hz(&self, window: Span) -> Option<f64> {
        let is_known = self.throughout > 0 || self.count == 0;
        let hz = per_second(self.throughout, window).filter(|_| is_known);
        match (hz, self.others_hz) {
            (Some(a), Some(b)) => Some(a + b),
            (a, b) => a.or(b),
        }
    }
}

impl GraphAssembly<'_> {
    /// Counts messages, topic by topic.
    fn topics(&mut self, recorded: &Recorded) -> io::Result<()> {
        let history = self.history;
        for (topic, streams) in &history.streams {
            let sums = rates(recorded, streams, &self.windows)?;
            for sum in &sums {
                self.messages[sum.window] += sum.arrivals.count;
            }
            self.count(recorded, *topic, streams, &sums)?;
            if let Some(id) = history.topic_ids.get(topic) {
                self.topic(*id, Some(&sums));
            }
        }
        for (name, id) in &history.topic_ids {
            if !history.streams.contains_key(name) {
                self.topic(*id, None);
            }
        }
        Ok(())
    }

    /// Adds up the messages of each publisher of a topic with these sums.
    fn count(
        &mut self,
        recorded: &Recorded,
        topic: Name,
        streams: &[usize],
        sums: &[Sums],
    ) -> io::Result<()> {
        let mut of: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
        for stream in streams {
            if let Some(node) = sender(&self.findings.streams[*stream]) {
                of.entry(node).or_default().push(*stream);
            }
        }
        for (node, own) in of {
            let read;
            let own = if own.len() == streams.len() {
                sums
            } else {
                read = rates(recorded, &own, &self.windows)?;
                &read
            };
            let many = self.windows.len();
            let sent = self
                .sent
                .entry(node)
                .or_insert_with(|| vec![Sent::default(); many]);
            let mut column = ColumnWriter::default();
            for sum in own {
                let window = self.windows.0[sum.window];
                sent[sum.window].add(&sum.arrivals, window);
                let row = Row {
                    count: Some(sum.arrivals.count),
                    bytes: sum.bytes,
                    jitter: Number::of(sum.jitter_s),
                    ..Row::new(State::Active, Confidence::Measured)
                };
                column.push(sum.window, row.with_hz(sum.arrivals.hz(window), window));
            }
            self.published.insert((node, topic), column.finish());
        }
        Ok(())
    }

    fn topic(&mut self, id: TopicId, sums: Option<&[Sums]>) {
        let what = Element::Topic(id);
        let Some(record) = self.history.records.of(what) else {
            return;
        };
        let mut list = sums.unwrap_or_default().iter().peekable();
        let mut rows = ColumnWriter::default();
        for (at, window) in self.windows.0.iter().enumerate() {
            let sum = list.next_if(|sum| sum.window == at);
            if !Self::sees(record, *window) {
                continue;
            }
            let state = Row::new(
                record.state(*window, sum.is_some()),
                self.confidence(what, record, *window),
            );
            let row = Row {
                count: Some(sum.map_or(0, |sum| sum.arrivals.count)),
                bytes: bytes(sum, sums.is_some()),
                median: Number::of(sum.and_then(|sum| sum.median_period_s)),
                gap: Number::of(sum.and_then(|sum| sum.max_gap_s)),
                ..state.with_measures(&Measures {
                    jitter_s: sum.and_then(|sum| sum.jitter_s),
                    ..self.measures.of(what, at)
                })
            };
            rows.push(
                at,
                match sum {
                    Some(sum) => row.with_hz(sum.arrivals.hz(*window), *window),
                    None => row,
                },
            );
        }
        self.graphs.element(what, rows);
    }

    fn nodes(&mut self) {
        for (name, id) in &self.history.node_ids {
            let what = Element::Node(*id);
            let Some(record) = self.history.records.of(what) else {
                continue;
            };
            let sent = self.sent.get(name);
            let mut rows = ColumnWriter::default();
            for (at, window) in self.windows.0.iter().enumerate() {
                if !Self::sees(record, *window) {
                    continue;
                }
                let lifecycle = self.findings.values.lifecycle(*name, *window);
                let row = Row {
                    // A node's count only stands for its rate.
                    count: sent
                        .filter(|_| per_second(0, *window).is_some())
                        .map(|of| of[at].count),
                    lifecycle: lifecycle.map_or(0, |word| self.graphs.lifecycle(&word)),
                    ..Row::new(
                        record.state(*window, false),
                        self.confidence(what, record, *window),
                    )
                };
                rows.push(
                    at,
                    match sent {
                        Some(of) => row.with_hz(of[at].hz(*window), *window),
                        None => row,
                    },
                );
            }
            self.graphs.element(what, rows);
        }
    }

    fn publishes(&mut self) {
        // In the order of their ids.
        let nodes: ById<NodeId, Name> = self.history.node_ids.keys().copied().collect();
        let topics: ById<TopicId, Name> = self.history.topic_ids.keys().copied().collect();
        for (id, edge) in self.history.elements.publishes.with_ids() {
            let what = Element::Publish(id);
            let Some(record) = self.history.records.of(what) else {
                continue;
            };
            let ends = nodes.get(edge.node).zip(topics.get(edge.topic));
            let sent = ends.and_then(|(node, topic)| self.published.get(&(*node, *topic)));
            let mut sent = sent.map(Column::cursor);
            let mut rows = ColumnWriter::default();
            for (at, window) in self.windows.0.iter().enumerate() {
                let row = sent.as_mut().map(ColumnCursor::next);
                let own = row.flatten();
                let count = row.map(|row| row.and_then(|row| row.count).unwrap_or(0));
                if !Self::sees(record, *window) {
                    continue;
                }
                let (delivered, bytes) = self.measures.counted(what, at);
                let measures = self.measures.of(what, at);
                let jitter = own.and_then(|row| row.jitter.value());
                let state = record.state(*window, count.is_some_and(|n| n > 0));
                let row = Row {
                    count: count.or(delivered),
                    bytes: own.and_then(|row| row.bytes).or(bytes),
                    rate: own.and_then(|row| row.rate),
                    ..Row::new(state, self.confidence(what, record, *window))
                };
                let measures = Measures {
                    jitter_s: jitter.or(measures.jitter_s),
                    ..measures
                };
                rows.push(at, row.with_measures(&measures));
            }
            self.graphs.element(what, rows);
        }
    }

    /// Adds the subscriptions: each has the state of its topic.
    fn subscribes(&mut self) {
        for (id, edge) in self.history.elements.subscribes.with_ids() {
            let what = Element::Subscribe(id);
            let Some(record) = self.history.records.of(what) else {
                continue;
            };
            let mut topic = self.graphs.cursor(Element::Topic(edge.topic));
            let mut rows = ColumnWriter::default();
            for (at, window) in self.windows.0.iter().enumerate() {
                let topic = topic.as_mut().and_then(ColumnCursor::next);
                if !Self::sees(record, *window) {
                    continue;
                }
                let state = match topic {
                    _ if record.is_declared() => State::Declared,
                    Some(row) => row.state,
                    None => State::Silent,
                };
                let (count, bytes) = self.measures.counted(what, at);
                let row = Row {
                    count,
                    bytes,
                    ..Row::new(state, self.confidence(what, record, *window))
                };
                let measures = self.measures.of(what, at);
                rows.push(at, row.with_measures(&measures));
            }
            self.graphs.element(what, rows);
        }
    }

    /// The strength of the evidence for an element in a window: before its first sign it is inferred to exist.
    fn confidence(&self, what: Element, record: &Record, window: Span) -> Confidence {
        let first = self.history.elements.seen(what).first;
        if first.is_some_and(|first| window.end <= first) {
            record.confidence.max(Confidence::Inferred)
        } else {
            record.confidence
        }
    }

    /// Whether an element with this record exists in a window.
    fn sees(record: &Record, window: Span) -> bool {
        let mut runs = record.spans();
        runs.any(|run| run.start < window.end && window.start < run.end)
    }
}

fn bytes(sum: Option<&Sums>, recorded: bool) -> Option<u64> {
    match sum {
        Some(sum) => sum.bytes,
        None => recorded.then_some(0),
    }
}
