//! Described bags as MCAP files, written by the crate `mcap`.

use std::collections::BTreeMap;
use std::io::Cursor;

use ::mcap::records::MessageHeader;
use ::mcap::{Compression, WriteOptions};

use super::Recording;

/// How a file is written.
#[derive(Clone, Debug)]
pub struct Options {
    /// `ros1` or `ros2`.
    pub profile: &'static str,
    pub compression: Option<Compression>,
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
            compression: Some(Compression::Zstd),
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
        .compression(options.compression)
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
    to.into_inner().into_inner()
}
