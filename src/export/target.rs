//! The targets of outputs: names with window numbers, checked before anything is read.

use std::ffi::OsStr;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::base::error::{Error, Result};

/// The placeholder for the window's index in a name.
pub(crate) const NUMBER: &str = "{n}";

/// The target of one output.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// Standard output (`-`).
    Stdout,
    /// A file, or a file per window if the name contains `{n}`.
    Path(PathBuf),
}

impl Target {
    /// Parses a target: `-`, `out/a.gif`, `frames/{n}.svg`; any file name.
    pub fn parse(text: impl AsRef<OsStr>) -> Self {
        match text.as_ref() {
            text if text == "-" => Self::Stdout,
            path => Self::Path(path.into()),
        }
    }

    /// The extension in lower case; `None` for standard output and names without one.
    pub fn extension(&self) -> Option<String> {
        match self {
            Self::Stdout => None,
            Self::Path(path) => Some(path.extension()?.to_string_lossy().to_lowercase()),
        }
    }

    /// Whether its name contains `{n}`, so that every window gets a file.
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
        let what = format!("`{}` requests a file per window", self.path().display());
        Err(Error::usage(what, format!("{reason}: omit `{{n}}`")))
    }

    /// The file of window `index`, zero-padded so that the names of all `windows` sort in their order.
    #[must_use]
    pub fn numbered(&self, index: usize, windows: usize) -> Self {
        let digits = windows.saturating_sub(1).to_string().len();
        let number = format!("{index:0digits$}");
        match self {
            Self::Path(path) => match path.file_name().and_then(OsStr::to_str) {
                Some(name) => Self::Path(path.with_file_name(name.replace(NUMBER, &number))),
                None => self.clone(),
            },
            Self::Stdout => Self::Stdout,
        }
    }

    /// The same name with `word` before its extension, by default `format`: `x.csv` becomes `x.edges.csv`, and so does
    /// `x`.
    #[must_use]
    pub fn with_word(&self, word: &str, format: &str) -> Self {
        match self {
            Self::Stdout => Self::Stdout,
            Self::Path(path) => {
                let extension = self.extension();
                let extension = extension.as_deref().unwrap_or(format);
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
        let (before, after) = around(&own_name);
        let middle = name
            .strip_prefix(before)
            .and_then(|rest| rest.strip_suffix(after));
        middle.is_some_and(|m| m.starts_with(|c: char| c.is_ascii_digit()))
            && same_file(folder_of(own), folder_of(path))
    }

    /// Whether files of both targets may be the same.
    pub(crate) fn may_meet(&self, other: &Self) -> bool {
        let (Self::Path(own), Self::Path(path)) = (self, other) else {
            return self == other;
        };
        match (self.is_numbered(), other.is_numbered()) {
            (_, false) => self.may_be(path),
            (false, true) => other.may_be(own),
            (true, true) => {
                let names =
                    [own, path].map(|p| p.file_name().unwrap_or_default().to_string_lossy());
                let [(a, b), (c, d)] = [around(&names[0]), around(&names[1])];
                let digits = |rest: &str| rest.bytes().all(|b| b.is_ascii_digit());
                let begins = |a: &str, b: &str| a.strip_prefix(b).is_some_and(digits);
                let ends = |a: &str, b: &str| a.strip_suffix(b).is_some_and(digits);
                (begins(a, c) || begins(c, a))
                    && (ends(b, d) || ends(d, b))
                    && same_file(folder_of(own), folder_of(path))
            }
        }
    }
}

/// The parts of a name before its first `{n}` and after its last.
fn around(name: &str) -> (&str, &str) {
    let before = name.split(NUMBER).next().unwrap_or_default();
    let after = name.rsplit(NUMBER).next().unwrap_or_default();
    (before, after)
}

/// The folder of a path: `.` for a bare name.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Whether `path` exists and is neither a file nor a folder: a device or a pipe, which is written in place.
pub(crate) fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// The path without links and `..`: resolved by the system for existing folders, by name for others.
pub(crate) fn resolved(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut full = PathBuf::new();
    for part in whole.components() {
        match part {
            Component::ParentDir => drop(full.pop()),
            part => full.push(part),
        }
        full = full.canonicalize().unwrap_or(full);
    }
    full
}

/// Whether two paths refer to the same file, or will once missing folders are created.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    resolved(a) == resolved(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(name: &str, index: usize, windows: usize) -> String {
        let target = Target::parse(name).numbered(index, windows);
        target.path().display().to_string()
    }

    #[test]
    fn numbers_are_zero_padded_to_the_last() {
        assert_eq!(numbered("f/{n}.svg", 7, 10), "f/7.svg");
        assert_eq!(numbered("f/{n}.svg", 7, 11), "f/07.svg");
        assert_eq!(numbered("a_{n}.png", 0, 1), "a_0.png");
        assert_eq!(numbered("plain.png", 3, 60), "plain.png");
    }

    #[test]
    fn tables_get_their_name_before_the_extension() {
        let table = |name: &str| Target::parse(name).with_word("edges", "csv");
        assert_eq!(table("out/x.csv"), Target::parse("out/x.edges.csv"));
        assert_eq!(table("out/x"), Target::parse("out/x.edges.csv"));
    }

    #[test]
    fn numbered_targets_collide_if_their_names_can() {
        let meet = |a: &str, b: &str| {
            let (a, b) = (Target::parse(a), Target::parse(b));
            assert_eq!(a.may_meet(&b), b.may_meet(&a));
            a.may_meet(&b)
        };
        assert!(meet("a{n}.svg", "a0.svg"));
        assert!(meet("a{n}.svg", "./a{n}.svg"));
        assert!(meet("a{n}.svg", "a1{n}.svg"));
        assert!(meet("a{n}.svg", "a{n}0.svg"));
        assert!(meet("{n}-{n}.svg", "3-3.svg"));
        assert!(!meet("a{n}.svg", "a.svg"));
        assert!(!meet("a{n}.svg", "b{n}.svg"));
        assert!(!meet("a{n}.svg", "a{n}.png"));
        assert!(!meet("a{n}.svg", "x/a0.svg"));
    }

    #[test]
    #[cfg(unix)]
    fn names_need_not_be_utf8() {
        use std::os::unix::ffi::OsStrExt as _;
        let name = OsStr::from_bytes(b"f\xff/{n}.svg");
        let first = Target::parse(name).numbered(3, 10);
        assert_eq!(first.path().as_os_str().as_bytes(), b"f\xff/3.svg");
    }
}
