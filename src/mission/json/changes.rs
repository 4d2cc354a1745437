//! The changes from window to window in JSON.

use serde::Serialize;

use super::events::{DetailJson, ElementName};
use crate::graph::Elements;
use crate::graph::diff::Change;
use crate::mission::EventId;
use crate::mission::event_log::{Detail, described};

#[derive(Serialize)]
pub(crate) struct ChangeRow<'a> {
    kind: &'static str,
    #[serde(rename = "entry")]
    event: EventId,
    #[serde(flatten)]
    named: ElementName<'a>,
    #[serde(flatten)]
    values: ChangeValues<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum ChangeValues<'a> {
    /// The time at which the element appeared, vanished or restarted, if known.
    Time {
        time_ns: Option<i64>,
    },
    Other(DetailJson<'a>),
}

impl<'a> ChangeRow<'a> {
    pub(crate) fn new(change: &Change, event: EventId, elements: &'a Elements) -> Self {
        let (_, what, time, detail) = described(change);
        let time_ns = time.map(|at| at.0);
        Self {
            kind: change.word(),
            event,
            named: ElementName::new(what, elements),
            values: match &detail {
                Detail::None => ChangeValues::Time { time_ns },
                detail => ChangeValues::Other(DetailJson::new(detail, elements)),
            },
        }
    }
}
