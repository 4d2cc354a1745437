//! The register of temporary files and folders, which are removed if a signal ends the process before their owners
//! remove them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

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
pub(crate) fn remove() {
    for path in all().iter() {
        // A path that cannot be removed is left.
        let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir_all(path));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        remove();
        let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }
}
