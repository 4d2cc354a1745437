//! Tables as Arrow record batches for zero-copy exchange.

use std::sync::Arc;

pub use arrow_array::RecordBatch;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{
    Array as _, ArrayRef, ArrowPrimitiveType, BinaryArray, BooleanArray, DictionaryArray,
    ListArray, PrimitiveArray, StringArray, TimestampNanosecondArray,
};
use arrow_buffer::{Buffer, NullBuffer, OffsetBuffer, ScalarBuffer};
use arrow_schema::{DataType, Field, Schema};

use crate::base::error::{Error, Result};
use crate::base::table::{Batch, ColumnKind, ColumnValues, TableColumn, TextColumn};

/// All rows of `batch`.
///
/// # Errors
/// [`Error::Usage`] if they do not fit Arrow's columns of texts, 2 GB each.
pub(crate) fn to_arrow(batch: &Batch) -> Result<RecordBatch> {
    record_batch(batch).map_err(|e| Error::usage(format!("no Arrow table can be made: {e}"), ""))
}

/// All rows of `batch`; words stay in their dictionary.
fn record_batch(batch: &Batch) -> ArrowResult<RecordBatch> {
    let columns: Vec<ArrayRef> = batch.columns.iter().map(array).collect::<Result<_, _>>()?;
    let fields = batch.columns.iter().zip(&columns);
    let fields = fields.map(|(column, array)| {
        let kind = array.data_type().clone();
        Field::new(column.name.as_ref(), kind, column.valid.is_some())
    });
    RecordBatch::try_new(Arc::new(Schema::new(fields.collect::<Vec<_>>())), columns)
}

fn element(kind: DataType) -> Arc<Field> {
    Arc::new(Field::new("element", kind, false))
}

type ArrowResult<T> = Result<T, arrow_schema::ArrowError>;

fn array(column: &TableColumn) -> ArrowResult<ArrayRef> {
    let mut array = values(column)?;
    for ends in column.lists.iter().rev() {
        let kind = element(array.data_type().clone());
        array = Arc::new(ListArray::try_new(kind, offsets(ends), array, None)?);
    }
    Ok(array)
}

fn values(column: &TableColumn) -> ArrowResult<ArrayRef> {
    let known = column.valid.clone().map(NullBuffer::from);
    Ok(match (&column.values, column.kind) {
        (ColumnValues::Flag(v), _) => Arc::new(BooleanArray::new(v.clone().into(), known)),
        (ColumnValues::I64(v), ColumnKind::Time) => {
            Arc::new(TimestampNanosecondArray::new(v.clone().into(), known).with_timezone("UTC"))
        }
        (ColumnValues::I8(v), _) => numbers::<Int8Type>(v, known),
        (ColumnValues::U8(v), _) => numbers::<UInt8Type>(v, known),
        (ColumnValues::I16(v), _) => numbers::<Int16Type>(v, known),
        (ColumnValues::U16(v), _) => numbers::<UInt16Type>(v, known),
        (ColumnValues::I32(v), _) => numbers::<Int32Type>(v, known),
        (ColumnValues::U32(v), _) => numbers::<UInt32Type>(v, known),
        (ColumnValues::I64(v), _) => numbers::<Int64Type>(v, known),
        (ColumnValues::U64(v), _) => numbers::<UInt64Type>(v, known),
        (ColumnValues::F32(v), _) => numbers::<Float32Type>(v, known),
        (ColumnValues::F64(v), _) => numbers::<Float64Type>(v, known),
        (ColumnValues::Texts(v), ColumnKind::Bytes) => {
            Arc::new(BinaryArray::try_new(offsets(&v.ends), held(v), known)?)
        }
        (ColumnValues::Texts(v), _) => Arc::new(strings(v, known)?),
        (ColumnValues::Words(v), _) => {
            let numbers = PrimitiveArray::<UInt32Type>::new(v.numbers.clone().into(), known);
            let words = Arc::new(strings(&v.words, None)?);
            Arc::new(DictionaryArray::try_new(numbers, words)?)
        }
    })
}

fn numbers<T: ArrowPrimitiveType>(values: &[T::Native], known: Option<NullBuffer>) -> ArrayRef {
    Arc::new(PrimitiveArray::<T>::new(values.to_vec().into(), known))
}

fn strings(texts: &TextColumn, known: Option<NullBuffer>) -> ArrowResult<StringArray> {
    StringArray::try_new(offsets(&texts.ends), held(texts), known)
}

fn held(texts: &TextColumn) -> Buffer {
    Buffer::from_slice_ref(&texts.bytes)
}

/// The ends as Arrow offsets, which begin with 0.
fn offsets(ends: &[i32]) -> OffsetBuffer<i32> {
    let all: Vec<i32> = std::iter::once(0).chain(ends.iter().copied()).collect();
    OffsetBuffer::new(ScalarBuffer::from(all))
}
