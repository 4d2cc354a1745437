//! Whole numbers as bytes: seven bits per byte, least significant first, the top bit set on all but the last (LEB128).

/// Appends a number.
pub(crate) fn put(bytes: &mut Vec<u8>, number: impl Into<u128>) {
    let mut number = number.into();
    while number >= 0x80 {
        bytes.push((number & 0x7f) as u8 | 0x80);
        number >>= 7;
    }
    bytes.push((number & 0x7f) as u8);
}

/// Takes a number of up to 64 bits from the front; 0 if it is larger, or if there are no more bytes.
pub(crate) fn take_u64(bytes: &mut &[u8]) -> u64 {
    u64::try_from(take(bytes)).unwrap_or(0)
}

/// Takes a number from the front; 0 if there are no more bytes.
pub(crate) fn take(bytes: &mut &[u8]) -> u128 {
    let mut number = 0;
    for shift in (0..u128::BITS).step_by(7) {
        let Some((byte, rest)) = bytes.split_first() else {
            break;
        };
        *bytes = rest;
        number |= u128::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            break;
        }
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_back() {
        let numbers = [0, 1, 127, 128, 300, u128::from(u64::MAX), u128::MAX];
        let mut bytes = Vec::new();
        for number in numbers {
            put(&mut bytes, number);
        }
        let mut rest = &bytes[..];
        assert_eq!(numbers.map(|_| take(&mut rest)), numbers);
        assert_eq!((rest, take(&mut rest)), (&[][..], 0));
        assert_eq!(take(&mut &[0x80, 0x80][..]), 0);
        let mut rest = &bytes[..];
        let small = numbers.map(|number| u64::try_from(number).unwrap_or(0));
        assert_eq!(numbers.map(|_| take_u64(&mut rest)), small);
    }
}
