//! A chunked bag that is still being written: each record once, as soon as it is complete.

use std::path::{Path, PathBuf};

use super::forward::Walk;
use super::{Grammar, HEAD};
use crate::bag::input::closed;
use crate::bag::model::{Growing, Growth, Sink};
use crate::bag::source::{ByteStream, FAR, FileSource};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};

/// The position up to which a growing bag has been read, and the state of the walk there.
struct GrowingChunks<G> {
    path: PathBuf,
    /// The first byte that has not been reported.
    at: u64,
    /// The size of the bag when it was last read.
    len: u64,
    /// Whether the bag had its end at that time.
    is_closed: bool,
    walk: Walk<G>,
    /// The last bytes before `at` that a recorder never changes.
    behind: Vec<u8>,
}

/// The number of bytes by which it is noticed that a bag was replaced.
const BEHIND: u64 = 64;

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
        walk: Walk::default(),
        behind: Vec::new(),
    }))
}

impl<G: Grammar> Growing for GrowingChunks<G> {
    fn poll(&mut self, sink: &mut dyn Sink) -> Result<Growth> {
        if let Some(closed) = closed(&self.path) {
            self.path = closed;
        }
        let source = FileSource::open(&self.path)?;
        let len = source.len();
        let fail = || Error::io("read", &self.path);
        let behind = self.last_bytes(&source).map_err(fail())?;
        if len < self.len || behind != self.behind {
            let text = if len < self.len {
                format!("the bag was shortened to {len} bytes while it was followed")
            } else {
                "the bag was rewritten while it was followed".to_owned()
            };
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
        let plan = G::plan(&source).map_err(fail())?;
        self.is_closed = plan.is_ok() || G::is_ended(&source);
        self.len = len;
        let mut stream = ByteStream::of_file(&source, self.at, len, FAR);
        if self.at == 0 {
            G::begin(&mut stream);
        }
        let (stop, at) = self.walk.go(&mut stream, 0, !self.is_closed, sink);
        self.at = at;
        if self.is_closed {
            std::mem::take(&mut self.walk).finish(&stop, at, sink);
        }
        self.behind = self
            .last_bytes(&source)
            .map_err(Error::io("read", &self.path))?;
        Ok(Growth::More)
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

impl<G: Grammar> GrowingChunks<G> {
    /// The bytes before byte `at`, as far as the head of a chunk.
    fn last_bytes(&self, source: &FileSource) -> std::io::Result<Vec<u8>> {
        let len = self.at.saturating_sub(self.walk.body).min(BEHIND);
        let mut bytes = vec![0; usize::try_from(len).unwrap_or(0)];
        let got = source.read_at(self.at - len, &mut bytes)?;
        bytes.truncate(got);
        Ok(bytes)
    }
}
