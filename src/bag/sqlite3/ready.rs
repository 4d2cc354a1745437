//! Where a database can be opened so that no row is lost and no file is created beside the user's.

use std::fs;
use std::path::{Path, PathBuf};

use crate::bag::source::Temporary;
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;

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
    let beside: Vec<PathBuf> = ["-wal", "-journal"]
        .iter()
        .map(|end| with_suffix(path, end))
        .filter(|p| p.metadata().is_ok_and(|m| m.is_file() && m.len() > 0))
        .collect();
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
            address.push('%');
            for half in [byte >> 4, byte & 15] {
                address.extend(char::from_digit(half.into(), 16));
            }
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
