//! The recordings in a folder: a folder of rosbag2 is one, every other bag below is one by itself.

use std::fs;
use std::path::{Path, PathBuf};

use super::InputKind;
use super::input::{Input, file_name};
use crate::base::error::{Error, Result};
use crate::base::words;

/// The depth below the folder to which bags are searched.
const DEEPEST: usize = 16;
/// The most recordings that an error lists.
const LISTED: usize = 8;

/// The only recording in a folder: the folder itself, or one bag in it.
///
/// # Errors
/// [`Error::UnknownBag`] for a folder without a recording, [`Error::Usage`] for one with several, which lists them.
pub(crate) fn only_recording(folder: &Path) -> Result<PathBuf> {
    let mut found = recordings(folder)?;
    // Beside files of the folder's own, links are no parts of a recording.
    if found.iter().any(|path| !path.is_symlink()) {
        found.retain(|path| !path.is_symlink());
    }
    match &found[..] {
        [] => Err(super::explain(folder, &[], true)),
        [one] => Ok(one.clone()),
        // What lies beside the files of a recording is told when it is read.
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
            let hint = "name one, or all of them for one mission; `bagreel info` and `bagreel tables` take folders of recordings";
            Err(Error::usage(what, hint))
        }
    }
}

/// Every recording below `folder`, a path each, in order of names; the folder itself where it is one.
///
/// # Errors
/// If the folder cannot be read.
pub(crate) fn recordings(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut bags = Vec::new();
    find(folder, DEEPEST, &mut bags)?;
    Ok(bags)
}

/// Adds every recording in `folder` in order of names: the folder itself where it is one, each other file that is a
/// bag, and those of the folders in it. A link to a file is that file, as tools that keep large files elsewhere leave
/// them (DVC, git-annex), and a bag that cannot be read where that is not there; links to folders, which may lead round,
/// are not followed.
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
            // A folder below that may not be read hides its bags, not the others.
            let _ = find(&path, deeper - 1, bags);
        }
    }
    Ok(())
}

/// Whether a folder has files of rosbag2 of its own, such as those of a recording whose `metadata.yaml` is written at its
/// end.
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

/// The files that make `folder` one recording of rosbag2: those that its `metadata.yaml` names, all storage files if it
/// names none that is there. Without it, numbered parts of one name with no other storage file beside them.
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

/// Whether a path is a bag by its first bytes, or has the ending of one: a broken bag has its row too.
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
