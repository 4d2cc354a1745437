//! ROS 1 connection headers and MCAP channel metadata: the publisher of each message (`callerid`).

use crate::base::name::is_log;
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Reliability, Validity};
use crate::evidence::observation::{Confidence, SourceId};

/// Every stream is evidence for its topic, and for its publisher if that name is reliable.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let streams = known.streams;
    for (at, stream) in streams.iter().enumerate() {
        let inference = |what, when| Inference::new(source, what, Confidence::Measured, when);
        let topic = ElementKey::Topic(stream.topic);
        known.add(inference(topic, Validity::Messages(at)));
        let Some(node) = stream.publisher else {
            continue;
        };
        let edge = ElementKey::Publish(node, stream.topic);
        match stream.trust {
            Reliability::Player
                if known.named_by_others(stream.topic, node)
                    && !is_log(stream.connection.topic.as_str()) => {}
            Reliability::Whole | Reliability::Player => {
                known.add(inference(edge, Validity::Messages(at)));
            }
            Reliability::Likely => {
                let when = Validity::Messages(at);
                known.add(Inference::new(source, edge, Confidence::Inferred, when));
            }
            // The tool that wrote this header does not know the publishers of the other messages.
            Reliability::First => {
                let when = Validity::First(at);
                known.add(Inference::new(source, edge, Confidence::Stated, when));
            }
            Reliability::Gone => {}
        }
    }
}
