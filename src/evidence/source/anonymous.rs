//! The start inside an anonymous name: rospy appends its process and the milliseconds since 1970, roscpp the nanoseconds.

use crate::base::time::Stamp;
use crate::evidence::claim::{Degree, SourceId};
use crate::evidence::proof::{Conclusions, Key, Proof, Validity};

/// A node that started longer before the recording than this was named by a clock that was not set.
const LONGEST_NS: i64 = 30 * 86_400_000_000_000;

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let (first, last) = known.mission;
    for node in known.nodes().clone() {
        let Some(start) = start(&known.text(node)) else {
            continue;
        };
        if start > last || first.since(start) > LONGEST_NS {
            continue;
        }
        let proof = Proof {
            what: Key::Node(node),
            source,
            degree: Degree::Stated,
            when: Validity::Signs {
                signs: vec![start.max(first)],
                ends: Vec::new(),
                held: false,
            },
        };
        known.because(proof, Some(start), |known| {
            format!("the name {} holds this start", known.text(node))
        });
    }
}

/// The moment in a name: `/x_PID_MILLISECONDS`, `/x_NANOSECONDS`.
fn start(name: &str) -> Option<Stamp> {
    let (rest, number) = name.rsplit_once('_')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let process = rest.rsplit_once('_').map_or("", |(_, process)| process);
    let unit = match number.len() {
        13 if digits(process) => 1_000_000,
        19 => 1,
        _ => return None,
    };
    let number: i64 = number.parse().ok().filter(|_| digits(number))?;
    number.checked_mul(unit).map(Stamp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anonymous_names_hold_their_start() {
        let at = |name| start(name).map(|t| t.0);
        assert_eq!(
            at("/probe_9665_1795171273454"),
            Some(1_795_171_273_454_000_000)
        );
        assert_eq!(
            at("/record_1795170682045487216"),
            Some(1_795_170_682_045_487_216)
        );
        assert_eq!(at("/camera_1795171273454"), None);
        assert_eq!(at("/camera_2"), None);
    }
}
