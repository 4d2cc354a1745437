//! The recorder subscribes everything recorded; views hide it unless asked.

use crate::facts::{Degree, Name, SourceId};
use crate::proof::{Known, Proof, What, When};
use crate::trust;
use std::collections::BTreeSet;

/// With one recorder among the nodes it is the one that wrote the bag; several cannot be told apart.
pub(super) fn conclude(source: SourceId, known: &mut Known<'_>) {
    let nodes = known.nodes().iter().copied();
    let recorders: Vec<Name> = nodes
        .filter(|n| trust::is_recorder(&known.text(*n)))
        .collect();
    if let [recorder] = recorders[..] {
        let topics: BTreeSet<Name> = known.streams.iter().map(|s| s.topic).collect();
        for topic in topics {
            known.prove(Proof {
                what: What::Subscribe(topic, recorder),
                source,
                degree: Degree::Stated,
                when: When::Like(What::Topic(topic)),
            });
        }
    }
}
