//! Bags in object stores and on web servers: parts of an object, fetched in few requests, all of the same version.

mod reader;
mod store;

use std::collections::VecDeque;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use crate::bag::input::public_url_of;
use crate::bag::source::{FileSource, Ranges};
use crate::base::error::Result;
use store::{Object, StoreRefusal};

pub(crate) use reader::open;
pub(crate) use store::list;

/// The size of the first request in bytes: it returns size and version, and all of a small bag.
const FIRST: u64 = 64 << 10;
/// Objects up to this size are fetched whole, which is as fast as two partial requests.
const SMALL: u64 = 512 << 10;
/// The smallest request, in bytes: smaller ones are not faster.
const LEAST: u64 = 4 << 10;
/// The end of an object is fetched in one piece: after a footer, the data that it points to is needed.
const TAIL: u64 = 32 << 10;
/// The largest read-ahead of sequential reads, in bytes.
const MOST_AHEAD: u64 = 4 << 20;
/// Ranges at most this far apart, in bytes, share a request: reading the gap is faster than another round trip.
const GAP: u64 = 16 << 10;
/// The most bytes of an object kept in memory.
const MOST_HELD: u64 = 32 << 20;
/// The most concurrent requests per waiting thread.
const TOGETHER: usize = 16;

/// An object with its cached parts.
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
    /// The end and the length of the last part that was requested alone.
    last: (u64, u64),
}

/// Some bytes of an object.
#[derive(Debug, Default)]
struct ObjectPart {
    start: u64,
    bytes: Vec<u8>,
}

/// An object as a source, and the storage for its first failure.
struct Opened {
    source: FileSource,
    etag: Option<String>,
    refused: Refused,
}

/// The first failure of the store or the connection while an object was read.
#[derive(Clone)]
struct Refused {
    url: String,
    why: Arc<OnceLock<StoreRefusal>>,
}

impl Refused {
    /// Returns the failure, if any: what was read then is not the whole object.
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

/// Opens the object at `url` in one request, which also returns its first bytes; two if it is small.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) if it does not exist, [`Error::Remote`](crate::Error::Remote) if the store fails.
fn object(url: &str) -> Result<Opened> {
    let public_url = &public_url_of(url);
    let (object, first) = Object::open(url, FIRST).map_err(|why| why.error(public_url))?;
    let (len, etag) = (object.len, object.etag.clone());
    let refused: Arc<OnceLock<StoreRefusal>> = Arc::default();
    let remote = Remote {
        object: Arc::new(object),
        state: Mutex::default(),
        refused: Arc::clone(&refused),
    };
    let refused = Refused {
        url: public_url.clone(),
        why: refused,
    };
    remote.keep(0, first);
    if len > FIRST && len <= SMALL {
        let rest = FIRST..len;
        // A failure is kept in `refused`.
        let _ = remote.fetch(&[rest]);
        refused.check()?;
    }
    Ok(Opened {
        source: FileSource::of(Path::new(public_url), len, remote),
        etag,
        refused,
    })
}

/// The size and the version of the object at `url`.
pub(crate) fn version(url: &str) -> Result<(u64, Option<String>)> {
    let opened = Object::open(url, 1).map_err(|why| why.error(&public_url_of(url)));
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
    /// Parts are complete or absent, so a poisoned lock does no harm.
    fn state(&self) -> MutexGuard<'_, HeldParts> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The range to request if `len` bytes from `at` on are wanted.
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

    /// Fetches all ranges concurrently; returns the last one.
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
    /// The part that contains the byte at `at`.
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

    /// Copies bytes from `at`, which it contains, to its end; returns their number.
    fn copy(&self, at: u64, into: &mut [u8]) -> usize {
        let from = usize::try_from(at.saturating_sub(self.start)).unwrap_or(usize::MAX);
        let bytes = self.bytes.get(from..).unwrap_or_default();
        let n = bytes.len().min(into.len());
        into[..n].copy_from_slice(&bytes[..n]);
        n
    }
}

/// Sorts the ranges, merges those that are close to each other, and clips them at the end.
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
    fn close_ranges_share_a_request() {
        let far = 999 + GAP;
        let ranges = vec![far..far + 10, 0..100, 50..999, 200..300, 9 << 30..10 << 30];
        let one = 0..far + 10;
        assert_eq!(together(ranges, 1 << 30), [one]);
        let apart = vec![0..10, GAP + 11..GAP + 20];
        assert_eq!(together(apart.clone(), u64::MAX), apart);
    }
}
