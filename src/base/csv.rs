//! Tables as comma-separated values (RFC 4180).

use std::borrow::Cow;
use std::io::{self, Write};

use csv::{ReaderBuilder, Terminator, WriterBuilder};

use super::cast::to_f32;
use super::table::{Batch, ColumnKind, ColumnValues, TableColumn, TableWriter, span};
use super::words::{is_invisible, visible};

/// Writes a table: the column names, then one row per line. Lists are written as JSON with `NaN` and `Infinity`, which
/// Python and JavaScript accept; unknown values are empty.
pub(crate) struct CsvRows<W: Write> {
    writer: csv::Writer<W>,
    field: Vec<u8>,
}

impl<W: Write> CsvRows<W> {
    /// Begins a table with the columns of `batch`.
    pub(crate) fn new(to: W, batch: &Batch) -> io::Result<Self> {
        let mut writer = WriterBuilder::new()
            .terminator(Terminator::Any(b'\n'))
            .from_writer(to);
        let heads = batch.columns.iter().map(|c| c.name.as_bytes());
        writer.write_record(heads).map_err(cause)?;
        Ok(Self {
            writer,
            field: Vec::new(),
        })
    }
}

impl<W: Write> TableWriter<W> for CsvRows<W> {
    fn write(&mut self, batch: &Batch) -> io::Result<()> {
        for row in 0..batch.rows {
            for column in &batch.columns {
                self.field.clear();
                if column.valid.as_ref().is_none_or(|valid| valid[row]) {
                    field(column, 0, row, &mut self.field)?;
                }
                self.writer.write_field(&self.field).map_err(cause)?;
            }
            self.writer.write_record(None::<&[u8]>).map_err(cause)?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> io::Result<W> {
        self.writer
            .into_inner()
            .map_err(csv::IntoInnerError::into_error)
    }
}

/// The I/O error inside a writer's error, so that a closed pipe is recognized.
fn cause(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(cause) => cause,
        other => io::Error::other(format!("{other:?}")),
    }
}

/// Writes value `at` of a level: a list, or below all lists a single value.
fn field(column: &TableColumn, level: usize, at: usize, to: &mut Vec<u8>) -> io::Result<()> {
    let in_list = level > 0;
    let Some(ends) = column.lists.get(level) else {
        return value(column, at, in_list, to);
    };
    to.push(b'[');
    for (count, element) in span(ends, at).enumerate() {
        if count > 0 {
            to.push(b',');
        }
        field(column, level + 1, element, to)?;
    }
    to.push(b']');
    Ok(())
}

fn value(column: &TableColumn, at: usize, in_list: bool, to: &mut Vec<u8>) -> io::Result<()> {
    match &column.values {
        ColumnValues::Wholes(v) => match column.kind {
            ColumnKind::FLAG => write!(to, "{}", v[at] != 0),
            ColumnKind::U64 => write!(to, "{}", v[at].cast_unsigned()),
            _ => write!(to, "{}", v[at]),
        },
        ColumnValues::Floats(v) if !v[at].is_finite() => odd(v[at], in_list, to),
        ColumnValues::Floats(v) if column.kind == ColumnKind::F64 => number(v[at], to),
        ColumnValues::Floats(v) => write!(to, "{:?}", to_f32(v[at])),
        ColumnValues::Texts(v) if column.kind == ColumnKind::Bytes => {
            serde_json::to_writer(to, v.get(at)).map_err(io::Error::from)
        }
        // Columns without unknown values are message fields.
        ColumnValues::Texts(v) => text(v.get(at), in_list, column.valid.is_none(), to),
        ColumnValues::Words(v) => text(v.get(at), in_list, column.valid.is_none(), to),
    }
}

/// The shortest digits that round-trip; very large and very small numbers with an exponent.
fn number(value: f64, to: &mut Vec<u8>) -> io::Result<()> {
    let size = value.abs();
    if value == 0.0 || (1e-5..1e17).contains(&size) {
        write!(to, "{value}")
    } else {
        write!(to, "{value:e}")
    }
}

/// Writes an infinite number or NaN.
fn odd(value: f64, in_list: bool, to: &mut Vec<u8>) -> io::Result<()> {
    match (in_list, value.is_nan(), value > 0.0) {
        (_, true, _) => write!(to, "NaN"),
        (true, _, true) => write!(to, "Infinity"),
        (true, _, false) => write!(to, "-Infinity"),
        (false, _, true) => write!(to, "inf"),
        (false, _, false) => write!(to, "-inf"),
    }
}

fn text(text: &[u8], in_list: bool, is_data: bool, to: &mut Vec<u8>) -> io::Result<()> {
    if !in_list {
        let text = String::from_utf8_lossy(text);
        to.extend_from_slice(cell(&text, is_data).as_bytes());
        return Ok(());
    }
    to.push(b'"');
    for byte in text {
        match byte {
            b'"' | b'\\' => to.extend([b'\\', *byte]),
            0..0x20 => write!(to, "\\u{byte:04x}")?,
            other => to.push(*other),
        }
    }
    to.push(b'"');
    Ok(())
}

/// Rows of texts, all of one length, as CSV: one row per line.
pub(crate) fn lines<R>(rows: impl IntoIterator<Item = R>) -> String
where
    R: IntoIterator<Item = String>,
{
    let mut writer = WriterBuilder::new()
        .terminator(Terminator::Any(b'\n'))
        .from_writer(Vec::new());
    // Writing to memory cannot fail.
    for row in rows {
        let cells = row.into_iter().map(|text| cell(&text, false).into_owned());
        let _ = writer.write_record(cells);
    }
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A text that is safe in a cell: control characters are escaped unless it is a message's own `data`, and what a
/// spreadsheet would interpret as a formula is prefixed with `'` (OWASP, *CSV Injection*). ROS names begin with none of
/// these characters.
pub(crate) fn cell(text: &str, is_data: bool) -> Cow<'_, str> {
    let signs = ['=', '+', '-', '@', '\t', '\r', '＝', '＋', '－', '＠'];
    let is_number = || !text.starts_with('+') && text.parse::<f64>().is_ok();
    // Spreadsheets pass over blanks of every kind.
    let is_blank = |c| c == ' ' || !signs.contains(&c) && is_invisible(c);
    let is_formula = text.trim_start_matches(is_blank).starts_with(signs) && !is_number();
    let shown = if is_data { text.into() } else { visible(text) };
    if is_formula {
        format!("'{shown}").into()
    } else {
        shown
    }
}

/// A row with its line, ≥ 1.
pub(crate) type CsvRow = (usize, Vec<String>);

/// Every row of a text, including the header, with its line, ≥ 1; rows may differ in length, and empty lines are
/// skipped.
///
/// # Errors
/// The line, and the mistake in it.
pub(crate) fn records(text: &str) -> Result<Vec<CsvRow>, (usize, String)> {
    each_record(text).collect()
}

/// The rows of [`records`], one by one.
pub(crate) fn each_record(
    text: &str,
) -> impl Iterator<Item = Result<CsvRow, (usize, String)>> + use<'_> {
    let reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
    let line = |position: Option<&csv::Position>| {
        position.map_or(0, |p| usize::try_from(p.line()).unwrap_or(usize::MAX))
    };
    reader.into_records().map(move |row| match row {
        Ok(row) => Ok((
            line(row.position()),
            row.iter().map(ToOwned::to_owned).collect(),
        )),
        Err(error) => Err((line(error.position()), error.to_string())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::table::TableCell;

    #[test]
    fn formulas_in_cells_are_escaped() {
        for (text, shown) in [
            ("=cmd|'/c calc'!A1", "'=cmd|'/c calc'!A1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("\t=1", "'\\u{9}=1"),
            ("-5.5", "-5.5"),
            ("+1", "'+1"),
            ("＝1", "'＝1"),
            ("  =1", "'  =1"),
            ("-5+cmd", "'-5+cmd"),
            ("/a\u{1b}[2J\n::error::", "/a\\u{1b}[2J\\u{a}::error::"),
            ("/größe", "/größe"),
        ] {
            assert_eq!(cell(text, false), shown);
        }
        assert_eq!(cell("two\nlines", true), "two\nlines");
    }

    #[test]
    fn cells_are_quoted_if_necessary() {
        let mut batch = Batch::of([
            TableColumn::known("a", ColumnKind::Text),
            TableColumn::known("b", ColumnKind::Text),
            TableColumn::known("c", ColumnKind::F64),
        ]);
        batch.push(&[
            TableCell::text("x,y"),
            TableCell::text("say \"hi\""),
            TableCell::Null,
        ]);
        batch.push(&[
            TableCell::Null,
            TableCell::text(""),
            TableCell::Float(1e300),
        ]);
        let mut rows = CsvRows::new(Vec::new(), &batch).unwrap();
        rows.write(&batch).unwrap();
        let text = String::from_utf8(Box::new(rows).finish().unwrap()).unwrap();
        assert_eq!(text, "a,b,c\n\"x,y\",\"say \"\"hi\"\"\",\n,,1e300\n");
    }
}
