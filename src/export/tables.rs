//! The mission as tidy tables in CSV or Parquet, from one description of their contents.
//!
//! Column names are in snake case and not reserved in any SQL dialect; an empty cell is unknown.

pub(crate) mod folder;
mod mission;
pub(crate) mod writer;

use std::io::Write as _;

use super::{Started, Written, at_end};
use crate::base::error::{Error, Result};
use crate::base::table::{Batch, TableCell};
use crate::export::sequence::Sequence;
use crate::export::sink::OutputSink;
use crate::export::target::{Target, is_special};
use crate::mission::Mission;
use mission::{RowTaker, TABLES, Table};
pub use writer::TableFormat;
use writer::begin;

/// Checks whether several files can be derived from this name.
///
/// # Errors
/// [`Error::Usage`] for standard output, devices, and a name with `{n}`.
pub(crate) fn check(target: &Target) -> Result<()> {
    let what = match target {
        Target::Stdout => "standard output is one".to_owned(),
        Target::Path(path) if is_special(path) => format!("`{}` is one", path.display()),
        Target::Path(_) => return target.must_be_one("the tables contain all windows"),
    };
    Err(Error::usage(
        format!("the tables are several files, {what}"),
        "give a file: `-o x.csv` writes `x.edges.csv` and others",
    ))
}

/// The files of all tables in the format of this name.
pub(crate) fn files(target: &Target, word: &str) -> Vec<Target> {
    let file = |table: &Table| target.with_word(table.word, word);
    TABLES.iter().map(file).collect()
}

/// Begins the tables.
///
/// # Errors
/// As [`check`].
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
    format: TableFormat,
) -> Started<'a> {
    check(target)?;
    let target = target.clone();
    Ok(at_end(move || {
        let each = TABLES.iter().zip(files(&target, format.word()));
        let write = |(table, file): (&Table, Target)| {
            let rows = |row: RowTaker<'_>| (table.fill)(sequence.data, row);
            write(rows, (table.batch)(), &file, format)
        };
        // All of them are complete before the first one is renamed.
        let mut sinks: Vec<OutputSink> = each.map(write).collect::<Result<_>>()?;
        for sink in &mut sinks {
            sink.flush().map_err(sink.error())?;
        }
        let mut written = Written::to(&target);
        for sink in sinks {
            written.add(sink.commit()?);
        }
        Ok(written)
    }))
}

/// Every table of a mission by name: `edges`, `topics`, `nodes`, `changes`, `events`, `phases`, `bags`.
pub fn of_mission(mission: &Mission) -> Vec<(&'static str, Batch)> {
    let fill = |table: &Table| {
        let mut batch = (table.batch)();
        (table.fill)(mission, &mut |row: &[TableCell<'_>]| batch.push(row));
        (table.word, batch)
    };
    TABLES.iter().map(fill).collect()
}

/// The number of rows buffered before they are written.
const MOST_ROWS: usize = 4096;

fn write(
    rows: impl Fn(RowTaker<'_>),
    mut batch: Batch,
    target: &Target,
    format: TableFormat,
) -> Result<OutputSink> {
    let sink = OutputSink::create(target, None)?;
    let failed = Error::io("write", sink.path());
    let write = || {
        let mut writer = begin(format, sink, &batch, &[])?;
        let mut result = Ok(());
        rows(&mut |row: &[TableCell<'_>]| {
            batch.push(row);
            if batch.rows >= MOST_ROWS && result.is_ok() {
                result = writer.write(&batch);
                batch.clear();
            }
        });
        result?;
        writer.write(&batch)?;
        writer.finish()
    };
    write().map_err(failed)
}
