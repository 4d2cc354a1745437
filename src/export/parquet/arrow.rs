//! A table in memory as an Arrow record batch, for programs that share our memory; and rows of one taken back.

pub use arrow_array::RecordBatch;
use arrow_array::cast::AsArray as _;
use arrow_array::types::Int64Type;
use arrow_array::{Array as _, ArrayRef};

use super::record_batch;
use crate::base::error::{Error, Result};
use crate::base::table::{Batch, ColumnKind, TableCell};

/// All rows of `batch`.
///
/// # Errors
/// [`Error::Usage`] if they do not fit Arrow's columns of texts, 2 GB each.
pub(crate) fn to_arrow(batch: &Batch) -> Result<RecordBatch> {
    record_batch(batch).map_err(|e| Error::usage(format!("no Arrow table can be made: {e}"), ""))
}

/// The rows of `from`, whose columns of these names hold texts and whole numbers.
///
/// # Errors
/// [`Error::Usage`] for a column that is missing or of another type.
pub(crate) fn from_arrow(
    from: &RecordBatch,
    columns: &[(&'static str, ColumnKind)],
) -> Result<Batch> {
    let found: Vec<&ArrayRef> = columns
        .iter()
        .map(|(name, kind)| column(from, name, *kind))
        .collect::<Result<_>>()?;
    let mut batch = Batch::new(columns);
    for row in 0..from.num_rows() {
        let cells: Vec<TableCell<'_>> = found.iter().map(|column| cell(column, row)).collect();
        batch.push(&cells);
    }
    Ok(batch)
}

fn column<'a>(from: &'a RecordBatch, name: &str, kind: ColumnKind) -> Result<&'a ArrayRef> {
    let column = from.column_by_name(name);
    let is_right = |column: &&ArrayRef| match kind {
        ColumnKind::Text => is_text(column),
        _ => column.as_primitive_opt::<Int64Type>().is_some(),
    };
    column.filter(is_right).ok_or_else(|| {
        Error::usage(
            format!("the table has no column `{name}` of the right type"),
            "give what `tables` gave: texts, and numbers of 64 bits",
        )
    })
}

/// Whether a column holds texts, in any of Arrow's three layouts.
fn is_text(column: &ArrayRef) -> bool {
    column.as_string_opt::<i32>().is_some()
        || column.as_string_opt::<i64>().is_some()
        || column.as_string_view_opt().is_some()
}

fn cell(column: &ArrayRef, row: usize) -> TableCell<'_> {
    if column.is_null(row) {
        return TableCell::Null;
    }
    if let Some(numbers) = column.as_primitive_opt::<Int64Type>() {
        return TableCell::Int(numbers.value(row));
    }
    let short = column.as_string_opt::<i32>().map(|texts| texts.value(row));
    let long = || column.as_string_opt::<i64>().map(|texts| texts.value(row));
    let view = || column.as_string_view_opt().map(|texts| texts.value(row));
    TableCell::known(short.or_else(long).or_else(view), TableCell::text)
}
