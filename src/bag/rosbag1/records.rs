//! The records of a ROS 1 bag: headers of fields, never trusted, and the connections they announce.

use std::collections::{HashMap, HashSet};
use std::io;
use std::sync::Arc;

use crate::bag::model::{Connection, ConnectionId, Encoding};
use crate::bag::source::Stream;
use crate::base::name::{NodeName, TopicName};
use crate::base::time::Stamp;

/// A record's header, as far as it concerns us.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Record {
    Bag {
        index_pos: u64,
        connections: u32,
        chunks: u32,
        encryptor: String,
    },
    Chunk {
        compression: Vec<u8>,
        size: u32,
    },
    Connection {
        id: u32,
        topic: Vec<u8>,
    },
    Message {
        id: u32,
        time: Stamp,
    },
    Index {
        id: u32,
        count: u32,
    },
    ChunkInfo {
        pos: u64,
        start: Stamp,
        end: Stamp,
        count: u32,
    },
    /// An operation that we do not know, or one without the fields it needs.
    Other,
}

/// Why no record comes.
#[derive(Debug)]
pub(super) enum Stop {
    /// The bytes end where a record could begin.
    End,
    /// They end inside a record.
    Cut,
    /// What stands here is no record.
    Broken,
    /// The system, or a decompressor, refuses.
    Io(io::Error),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Cut,
            _ => Self::Io(error),
        }
    }
}

/// The longest header that is believed, in bytes; real ones stay below 300.
const LONGEST_HEADER: usize = 1 << 20;

/// Takes the head of the next record: what it is, and the length of the data that `stream` then stands at.
///
/// An index record's length comes from its count: writers of 2010 put a wrong one.
pub(super) fn next(stream: &mut Stream<'_>) -> Result<(Record, u32), Stop> {
    let (record, mut len) = next_as_stated(stream)?;
    if let Record::Index { count, .. } = record {
        len = count.checked_mul(ENTRY).ok_or(Stop::Broken)?;
    }
    Ok((record, len))
}

/// As [`next`], with the length that the record states.
pub(super) fn next_as_stated(stream: &mut Stream<'_>) -> Result<(Record, u32), Stop> {
    let head = stream.peek(4)?;
    if head.is_empty() {
        return Err(Stop::End);
    }
    let header_len = u32_at(head, 0).ok_or(Stop::Cut)? as usize;
    // No record is without fields; where the disk was full, zeros stand.
    if header_len == 0 || header_len > LONGEST_HEADER {
        return Err(Stop::Broken);
    }
    let whole = stream.peek(header_len + 8)?;
    let header = whole.get(4..4 + header_len).ok_or(Stop::Cut)?;
    let data_len = u32_at(whole, 4 + header_len).ok_or(Stop::Cut)?;
    let record = parse(header).ok_or(Stop::Broken)?;
    stream.advance(header_len + 8);
    Ok((record, data_len))
}

/// The bytes of an entry of an index record: time and offset.
pub(super) const ENTRY: u32 = 12;

/// What a header says; `None` if it is none: a field without a name, or longer than the header.
pub(super) fn parse(header: &[u8]) -> Option<Record> {
    let mut fields = Fields::default();
    let mut rest = header;
    while !rest.is_empty() {
        let (name, value, after) = field(rest)?;
        rest = after;
        if fields.count < MOST_FIELDS {
            fields.all[fields.count] = (name, value);
            fields.count += 1;
        }
    }
    Some(fields.record().unwrap_or(Record::Other))
}

/// Whether a chunk's record begins here.
pub(super) fn is_chunk(bytes: &[u8]) -> bool {
    // Real headers take 40 to 60 bytes; the test is made at every byte.
    let len = u32_at(bytes, 0).filter(|n| (20..200).contains(n));
    let header = len.and_then(|n| bytes.get(4..4 + n as usize));
    matches!(header.and_then(parse), Some(Record::Chunk { .. }))
}

/// Real headers have up to six fields.
const MOST_FIELDS: usize = 12;

/// The names and values in a header.
#[derive(Default)]
struct Fields<'a> {
    all: [(&'a [u8], &'a [u8]); MOST_FIELDS],
    count: usize,
}

impl<'a> Fields<'a> {
    fn get(&self, name: &[u8]) -> Option<&'a [u8]> {
        let mut all = self.all[..self.count].iter();
        all.find(|(found, _)| *found == name)
            .map(|(_, value)| *value)
    }

    fn u32(&self, name: &[u8]) -> Option<u32> {
        self.get(name)?.try_into().ok().map(u32::from_le_bytes)
    }

    fn u64(&self, name: &[u8]) -> Option<u64> {
        self.get(name)?.try_into().ok().map(u64::from_le_bytes)
    }

    fn time(&self, name: &[u8]) -> Option<Stamp> {
        time_at(self.get(name)?, 0)
    }

    fn record(&self) -> Option<Record> {
        Some(match self.get(b"op")?.first()? {
            2 => Record::Message {
                id: self.u32(b"conn")?,
                time: self.time(b"time")?,
            },
            3 => Record::Bag {
                index_pos: self.u64(b"index_pos")?,
                connections: self.u32(b"conn_count")?,
                chunks: self.u32(b"chunk_count")?,
                encryptor: text(self.get(b"encryptor").unwrap_or_default()),
            },
            4 if self.u32(b"ver")? == 1 => Record::Index {
                id: self.u32(b"conn")?,
                count: self.u32(b"count")?,
            },
            5 => Record::Chunk {
                compression: self.get(b"compression")?.to_vec(),
                size: self.u32(b"size")?,
            },
            6 if self.u32(b"ver")? == 1 => Record::ChunkInfo {
                pos: self.u64(b"chunk_pos")?,
                start: self.time(b"start_time")?,
                end: self.time(b"end_time")?,
                count: self.u32(b"count")?,
            },
            7 => Record::Connection {
                id: self.u32(b"conn")?,
                topic: self.get(b"topic")?.to_vec(),
            },
            _ => return None,
        })
    }
}

/// The first field of a header and what follows it.
fn field(header: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let len = u32_at(header, 0)? as usize;
    let (field, rest) = header[4..].split_at_checked(len)?;
    let equals = field.iter().position(|b| *b == b'=')?;
    Some((&field[..equals], &field[equals + 1..], rest))
}

/// The number that stands at `at`, if there are four bytes.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    four.try_into().ok().map(u32::from_le_bytes)
}

/// The time that stands at `at`, if there are eight bytes.
pub(super) fn time_at(bytes: &[u8], at: usize) -> Option<Stamp> {
    Some(Stamp::from_ros(u32_at(bytes, at)?, u32_at(bytes, at + 4)?))
}

/// Text of any encoding; what is not UTF-8 is replaced.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The connections of a bag by their ids in it.
#[derive(Default)]
pub(super) struct Table {
    list: Vec<Connection>,
    ids: HashMap<u32, ConnectionId>,
    definitions: HashSet<Arc<str>>,
    held: usize,
}

/// More connections than this are not kept; real bags stay below 1,000.
const MOST_CONNECTIONS: usize = 100_000;
/// More text of definitions than this is not kept, in bytes.
const MOST_TEXT: usize = 8 << 20;

impl Table {
    /// The connection that the bag calls `id`.
    pub(super) fn get(&self, id: u32) -> Option<ConnectionId> {
        self.ids.get(&id).copied()
    }

    /// All of them in the order of their announcement.
    pub(super) fn list(&self) -> &[Connection] {
        &self.list
    }

    /// Adds what a connection record says; answers the connection if it is new. A second one of the same id is
    /// passed over, as every reader does.
    pub(super) fn add(&mut self, id: u32, topic: &[u8], data: &[u8]) -> Option<&Connection> {
        if self.ids.contains_key(&id) || self.list.len() >= MOST_CONNECTIONS {
            return None;
        }
        let place = ConnectionId(u32::try_from(self.list.len()).ok()?);
        let mut connection = blank(place, text(topic).into());
        self.describe(&mut connection, data);
        self.ids.insert(id, place);
        self.list.push(connection);
        self.list.last()
    }

    fn describe(&mut self, connection: &mut Connection, mut data: &[u8]) {
        while let Some((name, value, rest)) = field(data) {
            data = rest;
            match name {
                b"type" => connection.type_name = text(value).into(),
                b"md5sum" => connection.type_hash = Some(text(value).into()),
                b"message_definition" => connection.definition = self.definition(value),
                b"latching" => connection.latching = value == b"1",
                b"callerid" if !value.is_empty() => {
                    connection.publisher = Some(NodeName::from(text(value)));
                }
                _ => {}
            }
        }
    }

    /// Equal definitions share one text.
    fn definition(&mut self, value: &[u8]) -> Option<Arc<str>> {
        let text = String::from_utf8_lossy(value);
        if let Some(known) = self.definitions.get(text.as_ref()) {
            return Some(Arc::clone(known));
        }
        self.held += text.len();
        if self.held > MOST_TEXT {
            return None;
        }
        let new: Arc<str> = text.into();
        self.definitions.insert(Arc::clone(&new));
        Some(new)
    }
}

/// A connection of which only the topic is known.
fn blank(id: ConnectionId, topic: TopicName) -> Connection {
    Connection {
        id,
        topic,
        type_name: "".into(),
        definition: None,
        type_hash: None,
        publisher: None,
        latching: false,
        qos: None,
        encoding: Encoding::Ros1,
    }
}
