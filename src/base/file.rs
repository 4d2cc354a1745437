//! Reads the user's files up to a limit: a device or a pipe has no known length and may never end.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

#[cfg(feature = "render")]
use super::budget::SUMMARY;
use super::error::{Error, Result};

/// The number of first bytes checked for text before the rest is read.
const HEAD: u64 = 4096;

/// A path with more at its end.
pub(crate) fn with_suffix(path: &Path, end: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(end);
    name.into()
}

/// The text already in a file, with a blank line after it, if that is the file to append to.
///
/// # Errors
/// As [`read_text`].
#[cfg(feature = "render")]
pub(crate) fn text_before(path: &Path, append_to: Option<&Path>) -> Result<String> {
    if append_to != Some(path) || !path.is_file() {
        return Ok(String::new());
    }
    let before = read_text(path, SUMMARY)?;
    Ok(match before.trim_end() {
        "" => String::new(),
        before => format!("{before}\n\n"),
    })
}

/// The bytes of a file of at most `limit` bytes.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::BadFile`] if it is longer.
pub(crate) fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    read_if(path, limit, |_| Ok(()))
}

/// As [`read`], if `fits` accepts the first bytes.
fn read_if(path: &Path, limit: u64, fits: impl Fn(&[u8]) -> io::Result<()>) -> Result<Vec<u8>> {
    let file = File::open(path).map_err(Error::io("read", path))?;
    let mut bytes = Vec::new();
    let mut file = file.take(limit.saturating_add(1));
    let head = file.by_ref().take(HEAD).read_to_end(&mut bytes);
    let read = head.and_then(|_| fits(&bytes));
    let read = read.and_then(|()| file.read_to_end(&mut bytes));
    read.map_err(Error::io("read", path))?;
    if bytes.len() as u64 > limit {
        let reason = format!("more than {limit} bytes are not supported");
        return Err(Error::bad_file(path, 0, reason, "give a smaller file"));
    }
    Ok(bytes)
}

/// The text of a file of at most `limit` bytes.
///
/// # Errors
/// As [`read`], and [`Error::Io`] where it is not UTF-8.
pub(crate) fn read_text(path: &Path, limit: u64) -> Result<String> {
    let no_text = || io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text");
    let is_text = |head: &[u8]| {
        let binary = head.contains(&0);
        if binary { Err(no_text()) } else { Ok(()) }
    };
    String::from_utf8(read_if(path, limit, is_text)?)
        .map_err(|_| no_text())
        .map_err(Error::io("read", path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endless_file_is_too_long() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("style.toml");
        std::fs::write(&path, "1234").unwrap();
        assert_eq!(read_text(&path, 4).unwrap(), "1234");
        assert!(
            read(&path, 3)
                .unwrap_err()
                .to_string()
                .contains("not supported")
        );
        #[cfg(unix)]
        assert!(read(Path::new("/dev/zero"), 1 << 20).is_err());
    }

    #[test]
    fn binary_files_are_rejected_early() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("latin1.toml");
        std::fs::write(&path, b"t = 'gr\xfc\xdfe'").unwrap();
        let error = read_text(&path, 100).unwrap_err().to_string();
        assert!(
            error.contains("latin1.toml") && error.contains("UTF-8"),
            "{error}"
        );
        // A mission may have gigabytes, but other files are rejected early.
        #[cfg(unix)]
        assert!(read_text(Path::new("/dev/zero"), u64::MAX).is_err());
    }
}
