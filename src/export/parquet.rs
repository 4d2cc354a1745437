//! Tables as Apache Parquet, compressed by zstd unless they are small.
//!
//! Stamps are timestamps of nanoseconds in UTC, numbers keep their width, lists are lists of required elements
//! (<https://github.com/apache/parquet-format/blob/master/LogicalTypes.md>).

use std::io::{self, Write};
use std::ops::Range;
use std::sync::Arc;

use ::parquet::basic::{
    Compression, Encoding, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel,
};
use ::parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type,
};
use ::parquet::errors::Result as ParquetResult;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesBuilder};
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{ColumnPath, Type, TypePtr};

use crate::base::cast::to_f32;
use crate::base::table::{
    Batch, ColumnKind, ColumnValues, TableColumn, TableWriter, TextColumn, span,
};

/// The most rows in a group, as in other writers.
const MOST_ROWS: usize = 1 << 20;
/// The number of bytes of values kept in memory before their group is written: a million rows of the message
/// table.
const MOST_HELD: usize = 32 << 20;
/// The number of values passed to the writer at once, so that temporary data stays in the cache.
const AT_ONCE: usize = 1 << 14;

/// A table of fewer rows is not compressed, and has one page per column without page statistics: setting up zstd for
/// every column takes longer than counting a bag, and saves an eighth of the bytes.
const FEW_ROWS: usize = 1024;

/// A table in progress.
pub(crate) struct Rows<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    /// The rows of the group that has not been written yet.
    waiting: Vec<Batch>,
}

impl<W: Write + Send> Rows<W> {
    /// Begins a table with the columns of `batch`, which contains all rows or none yet; `facts` go into the file's
    /// metadata.
    pub(crate) fn new(to: W, batch: &Batch, facts: &[(&str, &str)]) -> io::Result<Self> {
        let facts = facts
            .iter()
            .map(|(key, value)| KeyValue::new((*key).to_owned(), (*value).to_owned()));
        let properties = WriterProperties::builder()
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
        let writer = schema(batch)
            .and_then(|schema| SerializedFileWriter::new(to, schema, Arc::new(properties)));
        Ok(Self {
            writer: writer.map_err(io::Error::other)?,
            waiting: Vec::new(),
        })
    }
}

impl<W: Write + Send> TableWriter<W> for Rows<W> {
    fn write(&mut self, batch: &Batch) -> io::Result<()> {
        if batch.rows == 0 {
            return Ok(());
        }
        let rows: usize = self.waiting.iter().map(|b| b.rows).sum();
        if rows + batch.rows > MOST_ROWS {
            self.unload()?;
        }
        self.waiting.push(batch.clone());
        if self.held() > MOST_HELD {
            self.unload()?;
        }
        Ok(())
    }

    fn held(&self) -> usize {
        self.waiting.iter().map(memory).sum()
    }

    /// Writes the rows in memory as one group.
    fn unload(&mut self) -> io::Result<()> {
        let batches = std::mem::take(&mut self.waiting);
        if batches.is_empty() {
            return Ok(());
        }
        let mut write = || {
            let mut group = self.writer.next_row_group()?;
            let mut at = 0;
            while let Some(mut writer) = group.next_column()? {
                for batch in &batches {
                    column(&mut writer, &batch.columns[at], batch.rows)?;
                }
                writer.close()?;
                at += 1;
            }
            group.close().map(drop)
        };
        write().map_err(io::Error::other)
    }

    fn finish(mut self: Box<Self>) -> io::Result<W> {
        self.unload()?;
        self.writer.into_inner().map_err(io::Error::other)
    }
}

/// The memory used by the values of a batch, in bytes.
fn memory(batch: &Batch) -> usize {
    let columns = batch.columns.iter().map(|column| {
        let ends = column.lists.iter().map(|ends| size_of_val(&ends[..]));
        let valid = column.valid.as_ref().map_or(0, Vec::len);
        let values = match &column.values {
            ColumnValues::Wholes(v) => size_of_val(&v[..]),
            ColumnValues::Floats(v) => size_of_val(&v[..]),
            ColumnValues::Texts(v) => v.bytes.len() + size_of_val(&v.ends[..]),
            ColumnValues::Words(v) => v.words.bytes.len() + size_of_val(&v.numbers[..]),
        };
        ends.sum::<usize>() + valid + values
    });
    columns.sum()
}

/// Chooses the encoding of a column if a dictionary of its values, the default, is unsuitable.
fn encoded(properties: WriterPropertiesBuilder, column: &TableColumn) -> WriterPropertiesBuilder {
    let path = || ColumnPath::new(vec![column.name.to_string()]);
    let is_long = matches!(column.kind, ColumnKind::I64 | ColumnKind::Time);
    match &column.values {
        // Times and counts differ little between rows and are rarely equal; they are delta-encoded, which all Parquet 2
        // readers support.
        ColumnValues::Wholes(_) if is_long && column.lists.is_empty() => properties
            .set_column_dictionary_enabled(path(), false)
            .set_column_encoding(path(), Encoding::DELTA_BINARY_PACKED),
        // Minimum and maximum words of time-sorted row groups never allow skipping one.
        ColumnValues::Words(_) => {
            properties.set_column_statistics_enabled(path(), EnabledStatistics::None)
        }
        _ => properties,
    }
}

fn schema(batch: &Batch) -> ParquetResult<TypePtr> {
    let fields = batch.columns.iter().map(field);
    let fields = fields.collect::<ParquetResult<_>>()?;
    let root = Type::group_type_builder("schema").with_fields(fields);
    root.build().map(Arc::new)
}

/// A list of these elements.
fn list(name: &str, element: TypePtr) -> ParquetResult<TypePtr> {
    let list = Type::group_type_builder("list")
        .with_repetition(Repetition::REPEATED)
        .with_fields(vec![element]);
    let outer = Type::group_type_builder(name)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(Some(LogicalType::List))
        .with_fields(vec![Arc::new(list.build()?)]);
    outer.build().map(Arc::new)
}

/// The schema of a column.
fn field(column: &TableColumn) -> ParquetResult<TypePtr> {
    let levels = column.lists.len();
    let own = |level: usize| if level == 0 { &*column.name } else { "element" };
    let optional = column.valid.is_some() && levels == 0;
    let (physical, logical) = kind(column.kind);
    let value = Type::primitive_type_builder(own(levels), physical)
        .with_logical_type(logical)
        .with_repetition(if optional {
            Repetition::OPTIONAL
        } else {
            Repetition::REQUIRED
        });
    let value = Arc::new(value.build()?);
    let mut levels = (0..levels).rev();
    levels.try_fold(value, |element, level| list(own(level), element))
}

fn kind(kind: ColumnKind) -> (Physical, Option<LogicalType>) {
    match kind {
        ColumnKind::FLAG => (Physical::BOOLEAN, None),
        ColumnKind::I64 => (Physical::INT64, None),
        ColumnKind::Whole { bits, is_signed } => {
            let physical = if bits == 64 {
                Physical::INT64
            } else {
                Physical::INT32
            };
            let is_plain = bits == 32 && is_signed;
            let integer = LogicalType::integer(bits.cast_signed(), is_signed);
            (physical, Some(integer).filter(|_| !is_plain))
        }
        ColumnKind::F64 => (Physical::DOUBLE, None),
        ColumnKind::Float { .. } => (Physical::FLOAT, None),
        ColumnKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        ColumnKind::Bytes => (Physical::BYTE_ARRAY, None),
        ColumnKind::Time => {
            let nanos = LogicalType::timestamp(true, TimeUnit::NANOS);
            (Physical::INT64, Some(nanos))
        }
    }
}

/// Writes the first `rows` rows of a column.
fn column(
    to: &mut SerializedColumnWriter<'_>,
    column: &TableColumn,
    rows: usize,
) -> ParquetResult<()> {
    match &column.values {
        ColumnValues::Wholes(v) => match column.kind {
            ColumnKind::FLAG => values::<BoolType>(to, column, rows, |at| v[at] != 0),
            ColumnKind::Whole { bits: ..=32, .. } => {
                values::<Int32Type>(to, column, rows, |at| low(v[at]))
            }
            _ => values::<Int64Type>(to, column, rows, |at| v[at]),
        },
        ColumnValues::Floats(v) if column.kind == ColumnKind::F64 => {
            values::<DoubleType>(to, column, rows, |at| v[at])
        }
        ColumnValues::Floats(v) => values::<FloatType>(to, column, rows, |at| to_f32(v[at])),
        ColumnValues::Texts(v) => values::<ByteArrayType>(to, column, rows, texts(v)),
        ColumnValues::Words(v) => {
            let words: Vec<ByteArray> = (0..v.words.ends.len()).map(texts(&v.words)).collect();
            let word = |at: usize| words[v.numbers[at] as usize].clone();
            values::<ByteArrayType>(to, column, rows, word)
        }
    }
}

/// The lower half of a number, which is all of it in a column of at most 32 bits.
#[expect(clippy::cast_possible_truncation, reason = "the upper half is dropped")]
fn low(number: i64) -> i32 {
    number as i32
}

/// The texts by index, which share one copy of the bytes.
fn texts(texts: &TextColumn) -> impl Fn(usize) -> ByteArray {
    let bytes = ByteArray::from(texts.bytes.clone());
    move |at| {
        let part = span(&texts.ends, at);
        bytes.slice(part.start, part.len())
    }
}

/// Writes the first `rows` rows of a column; `value` returns the value at an index.
fn values<T: DataType>(
    to: &mut SerializedColumnWriter<'_>,
    column: &TableColumn,
    rows: usize,
    value: impl Fn(usize) -> T::T,
) -> ParquetResult<()> {
    let writer = to.typed::<T>();
    for start in (0..rows).step_by(AT_ONCE) {
        let part = start..rows.min(start + AT_ONCE);
        if !column.lists.is_empty() {
            let mut levels = ListLevels::default();
            part.clone()
                .for_each(|row| levels.add(&column.lists, 0, row, 0));
            let places = places(&column.lists, part);
            let values: Vec<T::T> = places.map(&value).collect();
            writer.write_batch(&values, Some(&levels.defined), Some(&levels.repeated))?;
        } else if let Some(valid) = &column.valid {
            let values: Vec<T::T> = part.clone().filter(|at| valid[*at]).map(&value).collect();
            let defined: Vec<i16> = valid[part].iter().map(|v| i16::from(*v)).collect();
            writer.write_batch(&values, Some(&defined), None)?;
        } else {
            let values: Vec<T::T> = part.map(&value).collect();
            writer.write_batch(&values, None, None)?;
        }
    }
    Ok(())
}

/// The range of the values inside these rows of lists.
fn places(lists: &[Vec<i32>], rows: Range<usize>) -> Range<usize> {
    lists.iter().fold(rows, |inside, ends| {
        if inside.is_empty() {
            return 0..0;
        }
        span(ends, inside.start).start..span(ends, inside.end - 1).end
    })
}

/// Definition and repetition levels (Dremel, Melnik et al. 2010): one entry per value and per empty list.
#[derive(Default)]
struct ListLevels {
    /// The number of lists around the entry that are not empty.
    defined: Vec<i16>,
    /// The list that the entry continues, 1 for the row's own; 0 where a row begins.
    repeated: Vec<i16>,
}

impl ListLevels {
    /// Adds list `at` of this level, whose first entry continues list `first`.
    fn add(&mut self, lists: &[Vec<i32>], level: i16, at: usize, first: i16) {
        let Some((ends, deeper)) = lists.split_first() else {
            self.defined.push(level);
            self.repeated.push(first);
            return;
        };
        let inside = span(ends, at);
        if inside.is_empty() {
            self.defined.push(level);
            self.repeated.push(first);
        }
        for (number, item) in inside.enumerate() {
            let continues = if number == 0 { first } else { level + 1 };
            self.add(deeper, level + 1, item, continues);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_lists_have_the_levels_of_dremel() {
        // [[1, 2], []], [], [[3]]
        let lists = vec![vec![2, 2, 3], vec![2, 2, 3]];
        let mut levels = ListLevels::default();
        (0..3).for_each(|row| levels.add(&lists, 0, row, 0));
        assert_eq!(levels.defined, [2, 2, 1, 0, 2]);
        assert_eq!(levels.repeated, [0, 2, 1, 0, 0]);
        assert_eq!(places(&lists, 0..2), 0..2);
        assert!(places(&lists, 1..2).is_empty());
        assert_eq!(places(&lists, 2..3), 2..3);
    }
}
