//! The mission as tidy tables, as CSV or Parquet: one description of their content, two ways to write it.
//!
//! Column names are in snake case and reserved in no dialect of SQL; an empty cell is unknown.

pub(crate) mod folder;
mod mission;
mod seen;
pub(crate) mod writer;

use std::io::Write as _;

use super::{Encoder, Written};
use crate::base::error::{Error, Result};
use crate::base::table::{Batch, TableCell};
use crate::export::sequence::Sequence;
use crate::export::sink::OutputSink;
use crate::export::target::{Target, is_special};
use crate::mission::Mission;
use mission::{RowTaker, TABLES, Table};
pub(crate) use writer::TableFormat;
use writer::Writer;

struct TablesEncoder<'a> {
    mission: &'a Mission,
    target: Target,
    format: TableFormat,
    has_runs: bool,
}

/// Begins the tables as CSV.
///
/// # Errors
/// As [`check`].
pub(crate) fn start_csv<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    start(sequence, target, TableFormat::Csv)
}

/// Begins the tables as Parquet.
///
/// # Errors
/// As [`start_csv`].
#[cfg(feature = "parquet")]
pub(crate) fn start_parquet<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    start(sequence, target, TableFormat::Parquet)
}

/// Whether several files can be made of this name.
///
/// # Errors
/// [`Error::Usage`] for standard output, devices, and a name with `{n}`.
pub(crate) fn check(target: &Target) -> Result<()> {
    let what = match target {
        Target::Stdout => "standard output is one".to_owned(),
        Target::Path(path) if is_special(path) => format!("`{}` is one", path.display()),
        Target::Path(_) => return target.must_be_one("the tables hold all windows"),
    };
    Err(Error::usage(
        format!("the tables are several files, {what}"),
        "name a file: `-o x.csv` writes `x.edges.csv` and others",
    ))
}

/// The files of all tables in the format of this word.
pub(crate) fn files(target: &Target, word: &str) -> Vec<Target> {
    let file = |table: &Table| target.with_word(table.word, word);
    TABLES.iter().map(file).collect()
}

fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
    format: TableFormat,
) -> Result<Box<dyn Encoder + 'a>> {
    check(target)?;
    Ok(Box::new(TablesEncoder {
        mission: sequence.data,
        target: target.clone(),
        format,
        has_runs: sequence.options.has_runs,
    }))
}

impl Encoder for TablesEncoder<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let each = TABLES.iter().zip(files(&self.target, self.format.word()));
        let write = |(table, file): (&Table, Target)| {
            let rows = |row: RowTaker<'_>| (table.fill)(self.mission, self.has_runs, row);
            write(rows, (table.batch)(), &file, self.format)
        };
        // All of them are whole before the first one gets its name.
        let mut sinks: Vec<OutputSink> = each.map(write).collect::<Result<_>>()?;
        for sink in &mut sinks {
            sink.flush().map_err(sink.error())?;
        }
        let mut written = Written::to(&self.target);
        for sink in sinks {
            written.add(sink.commit()?);
        }
        Ok(written)
    }
}

/// Every table of a mission by its word, whole.
#[cfg(feature = "arrow")]
pub(crate) fn whole(mission: &Mission) -> Vec<(&'static str, Batch)> {
    let fill = |table: &Table| {
        let mut batch = (table.batch)();
        (table.fill)(mission, false, &mut |row: &[TableCell<'_>]| batch.push(row));
        (table.word, batch)
    };
    TABLES.iter().map(fill).collect()
}

/// The number of rows that are gathered before they are written.
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
        let mut writer = Writer::new(format, sink, &batch, &[])?;
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
