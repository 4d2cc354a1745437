//! The records of an MCAP file, read with bounds, and the channels they announce.
//!
//! The format: <https://mcap.dev/spec>.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;

use crate::bag::model::{Connection, ConnectionId, Encoding, MOST_PAYLOAD};
use crate::bag::source::Stream;
use crate::base::time::Stamp;

/// What a file begins and ends with.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The kinds of records that concern us.
pub(super) mod op {
    pub(in super::super) const HEADER: u8 = 1;
    pub(in super::super) const FOOTER: u8 = 2;
    pub(in super::super) const SCHEMA: u8 = 3;
    pub(in super::super) const CHANNEL: u8 = 4;
    pub(in super::super) const MESSAGE: u8 = 5;
    pub(in super::super) const CHUNK: u8 = 6;
    pub(in super::super) const MESSAGE_INDEX: u8 = 7;
    pub(in super::super) const CHUNK_INDEX: u8 = 8;
    pub(in super::super) const STATISTICS: u8 = 11;
    pub(in super::super) const DATA_END: u8 = 15;
}

/// The bytes of a record's head: kind and length.
pub(super) const HEAD: u64 = 9;
/// The bytes of a message before its payload.
pub(super) const MESSAGE_HEAD: u64 = 22;

/// Takes the head of the next record: its kind, and the length of what `stream` then stands at. `None` at the end.
pub(super) fn next(stream: &mut Stream<'_>) -> io::Result<Option<(u8, u64)>> {
    let head = stream.peek(9)?;
    if head.is_empty() {
        return Ok(None);
    }
    let mut cursor = Cursor(head);
    let (Some(kind), Some(len)) = (cursor.u8(), cursor.u64()) else {
        return Err(io::ErrorKind::UnexpectedEof.into());
    };
    stream.advance(9);
    Ok(Some((kind, len)))
}

/// The whole record that `stream` stands at, without taking it; `None` if it is too long to be one of those that are
/// looked into, or cut.
pub(super) fn whole<'s>(stream: &'s mut Stream<'_>, len: u64) -> io::Result<Option<&'s [u8]>> {
    let len = usize::try_from(len).unwrap_or(usize::MAX);
    if len > MOST_PAYLOAD {
        return Ok(None);
    }
    let bytes = stream.peek(len)?;
    Ok((bytes.len() == len).then_some(bytes))
}

/// Takes the head of a message record: its channel, its log time, the length of its payload.
pub(super) fn message(stream: &mut Stream<'_>, len: u64) -> Option<(u16, Stamp, u32)> {
    let size = u32::try_from(len.checked_sub(MESSAGE_HEAD)?).ok()?;
    let mut cursor = Cursor(stream.peek(22).ok()?);
    let (channel, _sequence) = (cursor.u16()?, cursor.u32()?);
    let (log, _publish) = (cursor.u64()?, cursor.u64()?);
    stream.advance(22);
    Some((channel, Stamp::from_nanos(log), size))
}

/// What stands before a chunk's records.
pub(super) struct ChunkHead {
    pub(super) compression: Vec<u8>,
    /// Where the compressed records begin, from the start of what follows the record's head.
    pub(super) skip: u64,
    pub(super) compressed: u64,
}

/// Reads the head of the chunk that `stream` stands at, without taking it.
pub(super) fn chunk(stream: &mut Stream<'_>) -> io::Result<Option<ChunkHead>> {
    let bytes = stream.peek(256)?;
    let total = bytes.len();
    let mut cursor = Cursor(bytes);
    let mut read = || {
        let (_start, _end, _size, _crc) =
            (cursor.u64()?, cursor.u64()?, cursor.u64()?, cursor.u32()?);
        let compression = cursor.bytes()?.to_vec();
        let compressed = cursor.u64()?;
        let skip = (total - cursor.0.len()) as u64;
        Some(ChunkHead {
            compression,
            skip,
            compressed,
        })
    };
    Ok(read())
}

/// Fields one after the other, never past the end.
pub(super) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (field, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*field)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    /// Bytes behind their length.
    pub(super) fn bytes(&mut self) -> Option<&'a [u8]> {
        let len = usize::try_from(self.u32()?).ok()?;
        let (bytes, rest) = self.0.split_at_checked(len)?;
        self.0 = rest;
        Some(bytes)
    }

    /// Text behind its length; what is not UTF-8 is replaced.
    pub(super) fn text(&mut self) -> Option<String> {
        Some(String::from_utf8_lossy(self.bytes()?).into_owned())
    }
}

/// A schema: the name of a type and its definition.
struct Schema {
    name: Arc<str>,
    definition: Option<Arc<str>>,
}

/// The channels of a file by their ids in it.
#[derive(Default)]
pub(super) struct Table {
    list: Vec<Connection>,
    ids: HashMap<u16, ConnectionId>,
    schemas: HashMap<u16, Schema>,
    held: usize,
}

/// More text of definitions than this is not kept, in bytes.
const MOST_TEXT: usize = 8 << 20;

impl Table {
    /// The connection of a channel.
    pub(super) fn get(&self, channel: u16) -> Option<ConnectionId> {
        self.ids.get(&channel).copied()
    }

    /// All connections in the order of their announcement.
    pub(super) fn list(&self) -> &[Connection] {
        &self.list
    }

    /// Adds what a schema record says. A second one of the same id is passed over.
    pub(super) fn schema(&mut self, record: &[u8]) -> Option<()> {
        let mut cursor = Cursor(record);
        let (id, name, encoding) = (cursor.u16()?, cursor.text()?, cursor.text()?);
        let data = cursor.bytes()?;
        let is_text = encoding.starts_with("ros") || encoding.ends_with("idl");
        let text = std::str::from_utf8(data)
            .ok()
            .filter(|t| is_text && !t.is_empty());
        self.held += data.len();
        let definition = text.filter(|_| self.held < MOST_TEXT).map(Arc::from);
        let name = name.into();
        self.schemas
            .entry(id)
            .or_insert(Schema { name, definition });
        Some(())
    }

    /// Adds what a channel record says; answers the connection if it is new. A second one of the same id is passed
    /// over.
    pub(super) fn channel(&mut self, record: &[u8]) -> Option<&Connection> {
        let mut cursor = Cursor(record);
        let (id, schema) = (cursor.u16()?, cursor.u16()?);
        if self.ids.contains_key(&id) {
            return None;
        }
        let (topic, encoding) = (cursor.text()?, cursor.text()?);
        let place = ConnectionId(u32::try_from(self.list.len()).ok()?);
        let schema = self.schemas.get(&schema);
        let mut connection = Connection {
            id: place,
            topic: topic.into(),
            type_name: schema.map_or_else(|| "".into(), |s| Arc::clone(&s.name)),
            definition: schema.and_then(|s| s.definition.clone()),
            type_hash: None,
            publisher: None,
            latching: false,
            qos: None,
            encoding: match encoding.as_str() {
                "ros1" => Encoding::Ros1,
                "cdr" => Encoding::Cdr,
                _ => Encoding::Other(encoding),
            },
        };
        describe(&mut connection, cursor.bytes().unwrap_or_default());
        self.ids.insert(id, place);
        self.list.push(connection);
        self.list.last()
    }
}

/// What ROS keeps in a channel's metadata.
fn describe(connection: &mut Connection, metadata: &[u8]) {
    let mut cursor = Cursor(metadata);
    while let (Some(key), Some(value)) = (cursor.text(), cursor.text()) {
        match key.as_str() {
            _ if value.is_empty() => {}
            "callerid" => connection.publisher = Some(value.into()),
            "latching" => connection.latching = value == "1" || value == "true",
            "md5sum" | "topic_type_hash" => connection.type_hash = Some(value.into()),
            "offered_qos_profiles" => connection.qos = Some(value.into()),
            _ => {}
        }
    }
}
