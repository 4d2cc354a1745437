//! Ranges as people write them: `13.5..16.5`, `5..`, `..1`; times on either side of `..` for parts of a mission.

use std::fmt;

use crate::base::time::{Moment, Span};

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
        let (from, to) = text.split_once("..")?;
        let end = |text: &str| match text.trim() {
            "" => Some(None),
            text => parse(text).map(Some),
        };
        let range = Self {
            from: end(from)?,
            to: end(to)?,
        };
        let is_some = range.from.is_some() || range.to.is_some();
        let is_ordered = range.from.unwrap_or(0.0) <= range.to.unwrap_or(f64::INFINITY);
        (is_some && is_ordered).then_some(range)
    }

    /// Whether the number is below it.
    pub(crate) fn is_above(&self, value: f64) -> bool {
        self.from.is_some_and(|from| value < from)
    }

    /// Whether the number is above it.
    pub(crate) fn is_below(&self, value: f64) -> bool {
        self.to.is_some_and(|to| value > to)
    }

    /// Whether the number is in it.
    pub(crate) fn holds(&self, value: f64) -> bool {
        !self.is_above(value) && !self.is_below(value)
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(from) = self.from {
            write!(f, "{from}")?;
        }
        f.write_str("..")?;
        match self.to {
            Some(to) => write!(f, "{to}"),
            None => Ok(()),
        }
    }
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

    /// Parses a time range; `None` if it is not one or ends before it starts.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let (from, to) = text.split_once("..")?;
        let moment = |text: &str| match text.trim() {
            "" => Some(None),
            text => Moment::parse(text).map(Some),
        };
        let during = Self {
            from: moment(from)?,
            to: moment(to)?,
        };
        let is_ordered = match (during.from, during.to) {
            (Some(Moment::AfterStart(from)), Some(Moment::AfterStart(to))) => from <= to,
            (Some(Moment::BeforeEnd(from)), Some(Moment::BeforeEnd(to))) => from >= to,
            (Some(Moment::Absolute(from)), Some(Moment::Absolute(to))) => from <= to,
            (None, None) => false,
            _ => true,
        };
        is_ordered.then_some(during)
    }

    /// The time range in a mission, clipped to its time.
    pub(crate) fn on(&self, mission: Span) -> Span {
        let start = self.from.map_or(mission.start, |m| m.on(mission));
        let end = self.to.map_or(mission.end, |m| m.on(mission));
        let start = start.clamp(mission.start, mission.end);
        Span::new(start, end.clamp(start, mission.end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

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
}
