//! `/statistics` of ROS 1: the publisher and the subscriber of a topic, counted by the middleware itself.

use super::SourceContext;
use crate::base::time::Span;
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::definition::MessageLayout;
use crate::evidence::observation::{Confidence, Measurement, Observation};

/// `rosgraph_msgs/TopicStatistics`.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "rosgraph_msgs/TopicStatistics",
    md5: "10152ed868c5097a5e2e4a89d7daa710",
    fields: &[(
        "",
        "string topic;string node_pub;string node_sub;time window_start;time window_stop;int32 delivered_msgs;\
         int32 dropped_msgs;int32 traffic;duration period_mean;duration period_stddev;duration period_max;\
         duration stamp_age_mean;duration stamp_age_stddev;duration stamp_age_max",
    )],
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
        is_rolling: false,
        delivered: count(delivered),
        count: count(delivered).unwrap_or(0),
        drops: count(dropped),
        bytes: count(traffic),
        jitter_ns: Some(jitter).filter(|_| period > 0),
        // Messages without a header have no age.
        age_ns: Some(age).filter(|_| oldest != 0),
    });
    if !publisher.is_empty() {
        let node = context.name(publisher);
        context.observation(Observation::Publish(node, of), Confidence::Measured, words);
    }
    if !subscriber.is_empty() {
        let node = context.name(subscriber);
        context.observation(
            Observation::Subscribe(node, of),
            Confidence::Measured,
            words,
        );
    }
    Ok(())
}
