//! Every node of ROS 1 publishes `/rosout`, mostly silently; the node `/rosout` subscribes it and publishes
//! `/rosout_agg`.

use crate::bag::Encoding;
use crate::evidence::claim::{Degree, SourceId};
use crate::evidence::proof::{Conclusions, ElementKey, Proof, Validity};

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
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
            known.prove(rule(
                ElementKey::Publish(node, log),
                Validity::Like(ElementKey::Node(node)),
            ));
        }
    }
    known.prove(rule(ElementKey::Node(log), Validity::Always));
    known.prove(rule(ElementKey::Publish(log, all), Validity::Always));
    known.prove(rule(ElementKey::Subscribe(log, log), Validity::Always));
}
