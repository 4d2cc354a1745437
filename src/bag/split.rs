//! The parts of a recording that `rosbag record --split` writes, recognized by their names: `run_2024-05-03-14-03-22_0`,
//! `run_2024-05-03-14-08-22_1`, …, each with the date at which it begins.

use std::collections::BTreeMap;

/// The length of a date: `2024-05-03-14-03-22`.
const DATE: usize = 19;

/// For each name without its extension, the recording that it is a part of, named like its first part without a number,
/// and its number; `None` for a recording of its own.
///
/// The parts of one prefix are recordings only if their numbers leave no doubt: sorted by date, each follows the one
/// before or is 0. The first may be another, since a recorder can be told to delete its oldest parts.
pub(crate) fn parts<'a>(stems: impl Iterator<Item = &'a str>) -> Vec<Option<(&'a str, u32)>> {
    let mut all = Vec::new();
    let mut prefixes: BTreeMap<&str, Vec<(&str, u32, usize)>> = BTreeMap::new();
    for (at, stem) in stems.enumerate() {
        all.push(None);
        if let Some((prefix, name, number)) = dated(stem) {
            prefixes.entry(prefix).or_default().push((name, number, at));
        }
    }
    for parts in prefixes.values_mut() {
        parts.sort_unstable();
        let follows = |a: &(&str, u32, usize), b: &(&str, u32, usize)| b.1 == a.1.wrapping_add(1);
        let is_clear = |pair: &[(&str, u32, usize)]| pair[1].1 == 0 || follows(&pair[0], &pair[1]);
        if !parts.windows(2).all(is_clear) {
            continue;
        }
        for recording in parts.chunk_by(follows).filter(|parts| parts.len() > 1) {
            let name = recording[0].0;
            for (_, number, at) in recording {
                all[*at] = Some((name, *number));
            }
        }
    }
    all
}

/// The prefix of a part, its name without the number, and its number: `run_`, `run_2024-05-03-14-03-22` and 0.
fn dated(stem: &str) -> Option<(&str, &str, u32)> {
    let (name, number) = stem.rsplit_once('_')?;
    let start = name.len().checked_sub(DATE)?;
    let (prefix, date) = (name.get(..start)?, name.get(start..)?);
    let is_date = date.bytes().enumerate().all(|(at, byte)| match at {
        4 | 7 | 10 | 13 | 16 => byte == b'-',
        _ => byte.is_ascii_digit(),
    });
    let is_number = number.bytes().all(|byte| byte.is_ascii_digit());
    let is_part = is_date && is_number && (prefix.is_empty() || prefix.ends_with(['_', '/', '\\']));
    is_part.then_some((prefix, name, number.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts, each as `minute of the recording's first part/number`, or `-`.
    fn grouped(stems: &[&str]) -> String {
        let each = parts(stems.iter().copied()).into_iter().map(|part| {
            part.map_or("-".to_owned(), |(name, number)| {
                format!("{}/{number}", &name[name.len() - 5..name.len() - 3])
            })
        });
        each.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn parts_with_ascending_dates_and_numbers_are_one_recording() {
        for (stems, expected) in [
            (
                &["d/run_2024-05-03-14-03-22_0", "d/run_2024-05-03-14-08-22_1"][..],
                "03/0 03/1",
            ),
            (
                &["2024-05-03-14-03-22_0", "2024-05-03-14-08-22_1"],
                "03/0 03/1",
            ),
            // Two recordings, of which the first has lost its beginning.
            (
                &[
                    "r_2024-05-03-14-03-00_4",
                    "r_2024-05-03-14-04-00_5",
                    "r_2024-05-03-14-05-00_0",
                    "r_2024-05-03-14-06-00_1",
                ],
                "03/4 03/5 05/0 05/1",
            ),
            // More than nine parts that begin in one second.
            (
                &["r_2024-05-03-14-03-00_9", "r_2024-05-03-14-03-00_10"],
                "03/9 03/10",
            ),
            (
                &["a_2024-05-03-14-03-00_0", "b_2024-05-03-14-04-00_1"],
                "- -",
            ),
            (
                &["r_2024-05-03-14-03-00_0", "r_2024-05-03-14-05-00_0"],
                "- -",
            ),
        ] {
            assert_eq!(grouped(stems), expected, "{stems:?}");
        }
    }

    #[test]
    fn parts_in_doubt_are_recordings_of_their_own() {
        for stems in [
            // One is missing.
            &["r_2024-05-03-14-03-00_0", "r_2024-05-03-14-05-00_2"][..],
            // Two recorders at once.
            &[
                "r_2024-05-03-14-03-00_0",
                "r_2024-05-03-14-03-01_0",
                "r_2024-05-03-14-04-00_1",
                "r_2024-05-03-14-04-01_1",
            ],
            &["r_2024-05-03-14-04-00_0", "r_2024-05-03-14-03-00_1"],
            &["r_0", "r_1"],
            &["r2024-05-03-14-03-00_0", "r2024-05-03-14-04-00_1"],
            &["", "_", "é_0"],
        ] {
            assert!(
                parts(stems.iter().copied()).iter().all(Option::is_none),
                "{stems:?}"
            );
        }
    }
}
