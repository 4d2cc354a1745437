//! Declarations in the robot's source code: names come from the bag, edges from the code. Nothing is executed.
//!
//! In: the files of a workspace. Out: the edges that its nodes declare. Begin with [`read`]: `files` finds the files, `cpp` and
//! `python` make declarations of each, `workspace` nodes of these, and `matching` chooses those that the bag confirms.
//!
//! A node's topics are almost always literal in its code, but the code does not show which nodes ran. So a node named
//! in the bag gets the publishers and subscribers that its code declares, if topic and type are recorded under exactly
//! these names. Evaluated on 182 public repositories and 242 bags; `matching` states the precision.

mod cpp;
mod declaration;
mod files;
pub(crate) mod matching;
mod packages;
mod python;
mod workspace;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::base::error::Result;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::words;
use crate::evidence::given::launch;
use declaration::FileCode;
use files::{FileKind, Files, SourceFile};
use workspace::{FileDeclaration, Instance, Workspace};

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
    let files = files::of_folder(&wanted.folder)?;
    let mut notices = Vec::new();
    if files.is_cut {
        let text = format!(
            "`{}` contains more than {} or {} of source code; the rest was not read",
            wanted.folder.display(),
            words::count(files::MOST_FILES, "file"),
            words::bytes(files::MOST_BYTES as u64)
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
    let packages = packages::packages(&files.list);
    let (mut code, mut launches) = (Vec::new(), Vec::new());
    for (file, read) in files.list.iter().zip(in_parallel(&files.list)) {
        match read {
            FileRead::Code(found) => code.push((file.path.clone(), found)),
            FileRead::Launch(nodes) => launches.push((file.path.clone(), nodes)),
            FileRead::Nothing => {}
        }
    }
    Workspace::new(packages, code, launches)
}

/// The result of reading one file.
enum FileRead {
    Code(FileCode),
    Launch(Vec<launch::LaunchedNode>),
    Nothing,
}

fn read_file(file: &SourceFile) -> FileRead {
    match files::kind(&file.path) {
        Some(FileKind::Python | FileKind::Script) => FileRead::Code(python::read(&file.text)),
        Some(FileKind::Cpp) => FileRead::Code(cpp::read(&file.text)),
        Some(FileKind::Launch) => {
            let path = Path::new(&file.path);
            // An unreadable launch file starts no nodes.
            let tree = launch::tree_of(path, &file.text).ok().flatten();
            tree.map_or(FileRead::Nothing, |tree| {
                FileRead::Launch(launch::nodes(path, &tree))
            })
        }
        _ => FileRead::Nothing,
    }
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
    let mut all: Vec<(usize, FileRead)> = std::thread::scope(|scope| {
        let readers: Vec<_> = (0..READERS.min(files.len()))
            .map(|_| scope.spawn(work))
            .collect();
        readers
            .into_iter()
            .flat_map(|reader| reader.join().unwrap_or_default())
            .collect()
    });
    all.sort_by_key(|(at, _)| *at);
    // If a reader panics, its files are missing; the others keep their positions.
    let mut read: Vec<FileRead> = files.iter().map(|_| FileRead::Nothing).collect();
    for (at, file) in all {
        read[at] = file;
    }
    read
}
