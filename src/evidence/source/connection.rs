//! ROS 1 connection headers and MCAP channel metadata: the publisher of each message (`callerid`).

use crate::evidence::claim::{Degree, SourceId};
use crate::evidence::proof::{Conclusions, ElementKey, Proof, Reliability, Validity};

/// Every stream proves its topic, and its publisher as far as its name is reliable.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let streams = known.streams;
    for (at, stream) in streams.iter().enumerate() {
        if stream.is_about() {
            continue;
        }
        let proof = |what, when| Proof {
            what,
            source,
            degree: Degree::Measured,
            when,
        };
        known.prove(proof(
            ElementKey::Topic(stream.topic),
            Validity::Messages(at),
        ));
        let Some(node) = stream.publisher else {
            continue;
        };
        let edge = ElementKey::Publish(node, stream.topic);
        match stream.trust {
            Reliability::Player if known.named_by_others(stream.topic, node) => {}
            Reliability::Whole | Reliability::Player => {
                known.prove(proof(edge, Validity::Messages(at)));
            }
            Reliability::Likely => known.prove(Proof {
                degree: Degree::Inferred,
                ..proof(edge, Validity::Messages(at))
            }),
            Reliability::First => known.prove(Proof {
                // The tool that wrote this header knows it of no other message.
                degree: Degree::Stated,
                ..proof(edge, Validity::First(at))
            }),
            Reliability::Gone => {}
        }
    }
}
