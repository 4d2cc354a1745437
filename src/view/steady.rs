//! The look of an element over several windows, without flicker from window to window.

use super::shown::{ShownRuns, ShownRunsWriter};
use super::{Mark, Shown};
use crate::base::time::Span;
use crate::evidence::Confidence;
use crate::graph::State;

/// The length of all windows before each, in nanoseconds; the last entry is the length of all.
pub(crate) struct Lengths(Vec<i64>);

impl Lengths {
    pub(crate) fn new(windows: impl Iterator<Item = Span>) -> Self {
        let mut whole = 0_i64;
        let mut all = vec![0];
        all.extend(windows.map(|span| {
            whole = whole.saturating_add(span.nanos());
            whole
        }));
        Self(all)
    }

    /// The length of the windows `from..to`, in nanoseconds.
    pub(crate) fn of(&self, from: u32, to: u32) -> f64 {
        let at = |window: u32| self.0.get(window as usize).copied().unwrap_or(0);
        (at(to) - at(from)) as f64
    }

    pub(crate) fn windows(&self) -> u32 {
        u32::try_from(self.0.len() - 1).unwrap_or(u32::MAX)
    }
}

/// The facts gathered so far about an element's current lifetime.
#[derive(Clone, Copy, Default)]
struct PresentLife {
    look: Option<(State, Confidence)>,
    /// Messages and nanoseconds since its rate last changed.
    sent: (f64, f64),
    /// Nanoseconds since the last window with messages.
    idle: f64,
    is_measured: bool,
    /// The rate that is written, with its number of messages.
    held: Option<(f64, Option<u64>)>,
}

/// A look in some consecutive windows.
struct ShownRun<'a> {
    from: u32,
    to: u32,
    place: u32,
    shown: &'a Shown,
    /// Its stable state, confidence and average rate.
    look: (State, Confidence),
    steady_hz: Option<f64>,
    held: Option<(f64, Option<u64>)>,
}

/// Gives an item or arrow its most active state and its strongest confidence for as long as it exists, and
/// its average rate between two rate changes.
///
/// A topic with a message per minute is also active in the seconds in between; only a pause in the event log
/// is drawn as one.
pub(crate) fn stable(raw: &ShownRuns, lengths: &Lengths) -> ShownRuns {
    let mut runs = runs(raw, lengths.windows());
    let mut life = PresentLife::default();
    let mut last = 0;
    for run in &mut runs {
        if last != run.from || run.shown.mark == Some(Mark::Added) {
            life = PresentLife::default();
        }
        life.forward(run, lengths);
        last = if is_ghost(run.shown) { 0 } else { run.to };
    }
    // Backwards, so that facts known at the end of a lifetime apply to all of it.
    let mut next = u32::MAX;
    for run in runs.iter_mut().rev() {
        if next != run.to || is_ghost(run.shown) {
            life = PresentLife::default();
        }
        life.backward(run);
        next = if run.shown.mark == Some(Mark::Added) {
            u32::MAX
        } else {
            run.from
        };
    }
    written(&runs, lengths.windows())
}

fn runs(raw: &ShownRuns, windows: u32) -> Vec<ShownRun<'_>> {
    let runs = raw.spans(windows);
    let runs = runs.map(|(from, to, place, shown)| ShownRun {
        from,
        to,
        place,
        shown,
        look: (shown.state, shown.confidence),
        steady_hz: None,
        held: None,
    });
    runs.collect()
}

impl PresentLife {
    fn forward(&mut self, run: &mut ShownRun<'_>, lengths: &Lengths) {
        let shown = run.shown;
        if is_rate(shown) {
            (self.sent, self.idle, self.is_measured) = ((0.0, 0.0), 0.0, false);
        }
        if !shown.is_paused {
            let old = self.look.unwrap_or(run.look);
            self.look = Some((livelier(old.0, run.look.0), old.1.min(run.look.1)));
        }
        // The rate of a ghost is not shown.
        let is_own = !shown.is_paused && !is_ghost(shown);
        if let Some(hz) = shown.hz.filter(|hz| hz.is_finite() && is_own) {
            // Its rate is that from the first message to the last.
            let length = lengths.of(run.from, run.to);
            if hz > 0.0 {
                let time = self.sent.1 + self.idle + length;
                (self.sent, self.idle) = ((self.sent.0 + hz * length, time), 0.0);
            } else if self.sent.0 > 0.0 {
                self.idle += length;
            }
            self.is_measured = true;
        }
        let (sent, time) = self.sent;
        run.steady_hz = self.is_measured.then(|| sent / time.max(1.0));
        let seconds = lengths.of(run.from, run.from + 1) / 1e9;
        // A window with an event shows the event's number, and a few messages make no rate.
        let is_few = shown.count.is_some_and(|count| count < FEWEST);
        if shown.mark.is_some() || is_few && self.held.is_none() {
            self.held = None;
        } else if self.held.is_none_or(|held| differs(held.0, shown, seconds)) {
            self.held = shown.hz.map(|hz| (hz, shown.count)).filter(|_| !is_few);
        }
        run.held = self.held;
        self.show(run);
    }

    fn backward(&mut self, run: &mut ShownRun<'_>) {
        if !run.shown.is_paused {
            self.look = self.look.or(Some(run.look));
        }
        // `sent` contains the rate from here to its next change.
        if self.is_measured {
            run.steady_hz = Some(self.sent.0);
        }
        self.sent = (run.steady_hz.unwrap_or(0.0), 0.0);
        self.is_measured = run.steady_hz.is_some() && !is_rate(run.shown);
        self.show(run);
    }

    fn show(&self, run: &mut ShownRun<'_>) {
        if let Some(look) = self.look.filter(|_| !run.shown.is_paused) {
            run.look = look;
        }
    }
}

/// The runs with their stable looks.
fn written(runs: &[ShownRun<'_>], windows: u32) -> ShownRuns {
    let mut writer = ShownRunsWriter::default();
    let look = |run: &ShownRun<'_>| (run.look, run.steady_hz, run.held);
    let is_same = |a: &ShownRun<'_>, b: &ShownRun<'_>| look(a) == look(b);
    // Between two changes only the numbers differ, and only a few of them.
    let mut places: Vec<Option<u32>> = Vec::new();
    let mut before: Option<&ShownRun<'_>> = None;
    for run in runs {
        if before.is_none_or(|before| !is_same(before, run)) {
            places.clear();
        }
        if let Some(before) = before.filter(|before| before.to < run.from) {
            writer.show(before.to, None);
        }
        let at = run.place as usize;
        places.resize(places.len().max(at + 1), None);
        let place = *places[at].get_or_insert_with(|| {
            let (state, confidence) = run.look;
            writer.look(Shown {
                state,
                confidence,
                steady_hz: run.steady_hz,
                held: run.held,
                ..run.shown.clone()
            })
        });
        writer.turn(run.from, place);
        before = Some(run);
    }
    if let Some(last) = before.filter(|last| last.to < windows) {
        writer.show(last.to, None);
    }
    writer.finish()
}

/// The least difference of a rate that changes the number that is written: as a share, and in standard deviations of
/// the number of messages.
const DIFFERENT: (f64, f64) = (0.25, 2.0);

/// The fewest messages in a window that make a rate: of four, one more or less is a quarter, the least difference that
/// counts.
const FEWEST: u64 = 5;

/// Whether the rate of a window of so many seconds differs from `held` by more than chance.
fn differs(held: f64, shown: &Shown, seconds: f64) -> bool {
    let by = shown.hz.map_or(0.0, |hz| (hz - held).abs());
    let is_chance =
        shown.count.is_some() && by * seconds <= DIFFERENT.1 * libm::sqrt(held * seconds);
    by > DIFFERENT.0 * held && !is_chance
}

fn is_rate(shown: &Shown) -> bool {
    matches!(shown.mark, Some(Mark::Faster | Mark::Slower))
}

fn is_ghost(shown: &Shown) -> bool {
    shown.mark == Some(Mark::Removed)
}

/// The more active of two states. Latched counts most, since it is more informative than active.
fn livelier(a: State, b: State) -> State {
    let rank = |state| match state {
        State::Latched => 0,
        State::Active => 1,
        State::Silent => 2,
        State::Declared => 3,
    };
    if rank(a) <= rank(b) { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

    /// The rate that is written in each window of ten seconds with so many messages.
    fn written_rates(counts: &[u64]) -> Vec<f64> {
        let shown = |count: &u64| Shown {
            hz: Some(*count as f64 / 10.0),
            count: Some(*count),
            ..Shown::plain(0, State::Active, Confidence::Measured)
        };
        let shown: Vec<Shown> = counts.iter().map(shown).collect();
        let window = Span::new(Stamp(0), Stamp(10_000_000_000));
        let lengths = Lengths::new(counts.iter().map(|_| window));
        let looks = stable(&ShownRuns::of(shown.iter().map(Some)), &lengths);
        let rate = |at| looks.at(at)?.written_rate().0;
        (0..counts.len()).filter_map(rate).collect()
    }

    #[test]
    fn an_average_rate_is_that_from_the_first_message_to_the_last() {
        let shown = [0, 100, 0, 50, 0].map(|count| Shown {
            hz: Some(f64::from(count) / 10.0),
            ..Shown::plain(0, State::Active, Confidence::Measured)
        });
        let window = Span::new(Stamp(0), Stamp(10_000_000_000));
        let lengths = Lengths::new(shown.iter().map(|_| window));
        let looks = stable(&ShownRuns::of(shown.iter().map(Some)), &lengths);
        let steady = (0..5).map(|at| looks.at(at).unwrap().steady_hz);
        assert_eq!(steady.collect::<Vec<_>>(), [Some(5.0); 5]);
    }

    #[test]
    fn a_written_rate_ends_where_chance_does_not_explain_the_number() {
        let by_chance = written_rates(&[71, 80, 64, 71]);
        assert_eq!(by_chance, [7.1, 7.1, 7.1, 7.1]);
        // No messages, and a few.
        assert_eq!(written_rates(&[71, 0, 3, 70]), [7.1, 0.0, 0.3, 7.0]);
        assert_eq!(written_rates(&[6, 5, 0, 6]), [0.6, 0.6, 0.0, 0.6]);
    }
}
