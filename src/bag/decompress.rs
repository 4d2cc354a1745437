//! Decompression of bags as streams: output is read piece by piece, so no number in a file determines memory use.

use std::io::{self, Read};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use zstd::stream::raw::{DParameter, Decoder, InBuffer, Operation as _, OutBuffer};

use crate::base::budget::{UNPACKED, UNPACKED_FOLD};
use crate::base::words::worded;

worded! {
    /// A compression that a bag may name; its word is its name in JSON.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub(crate) enum Compression {
        /// Bytes as they are.
        None = "none",
        /// bzip2 (ROS 1).
        Bz2 = "bz2",
        /// LZ4 frames (ROS 1, MCAP).
        Lz4 = "lz4",
        /// Zstandard frames (MCAP, rosbag2).
        Zstd = "zstd",
    }
}

/// The longest header of a Zstandard frame, in bytes.
pub(crate) const ZSTD_HEAD: usize = 18;

/// The number of plain bytes that a Zstandard frame states in its header.
pub(crate) fn zstd_stated(frame: &[u8]) -> Option<u64> {
    zstd::zstd_safe::get_frame_content_size(frame)
        .ok()
        .flatten()
}

/// Zstandard frames decompressed piece by piece, by a caller that has the packed bytes.
pub(crate) struct ZstdPieces(Decoder<'static>);

impl ZstdPieces {
    pub(crate) fn new() -> io::Result<Self> {
        let mut decoder = Decoder::new()?;
        decoder.set_parameter(DParameter::WindowLogMax(LARGEST_WINDOW))?;
        Ok(Self(decoder))
    }

    /// Decompresses some of `from` into `to`; returns the number of bytes taken and written.
    ///
    /// # Errors
    /// If the data is damaged.
    pub(crate) fn run(&mut self, from: &[u8], to: &mut [u8]) -> io::Result<(usize, usize)> {
        let (mut from, mut to) = (InBuffer::around(from), OutBuffer::around(to));
        self.0.run(&mut from, &mut to)?;
        Ok((from.pos(), to.pos()))
    }

    /// Forgets a frame, to begin another.
    pub(crate) fn begin(&mut self) -> io::Result<()> {
        self.0.reinit()
    }
}

impl Compression {
    /// The compression that a bag calls `name`; `None` for an unknown one.
    pub(crate) fn named(name: &[u8]) -> Option<Self> {
        match name {
            b"" => Some(Self::None),
            name => Self::from_word(std::str::from_utf8(name).ok()?),
        }
    }

    /// The cost of decompressing a byte, relative to the fastest compression. bzip2 takes that many times as long,
    /// even for zeros.
    fn cost(self) -> u64 {
        match self {
            Self::Bz2 => 16,
            Self::None | Self::Lz4 | Self::Zstd => 1,
        }
    }

    /// A reader of the unpacked content of `from`. Memory: at most 4 MiB per LZ4 block, 8 MiB per Zstandard window.
    ///
    /// # Errors
    /// Fails if a decompressor cannot be set up. Damaged data fails when it is read.
    pub(crate) fn reader<'a>(
        self,
        from: impl Read + Send + 'a,
    ) -> io::Result<Box<dyn Read + Send + 'a>> {
        Ok(match self {
            Self::None => Box::new(from),
            Self::Bz2 => Box::new(bzip2::read::MultiBzDecoder::new(from)),
            Self::Lz4 => lz4(from)?,
            Self::Zstd => {
                let mut decoder = zstd::Decoder::new(from)?;
                decoder.window_log_max(LARGEST_WINDOW)?;
                Box::new(decoder)
            }
        })
    }
}

/// The total amount that may be decompressed from one bag, so that a small file cannot keep a reader busy for
/// hours. Shared by threads; which of them first exhausts it on a decompression bomb is not deterministic.
#[derive(Debug, Default)]
pub(crate) struct Allowance {
    packed: AtomicU64,
    plain: AtomicU64,
}

impl Allowance {
    /// A reader of the unpacked content of `from`, which fails once the allowance is spent.
    ///
    /// # Errors
    /// As [`Compression::reader`].
    pub(crate) fn open<'a>(
        self: &Arc<Self>,
        how: Compression,
        from: impl Read + Send + 'a,
    ) -> io::Result<Box<dyn Read + Send + 'a>> {
        let packed = Counted {
            from,
            failed: None,
            allowance: Arc::clone(self),
            spends: None,
        };
        Ok(Box::new(Counted {
            from: how.reader(packed)?,
            failed: None,
            allowance: Arc::clone(self),
            spends: Some(how.cost()),
        }))
    }

    fn spend(&self, work: u64) -> io::Result<()> {
        let before = self.plain.fetch_add(work, Ordering::Relaxed);
        let packed = self.packed.load(Ordering::Relaxed);
        let most = packed.saturating_mul(UNPACKED_FOLD);
        if before.saturating_add(work) > most.saturating_add(UNPACKED) {
            return Err(io::Error::other(UNFOLDS));
        }
        Ok(())
    }
}

/// A reader that counts the bytes it reads, and ends with its first error.
struct Counted<R> {
    from: R,
    /// The error after which `from` is not read again: libbz2 would continue with a half-read table, and access memory
    /// outside it.
    failed: Option<io::ErrorKind>,
    allowance: Arc<Allowance>,
    /// What a byte costs of the allowance; `None` for compressed bytes, which increase it.
    spends: Option<u64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if let Some(kind) = self.failed {
            return Err(kind.into());
        }
        let n = self.from.read(into).inspect_err(|error| {
            // An interrupted read is simply repeated.
            self.failed = Some(error.kind()).filter(|kind| *kind != io::ErrorKind::Interrupted);
        })?;
        match self.spends {
            Some(cost) => self.allowance.spend(cost * n as u64)?,
            None => drop(self.allowance.packed.fetch_add(n as u64, Ordering::Relaxed)),
        }
        Ok(n)
    }
}

/// The error for a bag that spent its [`Allowance`].
const UNFOLDS: &str = "the bag decompresses to far more than its size";

/// The largest window that a Zstandard frame may require, as a power of two: 8 MiB, which every decoder must support.
const LARGEST_WINDOW: u32 = 23;

#[cfg(feature = "sqlite")]
/// The content of one Zstandard frame, at most `limit` bytes, such as a payload that rosbag2 compressed individually.
/// `None` if it is damaged or larger.
pub(crate) fn zstd_payload(
    bytes: &[u8],
    limit: usize,
    allowance: &Arc<Allowance>,
) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let reader = allowance.open(Compression::Zstd, bytes).ok()?;
    let most = u64::try_from(limit).ok()?.saturating_add(1);
    reader.take(most).read_to_end(&mut out).ok()?;
    (out.len() <= limit).then_some(out)
}

/// LZ4 frames of independent blocks, as ROS writes them, are decompressed block by block: without the content
/// checksum that takes two thirds of the time. All others go through the crate's decoder.
fn lz4<'a>(mut from: impl Read + Send + 'a) -> io::Result<Box<dyn Read + Send + 'a>> {
    let mut head = Vec::new();
    from.by_ref().take(6).read_to_end(&mut head)?;
    let plain = head.starts_with(b"\x04\x22\x4d\x18") && head.len() == 6;
    // Version 1, independent blocks, no dictionary.
    if plain && head[4] & 0b1110_0001 == 0b0110_0000 {
        let largest = match head[5] >> 4 & 7 {
            4 => 64 << 10,
            5 => 256 << 10,
            6 => 1 << 20,
            _ => 4 << 20,
        };
        // The content size, if present, and a checksum of the head.
        let rest = if head[4] & 0b1000 == 0 { 1 } else { 9 };
        io::copy(&mut from.by_ref().take(rest), &mut io::sink())?;
        return Ok(Box::new(Blocks {
            from,
            checksums: head[4] & 0b1_0000 != 0,
            is_summed: head[4] & 0b100 != 0,
            packed: Vec::new(),
            plain: vec![0; largest],
            ready: 0..0,
            ended: false,
        }));
    }
    let whole = io::Cursor::new(head).chain(from);
    Ok(Box::new(lz4_flex::frame::FrameDecoder::new(whole)))
}

/// The independent blocks of one LZ4 frame.
struct Blocks<R> {
    from: R,
    /// Whether each block is followed by a checksum, which is ignored.
    checksums: bool,
    /// Whether a checksum of the content follows the last block, which is ignored too.
    is_summed: bool,
    packed: Vec<u8>,
    plain: Vec<u8>,
    /// The part of `plain` that has not been read yet.
    ready: Range<usize>,
    ended: bool,
}

impl<R: Read> Blocks<R> {
    fn next(&mut self) -> io::Result<()> {
        let mut head = [0; 4];
        self.from.read_exact(&mut head)?;
        let head = u32::from_le_bytes(head);
        let (stored, len) = (head >> 31 == 1, (head & 0x7fff_ffff) as usize);
        self.ended = len == 0;
        if self.ended && self.is_summed {
            io::copy(&mut self.from.by_ref().take(4), &mut io::sink())?;
        }
        if len > self.plain.len() {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                "an LZ4 block is too long",
            ));
        }
        self.ready = 0..len;
        if stored {
            self.from.read_exact(&mut self.plain[..len])?;
        } else if !self.ended {
            self.packed.resize(len, 0);
            self.from.read_exact(&mut self.packed)?;
            let n = lz4_flex::block::decompress_into(&self.packed, &mut self.plain);
            self.ready = 0..n.map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))?;
        }
        if self.checksums && !self.ended {
            self.from.read_exact(&mut [0; 4])?;
        }
        Ok(())
    }
}

impl<R: Read> Read for Blocks<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while self.ready.is_empty() && !self.ended {
            self.next()?;
        }
        let n = self.ready.len().min(into.len());
        into[..n].copy_from_slice(&self.plain[self.ready.start..self.ready.start + n]);
        self.ready.start += n;
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    fn packed(how: Compression, plain: &[u8]) -> Vec<u8> {
        match how {
            Compression::None => plain.to_vec(),
            Compression::Bz2 => {
                let mut to = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
                to.write_all(plain).unwrap();
                to.finish().unwrap()
            }
            Compression::Lz4 => {
                let mut to = lz4_flex::frame::FrameEncoder::new(Vec::new());
                to.write_all(plain).unwrap();
                to.finish().unwrap()
            }
            Compression::Zstd => zstd::encode_all(plain, 1).unwrap(),
        }
    }

    #[test]
    fn compressed_data_round_trips() {
        let plain: Vec<u8> = (0..3_000_000u32)
            .flat_map(|i| (i / 7).to_le_bytes())
            .collect();
        for how in [
            Compression::None,
            Compression::Bz2,
            Compression::Lz4,
            Compression::Zstd,
        ] {
            let packed = packed(how, &plain);
            let mut out = Vec::new();
            how.reader(&packed[..])
                .unwrap()
                .read_to_end(&mut out)
                .unwrap();
            assert!(out == plain, "{how:?}");
        }
    }

    #[test]
    fn every_kind_of_lz4_frame_round_trips() {
        use lz4_flex::frame::{BlockMode, BlockSize, FrameEncoder, FrameInfo};
        let plain: Vec<u8> = (0..500_000u64)
            .flat_map(|i| (i * i / 7).to_le_bytes())
            .collect();
        for mode in [BlockMode::Independent, BlockMode::Linked] {
            for size in [BlockSize::Max64KB, BlockSize::Max1MB, BlockSize::Max4MB] {
                for checks in [false, true] {
                    let info = FrameInfo::new().block_mode(mode).block_size(size);
                    let info = info.block_checksums(checks).content_checksum(checks);
                    let info = info.content_size(checks.then_some(plain.len() as u64));
                    let mut to = FrameEncoder::with_frame_info(info, Vec::new());
                    to.write_all(&plain).unwrap();
                    let packed = to.finish().unwrap();
                    let mut out = Vec::new();
                    let mut reader = Compression::Lz4.reader(&packed[..]).unwrap();
                    reader.read_to_end(&mut out).unwrap();
                    assert!(out == plain, "{mode:?} {size:?} {checks}");
                    let cut = Compression::Lz4
                        .reader(&packed[..packed.len() / 2])
                        .unwrap();
                    assert!(
                        io::copy(&mut { cut }, &mut io::sink()).is_err(),
                        "cut {mode:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn no_bytes_follow_an_error() {
        let plain: Vec<u8> = (0..20_000u32).flat_map(|i| (i / 7).to_le_bytes()).collect();
        for how in [Compression::Bz2, Compression::Lz4, Compression::Zstd] {
            let packed = packed(how, &plain);
            let mut failed = 0;
            for at in 0..packed.len() {
                let mut damaged = packed.clone();
                damaged[at] ^= 1 << (at % 8);
                let allowance: Arc<Allowance> = Arc::default();
                let Ok(mut reader) = allowance.open(how, &damaged[..]) else {
                    continue;
                };
                let Err(error) = io::copy(&mut reader, &mut io::sink()) else {
                    continue;
                };
                failed += 1;
                for _ in 0..20 {
                    let again = reader.read(&mut [0; 4096]).unwrap_err();
                    assert_eq!(again.kind(), error.kind(), "{how:?}, byte {at}");
                }
            }
            assert!(failed > 0, "{how:?}");
        }
    }

    #[test]
    fn a_payload_larger_than_its_limit_is_refused() {
        let bomb = packed(Compression::Zstd, &vec![0; 1 << 24]);
        let payload = |bytes, limit| zstd_payload(bytes, limit, &Arc::default());
        assert_eq!(payload(&bomb, 1 << 20), None);
        assert_eq!(payload(&bomb, 1 << 24).map(|b| b.len()), Some(1 << 24));
        assert_eq!(payload(b"not a frame", 100), None);
    }
}
