//! The records of a chunk, one after the other, with checks of the chunk's own numbers.

use std::io::Read;
use std::sync::Arc;

use super::Grammar;
use super::record::{ChunkHead, MessageHead, NoRecord, RecordHead, pass, walk};
use super::search::next_record;
use crate::bag::checksum::CrcReader;
use crate::bag::decompress::{Allowance, Compression};
use crate::bag::source::ByteStream;

/// The receiver of a chunk's records.
pub(super) trait Visitor<G: Grammar> {
    /// A message, whose payload is next in `stream`.
    fn message(&mut self, stream: &mut ByteStream<'_>, head: MessageHead) -> Result<(), NoRecord>;

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

/// Visits the records of the chunk whose body is next in `stream`, and goes to its end. Returns the problem
/// with them, if any.
///
/// # Errors
/// Fails if the file ends first or cannot be read. If a chunk is stated to exceed the file, the stream is then at the
/// end of its records.
pub(super) fn unpack<G: Grammar>(
    stream: &mut ByteStream<'_>,
    head: &ChunkHead,
    allowance: &Arc<Allowance>,
    visitor: &mut dyn Visitor<G>,
) -> Result<Option<String>, NoRecord> {
    let end = stream.position().saturating_add(head.packed);
    let found = match (head.how, head.crc) {
        (None, _) => Some("its compression is not supported".to_owned()),
        (Some(Compression::None), None) => match records(stream, end, visitor) {
            Err(NoRecord::Io(e)) => return Err(NoRecord::Io(e)),
            Err(stop) => Some(stop.to_string()),
            Ok(()) if head.packed != head.plain => Some(NOT_AS_LONG.to_owned()),
            Ok(()) => None,
        },
        (Some(how), _) => summed(stream, head, how, allowance, visitor),
    };
    // Zeros over the head of a small chunk leave an empty one, and its records behind it.
    let is_blank = head.packed == 0 && head.padding > 0;
    let found = found.or_else(|| is_blank.then(|| NOT_AS_LONG.to_owned()));
    let rest = end.saturating_sub(stream.position());
    // A chunk cut by the end of the file is reported once, as the cut.
    pass(stream, rest.saturating_add(head.padding))?;
    Ok(found)
}

const NOT_AS_LONG: &str = "its length is wrong";

/// Visits the records of a chunk that is compressed or has a checksum, which requires reading all of it.
fn summed<G: Grammar>(
    stream: &mut ByteStream<'_>,
    head: &ChunkHead,
    how: Compression,
    allowance: &Arc<Allowance>,
    visitor: &mut dyn Visitor<G>,
) -> Option<String> {
    let from = stream.by_ref().take(head.packed);
    let mut from = match allowance.open(how, from) {
        Ok(from) => from,
        Err(e) => return Some(e.to_string()),
    };
    let mut sum = None;
    let (result, len) = if head.crc.is_some() {
        let mut from = CrcReader::new(from);
        let result = all_records(&mut from, visitor);
        sum = from.sum();
        result
    } else {
        all_records(&mut from, visitor)
    };
    match result {
        Err(stop) => Some(stop.to_string()),
        Ok(()) if sum != head.crc => Some("its checksum is wrong".to_owned()),
        Ok(()) if len != head.plain => Some(NOT_AS_LONG.to_owned()),
        Ok(()) => None,
    }
}

/// Visits all records in `from`, and returns the number of bytes.
fn all_records<G: Grammar>(
    from: &mut (impl Read + Send),
    visitor: &mut dyn Visitor<G>,
) -> (Result<(), NoRecord>, u64) {
    let mut plain = ByteStream::of_reader(from);
    let result = records(&mut plain, u64::MAX, visitor);
    (result, plain.position())
}

/// Visits the records of a chunk up to position `end` of `stream`, or to its end.
///
/// # Errors
/// The reason why they end earlier. Records that do not belong in a chunk are skipped and reported at the end.
pub(super) fn records<G: Grammar>(
    stream: &mut ByteStream<'_>,
    end: u64,
    visitor: &mut dyn Visitor<G>,
) -> Result<(), NoRecord> {
    let mut is_odd = false;
    let stop = walk(stream, end, |stream| {
        let from = stream.position();
        let step = G::next(stream).and_then(|record| {
            let is_open = end == u64::MAX;
            let left = end.saturating_sub(stream.position());
            if record.len() > left || is_open && !stream.has(record.len())? {
                // A length that exceeds the chunk is invalid.
                return Err(NoRecord::Broken);
            }
            match record {
                RecordHead::Message(head) => visitor.message(stream, head),
                RecordHead::Description { what, len } => visitor.description(stream, &what, len),
                odd => {
                    is_odd = true;
                    pass(stream, odd.len())
                }
            }
        });
        let is_broken = matches!(step, Err(NoRecord::Broken));
        if is_broken && next_record::<G>(stream, from, end) {
            is_odd = true;
            return Ok(());
        }
        step
    });
    match stop {
        NoRecord::End if is_odd => Err(NoRecord::Broken),
        NoRecord::End => Ok(()),
        stop => Err(stop),
    }
}
