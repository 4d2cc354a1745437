//! The publisher of a topic with messages that name none: if only one node is known to publish it, the messages are from
//! that node.

use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::observation::{Confidence, SourceId};

/// Topics that any node may publish, so that one known publisher does not imply that it is the only one.
const SHARED: [&str; 8] = [
    "/tf",
    "/tf_static",
    "/rosout",
    "/rosout_agg",
    "/diagnostics",
    "/parameter_events",
    "/statistics",
    "/clock",
];

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    for (at, stream) in known.streams.iter().enumerate() {
        if stream.publisher.is_some() || SHARED.contains(&stream.connection.topic.as_str()) {
            continue;
        }
        if let Some(only) = known.only_publisher(stream.topic) {
            let what = ElementKey::Publish(only, stream.topic);
            let when = Validity::Messages(at);
            known.add(Inference::new(source, what, Confidence::Inferred, when));
        }
    }
}
