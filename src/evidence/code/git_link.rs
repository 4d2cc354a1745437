//! The repository of a folder whose `.git` is a file or a link: work trees and submodules have such a file, and their
//! repository refers back to them. A file that names a foreign repository is not followed.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// The longest `.git` file that is read, in bytes.
const LONGEST: u64 = 8 << 10;

/// Whether the nearest `.git` at a folder or above it is a folder, or a file to which the named repository refers back;
/// true if there is none. `setting` reads a value from a configuration file.
pub(super) fn is_own(folder: &Path, setting: impl Fn(&Path, &str) -> Option<String>) -> bool {
    let Ok(folder) = folder.canonicalize() else {
        return false;
    };
    let mut entries = folder.ancestors().map(|above| (above, above.join(".git")));
    let found =
        entries.find_map(|(above, entry)| Some((above, fs::symlink_metadata(&entry).ok()?, entry)));
    match found {
        None => true,
        Some((_, about, _)) if about.is_dir() => true,
        Some((tree, about, entry)) if about.is_file() => repository(&entry)
            .is_some_and(|git| is_work_tree(&git, &entry) || is_submodule(&git, tree, setting)),
        Some(_) => false,
    }
}

/// The most entries of a repository that are checked.
const MOST_ENTRIES: usize = 1 << 18;

/// Whether the nearest `.git` folder at a folder or above it contains only files, folders and links: git would block
/// forever on a pipe.
pub(super) fn is_plain(folder: &Path) -> bool {
    let Ok(folder) = folder.canonicalize() else {
        return true;
    };
    let mut above = folder.ancestors().map(|above| above.join(".git"));
    let mut open: Vec<PathBuf> = above.find(|git| git.is_dir()).into_iter().collect();
    let mut left = MOST_ENTRIES;
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder)
            .into_iter()
            .flatten()
            .flatten()
            .take(left)
        {
            left -= 1;
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => open.push(entry.path()),
                Ok(kind) if kind.is_file() => {}
                // The target of a link.
                _ if fs::metadata(entry.path()).is_ok_and(|m| !m.is_file() && !m.is_dir()) => {
                    return false;
                }
                _ => {}
            }
        }
    }
    true
}

/// The repository that a `.git` file names.
fn repository(entry: &Path) -> Option<PathBuf> {
    let text = text(entry)?;
    let path = text.strip_prefix("gitdir:")?.trim();
    Some(entry.parent()?.join(path))
}

/// Whether a repository lists this `.git` file as that of its work tree.
fn is_work_tree(git: &Path, entry: &Path) -> bool {
    let named = text(&git.join("gitdir"));
    named.is_some_and(|named| is_same(&git.join(named.trim()), entry))
}

/// Whether a repository's configuration names this folder as its work tree, as those of submodules do.
fn is_submodule(git: &Path, tree: &Path, setting: impl Fn(&Path, &str) -> Option<String>) -> bool {
    let named = setting(&git.join("config"), "core.worktree");
    named.is_some_and(|named| is_same(&git.join(named), tree))
}

fn is_same(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    real(a).is_some_and(|a| Some(a) == real(b))
}

/// The text of a small file.
fn text(path: &Path) -> Option<String> {
    let mut text = String::new();
    // A pipe would block.
    let file = path.is_file().then(|| fs::File::open(path).ok())??;
    file.take(LONGEST).read_to_string(&mut text).ok()?;
    Some(text)
}
