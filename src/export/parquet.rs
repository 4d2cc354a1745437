//! Tables as Apache Parquet: one column of Arrow per column, compressed by zstd unless they are small.
//!
//! Stamps are timestamps of nanoseconds in UTC, numbers keep their width, lists are lists.

pub(crate) mod arrow;

use std::io::{self, Write};
use std::sync::Arc;

use ::parquet::arrow::ArrowWriter;
use ::parquet::arrow::arrow_writer::ArrowWriterOptions;
use ::parquet::basic::{Compression, Encoding, ZstdLevel};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesBuilder};
use ::parquet::schema::types::ColumnPath;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{
    ArrayRef, ArrowPrimitiveType, BinaryArray, BooleanArray, DictionaryArray, ListArray,
    PrimitiveArray, RecordBatch, StringArray, TimestampNanosecondArray,
};
use arrow_buffer::{Buffer, NullBuffer, OffsetBuffer, ScalarBuffer};
use arrow_schema::{DataType, Field, Schema, TimeUnit};

use crate::base::table::{Batch, ColumnKind, ColumnValues, TableColumn, TextColumn};

/// The largest number of rows in a group: its columns are held in memory, packed, until it is written.
const MOST_ROWS: usize = 1 << 20;
/// The number of bytes of packed columns held in memory before their group is written.
const MOST_HELD: usize = 16 << 20;

/// A table of fewer rows than this is not compressed, and is written in one page per column, of which nothing is said
/// beyond what is said of the column: to set up zstd for every column takes longer than to count a bag, and saves an
/// eighth of the bytes.
const FEW_ROWS: usize = 1024;

/// A table being written.
pub(crate) struct Rows<W: Write + Send> {
    writer: ArrowWriter<W>,
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
        let properties = WriterProperties::builder()
            .set_max_row_group_row_count(Some(MOST_ROWS))
            .set_created_by("bagreel".to_owned())
            .set_key_value_metadata(Some(facts.collect()));
        let properties = if (1..FEW_ROWS).contains(&batch.rows) {
            properties
                .set_statistics_enabled(EnabledStatistics::Chunk)
                .set_offset_index_disabled(true)
        } else {
            properties.set_compression(Compression::ZSTD(ZstdLevel::default()))
        };
        // A dictionary of one value is longer than the value.
        let properties = properties.set_dictionary_enabled(batch.rows != 1);
        let properties = batch.columns.iter().fold(properties, encoded).build();
        // Parquet's own types tell all that our columns are.
        let options = ArrowWriterOptions::new()
            .with_properties(properties)
            .with_skip_arrow_metadata(true);
        let writer = ArrowWriter::try_new_with_options(to, schema, options);
        Ok(Self {
            writer: writer.map_err(io::Error::other)?,
        })
    }

    /// Writes all rows of `batch`.
    pub(crate) fn write(&mut self, batch: &Batch) -> io::Result<()> {
        if batch.rows == 0 {
            return Ok(());
        }
        let rows = record_batch(batch).map_err(io::Error::other)?;
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

/// Chooses how a column is written where the usual way, a dictionary of its values, does not fit it.
fn encoded(properties: WriterPropertiesBuilder, column: &TableColumn) -> WriterPropertiesBuilder {
    let path = || ColumnPath::from(column.name.as_ref());
    match &column.values {
        // Times and counts differ little from row to row and are seldom equal; they stand as differences, which every
        // reader of Parquet 2 knows.
        ColumnValues::I64(_) if column.lists.is_empty() => properties
            .set_column_dictionary_enabled(path(), false)
            .set_column_encoding(path(), Encoding::DELTA_BINARY_PACKED),
        // The smallest and the largest word of a group of rows in order of time let no reader skip one.
        ColumnValues::Words(_) => {
            properties.set_column_statistics_enabled(path(), EnabledStatistics::None)
        }
        _ => properties,
    }
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

/// A column as the file has it.
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

/// The ends as Arrow has them: with the 0 at which the first begins.
fn offsets(ends: &[i32]) -> OffsetBuffer<i32> {
    let all: Vec<i32> = std::iter::once(0).chain(ends.iter().copied()).collect();
    OffsetBuffer::new(ScalarBuffer::from(all))
}
