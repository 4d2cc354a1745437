//! A ROS 1 bag record by record from the front: without an index, cut, still open, or from a pipe.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read as _;

use super::records::{self, Record, Stop, Table};
use crate::bag::adapters::Gather;
use crate::bag::decompress::{Allowance, Compression, UNFOLDS};
use crate::bag::index::{hand_over, nameless, pass};
use crate::bag::model::{MOST_PAYLOAD, Sink, Want};
use crate::bag::source::Stream;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;

/// How far is looked at a time for where records go on, in bytes.
const STRIDE: usize = 64 * 1024;

/// What was found on the way.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) compression: BTreeSet<Compression>,
    /// The bag ends where a record ends, and nothing was skipped.
    pub(super) complete: bool,
}

/// Messages that came before the connection that they belong to.
#[derive(Default)]
struct Early {
    runs: BTreeMap<u32, (Vec<Stamp>, Vec<u32>)>,
    held: usize,
    dropped: u64,
}

/// How many early messages are held: 3 MB.
const MOST_EARLY: usize = 1 << 18;

/// Walks the records of a bag.
struct Walk<'s> {
    sink: &'s mut dyn Sink,
    table: Table,
    wants: Vec<Want>,
    gather: Gather,
    early: Early,
    found: Found,
    allowance: Allowance,
    /// The compression of a chunk that was never closed; its data goes on to the end.
    open: Option<Compression>,
    total: u64,
}

/// Reads all that `stream` holds from behind the line that names the version.
pub(super) fn read(stream: &mut Stream<'_>, total: u64, sink: &mut dyn Sink) -> Found {
    let mut walk = Walk {
        sink,
        table: Table::default(),
        wants: Vec::new(),
        gather: Gather::default(),
        early: Early::default(),
        found: Found {
            complete: true,
            ..Found::default()
        },
        allowance: Allowance::default(),
        open: None,
        total,
    };
    let stop = walk.outside(stream);
    walk.finish(stop, stream.position())
}

impl Walk<'_> {
    /// The records of the file itself.
    fn outside(&mut self, stream: &mut Stream<'_>) -> Stop {
        loop {
            if let Some(how) = self.open.take() {
                return self.tail(stream, how);
            }
            let stop = match records::next(stream) {
                Ok((Record::Chunk { compression, size }, len)) => {
                    self.chunk(stream, &compression, size, len)
                }
                Ok((record, len)) => self.record(stream, record, len),
                Err(stop) => Err(stop),
            };
            match stop {
                Ok(()) => {}
                Err(Stop::Broken) if self.resume(stream) => {}
                Err(stop) => return stop,
            }
            self.sink.progress(stream.position(), self.total);
        }
    }

    /// Passes over what is no record, up to the next chunk; answers whether there is one.
    fn resume(&mut self, stream: &mut Stream<'_>) -> bool {
        let from = stream.position();
        while let Ok(window) = stream.peek(2 * STRIDE) {
            let len = window.len();
            let mut starts = 0..len.min(STRIDE);
            if let Some(at) = starts.find(|at| records::is_chunk(&window[*at..])) {
                stream.advance(at);
                let lost = stream.position() - from;
                self.damage(&format!("{lost} bytes from byte {from} on are no records"));
                return true;
            }
            if len <= STRIDE {
                break;
            }
            stream.advance(STRIDE);
        }
        false
    }

    fn chunk(
        &mut self,
        stream: &mut Stream<'_>,
        name: &[u8],
        size: u32,
        len: u32,
    ) -> Result<(), Stop> {
        let Some(how) = Compression::named(name) else {
            self.damage("a chunk is compressed in a way that no reader knows");
            return Ok(pass(stream, u64::from(len))?);
        };
        self.found.compression.insert(how);
        if size == 0 && len == 0 && how != Compression::None {
            // A recorder writes the lengths when it closes the chunk; this one was killed before.
            self.open = Some(how);
            return Ok(());
        }
        let end = stream.position() + u64::from(len);
        let inside = if how == Compression::None {
            self.inside(stream, end)
        } else {
            let most = self.allowance.left(end);
            if most == 0 {
                self.damage(UNFOLDS);
                return Ok(pass(stream, u64::from(len))?);
            }
            let packed = stream.by_ref().take(u64::from(len));
            let mut plain = Stream::of_reader(how.reader(packed)?.take(most));
            let stop = self.inside(&mut plain, u64::MAX);
            self.allowance.spend(plain.position());
            stop
        };
        self.gather.flush(self.sink);
        match inside {
            Stop::End => {}
            Stop::Io(e) if how == Compression::None => return Err(Stop::Io(e)),
            _ => self.damage("a chunk is damaged inside"),
        }
        let left = end.saturating_sub(stream.position());
        match stream.skip(left)? {
            n if n < left => Err(Stop::Cut),
            _ => Ok(()),
        }
    }

    /// The records of a chunk, up to where `stream` stands at `end`.
    fn inside(&mut self, stream: &mut Stream<'_>, end: u64) -> Stop {
        while stream.position() < end {
            let step = match records::next(stream) {
                Ok((record, len)) => self.record(stream, record, len),
                Err(stop) => Err(stop),
            };
            if let Err(stop) = step {
                return stop;
            }
        }
        Stop::End
    }

    /// The rest of the file as one compressed chunk that was never closed.
    fn tail(&mut self, stream: &mut Stream<'_>, how: Compression) -> Stop {
        let mut plain = match how.reader(&mut *stream) {
            Ok(reader) => Stream::of_reader(reader),
            Err(e) => return Stop::Io(e),
        };
        match self.inside(&mut plain, u64::MAX) {
            Stop::End => Stop::End,
            _ => Stop::Cut,
        }
    }

    fn record(&mut self, stream: &mut Stream<'_>, record: Record, len: u32) -> Result<(), Stop> {
        match record {
            Record::Message { id, time } => self.message(stream, id, time, len),
            Record::Connection { id, topic } => self.connection(stream, id, &topic, len),
            _ => Ok(pass(stream, u64::from(len))?),
        }
    }

    fn message(
        &mut self,
        stream: &mut Stream<'_>,
        raw: u32,
        time: Stamp,
        len: u32,
    ) -> Result<(), Stop> {
        let Some(id) = self.table.get(raw) else {
            pass(stream, u64::from(len))?;
            self.early.hold(raw, time, len);
            return Ok(());
        };
        let want = self.wants[id.0 as usize];
        hand_over(stream, (id, time, len), want, self.sink)?;
        self.gather.add(id, time, len, self.sink);
        Ok(())
    }

    fn connection(
        &mut self,
        stream: &mut Stream<'_>,
        raw: u32,
        topic: &[u8],
        len: u32,
    ) -> Result<(), Stop> {
        if self.table.get(raw).is_some() || len as usize > MOST_PAYLOAD {
            return Ok(pass(stream, u64::from(len))?);
        }
        let data = stream.peek(len as usize)?;
        if data.len() < len as usize {
            return Err(Stop::Cut);
        }
        if let Some(connection) = self.table.add(raw, topic, data) {
            self.wants.push(self.sink.connection(connection));
            let id = connection.id;
            if let Some((stamps, sizes)) = self.early.runs.remove(&raw) {
                self.sink.stamps(id, &stamps, Some(&sizes));
            }
        }
        Ok(pass(stream, u64::from(len))?)
    }

    fn damage(&mut self, text: &str) {
        self.found.complete = false;
        self.sink.notice(Notice::new(NoticeKind::Damaged, text));
    }

    fn finish(mut self, stop: Stop, at: u64) -> Found {
        self.gather.flush(self.sink);
        let early = self
            .early
            .runs
            .values()
            .map(|(stamps, _)| stamps.len() as u64);
        let homeless = early.sum::<u64>() + self.early.dropped;
        if homeless > 0 {
            self.found.complete = false;
            nameless(self.sink, homeless);
        }
        let (kind, text) = match stop {
            Stop::End => return self.found,
            Stop::Cut => (
                NoticeKind::Truncated,
                format!("the bag is cut at byte {at}"),
            ),
            Stop::Broken => (
                NoticeKind::Damaged,
                format!("what stands from byte {at} on is no record"),
            ),
            Stop::Io(e) => (
                NoticeKind::Damaged,
                format!("reading stopped at byte {at}: {e}"),
            ),
        };
        self.found.complete = false;
        self.sink.notice(Notice::new(kind, text));
        self.found
    }
}

impl Early {
    fn hold(&mut self, id: u32, time: Stamp, size: u32) {
        if self.held >= MOST_EARLY {
            self.dropped += 1;
            return;
        }
        self.held += 1;
        let run = self.runs.entry(id).or_default();
        run.0.push(time);
        run.1.push(size);
    }
}
