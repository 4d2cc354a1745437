//! The counts of a fleet's bags, and merging the counts of parts of a bag.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::bag::Tier;
use crate::base::time::{Period, Span, Stamp};

/// The version of both tables' columns, raised when the meaning of one changes.
pub const SCHEMA_VERSION: i64 = 3;

/// The messages of one publisher on one topic in one window: a row of the table `counts`. Windows without messages have
/// no row.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Count {
    /// The mission that the bag belongs to.
    pub mission: Arc<str>,
    /// The bag, as its path or URL was given.
    pub bag: Arc<str>,
    /// The format's name: `rosbag1`, `mcap`, `sqlite3`.
    pub format: Arc<str>,
    /// The length of a window.
    pub period: Period,
    /// The window's index from the plan's origin: periods since 1970 with windows by the clock.
    pub win: i64,
    /// The start of the window; it ends a period later.
    pub start: Stamp,
    /// The topic as recorded.
    pub topic: Arc<str>,
    /// Its type as recorded; empty if unknown.
    pub type_name: Arc<str>,
    /// The publishing node, if known.
    pub node: Option<Arc<str>>,
    /// The number of messages, ≥ 1.
    pub n: u64,
    /// The number of bytes of their payloads, if the index contains it.
    pub bytes: Option<u64>,
    /// The first message's time; unknown if a chunk was counted as a whole.
    pub first: Option<Stamp>,
    /// The last message's time; unknown if `first` is.
    pub last: Option<Stamp>,
    /// The longest time between two of them, in nanoseconds; unknown for one message, or if `first` is.
    pub max_gap_ns: Option<i64>,
}

/// The key of counts, without the mission and the format, which are determined by the bag. Rows of a table are sorted
/// by it.
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

/// Merges counts of the same window, topic and node from several parts of a bag, in any order: counts and bytes are
/// added, and gaps between the parts are included. Sorted by mission, bag, window, topic, type and node.
///
/// Exact for parts that do not overlap in time, as made by [`count`](super::count()). All parts of a bag must be merged
/// at once: the gap between two parts is only valid if no other part is in between.
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

/// One bag, readable or not, empty or not: a row of the table `bags`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FleetBag {
    /// Its path, as it was given.
    pub uri: String,
    /// The mission that it belongs to.
    pub mission: String,
    /// Its size in bytes, if known.
    pub file_bytes: Option<u64>,
    /// The format's name, if it is a bag.
    pub format: Option<String>,
    /// The tier in which it was read, if it was.
    pub tier: Option<Tier>,
    /// Whether nothing of it was lost.
    pub is_complete: bool,
    /// The number of messages, in the counted part of the time.
    pub messages: u64,
    /// A digest of the topics and times of these messages, the same for copies of a bag and conversions of it; none
    /// without messages. Chunks counted as a whole add their windows instead of times.
    pub content: Option<String>,
    /// From the first message to the last plus 1 ns; unknown if every chunk was counted as a whole.
    pub span: Option<Span>,
    /// The length of a window.
    pub period: Period,
    /// The start of one of the windows.
    pub origin: Stamp,
    /// A description of the loss, if any.
    pub lost: Option<String>,
    /// The reason why it could not be read.
    pub error: Option<String>,
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
    fn gaps_between_parts_are_counted() {
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
    fn unknown_values_of_a_part_are_unknown_in_the_sum() {
        let chunk_count = Count {
            first: None,
            last: None,
            max_gap_ns: None,
            ..part(0, 0, 4, None)
        };
        let merged = merge([part(0, 10, 3, Some(6)), chunk_count]);
        assert_eq!((merged[0].n, merged[0].first), (7, None));
        assert_eq!((merged[0].last, merged[0].max_gap_ns), (None, None));
    }

    #[test]
    fn different_windows_and_nodes_are_not_merged() {
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
