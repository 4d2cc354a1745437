//! Reads every bag below a folder one by one, for a survey.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::collect::NOTHING_RECORDED;
use super::{Reading, Watch, read};
use crate::bag::{self, Input, Recording};
use crate::base::error::{Error, Fault, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::export::tables::{self, TableFormat};
use crate::mission::Mission;
use crate::mission::info::{SurveyRow, survey_table};

/// The rows of a survey as a file of this format.
///
/// # Errors
/// If the format cannot represent them.
pub fn survey_file(rows: &[SurveyRow], format: TableFormat) -> Result<Vec<u8>> {
    tables::whole(format, &survey_table(rows))
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
    let rows: Vec<SurveyRow> = each(folder, reading, watch)?.map(row).collect();
    let skipped = rows.iter().any(|row| !row.is_complete);
    Ok(Survey { rows, skipped })
}

fn row(one: FolderBag) -> SurveyRow {
    match one.mission {
        Ok(mission) => SurveyRow::of(one.name, &mission),
        Err(unread) => SurveyRow {
            path: one.name,
            file_bytes: one.file_bytes,
            is_complete: !unread.kind.is_loss(),
            error: Some(unread.text),
            ..SurveyRow::default()
        },
    }
}

/// A recording in a folder.
pub(crate) struct FolderBag {
    /// Its name relative to the folder.
    pub(crate) name: String,
    /// Its size in bytes, if known.
    file_bytes: Option<u64>,
    /// The mission, or why there is none.
    pub(crate) mission: Result<Mission, Notice>,
}

/// Every recording below `folder`, sorted by path, each read when its turn comes.
///
/// # Errors
/// If the folder itself cannot be read or contains no bag.
pub(crate) fn each<'a>(
    folder: &'a Path,
    reading: &'a Reading,
    watch: &'a mut dyn Watch,
) -> Result<impl Iterator<Item = FolderBag> + use<'a>> {
    let bags = recordings(folder)?.into_iter();
    Ok(bags.map_while(move |recording| {
        let reading = Reading {
            inputs: recording.inputs(),
            ..reading.clone()
        };
        let name = recording.name_in(folder);
        let mission = alone(&name, || read(&reading, watch));
        (!watch.stopped()).then(|| FolderBag {
            name,
            file_bytes: reading.inputs.iter().map(bag::size_on_disk).sum(),
            mission: mission.map_err(unread),
        })
    }))
}

/// Why there is no mission of a recording. Data is lost, but an empty bag may be intact.
fn unread(error: Error) -> Notice {
    match error {
        Error::NoMessages(Fault { what, hint }) if hint == NOTHING_RECORDED => {
            Notice::new(NoticeKind::Note, format!("{what}: {hint}"))
        }
        Error::NoMessages(Fault { what, hint }) => {
            Notice::new(NoticeKind::Damaged, format!("{what}: {hint}"))
        }
        error => Notice::new(NoticeKind::Damaged, error.to_string()),
    }
}

/// The result of reading one bag; if bagreel fails at it, the error of this bag alone. The panic was printed.
pub(super) fn alone<T>(bag: &str, read: impl FnOnce() -> Result<T>) -> Result<T> {
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
        let hint = "give a bag, a rosbag2 folder, or a folder with bags below it";
        return Err(Error::unknown_bag(folder, "a folder without bags", hint));
    }
    Ok(bags)
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
