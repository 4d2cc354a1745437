//! Where outputs go: names with window numbers, checked before anything is read, and files that appear whole or not at all.

mod sink;

pub use sink::Sink;

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// What stands for the window's index in a name.
const NUMBER: &str = "{n}";

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
    fn may_be(&self, path: &Path) -> bool {
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

/// Checks every target before the inputs are read: no two the same, none an input, every folder there or to be
/// made, and writable. Leaves nothing behind.
///
/// # Errors
/// [`Error::Usage`] where targets and inputs meet, [`Error::Output`] or [`Error::Io`] where a folder cannot be
/// written.
pub fn check(targets: &[Target], inputs: &[PathBuf]) -> Result<()> {
    for (at, target) in targets.iter().enumerate() {
        let name = target.path().display();
        let twice = targets[..at].iter().any(|t| match (t, target) {
            (Target::Path(a), Target::Path(b)) => same_file(a, b),
            (a, b) => a == b,
        });
        if twice {
            return Err(Error::usage(
                format!("`{name}` is asked for twice"),
                "give every output its own name",
            ));
        }
        if inputs.iter().any(|input| target.may_be(input)) {
            return Err(Error::usage(
                format!("`{name}` would overwrite an input"),
                "give the output another name",
            ));
        }
        check_place(target)?;
    }
    Ok(())
}

fn check_place(target: &Target) -> Result<()> {
    let Target::Path(path) = target else {
        return Ok(());
    };
    let refuse = |reason: String, hint: &str| {
        Err(Error::Output {
            path: path.clone(),
            reason,
            hint: hint.to_owned(),
        })
    };
    if path.file_name().is_none() || path.is_dir() {
        return refuse("it is a folder".to_owned(), "name a file in it");
    }
    let folder = folder_of(path);
    if folder.to_string_lossy().contains(NUMBER) {
        return refuse(
            "`{n}` stands in the folder".to_owned(),
            "put `{n}` into the file's name",
        );
    }
    let there = folder
        .ancestors()
        .find(|f| f.exists() || *f == Path::new(""));
    let there = there
        .filter(|f| *f != Path::new(""))
        .unwrap_or(Path::new("."));
    if !there.is_dir() {
        return refuse(
            format!("`{}` is no folder", there.display()),
            "name a folder, or one that can be made",
        );
    }
    if sink::is_special(path) {
        return Ok(());
    }
    sink::probe(there).map_err(Error::io("write into", there))
}

/// Makes the folder of `target` if it is not there.
///
/// # Errors
/// Where the system refuses.
pub fn make_folder(target: &Target) -> Result<()> {
    match target {
        Target::Stdout => Ok(()),
        Target::Path(path) => {
            let folder = folder_of(path);
            fs::create_dir_all(folder).map_err(Error::io("make the folder", folder))
        }
    }
}

/// The folder a path stands in: `.` for a bare name.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Whether two paths lead to the same place; the last part need not exist.
fn same_file(a: &Path, b: &Path) -> bool {
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
    fn no_two_outputs_share_a_name() {
        let twice = [Target::Stdout, Target::Stdout];
        assert!(check(&twice, &[]).is_err_and(|e| e.is_usage()));
        let twice = [Target::parse("a.gif"), Target::parse("./a.gif")];
        assert!(check(&twice, &[]).is_err_and(|e| e.is_usage()));
    }

    #[test]
    fn a_folder_need_not_exist_yet_and_a_check_leaves_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let deep = Target::Path(folder.path().join("a/b/{n}.svg"));
        check(std::slice::from_ref(&deep), &[]).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        make_folder(&deep).unwrap();
        assert!(folder.path().join("a/b").is_dir());
    }

    #[test]
    fn folders_and_files_are_not_taken_for_each_other() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("file"), "").unwrap();
        let refused = |name: &str| check(&[Target::Path(folder.path().join(name))], &[]).is_err();
        assert!(refused(""));
        assert!(refused("file/a.gif"));
        assert!(refused("{n}/a.gif"));
        assert!(!refused("file"));
    }
}
