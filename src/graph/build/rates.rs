//! Rates: messages of each topic and of each of its streams per window, their bytes, periods and gaps.

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::sync::Arc;

use super::measures::seconds;
use super::windows::SortedWindows;
use crate::base::error::Result;
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::{Recorded, spool_error};

/// The messages of one topic in one window.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sums {
    pub(crate) window: usize,
    pub(crate) count: u64,
    pub(crate) bytes: Option<u64>,
    pub(crate) median_period_s: Option<f64>,
    pub(crate) max_gap_s: Option<f64>,
    /// The standard deviation of the time between messages; `None` with fewer than three.
    pub(crate) jitter_s: Option<f64>,
    /// The number of messages of each stream of the topic.
    pub(crate) streams: Vec<u64>,
    /// Their bytes, each stream's, if known.
    pub(crate) stream_bytes: Option<Vec<u64>>,
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
            count: sum.count,
        }));
    }
    Ok(all)
}

/// A window that may still receive messages.
#[derive(Default)]
struct OpenWindow {
    window: usize,
    count: u64,
    bytes: u64,
    before: Option<Stamp>,
    longest: Option<i64>,
    gaps: Vec<i64>,
    streams: Vec<u64>,
    stream_bytes: Vec<u64>,
}

/// The most gaps kept per window for their median (8 MB); a window with more has no median.
const MOST_GAPS: usize = 1 << 20;

/// Counts the messages of some streams, which together are one topic: each window with messages, in order.
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
    recorded.messages.merge(&ids, |timed| {
        while open
            .front()
            .is_some_and(|o| windows.end(o.window) <= timed.time)
        {
            all.extend(open.pop_front().and_then(|o| o.close(sized)));
        }
        while windows.start(next).is_some_and(|start| start <= timed.time) {
            if timed.time < windows.end(next) {
                open.push_back(OpenWindow::new(next, streams.len()));
            }
            next += 1;
        }
        for window in &mut open {
            window.take(timed.time, timed.series, timed.size);
        }
    })?;
    all.extend(open.into_iter().filter_map(|o| o.close(sized)));
    Ok(all)
}

impl OpenWindow {
    fn new(window: usize, streams: usize) -> Self {
        Self {
            window,
            streams: vec![0; streams],
            stream_bytes: vec![0; streams],
            ..Self::default()
        }
    }

    fn take(&mut self, time: Stamp, stream: usize, size: u32) {
        self.count += 1;
        self.bytes = self.bytes.saturating_add(u64::from(size));
        self.streams[stream] += 1;
        let own = &mut self.stream_bytes[stream];
        *own = own.saturating_add(u64::from(size));
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
            jitter_s: deviation(&self.gaps).filter(|_| exact),
            median_period_s: median(&mut self.gaps).filter(|_| exact),
            streams: self.streams,
            stream_bytes: sized.then_some(self.stream_bytes),
        })
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
