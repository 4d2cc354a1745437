//! A folder of tables in progress: hidden until all of them are complete, with few files open at a time.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::base::error::{Error, Result};
use crate::base::file::Leftover;

/// Files that appear together in a folder. Dropped without [`Folder::commit`], they are removed.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    hidden: TempDir,
    /// The guard that removes the hidden folder when a signal ends the process.
    _left: Leftover,
    /// Dropped after the hidden folder inside it.
    _made: Made,
    names: Vec<String>,
}

/// Folders created for the files, the outermost first. Those still empty on drop are removed.
#[derive(Debug)]
struct Made(Vec<PathBuf>);

impl Drop for Made {
    fn drop(&mut self) {
        for folder in self.0.iter().rev() {
            // Fails for folders with files, as intended.
            let _ = fs::remove_dir(folder);
        }
    }
}

impl Folder {
    /// Files that will appear in the folder `path`, which is created if missing.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        let missing = path
            .ancestors()
            .take_while(|f| !f.as_os_str().is_empty() && !f.exists());
        let mut missing: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        missing.reverse();
        fs::create_dir_all(path).map_err(Error::io("create the folder", path))?;
        let mut builder = tempfile::Builder::new();
        let hidden = builder
            .prefix(".bagreel-")
            .suffix(".part")
            .tempdir_in(path)
            .map_err(Error::io("write into", path))?;
        Ok(Self {
            path: path.to_owned(),
            _left: Leftover::at(hidden.path()),
            hidden,
            _made: Made(missing),
            names: Vec::new(),
        })
    }

    /// A new file with the unique name `name`.
    pub(crate) fn file(&mut self, name: String) -> Part {
        let path = self.hidden.path().join(&name);
        self.names.push(name);
        Part(path)
    }

    /// Renames all files, replacing existing ones.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn commit(self) -> Result<()> {
        for name in &self.names {
            let to = self.path.join(name);
            let given = fs::rename(self.hidden.path().join(name), &to);
            given.map_err(Error::io("write", &to))?;
        }
        Ok(())
    }
}

/// One of its files. It is only open while bytes are added, as a bag may have more topics than a process may have open
/// files; write large blocks.
#[derive(Debug)]
pub(crate) struct Part(PathBuf);

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut file = File::options().create(true).append(true).open(&self.0)?;
        file.write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The longest file name without extension, in bytes, that every system supports.
const LONGEST: usize = 200;

/// The name of a topic's file: `/base/scan` is `base.scan`. A character that is neither letter, digit, `_` nor `-` is
/// written as its bytes, `%2E`, so that no name leaves the folder; different topics have different names, except for a
/// leading slash.
pub(crate) fn file_stem(topic: &str) -> String {
    let mut stem = String::new();
    for byte in topic.strip_prefix('/').unwrap_or(topic).bytes() {
        match byte {
            b'/' => stem.push('.'),
            b if b.is_ascii_alphanumeric() || b == b'_' || b == b'-' => stem.push(char::from(b)),
            b => {
                // Writing to a string cannot fail.
                let _ = write!(stem, "%{b:02X}");
            }
        }
    }
    stem.truncate(LONGEST);
    // Neither hidden nor empty, nor an option of a command.
    if stem.is_empty() || stem.starts_with(['.', '-']) {
        stem.insert(0, '_');
    }
    stem
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_topic_leaves_the_folder() {
        assert_eq!(file_stem("/base/scan"), "base.scan");
        assert_eq!(
            file_stem("/../../etc/x y"),
            "_%2E%2E.%2E%2E.etc.x%20y".trim_start_matches('_')
        );
        assert_eq!(file_stem("//a"), "_.a");
        assert_eq!(file_stem("/"), "_");
        assert_eq!(file_stem(&"/a".repeat(500)).len(), LONGEST);
    }

    #[test]
    fn files_appear_together_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let write = |word: &[u8]| {
            let mut folder = Folder::create(&dir.path().join("t")).unwrap();
            for name in ["a", "b"] {
                let mut part = folder.file(name.to_owned());
                part.write_all(word).unwrap();
                part.write_all(b"!").unwrap();
            }
            folder
        };
        drop(write(b"lost"));
        assert!(!dir.path().join("t").exists());
        write(b"old").commit().unwrap();
        write(b"new").commit().unwrap();
        assert_eq!(fs::read(dir.path().join("t/b")).unwrap(), b"new!");
        assert_eq!(fs::read_dir(dir.path().join("t")).unwrap().count(), 2);
    }
}
