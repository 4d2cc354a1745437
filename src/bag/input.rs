//! The location of a bag, its first bytes, which determine its format, and advice where they are of no bag.

use std::ffi::OsStr;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::model::{Growing, OpenOptions, Reader};
use super::source::{ByteStream, FileSource};
use crate::base::error::{Error, Result};

/// One bag to read: a path, or standard input (`-`).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Input {
    /// A file or a folder.
    Path(PathBuf),
    /// Standard input: ROS 1 or MCAP.
    Stdin,
}

impl Input {
    /// Parses an input: `-` is standard input, everything else a path.
    pub fn parse(text: impl AsRef<OsStr>) -> Self {
        let text = text.as_ref();
        if text == "-" {
            Self::Stdin
        } else {
            Self::Path(text.into())
        }
    }

    /// Whether it can be read only once: standard input, a named pipe, a device.
    pub fn is_pipe(&self) -> bool {
        match self {
            Self::Path(path) => path.exists() && !path.is_file() && !path.is_dir(),
            Self::Stdin => true,
        }
    }

    /// The bag's own name, without a path.
    pub fn name(&self) -> String {
        match self {
            Self::Path(path) => file_name(path),
            Self::Stdin => "standard input".to_owned(),
        }
    }

    /// The input as given.
    pub(crate) fn given(&self) -> String {
        match self {
            Self::Path(path) => path.display().to_string(),
            Self::Stdin => "-".to_owned(),
        }
    }
}

/// The size of an input on disk in bytes, for a folder that of its own files; `None` for pipes and inputs of
/// unknown size.
pub fn size_on_disk(input: &Input) -> Option<u64> {
    let Input::Path(path) = input else {
        return None;
    };
    let size = |path: &Path| {
        let metadata = std::fs::metadata(path).ok();
        metadata.filter(std::fs::Metadata::is_file).map(|m| m.len())
    };
    size(path).or_else(|| {
        let files = std::fs::read_dir(path).ok()?.flatten();
        Some(files.filter_map(|file| size(&file.path())).sum())
    })
}

/// Opens a bag that is still being written.
pub(crate) type Follow = fn(&Path) -> Result<Box<dyn Growing>>;

/// A row of `FORMATS`.
pub struct FormatRow {
    /// The format's name in JSON.
    pub name: &'static str,
    /// A description for people.
    pub what: &'static str,
    /// The usual file extensions. For information only: the first bytes decide.
    pub extensions: &'static [&'static str],
    /// Whether it is read at any position, and never from a pipe.
    pub(crate) needs_file: bool,
    /// Whether an input's first bytes are those of such a bag.
    pub(crate) sniff: fn(&BagPlace, &[u8]) -> bool,
    /// Whether the first and last bytes of an input of no known kind are those of such a bag whose very first are damaged.
    pub(crate) is_inside: fn(&[u8]) -> bool,
    /// Opens a reader.
    pub(crate) open: fn(BagPlace, &OpenOptions) -> Result<Box<dyn Reader>>,
    /// Opens a reader of a bag that is still being written.
    pub(crate) follow: Option<Follow>,
}

/// The location of a bag, opened.
pub(crate) enum BagPlace {
    /// A folder.
    Folder(PathBuf),
    /// A regular file.
    File(FileSource),
    /// A pipe: its name and its bytes.
    Pipe(String, ByteStream<'static>),
}

/// The number of first bytes needed to recognize a format.
pub(crate) const HEAD: usize = 512;

/// Opens an input and only determines its kind.
pub(crate) fn place(input: &Input) -> Result<BagPlace> {
    let path = match input {
        Input::Path(path) => path,
        Input::Stdin => {
            let stream = ByteStream::of_reader(io::stdin());
            return Ok(BagPlace::Pipe(input.name(), stream));
        }
    };
    let meta = path.metadata().map_err(Error::io("read", path))?;
    if meta.is_dir() {
        return Ok(BagPlace::Folder(path.clone()));
    }
    if meta.is_file() {
        return FileSource::open(path).map(BagPlace::File);
    }
    let pipe = File::open(path).map_err(Error::io("read", path))?;
    Ok(BagPlace::Pipe(file_name(path), ByteStream::of_reader(pipe)))
}

/// The first bytes, at most so many; none of a folder.
pub(crate) fn head(place: &mut BagPlace, most: usize) -> Result<Vec<u8>> {
    match place {
        BagPlace::Folder(_) => Ok(Vec::new()),
        BagPlace::File(source) => {
            let mut head = vec![0; most];
            let got = source.read_at(0, &mut head);
            head.truncate(got.map_err(Error::io("read", source.path()))?);
            Ok(head)
        }
        BagPlace::Pipe(name, stream) => {
            let head = stream.peek(most).map(<[u8]>::to_vec);
            head.map_err(Error::io("read", Path::new(name)))
        }
    }
}

/// The number of first bytes that are searched for a chunk where the very first are damaged.
pub(crate) const SEARCHED: usize = 1 << 20;

/// The last bytes of a file; none of anything else.
pub(crate) fn last(place: &BagPlace) -> [u8; 8] {
    let mut last = [0; 8];
    if let BagPlace::File(source) = place {
        // Without them, the first ones decide.
        let _ = source.read_at(source.len().saturating_sub(8), &mut last);
    }
    last
}

/// The new name of a bag that no longer exists under the name it had while recording: a recorder drops `.active`
/// when it closes a bag.
pub(crate) fn closed(path: &Path) -> Option<PathBuf> {
    let is_active = path.extension().is_some_and(|end| end == "active");
    let closed = path.with_extension("");
    (is_active && !path.exists() && closed.is_file()).then_some(closed)
}

/// The last part of a path as text.
pub fn file_name(path: &Path) -> String {
    let part = path.canonicalize().ok();
    let part = part.as_deref().unwrap_or(path).file_name();
    part.map_or_else(
        || path.display().to_string(),
        |n| n.to_string_lossy().into_owned(),
    )
}

// Explanations for files that are not bags, and advice.

/// The error for `path`, which begins with `head` and is not a bag.
pub(crate) fn explain(path: &Path, head: &[u8], folder: bool) -> Error {
    let (looks_like, hint) = if folder {
        (
            "a folder without a recording",
            "give a `.bag`, `.db3` or `.mcap` file, or the folder that contains `metadata.yaml`",
        )
    } else {
        guess(head)
    };
    Error::unknown_bag(path, looks_like, hint)
}

/// The first bytes of files that are no bags, what these are, and advice.
const KNOWN: &[(&[u8], &str, &str)] = &[
    (
        b"version https://git-lfs",
        "a git-LFS pointer",
        "`git lfs pull` fetches the bag itself",
    ),
    (b"PK\x03\x04", "a zip archive", "unpack it first"),
    (b"\x1f\x8b", "a gzip file", "unpack it first (`gunzip`)"),
    (b"BZh", "a bzip2 file", "unpack it first (`bunzip2`)"),
    (b"\xfd7zXZ", "an xz file", "unpack it first (`unxz`)"),
    (
        b"\x04\x22\x4d\x18",
        "an LZ4 file",
        "unpack it first (`lz4 -d`)",
    ),
    (
        b"rosbag2_bagfile",
        "the metadata of a recording",
        "give the folder that contains it",
    ),
    (
        b"<!DOCTYPE",
        "a web page",
        "the download failed; fetch the bag again",
    ),
    (
        b"<html",
        "a web page",
        "the download failed; fetch the bag again",
    ),
];

/// The place of the mark of a tar archive, which may contain bags.
const TAR: usize = 257;

/// Whether a file that begins with `head` is of another known kind than a bag.
pub(crate) fn is_known(head: &[u8]) -> bool {
    is_tar(head) || KNOWN.iter().any(|(magic, ..)| head.starts_with(magic))
}

fn is_tar(head: &[u8]) -> bool {
    head.get(TAR..)
        .is_some_and(|mark| mark.starts_with(b"ustar"))
}

fn guess(head: &[u8]) -> (&'static str, &'static str) {
    if is_tar(head) {
        return ("a tar archive", "unpack it first (`tar xf`)");
    }
    if head.is_empty() {
        return (
            "empty",
            "the recording or the copy failed; record or copy it again",
        );
    }
    if head.iter().all(|b| *b == 0) {
        return (
            "zeros, at least at its beginning",
            "the copy failed, or the disk was full; copy it again",
        );
    }
    let found = KNOWN.iter().find(|(magic, ..)| head.starts_with(magic));
    found.map_or(
        (
            "of an unrecognized format",
            "bags are ROS 1 `.bag`, ROS 2 `.db3` and `.mcap`, and folders that contain `metadata.yaml`",
        ),
        |(_, what, hint)| (*what, *hint),
    )
}
