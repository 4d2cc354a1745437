//! A chunked bag that is still being written: each record once, as soon as it is complete.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::index::hand_over;
use super::record::{Announced, NoRecord, RecordHead, pass, walk};
use super::unpack::{Visitor, unpack};
use super::{Grammar, HEAD};
use crate::bag::adapters::Gather;
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::input::closed;
use crate::bag::model::{Growing, Growth, Sink};
use crate::bag::source::{ByteStream, FAR, FileSource};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;

/// The position up to which a growing bag has been read, and the connections described so far.
struct GrowingChunks<G> {
    path: PathBuf,
    /// The first byte that has not been reported.
    at: u64,
    /// The size of the bag when it was last read.
    len: u64,
    /// Whether the bag had its end at that time.
    is_closed: bool,
    announced: Announced<G>,
    allowance: Arc<Allowance>,
}

/// Follows a bag of this grammar.
pub(crate) fn follow<G: Grammar>(path: &Path) -> Result<Box<dyn Growing>> {
    let source = FileSource::open(path)?;
    let mut head = [0; HEAD];
    let got = source.read_at(0, &mut head);
    G::accept(path, &head[..got.map_err(Error::io("read", path))?])?;
    Ok(Box::new(GrowingChunks::<G> {
        path: path.to_owned(),
        at: 0,
        len: 0,
        is_closed: false,
        announced: Announced::default(),
        allowance: Arc::default(),
    }))
}

impl<G: Grammar> Growing for GrowingChunks<G> {
    fn poll(&mut self, sink: &mut dyn Sink) -> Result<Growth> {
        self.find();
        let source = FileSource::open(&self.path)?;
        let len = source.len();
        if len < self.at {
            let text = format!("the bag was shortened to {len} bytes while it was followed");
            sink.notice(Notice::new(NoticeKind::Truncated, text));
            return Ok(Growth::Ended);
        }
        if len == self.len {
            return Ok(if self.is_closed {
                Growth::Ended
            } else {
                Growth::Same
            });
        }
        self.len = len;
        self.records(&source, sink);
        let plan = G::plan(&source).map_err(Error::io("read", &self.path))?;
        self.is_closed = plan.is_ok() || G::is_ended(&source);
        Ok(Growth::More)
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

impl<G: Grammar> GrowingChunks<G> {
    /// Takes the bag's new name.
    fn find(&mut self) {
        if let Some(closed) = closed(&self.path) {
            self.path = closed;
        }
    }

    /// Reports the records that have become complete.
    fn records(&mut self, source: &FileSource, sink: &mut dyn Sink) {
        let mut stream = ByteStream::of_file(source, self.at, self.len, FAR);
        if self.at == 0 {
            G::begin(&mut stream);
        }
        let mut gather = Gather::default();
        // No complete record follows yet; damage is reported when the closed bag is read.
        let _ = walk(&mut stream, u64::MAX, |stream| {
            let mut records = Records {
                bag: self,
                gather: &mut gather,
                sink: &mut *sink,
            };
            records.next(stream)?;
            self.at = stream.position();
            Ok(())
        });
        gather.flush(sink);
    }
}

/// The receiver of the records of a growing bag.
struct Records<'a, G> {
    bag: &'a mut GrowingChunks<G>,
    gather: &'a mut Gather,
    sink: &'a mut dyn Sink,
}

impl<G: Grammar> Records<'_, G> {
    /// Takes the next record, if it is complete.
    fn next(&mut self, stream: &mut ByteStream<'_>) -> Result<(), NoRecord> {
        match G::next(stream)? {
            // The open chunk has no length yet: its records follow, and if compressed they cannot be read before it is
            // closed.
            RecordHead::Chunk(head) if head.unclosed => Err(NoRecord::Cut),
            RecordHead::Chunk(head) if head.packed == 0 && head.how == Some(Compression::None) => {
                Ok(())
            }
            record if stream.left().is_some_and(|left| left < record.len()) => Err(NoRecord::Cut),
            RecordHead::Chunk(head) => {
                let allowance = Arc::clone(&self.bag.allowance);
                unpack(stream, &head, &allowance, self).map(drop)
            }
            RecordHead::Message { raw, time, size } => self.message(stream, (raw, time, size)),
            RecordHead::Description { what, len } => self.description(stream, &what, len),
            record => pass(stream, record.len()),
        }
    }
}

impl<G: Grammar> Visitor<G> for Records<'_, G> {
    fn message(
        &mut self,
        stream: &mut ByteStream<'_>,
        (raw, time, size): (u32, Stamp, u32),
    ) -> Result<(), NoRecord> {
        let Some((id, want)) = self.bag.announced.get(raw) else {
            return pass(stream, u64::from(size));
        };
        hand_over(stream, (id, time, size), want, self.sink)?;
        self.gather.add(id, time, size, self.sink);
        Ok(())
    }

    fn description(
        &mut self,
        stream: &mut ByteStream<'_>,
        what: &G::Description,
        len: u64,
    ) -> Result<(), NoRecord> {
        // Errors are reported when the closed bag is read.
        let new = self.bag.announced.read(stream, (what, len), self.sink);
        new.map(drop)
    }
}
