//! How often: messages of each topic and of each of its streams per window, their bytes, periods and gaps; and how each
//! of its senders sent over the whole mission.

use std::collections::{BTreeMap, VecDeque};
use std::io;

use super::tempo::stretches;
use super::windows::Windows;
use crate::base::time::Stamp;
use crate::evidence::claim::Name;
use crate::evidence::collector::Collected;
use crate::evidence::proof::Reliability;
use crate::graph::lives::Stretch;

/// What one topic did in one window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sums {
    pub(crate) window: usize,
    pub(crate) count: u64,
    pub(crate) bytes: Option<u64>,
    pub(crate) median_period_s: Option<f64>,
    pub(crate) max_gap_s: Option<f64>,
    /// Messages of each stream of the topic.
    pub(crate) streams: Vec<u64>,
}

/// What one topic did in the whole mission.
#[derive(Debug, Default)]
pub(crate) struct Rates {
    /// Windows with messages, in order.
    pub(crate) tallies: Vec<Sums>,
    /// The first and the last message of each stream; `None` if it has none.
    pub(crate) traces: Vec<Option<(Stamp, Stamp)>>,
    /// What each sender sent: those that are known, sorted, after the unknown ones together.
    pub(crate) senders: Vec<Sender>,
    /// The place of each stream's sender among those.
    pub(crate) of: Vec<usize>,
}

/// What one sender sent on one topic, over all its streams: a split recording has one per part.
#[derive(Debug)]
pub(crate) struct Sender {
    /// `None` for all who are not known.
    pub(crate) node: Option<Name>,
    pub(crate) latched: bool,
    pub(crate) stretches: Vec<Stretch>,
}

/// A window that messages still fall into.
struct Open {
    window: usize,
    count: u64,
    bytes: u64,
    before: Option<Stamp>,
    longest: Option<i64>,
    gaps: Vec<i64>,
    streams: Vec<u64>,
}

/// The most gaps kept per window for their median (8 MB); a window with more has no median.
const MOST_GAPS: usize = 1 << 20;

/// Counts the messages of some streams, which together are one topic.
pub(crate) fn rates(
    collected: &mut Collected,
    streams: &[usize],
    windows: &Windows<'_>,
) -> io::Result<Rates> {
    let ids: Vec<_> = streams
        .iter()
        .map(|s| collected.streams[*s].times)
        .collect();
    let sized = ids.iter().all(|id| collected.messages.sized(*id));
    let believed = collected.believed;
    let mut all = Rates {
        tallies: Vec::new(),
        traces: vec![None; streams.len()],
        senders: Vec::new(),
        of: Vec::new(),
    };
    let (of, mut heard) = senders(collected, streams);
    let mut open: VecDeque<Open> = VecDeque::new();
    let mut next = 0;
    collected.messages.merge(&ids, |timed| {
        if believed.is_some_and(|span| !span.contains(timed.time)) {
            return;
        }
        let trace = &mut all.traces[timed.series];
        *trace = Some((trace.map_or(timed.time, |t| t.0), timed.time));
        heard[of[timed.series]].hear(timed.time);
        while open
            .front()
            .is_some_and(|o| windows.end(o.window) <= timed.time)
        {
            all.tallies
                .extend(open.pop_front().and_then(|o| o.close(sized)));
        }
        while windows.start(next).is_some_and(|start| start <= timed.time) {
            if timed.time < windows.end(next) {
                open.push_back(Open::new(next, streams.len()));
            }
            next += 1;
        }
        for window in &mut open {
            window.take(timed.time, timed.series, timed.size);
        }
    })?;
    all.tallies
        .extend(open.into_iter().filter_map(|o| o.close(sized)));
    all.of = of;
    all.senders = heard.into_iter().map(Heard::into_sender).collect();
    Ok(all)
}

/// What is heard of one sender.
struct Heard {
    node: Option<Name>,
    latched: bool,
    times: Vec<Stamp>,
    /// Of so many messages one is kept, unless it comes late.
    every: usize,
    passed: usize,
}

/// The most times kept per sender (32 MB); of more, every second goes.
const MOST_TIMES: usize = 1 << 22;
/// A message after so much silence is kept in any case, and the one before it.
const LATE_NS: i64 = 500_000_000;

impl Heard {
    fn hear(&mut self, time: Stamp) {
        let late = self
            .times
            .last()
            .is_none_or(|last| time.since(*last) > LATE_NS);
        self.passed += 1;
        if !late && self.passed < self.every {
            return;
        }
        self.passed = 0;
        self.times.push(time);
        if self.times.len() > MOST_TIMES {
            self.every *= 2;
            let mut kept = false;
            self.times.retain(|_| {
                kept = !kept;
                kept
            });
        }
    }

    fn into_sender(self) -> Sender {
        let mut stretches = stretches(&self.times);
        for stretch in &mut stretches {
            stretch.count = (stretch.count - 1) * self.every as u64 + 1;
            stretch.period /= i64::try_from(self.every).unwrap_or(i64::MAX);
        }
        Sender {
            node: self.node,
            latched: self.latched,
            stretches,
        }
    }
}

/// The sender of each stream, and what is heard of each sender: nothing yet.
fn senders(collected: &Collected, streams: &[usize]) -> (Vec<usize>, Vec<Heard>) {
    let of = |at: &usize| {
        let stream = &collected.streams[*at];
        stream
            .speaker
            .filter(|_| stream.trust != Reliability::First)
    };
    let mut latched: BTreeMap<Option<Name>, bool> = BTreeMap::new();
    for at in streams {
        *latched.entry(of(at)).or_insert(true) &= collected.streams[*at].latched;
    }
    let place = |at: &usize| latched.range(..of(at)).count();
    let places = streams.iter().map(place).collect();
    let heard = latched.iter().map(|(node, latched)| Heard {
        node: *node,
        latched: *latched,
        times: Vec::new(),
        every: 1,
        passed: 0,
    });
    (places, heard.collect())
}

impl Open {
    fn new(window: usize, streams: usize) -> Self {
        Self {
            window,
            count: 0,
            bytes: 0,
            before: None,
            longest: None,
            gaps: Vec::new(),
            streams: vec![0; streams],
        }
    }

    fn take(&mut self, time: Stamp, stream: usize, size: u32) {
        self.count += 1;
        self.bytes = self.bytes.saturating_add(u64::from(size));
        self.streams[stream] += 1;
        let Some(before) = self.before.replace(time) else {
            return;
        };
        let gap = time.since(before);
        self.longest = self.longest.max(Some(gap));
        if self.gaps.len() <= MOST_GAPS {
            self.gaps.push(gap);
        }
    }

    fn close(mut self, sized: bool) -> Option<Sums> {
        let exact = self.gaps.len() <= MOST_GAPS;
        (self.count > 0).then(|| Sums {
            window: self.window,
            count: self.count,
            bytes: sized.then_some(self.bytes),
            max_gap_s: self.longest.map(|gap| gap as f64 / 1e9),
            median_period_s: median(&mut self.gaps).filter(|_| exact),
            streams: self.streams,
        })
    }
}

/// The middle value in seconds; the mean of both middle ones of an even number.
fn median(gaps: &mut [i64]) -> Option<f64> {
    if gaps.is_empty() {
        return None;
    }
    let (middle, even) = (gaps.len() / 2, gaps.len().is_multiple_of(2));
    let (below, upper, _) = gaps.select_nth_unstable(middle);
    let upper = *upper as f64;
    let lower = match below.iter().max() {
        Some(lower) if even => *lower as f64,
        _ => upper,
    };
    Some(f64::midpoint(lower, upper) / 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_or_the_mean_of_both() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3_000_000_000]), Some(3.0));
        assert_eq!(
            median(&mut [9_000_000_000, 1_000_000_000, 2_000_000_000]),
            Some(2.0)
        );
        assert_eq!(median(&mut [4_000_000_000, 1_000_000_000]), Some(2.5));
    }
}
