//! SQLite, opened so that nothing in a database can run, write or grow, and no row is lost. The only file that knows `rusqlite`.

use std::fmt::Write as _;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

pub(super) use rusqlite::Error as Refusal;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};

use crate::bag::source::Temporary;
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;

/// An open database.
pub(super) struct Db(Connection);

/// The longest value that SQLite may produce, in bytes.
const LONGEST_VALUE: i32 = 64 << 20;

/// A row of a query; columns count from 0. SQLite does not enforce the types of columns.
pub(super) struct QueryRow<'r>(&'r rusqlite::Row<'r>);

impl QueryRow<'_> {
    /// A column's integer; `None` if it has another type.
    pub(super) fn integer(&self, column: usize) -> Option<i64> {
        self.0.get(column).ok()
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
        self.0.get_ref(column).ok()?.as_bytes().ok()
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
        pick: impl Fn(&QueryRow<'_>) -> Option<T>,
    ) -> Result<Option<T>, Refusal> {
        let mut picked = None;
        self.each(sql, &[], |row| {
            picked = pick(row);
            ControlFlow::Break(())
        })?;
        Ok(picked)
    }
}

// Where a database can be opened so that no row is lost and no file is created beside the user's.

/// A database ready to be opened.
pub(super) struct Ready {
    pub(super) path: PathBuf,
    /// Whether the database is cut or damaged, and is read as far as possible.
    pub(super) damaged: bool,
    /// Whether rows are ignored because the copy would be too large.
    pub(super) left_behind: bool,
    /// The copy, removed when the bag has been read.
    copy: Option<Temporary>,
    /// Whether a recorder writes to a log beside the database, which is read too.
    is_shared: bool,
}

impl Ready {
    /// A database that is read without a copy, with its log if it has one.
    pub(super) fn growing(path: &Path, has_log: bool) -> Self {
        Self {
            path: path.to_owned(),
            damaged: false,
            left_behind: false,
            copy: None,
            is_shared: has_log,
        }
    }

    /// Whether it is our own copy, which SQLite may recover; otherwise it must not modify the file.
    pub(super) fn is_copy(&self) -> bool {
        self.copy.is_some()
    }
}

/// The largest database that is copied, in bytes: 16 GiB.
const LARGEST_COPY: u64 = 16 << 30;

/// Copies a database with its newest rows in a log or journal beside it that was never merged.
pub(super) fn ready(path: &Path) -> Result<Ready> {
    let is_filled = |p: &PathBuf| p.metadata().is_ok_and(|m| m.is_file() && m.len() > 0);
    let beside = ["-wal", "-journal"].map(|end| with_suffix(path, end));
    let beside: Vec<PathBuf> = beside.into_iter().filter(is_filled).collect();
    let mut ready = Ready::growing(path, false);
    if beside.is_empty() {
        return Ok(ready);
    }
    let all = || beside.iter().map(PathBuf::as_path).chain([path]);
    let size: u64 = all().filter_map(|p| Some(p.metadata().ok()?.len())).sum();
    if size > LARGEST_COPY {
        ready.left_behind = true;
        return Ok(ready);
    }
    let copy = Temporary::new()?;
    for from in all() {
        let to = copy.path().join(from.file_name().unwrap_or_default());
        fs::copy(from, to).map_err(Error::io("copy", from))?;
    }
    ready.path = copy.path().join(path.file_name().unwrap_or_default());
    ready.copy = Some(copy);
    Ok(ready)
}

/// The URI under which SQLite opens the file.
pub(super) fn address(ready: &Ready) -> String {
    let mut address = "file:".to_owned();
    for byte in bytes(&ready.path) {
        if byte.is_ascii_alphanumeric() || b"/._-~".contains(&byte) {
            address.push(byte as char);
        } else {
            let _ = write!(address, "%{byte:02x}");
        }
    }
    address += if ready.is_copy() {
        "?mode=rw"
    } else if ready.is_shared {
        "?mode=ro"
    } else {
        "?mode=ro&immutable=1"
    };
    address
}

#[cfg(unix)]
fn bytes(path: &Path) -> Vec<u8> {
    std::os::unix::ffi::OsStrExt::as_bytes(path.as_os_str()).to_vec()
}

#[cfg(not(unix))]
fn bytes(path: &Path) -> Vec<u8> {
    let text = path.to_string_lossy().replace('\\', "/");
    // A drive letter needs a slash before it.
    let slash = if text.get(1..2) == Some(":") { "/" } else { "" };
    format!("{slash}{text}").into_bytes()
}
