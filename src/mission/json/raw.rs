//! The keys of an evolution's JSON; all are optional except names and times.

use serde::Deserialize;

use super::entries::{InterruptionRow, PhaseRow, RawEntry};
use super::runs::RawWhole;
use super::sending::RawSending;
use crate::base::time::{Span, Stamp};
use crate::evidence::{Degree, Evidence};
use crate::graph::{EdgeState, Measures, State};

#[derive(Default, Deserialize)]
pub(crate) struct Raw {
    pub(crate) schema: String,
    #[serde(default)]
    pub(crate) bags: Vec<RawBag>,
    pub(crate) start_ns: Option<i64>,
    pub(crate) end_ns: Option<i64>,
    pub(crate) messages: Option<u64>,
    pub(crate) period_ns: Option<i64>,
    pub(crate) step_ns: Option<i64>,
    pub(crate) windows: Vec<RawWindow>,
    #[serde(default)]
    pub(crate) nodes: Vec<RawWhole<RawNode>>,
    #[serde(default)]
    pub(crate) topics: Vec<RawWhole<RawTopic>>,
    #[serde(default)]
    pub(crate) publishes: Vec<RawWhole<RawEdge>>,
    #[serde(default)]
    pub(crate) subscribes: Vec<RawWhole<RawEdge>>,
    pub(crate) sending: Option<RawSending>,
    pub(crate) form: Option<String>,
    pub(crate) ledger: Option<Vec<RawEntry>>,
    #[serde(default)]
    pub(crate) interruptions: Vec<InterruptionRow>,
    #[serde(default)]
    pub(crate) phases: Vec<PhaseRow>,
    pub(crate) layout: Option<RawLayout>,
    #[serde(default)]
    pub(crate) notices: Vec<RawNotice>,
}

#[derive(Default, Deserialize)]
pub(crate) struct RawBag {
    #[serde(default)]
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) format: String,
    #[serde(default)]
    pub(crate) compression: Vec<String>,
    #[serde(default)]
    pub(crate) tier: String,
    pub(crate) tier_reason: Option<String>,
    pub(crate) complete: Option<bool>,
    #[serde(default)]
    pub(crate) file_bytes: u64,
}

#[derive(Deserialize)]
pub(crate) struct RawNotice {
    #[serde(default)]
    pub(crate) kind: String,
    pub(crate) count: Option<u64>,
    #[serde(default)]
    pub(crate) text: String,
}

#[derive(Deserialize)]
pub(crate) struct RawLayout {
    #[serde(default)]
    pub(crate) width: f64,
    #[serde(default)]
    pub(crate) height: f64,
    #[serde(default)]
    pub(crate) orientation: String,
    #[serde(default)]
    pub(crate) boxes: Vec<RawBox>,
}

#[derive(Deserialize)]
pub(crate) struct RawBox {
    pub(crate) what: String,
    pub(crate) name: String,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) w: f64,
    pub(crate) h: f64,
}

#[derive(Default, Deserialize)]
pub(crate) struct RawWindow {
    pub(crate) start_ns: i64,
    pub(crate) end_ns: i64,
    pub(crate) partial: Option<bool>,
    pub(crate) messages: Option<u64>,
    #[serde(default)]
    pub(crate) nodes: Vec<RawNode>,
    #[serde(default)]
    pub(crate) topics: Vec<RawTopic>,
    #[serde(default)]
    pub(crate) publishes: Vec<RawEdge>,
    #[serde(default)]
    pub(crate) subscribes: Vec<RawEdge>,
}

/// The keys that every element may have.
#[derive(Default, Deserialize)]
pub(crate) struct RawState {
    pub(crate) state: Option<String>,
    pub(crate) degree: Option<String>,
    #[serde(default)]
    pub(crate) evidence: Vec<String>,
    pub(crate) first_ns: Option<i64>,
    pub(crate) last_ns: Option<i64>,
    #[serde(default)]
    pub(crate) runs: Vec<[i64; 2]>,
    pub(crate) count: Option<u64>,
    pub(crate) hz: Option<f64>,
    pub(crate) bytes: Option<u64>,
    pub(crate) drops: Option<u64>,
    pub(crate) jitter_s: Option<f64>,
    pub(crate) age_s: Option<f64>,
}

#[derive(Default, Deserialize)]
pub(crate) struct RawNode {
    pub(crate) name: String,
    pub(crate) role: Option<String>,
    pub(crate) lifecycle: Option<String>,
    #[serde(flatten)]
    pub(crate) rest: RawState,
}

#[derive(Default, Deserialize)]
pub(crate) struct RawTopic {
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) types: Vec<String>,
    pub(crate) median_period_s: Option<f64>,
    pub(crate) max_gap_s: Option<f64>,
    pub(crate) qos: Option<String>,
    pub(crate) unknown_publishers: Option<u32>,
    #[serde(flatten)]
    pub(crate) rest: RawState,
}

#[derive(Default, Deserialize)]
pub(crate) struct RawEdge {
    pub(crate) node: String,
    pub(crate) topic: String,
    #[serde(flatten)]
    pub(crate) rest: RawState,
}

impl RawState {
    pub(crate) fn state(&self) -> State {
        state_of(self.state.as_deref())
    }

    pub(crate) fn degree(&self) -> Degree {
        degree_of(self.degree.as_deref())
    }

    pub(crate) fn evidence(&self) -> Evidence {
        self.evidence
            .iter()
            .fold(Evidence::NONE, |all, word| all.and(Evidence::of(word)))
    }

    pub(crate) fn life(&self) -> (Option<Stamp>, Option<Stamp>) {
        (self.first_ns.map(Stamp), self.last_ns.map(Stamp))
    }

    pub(crate) fn runs(&self) -> Vec<Span> {
        spans(&self.runs)
    }

    pub(crate) fn measures(&self) -> Measures {
        Measures {
            drops: self.drops,
            jitter_s: self.jitter_s,
            age_s: self.age_s,
        }
    }

    pub(crate) fn edge(&self, id: u32) -> EdgeState {
        EdgeState {
            id,
            state: self.state(),
            degree: self.degree(),
            count: self.count,
            hz: self.hz,
            bytes: self.bytes,
            measures: self.measures(),
        }
    }
}

fn spans(raw: &[[i64; 2]]) -> Vec<Span> {
    let span = |[start, end]: &[i64; 2]| Span::new(Stamp(*start), Stamp(*end.max(start)));
    raw.iter().map(span).collect()
}

/// The state of this word; active for another, or none.
pub(crate) fn state_of(word: Option<&str>) -> State {
    let known = State::ALL.into_iter().find(|s| word == Some(s.word()));
    known.unwrap_or(State::Active)
}

/// The degree of this word; stated for another, or none.
pub(crate) fn degree_of(word: Option<&str>) -> Degree {
    let known = Degree::ALL.into_iter().find(|d| word == Some(d.word()));
    known.unwrap_or(Degree::Stated)
}
