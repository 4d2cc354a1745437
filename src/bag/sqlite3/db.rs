//! SQLite, opened so that nothing in a database can run, write or grow. The only file that uses `rusqlite`.

use std::fmt;
use std::ops::ControlFlow;

use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};

use super::ready::{Ready, address};

/// An open database.
pub(super) struct Db(Connection);

/// An error of SQLite.
#[derive(Debug)]
pub(super) struct Refusal(rusqlite::Error);

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl From<rusqlite::Error> for Refusal {
    fn from(error: rusqlite::Error) -> Self {
        Self(error)
    }
}

/// The longest value that SQLite may produce, in bytes.
const LONGEST_VALUE: i32 = 64 << 20;

/// A row of a query; columns count from 0. SQLite does not enforce the types of columns.
pub(super) struct QueryRow<'r>(&'r rusqlite::Row<'r>);

impl QueryRow<'_> {
    /// A column's integer; `None` if it has another type.
    pub(super) fn integer(&self, column: usize) -> Option<i64> {
        match self.0.get_ref(column).ok()? {
            ValueRef::Integer(n) => Some(n),
            _ => None,
        }
    }

    /// A column's text, with invalid UTF-8 replaced; `None` if it has another type.
    pub(super) fn text(&self, column: usize) -> Option<String> {
        match self.0.get_ref(column).ok()? {
            ValueRef::Text(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
            _ => None,
        }
    }

    /// A column's bytes, of text or a blob; `None` if it has another type.
    pub(super) fn bytes(&self, column: usize) -> Option<&[u8]> {
        match self.0.get_ref(column).ok()? {
            ValueRef::Blob(bytes) | ValueRef::Text(bytes) => Some(bytes),
            _ => None,
        }
    }
}

impl Db {
    /// Opens a database for reading.
    pub(super) fn open(ready: &Ready) -> Result<Self, Refusal> {
        let access = if ready.is_copy() {
            OpenFlags::SQLITE_OPEN_READ_WRITE
        } else {
            OpenFlags::SQLITE_OPEN_READ_ONLY
        };
        let flags = access | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let db = Connection::open_with_flags(address(ready), flags)?;
        // SQLite reads past damage only with a writable schema; still nothing can be written, as the file is opened
        // read-only and the connection is query-only.
        if ready.damaged {
            db.pragma_update(None, "writable_schema", 1)?;
        } else {
            db.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
        }
        db.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
        db.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false)?;
        db.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false)?;
        db.set_limit(Limit::SQLITE_LIMIT_LENGTH, LONGEST_VALUE)?;
        for (name, value) in [("cell_size_check", 1), ("query_only", 1), ("mmap_size", 0)] {
            db.pragma_update(None, name, value)?;
        }
        Ok(Self(db))
    }

    /// The columns of a table with stored values; empty if it is not a table.
    pub(super) fn columns(&self, table: &str) -> Result<Vec<String>, Refusal> {
        let is_table = "SELECT count(*) FROM sqlite_schema WHERE name = ?1 COLLATE NOCASE AND type = 'table' AND rootpage > 0";
        let count: i64 = self.0.query_row(is_table, [table], |row| row.get(0))?;
        let mut columns = Vec::new();
        if count == 0 {
            return Ok(columns);
        }
        self.each(&format!("PRAGMA table_xinfo({table})"), &[], |row| {
            // Generated columns run arbitrary expressions when they are read.
            if row.integer(6) == Some(0) && columns.len() < 100 {
                columns.extend(row.text(1));
            }
            ControlFlow::Continue(())
        })?;
        Ok(columns)
    }

    /// Calls `visit` with each row until it stops.
    pub(super) fn each(
        &self,
        sql: &str,
        args: &[i64],
        mut visit: impl FnMut(&QueryRow<'_>) -> ControlFlow<()>,
    ) -> Result<(), Refusal> {
        let mut query = self.0.prepare(sql)?;
        let mut rows = query.query(rusqlite::params_from_iter(args))?;
        while let Some(row) = rows.next()? {
            if visit(&QueryRow(row)).is_break() {
                break;
            }
        }
        Ok(())
    }

    /// The value that `pick` takes from the first row; `None` if there is no row, or nothing to pick.
    pub(super) fn first<T>(
        &self,
        sql: &str,
        args: &[i64],
        pick: impl Fn(&QueryRow<'_>) -> Option<T>,
    ) -> Result<Option<T>, Refusal> {
        let mut picked = None;
        self.each(sql, args, |row| {
            picked = pick(row);
            ControlFlow::Break(())
        })?;
        Ok(picked)
    }
}
