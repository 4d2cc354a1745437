//! Described bags as MCAP files, written by the crate `mcap`, and compressed with Zstandard afterwards: the crate's own
//! compressor would build the C library again, with everything it offers.

use std::collections::BTreeMap;
use std::io::Cursor;

use ::mcap::records::{MessageHeader, op};
use ::mcap::{MAGIC, WriteOptions};

use super::Recording;

/// The compression of chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packed {
    Lz4,
    Zstd,
}

/// How a file is written.
#[derive(Clone, Debug)]
pub struct Options {
    /// `ros1` or `ros2`.
    pub profile: &'static str,
    pub compression: Option<Packed>,
    pub chunked: bool,
    pub message_index: bool,
    pub summary: bool,
    pub chunk: u64,
    /// The key of a channel's metadata that names its publisher in ROS 2, if any.
    pub publisher_key: Option<&'static str>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            profile: "ros1",
            compression: Some(Packed::Zstd),
            chunked: true,
            message_index: true,
            summary: true,
            chunk: 16 * 1024,
            publisher_key: None,
        }
    }
}

/// A file of these messages.
pub fn write(recording: &Recording, options: &Options) -> Vec<u8> {
    let mut to = WriteOptions::new()
        .profile(options.profile)
        .library("bagreel tests")
        .compression((options.compression == Some(Packed::Lz4)).then_some(::mcap::Compression::Lz4))
        .use_chunks(options.chunked)
        .chunk_size(Some(options.chunk))
        .emit_message_indexes(options.message_index)
        .emit_summary_records(options.summary)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    let (encoding, schema) = match options.profile {
        "ros1" => ("ros1", "ros1msg"),
        _ => ("cdr", "ros2msg"),
    };
    let channels: Vec<u16> = recording
        .publishers
        .iter()
        .map(|p| {
            let schema = to
                .add_schema(&p.type_name, schema, p.definition.as_bytes())
                .unwrap();
            let mut metadata = BTreeMap::new();
            if options.profile == "ros1" {
                metadata.insert("callerid".to_owned(), p.node.clone());
                metadata.insert("latching".to_owned(), u8::from(p.latching).to_string());
            } else {
                metadata.insert("offered_qos_profiles".to_owned(), p.qos.clone());
                let key = options.publisher_key.map(str::to_owned);
                metadata.extend(key.map(|key| (key, p.node.clone())));
            }
            to.add_channel(schema, &p.topic, encoding, &metadata)
                .unwrap()
        })
        .collect();
    for (sequence, (publisher, at, payload)) in recording.messages.iter().enumerate() {
        let log_time = u64::try_from(*at).unwrap();
        let header = MessageHeader {
            channel_id: channels[*publisher],
            sequence: u32::try_from(sequence).unwrap(),
            log_time,
            publish_time: log_time,
        };
        to.write_to_known_channel(&header, payload).unwrap();
    }
    to.finish().unwrap();
    let file = to.into_inner().into_inner();
    match options.compression {
        Some(Packed::Zstd) => zstd(&file),
        _ => file,
    }
}

/// The same file with its chunks, which are not compressed, as Zstandard; all positions and checksums follow.
pub fn zstd(file: &[u8]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    // The new position of each record, by its old one, and the packed size of each chunk, by its new position.
    let (mut moved, mut packed) = (BTreeMap::from([(0, 0)]), BTreeMap::new());
    let (mut at, mut data_end) = (MAGIC.len(), 0);
    while at + MAGIC.len() < file.len() {
        let (kind, len) = (file[at], number(file, at + 1));
        let mut content = file[at + 9..at + 9 + len].to_vec();
        moved.insert(at, out.len());
        match kind {
            op::CHUNK => {
                // Two times, the plain size, a checksum, no name, the packed size.
                let zstd = zstd::encode_all(&content[40..], 1).unwrap();
                content.truncate(28);
                content.extend([&4u32.to_le_bytes()[..], b"zstd"].concat());
                content.extend((zstd.len() as u64).to_le_bytes());
                packed.insert(out.len(), (content.len() + zstd.len() + 9, zstd.len()));
                content.extend(zstd);
            }
            op::DATA_END => {
                let crc = crc32fast::hash(&out);
                content.copy_from_slice(&crc.to_le_bytes());
                data_end = out.len() + 13;
            }
            op::CHUNK_INDEX => {
                let chunk = moved[&number(&content, 16)];
                let (length, size) = packed[&chunk];
                set(&mut content, 16, chunk);
                set(&mut content, 24, length);
                let offsets = 36 + u32::from_le_bytes(content[32..36].try_into().unwrap()) as usize;
                for entry in (36..offsets).step_by(10) {
                    let index = moved[&number(&content, entry + 2)];
                    set(&mut content, entry + 2, index);
                }
                let plain = content.split_off(content.len() - 8);
                content.truncate(offsets + 8);
                content.extend([&4u32.to_le_bytes()[..], b"zstd"].concat());
                content.extend((size as u64).to_le_bytes());
                content.extend(plain);
            }
            op::SUMMARY_OFFSET => {
                let (start, length) = (number(&content, 1), number(&content, 9));
                let end = moved[&(start + length)];
                set(&mut content, 1, moved[&start]);
                set(&mut content, 9, end - moved[&start]);
            }
            op::FOOTER => {
                for place in [0, 8] {
                    let old = number(&content, place);
                    set(&mut content, place, moved[&old]);
                }
                let head = [&[kind][..], &(len as u64).to_le_bytes(), &content[..16]].concat();
                let crc = crc32fast::hash(&[&out[data_end..], &head].concat());
                content[16..].copy_from_slice(&crc.to_le_bytes());
            }
            _ => {}
        }
        out.push(kind);
        out.extend((content.len() as u64).to_le_bytes());
        out.extend(content);
        at += 9 + len;
    }
    out.extend(MAGIC);
    out
}

fn number(bytes: &[u8], at: usize) -> usize {
    usize::try_from(u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())).unwrap()
}

fn set(bytes: &mut [u8], at: usize, number: usize) {
    bytes[at..at + 8].copy_from_slice(&(number as u64).to_le_bytes());
}
