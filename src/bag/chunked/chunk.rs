//! Reads one chunk of an indexed bag: by its index, or record by record if that is missing or wrong.

use std::io;

use super::Grammar;
use super::index::{ChunkBody, Index, IndexSum, LONGEST_INDEX, Query, hand_over, nameless, spans};
use super::plan::Chunk;
use super::record::{MessageHead, NoRecord, RecordHead};
use super::search::next_chunk;
use super::unpack::{Visitor, unpack};
use crate::bag::adapters::Gather;
use crate::bag::model::{Sink, Want, damaged, lost};
use crate::bag::source::{ByteStream, FAR, GLANCE};

impl<G: Grammar> Query<'_, G> {
    /// Reports all stamps of `chunk` and the wanted parts of its messages to `sink`.
    pub(super) fn read(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        // A chunk without an index was stated to be empty elsewhere.
        let Some(promised) = &chunk.promised else {
            return;
        };
        let found = match self.index(chunk, promised) {
            Ok(found) => found,
            Err(e) => return lost(sink, "a chunk's index cannot be read", &e),
        };
        let times = (chunk.first, chunk.last);
        let found = found.filter(|found| found.index.times().is_none_or(|own| spans(own, times)));
        let Some(found) = found else {
            damaged(
                sink,
                1,
                "chunks were read whole, since their index is missing or wrong",
            );
            let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, FAR);
            self.walked(&mut stream, Share::Whole, sink);
            return self.unnamed(chunk, sink);
        };
        let body = found.body.or_else(|| self.moved(chunk));
        self.report(&found.index, body, sink);
        if found.place == Place::Apart {
            damaged(sink, 1, APART);
        }
        if found.place != Place::Expected {
            self.unnamed(chunk, sink);
        }
    }

    /// Reads the chunks after `chunk` that the tail does not list.
    fn unnamed(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        let Ok(Some(body)) = self.body(chunk) else {
            return;
        };
        let mut stream = ByteStream::of_file(self.source, body.range.end, self.tail, FAR);
        let mut from = chunk.start;
        while next_chunk::<G>(&mut stream, from) && stream.position() < chunk.end {
            damaged(sink, 1, "chunks that the index does not list were read");
            from = stream.position();
            let here = Chunk {
                start: from,
                end: self.tail,
                ..chunk.clone()
            };
            let body = self.body(&here).ok().flatten();
            if chunk.end < self.tail && body.is_some_and(|body| body.range.end > chunk.end) {
                // The next listed chunk, listed at a wrong position: its index is found there, its messages here.
                let mut stream = ByteStream::of_file(self.source, here.start, here.end, FAR);
                return self.walked(&mut stream, Share::Payloads, sink);
            }
            self.walked(&mut stream, Share::Whole, sink);
        }
    }

    /// The chunk's index, if it agrees exactly with the tail.
    fn index(&self, chunk: &Chunk, promised: &IndexSum) -> io::Result<Option<Found>> {
        let len = chunk.index.end - chunk.index.start;
        if len > LONGEST_INDEX {
            return Ok(None);
        }
        let body = self.body(chunk)?;
        let behind = body.as_ref().map(|body| body.range.end);
        let expected = || self.index_at(chunk.index.start, len, promised);
        // Bytes between a chunk and its index belong to neither.
        let mut place = Place::Expected;
        let mut index = None;
        if behind == Some(chunk.index.start) {
            index = expected()?;
        }
        if let (None, Some(behind)) = (&index, behind) {
            // After a chunk there may be a gap, and headers may be longer than usual.
            let most = (len * 2 + 4096).min(LONGEST_INDEX);
            let len = chunk.end.saturating_sub(behind).min(most);
            index = self.index_at(behind, len, promised)?;
            place = Place::Behind;
        }
        if index.is_none() && len > 0 && !behind.is_some_and(|at| self.is_index(at, chunk.end)) {
            index = expected()?;
            place = Place::Apart;
        }
        Ok(index.map(|index| Found { index, body, place }))
    }

    /// Whether an index begins at `start`, even if not the stated one.
    fn is_index(&self, start: u64, end: u64) -> bool {
        let mut stream = ByteStream::of_file(self.source, start, end, GLANCE);
        matches!(G::next(&mut stream), Ok(RecordHead::Index { .. }))
    }

    fn index_at(&self, start: u64, len: u64, promised: &IndexSum) -> io::Result<Option<Index>> {
        let len = len.min(self.source.len());
        let mut bytes = vec![0; usize::try_from(len).unwrap_or(0)];
        let got = self.source.read_at(start, &mut bytes)?;
        Ok(G::index(&bytes[..got], promised))
    }

    /// The chunk's compression and the position of its body.
    pub(super) fn body(&self, chunk: &Chunk) -> io::Result<Option<ChunkBody>> {
        let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, GLANCE);
        let head = match G::next(&mut stream) {
            Ok(RecordHead::Chunk(head)) => head,
            Err(NoRecord::Io(e)) => return Err(e),
            _ => return Ok(None),
        };
        let start = stream.position();
        let range = start..start.saturating_add(head.packed);
        let how = head.how.filter(|_| range.end <= chunk.end);
        Ok(how.map(|how| ChunkBody { how, range }))
    }

    /// The body of a chunk whose position in the tail is too early.
    fn moved(&self, chunk: &Chunk) -> Option<ChunkBody> {
        let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, FAR);
        let start = next_chunk::<G>(&mut stream, chunk.start).then(|| stream.position())?;
        let here = Chunk {
            start,
            ..chunk.clone()
        };
        self.body(&here).ok().flatten()
    }

    /// Reports the chunk at the position of `stream` to `sink`, record by record, and damage in it.
    fn walked(&self, stream: &mut ByteStream<'_>, what: Share, sink: &mut dyn Sink) {
        if let Err(why) = self.walk(stream, what, sink) {
            damaged(sink, 1, &format!("a chunk is damaged inside: {why}"));
        }
    }

    fn walk(
        &self,
        stream: &mut ByteStream<'_>,
        what: Share,
        sink: &mut dyn Sink,
    ) -> Result<(), String> {
        let Ok(RecordHead::Chunk(head)) = G::next(stream) else {
            return Err("it has no readable head".to_owned());
        };
        let mut walk = ChunkWalk {
            query: self,
            what,
            gather: Gather::default(),
            sink,
        };
        let walked = unpack(stream, &head, &self.allowance, &mut walk);
        walk.gather.flush(walk.sink);
        match walked {
            Ok(None) => Ok(()),
            Ok(Some(why)) => Err(why),
            Err(stop) => Err(stop.to_string()),
        }
    }
}

const APART: &str = "chunks differ in position or length from the bag's index";

/// The index of a chunk.
struct Found {
    index: Index,
    /// The position of the chunk's records, if its head is readable.
    body: Option<ChunkBody>,
    place: Place,
}

/// The position of a chunk's index.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// At the stated position, right after the chunk.
    Expected,
    /// After the chunk, but not at the stated position.
    Behind,
    /// At the stated position, but not after the chunk: the chunk has another length or position.
    Apart,
}

/// The part of a chunk that is reported.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Share {
    Whole,
    /// Only the wanted payloads: an index elsewhere reports the stamps.
    Payloads,
}

/// The messages of a chunk on their way to a sink.
struct ChunkWalk<'a, 's, G> {
    query: &'a Query<'a, G>,
    what: Share,
    gather: Gather,
    sink: &'s mut dyn Sink,
}

impl<G: Grammar> Visitor<G> for ChunkWalk<'_, '_, G> {
    fn message(&mut self, stream: &mut ByteStream<'_>, head: MessageHead) -> Result<(), NoRecord> {
        let Some(id) = self.query.connections.get(head.raw) else {
            nameless(self.sink, 1);
            return super::record::pass(stream, u64::from(head.size));
        };
        let want: Want = self.query.wants[id.0 as usize];
        hand_over(stream, (id, want), head, self.sink)?;
        if self.what == Share::Whole {
            self.gather.add(id, head.time, head.size, self.sink);
        }
        Ok(())
    }
}
