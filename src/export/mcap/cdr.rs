//! Writes payloads in CDR (OMG DDSI-RTPS 2.5, section 10): little-endian, each number aligned to its size.

use crate::base::time::Stamp;

/// The number of header bytes, which do not count for alignment.
const HEAD: usize = 4;

/// A payload in progress.
pub(super) struct CdrWriter(Vec<u8>);

impl CdrWriter {
    pub(super) fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.0.push(value);
    }

    pub(super) fn u32(&mut self, value: u32) {
        let over = (self.0.len() - HEAD) % 4;
        self.0.resize(self.0.len() + (4 - over) % 4, 0);
        self.0.extend(value.to_le_bytes());
    }

    /// The number of elements that follow.
    pub(super) fn count(&mut self, many: usize) {
        self.u32(u32::try_from(many).unwrap_or(u32::MAX));
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend(bytes);
    }

    /// A string; a zero byte in it ends it early.
    pub(super) fn text(&mut self, text: &str) {
        let text = text.split('\0').next().unwrap_or_default();
        self.count(text.len() + 1);
        self.bytes(text.as_bytes());
        self.u8(0);
    }

    /// `builtin_interfaces/Time`; seconds saturate at 32 bits.
    pub(super) fn time(&mut self, time: Stamp) {
        const SECOND: i64 = 1_000_000_000;
        self.u32(u32::try_from(time.0.div_euclid(SECOND)).unwrap_or(u32::MAX));
        self.u32(u32::try_from(time.0.rem_euclid(SECOND)).unwrap_or(0));
    }

    pub(super) fn done(self) -> Vec<u8> {
        self.0
    }
}
