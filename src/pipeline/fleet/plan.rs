//! The plan, fixed before anything is counted: the bags, the mission of each, and the starts of windows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use regex::Regex;

use crate::bag::{self, Input, OpenOptions, Recording};
use crate::base::error::{Error, Result};
use crate::base::time::{Period, Stamp};
use crate::base::words::worded;
use crate::graph::window::Align;
use crate::pipeline::extract::Bounds;

/// The options of a plan.
#[derive(Clone, Debug)]
pub struct Planning {
    /// The length of a window.
    pub period: Period,
    /// The alignment of windows: whole periods of UTC, or from the first message of each mission.
    pub align: Align,
    /// A regular expression whose first group, or whole match, in a bag's path is its mission.
    pub mission: Option<String>,
}

impl Default for Planning {
    /// Windows of ten seconds by the clock: comparable between missions, and no bag is read to make the plan.
    fn default() -> Self {
        Self {
            period: TEN_SECONDS,
            align: Align::Clock,
            mission: None,
        }
    }
}

const TEN_SECONDS: Period = match Period::from_nanos(10_000_000_000) {
    Some(period) => period,
    None => unreachable!(),
};

worded! {
    /// The detail in which messages are counted: with their times, or only by their number.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum CountDetail {
        /// Every message's time, from the index.
        #[default]
        Index = "index",
        /// By chunks: a chunk within one window is counted as a whole, without times. A bag without chunks is read by
        /// its index.
        Chunks = "chunks",
    }
}

/// One bag of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedBag {
    /// Its path, as it was given or found.
    pub uri: String,
    /// The mission that it belongs to.
    pub mission: String,
    /// The start of one of the windows: the same for all bags of a mission.
    pub origin: Stamp,
}

impl PlannedBag {
    /// The bag itself.
    pub(super) fn input(&self) -> Input {
        match Input::parse(&self.uri) {
            Input::Path(path) if self.uri.contains(UNKNOWN) && !path.exists() => {
                Input::Path(named(&path).unwrap_or(path))
            }
            input => input,
        }
    }
}

/// The character that replaces invalid UTF-8 in a table.
const UNKNOWN: char = '\u{fffd}';

/// The path with invalid UTF-8 that is reported as `path`; `None` unless there is exactly one.
fn named(path: &Path) -> Option<PathBuf> {
    let mut real = PathBuf::new();
    for part in path.components() {
        let next = real.join(part);
        if next.exists() || part.as_os_str() == "." {
            real = next;
            continue;
        }
        let folder = if real.as_os_str().is_empty() {
            Path::new(".")
        } else {
            &real
        };
        let reported = part.as_os_str().to_string_lossy();
        let names = std::fs::read_dir(folder).ok()?.flatten();
        let names = names.map(|event| event.file_name());
        let mut names = names.filter(|name| name.to_string_lossy() == reported);
        let name = names.next().filter(|_| names.next().is_none())?;
        real.push(name);
    }
    Some(real)
}

/// The bags to count, sorted by mission and name, without duplicates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FleetPlan {
    /// The length of a window.
    pub period: Period,
    /// The bags.
    pub bags: Vec<PlannedBag>,
}

impl FleetPlan {
    /// The missions of shard `index` of `count`, counted from 1: missions are assigned to shards in turn, and equal
    /// plans are always divided equally.
    ///
    /// # Errors
    /// [`Error::Usage`] unless `index` is 1 to `count`.
    pub fn shard(mut self, index: usize, count: usize) -> Result<Self> {
        if index == 0 || index > count {
            return Err(Error::usage(
                format!("there is no shard {index} of {count}"),
                "shards are counted from 1: `--shard 1/8` to `--shard 8/8`",
            ));
        }
        let mut place = 0;
        let mut before: Option<String> = None;
        self.bags.retain(|bag| {
            if before
                .as_ref()
                .is_some_and(|mission| *mission != bag.mission)
            {
                place += 1;
            }
            before = Some(bag.mission.clone());
            place % count == index - 1
        });
        Ok(self)
    }
}

/// Makes a plan of bags and folders with bags below them.
///
/// A folder that is one ROS 2 recording is one bag. Parts of a split recording (`x_0.bag`, `x_1.bag`, …, from 0 without
/// a gap) are one mission, `x`; so are the dated ones that ROS 1 records (`x_2024-05-03-14-03-22_0.bag`, …), and the files `x/x_0.mcap`, … of a ROS 2 recording that are given individually;
/// every other bag is its own mission, named by its path without the format's extension.
///
/// # Errors
/// If a folder cannot be listed, or the pattern is not a regular expression. Unreadable bags are detected later.
pub fn plan(sources: &[String], planning: &Planning) -> Result<FleetPlan> {
    let mut uris = Vec::new();
    for source in sources {
        uris.extend(listed(source)?);
    }
    uris.sort();
    uris.dedup();
    let missions = missions(&uris, planning.mission.as_deref())?;
    let mut bags: Vec<PlannedBag> = uris
        .into_iter()
        .zip(missions)
        .map(|(uri, mission)| PlannedBag {
            uri,
            mission,
            origin: Stamp(0),
        })
        .collect();
    bags.sort_by(|a, b| (&a.mission, &a.uri).cmp(&(&b.mission, &b.uri)));
    if planning.align == Align::Bag {
        begin_with_missions(&mut bags);
    }
    Ok(FleetPlan {
        period: planning.period,
        bags,
    })
}

/// The bags of a path.
fn listed(source: &str) -> Result<Vec<String>> {
    match Input::parse(source) {
        Input::Path(path) if path.is_dir() => {
            let text = |path: PathBuf| path.to_string_lossy().into_owned();
            let found = bag::recordings(&path)?;
            let files = found.iter().flat_map(Recording::paths).cloned();
            Ok(files.map(text).collect())
        }
        _ => Ok(vec![source.to_owned()]),
    }
}

/// The file extensions of bags, longest first.
fn endings() -> Vec<String> {
    let all = bag::FORMATS.iter().flat_map(|format| format.extensions);
    let mut all: Vec<String> = all.map(|ending| format!(".{ending}")).collect();
    all.sort_by_key(|ending| std::cmp::Reverse(ending.len()));
    all
}

/// The mission of each bag.
fn missions(uris: &[String], pattern: Option<&str>) -> Result<Vec<String>> {
    let endings = endings();
    let stem = |uri: &String| {
        let stem = endings
            .iter()
            .find_map(|ending| uri.strip_suffix(&**ending));
        stem.unwrap_or(uri).to_owned()
    };
    let stems: Vec<String> = uris.iter().map(stem).collect();
    let Some(pattern) = pattern else {
        return Ok(split_groups(&stems));
    };
    let pattern = Regex::new(pattern).map_err(|error| {
        // The lines before show the pattern.
        let error = error.to_string();
        let reason = error.lines().last().unwrap_or_default();
        let reason = reason.trim().trim_start_matches("error: ");
        Error::usage(
            format!("`{pattern}` is not a regular expression: {reason}"),
            "its first group, or the whole match, names the mission",
        )
    })?;
    let own = |(uri, stem): (&String, String)| match pattern.captures(uri) {
        Some(found) => {
            let part = found.get(1).or_else(|| found.get(0));
            part.map_or(stem, |part| part.as_str().to_owned())
        }
        None => stem,
    };
    Ok(uris.iter().zip(stems).map(own).collect())
}

/// The stems, with those of split recordings cut before the number.
fn split_groups(stems: &[String]) -> Vec<String> {
    let mut numbers: BTreeMap<&str, Vec<u32>> = BTreeMap::new();
    for (name, number) in stems.iter().filter_map(|stem| numbered(stem)) {
        numbers.entry(name).or_default().push(number);
    }
    for numbers in numbers.values_mut() {
        numbers.sort_unstable();
    }
    let is_split = |name: &str| {
        let parts = numbers.get(name).map_or(&[][..], |parts| parts);
        parts.len() > 1
            && parts
                .iter()
                .zip(0..)
                .all(|(number, place)| *number == place)
    };
    let dated = bag::split_parts(stems.iter().map(String::as_str));
    let mission = |(stem, part): (&String, Option<(&str, u32)>)| match part.or(numbered(stem)) {
        Some((name, _)) if part.is_some() => name.to_owned(),
        // ROS 2 names the files of the recording `run` like `run/run_0.mcap`.
        Some((name, _)) if in_own_folder(name) => {
            let folder = Path::new(name).parent();
            folder.map_or(name.into(), |f| f.to_string_lossy().into_owned())
        }
        Some((name, _)) if is_split(name) => name.to_owned(),
        _ => stem.clone(),
    };
    stems.iter().zip(dated).map(mission).collect()
}

/// A name and its number: `run` and 12 of `run_12`.
fn numbered(stem: &str) -> Option<(&str, u32)> {
    let (name, number) = stem.rsplit_once('_')?;
    let is_number = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
    is_number.then_some(())?;
    Some((name, number.parse().ok()?))
}

fn in_own_folder(name: &str) -> bool {
    let path = Path::new(name);
    let folder = path.parent().and_then(Path::file_name);
    folder.is_some() && folder == path.file_name()
}

/// Aligns the windows of each mission with its first message. Unreadable bags are ignored.
fn begin_with_missions(bags: &mut [PlannedBag]) {
    for mission in bags.chunk_by_mut(|a, b| a.mission == b.mission) {
        let own = mission.iter().map(|bag| begins(&bag.input()));
        let first = own.filter_map(|own| own.ok().flatten()).min();
        for bag in mission {
            bag.origin = first.unwrap_or_default();
        }
    }
}

/// The start of a bag, read from its end if possible.
fn begins(input: &Input) -> Result<Option<Stamp>> {
    if input.is_pipe() {
        return Err(Error::usage(
            "the start of a pipe is unknown until it ends",
            "save it to a file first, or align windows with the clock: `--align clock`",
        ));
    }
    let mut reader = bag::open(input, &OpenOptions::default())?;
    if let Some(span) = reader.span()? {
        return Ok(Some(span.start));
    }
    let mut bounds = Bounds(None);
    reader.read(None, &mut bounds)?;
    Ok(bounds.0.map(|span| span.start))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missions_of(uris: &[&str], pattern: Option<&str>) -> Vec<String> {
        let uris: Vec<String> = uris.iter().map(|uri| (*uri).to_owned()).collect();
        missions(&uris, pattern).unwrap()
    }

    #[test]
    fn parts_numbered_from_zero_are_one_mission() {
        let split = [
            "d/a_0.bag",
            "d/a_1.bag",
            "d/b_1.bag",
            "d/b_2.bag",
            "c_0.db3",
        ];
        let dated = [
            "d/r_2024-05-03-14-03-22_0.bag",
            "d/r_2024-05-03-14-08-22_1.bag.active",
        ];
        assert_eq!(missions_of(&dated, None), ["d/r_2024-05-03-14-03-22"; 2]);
        let expected = ["d/a", "d/a", "d/b_1", "d/b_2", "c_0"];
        assert_eq!(missions_of(&split, None), expected);
        assert_eq!(missions_of(&["/x/run/run_0.mcap"], None), ["/x/run"]);
        assert_eq!(
            missions_of(&["a.bag.active", "b.db3.zstd", "c"], None),
            ["a", "b", "c"]
        );
    }

    #[test]
    fn a_pattern_names_missions() {
        let uris = ["day1/r1/a.bag", "day1/r2/b.bag", "other.bag"];
        let expected = ["day1", "day1", "other"];
        assert_eq!(missions_of(&uris, Some("^(day[0-9]+)/")), expected);
        assert!(missions(&[], Some("(")).is_err());
    }

    #[test]
    fn shards_divide_the_missions_and_split_none() {
        let bag = |mission: usize, part: usize| PlannedBag {
            uri: format!("{mission}_{part}.bag"),
            mission: mission.to_string(),
            origin: Stamp(0),
        };
        let bags: Vec<PlannedBag> = (0..7).flat_map(|m| [bag(m, 0), bag(m, 1)]).collect();
        let all = FleetPlan {
            period: TEN_SECONDS,
            bags: bags.clone(),
        };
        let mut seen: Vec<PlannedBag> = Vec::new();
        for index in 1..=3 {
            let shard = all.clone().shard(index, 3).unwrap();
            assert!(matches!(shard.bags.len(), 4 | 6), "{}", shard.bags.len());
            seen.extend(shard.bags);
        }
        seen.sort_by(|a, b| a.uri.cmp(&b.uri));
        assert_eq!(seen, bags);
        assert!(all.clone().shard(0, 3).is_err() && all.shard(4, 3).is_err());
    }
}
