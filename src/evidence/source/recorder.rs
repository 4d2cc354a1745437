//! The recorder subscribes to every recorded topic; views hide it unless requested.

use std::collections::BTreeSet;

use super::SourceContext;
use crate::base::name::is_recorder;
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::message::log::LogRecord;
use crate::evidence::observation::{Confidence, Name, Observation, SourceId};

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
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let stated = known.facts.list.iter().filter(|fact| fact.source == source);
    let stated = stated.filter_map(|fact| match fact.observation {
        Observation::Node(node) => Some(node),
        _ => None,
    });
    let nodes = known.nodes().iter().copied();
    let named = nodes.filter(|node| is_recorder(&known.text(*node)));
    let recorders: BTreeSet<Name> = stated.chain(named).collect();
    for recorder in &recorders {
        let what = ElementKey::Node(*recorder);
        known.add(Inference::new(
            source,
            what,
            Confidence::Stated,
            Validity::Unending,
        ));
    }
    if recorders.len() != 1 {
        return;
    }
    let topics: BTreeSet<Name> = known.streams.iter().map(|s| s.topic).collect();
    for recorder in recorders {
        for topic in &topics {
            let what = ElementKey::Subscribe(*topic, recorder);
            let when = Validity::Like(ElementKey::Topic(*topic));
            known.add(Inference::new(source, what, Confidence::Stated, when));
        }
    }
}
