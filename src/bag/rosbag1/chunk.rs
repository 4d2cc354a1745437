//! One chunk of a ROS 1 bag: by the index behind it, or record by record if that is missing or wrong.

use std::io;

use super::records::{self, ENTRY, Record, Stop, Table};
use crate::bag::adapters::Gather;
use crate::bag::decompress::Compression;
use crate::bag::index::{Body, Index, IndexSum, LONGEST_INDEX, Query, hand_over, nameless, pass};
use crate::bag::model::{Sink, lost};
use crate::bag::source::{FAR, NEAR, Source, Stream};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;

/// What the tail says about a chunk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chunk {
    /// Where its record begins.
    pub(super) pos: u64,
    /// Where the next chunk, or the tail, begins.
    pub(super) end: u64,
    pub(super) first: Stamp,
    pub(super) last: Stamp,
    pub(super) tally: IndexSum,
}

impl Chunk {
    /// How long the index records are if their headers are as every writer makes them: 47 bytes.
    pub(super) fn index_len(&self) -> u64 {
        let entries = self.tally.messages.saturating_mul(u64::from(ENTRY));
        entries.saturating_add(u64::from(self.tally.connections) * (4 + 47 + 4))
    }
}

/// Reads chunks of one bag; shared by threads.
pub(super) struct Chunks<'a> {
    pub(super) source: &'a Source,
    pub(super) table: &'a Table,
    pub(super) ask: Query<'a>,
}

/// Takes the head of a message record.
pub(super) fn head(stream: &mut Stream<'_>) -> Option<(u32, u32)> {
    match records::next(stream).ok()? {
        (Record::Message { id, .. }, len) => Some((id, len)),
        _ => None,
    }
}

impl Chunks<'_> {
    /// Tells `sink` all stamps of `chunk` and what is wanted of its messages.
    pub(super) fn read(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        let index = match self.index(chunk) {
            Ok(index) => index,
            Err(e) => return lost(sink, "a chunk's index cannot be read", &e),
        };
        if let Some(index) = index {
            let body = || self.body(chunk).ok().flatten();
            return self.ask.tell(&index, self.source, body, sink);
        }
        let text = "chunks were read whole, since their index is missing or wrong";
        sink.notice(Notice::new(NoticeKind::Downgraded, text));
        if let Err(e) = self.walk(chunk, sink) {
            lost(sink, "a chunk cannot be read", &e);
        }
    }

    /// The chunk's index, if it says exactly what the tail says.
    fn index(&self, chunk: &Chunk) -> io::Result<Option<Index>> {
        let len = chunk.index_len();
        if len > LONGEST_INDEX {
            return Ok(None);
        }
        let start = chunk.end.checked_sub(len).filter(|s| *s > chunk.pos);
        if let (Some(start), 1..) = (start, len) {
            let found = self.index_at(start, chunk)?;
            if found.is_some() {
                return Ok(found);
            }
        }
        match self.body(chunk)? {
            Some(body) => self.index_at(body.range.end, chunk),
            None => Ok(None),
        }
    }

    fn index_at(&self, start: u64, chunk: &Chunk) -> io::Result<Option<Index>> {
        // Behind a chunk there may be a gap, and headers may be longer than usual.
        let most = (chunk.index_len() * 2 + 4096).min(LONGEST_INDEX);
        let len = chunk.end.saturating_sub(start).min(most);
        let mut bytes = vec![0; usize::try_from(len).unwrap_or(0)];
        let got = self.source.read_at(start, &mut bytes)?;
        Ok(index_of(&bytes[..got], &chunk.tally))
    }

    /// The chunk's compression and where its body stands.
    pub(super) fn body(&self, chunk: &Chunk) -> io::Result<Option<Body>> {
        let mut stream = Stream::of_file(self.source, chunk.pos, chunk.end, NEAR);
        let (record, len) = match records::next(&mut stream) {
            Ok(found) => found,
            Err(Stop::Io(e)) => return Err(e),
            Err(_) => return Ok(None),
        };
        let Record::Chunk { compression, .. } = record else {
            return Ok(None);
        };
        let start = stream.position();
        let range = start..start + u64::from(len);
        let how = Compression::named(&compression).filter(|_| range.end <= chunk.end);
        Ok(how.map(|how| Body { how, range }))
    }

    /// Reads the chunk record by record.
    fn walk(&self, chunk: &Chunk, sink: &mut dyn Sink) -> io::Result<()> {
        let Some(body) = self.body(chunk)? else {
            sink.notice(Notice::new(
                NoticeKind::Damaged,
                "a chunk has no readable head",
            ));
            return Ok(());
        };
        let (mut stream, _) = body.plain(self.source, FAR)?;
        let mut gather = Gather::default();
        let stop = loop {
            let step = match records::next(&mut stream) {
                Ok((Record::Message { id, time }, len)) => {
                    self.message(&mut stream, (id, time, len), &mut gather, sink)
                }
                Ok((_, len)) => pass(&mut stream, u64::from(len)),
                Err(stop) => break stop,
            };
            if let Err(e) = step {
                break e.into();
            }
        };
        gather.flush(sink);
        if !matches!(stop, Stop::End) {
            sink.notice(Notice::new(
                NoticeKind::Damaged,
                "a chunk is damaged inside",
            ));
        }
        Ok(())
    }

    fn message(
        &self,
        stream: &mut Stream<'_>,
        (raw, time, len): (u32, Stamp, u32),
        gather: &mut Gather,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        let Some(id) = self.table.get(raw) else {
            nameless(sink, 1);
            return pass(stream, u64::from(len));
        };
        hand_over(stream, (id, time, len), self.ask.wants[id.0 as usize], sink)?;
        gather.add(id, time, len, sink);
        Ok(())
    }
}

/// The index records in `bytes`, if they add up to `tally`.
fn index_of(bytes: &[u8], tally: &IndexSum) -> Option<Index> {
    let mut found = IndexSum::default();
    let mut index = Index::default();
    let mut at = 0;
    if tally.messages == 0 && record_at(bytes, 0).is_some_and(|(_, count, _)| count > 0) {
        return None;
    }
    while found.connections < tally.connections {
        let (id, count, start) = record_at(bytes, at)?;
        let end = start.checked_add((count as usize).checked_mul(ENTRY as usize)?)?;
        let entries = bytes.get(start..end)?.chunks_exact(ENTRY as usize);
        found.add(id, count);
        index.add(id, entries.filter_map(entry));
        at = end;
    }
    (found == *tally).then_some(index)
}

/// The index record at `at`: its connection, its count, and where its entries begin.
fn record_at(bytes: &[u8], at: usize) -> Option<(u32, u32, usize)> {
    let len = records::u32_at(bytes, at)? as usize;
    let header = bytes.get(at + 4..)?.get(..len)?;
    match records::parse(header)? {
        Record::Index { id, count } => Some((id, count, at + 4 + len + 4)),
        _ => None,
    }
}

fn entry(bytes: &[u8]) -> Option<(Stamp, u64)> {
    let offset = records::u32_at(bytes, 8)?;
    Some((records::time_at(bytes, 0)?, u64::from(offset)))
}
