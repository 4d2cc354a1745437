//! Declarations in the robot's source code: names come from the bag, edges from the code. Nothing is executed.
//!
//! In: the files of a workspace. Out: the edges that its nodes declare. Begin with [`read`]: it finds the files, `cpp` and
//! `python` make declarations of each, `workspace` nodes of these, and `matching` chooses those that the bag confirms.
//!
//! A node's topics are almost always literal in its code, but the code does not show which nodes ran. So a node named
//! in the bag gets the publishers and subscribers that its code declares, if topic and type are recorded under exactly
//! these names. Evaluated on 182 public repositories and 242 bags; `matching` states the precision.

mod cpp;
mod declaration;
pub(crate) mod matching;
mod python;
mod workspace;

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use declaration::FileCode;
use workspace::{FileDeclaration, Instance, Workspace};

use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::words;
use crate::evidence::given::launch;

/// The source code to read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceCode {
    /// A workspace or repository, of which the working tree is read.
    pub folder: PathBuf,
    /// Whether the only possible declaration counts too, although the bag does not name its node.
    pub infers: bool,
}

/// The source code after reading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Code {
    instances: Vec<Instance>,
    /// Every declaration in the code.
    places: Vec<FileDeclaration>,
    files: usize,
    packages: usize,
    infers: bool,
    notices: Vec<Notice>,
}

/// Reads source code.
///
/// # Errors
/// If the folder cannot be read.
pub fn read(wanted: &SourceCode) -> Result<Code> {
    let files = of_folder(&wanted.folder)?;
    let mut notices = Vec::new();
    if files.is_cut {
        let text = format!(
            "`{}` contains more than {} or {} of source code; the rest was not read",
            wanted.folder.display(),
            words::count(MOST_FILES, "file"),
            words::bytes(MOST_BYTES as u64)
        );
        notices.push(Notice::new(NoticeKind::Note, text));
    }
    let left_out = [
        (
            files.too_long,
            "files of source code longer than 600 kB were left out",
        ),
        (files.too_deep, "folders nested too deep were left out"),
    ];
    for (count, text) in left_out.into_iter().filter(|(count, _)| *count > 0) {
        notices.push(Notice::counted(NoticeKind::Note, count as u64, text));
    }
    let workspace = workspace(&files);
    Ok(Code {
        instances: workspace.instances(),
        places: workspace.places(),
        files: files.list.len(),
        packages: workspace.packages.len(),
        infers: wanted.infers,
        notices,
    })
}

fn workspace(files: &Files) -> Workspace {
    let packages = workspace::packages(&files.list);
    let (mut code, mut launches) = (Vec::new(), Vec::new());
    for (file, read) in files.list.iter().zip(in_parallel(&files.list)) {
        code.push((file.path.clone(), read.code));
        launches.push((file.path.clone(), read.launched));
    }
    Workspace::new(packages, code, launches)
}

/// The result of reading one file.
#[derive(Default)]
struct FileRead {
    code: FileCode,
    /// The nodes that a launch file may start.
    launched: Vec<launch::LaunchedNode>,
}

fn read_file(file: &SourceFile) -> FileRead {
    let mut read = FileRead::default();
    match kind(&file.path) {
        Some(FileKind::Python | FileKind::Script) => read.code = python::read(&file.text),
        Some(FileKind::Cpp) => read.code = cpp::read(&file.text),
        Some(FileKind::Launch) => {
            let path = Path::new(&file.path);
            // An unreadable launch file starts no nodes.
            if let Ok(Some(tree)) = launch::tree_of(path, &file.text) {
                read.launched = launch::nodes(path, &tree);
            }
        }
        _ => {}
    }
    read
}

/// The number of files read at once: more do not help, as the largest file dominates.
const READERS: usize = 4;

/// Reads all files, in their order.
fn in_parallel(files: &[SourceFile]) -> Vec<FileRead> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            match files.get(at) {
                Some(file) => done.push((at, read_file(file))),
                None => return done,
            }
        }
    };
    let all: Vec<(usize, FileRead)> = std::thread::scope(|scope| {
        let readers = 0..READERS.min(files.len());
        let readers: Vec<_> = readers.map(|_| scope.spawn(work)).collect();
        let readers = readers.into_iter();
        let read = readers.flat_map(|reader| reader.join().unwrap_or_default());
        read.collect()
    });
    // If a reader panics, its files are missing; the others keep their positions.
    let mut read: Vec<FileRead> = files.iter().map(|_| FileRead::default()).collect();
    for (at, file) in all {
        read[at] = file;
    }
    read
}

// The relevant files of a workspace, found without following links, bounded in number and bytes.

/// A file of the workspace.
#[derive(Debug)]
struct SourceFile {
    /// The path below the workspace, with slashes.
    path: String,
    text: String,
}

/// The kind of a file, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum FileKind {
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
const MOST_FILES: usize = 50_000;

/// The most text that is read, in bytes: ten times the largest workspace seen.
const MOST_BYTES: usize = 200 << 20;

/// The deepest nesting of folders that is entered, as folders may be mounted in circles: workspaces nest a dozen deep.
const DEEPEST: usize = 40;

/// Files, and whether there were more than the limits allow.
#[derive(Debug, Default)]
struct Files {
    list: Vec<SourceFile>,
    is_cut: bool,
    /// The number of files that are too long and of folders nested too deep.
    too_long: usize,
    too_deep: usize,
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
fn kind(path: &str) -> Option<FileKind> {
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
fn of_folder(folder: &Path) -> Result<Files> {
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
                } else if let Some(bytes) = read_bytes(&entry.path()) {
                    files.add(path, &bytes);
                }
            }
        }
    }
    files.list.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}

/// The bytes of a file; `None` if it cannot be read.
fn read_bytes(path: &Path) -> Option<Vec<u8>> {
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
