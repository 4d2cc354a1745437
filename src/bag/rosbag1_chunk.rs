//! One chunk of a ROS 1 bag: its stamps from the index behind it, wanted messages from inside, or all by walking it.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;

use super::records::{self, ENTRY, Record, Stop, Table};
use crate::bag::{ConnectionId, Gather, MOST_PAYLOAD, Message, Sink, Want, lost};
use crate::decompress::Compression;
use crate::notice::{Notice, NoticeKind};
use crate::source::{FAR, NEAR, Source, Stream};
use crate::time::{Span, Stamp};

/// What the tail says about a chunk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chunk {
    /// Where its record begins.
    pub(super) pos: u64,
    /// Where the next chunk, or the tail, begins.
    pub(super) end: u64,
    pub(super) first: Stamp,
    pub(super) last: Stamp,
    pub(super) tally: Tally,
}

/// What index records of a chunk should add up to, in any order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    connections: u32,
    pub(super) messages: u64,
    mix: u64,
}

impl Tally {
    /// Adds `count` messages of connection `id`.
    pub(super) fn add(&mut self, id: u32, count: u32) {
        // A multiplication by an odd number loses nothing; its high bits make sums of pairs differ.
        let pair = u64::from(id) << 32 | u64::from(count);
        let spread = pair.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.mix = self.mix.wrapping_add(spread ^ spread >> 29);
        self.connections = self.connections.saturating_add(1);
        self.messages += u64::from(count);
    }

    /// How long the index records are if their headers are as every writer makes them: 47 bytes.
    pub(super) fn index_len(&self) -> u64 {
        u64::from(self.connections) * (4 + 47 + 4) + self.messages * u64::from(ENTRY)
    }
}

/// A longer index is not held in memory; its chunk is walked instead.
pub(super) const LONGEST_INDEX: u64 = 16 << 20;

/// The index record of one connection: where its entries stand in the index's bytes.
struct Run {
    id: u32,
    entries: Range<usize>,
}

/// Reads chunks of one bag; shared by threads.
pub(super) struct Chunks<'a> {
    pub(super) source: &'a Source,
    pub(super) table: &'a Table,
    /// What is wanted, by connection.
    pub(super) wants: &'a [Want],
    pub(super) range: Option<Span>,
}

impl Chunks<'_> {
    /// Tells `sink` all stamps of `chunk` and what is wanted of its messages.
    pub(super) fn read(&self, chunk: &Chunk, sink: &mut dyn Sink) {
        let told = match self.index(chunk) {
            Ok(Some((bytes, runs))) => {
                self.tell(chunk, &bytes, &runs, sink);
                Ok(())
            }
            Ok(None) => {
                sink.notice(Notice::new(
                    NoticeKind::Downgraded,
                    "chunks were read whole since their index is missing or wrong",
                ));
                self.walk(chunk, sink)
            }
            Err(e) => Err(e),
        };
        if let Err(e) = told {
            lost(sink, "a chunk that the system refuses to read", &e);
        }
    }

    /// The chunk's index, if it says exactly what the tail says.
    fn index(&self, chunk: &Chunk) -> io::Result<Option<(Vec<u8>, Vec<Run>)>> {
        let len = chunk.tally.index_len();
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
            Some((_, body)) => self.index_at(body.end, chunk),
            None => Ok(None),
        }
    }

    fn index_at(&self, start: u64, chunk: &Chunk) -> io::Result<Option<(Vec<u8>, Vec<Run>)>> {
        let room = chunk.end.saturating_sub(start);
        // Behind a chunk there may be a gap; the index is not longer than it should be, but for odd headers.
        let len = room
            .min(chunk.tally.index_len() * 2 + 4096)
            .min(LONGEST_INDEX);
        let len = usize::try_from(len).unwrap_or(usize::MAX);
        let mut bytes = vec![0; len];
        let got = self.source.read_at(start, &mut bytes)?;
        bytes.truncate(got);
        Ok(runs(&bytes, &chunk.tally).map(|runs| (bytes, runs)))
    }

    /// The chunk's compression and where its body stands.
    fn body(&self, chunk: &Chunk) -> io::Result<Option<(Compression, Range<u64>)>> {
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
        let body = start..start + u64::from(len);
        let how = Compression::named(&compression).filter(|_| body.end <= chunk.end);
        Ok(how.map(|how| (how, body)))
    }

    /// How the chunk is compressed, if that can be told.
    pub(super) fn compression(&self, chunk: &Chunk) -> Option<Compression> {
        self.body(chunk).ok().flatten().map(|(how, _)| how)
    }

    fn tell(&self, chunk: &Chunk, bytes: &[u8], runs: &[Run], sink: &mut dyn Sink) {
        let mut sizes = BTreeMap::new();
        let wanted = self.wanted(bytes, runs);
        if !wanted.is_empty() {
            sizes = self.fetch(chunk, &wanted, sink);
        }
        let mut stamps = Vec::new();
        for (at, run) in runs.iter().enumerate() {
            let entries = bytes[run.entries.clone()].chunks_exact(ENTRY as usize);
            let Some(id) = self.table.get(run.id) else {
                unknown(sink, entries.len() as u64);
                continue;
            };
            stamps.clear();
            stamps.extend(entries.filter_map(|e| records::time_at(e, 0)));
            let sizes = sizes
                .get(&at)
                .filter(|s: &&Vec<u32>| s.len() == stamps.len());
            sink.stamps(id, &stamps, sizes.map(Vec::as_slice));
        }
    }

    /// The entries of which more than the stamp is wanted, in the order of the chunk.
    fn wanted(&self, bytes: &[u8], runs: &[Run]) -> Vec<Wanted> {
        let mut all = Vec::new();
        for (at, run) in runs.iter().enumerate() {
            let Some(id) = self.table.get(run.id) else {
                continue;
            };
            let want = self.wants[id.0 as usize];
            if want == Want::Stamps {
                continue;
            }
            let entries = bytes[run.entries.clone()].chunks_exact(ENTRY as usize);
            for (entry, e) in entries.enumerate() {
                let (Some(time), Some(offset)) = (records::time_at(e, 0), records::u32_at(e, 8))
                else {
                    continue;
                };
                let inside = self.range.is_none_or(|r| r.contains(time));
                if inside || want == Want::Sizes {
                    all.push(Wanted {
                        offset,
                        run: at,
                        entry,
                        raw: run.id,
                        id,
                        time,
                        want,
                    });
                }
            }
        }
        all.sort_unstable_by_key(|w| (w.offset, w.run, w.entry));
        all
    }

    /// Fetches wanted messages; answers the sizes per run.
    fn fetch(
        &self,
        chunk: &Chunk,
        wanted: &[Wanted],
        sink: &mut dyn Sink,
    ) -> BTreeMap<usize, Vec<u32>> {
        let mut sizes = BTreeMap::new();
        let bad = match self.body(chunk) {
            Ok(Some((Compression::None, body))) => {
                let mut stream = Stream::of_file(self.source, body.start, body.end, NEAR);
                pick(&mut stream, body.start, wanted, &mut sizes, sink)
            }
            Ok(Some((how, body))) => {
                let packed = Stream::of_file(self.source, body.start, body.end, FAR);
                match how.reader(packed) {
                    Ok(plain) => pick(&mut Stream::of_reader(plain), 0, wanted, &mut sizes, sink),
                    Err(_) => wanted.len(),
                }
            }
            _ => wanted.len(),
        };
        if bad > 0 {
            sizes.clear();
            sink.notice(Notice {
                kind: NoticeKind::Damaged,
                count: bad as u64,
                text: "messages are in the index but not in their chunk".to_owned(),
            });
        }
        sizes
    }

    /// Reads the chunk record by record.
    fn walk(&self, chunk: &Chunk, sink: &mut dyn Sink) -> io::Result<()> {
        let Some((how, body)) = self.body(chunk)? else {
            sink.notice(Notice::new(
                NoticeKind::Damaged,
                "a chunk has no readable head",
            ));
            return Ok(());
        };
        let packed = Stream::of_file(self.source, body.start, body.end, FAR);
        let mut stream = match how {
            Compression::None => packed,
            _ => Stream::of_reader(how.reader(packed)?),
        };
        let mut gather = Gather::default();
        let stop = loop {
            match records::next(&mut stream) {
                Ok((Record::Message { id, time }, len)) => {
                    let Some(id) = self.table.get(id) else {
                        unknown(sink, 1);
                        let _ = stream.skip(u64::from(len))?;
                        continue;
                    };
                    gather.add(id, time, len, sink);
                    let want = self.wants[id.0 as usize];
                    if let Err(e) = hand_over(&mut stream, id, time, len, want, sink) {
                        break e;
                    }
                }
                Ok((_, len)) => drop(stream.skip(u64::from(len))?),
                Err(stop) => break stop,
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
}

/// Messages of a connection that the bag does not describe.
pub(super) fn unknown(sink: &mut dyn Sink, count: u64) {
    sink.notice(Notice {
        kind: NoticeKind::Damaged,
        count,
        text: "messages belong to a connection that the bag does not describe".to_owned(),
    });
}

/// A message to be fetched.
struct Wanted {
    offset: u32,
    run: usize,
    entry: usize,
    raw: u32,
    id: ConnectionId,
    time: Stamp,
    want: Want,
}

/// The index records in `bytes`, if they add up to `tally`.
fn runs(bytes: &[u8], tally: &Tally) -> Option<Vec<Run>> {
    let mut found = Tally::default();
    let mut runs = Vec::new();
    let mut at = 0;
    if tally.messages == 0 && at_index_record(bytes) {
        return None;
    }
    while found != *tally && runs.len() < tally.connections as usize {
        let header_len = records::u32_at(bytes, at)? as usize;
        let header = bytes.get(at + 4..)?.get(..header_len)?;
        let Some(Record::Index { id, count }) = records::parse(header) else {
            return None;
        };
        let start = at + 4 + header_len + 4;
        let end = start.checked_add((count as usize).checked_mul(ENTRY as usize)?)?;
        bytes.get(start..end)?;
        found.add(id, count);
        runs.push(Run {
            id,
            entries: start..end,
        });
        at = end;
    }
    (found == *tally).then_some(runs)
}

fn at_index_record(bytes: &[u8]) -> bool {
    let len = records::u32_at(bytes, 0).map_or(0, |n| n as usize);
    let header = bytes.get(4..).and_then(|b| b.get(..len));
    matches!(
        header.and_then(records::parse),
        Some(Record::Index { count: 1.., .. })
    )
}

/// Fetches `wanted`, which is in the order of the stream; answers how many were not there.
fn pick(
    stream: &mut Stream<'_>,
    base: u64,
    wanted: &[Wanted],
    sizes: &mut BTreeMap<usize, Vec<u32>>,
    sink: &mut dyn Sink,
) -> usize {
    let mut bad = 0;
    for one in wanted {
        match pick_one(stream, base, one, sink) {
            Some(size) => {
                let run = sizes.entry(one.run).or_default();
                if run.len() <= one.entry {
                    run.resize(one.entry + 1, 0);
                }
                run[one.entry] = size;
            }
            None => bad += 1,
        }
    }
    bad
}

fn pick_one(stream: &mut Stream<'_>, base: u64, one: &Wanted, sink: &mut dyn Sink) -> Option<u32> {
    let ahead = (base + u64::from(one.offset)).checked_sub(stream.position())?;
    if stream.skip(ahead).ok()? < ahead {
        return None;
    }
    let (record, len) = records::next(stream).ok()?;
    match record {
        Record::Message { id, .. } if id == one.raw => {
            let data = wanted_part(stream, len, one.want, sink).ok()?;
            if let Some(data) = data {
                sink.message(Message {
                    connection: one.id,
                    time: one.time,
                    data,
                    size: len,
                });
            }
            Some(len)
        }
        _ => None,
    }
}

/// Hands over what is wanted of the message that `stream` stands at, and passes over it.
pub(super) fn hand_over(
    stream: &mut Stream<'_>,
    connection: ConnectionId,
    time: Stamp,
    size: u32,
    want: Want,
    sink: &mut dyn Sink,
) -> Result<(), Stop> {
    if let Some(data) = wanted_part(stream, size, want, sink)? {
        sink.message(Message {
            connection,
            time,
            data,
            size,
        });
    }
    match stream.skip(u64::from(size))? {
        n if n < u64::from(size) => Err(Stop::Cut),
        _ => Ok(()),
    }
}

/// The bytes that are wanted of the message that `stream` stands at; `None` if none are, or too many.
fn wanted_part<'s>(
    stream: &'s mut Stream<'_>,
    size: u32,
    want: Want,
    sink: &mut dyn Sink,
) -> Result<Option<&'s [u8]>, Stop> {
    let len = match want {
        Want::Stamps | Want::Sizes => return Ok(None),
        Want::Head(n) => (size as usize).min(n),
        Want::Payload => size as usize,
    };
    if len > MOST_PAYLOAD {
        sink.notice(Notice::new(
            NoticeKind::Undecodable,
            "messages larger than 16 MiB were counted and not looked into",
        ));
        return Ok(None);
    }
    let data = stream.peek(len)?;
    if data.len() < len {
        return Err(Stop::Cut);
    }
    Ok(Some(data))
}
