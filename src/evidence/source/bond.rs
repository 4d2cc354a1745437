//! Bonds: a node that publishes a bond topic (`bond/Status`) also subscribes to it.

use crate::evidence::inference::Conclusions;
use crate::evidence::observation::SourceId;

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    for topic in known.topics_of(|kind| kind == "bond/Status") {
        for node in known.publishers(topic).collect::<Vec<_>>() {
            known.subscribes_as_well(source, node, topic, topic);
        }
    }
}
