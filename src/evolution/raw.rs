//! The keys of an evolution's JSON, all but the names and times optional.

use serde::Deserialize;

use crate::evidence::{Degree, Evidence};
use crate::graph::{EdgeState, State};
use crate::time::Stamp;

#[derive(Deserialize)]
pub(super) struct Raw {
    pub(super) schema: String,
    #[serde(default)]
    pub(super) bags: Vec<RawBag>,
    pub(super) start_ns: Option<i64>,
    pub(super) end_ns: Option<i64>,
    pub(super) messages: Option<u64>,
    pub(super) period_ns: Option<i64>,
    pub(super) step_ns: Option<i64>,
    pub(super) windows: Vec<RawWindow>,
    pub(super) layout: Option<RawLayout>,
    #[serde(default)]
    pub(super) notices: Vec<RawNotice>,
}

#[derive(Deserialize)]
pub(super) struct RawBag {
    #[serde(default)]
    pub(super) name: String,
    #[serde(default)]
    pub(super) format: String,
    #[serde(default)]
    pub(super) compression: Vec<String>,
    #[serde(default)]
    pub(super) tier: String,
    pub(super) complete: Option<bool>,
}

#[derive(Deserialize)]
pub(super) struct RawNotice {
    #[serde(default)]
    pub(super) kind: String,
    pub(super) count: Option<u64>,
    #[serde(default)]
    pub(super) text: String,
}

#[derive(Deserialize)]
pub(super) struct RawLayout {
    #[serde(default)]
    pub(super) width: f64,
    #[serde(default)]
    pub(super) height: f64,
    #[serde(default)]
    pub(super) orientation: String,
    #[serde(default)]
    pub(super) boxes: Vec<RawBox>,
}

#[derive(Deserialize)]
pub(super) struct RawBox {
    pub(super) what: String,
    pub(super) name: String,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) w: f64,
    pub(super) h: f64,
}

#[derive(Deserialize)]
pub(super) struct RawWindow {
    pub(super) start_ns: i64,
    pub(super) end_ns: i64,
    pub(super) partial: Option<bool>,
    pub(super) messages: Option<u64>,
    #[serde(default)]
    pub(super) nodes: Vec<RawNode>,
    #[serde(default)]
    pub(super) topics: Vec<RawTopic>,
    #[serde(default)]
    pub(super) publishes: Vec<RawEdge>,
    #[serde(default)]
    pub(super) subscribes: Vec<RawEdge>,
}

/// What every element may say of itself.
#[derive(Deserialize)]
pub(super) struct RawState {
    pub(super) state: Option<String>,
    pub(super) degree: Option<String>,
    #[serde(default)]
    pub(super) evidence: Vec<String>,
    pub(super) first_ns: Option<i64>,
    pub(super) last_ns: Option<i64>,
    pub(super) count: Option<u64>,
    pub(super) hz: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct RawNode {
    pub(super) name: String,
    pub(super) role: Option<String>,
    pub(super) lifecycle: Option<String>,
    #[serde(flatten)]
    pub(super) rest: RawState,
}

#[derive(Deserialize)]
pub(super) struct RawTopic {
    pub(super) name: String,
    #[serde(default)]
    pub(super) types: Vec<String>,
    pub(super) bytes: Option<u64>,
    pub(super) median_period_s: Option<f64>,
    pub(super) max_gap_s: Option<f64>,
    pub(super) qos: Option<String>,
    #[serde(flatten)]
    pub(super) rest: RawState,
}

#[derive(Deserialize)]
pub(super) struct RawEdge {
    pub(super) node: String,
    pub(super) topic: String,
    #[serde(flatten)]
    pub(super) rest: RawState,
}

impl RawState {
    pub(super) fn state(&self) -> State {
        let known = State::ALL
            .into_iter()
            .find(|s| self.state.as_deref() == Some(s.word()));
        known.unwrap_or(State::Active)
    }

    pub(super) fn degree(&self) -> Degree {
        let known = Degree::ALL
            .into_iter()
            .find(|d| self.degree.as_deref() == Some(d.word()));
        known.unwrap_or(Degree::Stated)
    }

    pub(super) fn evidence(&self) -> Evidence {
        self.evidence
            .iter()
            .fold(Evidence::NONE, |all, word| all.and(Evidence::of(word)))
    }

    pub(super) fn life(&self) -> (Option<Stamp>, Option<Stamp>) {
        (self.first_ns.map(Stamp), self.last_ns.map(Stamp))
    }

    pub(super) fn edge(&self, id: u32) -> EdgeState {
        EdgeState {
            id,
            state: self.state(),
            degree: self.degree(),
            count: self.count,
            hz: self.hz,
        }
    }
}
