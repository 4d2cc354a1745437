//! `/events/rosbag2_messages_lost`: messages that the recorder itself lost, so that a gap is not attributed
//! to the robot.

use std::collections::BTreeMap;

use super::SourceContext;
use crate::base::time::Stamp;
use crate::evidence::inference::{Conclusions, ElementKey, IncidentKind};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::definition::MessageLayout;
use crate::evidence::observation::{Name, Observation, SourceId};

/// `rosbag2_interfaces/msg/MessagesLostEvent`.
pub(crate) const SHAPE: MessageLayout = MessageLayout::ros2(
    "rosbag2_interfaces/MessagesLostEvent",
    &[
        (
            "",
            "string node_name;MessagesLostEventTopicStat[] messages_lost_statistics",
        ),
        (
            "MessagesLostEventTopicStat",
            "string topic_name;uint64 messages_lost_in_transport;uint64 messages_lost_in_recorder",
        ),
    ],
);

pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let recorder = payload.string()?;
    let mut all = Vec::new();
    for _ in 0..payload.length(20)? {
        all.push((payload.string()?, payload.u64()?, payload.u64()?));
    }
    payload.finish()?;
    for (topic, in_transport, in_recorder) in all {
        let lost = in_transport.saturating_add(in_recorder);
        let (of, many) = (context.name(topic), context.name(&lost.to_string()));
        context.states(Observation::Lost(of, many), || {
            format!("{recorder} lost {in_transport} messages of {topic} in transport and {in_recorder} itself")
        });
    }
    Ok(())
}

/// Adds the losses; consecutive reports are combined.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let mut lost: BTreeMap<Name, Vec<(Stamp, u64)>> = BTreeMap::new();
    for fact in known.facts.list.clone() {
        if let Observation::Lost(topic, many) = fact.observation
            && known.is_recorded(topic)
            && let Ok(many @ 1..) = known.text(many).parse::<u64>()
        {
            let times = known.times(&fact).into_iter();
            lost.entry(topic)
                .or_default()
                .extend(times.map(|time| (time, many)));
        }
    }
    for (topic, mut reports) in lost {
        reports.sort_unstable();
        for (time, many) in reports {
            known.incident(
                source,
                ElementKey::Topic(topic),
                IncidentKind::Lost(many),
                time,
            );
        }
    }
}
