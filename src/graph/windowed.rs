//! The graph of each window: the elements in it, their states and rates.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::ops::Range;
use std::sync::Arc;

use crate::base::cast;
use crate::base::error::Result;
use crate::base::ids::{Few, grouped};
use crate::base::name::is_quiet;
use crate::base::time::{Span, Stamp};
use crate::evidence::Confidence;
use crate::evidence::collector::{Recorded, spool_error};
use crate::evidence::conclude::Findings;
use crate::evidence::observation::{Measurement, Name, age_of};
use crate::graph::history::Sender;
use crate::graph::history::records::{History, Record};
use crate::graph::history::senders::sender;
use crate::graph::{
    ById, Column, ColumnCursor, ColumnWriter, Element, Graphs, GraphsWriter, Measures, NodeId,
    Number, Row, State, TopicId, per_second, rate_between,
};

/// The graphs of the windows of one division of time.
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
    let measures = WindowMeasures::new(recorded, findings, history, windows);
    let mut all = GraphAssembly {
        measures: measures.map_err(spool_error)?,
        graphs: GraphsWriter::new(windows.to_vec()),
        messages: vec![0; windows.len()],
        windows,
        findings,
        history,
        publishers: history.elements.wiring(|_, _| true).publishers,
        published: BTreeMap::new(),
        sent: Few::default(),
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

/// A window in which an element exists.
struct ElementWindow<'a> {
    at: usize,
    window: Span,
    record: &'a Record,
    /// The strength of the evidence for the element in it.
    confidence: Confidence,
}

struct GraphAssembly<'a> {
    /// Numbers from statistics and header stamps.
    measures: WindowMeasures,
    graphs: GraphsWriter,
    messages: Vec<u64>,
    windows: &'a [Span],
    findings: &'a Findings,
    history: &'a History,
    /// The known publishers of each topic.
    publishers: ById<TopicId, Vec<NodeId>>,
    /// The messages of each known publisher on each topic, in windows with any.
    published: BTreeMap<Element, Column>,
    /// The messages of each known publisher per window.
    sent: Few<Name, Vec<Sent>>,
}

/// The messages of a node in one window.
#[derive(Clone, Copy, Default)]
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
        // Neither begins nor ends in the window.
        if arrivals.before.is_some() && arrivals.after.is_some() {
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

impl<'a> GraphAssembly<'a> {
    /// Counts messages, topic by topic.
    fn topics(&mut self, recorded: &Recorded) -> io::Result<()> {
        let history = self.history;
        for (topic, streams) in history.streams.with_ids() {
            if streams.is_empty() {
                continue;
            }
            let sums = rates(recorded, streams, self.windows)?;
            for sum in &sums {
                self.messages[sum.window] += sum.arrivals.count;
            }
            self.count(recorded, topic, streams, &sums)?;
            if let Some(id) = history.topic_ids.some(topic) {
                self.topic(*id, Some(&sums));
            }
        }
        for (name, id) in history.topic_ids.somes() {
            if history.streams.of(name).is_empty() {
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
        let sent = |at: &usize| Some((sender(&self.findings.streams[*at])?, *at));
        for (node, own) in grouped(streams.iter().filter_map(sent)) {
            let read;
            let own = if own.len() == streams.len() {
                sums
            } else {
                read = rates(recorded, &own, self.windows)?;
                &read
            };
            let many = self.windows.len();
            let sent = self.sent.grown(node);
            sent.resize(many, Sent::default());
            let mut column = ColumnWriter::default();
            for sum in own {
                sent[sum.window].add(&sum.arrivals, self.windows[sum.window]);
                let row = Row {
                    // Only topics show these two.
                    median: Number::Unknown,
                    gap: Number::Unknown,
                    ..sum.row
                };
                column.push(sum.window, row);
            }
            let history = self.history;
            let (node, topic) = (history.node_ids.some(node), history.topic_ids.some(topic));
            let ends = node.copied().zip(topic.copied());
            let edge = ends.and_then(|ends| history.elements.published(ends));
            self.published
                .extend(edge.map(|edge| (edge, column.finish())));
        }
        Ok(())
    }

    /// Sets the rows of an element: `own` is called for every window, with its index, and makes the row from this and the
    /// element's record in those in which it exists.
    fn element<T>(
        &mut self,
        what: Element,
        mut own: impl FnMut(&Self, usize) -> T,
        row: impl Fn(&mut Self, ElementWindow<'_>, T) -> Row,
    ) {
        let (history, windows) = (self.history, self.windows);
        let Some(record) = history.records.of(what) else {
            return;
        };
        let first = history.elements.seen(what).first;
        let mut rows = ColumnWriter::default();
        for (at, window) in windows.iter().copied().enumerate() {
            let own = own(self, at);
            let is_there = |run: Span| run.start < window.end && window.start < run.end;
            if record.spans().any(is_there) {
                // Before its first sign it is inferred to exist.
                let is_inferred = first.is_some_and(|first| window.end <= first);
                let seen = ElementWindow {
                    at,
                    window,
                    record,
                    confidence: match record.confidence {
                        known if is_inferred => known.max(Confidence::Inferred),
                        known => known,
                    },
                };
                rows.push(at, row(self, seen, own));
            }
        }
        self.graphs.element(what, rows);
    }

    fn topic(&mut self, id: TopicId, sums: Option<&[Sums]>) {
        let what = Element::Topic(id);
        let mut list = sums.unwrap_or_default().iter().peekable();
        let own = |_: &Self, at| list.next_if(|sum| sum.window == at);
        let senders = self.senders(id);
        self.element(what, own, |all, seen, sum| {
            let lives = |life: Span| life.start < seen.window.end && seen.window.start < life.end;
            let has_sender = senders.is_empty() || senders.iter().any(|s| s.spans().any(lives));
            let measures = all.measures.of(what, seen.at);
            let none = Row {
                count: Some(0),
                bytes: sums.map(|_| 0),
                ..Row::default()
            };
            Row {
                state: match seen.record.state(seen.window, sum.is_some()) {
                    State::Active if sum.is_none() && !has_sender => State::Silent,
                    state => state,
                },
                confidence: seen.confidence,
                drops: measures.drops,
                age: Number::of(measures.age_s),
                ..sum.map_or(none, |sum| sum.row)
            }
        });
    }

    /// The publications of a topic, without which it is silent; none if it may have unknown publishers.
    fn senders(&self, topic: TopicId) -> Vec<&'a Record> {
        let history = self.history;
        let is_unknown = |s: &Sender| s.node.is_none();
        let known = history.elements.topics.get(topic);
        if known.is_none_or(|t| t.unknown_publishers != Some(0))
            && history.sending.of_topic(topic).iter().any(is_unknown)
        {
            return Vec::new();
        }
        let nodes = self.publishers.get(topic).into_iter().flatten();
        let edges = nodes.filter_map(|node| history.elements.published((*node, topic)));
        edges.filter_map(|edge| history.records.of(edge)).collect()
    }

    fn nodes(&mut self) {
        let history = self.history;
        for (name, id) in history.node_ids.somes() {
            let own = |all: &Self, at| {
                let sent = all.sent.get(name).filter(|sent| !sent.is_empty());
                sent.map(|sent| sent[at])
            };
            self.element(Element::Node(*id), own, |all, seen, sent| {
                let ElementWindow { window, .. } = seen;
                let lifecycle = all.findings.values.lifecycle(name, window);
                let is_rated = per_second(0, window).is_some();
                let row = Row {
                    // A node's count only stands for its rate.
                    count: sent.filter(|_| is_rated).map(|sent| sent.count),
                    lifecycle: lifecycle.map_or(0, |word| all.graphs.lifecycle(&word)),
                    ..Row::new(seen.record.state(window, false), seen.confidence)
                };
                sent.map_or(row, |sent| row.with_hz(sent.hz(window), window))
            });
        }
    }

    fn publishes(&mut self) {
        let (history, published) = (self.history, std::mem::take(&mut self.published));
        for id in history.elements.publishes.ids() {
            let what = Element::Publish(id);
            let mut sent = published.get(&what).map(Column::cursor);
            let own = |_: &Self, _| sent.as_mut().map(ColumnCursor::next);
            self.element(what, own, |all, seen, row| {
                let own = row.flatten();
                let count = row.map(|row| row.and_then(|row| row.count).unwrap_or(0));
                let (delivered, bytes) = all.measures.counted(what, seen.at);
                let measures = all.measures.of(what, seen.at);
                let jitter = own.and_then(|row| row.jitter.value());
                let state = seen.record.state(seen.window, count.is_some_and(|n| n > 0));
                let row = Row {
                    count: count.or(delivered),
                    bytes: own.and_then(|row| row.bytes).or(bytes),
                    rate: own.and_then(|row| row.rate),
                    ..Row::new(state, seen.confidence)
                };
                row.with_measures(&Measures {
                    jitter_s: jitter.or(measures.jitter_s),
                    ..measures
                })
            });
        }
    }

    /// Adds the subscriptions: each has the state of its topic.
    fn subscribes(&mut self) {
        let history = self.history;
        for (id, edge) in history.elements.subscribes.with_ids() {
            let what = Element::Subscribe(id);
            let topic = self.graphs.column(Element::Topic(edge.topic));
            let mut topic = topic.as_ref().map(Column::cursor);
            let own = |_: &Self, _| topic.as_mut().and_then(ColumnCursor::next);
            self.element(what, own, |all, seen, topic| {
                let state = match topic {
                    _ if seen.record.is_declared() => State::Declared,
                    Some(row) => row.state,
                    None => State::Silent,
                };
                let (count, bytes) = all.measures.counted(what, seen.at);
                let row = Row {
                    count,
                    bytes,
                    ..Row::new(state, seen.confidence)
                };
                row.with_measures(&all.measures.of(what, seen.at))
            });
        }
    }
}

// Further measurements of windows: counts and measurements from statistics, and the ages of messages by
// their header stamps.

/// Sums of one element in one window. A report belongs to windows by the share of its interval in each.
#[derive(Clone, Copy, Default)]
struct MeasureSum {
    delivered: Option<f64>,
    drops: Option<f64>,
    bytes: Option<f64>,
    /// Squares of the deviation, by messages, and the messages.
    jitter: (f64, f64),
    /// Ages by messages, and the messages.
    age: (f64, f64),
    /// As `age`, by header stamps, which take precedence over statistics.
    header_age: (f64, f64),
}

/// The sums of all elements with any.
#[derive(Default)]
pub(crate) struct WindowMeasures(BTreeMap<(Element, usize), MeasureSum>);

impl WindowMeasures {
    /// Sums up everything measured.
    ///
    /// # Errors
    /// If the temporary file of times cannot be read.
    pub(crate) fn new(
        recorded: &Recorded,
        findings: &Findings,
        history: &History,
        windows: &[Span],
    ) -> io::Result<Self> {
        let mut all = Self::default();
        // The topics of each node besides housekeeping, for measurements that name none.
        let elements = &history.elements;
        let is_quiet = |topic: TopicId| is_quiet(elements.topics[topic].name.as_str());
        let subscribed = elements.wiring(|_, topic| !is_quiet(topic)).subscribed;
        // The ends of rolling reports, by what they are about.
        let mut ends: BTreeMap<_, Stamp> = BTreeMap::new();
        for measured in &findings.measured {
            let mut span = measured.span;
            if measured.is_rolling {
                let about = (measured.topic, measured.publisher, measured.subscriber);
                let before = ends.insert(about, span.end);
                span.start = span.start.max(before.unwrap_or(span.start)).min(span.end);
            }
            all.report(measured, span, &subscribed, history, windows);
        }
        for (topic, streams) in history.streams.with_ids() {
            let Some(id) = history.topic_ids.some(topic) else {
                continue;
            };
            for stream in streams {
                let Some(ages) = recorded.facts.ages.some(*stream) else {
                    continue;
                };
                let node = sender(&findings.streams[*stream]);
                let node = node.and_then(|node| history.node_ids.some(node));
                let edge = node.and_then(|node| history.elements.publication(*node, *id));
                recorded.facts.times.merge(&[*ages], |timed| {
                    let age = age_of(timed.size) as f64;
                    for at in over(windows, timed.time, timed.time) {
                        let edge = edge.map(Element::Publish);
                        for what in edge.into_iter().chain([Element::Topic(*id)]) {
                            let sum = all.0.entry((what, at)).or_default();
                            add_weighted(&mut sum.header_age, age, 1.0);
                        }
                    }
                })?;
            }
        }
        Ok(all)
    }

    /// Adds the part of a report that is new to its topic and to the edges that it is about.
    fn report(
        &mut self,
        of: &Measurement,
        new: Span,
        subscribed: &ById<NodeId, Vec<TopicId>>,
        history: &History,
        windows: &[Span],
    ) {
        let node = |name| history.node_ids.some(name).copied();
        let topic = match of.topic {
            Some(topic) => history.topic_ids.some(topic).copied(),
            None => match of.subscriber.and_then(node).map(|node| subscribed.of(node)) {
                Some([only]) => Some(*only),
                _ => None,
            },
        };
        let Some(topic) = topic else {
            return;
        };
        let elements = &history.elements;
        let from = of.publisher.and_then(node);
        let from = from.and_then(|node| elements.publication(node, topic));
        let to = of.subscriber.and_then(node);
        let to = to.and_then(|node| elements.subscription(topic, node));
        let ends = [from.map(Element::Publish), to.map(Element::Subscribe)];
        let whole = of.span.nanos().max(1) as f64;
        for at in over(windows, new.start, new.end.plus(-1)) {
            let window = windows[at];
            let shared = Span::new(new.start.max(window.start), new.end.min(window.end));
            let share = shared.nanos().max(0) as f64 / whole;
            for what in ends.into_iter().flatten().chain([Element::Topic(topic)]) {
                self.0.entry((what, at)).or_default().take(of, share);
            }
        }
    }

    /// The numbers of an element in a window.
    pub(crate) fn of(&self, what: Element, at: usize) -> Measures {
        let Some(sum) = self.0.get(&(what, at)) else {
            return Measures::default();
        };
        let mean = |(sum, many): (f64, f64)| (many > 0.0).then(|| sum / many);
        let age = mean(sum.header_age).or(mean(sum.age));
        Measures {
            drops: sum.drops.map(whole_number),
            jitter_s: mean(sum.jitter).map(|square| seconds(libm::sqrt(square))),
            age_s: age.map(seconds),
        }
    }

    /// The messages over an edge in a window and their bytes, as statistics count them.
    pub(crate) fn counted(&self, what: Element, at: usize) -> (Option<u64>, Option<u64>) {
        let sum = self.0.get(&(what, at)).copied().unwrap_or_default();
        (sum.delivered.map(whole_number), sum.bytes.map(whole_number))
    }
}

impl MeasureSum {
    fn take(&mut self, of: &Measurement, share: f64) {
        let counted = |sum: &mut Option<f64>, more: Option<u64>| {
            if let Some(more) = more {
                *sum = Some(sum.unwrap_or(0.0) + more as f64 * share);
            }
        };
        counted(&mut self.delivered, of.delivered);
        counted(&mut self.drops, of.drops);
        counted(&mut self.bytes, of.bytes);
        let weight = of.count as f64 * share;
        if let Some(jitter) = of.jitter_ns {
            add_weighted(&mut self.jitter, jitter as f64 * jitter as f64, weight);
        }
        if let Some(age) = of.age_ns {
            add_weighted(&mut self.age, age as f64, weight);
        }
    }
}

fn add_weighted(sum: &mut (f64, f64), value: f64, weight: f64) {
    sum.0 += value * weight;
    sum.1 += weight;
}

/// Nanoseconds as seconds, to the nanosecond.
pub(crate) fn seconds(nanos: f64) -> f64 {
    libm::round(nanos) / 1e9
}

fn whole_number(sum: f64) -> u64 {
    cast::to_u64(libm::round(sum))
}

// Rates: the messages of some streams per window, their bytes, periods and gaps.

/// The messages of one topic, or of one of its publishers, in one window.
struct Sums {
    window: usize,
    arrivals: Arrivals,
    /// Their number, bytes, intervals and rate, of an active element.
    row: Row,
}

/// The times of the messages in one window.
#[derive(Clone, Copy)]
struct Arrivals {
    /// The number of messages, ≥ 1.
    count: u64,
    first: Stamp,
    last: Stamp,
    /// The last message before the window, if the pause after it is an ordinary one.
    before: Option<Stamp>,
    /// The first message after the window, if the pause before it is an ordinary one.
    after: Option<Stamp>,
}

/// The sending begins, or ends, with a pause of more than so many ordinary intervals: a few messages may be lost.
const PAUSE: i64 = 4;

impl Arrivals {
    /// Forgets the neighbours after pauses longer than the window and than [`PAUSE`] intervals. With one message, whose
    /// interval is unknown, the window's length is taken: for a topic at 1 Hz in windows of 1 s.
    fn within(self, window: Span) -> Self {
        let intervals = i64::try_from(self.count - 1).unwrap_or(i64::MAX);
        let usual = self.last.since(self.first).checked_div(intervals);
        let usual = usual.unwrap_or(window.nanos());
        let longest = window.nanos().max(usual.saturating_mul(PAUSE));
        Self {
            before: self.before.filter(|at| self.first.since(*at) <= longest),
            after: self.after.filter(|at| at.since(self.last) <= longest),
            ..self
        }
    }

    /// Messages per second in the part of the window in which they are sent: if the sending begins or ends in it, the
    /// intervals from the first message or to the last one, by the time they take; a single message has no rate there.
    fn hz(&self, window: Span) -> Option<f64> {
        let part = |intervals: u64, from: Stamp, to: Stamp| {
            let is_rhythm = self.count > 1;
            rate_between(intervals, Span::new(from, to), window.nanos()).filter(|_| is_rhythm)
        };
        match (self.before, self.after) {
            (Some(_), Some(_)) => per_second(self.count, window),
            (Some(before), None) => part(self.count, before, self.last),
            (None, Some(after)) => part(self.count, self.first, after),
            (None, None) => part(self.count - 1, self.first, self.last),
        }
    }
}

/// The number of messages of a topic in a window.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TopicCount {
    /// The topic's name.
    pub topic: Arc<str>,
    /// The index of the window.
    pub window: usize,
    /// The number of messages, ≥ 1.
    pub count: u64,
}

/// Counts the messages of every topic in every window, before any conclusions. Windows are as for [`super::graphs()`].
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn counts(recorded: &Recorded, windows: &[Span]) -> Result<Vec<TopicCount>> {
    let streams = recorded.streams.iter().enumerate();
    let streams = grouped(streams.map(|(at, of)| (of.connection.topic.as_str(), at)));
    let mut all = Vec::new();
    for (topic, streams) in streams {
        let topic: Arc<str> = topic.into();
        let sums = rates(recorded, &streams, windows).map_err(spool_error)?;
        all.extend(sums.into_iter().map(|sum| TopicCount {
            topic: Arc::clone(&topic),
            window: sum.window,
            count: sum.arrivals.count,
        }));
    }
    Ok(all)
}

/// A window that may still receive messages.
struct OpenWindow {
    window: usize,
    span: Span,
    arrivals: Arrivals,
    bytes: u64,
    longest: Option<i64>,
    gaps: Vec<i64>,
}

/// The most gaps kept per window for their median (8 MB); a window with more has no median: 1 kHz for 17 minutes.
const MOST_GAPS: usize = 1 << 20;

/// Counts the messages of some streams, those of a topic or of one of its publishers: each window with messages, in order.
fn rates(recorded: &Recorded, streams: &[usize], windows: &[Span]) -> io::Result<Vec<Sums>> {
    let ids: Vec<_> = streams.iter().map(|s| recorded.streams[*s].times).collect();
    let sized = ids.iter().all(|id| recorded.messages.sized(*id));
    let mut all = Vec::new();
    let mut open: VecDeque<OpenWindow> = VecDeque::new();
    let mut next = 0;
    let mut before = None;
    recorded.messages.merge(&ids, |timed| {
        let time = timed.time;
        let ended = open.partition_point(|o| o.span.end <= time);
        all.extend(open.drain(..ended).map(|o| o.close(sized, Some(time))));
        while let Some(window) = windows.get(next).filter(|w| w.start <= time) {
            if time < window.end {
                open.push_back(OpenWindow::new(next, *window, time, before));
            }
            next += 1;
        }
        for window in &mut open {
            window.take(time, timed.size);
        }
        before = Some(time);
    })?;
    all.extend(open.into_iter().map(|o| o.close(sized, None)));
    Ok(all)
}

impl OpenWindow {
    /// A window with a first message at `time`, which is not taken yet, and one `before` the window.
    fn new(window: usize, span: Span, time: Stamp, before: Option<Stamp>) -> Self {
        Self {
            window,
            span,
            arrivals: Arrivals {
                count: 0,
                first: time,
                last: time,
                before,
                after: None,
            },
            bytes: 0,
            longest: None,
            gaps: Vec::new(),
        }
    }

    fn take(&mut self, time: Stamp, size: u32) {
        self.arrivals.count += 1;
        self.bytes = self.bytes.saturating_add(u64::from(size));
        let before = std::mem::replace(&mut self.arrivals.last, time);
        if self.arrivals.count == 1 {
            return;
        }
        let gap = time.since(before);
        self.longest = self.longest.max(Some(gap));
        if self.gaps.len() <= MOST_GAPS {
            self.gaps.push(gap);
        }
    }

    fn close(mut self, sized: bool, after: Option<Stamp>) -> Sums {
        let exact = self.gaps.len() <= MOST_GAPS;
        let arrivals = Arrivals {
            after,
            ..self.arrivals
        };
        let arrivals = arrivals.within(self.span);
        let row = Row {
            count: Some(arrivals.count),
            bytes: sized.then_some(self.bytes),
            gap: Number::of(self.longest.map(|gap| gap as f64 / 1e9)),
            jitter: Number::of(deviation(&self.gaps).filter(|_| exact)),
            median: Number::of(median(&mut self.gaps).filter(|_| exact)),
            ..Row::default()
        };
        Sums {
            window: self.window,
            arrivals,
            row: row.with_hz(arrivals.hz(self.span), self.span),
        }
    }
}

/// The standard deviation in seconds of at least two gaps.
fn deviation(gaps: &[i64]) -> Option<f64> {
    let many = gaps.len() as f64;
    let mean = gaps.iter().map(|gap| *gap as f64).sum::<f64>() / many;
    let square = |gap: &i64| (*gap as f64 - mean) * (*gap as f64 - mean);
    let squares: f64 = gaps.iter().map(square).sum();
    (gaps.len() > 1).then(|| seconds(libm::sqrt(squares / many)))
}

/// The median in seconds; the mean of the two middle values of an even number.
fn median(gaps: &mut [i64]) -> Option<f64> {
    if gaps.is_empty() {
        return None;
    }
    let (middle, even) = (gaps.len() / 2, gaps.len().is_multiple_of(2));
    let (below, upper, _) = gaps.select_nth_unstable(middle);
    let upper = *upper as f64;
    let lower = match below.iter().max() {
        Some(lower) if even => *lower as f64,
        _ => upper,
    };
    Some(f64::midpoint(lower, upper) / 1e9)
}

/// The windows that overlap `[from, to]`; they are sorted by start, none of them inside another, and may overlap each other.
fn over(windows: &[Span], from: Stamp, to: Stamp) -> Range<usize> {
    let first = windows.partition_point(|w| w.end <= from);
    let end = windows.partition_point(|w| w.start <= to);
    first..end.max(first)
}

#[cfg(test)]
mod tests {
    mod rates {
        use super::super::*;

        /// The rate in windows of 10 s of messages at these milliseconds, if any.
        fn hz(times: &[i64]) -> Vec<Option<f64>> {
            let at = |ms: i64| Stamp(ms * 1_000_000);
            let window = |k: i64| Span::new(at(k * 10_000), at(k * 10_000 + 10_000));
            let rate = |k: i64| {
                let span = window(k);
                let own: Vec<Stamp> = times.iter().map(|ms| at(*ms)).collect();
                let from = own.partition_point(|time| *time < span.start);
                let to = own.partition_point(|time| *time < span.end);
                let arrivals = Arrivals {
                    count: (to - from) as u64,
                    first: *own[from..to].first()?,
                    last: *own[from..to].last()?,
                    before: from.checked_sub(1).map(|before| own[before]),
                    after: own.get(to).copied(),
                };
                arrivals.within(span).hz(span)
            };
            (0..4).map(rate).collect()
        }

        #[test]
        fn a_window_in_which_a_topic_begins_or_ends_has_its_full_rate() {
            let ten = |from: i64, to: i64| (from..to).map(|k| k * 100).collect::<Vec<_>>();
            assert_eq!(hz(&ten(0, 400)), [Some(10.0); 4]);
            assert_eq!(
                hz(&ten(50, 270)),
                [Some(10.0), Some(10.0), Some(10.0), None]
            );
            assert_eq!(hz(&ten(150, 170)), [None, Some(10.0), None, None]);
            // A pause within a window, or one as short as it, is part of the sending.
            let twice = [ten(0, 30), ten(70, 300)].concat();
            assert_eq!(hz(&twice)[..2], [Some(6.0), Some(10.0)]);
        }

        #[test]
        fn few_messages_have_a_rate_only_within_a_rhythm() {
            // Every 8 s: one or two in each window.
            assert_eq!(
                hz(&[1_000, 9_000, 17_000, 25_000, 33_000, 41_000])[1..],
                [Some(0.1); 3]
            );
            assert_eq!(hz(&[5_000])[0], None);
            // A burst has none.
            assert_eq!(hz(&[5_000, 5_001, 5_003])[0], None);
            assert_eq!(hz(&[5_000, 6_000])[0], Some(1.0));
        }

        #[test]
        fn the_median_is_the_middle_or_the_mean_of_both() {
            assert_eq!(median(&mut []), None);
            assert_eq!(median(&mut [3_000_000_000]), Some(3.0));
            assert_eq!(
                median(&mut [9_000_000_000, 1_000_000_000, 2_000_000_000]),
                Some(2.0)
            );
            assert_eq!(median(&mut [4_000_000_000, 1_000_000_000]), Some(2.5));
        }
    }

    mod windows {
        use super::super::*;

        fn spans(list: &[(i64, i64)]) -> Vec<Span> {
            let span = |(a, b): &(i64, i64)| Span::new(Stamp(*a), Stamp(*b));
            list.iter().map(span).collect()
        }

        #[test]
        fn windows_are_half_open_and_may_overlap() {
            let windows = spans(&[(0, 10), (5, 15), (10, 20)]);
            assert_eq!(over(&windows, Stamp(5), Stamp(5)), 0..2);
            assert_eq!(over(&windows, Stamp(10), Stamp(10)), 1..3);
            assert_eq!(over(&windows, Stamp(3), Stamp(4)), 0..1);
            assert!(over(&windows, Stamp(20), Stamp(30)).is_empty());
        }
    }
}
