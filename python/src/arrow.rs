//! Tables as Arrow record batches, for zero-copy exchange.

use std::sync::Arc;

use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray,
    TimestampNanosecondArray,
};
use arrow_buffer::{Buffer, NullBuffer, OffsetBuffer, ScalarBuffer};
use arrow_schema::{ArrowError, Field, Schema};
use bagreel::internals::tables::{Batch, ColumnKind, ColumnValues, TableColumn};

/// All rows of a table.
///
/// # Errors
/// If its texts do not fit Arrow's columns, 2 GB each.
pub(crate) fn record_batch(table: Batch) -> Result<RecordBatch, ArrowError> {
    let (mut fields, mut arrays) = (Vec::new(), Vec::new());
    for column in table.columns {
        let (name, is_optional) = (column.name.clone(), column.valid.is_some());
        let array = array(column)?;
        fields.push(Field::new(name, array.data_type().clone(), is_optional));
        arrays.push(array);
    }
    RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays)
}

fn array(column: TableColumn) -> Result<ArrayRef, ArrowError> {
    let known = column.valid.map(NullBuffer::from);
    Ok(match (column.values, column.kind) {
        (ColumnValues::Wholes(v), ColumnKind::FLAG) => {
            let flags: Vec<bool> = v.into_iter().map(|flag| flag != 0).collect();
            Arc::new(BooleanArray::new(flags.into(), known))
        }
        (ColumnValues::Wholes(v), ColumnKind::Time) => {
            Arc::new(TimestampNanosecondArray::new(v.into(), known).with_timezone("UTC"))
        }
        (ColumnValues::Wholes(v), _) => Arc::new(Int64Array::new(v.into(), known)),
        (ColumnValues::Floats(v), _) => Arc::new(Float64Array::new(v.into(), known)),
        (ColumnValues::Texts(v), _) => {
            let ends: Vec<i32> = std::iter::once(0).chain(v.ends).collect();
            let ends = OffsetBuffer::new(ScalarBuffer::from(ends));
            Arc::new(StringArray::try_new(
                ends,
                Buffer::from_vec(v.bytes),
                known,
            )?)
        }
        // Only the table of messages has one, which is a file.
        (ColumnValues::Words(_), _) => {
            let what = format!("the column `{}` of recurring texts", column.name);
            return Err(ArrowError::NotYetImplemented(what));
        }
    })
}
