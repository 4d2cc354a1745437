//! Checks, before anything is read, that outputs can be written to their targets.

use std::fs;
use std::path::{Path, PathBuf};

use super::FORMATS;
use super::sink::probe;
use super::target::{NUMBER, Target, folder_of, is_special, same_file};
use crate::bag;
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;

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
            let path = other.path().display();
            let what = if *other == *target {
                format!("`{name}` is requested twice")
            } else {
                format!("`{name}` and `{path}` may be the same file")
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
        let own = path.extension().unwrap_or_default();
        own.eq_ignore_ascii_case(ending) && same_file(folder_of(path), folder)
    };
    let clash = kept.iter().find(|path| {
        is_like_a_table(path) || path.canonicalize().is_ok_and(|path| is_like_a_table(&path))
    });
    let Some(path) = clash else {
        let mut beside = fs::read_dir(folder).into_iter().flatten().flatten();
        let is_others = beside.any(|entry| is_like_a_table(&entry.path()));
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
        let hint = "give it a name in UTF-8, or omit `{n}`";
        return refuse("`{n}` is in a name that is not UTF-8", hint);
    }
    let folder = folder_of(path);
    if folder.to_string_lossy().contains(NUMBER) {
        return refuse("`{n}` is in the folder", "put `{n}` into the file's name");
    }
    let mut around = folder.ancestors().take_while(|f| *f != Path::new(""));
    let there = around.find(|f| f.exists()).unwrap_or(Path::new("."));
    if !there.is_dir() {
        let reason = format!("`{}` is not a folder", there.display());
        return refuse(
            &reason,
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
