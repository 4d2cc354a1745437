//! Differences between the clocks of several recorders, by the messages that two of them recorded.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use crate::base::time::Stamp;
use crate::evidence::inference::Stream;
use crate::evidence::observation::Observations;

/// The fewest common messages that are significant.
const FEWEST: usize = 10;
/// The fewest topics that must agree: a node may send the same sequence again.
const TOPICS: usize = 2;
/// The share, in per cent, of the messages in common that must agree about the offset.
const SHARE: usize = 80;
/// The largest difference between the offsets of two messages, in nanoseconds: they take different paths to
/// the recorders.
const NEAR_NS: i64 = 50_000_000;

/// The offset of a recorder's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ClockOffset {
    /// The index of the bag among the inputs, and that of the one that it is compared with.
    pub(crate) bag: usize,
    pub(crate) other: usize,
    /// The time by which its clock is ahead, in nanoseconds.
    pub(crate) ahead: i64,
    /// The number of messages that show it.
    pub(crate) messages: usize,
}

/// The times of contents that occur once on a topic of a bag; `None` for those that occur more often.
type Contents<'a> = BTreeMap<(&'a str, u32), Option<Stamp>>;

/// The bags whose clocks differ from that of an earlier one.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn offsets(streams: &[Stream], facts: &Observations) -> io::Result<Vec<ClockOffset>> {
    let last = streams.iter().map(|stream| stream.bag).max();
    let mut bags: Vec<Contents<'_>> = vec![Contents::new(); last.map_or(0, |last| last + 1)];
    if bags.len() < 2 {
        return Ok(Vec::new());
    }
    for (at, series) in &facts.payloads {
        let stream = &streams[*at];
        if stream.latched {
            continue;
        }
        let contents = &mut bags[stream.bag];
        facts.times.merge(&[*series], |timed| {
            let key = (stream.connection.topic.as_str(), timed.size);
            let time = contents.entry(key).or_insert(Some(timed.time));
            *time = time.filter(|time| *time == timed.time);
        })?;
    }
    let filled = (0..bags.len()).filter(|bag| !bags[*bag].is_empty());
    let filled: Vec<usize> = filled.collect();
    let mut found = Vec::new();
    for (at, bag) in filled.iter().copied().enumerate() {
        let mut before = filled[..at].iter().copied();
        let apart = before.find_map(|other| Some((other, apart(&bags[other], &bags[bag])?)));
        if let Some((other, (ahead, messages))) = apart
            && ahead.abs() > NEAR_NS
        {
            found.push(ClockOffset {
                bag,
                other,
                ahead,
                messages,
            });
        }
    }
    Ok(found)
}

/// The delay of the common messages in the second recording, and their number; `None` without agreement.
fn apart(one: &Contents<'_>, other: &Contents<'_>) -> Option<(i64, usize)> {
    let both = other.iter().filter_map(|(key, time)| {
        let before = one.get(key)?.as_ref()?;
        Some((time.as_ref()?.since(*before), key.0))
    });
    let mut lags: Vec<(i64, &str)> = both.collect();
    lags.sort_unstable();
    let median = lags.get(lags.len() / 2)?.0;
    let near = lags.iter().filter(|lag| (lag.0 - median).abs() <= NEAR_NS);
    let agreeing = near.clone().count();
    let topics: BTreeSet<&str> = near.map(|lag| lag.1).collect();
    let is_clear = agreeing >= FEWEST && agreeing * 100 >= lags.len() * SHARE;
    (is_clear && topics.len() >= TOPICS).then_some((median, agreeing))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contents(times: &[i64]) -> Contents<'static> {
        let keys = (0..).map(|hash| (["/tf", "/odom"][hash as usize % 2], hash));
        keys.zip(times.iter().map(|t| Some(Stamp(t * 1_000_000))))
            .collect()
    }

    #[test]
    fn an_offset_needs_messages_that_agree() {
        let one: Vec<i64> = (0..20).map(|n| n * 100).collect();
        let later: Vec<i64> = one.iter().map(|t| t + 350 + t % 7).collect();
        let (ahead, messages) = apart(&contents(&one), &contents(&later)).unwrap();
        assert_eq!((ahead / 10_000_000, messages), (35, 20));
        let wild: Vec<i64> = one.iter().map(|t| t * 2).collect();
        assert_eq!(apart(&contents(&one), &contents(&wild)), None);
        assert_eq!(apart(&contents(&one[..5]), &contents(&later)), None);
        let only = |mut all: Contents<'static>| {
            all.retain(|key, _| key.0 == "/tf");
            all
        };
        assert_eq!(apart(&only(contents(&one)), &only(contents(&later))), None);
    }
}
