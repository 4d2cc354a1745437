//! The data model of bags: connections, messages, the sink that receives them, the reader that feeds it.

use std::io;
use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use crate::base::error::Result;
use crate::base::ids::ids;
use crate::base::name::{NodeName, TopicName};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::{Span, Stamp};
use crate::base::words::worded;

/// The serialisation of a payload.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Encoding {
    /// ROS 1 serialisation: little-endian, packed.
    #[default]
    Ros1,
    /// ROS 2 serialisation: CDR after a header of four bytes.
    Cdr,
    /// Anything else, as named in the bag; never decoded.
    Other(String),
}

ids! {
    /// The index of a connection among those that a reader has announced, from 0 without gaps.
    ConnectionId,
}

/// A publisher's connection (ROS 1), a channel (MCAP) or a topic row (sqlite3): one source of messages.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Connection {
    /// The index among the reader's connections.
    pub id: ConnectionId,
    /// The topic as recorded.
    pub topic: TopicName,
    /// The message type as recorded: `std_msgs/String`, `std_msgs/msg/String`; empty if not recorded.
    pub type_name: Arc<str>,
    /// The message definition, if the bag contains one.
    pub definition: Option<Arc<str>>,
    /// Whether the definition is in OMG IDL (`ros2idl`), not the text of a `.msg` file.
    pub is_idl: bool,
    /// The md5 sum (ROS 1) or RIHS01 hash (ROS 2) of the type, if the bag contains one.
    pub type_hash: Option<Arc<str>>,
    /// The node that publishes, if the header names one (`callerid`).
    pub publisher: Option<NodeName>,
    /// Whether the publisher latches (ROS 1 header).
    pub latching: bool,
    /// `offered_qos_profiles` as recorded (ROS 2): YAML text or YAML converted to JSON text; empty means none.
    pub qos: Option<Arc<str>>,
    /// The serialisation of its payloads.
    pub encoding: Encoding,
}

/// The part of a connection's payloads that a sink wants. Stamps are always delivered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Want {
    /// No payloads: the reader only needs its index.
    #[default]
    Stamps,
    /// The size of each payload, even if that means reading more than the index.
    Sizes,
    /// As [`Want::Head`], unless the bag has an index and no other connection's payloads are wanted.
    Beside(usize),
    /// The first bytes of each payload: at least this many, or all of a shorter payload; more may be
    /// delivered.
    Head(usize),
    /// Each payload whole.
    Payload,
}

/// One wanted message.
#[derive(Clone, Copy, Debug)]
pub struct Message<'a> {
    /// The connection, announced before.
    pub connection: ConnectionId,
    /// The time at which the recorder received it.
    pub time: Stamp,
    /// The payload, or its head ([`Want::Head`]).
    pub data: &'a [u8],
    /// The length of the whole payload in bytes.
    pub size: u32,
}

impl Want {
    /// Resolves every [`Want::Beside`] for a bag that is read by its index.
    pub(crate) fn resolve(wants: &mut [Self]) {
        let is_read = wants
            .iter()
            .any(|w| matches!(w, Self::Head(_) | Self::Payload));
        for want in wants {
            if let Self::Beside(n) = *want {
                *want = if is_read { Self::Head(n) } else { Self::Stamps };
            }
        }
    }
}

/// The receiver of everything that a reader finds.
///
/// Order: a connection is announced before its stamps and messages; otherwise calls may come in any order.
/// Every message of the bag (inside the requested range) is stamped exactly once through [`Sink::stamps`]; a wanted
/// one is also passed to [`Sink::message`], before or after.
pub trait Sink {
    /// Takes a new connection; returns the wanted part of its payloads: none of them by default.
    fn connection(&mut self, connection: &Connection) -> Want {
        let behind = self.behind();
        behind.map_or(Want::Stamps, |sink| sink.connection(connection))
    }

    /// The next sink, which receives everything that this one does not handle.
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        None
    }

    /// Marks that all following stamps are later in the file than all previous ones.
    fn part(&mut self) {
        if let Some(sink) = self.behind() {
            sink.part();
        }
    }

    /// Takes log times of messages of one connection, in file order. `sizes`, if the reader knows them (always if
    /// wanted), contains each payload's size in bytes and is as long as `stamps`.
    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>);

    /// Takes a wanted message.
    fn message(&mut self, message: Message<'_>) {
        if let Some(sink) = self.behind() {
            sink.message(message);
        }
    }

    /// Takes a notice for the user.
    fn notice(&mut self, notice: Notice) {
        if let Some(sink) = self.behind() {
            sink.notice(notice);
        }
    }

    /// Takes the progress of the reader, in bytes of `total` (0 if unknown).
    fn progress(&mut self, done: u64, total: u64) {
        if let Some(sink) = self.behind() {
            sink.progress(done, total);
        }
    }
}

worded! {
    /// The way a bag was read; `reading.md` calls them tiers.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Tier {
        /// By its index: only wanted payloads are read.
        #[default]
        Index = "index",
        /// Record by record from the front.
        Forward = "forward",
        /// By a second, independent reader of the whole bag.
        Verify = "verify",
    }
}

/// A reader's report about its bag after reading. `info` writes it as JSON with these names.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Report {
    /// The file's or folder's own name, without a path.
    pub name: String,
    /// The format's name in JSON: `rosbag1`, `sqlite3`, `mcap`.
    pub format: String,
    /// Every compression seen, sorted: `none`, `bz2`, `lz4`, `zstd`.
    pub compression: Vec<String>,
    /// The way it was read.
    pub tier: Tier,
    /// Why it was not read by its index, if so.
    pub tier_reason: Option<String>,
    /// Whether nothing was lost.
    pub complete: bool,
    /// Bytes read from the file, for benchmarks; 0 if unknown.
    #[serde(skip)]
    pub bytes_read: u64,
    /// The size of the bag on disk in bytes; 0 if unknown.
    pub file_bytes: u64,
    /// Stored facts to show in `info`: `ros_distro`, `library`, `storage`, …
    pub facts: Vec<(String, String)>,
}

/// An open bag.
pub trait Reader: Send {
    /// Whether, according to an index, time never goes back from one part of the bag to the next.
    fn is_straight(&self) -> bool {
        true
    }

    /// The time covered, as stated: not all of the index is read for it, and it may be wrong.
    fn stated(&self) -> Option<Span> {
        None
    }

    /// The time covered: `[first log time, last log time + 1 ns)`, if the tail or an index contains it.
    /// `None` if only reading the bag can determine it. A large bag with a wrong tail may contain stamps
    /// outside.
    fn span(&mut self) -> Result<Option<Span>>;

    /// Reads the bag once, front to back or by its index, into `sink`. With `range` only messages inside it are
    /// stamped, and parts outside are not read if the index allows it; connections are announced anyway.
    ///
    /// # Errors
    /// Fails only if nothing at all can be read. Partial loss is reported by a notice and sets `Report::complete` to
    /// false.
    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report>;
}

/// The outcome of one poll of a growing recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Growth {
    /// Nothing was written.
    Same,
    /// Something was written, and what has become readable of it was reported.
    More,
    /// The recording is over, and all of it was reported.
    Ended,
}

/// A recording that is read while it is written. Every message is reported once, as soon as it is complete, and damage
/// as soon as it is passed; what is missing at the end shows when the closed recording is read.
pub(crate) trait Growing: Send {
    /// Reports to `sink` what has become readable since the last call.
    ///
    /// # Errors
    /// If the recording no longer exists or cannot be read at all.
    fn poll(&mut self, sink: &mut dyn Sink) -> Result<Growth>;

    /// The file or folder, which may have been renamed since.
    fn path(&self) -> &Path;
}

/// Options for opening a bag.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Read everything by the second, independent reader instead (tier `verify`).
    pub verify: bool,
}

/// The longest payload or connection record kept in memory, in bytes.
pub(crate) const MOST_PAYLOAD: usize = 16 << 20;

/// Reports damage to `sink`, as often as it occurred.
pub(crate) fn damaged(sink: &mut dyn Sink, count: u64, text: &str) {
    if count > 0 {
        sink.notice(Notice::counted(NoticeKind::Damaged, count, text));
    }
}

/// Reports to `sink` that data was lost because of a system error.
pub(crate) fn lost(sink: &mut dyn Sink, what: &str, why: &io::Error) {
    damaged(sink, 1, &format!("{what}: {why}"));
}
