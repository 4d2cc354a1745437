//! Values of options, parsed from text; each error suggests what to write instead.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::base::time::{Moment, Period, parse_nanos};
use crate::base::words::Worded;
use crate::graph::window::Length;
use crate::pipeline::Phases;

/// The parser of the words of these values.
pub(super) fn one_of<T, const N: usize>(all: [T; N]) -> impl TypedValueParser<Value = T>
where
    T: Worded + Send + Sync + 'static,
{
    let words = PossibleValuesParser::new(all.each_ref().map(Worded::word));
    words.try_map(move |word| {
        let found = all.iter().find(|one| one.word() == word);
        found.copied().ok_or("it is not listed")
    })
}

pub(super) fn length(text: &str) -> Result<Length, &'static str> {
    match text {
        "all" => Ok(Length::All),
        text => period(text).map(Length::Fixed),
    }
}

pub(super) fn period(text: &str) -> Result<Period, &'static str> {
    Period::parse(text).ok_or("write `60`, `30s`, `1m` or `500ms`")
}

pub(super) fn moment(text: &str) -> Result<Moment, &'static str> {
    Moment::parse(text).ok_or("write `90`, `1:30`, `2m`, `-30s`, or RFC 3339")
}

/// A bag and the time by which its clock is corrected.
pub(super) fn offset(text: &str) -> Result<(PathBuf, i64), &'static str> {
    let parsed = text.rsplit_once('=').and_then(|(bag, time)| {
        let (sign, length) = match time.strip_prefix('-') {
            Some(length) => (-1, length),
            None => (1, time.strip_prefix('+').unwrap_or(time)),
        };
        Some((PathBuf::from(bag), sign * parse_nanos(length)?))
    });
    let parsed = parsed.filter(|(bag, _)| !bag.as_os_str().is_empty());
    parsed.ok_or("write a bag and a time, such as `robot2.bag=+0.35s`")
}

/// A bag and the namespace of its names.
pub(super) fn namespace(text: &str) -> Result<(PathBuf, String), &'static str> {
    let is_name = |part: &str| {
        !part.is_empty() && part.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
    };
    let parsed = text.rsplit_once('=').filter(|(bag, space)| {
        let parts = space.strip_prefix('/').map(|space| space.split('/'));
        !bag.is_empty() && parts.is_some_and(|mut parts| parts.all(is_name))
    });
    let parsed = parsed.map(|(bag, space)| (PathBuf::from(bag), space.to_owned()));
    parsed.ok_or("write a bag and a namespace, such as `robot2.bag=/robot2`")
}

/// The source of phases; any word but two is a file.
#[expect(clippy::unnecessary_wraps, reason = "the form that clap requires")]
pub(super) fn phases(text: &str) -> Result<Phases, &'static str> {
    Ok(match text {
        "auto" => Phases::Found,
        "none" => Phases::None,
        file => Phases::File(file.into()),
    })
}

/// A name and an address. Readers trust the links in a report: no scheme that executes code.
pub(super) fn link(text: &str) -> Result<(String, String), &'static str> {
    let parts = text.split_once('=');
    let parts = parts.filter(|(name, url)| !name.is_empty() && !url.is_empty());
    let is_safe = |url: &str| {
        let scheme = url.split_once(':').map(|(scheme, _)| scheme);
        let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.');
        let mut scheme = scheme.into_iter().filter(|s| s.chars().all(is_part));
        scheme.all(|s| ["http", "https"].contains(&&*s.to_ascii_lowercase()))
    };
    let (name, url) = parts.ok_or("write `player=https://…`, or a path")?;
    let link = (name.to_owned(), url.to_owned());
    (is_safe(url).then_some(link)).ok_or("write an address on the web, or a path")
}

pub(super) fn share(text: &str) -> Result<f64, &'static str> {
    let share = text.parse().ok();
    let share = share.filter(|s: &f64| s.is_finite() && *s >= 0.0);
    share.ok_or("write a fraction such as `0.25`")
}

pub(super) fn size(text: &str) -> Result<(u32, u32), &'static str> {
    let side = |part: &str| part.parse().ok().filter(|n| (64..=16_384).contains(n));
    let both = text.split_once('x');
    let both = both.and_then(|(w, h)| Some((side(w)?, side(h)?)));
    both.ok_or("write a size such as `1280x720`; each side is 64 to 16384")
}

pub(super) fn width(text: &str) -> Result<f64, &'static str> {
    let units = [("mm", 1.0), ("cm", 10.0), ("in", 25.4)];
    let mut known = units.iter();
    let millimetres =
        known.find_map(|(unit, mm)| Some(text.strip_suffix(unit)?.parse::<f64>().ok()? * mm));
    let millimetres = millimetres.filter(|mm| (20.0..=2000.0).contains(mm));
    millimetres.ok_or("write a width such as `88mm`, `8.8cm` or `3.5in`; 20 to 2000 mm")
}

pub(super) fn points(text: &str) -> Result<f64, &'static str> {
    let points = text.strip_suffix("pt").and_then(|n| n.parse().ok());
    let points = points.filter(|pt: &f64| (7.0..=12.0).contains(pt));
    points.ok_or("write a size such as `8pt`; 7 to 12")
}

pub(super) fn bytes(text: &str) -> Result<u64, &'static str> {
    let unit = text.find(|c: char| c.is_ascii_alphabetic());
    let at = unit.unwrap_or(text.len());
    let scale = match text[at..].to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "k" | "kb" => 1000,
        "m" | "mb" => 1_000_000,
        "kib" => 1024,
        "mib" => 1024 * 1024,
        _ => 0,
    };
    // The nanoseconds of a plain decimal number are exact enough for its thousandths.
    let number = parse_nanos(&text[..at]).filter(|_| scale > 0 && at > 0);
    let bytes = number.map(|n| i128::from(n) * i128::from(scale) / 1_000_000_000);
    let bytes = bytes.and_then(|n| u64::try_from(n).ok()).filter(|n| *n > 0);
    bytes.ok_or("write a size such as `5MB` or `500kB`")
}
