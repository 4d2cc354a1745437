//! Division of time into windows.

use crate::base::budget;
use crate::base::error::{Error, Result};
use crate::base::time::{DAY, Moment, Period, SECOND, Span, Stamp};
use crate::base::words::{self, worded};

/// The periods to choose from, in milliseconds, the shortest first: below a minute for a bag shorter than five minutes.
const PERIODS: [i64; 19] = [
    100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 30_000, 60_000, 120_000, 300_000, 600_000,
    1_800_000, 3_600_000, 7_200_000, 21_600_000, 43_200_000, 86_400_000,
];

/// The periods to choose from, in nanoseconds, the shortest first.
fn periods() -> impl DoubleEndedIterator<Item = i64> {
    PERIODS.iter().map(|millis| millis * (SECOND / 1000))
}

/// The requested length of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Length {
    /// Chosen by the length of the bag: [`default_period`].
    #[default]
    Auto,
    /// One window for the whole bag.
    All,
    /// This many equal windows, ≥ 1.
    Parts(u32),
    /// This length.
    Fixed(Period),
}

worded! {
    /// The alignment of windows.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Align {
        /// At the first message.
        #[default]
        Bag = "bag",
        /// At whole periods of UTC.
        Clock = "clock",
    }
}

/// The requested division of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Division {
    /// The length of a window.
    pub length: Length,
    /// The time from one window's start to the next; equal to the length if `None`.
    pub step: Option<Period>,
    /// The beginning of the part to divide; the time before is left out.
    pub start: Option<Moment>,
    /// The end of the part to divide; the time after is left out.
    pub end: Option<Moment>,
    /// The alignment of windows.
    pub align: Align,
    /// Windows from one phase or reconfiguration to the next, instead of equal ones.
    pub cut: Option<Cut>,
}

worded! {
    /// The points at which windows of unequal length begin.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Cut {
        /// With each phase.
        Phases = "phases",
        /// With each reconfiguration; changes within seconds of each other are one.
        Changes = "changes",
    }
}

/// The windows of a mission: all as long as the period, a step apart, except those cut off by the mission's
/// ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Windows {
    /// The divided time.
    pub span: Span,
    /// The length of a whole window.
    pub period: Period,
    /// The time from one window's start to the next, never more than the period.
    pub step: Period,
    /// The times of the windows, in order; at least one.
    pub spans: Vec<Span>,
}

impl Windows {
    /// Whether the window with this index, counted from 0, is shorter than the period.
    pub fn partial(&self, index: usize) -> bool {
        self.spans[index].nanos() < self.period.nanos()
    }
}

/// The part of `bag` that a division requests.
///
/// # Errors
/// [`Error::Usage`] if it contains nothing of the bag.
pub fn range(division: &Division, bag: Span) -> Result<Span> {
    let start = division.start.map_or(bag.start, |m| m.on(bag));
    let end = division.end.map_or(bag.end, |m| m.on(bag));
    let (start, end) = (start.max(bag.start), end.min(bag.end));
    if start < end {
        return Ok(Span::new(start, end));
    }
    Err(Error::usage(
        format!(
            "`--start` and `--end` select nothing of this bag's {}",
            words::duration(bag.nanos())
        ),
        format!("the bag covers {} to {}", bag.start, bag.end),
    ))
}

/// The default period for a bag of this length: a minute; from 30 s down to 0.1 s for a bag below five minutes, so that
/// it has at least five windows; from 2 min up to a day, then whole days, above 600 windows.
pub fn default_period(nanos: i64) -> Period {
    let minute = 60 * SECOND;
    let chosen = if nanos < 5 * minute {
        let mut short = periods().rev().filter(|p| *p < minute);
        let enough = short.find(|p| count(nanos, *p) >= 5);
        enough.unwrap_or(SECOND / 10)
    } else {
        let fits = |p: &i64| *p >= minute && count(nanos, *p) <= budget::CHOSEN_WINDOWS;
        let found = periods().find(fits);
        found.unwrap_or_else(|| whole_days(nanos))
    };
    Period::from_nanos(chosen).unwrap_or(MINUTE)
}

/// The fewest whole days that cover `nanos` with at most [`budget::CHOSEN_WINDOWS`] windows.
fn whole_days(nanos: i64) -> i64 {
    count(count(nanos, DAY), budget::CHOSEN_WINDOWS) * DAY
}

const MINUTE: Period = match Period::from_nanos(60 * SECOND) {
    Some(minute) => minute,
    None => unreachable!(),
};

/// The number of windows of `period` that cover `nanos`, both positive.
fn count(nanos: i64, period: i64) -> i64 {
    nanos / period + i64::from(nanos % period > 0)
}

/// Divides `span` (see [`range`]) into windows.
///
/// # Errors
/// [`Error::Usage`] for a step longer than the period and for more than `budget::WINDOWS` windows.
pub fn divide(division: &Division, span: Span) -> Result<Windows> {
    let nanos = span.nanos().max(1);
    let period = match division.length {
        Length::Auto => default_period(nanos),
        Length::All => Period::from_nanos(nanos).unwrap_or(MINUTE),
        Length::Parts(parts) => {
            Period::from_nanos(count(nanos, i64::from(parts.max(1)))).unwrap_or(MINUTE)
        }
        Length::Fixed(period) => period,
    };
    let step = division.step.unwrap_or(period);
    if step > period {
        return Err(Error::usage(
            format!("a step of {step} is longer than the period of {period}"),
            "windows may overlap but leave no gaps; `--step` is at most `--period`",
        ));
    }
    let first = first_start(division, span, period, step);
    let many = count(span.end.since(first), step.nanos());
    if many > budget::WINDOWS {
        return Err(too_many(many, nanos));
    }
    let starts = (0..many).map(|k| first.plus(k * step.nanos()));
    let end = |start: Stamp| start.plus(period.nanos()).min(span.end);
    let spans = starts.map(|at| Span::new(at.max(span.start), end(at)));
    Ok(Windows {
        span,
        period,
        step,
        spans: spans.collect(),
    })
}

/// The windows that begin at the start of `span` and at each of `changes`, sorted; none of them is partial.
pub(crate) fn at_changes(span: Span, changes: impl Iterator<Item = Stamp>) -> Windows {
    let mut spans = cut_at(span, changes);
    spans.retain(|window| window.start < window.end);
    let shortest = spans.iter().map(Span::nanos).min().unwrap_or(1);
    let period = Period::from_nanos(shortest.max(1)).unwrap_or(MINUTE);
    Windows {
        span,
        period,
        step: period,
        spans,
    }
}

/// A time cut at the moments that are inside it, sorted.
pub(crate) fn cut_at(span: Span, moments: impl Iterator<Item = Stamp>) -> Vec<Span> {
    let inside = moments.filter(|at| span.start < *at && *at < span.end);
    let starts: Vec<Stamp> = std::iter::once(span.start).chain(inside).collect();
    between(&starts, span.end)
}

/// The intervals from each start to the next, the last one to `end`.
pub(crate) fn between(starts: &[Stamp], end: Stamp) -> Vec<Span> {
    let ends = starts.iter().skip(1).copied().chain([end]);
    let pairs = starts.iter().zip(ends);
    pairs.map(|(start, end)| Span::new(*start, end)).collect()
}

fn first_start(division: &Division, span: Span, period: Period, step: Period) -> Stamp {
    match (division.align, division.length) {
        (Align::Clock, Length::Auto | Length::Fixed(_)) => {
            let back = span.start.0.rem_euclid(step.nanos().max(period.nanos()));
            span.start.plus(-back)
        }
        _ => span.start,
    }
}

fn too_many(many: i64, nanos: i64) -> Error {
    let enough = periods().find(|p| count(nanos, *p) <= budget::WINDOWS);
    let enough = enough.unwrap_or_else(|| count(nanos, budget::WINDOWS));
    Error::usage(
        format!("{many} windows are more than {}", budget::WINDOWS),
        format!("use `--period {}`", plain(enough)),
    )
}

/// `span` cut into pieces of `step` nanoseconds, at least 1; the last one may be shorter.
pub(crate) fn every(span: Span, step: i64) -> Vec<Span> {
    let step = step.max(1);
    let many = count(span.nanos().max(1), step);
    let starts = (0..many).map(|k| span.start.plus(k * step));
    let piece = |start: Stamp| Span::new(start, start.plus(step).min(span.end));
    starts.map(piece).collect()
}

/// A period in the form that `--period` takes.
pub fn plain(nanos: i64) -> String {
    if nanos % SECOND == 0 {
        format!("{}s", nanos / SECOND)
    } else {
        format!(
            "{}ms",
            nanos.div_euclid(1_000_000) + i64::from(nanos % 1_000_000 > 0)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn secs(from: i64, to: i64) -> Span {
        Span::new(Stamp(from * SECOND), Stamp(to * SECOND))
    }

    fn every(text: &str) -> Division {
        Division {
            length: Period::parse(text).map_or(Length::Auto, Length::Fixed),
            ..Division::default()
        }
    }

    #[test]
    fn the_last_window_is_cut_at_the_end() {
        let windows = divide(&every("10"), secs(100, 125)).unwrap();
        assert_eq!(
            windows.spans,
            [secs(100, 110), secs(110, 120), secs(120, 125)]
        );
        assert_eq!((windows.partial(1), windows.partial(2)), (false, true));
    }

    #[test]
    fn a_smaller_step_makes_windows_overlap() {
        let division = Division {
            step: Period::parse("5"),
            ..every("10")
        };
        let windows = divide(&division, secs(0, 20)).unwrap();
        assert_eq!(
            windows.spans,
            [secs(0, 10), secs(5, 15), secs(10, 20), secs(15, 20)]
        );
    }

    #[test]
    fn the_clock_aligns_windows_to_whole_periods() {
        let division = Division {
            align: Align::Clock,
            ..every("10")
        };
        let windows = divide(&division, secs(104, 125)).unwrap();
        assert_eq!(
            windows.spans,
            [secs(104, 110), secs(110, 120), secs(120, 125)]
        );
    }

    #[test]
    fn the_default_period_gives_five_to_six_hundred_windows() {
        let chosen = |s: i64| default_period(s * SECOND).nanos() / SECOND;
        assert_eq!(
            [chosen(330), chosen(299), chosen(49), chosen(5)],
            [60, 30, 10, 1]
        );
        assert_eq!([chosen(600 * 60), chosen(601 * 60)], [60, 120]);
        assert_eq!(default_period(1).nanos(), SECOND / 10);
        assert_eq!(chosen(601 * 86_400), 2 * 86_400);
    }

    #[test]
    fn no_span_is_too_long_for_600_windows() {
        for end in [i64::MAX / 2, i64::MAX] {
            let span = Span::new(Stamp(0), Stamp(end));
            let windows = divide(&Division::default(), span).unwrap();
            assert!((500..=600).contains(&windows.spans.len()), "{end}");
            assert_eq!(windows.spans.last().unwrap().end, Stamp(end));
        }
    }

    #[test]
    fn too_many_windows_suggest_a_period() {
        let error = divide(&every("1ms"), secs(0, 3600)).unwrap_err();
        assert!(error.is_usage());
        assert_eq!(error.hint(), "use `--period 100ms`");
        assert!(divide(&every("100ms"), secs(0, 3600)).is_ok());
    }

    #[test]
    fn start_and_end_limit_the_range() {
        let cut = |start, end| {
            let moment = |t: Option<&str>| t.and_then(Moment::parse);
            range(
                &Division {
                    start: moment(start),
                    end: moment(end),
                    ..Division::default()
                },
                secs(100, 200),
            )
        };
        assert_eq!(cut(Some("30"), Some("-30s")).unwrap(), secs(130, 170));
        assert_eq!(
            cut(None, Some("0")).unwrap_err().to_string(),
            "`--start` and `--end` select nothing of this bag's 1 min 40 s"
        );
    }
}
