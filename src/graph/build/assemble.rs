//! The graph of each window: the elements in it, their states and rates.

use std::collections::BTreeMap;
use std::io;

use super::history::{History, Record};
use super::measures::WindowMeasures;
use super::rates::{Sums, rates};
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
    /// The number of messages of each known publisher on each topic, in windows with any.
    published: BTreeMap<(Name, Name), Column>,
    /// The number of messages of each known publisher per window.
    sent: BTreeMap<Name, Vec<u64>>,
}

impl GraphAssembly<'_> {
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
        for (name, id) in &history.topic_ids {
            if !history.streams.contains_key(name) {
                self.topic(*id, None);
            }
        }
        Ok(())
    }

    /// Adds up the messages of each publisher.
    fn count(&mut self, topic: Name, streams: &[usize], sums: &[Sums]) {
        for sum in sums {
            self.messages[sum.window] += sum.count;
        }
        let of = |stream: &usize| sender(&self.findings.streams[*stream]);
        let mut places: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
        for (place, node) in streams.iter().map(of).enumerate() {
            if let Some(node) = node {
                places.entry(node).or_default().push(place);
            }
        }
        for (node, places) in places {
            let many = self.windows.len();
            let sent = self.sent.entry(node).or_insert_with(|| vec![0; many]);
            let mut column = ColumnWriter::default();
            for sum in sums {
                let of = |all: &Vec<u64>| places.iter().map(|place| all[*place]).sum();
                let count: u64 = of(&sum.streams);
                sent[sum.window] += count;
                if count > 0 {
                    column.push(sum.window, counted(count, count == sum.count, sum, of));
                }
            }
            self.published.insert((node, topic), column.finish());
        }
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
                count: Some(sum.map_or(0, |sum| sum.count)),
                bytes: bytes(sum, sums.is_some()),
                median: Number::of(sum.and_then(|sum| sum.median_period_s)),
                gap: Number::of(sum.and_then(|sum| sum.max_gap_s)),
                ..state.with_measures(&Measures {
                    jitter_s: sum.and_then(|sum| sum.jitter_s),
                    ..self.measures.of(what, at)
                })
            };
            rows.push(at, row);
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
                        .map(|of| of[at]),
                    lifecycle: lifecycle.map_or(0, |word| self.graphs.lifecycle(&word)),
                    ..Row::new(
                        record.state(*window, false),
                        self.confidence(what, record, *window),
                    )
                };
                rows.push(at, row);
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

/// The messages of one publisher of a topic, with their bytes, and with the topic's jitter if all are its own.
fn counted(count: u64, is_sole: bool, sum: &Sums, of: impl Fn(&Vec<u64>) -> u64) -> Row {
    Row {
        count: Some(count),
        bytes: sum.stream_bytes.as_ref().map(of),
        jitter: Number::of(sum.jitter_s.filter(|_| is_sole)),
        ..Row::new(State::Active, Confidence::Measured)
    }
}

fn bytes(sum: Option<&Sums>, recorded: bool) -> Option<u64> {
    match sum {
        Some(sum) => sum.bytes,
        None => recorded.then_some(0),
    }
}
