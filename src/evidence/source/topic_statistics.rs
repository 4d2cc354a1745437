//! `/topic_statistics` of graph-monitor: the publishers and subscribers of a topic of ROS 2, measured in its
//! middleware. Its means are rolling: each is of the last messages (50 by default), reported once a second.

use std::collections::BTreeMap;

use super::SourceContext;
use crate::base::time::{Span, Stamp};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::definition::MessageLayout;
use crate::evidence::observation::{Confidence, Measurement, Name, Observation};

/// `rosgraph_monitor_msgs/msg/TopicStatistics`.
pub(crate) const SHAPE: MessageLayout = MessageLayout::ros2(
    "rosgraph_monitor_msgs/TopicStatistics",
    &[
        ("", "time timestamp;TopicStatistic[] statistics"),
        (
            "TopicStatistic",
            "byte statistic_type;string node_name;string topic_name;int32 window_count;duration mean;duration min;\
             duration max",
        ),
    ],
);

/// The kinds of statistics: the period of a publisher, that of a subscriber, and the time from publishing to taking.
const PUBLISHED_PERIOD: u8 = 0;
const RECEIVED_PERIOD: u8 = 1;
const AGE: u8 = 2;

pub(crate) fn read(
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
        let (verb, observation) = if is_sent {
            ("publishes", Observation::Publish(name, of))
        } else {
            ("receives", Observation::Subscribe(name, of))
        };
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
        context.observation(observation, confidence, || {
            format!("{node} {verb} {topic}: {count} messages counted")
        });
    }
    for ((topic, node, is_sent), [(periods, period), (ages, age)]) in ends {
        let nanos = i64::try_from(periods).map_or(0, |many| period.saturating_mul(many));
        context.measure(Measurement {
            topic: Some(topic),
            publisher: Some(node).filter(|_| is_sent),
            subscriber: Some(node).filter(|_| !is_sent),
            // Without periods: the collector reports once a second.
            span: Span::new(
                Stamp(0),
                Stamp(if nanos > 0 { nanos } else { 1_000_000_000 }),
            ),
            is_rolling: true,
            delivered: Some(periods).filter(|_| nanos > 0),
            count: ages,
            drops: None,
            bytes: None,
            jitter_ns: None,
            age_ns: Some(age).filter(|_| ages > 0),
        });
    }
    Ok(())
}
