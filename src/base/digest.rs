//! Digests, base64 and compression, in the forms that a Content-Security-Policy, data inside a page and PDF need.

use sha2::{Digest as _, Sha256};

/// The source expression that allows exactly this script or style: `'sha256-…'`.
pub(crate) fn policy(text: &str) -> String {
    let mut out = String::from("'sha256-");
    base64(&mut out, &Sha256::digest(text.as_bytes()));
    out.push('\'');
    out
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex_of(bytes: &[u8]) -> String {
    let digit = |n: u8| char::from_digit(n.into(), 16).unwrap_or('0');
    let digits = bytes.iter().flat_map(|b| [digit(b >> 4), digit(b & 15)]);
    digits.collect()
}

/// The first `digits` hex digits of a text's digest, 64 at most.
pub(crate) fn hex(text: &str, digits: usize) -> String {
    let mut all = hex_of(&Sha256::digest(text.as_bytes()));
    all.truncate(digits);
    all
}

/// Bytes compressed as a zlib stream (RFC 1950): two bytes, DEFLATE, and a checksum of four bytes.
#[cfg(feature = "render")]
pub(crate) fn zlib(bytes: &[u8], level: u32) -> Vec<u8> {
    use std::io::Write as _;

    let mut all = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::new(level));
    // Writing to memory does not fail.
    let _ = all.write_all(bytes);
    all.finish().unwrap_or_default()
}

/// Appends `data` in base64 with padding (RFC 4648, section 4).
pub(crate) fn base64(out: &mut String, data: &[u8]) {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for chunk in data.chunks(3) {
        let byte = |at: usize| u32::from(chunk.get(at).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for at in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * at) & 63) as usize];
            out.push(if at <= chunk.len() {
                char::from(digit)
            } else {
                '='
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_policy_contains_the_digest() {
        // The digest of nothing, from FIPS 180-4's examples.
        assert_eq!(
            policy(""),
            "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='"
        );
    }

    #[test]
    fn hex_is_a_prefix_of_the_digest() {
        assert_eq!(hex("", 12), "e3b0c44298fc");
    }

    #[test]
    fn base64_pads() {
        let of = |data: &[u8]| {
            let mut out = String::new();
            base64(&mut out, data);
            out
        };
        assert_eq!([of(b"f"), of(b"fo"), of(b"foo")], ["Zg==", "Zm8=", "Zm9v"]);
    }
}
