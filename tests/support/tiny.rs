//! Bags of a few kilobytes in every format, small enough to flip every bit and to cut at every byte.

use std::fs;

use super::rosbag1::Pack;
use super::{Recording, mcap, rosbag1, sqlite3};

/// Messages in each of the [`bags`].
pub const MESSAGES: usize = 14;

fn recording() -> Recording {
    let mut recording = Recording::default();
    let one = recording.publisher("/a", "/one", "std_msgs/String");
    let other = recording.publisher("/b", "/two", "std_msgs/String");
    recording.send(one, (0, 1000), 100, b"\x04\0\0\0ping");
    recording.send(other, (50, 1000), 300, b"\x04\0\0\0pong");
    recording
}

/// The bags with their names, which contain the format and whether they are read from the front.
pub fn bags() -> Vec<(&'static str, Vec<u8>)> {
    let recording = recording();
    let bag = |how| rosbag1::write(&recording, how, 150);
    let chunked = |summary, compression| {
        let options = mcap::Options {
            summary,
            compression,
            chunk: 150,
            ..mcap::Options::default()
        };
        mcap::write(&recording, &options)
    };
    let unchunked = |summary| {
        let options = mcap::Options {
            summary,
            chunked: false,
            ..mcap::Options::default()
        };
        mcap::write(&recording, &options)
    };
    let zstd = Some(mcap::Packed::Zstd);
    let lz4 = Some(mcap::Packed::Lz4);
    vec![
        ("none.bag", bag(Pack::None)),
        ("bz2.bag", bag(Pack::Bz2)),
        ("lz4.bag", bag(Pack::Lz4)),
        ("front_none.bag", rosbag1::unindexed(&bag(Pack::None))),
        ("front_lz4.bag", rosbag1::unindexed(&bag(Pack::Lz4))),
        ("none.mcap", chunked(true, None)),
        ("zstd.mcap", chunked(true, zstd)),
        ("front_none.mcap", chunked(false, None)),
        ("front_zstd.mcap", chunked(false, zstd)),
        ("front_lz4.mcap", chunked(false, lz4)),
        ("unchunked.mcap", unchunked(true)),
        ("front_unchunked.mcap", unchunked(false)),
        ("rows.db3", database(&recording)),
    ]
}

/// A database of the smallest pages that SQLite supports.
fn database(recording: &Recording) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.db3");
    sqlite3::write(recording, &path);
    let db = rusqlite::Connection::open(&path).unwrap();
    db.execute_batch("PRAGMA page_size = 512; VACUUM;").unwrap();
    db.close().unwrap();
    fs::read(&path).unwrap()
}
