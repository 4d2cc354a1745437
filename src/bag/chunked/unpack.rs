//! A chunk opened: its records, one after the other, and whether they are what the chunk says.

use std::io::{self, Read};
use std::sync::{Arc, OnceLock};

use super::Grammar;
use super::record::{ChunkHead, Record, Stop, pass};
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::source::Stream;
use crate::base::time::Stamp;

/// What takes in the records of a chunk.
pub(super) trait Visitor<G: Grammar> {
    /// A message, whose payload `stream` stands at.
    fn message(&mut self, stream: &mut Stream<'_>, message: (u32, Stamp, u32)) -> Result<(), Stop>;

    /// A description, `len` bytes that `stream` stands at.
    fn description(
        &mut self,
        stream: &mut Stream<'_>,
        _what: &G::Description,
        len: u64,
    ) -> Result<(), Stop> {
        pass(stream, len)
    }
}

/// Hands over the records of the chunk whose body `stream` stands at, and goes to its end. Answers what is wrong with
/// them, if anything is.
///
/// # Errors
/// Where the file ends first or cannot be read on.
pub(super) fn unpack<G: Grammar>(
    stream: &mut Stream<'_>,
    head: &ChunkHead,
    allowance: &Arc<Allowance>,
    visitor: &mut dyn Visitor<G>,
) -> Result<Option<String>, Stop> {
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
        n if n < rest => Err(Stop::Cut),
        _ => found,
    }
}

/// The records of a chunk that stand in the file as they are. Nobody looks at their checksum: that would mean reading
/// every payload.
fn plain<G: Grammar>(
    stream: &mut Stream<'_>,
    end: u64,
    visitor: &mut dyn Visitor<G>,
) -> Result<Option<String>, Stop> {
    match records(stream, end, visitor) {
        Stop::End => Ok(None),
        Stop::Io(e) => Err(Stop::Io(e)),
        stop => Ok(Some(stop.to_string())),
    }
}

/// The records of a compressed chunk.
fn packed<G: Grammar>(
    stream: &mut Stream<'_>,
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
    let mut records_of = Stream::of_reader(Checked {
        from,
        hasher: head.crc.map(|_| crc32fast::Hasher::new()),
        at_end: &crc,
    });
    let stop = records(&mut records_of, u64::MAX, visitor);
    match stop {
        Stop::End if head.crc.is_some() && crc.get() != head.crc.as_ref() => {
            Some("its checksum is wrong".to_owned())
        }
        Stop::End if records_of.position() != head.plain => {
            Some("it is not as long as it says".to_owned())
        }
        Stop::End => None,
        stop => Some(stop.to_string()),
    }
}

/// The records up to where `stream` stands at `end`.
pub(super) fn records<G: Grammar>(
    stream: &mut Stream<'_>,
    end: u64,
    visitor: &mut dyn Visitor<G>,
) -> Stop {
    while stream.position() < end {
        let step = match G::next(stream) {
            Ok(record) => one(stream, end, record, visitor),
            Err(stop) => return stop,
        };
        if let Err(stop) = step {
            return stop;
        }
    }
    Stop::End
}

fn one<G: Grammar>(
    stream: &mut Stream<'_>,
    end: u64,
    record: Record<G::Description>,
    visitor: &mut dyn Visitor<G>,
) -> Result<(), Stop> {
    let left = end.saturating_sub(stream.position());
    match record {
        Record::Message { raw, time, size } if u64::from(size) <= left => {
            visitor.message(stream, (raw, time, size))
        }
        Record::Description { what, len } if len <= left => visitor.description(stream, &what, len),
        // A chunk in a chunk is none.
        Record::Chunk(head) if head.packed <= left => pass(stream, head.packed),
        Record::Index { len, .. }
        | Record::Total { len, .. }
        | Record::DataEnd { len }
        | Record::FileEnd { len }
        | Record::Other { len }
            if len <= left =>
        {
            pass(stream, len)
        }
        // A length that leaves the chunk is none.
        _ => Err(Stop::Broken),
    }
}

/// Sums up what is read.
struct Checked<'a, R> {
    from: R,
    hasher: Option<crc32fast::Hasher>,
    /// The sum, once everything has been read.
    at_end: &'a OnceLock<u32>,
}

impl<R: Read> Read for Checked<'_, R> {
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
