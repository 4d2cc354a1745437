//! The records of a chunked bag as a grammar parses them, the reasons why no record follows, and the described
//! connections.

use std::collections::HashMap;
use std::{fmt, io};

use super::Grammar;
use super::index::{hand_over_slice, nameless};
use crate::bag::adapters::Gather;
use crate::bag::decompress::Compression;
use crate::bag::model::{Connection, ConnectionId, Encoding, MOST_PAYLOAD, Sink, Want};
use crate::bag::source::ByteStream;
use crate::base::budget::CONNECTIONS;
use crate::base::time::Stamp;

/// The head of a record; the stream is positioned after it. `len` is the number of bytes that follow.
#[derive(Debug)]
pub(crate) enum RecordHead<D> {
    /// A chunk, whose body follows.
    Chunk(ChunkHead),
    /// A message; its payload follows.
    Message(MessageHead),
    /// A description of connections.
    Description { what: D, len: u64 },
    /// The number of messages of a connection in the previous chunk; their entries follow.
    Index { raw: u32, count: u32, len: u64 },
    /// The numbers of messages and chunks that the bag states.
    Total { stated: Counts, len: u64 },
    /// The position of a chunk that the bag's index lists, and the times of its first and last message.
    Listed {
        at: u64,
        times: (Stamp, Stamp),
        len: u64,
    },
    /// The end of the data: no message follows. `crc` is the CRC-32 of all bytes of the bag before the `len` bytes, if
    /// it is stated.
    DataEnd { len: u64, crc: Option<u32> },
    /// The end of the file: only the closing bytes of the bag follow. `crc` is the CRC-32 of all bytes from the end of the
    /// data up to the last four of this record, if it is stated.
    FileEnd { len: u64, crc: Option<u32> },
    /// A record that is ignored.
    Other { len: u64 },
    /// An ignored record that only occurs after the end of the data.
    Tail { len: u64 },
    /// A record of an undefined kind, or that cannot be of its stated kind. The format leaves `extension` kinds to its
    /// users.
    Unknown { len: u64, extension: bool },
}

/// A message of the connection with the number `raw`, and the size of its payload in bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MessageHead {
    pub(crate) raw: u32,
    pub(crate) time: Stamp,
    pub(crate) size: u32,
}

impl<D> RecordHead<D> {
    /// Whether it only occurs after the end of the data, in formats that state one.
    pub(crate) fn is_of_the_end(&self) -> bool {
        matches!(
            self,
            Self::Tail { .. } | Self::Total { .. } | Self::Listed { .. }
        )
    }

    /// The number of bytes that follow, all of them of this record.
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Chunk(head) => head.packed.saturating_add(head.padding),
            Self::Message(head) => u64::from(head.size),
            Self::Description { len, .. }
            | Self::Index { len, .. }
            | Self::Total { len, .. }
            | Self::Listed { len, .. }
            | Self::DataEnd { len, .. }
            | Self::FileEnd { len, .. }
            | Self::Other { len }
            | Self::Tail { len }
            | Self::Unknown { len, .. } => *len,
        }
    }
}

/// The numbers of a bag's messages, channels and chunks; 0 if they are not stated.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub(crate) messages: u64,
    pub(crate) channels: u32,
    pub(crate) chunks: u32,
}

/// The head of a chunk, before its records.
#[derive(Clone, Debug)]
pub(crate) struct ChunkHead {
    /// `None` for an unknown compression.
    pub(crate) how: Option<Compression>,
    /// The bytes of its body in the file.
    pub(crate) packed: u64,
    /// The bytes after the body that belong to the chunk.
    pub(crate) padding: u64,
    /// The stated number of bytes of its records.
    pub(crate) plain: u64,
    /// The stated CRC-32 of its records, if there is one.
    pub(crate) crc: Option<u32>,
    /// The first and the last time in it, if stated.
    pub(crate) times: Option<(Stamp, Stamp)>,
    /// Whether it is marked as a record of another kind.
    pub(crate) misnamed: bool,
    /// Whether the recorder was killed before it wrote the lengths; the body extends to the end.
    pub(crate) unclosed: bool,
}

/// The reason why no record follows.
#[derive(Debug)]
pub(crate) enum NoRecord {
    /// The bytes end where a record could begin.
    End,
    /// They end inside a record.
    Cut,
    /// The bytes here are not a record.
    Broken,
    /// An error of the system, or of a decompressor.
    Io(io::Error),
}

impl From<io::Error> for NoRecord {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Cut,
            _ => Self::Io(error),
        }
    }
}

impl fmt::Display for NoRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::End => f.write_str("it ends"),
            Self::Cut => f.write_str("it ends inside a record"),
            Self::Broken => f.write_str("there is no record"),
            Self::Io(e) => e.fmt(f),
        }
    }
}

/// Takes records up to byte `end` of `stream`, one per step; returns why they end. A step that consumes no byte ends
/// the walk too, so no walk through a bag has more steps than the bag has bytes.
pub(crate) fn walk<'a>(
    stream: &mut ByteStream<'a>,
    end: u64,
    mut step: impl FnMut(&mut ByteStream<'a>) -> Result<(), NoRecord>,
) -> NoRecord {
    while stream.position() < end {
        let before = stream.position();
        match step(stream) {
            Ok(()) if stream.position() > before => {}
            Ok(()) => return NoRecord::Broken,
            Err(reason) => return reason,
        }
    }
    NoRecord::End
}

/// The next `len` bytes of `stream`, without taking them.
pub(crate) fn peek_whole<'s>(
    stream: &'s mut ByteStream<'_>,
    len: u64,
) -> Result<&'s [u8], NoRecord> {
    let len = usize::try_from(len).unwrap_or(usize::MAX);
    let bytes = stream.peek(len.min(MOST_PAYLOAD))?;
    if bytes.len() < len {
        return Err(NoRecord::Cut);
    }
    Ok(bytes)
}

/// Skips `len` bytes, which must exist: if the length exceeds the bag, nothing is skipped.
pub(crate) fn pass(stream: &mut ByteStream<'_>, len: u64) -> Result<(), NoRecord> {
    if !stream.has(len)? {
        return Err(NoRecord::Cut);
    }
    match stream.skip(len)? {
        n if n < len => Err(NoRecord::Cut),
        _ => Ok(()),
    }
}

/// The connections of a bag by the numbers that it gives them.
#[derive(Debug, Default)]
pub(crate) struct Connections {
    list: Vec<Connection>,
    ids: HashMap<u32, ConnectionId>,
}

impl Connections {
    /// The connection with the number `raw`.
    pub(crate) fn get(&self, raw: u32) -> Option<ConnectionId> {
        self.ids.get(&raw).copied()
    }

    /// All connections in the order of their announcement.
    pub(crate) fn list(&self) -> &[Connection] {
        &self.list
    }

    /// Adds a connection under the next free id; returns it if it is new. A second one with the same number is ignored,
    /// as in every reader.
    pub(crate) fn add(&mut self, raw: u32, connection: Connection) -> Option<&Connection> {
        if self.ids.contains_key(&raw) || self.list.len() >= CONNECTIONS {
            return None;
        }
        let id = ConnectionId(u32::try_from(self.list.len()).ok()?);
        self.ids.insert(raw, id);
        self.list.push(Connection { id, ..connection });
        self.list.last()
    }
}

/// The connections of a bag that were announced to a sink, and what it wants of each.
#[derive(Default)]
pub(crate) struct Announced<G> {
    grammar: G,
    connections: Connections,
    wants: Vec<Want>,
}

impl<G: Grammar> Announced<G> {
    /// The connection that the bag calls `raw`, and what is wanted of it.
    pub(crate) fn get(&self, raw: u32) -> Option<(ConnectionId, Want)> {
        let id = self.connections.get(raw)?;
        Some((id, self.wants[id.0 as usize]))
    }

    /// As [`Announced::describe`], for a description of `len` bytes that follows in `stream`; one that is too long to be
    /// one is ignored. The outer error is that of the stream.
    pub(crate) fn read(
        &mut self,
        stream: &mut ByteStream<'_>,
        (what, len): (&G::Description, u64),
        sink: &mut dyn Sink,
    ) -> Result<Result<Option<(u32, ConnectionId)>, NoRecord>, NoRecord> {
        let new = if len > MOST_PAYLOAD as u64 {
            Ok(None)
        } else {
            self.describe(what, peek_whole(stream, len)?, sink)
        };
        pass(stream, len).map(|()| new)
    }

    /// Announces a connection that the bag calls `raw` and does not describe.
    pub(super) fn unnamed(&mut self, raw: u32, sink: &mut dyn Sink) -> Option<ConnectionId> {
        let connection = Connection {
            topic: format!("connection {raw}").into(),
            encoding: Encoding::Other(String::new()),
            ..Connection::default()
        };
        let connection = self.connections.add(raw, connection)?;
        self.wants.push(sink.connection(connection));
        Some(connection.id)
    }

    /// Announces the connection of a description if it is a new one; returns it with the bag's number for it.
    pub(crate) fn describe(
        &mut self,
        what: &G::Description,
        data: &[u8],
        sink: &mut dyn Sink,
    ) -> Result<Option<(u32, ConnectionId)>, NoRecord> {
        let described = self.grammar.describe(what, data, &self.connections)?;
        let new = described.and_then(|(raw, new)| Some((raw, self.connections.add(raw, new)?)));
        Ok(new.map(|(raw, connection)| {
            self.wants.push(sink.connection(connection));
            (raw, connection.id)
        }))
    }
}

/// What a second reader of a bag finds, on its way to the sink.
pub(crate) struct SecondFinds<'s, G> {
    announced: Announced<G>,
    gather: Gather,
    sink: &'s mut dyn Sink,
}

impl<'s, G: Grammar> SecondFinds<'s, G> {
    pub(crate) fn new(sink: &'s mut dyn Sink) -> Self {
        Self {
            announced: Announced::default(),
            gather: Gather::default(),
            sink,
        }
    }

    pub(crate) fn describe(&mut self, what: &G::Description, data: &[u8]) {
        // Errors are reported with the connection's messages.
        let _ = self.announced.describe(what, data, self.sink);
    }

    pub(crate) fn message(&mut self, raw: u32, time: Stamp, data: &[u8]) {
        let Some((id, want)) = self.announced.get(raw) else {
            return nameless(self.sink, 1);
        };
        hand_over_slice(data, (id, time), want, self.sink);
        let size = u32::try_from(data.len()).unwrap_or(u32::MAX);
        self.gather.add(id, time, size, self.sink);
    }

    /// Reports what was gathered.
    pub(crate) fn flush(&mut self) {
        self.gather.flush(self.sink);
    }
}
