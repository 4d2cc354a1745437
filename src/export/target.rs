//! The targets of outputs: names with window numbers, checked before anything is read.

use std::ffi::OsStr;
use std::fs;
use std::path::{Component, Path, PathBuf};

use super::FORMATS;
use super::sink::probe;
use crate::bag;
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;

/// The placeholder for the window's index in a name.
const NUMBER: &str = "{n}";

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
    fn may_be(&self, path: &Path) -> bool {
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
    fn may_meet(&self, other: &Self) -> bool {
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
fn same_file(a: &Path, b: &Path) -> bool {
    resolved(a) == resolved(b)
}

// Checks, before anything is read, that outputs can be written to their targets.

/// Checks every output file before the inputs are read: no duplicates, no kept files, and every folder can be created
/// and written. Leaves no files.
///
/// Kept are files with their `SQLite` companions, and in a folder all files without the extension of an output.
///
/// # Errors
/// [`Error::Usage`] if targets collide with each other or a kept file, [`Error::Output`] or [`Error::Io`] if a folder
/// cannot be written.
pub(crate) fn check(targets: &[Target], kept: &[PathBuf]) -> Result<()> {
    for (at, target) in targets.iter().enumerate() {
        let name = target.path().display();
        if let Some(other) = targets[..at].iter().find(|t| t.may_meet(target)) {
            let what = if *other == *target {
                format!("`{name}` is requested twice")
            } else {
                format!(
                    "`{name}` and `{}` may be the same file",
                    other.path().display()
                )
            };
            return Err(Error::usage(what, "give every output its own name"));
        }
        if let Some(path) = kept.iter().find(|path| would_harm(target, path)) {
            let whose = if path.is_dir() {
                format!("a file of `{}`", path.display())
            } else {
                "an input".to_owned()
            };
            let what = format!("`{name}` would overwrite {whose}");
            return Err(Error::usage(what, "give the output another name"));
        }
        check_place(target)?;
    }
    Ok(())
}

/// Checks a folder for tables named after the input, with this extension, before anything is created in it: no input in
/// it may have a table's name, and all tables in it must be from an earlier run, which wrote an index of them.
///
/// # Errors
/// [`Error::Usage`] if a table might replace an input or another file.
pub(crate) fn check_folder(folder: &Path, ending: &str, kept: &[PathBuf]) -> Result<()> {
    let is_like_a_table = |path: &Path| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case(ending))
            && same_file(folder_of(path), folder)
    };
    let clash = kept.iter().find(|path| {
        is_like_a_table(path) || path.canonicalize().is_ok_and(|path| is_like_a_table(&path))
    });
    let Some(path) = clash else {
        let beside = fs::read_dir(folder).into_iter().flatten().flatten();
        let is_others = beside
            .map(|entry| entry.path())
            .any(|path| is_like_a_table(&path));
        if !is_others || folder.join(format!("index.{ending}")).exists() {
            return Ok(());
        }
        let what = format!("`{}` contains tables of another origin", folder.display());
        return Err(Error::usage(what, "give a new folder"));
    };
    let (folder, path) = (folder.display(), path.display());
    let what = format!("a table in `{folder}` might overwrite `{path}`, which is read");
    Err(Error::usage(what, "give another folder"))
}

/// The suffixes of a database and of its `SQLite` companion files.
const BESIDE: [&str; 4] = ["", "-wal", "-shm", "-journal"];

/// Whether writing `target` would modify the kept file or folder at `path`.
fn would_harm(target: &Target, path: &Path) -> bool {
    if path.is_dir() {
        return existing(target).iter().any(|file| is_kept_in(path, file));
    }
    let mut beside = BESIDE.iter().map(|end| with_suffix(path, end));
    beside.any(|path| target.may_be(&path))
}

/// The existing files that would be replaced.
fn existing(target: &Target) -> Vec<PathBuf> {
    let Target::Path(path) = target else {
        return Vec::new();
    };
    if !target.is_numbered() {
        return vec![path.clone()];
    }
    let beside = fs::read_dir(folder_of(path)).into_iter().flatten();
    let files = beside.filter_map(|entry| Some(entry.ok()?.path()));
    files.filter(|file| target.may_be(file)).collect()
}

/// Whether `file` exists inside `folder` and has a bag's extension or none of an output.
fn is_kept_in(folder: &Path, file: &Path) -> bool {
    let (Ok(folder), Ok(file)) = (folder.canonicalize(), file.canonicalize()) else {
        return false;
    };
    let ending = file.extension().unwrap_or_default().to_string_lossy();
    let is_ending = |word: &str| ending.eq_ignore_ascii_case(word.trim_start_matches('.'));
    let is_output = FORMATS.iter().any(|f| is_ending(f.word));
    // MCAP is both.
    let mut bags = bag::FORMATS.iter().flat_map(|f| f.extensions);
    file.starts_with(folder) && (bags.any(|word| is_ending(word)) || !is_output)
}

fn check_place(target: &Target) -> Result<()> {
    let Target::Path(path) = target else {
        return Ok(());
    };
    let refuse = |reason: &str, hint: &str| Err(Error::output(path, reason, hint));
    if path.file_name().is_none() || path.is_dir() {
        return refuse("it is a folder", "give a file in it");
    }
    let is_text = path.file_name().is_some_and(|name| name.to_str().is_some());
    if Target::Path(path.clone()).is_numbered() && !is_text {
        return refuse(
            "`{n}` is in a name that is not UTF-8",
            "give it a name in UTF-8, or omit `{n}`",
        );
    }
    let folder = folder_of(path);
    if folder.to_string_lossy().contains(NUMBER) {
        return refuse("`{n}` is in the folder", "put `{n}` into the file's name");
    }
    let there = folder
        .ancestors()
        .find(|f| f.exists() || *f == Path::new(""));
    let there = there
        .filter(|f| *f != Path::new(""))
        .unwrap_or(Path::new("."));
    if !there.is_dir() {
        return refuse(
            &format!("`{}` is not a folder", there.display()),
            "give an existing folder, or one that can be created",
        );
    }
    if is_special(path) {
        return Ok(());
    }
    probe(there).map_err(Error::io("write into", there))
}

/// Creates the folder of `target` if necessary.
///
/// # Errors
/// A system error.
pub(crate) fn make_folder(target: &Target) -> Result<()> {
    match target {
        Target::Stdout => Ok(()),
        Target::Path(path) => {
            let folder = folder_of(path);
            fs::create_dir_all(folder).map_err(Error::io("create the folder", folder))
        }
    }
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

    #[test]
    fn an_input_is_never_overwritten() -> Result<()> {
        let folder = tempfile::tempdir().map_err(Error::io("make", Path::new("tmp")))?;
        let file = |name: &str| folder.path().join(name);
        fs::write(file("7.json"), "{}").map_err(Error::io("write", Path::new("7.json")))?;
        let clash = |out: &str| {
            let target = Target::Path(file(out));
            check(&[target], &[file("7.json")]).is_err_and(|e| e.is_usage())
        };
        assert!(clash("7.json"));
        assert!(clash("{n}.json"));
        assert!(!clash("8.json"));
        assert!(!clash("x{n}.json"));
        Ok(())
    }

    #[test]
    fn companion_files_of_an_input_are_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let bag = folder.path().join("bag");
        fs::create_dir(&bag).unwrap();
        for name in ["bag_0.db3", "bag_0.db3-wal", "metadata.yaml", "old.gif"] {
            fs::write(bag.join(name), "").unwrap();
        }
        let clash = |out: &str, kept: &Path| {
            let target = Target::Path(bag.join(out));
            check(&[target], &[kept.to_owned()]).is_err_and(|e| e.is_usage())
        };
        for out in ["bag_0.db3", "bag_0.db3-wal", "metadata.yaml", "bag_{n}.db3"] {
            assert!(clash(out, &bag), "{out}");
        }
        assert!(!clash("old.gif", &bag) && !clash("new.gif", &bag));
        let file = bag.join("bag_0.db3");
        assert!(clash("bag_0.db3-wal", &file) && clash("bag_0.db3-journal", &file));
        assert!(!clash("metadata.gif", &file));
    }

    #[test]
    fn no_two_outputs_share_a_name() {
        let twice = [Target::Stdout, Target::Stdout];
        assert!(check(&twice, &[]).is_err_and(|e| e.is_usage()));
        let twice = [Target::parse("a.gif"), Target::parse("./a.gif")];
        assert!(check(&twice, &[]).is_err_and(|e| e.is_usage()));
        let twice = [Target::parse("a{n}.svg"), Target::parse("a0.svg")];
        assert!(check(&twice, &[]).is_err_and(|e| e.is_usage()));
    }

    #[test]
    fn a_missing_folder_is_accepted_and_a_check_leaves_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let deep = Target::Path(folder.path().join("a/b/{n}.svg"));
        check(std::slice::from_ref(&deep), &[]).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        make_folder(&deep).unwrap();
        assert!(folder.path().join("a/b").is_dir());
    }

    #[test]
    fn folders_and_files_are_distinguished() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("file"), "").unwrap();
        let refused = |name: &str| check(&[Target::Path(folder.path().join(name))], &[]).is_err();
        assert!(refused(""));
        assert!(refused("file/a.gif"));
        assert!(refused("{n}/a.gif"));
        assert!(!refused("file"));
    }
}
