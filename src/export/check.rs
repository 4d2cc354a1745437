//! Whether outputs may be written where they are asked for, told before anything is read.

use std::fs;
use std::path::{Path, PathBuf};

use super::sink::probe;
use super::target::{NUMBER, Target, folder_of, is_special, same_file};
use crate::base::error::{Error, Result};

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
    if is_special(path) {
        return Ok(());
    }
    probe(there).map_err(Error::io("write into", there))
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
