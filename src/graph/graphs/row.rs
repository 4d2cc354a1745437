//! The state of a node, topic or edge in one window, in one form: exact integers where numbers come from integers.

use std::sync::Arc;

use crate::base::cast;
use crate::base::time::Span;
use crate::evidence::Confidence;
use crate::graph::{Element, ElementState, Measures, State, per_second};

/// A number, as an integer where possible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Number {
    #[default]
    Unknown,
    /// Seconds as a whole number of half nanoseconds.
    Halves(i64),
    /// Any other number, by its bits.
    Bits(u64),
}

impl Number {
    pub(crate) fn of(value: Option<f64>) -> Self {
        let Some(value) = value else {
            return Self::Unknown;
        };
        let halves = libm::round(value * 2e9);
        let exact = Self::Halves(cast::to_i64(halves));
        let is_exact =
            halves.abs() < EXACT && exact.value().map(f64::to_bits) == Some(value.to_bits());
        if is_exact {
            exact
        } else {
            Self::Bits(value.to_bits())
        }
    }

    pub(crate) fn value(self) -> Option<f64> {
        match self {
            Self::Unknown => None,
            Self::Halves(halves) => Some(halves as f64 / 2.0 / 1e9),
            Self::Bits(bits) => Some(f64::from_bits(bits)),
        }
    }
}

/// The number below which integers are exact in a float.
const EXACT: f64 = 9e15;

/// The state of one element in one window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) state: State,
    pub(crate) confidence: Confidence,
    /// The number of its lifecycle state, counted from 1; 0 for none.
    pub(crate) lifecycle: u32,
    /// The number of messages; for a node, those from which its rate is computed.
    pub(crate) count: Option<u64>,
    pub(crate) bytes: Option<u64>,
    pub(crate) median: Number,
    pub(crate) gap: Number,
    pub(crate) drops: Option<u64>,
    pub(crate) jitter: Number,
    pub(crate) age: Number,
    /// The rate, if it differs from the count divided by the window's length.
    pub(crate) rate: Option<Number>,
}

impl Row {
    pub(crate) fn new(state: State, confidence: Confidence) -> Self {
        Self {
            state,
            confidence,
            ..Self::default()
        }
    }

    pub(crate) fn with_measures(self, measures: &Measures) -> Self {
        Self {
            drops: measures.drops,
            jitter: Number::of(measures.jitter_s),
            age: Number::of(measures.age_s),
            ..self
        }
    }

    /// With this rate in a window `span`.
    pub(crate) fn with_hz(self, hz: Option<f64>, span: Span) -> Self {
        let row = Self { rate: None, ..self };
        let follows = row.hz(span).map(f64::to_bits) == hz.map(f64::to_bits);
        Self {
            rate: (!follows).then(|| Number::of(hz)),
            ..row
        }
    }

    /// Further measurements of the window.
    pub(crate) fn measures(&self) -> Measures {
        Measures {
            drops: self.drops,
            jitter_s: self.jitter.value(),
            age_s: self.age.value(),
        }
    }

    /// Messages per second in a window of this length.
    pub(crate) fn hz(&self, span: Span) -> Option<f64> {
        match self.rate {
            Some(rate) => rate.value(),
            None => self.count.and_then(|count| per_second(count, span)),
        }
    }

    /// The row of a state in the window `span`; `lifecycle` is the number of its lifecycle state.
    pub(super) fn of(state: &ElementState, span: Span, lifecycle: u32) -> Self {
        let sent = || {
            let count = libm::round(state.hz? * span.nanos() as f64 / 1e9);
            let is_exact = (0.0..EXACT).contains(&count);
            is_exact.then(|| cast::to_u64(count))
        };
        let row = Self {
            lifecycle,
            count: match state.what {
                Element::Node(_) => sent(),
                _ => state.count,
            },
            bytes: state.bytes,
            median: Number::of(state.median_period_s),
            gap: Number::of(state.max_gap_s),
            ..Self::new(state.state, state.confidence).with_measures(&state.measures)
        };
        row.with_hz(state.hz, span)
    }

    /// The state of an element in the window `span`.
    pub(super) fn state(&self, what: Element, span: Span, lifecycles: &[Arc<str>]) -> ElementState {
        let lifecycle = (self.lifecycle as usize).checked_sub(1);
        ElementState {
            count: match what {
                Element::Node(_) => None,
                Element::Topic(_) => Some(self.count.unwrap_or(0)),
                _ => self.count,
            },
            bytes: self.bytes,
            hz: self.hz(span),
            median_period_s: self.median.value(),
            max_gap_s: self.gap.value(),
            lifecycle: lifecycle.and_then(|at| lifecycles.get(at)).map(Arc::clone),
            measures: self.measures(),
            ..ElementState::new(what, self.state, self.confidence)
        }
    }
}
