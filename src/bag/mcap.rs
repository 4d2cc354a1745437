//! The grammar of MCAP files.
//!
//! The format: <https://mcap.dev/spec>.

mod records;
mod summary;
mod verify;

use std::collections::HashMap;
use std::io;
use std::path::Path;

use mcap::MAGIC;
use mcap::records::op;

use crate::bag::chunked::{
    self, ChunkPlan, Connections, Grammar, Index, IndexSum, NoRecord, RecordHead, SecondReading,
    Unindexed,
};
use crate::bag::input::FormatRow;
use crate::bag::model::{Connection, Sink};
use crate::bag::source::{ByteStream, FileSource};
use crate::base::error::Result;
use crate::base::time::Stamp;
use records::{FieldCursor, SchemaRecord};

/// MCAP files.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "mcap",
    what: "MCAP file (ROS 1 or ROS 2)",
    extensions: &["mcap"],
    needs_file: false,
    sniff: |_, head| head.starts_with(MAGIC),
    is_inside: |bytes| bytes.ends_with(MAGIC) || chunked::has_chunk::<Mcap>(bytes),
    open: chunked::open::<Mcap>,
    follow: Some(chunked::follow::<Mcap>),
};

/// The schemas seen, which channels refer to.
#[derive(Default)]
struct Mcap {
    schemas: HashMap<u16, SchemaRecord>,
    held: usize,
}

/// The two kinds of records that describe a connection.
#[derive(Clone, Copy)]
enum Described {
    Schema,
    Channel,
}

impl Grammar for Mcap {
    const NAME: &'static str = FORMAT.name;
    const HAS_END: bool = true;
    const IS_LOOSE: bool = true;
    const OPENING: &'static [u8] = MAGIC;
    const CLOSING: &'static [u8] = MAGIC;
    type Description = Described;

    fn accept(_path: &Path, _head: &[u8]) -> Result<()> {
        Ok(())
    }

    fn begin(stream: &mut ByteStream<'_>) {
        if stream.peek(MAGIC.len()).is_ok() {
            stream.advance(MAGIC.len());
        }
    }

    fn next(stream: &mut ByteStream<'_>) -> Result<RecordHead<Described>, NoRecord> {
        records::next(stream)
    }

    fn describe(
        &mut self,
        what: &Described,
        data: &[u8],
        known: &Connections,
    ) -> Result<Option<(u32, Connection)>, NoRecord> {
        match what {
            Described::Schema => records::schema(self, data)
                .ok_or(NoRecord::Broken)
                .map(|()| None),
            Described::Channel => records::channel(self, data, known),
        }
    }

    fn is_chunk(bytes: &[u8]) -> bool {
        records::is_chunk(bytes)
    }

    fn is_content(bytes: &[u8]) -> bool {
        records::is_content(bytes)
    }

    fn index(bytes: &[u8], promised: &IndexSum) -> Option<Index> {
        let mut found = IndexSum::default();
        let mut index = Index::default();
        let mut rest = FieldCursor(bytes);
        // The crate reads these into vectors of pairs, which takes several times as long.
        while let Some(kind) = rest.u8() {
            let len = usize::try_from(rest.u64()?).ok()?;
            let (record, after) = rest.0.split_at_checked(len)?;
            rest = FieldCursor(after);
            if kind != op::MESSAGE_INDEX {
                return None;
            }
            let mut cursor = FieldCursor(record);
            let channel = u32::from(cursor.u16()?);
            let entries = cursor.bytes()?.chunks_exact(records::ENTRY);
            found.add(channel, u32::try_from(entries.len()).ok()?);
            index.add(channel, entries.filter_map(entry));
        }
        (found == *promised).then_some(index)
    }

    fn index_stamps(data: &[u8]) -> Vec<Stamp> {
        let mut cursor = FieldCursor(data);
        let entries = cursor.u16().and_then(|_| cursor.bytes());
        let entries = entries.unwrap_or_default().chunks_exact(records::ENTRY);
        entries.filter_map(|e| Some(entry(e)?.0)).collect()
    }

    fn plan(source: &FileSource) -> io::Result<Result<ChunkPlan, Unindexed>> {
        summary::read(source)
    }

    fn is_summed(source: Option<&FileSource>) -> bool {
        source.is_none_or(|source| !matches!(summary::data_crc(source), Ok(Some(0))))
    }

    fn is_ended(source: &FileSource) -> bool {
        matches!(summary::data_crc(source), Ok(Some(_)))
    }

    /// The facts in the file's header.
    fn facts(head: &[u8]) -> Vec<(String, String)> {
        let mut cursor = FieldCursor(head.get(MAGIC.len()..).unwrap_or_default());
        let (kind, len) = (cursor.u8(), cursor.u64().unwrap_or(0));
        let record = usize::try_from(len)
            .ok()
            .and_then(|len| cursor.0.get(..len));
        let (Some(op::HEADER), Some(record)) = (kind, record) else {
            return Vec::new();
        };
        let mut cursor = FieldCursor(record);
        let (Some(profile), Some(library)) = (cursor.text(), cursor.text()) else {
            return Vec::new();
        };
        let known = [("profile", profile), ("library", library)];
        let known = known.into_iter().filter(|(_, value)| !value.is_empty());
        known
            .map(|(name, value)| (name.to_owned(), value))
            .collect()
    }

    /// The crate reads from the front, with or without a summary.
    fn verify(
        source: &FileSource,
        _plan: &Result<ChunkPlan, Unindexed>,
        sink: &mut dyn Sink,
    ) -> SecondReading {
        SecondReading {
            stopped: verify::read(source, sink).err(),
            ..SecondReading::default()
        }
    }
}

/// The time and the offset in an entry of a message index.
fn entry(bytes: &[u8]) -> Option<(Stamp, u64)> {
    let mut cursor = FieldCursor(bytes);
    Some((Stamp::from_nanos(cursor.u64()?), cursor.u64()?))
}
