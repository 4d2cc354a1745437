//! Reads every bag below a folder, one after another, for a survey.

use std::fs;
use std::path::{Path, PathBuf};

use super::collect::NOTHING_RECORDED;
use super::{Reading, Watch, read};
use crate::bag::{self, Input, InputKind};
use crate::base::error::{Error, Result};
use crate::export::tables::{TableFormat, writer};
use crate::mission::Mission;
use crate::mission::info::{SurveyRow, survey_table};

/// The rows of a survey as a file of this format.
///
/// # Errors
/// If the format cannot hold them.
pub fn survey_file(rows: &[SurveyRow], format: TableFormat) -> Result<Vec<u8>> {
    writer::whole(format, &survey_table(rows))
}

/// The depth below the folder to which bags are searched.
const DEEPEST: usize = 16;

/// Whether `input` is a folder of bags, and not one recording with nothing beside it.
pub fn is_survey(input: &Input) -> bool {
    let Input::Path(path) = input else {
        return false;
    };
    let mut bags = Vec::new();
    if !path.is_dir() || find(path, DEEPEST, &mut bags).is_err() {
        return false;
    }
    let is_one = match &bags[..] {
        [one] => one == path || one.parent() == Some(path) && bag::sniff(input).is_ok(),
        _ => false,
    };
    !is_one
}

/// The survey of the bags below a folder.
pub struct Survey {
    /// One row per bag, sorted by path; a bag that cannot be read has a row that says why.
    pub rows: Vec<SurveyRow>,
    /// Whether data of some bag was skipped, or all of it.
    pub skipped: bool,
}

/// Reads every bag below `folder`.
///
/// # Errors
/// If the folder itself cannot be read or holds no bag.
pub fn survey(folder: &Path, reading: &Reading, watch: &mut dyn Watch) -> Result<Survey> {
    let bags = recordings(folder)?;
    if bags.is_empty() {
        let hint = "give a bag, a rosbag2 folder, or a folder with bags below it".to_owned();
        return Err(Error::UnknownBag {
            path: folder.to_owned(),
            looks_like: "a folder without bags".to_owned(),
            hint,
        });
    }
    let mut skipped = false;
    let row = |path: PathBuf| {
        let shown = match path.strip_prefix(folder).unwrap_or(&path) {
            own if own == Path::new("") => ".".to_owned(),
            below => below.display().to_string(),
        };
        let input = Input::Path(path);
        let size = bag::size_on_disk(&input);
        let one = Reading {
            inputs: vec![input],
            ..reading.clone()
        };
        let row = surveyed(shown, size, read(&one, watch));
        skipped |= !row.is_complete;
        row
    };
    let rows = bags.into_iter().map(row).collect();
    Ok(Survey { rows, skipped })
}

/// The row of a bag that was read, or not.
fn surveyed(path: String, size: Option<u64>, read: Result<Mission>) -> SurveyRow {
    let row = SurveyRow {
        path,
        file_bytes: size,
        ..SurveyRow::default()
    };
    match read {
        Ok(mission) => SurveyRow::of(row.path, &mission),
        // An empty bag may be a whole one.
        Err(Error::NoMessages { path, hint }) => SurveyRow {
            is_complete: hint == NOTHING_RECORDED,
            error: Some(format!("`{}` holds no messages: {hint}", path.display())),
            ..row
        },
        Err(error) => SurveyRow {
            error: Some(error.to_string()),
            ..row
        },
    }
}

/// Every recording below `folder`, a path each, in order of names; the folder itself where it is one.
///
/// # Errors
/// If the folder cannot be read.
pub(super) fn recordings(folder: &Path) -> Result<Vec<PathBuf>> {
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

/// The longest `metadata.yaml` that is searched for names, in bytes.
const MOST_METADATA: u64 = 16 << 20;

/// The files that make `folder` one recording of rosbag2: those that its `metadata.yaml` names, all storage files if it
/// names none that is there. Without it, numbered parts of one name with no other storage file beside them.
fn own_parts(folder: &Path, paths: &[PathBuf]) -> Option<Vec<PathBuf>> {
    let storage = |path: &&PathBuf| [".db3", ".mcap", ".zstd"].iter().any(|e| ends_in(path, e));
    let storage: Vec<PathBuf> = paths.iter().filter(storage).cloned().collect();
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
            let name = bag::file_name(path);
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
            bag::sniff(&Input::Path(path.to_owned())),
            Ok(InputKind::Bag(_))
        )
}

fn is_named(path: &Path) -> bool {
    let mut endings = bag::FORMATS.iter().flat_map(|format| format.extensions);
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
