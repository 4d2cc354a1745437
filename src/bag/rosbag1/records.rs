//! The records of a ROS 1 bag: headers of fields, never trusted, and the connections they describe.

use std::sync::Arc;

use super::Rosbag1;
use crate::bag::chunked::NoRecord;
use crate::bag::decompress::Compression;
use crate::bag::model::Connection;
use crate::bag::source::ByteStream;
use crate::base::budget::DEFINITIONS;
use crate::base::name::NodeName;
use crate::base::time::Stamp;

/// The header of a record, as far as it is used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Header {
    Bag {
        index_pos: u64,
        connections: u32,
        chunks: u32,
        encryptor: String,
    },
    Chunk {
        /// `None` for an unknown compression.
        how: Option<Compression>,
        size: u32,
    },
    Connection {
        raw: u32,
        topic: Vec<u8>,
    },
    Message {
        raw: u32,
        time: Stamp,
    },
    Index {
        raw: u32,
        count: u32,
    },
    ChunkInfo {
        pos: u64,
        start: Stamp,
        end: Stamp,
        count: u32,
    },
    /// An unknown operation, or one without the fields it needs.
    Unknown,
}

/// The longest header that is accepted, in bytes; real ones stay below 300.
const LONGEST_HEADER: usize = 1 << 20;

/// Takes the header of the next record, and the stated length of the data that follows in `stream`.
pub(super) fn header(stream: &mut ByteStream<'_>) -> Result<(Header, u32), NoRecord> {
    let head = stream.peek(4)?;
    if head.is_empty() {
        return Err(NoRecord::End);
    }
    let header_len = u32_at(head, 0).ok_or(NoRecord::Cut)? as usize;
    // Every record has fields; a full disk leaves zeros.
    if header_len == 0 || header_len > LONGEST_HEADER {
        return Err(NoRecord::Broken);
    }
    let whole = stream.peek(header_len + 8)?;
    let header = whole.get(4..4 + header_len).ok_or(NoRecord::Cut)?;
    let data_len = u32_at(whole, 4 + header_len).ok_or(NoRecord::Cut)?;
    let record = parse(header).ok_or(NoRecord::Broken)?;
    stream.advance(header_len + 8);
    Ok((record, data_len))
}

/// The header of the record that begins here, and the number of its bytes; `None` unless it is of a usual length: 40 to 60
/// bytes, more with a long topic. Tested at every byte.
pub(super) fn short(bytes: &[u8]) -> Option<(Header, usize)> {
    let len = u32_at(bytes, 0).filter(|n| (20..300).contains(n))? as usize;
    let header = parse(bytes.get(4..4 + len)?).filter(|header| *header != Header::Unknown)?;
    let data = u32_at(bytes, 4 + len)? as usize;
    Some((header, 8 + len + data))
}

/// The number of bytes of an entry of an index record: time and offset.
pub(super) const ENTRY: u32 = 12;

/// The parsed header; `None` if it is broken: a field without a name, or longer than the header.
pub(super) fn parse(header: &[u8]) -> Option<Header> {
    let mut rest = header;
    while !rest.is_empty() {
        rest = field(rest)?.2;
    }
    Some(record(header).unwrap_or(Header::Unknown))
}

/// The value of a header's field; the first of duplicates counts.
fn value<'a>(mut header: &'a [u8], wanted: &str) -> Option<&'a [u8]> {
    loop {
        let (name, value, rest) = field(header)?;
        if name == wanted.as_bytes() {
            return Some(value);
        }
        header = rest;
    }
}

fn record(header: &[u8]) -> Option<Header> {
    let value = |name| value(header, name);
    let number = |name| value(name)?.try_into().ok().map(u32::from_le_bytes);
    let place = |name| value(name)?.try_into().ok().map(u64::from_le_bytes);
    let time = |name| time_at(value(name)?, 0);
    let is_version_1 = || number("ver") == Some(1);
    Some(match value("op")?.first()? {
        2 => Header::Message {
            raw: number("conn")?,
            time: time("time")?,
        },
        3 => Header::Bag {
            index_pos: place("index_pos")?,
            connections: number("conn_count")?,
            chunks: number("chunk_count")?,
            encryptor: text(value("encryptor").unwrap_or_default()),
        },
        4 if is_version_1() => Header::Index {
            raw: number("conn")?,
            count: number("count")?,
        },
        5 => Header::Chunk {
            how: Compression::named(value("compression")?),
            size: number("size")?,
        },
        6 if is_version_1() => Header::ChunkInfo {
            pos: place("chunk_pos")?,
            start: time("start_time")?,
            end: time("end_time")?,
            count: number("count")?,
        },
        7 => Header::Connection {
            raw: number("conn")?,
            topic: value("topic")?.to_vec(),
        },
        _ => return None,
    })
}

/// The first field of a header and the rest.
fn field(header: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let len = u32_at(header, 0)? as usize;
    let (field, rest) = header[4..].split_at_checked(len)?;
    let equals = field.iter().position(|b| *b == b'=')?;
    Some((&field[..equals], &field[equals + 1..], rest))
}

/// The number at `at`, if four bytes are available.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    four.try_into().ok().map(u32::from_le_bytes)
}

/// The time at `at`, if eight bytes are available.
pub(super) fn time_at(bytes: &[u8], at: usize) -> Option<Stamp> {
    Some(Stamp::from_ros(u32_at(bytes, at)?, u32_at(bytes, at + 4)?))
}

/// Text of any encoding; bytes that are not UTF-8 are replaced.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The connection that a record describes, with the fields before the first damaged one.
pub(super) fn connection(grammar: &mut Rosbag1, topic: &[u8], mut data: &[u8]) -> Connection {
    let mut connection = Connection {
        topic: text(topic).into(),
        ..Connection::default()
    };
    while let Some((name, value, rest)) = field(data) {
        data = rest;
        match name {
            b"type" => connection.type_name = text(value).into(),
            b"md5sum" => connection.type_hash = Some(text(value).into()),
            b"message_definition" => connection.definition = definition(grammar, value),
            b"latching" => connection.latching = value == b"1",
            b"callerid" if !value.is_empty() => {
                connection.publisher = Some(NodeName::from(text(value)));
            }
            _ => {}
        }
    }
    connection
}

/// The text of a definition; equal texts are shared.
fn definition(grammar: &mut Rosbag1, value: &[u8]) -> Option<Arc<str>> {
    let text = String::from_utf8_lossy(value);
    if let Some(known) = grammar.definitions.get(text.as_ref()) {
        return Some(Arc::clone(known));
    }
    grammar.held += text.len();
    if grammar.held > DEFINITIONS {
        return None;
    }
    let new: Arc<str> = text.into();
    grammar.definitions.insert(Arc::clone(&new));
    Some(new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_duplicate_fields_counts() {
        let mut header = Vec::new();
        for (name, value) in [
            ("op", 2),
            ("conn", 7),
            ("conn", 8),
            ("other", 1),
            ("time", 0),
        ] {
            let value = [value, 0, 0, 0, 0, 0, 0, 0];
            let value = &value[..if name == "time" { 8 } else { 4 }];
            let len = u32::try_from(name.len() + 1 + value.len()).unwrap();
            header.extend(len.to_le_bytes());
            header.extend([name.as_bytes(), b"=", value].concat());
        }
        let (raw, time) = (7, Stamp(0));
        assert_eq!(parse(&header), Some(Header::Message { raw, time }));
        assert_eq!(parse(&header[..header.len() - 20]), None);
    }
}
