//! The stretches of senders in JSON, so that phases and figures from a file equal those from its bag.
//!
//! ```text
//! {"what": "publish", "node": "/lidar", "topic": "/scan", …, "latched": true,
//!     "stretches": [[first_ns, last_ns, messages, period_ns, flags], …]}
//! {"what": "topic", "name": "/scan", …, "stretches": […], "pauses": [[from_ns, to_ns], …]}
//! ```
//!
//! The stretches of a topic are those of all unknown senders together. Flags are 1 for messages at even
//! intervals, plus 2 if the stretch begins where the previous one ends. `pauses` are the longest intervals
//! between two messages.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::elements::{EdgeJson, TopicJson, spans};
use crate::base::time::Stamp;
use crate::graph::history::{Sender, Sending, Stretch};
use crate::graph::{ById, Elements, NodeId, TopicId};

/// A stretch: first and last message, their number, the usual period, flags.
type StretchJson = (i64, i64, u64, i64, u8);

/// The messages of a sender on a topic.
#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct SendingJson {
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    latched: bool,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    stretches: Vec<StretchJson>,
}

/// The senders by topic and node; `None` means all unknown ones.
pub(super) fn senders(sending: &Sending) -> BTreeMap<(TopicId, Option<NodeId>), &Sender> {
    let senders = sending.senders.iter();
    senders.map(|one| ((one.topic, one.node), one)).collect()
}

impl From<Option<&Sender>> for SendingJson {
    fn from(sender: Option<&Sender>) -> Self {
        let stretch = |s: &Stretch| {
            let flags = u8::from(s.is_even) + 2 * u8::from(s.is_joined);
            (s.first.0, s.last.0, s.count, s.period, flags)
        };
        sender.map_or_else(Self::default, |sender| Self {
            latched: sender.is_latched,
            stretches: sender.stretches.iter().map(stretch).collect(),
        })
    }
}

/// The sending of a mission with these elements.
///
/// # Errors
/// The mistake in the stretches.
pub(super) fn sending<'a>(
    topics: impl Iterator<Item = &'a TopicJson<'static>> + Clone,
    publishes: impl Iterator<Item = &'a EdgeJson<'static>>,
    elements: &Elements,
) -> Result<Sending, String> {
    let unnamed = topics.clone().map(|one| (&one.name, None, &one.sending));
    let named = publishes.map(|one| (&one.topic, Some(&one.node), &one.sending));
    let mut all: BTreeMap<(TopicId, Option<NodeId>), Sender> = BTreeMap::new();
    for (name, node, sent) in unnamed.chain(named) {
        let Some(topic) = elements.topic(name).filter(|_| !sent.stretches.is_empty()) else {
            continue;
        };
        let stretches: Vec<Stretch> = sent.stretches.iter().copied().map(stretch).collect();
        let is_whole = |s: &Stretch| s.first <= s.last && s.count > 0 && s.period >= 0;
        let ascend = |pair: &[Stretch]| pair[0].last <= pair[1].first;
        if !stretches.iter().all(is_whole) || !stretches.windows(2).all(ascend) {
            return Err(format!("the stretches of `{name}` do not ascend"));
        }
        let sender = Sender {
            topic,
            node: node.and_then(|name| elements.node(name)),
            is_latched: sent.latched,
            stretches,
        };
        all.insert((topic, sender.node), sender);
    }
    let mut pauses = ById::default();
    for one in topics.filter(|one| !one.pauses.is_empty()) {
        if let Some(topic) = elements.topic(&one.name) {
            if pauses.is_empty() {
                pauses = ById::like(&elements.topics, Vec::new());
            }
            pauses[topic] = spans(&one.pauses);
        }
    }
    Ok(Sending {
        senders: all.into_values().collect(),
        pauses,
    })
}

fn stretch((first, last, count, period, flags): StretchJson) -> Stretch {
    Stretch {
        first: Stamp(first),
        last: Stamp(last),
        count,
        period,
        is_even: flags & 1 > 0,
        is_joined: flags & 2 > 0,
    }
}
