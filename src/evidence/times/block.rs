//! A sorted run of stamps as bytes: differences as variable-length numbers, then the sizes.

use crate::base::time::Stamp;
use crate::base::varint::{put, take_u64};

/// Writes sorted stamps with their sizes.
pub(super) fn encode(run: &[(Stamp, u32)]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(run.len() * 6);
    let mut before = 0_i64;
    for (stamp, _) in run {
        // Wraps around on purpose: any two stamps differ by less than 2^64.
        put(&mut bytes, stamp.0.wrapping_sub(before).cast_unsigned());
        before = stamp.0;
    }
    if run.iter().any(|(_, size)| *size != 0) {
        for (_, size) in run {
            put(&mut bytes, u64::from(*size));
        }
    }
    bytes
}

/// Reads `count` stamps back; sizes are 0 if none were written.
pub(super) fn decode(mut bytes: &[u8], count: usize) -> Vec<(Stamp, u32)> {
    let mut before = 0_i64;
    let mut run = Vec::with_capacity(count);
    for _ in 0..count {
        before = before.wrapping_add(take_u64(&mut bytes).cast_signed());
        run.push((Stamp(before), 0));
    }
    if !bytes.is_empty() {
        for (_, size) in &mut run {
            *size = u32::try_from(take_u64(&mut bytes)).unwrap_or(u32::MAX);
        }
    }
    run
}
