//! A file that is written atomically: hidden until complete, removed otherwise.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::target::{Target, folder_of, is_special};
use crate::base::error::{Error, Result};
use crate::base::file::Leftover;

/// A file (or standard output) in progress. Dropped without [`OutputSink::commit`], a file is removed.
pub(crate) struct OutputSink {
    /// The path as given.
    path: PathBuf,
    /// The path that is replaced: for a symbolic link, the one it points to.
    place: PathBuf,
    to: BufWriter<SinkTarget>,
    written: u64,
    limit: u64,
}

enum SinkTarget {
    Stdout(io::Stdout),
    /// An existing device or pipe, which is not renamed.
    Special(File),
    /// An unnamed file, which disappears even if the process is killed.
    #[cfg(target_os = "linux")]
    Nameless(File),
    /// A file with a temporary name beside the final one.
    Named(NamedTempFile, Leftover),
    /// Bytes not yet written, until they are known to be within the limit.
    Memory(Vec<u8>),
}

impl OutputSink {
    /// Opens the file that will become `target`, whose folder exists. With `limit`, writing more bytes than that
    /// fails as [`io::ErrorKind::FileTooLarge`].
    ///
    /// # Errors
    /// A system error, with the name of the final file.
    pub(crate) fn create(target: &Target, limit: Option<u64>) -> Result<Self> {
        let way = match target {
            Target::Stdout if limit.is_some() => Ok(SinkTarget::Memory(Vec::new())),
            // Output requested on standard output is not a message of the library.
            Target::Stdout => Ok(SinkTarget::Stdout(io::stdout())),
            Target::Path(path) if is_special(path) => {
                let file = File::options().write(true).open(path);
                file.map(SinkTarget::Special)
            }
            Target::Path(path) => hidden(folder_of(path)),
        };
        let place = match target {
            Target::Path(path) if path.is_symlink() => {
                path.canonicalize().unwrap_or_else(|_| path.clone())
            }
            Target::Path(path) => path.clone(),
            Target::Stdout => "-".into(),
        };
        Ok(Self {
            to: BufWriter::with_capacity(1 << 16, way.map_err(Error::io("write", target.path()))?),
            path: target.path().to_owned(),
            place,
            written: 0,
            limit: limit.unwrap_or(u64::MAX),
        })
    }

    /// The path as given, for messages; `-` for standard output.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// A function that converts an I/O error of this file.
    pub(crate) fn error(&self) -> impl FnOnce(io::Error) -> Error + use<> {
        Error::io("write", &self.path)
    }

    /// Finishes the file: it appears under its final name, replacing an existing file. Returns its size in bytes.
    ///
    /// # Errors
    /// If the last bytes do not fit or the file cannot be renamed; then no file is left.
    pub(crate) fn commit(mut self) -> Result<u64> {
        self.to.flush().map_err(self.error())?;
        let Self {
            path,
            place,
            to,
            written,
            ..
        } = self;
        let (way, _) = to.into_parts();
        publish(way, &place).map_err(Error::io("write", &path))?;
        Ok(written)
    }
}

/// Writes a whole file; returns its size.
///
/// # Errors
/// Where the system refuses.
pub(crate) fn write_file(target: &Target, bytes: &[u8]) -> Result<u64> {
    let mut sink = OutputSink::create(target, None)?;
    sink.write_all(bytes).map_err(sink.error())?;
    sink.commit()
}

impl Write for OutputSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.written + bytes.len() as u64 > self.limit {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let count = self.to.write(bytes)?;
        self.written += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

impl Write for SinkTarget {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Stdout(out) => out.write(bytes),
            Self::Special(file) => file.write(bytes),
            #[cfg(target_os = "linux")]
            Self::Nameless(file) => file.write(bytes),
            Self::Named(file, _) => file.write(bytes),
            Self::Memory(held) => held.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Stdout(out) => out.flush(),
            _ => Ok(()),
        }
    }
}

/// Gives the written file its final name.
fn publish(way: SinkTarget, path: &Path) -> io::Result<()> {
    match way {
        SinkTarget::Stdout(_) | SinkTarget::Special(_) => Ok(()),
        SinkTarget::Memory(held) => {
            let mut out = io::stdout().lock();
            out.write_all(&held)?;
            out.flush()
        }
        #[cfg(target_os = "linux")]
        SinkTarget::Nameless(file) => {
            // An existing file is replaced by renaming a second link, as linking does not replace.
            if link(&file, path).is_ok() {
                return Ok(());
            }
            let mut left = None;
            let named = temporary().make_in(folder_of(path), |name| {
                left = Some(Leftover::at(name));
                link(&file, name)
            })?;
            named.persist(path).map(drop).map_err(|e| e.error)
        }
        SinkTarget::Named(file, _left) => file.persist(path).map(drop).map_err(|e| e.error),
    }
}

/// A hidden file in `folder`: unnamed if the system supports it.
fn hidden(folder: &Path) -> io::Result<SinkTarget> {
    #[cfg(target_os = "linux")]
    if let Ok(file) = nameless(folder) {
        return Ok(SinkTarget::Nameless(file));
    }
    let file = temporary().tempfile_in(folder)?;
    let left = Leftover::at(file.path());
    Ok(SinkTarget::Named(file, left))
}

/// The builder of temporary files with recognizable names.
fn temporary() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bagreel-").suffix(".part");
    // Permissions by the user's umask, like any new file; the default is private.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

#[cfg(target_os = "linux")]
fn nameless(folder: &Path) -> io::Result<File> {
    use rustix::fs::{Mode, OFlags, open};
    let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
    let file = File::from(open(folder, flags, Mode::from_raw_mode(0o666))?);
    // Linking needs /proc, so its absence must be detected here.
    fs::metadata(proc_path(&file)).map(|_| file)
}

#[cfg(target_os = "linux")]
fn proc_path(file: &File) -> String {
    use std::os::fd::AsRawFd as _;
    format!("/proc/self/fd/{}", file.as_raw_fd())
}

#[cfg(target_os = "linux")]
fn link(file: &File, name: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    let linked = linkat(CWD, proc_path(file), CWD, name, AtFlags::SYMLINK_FOLLOW);
    Ok(linked?)
}

/// Checks whether a file can be created in `folder`; leaves no file.
pub(crate) fn probe(folder: &Path) -> io::Result<()> {
    hidden(folder).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with a target in it.
    fn place(name: &str) -> (tempfile::TempDir, Target) {
        let folder = tempfile::tempdir().unwrap();
        let target = Target::Path(folder.path().join(name));
        (folder, target)
    }

    fn names(folder: &Path) -> Vec<String> {
        let name = |e: io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
        fs::read_dir(folder).unwrap().map(name).collect()
    }

    #[test]
    fn a_file_appears_when_it_is_complete() {
        let (folder, target) = place("a.gif");
        let mut sink = OutputSink::create(&target, None).unwrap();
        sink.write_all(b"whole").unwrap();
        #[cfg(target_os = "linux")]
        assert!(names(folder.path()).is_empty());
        assert_eq!(sink.commit().unwrap(), 5);
        assert_eq!(names(folder.path()), ["a.gif"]);
        assert_eq!(fs::read(target.path()).unwrap(), b"whole");
    }

    #[test]
    fn an_abandoned_file_leaves_the_old_one() {
        let (folder, target) = place("a.gif");
        fs::write(target.path(), "old").unwrap();
        let mut sink = OutputSink::create(&target, None).unwrap();
        sink.write_all(b"half").unwrap();
        drop(sink);
        assert_eq!(names(folder.path()), ["a.gif"]);
        assert_eq!(fs::read(target.path()).unwrap(), b"old");
    }

    #[test]
    fn a_size_limit_is_enforced() {
        let (folder, target) = place("a.gif");
        let mut sink = OutputSink::create(&target, Some(4)).unwrap();
        let error = sink.write_all(b"five!").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        drop(sink);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_deleted_folder_is_reported() {
        let (folder, target) = place("a.gif");
        let mut sink = OutputSink::create(&target, None).unwrap();
        sink.write_all(b"whole").unwrap();
        fs::remove_dir_all(folder.path()).unwrap();
        let error = sink.commit().unwrap_err().to_string();
        assert!(error.contains("a.gif"), "{error}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_is_reported_with_the_file_name() {
        let target = Target::parse("/dev/full");
        let mut sink = OutputSink::create(&target, None).unwrap();
        sink.write_all(b"no room").unwrap();
        let error = sink.commit().unwrap_err();
        assert!(error.to_string().contains("/dev/full"), "{error}");
        assert!(!error.hint().is_empty());
    }

    #[test]
    #[cfg(unix)]
    fn a_symlink_stays_a_symlink() {
        let (folder, target) = place("link.gif");
        let real = folder.path().join("real.gif");
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, target.path()).unwrap();
        let mut sink = OutputSink::create(&target, None).unwrap();
        sink.write_all(b"new").unwrap();
        sink.commit().unwrap();
        assert!(fs::symlink_metadata(target.path()).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }
}
