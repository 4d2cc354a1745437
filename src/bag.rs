//! Bags as streams: one interface for all formats, recognized by their first bytes.
//!
//! A reader owns a file and feeds a [`Sink`]; it does not depend on evidence, windows or graphs. Adding a format takes
//! one file below `bag/` and one row in `FORMATS`.

mod adapters;
mod chunked;
pub(crate) mod decompress;
mod folder;
mod input;
mod mcap;
mod model;
mod rosbag1;
mod rosbag2;
pub(crate) mod source;
#[cfg(feature = "sqlite")]
mod sqlite3;
pub(crate) mod straight;
mod zstd;

use std::path::{Path, PathBuf};

use input::{HEAD, SEARCHED, closed, explain, head, last, place};

use crate::base::error::{Error, Result};
use crate::base::time::Span;

pub(crate) use adapters::{Moved, known_span};
pub(crate) use folder::{Recording, parts_of, plain, recordings, written};
pub(crate) use input::BagPlace;
pub use input::{FormatRow, Input, file_name, size_on_disk};
pub(crate) use model::Growing;
#[doc(hidden)]
pub use model::Growth;
pub use model::{
    Connection, ConnectionId, Encoding, Message, OpenOptions, Reader, Report, Sink, Tier, Want,
};

/// Every format that can be read.
pub const FORMATS: &[FormatRow] = &[
    rosbag1::FORMAT,
    self::mcap::FORMAT,
    #[cfg(feature = "sqlite")]
    sqlite3::FORMAT,
    rosbag2::FORMAT,
    zstd::FORMAT,
];

/// The kind of an input, recognized by its first bytes.
#[derive(Clone, Copy)]
pub enum InputKind {
    /// A bag of this format. Standard input is not read for this and counts as a ROS 1 bag here.
    Bag(&'static FormatRow),
    /// JSON text, such as a mission written by bagreel; not a bag.
    Json,
}

/// Detects the kind of `input` from its first bytes. Standard input is left untouched.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::UnknownBag`] with a hint if its format is unknown.
pub fn sniff(input: &Input) -> Result<InputKind> {
    let path = match input {
        Input::Path(path) if !input.is_pipe() => path,
        _ => return Ok(InputKind::Bag(&FORMATS[0])),
    };
    let mut place = place(input)?;
    let head = head(&mut place, HEAD)?;
    let json = head.trim_ascii_start().first() == Some(&b'{');
    match recognized(&mut place, &head)? {
        Some(row) => Ok(InputKind::Bag(row)),
        None if json => Ok(InputKind::Json),
        None => Err(explain(path, &head, path.is_dir())),
    }
}

/// The format of an input: by its first bytes or, if these are of no known kind, by a chunk behind them or its last ones.
fn recognized(place: &mut BagPlace, head: &[u8]) -> Result<Option<&'static FormatRow>> {
    let row = FORMATS.iter().find(|row| (row.sniff)(place, head));
    if row.is_some() || input::is_known(head) {
        return Ok(row);
    }
    let bytes = [&input::head(place, SEARCHED)?[..], &last(place)].concat();
    Ok(FORMATS.iter().find(|row| (row.is_inside)(&bytes)))
}

/// Opens a bag of any format, recognized by its first bytes.
///
/// # Errors
/// [`Error::Io`] if it cannot be read; [`Error::UnknownBag`], [`Error::Unsupported`] or
/// [`Error::Malformed`], with a hint, if no content can be read.
pub fn open(input: &Input, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let mut place = place(input)?;
    let head = head(&mut place, HEAD)?;
    if let Some(row) = recognized(&mut place, &head)? {
        return (row.open)(place, options);
    }
    let path = match input {
        Input::Path(path) => path.clone(),
        Input::Stdin => PathBuf::from(input.name()),
    };
    let folder = matches!(place, BagPlace::Folder(_));
    Err(explain(&path, &head, folder))
}

/// Follows a recording that is still being written, recognized by its first bytes; in a folder that is not a
/// recording, the newest one below it.
///
/// # Errors
/// As [`open`], and [`Error::Unsupported`] for inputs that do not grow: pipes, and bags compressed as a
/// whole.
pub(crate) fn follow(input: &Input) -> Result<Box<dyn Growing>> {
    let grows = |path: &Path| {
        let kind = sniff(&Input::Path(path.to_owned()));
        matches!(kind, Ok(InputKind::Bag(row)) if row.follow.is_some())
    };
    let within = match input {
        Input::Path(path) if path.is_dir() && !folder::is_growing(path) => {
            let newest = folder::newest(path, grows).ok_or_else(|| explain(path, &[], true))?;
            Some(Input::Path(newest))
        }
        Input::Path(path) => closed(path).map(Input::Path),
        Input::Stdin => None,
    };
    let input = within.as_ref().unwrap_or(input);
    if let Input::Path(path) = input
        && !input.is_pipe()
        && let InputKind::Bag(row) = sniff(input)?
        && let Some(follow) = row.follow
    {
        return follow(path);
    }
    let what = "it cannot be followed while it grows";
    let hint = "give a `.bag.active`, `.bag`, `.mcap` or `.db3` file, or a rosbag2 folder";
    Err(Error::unsupported(input.name(), what, hint))
}

// Many bags, only a few of them open at a time: some systems allow a process only 256 open files.

/// The number of bags that stay open until they are read; each may be a folder that keeps as many files open.
const STAY_OPEN: usize = 8;

/// A bag that is opened on demand.
struct Deferred {
    input: Input,
    options: OpenOptions,
    /// The open reader, if there is one.
    reader: Option<Box<dyn Reader>>,
}

/// The readers of `inputs`, in order; each is opened once up front, so that an input that is not a bag is reported
/// immediately.
pub(crate) fn open_each(
    inputs: impl IntoIterator<Item = Input>,
    options: &OpenOptions,
) -> impl Iterator<Item = Result<Box<dyn Reader>>> {
    inputs.into_iter().enumerate().map(|(place, input)| {
        let reader = if place < STAY_OPEN {
            Some(open(&input, options)?)
        } else {
            sniff(&input)?;
            None
        };
        let options = options.clone();
        Ok(Box::new(Deferred {
            input,
            options,
            reader,
        }) as Box<dyn Reader>)
    })
}

impl Deferred {
    /// What a reader that is open now says.
    fn ask<T>(&self, ask: impl Fn(&dyn Reader) -> T) -> Option<T> {
        match &self.reader {
            Some(reader) => Some(ask(reader.as_ref())),
            // Errors are reported when the bag is read.
            None => Some(ask(open(&self.input, &self.options).ok()?.as_ref())),
        }
    }
}

impl Reader for Deferred {
    fn is_straight(&self) -> bool {
        self.ask(|reader| reader.is_straight()).unwrap_or(true)
    }

    fn stated(&self) -> Option<Span> {
        self.ask(|reader| reader.stated()).flatten()
    }

    fn span(&mut self) -> Result<Option<Span>> {
        match &mut self.reader {
            Some(reader) => reader.span(),
            None => open(&self.input, &self.options)?.span(),
        }
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let reader = self.reader.take();
        let mut reader = reader.map_or_else(|| open(&self.input, &self.options), Ok)?;
        reader.read(range, sink)
    }
}
