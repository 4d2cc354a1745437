//! Simulated time: where it was set back, stood still, or had another speed than the recorder's clock. For example, `/clock` counts to
//! 104 s, is silent for 6 s and goes on at 104.01 s: the simulation was paused. If it goes on at 110 s, the recorder was.

use std::collections::BTreeSet;
use std::io;

use crate::base::ids::grouped;
use crate::base::rhythm::{
    CLOSE_NS, GAP, GAP_NS, SAME_STEP, SPEED_FEWEST, SPEED_HOLDS_NS, SPEED_NS, SPEED_SHARE,
    TOGETHER_NS,
};
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::Recorded;
use crate::evidence::observation::Name;
use crate::evidence::times::SeriesId;
use crate::graph::history::Stretch;
use crate::graph::history::senders::Traffic;

/// The most steps and pauses: with more, several clocks are recorded as one.
const MOST: usize = 64;

/// What simulated time did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ClockChange {
    /// It was set back by this many nanoseconds.
    Back(i64),
    /// It stood still.
    Paused,
    /// It had this speed, as a multiple of the recorder's clock.
    Speed(f64),
}

/// The changes of simulated time, each with the time for which it lasted; all speeds, usual ones too.
#[derive(Debug, Default)]
pub(crate) struct Simulation {
    pub(crate) changes: Vec<(Span, ClockChange)>,
    speeds: Vec<(Span, f64)>,
}

/// Reads the simulated time of a mission: from `/clock`, without one from the rates of its senders.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn simulation(recorded: &Recorded, traffic: &Traffic) -> io::Result<Simulation> {
    // One clock, possibly in the parts of a recording; of several, the one with the most messages.
    let clocks = recorded.facts.clocks.somes().map(|(at, series)| {
        let stream = &recorded.streams[at];
        ((stream.topic, stream.publisher), *series)
    });
    let clocks = grouped(clocks);
    let times = &recorded.facts.times;
    let many = |of: &&Vec<SeriesId>| of.iter().map(|series| times.count(*series)).sum::<u64>();
    let Some(clock) = clocks.values().max_by_key(many) else {
        return Ok(Simulation::of_speeds(speeds_of_rates(traffic)));
    };
    let mut ticks = Ticks::default();
    times.merge(clock, |timed| ticks.add(timed.time, timed.size))?;
    Ok(ticks.simulation())
}

impl Simulation {
    fn of_speeds(speeds: Vec<(Span, f64)>) -> Self {
        let unusual = speeds
            .iter()
            .filter(|(_, speed)| !is_same(*speed, 1.0, UNUSUAL));
        let changes = unusual.map(|(span, speed)| (*span, ClockChange::Speed(*speed)));
        Self {
            changes: changes.collect(),
            speeds,
        }
    }

    /// The times at which it stood still, sorted.
    pub(crate) fn pauses(&self) -> impl Iterator<Item = Span> + '_ {
        let paused = self.changes.iter();
        let paused = paused.filter(|(_, what)| *what == ClockChange::Paused);
        paused.map(|(span, _)| *span)
    }

    /// Whether the clock explains that a rate changes at `at` by this factor.
    pub(crate) fn explains(&self, at: Stamp, factor: f64) -> bool {
        self.speeds.windows(2).any(|pair| {
            let step = pair[1].1 / pair[0].1;
            let is_near = at.since(pair[1].0.start).abs() <= TOGETHER_NS;
            is_near && !is_same(step, 1.0, SAME_STEP) && is_same(step, factor, SAME_STEP)
        })
    }
}

/// The factor by which a speed differs from the usual one: with less, every simulation on a busy computer would.
const UNUSUAL: f64 = 1.1;

fn is_same(a: f64, b: f64, most: f64) -> bool {
    (1.0 / most..=most).contains(&(a / b))
}

/// The ticks of a clock, one after another.
#[derive(Default)]
struct Ticks {
    /// The time of the last tick, and of the last one at which the clock moved, with its milliseconds.
    last: Stamp,
    moved: Option<(Stamp, u32)>,
    /// The beginning of the present part, and the simulated time since.
    part: (Stamp, i64),
    parts: Vec<(Span, f64)>,
    changes: Vec<(Span, ClockChange)>,
}

impl Ticks {
    fn add(&mut self, time: Stamp, millis: u32) {
        self.last = time;
        let Some((moved, before)) = self.moved else {
            (self.moved, self.part) = (Some((time, millis)), (time, 0));
            return;
        };
        let step = i64::from(millis.wrapping_sub(before).cast_signed()) * 1_000_000;
        let waited = time.since(moved);
        if step == 0 || (1 - GAP_NS..0).contains(&step) {
            return;
        }
        let change = if step < 0 {
            Some((Span::new(time, time), ClockChange::Back(-step)))
        } else {
            let is_still = waited >= GAP_NS && step.saturating_mul(2 * GAP) <= waited;
            is_still.then_some((Span::new(moved, time), ClockChange::Paused))
        };
        if change.is_none() {
            self.part.1 += step;
        }
        let part = Span::new(self.part.0, if change.is_none() { time } else { moved });
        let is_over = part.nanos() >= SPEED_NS;
        if is_over {
            self.parts
                .push((part, self.part.1 as f64 / part.nanos() as f64));
        }
        if is_over || change.is_some() {
            self.part = (time, 0);
        }
        self.changes.extend(change);
        self.moved = Some((time, millis));
    }

    fn simulation(mut self) -> Simulation {
        let moved = self.moved.map_or(self.last, |(moved, _)| moved);
        if self.last.since(moved) >= GAP_NS {
            self.changes
                .push((Span::new(moved, self.last), ClockChange::Paused));
        }
        let rest = Span::new(self.part.0, moved);
        if rest.nanos() >= GAP_NS {
            self.parts
                .push((rest, self.part.1 as f64 / rest.nanos() as f64));
        }
        if self.changes.len() > MOST {
            return Simulation::default();
        }
        let mut all = Simulation::of_speeds(lasting(self.parts));
        all.changes.extend(self.changes);
        all.changes.sort_by_key(|(span, _)| span.start);
        all
    }
}

/// Parts of about the same speed as one, each of which lasts: a hesitation is a part of the time after it.
fn lasting(mut parts: Vec<(Span, f64)>) -> Vec<(Span, f64)> {
    for least in [SPEED_HOLDS_NS, 0] {
        let mut all: Vec<(Span, f64)> = Vec::new();
        for (span, speed) in parts {
            let last = all.last_mut();
            let is_part = |(before, mean): &&mut (Span, f64)| {
                before.nanos() < least || is_same(*mean, speed, SAME_STEP)
            };
            if let Some((before, mean)) = last.filter(is_part) {
                let (old, new) = (before.nanos() as f64, span.nanos() as f64);
                *mean = (*mean * old + speed * new) / (old + new);
                before.end = span.end;
            } else {
                all.push((span, speed));
            }
        }
        parts = all;
    }
    parts.retain(|(span, _)| span.nanos() >= SPEED_HOLDS_NS);
    parts
}

/// A change of a sender's rate.
#[derive(Clone, Copy)]
struct RateStep {
    at: Stamp,
    factor: f64,
    node: Option<Name>,
}

/// The speeds of a clock that is not recorded: if nearly all senders change their rates by one factor at once, it is the clock.
fn speeds_of_rates(traffic: &Traffic) -> Vec<(Span, f64)> {
    let senders = traffic.iter().flatten().flat_map(|of| &of.list);
    let senders: Vec<_> = senders.filter(|s| !s.latched).collect();
    let mut steps: Vec<RateStep> = Vec::new();
    for sender in &senders {
        for pair in sender.stretches.windows(2) {
            if pair[1].is_joined && pair.iter().all(Stretch::has_rate) {
                steps.push(RateStep {
                    at: pair[1].first,
                    factor: pair[1].hz() / pair[0].hz(),
                    node: sender.node,
                });
            }
        }
    }
    steps.sort_by_key(|step| step.at);
    let stretches = || senders.iter().flat_map(|sender| &sender.stretches);
    let first = stretches().map(|s| s.first).min();
    let last = stretches().map(|s| s.last).max();
    let Some((mut from, end)) = first.zip(last) else {
        return Vec::new();
    };
    let (mut speeds, mut speed) = (Vec::new(), 1.0);
    while let Some(RateStep { at, factor, .. }) = steps.first().copied() {
        let many = steps.partition_point(|other| other.at.since(at) <= CLOSE_NS);
        let together = &steps[..many];
        let alike = together
            .iter()
            .filter(|other| is_same(other.factor, factor, SAME_STEP));
        let nodes: BTreeSet<Name> = alike.clone().filter_map(|step| step.node).collect();
        let alike = alike.count();
        // Others that go on as before, and would show it.
        let goes_on = |s: &Stretch| {
            let margin = SPEED_HOLDS_NS / 2;
            let spans = s.first.plus(margin) <= at && at <= s.last.plus(-margin);
            spans && s.is_even && s.period <= GAP_NS
        };
        let others = senders.iter();
        let others = others.filter(|s| s.stretches.iter().any(goes_on)).count();
        let is_most = alike * 100 >= (many + others) * SPEED_SHARE;
        // Slow topics show the same step somewhat later.
        let is_new = at.since(from) >= SPEED_HOLDS_NS;
        if is_new && is_most && alike >= SPEED_FEWEST.0 && nodes.len() >= SPEED_FEWEST.1 {
            speeds.push((Span::new(from, at), speed));
            (from, speed) = (at, speed * factor);
        }
        steps.drain(..many);
    }
    speeds.push((Span::new(from, end), speed));
    speeds
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    /// The changes of a clock that ticks at these times, in tenths of a second and in simulated milliseconds.
    fn changes(ticks: impl Iterator<Item = (i64, u32)>) -> Vec<(i64, i64, ClockChange)> {
        let mut all = Ticks::default();
        ticks.for_each(|(at, millis)| all.add(Stamp(at * SECOND / 10), millis));
        let changes = all.simulation().changes.into_iter();
        let second = |at: Stamp| at.0 / SECOND;
        changes
            .map(|(span, what)| (second(span.start), second(span.end), what))
            .collect()
    }

    /// Ten ticks a second, each advancing by the millis that `step` says for its number.
    fn clock(step: impl Fn(u32) -> i32) -> impl Iterator<Item = (i64, u32)> {
        let mut now = 4_294_900_000_u32;
        (0..1000).map(move |tick| {
            now = now.wrapping_add_signed(step(tick));
            (i64::from(tick), now)
        })
    }

    #[test]
    fn a_clock_that_goes_on_shows_nothing() {
        assert_eq!(changes(clock(|_| 100)), []);
        let hole = clock(|_| 100).filter(|(at, _)| !(300..400).contains(at));
        assert_eq!(changes(hole), []);
        let late = clock(|tick| match tick {
            5 => -50,
            6 => 250,
            _ => 100,
        });
        assert_eq!(changes(late), []);
    }

    #[test]
    fn steps_pauses_and_speeds_are_found() {
        let back = changes(clock(|tick| if tick == 500 { -45_000 } else { 100 }));
        assert_eq!(back, [(50, 50, ClockChange::Back(45 * SECOND))]);
        let paused = |tick| if (300..360).contains(&tick) { 0 } else { 100 };
        assert_eq!(changes(clock(paused)), [(29, 36, ClockChange::Paused)]);
        let silent = clock(paused).filter(|(at, _)| !(300..360).contains(at));
        assert_eq!(changes(silent), [(29, 36, ClockChange::Paused)]);
        let slow = changes(clock(|tick| if tick < 400 { 100 } else { 70 }));
        let [(40, 99, ClockChange::Speed(speed))] = slow[..] else {
            panic!("{slow:?}");
        };
        assert!((speed - 0.7).abs() < 0.01);
    }
}
