//! `/topic_statistics` of graph-monitor: the publishers and subscribers of a topic of ROS 2, measured in its
//! middleware.

use super::SourceContext;
use crate::bag::Encoding;
use crate::base::time::{Span, Stamp};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::definition::{MessageLayout, TIME2};
use crate::evidence::observation::{Confidence, Measurement, Observation};

/// `rosgraph_monitor_msgs/msg/TopicStatistics`.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "rosgraph_monitor_msgs/TopicStatistics",
    md5: "",
    encoding: Encoding::Cdr,
    fields: &[
        ("", "Time timestamp;TopicStatistic[] statistics"),
        (
            "TopicStatistic",
            "byte statistic_type;string node_name;string topic_name;int32 window_count;Duration mean;Duration min;\
             Duration max",
        ),
        ("Duration", "int32 sec;uint32 nanosec"),
        TIME2,
    ],
};

/// The kind of statistic that a publisher measures; all others are a subscriber's.
const PUBLISHED_PERIOD: u8 = 0;
/// The kind for the time from publishing to receiving.
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
    for (kind, node, topic, count, mean) in all {
        let (name, of) = (context.name(node), context.name(topic));
        let (verb, observation) = match kind {
            PUBLISHED_PERIOD => ("publishes", Observation::Publish(name, of)),
            _ => ("receives", Observation::Subscribe(name, of)),
        };
        if kind == AGE && count > 0 {
            context.measure(Measurement {
                topic: Some(of),
                publisher: None,
                subscriber: Some(name),
                // The collector reports once a second.
                span: Span::new(Stamp(0), Stamp(1_000_000_000)),
                count: u64::try_from(count).unwrap_or(0),
                drops: None,
                bytes: None,
                jitter_ns: None,
                age_ns: Some(mean),
            });
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
    Ok(())
}
