//! CRC-32 checksums: of bytes as they are read, and of bytes after a part with a known checksum.

use std::io::{self, Read};

/// A running checksum.
#[derive(Clone, Default)]
pub(crate) struct Checksum(crc32fast::Hasher);

impl Checksum {
    /// The sum of bytes of which `crc` is the CRC-32.
    pub(crate) fn of(crc: u32) -> Self {
        Self(crc32fast::Hasher::new_with_initial(crc))
    }

    /// Adds these bytes.
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The CRC-32 of all bytes so far.
    pub(crate) fn crc(&self) -> u32 {
        self.0.clone().finalize()
    }
}

/// A reader that computes the checksum of the bytes it reads.
pub(crate) struct CrcReader<R> {
    from: R,
    sum: Checksum,
    is_at_end: bool,
}

impl<R> CrcReader<R> {
    pub(crate) fn new(from: R) -> Self {
        Self {
            from,
            sum: Checksum::default(),
            is_at_end: false,
        }
    }

    /// The CRC-32 of all bytes; `None` before the end is reached.
    pub(crate) fn sum(&self) -> Option<u32> {
        self.is_at_end.then(|| self.sum.crc())
    }
}

impl<R: Read> Read for CrcReader<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let n = self.from.read(into)?;
        self.sum.add(&into[..n]);
        self.is_at_end = n == 0;
        Ok(n)
    }
}
