//! The grammar of ROS 1 bags, version 2.
//!
//! The format: <https://wiki.ros.org/Bags/Format/2.0>.

mod records;
mod tail;
mod verify;

use std::collections::HashSet;
use std::io;
use std::path::Path;
use std::sync::Arc;

use crate::bag::chunked::{
    self, ChunkPlan, Connections, Grammar, Index, IndexSum, NoRecord, SecondReading, Unindexed,
};
use crate::bag::input::FormatRow;
use crate::bag::model::{Connection, Sink};
use crate::bag::source::{ByteStream, FileSource};
use crate::base::error::{Error, Result};
use crate::base::time::Stamp;
use records::{ENTRY, Header};

/// ROS 1 bags.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "rosbag1",
    what: "ROS 1 bag",
    extensions: &["bag", "bag.active"],
    needs_file: false,
    sniff: |_, head| head.starts_with(Rosbag1::OPENING) || head.starts_with(b"#ROSRECORD V"),
    is_inside: chunked::has_chunk::<Rosbag1>,
    open: chunked::open::<Rosbag1>,
    follow: Some(chunked::follow::<Rosbag1>),
};

/// The definitions seen, of which equal ones share one text.
#[derive(Default)]
struct Rosbag1 {
    definitions: HashSet<Arc<str>>,
    held: usize,
}

/// The head of a connection record.
struct Described {
    raw: u32,
    topic: Vec<u8>,
}

impl Grammar for Rosbag1 {
    const NAME: &'static str = FORMAT.name;
    const HAS_END: bool = false;
    const IS_LOOSE: bool = false;
    const OPENING: &'static [u8] = b"#ROSBAG V2.";
    const CLOSING: &'static [u8] = b"";
    type Description = Described;

    /// Refuses bags older than version 2, and encrypted ones.
    fn accept(path: &Path, head: &[u8]) -> Result<()> {
        if !head.starts_with(b"#ROSRECORD V") {
            return refuse_encrypted(path, head);
        }
        let line = head.split(|b| *b == b'\n').next().unwrap_or_default();
        let line = String::from_utf8_lossy(&line[..line.len().min(32)]);
        let what = format!("it is of an old format, `{line}`");
        let hint =
            "convert it to version 2 with `rosbag fix old.bag new.bag` of a ROS 1 installation";
        Err(Error::unsupported(path, what, hint))
    }

    /// The first line names the version.
    fn begin(stream: &mut ByteStream<'_>) {
        if let Ok(head) = stream.peek(32) {
            let line = head.iter().position(|b| *b == b'\n');
            stream.advance(line.map_or(0, |at| at + 1));
        }
    }

    fn next(stream: &mut ByteStream<'_>) -> Result<chunked::RecordHead<Described>, NoRecord> {
        records::next(stream)
    }

    fn describe(
        &mut self,
        what: &Described,
        data: &[u8],
        known: &Connections,
    ) -> Result<Option<(u32, Connection)>, NoRecord> {
        let is_new = known.get(what.raw).is_none();
        Ok(is_new.then(|| (what.raw, records::connection(self, &what.topic, data))))
    }

    fn is_chunk(bytes: &[u8]) -> bool {
        matches!(records::short(bytes), Some((Header::Chunk { .. }, _)))
    }

    fn is_content(bytes: &[u8]) -> bool {
        let Some((Header::Message { .. } | Header::Connection { .. }, len)) = records::short(bytes)
        else {
            return false;
        };
        let next = bytes.get(len..);
        next.is_some_and(|next| next.is_empty() || records::short(next).is_some())
    }

    fn index(bytes: &[u8], promised: &IndexSum) -> Option<Index> {
        let mut found = IndexSum::default();
        let mut index = Index::default();
        let mut at = 0;
        while found.connections < promised.connections {
            let (raw, count, start) = record_at(bytes, at)?;
            let end = start.checked_add((count as usize).checked_mul(ENTRY as usize)?)?;
            let entries = bytes.get(start..end)?.chunks_exact(ENTRY as usize);
            found.add(raw, count);
            index.add(raw, entries.filter_map(entry));
            at = end;
        }
        // One more record than the tail states: then the tail lacks a connection.
        let is_all = record_at(bytes, at).is_none();
        (is_all && found == *promised).then_some(index)
    }

    fn index_stamps(data: &[u8]) -> Vec<Stamp> {
        let entries = data.chunks_exact(ENTRY as usize);
        entries.filter_map(|e| Some(entry(e)?.0)).collect()
    }

    fn plan(source: &FileSource) -> io::Result<Result<ChunkPlan, Unindexed>> {
        tail::read(source)
    }

    fn facts(_head: &[u8]) -> Vec<(String, String)> {
        Vec::new()
    }

    fn verify(
        source: &FileSource,
        plan: &Result<ChunkPlan, Unindexed>,
        sink: &mut dyn Sink,
    ) -> SecondReading {
        match plan {
            Ok(plan) => verify::read(source, plan, sink),
            Err(reason) => SecondReading {
                stopped: Some(format!(
                    "the crate `rosbag` needs an index, and {}",
                    reason.why
                )),
                refused: true,
                ..SecondReading::default()
            },
        }
    }
}

/// Refuses a bag whose payloads and connections are encrypted.
fn refuse_encrypted(path: &Path, head: &[u8]) -> Result<()> {
    let mut stream = ByteStream::of_reader(head);
    Rosbag1::begin(&mut stream);
    let Ok((Header::Bag { encryptor, .. }, _)) = records::header(&mut stream) else {
        return Ok(());
    };
    if encryptor.is_empty() {
        return Ok(());
    }
    let what = format!("it is encrypted by `{encryptor}`");
    let hint = "decrypt it first with `rosbag decrypt`, on a machine that has its key";
    Err(Error::unsupported(path, what, hint))
}

/// The index record at `at`: its connection, its count, and the start of its entries.
fn record_at(bytes: &[u8], at: usize) -> Option<(u32, u32, usize)> {
    let len = records::u32_at(bytes, at)? as usize;
    let header = bytes.get(at + 4..)?.get(..len)?;
    match records::parse(header)? {
        Header::Index { raw, count } => Some((raw, count, at + 4 + len + 4)),
        _ => None,
    }
}

/// The time and the offset in an entry of an index record.
fn entry(bytes: &[u8]) -> Option<(Stamp, u64)> {
    let offset = records::u32_at(bytes, 8)?;
    Some((records::time_at(bytes, 0)?, u64::from(offset)))
}
