//! Tables as Apache Parquet: one column of Arrow per column, compressed by zstd unless they are small.
//!
//! Stamps are timestamps of nanoseconds in UTC, numbers keep their width, lists are lists.

pub(crate) mod arrow;

use std::io::{self, Write};
use std::sync::Arc;

use ::parquet::arrow::ArrowWriter;
use ::parquet::arrow::arrow_writer::ArrowWriterOptions;
use ::parquet::basic::{Compression, ZstdLevel};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{
    ArrayRef, ArrowPrimitiveType, BinaryArray, BooleanArray, ListArray, PrimitiveArray,
    RecordBatch, StringArray, TimestampNanosecondArray,
};
use arrow_buffer::{Buffer, NullBuffer, OffsetBuffer, ScalarBuffer};
use arrow_schema::{DataType, Field, Schema, TimeUnit};

use crate::base::table::{Batch, ColumnKind, ColumnValues, TableColumn, TextColumn};

/// The largest number of rows in a group: its columns are held in memory, packed, until it is written.
const MOST_ROWS: usize = 1 << 20;
/// The number of bytes of packed columns held in memory before their group is written.
const MOST_HELD: usize = 16 << 20;

/// A table of fewer rows than this is not compressed: to set up zstd for every column takes longer than to count a bag,
/// and saves an eighth of the bytes.
const FEW_ROWS: usize = 1024;

/// A table being written.
pub(crate) struct Rows<W: Write + Send> {
    writer: ArrowWriter<W>,
    schema: Arc<Schema>,
}

impl<W: Write + Send> Rows<W> {
    /// Begins a table with the columns of `batch`, which holds all rows or none yet; `facts` are kept in the file's
    /// metadata.
    pub(crate) fn new(to: W, batch: &Batch, facts: &[(&str, &str)]) -> io::Result<Self> {
        let schema = Arc::new(Schema::new(
            batch.columns.iter().map(field).collect::<Vec<_>>(),
        ));
        let facts = facts
            .iter()
            .map(|(key, value)| KeyValue::new((*key).to_owned(), (*value).to_owned()));
        let compression = if (1..FEW_ROWS).contains(&batch.rows) {
            Compression::UNCOMPRESSED
        } else {
            Compression::ZSTD(ZstdLevel::default())
        };
        let properties = WriterProperties::builder()
            .set_compression(compression)
            .set_max_row_group_row_count(Some(MOST_ROWS))
            .set_created_by("bagreel".to_owned())
            .set_key_value_metadata(Some(facts.collect()))
            .build();
        let options = ArrowWriterOptions::new().with_properties(properties);
        let writer = ArrowWriter::try_new_with_options(to, Arc::clone(&schema), options);
        Ok(Self {
            writer: writer.map_err(io::Error::other)?,
            schema,
        })
    }

    /// Writes all rows of `batch`.
    pub(crate) fn write(&mut self, batch: &Batch) -> io::Result<()> {
        if batch.rows == 0 {
            return Ok(());
        }
        let columns = batch.columns.iter().map(array).collect::<Result<_, _>>();
        let rows = columns.and_then(|c| RecordBatch::try_new(Arc::clone(&self.schema), c));
        let rows = rows.map_err(io::Error::other)?;
        self.writer.write(&rows).map_err(io::Error::other)?;
        if self.held() > MOST_HELD {
            self.unload()?;
        }
        Ok(())
    }

    /// The number of bytes of packed columns that it holds in memory.
    pub(crate) fn held(&self) -> usize {
        self.writer.in_progress_size()
    }

    /// Ends the group of rows that is held in memory.
    pub(crate) fn unload(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(io::Error::other)
    }

    /// Ends the table.
    pub(crate) fn finish(self) -> io::Result<W> {
        self.writer.into_inner().map_err(io::Error::other)
    }
}

fn field(column: &TableColumn) -> Field {
    let mut kind = data_type(column.kind);
    for _ in &column.lists {
        kind = DataType::List(element(kind));
    }
    Field::new(column.name.as_ref(), kind, column.valid.is_some())
}

fn element(kind: DataType) -> Arc<Field> {
    Arc::new(Field::new("element", kind, false))
}

fn data_type(kind: ColumnKind) -> DataType {
    match kind {
        ColumnKind::Flag => DataType::Boolean,
        ColumnKind::I8 => DataType::Int8,
        ColumnKind::U8 => DataType::UInt8,
        ColumnKind::I16 => DataType::Int16,
        ColumnKind::U16 => DataType::UInt16,
        ColumnKind::I32 => DataType::Int32,
        ColumnKind::U32 => DataType::UInt32,
        ColumnKind::I64 => DataType::Int64,
        ColumnKind::U64 => DataType::UInt64,
        ColumnKind::F32 => DataType::Float32,
        ColumnKind::F64 => DataType::Float64,
        ColumnKind::Text => DataType::Utf8,
        ColumnKind::Bytes => DataType::Binary,
        ColumnKind::Time => DataType::Timestamp(TimeUnit::Nanosecond, Some("UTC".into())),
    }
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
        (ColumnValues::Texts(v), _) => {
            Arc::new(StringArray::try_new(offsets(&v.ends), held(v), known)?)
        }
    })
}

fn numbers<T: ArrowPrimitiveType>(values: &[T::Native], known: Option<NullBuffer>) -> ArrayRef {
    Arc::new(PrimitiveArray::<T>::new(values.to_vec().into(), known))
}

fn held(texts: &TextColumn) -> Buffer {
    Buffer::from_slice_ref(&texts.bytes)
}

/// The ends as Arrow has them: with the 0 at which the first begins.
fn offsets(ends: &[i32]) -> OffsetBuffer<i32> {
    let all: Vec<i32> = std::iter::once(0).chain(ends.iter().copied()).collect();
    OffsetBuffer::new(ScalarBuffer::from(all))
}
