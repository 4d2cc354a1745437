//! Reads a ROS 1 bag again with an independent reader, the crate `rosbag`, after checking the bounds of every chunk.

use std::sync::Arc;

use rosbag::{ChunkRecord, IndexRecord, MessageRecord, RosBag};

use super::records::{self, ENTRY, Header};
use super::{Described, Rosbag1};
use crate::bag::chunked::{ChunkBody, ChunkPlan, NoRecord, SecondFinds, SecondReading, pass, walk};
use crate::bag::decompress::Allowance;
use crate::bag::model::Sink;
use crate::bag::source::{ByteStream, FAR, FileSource};
use crate::base::digest::hex_of;
use crate::base::time::Stamp;

/// The largest chunk that the crate may unpack into memory, in bytes.
const LARGEST_CHUNK: u32 = 256 << 20;

/// Reports everything that the crate finds to `sink`. `plan` has the position of the index, without which the crate
/// does not read.
pub(super) fn read(source: &FileSource, plan: &ChunkPlan, sink: &mut dyn Sink) -> SecondReading {
    let mut verified = SecondReading::default();
    let bag = bound(source, plan, &mut verified).and_then(|()| {
        let bag = RosBag::new(source.path()).map_err(|e| e.to_string())?;
        // The crate's iterators repeat an error forever, so the first one ends the walk.
        let bad = bag.index_records().find_map(Result::err);
        bad.map_or(Ok(bag), |e| Err(e.to_string()))
    });
    verified.refused = bag.is_err();
    let result = bag.and_then(|bag| records_of(&bag, &mut SecondFinds::new(sink)));
    verified.stopped = result.err();
    verified
}

/// Walks the chunks as the crate will, and rejects oversized ones: it decompresses a chunk before it checks its size.
fn bound(
    source: &FileSource,
    plan: &ChunkPlan,
    verified: &mut SecondReading,
) -> Result<(), String> {
    let allowance = Arc::default();
    let mut stream = ByteStream::of_file(source, plan.body.start, plan.body.end, FAR);
    let mut refused = None;
    let stop = walk(&mut stream, u64::MAX, |stream| {
        let (header, len) = records::header(stream)?;
        let start = stream.position();
        pass(stream, u64::from(len))?;
        let found = match header {
            Header::Chunk { how: None, .. } => {
                Err("a chunk is compressed in an unknown way".to_owned())
            }
            Header::Chunk {
                how: Some(how),
                size,
            } => {
                verified.compression.insert(how);
                let range = start..start + u64::from(len);
                bound_chunk(source, &ChunkBody { how, range }, size, &allowance)
            }
            Header::Index { count, .. } if count.checked_mul(ENTRY) == Some(len) => Ok(()),
            _ => Err("a record among the chunks is of an unexpected kind".to_owned()),
        };
        refused = found.err();
        refused.as_ref().map_or(Ok(()), |_| Err(NoRecord::Broken))
    });
    match (stop, refused) {
        (NoRecord::End, _) => Ok(()),
        (_, Some(why)) => Err(why),
        (_, None) => Err("the chunks are not contiguous".to_owned()),
    }
}

/// Rejects a chunk whose length differs from the stated one or is too large.
fn bound_chunk(
    source: &FileSource,
    body: &ChunkBody,
    size: u32,
    allowance: &Arc<Allowance>,
) -> Result<(), String> {
    let unpacked = body
        .plain(source, FAR, allowance)
        .and_then(|(mut plain, base)| {
            plain.skip(u64::from(size) + 1)?;
            Ok(plain.position() - base)
        });
    let unpacked = unpacked.map_err(|e| format!("a chunk cannot be decompressed: {e}"))?;
    if unpacked != u64::from(size) || size > LARGEST_CHUNK {
        return Err(format!(
            "a chunk decompresses to {unpacked} bytes instead of {size}"
        ));
    }
    Ok(())
}

fn records_of(bag: &RosBag, to: &mut SecondFinds<'_, Rosbag1>) -> Result<(), String> {
    for record in bag.index_records() {
        if let IndexRecord::Connection(connection) = record.map_err(|e| e.to_string())? {
            announce(&connection, to);
        }
    }
    for record in bag.chunk_records() {
        if let ChunkRecord::Chunk(chunk) = record.map_err(|e| e.to_string())? {
            for message in chunk.messages() {
                match message.map_err(|e| e.to_string())? {
                    MessageRecord::Connection(connection) => announce(&connection, to),
                    MessageRecord::MessageData(message) => {
                        let time = Stamp::from_nanos(message.time);
                        to.message(message.conn_id, time, message.data);
                    }
                }
            }
            to.flush();
        }
    }
    Ok(())
}

fn announce(found: &rosbag::record_types::Connection<'_>, to: &mut SecondFinds<'_, Rosbag1>) {
    let mut data = Vec::new();
    let md5 = hex_of(&found.md5sum);
    let fields = [
        ("type", found.tp),
        ("md5sum", md5.as_str()),
        ("message_definition", found.message_definition),
        ("callerid", found.caller_id),
        ("latching", if found.latching { "1" } else { "0" }),
    ];
    for (name, value) in fields {
        let len = u32::try_from(name.len() + 1 + value.len()).unwrap_or(0);
        data.extend(len.to_le_bytes());
        data.extend(name.bytes().chain([b'=']).chain(value.bytes()));
    }
    let what = Described {
        raw: found.id,
        topic: found.storage_topic.as_bytes().to_vec(),
    };
    to.describe(&what, &data);
}
