//! Files: the user's, read up to a limit, as a device or a pipe has no known length and may never end, and temporary ones,
//! which a signal must not leave behind.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::error::{Error, Result};

#[cfg(feature = "render")]
use super::budget::SUMMARY;

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

// The register of temporary files and folders, which are removed if a signal ends the process before their owners
// remove them.

static ALL: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// The paths to remove; a panic elsewhere cannot leave the set inconsistent.
fn all() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    ALL.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary file or folder, registered from before its creation until its owner has removed or renamed it.
#[derive(Debug)]
pub(crate) struct Leftover(PathBuf);

impl Leftover {
    /// Registers `path`.
    pub(crate) fn at(path: &Path) -> Self {
        all().insert(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Leftover {
    fn drop(&mut self) {
        all().remove(&self.0);
    }
}

/// Removes all registered paths just before the process ends.
pub(crate) fn remove_leftovers() {
    for path in all().iter() {
        // A path that cannot be removed is left.
        let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir_all(path));
    }
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

    #[test]
    fn registered_paths_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        std::fs::write(place("half"), "").unwrap();
        std::fs::create_dir(place("unpacked")).unwrap();
        std::fs::write(place("unpacked/bag"), "").unwrap();
        std::fs::write(place("whole"), "").unwrap();
        let _kept = [
            Leftover::at(&place("half")),
            Leftover::at(&place("unpacked")),
        ];
        drop(Leftover::at(&place("whole")));
        remove_leftovers();
        let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }
}
