//! Points in time and lengths of time, in whole nanoseconds, and how they are written by people.

use std::fmt;
use std::num::NonZeroI64;

use chrono::DateTime;
use serde::{Deserialize, Serialize};

use super::{cast, words};

/// A point in time: nanoseconds since 1970-01-01T00:00:00Z, by the clock of the recorder.
///
/// Bags contain any value: 0, simulated time near 0, negative numbers. All of `i64` is allowed.
#[derive(
    Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize,
)]
pub struct Stamp(pub i64);

/// A second and a day, in nanoseconds.
pub(crate) const SECOND: i64 = 1_000_000_000;
pub(crate) const DAY: i64 = 86_400 * SECOND;

impl Stamp {
    /// The earliest stamp.
    pub const MIN: Self = Self(i64::MIN);
    /// The latest stamp.
    pub const MAX: Self = Self(i64::MAX);
    /// The latest stamp of a message: a half-open interval can still end after it.
    pub const LAST: Self = Self(i64::MAX - 1);

    /// The stamp of a ROS time, `secs` since 1970 and `nanos` on top (≥ 0; values of a second or more carry over).
    pub const fn from_ros(secs: u32, nanos: u32) -> Self {
        Self(secs as i64 * SECOND + nanos as i64)
    }

    /// The stamp of an unsigned nanosecond count as in MCAP; saturates at [`Stamp::LAST`] in the year 2262.
    pub fn from_nanos(nanos: u64) -> Self {
        Self(i64::try_from(nanos).unwrap_or(i64::MAX)).min(Self::LAST)
    }

    /// `nanos` later (earlier if negative); saturates.
    #[must_use]
    pub const fn plus(self, nanos: i64) -> Self {
        Self(self.0.saturating_add(nanos))
    }

    /// Nanoseconds since `earlier`; saturates.
    pub const fn since(self, earlier: Self) -> i64 {
        self.0.saturating_sub(earlier.0)
    }

    /// As RFC 3339 in UTC, to the nanosecond if needed.
    pub fn rfc3339(self) -> String {
        let second = DateTime::from_timestamp_nanos(self.0).format("%Y-%m-%dT%H:%M:%S");
        match self.0.rem_euclid(SECOND) {
            0 => format!("{second}Z"),
            nanos => format!("{second}.{}Z", format!("{nanos:09}").trim_end_matches('0')),
        }
    }
}

impl fmt::Display for Stamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.rfc3339())
    }
}

/// A half-open interval `[start, end)`.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Serialize)]
#[serde(from = "[Stamp; 2]", into = "[Stamp; 2]")]
pub struct Span {
    /// The start, inclusive.
    pub start: Stamp,
    /// The end, exclusive; never before `start`.
    pub end: Stamp,
}

/// In JSON: the start and the end; an end before the start is the start.
impl From<[Stamp; 2]> for Span {
    fn from([start, end]: [Stamp; 2]) -> Self {
        Self::new(start, end.max(start))
    }
}

impl From<Span> for [Stamp; 2] {
    fn from(span: Span) -> Self {
        [span.start, span.end]
    }
}

impl Span {
    /// The interval from `start` to `end`.
    pub const fn new(start: Stamp, end: Stamp) -> Self {
        Self { start, end }
    }

    /// The part of this time that is over at a moment, 0 to 1.
    pub(crate) fn part(&self, at: Stamp) -> f64 {
        let whole = self.nanos().max(1) as f64;
        (at.since(self.start) as f64 / whole).clamp(0.0, 1.0)
    }

    /// The overlap of two intervals in nanoseconds; 0 or less if there is none.
    pub(crate) fn shared(&self, other: Self) -> i64 {
        self.end.min(other.end).since(self.start.max(other.start))
    }

    /// The interval this many nanoseconds later.
    pub(crate) fn moved(self, by: i64) -> Self {
        Self::new(self.start.plus(by), self.end.plus(by))
    }

    /// The shortest interval that contains both.
    pub(crate) fn hull(&self, other: Self) -> Self {
        Self::new(self.start.min(other.start), self.end.max(other.end))
    }

    /// Sorts intervals and joins those that overlap or are at most `gap` nanoseconds apart.
    pub(crate) fn joined(mut spans: Vec<Self>, gap: i64) -> Vec<Self> {
        spans.sort_unstable_by_key(|span| (span.start, span.end));
        let mut all: Vec<Self> = Vec::new();
        for span in spans {
            match all.last_mut() {
                Some(last) if span.start.since(last.end) <= gap => {
                    last.end = last.end.max(span.end);
                }
                _ => all.push(span),
            }
        }
        all
    }

    /// The length in nanoseconds, ≥ 0.
    pub const fn nanos(&self) -> i64 {
        self.end.since(self.start)
    }

    /// Whether `at` lies inside.
    pub fn contains(&self, at: Stamp) -> bool {
        self.start <= at && at < self.end
    }
}

/// A length of time, 1 ns or more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Period(NonZeroI64);

impl Period {
    /// A period of `nanos` nanoseconds; `None` unless positive.
    pub const fn from_nanos(nanos: i64) -> Option<Self> {
        match NonZeroI64::new(nanos) {
            Some(n) if nanos > 0 => Some(Self(n)),
            _ => None,
        }
    }

    /// The length in nanoseconds, ≥ 1.
    pub const fn nanos(self) -> i64 {
        self.0.get()
    }

    /// Reads `60`, `30s`, `1m`, `2h`, `1d`, `500ms`, `1.5s`; a bare number is seconds.
    /// `None` for anything else, for 0, and past 292 years.
    pub fn parse(text: &str) -> Option<Self> {
        Self::from_nanos(parse_nanos(text)?)
    }
}

impl fmt::Display for Period {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&words::period(self.nanos()))
    }
}

/// Reads a length in nanoseconds, 0 included: `90`, `1:30`, `1:02:03`, `2m`, `500ms`. `None` if it is not a length.
pub fn parse_nanos(text: &str) -> Option<i64> {
    let text = text.trim();
    if text.contains(':') {
        let mut total = 0.0;
        for (at, part) in text.split(':').enumerate() {
            let number = parse_number(part)?;
            if at > 2 || at > 0 && number >= 60.0 {
                return None;
            }
            total = total * 60.0 + number;
        }
        return to_nanos(total);
    }
    let unit = text.find(|c: char| c.is_ascii_alphabetic());
    let digits = unit.unwrap_or(text.len());
    let scale = match text[digits..].trim() {
        "" | "s" | "sec" => 1.0,
        "ms" => 1e-3,
        "us" => 1e-6,
        "ns" => 1e-9,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        "d" => 86_400.0,
        _ => return None,
    };
    to_nanos(parse_number(text[..digits].trim())? * scale)
}

/// A plain decimal number, 0 or more: digits and at most one point.
fn parse_number(text: &str) -> Option<f64> {
    let plain = !text.is_empty() && text.chars().all(|c| c.is_ascii_digit() || c == '.');
    plain.then(|| text.parse().ok()).flatten()
}

fn to_nanos(secs: f64) -> Option<i64> {
    let nanos = libm::round(secs * 1e9);
    // i64::MAX is not an f64; everything below 9.2e18 converts exactly enough.
    (nanos.is_finite() && nanos < 9.2e18).then(|| cast::to_i64(nanos))
}

/// The smallest round length of time that is at least `least` nanoseconds: 1 ms, 2 ms, … 6 h, and whole days.
pub(crate) fn round_length(least: i64) -> i64 {
    /// In milliseconds, up to six hours.
    const STEPS: [i64; 24] = [
        1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 30_000, 60_000,
        120_000, 300_000, 600_000, 1_200_000, 1_800_000, 3_600_000, 7_200_000, 21_600_000,
    ];
    let mut steps = STEPS.iter().map(|millis| millis * (SECOND / 1000));
    let found = steps.find(|step| *step >= least);
    found.unwrap_or_else(|| ((least - 1) / DAY + 1).saturating_mul(DAY))
}

/// A point in time relative to a bag, as in `--start` and `--end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// Nanoseconds after the bag's start.
    AfterStart(i64),
    /// Nanoseconds before the bag's end.
    BeforeEnd(i64),
    /// A point in absolute time.
    Absolute(Stamp),
}

impl Moment {
    /// Reads `90`, `1:30`, `2m` (after the start), `-30s` (before the end) or RFC 3339. `None` if it is none of these.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if let Ok(t) = DateTime::parse_from_rfc3339(text) {
            return t.timestamp_nanos_opt().map(|n| Self::Absolute(Stamp(n)));
        }
        match text.strip_prefix('-') {
            Some(rest) => parse_nanos(rest).map(Self::BeforeEnd),
            None => parse_nanos(text).map(Self::AfterStart),
        }
    }

    /// The point in time that it denotes in a bag that covers `bag`.
    pub fn on(self, bag: Span) -> Stamp {
        match self {
            Self::AfterStart(n) => bag.start.plus(n),
            Self::BeforeEnd(n) => bag.end.plus(-n),
            Self::Absolute(at) => at,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_are_parsed_in_all_forms() {
        let nanos = |t| Period::parse(t).map(Period::nanos);
        assert_eq!(nanos("60"), Some(60 * SECOND));
        assert_eq!(nanos("500ms"), Some(500_000_000));
        assert_eq!(nanos("1.5s"), Some(1_500_000_000));
        assert_eq!(nanos("2m"), Some(120 * SECOND));
        for bad in ["", "0", "-5", "ten", "5 parsecs", "1e9", "nan"] {
            assert_eq!(nanos(bad), None, "{bad}");
        }
    }

    #[test]
    fn moments_count_from_either_end() {
        let bag = Span::new(Stamp(100 * SECOND), Stamp(200 * SECOND));
        let at = |t| Moment::parse(t).map(|m| m.on(bag).0 / SECOND);
        assert_eq!(at("1:30"), Some(190));
        assert_eq!(at("-30s"), Some(170));
        assert_eq!(at("1970-01-01T00:02:00Z"), Some(120));
        assert_eq!(at("75:00"), Some(4600));
        for bad in ["noon", "9:99", "1:60:00", "0:0:0:1"] {
            assert_eq!(at(bad), None, "{bad}");
        }
    }
}
