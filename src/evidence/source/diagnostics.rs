//! Diagnostics: the name of a status begins with its node (`ns/node: …`); a node that publishes `/diagnostics_agg`
//! subscribes to `/diagnostics`.

use super::SourceContext;
use crate::evidence::inference::{Conclusions, ElementKey, Validity};
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::{Confidence, Name, Observation};
use std::collections::BTreeSet;

/// `diagnostic_msgs/DiagnosticArray`, since `diagnostic_msgs` 1.2.
pub(crate) const SHAPE: MessageLayout = MessageLayout {
    type_name: "diagnostic_msgs/DiagnosticArray",
    md5: "60810da900de1dd6ddd437c3503511da",
    fields: "Header header;DiagnosticStatus[] status
             DiagnosticStatus: byte level;string name;string message;string hardware_id;KeyValue[] values
             KeyValue: string key;string value",
};

pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    payload.header()?;
    let mut names = Vec::new();
    for _ in 0..payload.length(4)? {
        payload.u8()?;
        names.push(payload.string()?);
        payload.skip_string()?;
        payload.skip_string()?;
        for _ in 0..payload.length(8)? {
            payload.skip_string()?;
            payload.skip_string()?;
        }
    }
    payload.finish()?;
    let topic = context.stream.connection.topic.as_str();
    if topic == "diagnostics" || topic.ends_with("/diagnostics") {
        for name in names {
            if let Some(node) = node(name) {
                let node = context.name(&format!("/{node}"));
                let topic = context.stream.topic;
                let words = || format!("status `{name}`");
                let stated = Observation::Reports(node, topic);
                context.observation(stated, Confidence::Inferred, words);
            }
        }
    }
    Ok(())
}

/// The node in the name of a status, without its first slash; `None` if the text before the colon is not a name.
fn node(name: &str) -> Option<&str> {
    let (node, _) = name.split_once(": ")?;
    let node = node.trim_start_matches('/');
    let part = |p: &str| {
        p.starts_with(|c: char| c.is_ascii_alphabetic())
            && p.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    node.split('/').all(part).then_some(node)
}

/// Adds publishers by the names in statuses, if the header does not name the publisher. A status may be named after anything,
/// so only names that are those of nodes by other evidence count.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let reports = known
        .facts
        .list
        .iter()
        .filter_map(|fact| match fact.observation {
            Observation::Reports(_, topic) => Some(topic),
            _ => None,
        });
    let unnamed: BTreeSet<Name> = reports.filter(|topic| !known.is_reported(*topic)).collect();
    let names = known.names();
    for (fact, signs, ends) in known.observations() {
        let Observation::Reports(node, topic) = fact.observation else {
            continue;
        };
        let node = known.meant(node);
        if unnamed.contains(&topic) && names.contains(&node) {
            let what = ElementKey::Publish(node, topic);
            let when = Validity::Signs { signs, ends };
            known.add(what, Confidence::Inferred, when);
        }
    }
    let [all, each] = ["/diagnostics_agg", "/diagnostics"].map(|name| known.facts.name(name));
    for node in known.publishers(all).collect::<Vec<_>>() {
        let basis = ElementKey::Publish(node, all);
        known.like(ElementKey::Subscribe(each, node), basis);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_names_its_node_before_the_colon() {
        assert_eq!(node("robot1/lidar: Frequency"), Some("robot1/lidar"));
        assert_eq!(node("CPU 0: load"), None);
        assert_eq!(node("battery"), None);
    }
}
