//! The recorder: it subscribes to every recorded topic (views hide it unless requested), and states which messages it lost.

use std::collections::BTreeSet;

use crate::base::ids::Few;
use crate::base::name::is_recorder;
use crate::base::time::Stamp;
use crate::evidence::inference::{Conclusions, ElementKey, IncidentKind, Validity};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::{LogRecord, MessageLayout};
use crate::evidence::observation::{Confidence, Name, Observation};
use crate::evidence::source::SourceContext;

/// The ends of the recorder's source paths: of `rosbag` and of `rosbag2_transport`.
const FILES: [&str; 2] = ["/src/recorder.cpp", "/rosbag2_transport/recorder.cpp"];

/// Recognises a recorder by the source file in its log records, regardless of its name.
pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    let file = record.file.replace('\\', "/");
    if FILES.iter().any(|end| file.ends_with(end)) {
        let node = context.name(&record.logger);
        context.states(Observation::Node(node), || {
            format!("{} records: {}", record.logger, record.text)
        });
    }
}

/// Adds the subscriptions of the recorder: a single one among the nodes wrote the bag; several cannot be distinguished.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let observed = known.observed(known.source).into_iter();
    let stated = observed.filter_map(|fact| match fact.observation {
        Observation::Node(node) => Some(node),
        _ => None,
    });
    let nodes = known.nodes().iter().copied();
    let named = nodes.filter(|node| is_recorder(&known.text(*node)));
    let recorders: BTreeSet<Name> = stated.chain(named).collect();
    for recorder in &recorders {
        let what = ElementKey::Node(*recorder);
        known.add(what, Confidence::Stated, Validity::Unending);
    }
    if recorders.len() != 1 {
        return;
    }
    let topics: BTreeSet<Name> = known.streams.iter().map(|s| s.topic).collect();
    for recorder in recorders {
        for topic in &topics {
            let what = ElementKey::Subscribe(*topic, recorder);
            let when = Validity::Like(ElementKey::Topic(*topic));
            known.add(what, Confidence::Stated, when);
        }
    }
}

// `/events/rosbag2_messages_lost`: messages that the recorder itself lost, so that a gap is not attributed
// to the robot.

/// `rosbag2_interfaces/msg/MessagesLostEvent`.
pub(crate) const LOST: MessageLayout = MessageLayout::ros2(
    "rosbag2_interfaces/MessagesLostEvent",
    "string node_name;MessagesLostEventTopicStat[] messages_lost_statistics
     MessagesLostEventTopicStat: string topic_name;uint64 messages_lost_in_transport;uint64 messages_lost_in_recorder",
);

pub(crate) fn read_lost(
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
pub(crate) fn conclude_lost(known: &mut Conclusions<'_>) {
    let mut lost: Few<Name, Vec<(Stamp, u64)>> = Few::default();
    for fact in known.facts.list.clone() {
        if let Observation::Lost(topic, many) = fact.observation
            && known.is_recorded(topic)
            && let Ok(many @ 1..) = known.text(many).parse::<u64>()
        {
            let times = known.times(&fact).into_iter();
            lost.grown(topic).extend(times.map(|time| (time, many)));
        }
    }
    for reports in lost.iter_mut() {
        reports.sort_unstable();
    }
    for (topic, reports) in lost.with_ids() {
        for (time, many) in reports {
            let what = ElementKey::Topic(topic);
            known.incident(what, IncidentKind::Lost(*many), *time);
        }
    }
}
