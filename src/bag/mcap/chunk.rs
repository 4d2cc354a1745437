//! One chunk of an MCAP file: by the message indexes behind it, or record by record if they are wrong.

use std::io;

use super::records::{self, Cursor, HEAD, op};
use crate::bag::adapters::Gather;
use crate::bag::decompress::Compression;
use crate::bag::index::{Body, Index, IndexSum, LONGEST_INDEX, Query, hand_over, nameless, pass};
use crate::bag::model::{Sink, lost};
use crate::bag::source::{FAR, NEAR, Source, Stream};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;

/// What the summary says about a chunk. Its sums do not overflow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chunk {
    /// Where its record begins, and how long that is.
    pub(super) start: u64,
    pub(super) len: u64,
    /// The length of the message indexes behind it.
    pub(super) index_len: u64,
    /// The length of its plain records, if that is true.
    pub(super) size: u64,
    pub(super) first: Stamp,
    pub(super) last: Stamp,
    /// What its message indexes should add up to; `None` if it has none.
    pub(super) tally: Option<IndexSum>,
}

/// Reads chunks of one file; shared by threads.
pub(super) struct Chunks<'a> {
    pub(super) source: &'a Source,
    pub(super) ask: Query<'a>,
}

/// Takes the head of a message record.
pub(super) fn head(stream: &mut Stream<'_>) -> Option<(u32, u32)> {
    match records::next(stream).ok()?? {
        (op::MESSAGE, len) => {
            let (channel, _, size) = records::message(stream, len)?;
            Some((u32::from(channel), size))
        }
        _ => None,
    }
}

impl Chunks<'_> {
    /// Tells `sink` all stamps of `chunk` and what is wanted of its messages.
    pub(super) fn read(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        // Without an index here the statistics have said that the chunk is empty.
        let Some(tally) = &chunk.tally else {
            return;
        };
        let index = match self.index(chunk, tally) {
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
            lost(sink, "a chunk is damaged inside", &e);
        }
    }

    /// The chunk's index, if it says exactly what the summary says.
    fn index(&self, chunk: &Chunk, tally: &IndexSum) -> io::Result<Option<Index>> {
        if chunk.index_len > LONGEST_INDEX {
            return Ok(None);
        }
        let len = usize::try_from(chunk.index_len.min(self.source.len())).unwrap_or(0);
        let mut bytes = vec![0; len];
        let got = self.source.read_at(chunk.start + chunk.len, &mut bytes)?;
        Ok(index_of(&bytes[..got], tally))
    }

    /// The chunk's compression and where its records stand.
    pub(super) fn body(&self, chunk: &Chunk) -> io::Result<Option<Body>> {
        let end = chunk.start + chunk.len;
        let mut stream = Stream::of_file(self.source, chunk.start, end, NEAR);
        match records::next(&mut stream)? {
            Some((op::CHUNK, len)) if len == chunk.len - HEAD => {}
            _ => return Ok(None),
        }
        Ok(records::chunk(&mut stream)?.and_then(|head| {
            let start = stream.position() + head.skip;
            let range = start..start.checked_add(head.compressed).filter(|e| *e <= end)?;
            let how = Compression::named(&head.compression)?;
            Some(Body { how, range })
        }))
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
        let told = self.walk_records(&mut stream, &mut gather, sink);
        gather.flush(sink);
        told
    }

    fn walk_records(
        &self,
        stream: &mut Stream<'_>,
        gather: &mut Gather,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        while let Some((kind, len)) = records::next(stream)? {
            let message = (kind == op::MESSAGE).then(|| records::message(stream, len));
            let Some((channel, time, size)) = message.flatten() else {
                pass(stream, len)?;
                continue;
            };
            let Some(id) = (self.ask.resolve)(u32::from(channel)) else {
                nameless(sink, 1);
                pass(stream, u64::from(size))?;
                continue;
            };
            hand_over(
                stream,
                (id, time, size),
                self.ask.wants[id.0 as usize],
                sink,
            )?;
            gather.add(id, time, size, sink);
        }
        Ok(())
    }
}

/// The message indexes in `bytes`, if they add up to `tally`.
fn index_of(bytes: &[u8], tally: &IndexSum) -> Option<Index> {
    let mut found = IndexSum::default();
    let mut index = Index::default();
    let mut rest = Cursor(bytes);
    while let Some(kind) = rest.u8() {
        let len = usize::try_from(rest.u64()?).ok()?;
        let (record, after) = rest.0.split_at_checked(len)?;
        rest = Cursor(after);
        if kind != op::MESSAGE_INDEX {
            continue;
        }
        let mut cursor = Cursor(record);
        let channel = u32::from(cursor.u16()?);
        let entries = cursor.bytes()?.chunks_exact(16);
        found.add(channel, u32::try_from(entries.len()).ok()?);
        index.add(channel, entries.filter_map(entry));
    }
    (found == *tally).then_some(index)
}

fn entry(bytes: &[u8]) -> Option<(Stamp, u64)> {
    let mut cursor = Cursor(bytes);
    Some((Stamp::from_nanos(cursor.u64()?), cursor.u64()?))
}
