//! Log texts about two nodes of one name: rcl, where both log over one publisher, and the master of ROS 1, which ends
//! the older one.

use super::SourceContext;
use crate::evidence::inference::{Conclusions, ElementKey, IncidentKind};
use crate::evidence::message::log::LogRecord;
use crate::evidence::observation::{Observation, SourceId};

pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    if let Some(node) = doubled(record) {
        let node = context.name(&node);
        context.states(Observation::Duplicate(node), || {
            format!("{} logs: {}", record.logger, record.text)
        });
    }
}

/// The duplicated node according to a text.
fn doubled(record: &LogRecord<'_>) -> Option<String> {
    let text = record.text;
    if let Some((before, _)) = text.split_once("] Reason: new node registered with same name") {
        return Some(before.rsplit_once('[')?.1.to_owned());
    }
    let rest = text.split_once("Publisher already registered for ")?.1;
    // Since Iron the text names the logger; the record's own is `rcl.logging_rosout`, or the node's.
    let named = rest
        .strip_prefix("node name: '")
        .and_then(|rest| rest.split_once('\''));
    match named {
        Some((name, _)) => Some(format!(
            "/{}",
            name.trim_start_matches('/').replace('.', "/")
        )),
        None => Some(record.logger.clone()).filter(|name| !name.starts_with("/rcl/")),
    }
}

/// Adds the names that are used twice.
pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    for fact in known.observed(source) {
        let Observation::Duplicate(name) = fact.observation else {
            continue;
        };
        let Some(node) = known.owner(&known.text(name)) else {
            continue;
        };
        for time in known.times(&fact) {
            known.incident(
                source,
                ElementKey::Node(node),
                IncidentKind::Duplicate,
                time,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_texts_name_the_node() {
        let said = |logger: &str, text| {
            doubled(&LogRecord {
                logger: logger.to_owned(),
                text,
                ..LogRecord::default()
            })
        };
        let old = "Publisher already registered for provided node name. If this is due to";
        let new = "Publisher already registered for node name: 'r1.talker'. If this is due to";
        let ros1 =
            "Reason given for shutdown: [[/talker] Reason: new node registered with same name]";
        assert_eq!(said("/talker", old).as_deref(), Some("/talker"));
        assert_eq!(said("/rcl/logging_rosout", old), None);
        assert_eq!(
            said("/rcl/logging_rosout", new).as_deref(),
            Some("/r1/talker")
        );
        assert_eq!(said("/talker", ros1).as_deref(), Some("/talker"));
        assert_eq!(said("/talker", "hello"), None);
    }
}
