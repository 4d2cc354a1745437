//! The tables as Arrow record batches, for zero-copy exchange.
//!
//! The crate `arrow-array` is part of the public API: a program that uses these batches needs the same version.

use std::sync::Arc;

use super::counts::{Count, FleetBag};
use super::rows::{COUNTS, ROLE, bags_table, counts_table};
use crate::base::error::{Error, Result};
use crate::base::table::{Batch, ColumnValues, TableColumn};
use crate::base::time::{Period, Stamp};
use crate::export::arrow::{from_arrow, to_arrow};
use crate::export::tables::whole;
use crate::mission::Mission;

pub use crate::export::arrow::RecordBatch;

/// The table `counts`.
///
/// # Errors
/// [`Error::Usage`] for texts of more than 2 GB in total.
pub fn counts_batch(counts: &[Count]) -> Result<RecordBatch> {
    to_arrow(&counts_table(counts))
}

/// The table `bags`.
///
/// # Errors
/// As [`counts_batch`].
pub fn bags_batch(bags: &[FleetBag]) -> Result<RecordBatch> {
    to_arrow(&bags_table(bags))
}

/// Every table of a mission by name: `edges`, `topics`, `nodes`, `changes`, `log`, `phases`, `bags`.
///
/// # Errors
/// As [`counts_batch`].
pub fn mission_batches(mission: &Mission) -> Result<Vec<(&'static str, RecordBatch)>> {
    let tables = whole(mission).into_iter();
    tables
        .map(|(word, batch)| Ok((word, to_arrow(&batch)?)))
        .collect()
}

/// The counts in the rows of a table `counts`, written by any program.
///
/// # Errors
/// [`Error::Usage`] for a column that is missing, of another type, or null where a value is required.
pub fn counts_of(batch: &RecordBatch) -> Result<Vec<Count>> {
    // A role is derived from the name, and older tables lack it.
    let columns = COUNTS.iter().filter(|(name, ..)| *name != ROLE);
    let columns: Vec<_> = columns.map(|(name, kind, _)| (*name, *kind)).collect();
    let table = from_arrow(batch, &columns)?;
    (0..table.rows).map(|row| count(&table, row)).collect()
}

fn count(table: &Batch, row: usize) -> Result<Count> {
    let text = |name: &str| text(table, name, row);
    let number = |name: &str| number(table, name, row);
    let need = |name: &str| number(name).ok_or_else(|| missing(name));
    let stamp = |name: &str| number(name).map(Stamp);
    let positive = |name: &str| number(name).and_then(|n| u64::try_from(n).ok());
    let needed = |name: &str| text(name).ok_or_else(|| missing(name));
    Ok(Count {
        mission: needed("mission")?,
        bag: needed("bag")?,
        format: needed("format")?,
        period: Period::from_nanos(need("period_ns")?).ok_or_else(|| missing("period_ns"))?,
        win: need("win")?,
        start: Stamp(need("start_ns")?),
        topic: needed("topic")?,
        type_name: text("type").unwrap_or_default(),
        node: text("node"),
        n: positive("n").ok_or_else(|| missing("n"))?,
        bytes: positive("bytes"),
        first: stamp("first_ns"),
        last: stamp("last_ns"),
        max_gap_ns: number("max_gap_ns"),
    })
}

fn missing(name: &str) -> Error {
    let what = format!("the `{name}` of a row is missing or not valid");
    Error::usage(what, "pass tables as `tables` returned them")
}

fn known<'a>(table: &'a Batch, name: &str, row: usize) -> Option<&'a TableColumn> {
    let column = table.columns.iter().find(|column| column.name == name)?;
    let is_known = column.valid.as_ref().is_none_or(|valid| valid[row]);
    is_known.then_some(column)
}

fn number(table: &Batch, name: &str, row: usize) -> Option<i64> {
    match &known(table, name, row)?.values {
        ColumnValues::I64(numbers) => numbers.get(row).copied(),
        _ => None,
    }
}

fn text(table: &Batch, name: &str, row: usize) -> Option<Arc<str>> {
    match &known(table, name, row)?.values {
        ColumnValues::Texts(texts) => Some(Arc::from(&*String::from_utf8_lossy(texts.get(row)))),
        _ => None,
    }
}
