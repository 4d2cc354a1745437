//! The recordings in a folder: a rosbag2 folder is one recording, and so are the parts of a split ROS 1 recording and
//! every other bag file below it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::InputKind;
use super::input::{Input, file_name};
use super::source::FileSource;
use crate::bag::decompress::{ZSTD_HEAD, zstd_stated};
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;
use crate::base::words;

/// The depth below the folder down to which bags are searched for.
const DEEPEST: usize = 16;
/// The most recordings that an error lists.
const LISTED: usize = 8;

/// A recording: a file, a rosbag2 folder, or the parts of a split ROS 1 recording, in order.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Recording(Vec<PathBuf>);

impl Recording {
    /// A file or a rosbag2 folder.
    pub(crate) fn of(path: PathBuf) -> Self {
        Self(vec![path])
    }

    /// Its files, at least one.
    pub(crate) fn paths(&self) -> &[PathBuf] {
        &self.0
    }

    /// Its files as the inputs of one mission.
    pub(crate) fn inputs(&self) -> Vec<Input> {
        self.0.iter().cloned().map(Input::Path).collect()
    }

    /// Its name, relative to a folder: `run.bag`, `run_0.bag to run_3.bag`, `.` for the folder itself.
    pub(crate) fn name_in(&self, folder: &Path) -> String {
        let name = |path: &PathBuf| match path.strip_prefix(folder).unwrap_or(path) {
            own if own == Path::new("") => ".".to_owned(),
            below => below.display().to_string(),
        };
        match &self.0[..] {
            [first, .., last] => format!("{} to {}", name(first), file_name(last)),
            all => all.first().map_or_else(String::new, name),
        }
    }
}

/// The inputs of an input: the parts of a split ROS 1 recording for the folder of it, else the input itself.
pub(crate) fn parts_of(input: &Input) -> Vec<Input> {
    let only = match input {
        Input::Path(path) if path.is_dir() => only_recording(path).ok(),
        _ => None,
    };
    let split = only.filter(|only| only.0.len() > 1);
    split.map_or_else(|| vec![input.clone()], |split| split.inputs())
}

/// The only recording in a folder: the folder itself, or one in it.
///
/// # Errors
/// [`Error::UnknownBag`] for a folder without a recording, [`Error::Usage`] for one with several, which lists them.
pub(crate) fn only_recording(folder: &Path) -> Result<Recording> {
    let mut found = recordings(folder)?;
    // If the folder has files of its own, links are not part of the recording.
    let is_link = |one: &Recording| one.0.iter().any(|path| path.is_symlink());
    if found.iter().any(|one| !is_link(one)) {
        found.retain(|one| !is_link(one));
    }
    match &found[..] {
        [] => Err(super::explain(folder, &[], true)),
        [one] => Ok(one.clone()),
        // Other files beside a recording's are reported when it is read.
        [first, ..] if first.0 == [folder] => Ok(first.clone()),
        all => {
            let names: Vec<String> = all.iter().map(|one| one.name_in(folder)).collect();
            let what = format!(
                "`{}` is a folder with {} recordings: {}",
                folder.display(),
                all.len(),
                words::some_of(&names, LISTED)
            );
            let hint = "give one, or all of them for one mission; `bagreel info`, `events` and `tables` take folders of recordings";
            Err(Error::usage(what, hint))
        }
    }
}

/// Every recording below `folder`, sorted by name; the folder itself if it is one.
///
/// # Errors
/// Fails if the folder cannot be read.
pub(crate) fn recordings(folder: &Path) -> Result<Vec<Recording>> {
    let mut bags = Vec::new();
    find(folder, DEEPEST, &mut bags)?;
    let stems = bags.iter().map(|path| path.to_str().and_then(stem));
    let parts = parts(stems.map(Option::unwrap_or_default));
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    let mut whole: Vec<Vec<(u32, &PathBuf)>> = Vec::new();
    for (path, part) in bags.iter().zip(parts) {
        let (name, number) = part.unwrap_or_default();
        let next = whole.len();
        let place = match part {
            Some(_) => *places.entry(name).or_insert(next),
            None => next,
        };
        if place == next {
            whole.push(Vec::new());
        }
        whole[place].push((number, path));
    }
    let ordered = whole.into_iter().map(|mut parts| {
        // By number, of which 10 is after 9.
        parts.sort_unstable();
        Recording(parts.into_iter().map(|(_, path)| path.clone()).collect())
    });
    Ok(ordered.collect())
}

/// The path of a ROS 1 bag without its extension.
fn stem(path: &str) -> Option<&str> {
    path.strip_suffix(".active")
        .unwrap_or(path)
        .strip_suffix(".bag")
}

/// The most recently written file or rosbag2 folder below a folder of which `grows` is true.
pub(crate) fn newest(folder: &Path, grows: impl Fn(&Path) -> bool) -> Option<PathBuf> {
    let found = recordings(folder).ok()?.into_iter();
    let files = found.flat_map(|recording| recording.0).map(|path| {
        // The first file of a rosbag2 recording is followed by others in its folder.
        let own = path
            .parent()
            .filter(|parent| is_growing(parent) && is_storage(&path));
        own.map_or_else(|| path.clone(), Path::to_owned)
    });
    let mut files: Vec<PathBuf> = files.collect();
    files.sort_by_cached_key(|path| std::cmp::Reverse(written(path)));
    files.into_iter().find(|path| grows(path))
}

/// The last time at which a file, or one in a folder, was written.
pub(crate) fn written(path: &Path) -> Option<SystemTime> {
    let inside = fs::read_dir(path).into_iter().flatten().flatten();
    let inside = inside.filter_map(|entry| fs::metadata(entry.path()).ok()?.modified().ok());
    inside.chain(path.metadata().ok()?.modified().ok()).max()
}

/// Adds every recording in `folder`, sorted by name: the folder itself if it is one, otherwise each bag file and the
/// recordings in its subfolders. Links to files are followed (DVC and git-annex store large files that way), and
/// dangling ones count as unreadable bags; links to folders, which may be cyclic, are not followed.
fn find(folder: &Path, deeper: usize, bags: &mut Vec<PathBuf>) -> Result<()> {
    let entries = fs::read_dir(folder).map_err(Error::io("read", folder))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.retain(|path| !is_spare(path));
    paths.sort();
    let own = own_parts(folder, &paths);
    if let Some(parts) = own {
        bags.push(folder.to_owned());
        paths.retain(|path| !parts.contains(path));
    }
    for path in paths {
        let is_own = fs::symlink_metadata(&path).is_ok_and(|meta| !meta.is_symlink());
        let is_gone = !is_own && !path.exists();
        if (path.is_file() && is_bag(&path)) || (is_gone && is_named(&path)) {
            bags.push(path);
        } else if is_own && path.is_dir() && deeper > 0 {
            // An unreadable subfolder hides only its own bags.
            let _ = find(&path, deeper - 1, bags);
        }
    }
    Ok(())
}

/// The endings of recordings that are compressed as a whole.
const PACKED: [&str; 2] = [".zstd", ".zst"];

/// Whether a file is not read because its recording is beside it too, compressed or not: recorders remove the original
/// after compressing it, and players leave the one that they decompressed. The compressed one is not needed unless the
/// other is shorter than it states.
pub(crate) fn is_spare(path: &Path) -> bool {
    let is_short = |plain: &Path, packed: &Path| {
        let stated = stated(packed);
        let len = plain.metadata().map_or(0, |meta| meta.len());
        stated.is_some_and(|stated| len < stated)
    };
    let plain = plain(path);
    if plain != path {
        return plain.is_file() && !is_short(&plain, path);
    }
    let mut packed = PACKED.iter().map(|end| with_suffix(path, end));
    packed.any(|packed| packed.is_file() && is_short(path, &packed))
}

/// The path of a recording without the ending for compression as a whole.
pub(crate) fn plain(path: &Path) -> PathBuf {
    let is_packed = PACKED.iter().any(|end| ends_in(path, end));
    if is_packed {
        path.with_extension("")
    } else {
        path.to_owned()
    }
}

/// The length of the recording in a compressed file, if the file states it.
fn stated(packed: &Path) -> Option<u64> {
    let mut head = [0; ZSTD_HEAD];
    let got = FileSource::open(packed).ok()?.read_at(0, &mut head).ok()?;
    zstd_stated(&head[..got])
}

/// Whether a folder is one rosbag2 recording, even if its `metadata.yaml` is not written yet: all of its storage files
/// are parts of one name.
pub(crate) fn is_growing(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    let storage = paths.iter().filter(|path| is_storage(path));
    let stems: Option<BTreeSet<String>> = storage.map(|path| numbered(path)).collect();
    stems.is_some_and(|stems| stems.len() == 1) || folder.join("metadata.yaml").is_file()
}

/// Whether a file has the name of a storage file.
pub(super) fn is_storage(path: &Path) -> bool {
    let mut endings = ["db3", "mcap", "db3.zstd", "mcap.zstd"].into_iter();
    endings.any(|ending| ends_in(path, ending))
}

/// The longest `metadata.yaml` that is searched for names, in bytes.
const MOST_METADATA: u64 = 16 << 20;

/// The files that make `folder` one rosbag2 recording: those that its `metadata.yaml` lists, or all storage files if
/// none of those exists. Without metadata, numbered parts of one name with no other storage file beside them.
fn own_parts(folder: &Path, paths: &[PathBuf]) -> Option<Vec<PathBuf>> {
    let storage = paths.iter().filter(|path| is_storage(path));
    let storage: Vec<PathBuf> = storage.cloned().collect();
    let metadata = folder.join("metadata.yaml");
    if metadata.is_file() {
        let is_short = metadata.metadata().is_ok_and(|m| m.len() <= MOST_METADATA);
        let bytes = is_short.then(|| fs::read(&metadata).ok()).flatten();
        let bytes = bytes.unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        let is_named = |path: &&PathBuf| {
            let name = file_name(path);
            text.contains(name.trim_end_matches(".zstd"))
        };
        let named: Vec<PathBuf> = storage.iter().filter(is_named).cloned().collect();
        return Some(if named.is_empty() { storage } else { named });
    }
    let stems: Option<Vec<String>> = storage.iter().map(|path| numbered(path)).collect();
    let mut stems = stems?;
    stems.dedup();
    (storage.len() > 1 && stems.len() == 1).then_some(storage)
}

/// The name of a recording of which this is a part: `run` of `run_0.db3`; `None` without a number.
fn numbered(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let (stem, number) = name.split('.').next()?.rsplit_once('_')?;
    let is_number = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
    is_number.then(|| stem.to_owned())
}

/// Whether a path is a bag by its first bytes or its extension: a broken bag gets a row too.
fn is_bag(path: &Path) -> bool {
    let kind = || super::sniff(&Input::Path(path.to_owned()));
    is_named(path) || matches!(kind(), Ok(InputKind::Bag(_)))
}

fn is_named(path: &Path) -> bool {
    let mut endings = super::FORMATS.iter().flat_map(|format| format.extensions);
    endings.any(|ending| ends_in(path, ending))
}

fn ends_in(path: &Path, extension: &str) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.to_lowercase()
        .ends_with(&format!(".{}", extension.trim_start_matches('.')))
}

// The parts of a recording that `rosbag record --split` writes, recognized by their names: `run_2024-05-03-14-03-22_0`,
// `run_2024-05-03-14-08-22_1`, …, each with the date at which it begins.

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

    #[test]
    fn storage_files_are_known_by_their_names() {
        let is = |name: &str| is_storage(Path::new(name));
        assert!(["run_0.db3", "RUN_0.MCAP", "a/run_0.mcap.zstd"].map(is) == [true; 3]);
        // A compressed ROS 1 bag is no part of a rosbag2 folder.
        assert!(["run_0.bag.zstd", "metadata.yaml", "db3"].map(is) == [false; 3]);
    }

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
