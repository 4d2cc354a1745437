//! Further measurements of windows: counts and measurements from statistics, and the ages of messages by
//! their header stamps.

use std::collections::BTreeMap;
use std::io;

use super::history::History;
use super::senders::sender;
use super::windows::SortedWindows;
use crate::base::cast;
use crate::base::name::is_quiet;
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::Recorded;
use crate::evidence::conclude::Findings;
use crate::evidence::observation::{Measurement, age_of};
use crate::graph::{Element, Measures, NodeId, TopicId};

/// Sums of one element in one window. A report belongs to windows by the share of its interval in each.
#[derive(Clone, Copy, Debug, Default)]
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
#[derive(Debug, Default)]
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
        windows: &SortedWindows<'_>,
    ) -> io::Result<Self> {
        let mut all = Self::default();
        let only = only_topics(findings, history);
        // The ends of rolling reports, by what they are about.
        let mut ends: BTreeMap<_, Stamp> = BTreeMap::new();
        for measured in &findings.measured {
            let mut span = measured.span;
            if measured.is_rolling {
                let about = (measured.topic, measured.publisher, measured.subscriber);
                let before = ends.insert(about, span.end);
                span.start = span.start.max(before.unwrap_or(span.start)).min(span.end);
            }
            all.report(measured, span, &only, history, windows);
        }
        for (topic, streams) in &history.streams {
            let Some(id) = history.topic_ids.get(topic) else {
                continue;
            };
            for stream in streams {
                let Some(ages) = recorded.facts.ages.get(stream) else {
                    continue;
                };
                let node = sender(&findings.streams[*stream]);
                let node = node.and_then(|node| history.node_ids.get(&node));
                let edge = node.and_then(|node| history.elements.publication(*node, *id));
                recorded.facts.times.merge(&[*ages], |timed| {
                    let age = age_of(timed.size) as f64;
                    for at in windows.over(timed.time, timed.time) {
                        let edge = edge.map(Element::Publish);
                        for what in edge.into_iter().chain([Element::Topic(*id)]) {
                            let sum = all.0.entry((what, at)).or_default();
                            add(&mut sum.header_age, age, 1.0);
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
        only: &BTreeMap<NodeId, Option<TopicId>>,
        history: &History,
        windows: &SortedWindows<'_>,
    ) {
        let node = |name| history.node_ids.get(&name).copied();
        let topic = match of.topic {
            Some(topic) => history.topic_ids.get(&topic).copied(),
            None => of
                .subscriber
                .and_then(node)
                .and_then(|node| *only.get(&node)?),
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
        for at in windows.over(new.start, new.end.plus(-1)) {
            let window = windows.0[at];
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
            drops: sum.drops.map(whole),
            jitter_s: mean(sum.jitter).map(|square| seconds(libm::sqrt(square))),
            age_s: age.map(seconds),
        }
    }

    /// The messages over an edge in a window and their bytes, as statistics count them.
    pub(crate) fn counted(&self, what: Element, at: usize) -> (Option<u64>, Option<u64>) {
        let sum = self.0.get(&(what, at)).copied().unwrap_or_default();
        (sum.delivered.map(whole), sum.bytes.map(whole))
    }
}

/// The topic of each node that subscribes to a single one besides housekeeping, if a measurement needs it.
fn only_topics(findings: &Findings, history: &History) -> BTreeMap<NodeId, Option<TopicId>> {
    let mut only = BTreeMap::new();
    if findings.measured.iter().all(|one| one.topic.is_some()) {
        return only;
    }
    let elements = &history.elements;
    let is_quiet = |topic: TopicId| is_quiet(elements.topics[topic].name.as_str());
    for edge in elements
        .subscribes
        .iter()
        .filter(|edge| !is_quiet(edge.topic))
    {
        let topic = only.entry(edge.node).or_insert(Some(edge.topic));
        *topic = topic.filter(|topic| *topic == edge.topic);
    }
    only
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
            add(&mut self.jitter, jitter as f64 * jitter as f64, weight);
        }
        if let Some(age) = of.age_ns {
            add(&mut self.age, age as f64, weight);
        }
    }
}

fn add(sum: &mut (f64, f64), value: f64, weight: f64) {
    sum.0 += value * weight;
    sum.1 += weight;
}

/// Nanoseconds as seconds, to the nanosecond.
pub(crate) fn seconds(nanos: f64) -> f64 {
    libm::round(nanos) / 1e9
}

fn whole(sum: f64) -> u64 {
    cast::to_u64(libm::round(sum))
}
