//! Every node of ROS 1 publishes `/rosout`, mostly silently; the node `/rosout` subscribes it and publishes
//! `/rosout_agg`.

use crate::bag::Encoding;
use crate::facts::{Degree, SourceId};
use crate::proof::{Known, Proof, What, When};

pub(super) fn conclude(source: SourceId, known: &mut Known<'_>) {
    let ros1 = known
        .streams
        .iter()
        .any(|s| s.connection.encoding == Encoding::Ros1);
    if !ros1 || known.nodes().is_empty() {
        return;
    }
    let [log, all] = ["/rosout", "/rosout_agg"].map(|name| known.facts.name(name));
    let rule = |what, when| Proof {
        what,
        source,
        degree: Degree::Inferred,
        when,
    };
    for node in known.nodes().clone() {
        if node != log {
            known.prove(rule(What::Publish(node, log), When::Like(What::Node(node))));
        }
    }
    known.prove(rule(What::Node(log), When::Always));
    known.prove(rule(What::Publish(log, all), When::Always));
    known.prove(rule(What::Subscribe(log, log), When::Always));
}
