//! A columnar table, used for all tables in all output formats.

use std::borrow::Cow;

use super::time::Stamp;

/// The type of the values in a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnKind {
    /// A whole number of 8 to 64 bits; of 1 bit, false or true.
    Whole {
        /// Its size in bits.
        bits: u8,
        /// Whether it may be negative.
        is_signed: bool,
    },
    /// A floating-point number.
    Float {
        /// Its size in bits, 32 or 64.
        bits: u8,
    },
    /// A [`Stamp`].
    Time,
    /// Text in UTF-8.
    Text,
    /// Bytes of any meaning.
    Bytes,
}

impl ColumnKind {
    /// False or true.
    pub const FLAG: Self = Self::whole(1, false);
    /// The whole numbers of most columns.
    pub const I64: Self = Self::whole(64, true);
    /// The largest numbers of message fields.
    pub(crate) const U64: Self = Self::whole(64, false);
    /// The floating-point numbers of most columns.
    pub const F64: Self = Self::Float { bits: 64 };

    pub(crate) const fn whole(bits: u8, is_signed: bool) -> Self {
        Self::Whole { bits, is_signed }
    }

    /// The size of a number in bytes; 0 for other kinds.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Whole { bits, .. } | Self::Float { bits } => usize::from(bits.div_ceil(8)),
            Self::Time | Self::Text | Self::Bytes => 0,
        }
    }
}

/// A column: its name, its kind, and its cell in the row of an `R` that belongs to a `C`.
pub(crate) struct ColumnOf<C, R> {
    pub(crate) name: &'static str,
    pub(crate) kind: ColumnKind,
    pub(crate) cell: for<'a> fn(&'a C, &'a R) -> TableCell<'a>,
}

/// Columns as [`ColumnOf`], a line each.
macro_rules! columns {
    ($($name:literal $kind:ident $cell:expr;)*) => {
        &[$(ColumnOf { name: $name, kind: ColumnKind::$kind, cell: $cell }),*]
    };
}
pub(crate) use columns;

/// Texts, or strings of bytes, one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextColumn {
    /// All of them.
    pub bytes: Vec<u8>,
    /// The end of each text.
    pub ends: Vec<i32>,
}

impl TextColumn {
    /// Adds a text. At most 2 GB fit; a batch is written long before.
    pub(crate) fn push(&mut self, text: &[u8]) {
        self.bytes.extend_from_slice(text);
        self.ends.push(length(self.bytes.len()));
    }

    /// The text at index `at`.
    pub(crate) fn get(&self, at: usize) -> &[u8] {
        &self.bytes[span(&self.ends, at)]
    }

    fn truncate(&mut self, len: usize) {
        self.ends.truncate(len);
        self.bytes
            .truncate(self.ends.last().map_or(0, |end| place(*end)));
    }
}

/// Dictionary-encoded texts: each is stored by its number among the distinct ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WordColumn {
    /// The distinct texts.
    pub words: TextColumn,
    /// The number of each text.
    pub numbers: Vec<u32>,
}

impl WordColumn {
    /// The text at index `at`.
    pub(crate) fn get(&self, at: usize) -> &[u8] {
        self.words.get(self.numbers[at] as usize)
    }
}

/// The values of a column; for a column of lists, their elements.
#[derive(Clone, Debug, PartialEq)]
pub enum ColumnValues {
    /// Whole numbers, 0 or 1 for a flag, those of 64 bits without sign as the same bits with one; stamps in
    /// nanoseconds.
    Wholes(Vec<i64>),
    /// Floating-point numbers.
    Floats(Vec<f64>),
    /// Texts or bytes.
    Texts(TextColumn),
    /// Texts that recur.
    Words(WordColumn),
}

impl ColumnValues {
    fn new(kind: ColumnKind) -> Self {
        match kind {
            ColumnKind::Whole { .. } | ColumnKind::Time => Self::Wholes(Vec::new()),
            ColumnKind::Float { .. } => Self::Floats(Vec::new()),
            ColumnKind::Text | ColumnKind::Bytes => Self::Texts(TextColumn::default()),
        }
    }

    fn truncate(&mut self, len: usize) {
        match self {
            Self::Wholes(v) => v.truncate(len),
            Self::Floats(v) => v.truncate(len),
            Self::Texts(v) => v.truncate(len),
            Self::Words(v) => v.numbers.truncate(len),
        }
    }

    /// Adds a placeholder for an unknown value.
    fn push_blank(&mut self) {
        match self {
            Self::Wholes(v) => v.push(0),
            Self::Floats(v) => v.push(0.0),
            Self::Texts(v) => v.push(b""),
            Self::Words(v) => v.numbers.push(0),
        }
    }
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TableColumn {
    /// Its name, in snake case except for message fields.
    pub name: Cow<'static, str>,
    /// The type of its values.
    pub kind: ColumnKind,
    /// Its values.
    pub values: ColumnValues,
    /// The end of each list among the lists of the next level, or among the values; the rows' own lists first. Empty
    /// for a column of single values.
    pub(crate) lists: Vec<Vec<i32>>,
    /// Whether each row has a value; `None` for a column in which all rows have one.
    pub valid: Option<Vec<bool>>,
}

impl TableColumn {
    /// A column of single values, some of which may be unknown.
    pub(crate) fn known(name: impl Into<Cow<'static, str>>, kind: ColumnKind) -> Self {
        Self {
            valid: Some(Vec::new()),
            ..Self::full(name, kind, 0)
        }
    }

    /// A column in which every row has a value: a list of lists `levels` deep, 0 for a single value.
    pub(crate) fn full(
        name: impl Into<Cow<'static, str>>,
        kind: ColumnKind,
        levels: usize,
    ) -> Self {
        Self {
            name: name.into(),
            kind,
            values: ColumnValues::new(kind),
            lists: vec![Vec::new(); levels],
            valid: None,
        }
    }

    /// A column of texts that are all among `words`; some rows may have none.
    pub(crate) fn words<'a>(
        name: impl Into<Cow<'static, str>>,
        words: impl Iterator<Item = &'a str>,
    ) -> Self {
        let mut column = WordColumn::default();
        words.for_each(|word| column.words.push(word.as_bytes()));
        Self {
            values: ColumnValues::Words(column),
            ..Self::known(name, ColumnKind::Text)
        }
    }

    /// Ends a list of `count` elements on this level.
    pub(crate) fn end_list(&mut self, level: usize, count: usize) {
        let ends = &mut self.lists[level];
        let before = ends.last().copied().unwrap_or(0);
        ends.push(before.saturating_add(length(count)));
    }

    /// Removes all rows from `rows` on, including an incomplete last one.
    fn truncate(&mut self, rows: usize) {
        let mut len = rows;
        for ends in &mut self.lists {
            ends.truncate(len);
            len = ends.last().map_or(0, |end| place(*end));
        }
        self.values.truncate(len);
        if let Some(valid) = &mut self.valid {
            valid.truncate(rows);
        }
    }

    /// Adds a cell; a cell of another kind than the column becomes unknown.
    pub(crate) fn push(&mut self, cell: &TableCell<'_>) {
        let mut is_known = true;
        match (&mut self.values, cell) {
            (ColumnValues::Wholes(to), TableCell::Flag(value)) => to.push((*value).into()),
            (ColumnValues::Wholes(to), TableCell::Int(value) | TableCell::Time(Stamp(value))) => {
                to.push(*value);
            }
            (ColumnValues::Floats(to), TableCell::Float(value)) if value.is_finite() => {
                to.push(*value);
            }
            (ColumnValues::Texts(to), TableCell::Text(value)) => to.push(value.as_bytes()),
            (ColumnValues::Words(to), TableCell::Word(number)) => to.numbers.push(*number),
            (other, _) => {
                other.push_blank();
                is_known = false;
            }
        }
        if let Some(valid) = &mut self.valid {
            valid.push(is_known);
        }
    }
}

/// One value of a row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum TableCell<'a> {
    /// Unknown.
    Null,
    Flag(bool),
    Int(i64),
    Float(f64),
    Text(Cow<'a, str>),
    Time(Stamp),
    /// A text, by its number in a column of words.
    Word(u32),
}

impl<'a> TableCell<'a> {
    /// A text.
    pub(crate) fn text(text: impl Into<Cow<'a, str>>) -> Self {
        Self::Text(text.into())
    }

    /// A count, saturating at `i64::MAX`.
    pub(crate) fn count(count: impl TryInto<i64>) -> Self {
        Self::Int(count.try_into().unwrap_or(i64::MAX))
    }

    /// The cell for a value, or an unknown cell.
    pub(crate) fn known<T>(value: Option<T>, cell: impl FnOnce(T) -> Self) -> Self {
        value.map_or(Self::Null, cell)
    }
}

/// Rows of a table, in columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// The columns, all of the same length.
    pub columns: Vec<TableColumn>,
    /// The number of rows.
    pub rows: usize,
}

impl Batch {
    /// A batch without rows, with these columns.
    pub(crate) fn of(columns: impl IntoIterator<Item = TableColumn>) -> Self {
        Self {
            columns: columns.into_iter().collect(),
            rows: 0,
        }
    }

    /// A batch without rows, with these columns.
    pub(crate) fn with<C, R>(columns: &[ColumnOf<C, R>]) -> Self {
        let known = |column: &ColumnOf<C, R>| TableColumn::known(column.name, column.kind);
        Self::of(columns.iter().map(known))
    }

    /// The rows of a whole table that belongs to `all`.
    pub(crate) fn filled<'a, C, R: 'a>(
        columns: &[ColumnOf<C, R>],
        all: &C,
        rows: impl IntoIterator<Item = &'a R>,
    ) -> Self {
        let mut table = Self::with(columns);
        for row in rows {
            let cells = columns.iter().map(|column| (column.cell)(all, row));
            table.push(&cells.collect::<Vec<_>>());
        }
        table
    }

    /// Adds a row: one cell per column; a cell of another kind than its column becomes unknown.
    pub(crate) fn push(&mut self, row: &[TableCell<'_>]) {
        for (column, cell) in self.columns.iter_mut().zip(row) {
            column.push(cell);
        }
        self.rows += 1;
    }

    /// Removes the cells of an incomplete last row.
    pub(crate) fn take_back(&mut self) {
        let rows = self.rows;
        self.columns.iter_mut().for_each(|c| c.truncate(rows));
    }

    /// Removes all rows.
    pub(crate) fn clear(&mut self) {
        self.rows = 0;
        self.take_back();
    }
}

/// A table in progress.
pub(crate) trait TableWriter<W> {
    /// Writes all rows of `batch`, which must have the table's columns.
    fn write(&mut self, batch: &Batch) -> std::io::Result<()>;

    /// The number of bytes of encoded rows in memory.
    fn held(&self) -> usize {
        0
    }

    /// Writes the rows in memory.
    fn unload(&mut self) -> std::io::Result<()> {
        Ok(())
    }

    /// Ends the table and returns the sink that it was written to.
    fn finish(self: Box<Self>) -> std::io::Result<W>;
}

/// The range of the elements of list `at` in the level below.
pub(crate) fn span(ends: &[i32], at: usize) -> std::ops::Range<usize> {
    let start = at.checked_sub(1).map_or(0, |before| place(ends[before]));
    start..place(ends[at])
}

fn place(end: i32) -> usize {
    usize::try_from(end).unwrap_or(0)
}

fn length(len: usize) -> i32 {
    i32::try_from(len).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_filled_row_is_taken_back() {
        let mut batch = Batch::of([
            TableColumn::full("a", ColumnKind::I64, 0),
            TableColumn::full("b", ColumnKind::Text, 1),
        ]);
        let add = |batch: &mut Batch, texts: &[&str]| {
            if let ColumnValues::Wholes(to) = &mut batch.columns[0].values {
                to.push(1);
            }
            if let ColumnValues::Texts(to) = &mut batch.columns[1].values {
                for text in texts {
                    to.push(text.as_bytes());
                }
            }
        };
        add(&mut batch, &["x", "yz"]);
        batch.columns[1].end_list(0, 2);
        batch.rows = 1;
        let whole = batch.clone();
        add(&mut batch, &["lost"]);
        batch.take_back();
        assert_eq!(batch, whole);
        assert_eq!(span(&batch.columns[1].lists[0], 0), 0..2);
    }

    #[test]
    fn a_cell_of_another_kind_is_unknown() {
        let mut batch = Batch::of([TableColumn::known("a", ColumnKind::F64)]);
        batch.push(&[TableCell::Float(f64::NAN)]);
        batch.push(&[TableCell::Int(1)]);
        batch.push(&[TableCell::Float(2.0)]);
        assert_eq!(batch.columns[0].valid, Some(vec![false, false, true]));
    }
}
