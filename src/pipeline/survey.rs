//! Reads every bag below a folder, one after another, for a survey.

use std::fs;
use std::path::{Path, PathBuf};

use super::read::NOTHING_RECORDED;
use super::{Reading, Watch, read};
use crate::bag::{self, Input, Kind};
use crate::base::error::{Error, Result};
use crate::mission::info::{SurveyRow, info};

/// How deep below the folder bags are looked for.
const DEEPEST: usize = 16;

/// Whether `input` is a folder that is no bag itself.
pub fn is_survey(input: &Input) -> bool {
    matches!(input, Input::Path(path) if path.is_dir() && bag::sniff(input).is_err())
}

/// What was found of the bags below a folder.
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
    let mut bags = Vec::new();
    find(folder, DEEPEST, &mut bags)?;
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
        let shown = path
            .strip_prefix(folder)
            .unwrap_or(&path)
            .display()
            .to_string();
        let one = Reading {
            inputs: vec![Input::Path(path)],
            ..reading.clone()
        };
        let read = read(&one, watch);
        skipped |= match &read {
            Ok(mission) => mission.notices.any_loss(),
            // An empty bag may be a whole one.
            Err(Error::NoMessages { hint, .. }) => hint != NOTHING_RECORDED,
            Err(_) => true,
        };
        match read {
            Ok(mission) => SurveyRow {
                path: shown,
                error: None,
                info: Some(info(&mission)),
            },
            Err(error) => SurveyRow {
                path: shown,
                error: Some(error.to_string()),
                info: None,
            },
        }
    };
    let rows = bags.into_iter().map(row).collect();
    Ok(Survey { rows, skipped })
}

/// Adds every bag in `folder` in order of names; a folder that is a bag counts as one. Links are not followed.
fn find(folder: &Path, deeper: usize, bags: &mut Vec<PathBuf>) -> Result<()> {
    let entries = fs::read_dir(folder).map_err(Error::io("read", folder))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.sort();
    for path in paths {
        let Ok(meta) = fs::symlink_metadata(&path) else {
            continue;
        };
        let is_bag = (meta.is_file() || meta.is_dir()) && is_bag(&path);
        if is_bag {
            bags.push(path);
        } else if meta.is_dir() && deeper > 0 {
            // A folder below that may not be read hides its bags, not the others.
            let _ = find(&path, deeper - 1, bags);
        }
    }
    Ok(())
}

/// Whether a path is a bag by its first bytes, or calls itself one: a broken bag has its row too.
fn is_bag(path: &Path) -> bool {
    let named = path.is_file()
        && bag::FORMATS
            .iter()
            .flat_map(|f| f.extensions)
            .any(|e| ends_in(path, e));
    named || matches!(bag::sniff(&Input::Path(path.to_owned())), Ok(Kind::Bag(_)))
}

fn ends_in(path: &Path, extension: &str) -> bool {
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    name.ends_with(&format!(".{}", extension.trim_start_matches('.')))
}
