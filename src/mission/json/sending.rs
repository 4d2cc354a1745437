//! The sending of a mission as JSON, so that phases and figures from a file equal those from its bag.
//!
//! ```text
//! "sending": {"senders": [{"topic": "/scan", "node": "/lidar", "latched": false,
//!     "stretches": [[first_ns, last_ns, messages, period_ns, flags], …]}, …],
//!   "pauses": [{"topic": "/scan", "spans": [[from_ns, to_ns], …]}, …]}
//! ```
//!
//! `node` is `null` for all unknown senders together. Flags are 1 for messages at even intervals, plus 2 where the
//! stretch begins where the one before ends. `pauses` are the longest ones between two messages.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize, Serializer};

use super::names::Ids;
use super::rows::RunRows;
use super::write::List;
use crate::base::time::{Span, Stamp};
use crate::graph::Elements;
use crate::graph::history::{Sender, Sending, Stretch};

/// The sending in the form for writing.
pub(super) struct SendingOf<'a> {
    pub(super) sending: &'a Sending,
    pub(super) elements: &'a Elements,
}

/// A stretch: first and last message, their number, the usual period, flags.
type StretchRow = (i64, i64, u64, i64, u8);

#[derive(Serialize)]
struct SenderRow<'a> {
    topic: &'a str,
    node: Option<&'a str>,
    latched: bool,
    stretches: Vec<StretchRow>,
}

#[derive(Serialize)]
struct PausesRow<'a> {
    topic: &'a str,
    spans: RunRows<'a>,
}

impl Serialize for SendingOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap as _;
        let Self { sending, elements } = *self;
        let topic = |id: u32| elements.topics[id as usize].name.as_str();
        let node = |id: u32| elements.nodes[id as usize].name.as_str();
        let stretch = |s: &Stretch| {
            let flags = u8::from(s.is_even) + 2 * u8::from(s.is_joined);
            (s.first.0, s.last.0, s.count, s.period, flags)
        };
        let senders = sending.senders.iter().map(|sender| SenderRow {
            topic: topic(sender.topic),
            node: sender.node.map(node),
            latched: sender.is_latched,
            stretches: sender.stretches.iter().map(stretch).collect(),
        });
        let pauses = (0..).zip(&sending.pauses).map(|(id, spans)| PausesRow {
            topic: topic(id),
            spans: RunRows(spans),
        });
        let mut map = serializer.serialize_map(Some(2))?;
        map.serialize_entry("senders", &List(senders))?;
        map.serialize_entry("pauses", &List(pauses))?;
        map.end()
    }
}

/// The sending as it is read.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(crate) struct RawSending {
    senders: Vec<RawSender>,
    pauses: Vec<RawPauses>,
}

#[derive(Deserialize)]
struct RawSender {
    topic: String,
    node: Option<String>,
    #[serde(default)]
    latched: bool,
    stretches: Vec<StretchRow>,
}

#[derive(Deserialize)]
struct RawPauses {
    topic: String,
    spans: Vec<[i64; 2]>,
}

impl RawSending {
    /// The sending of a mission with these names. Senders and topics that no window has are left out.
    ///
    /// # Errors
    /// The mistake in the stretches.
    pub(super) fn sending(self, ids: &Ids) -> Result<Sending, String> {
        let mut all: BTreeMap<(u32, Option<u32>), Sender> = BTreeMap::new();
        for raw in self.senders {
            let node = raw.node.as_deref().map(|name| ids.node(name));
            let (Some(topic), None | Some(Some(_))) = (ids.topic(&raw.topic), node) else {
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
            if let Some(topic) = ids.topic(&raw.topic) {
                pauses.resize(ids.topics(), Vec::new());
                let spans = raw
                    .spans
                    .into_iter()
                    .map(|[start, end]| Span::new(Stamp(start), Stamp(end.max(start))));
                pauses[topic as usize] = spans.collect();
            }
        }
        Ok(Sending {
            senders: all.into_values().collect(),
            pauses,
        })
    }
}

fn stretch((first, last, count, period, flags): StretchRow) -> Stretch {
    Stretch {
        first: Stamp(first),
        last: Stamp(last),
        count,
        period,
        is_even: flags & 1 > 0,
        is_joined: flags & 2 > 0,
    }
}
