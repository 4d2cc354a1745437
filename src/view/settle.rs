//! Looks that do not flicker: between what the ledger tells, an element keeps its state and the thickness of its rate.

use super::{Frame, Mark, Shown};
use crate::evidence::Degree;
use crate::graph::State;

/// What is known so far of an element's present life.
#[derive(Clone, Copy, Default)]
struct PresentLife {
    /// The frame in which it was seen last, counted from 1.
    last: usize,
    look: Option<(State, Degree)>,
    /// Messages and nanoseconds since its rate last changed.
    sent: (f64, f64),
    is_measured: bool,
}

/// Gives each item or arrow, for as long as it lives, its liveliest state and its strongest degree, and its average
/// rate between two changes of it. `count` is how many there are.
///
/// A topic that speaks once a minute is as alive in the seconds between as in those in which it is heard; only a pause
/// that the ledger knows is drawn as one.
pub(crate) fn settle(
    frames: &mut [Frame],
    count: usize,
    shown_of: impl Fn(&mut Frame) -> &mut Vec<Shown>,
) {
    let mut lives = vec![PresentLife::default(); count];
    for (at, frame) in (1..).zip(frames.iter_mut()) {
        let length = frame.span.nanos() as f64;
        for shown in shown_of(frame) {
            if let Some(life) = lives.get_mut(shown.id as usize) {
                life.forward(at, shown, length);
            }
        }
    }
    // Backwards, what is known at the end of a life is known all through it.
    let mut lives = vec![PresentLife::default(); count];
    let last = frames.len();
    for (at, frame) in frames.iter_mut().rev().enumerate() {
        for shown in shown_of(frame) {
            if let Some(life) = lives.get_mut(shown.id as usize) {
                life.backward(last - at, shown);
            }
        }
    }
}

impl PresentLife {
    fn forward(&mut self, at: usize, shown: &mut Shown, length: f64) {
        if self.last + 1 != at || shown.mark == Some(Mark::Added) {
            *self = Self::default();
        }
        if is_rate(shown) {
            (self.sent, self.is_measured) = ((0.0, 0.0), false);
        }
        if !shown.is_paused {
            let look = (shown.state, shown.degree);
            let old = self.look.unwrap_or(look);
            self.look = Some((livelier(old.0, look.0), old.1.min(look.1)));
        }
        if let Some(hz) = shown.hz.filter(|hz| hz.is_finite() && !shown.is_paused) {
            // A ghost's rate is not its own.
            if shown.mark != Some(Mark::Removed) {
                self.sent = (self.sent.0 + hz * length, self.sent.1 + length);
                self.is_measured = true;
            }
        }
        self.last = if shown.mark == Some(Mark::Removed) {
            0
        } else {
            at
        };
        let (sent, time) = self.sent;
        shown.steady_hz = self.is_measured.then(|| sent / time.max(1.0));
        self.show(shown);
    }

    fn backward(&mut self, at: usize, shown: &mut Shown) {
        let goes_on = self.last == at + 1 && shown.mark != Some(Mark::Removed);
        let known = if goes_on { *self } else { Self::default() };
        let look = if shown.is_paused {
            known.look
        } else {
            known.look.or(Some((shown.state, shown.degree)))
        };
        // `sent` holds the rate from here to the next change of it.
        let steady = if known.is_measured {
            Some(known.sent.0)
        } else {
            shown.steady_hz
        };
        shown.steady_hz = steady;
        let ends_here = is_rate(shown);
        *self = Self {
            last: if shown.mark == Some(Mark::Added) {
                0
            } else {
                at
            },
            look,
            sent: (steady.unwrap_or(0.0), 0.0),
            is_measured: steady.is_some() && !ends_here,
        };
        self.show(shown);
    }

    fn show(&self, shown: &mut Shown) {
        if let Some((state, degree)) = self.look.filter(|_| !shown.is_paused) {
            (shown.state, shown.degree) = (state, degree);
        }
    }
}

fn is_rate(shown: &Shown) -> bool {
    matches!(shown.mark, Some(Mark::Faster | Mark::Slower))
}

/// Alive by a latched message counts most, since it says more than messages do.
fn livelier(a: State, b: State) -> State {
    let rank = |state| match state {
        State::Latched => 0,
        State::Active => 1,
        State::Silent => 2,
        State::Declared => 3,
    };
    if rank(a) <= rank(b) { a } else { b }
}
