//! One lifetime of an element: when it begins and ends by the evidence for both.

use crate::base::rhythm::{ADVERTISED_NS, DISCOVERY_NS, FOUND_NS, REGISTRATION_NS};
use crate::base::time::Stamp;
use crate::graph::history::Bound;

/// A period of existence, both ends included; it never ends before it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lifetime {
    from: Stamp,
    to: Stamp,
    /// The first sign of it.
    pub(crate) sign: Stamp,
    pub(crate) began: Option<Bound>,
    pub(crate) ended: Option<Bound>,
}

impl Lifetime {
    /// A lifetime of the whole mission.
    pub(crate) fn whole(mission: (Stamp, Stamp)) -> Self {
        Self {
            from: mission.0,
            to: mission.1,
            sign: mission.0,
            began: None,
            ended: None,
        }
    }

    pub(crate) fn from(&self) -> Stamp {
        self.from
    }

    pub(crate) fn to(&self) -> Stamp {
        self.to
    }

    /// Sets the beginning, which is not after the end.
    pub(super) fn begin_at(&mut self, from: Stamp, began: Option<Bound>) {
        (self.from, self.began) = (from.min(self.to), began);
    }

    /// Sets the end, which is not before the beginning.
    pub(super) fn end_at(&mut self, to: Stamp, ended: Option<Bound>) {
        (self.to, self.ended) = (to.max(self.from), ended);
    }

    fn at(sign: Stamp) -> Self {
        Self {
            from: sign,
            to: sign,
            sign,
            began: Some(Bound {
                time: sign,
                earliest: Stamp::MIN,
                latest: sign,
            }),
            ended: None,
        }
    }

    /// The part of it inside another one; `None` if they do not overlap.
    pub(super) fn within(&self, other: &Self) -> Option<Self> {
        let later = if other.from > self.from { other } else { self };
        let sooner = if other.to < self.to { other } else { self };
        (later.from <= sooner.to).then_some(Self {
            from: later.from,
            to: sooner.to,
            sign: self.sign.max(later.from),
            began: later.began,
            ended: sooner.ended,
        })
    }

    /// Ends the lifetime because of evidence.
    pub(super) fn close(&mut self, end: Stamp) {
        let (last, end) = (self.to, end.max(self.to));
        let ended = Bound {
            time: end,
            earliest: last,
            latest: end,
        };
        self.end_at(end, Some(ended));
    }

    /// Sets the beginning of a first lifetime: with a rhythm it began shortly before its first sign, and in any case after
    /// its last known absence.
    /// `recording` is the start of its own recording, one of several; without evidence it began before.
    pub(super) fn begin(
        &mut self,
        mission: Stamp,
        recording: Stamp,
        period: Option<i64>,
        is_proved: bool,
    ) {
        let late = period.unwrap_or(0);
        if !is_proved || self.from.since(recording) <= FOUND_NS.saturating_add(late) {
            self.begin_at(mission, None);
        } else if let Some(began) = &mut self.began {
            let sooner = DISCOVERY_NS.saturating_add(late);
            let possible = period.map_or(mission, |_| self.from.plus(-sooner));
            began.earliest = began.earliest.max(possible);
        }
    }

    /// Sets the beginning of an edge's first lifetime inside its node's; `absent` is the first moment at
    /// which it may exist, if known. A first message that is not due earlier (`is_due`) is not a beginning.
    pub(super) fn begin_within(
        &mut self,
        around: &Self,
        absent: Option<Stamp>,
        stated: bool,
        is_due: bool,
    ) {
        let registered = around.from.plus(REGISTRATION_NS);
        match absent {
            Some(absent) => {
                if stated {
                    self.from = absent.max(registered).min(self.from);
                }
                if let Some(began) = &mut self.began {
                    began.earliest = absent;
                }
            }
            None if stated || is_due || self.from.since(around.sign) <= ADVERTISED_NS => {
                self.begin_at(around.from, around.began);
            }
            None => {
                if let Some(began) = &mut self.began {
                    began.earliest = around.from;
                }
            }
        }
    }
}

/// Lifetimes between ends, from sorted signs and sorted ends; an end at the time of a sign comes after it.
/// The true end lies between the evidence and the sign before, the true beginning between the sign and the
/// end before.
pub(super) fn lives(signs: &[Stamp], ends: &[Stamp]) -> Vec<Lifetime> {
    let mut lives: Vec<Lifetime> = Vec::new();
    let mut ends = ends.iter().copied().peekable();
    let (mut open, mut gone) = (false, Stamp::MIN);
    for sign in signs {
        while let Some(end) = ends.next_if(|end| end < sign) {
            if let Some(life) = lives.last_mut().filter(|_| open) {
                life.close(end);
            }
            (open, gone) = (false, end);
        }
        match lives.last_mut() {
            Some(life) if open => life.end_at(*sign, None),
            _ => {
                let mut life = Lifetime::at(*sign);
                life.began = life.began.map(|b| Bound {
                    earliest: gone,
                    ..b
                });
                lives.push(life);
            }
        }
        open = true;
    }
    if let (Some(life), Some(end)) = (lives.last_mut(), ends.next()) {
        life.close(end);
    }
    lives.shrink_to_fit();
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
    fn a_beginning_is_not_before_the_last_known_absence() {
        let stamp = |seconds: i64| Stamp(seconds * 1_000_000_000);
        let earliest = |ends: &[Stamp], period| {
            let mut life = lives(&[stamp(30)], ends)[0];
            life.begin(stamp(0), stamp(0), period, true);
            life.began.unwrap().earliest
        };
        assert_eq!(earliest(&[stamp(4), stamp(20)], None), stamp(20));
        assert_eq!(earliest(&[stamp(29)], Some(5_000_000_000)), stamp(29));
        assert_eq!(earliest(&[], None), stamp(0));
    }

    #[test]
    fn a_lifetime_spans_its_signs() {
        assert_eq!(stretches(&[1, 5, 9], &[]), [(1, 9)]);
        assert_eq!(stretches(&[], &[4]), []);
    }

    #[test]
    fn an_end_closes_a_lifetime_and_the_next_sign_begins_another() {
        assert_eq!(stretches(&[1, 5, 9, 10], &[6]), [(1, 6), (9, 10)]);
        assert_eq!(stretches(&[1, 5], &[0, 7, 8]), [(1, 7)]);
        assert_eq!(stretches(&[1, 5], &[5]), [(1, 5)]);
    }
}
