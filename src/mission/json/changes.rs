//! The changes from window to window in JSON.

use serde::Serialize;

use super::rows::nanos;
use crate::base::time::Stamp;
use crate::graph::diff::Change;
use crate::graph::{Element, Elements};
use crate::mission::EntryId;

/// An element by its name, or an edge by its two names.
#[derive(Serialize)]
pub(crate) struct RawElementName<'a> {
    what: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    node: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    topic: Option<&'a str>,
}

impl<'a> RawElementName<'a> {
    pub(crate) fn new(what: Element, elements: &'a Elements) -> Self {
        let (node, topic) = elements.names(what);
        let is_edge = node.is_some() && topic.is_some();
        Self {
            what: what.word(),
            name: node.or(topic).filter(|_| !is_edge),
            node: node.filter(|_| is_edge),
            topic: topic.filter(|_| is_edge),
        }
    }
}

#[derive(Serialize)]
pub(crate) struct ChangeRow<'a> {
    kind: &'static str,
    entry: EntryId,
    #[serde(flatten)]
    named: RawElementName<'a>,
    #[serde(flatten)]
    rest: ChangeValues<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum ChangeValues<'a> {
    Time {
        time_ns: Option<i64>,
    },
    Rate {
        from_hz: f64,
        to_hz: f64,
    },
    Hands {
        from: Vec<&'a str>,
        to: Vec<&'a str>,
    },
    Value {
        from: String,
        to: String,
    },
}

impl<'a> ChangeRow<'a> {
    pub(crate) fn new(change: &Change, entry: EntryId, elements: &'a Elements) -> Self {
        let names = |nodes: &[u32]| {
            nodes
                .iter()
                .map(|n| elements.nodes[*n as usize].name.as_str())
                .collect()
        };
        let time = |time: Option<Stamp>| ChangeValues::Time {
            time_ns: nanos(time),
        };
        let (what, rest) = match change {
            Change::Added { what, time: at } | Change::Removed { what, time: at } => {
                (*what, time(*at))
            }
            Change::Restarted { node, time: at } => (Element::Node(*node), time(Some(*at))),
            Change::Rate {
                what,
                from_hz,
                to_hz,
            } => (
                *what,
                ChangeValues::Rate {
                    from_hz: *from_hz,
                    to_hz: *to_hz,
                },
            ),
            Change::HandedOver { topic, from, to } => (
                Element::Topic(*topic),
                ChangeValues::Hands {
                    from: names(from),
                    to: names(to),
                },
            ),
            Change::Value { what, from, to, .. } => (
                *what,
                ChangeValues::Value {
                    from: from.to_string(),
                    to: to.to_string(),
                },
            ),
        };
        Self {
            kind: change.word(),
            entry,
            named: RawElementName::new(what, elements),
            rest,
        }
    }
}
