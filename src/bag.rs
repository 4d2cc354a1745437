//! Bags as streams: one interface over every format, told apart by their first bytes.
//!
//! A reader owns a file and feeds a [`Sink`]; it knows nothing of evidence, windows or graphs. Adding a format is
//! one file below `bag/` and one row in `FORMATS`.

mod adapters;
mod checksum;
mod chunked;
pub(crate) mod decompress;
mod deferred;
mod input;
mod mcap;
mod model;
mod object;
#[cfg(feature = "remote")]
mod remote;
mod rosbag1;
mod rosbag2;
pub(crate) mod source;
#[cfg(feature = "sqlite")]
mod sqlite3;
mod unknown;
mod zstd;

use std::path::PathBuf;

use crate::base::error::Result;

pub(crate) use deferred::open_each;
pub(crate) use input::BagPlace;
pub use input::{FormatRow, Input, file_name, size_on_disk};
use input::{head, place};
pub(crate) use model::ETAG;
pub use model::{
    Connection, ConnectionId, Encoding, Lumps, Message, OpenOptions, Reader, Report, Sink, Tier,
    Want,
};
pub(crate) use object::{list, version};
use unknown::explain;

/// Every format that can be read.
pub const FORMATS: &[FormatRow] = &[
    rosbag1::FORMAT,
    self::mcap::FORMAT,
    #[cfg(feature = "sqlite")]
    sqlite3::FORMAT,
    rosbag2::FORMAT,
    zstd::FORMAT,
];

/// The kind of an input, told by its first bytes.
#[derive(Clone, Copy)]
pub enum InputKind {
    /// A bag of this format. Standard input and URLs are not read for this and count as ROS 1 bags here.
    Bag(&'static FormatRow),
    /// JSON text, such as an evolution of ours, which is not a bag.
    Json,
}

/// Tells the kind of `input` by its first bytes. Standard input is left untouched.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) if it cannot be read, [`Error::UnknownBag`](crate::Error::UnknownBag) with a hint if
/// it is of no known format.
pub fn sniff(input: &Input) -> Result<InputKind> {
    let path = match input {
        Input::Path(path) if !input.is_pipe() => path,
        // What is far away is looked into once, when it is opened.
        _ => return Ok(InputKind::Bag(&FORMATS[0])),
    };
    let mut place = place(input)?;
    let head = head(&mut place)?;
    let json = head.trim_ascii_start().first() == Some(&b'{');
    match FORMATS.iter().find(|f| (f.sniff)(&place, &head)) {
        Some(row) => Ok(InputKind::Bag(row)),
        None if json => Ok(InputKind::Json),
        None => Err(explain(path, &head, path.is_dir())),
    }
}

/// Opens a bag of any format, told by its first bytes. Objects need the feature `remote`.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) if it cannot be read, [`Error::Remote`](crate::Error::Remote) if a store does not give it, [`Error::UnknownBag`](crate::Error::UnknownBag), [`Error::Unsupported`](crate::Error::Unsupported) or [`Error::Malformed`](crate::Error::Malformed) with a
/// hint if nothing in it can be.
pub fn open(input: &Input, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    if let Input::Url(url) = input {
        return object::open(url, options);
    }
    let mut place = place(input)?;
    let head = head(&mut place)?;
    if let Some(row) = FORMATS.iter().find(|f| (f.sniff)(&place, &head)) {
        return (row.open)(place, options);
    }
    let path = match input {
        Input::Path(path) => path.clone(),
        Input::Url(_) | Input::Stdin => PathBuf::from(input.name()),
    };
    let folder = matches!(place, BagPlace::Folder(_));
    Err(explain(&path, &head, folder))
}
