//! `/statistics` of ROS 2 (`statistics_msgs/msg/MetricsMessage`): a subscriber's node is running and
//! publishes them.

use super::SourceContext;
use crate::base::cast;
use crate::base::time::Span;
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::definition::MessageLayout;
use crate::evidence::observation::{Measurement, Observation, SourceId};

/// `statistics_msgs/msg/MetricsMessage`.
pub(crate) const SHAPE: MessageLayout = MessageLayout::ros2(
    "statistics_msgs/MetricsMessage",
    &[
        (
            "",
            "string measurement_source_name;string metrics_source;string unit;time window_start;time window_stop;\
             StatisticDataPoint[] statistics",
        ),
        ("StatisticDataPoint", "byte data_type;float64 data"),
    ],
);

/// Kinds of numbers in `statistics_msgs/msg/StatisticDataType`.
const AVERAGE: usize = 1;
const DEVIATION: usize = 4;
const SAMPLES: usize = 5;

pub(crate) fn read(
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
            topic: None,
            publisher: None,
            subscriber: Some(name),
            span,
            is_rolling: false,
            delivered: Some(count).filter(|_| metric == "message_period"),
            count,
            drops: None,
            bytes: None,
            jitter_ns: nanos(numbers[DEVIATION]).filter(|_| metric == "message_period"),
            age_ns: nanos(numbers[AVERAGE]).filter(|_| metric == "message_age"),
        });
    }
    Ok(())
}

/// Adds the publications of the nodes named in metrics, whose names lack the namespace.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let mut measured = std::mem::take(&mut known.facts.measured);
    for one in measured.iter_mut().filter(|one| one.topic.is_none()) {
        one.subscriber = one.subscriber.map(|node| known.meant(node));
    }
    known.facts.measured = measured;
    for (fact, signs, ends) in known.observations(source) {
        if let Observation::Reports(node, topic) = fact.observation {
            let node = known.meant(node);
            let what = ElementKey::Publish(node, topic);
            let when = Validity::Signs { signs, ends };
            known.add(Inference::new(source, what, fact.confidence, when));
        }
    }
}
