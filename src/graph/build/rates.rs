//! Rates: the messages of some streams per window, their bytes, periods and gaps.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::sync::Arc;

use super::measures::seconds;
use super::windows::SortedWindows;

use crate::base::error::Result;
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::{Recorded, spool_error};
use crate::graph::{per_second, rate_between};

/// The messages of one topic, or of one of its publishers, in one window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sums {
    pub(crate) window: usize,
    pub(crate) arrivals: Arrivals,
    pub(crate) bytes: Option<u64>,
    pub(crate) median_period_s: Option<f64>,
    pub(crate) max_gap_s: Option<f64>,
    /// The standard deviation of the time between messages; `None` with fewer than three.
    pub(crate) jitter_s: Option<f64>,
}

/// The times of the messages in one window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Arrivals {
    /// The number of messages, ≥ 1.
    pub(crate) count: u64,
    first: Stamp,
    last: Stamp,
    /// The last message before the window, if the pause after it is an ordinary one.
    before: Option<Stamp>,
    /// The first message after the window, if the pause before it is an ordinary one.
    after: Option<Stamp>,
}

/// The sending begins, or ends, with a pause of more than so many ordinary intervals: a few messages may be lost.
const PAUSE: i64 = 4;

impl Arrivals {
    /// Forgets the neighbours after pauses longer than the window and than [`PAUSE`] intervals. With one message, whose
    /// interval is unknown, the window's length is taken: for a topic at 1 Hz in windows of 1 s.
    fn within(self, window: Span) -> Self {
        let intervals = i64::try_from(self.count - 1).unwrap_or(i64::MAX);
        let usual = self.last.since(self.first).checked_div(intervals);
        let usual = usual.unwrap_or(window.nanos());
        let longest = window.nanos().max(usual.saturating_mul(PAUSE));
        Self {
            before: self.before.filter(|at| self.first.since(*at) <= longest),
            after: self.after.filter(|at| at.since(self.last) <= longest),
            ..self
        }
    }

    /// Whether the sending neither begins nor ends in the window.
    pub(crate) fn fills_window(&self) -> bool {
        self.before.is_some() && self.after.is_some()
    }

    /// Messages per second in the part of the window in which they are sent: if the sending begins or ends in it, the
    /// intervals from the first message or to the last one, by the time they take; a single message has no rate there.
    pub(crate) fn hz(&self, window: Span) -> Option<f64> {
        let part = |intervals: u64, from: Stamp, to: Stamp| {
            let is_rhythm = self.count > 1;
            rate_between(intervals, Span::new(from, to), window.nanos()).filter(|_| is_rhythm)
        };
        match (self.before, self.after) {
            (Some(_), Some(_)) => per_second(self.count, window),
            (Some(before), None) => part(self.count, before, self.last),
            (None, Some(after)) => part(self.count, self.first, after),
            (None, None) => part(self.count - 1, self.first, self.last),
        }
    }
}

/// The number of messages of a topic in a window.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TopicCount {
    /// The topic's name.
    pub topic: Arc<str>,
    /// The index of the window.
    pub window: usize,
    /// The number of messages, ≥ 1.
    pub count: u64,
}

/// Counts the messages of every topic in every window, before any conclusions. Windows are as for [`super::graphs`].
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn counts(recorded: &Recorded, windows: &[Span]) -> Result<Vec<TopicCount>> {
    let mut streams: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (at, stream) in recorded.streams.iter().enumerate() {
        let topic = stream.connection.topic.as_str();
        streams.entry(topic).or_default().push(at);
    }
    let mut all = Vec::new();
    for (topic, streams) in streams {
        let topic: Arc<str> = topic.into();
        let sums = rates(recorded, &streams, &SortedWindows(windows)).map_err(spool_error)?;
        all.extend(sums.into_iter().map(|sum| TopicCount {
            topic: Arc::clone(&topic),
            window: sum.window,
            count: sum.arrivals.count,
        }));
    }
    Ok(all)
}

/// A window that may still receive messages.
struct OpenWindow {
    window: usize,
    span: Span,
    arrivals: Arrivals,
    bytes: u64,
    longest: Option<i64>,
    gaps: Vec<i64>,
}

/// The most gaps kept per window for their median (8 MB); a window with more has no median.
const MOST_GAPS: usize = 1 << 20;

/// Counts the messages of some streams, those of a topic or of one of its publishers: each window with messages, in order.
pub(crate) fn rates(
    recorded: &Recorded,
    streams: &[usize],
    windows: &SortedWindows<'_>,
) -> io::Result<Vec<Sums>> {
    let ids: Vec<_> = streams.iter().map(|s| recorded.streams[*s].times).collect();
    let sized = ids.iter().all(|id| recorded.messages.sized(*id));
    let mut all = Vec::new();
    let mut open: VecDeque<OpenWindow> = VecDeque::new();
    let mut next = 0;
    let mut before = None;
    recorded.messages.merge(&ids, |timed| {
        let time = timed.time;
        let ended = open.partition_point(|o| o.span.end <= time);
        all.extend(open.drain(..ended).map(|o| o.close(sized, Some(time))));
        while windows.start(next).is_some_and(|start| start <= time) {
            if time < windows.end(next) {
                open.push_back(OpenWindow::new(next, windows.0[next], time, before));
            }
            next += 1;
        }
        for window in &mut open {
            window.take(time, timed.size);
        }
        before = Some(time);
    })?;
    all.extend(open.into_iter().map(|o| o.close(sized, None)));
    Ok(all)
}

impl OpenWindow {
    /// A window with a first message at `time`, which is not taken yet, and one `before` the window.
    fn new(window: usize, span: Span, time: Stamp, before: Option<Stamp>) -> Self {
        Self {
            window,
            span,
            arrivals: Arrivals {
                count: 0,
                first: time,
                last: time,
                before,
                after: None,
            },
            bytes: 0,
            longest: None,
            gaps: Vec::new(),
        }
    }

    fn take(&mut self, time: Stamp, size: u32) {
        self.arrivals.count += 1;
        self.bytes = self.bytes.saturating_add(u64::from(size));
        let before = std::mem::replace(&mut self.arrivals.last, time);
        if self.arrivals.count == 1 {
            return;
        }
        let gap = time.since(before);
        self.longest = self.longest.max(Some(gap));
        if self.gaps.len() <= MOST_GAPS {
            self.gaps.push(gap);
        }
    }

    fn close(mut self, sized: bool, after: Option<Stamp>) -> Sums {
        let exact = self.gaps.len() <= MOST_GAPS;
        let arrivals = Arrivals {
            after,
            ..self.arrivals
        };
        Sums {
            window: self.window,
            arrivals: arrivals.within(self.span),
            bytes: sized.then_some(self.bytes),
            max_gap_s: self.longest.map(|gap| gap as f64 / 1e9),
            jitter_s: deviation(&self.gaps).filter(|_| exact),
            median_period_s: median(&mut self.gaps).filter(|_| exact),
        }
    }
}

/// The standard deviation in seconds of at least two gaps.
fn deviation(gaps: &[i64]) -> Option<f64> {
    let many = gaps.len() as f64;
    let mean = gaps.iter().map(|gap| *gap as f64).sum::<f64>() / many;
    let square = |gap: &i64| (*gap as f64 - mean) * (*gap as f64 - mean);
    let squares: f64 = gaps.iter().map(square).sum();
    (gaps.len() > 1).then(|| seconds(libm::sqrt(squares / many)))
}

/// The median in seconds; the mean of the two middle values of an even number.
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

    /// The rate in windows of 10 s of messages at these milliseconds, if any.
    fn hz(times: &[i64]) -> Vec<Option<f64>> {
        let at = |ms: i64| Stamp(ms * 1_000_000);
        let window = |k: i64| Span::new(at(k * 10_000), at(k * 10_000 + 10_000));
        let rate = |k: i64| {
            let span = window(k);
            let own: Vec<Stamp> = times.iter().map(|ms| at(*ms)).collect();
            let from = own.partition_point(|time| *time < span.start);
            let to = own.partition_point(|time| *time < span.end);
            let arrivals = Arrivals {
                count: (to - from) as u64,
                first: *own[from..to].first()?,
                last: *own[from..to].last()?,
                before: from.checked_sub(1).map(|before| own[before]),
                after: own.get(to).copied(),
            };
            arrivals.within(span).hz(span)
        };
        (0..4).map(rate).collect()
    }

    #[test]
    fn a_window_in_which_a_topic_begins_or_ends_has_its_full_rate() {
        let ten = |from: i64, to: i64| (from..to).map(|k| k * 100).collect::<Vec<_>>();
        assert_eq!(hz(&ten(0, 400)), [Some(10.0); 4]);
        assert_eq!(
            hz(&ten(50, 270)),
            [Some(10.0), Some(10.0), Some(10.0), None]
        );
        assert_eq!(hz(&ten(150, 170)), [None, Some(10.0), None, None]);
        // A pause within a window, or one as short as it, is part of the sending.
        let twice = [ten(0, 30), ten(70, 300)].concat();
        assert_eq!(hz(&twice)[..2], [Some(6.0), Some(10.0)]);
    }

    #[test]
    fn few_messages_have_a_rate_only_within_a_rhythm() {
        // Every 8 s: one or two in each window.
        assert_eq!(
            hz(&[1_000, 9_000, 17_000, 25_000, 33_000, 41_000])[1..],
            [Some(0.1); 3]
        );
        assert_eq!(hz(&[5_000])[0], None);
        // A burst has none.
        assert_eq!(hz(&[5_000, 5_001, 5_003])[0], None);
        assert_eq!(hz(&[5_000, 6_000])[0], Some(1.0));
    }

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
