//! The relevant files of a workspace, found without following links, bounded in number and bytes.

use std::fs;
use std::io::Read as _;
use std::path::Path;

use crate::base::error::{Error, Result};

/// A file of the workspace.
#[derive(Debug)]
pub(super) struct SourceFile {
    /// The path below the workspace, with slashes.
    pub(super) path: String,
    pub(super) text: String,
}

/// The kind of a file, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum FileKind {
    Python,
    Cpp,
    Launch,
    /// `package.xml`
    Package,
    /// `CMakeLists.txt`
    Cmake,
    /// `setup.py` or `setup.cfg`
    Setup,
    /// A program without a file extension, which may be Python.
    Script,
}

/// The longest file that is read, in bytes: longer ones are generated or data.
const LONGEST: u64 = 600_000;

/// The most files that are read: five times those of the largest workspace seen; a folder of everything, such as `/`, has more.
pub(super) const MOST_FILES: usize = 50_000;

/// The most text that is read, in bytes: ten times the largest workspace seen.
pub(super) const MOST_BYTES: usize = 200 << 20;

/// The deepest nesting of folders that is entered, as folders may be mounted in circles: workspaces nest a dozen deep.
const DEEPEST: usize = 40;

/// Files, and whether there were more than the limits allow.
#[derive(Debug, Default)]
pub(super) struct Files {
    pub(super) list: Vec<SourceFile>,
    pub(super) is_cut: bool,
    /// The number of files that are too long and of folders nested too deep.
    pub(super) too_long: usize,
    pub(super) too_deep: usize,
    bytes: usize,
}

impl Files {
    /// Adds a file if the limits allow.
    fn add(&mut self, path: String, bytes: &[u8]) {
        if self.list.len() >= MOST_FILES || self.bytes + bytes.len() > MOST_BYTES {
            self.is_cut = true;
            return;
        }
        let kind = kind(&path);
        let is_wanted = kind.is_some() && (kind != Some(FileKind::Script) || is_python(bytes));
        if is_wanted && bytes.len() as u64 <= LONGEST {
            self.bytes += bytes.len();
            let text = String::from_utf8_lossy(bytes).into_owned();
            self.list.push(SourceFile { path, text });
        }
    }
}

/// The kind of the file at a path below the workspace; `None` for irrelevant files and skipped folders.
pub(super) fn kind(path: &str) -> Option<FileKind> {
    let (folders, name) = path.rsplit_once('/').unwrap_or(("", path));
    if folders.split('/').any(is_skipped) || name.starts_with('.') {
        return None;
    }
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    match (name, ending) {
        ("package.xml", _) => Some(FileKind::Package),
        ("CMakeLists.txt", _) => Some(FileKind::Cmake),
        ("setup.py" | "setup.cfg", _) => Some(FileKind::Setup),
        (_, "launch") => Some(FileKind::Launch),
        (_, "py") if name.ends_with("launch.py") => Some(FileKind::Launch),
        (_, "xml" | "yaml" | "yml") if is_launch_name(folders, name) => Some(FileKind::Launch),
        (_, "py") => Some(FileKind::Python),
        (_, "cpp" | "cc" | "cxx" | "h" | "hpp" | "hh") => Some(FileKind::Cpp),
        (_, "") if !name.contains('.') => Some(FileKind::Script),
        _ => None,
    }
}

fn is_launch_name(folders: &str, name: &str) -> bool {
    name.ends_with(".launch.xml")
        || name.ends_with("launch.yaml")
        || name.ends_with("launch.yml")
        || name.split('.').next_back() == Some("xml") && folders.split('/').any(|f| f == "launch")
}

/// Whether a folder is skipped: with built, fetched or hidden files.
fn is_skipped(folder: &str) -> bool {
    let is_built = matches!(
        folder,
        "build" | "install" | "log" | "devel" | "node_modules" | "__pycache__" | "site-packages"
    );
    is_built || folder.starts_with('.') || folder.contains("venv")
}

/// Whether a script without a file extension is in Python.
fn is_python(bytes: &[u8]) -> bool {
    let first = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    first.starts_with(b"#!") && first.windows(6).any(|w| w == b"python")
}

/// The files below a folder. Links are not followed, and nothing but regular files is opened.
///
/// # Errors
/// If the folder itself cannot be read; unreadable files inside are left out.
pub(super) fn of_folder(folder: &Path) -> Result<Files> {
    fs::read_dir(folder).map_err(Error::io("read", folder))?;
    let mut files = Files::default();
    let mut seen = 0_usize;
    let mut open = vec![(folder.to_owned(), String::new(), 0)];
    while let Some((folder, below, depth)) = open.pop() {
        let Ok(entries) = fs::read_dir(&folder) else {
            continue;
        };
        let mut entries: Vec<_> = entries.flatten().take(MOST_FILES).collect();
        entries.sort_by_key(fs::DirEntry::file_name);
        for entry in entries {
            let (Ok(file_type), Ok(name)) = (entry.file_type(), entry.file_name().into_string())
            else {
                continue;
            };
            seen += 1;
            if seen > MOST_FILES * 4 {
                files.is_cut = true;
                return Ok(files);
            }
            let path = if below.is_empty() {
                name.clone()
            } else {
                format!("{below}/{name}")
            };
            if file_type.is_dir() && !is_skipped(&name) {
                if depth < DEEPEST {
                    open.push((entry.path(), path, depth + 1));
                } else {
                    files.too_deep += 1;
                }
            } else if file_type.is_file() && kind(&path).is_some() {
                if entry.metadata().is_ok_and(|about| about.len() > LONGEST) {
                    files.too_long += usize::from(kind(&path) != Some(FileKind::Script));
                } else if let Some(bytes) = read(&entry.path()) {
                    files.add(path, &bytes);
                }
            }
        }
    }
    files.list.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}

/// The bytes of a file; `None` if it cannot be read.
fn read(path: &Path) -> Option<Vec<u8>> {
    let file = fs::File::open(path).ok()?;
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_kinds_are_recognized_by_name() {
        for (path, expected) in [
            ("a/src/x.cpp", Some(FileKind::Cpp)),
            ("a/x.launch.py", Some(FileKind::Launch)),
            ("a/launch/x.xml", Some(FileKind::Launch)),
            ("a/config/x.yaml", None),
            ("a/scripts/talker", Some(FileKind::Script)),
            ("build/a/x.py", None),
            (".git/hooks/x.py", None),
            ("my_venv3/x.py", None),
        ] {
            assert_eq!(kind(path), expected, "{path}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_and_huge_files_are_skipped() {
        let (outside, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        fs::write(outside.path().join("secret.py"), "x = 1").unwrap();
        std::os::unix::fs::symlink(outside.path(), folder.path().join("out")).unwrap();
        std::os::unix::fs::symlink(outside.path().join("secret.py"), folder.path().join("s.py"))
            .unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("round")).unwrap();
        fs::write(folder.path().join("huge.py"), vec![b' '; 700_000]).unwrap();
        fs::write(folder.path().join("script"), "#!/usr/bin/env python\n").unwrap();
        fs::write(folder.path().join("LICENSE"), "words").unwrap();
        fs::write(folder.path().join("a.py"), [0xff, 0xfe]).unwrap();
        let mut deep = folder.path().to_owned();
        (0..=DEEPEST).for_each(|_| deep.push("d"));
        fs::create_dir_all(&deep).unwrap();
        let found = of_folder(folder.path()).unwrap();
        let paths: Vec<&str> = found.list.iter().map(|f| f.path.as_str()).collect();
        assert_eq!(paths, ["a.py", "script"]);
        assert_eq!((found.too_long, found.too_deep), (1, 1));
    }
}
