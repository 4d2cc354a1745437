//! ROS 1 connection headers and MCAP channel metadata: who publishes each message (`callerid`).

use crate::facts::{Degree, SourceId};
use crate::proof::{Known, Proof, Trust, What, When};

/// Every stream proves its topic, and its publisher as far as that is believed.
pub(super) fn conclude(source: SourceId, known: &mut Known<'_>) {
    let streams = known.streams;
    for (at, stream) in streams.iter().enumerate() {
        let proof = |what, when| Proof {
            what,
            source,
            degree: Degree::Measured,
            when,
        };
        known.prove(proof(What::Topic(stream.topic), When::Messages(at)));
        let Some(node) = stream.publisher else {
            continue;
        };
        let edge = What::Publish(node, stream.topic);
        match stream.trust {
            Trust::Player if known.named_by_others(stream.topic, node) => {}
            Trust::Whole | Trust::Player => known.prove(proof(edge, When::Messages(at))),
            Trust::First => known.prove(proof(edge, When::First(at))),
        }
    }
}
