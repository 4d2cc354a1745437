//! Explanations for files that are not bags, and advice.

use std::path::Path;

use crate::base::error::Error;

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
