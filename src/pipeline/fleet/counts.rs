//! The rows of the two tables of a fleet, and how the counts of parts become those of a whole.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::bag::Tier;
use crate::base::table::{Batch, ColumnKind, TableCell};
use crate::base::time::{Period, Span, Stamp};

/// The version of both tables' columns: a change of what one means counts it up.
pub const SCHEMA_VERSION: i64 = 1;

/// What one publisher sent on one topic in one window: a row of the table `counts`. Windows without messages have none.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Count {
    /// The mission that the bag belongs to.
    pub mission: Arc<str>,
    /// The bag, as its path or URL was given.
    pub bag: Arc<str>,
    /// The format's word: `rosbag1`, `mcap`, `sqlite3`.
    pub format: Arc<str>,
    /// The length of a window.
    pub period: Period,
    /// The window's place from the plan's origin: periods since 1970 with windows by the clock.
    pub win: i64,
    /// When the window begins; it ends a period later.
    pub start: Stamp,
    /// The topic as recorded.
    pub topic: Arc<str>,
    /// Its type as recorded; empty if the bag does not say.
    pub type_name: Arc<str>,
    /// The node that published, if the bag knows it.
    pub node: Option<Arc<str>>,
    /// Messages, 1...
    pub n: u64,
    /// Their payloads' bytes, if the index tells them.
    pub bytes: Option<u64>,
    /// The first message's time; unknown where a chunk was counted as a whole.
    pub first: Option<Stamp>,
    /// The last message's time; known as `first` is.
    pub last: Option<Stamp>,
    /// The longest time between two of them, in nanoseconds; unknown of one message, and as `first` is.
    pub max_gap_ns: Option<i64>,
}

/// What says which counts are of the same messages, apart from the mission and the format, which follow from the bag.
/// The order of a table's rows.
type CountKey = (
    Arc<str>,
    Arc<str>,
    i64,
    Arc<str>,
    Arc<str>,
    Option<Arc<str>>,
);

impl Count {
    fn key(&self) -> CountKey {
        (
            Arc::clone(&self.mission),
            Arc::clone(&self.bag),
            self.win,
            Arc::clone(&self.topic),
            Arc::clone(&self.type_name),
            self.node.clone(),
        )
    }
}

/// Makes one count of those of the same window, topic and node that come from several parts of a bag, in any order:
/// counts and bytes are added, the longest gap takes in those between the parts. Sorted by mission, bag, window, topic,
/// type and node.
///
/// Exact for parts that do not overlap in time, as [`count`](super::count()) makes them. All parts of a bag go in at
/// once: what lies between two parts is only known when no other lies there.
pub fn merge(counts: impl IntoIterator<Item = Count>) -> Vec<Count> {
    let mut all: BTreeMap<CountKey, Vec<Count>> = BTreeMap::new();
    for count in counts {
        all.entry(count.key()).or_default().push(count);
    }
    all.into_values().filter_map(whole).collect()
}

fn whole(mut parts: Vec<Count>) -> Option<Count> {
    parts.sort_by_key(|part| (part.first, part.last));
    let mut parts = parts.into_iter();
    let first = parts.next()?;
    Some(parts.fold(first, |whole, part| {
        let seam = part.first.zip(whole.last);
        let seam = seam.map(|(first, last)| first.since(last).max(0));
        let gaps = [whole.max_gap_ns, part.max_gap_ns, seam];
        Count {
            n: whole.n.saturating_add(part.n),
            bytes: sum(whole.bytes, part.bytes),
            first: whole.first.and_then(|a| Some(a.min(part.first?))),
            last: whole.last.and_then(|a| Some(a.max(part.last?))),
            max_gap_ns: seam.and_then(|_| gaps.into_iter().flatten().max()),
            ..whole
        }
    }))
}

fn sum(a: Option<u64>, b: Option<u64>) -> Option<u64> {
    Some(a?.saturating_add(b?))
}

pub(super) const COUNTS: &[(&str, ColumnKind)] = &[
    ("mission", ColumnKind::Text),
    ("bag", ColumnKind::Text),
    ("format", ColumnKind::Text),
    ("period_ns", ColumnKind::I64),
    ("win", ColumnKind::I64),
    ("start_ns", ColumnKind::I64),
    ("end_ns", ColumnKind::I64),
    ("topic", ColumnKind::Text),
    ("type", ColumnKind::Text),
    ("node", ColumnKind::Text),
    ("n", ColumnKind::I64),
    ("bytes", ColumnKind::I64),
    ("first_ns", ColumnKind::I64),
    ("last_ns", ColumnKind::I64),
    ("max_gap_ns", ColumnKind::I64),
];

/// A time as a number: engines that know no nanoseconds (Spark) would cut a timestamp.
fn nanos(stamp: Stamp) -> TableCell<'static> {
    TableCell::Int(stamp.0)
}

/// The counts as a table.
pub(crate) fn counts_table(counts: &[Count]) -> Batch {
    let mut table = Batch::new(COUNTS);
    for count in counts {
        table.push(&[
            TableCell::text(&*count.mission),
            TableCell::text(&*count.bag),
            TableCell::text(&*count.format),
            TableCell::Int(count.period.nanos()),
            TableCell::Int(count.win),
            nanos(count.start),
            nanos(count.start.plus(count.period.nanos())),
            TableCell::text(&*count.topic),
            TableCell::text(&*count.type_name),
            TableCell::known(count.node.as_deref(), TableCell::text),
            TableCell::count(count.n),
            TableCell::known(count.bytes, TableCell::count),
            TableCell::known(count.first, nanos),
            TableCell::known(count.last, nanos),
            TableCell::known(count.max_gap_ns, TableCell::Int),
        ]);
    }
    table
}

/// One bag, readable or not, empty or not: a row of the table `bags`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FleetBag {
    /// Its path or URL, as it was given.
    pub uri: String,
    /// The mission that it belongs to.
    pub mission: String,
    /// What the store says of its version; none for files.
    pub etag: Option<String>,
    /// Its size in bytes, if that is known.
    pub file_bytes: Option<u64>,
    /// The format's word, if it is a bag.
    pub format: Option<String>,
    /// How it was read, if it was.
    pub tier: Option<Tier>,
    /// Whether nothing of it was lost.
    pub is_complete: bool,
    /// All messages; with a part of the time, those in it.
    pub messages: u64,
    /// From the first message to the last plus 1 ns; unknown where every chunk was counted as a whole.
    pub span: Option<Span>,
    /// The length of a window.
    pub period: Period,
    /// Where windows begin.
    pub origin: Stamp,
    /// What was lost, if something was.
    pub lost: Option<String>,
    /// Why it could not be read.
    pub error: Option<String>,
}

const BAGS: &[(&str, ColumnKind)] = &[
    ("uri", ColumnKind::Text),
    ("mission", ColumnKind::Text),
    ("etag", ColumnKind::Text),
    ("file_bytes", ColumnKind::I64),
    ("format", ColumnKind::Text),
    ("tier", ColumnKind::Text),
    ("is_complete", ColumnKind::Flag),
    ("messages", ColumnKind::I64),
    ("start_ns", ColumnKind::I64),
    ("end_ns", ColumnKind::I64),
    ("period_ns", ColumnKind::I64),
    ("origin_ns", ColumnKind::I64),
    ("lost", ColumnKind::Text),
    ("error", ColumnKind::Text),
    ("bagreel", ColumnKind::Text),
    ("schema_version", ColumnKind::I64),
];

/// The bags as a table.
pub(crate) fn bags_table(bags: &[FleetBag]) -> Batch {
    let mut table = Batch::new(BAGS);
    for bag in bags {
        table.push(&[
            TableCell::text(&*bag.uri),
            TableCell::text(&*bag.mission),
            TableCell::known(bag.etag.as_deref(), TableCell::text),
            TableCell::known(bag.file_bytes, TableCell::count),
            TableCell::known(bag.format.as_deref(), TableCell::text),
            TableCell::known(bag.tier, |tier| TableCell::text(tier.word())),
            TableCell::Flag(bag.is_complete),
            TableCell::count(bag.messages),
            TableCell::known(bag.span, |span| nanos(span.start)),
            TableCell::known(bag.span, |span| nanos(span.end)),
            TableCell::Int(bag.period.nanos()),
            nanos(bag.origin),
            TableCell::known(bag.lost.as_deref(), TableCell::text),
            TableCell::known(bag.error.as_deref(), TableCell::text),
            TableCell::text(env!("CARGO_PKG_VERSION")),
            TableCell::Int(SCHEMA_VERSION),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(first: i64, last: i64, n: u64, gap: Option<i64>) -> Count {
        Count {
            mission: "m".into(),
            bag: "b".into(),
            format: "mcap".into(),
            period: Period::from_nanos(100).unwrap(),
            win: 0,
            start: Stamp(0),
            topic: "/t".into(),
            type_name: "".into(),
            node: None,
            n,
            bytes: Some(n),
            first: Some(Stamp(first)),
            last: Some(Stamp(last)),
            max_gap_ns: gap,
        }
    }

    #[test]
    fn the_gap_between_two_parts_counts() {
        let parts = [part(80, 90, 2, Some(10)), part(0, 10, 3, Some(6))];
        let whole = part(0, 90, 5, Some(70));
        assert_eq!(merge(parts), [whole]);
        let single = [
            part(0, 0, 1, None),
            part(5, 5, 1, None),
            part(7, 7, 1, None),
        ];
        assert_eq!(merge(single), [part(0, 7, 3, Some(5))]);
    }

    #[test]
    fn what_is_unknown_of_a_part_is_unknown_of_the_whole() {
        let lump = Count {
            first: None,
            last: None,
            max_gap_ns: None,
            ..part(0, 0, 4, None)
        };
        let merged = merge([part(0, 10, 3, Some(6)), lump]);
        assert_eq!((merged[0].n, merged[0].first), (7, None));
        assert_eq!((merged[0].last, merged[0].max_gap_ns), (None, None));
    }

    #[test]
    fn other_windows_and_nodes_stay_apart() {
        let other = Count {
            node: Some("/n".into()),
            ..part(0, 0, 1, None)
        };
        let later = Count {
            win: 1,
            ..part(0, 0, 1, None)
        };
        assert_eq!(merge([later, other, part(0, 0, 1, None)]).len(), 3);
    }
}
