//! Reads every bag below a folder one by one, for a survey.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::collect::NOTHING_RECORDED;
use super::{Reading, Watch, read};
use crate::bag::{self, Input, Recording};
use crate::base::error::{Error, Result};
use crate::export::tables::{TableFormat, writer};
use crate::mission::Mission;
use crate::mission::info::{SurveyRow, survey_table};

/// The rows of a survey as a file of this format.
///
/// # Errors
/// If the format cannot represent them.
pub fn survey_file(rows: &[SurveyRow], format: TableFormat) -> Result<Vec<u8>> {
    writer::whole(format, &survey_table(rows))
}

/// Whether `input` is a folder of bags rather than one recording.
pub fn is_survey(input: &Input) -> bool {
    let Input::Path(path) = input else {
        return false;
    };
    let is_one = |found: Vec<Recording>| found.len() == 1;
    path.is_dir() && !bag::recordings(path).is_ok_and(is_one)
}

/// The survey of the bags below a folder.
pub struct Survey {
    /// One row per bag, sorted by path; the row of an unreadable bag has the reason.
    pub rows: Vec<SurveyRow>,
    /// Whether any data was skipped.
    pub skipped: bool,
}

/// Reads every bag below `folder`.
///
/// # Errors
/// If the folder itself cannot be read or contains no bag.
pub fn survey(folder: &Path, reading: &Reading, watch: &mut dyn Watch) -> Result<Survey> {
    let bags = recordings(folder)?;
    let mut skipped = false;
    let row = |recording: Recording| {
        let one = Reading {
            inputs: recording.inputs(),
            ..reading.clone()
        };
        let shown = recording.name_in(folder);
        let read = alone(&shown, || read(&one, watch));
        let row = surveyed(shown, size(&one.inputs), read);
        skipped |= !row.is_complete;
        row
    };
    let rows = bags.into_iter().map(row).collect();
    Ok(Survey { rows, skipped })
}

/// The result of reading one bag; if bagreel fails at it, the error of this bag alone. The panic was printed.
fn alone<T>(bag: &str, read: impl FnOnce() -> Result<T>) -> Result<T> {
    let failed = |_| Err(Error::unsupported(bag, "a fault of bagreel: report it", ""));
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(failed)
}

/// Every recording below a folder.
///
/// # Errors
/// If it cannot be read or contains no bag.
pub(super) fn recordings(folder: &Path) -> Result<Vec<Recording>> {
    let bags = bag::recordings(folder)?;
    if bags.is_empty() {
        return Err(no_bags(folder));
    }
    Ok(bags)
}

/// The error of a folder without bags.
pub(super) fn no_bags(folder: &Path) -> Error {
    Error::UnknownBag {
        path: folder.to_owned(),
        looks_like: "a folder without bags".to_owned(),
        hint: "give a bag, a rosbag2 folder, or a folder with bags below it".to_owned(),
    }
}

/// The size of a recording in bytes, if known.
pub(super) fn size(inputs: &[Input]) -> Option<u64> {
    inputs.iter().map(bag::size_on_disk).sum()
}

/// The row of a bag that was read, or not.
pub(super) fn surveyed(path: String, size: Option<u64>, read: Result<Mission>) -> SurveyRow {
    let row = SurveyRow {
        path,
        file_bytes: size,
        ..SurveyRow::default()
    };
    match read {
        Ok(mission) => SurveyRow::of(row.path, &mission),
        // An empty bag may be intact.
        Err(Error::NoMessages { path, hint }) => SurveyRow {
            is_complete: hint == NOTHING_RECORDED,
            error: Some(format!("`{}` contains no messages: {hint}", path.display())),
            ..row
        },
        Err(error) => SurveyRow {
            error: Some(error.to_string()),
            ..row
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_at_one_bag_is_its_error() {
        let error = alone("run/a.bag", || -> Result<()> { panic!("expected") }).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("run/a.bag") && text.contains("fault"),
            "{text}"
        );
        assert!(alone("b.bag", || Ok(())).is_ok());
    }
}
