//! The map step: the counts of one bag, or of a part of its time, from its index alone; a pure function of the bag and
//! the plan.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use super::counts::{Count, FleetBag};
use super::plan::{CountDetail, PlannedBag};
use crate::bag::{
    self, ChunkCounts, Connection, ConnectionId, Input, OpenOptions, Report, Sink, Want,
};
use crate::base::error::{Error, Result};
use crate::base::name::NodeName;
use crate::base::notice::{Notice, Notices};
use crate::base::time::{Period, Span, Stamp};
use crate::evidence::times::{SeriesId, Stamps};
use crate::pipeline::contents::Contents;

/// The options of counting.
#[derive(Clone, Copy, Debug)]
pub struct Tally {
    /// The length of a window.
    pub period: Period,
    /// The detail in which messages are counted.
    pub detail: CountDetail,
    /// Only messages inside this part of the bag's time; `None` for all of it.
    pub part: Option<Span>,
}

impl Tally {
    /// The options for all of a bag, in windows of this length.
    pub fn of(period: Period) -> Self {
        Self {
            period,
            detail: CountDetail::default(),
            part: None,
        }
    }
}

/// The counts of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct CountedBag {
    /// The counts, sorted by window, topic, type and node.
    pub counts: Vec<Count>,
    /// The bag itself, whether or not it could be read.
    pub bag: FleetBag,
}

/// Counts the messages of a bag. An unreadable or damaged bag is not an error but has a row that states it.
///
/// # Errors
/// If the temporary file of times cannot be used.
pub fn count(planned: &PlannedBag, tally: &Tally) -> Result<CountedBag> {
    Ok(try_count(planned, tally).unwrap_or_else(|error| unreadable(planned, tally, &error)))
}

/// As [`count()`], with an error for a bag that cannot be read.
pub(super) fn try_count(planned: &PlannedBag, tally: &Tally) -> Result<CountedBag> {
    let mut taken = BagTally::new(planned.origin, tally.period);
    let report = read(&planned.input(), planned, tally, &mut taken)?;
    let counts = taken.counts(planned, &report).map_err(spool_error)?;
    let mut bag = row(planned, tally);
    bag.take(&report, &taken);
    Ok(CountedBag { counts, bag })
}

/// The result for a bag that cannot be read for this reason.
pub(super) fn unreadable(planned: &PlannedBag, tally: &Tally, error: &Error) -> CountedBag {
    let bag = FleetBag {
        file_bytes: bag::size_on_disk(&planned.input()),
        error: Some(error.to_string()),
        ..row(planned, tally)
    };
    CountedBag {
        counts: Vec::new(),
        bag,
    }
}

fn spool_error(error: io::Error) -> Error {
    Error::io("read", Path::new("temporary file of times"))(error)
}

fn row(planned: &PlannedBag, tally: &Tally) -> FleetBag {
    FleetBag {
        uri: planned.uri.clone(),
        mission: planned.mission.clone(),
        file_bytes: None,
        format: None,
        tier: None,
        is_complete: false,
        messages: 0,
        content: None,
        span: None,
        period: tally.period,
        origin: planned.origin,
        lost: None,
        error: None,
    }
}

impl FleetBag {
    /// Adds the outcome of reading the bag.
    fn take(&mut self, report: &Report, taken: &BagTally) {
        let lost: Vec<String> = taken
            .notices
            .iter()
            .filter(|n| n.kind.is_loss())
            .map(reported)
            .collect();
        self.file_bytes = Some(report.file_bytes);
        self.format = Some(report.format.clone());
        self.tier = Some(report.tier);
        self.is_complete = report.complete && lost.is_empty();
        self.messages = taken.messages;
        self.content = taken.contents.digest();
        self.span = taken.span;
        self.lost = (!lost.is_empty()).then(|| lost.join("; "));
    }
}

fn reported(notice: Notice) -> String {
    match notice.count {
        1 => notice.text,
        count => format!("{} (×{count})", notice.text),
    }
}

fn read(
    input: &Input,
    planned: &PlannedBag,
    tally: &Tally,
    taken: &mut BagTally,
) -> Result<Report> {
    let chunk_counts = (tally.detail == CountDetail::Chunks).then_some(ChunkCounts {
        origin: planned.origin,
        period: tally.period,
    });
    let options = OpenOptions {
        chunk_counts,
        ..OpenOptions::default()
    };
    bag::open(input, &options)?.read(tally.part, taken)
}

/// The key of a publication: topic, type and publisher.
type SenderKey = (Arc<str>, Arc<str>, Option<Arc<str>>);

/// The messages of one sender.
#[derive(Default)]
struct SentMessages {
    /// The series of messages with known sizes, and of the others.
    series: Vec<SeriesId>,
    /// The number of messages counted without times, by window start.
    chunk_counts: BTreeMap<Stamp, u64>,
}

/// All facts gathered from a bag.
struct BagTally {
    origin: Stamp,
    period: Period,
    senders: BTreeMap<SenderKey, SentMessages>,
    /// The sender and the series of each connection.
    sources: Vec<(SenderKey, [SeriesId; 2])>,
    stamps: Stamps,
    notices: Notices,
    messages: u64,
    contents: Contents,
    span: Option<Span>,
}

impl BagTally {
    fn new(origin: Stamp, period: Period) -> Self {
        Self {
            origin,
            period,
            senders: BTreeMap::new(),
            sources: Vec::new(),
            stamps: Stamps::default(),
            notices: Notices::new(),
            messages: 0,
            contents: Contents::default(),
            span: None,
        }
    }

    /// The counts of all senders, in order.
    fn counts(&mut self, planned: &PlannedBag, report: &Report) -> io::Result<Vec<Count>> {
        self.stamps.finish()?;
        let (mission, bag) = (Arc::from(&*planned.mission), Arc::from(&*planned.uri));
        let format = Arc::from(&*report.format);
        let mut all = Vec::new();
        for (sender, sent) in &self.senders {
            for (start, window) in self.windows(sent)? {
                let (topic, type_name, node) = sender.clone();
                all.push(Count {
                    mission: Arc::clone(&mission),
                    bag: Arc::clone(&bag),
                    format: Arc::clone(&format),
                    period: self.period,
                    win: place(start, self.origin, self.period),
                    start,
                    topic,
                    type_name,
                    node,
                    n: window.n,
                    bytes: window.bytes,
                    first: window.first,
                    last: window.last,
                    max_gap_ns: window.gap,
                });
            }
        }
        all.sort_by(|a, b| {
            let order = (a.win, &a.topic, &a.type_name).cmp(&(b.win, &b.topic, &b.type_name));
            order.then_with(|| a.node.cmp(&b.node))
        });
        Ok(all)
    }

    /// The messages of one sender in each window, by the window's start.
    fn windows(&self, sent: &SentMessages) -> io::Result<BTreeMap<Stamp, InWindow>> {
        let mut all: BTreeMap<Stamp, InWindow> = BTreeMap::new();
        let chunk_counts = ChunkCounts {
            origin: self.origin,
            period: self.period,
        };
        let sized: Vec<bool> = sent
            .series
            .iter()
            .map(|id| self.stamps.sized(*id))
            .collect();
        let mut open: Option<(Stamp, InWindow)> = None;
        self.stamps.merge(&sent.series, |timed| {
            let size = sized[timed.series].then_some(u64::from(timed.size));
            // They are sorted by time. A window start before the range of time saturates, and is less precise.
            let is_open =
                |start: Stamp| start > Stamp::MIN && timed.time.since(start) < self.period.nanos();
            let start = match &open {
                Some((start, _)) if is_open(*start) => *start,
                _ => chunk_counts.window(timed.time),
            };
            match &mut open {
                Some((at, window)) if *at == start => window.take(timed.time, size),
                _ => all.extend(open.replace((start, InWindow::of(timed.time, size)))),
            }
        })?;
        all.extend(open);
        for (start, count) in &sent.chunk_counts {
            let window = all.entry(*start).or_default();
            *window = InWindow {
                n: window.n.saturating_add(*count),
                ..InWindow::default()
            };
        }
        Ok(all)
    }
}

/// The index of the window that begins at `start`.
fn place(start: Stamp, origin: Stamp, period: Period) -> i64 {
    let from_origin = i128::from(start.0) - i128::from(origin.0);
    let place = from_origin.div_euclid(i128::from(period.nanos()));
    i64::try_from(place).unwrap_or(i64::MIN)
}

/// The messages of one sender in one window.
#[derive(Default)]
struct InWindow {
    n: u64,
    bytes: Option<u64>,
    first: Option<Stamp>,
    last: Option<Stamp>,
    gap: Option<i64>,
}

impl InWindow {
    fn of(time: Stamp, size: Option<u64>) -> Self {
        Self {
            n: 1,
            bytes: size,
            first: Some(time),
            last: Some(time),
            gap: None,
        }
    }

    /// Adds the next message.
    fn take(&mut self, time: Stamp, size: Option<u64>) {
        let gap = self.last.map(|last| time.since(last));
        self.n += 1;
        self.bytes = self.bytes.zip(size).map(|(a, b)| a.saturating_add(b));
        self.last = Some(time);
        self.gap = self.gap.max(gap);
    }
}

impl Sink for BagTally {
    fn connection(&mut self, connection: &Connection) -> Want {
        let sender = (
            Arc::from(connection.topic.as_str()),
            Arc::clone(&connection.type_name),
            connection.publisher.as_ref().map(NodeName::shared),
        );
        let series = [self.stamps.series(), self.stamps.series()];
        let sent = self.senders.entry(sender.clone()).or_default();
        sent.series.extend(series);
        self.contents.connection(connection.topic.as_str());
        self.sources.push((sender, series));
        Want::Stamps
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let Some((_, [with_sizes, without])) = self.sources.get(connection.0 as usize) else {
            return;
        };
        let series = if sizes.is_some() {
            *with_sizes
        } else {
            *without
        };
        self.stamps.add(series, stamps, sizes);
        self.messages += stamps.len() as u64;
        self.contents.add(connection, stamps);
        for at in stamps {
            let end = at.plus(1);
            let span = self.span.get_or_insert(Span::new(*at, end));
            span.start = span.start.min(*at);
            span.end = span.end.max(end);
        }
    }

    fn chunk_count(&mut self, connection: ConnectionId, window: Stamp, count: u64) {
        let source = self.sources.get(connection.0 as usize);
        let sent = source.and_then(|(sender, _)| self.senders.get_mut(sender));
        let Some(sent) = sent.filter(|_| count > 0) else {
            return;
        };
        *sent.chunk_counts.entry(window).or_default() += count;
        self.contents.add_many(connection, window, count);
        self.messages += count;
    }

    fn notice(&mut self, notice: Notice) {
        self.notices.add(notice);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_whole_periods_before_and_after_the_origin() {
        let period = Period::from_nanos(10).unwrap();
        let chunk_counts = ChunkCounts {
            origin: Stamp(3),
            period,
        };
        for (at, start, win) in [
            (3, 3, 0),
            (12, 3, 0),
            (13, 13, 1),
            (2, -7, -1),
            (-8, -17, -2),
        ] {
            assert_eq!(chunk_counts.window(Stamp(at)), Stamp(start), "{at}");
            assert_eq!(place(Stamp(start), Stamp(3), period), win, "{at}");
        }
        let far = chunk_counts.window(Stamp::MIN);
        assert!(far <= Stamp(i64::MIN + 10), "{far:?}");
    }
}
