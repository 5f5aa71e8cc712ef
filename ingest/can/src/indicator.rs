//! Values of SAE J1939 that are not numbers: the highest of every length.

/// What such a value says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Indicator {
    NotAvailable,
    /// Also what is reserved or specific to the parameter.
    Error,
}

/// What an unsigned value of so many bits says, if it is not a number (J1939-71, table 1): of a byte 255 is "not
/// available", 254 "error" and 251 to 253 reserved; the high byte of 2, 3 and 4 bytes likewise. Of shorter fields the
/// highest value is "not available" and the one below it "error"; a single bit is a number.
#[inline]
pub(crate) fn indicator(raw: u64, bit_count: u32) -> Option<Indicator> {
    if matches!(bit_count, 8 | 12 | 16 | 24 | 32 | 64) {
        return match raw >> (bit_count - 8) {
            255 => Some(Indicator::NotAvailable),
            251..=254 => Some(Indicator::Error),
            _ => None,
        };
    }
    let highest = u64::MAX >> (64 - bit_count.clamp(1, 64));
    match highest - raw.min(highest) {
        0 if bit_count > 1 => Some(Indicator::NotAvailable),
        1 if bit_count > 1 => Some(Indicator::Error),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_highest_values_are_not_numbers() {
        use Indicator::{Error, NotAvailable};
        let cases = [
            (0xfa, 8, None),
            (0xfb, 8, Some(Error)),
            (0xff, 8, Some(NotAvailable)),
            (0xfaff, 16, None),
            (0xfe00, 16, Some(Error)),
            (0xff00, 16, Some(NotAvailable)),
            (0xfaffff, 24, None),
            (0xfeffff, 24, Some(Error)),
            (0xfb00_0000, 32, Some(Error)),
            (1, 1, None),
            (1, 2, None),
            (2, 2, Some(Error)),
            (3, 2, Some(NotAvailable)),
            (14, 4, Some(Error)),
            (0x3fd, 10, None),
            (0x3ff, 10, Some(NotAvailable)),
        ];
        for (raw, bits, expected) in cases {
            assert_eq!(indicator(raw, bits), expected, "{raw:x} of {bits} bits");
        }
    }
}
