//! One chunk of an indexed bag: by the index behind it, or record by record if that is missing or wrong.

use std::io;

use super::Grammar;
use super::forward::next_chunk;
use super::index::{ChunkBody, Index, IndexSum, LONGEST_INDEX, Query, hand_over, nameless};
use super::plan::Chunk;
use super::record::{NoRecord, RecordHead};
use super::unpack::{Visitor, unpack};
use crate::bag::adapters::Gather;
use crate::bag::model::{Sink, Want, lost};
use crate::bag::source::{ByteStream, FAR, GLANCE, NEAR};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;

impl<G: Grammar> Query<'_, G> {
    /// Reports all stamps of `chunk` and the wanted parts of its messages to `sink`.
    pub(super) fn read(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        // Without an index here the bag has said elsewhere that the chunk is empty.
        let Some(promised) = &chunk.promised else {
            return;
        };
        let index = match self.index(chunk, promised) {
            Ok(index) => index,
            Err(e) => return lost(sink, "a chunk's index cannot be read", &e),
        };
        if let Some((index, where_expected)) = index {
            let body = || {
                self.body(chunk)
                    .ok()
                    .flatten()
                    .or_else(|| self.moved(chunk))
            };
            self.tell(&index, body, sink);
            if !where_expected {
                self.unnamed(chunk, sink);
            }
            return;
        }
        let text = "chunks were read whole, since their index is missing or wrong";
        sink.notice(Notice::new(NoticeKind::Downgraded, text));
        let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, FAR);
        self.told(&mut stream, Share::Whole, sink);
        self.unnamed(chunk, sink);
    }

    /// Reads the chunks that stand behind `chunk` though the tail does not name them.
    fn unnamed(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        let Ok(Some(body)) = self.body(chunk) else {
            return;
        };
        let mut stream = ByteStream::of_file(self.source, body.range.end, self.tail, FAR);
        while next_chunk::<G>(&mut stream) && stream.position() < chunk.end {
            let text = "chunks were read that the index does not name";
            sink.notice(Notice::new(NoticeKind::Downgraded, text));
            let here = Chunk {
                start: stream.position(),
                end: self.tail,
                ..chunk.clone()
            };
            let body = self.body(&here).ok().flatten();
            if chunk.end < self.tail && body.is_some_and(|body| body.range.end > chunk.end) {
                // The next chunk of the tail, named at a wrong place: there its index is found, and here its messages.
                let mut stream = ByteStream::of_file(self.source, here.start, here.end, FAR);
                return self.told(&mut stream, Share::Payloads, sink);
            }
            self.told(&mut stream, Share::Whole, sink);
            if stream.position() == here.start && !matches!(stream.skip(1), Ok(1)) {
                return;
            }
        }
    }

    /// The chunk's index, if it agrees exactly with the tail, and whether it stands where it should.
    fn index(&self, chunk: &Chunk, promised: &IndexSum) -> io::Result<Option<(Index, bool)>> {
        let len = chunk.index.end - chunk.index.start;
        if len > LONGEST_INDEX {
            return Ok(None);
        }
        if len > 0
            && let Some(found) = self.index_at(chunk.index.start, len, promised)?
            && (!G::INDEX_IS_GUESSED || found.spans(chunk.first, chunk.last))
        {
            return Ok(Some((found, true)));
        }
        let Some(body) = self.body(chunk)? else {
            return Ok(None);
        };
        // Behind a chunk there may be a gap, and headers may be longer than usual.
        let most = (len * 2 + 4096).min(LONGEST_INDEX);
        let len = chunk.end.saturating_sub(body.range.end).min(most);
        let found = self.index_at(body.range.end, len, promised)?;
        Ok(found.map(|index| (index, false)))
    }

    fn index_at(&self, start: u64, len: u64, promised: &IndexSum) -> io::Result<Option<Index>> {
        let len = len.min(self.source.len());
        let mut bytes = vec![0; usize::try_from(len).unwrap_or(0)];
        let got = self.source.read_at(start, &mut bytes)?;
        Ok(G::index(&bytes[..got], promised))
    }

    /// The chunk's compression and the place of its body.
    pub(super) fn body(&self, chunk: &Chunk) -> io::Result<Option<ChunkBody>> {
        let step = if self.source.is_far() { GLANCE } else { NEAR };
        let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, step);
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

    /// The body of a chunk for which the tail names a place too early.
    fn moved(&self, chunk: &Chunk) -> Option<ChunkBody> {
        let mut stream = ByteStream::of_file(self.source, chunk.start, chunk.end, FAR);
        let start = next_chunk::<G>(&mut stream).then(|| stream.position())?;
        let here = Chunk {
            start,
            ..chunk.clone()
        };
        self.body(&here).ok().flatten()
    }

    /// Reports the chunk at the position of `stream` to `sink`, record by record, and damage in it.
    fn told(&self, stream: &mut ByteStream<'_>, what: Share, sink: &mut dyn Sink) {
        if let Err(why) = self.walk(stream, what, sink) {
            let text = format!("a chunk is damaged inside: {why}");
            sink.notice(Notice::new(NoticeKind::Damaged, text));
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
        let told = unpack(stream, &head, &self.allowance, &mut walk);
        walk.gather.flush(walk.sink);
        match told {
            Ok(None) => Ok(()),
            Ok(Some(why)) => Err(why),
            Err(stop) => Err(stop.to_string()),
        }
    }
}

/// The part of a chunk that is reported.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Share {
    Whole,
    /// Only the wanted payloads: the stamps are reported by an index elsewhere.
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
    fn message(
        &mut self,
        stream: &mut ByteStream<'_>,
        (raw, time, size): (u32, Stamp, u32),
    ) -> Result<(), NoRecord> {
        let Some(id) = self.query.connections.get(raw) else {
            nameless(self.sink, 1);
            return super::record::pass(stream, u64::from(size));
        };
        let want: Want = self.query.wants[id.0 as usize];
        hand_over(stream, (id, time, size), want, self.sink)?;
        if self.what == Share::Whole {
            self.gather.add(id, time, size, self.sink);
        }
        Ok(())
    }
}
