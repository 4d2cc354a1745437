//! Tables as comma-separated values (RFC 4180).

use std::borrow::Cow;

use super::words::visible;
use csv::{ReaderBuilder, Terminator, WriterBuilder};

/// A table as text: the names of the columns, then a row a line.
pub(crate) fn table(columns: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut writer = WriterBuilder::new()
        .terminator(Terminator::Any(b'\n'))
        .from_writer(Vec::new());
    // Writing to memory cannot fail, and rows are as long as the head.
    let _ = writer.write_record(columns);
    for row in rows {
        let _ = writer.write_record(row.iter().map(|text| cell(text).into_owned()));
    }
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A text as it may stand in a cell: control characters are shown, not obeyed, and what a spreadsheet would take for a
/// formula begins with `'` (OWASP, *CSV Injection*). Names of ROS begin with none of these signs.
pub(crate) fn cell(text: &str) -> Cow<'_, str> {
    let is_formula =
        text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    let shown = visible(text);
    if is_formula {
        format!("'{shown}").into()
    } else {
        shown
    }
}

/// A row with its line, 1...
pub(crate) type Record = (usize, Vec<String>);

/// Every row of a text with its line, 1.., the head among them; rows may differ in length, and empty lines are none.
///
/// # Errors
/// The line, and what is wrong there.
pub(crate) fn records(text: &str) -> Result<Vec<Record>, (usize, String)> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(text.trim_start_matches('\u{feff}').as_bytes());
    let line = |position: Option<&csv::Position>| {
        position.map_or(0, |p| usize::try_from(p.line()).unwrap_or(usize::MAX))
    };
    let rows = reader.records().map(|row| match row {
        Ok(row) => Ok((
            line(row.position()),
            row.iter().map(ToOwned::to_owned).collect(),
        )),
        Err(error) => Err((line(error.position()), error.to_string())),
    });
    rows.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_is_a_formula() {
        for (text, shown) in [
            ("=cmd|'/c calc'!A1", "'=cmd|'/c calc'!A1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("\t=1", "'\\u{9}=1"),
            ("-5.5", "-5.5"),
            ("-5+cmd", "'-5+cmd"),
            ("/a\u{1b}[2J\n::error::", "/a\\u{1b}[2J\\u{a}::error::"),
            ("/größe", "/größe"),
        ] {
            assert_eq!(cell(text), shown);
        }
    }

    #[test]
    fn cells_are_quoted_where_they_must_be() {
        let text = table(
            &["a", "b"],
            [vec!["x,y".to_owned(), "say \"hi\"".to_owned()]],
        );
        assert_eq!(text, "a,b\n\"x,y\",\"say \"\"hi\"\"\"\n");
    }
}
