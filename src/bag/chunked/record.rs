//! The records of a chunked bag as a grammar parses them, those inside a chunk, the reasons why no record follows and the search
//! for the next, and the described connections.

use std::collections::HashMap;
use std::fmt;
use std::io::{self, Read as _};
use std::sync::Arc;

use super::Grammar;
use super::index::{hand_over_slice, nameless};
use crate::bag::adapters::Gather;
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::model::{Connection, ConnectionId, Encoding, MOST_PAYLOAD, Sink, Want};
use crate::bag::source::ByteStream;
use crate::base::budget::CONNECTIONS;
use crate::base::time::Stamp;

/// The head of a record; the stream is positioned after it.
#[derive(Debug)]
pub(crate) struct RecordHead<D> {
    pub(crate) kind: RecordKind<D>,
    /// The number of bytes that follow, all of them of this record.
    pub(crate) len: u64,
}

/// The kind of a record, and the content of its head.
#[derive(Debug)]
pub(crate) enum RecordKind<D> {
    /// A chunk, whose body follows.
    Chunk(ChunkHead),
    /// A message; its payload follows.
    Message(MessageHead),
    /// A description of connections.
    Description(D),
    /// The number of messages of a connection in the previous chunk; their entries follow.
    Index { raw: u32, count: u32 },
    /// The numbers of messages and chunks that the bag states.
    Total(Counts),
    /// The position of a chunk that the bag's index lists, and the times of its first and last message.
    Listed { at: u64, times: (Stamp, Stamp) },
    /// The end of the data: no message follows. With the CRC-32 of all bytes of the bag before those that follow, if it is
    /// stated.
    DataEnd(Option<u32>),
    /// The end of the file: only the closing bytes of the bag follow. With the CRC-32 of all bytes from the end of the data up to
    /// the last four of this record, if it is stated.
    FileEnd(Option<u32>),
    /// A record that is ignored.
    Other,
    /// An ignored record that only occurs after the end of the data.
    Tail,
    /// A record of an undefined kind, or that cannot be of its stated kind. The format leaves `extension` kinds to its
    /// users.
    Unknown { extension: bool },
}

/// A message of the connection with the number `raw`, and the size of its payload in bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MessageHead {
    pub(crate) raw: u32,
    pub(crate) time: Stamp,
    pub(crate) size: u32,
}

impl<D> RecordKind<D> {
    /// Whether it only occurs after the end of the data, in formats that state one.
    pub(crate) fn is_of_the_end(&self) -> bool {
        matches!(self, Self::Tail | Self::Total(_) | Self::Listed { .. })
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
#[derive(Clone, Debug, Default)]
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

// The records of a chunk, one after the other, with checks of the chunk's own numbers.

/// The receiver of a chunk's records.
pub(super) trait Visitor<G: Grammar> {
    /// A message, whose payload is next in `stream`.
    fn message(&mut self, stream: &mut ByteStream<'_>, head: MessageHead) -> Result<(), NoRecord>;

    /// A description, the next `len` bytes of `stream`.
    fn description(
        &mut self,
        stream: &mut ByteStream<'_>,
        _what: &G::Description,
        len: u64,
    ) -> Result<(), NoRecord> {
        pass(stream, len)
    }
}

/// Visits the records of the chunk whose body is next in `stream`, and goes to its end. Returns the problem
/// with them, if any.
///
/// # Errors
/// Fails if the file ends first or cannot be read. If a chunk is stated to exceed the file, the stream is then at the
/// end of its records.
pub(super) fn unpack<G: Grammar>(
    stream: &mut ByteStream<'_>,
    head: &ChunkHead,
    allowance: &Arc<Allowance>,
    visitor: &mut dyn Visitor<G>,
) -> Result<Option<String>, NoRecord> {
    let end = stream.position().saturating_add(head.packed);
    let found = match (head.how, head.crc) {
        (None, _) => Some("its compression is not supported".to_owned()),
        (Some(Compression::None), None) => match records(stream, end, visitor) {
            Err(NoRecord::Io(e)) => return Err(NoRecord::Io(e)),
            Err(stop) => Some(stop.to_string()),
            Ok(()) if head.packed != head.plain => Some(NOT_AS_LONG.to_owned()),
            Ok(()) => None,
        },
        (Some(how), _) => summed(stream, head, how, allowance, visitor),
    };
    // Zeros over the head of a small chunk leave an empty one, and its records behind it.
    let is_blank = head.packed == 0 && head.padding > 0;
    let found = found.or_else(|| is_blank.then(|| NOT_AS_LONG.to_owned()));
    let rest = end.saturating_sub(stream.position());
    // A chunk cut by the end of the file is reported once, as the cut.
    pass(stream, rest.saturating_add(head.padding))?;
    Ok(found)
}

const NOT_AS_LONG: &str = "its length is wrong";

/// Visits the records of a chunk that is compressed or has a checksum, which requires reading all of it.
fn summed<G: Grammar>(
    stream: &mut ByteStream<'_>,
    head: &ChunkHead,
    how: Compression,
    allowance: &Arc<Allowance>,
    visitor: &mut dyn Visitor<G>,
) -> Option<String> {
    let from = stream.by_ref().take(head.packed);
    let mut plain = match allowance.open(how, from) {
        Ok(from) => ByteStream::of_reader(from),
        Err(e) => return Some(e.to_string()),
    };
    if head.crc.is_some() {
        plain.sum_up();
    }
    match records(&mut plain, u64::MAX, visitor) {
        Err(stop) => Some(stop.to_string()),
        Ok(()) if plain.sum() != head.crc => Some("its checksum is wrong".to_owned()),
        Ok(()) if plain.position() != head.plain => Some(NOT_AS_LONG.to_owned()),
        Ok(()) => None,
    }
}

/// Visits the records of a chunk up to position `end` of `stream`, or to its end.
///
/// # Errors
/// The reason why they end earlier. Records that do not belong in a chunk are skipped and reported at the end.
pub(super) fn records<G: Grammar>(
    stream: &mut ByteStream<'_>,
    end: u64,
    visitor: &mut dyn Visitor<G>,
) -> Result<(), NoRecord> {
    let mut is_odd = false;
    let stop = walk(stream, end, |stream| {
        let from = stream.position();
        let step = G::next(stream).and_then(|RecordHead { kind, len }| {
            let is_open = end == u64::MAX;
            let left = end.saturating_sub(stream.position());
            if len > left || is_open && !stream.has(len)? {
                // A length that exceeds the chunk is invalid.
                return Err(NoRecord::Broken);
            }
            match kind {
                RecordKind::Message(head) => visitor.message(stream, head),
                RecordKind::Description(what) => visitor.description(stream, &what, len),
                _ => {
                    is_odd = true;
                    pass(stream, len)
                }
            }
        });
        let is_broken = matches!(step, Err(NoRecord::Broken));
        if is_broken && next_record::<G>(stream, from, end) {
            is_odd = true;
            return Ok(());
        }
        step
    });
    match stop {
        NoRecord::End if is_odd => Err(NoRecord::Broken),
        NoRecord::End => Ok(()),
        stop => Err(stop),
    }
}

// The search for the next record behind bytes that are not one.

/// The number of bytes searched at a time for the next record.
const STRIDE: usize = 64 * 1024;

/// Goes to the beginning of the next chunk after byte `from`; false if there is none before the end of the stream.
pub(super) fn next_chunk<G: Grammar>(stream: &mut ByteStream<'_>, from: u64) -> bool {
    next(stream, from, u64::MAX, G::is_chunk)
}

/// As [`next_chunk`], for a chunk, a message or a description, before byte `end`.
pub(super) fn next_record<G: Grammar>(stream: &mut ByteStream<'_>, from: u64, end: u64) -> bool {
    let is_wanted = |bytes: &[u8]| G::is_chunk(bytes) || G::is_content(bytes);
    next(stream, from, end, is_wanted)
}

fn next(stream: &mut ByteStream<'_>, from: u64, end: u64, is_wanted: fn(&[u8]) -> bool) -> bool {
    if stream.position() <= from && !matches!(stream.skip(1), Ok(1)) {
        return false;
    }
    let left = end.saturating_sub(stream.position());
    let mut before = Before::new(stream, is_wanted);
    // An error of reading ends the search; the walk meets it again.
    let _ = io::copy(&mut before.by_ref().take(left), &mut io::sink());
    before.is_there && before.free == 0
}

/// The bytes of a stream before the next record that is wanted.
pub(super) struct Before<'a, 'b> {
    stream: &'a mut ByteStream<'b>,
    is_wanted: fn(&[u8]) -> bool,
    /// The number of next bytes at which none begins.
    free: usize,
    /// Whether one begins behind them.
    pub(super) is_there: bool,
}

impl<'a, 'b> Before<'a, 'b> {
    pub(super) fn new(stream: &'a mut ByteStream<'b>, is_wanted: fn(&[u8]) -> bool) -> Self {
        Self {
            stream,
            is_wanted,
            free: 0,
            is_there: false,
        }
    }
}

impl io::Read for Before<'_, '_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.free == 0 && !self.is_there {
            let window = self.stream.peek(2 * STRIDE)?;
            let searched = window.len().min(STRIDE);
            let found = (0..searched).find(|at| (self.is_wanted)(&window[*at..]));
            self.is_there = found.is_some();
            self.free = found.unwrap_or(searched);
        }
        let most = into.len().min(self.free);
        let read = self.stream.read(&mut into[..most])?;
        self.free -= read;
        Ok(read)
    }
}
