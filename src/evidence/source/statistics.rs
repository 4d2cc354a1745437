//! Statistics of topics: of the middleware of ROS 1, which counts what it delivers, of graph-monitor, and of the subscribers of
//! ROS 2.

use std::collections::BTreeMap;

use crate::base::cast;
use crate::base::time::{Span, Stamp};
use crate::evidence::inference::{Conclusions, ElementKey, Validity};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::{Confidence, Measurement, Name, Observation};
use crate::evidence::source::SourceContext;

/// `rosgraph_msgs/TopicStatistics`.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "rosgraph_msgs/TopicStatistics",
    md5: "10152ed868c5097a5e2e4a89d7daa710",
    fields: "string topic;string node_pub;string node_sub;time window_start;time window_stop;int32 delivered_msgs;\
             int32 dropped_msgs;int32 traffic;duration period_mean;duration period_stddev;duration period_max;\
             duration stamp_age_mean;duration stamp_age_stddev;duration stamp_age_max",
};

pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let topic = payload.string()?;
    let publisher = payload.string()?;
    let subscriber = payload.string()?;
    let (start, end) = (payload.time()?, payload.time()?);
    let (delivered, dropped) = (payload.i32()?, payload.i32()?);
    let traffic = payload.i32()?;
    let mut durations = [0; 6];
    for nanos in &mut durations {
        *nanos = payload.duration()?;
    }
    payload.finish()?;
    let words = || format!("{publisher} → {topic} → {subscriber}: {delivered} messages delivered");
    let of = context.name(topic);
    let mut end_of = |node: &str| (!node.is_empty()).then(|| context.name(node));
    let (from, to) = (end_of(publisher), end_of(subscriber));
    let count = |n: i32| u64::try_from(n).ok();
    let [period, jitter, _, age, _, oldest] = durations;
    context.measure(Measurement {
        topic: Some(of),
        publisher: from,
        subscriber: to,
        span: Span::new(start, end),
        delivered: count(delivered),
        count: count(delivered).unwrap_or(0),
        drops: count(dropped),
        bytes: count(traffic),
        jitter_ns: Some(jitter).filter(|_| period > 0),
        // Messages without a header have no age.
        age_ns: Some(age).filter(|_| oldest != 0),
        ..Measurement::default()
    });
    for (publishes, node) in [(true, from), (false, to)] {
        if let Some(node) = node {
            let stated = Observation::edge(publishes, node, of);
            context.observation(stated, Confidence::Measured, words);
        }
    }
    Ok(())
}

// `/topic_statistics` of graph-monitor: the publishers and subscribers of a topic of ROS 2, measured in its
// middleware. Its means are rolling: each is of the last messages (50 by default), reported once a second.

/// `rosgraph_monitor_msgs/msg/TopicStatistics`.
pub(crate) const MONITOR: MessageLayout = MessageLayout::ros2(
    "rosgraph_monitor_msgs/TopicStatistics",
    "time timestamp;TopicStatistic[] statistics
     TopicStatistic: byte statistic_type;string node_name;string topic_name;int32 window_count;duration mean;\
     duration min;duration max",
);

/// The kinds of statistics: the period of a publisher, that of a subscriber, and the time from publishing to taking.
const PUBLISHED_PERIOD: u8 = 0;
const RECEIVED_PERIOD: u8 = 1;
const AGE: u8 = 2;

pub(crate) fn read_monitor(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    payload.time()?;
    let mut all = Vec::new();
    for _ in 0..payload.length(37)? {
        let kind = payload.u8()?;
        let (node, topic, count) = (payload.string()?, payload.string()?, payload.i32()?);
        let mean = payload.duration()?;
        payload.duration()?;
        payload.duration()?;
        all.push((kind, node, topic, count, mean));
    }
    payload.finish()?;
    // By the end of a topic: the number of periods with their mean, and that of ages; 0 without any.
    let mut ends: BTreeMap<(Name, Name, bool), [(u64, i64); 2]> = BTreeMap::new();
    for (kind, node, topic, count, mean) in all {
        let (name, of) = (context.name(node), context.name(topic));
        let is_sent = kind == PUBLISHED_PERIOD;
        let verb = if is_sent { "publishes" } else { "receives" };
        let numbers = ends.entry((of, name, is_sent)).or_default();
        let measured = (u64::try_from(count).unwrap_or(0), mean);
        match kind {
            PUBLISHED_PERIOD | RECEIVED_PERIOD => numbers[0] = measured,
            AGE => numbers[1] = measured,
            _ => {}
        }
        // A statistic over no messages only shows that the endpoint exists.
        let confidence = if count > 0 {
            Confidence::Measured
        } else {
            Confidence::Stated
        };
        context.observation(Observation::edge(is_sent, name, of), confidence, || {
            format!("{node} {verb} {topic}: {count} messages counted")
        });
    }
    for ((topic, node, is_sent), [(periods, period), (ages, age)]) in ends {
        let nanos = i64::try_from(periods).map_or(0, |many| period.saturating_mul(many));
        // Without periods: the collector reports once a second.
        let length = if nanos > 0 { nanos } else { 1_000_000_000 };
        context.measure(Measurement {
            topic: Some(topic),
            publisher: Some(node).filter(|_| is_sent),
            subscriber: Some(node).filter(|_| !is_sent),
            span: Span::new(Stamp(0), Stamp(length)),
            is_rolling: true,
            delivered: Some(periods).filter(|_| nanos > 0),
            count: ages,
            age_ns: Some(age).filter(|_| ages > 0),
            ..Measurement::default()
        });
    }
    Ok(())
}

// `/statistics` of ROS 2 (`statistics_msgs/msg/MetricsMessage`): a subscriber's node is running and publishes
// them.

/// `statistics_msgs/msg/MetricsMessage`.
pub(crate) const METRICS: MessageLayout = MessageLayout::ros2(
    "statistics_msgs/MetricsMessage",
    "string measurement_source_name;string metrics_source;string unit;time window_start;time window_stop;\
     StatisticDataPoint[] statistics
     StatisticDataPoint: byte data_type;float64 data",
);

/// Kinds of numbers in `statistics_msgs/msg/StatisticDataType`.
const AVERAGE: usize = 1;
const DEVIATION: usize = 4;
const SAMPLES: usize = 5;

pub(crate) fn read_metrics(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let node = payload.string()?;
    let metric = payload.string()?;
    let unit = payload.string()?;
    let span = Span::new(payload.time()?, payload.time()?);
    let mut numbers = [f64::NAN; SAMPLES + 1];
    for _ in 0..payload.length(9)? {
        let (kind, number) = (payload.u8()?, payload.f64()?);
        if let Some(slot) = numbers.get_mut(usize::from(kind)) {
            *slot = number;
        }
    }
    payload.finish()?;
    if !node.is_empty() {
        let name = context.name(&format!("/{}", node.trim_start_matches('/')));
        let observation = Observation::Reports(name, context.stream.topic);
        context.states(observation, || format!("{node} reports its {metric}"));
        let nanos = |number: f64| {
            let nanos = libm::round(number * 1e6);
            (unit == "ms" && nanos.abs() < 9e15).then(|| cast::to_i64(nanos))
        };
        let count = cast::to_u64(numbers[SAMPLES]);
        context.measure(Measurement {
            subscriber: Some(name),
            span,
            delivered: Some(count).filter(|_| metric == "message_period"),
            count,
            jitter_ns: nanos(numbers[DEVIATION]).filter(|_| metric == "message_period"),
            age_ns: nanos(numbers[AVERAGE]).filter(|_| metric == "message_age"),
            ..Measurement::default()
        });
    }
    Ok(())
}

/// Adds the publications of the nodes named in metrics, whose names lack the namespace.
pub(crate) fn conclude_metrics(known: &mut Conclusions<'_>) {
    let mut measured = std::mem::take(&mut known.facts.measured);
    for one in measured.iter_mut().filter(|one| one.topic.is_none()) {
        one.subscriber = one.subscriber.map(|node| known.meant(node));
    }
    known.facts.measured = measured;
    for (fact, signs, ends) in known.observations() {
        if let Observation::Reports(node, topic) = fact.observation {
            let node = known.meant(node);
            let what = ElementKey::Publish(node, topic);
            let when = Validity::Signs { signs, ends };
            known.add(what, fact.confidence, when);
        }
    }
}
