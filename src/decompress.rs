//! The compressions of bags as streams: what comes out is read piece by piece, so no number in a file sizes memory.

use std::io::{self, Read};

/// A compression that a bag may name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Compression {
    /// Bytes as they are.
    None,
    /// bzip2 (ROS 1).
    Bz2,
    /// LZ4 frames (ROS 1, MCAP).
    Lz4,
    /// Zstandard frames (MCAP, rosbag2).
    Zstd,
}

impl Compression {
    /// The compression that a bag calls `name`; `None` for one that we do not know.
    pub(crate) fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"" | b"none" => Self::None,
            b"bz2" => Self::Bz2,
            b"lz4" => Self::Lz4,
            b"zstd" => Self::Zstd,
            _ => return None,
        })
    }

    /// Its word in JSON.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Bz2 => "bz2",
            Self::Lz4 => "lz4",
            Self::Zstd => "zstd",
        }
    }

    /// A reader of what `from` holds compressed. Memory: at most 4 MiB per LZ4 block, 8 MiB per Zstandard window.
    ///
    /// # Errors
    /// Where a decompressor cannot be set up. Damage in the data shows when it is read.
    pub(crate) fn reader<'a>(
        self,
        from: impl Read + Send + 'a,
    ) -> io::Result<Box<dyn Read + Send + 'a>> {
        Ok(match self {
            Self::None => Box::new(from),
            Self::Bz2 => Box::new(bzip2::read::MultiBzDecoder::new(from)),
            Self::Lz4 => Box::new(lz4_flex::frame::FrameDecoder::new(from)),
            Self::Zstd => {
                let mut decoder = zstd::Decoder::new(from)?;
                decoder.window_log_max(LARGEST_WINDOW)?;
                Box::new(decoder)
            }
        })
    }
}

/// The largest look-back that a Zstandard frame may ask for, as a power of two: 8 MiB, what every decoder must offer.
const LARGEST_WINDOW: u32 = 23;

/// The whole of one Zstandard frame of at most `limit` bytes, such as a payload that rosbag2 compressed by itself.
/// `None` if it is damaged or larger.
pub(crate) fn zstd_payload(bytes: &[u8], limit: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let reader = Compression::Zstd.reader(bytes).ok()?;
    let most = u64::try_from(limit).ok()?.saturating_add(1);
    reader.take(most).read_to_end(&mut out).ok()?;
    (out.len() <= limit).then_some(out)
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
    fn what_was_packed_comes_out_again() {
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
    fn a_payload_larger_than_its_limit_is_refused() {
        let bomb = packed(Compression::Zstd, &vec![0; 1 << 24]);
        assert_eq!(zstd_payload(&bomb, 1 << 20), None);
        assert_eq!(zstd_payload(&bomb, 1 << 24).map(|b| b.len()), Some(1 << 24));
        assert_eq!(zstd_payload(b"not a frame", 100), None);
    }
}
