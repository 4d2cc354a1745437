//! An MCAP file read a second time by an independent reader, the crate `mcap`, with all checksums.

use std::io::{self, Read as _};

use mcap::records::{Record, op};
use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult, parse_record};

use super::{Described, Mcap, records};
use crate::bag::chunked::{Grammar as _, NoRecord, SecondFinds, pass, walk};
use crate::bag::decompress::{Compression, ZstdPieces};
use crate::bag::model::Sink;
use crate::bag::source::{ByteStream, FAR, FileSource};
use crate::base::time::Stamp;

/// The longest record that is parsed, in bytes.
const LONGEST_RECORD: usize = 256 << 20;

/// Reports everything that the crate finds to `sink`.
///
/// # Errors
/// The reason why it did not reach the end: a wrong checksum, a cut, or another violation of the format.
pub(super) fn read(source: &FileSource, sink: &mut dyn Sink) -> Result<(), String> {
    bound(source)?;
    let mut from = ByteStream::of_file(source, 0, source.len(), FAR);
    let options = LinearReaderOptions::default()
        .with_validate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_record_length_limit(LONGEST_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let zstd = ZstdPieces::new().map_err(|e| e.to_string())?;
    reader.add_decompressor(zstd).map_err(|e| e.to_string())?;
    let mut found = SecondFinds::new(sink);
    let result = records_of(&mut reader, &mut from, &mut found);
    found.flush();
    result
}

/// Walks the plain chunks as the crate will, and rejects a file that would make it underflow: it subtracts a record's
/// length, head included, from what is left of the chunk before it compares them.
fn bound(source: &FileSource) -> Result<(), String> {
    let mut stream = ByteStream::of_file(source, 0, source.len(), FAR);
    Mcap::begin(&mut stream);
    let mut refused = None;
    walk(&mut stream, u64::MAX, |stream| {
        let (kind, len) = records::head(stream)?;
        let end = stream.position().saturating_add(len);
        if kind == op::CHUNK {
            refused = bound_chunk(stream, len).err();
        }
        if refused.is_some() {
            return Err(NoRecord::Broken);
        }
        pass(stream, end.saturating_sub(stream.position()))
    });
    refused.map_or(Ok(()), Err)
}

fn bound_chunk(stream: &mut ByteStream<'_>, len: u64) -> Result<(), String> {
    let head = records::chunk(stream, len).map_err(|stop| format!("a chunk's head: {stop}"))?;
    if head.how != Some(Compression::None) {
        return Ok(());
    }
    let end = stream.position() + head.packed;
    let stop = walk(stream, end, |stream| {
        let (_, len) = records::head(stream)?;
        match end.checked_sub(stream.position()) {
            Some(left) if len <= left => pass(stream, len),
            _ => Err(NoRecord::Broken),
        }
    });
    match stop {
        NoRecord::End => Ok(()),
        stop => Err(format!("a record is longer than its chunk: {stop}")),
    }
}

fn records_of(
    reader: &mut LinearReader,
    from: &mut ByteStream<'_>,
    found: &mut SecondFinds<'_, Mcap>,
) -> Result<(), String> {
    while let Some(event) = reader.next_event() {
        match event.map_err(|e| e.to_string())? {
            LinearReadEvent::ReadRequest(n) => {
                // Memory grows with the bytes received, not with the bytes requested.
                let got = from.read(reader.insert(n.min(1 << 20)));
                reader.notify_read(got.map_err(|e| e.to_string())?);
            }
            LinearReadEvent::Record { data, opcode } => record(opcode, data, found)?,
        }
    }
    Ok(())
}

fn record(kind: u8, data: &[u8], found: &mut SecondFinds<'_, Mcap>) -> Result<(), String> {
    match kind {
        op::SCHEMA => found.describe(&Described::Schema, data),
        op::CHANNEL => found.describe(&Described::Channel, data),
        op::MESSAGE => {
            let record = parse_record(kind, data).map_err(|e| e.to_string())?;
            if let Record::Message { header, data } = record {
                let time = Stamp::from_nanos(header.log_time);
                found.message(u32::from(header.channel_id), time, &data);
            }
        }
        _ => {}
    }
    Ok(())
}

/// The crate's own decompressor would compile everything that the C library offers.
impl Decompressor for ZstdPieces {
    fn next_read_size(&self) -> usize {
        0
    }

    fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
        let (consumed, wrote) = self.run(src, dst).map_err(|e| failed(&e))?;
        Ok(DecompressResult { consumed, wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        self.begin().map_err(|e| failed(&e))
    }

    fn name(&self) -> &'static str {
        "zstd"
    }
}

fn failed(error: &io::Error) -> McapError {
    McapError::DecompressionError(error.to_string())
}
