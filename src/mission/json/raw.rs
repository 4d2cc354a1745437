//! The keys of a mission's JSON as it is read; all are optional except names, windows and times.

use serde::{Deserialize, Serialize};

use super::elements::{ElementJson, Text};
use super::events::{EventJson, InterruptionRow, PhaseRow};
use crate::mission::Places;

#[derive(Deserialize)]
pub(crate) struct Raw {
    pub(crate) schema: String,
    #[serde(default)]
    pub(crate) bags: Vec<BagJson<'static>>,
    pub(crate) start_ns: Option<i64>,
    pub(crate) end_ns: Option<i64>,
    pub(crate) messages: Option<u64>,
    pub(crate) period_ns: Option<i64>,
    pub(crate) step_ns: Option<i64>,
    pub(crate) windows: Vec<RawWindow>,
    #[serde(default)]
    pub(crate) elements: Vec<ElementJson<'static>>,
    pub(crate) events: Option<Vec<EventJson<'static>>>,
    #[serde(default)]
    pub(crate) interruptions: Vec<InterruptionRow>,
    #[serde(default)]
    pub(crate) phases: Vec<PhaseRow>,
    pub(crate) layout: Option<Places>,
    #[serde(default)]
    pub(crate) notices: Vec<NoticeJson<'static>>,
}

#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct BagJson<'a> {
    pub(crate) name: Text<'a>,
    pub(crate) format: Text<'a>,
    pub(crate) compression: Vec<Text<'a>>,
    pub(crate) tier: Text<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tier_reason: Option<Text<'a>>,
    pub(crate) complete: Option<bool>,
    pub(crate) file_bytes: u64,
}

#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
pub(crate) struct NoticeJson<'a> {
    pub(crate) kind: Text<'a>,
    pub(crate) count: Option<u64>,
    pub(crate) text: String,
}

#[derive(Deserialize)]
pub(crate) struct RawWindow {
    pub(crate) start_ns: i64,
    pub(crate) end_ns: i64,
    pub(crate) partial: Option<bool>,
    pub(crate) messages: Option<u64>,
}
