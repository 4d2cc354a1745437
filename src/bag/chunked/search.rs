//! The search for the next record behind bytes that are not one.

use std::io::{self, Read as _};

use super::Grammar;
use crate::bag::source::ByteStream;

/// The number of bytes searched at a time for the next record.
const STRIDE: usize = 64 * 1024;

/// Goes to the beginning of the next chunk after byte `from`; false if there is none before the end of the stream.
pub(super) fn next_chunk<G: Grammar>(stream: &mut ByteStream<'_>, from: u64) -> bool {
    next(stream, from, u64::MAX, G::is_chunk)
}

/// As [`next_chunk`], for a chunk, a message or a description, before byte `end`.
pub(super) fn next_record<G: Grammar>(stream: &mut ByteStream<'_>, from: u64, end: u64) -> bool {
    let is_wanted = |bytes: &[u8]| G::is_chunk(bytes) || G::is_content(bytes);
    next(stream, from, end, is_wanted)
}

fn next(stream: &mut ByteStream<'_>, from: u64, end: u64, is_wanted: fn(&[u8]) -> bool) -> bool {
    if stream.position() <= from && !matches!(stream.skip(1), Ok(1)) {
        return false;
    }
    let left = end.saturating_sub(stream.position());
    let mut before = Before::new(stream, is_wanted);
    // An error of reading ends the search; the walk meets it again.
    let _ = io::copy(&mut before.by_ref().take(left), &mut io::sink());
    before.is_there && before.free == 0
}

/// The bytes of a stream before the next record that is wanted.
pub(super) struct Before<'a, 'b> {
    stream: &'a mut ByteStream<'b>,
    is_wanted: fn(&[u8]) -> bool,
    /// The number of next bytes at which none begins.
    free: usize,
    /// Whether one begins behind them.
    pub(super) is_there: bool,
}

impl<'a, 'b> Before<'a, 'b> {
    pub(super) fn new(stream: &'a mut ByteStream<'b>, is_wanted: fn(&[u8]) -> bool) -> Self {
        Self {
            stream,
            is_wanted,
            free: 0,
            is_there: false,
        }
    }
}

impl io::Read for Before<'_, '_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.free == 0 && !self.is_there {
            let window = self.stream.peek(2 * STRIDE)?;
            let searched = window.len().min(STRIDE);
            let found = (0..searched).find(|at| (self.is_wanted)(&window[*at..]));
            self.is_there = found.is_some();
            self.free = found.unwrap_or(searched);
        }
        let most = into.len().min(self.free);
        let read = self.stream.read(&mut into[..most])?;
        self.free -= read;
        Ok(read)
    }
}
