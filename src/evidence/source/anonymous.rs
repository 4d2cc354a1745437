//! The start time inside an anonymous name: rospy appends its process and the milliseconds since 1970, roscpp the
//! nanoseconds.

use crate::base::role::start;
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::observation::{Confidence, SourceId};

/// The longest time from a start in a name to the recording, in nanoseconds; if it is longer, the clock was
/// not set.
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
        let what = ElementKey::Node(node);
        let when = Validity::Begins {
            signs: vec![start.max(first)],
            ends: Vec::new(),
        };
        let inference = Inference::new(source, what, Confidence::Stated, when);
        known.because(inference, Some(start), |known| {
            format!("the name {} contains this start time", known.text(node))
        });
    }
}
