//! Where outputs go: names with window numbers, checked before anything is read, and files that appear whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};

/// What stands for the window's index in a name.
pub(crate) const NUMBER: &str = "{n}";

/// Where one output goes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// Standard output (`-`).
    Stdout,
    /// A file, or a file per window where the name holds `{n}`.
    Path(PathBuf),
}

impl Target {
    /// Reads a target as the user writes it: `-`, `out/a.gif`, `frames/{n}.svg`.
    pub fn parse(text: &str) -> Self {
        match text {
            "-" => Self::Stdout,
            path => Self::Path(path.into()),
        }
    }

    /// What stands behind the name's last point, in lower case; `None` for standard output and names without one.
    pub fn extension(&self) -> Option<String> {
        match self {
            Self::Stdout => None,
            Self::Path(path) => Some(path.extension()?.to_string_lossy().to_lowercase()),
        }
    }

    /// Whether its name holds `{n}`, so that every window gets a file.
    pub fn is_numbered(&self) -> bool {
        self.path().to_string_lossy().contains(NUMBER)
    }

    /// Refuses `{n}`, with the reason why this format has one file.
    ///
    /// # Errors
    /// [`Error::Usage`] for a name with `{n}`.
    pub fn must_be_one(&self, reason: &str) -> Result<()> {
        if !self.is_numbered() {
            return Ok(());
        }
        let what = format!("`{}` asks for a file per window", self.path().display());
        Err(Error::usage(what, format!("{reason}: leave `{{n}}` out")))
    }

    /// The file of window `index`, zero-padded so that the names of all `windows` sort in their order.
    #[must_use]
    pub fn numbered(&self, index: usize, windows: usize) -> Self {
        let digits = windows.saturating_sub(1).to_string().len();
        let number = format!("{index:0digits$}");
        match self {
            Self::Path(path) if self.is_numbered() => {
                Self::Path(path.to_string_lossy().replace(NUMBER, &number).into())
            }
            other => other.clone(),
        }
    }

    /// The same name with `word` before its extension: `x.csv` becomes `x.edges.csv`.
    #[must_use]
    pub fn with_word(&self, word: &str) -> Self {
        match self {
            Self::Stdout => Self::Stdout,
            Self::Path(path) => {
                let extension = self.extension().unwrap_or_default();
                Self::Path(path.with_extension(format!("{word}.{extension}")))
            }
        }
    }

    /// Its path; `-` for standard output. For messages.
    pub fn path(&self) -> &Path {
        match self {
            Self::Stdout => Path::new("-"),
            Self::Path(path) => path,
        }
    }

    /// Whether `path` is this file or one of its windows' files.
    pub(crate) fn may_be(&self, path: &Path) -> bool {
        let Self::Path(own) = self else { return false };
        if !self.is_numbered() {
            return same_file(own, path);
        }
        let (Some(own_name), Some(name)) = (own.file_name(), path.file_name()) else {
            return false;
        };
        let (own_name, name) = (own_name.to_string_lossy(), name.to_string_lossy());
        let Some((before, after)) = own_name.split_once(NUMBER) else {
            return false;
        };
        let middle = name
            .strip_prefix(before)
            .and_then(|rest| rest.strip_suffix(after));
        middle.is_some_and(|m| m.starts_with(|c: char| c.is_ascii_digit()))
            && same_file(folder_of(own), folder_of(path))
    }
}

/// The folder a path stands in: `.` for a bare name.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Whether `path` is there and neither a file nor a folder: a device or a pipe, which is written in place.
pub(crate) fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Whether two paths lead to the same place; the last part need not exist.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    fn full(path: &Path) -> PathBuf {
        path.canonicalize().unwrap_or_else(|_| {
            let folder = folder_of(path);
            let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
            path.file_name()
                .map_or(folder.clone(), |name| folder.join(name))
        })
    }
    full(a) == full(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(name: &str, index: usize, windows: usize) -> String {
        let target = Target::parse(name).numbered(index, windows);
        target.path().display().to_string()
    }

    #[test]
    fn numbers_are_as_wide_as_the_last_one() {
        assert_eq!(numbered("f/{n}.svg", 7, 10), "f/7.svg");
        assert_eq!(numbered("f/{n}.svg", 7, 11), "f/07.svg");
        assert_eq!(numbered("a_{n}.png", 0, 1), "a_0.png");
        assert_eq!(numbered("plain.png", 3, 60), "plain.png");
    }

    #[test]
    fn tables_get_a_word_before_their_extension() {
        let table = Target::parse("out/x.csv").with_word("edges");
        assert_eq!(table, Target::parse("out/x.edges.csv"));
    }
}
