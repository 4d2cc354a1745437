//! ROS 1 connection headers and MCAP channel metadata: who publishes each message (`callerid`).

use std::io;

use crate::facts::{Degree, SourceId};
use crate::proof::{Known, Proof, What, When};

/// Every stream proves its topic, and its publisher where that is named and believed.
pub(super) fn conclude(source: SourceId, known: &mut Known<'_>) -> io::Result<()> {
    let streams = known.streams;
    for (at, stream) in streams.iter().enumerate() {
        let proof = |what| Proof {
            what,
            source,
            degree: Degree::Measured,
            when: When::Messages(at),
        };
        known.prove(proof(What::Topic(stream.topic)));
        if let Some(node) = stream.publisher.filter(|_| stream.trusted) {
            known.prove(proof(What::Publish(node, stream.topic)));
        }
    }
    Ok(())
}
