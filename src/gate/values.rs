//! The values of an expectations file: names with wildcards (`*` matches any characters except `/`, `**` any characters, `?` one
//! that is not `/`; a backslash before them makes them plain), ranges of numbers (`13.5..16.5`, `5..`), times of a mission (`1:30..2m`, `-30s..`), measures of messages.

use std::collections::BTreeSet;
use std::fmt;

use super::finding::FindingKind;
use crate::base::cast;
use crate::base::time::{Moment, Span, parse_nanos};
use crate::base::words;
use crate::graph::Row;

/// A name that may contain wildcards.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Pattern {
    text: String,
    parts: Vec<PatternPart>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum PatternPart {
    This(char),
    One,
    Some,
    All,
}

impl Pattern {
    /// The pattern of this text.
    pub(crate) fn new(text: &str) -> Self {
        let mut parts = Vec::new();
        let mut chars = text.chars();
        while let Some(c) = chars.next() {
            match (c, parts.last()) {
                ('\\', _) => parts.push(PatternPart::This(chars.next().unwrap_or(c))),
                ('*', Some(PatternPart::Some | PatternPart::All)) => {
                    parts.pop();
                    parts.push(PatternPart::All);
                }
                ('*', _) => parts.push(PatternPart::Some),
                ('?', _) => parts.push(PatternPart::One),
                (c, _) => parts.push(PatternPart::This(c)),
            }
        }
        let name = parts.iter().map(|part| match part {
            PatternPart::This(c) => Some(*c),
            _ => None,
        });
        Self {
            text: name.collect::<Option<String>>().unwrap_or(text.to_owned()),
            parts,
        }
    }

    /// The text of the pattern that only matches this name.
    pub(crate) fn text_of(name: &str) -> String {
        let mut text = String::new();
        for c in name.chars() {
            text.extend(matches!(c, '*' | '?' | '\\').then_some('\\'));
            text.push(c);
        }
        text
    }

    /// The pattern as written; for a name, the name.
    pub(crate) fn as_str(&self) -> &str {
        &self.text
    }

    /// Whether it has no wildcards.
    pub(crate) fn is_name(&self) -> bool {
        self.parts.iter().all(|p| matches!(p, PatternPart::This(_)))
    }

    /// Whether it matches a name. The cost is at most the product of both lengths.
    pub(crate) fn matches(&self, name: &str) -> bool {
        if self.is_name() {
            return self.text == name;
        }
        let name: Vec<char> = name.chars().collect();
        // Whether the parts so far match the first characters of the name, for each number of these.
        let mut fits = vec![false; name.len() + 1];
        fits[0] = true;
        for part in &self.parts {
            let mut next = vec![false; fits.len()];
            next[0] = fits[0] && matches!(part, PatternPart::Some | PatternPart::All);
            for (at, c) in name.iter().enumerate() {
                next[at + 1] = match part {
                    PatternPart::This(own) => fits[at] && own == c,
                    PatternPart::One => fits[at] && *c != '/',
                    PatternPart::Some => fits[at + 1] || next[at] && *c != '/',
                    PatternPart::All => fits[at + 1] || next[at],
                };
            }
            fits = next;
        }
        fits[name.len()]
    }
}

/// A set of names and patterns.
#[derive(Debug, Default)]
pub(crate) struct NamePatterns<'a> {
    exact: BTreeSet<&'a str>,
    patterns: Vec<&'a Pattern>,
}

impl<'a> FromIterator<&'a Pattern> for NamePatterns<'a> {
    fn from_iter<I: IntoIterator<Item = &'a Pattern>>(all: I) -> Self {
        let mut names = Self::default();
        for pattern in all {
            if pattern.is_name() {
                names.exact.insert(pattern.as_str());
            } else {
                names.patterns.push(pattern);
            }
        }
        names
    }
}

impl NamePatterns<'_> {
    /// Whether one of them matches this name.
    pub(crate) fn hold(&self, name: &str) -> bool {
        self.exact.contains(name) || self.patterns.iter().any(|p| p.matches(name))
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// An inclusive range of numbers; an open end is unlimited.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Range {
    pub(crate) from: Option<f64>,
    pub(crate) to: Option<f64>,
}

impl Range {
    /// Parses a range of numbers ≥ 0; `None` if it is not a range or is empty.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let plain = |c: char| c.is_ascii_digit() || c == '.';
        Self::parse_ends(text, |end| {
            end.parse().ok().filter(|_| end.chars().all(plain))
        })
    }

    /// As [`Self::parse`], with ends read by `parse`.
    pub(crate) fn parse_ends(text: &str, parse: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        let [from, to] = ends(text, parse)?;
        let is_ordered = from.unwrap_or(0.0) <= to.unwrap_or(f64::INFINITY);
        is_ordered.then_some(Self { from, to })
    }

    /// Whether the number is below it.
    pub(crate) fn is_above(&self, value: f64) -> bool {
        self.from.is_some_and(|from| value < from)
    }

    /// Whether the number is above it.
    pub(crate) fn is_below(&self, value: f64) -> bool {
        self.to.is_some_and(|to| value > to)
    }

    /// The range with its ends as `end` writes them.
    pub(crate) fn shown(&self, end: impl Fn(f64) -> String) -> String {
        let [from, to] = [self.from, self.to].map(|own| own.map(&end).unwrap_or_default());
        format!("{from}..{to}")
    }

    /// Whether the number is in it.
    pub(crate) fn holds(&self, value: f64) -> bool {
        !self.is_above(value) && !self.is_below(value)
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.shown(|end| end.to_string()))
    }
}

/// The ends on either side of `..`, each read by `parse`; `None` if one is wrong or both are open.
fn ends<T>(text: &str, parse: impl Fn(&str) -> Option<T>) -> Option<[Option<T>; 2]> {
    let (from, to) = text.split_once("..")?;
    let end = |text: &str| match text.trim() {
        "" => Some(None),
        text => parse(text).map(Some),
    };
    let ends = [end(from)?, end(to)?];
    ends.iter().any(Option::is_some).then_some(ends)
}

/// A time range of a mission: `1:30..2m`, `-30s..`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct During {
    from: Option<Moment>,
    to: Option<Moment>,
}

impl During {
    /// The whole mission.
    pub(crate) const WHOLE: Self = Self {
        from: None,
        to: None,
    };

    /// From the mission's start to a moment.
    pub(crate) fn until(nanos: i64) -> Self {
        Self {
            from: None,
            to: Some(Moment::AfterStart(nanos)),
        }
    }

    /// Whether it ends after the mission does.
    pub(crate) fn is_beyond(&self, mission: Span) -> bool {
        self.to.is_some_and(|to| to.on(mission) > mission.end)
    }

    /// Whether it ends at the same time however long a recording becomes, and has ended in this part of it.
    pub(crate) fn is_over(&self, part: Span) -> bool {
        self.is_fixed() && self.to.is_some_and(|to| to.on(part) < part.end)
    }

    /// Whether it means the same time however long a recording becomes.
    pub(crate) fn is_fixed(&self) -> bool {
        let mut ends = self.from.iter().chain(&self.to);
        !ends.any(|moment| matches!(moment, Moment::BeforeEnd(_)))
    }

    /// Parses a time range; `None` if it is not one or ends before it starts.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let [from, to] = ends(text, Moment::parse)?;
        let is_ordered = match (from, to) {
            (Some(Moment::AfterStart(from)), Some(Moment::AfterStart(to))) => from <= to,
            (Some(Moment::BeforeEnd(from)), Some(Moment::BeforeEnd(to))) => from >= to,
            (Some(Moment::Absolute(from)), Some(Moment::Absolute(to))) => from <= to,
            _ => true,
        };
        is_ordered.then_some(Self { from, to })
    }

    /// The time range in a mission, clipped to its time.
    pub(crate) fn on(&self, mission: Span) -> Span {
        let start = self.from.map_or(mission.start, |m| m.on(mission));
        let end = self.to.map_or(mission.end, |m| m.on(mission));
        let start = start.clamp(mission.start, mission.end);
        Span::new(start, end.clamp(start, mission.end))
    }
}

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

/// All of them, in the order of [`super::expectation::Entry::measures`].
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
}

/// `5MB/s`, `800 kB/s`, `1000`.
fn bytes_per_second(text: &str) -> Option<f64> {
    const UNITS: [(&str, f64); 4] = [("kB", 1e3), ("MB", 1e6), ("GB", 1e9), ("B", 1.0)];
    let text = text.strip_suffix("/s").unwrap_or(text);
    let mut units = UNITS.iter();
    let unit = units.find_map(|(unit, size)| Some((text.strip_suffix(unit)?, size)));
    let (number, size) = unit.unwrap_or((text, &1.0));
    let number: f64 = number.trim_end().parse().ok()?;
    Some(number * size).filter(|bytes| (0.0..1e18).contains(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

    #[test]
    fn a_set_contains_what_one_of_its_patterns_matches() {
        let all = ["/a", "/cam_*", "/b"].map(Pattern::new);
        let names: NamePatterns<'_> = all.iter().collect();
        let held = ["/a", "/b", "/cam_1", "/c", "/cam_1/x"].map(|name| names.hold(name));
        assert_eq!(held, [true, true, true, false, false]);
    }

    #[test]
    fn wildcards_match_parts_of_names() {
        let table = [
            ("/scan", "/scan", true),
            ("/scan", "/scan2", false),
            ("/nav/*", "/nav/planner", true),
            ("/nav/*", "/nav/a/b", false),
            ("/nav/**", "/nav/a/b", true),
            ("/cam_*/image", "/cam_front/image", true),
            ("/cam_*/image", "/cam_/raw/image", false),
            ("/cam_?", "/cam_1", true),
            ("/cam_?", "/cam_", false),
            ("*", "a", true),
            ("**", "/a/b", true),
            ("/a*b*c", "/aXbbYc", true),
        ];
        for (pattern, name, fits) in table {
            assert_eq!(
                Pattern::new(pattern).matches(name),
                fits,
                "{pattern} {name}"
            );
        }
    }

    #[test]
    fn ranges_are_read_and_written_the_same() {
        for text in ["13.5..16.5", "5..", "..1", "0..0"] {
            let range = Range::parse(text);
            assert_eq!(range.map(|r| r.to_string()).as_deref(), Some(text));
        }
        for bad in [
            "", "5", "..", "2..1", "a..b", "-1..", "1e9..", "nan..", "1...2",
        ] {
            assert_eq!(Range::parse(bad), None, "{bad}");
        }
        let range = Range::parse("2..3").unwrap();
        assert!(range.holds(2.0) && range.is_above(1.9) && range.is_below(3.1));
    }

    #[test]
    fn time_ranges_count_from_either_end() {
        let second = |s: i64| Stamp(s * 1_000_000_000);
        let mission = Span::new(second(100), second(200));
        let on = |text| {
            let span = During::parse(text).unwrap().on(mission);
            (span.start.0 / 1_000_000_000, span.end.0 / 1_000_000_000)
        };
        assert_eq!(on("-30s.."), (170, 200));
        assert_eq!(on("10..1:00"), (110, 160));
        assert_eq!(on("..500"), (100, 200));
        assert_eq!(During::parse("soon.."), None);
        assert_eq!(During::parse(".."), None);
        for reversed in ["2m..1:30", "-10s..-20s"] {
            assert_eq!(During::parse(reversed), None, "{reversed}");
        }
        assert_eq!(on("10..-20s"), (110, 180));
    }

    #[test]
    fn ranges_have_units() {
        let shown = |at: usize, text: &str| {
            let measure = &MEASURES[at];
            measure.range(text).map(|range| range.shown(measure.shown))
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
