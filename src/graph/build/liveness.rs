//! When something is alive: from its first sign to its last, held on by latched messages, ended by proofs of an end.

use std::collections::BTreeMap;

use super::windows::Windows;
use crate::base::time::{Span, Stamp};
use crate::evidence::{Degree, Evidence};
use crate::graph::State;

/// A node has registered its topics this long after its first sign.
const REGISTRATION_NS: i64 = 1_000_000_000;

/// How far a life reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Extent {
    /// As far as its signs.
    Signs,
    /// The whole mission, unless there are signs: a header or a file declares it.
    Whole,
    /// The whole mission, whatever its signs say.
    Always,
}

/// One stretch of being alive, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lifetime {
    pub(crate) from: Stamp,
    /// The last sign; from here on it is only held.
    pub(crate) spoke: Stamp,
    pub(crate) to: Stamp,
}

/// What is known about the life of one element.
#[derive(Clone, Debug)]
pub(crate) struct Liveness {
    pub(crate) evidence: Evidence,
    /// How well it is known where no message proves it.
    pub(crate) quiet: Degree,
    /// Signs that bound lives: sorted later.
    pub(crate) signs: Vec<Stamp>,
    /// Those of the signs by which somebody states what holds already.
    pub(crate) stated: Vec<Stamp>,
    /// Proofs of an end.
    pub(crate) ends: Vec<Stamp>,
    /// Whether it lives on after its last sign.
    pub(crate) held: bool,
    /// Whether messages came in a rhythm that broke off before the mission's end.
    pub(crate) ceased: bool,
    /// Since when a latched message stands for it.
    pub(crate) latched: Option<Stamp>,
    /// Windows with signs, and how strong the best one is.
    pub(crate) active: BTreeMap<usize, Degree>,
    /// Whether it is there for the whole mission.
    pub(crate) extent: Extent,
    pub(crate) lives: Vec<Lifetime>,
}

impl Default for Liveness {
    fn default() -> Self {
        Self {
            evidence: Evidence::NONE,
            quiet: Degree::Declared,
            signs: Vec::new(),
            stated: Vec::new(),
            ends: Vec::new(),
            held: false,
            ceased: false,
            latched: None,
            active: BTreeMap::new(),
            extent: Extent::Signs,
            lives: Vec::new(),
        }
    }
}

impl Liveness {
    /// Marks a window as one with a sign.
    pub(crate) fn mark(&mut self, window: usize, degree: Degree) {
        let best = self.active.entry(window).or_insert(degree);
        *best = degree.min(*best);
    }

    /// Adds signs, sorted, that mark their windows and state what holds already; of those with no end between them only
    /// the outer two are kept.
    pub(crate) fn sign_all(
        &mut self,
        signs: &[Stamp],
        ends: &[Stamp],
        degree: Degree,
        windows: &Windows<'_>,
    ) {
        let before = self.signs.len();
        self.begin_all(signs, ends, degree, windows);
        self.stated.extend(&self.signs[before..]);
    }

    /// The same for signs that are beginnings.
    pub(crate) fn begin_all(
        &mut self,
        signs: &[Stamp],
        ends: &[Stamp],
        degree: Degree,
        windows: &Windows<'_>,
    ) {
        for time in signs {
            for window in windows.over(*time, *time) {
                self.mark(window, degree);
            }
        }
        self.bound_all(signs, ends);
    }

    /// Adds signs, sorted, that mark nothing; of those with no end between them only the outer two are kept.
    pub(crate) fn bound_all(&mut self, signs: &[Stamp], ends: &[Stamp]) {
        let before = |time: &Stamp| ends.partition_point(|end| end < time);
        for run in signs.chunk_by(|a, b| before(a) == before(b)) {
            self.signs.extend(run.first());
            self.signs.extend(run.last());
        }
        self.ends.extend(ends);
    }

    /// Takes on what another element proves about this one: an edge proves its node and its topic.
    pub(crate) fn learn(&mut self, other: &Self) {
        self.evidence = self.evidence.and(other.evidence);
        self.quiet = self.quiet.min(other.quiet);
        self.signs.extend(&other.signs);
        self.held |= other.held;
        self.ceased |= other.ceased;
        self.extent = self.extent.max(other.extent.min(Extent::Whole));
        self.latched = match (self.latched, other.latched) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        for (window, degree) in &other.active {
            self.mark(*window, *degree);
        }
    }

    /// Works out the lives from the signs alone; `linger` is the last moment of somebody whose last sign is known.
    pub(crate) fn live(&mut self, mission: (Stamp, Stamp), linger: impl Fn(Stamp) -> Stamp) {
        self.signs.sort_unstable();
        self.ends.sort_unstable();
        self.lives = lives(&self.signs, &self.ends);
        if let Some(life) = self.lives.last_mut() {
            let ended = self.ends.last().is_some_and(|end| *end >= life.spoke);
            life.to = match (ended, self.held && !self.ceased) {
                (true, _) => life.to,
                (false, true) => mission.1,
                (false, false) => linger(life.spoke),
            };
        }
        if self.is_whole() {
            self.lives = vec![Lifetime {
                from: mission.0,
                spoke: mission.1,
                to: mission.1,
            }];
        }
    }

    /// Works out the lives of an edge inside those of its node: whoever has advertised or subscribed a topic does so
    /// until it ends, unless something else is known. What somebody states was so before he said it, unless its absence
    /// is known; a first message, in contrast, is a beginning.
    pub(crate) fn live_within(&mut self, node: &[Lifetime]) {
        self.signs.sort_unstable();
        self.ends.sort_unstable();
        self.ends.dedup();
        self.stated.sort_unstable();
        if self.is_whole() || self.signs.is_empty() {
            self.lives = if self.is_whole() {
                node.to_vec()
            } else {
                Vec::new()
            };
            return;
        }
        self.lives.clear();
        for around in node {
            let from = self.signs.partition_point(|s| *s < around.from);
            let to = self.signs.partition_point(|s| *s <= around.to);
            let mut inside = lives(&self.signs[from..to], &self.ends);
            if let Some(first) = inside.first_mut()
                && self.stated.binary_search(&first.from).is_ok()
            {
                let next = self.ends.partition_point(|end| *end < first.from);
                let absent = next.checked_sub(1).map(|at| self.ends[at].plus(1));
                let since = around
                    .from
                    .plus(REGISTRATION_NS)
                    .max(absent.unwrap_or(Stamp::MIN));
                first.from = since.min(first.from);
            }
            if let Some(last) = inside.last_mut() {
                let ended = self.ends.iter().find(|end| **end >= last.spoke);
                last.to = ended.map_or(around.to, |end| (*end).min(around.to));
            }
            self.lives.extend(inside);
        }
    }

    /// How alive it is in a window, and how well that is known; `None` if it is not there.
    pub(crate) fn state(&self, window: usize, span: Span) -> Option<(State, Degree)> {
        if let Some(degree) = self.active.get(&window) {
            return Some((State::Active, *degree));
        }
        let alive = |life: &&Lifetime| life.from < span.end && span.start <= life.to;
        let life = self.lives.iter().find(alive)?;
        let state = if self.signs.is_empty() && self.is_whole() && self.quiet == Degree::Declared {
            State::Declared
        } else if life.spoke < span.start && self.latched.is_some_and(|since| since < span.end) {
            State::Latched
        } else {
            State::Silent
        };
        Some((state, self.quiet))
    }

    /// Whether it is there for the whole mission.
    fn is_whole(&self) -> bool {
        match self.extent {
            Extent::Signs => false,
            Extent::Whole => self.signs.is_empty(),
            Extent::Always => true,
        }
    }

    /// The first and last sign.
    pub(crate) fn bounds(&self) -> (Option<Stamp>, Option<Stamp>) {
        (self.signs.first().copied(), self.signs.last().copied())
    }
}

/// Lives between ends, from sorted signs and sorted ends; an end at the time of a sign comes after it.
fn lives(signs: &[Stamp], ends: &[Stamp]) -> Vec<Lifetime> {
    let mut lives: Vec<Lifetime> = Vec::new();
    let mut ends = ends.iter().copied().peekable();
    let mut open = false;
    for sign in signs {
        while let Some(end) = ends.next_if(|end| end < sign) {
            if let Some(life) = lives.last_mut().filter(|_| open) {
                life.to = end;
            }
            open = false;
        }
        match lives.last_mut() {
            Some(life) if open => (life.spoke, life.to) = (*sign, *sign),
            _ => lives.push(Lifetime {
                from: *sign,
                spoke: *sign,
                to: *sign,
            }),
        }
        open = true;
    }
    if let (Some(life), Some(end)) = (lives.last_mut(), ends.next()) {
        life.to = life.to.max(end);
    }
    lives
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretches(signs: &[i64], ends: &[i64]) -> Vec<(i64, i64)> {
        let stamps = |list: &[i64]| list.iter().map(|t| Stamp(*t)).collect::<Vec<_>>();
        let lives = lives(&stamps(signs), &stamps(ends));
        lives.iter().map(|l| (l.from.0, l.to.0)).collect()
    }

    #[test]
    fn a_life_spans_its_signs() {
        assert_eq!(stretches(&[1, 5, 9], &[]), [(1, 9)]);
        assert_eq!(stretches(&[], &[4]), []);
    }

    #[test]
    fn an_end_closes_a_life_and_the_next_sign_opens_another() {
        assert_eq!(stretches(&[1, 5, 9, 10], &[6]), [(1, 6), (9, 10)]);
        assert_eq!(stretches(&[1, 5], &[0, 7, 8]), [(1, 7)]);
        assert_eq!(stretches(&[1, 5], &[5]), [(1, 5)]);
    }
}
