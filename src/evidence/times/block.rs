//! A sorted run of stamps as bytes: differences as variable-length numbers, then the sizes.

use crate::base::time::Stamp;

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
pub(super) fn decode(bytes: &[u8], count: usize) -> Vec<(Stamp, u32)> {
    let mut at = 0;
    let mut before = 0_i64;
    let mut run = Vec::with_capacity(count);
    for _ in 0..count {
        before = before.wrapping_add(take(bytes, &mut at).cast_signed());
        run.push((Stamp(before), 0));
    }
    if at < bytes.len() {
        for (_, size) in &mut run {
            *size = u32::try_from(take(bytes, &mut at)).unwrap_or(u32::MAX);
        }
    }
    run
}

/// Seven bits per byte, least significant first, the top bit set on all but the last.
fn put(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push((number & 0x7f) as u8 | 0x80);
        number >>= 7;
    }
    bytes.push((number & 0x7f) as u8);
}

fn take(bytes: &[u8], at: &mut usize) -> u64 {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let Some(byte) = bytes.get(*at) else { break };
        *at += 1;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            break;
        }
    }
    number
}
