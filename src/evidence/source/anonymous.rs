//! The start time inside an anonymous name: rospy appends its process and the milliseconds since 1970, roscpp the
//! nanoseconds.

use crate::base::role::start;
use crate::evidence::claim::{Degree, SourceId};
use crate::evidence::proof::{Conclusions, ElementKey, Proof, Validity};

/// The longest time from a start in a name to the recording, in nanoseconds; with a longer one the clock was not set.
const LONGEST_NS: i64 = 30 * 86_400_000_000_000;

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let (first, last) = known.mission;
    for node in known.nodes().clone() {
        let Some(start) = start(&known.text(node)) else {
            continue;
        };
        if known.gone.contains(&Some(node)) || start > last || first.since(start) > LONGEST_NS {
            continue;
        }
        let proof = Proof {
            what: ElementKey::Node(node),
            source,
            degree: Degree::Stated,
            when: Validity::Begins {
                signs: vec![start.max(first)],
                ends: Vec::new(),
            },
        };
        known.because(proof, Some(start), |known| {
            format!("the name {} holds this start", known.text(node))
        });
    }
}
