//! The sending of a mission as JSON, so that phases and figures from a file equal those from its bag.
//!
//! ```text
//! "sending": {"senders": [{"topic": "/scan", "node": "/lidar", "latched": false,
//!     "stretches": [[first_ns, last_ns, messages, period_ns, flags], …]}, …],
//!   "pauses": [{"topic": "/scan", "spans": [[from_ns, to_ns], …]}, …]}
//! ```
//!
//! `node` is `null` for all unknown senders together. Flags are 1 for messages at even intervals, plus 2 if the
//! stretch begins where the previous one ends. `pauses` are the longest ones between two messages.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::elements::{Text, pairs, spans};
use crate::base::time::Stamp;
use crate::graph::Elements;
use crate::graph::history::{Sender, Sending, Stretch};

#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct SendingJson<'a> {
    senders: Vec<SenderJson<'a>>,
    pauses: Vec<PausesJson<'a>>,
}

/// A stretch: first and last message, their number, the usual period, flags.
type StretchJson = (i64, i64, u64, i64, u8);

#[derive(Deserialize, Serialize)]
struct SenderJson<'a> {
    topic: Text<'a>,
    node: Option<Text<'a>>,
    #[serde(default)]
    latched: bool,
    stretches: Vec<StretchJson>,
}

#[derive(Deserialize, Serialize)]
struct PausesJson<'a> {
    topic: Text<'a>,
    spans: Vec<[i64; 2]>,
}

impl<'a> SendingJson<'a> {
    pub(super) fn new(sending: &Sending, elements: &'a Elements) -> Self {
        let topic = |id: u32| Text::from(elements.topics[id as usize].name.as_str());
        let node = |id: u32| Text::from(elements.nodes[id as usize].name.as_str());
        let stretch = |s: &Stretch| {
            let flags = u8::from(s.is_even) + 2 * u8::from(s.is_joined);
            (s.first.0, s.last.0, s.count, s.period, flags)
        };
        let senders = sending.senders.iter().map(|sender| SenderJson {
            topic: topic(sender.topic),
            node: sender.node.map(node),
            latched: sender.is_latched,
            stretches: sender.stretches.iter().map(stretch).collect(),
        });
        let pauses = (0..).zip(&sending.pauses).map(|(id, spans)| PausesJson {
            topic: topic(id),
            spans: pairs(spans),
        });
        Self {
            senders: senders.collect(),
            pauses: pauses.collect(),
        }
    }

    /// The sending of a mission with these names. Senders and topics that are in no window are ignored.
    ///
    /// # Errors
    /// The mistake in the stretches.
    pub(super) fn sending(self, elements: &Elements) -> Result<Sending, String> {
        let mut all: BTreeMap<(u32, Option<u32>), Sender> = BTreeMap::new();
        for raw in self.senders {
            let node = raw.node.as_deref().map(|name| elements.node(name));
            let (Some(topic), None | Some(Some(_))) = (elements.topic(&raw.topic), node) else {
                continue;
            };
            let stretches: Vec<Stretch> = raw.stretches.into_iter().map(stretch).collect();
            let is_whole = |s: &Stretch| s.first <= s.last && s.count > 0 && s.period >= 0;
            let ascend = |pair: &[Stretch]| pair[0].last <= pair[1].first;
            if !stretches.iter().all(is_whole) || !stretches.windows(2).all(ascend) {
                return Err(format!("the stretches of `{}` do not ascend", raw.topic));
            }
            let sender = Sender {
                topic,
                node: node.flatten(),
                is_latched: raw.latched,
                stretches,
            };
            all.insert((topic, sender.node), sender);
        }
        let mut pauses = Vec::new();
        for raw in self.pauses {
            if let Some(topic) = elements.topic(&raw.topic) {
                pauses.resize(elements.topics.len(), Vec::new());
                pauses[topic as usize] = spans(&raw.spans);
            }
        }
        Ok(Sending {
            senders: all.into_values().collect(),
            pauses,
        })
    }
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
