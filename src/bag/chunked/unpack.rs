//! The records of a chunk, one after the other, with checks of the chunk's own numbers.

use std::io::{self, Read};
use std::sync::{Arc, OnceLock};

use super::Grammar;
use super::record::{ChunkHead, NoRecord, RecordHead, pass};
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::source::ByteStream;
use crate::base::time::Stamp;

/// The receiver of a chunk's records.
pub(super) trait Visitor<G: Grammar> {
    /// A message, whose payload is next in `stream`.
    fn message(
        &mut self,
        stream: &mut ByteStream<'_>,
        message: (u32, Stamp, u32),
    ) -> Result<(), NoRecord>;

    /// A description, the next `len` bytes of `stream`.
    fn description(
        &mut self,
        stream: &mut ByteStream<'_>,
        _what: &G::Description,
        len: u64,
    ) -> Result<(), NoRecord> {
        pass(stream, len)
    }
}

/// Hands over the records of the chunk whose body is next in `stream`, and goes to its end. Returns what is wrong with
/// them, if anything.
///
/// # Errors
/// Fails where the file ends first or cannot be read on.
pub(super) fn unpack<G: Grammar>(
    stream: &mut ByteStream<'_>,
    head: &ChunkHead,
    allowance: &Arc<Allowance>,
    visitor: &mut dyn Visitor<G>,
) -> Result<Option<String>, NoRecord> {
    let end = stream.position().saturating_add(head.packed);
    let found = match head.how {
        None => Ok(Some(
            "it is compressed in a way that no reader knows".to_owned(),
        )),
        Some(Compression::None) => plain(stream, end, visitor),
        Some(how) => Ok(packed(stream, head, how, allowance, visitor)),
    };
    let rest = end
        .saturating_sub(stream.position())
        .saturating_add(head.padding);
    // A chunk cut by the end of the file is told once, as the cut.
    match stream.skip(rest)? {
        n if n < rest => Err(NoRecord::Cut),
        _ => found,
    }
}

/// Hands over the records of an uncompressed chunk. Their checksum is not verified: that would mean reading every
/// payload.
fn plain<G: Grammar>(
    stream: &mut ByteStream<'_>,
    end: u64,
    visitor: &mut dyn Visitor<G>,
) -> Result<Option<String>, NoRecord> {
    match records(stream, end, visitor) {
        NoRecord::End => Ok(None),
        NoRecord::Io(e) => Err(NoRecord::Io(e)),
        stop => Ok(Some(stop.to_string())),
    }
}

/// Hands over the records of a compressed chunk.
fn packed<G: Grammar>(
    stream: &mut ByteStream<'_>,
    head: &ChunkHead,
    how: Compression,
    allowance: &Arc<Allowance>,
    visitor: &mut dyn Visitor<G>,
) -> Option<String> {
    let crc = OnceLock::new();
    let from = stream.by_ref().take(head.packed);
    let from = match allowance.open(how, from) {
        Ok(from) => from,
        Err(e) => return Some(e.to_string()),
    };
    let mut records_of = ByteStream::of_reader(CrcReader {
        from,
        hasher: head.crc.map(|_| crc32fast::Hasher::new()),
        at_end: &crc,
    });
    let stop = records(&mut records_of, u64::MAX, visitor);
    match stop {
        NoRecord::End if head.crc.is_some() && crc.get() != head.crc.as_ref() => {
            Some("its checksum is wrong".to_owned())
        }
        NoRecord::End if records_of.position() != head.plain => {
            Some("it is not as long as it says".to_owned())
        }
        NoRecord::End => None,
        stop => Some(stop.to_string()),
    }
}

/// Hands over the records up to position `end` of `stream`.
pub(super) fn records<G: Grammar>(
    stream: &mut ByteStream<'_>,
    end: u64,
    visitor: &mut dyn Visitor<G>,
) -> NoRecord {
    while stream.position() < end {
        let step = match G::next(stream) {
            Ok(record) => one(stream, end, record, visitor),
            Err(stop) => return stop,
        };
        if let Err(stop) = step {
            return stop;
        }
    }
    NoRecord::End
}

fn one<G: Grammar>(
    stream: &mut ByteStream<'_>,
    end: u64,
    record: RecordHead<G::Description>,
    visitor: &mut dyn Visitor<G>,
) -> Result<(), NoRecord> {
    let left = end.saturating_sub(stream.position());
    match record {
        RecordHead::Message { raw, time, size } if u64::from(size) <= left => {
            visitor.message(stream, (raw, time, size))
        }
        RecordHead::Description { what, len } if len <= left => {
            visitor.description(stream, &what, len)
        }
        // A chunk in a chunk is none.
        RecordHead::Chunk(head) if head.packed <= left => pass(stream, head.packed),
        RecordHead::Index { len, .. }
        | RecordHead::Total { len, .. }
        | RecordHead::DataEnd { len }
        | RecordHead::FileEnd { len }
        | RecordHead::Other { len }
            if len <= left =>
        {
            pass(stream, len)
        }
        // A length that leaves the chunk is none.
        _ => Err(NoRecord::Broken),
    }
}

/// A reader that sums up the bytes it reads.
struct CrcReader<'a, R> {
    from: R,
    hasher: Option<crc32fast::Hasher>,
    /// The sum, set once everything has been read.
    at_end: &'a OnceLock<u32>,
}

impl<R: Read> Read for CrcReader<'_, R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let n = self.from.read(into)?;
        match &mut self.hasher {
            Some(hasher) if n > 0 => hasher.update(&into[..n]),
            Some(hasher) => drop(self.at_end.set(hasher.clone().finalize())),
            None => {}
        }
        Ok(n)
    }
}
