//! Which times to believe: a few messages far from all others were recorded with a clock that was not set.

use std::collections::BTreeMap;

use crate::base::time::{Span, Stamp};

const DAY: i64 = 86_400_000_000_000;
/// Times further than this from all others are strangers.
const FAR_DAYS: i64 = 365;
/// Of so many messages at most one may be a stranger that is set aside.
const RARE: u64 = 10;

/// The times to believe, if a few messages lie far from the bulk; `None` to believe all.
pub(crate) fn believed(days: &BTreeMap<i64, u64>) -> Option<Span> {
    let mut clusters: Vec<(i64, i64, u64)> = Vec::new();
    for (day, count) in days {
        match clusters.last_mut() {
            Some((_, last, sum)) if day - *last <= FAR_DAYS => {
                *last = *day;
                *sum += count;
            }
            _ => clusters.push((*day, *day, *count)),
        }
    }
    let total: u64 = days.values().sum();
    let (first, last, count) = clusters.iter().max_by_key(|c| c.2)?;
    let strangers = total - count;
    let rare = strangers <= (total / RARE).max(1) && strangers < *count;
    (strangers > 0 && rare).then(|| Span {
        start: Stamp(first.saturating_mul(DAY)),
        end: Stamp((last + 1).saturating_mul(DAY)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(days: &[(i64, u64)]) -> Option<(i64, i64)> {
        let span = believed(&days.iter().copied().collect())?;
        Some((span.start.0 / DAY, span.end.0 / DAY))
    }

    #[test]
    fn a_few_messages_far_from_the_bulk_are_set_aside() {
        assert_eq!(kept(&[(0, 3), (20_000, 500)]), Some((20_000, 20_001)));
        assert_eq!(kept(&[(0, 1), (20_000, 2)]), Some((20_000, 20_001)));
        assert_eq!(kept(&[(0, 500), (20_000, 3)]), Some((0, 1)));
    }

    #[test]
    fn a_bag_that_is_one_piece_or_two_halves_is_kept_whole() {
        assert_eq!(kept(&[(0, 500)]), None);
        assert_eq!(kept(&[(20_000, 2), (20_006, 3)]), None);
        assert_eq!(kept(&[(0, 250), (20_000, 250)]), None);
        assert_eq!(kept(&[(0, 1), (20_000, 1)]), None);
        assert_eq!(kept(&[]), None);
    }
}
