//! A cursor over serialised payloads, ROS 1 and CDR: numbers, strings and sequences, never past the end.
//!
//! ROS 1 is little-endian and packed (<http://wiki.ros.org/msg>); CDR aligns each number to its own size, counted
//! after the encapsulation header (OMG DDSI-RTPS 2.5, section 10).

use std::fmt;

use crate::bag::Encoding;
use crate::base::time::Stamp;

/// The error for a payload without the expected content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Malformed {
    /// The position, in bytes from the payload's start.
    pub at: usize,
    /// The expected content.
    pub expected: &'static str,
}

impl fmt::Display for Malformed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {} at byte {}", self.expected, self.at)
    }
}

/// The result of every reading function.
pub(crate) type PayloadResult<T> = std::result::Result<T, Malformed>;

/// The encoding that a payload's encapsulation header states, if it is another one than plain CDR (OMG DDS-XTypes 1.3, 7.6.3.1.2;
/// the numbers of XCDR2 are those of DDSI-RTPS 2.5, 10.2).
pub(crate) fn other_cdr(data: &[u8]) -> Option<&'static str> {
    match data {
        [0, 2 | 3, ..] => Some("a parameter list (PL_CDR)"),
        [0, 6..=0xb | 0x10..=0x15, ..] => Some("XCDR2"),
        _ => None,
    }
}

/// A position in a payload.
#[derive(Clone, Debug)]
pub(crate) struct PayloadCursor<'a> {
    data: &'a [u8],
    at: usize,
    /// The origin of alignment; `None` if nothing is aligned (ROS 1).
    origin: Option<usize>,
    big_endian: bool,
    /// Whether headers begin with a sequence number.
    is_numbered: bool,
}

/// The content of a `std_msgs/Header`.
#[derive(Clone, Copy)]
pub(crate) struct Header {
    /// The sequence number, which ROS 2 has left out.
    pub(crate) number: Option<u32>,
    pub(crate) stamp: Stamp,
}

impl<'a> PayloadCursor<'a> {
    /// A cursor at the start of a payload.
    ///
    /// # Errors
    /// For an encoding that is neither ROS 1 nor plain CDR (XCDR1).
    pub(crate) fn new(encoding: &Encoding, data: &'a [u8]) -> PayloadResult<Self> {
        match encoding {
            Encoding::Ros1 => Ok(Self::ros1(data)),
            Encoding::Cdr => Self::cdr(data),
            Encoding::Other(_) => Err(Malformed {
                at: 0,
                expected: "ROS 1 or CDR encoding",
            }),
        }
    }

    /// A cursor over a ROS 1 payload.
    pub(crate) fn ros1(data: &'a [u8]) -> Self {
        Self {
            data,
            at: 0,
            origin: None,
            big_endian: false,
            is_numbered: true,
        }
    }

    /// A cursor over a CDR payload, after its encapsulation header.
    ///
    /// # Errors
    /// Unless the header states plain CDR, of either byte order.
    pub(crate) fn cdr(data: &'a [u8]) -> PayloadResult<Self> {
        match data {
            [0, kind @ (0 | 1), _, _, ..] => Ok(Self {
                data,
                at: 4,
                origin: Some(4),
                big_endian: *kind == 0,
                is_numbered: false,
            }),
            _ => Err(Malformed {
                at: 0,
                expected: "a plain CDR header",
            }),
        }
    }

    /// The same cursor, over a message whose headers begin with a sequence number or not, if that is not as usual in its
    /// encoding.
    pub(crate) fn numbered(self, is_numbered: bool) -> Self {
        Self {
            is_numbered,
            ..self
        }
    }

    /// Whether this is CDR.
    pub(crate) fn is_cdr(&self) -> bool {
        self.origin.is_some()
    }

    /// The number of bytes left.
    pub(crate) fn remaining(&self) -> usize {
        self.data.len() - self.at
    }

    /// Checks that nothing is left; CDR may be padded by up to three bytes.
    ///
    /// # Errors
    /// If more is left.
    pub(crate) fn finish(&self) -> PayloadResult<()> {
        let allowed = if self.is_cdr() { 3 } else { 0 };
        if self.remaining() > allowed {
            return Err(self.wrong("the end"));
        }
        Ok(())
    }

    /// The error for `expected` at this position.
    pub(crate) fn wrong(&self, expected: &'static str) -> Malformed {
        Malformed {
            at: self.at,
            expected,
        }
    }

    /// The next `len` bytes.
    pub(crate) fn bytes(&mut self, len: usize) -> PayloadResult<&'a [u8]> {
        let end = self.at.checked_add(len);
        let part = end.and_then(|end| self.data.get(self.at..end));
        let part = part.ok_or(self.wrong("more bytes"))?;
        self.at += len;
        Ok(part)
    }

    /// Skips the bytes before the next number of `size` bytes, in CDR.
    fn align(&mut self, size: usize) -> PayloadResult<()> {
        let over = self
            .origin
            .map_or(0, |origin| (self.at - origin) % size.max(1));
        self.bytes(if over == 0 { 0 } else { size - over })
            .map(drop)
    }

    /// The next `N` bytes, aligned to `N` in CDR, least significant first.
    fn number<const N: usize>(&mut self) -> PayloadResult<[u8; N]> {
        self.align(N)?;
        let mut number = [0; N];
        number.copy_from_slice(self.bytes(N)?);
        if self.big_endian {
            number.reverse();
        }
        Ok(number)
    }

    /// The next byte.
    pub(crate) fn u8(&mut self) -> PayloadResult<u8> {
        self.number().map(u8::from_le_bytes)
    }

    /// The next 16 bits.
    pub(crate) fn u16(&mut self) -> PayloadResult<u16> {
        self.number().map(u16::from_le_bytes)
    }

    /// The next 32 bits.
    pub(crate) fn u32(&mut self) -> PayloadResult<u32> {
        self.number().map(u32::from_le_bytes)
    }

    /// The next 32 bits, signed.
    pub(crate) fn i32(&mut self) -> PayloadResult<i32> {
        self.number().map(i32::from_le_bytes)
    }

    /// The next 64 bits.
    pub(crate) fn u64(&mut self) -> PayloadResult<u64> {
        self.number().map(u64::from_le_bytes)
    }

    /// The next 64 bits, signed.
    pub(crate) fn i64(&mut self) -> PayloadResult<i64> {
        self.number().map(i64::from_le_bytes)
    }

    /// The next 64 bits as a floating point number.
    pub(crate) fn f64(&mut self) -> PayloadResult<f64> {
        self.number().map(f64::from_le_bytes)
    }

    /// The next time: seconds and nanoseconds of 32 bits each.
    pub(crate) fn time(&mut self) -> PayloadResult<Stamp> {
        Ok(Stamp::from_ros(self.u32()?, self.u32()?))
    }

    /// The next duration in nanoseconds: seconds and nanoseconds of 32 bits each, of either sign.
    pub(crate) fn duration(&mut self) -> PayloadResult<i64> {
        let (seconds, nanos) = (i64::from(self.i32()?), i64::from(self.i32()?));
        Ok(seconds * 1_000_000_000 + nanos)
    }

    /// The next `count` numbers of `size` bytes each as they are written, aligned in CDR.
    pub(crate) fn numbers(&mut self, count: usize, size: usize) -> PayloadResult<&'a [u8]> {
        if count > 0 {
            self.align(size)?;
        }
        self.bytes(count.saturating_mul(size))
    }

    /// Whether numbers are big-endian.
    pub(crate) fn is_big_endian(&self) -> bool {
        self.big_endian
    }

    /// The next string; invalid UTF-8 is an error.
    pub(crate) fn string(&mut self) -> PayloadResult<&'a str> {
        let text = self.text()?;
        std::str::from_utf8(text).map_err(|_| self.wrong("text in UTF-8"))
    }

    /// The bytes of the next string, unchecked.
    pub(crate) fn text(&mut self) -> PayloadResult<&'a [u8]> {
        let len = self.u32()? as usize;
        let text = self.bytes(len)?;
        match text {
            _ if !self.is_cdr() => Ok(text),
            [rest @ .., 0] => Ok(rest),
            // Some writers omit the final zero of an empty string.
            [] => Ok(text),
            _ => Err(self.wrong("a string's closing zero")),
        }
    }

    /// Skips the next string without checking its bytes.
    pub(crate) fn skip_string(&mut self) -> PayloadResult<()> {
        let len = self.u32()? as usize;
        self.bytes(len).map(drop)
    }

    /// The length of the next sequence, whose elements take at least `least` bytes each.
    pub(crate) fn length(&mut self, least: usize) -> PayloadResult<usize> {
        let count = self.u32()? as usize;
        if count.saturating_mul(least) > self.remaining() {
            return Err(self.wrong("as many elements as the sequence announces"));
        }
        Ok(count)
    }

    /// The next header.
    pub(crate) fn header(&mut self) -> PayloadResult<Header> {
        let header = self.header_start()?;
        self.skip_string()?;
        Ok(header)
    }

    /// The next header up to its stamp.
    pub(crate) fn header_start(&mut self) -> PayloadResult<Header> {
        let number = self.is_numbered.then(|| self.u32()).transpose()?;
        let stamp = self.time()?;
        Ok(Header { number, stamp })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ros1_is_packed() {
        let data = [7, 1, 0, 0, 0, 2, 0, 0, 0, b'h', b'i'];
        let mut cursor = PayloadCursor::ros1(&data);
        assert_eq!((cursor.u8(), cursor.u32()), (Ok(7), Ok(1)));
        assert_eq!(cursor.string(), Ok("hi"));
        assert_eq!(cursor.finish(), Ok(()));
    }

    #[test]
    fn cdr_is_aligned_in_either_byte_order() {
        let little = [0, 1, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0];
        let big = [0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 1];
        for data in [little, big] {
            let mut cursor = PayloadCursor::cdr(&data).unwrap();
            assert_eq!((cursor.u8(), cursor.u32()), (Ok(7), Ok(1)));
        }
    }

    #[test]
    fn nothing_is_read_past_the_end() {
        let mut cursor = PayloadCursor::ros1(&[255, 255, 255, 255, 1]);
        assert!(cursor.clone().string().is_err());
        assert!(cursor.clone().length(1).is_err());
        assert!(cursor.u64().is_err());
        assert!(PayloadCursor::cdr(&[0, 7, 0, 0]).is_err());
    }

    #[test]
    fn a_cdr_string_ends_with_a_zero() {
        let with = |last| [0, 1, 0, 0, 2, 0, 0, 0, b'a', last];
        assert_eq!(PayloadCursor::cdr(&with(0)).unwrap().string(), Ok("a"));
        assert!(PayloadCursor::cdr(&with(b'b')).unwrap().string().is_err());
    }
}
