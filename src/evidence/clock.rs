//! Credible times: a few messages far from all others were recorded with a clock that was not set.

use std::collections::BTreeMap;

use crate::base::budget;
use crate::base::time::{Span, Stamp};

pub(crate) const DAY: i64 = 86_400_000_000_000;
/// The distance in days beyond which times count as far from all others.
pub(crate) const FAR_DAYS: i64 = 365;
/// The most far messages that are set aside, as one in so many messages.
const RARE: u64 = 10;
/// The days after 1970, ten years, that count as an unset clock: without a battery it begins there, and no robot
/// recorded then.
const UNSET_DAYS: i64 = 3652;

/// Days without a gap of more than [`FAR_DAYS`] between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct DayCluster {
    first: i64,
    last: i64,
    messages: u64,
}

/// The assessment of the times of a mission.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Belief {
    /// The credible times, if some messages are far from the bulk; `None` if all are credible.
    pub(crate) span: Option<Span>,
    /// A sentence about clock jumps, if too many messages to be an accident are far apart and stay on one
    /// axis.
    pub(crate) jump: Option<String>,
}

/// Assesses the times of a mission by the number of messages of each day.
pub(crate) fn believed(days: &BTreeMap<i64, u64>) -> Belief {
    let clusters = clusters(days);
    let Some(bulk) = clusters.iter().max_by_key(|c| c.messages) else {
        return Belief::default();
    };
    let outliers: u64 = days.values().sum::<u64>() - bulk.messages;
    let is_rare = outliers <= (days.values().sum::<u64>() / RARE).max(1);
    let others = || clusters.iter().filter(|c| *c != bulk);
    let is_unset = bulk.first > UNSET_DAYS && others().all(|c| (0..=UNSET_DAYS).contains(&c.last));
    let whole = clusters.last().map_or(0, |c| c.last) - clusters.first().map_or(0, |c| c.first);
    let is_too_long = whole >= budget::SPAN_DAYS;
    if outliers < bulk.messages && (is_rare || is_unset) || is_too_long {
        let last = bulk.last.min(bulk.first + budget::SPAN_DAYS - 1);
        let span = Span::new(
            Stamp(bulk.first.saturating_mul(DAY)),
            Stamp((last + 1).saturating_mul(DAY)),
        );
        return Belief {
            span: (outliers > 0 || is_too_long).then_some(span),
            jump: None,
        };
    }
    Belief {
        span: None,
        jump: (clusters.len() > 1).then(|| stated(&clusters)),
    }
}

fn clusters(days: &BTreeMap<i64, u64>) -> Vec<DayCluster> {
    let mut clusters: Vec<DayCluster> = Vec::new();
    for (day, count) in days {
        match clusters.last_mut() {
            Some(before) if day - before.last <= FAR_DAYS => {
                before.last = *day;
                before.messages += count;
            }
            _ => clusters.push(DayCluster {
                first: *day,
                last: *day,
                messages: *count,
            }),
        }
    }
    clusters
}

/// The number of clusters that are listed.
const NAMED: usize = 3;

fn stated(clusters: &[DayCluster]) -> String {
    let one = |c: &DayCluster| {
        let date = Stamp(c.first.saturating_mul(DAY)).to_string();
        let date = date.split('T').next().unwrap_or_default();
        format!("{} messages from {date}", c.messages)
    };
    let mut parts: Vec<String> = clusters.iter().take(NAMED).map(one).collect();
    if clusters.len() > NAMED {
        parts.push(format!("{} more such jumps", clusters.len() - NAMED));
    }
    format!(
        "the recorder's clock jumps by more than a year: {}; select a part with `--start` and `--end`",
        parts.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(days: &[(i64, u64)]) -> Option<(i64, i64)> {
        let span = believed(&days.iter().copied().collect()).span?;
        Some((span.start.0 / DAY, span.end.0 / DAY))
    }

    #[test]
    fn a_few_messages_far_from_the_bulk_are_set_aside() {
        assert_eq!(kept(&[(0, 3), (20_000, 500)]), Some((20_000, 20_001)));
        assert_eq!(kept(&[(0, 1), (20_000, 2)]), Some((20_000, 20_001)));
        assert_eq!(kept(&[(0, 500), (20_000, 3)]), Some((0, 1)));
    }

    #[test]
    fn a_bag_in_one_or_two_parts_is_kept_completely() {
        assert_eq!(kept(&[(0, 500)]), None);
        assert_eq!(kept(&[(20_000, 2), (20_006, 3)]), None);
        assert_eq!(kept(&[(0, 250), (20_000, 250)]), None);
        assert_eq!(kept(&[(0, 1), (20_000, 1)]), None);
        assert_eq!(kept(&[]), None);
    }

    #[test]
    fn messages_before_the_clock_was_set_are_set_aside() {
        assert_eq!(kept(&[(0, 249), (20_000, 250)]), Some((20_000, 20_001)));
        assert_eq!(kept(&[(10_957, 249), (20_000, 250)]), None);
        assert_eq!(kept(&[(0, 250), (20_000, 249)]), None);
    }

    #[test]
    fn missions_are_limited_to_a_hundred_years() {
        assert_eq!(kept(&[(0, 2), (100_000, 2)]), Some((100_000, 100_001)));
        assert_eq!(kept(&[(0, 3), (100_000, 2)]), Some((0, 1)));
        let yearly: Vec<_> = (0..200).map(|year| (year * 365, 1)).collect();
        assert_eq!(kept(&yearly), Some((0, budget::SPAN_DAYS)));
    }

    #[test]
    fn a_plausible_clock_jump_is_reported() {
        let days = [(10_957, 249), (20_000, 250)].into_iter().collect();
        let stated = believed(&days).jump.unwrap();
        assert!(
            stated.contains("249 messages from 2000-01-01, 250 messages from 2024-10-04"),
            "{stated}"
        );
        let one = [(20_000, 249), (20_001, 250)].into_iter().collect();
        assert_eq!(believed(&one).jump, None);
    }
}
