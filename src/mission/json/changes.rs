//! The changes from window to window in JSON.

use serde::Serialize;

use super::elements::Text;
use super::events::ElementName;
use crate::base::time::Stamp;
use crate::graph::diff::Change;
use crate::graph::{Element, Elements, NodeId};
use crate::mission::EventId;

#[derive(Serialize)]
pub(crate) struct ChangeRow<'a> {
    kind: &'static str,
    event: EventId,
    #[serde(flatten)]
    named: ElementName<'a>,
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
        from: Text<'a>,
        to: Text<'a>,
    },
}

impl<'a> ChangeRow<'a> {
    pub(crate) fn new(change: &'a Change, event: EventId, elements: &'a Elements) -> Self {
        let name = |id: &NodeId| elements.nodes[*id as usize].name.as_str();
        let time = |time: Option<Stamp>| ChangeValues::Time {
            time_ns: time.map(|at| at.0),
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
            } => {
                let (from_hz, to_hz) = (*from_hz, *to_hz);
                (*what, ChangeValues::Rate { from_hz, to_hz })
            }
            Change::HandedOver { topic, from, to } => {
                let from = from.iter().map(name).collect();
                let to = to.iter().map(name).collect();
                (Element::Topic(*topic), ChangeValues::Hands { from, to })
            }
            Change::Value { what, from, to, .. } => {
                let (from, to) = ((&**from).into(), (&**to).into());
                (*what, ChangeValues::Value { from, to })
            }
        };
        Self {
            kind: change.word(),
            event,
            named: ElementName::new(what, elements),
            rest,
        }
    }
}
