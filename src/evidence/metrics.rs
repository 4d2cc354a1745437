//! `/statistics` of ROS 2 (`statistics_msgs/msg/MetricsMessage`): a subscriber's node is alive and publishes them.

use super::Heard;
use crate::bag::Encoding;
use crate::definition::{Shape, TIME2};
use crate::facts::{Claim, Degree, SourceId};
use crate::proof::{Known, Proof, What, When};
use crate::wire::{self, Cursor};

/// `statistics_msgs/msg/MetricsMessage`.
pub(super) const SHAPE: Shape = Shape {
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

pub(super) fn read(heard: &mut Heard<'_>, payload: &mut Cursor<'_>) -> wire::Result<()> {
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

/// The source names itself without its namespace.
pub(super) fn conclude(source: SourceId, known: &mut Known<'_>) {
    for (fact, signs, ends) in known.claims(source) {
        if let Claim::Reports(node, topic) = fact.claim {
            let (node, held) = (known.meant(node), known.lasts(&signs));
            known.prove(Proof {
                what: What::Publish(node, topic),
                source,
                degree: fact.degree,
                when: When::Signs { signs, ends, held },
            });
        }
    }
}
