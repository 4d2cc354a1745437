//! Formatting of numbers, times and names for people: all human-readable output goes through here.
//!
//! Data files (JSON, CSV, Parquet) contain plain numbers instead.

use std::borrow::Cow;
use std::fmt;

use chrono::DateTime;

/// An enum without values whose variants have a word each: on the command line, in JSON, for people.
/// A value with a word for the command line.
pub(crate) trait Worded: Copy {
    /// Its word.
    fn word(&self) -> &'static str;
}

macro_rules! worded {
    (
        $(#[$about:meta])*
        $vis:vis enum $name:ident {
            $($(#[$meaning:meta])* $variant:ident = $word:literal,)+
        }
    ) => {
        $(#[$about])*
        $vis enum $name {
            $($(#[$meaning])* $variant,)+
        }

        #[allow(dead_code, reason = "not every enum is listed or parsed")]
        impl $name {
            /// All of them, in order.
            $vis const ALL: [Self; [$($word),+].len()] = [$(Self::$variant),+];

            /// Its word.
            $vis fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }

            /// The one of this word.
            $vis fn from_word(word: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| one.word() == word)
            }
        }

        impl $crate::base::words::Worded for $name {
            fn word(&self) -> &'static str {
                Self::word(*self)
            }
        }
    };
}
pub(crate) use worded;

const SECOND: i64 = 1_000_000_000;

/// A rate in messages per second: `50 Hz`, `12.5 Hz`, `0.25 Hz`, `1.2 kHz`; `0 Hz` for an infinite one, NaN and below
/// 0.
pub fn rate(hz: f64) -> String {
    let (value, unit) = split_rate(hz);
    format!("{value} {unit}")
}

/// The most rates in a row of them.
const MOST_RATES: usize = 4;

/// Rates one after the other: `10 → 5 → 10 Hz`, `900 Hz → 1.2 kHz`; of more than four, the first two, the last, and `…` for the others.
pub fn rates(all_hz: &[f64]) -> String {
    let split: Vec<(String, &str)> = all_hz.iter().map(|hz| split_rate(*hz)).collect();
    let unit = split.last().map_or("", |last| last.1);
    let one = |(value, own): &(String, &str)| match *own {
        own if own == unit => value.clone(),
        own => format!("{value} {own}"),
    };
    let mut parts: Vec<String> = split.iter().map(one).collect();
    if parts.len() > MOST_RATES {
        parts.splice(2..parts.len() - 1, ["…".to_owned()]);
    }
    format!("{} {unit}", parts.join(" → "))
}

/// A range of rates: `13.5–16.5 Hz`, `at least 5 Hz`.
pub fn rate_range(from_hz: Option<f64>, to_hz: Option<f64>) -> String {
    match (from_hz, to_hz) {
        (Some(from), Some(to)) => format!("{from}–{to} Hz"),
        (Some(from), None) => format!("at least {from} Hz"),
        (None, Some(to)) => format!("at most {to} Hz"),
        (None, None) => "any rate".to_owned(),
    }
}

/// A range of counts: `at most 2`, `1–3`.
pub fn count_range(from: Option<f64>, to: Option<f64>) -> String {
    match (from, to) {
        (Some(from), Some(to)) if from < to => format!("{from}–{to}"),
        (Some(one), Some(_)) => one.to_string(),
        (Some(from), None) => format!("at least {from}"),
        (None, Some(0.0)) => "none".to_owned(),
        (None, Some(to)) => format!("at most {to}"),
        (None, None) => "any".to_owned(),
    }
}

/// The rate of `count` messages in `seconds`, with only as many digits as are significant: `1 msg` for a single
/// one, one digit below 10 messages, two below 1,000, else as [`rate`]. A count of n is uncertain by about √n. Below a
/// millisecond only the number is shown.
pub fn rate_of(count: u64, seconds: f64) -> String {
    let hz = count as f64 / seconds;
    match count {
        0 => rate(0.0),
        1 => "1 msg".to_owned(),
        n if seconds < 0.001 => format!("{n} msg"),
        2..=9 => rate(significant(hz, 1)),
        10..=999 => rate(significant(hz, 2)),
        _ => rate(hz),
    }
}

/// `value` rounded to `digits` significant digits; unchanged if it is 0, infinite or NaN.
pub fn significant(value: f64, digits: u8) -> f64 {
    to_digits(value, digits, libm::round)
}

/// As [`significant`], rounded by `whole` to a whole number of units of the last digit.
pub(crate) fn to_digits(value: f64, digits: u8, whole: impl Fn(f64) -> f64) -> f64 {
    if !value.is_finite() || value == 0.0 {
        return value;
    }
    let power = f64::from(digits) - 1.0 - libm::floor(libm::log10(libm::fabs(value)));
    let scale = libm::pow(10.0, libm::fabs(power));
    // Dividing by a power of ten keeps 0.3 exact, multiplying by 0.1 would not.
    if power >= 0.0 {
        whole(value * scale) / scale
    } else {
        whole(value / scale) * scale
    }
}

fn split_rate(hz: f64) -> (String, &'static str) {
    match hz {
        r if !r.is_finite() || r <= 0.0 => ("0".to_owned(), "Hz"),
        r if r >= 999.5 => (number(r / 1000.0), "kHz"),
        r => (number(r), "Hz"),
    }
}

/// A number ≥ 0 in few digits: whole from 100 on, a tenth from 1 on, two significant digits below, `<0.001`.
pub fn number(value: f64) -> String {
    let digits = match value {
        0.0 => return "0".to_owned(),
        v if v >= 99.95 => 0,
        v if v >= 0.95 => 1,
        v if v >= 0.0995 => 2,
        v if v >= 0.000_995 => 3,
        _ => return "<0.001".to_owned(),
    };
    let text = format!("{value:.digits$}");
    match text.split_once('.') {
        Some(_) => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

/// A number of things: `1 node`, `3 nodes`, `2 entries`, `2 switches`.
pub fn count(n: impl TryInto<usize>, word: &str) -> String {
    let n = n.try_into().unwrap_or(usize::MAX);
    if n == 1 {
        return format!("1 {word}");
    }
    match word.strip_suffix('y') {
        Some(stem) if !stem.ends_with(['a', 'e', 'o', 'u']) => format!("{n} {stem}ies"),
        _ if word.ends_with('s') || word.ends_with("ch") => format!("{n} {word}es"),
        _ => format!("{n} {word}s"),
    }
}

/// The counts that are not 0, as `write` writes each: `2 nodes, 1 topic`.
pub(crate) fn counted(counts: &[(usize, &str)], write: impl Fn(usize, &str) -> String) -> String {
    let counts = counts.iter().filter(|(n, _)| *n > 0);
    joined(counts.map(|(n, word)| write(*n, word)), ", ")
}

/// A share as a whole percentage without its sign: `25` for 0.25.
pub fn percent(share: f64) -> String {
    format!("{:.0}", share * 100.0)
}

/// A size in powers of 1000: `12 bytes`, `6.9 MB`.
pub fn bytes(n: u64) -> String {
    let units = [(1_000_000_000_u64, "GB"), (1_000_000, "MB"), (1000, "kB")];
    match units.iter().find(|(unit, _)| n >= *unit) {
        Some((unit, word)) => format!("{:.1} {word}", n as f64 / *unit as f64),
        None if n == 1 => "1 byte".to_owned(),
        None => format!("{n} bytes"),
    }
}

/// An exact length of time in its shortest form: `10 s`, `1.5 s`, `2 min`, `500 ms`, `1 d`. For periods.
pub fn period(nanos: i64) -> String {
    const DAY: i64 = 86_400 * SECOND;
    const HOUR: i64 = 3600 * SECOND;
    const MINUTE: i64 = 60 * SECOND;
    match nanos {
        0 => "0 s".to_owned(),
        n if n % DAY == 0 => format!("{} d", n / DAY),
        n if n % HOUR == 0 => format!("{} h", n / HOUR),
        n if n % MINUTE == 0 => format!("{} min", n / MINUTE),
        n if n.abs() >= SECOND => format!("{} s", n as f64 / 1e9),
        n => format!("{} ms", n as f64 / 1e6),
    }
}

/// A measured length of time, rounded for people: `350 ms`, `5.3 s`, `5 min 26 s`, `2 h 5 min`, `3 d 4 h`.
pub fn duration(nanos: i64) -> String {
    let two = |big: i64, unit: &str, small: i64, part: &str| match small {
        0 => format!("{big} {unit}"),
        _ => format!("{big} {unit} {small} {part}"),
    };
    let seconds = (nanos.saturating_add(SECOND / 2)) / SECOND;
    match nanos {
        n if n < SECOND => format!("{} ms", n / 1_000_000),
        n if n < 60 * SECOND => format!("{} s", number(n as f64 / 1e9)),
        _ if seconds < 3600 => two(seconds / 60, "min", seconds % 60, "s"),
        _ if seconds < 86_400 => two(seconds / 3600, "h", seconds / 60 % 60, "min"),
        _ => two(seconds / 86_400, "d", seconds / 3600 % 24, "h"),
    }
}

/// A moment of a mission, counted from its start: `07:10.25`, `1:02:03` from an hour on, to the millisecond.
pub fn offset(nanos: i64) -> String {
    let sign = if nanos < 0 { "-" } else { "" };
    let nanos = nanos.unsigned_abs();
    let second = nanos / 1_000_000_000;
    let fraction = format!(".{:03}", nanos / 1_000_000 % 1000);
    let fraction = fraction.trim_end_matches('0').trim_end_matches('.');
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    match hour {
        0 => format!("{sign}{minute:02}:{second:02}{fraction}"),
        hour => format!("{sign}{hour}:{minute:02}:{second:02}{fraction}"),
    }
}

/// A moment as [`offset`] writes it, in whole seconds, rounded down: `07:10`.
pub fn offset_seconds(nanos: i64) -> String {
    offset(nanos.div_euclid(SECOND).saturating_mul(SECOND))
}

/// A moment as [`offset`] writes it, to a tenth of a second, rounded down, always with its tenth: `07:10.2`. For logs,
/// where columns align.
pub fn offset_tenths(nanos: i64) -> String {
    let tenth = nanos.div_euclid(SECOND / 10).rem_euclid(10);
    format!("{}.{tenth}", offset_seconds(nanos))
}

/// A moment as [`offset`] writes it, without a leading zero: `3:20`, `0:38.5`, `1:02:03`.
pub fn moment(nanos: i64) -> String {
    let text = offset(nanos);
    text.strip_prefix('0').unwrap_or(&text).to_owned()
}

/// A moment as [`moment`] writes it, to the millisecond, after 20 s to the second: the last window, which ends 1 ns after
/// the last message, is shown as ending at it.
pub fn moment_rounded(nanos: i64) -> String {
    let milli = nanos.saturating_add(500_000) / 1_000_000 * 1_000_000;
    moment(if milli.abs() > 20 * SECOND {
        milli.saturating_add(SECOND / 2) / SECOND * SECOND
    } else {
        milli
    })
}

/// Date and zone of a time since 1970, in nanoseconds: `2024-05-03 UTC`; `None` for a time that is not of the calendar.
pub fn date(nanos: i64) -> Option<String> {
    let time = of_calendar(nanos)?;
    Some(time.format("%Y-%m-%d UTC").to_string())
}

/// Date, clock and zone of a time since 1970, in nanoseconds: `2024-05-03 14:03:22 UTC`; `None` for a time that is not of
/// the calendar.
pub fn date_and_clock(nanos: i64) -> Option<String> {
    let time = of_calendar(nanos)?;
    Some(time.format("%Y-%m-%d %H:%M:%S UTC").to_string())
}

/// The first second of 2007, the year of the first commit of ROS: earlier times are those of simulations, or of clocks that
/// were not set.
const FIRST_OF_ROS: i64 = 1_167_609_600 * SECOND;

fn of_calendar(nanos: i64) -> Option<DateTime<chrono::Utc>> {
    (nanos >= FIRST_OF_ROS).then(|| DateTime::from_timestamp_nanos(nanos))
}

/// `text` in at most `most` characters, its end cut with `…`.
pub fn shorten(text: &str, most: usize) -> Cow<'_, str> {
    if text.chars().nth(most).is_none() {
        return Cow::Borrowed(text);
    }
    let kept: String = text.chars().take(most.saturating_sub(1)).collect();
    Cow::Owned(kept + "…")
}

/// Texts one after the other, with `between` between them.
pub(crate) fn joined<T: fmt::Display>(texts: impl IntoIterator<Item = T>, between: &str) -> String {
    let texts: Vec<String> = texts.into_iter().map(|text| text.to_string()).collect();
    texts.join(between)
}

/// A list of names, shortened: `a, b and c`, or `a, b, c and 4 more`. At least one and at most `most` are named.
pub fn some_of<S: AsRef<str>>(names: impl IntoIterator<Item = S>, most: usize) -> String {
    let names: Vec<S> = names.into_iter().collect();
    let listed: Vec<&str> = names.iter().take(most.max(1)).map(AsRef::as_ref).collect();
    match (listed.as_slice(), names.len() - listed.len()) {
        ([] | [_], 0) => listed.concat(),
        ([first @ .., last], 0) => format!("{} and {last}", first.join(", ")),
        (listed, rest) => format!("{} and {rest} more", listed.join(", ")),
    }
}

/// `text` with line ends, other control characters, invisible and direction marks escaped as `\u{…}`, so that it can
/// neither control a terminal nor hide or reverse adjacent text.
pub fn visible(text: &str) -> Cow<'_, str> {
    replaced(text, is_invisible, |c, out| out.extend(c.escape_unicode()))
}

/// JSON with the invisible characters of its strings escaped as `\uXXXX`, for printing; they only occur in strings.
pub(crate) fn visible_json(json: &str) -> Cow<'_, str> {
    let is_plain = |byte: u8| matches!(byte, b' '..=b'~' | b'\n');
    if json.bytes().all(is_plain) {
        return Cow::Borrowed(json);
    }
    let is_hidden = |c| c != '\n' && is_invisible(c);
    replaced(json, is_hidden, |c, out| {
        let mut units = [0; 2];
        let units = c.encode_utf16(&mut units).iter();
        out.extend(units.map(|unit| format!("\\u{unit:04x}")));
    })
}

/// The text with what `write` writes for each character of which `is` is true.
pub(crate) fn replaced(
    text: &str,
    is: impl Fn(char) -> bool,
    write: impl Fn(char, &mut String),
) -> Cow<'_, str> {
    if !text.contains(&is) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is(c) {
            write(c, &mut out);
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// Control characters, spaces other than the plain one, direction marks, joiners, and noncharacters, which YAML and
/// XML reject.
pub fn is_invisible(c: char) -> bool {
    if (' '..='~').contains(&c) {
        return false;
    }
    c.is_control()
        || (c.is_whitespace() && c != ' ')
        || matches!(c, '\u{ad}' | '\u{61c}' | '\u{115f}' | '\u{1160}' | '\u{180b}'..='\u{180e}' | '\u{200b}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}'
            | '\u{ffa0}' | '\u{fff9}'..='\u{fffb}' | '\u{fffe}' | '\u{ffff}' | '\u{e0000}'..='\u{e0fff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visible_json_is_equivalent() {
        let name = "/a\u{9b}2J\u{202e}\u{e0001}ß\u{1b}";
        let json = serde_json::to_string_pretty(&[name]).unwrap();
        let shown = visible_json(&json);
        assert!(!shown.contains(|c| c != '\n' && is_invisible(c)), "{shown}");
        assert_eq!(serde_json::from_str::<Vec<String>>(&shown).unwrap(), [name]);
    }

    #[test]
    fn formatting_is_consistent() {
        let minute = 60 * SECOND;
        let table = [
            (rate(0.0), "0 Hz"),
            (rate(f64::NAN), "0 Hz"),
            (rate(0.0001), "<0.001 Hz"),
            (rate(0.004), "0.004 Hz"),
            (rate(0.05), "0.05 Hz"),
            (rate(0.25), "0.25 Hz"),
            (rate(1.0), "1 Hz"),
            (rate(7.44), "7.4 Hz"),
            (rate(9.96), "10 Hz"),
            (rate(12.5), "12.5 Hz"),
            (rate(29.97), "30 Hz"),
            (rate(100.4), "100 Hz"),
            (rate(999.6), "1 kHz"),
            (rate(1200.0), "1.2 kHz"),
            (rate(48_000.0), "48 kHz"),
            (rates(&[15.0, 7.4]), "15 → 7.4 Hz"),
            (rates(&[900.0, 1200.0]), "900 Hz → 1.2 kHz"),
            (rate_range(Some(13.5), Some(16.0)), "13.5–16 Hz"),
            (rate_range(Some(13.5), None), "at least 13.5 Hz"),
            (count_range(None, Some(0.0)), "none"),
            (count_range(None, Some(2.0)), "at most 2"),
            (count_range(Some(1.0), Some(3.0)), "1–3"),
            (count_range(Some(2.0), Some(2.0)), "2"),
            (rate_of(0, 10.0), "0 Hz"),
            (rate_of(1, 300.0), "1 msg"),
            (rate_of(3, 10.0), "0.3 Hz"),
            (rate_of(3, 1e-6), "3 msg"),
            (rate_of(299, 10.0), "30 Hz"),
            (rate_of(1249, 100.0), "12.5 Hz"),
            (count(0, "node"), "0 nodes"),
            (count(1, "node"), "1 node"),
            (count(2, "entry"), "2 entries"),
            (count(2, "switch"), "2 switches"),
            (percent(0.25), "25"),
            (bytes(12), "12 bytes"),
            (bytes(1), "1 byte"),
            (bytes(6_881_622), "6.9 MB"),
            (period(90 * SECOND), "90 s"),
            (period(2 * minute), "2 min"),
            (period(500_000_000), "500 ms"),
            (duration(350_000_000), "350 ms"),
            (duration(5_340_000_000), "5.3 s"),
            (duration(326_464_666_680), "5 min 26 s"),
            (duration(125 * minute), "2 h 5 min"),
            (duration(76 * 60 * minute), "3 d 4 h"),
            (offset(430 * SECOND), "07:10"),
            (offset(3_723_500_000_000), "1:02:03.5"),
            (offset(-SECOND), "-00:01"),
            (offset_seconds(430_900_000_000), "07:10"),
            (offset_tenths(430_190_000_000), "07:10.1"),
            (
                date_and_clock(FIRST_OF_ROS).unwrap(),
                "2007-01-01 00:00:00 UTC",
            ),
            (date(FIRST_OF_ROS - 1).unwrap_or_default(), ""),
            (shorten("/camera/image", 8).into_owned(), "/camera…"),
            (shorten("/camera", 7).into_owned(), "/camera"),
            (some_of(["a", "b"], 3), "a and b"),
            (some_of(["a", "b", "c", "d"], 2), "a, b and 2 more"),
            (
                visible("/a\u{1b}[2J\u{202e}\nb").into_owned(),
                "/a\\u{1b}[2J\\u{202e}\\u{a}b",
            ),
            (visible("/größe ✓").into_owned(), "/größe ✓"),
        ];
        for (text, expected) in table {
            assert_eq!(text, expected);
        }
    }
}
