//! Counts the messages of a recording per publisher, topic and window, by its index alone.

use std::sync::Arc;

use crate::bag::{self, Input, OpenOptions, Want};
use crate::base::error::Result;
use crate::base::ids::grouped;
use crate::base::name::role;
use crate::base::notice::Notices;
use crate::base::table::{Batch, ColumnKind, ColumnOf, TableCell, columns};
use crate::base::time::{Period, Stamp};
use crate::graph::window::Align;
use crate::pipeline::Unwatched;
use crate::pipeline::inputs::each_once;
use crate::pipeline::times::{MessageTimes, Sender};
use crate::view::NameFilter;

/// The windows in which messages are counted.
#[derive(Clone, Copy, Debug)]
pub struct Counting {
    /// The length of a window.
    pub period: Period,
    /// The alignment of windows: whole periods of UTC, or from the first message of each recording.
    pub align: Align,
}

impl Default for Counting {
    /// Windows of ten seconds by the clock, comparable between recordings.
    fn default() -> Self {
        Self {
            period: TEN_SECONDS,
            align: Align::Clock,
        }
    }
}

const TEN_SECONDS: Period = match Period::from_nanos(10_000_000_000) {
    Some(period) => period,
    None => unreachable!(),
};

/// The counts of a recording.
#[derive(Clone, Debug)]
pub struct Counted {
    /// A row per publisher, topic and window with messages.
    pub rows: Batch,
    /// The number of messages counted.
    pub messages: u64,
    /// The notices for the user, such as those about losses.
    pub notices: Notices,
}

/// Counts the messages of a recording, which may have several parts; its name in the rows is `name`.
///
/// # Errors
/// If it cannot be read, or if the temporary file of times cannot be used.
pub fn count(name: &str, inputs: &[Input], counting: &Counting) -> Result<Counted> {
    let (inputs, twice) = each_once(inputs)?;
    let every = NameFilter::default();
    let mut times = MessageTimes::new(&every, Want::Stamps);
    times.notices.extend(twice);
    let mut format = String::new();
    for input in inputs {
        let mut reader = bag::open(&input, &OpenOptions::default())?;
        format = times.read(&mut *reader, None, &mut Unwatched)?.format;
    }
    let aside = times.finish()?;
    times.notices.extend(aside);
    let (first, _, messages) = times.stamps.extent().unwrap_or_default();
    let windows = Windows {
        origin: match counting.align {
            Align::Clock => Stamp(0),
            Align::Bag => first,
        },
        period: counting.period,
    };
    let mut counts = counts(&times, windows)?;
    counts.sort_by(|a, b| (a.window, &a.sender).cmp(&(b.window, &b.sender)));
    let table = CountTable {
        bag: name.to_owned(),
        format,
        windows,
    };
    Ok(Counted {
        rows: Batch::filled(COLUMNS, &table, &counts),
        messages,
        notices: times.notices,
    })
}

/// Windows of equal length, one of which begins at `origin`.
#[derive(Clone, Copy)]
struct Windows {
    origin: Stamp,
    period: Period,
}

impl Windows {
    /// The index of the window that contains `at`; window 0 begins at the origin.
    fn index(self, at: Stamp) -> i64 {
        let from_origin = i128::from(at.0) - i128::from(self.origin.0);
        saturated(from_origin.div_euclid(i128::from(self.period.nanos())))
    }

    /// The start of a window; the end of the one before.
    fn start(self, index: i64) -> Stamp {
        let from_origin = i128::from(index) * i128::from(self.period.nanos());
        Stamp(saturated(from_origin + i128::from(self.origin.0)))
    }
}

/// The nearest number of 64 bits.
fn saturated(number: i128) -> i64 {
    let limit = if number < 0 { i64::MIN } else { i64::MAX };
    i64::try_from(number).unwrap_or(limit)
}

/// The messages of one sender in one window.
struct Count {
    sender: Arc<Sender>,
    window: i64,
    n: u64,
    /// The size of their payloads, if the index contains it.
    bytes: Option<u64>,
    first: Stamp,
    last: Stamp,
    max_gap_ns: Option<i64>,
}

impl Count {
    fn add(&mut self, at: Stamp, size: Option<u64>) {
        self.n += 1;
        self.bytes = self.bytes.zip(size).map(|(a, b)| a.saturating_add(b));
        self.max_gap_ns = self.max_gap_ns.max(Some(at.since(self.last)));
        self.last = at;
    }
}

/// What is the same in all rows of a table.
struct CountTable {
    bag: String,
    format: String,
    windows: Windows,
}

const COLUMNS: &[ColumnOf<CountTable, Count>] = columns! {
    "bag" Text |table, _| TableCell::text(&*table.bag);
    "format" Text |table, _| TableCell::text(&*table.format);
    "period_ns" I64 |table, _| TableCell::Int(table.windows.period.nanos());
    "win" I64 |_, count| TableCell::Int(count.window);
    "start_ns" I64 |table, count| TableCell::Int(table.windows.start(count.window).0);
    "end_ns" I64 |table, count| TableCell::Int(table.windows.start(count.window.saturating_add(1)).0);
    "topic" Text |_, count| TableCell::text(count.sender.topic.as_str());
    "type" Text |_, count| TableCell::text(&*count.sender.type_name);
    "node" Text |_, count| TableCell::known(count.sender.node.as_deref(), TableCell::text);
    "node_role" Text |_, count| TableCell::known(count.sender.node.as_deref().map(role), TableCell::text);
    "n" I64 |_, count| TableCell::count(count.n);
    "bytes" I64 |_, count| TableCell::known(count.bytes, TableCell::count);
    "first_ns" I64 |_, count| TableCell::Int(count.first.0);
    "last_ns" I64 |_, count| TableCell::Int(count.last.0);
    "max_gap_ns" I64 |_, count| TableCell::known(count.max_gap_ns, TableCell::Int);
};

/// The counts of all senders.
fn counts(times: &MessageTimes<'_>, windows: Windows) -> Result<Vec<Count>> {
    let senders = grouped(times.senders.iter().zip(times.series.iter().copied()));
    let mut all: Vec<Count> = Vec::new();
    for (sender, series) in senders {
        let sender = Arc::new(sender.clone());
        let mut end = None;
        times.merge(&series, |timed| {
            let is_sized = times.stamps.sized(series[timed.series]);
            let size = is_sized.then_some(u64::from(timed.size));
            // Messages are sorted by time, so most are in the window of the one before.
            let is_same = end.is_some_and(|end| timed.time < end);
            if let Some(count) = all.last_mut().filter(|_| is_same) {
                count.add(timed.time, size);
                return;
            }
            let window = windows.index(timed.time);
            end = Some(windows.start(window.saturating_add(1)));
            all.push(Count {
                sender: Arc::clone(&sender),
                window,
                n: 1,
                bytes: size,
                first: timed.time,
                last: timed.time,
                max_gap_ns: None,
            });
        })?;
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_whole_periods_before_and_after_the_origin() {
        let period = Period::from_nanos(10).unwrap();
        let windows = Windows {
            origin: Stamp(3),
            period,
        };
        for (at, start, index) in [
            (3, 3, 0),
            (12, 3, 0),
            (13, 13, 1),
            (2, -7, -1),
            (-8, -17, -2),
        ] {
            assert_eq!(windows.index(Stamp(at)), index, "{at}");
            assert_eq!(windows.start(index), Stamp(start), "{at}");
        }
        assert_eq!(windows.start(windows.index(Stamp::MIN)), Stamp::MIN);
        assert_eq!(windows.start(windows.index(Stamp::MAX) + 1), Stamp::MAX);
    }
}
