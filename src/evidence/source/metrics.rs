//! `/statistics` of ROS 2 (`statistics_msgs/msg/MetricsMessage`): a subscriber's node is alive and publishes them.

use super::SourceContext;
use crate::bag::Encoding;
use crate::evidence::claim::{Claim, Degree, SourceId};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::definition::{MessageLayout, TIME2};
use crate::evidence::proof::{Conclusions, ElementKey, Proof, Validity};

/// `statistics_msgs/msg/MetricsMessage`.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "statistics_msgs/MetricsMessage",
    md5: "",
    encoding: Encoding::Cdr,
    fields: &[
        (
            "",
            "string measurement_source_name;string metrics_source;string unit;Time window_start;Time window_stop;\
             StatisticDataPoint[] statistics",
        ),
        ("StatisticDataPoint", "byte data_type;float64 data"),
        TIME2,
    ],
};

pub(crate) fn read(
    heard: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let node = payload.string()?;
    let metric = payload.string()?;
    payload.skip_string()?;
    payload.time()?;
    payload.time()?;
    for _ in 0..payload.length(9)? {
        payload.u8()?;
        payload.f64()?;
    }
    payload.finish()?;
    if !node.is_empty() {
        let name = heard.name(&format!("/{}", node.trim_start_matches('/')));
        let claim = Claim::Reports(name, heard.stream.topic);
        heard.claim(claim, Degree::Stated, || {
            format!("{node} tells of its {metric}")
        });
    }
    Ok(())
}

/// Adds the publications of the nodes named in metrics, whose names lack the namespace.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    for (fact, signs, ends) in known.claims(source) {
        if let Claim::Reports(node, topic) = fact.claim {
            let node = known.meant(node);
            known.prove(Proof {
                what: ElementKey::Publish(node, topic),
                source,
                degree: fact.degree,
                when: Validity::Signs { signs, ends },
            });
        }
    }
}
