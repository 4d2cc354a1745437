//! A ROS 1 bag read a second time by somebody else's reader, the crate `rosbag`, once every chunk is known to be bounded.

use std::collections::BTreeSet;
use std::io;

use rosbag::{ChunkRecord, IndexRecord, MessageRecord, RosBag};

use super::plan::Plan;
use super::records::{self, Record, Stop, Table};
use crate::bag::adapters::Gather;
use crate::bag::decompress::Compression;
use crate::bag::index::{Body, hand_over_slice, nameless, pass};
use crate::bag::model::{Sink, Want};
use crate::bag::source::{FAR, Source, Stream};
use crate::base::time::Stamp;

/// What the second reader did.
#[derive(Default)]
pub(super) struct Verified {
    pub(super) compression: BTreeSet<Compression>,
    /// Why it did not get to the end.
    pub(super) stopped: Option<String>,
    /// It told nothing at all.
    pub(super) refused: bool,
}

/// The largest chunk that the crate may unpack into memory, in bytes.
const LARGEST_CHUNK: u32 = 256 << 20;

/// Tells `sink` all that the crate finds. `plan` says where the index is: without one the crate does not read.
pub(super) fn read(source: &Source, plan: &Plan, sink: &mut dyn Sink) -> Verified {
    let mut verified = Verified::default();
    let bag = bound(source, plan, &mut verified).and_then(|()| {
        let bag = RosBag::new(source.path()).map_err(|e| e.to_string())?;
        // An iterator of the crate answers an error for ever, so the first one ends the walk.
        let bad = bag.index_records().find_map(Result::err);
        bad.map_or(Ok(bag), |e| Err(e.to_string()))
    });
    verified.refused = bag.is_err();
    let told = bag.and_then(|bag| {
        Crate {
            sink,
            table: Table::default(),
            wants: Vec::new(),
            gather: Gather::default(),
        }
        .read(&bag)
    });
    verified.stopped = told.err();
    verified
}

/// Walks the chunks as the crate will, and refuses what it could not bear: it unpacks a chunk before it looks at its
/// size.
fn bound(source: &Source, plan: &Plan, verified: &mut Verified) -> Result<(), String> {
    let broken = |e: io::Error| format!("the bag cannot be read: {e}");
    let mut stream = Stream::of_file(source, plan.body, plan.index_pos, FAR);
    loop {
        let (record, len) = match records::next_as_stated(&mut stream) {
            Ok(found) => found,
            Err(Stop::End) => return Ok(()),
            Err(_) => return Err("the chunks are not one behind the other".to_owned()),
        };
        let start = stream.position();
        pass(&mut stream, u64::from(len)).map_err(broken)?;
        match record {
            Record::Chunk { compression, size } => {
                let how = Compression::named(&compression)
                    .ok_or("a chunk is compressed in an unknown way")?;
                verified.compression.insert(how);
                let body = Body {
                    how,
                    range: start..start + u64::from(len),
                };
                let unpacked = unpacked_len(source, &body, size).map_err(broken)?;
                if unpacked != u64::from(size) || size > LARGEST_CHUNK {
                    return Err(format!(
                        "a chunk unfolds to {unpacked} bytes, not to {size}"
                    ));
                }
            }
            Record::Index { count, .. } if count.checked_mul(records::ENTRY) == Some(len) => {}
            _ => return Err("a record among the chunks is not what it should be".to_owned()),
        }
    }
}

/// How long a chunk is when unpacked; at most one more than `most`.
fn unpacked_len(source: &Source, body: &Body, most: u32) -> io::Result<u64> {
    let (mut plain, base) = body.plain(source, FAR)?;
    plain.skip(u64::from(most) + 1)?;
    Ok(plain.position() - base)
}

/// The crate's findings on their way to a sink.
struct Crate<'s> {
    sink: &'s mut dyn Sink,
    table: Table,
    wants: Vec<Want>,
    gather: Gather,
}

impl Crate<'_> {
    fn read(&mut self, bag: &RosBag) -> Result<(), String> {
        for record in bag.index_records() {
            if let IndexRecord::Connection(connection) = record.map_err(|e| e.to_string())? {
                self.announce(&connection);
            }
        }
        for record in bag.chunk_records() {
            if let ChunkRecord::Chunk(chunk) = record.map_err(|e| e.to_string())? {
                for message in chunk.messages() {
                    match message.map_err(|e| e.to_string())? {
                        MessageRecord::Connection(connection) => self.announce(&connection),
                        MessageRecord::MessageData(message) => self.message(&message),
                    }
                }
                self.gather.flush(self.sink);
            }
        }
        Ok(())
    }

    fn announce(&mut self, found: &rosbag::record_types::Connection<'_>) {
        let mut data = Vec::new();
        let md5: String = found
            .md5sum
            .iter()
            .flat_map(|b| [b >> 4, b & 15])
            .filter_map(|d| char::from_digit(d.into(), 16))
            .collect();
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
        if let Some(connection) = self
            .table
            .add(found.id, found.storage_topic.as_bytes(), &data)
        {
            self.wants.push(self.sink.connection(connection));
        }
    }

    fn message(&mut self, found: &rosbag::record_types::MessageData<'_>) {
        let Some(id) = self.table.get(found.conn_id) else {
            return nameless(self.sink, 1);
        };
        let time = Stamp::from_nanos(found.time);
        hand_over_slice(found.data, (id, time), self.wants[id.0 as usize], self.sink);
        let size = u32::try_from(found.data.len()).unwrap_or(u32::MAX);
        self.gather.add(id, time, size, self.sink);
    }
}
