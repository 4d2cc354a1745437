//! The records of an MCAP file, read with bounds, and the channels they describe.
//!
//! They are parsed here, from a stream and without copies, and no length in them determines memory use; invalid UTF-8
//! is replaced where the crate `mcap` rejects the record.

use std::sync::Arc;

use mcap::MAGIC;
use mcap::records::op;

use super::{Described, Mcap};
use crate::bag::chunked::{
    ChunkHead, Connections, Counts, MessageHead, NoRecord, RecordHead, RecordKind,
};
use crate::bag::decompress::Compression;
use crate::bag::model::{Connection, Encoding};
use crate::bag::source::{ByteStream, extended};
use crate::base::budget::DEFINITIONS;
use crate::base::time::Stamp;

/// The number of bytes of a record's head: kind and length.
pub(super) const HEAD: u64 = 9;
/// The number of bytes of a message before its payload.
const MESSAGE_HEAD: usize = 22;
/// The number of bytes of a schema without any text, the shortest record that is looked for.
const SHORTEST: usize = 2 + 4 + 4 + 4;
/// The number of bytes of an entry of a message index: time and offset.
pub(super) const ENTRY: usize = 16;
/// The lengths of a footer and of a data end record, which distinguish them from records with a damaged kind.
pub(super) const FOOTER: u64 = 20;
pub(super) const DATA_END: u64 = 4;
/// The number of bytes of statistics before the counts of channels.
pub(super) const STATISTICS: usize = 8 + 2 + 4 + 4 + 4 + 4 + 8 + 8;
/// The bytes of a record that are inspected for the lengths in it; names are shorter.
const MOST_LOOKED_AT: usize = 1024;
/// The first of the record kinds that the format leaves to its users.
const FIRST_EXTENSION: u8 = 0x80;

/// Takes the head of the next record.
pub(super) fn next(stream: &mut ByteStream<'_>) -> Result<RecordHead<Described>, NoRecord> {
    let is_first = stream.position() == MAGIC.len() as u64;
    let (kind, len) = head(stream)?;
    match kind {
        op::MESSAGE => return message(stream, len),
        op::CHUNK => return chunk(stream, len).map(of_chunk),
        // A full disk leaves zeros.
        0 => return Err(NoRecord::Broken),
        _ => {}
    }
    // One flipped bit makes a chunk an index, a description, or the end of the file.
    if is_chunk_of(stream.peek(CHUNK_HEAD + 32)?, len) {
        let mut chunk = chunk(stream, len)?;
        chunk.misnamed = true;
        return Ok(of_chunk(chunk));
    }
    let kind = match kind {
        op::MESSAGE_INDEX => index(stream, len)?,
        op::STATISTICS if len >= STATISTICS as u64 => {
            RecordKind::Total(counts(stream.peek(STATISTICS)?).ok_or(NoRecord::Cut)?)
        }
        op::CHUNK_INDEX => listed(stream.peek(24)?).ok_or(NoRecord::Cut)?,
        op::SCHEMA => RecordKind::Description(Described::Schema),
        op::CHANNEL => RecordKind::Description(Described::Channel),
        op::HEADER if !is_first => RecordKind::Unknown { extension: false },
        op::HEADER | op::ATTACHMENT | op::METADATA => {
            let content = content_len(kind, stream.peek(MOST_LOOKED_AT)?);
            let is_long = content.is_none() && len > MOST_LOOKED_AT as u64;
            if !is_long && !content.is_some_and(|content| is_extended(content, len)) {
                return Err(NoRecord::Broken);
            }
            RecordKind::Other
        }
        op::ATTACHMENT_INDEX | op::METADATA_INDEX | op::SUMMARY_OFFSET => RecordKind::Tail,
        op::DATA_END if len == DATA_END => RecordKind::DataEnd(data_crc(stream.peek(4)?)),
        op::FOOTER if len == FOOTER => {
            let crc = stream.peek(20)?.get(16..).unwrap_or_default();
            RecordKind::FileEnd(FieldCursor(crc).u32().filter(|crc| *crc != 0))
        }
        op::DATA_END | op::FOOTER => return Err(NoRecord::Broken),
        kind => RecordKind::Unknown {
            extension: kind >= FIRST_EXTENSION,
        },
    };
    Ok(RecordHead { kind, len })
}

fn of_chunk(head: ChunkHead) -> RecordHead<Described> {
    RecordHead {
        len: head.packed.saturating_add(head.padding),
        kind: RecordKind::Chunk(head),
    }
}

/// The counts of the whole file in a statistics record.
pub(super) fn counts(record: &[u8]) -> Option<Counts> {
    let mut cursor = FieldCursor(record);
    let messages = cursor.u64()?;
    let (_schemas, channels) = (cursor.u16()?, cursor.u32()?);
    let (_attachments, _metadata) = (cursor.u32()?, cursor.u32()?);
    Some(Counts {
        messages,
        channels,
        chunks: cursor.u32()?,
    })
}

/// The CRC-32 of all bytes before the content of the data end record. The stated one (0 for none) covers the bytes
/// before the record, whose head is constant.
fn data_crc(content: &[u8]) -> Option<u32> {
    let stated = FieldCursor(content).u32().filter(|crc| *crc != 0)?;
    let sum = extended(stated, &[op::DATA_END]);
    Some(extended(sum, &DATA_END.to_le_bytes()))
}

/// The chunk that a chunk index lists.
fn listed(content: &[u8]) -> Option<RecordKind<Described>> {
    let mut cursor = FieldCursor(content);
    let times = (cursor.u64()?, cursor.u64()?);
    Some(RecordKind::Listed {
        at: cursor.u64()?,
        times: (Stamp::from_nanos(times.0), Stamp::from_nanos(times.1)),
    })
}

/// The length of a record according to the lengths in it; `None` if these first bytes do not contain them.
fn content_len(kind: u8, content: &[u8]) -> Option<u64> {
    let mut cursor = FieldCursor(content);
    if kind == op::ATTACHMENT {
        let _times = (cursor.u64()?, cursor.u64()?);
    }
    let mut len = content.len() - cursor.0.len();
    len += 4 + cursor.bytes()?.len();
    let last = match kind {
        op::ATTACHMENT => {
            len += 4 + cursor.bytes()?.len();
            // The length of the data, and the checksum after it.
            cursor.u64()?.checked_add(8 + 4)?
        }
        _ => 4 + u64::from(cursor.u32()?),
    };
    last.checked_add(len as u64)
}

/// Takes a record's kind and the length of the content that follows in `stream`.
pub(super) fn head(stream: &mut ByteStream<'_>) -> Result<(u8, u64), NoRecord> {
    let head = stream.peek(9)?;
    if head.is_empty() {
        return Err(NoRecord::End);
    }
    let mut cursor = FieldCursor(head);
    let (Some(kind), Some(len)) = (cursor.u8(), cursor.u64()) else {
        return Err(NoRecord::Cut);
    };
    stream.advance(9);
    Ok((kind, len))
}

/// Takes the fields before a message's payload.
fn message(stream: &mut ByteStream<'_>, len: u64) -> Result<RecordHead<Described>, NoRecord> {
    let size = len.checked_sub(MESSAGE_HEAD as u64);
    let size = size.and_then(|size| u32::try_from(size).ok());
    let mut cursor = FieldCursor(stream.peek(MESSAGE_HEAD)?);
    let (channel, _sequence) = (cursor.u16(), cursor.u32());
    let (log_time, publish_time) = (cursor.u64(), cursor.u64());
    let (Some(raw), Some(time), Some(_)) = (channel, log_time, publish_time) else {
        return Err(NoRecord::Cut);
    };
    let size = size.ok_or(NoRecord::Broken)?;
    stream.advance(MESSAGE_HEAD);
    let head = MessageHead {
        raw: u32::from(raw),
        time: Stamp::from_nanos(time),
        size,
    };
    Ok(RecordHead {
        kind: RecordKind::Message(head),
        len: u64::from(size),
    })
}

/// The most bytes that unknown fields at the end of a record may take; with more, a length is damaged.
const MOST_EXTENSION: u64 = 4096;

/// Whether a record of `len` bytes may have this `content`: later versions of the format may add fields at its end.
fn is_extended(content: u64, len: u64) -> bool {
    len.checked_sub(content)
        .is_some_and(|unknown| unknown <= MOST_EXTENSION)
}

/// Parses the head of a message index.
fn index(stream: &mut ByteStream<'_>, len: u64) -> Result<RecordKind<Described>, NoRecord> {
    let mut cursor = FieldCursor(stream.peek(6)?);
    let (channel, entries) = (cursor.u16(), cursor.u32().map(u64::from));
    let (Some(channel), Some(entries)) = (channel, entries) else {
        return Err(NoRecord::Cut);
    };
    if !is_extended(entries + 6, len) || entries % ENTRY as u64 != 0 {
        return Ok(RecordKind::Unknown { extension: false });
    }
    Ok(RecordKind::Index {
        raw: u32::from(channel),
        count: u32::try_from(entries / ENTRY as u64).unwrap_or(u32::MAX),
    })
}

/// The number of bytes of a chunk before the name of its compression.
const CHUNK_HEAD: usize = 8 + 8 + 8 + 4;

/// Takes the fields before a chunk's records.
pub(super) fn chunk(stream: &mut ByteStream<'_>, len: u64) -> Result<ChunkHead, NoRecord> {
    let bytes = stream.peek(256)?;
    let total = bytes.len();
    let mut cursor = FieldCursor(bytes);
    let mut read = || {
        let (first, last, plain) = (cursor.u64()?, cursor.u64()?, cursor.u64()?);
        let crc = cursor.u32()?;
        let name = cursor.bytes()?;
        // A record without a plausible compression name is not a chunk.
        let is_word = name.len() <= 16 && name.iter().all(u8::is_ascii_graphic);
        let how = Compression::named(name);
        let packed = cursor.u64().filter(|_| is_word)?;
        let times = (Stamp::from_nanos(first), Stamp::from_nanos(last));
        Some((times, plain, crc, how, packed))
    };
    let Some((times, plain, crc, how, packed)) = read() else {
        return Err(if total < 256 {
            NoRecord::Cut
        } else {
            NoRecord::Broken
        });
    };
    let skip = total - cursor.0.len();
    let room = len.checked_sub(skip as u64).ok_or(NoRecord::Broken)?;
    stream.advance(skip);
    let packed = packed.min(room);
    let behind = room - packed;
    Ok(ChunkHead {
        how,
        packed,
        padding: if is_extended(packed, room) { behind } else { 0 },
        plain,
        crc: (crc != 0).then_some(crc),
        // An empty chunk has zeros.
        times: (times.0 <= times.1 && times.1 > Stamp(0)).then_some(times),
        ..ChunkHead::default()
    })
}

/// Whether a chunk begins here.
pub(super) fn is_chunk(bytes: &[u8]) -> bool {
    if bytes.first() != Some(&op::CHUNK) {
        return false;
    }
    let mut cursor = FieldCursor(&bytes[1..]);
    cursor.u64().is_some_and(|len| is_chunk_of(cursor.0, len))
}

/// Whether a message, schema or channel begins here, which another record or the end of the bytes follows.
pub(super) fn is_content(bytes: &[u8]) -> bool {
    let record = |bytes| {
        let mut cursor = FieldCursor(bytes);
        let kind = cursor
            .u8()
            .filter(|kind| (1..=op::DATA_END).contains(kind))?;
        let len = u32::try_from(cursor.u64()?).ok()?;
        Some((kind, len as usize, cursor.0))
    };
    let Some((kind, len, content)) = record(bytes) else {
        return false;
    };
    let is_kept = match kind {
        // Its time is known: among small numbers, zeros follow.
        op::MESSAGE => content.get(6..14).is_some_and(|time| time != [0; 8]),
        kind => matches!(kind, op::SCHEMA | op::CHANNEL),
    };
    let next = content.get(len..);
    let is_followed = next.is_some_and(|next| next.is_empty() || record(next).is_some());
    is_kept && len >= SHORTEST && is_followed
}

/// Whether a record of `len` bytes that begins like this is a chunk: its two lengths agree.
fn is_chunk_of(bytes: &[u8], len: u64) -> bool {
    let mut rest = FieldCursor(bytes.get(CHUNK_HEAD..).unwrap_or_default());
    let Some(name) = rest.bytes() else {
        return false;
    };
    let head = (CHUNK_HEAD + 4 + name.len() + 8) as u64;
    let packed = rest.u64().and_then(|packed| packed.checked_add(head));
    Compression::named(name).is_some() && packed == Some(len)
}

/// A cursor over the fields of a record, never past the end.
pub(super) struct FieldCursor<'a>(pub(super) &'a [u8]);

impl<'a> FieldCursor<'a> {
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

    /// A length-prefixed byte string.
    pub(super) fn bytes(&mut self) -> Option<&'a [u8]> {
        let len = usize::try_from(self.u32()?).ok()?;
        let (bytes, rest) = self.0.split_at_checked(len)?;
        self.0 = rest;
        Some(bytes)
    }

    /// A length-prefixed text; invalid UTF-8 is replaced.
    pub(super) fn text(&mut self) -> Option<String> {
        Some(String::from_utf8_lossy(self.bytes()?).into_owned())
    }
}

/// A schema: the name of a type and its definition.
pub(super) struct SchemaRecord {
    name: Arc<str>,
    definition: Option<Arc<str>>,
    is_idl: bool,
}

/// Adds the schema of a record; `None` if it is damaged. A second one with the same id is ignored.
pub(super) fn schema(grammar: &mut Mcap, record: &[u8]) -> Option<()> {
    let mut cursor = FieldCursor(record);
    let id = cursor.u16()?;
    let (name, encoding) = (cursor.text()?, cursor.text()?);
    let data = cursor.bytes()?;
    if grammar.schemas.contains_key(&id) {
        return Some(());
    }
    let is_idl = encoding.ends_with("idl");
    let is_text = is_idl || encoding.starts_with("ros");
    grammar.held += data.len();
    let is_held = is_text && grammar.held < DEFINITIONS;
    let schema = SchemaRecord {
        name: name.into(),
        definition: is_held.then(|| String::from_utf8_lossy(data).into()),
        is_idl,
    };
    grammar.schemas.insert(id, schema);
    Some(())
}

/// The connection that a channel record describes, if it is new.
///
/// # Errors
/// If the record is damaged or contradicts an earlier one with the same id.
pub(super) fn channel(
    grammar: &Mcap,
    record: &[u8],
    known: &Connections,
) -> Result<Option<(u32, Connection)>, NoRecord> {
    let mut cursor = FieldCursor(record);
    let mut read = || {
        let (id, schema) = (u32::from(cursor.u16()?), cursor.u16()?);
        Some((id, schema, cursor.text()?, cursor.text()?))
    };
    let (id, schema, topic, encoding) = read().ok_or(NoRecord::Broken)?;
    if let Some(at) = known.get(id) {
        let is_same = known.list()[at.0 as usize].topic.as_str() == topic;
        return if is_same {
            Ok(None)
        } else {
            Err(NoRecord::Broken)
        };
    }
    let schema = grammar.schemas.get(&schema);
    let mut connection = Connection {
        topic: topic.into(),
        type_name: schema.map_or_else(|| "".into(), |s| Arc::clone(&s.name)),
        definition: schema.and_then(|s| s.definition.clone()),
        is_idl: schema.is_some_and(|s| s.is_idl),
        encoding: match encoding.as_str() {
            "ros1" => Encoding::Ros1,
            "cdr" => Encoding::Cdr,
            _ => Encoding::Other(encoding),
        },
        ..Connection::default()
    };
    describe(&mut connection, cursor.bytes().unwrap_or_default());
    Ok(Some((id, connection)))
}

/// Adds the fields that ROS stores in a channel's metadata.
fn describe(connection: &mut Connection, metadata: &[u8]) {
    let mut cursor = FieldCursor(metadata);
    while let (Some(key), Some(value)) = (cursor.text(), cursor.text()) {
        match key.as_str() {
            _ if value.is_empty() => {}
            "callerid" => connection.publisher = Some(value.into()),
            "latching" => connection.latching = value == "1" || value == "true",
            "md5sum" | "topic_type_hash" => connection.type_hash = Some(value.into()),
            "offered_qos_profiles" => connection.qos = Some(value.into()),
            key if connection.publisher.is_none() && names_publisher(key, &value) => {
                connection.publisher = Some(value.into());
            }
            _ => {}
        }
    }
}

/// Whether an entry of a channel's metadata names the publishing node: recorders have no common key for it, but a
/// node's full name begins with a slash and has no blanks.
fn names_publisher(key: &str, value: &str) -> bool {
    let key = key.to_lowercase();
    let is_about = ["node", "publisher", "caller"]
        .iter()
        .any(|word| key.contains(word));
    let is_name = |c: char| c.is_ascii_alphanumeric() || "/_".contains(c);
    is_about && value.len() > 1 && value.starts_with('/') && value.chars().all(is_name)
}
