//! Optional measures of a topic besides its rate: their syntax in a file, their value in a window, and their format.

use super::finding::FindingKind;
use super::range::Range;
use crate::base::cast;
use crate::base::time::{Span, parse_nanos};
use crate::base::words;
use crate::graph::Row;

/// A measure of a topic in each window.
pub(crate) struct Measure {
    /// The key of its range in a file.
    pub(crate) key: &'static str,
    pub(crate) kind: FindingKind,
    /// How to write a range.
    pub(crate) hint: &'static str,
    /// Reads an end of a range.
    pub(crate) parse: fn(&str) -> Option<f64>,
    /// The value in a window, if known.
    pub(crate) of: fn(&Row, Span) -> Option<f64>,
    /// Formats the value.
    pub(crate) shown: fn(f64) -> String,
}

/// All of them, in the order of [`super::expectation::TopicFacts::measures`].
pub(crate) const MEASURES: [Measure; 3] = [
    Measure {
        key: "age",
        kind: FindingKind::TopicAge,
        hint: "write a range of durations: `..0.2s`",
        parse: |text| Some(parse_nanos(text)? as f64 / 1e9),
        of: |row, _| row.age.value(),
        shown: |seconds| words::duration(cast::to_i64(seconds * 1e9)),
    },
    Measure {
        key: "bytes",
        kind: FindingKind::TopicBytes,
        hint: "write a range of bytes per second: `..5MB/s`",
        parse: bytes_per_second,
        of: |row, span| Some(row.bytes? as f64 / (span.nanos().max(1) as f64 / 1e9)),
        shown: |bytes| format!("{}/s", words::bytes(cast::to_u64(bytes))),
    },
    Measure {
        key: "drops",
        kind: FindingKind::TopicDrops,
        hint: "write a range of messages lost in a window: `..0`",
        parse: |text| text.parse().ok(),
        of: |row, _| row.drops.map(|drops| drops as f64),
        shown: words::number,
    },
];

impl Measure {
    /// Reads a range.
    pub(crate) fn range(&self, text: &str) -> Option<Range> {
        Range::parse_ends(text, self.parse)
    }

    /// Formats a range.
    pub(crate) fn range_shown(&self, range: Range) -> String {
        let end = |end: Option<f64>| end.map(self.shown).unwrap_or_default();
        format!("{}..{}", end(range.from), end(range.to))
    }
}

/// `5MB/s`, `800 kB/s`, `1000`.
fn bytes_per_second(text: &str) -> Option<f64> {
    const UNITS: [(&str, f64); 4] = [("kB", 1e3), ("MB", 1e6), ("GB", 1e9), ("B", 1.0)];
    let text = text.strip_suffix("/s").unwrap_or(text);
    let unit = UNITS
        .iter()
        .find_map(|(unit, size)| Some((text.strip_suffix(unit)?, size)));
    let (number, size) = unit.unwrap_or((text, &1.0));
    let number: f64 = number.trim_end().parse().ok()?;
    Some(number * size).filter(|bytes| (0.0..1e18).contains(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_have_units() {
        let shown = |at: usize, text: &str| {
            let measure = &MEASURES[at];
            measure.range(text).map(|range| measure.range_shown(range))
        };
        assert_eq!(shown(0, "..0.2s").as_deref(), Some("..200 ms"));
        assert_eq!(shown(0, "5ms..1m").as_deref(), Some("5 ms..1 min"));
        assert_eq!(
            shown(1, "1kB/s..5MB/s").as_deref(),
            Some("1.0 kB/s..5.0 MB/s")
        );
        assert_eq!(shown(2, "..0").as_deref(), Some("..0"));
        for (at, text) in [
            (0, "0.2s"),
            (0, "..x"),
            (1, "..5 apples"),
            (1, "5MB/s..1B/s"),
            (2, ".."),
        ] {
            assert_eq!(shown(at, text), None, "{text}");
        }
    }
}
