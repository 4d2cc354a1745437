//! Bags as streams: one interface over every format, told apart by their first bytes.
//!
//! A reader owns a file and feeds a [`Sink`]; it knows nothing of evidence, windows or graphs. Adding a format is
//! one file below `bag/` and one row in `FORMATS`.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::name::{NodeName, TopicName};
use crate::notice::{Notice, NoticeKind};
use crate::source::{Source, Stream};
use crate::time::{Span, Stamp};

use index::{
    Ask, Body, Index, LONGEST_INDEX, Tally, hand_over, hand_over_slice, nameless, pass, span_of,
    threads,
};
use relay::{Clip, GROUP, Gather, in_order};
use unknown::explain;

mod index;
mod mcap;
mod relay;
mod rosbag1;
mod rosbag2;
mod sqlite3;
mod unknown;
mod zstd_file;

/// How a payload is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// ROS 1 serialisation: little-endian, packed.
    Ros1,
    /// ROS 2 serialisation: CDR behind a header of four bytes.
    Cdr,
    /// Anything else, by the name that the bag gives it; never decoded.
    Other(String),
}

/// The place of a connection among those that one reader has announced: 0.., no holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ConnectionId(pub u32);

/// A publisher's connection (ROS 1), a channel (MCAP) or a topic row (sqlite3): one source of messages.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// Its place among the reader's connections.
    pub id: ConnectionId,
    /// The topic as recorded.
    pub topic: TopicName,
    /// The message type as recorded: `std_msgs/String`, `std_msgs/msg/String`; empty if the bag does not say.
    pub type_name: Arc<str>,
    /// The text of the message definition, if the bag holds one.
    pub definition: Option<Arc<str>>,
    /// The md5 sum (ROS 1) or RIHS01 hash (ROS 2) of the type, if the bag holds one.
    pub type_hash: Option<Arc<str>>,
    /// The node that publishes, if the header names one (`callerid`).
    pub publisher: Option<NodeName>,
    /// Whether the publisher latches (ROS 1 header).
    pub latching: bool,
    /// `offered_qos_profiles` as recorded (ROS 2): YAML text or YAML converted to JSON text; empty means none.
    pub qos: Option<Arc<str>>,
    /// How its payloads are written.
    pub encoding: Encoding,
}

/// What a sink wants to see of a connection's payloads. Stamps come in any case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Want {
    /// Nothing: the reader stays at its index.
    #[default]
    Stamps,
    /// The size of each payload, even if that means reading more than the index.
    Sizes,
    /// The first bytes of each payload, at least this many if it is that long; more may come.
    Head(usize),
    /// Each payload whole.
    Payload,
}

/// One wanted message.
#[derive(Clone, Copy, Debug)]
pub struct Message<'a> {
    /// Its connection, announced before.
    pub connection: ConnectionId,
    /// When the recorder received it.
    pub time: Stamp,
    /// The payload, or its head ([`Want::Head`]).
    pub data: &'a [u8],
    /// The length of the whole payload in bytes.
    pub size: u32,
}

/// What takes in what a reader finds.
///
/// Order: a connection is announced before its stamps and messages, otherwise anything may come in any order.
/// Every message of the bag (inside the range asked for) is stamped exactly once through [`Sink::stamps`]; a wanted
/// one comes through [`Sink::message`] as well, before or after.
pub trait Sink {
    /// A new connection; answers what is wanted of it.
    fn connection(&mut self, connection: &Connection) -> Want;

    /// Log times of messages of one connection, in file order. `sizes` holds each payload's bytes where the reader
    /// knows them (always if wanted); then it is as long as `stamps`.
    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>);

    /// A wanted message.
    fn message(&mut self, message: Message<'_>);

    /// Something worth saying.
    fn notice(&mut self, notice: Notice);

    /// How far the reader is, in bytes of `total` (0 where the size is not known).
    fn progress(&mut self, _done: u64, _total: u64) {}
}

/// The way a bag was read; `reading.md` calls them tiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tier {
    /// By its index: no payload is read that is not wanted.
    Index,
    /// Record by record from the front.
    Forward,
    /// Everything, a second time, by an independent reader.
    Verify,
}

impl Tier {
    /// Its word in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Index => "index",
            Self::Forward => "forward",
            Self::Verify => "verify",
        }
    }
}

/// What a reader says about its bag when it is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// The file's or folder's own name, no path.
    pub name: String,
    /// The format's word in JSON: `rosbag1`, `sqlite3`, `mcap`, `evolution`.
    pub format: String,
    /// Every compression seen, sorted: `none`, `bz2`, `lz4`, `zstd`.
    pub compression: Vec<String>,
    /// How it was read.
    pub tier: Tier,
    /// Why not by its index, if so.
    pub tier_reason: Option<String>,
    /// Whether nothing was lost.
    pub complete: bool,
    /// Bytes read from the file, for benchmarks; 0 where not known.
    pub bytes_read: u64,
    /// The size of the bag on disk in bytes; 0 where not known.
    pub file_bytes: u64,
    /// Stored facts worth telling in `info`: `ros_distro`, `library`, `storage`, …
    pub facts: Vec<(String, String)>,
}

/// A bag, open.
pub trait Reader: Send {
    /// The time covered: `[first log time, last log time + 1 ns)`, if the tail or an index tells it without
    /// reading the bag. `None` when only reading will tell. A big bag with a lying tail may hold stamps outside.
    fn span(&mut self) -> Result<Option<Span>>;

    /// Reads the bag once, front to back or by its index, into `sink`. With `range` only messages inside it are
    /// stamped, and parts of the bag outside are not read where the index allows; connections are announced anyway.
    ///
    /// # Errors
    /// Only where nothing at all can be read. Whatever is lost on the way is a notice, and `Report::complete` false.
    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report>;
}

/// How to open a bag.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Read everything by the second, independent reader instead (tier `verify`).
    pub verify: bool,
}

/// One bag to read: a path, or standard input (`-`).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Input {
    /// A file or a folder.
    Path(PathBuf),
    /// Standard input: ROS 1 or MCAP.
    Stdin,
}

impl Input {
    /// The bag's own name, no path.
    pub fn name(&self) -> String {
        match self {
            Self::Path(path) => file_name(path),
            Self::Stdin => "standard input".to_owned(),
        }
    }
}

/// A row of [`FORMATS`].
pub struct FormatRow {
    /// Its word in JSON.
    pub name: &'static str,
    /// What it is, for people.
    pub what: &'static str,
    /// The names that such bags usually end in. Only told, never asked: the first bytes decide.
    pub extensions: &'static [&'static str],
    /// What it is read from.
    medium: Medium,
    /// Whether a bag begins so.
    sniff: fn(&Place, &[u8]) -> bool,
    /// Makes a reader.
    open: fn(Place, &OpenOptions) -> Result<Box<dyn Reader>>,
}

/// What a format is read from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Medium {
    /// A file, or a pipe.
    Stream,
    /// A file.
    File,
    /// A folder.
    Folder,
    /// A file or a pipe with a bag of another format in it.
    Wrapping,
}

/// Every format that can be read.
pub const FORMATS: &[FormatRow] = &[
    rosbag1::FORMAT,
    self::mcap::FORMAT,
    sqlite3::FORMAT,
    rosbag2::FORMAT,
    zstd_file::FORMAT,
];

/// Where a bag lies.
pub(crate) enum Place {
    /// A folder.
    Folder(PathBuf),
    /// A regular file.
    File(Source),
    /// A pipe: its name and its bytes.
    Pipe(String, Stream<'static>),
}

/// What an input is, from its first bytes.
#[derive(Clone, Copy)]
pub enum Kind {
    /// A bag of this format. Standard input is not looked into and counts as a ROS 1 bag here.
    Bag(&'static FormatRow),
    /// JSON text, such as an evolution of ours: no bag.
    Json,
}

/// How many first bytes tell a format.
const HEAD: usize = 512;

/// Tells what `input` is from its first bytes. Standard input is left untouched.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::UnknownBag`] with a hint if it is none of ours.
pub fn sniff(input: &Input) -> Result<Kind> {
    let Input::Path(path) = input else {
        return Ok(Kind::Bag(&FORMATS[0]));
    };
    if !path.is_dir() && !path.is_file() && path.exists() {
        return Ok(Kind::Bag(&FORMATS[0]));
    }
    let mut place = place(input)?;
    let head = head(&mut place)?;
    let json = head.trim_ascii_start().first() == Some(&b'{');
    match FORMATS.iter().find(|f| (f.sniff)(&place, &head)) {
        Some(row) => Ok(Kind::Bag(row)),
        None if json => Ok(Kind::Json),
        None => Err(explain(path, &head, path.is_dir())),
    }
}

/// Opens a bag of any format, told by its first bytes.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::UnknownBag`], [`Error::Unsupported`] or [`Error::Malformed`] with a
/// hint if nothing in it can be.
pub fn open(input: &Input, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let mut place = place(input)?;
    let head = head(&mut place)?;
    if let Some(row) = FORMATS.iter().find(|f| (f.sniff)(&place, &head)) {
        return (row.open)(place, options);
    }
    let path = match input {
        Input::Path(path) => path.clone(),
        Input::Stdin => PathBuf::from(input.name()),
    };
    let folder = matches!(place, Place::Folder(_));
    Err(explain(&path, &head, folder))
}

fn place(input: &Input) -> Result<Place> {
    let Input::Path(path) = input else {
        return Ok(Place::Pipe(input.name(), Stream::of_reader(io::stdin())));
    };
    let meta = path.metadata().map_err(Error::io("read", path))?;
    if meta.is_dir() {
        return Ok(Place::Folder(path.clone()));
    }
    if meta.is_file() {
        return Source::open(path).map(Place::File);
    }
    let pipe = File::open(path).map_err(Error::io("read", path))?;
    Ok(Place::Pipe(file_name(path), Stream::of_reader(pipe)))
}

/// The first bytes; none for a folder.
fn head(place: &mut Place) -> Result<Vec<u8>> {
    match place {
        Place::Folder(_) => Ok(Vec::new()),
        Place::File(source) => {
            let mut head = vec![0; HEAD];
            let got = source.read_at(0, &mut head);
            head.truncate(got.map_err(Error::io("read", source.path()))?);
            Ok(head)
        }
        Place::Pipe(name, stream) => {
            let head = stream.peek(HEAD).map(<[u8]>::to_vec);
            head.map_err(Error::io("read", Path::new(name)))
        }
    }
}

/// The longest payload, or connection record, that is held in memory, in bytes.
const MOST_PAYLOAD: usize = 16 << 20;

/// Tells `sink` that something was lost because the system refused.
fn lost(sink: &mut dyn Sink, what: &str, why: &io::Error) {
    sink.notice(Notice::new(NoticeKind::Damaged, format!("{what}: {why}")));
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
