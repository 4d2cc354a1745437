//! The recordings in a folder: a rosbag2 folder is one recording, and so is every other bag file below it.

use std::fs;
use std::path::{Path, PathBuf};

use super::InputKind;
use super::input::{Input, file_name};
use crate::base::error::{Error, Result};
use crate::base::words;

/// The depth below the folder down to which bags are searched for.
const DEEPEST: usize = 16;
/// The most recordings that an error lists.
const LISTED: usize = 8;

/// The only recording in a folder: the folder itself, or one bag in it.
///
/// # Errors
/// [`Error::UnknownBag`] for a folder without a recording, [`Error::Usage`] for one with several, which lists them.
pub(crate) fn only_recording(folder: &Path) -> Result<PathBuf> {
    let mut found = recordings(folder)?;
    // If the folder has files of its own, links are not part of the recording.
    if found.iter().any(|path| !path.is_symlink()) {
        found.retain(|path| !path.is_symlink());
    }
    match &found[..] {
        [] => Err(super::explain(folder, &[], true)),
        [one] => Ok(one.clone()),
        // Other files beside a recording's are reported when it is read.
        [first, ..] if first == folder => Ok(first.clone()),
        all => {
            let name = |path: &PathBuf| {
                path.strip_prefix(folder)
                    .unwrap_or(path)
                    .display()
                    .to_string()
            };
            let names: Vec<String> = all.iter().map(name).collect();
            let what = format!(
                "`{}` is a folder with {} recordings: {}",
                folder.display(),
                all.len(),
                words::some_of(&names, LISTED)
            );
            let hint = "give one, or all of them for one mission; `bagreel info` and `bagreel tables` take folders of recordings";
            Err(Error::usage(what, hint))
        }
    }
}

/// The path of every recording below `folder`, sorted by name; the folder itself if it is one.
///
/// # Errors
/// Fails if the folder cannot be read.
pub(crate) fn recordings(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut bags = Vec::new();
    find(folder, DEEPEST, &mut bags)?;
    Ok(bags)
}

/// Adds every recording in `folder`, sorted by name: the folder itself if it is one, otherwise each bag file and the
/// recordings in its subfolders. Links to files are followed (DVC and git-annex store large files that way), and
/// dangling ones count as unreadable bags; links to folders, which may be cyclic, are not followed.
fn find(folder: &Path, deeper: usize, bags: &mut Vec<PathBuf>) -> Result<()> {
    let entries = fs::read_dir(folder).map_err(Error::io("read", folder))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
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

/// Whether a folder directly contains rosbag2 storage files, such as those of a recording whose `metadata.yaml` is
/// not written yet.
pub(crate) fn has_storage(folder: &Path) -> bool {
    let mut entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.any(|entry| {
        let path = entry.path();
        file_name(&path) == "metadata.yaml" || is_storage(&path)
    })
}

fn is_storage(path: &Path) -> bool {
    [".db3", ".mcap", ".zstd"].iter().any(|e| ends_in(path, e))
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
        let text = if is_short {
            fs::read(&metadata)
        } else {
            Ok(Vec::new())
        };
        let text = String::from_utf8_lossy(&text.unwrap_or_default()).into_owned();
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
    is_named(path)
        || matches!(
            super::sniff(&Input::Path(path.to_owned())),
            Ok(InputKind::Bag(_))
        )
}

fn is_named(path: &Path) -> bool {
    let mut endings = super::FORMATS.iter().flat_map(|format| format.extensions);
    endings.any(|ending| ends_in(path, ending))
}

fn ends_in(path: &Path, extension: &str) -> bool {
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    name.ends_with(&format!(".{}", extension.trim_start_matches('.')))
}
