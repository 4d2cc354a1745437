//! Bags in object stores and on web servers: parts of an object, asked for in few requests, all of the same version.

mod reader;
mod store;

use std::collections::VecDeque;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use crate::bag::input::told_url;
use crate::bag::source::{FileSource, Ranges};
use crate::base::error::Result;
use store::{Object, StoreRefusal};

pub(crate) use reader::open;
pub(crate) use store::list;

/// The first request asks for so much, in bytes: it tells size and version, and holds all of a small bag.
const FIRST: u64 = 64 << 10;
/// What is not larger is fetched whole: as fast as two requests for its parts.
const SMALL: u64 = 512 << 10;
/// The least that is asked for, in bytes: less is not faster.
const LEAST: u64 = 4 << 10;
/// The end of an object is asked for in one piece: a footer is followed by what it points to.
const TAIL: u64 = 32 << 10;
/// The most that is asked for at once where one part is read after the other, in bytes.
const MOST_AHEAD: u64 = 4 << 20;
/// What lies so close, in bytes, is asked for together: reading over it takes less than another answer.
const GAP: u64 = 16 << 10;
/// How much of an object is held in memory, in bytes.
const MOST_HELD: u64 = 32 << 20;
/// The most requests that are on their way at a time, for each thread that waits.
const TOGETHER: usize = 16;

/// An object with the parts of it that were fetched and not yet forgotten.
#[derive(Debug)]
struct Remote {
    object: Arc<Object>,
    state: Mutex<HeldParts>,
    refused: Arc<OnceLock<StoreRefusal>>,
}

#[derive(Debug, Default)]
struct HeldParts {
    held: VecDeque<Arc<ObjectPart>>,
    bytes: u64,
    /// Where the last part ended that was asked for by itself, and its length.
    last: (u64, u64),
}

/// Some bytes of an object.
#[derive(Debug, Default)]
struct ObjectPart {
    start: u64,
    bytes: Vec<u8>,
}

/// An object as a source, and where it says why it could not be read on.
struct Opened {
    source: FileSource,
    etag: Option<String>,
    refused: Refused,
}

/// Whether the store, or the way there, failed while an object was read.
#[derive(Clone)]
struct Refused {
    url: String,
    why: Arc<OnceLock<StoreRefusal>>,
}

impl Refused {
    /// The failure, if there was one: whatever was read besides is not the whole object.
    ///
    /// # Errors
    /// [`Error::Remote`](crate::Error::Remote) for the first one.
    fn check(&self) -> Result<()> {
        match self.why.get() {
            Some(why) => Err(why.error(&self.url)),
            None => Ok(()),
        }
    }
}

/// Opens the object at `url` in one request, which brings its first bytes too; two where it is small.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) if there is none, [`Error::Remote`](crate::Error::Remote) if the store cannot be asked.
fn object(url: &str) -> Result<Opened> {
    let told = &told_url(url);
    let (object, first) = Object::open(url, FIRST).map_err(|why| why.error(told))?;
    let (len, etag) = (object.len, object.etag.clone());
    let refused: Arc<OnceLock<StoreRefusal>> = Arc::default();
    let remote = Remote {
        object: Arc::new(object),
        state: Mutex::default(),
        refused: Arc::clone(&refused),
    };
    let refused = Refused {
        url: told.clone(),
        why: refused,
    };
    remote.keep(0, first);
    if len > FIRST && len <= SMALL {
        let rest = FIRST..len;
        // What went wrong is asked for behind it.
        let _ = remote.fetch(&[rest]);
        refused.check()?;
    }
    Ok(Opened {
        source: FileSource::of(Path::new(told), len, remote),
        etag,
        refused,
    })
}

/// The size and the version of the object at `url`.
pub(crate) fn version(url: &str) -> Result<(u64, Option<String>)> {
    let opened = Object::open(url, 1).map_err(|why| why.error(&told_url(url)));
    opened.map(|(object, _)| (object.len, object.etag))
}

impl Ranges for Remote {
    fn read_once(&self, at: u64, into: &mut [u8]) -> io::Result<usize> {
        if at >= self.object.len || into.is_empty() {
            return Ok(0);
        }
        let held = self.state().part(at);
        let part = match held {
            Some(part) => part,
            None => self.fetch(&[self.around(at, into.len() as u64)])?,
        };
        Ok(part.copy(at, into))
    }

    fn expect(&self, ranges: &[Range<u64>]) -> io::Result<()> {
        let missing: Vec<Range<u64>> = {
            let state = self.state();
            let missing = ranges.iter().filter(|range| !state.holds(range));
            missing.cloned().collect()
        };
        together(missing, self.object.len)
            .chunks(TOGETHER)
            .try_for_each(|ranges| self.fetch(ranges).map(drop))
    }

    fn is_far(&self) -> bool {
        true
    }
}

impl Remote {
    /// Parts are whole or not there, so that a panic elsewhere spoils nothing.
    fn state(&self) -> MutexGuard<'_, HeldParts> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What to ask for, where `len` bytes from `at` on are wanted.
    fn around(&self, at: u64, len: u64) -> Range<u64> {
        let end = self.object.len;
        if at.saturating_add(TAIL) >= end {
            return end.saturating_sub(TAIL)..end;
        }
        let mut state = self.state();
        let len = match state.last {
            (last, before) if last == at => len.max((before * 2).min(MOST_AHEAD)),
            _ => len.max(LEAST),
        };
        let range = at..at.saturating_add(len).min(end);
        state.last = (range.end, range.end - range.start);
        range
    }

    /// Fetches all of these at the same time; answers the last one.
    fn fetch(&self, ranges: &[Range<u64>]) -> io::Result<Arc<ObjectPart>> {
        if let Some(why) = self.refused.get() {
            return Err(why.io());
        }
        let parts = self.object.get(ranges).map_err(|why| {
            let error = why.io();
            // Only the first one is reported.
            let _ = self.refused.set(why);
            error
        })?;
        let mut last = Arc::default();
        for (range, bytes) in ranges.iter().zip(parts) {
            last = self.keep(range.start, bytes);
        }
        Ok(last)
    }

    fn keep(&self, start: u64, bytes: Vec<u8>) -> Arc<ObjectPart> {
        let part = Arc::new(ObjectPart { start, bytes });
        let mut state = self.state();
        state.bytes += part.bytes.len() as u64;
        state.held.push_back(Arc::clone(&part));
        while state.bytes > MOST_HELD && state.held.len() > 2 * TOGETHER {
            let gone = state.held.pop_front();
            state.bytes -= gone.map_or(0, |part| part.bytes.len() as u64);
        }
        part
    }
}

impl HeldParts {
    /// The part that holds the byte at `at`.
    fn part(&self, at: u64) -> Option<Arc<ObjectPart>> {
        let part = self.held.iter().rev().find(|part| part.holds(at));
        part.cloned()
    }

    fn holds(&self, range: &Range<u64>) -> bool {
        let ends = |part: &Arc<ObjectPart>| part.holds(range.start) && part.end() >= range.end;
        range.is_empty() || self.held.iter().any(ends)
    }
}

impl ObjectPart {
    fn end(&self) -> u64 {
        self.start + self.bytes.len() as u64
    }

    fn holds(&self, at: u64) -> bool {
        self.start <= at && at < self.end()
    }

    /// Copies what there is from `at` on, which it holds; answers how much that was.
    fn copy(&self, at: u64, into: &mut [u8]) -> usize {
        let from = usize::try_from(at.saturating_sub(self.start)).unwrap_or(usize::MAX);
        let bytes = self.bytes.get(from..).unwrap_or_default();
        let n = bytes.len().min(into.len());
        into[..n].copy_from_slice(&bytes[..n]);
        n
    }
}

/// Ranges that lie close made one, in order, none past the end.
fn together(mut ranges: Vec<Range<u64>>, end: u64) -> Vec<Range<u64>> {
    ranges.sort_by_key(|range| range.start);
    let mut all: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        let range = range.start..range.end.min(end);
        match all.last_mut() {
            _ if range.is_empty() => {}
            Some(last)
                if range.start <= last.end.saturating_add(GAP)
                    && range.end.max(last.end) - last.start <= MOST_AHEAD =>
            {
                last.end = last.end.max(range.end);
            }
            _ => all.push(range),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_close_is_asked_for_together() {
        let far = 999 + GAP;
        let ranges = vec![far..far + 10, 0..100, 50..999, 200..300, 9 << 30..10 << 30];
        let one = 0..far + 10;
        assert_eq!(together(ranges, 1 << 30), [one]);
        let apart = vec![0..10, GAP + 11..GAP + 20];
        assert_eq!(together(apart.clone(), u64::MAX), apart);
    }
}
