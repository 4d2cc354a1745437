//! The rates of topics, window by window, and their silences.

use super::Facts;
use crate::base::cast;
use crate::base::rhythm::{CLOSING_NS, DISCOVERY_NS};
use crate::base::time::{Span, Stamp};
use crate::graph::{Element, Row, TopicId};
use crate::mission::Window;

/// The rate of a topic in a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rate {
    /// The window's index.
    pub(crate) window: usize,
    /// The part of it that counts.
    pub(crate) span: Span,
    pub(crate) count: u64,
    /// The median time between its messages in seconds.
    pub(crate) median_s: Option<f64>,
}

impl Rate {
    fn seconds(&self) -> f64 {
        self.span.nanos().max(1) as f64 / 1e9
    }

    /// Messages per second.
    pub(crate) fn hz(&self) -> f64 {
        self.count as f64 / self.seconds()
    }

    /// Messages per second with one more message, which may have just missed this window.
    pub(crate) fn at_most(&self) -> f64 {
        (self.count + 1) as f64 / self.seconds()
    }

    /// Messages per second with one message less.
    pub(crate) fn at_least(&self) -> f64 {
        self.count.saturating_sub(1) as f64 / self.seconds()
    }

    /// Whether messages are evenly spaced, judged by the median interval in each of these windows.
    pub(crate) fn are_even(rates: &[Self]) -> bool {
        let share = |rate: &Self| Some(rate.median_s? * rate.hz());
        let mut shares = rates.iter().filter_map(share).peekable();
        shares.peek().is_some() && shares.all(|share| (0.8..=1.25).contains(&share))
    }
}

impl<'a> Facts<'a> {
    /// The first and the last message of a topic, the latter 1 ns before the end; `None` if it has none.
    pub(crate) fn received(&self, topic: TopicId) -> Option<Span> {
        let of = self.mission.sending.of_topic(topic).iter();
        let stretches = of.flat_map(|sender| &sender.stretches);
        let first = stretches.clone().map(|s| s.first).min()?;
        let last = stretches.map(|s| s.last).max()?;
        Some(Span::new(first, last.plus(1)))
    }

    /// The windows that contain a topic, each with its row of the graph.
    pub(crate) fn rows(&self, topic: TopicId) -> impl Iterator<Item = (&'a Window, Row)> + use<'a> {
        let windows = &self.mission.windows;
        let rows = self.mission.graphs.rows(Element::Topic(topic));
        rows.filter_map(|(at, row)| Some((windows.get(at)?, row)))
    }

    /// The number of messages of a topic in each window.
    pub(crate) fn counts(&self, topic: TopicId) -> Vec<u64> {
        let mut all = vec![0; self.mission.windows.len()];
        for (at, row) in self.mission.graphs.rows(Element::Topic(topic)) {
            if let Some(own) = all.get_mut(at) {
                *own = count(&row);
            }
        }
        all
    }

    /// The rates by which a topic is checked: of every window, and of the last if it is longer than half of one or has
    /// enough expected messages of one sender, from its first message to the mission's end, or to its last if it `may_end`.
    pub(crate) fn rates(&self, topic: TopicId, may_end: bool, during: Span) -> Vec<Rate> {
        let Some(received) = self.received(topic) else {
            return Vec::new();
        };
        let mut rows = self.rows(topic).peekable();
        // Several senders end one after the other when the robot shuts down.
        let ends_in_turn = self.mission.sending.of_topic(topic).len() > 1;
        let (mut all, mut first) = (Vec::new(), None);
        for window in &self.mission.windows {
            let row = rows.next_if(|(own, _)| own.index == window.index);
            let inside = during.start <= window.span.start && window.span.end <= during.end;
            // A window cut by the mission's end has a rate if it is long enough, or the topic was even until then.
            let is_short = window.span.nanos() < self.mission.period.nanos() / 2;
            let is_cut = window.partial && is_short;
            if is_cut && (ends_in_turn || !is_enough(&all, window.span)) || !inside {
                continue;
            }
            let rate = |span| Rate {
                window: window.index,
                span,
                count: row.as_ref().map_or(0, |(_, row)| count(row)),
                median_s: row.as_ref().and_then(|(_, row)| row.median.value()),
            };
            if let Some(span) = self.counted(window.span, received, may_end) {
                all.push(rate(span));
            } else if first.is_none() && received.end >= window.span.end {
                first = begun(window.span, received.start).map(rate);
            }
        }
        // A topic that exists for little more than a window rarely fills one, so a part is used.
        if all.is_empty() {
            first.into_iter().collect()
        } else {
            all
        }
    }

    /// The rate of a topic from its first to its last message, as one that covers all of it; `None` with fewer than
    /// two.
    pub(crate) fn mean(&self, topic: TopicId) -> Option<Rate> {
        let received = self.received(topic)?;
        let count = self.messages(topic).checked_sub(1)?;
        (count > 0).then_some(Rate {
            window: 0,
            span: received,
            count,
            median_s: None,
        })
    }

    /// The part of a window in which a topic with messages in `received` counts; `None` if it is too short.
    fn counted(&self, window: Span, received: Span, may_end: bool) -> Option<Span> {
        let whole = self.mission.span;
        let mut span = window;
        if received.start > span.start {
            // A topic that exists when the recorder starts is received a moment later; others have a partial window.
            let found =
                span.start == whole.start && received.start.since(whole.start) <= DISCOVERY_NS;
            span.start = found.then_some(received.start)?;
        }
        if received.end < span.end {
            let is_over = whole.end.since(received.end) <= CLOSING_NS;
            match (is_over, may_end) {
                (true, _) => span.end = received.end,
                (false, true) => return None,
                (false, false) => {}
            }
        }
        (span.nanos() >= window.nanos() / 2).then_some(span)
    }

    /// The longest silences of a topic inside `during`: those of the whole mission, to the nanosecond if message times
    /// are known; the longest of each window; and, unless it `may_end`, from its last message to the mission's end.
    pub(crate) fn silences(
        &self,
        topic: TopicId,
        may_end: bool,
        during: Span,
    ) -> Vec<TopicSilence> {
        let mut all = Vec::new();
        for (window, row) in self.rows(topic) {
            let inside = during.start <= window.span.start && window.span.end <= during.end;
            if let (true, Some(gap)) = (inside, row.gap.value()) {
                all.push(TopicSilence {
                    span: window.span,
                    nanos: nanos(gap),
                });
            }
        }
        all.extend(self.pauses(topic).filter_map(|gap| clipped(gap, during)));
        let whole = self.mission.span;
        if let (Some(received), false) = (self.received(topic), may_end) {
            let span = Span::new(received.end.plus(-1), whole.end);
            // An end at the robot's shutdown is not a silence.
            if span.nanos() > CLOSING_NS {
                all.extend(clipped(span, during));
            }
        }
        all
    }

    /// The longest silence of a topic between its first and its last message, in nanoseconds; at least a window's length
    /// if single messages are unknown.
    pub(crate) fn longest_silence(&self, topic: TopicId) -> i64 {
        let silences = self.silences(topic, true, self.mission.span);
        let longest = silences.iter().map(|s| s.nanos).max().unwrap_or(0);
        if self.mission.sending.pauses.is_empty() {
            longest.max(self.mission.period.nanos())
        } else {
            longest
        }
    }

    /// The longest times between two messages, if single messages are known.
    fn pauses(&self, topic: TopicId) -> impl Iterator<Item = Span> + use<'a> {
        let pauses = self.mission.sending.pauses.get(topic);
        pauses.into_iter().flatten().copied()
    }
}

/// The fewest expected messages of an even topic by which a window cut by the mission's end is checked: one more or
/// less is a twentieth.
const ENOUGH: f64 = 20.0;

/// Whether a topic with these rates before was even, and enough of its messages are expected in this time.
fn is_enough(before: &[Rate], span: Span) -> bool {
    let expected = |last: &Rate| last.hz() * span.nanos() as f64 / 1e9;
    before.last().is_some_and(|last| expected(last) >= ENOUGH) && Rate::are_even(before)
}

/// The part of a window from a topic's first message on; `None` if that is less than half of it.
fn begun(window: Span, first: Stamp) -> Option<Span> {
    let span = Span::new(first.max(window.start), window.end);
    (span.nanos() >= window.nanos() / 2).then_some(span)
}

/// A time without messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TopicSilence {
    /// The time of the silence, or the window that it is in.
    pub(crate) span: Span,
    /// Its length in nanoseconds.
    pub(crate) nanos: i64,
}

/// The part of a silence within a time range.
fn clipped(gap: Span, during: Span) -> Option<TopicSilence> {
    let span = Span::new(gap.start.max(during.start), gap.end.min(during.end));
    let nanos = span.end.since(span.start);
    (nanos > 0).then_some(TopicSilence { span, nanos })
}

fn count(row: &Row) -> u64 {
    row.count.unwrap_or(0)
}

/// Seconds in nanoseconds, saturating.
fn nanos(seconds: f64) -> i64 {
    cast::to_i64(libm::round(seconds * 1e9))
}
