//! Numbers in bytes: little-endian fields of files, and signals of any length in the data of a frame.

/// A field of a file; `None` behind its end.
pub(crate) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(array_at(bytes, at)?))
}

/// A field of a file; `None` behind its end.
pub(crate) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(array_at(bytes, at)?))
}

/// A field of a file; `None` behind its end.
pub(crate) fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(array_at(bytes, at)?))
}

/// Some bytes; `None` behind the end.
pub(crate) fn array_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at.checked_add(N)?)?.first_chunk().copied()
}

/// The place of the first of some bytes.
pub(crate) fn find(bytes: &[u8], part: &[u8]) -> Option<usize> {
    bytes.windows(part.len()).position(|window| window == part)
}

/// Position of a number in the data of a frame: consecutive bytes, from the byte of lowest value to that of highest, and the bits
/// of these. Prepared once for every signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BitRange {
    /// The first of the bytes.
    first_byte: usize,
    /// Number of bytes, up to nine.
    byte_count: usize,
    /// Number of bits of the lowest byte below the number.
    shift: u32,
    /// Number of bits, up to 64.
    pub(crate) bit_count: u32,
    is_big_endian: bool,
}

impl BitRange {
    /// A number whose lowest bit is `start`, counted through the bytes from the lowest bit of the first byte on.
    pub(crate) fn little_endian(start: usize, bit_count: u32) -> Option<Self> {
        Self::is_possible(start, bit_count).then(|| Self {
            first_byte: start / 8,
            byte_count: (start % 8 + bit_count as usize).div_ceil(8),
            shift: (start % 8) as u32,
            bit_count,
            is_big_endian: false,
        })
    }

    /// A number whose highest bit is `start` (in the numbering of DBC files: bit 7 is the highest of the first byte),
    /// and whose further bits follow downwards and into the next bytes.
    pub(crate) fn big_endian(start: usize, bit_count: u32) -> Option<Self> {
        Self::is_possible(start, bit_count).then(|| {
            // the bit's place, counted from the highest bit of the first byte on
            let in_byte = 7 - start % 8;
            let bits = in_byte + bit_count as usize;
            Self {
                first_byte: start / 8,
                byte_count: bits.div_ceil(8),
                shift: (bits.div_ceil(8) * 8 - bits) as u32,
                bit_count,
                is_big_endian: true,
            }
        })
    }

    /// A number in whole bytes from `first_byte` on, the highest first, whose lowest bit is bit `shift` of the last.
    pub(crate) fn highest_byte_first(
        first_byte: usize,
        shift: u32,
        bit_count: u32,
    ) -> Option<Self> {
        let start = first_byte.checked_mul(8)?;
        (shift < 8 && Self::is_possible(start, bit_count)).then(|| Self {
            first_byte,
            byte_count: (shift + bit_count).div_ceil(8) as usize,
            shift,
            bit_count,
            is_big_endian: true,
        })
    }

    fn is_possible(start: usize, bit_count: u32) -> bool {
        const MOST_BYTES: usize = 1785;
        start < MOST_BYTES * 8 && (1..=64).contains(&bit_count)
    }

    /// The byte behind the number.
    pub(crate) fn end(self) -> usize {
        self.first_byte + self.byte_count
    }

    /// The number; `None` if the data end before it.
    #[inline]
    pub(crate) fn read(self, data: &[u8]) -> Option<u64> {
        let bytes = data.get(self.first_byte..self.end())?;
        let fold = |number: u128, byte: &u8| number << 8 | u128::from(*byte);
        let number = match self.is_big_endian {
            true => bytes.iter().fold(0, fold),
            false => bytes.iter().rev().fold(0, fold),
        };
        Some((number >> self.shift) as u64 & self.all_ones())
    }

    /// Returns the largest number with the bits of this range.
    #[inline]
    pub(crate) fn all_ones(self) -> u64 {
        u64::MAX >> (64 - self.bit_count)
    }

    /// The number with its highest bit as sign.
    #[inline]
    pub(crate) fn signed(self, raw: u64) -> i64 {
        let unused = 64 - self.bit_count;
        ((raw << unused) as i64) >> unused
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Reads a number bit by bit, as the DBC format describes it.
    fn bit_by_bit(data: &[u8], start: usize, count: u32, is_big_endian: bool) -> Option<u64> {
        let bit = |at: usize| Some(u64::from(data.get(at / 8)? >> (at % 8) & 1));
        let mut number = 0;
        let mut at = start;
        for place in 0..count {
            if is_big_endian {
                number = number << 1 | bit(at)?;
                at = if at.is_multiple_of(8) {
                    at + 15
                } else {
                    at - 1
                };
            } else {
                number |= bit(at)? << place;
                at += 1;
            }
        }
        Some(number)
    }

    proptest! {
        #[test]
        fn numbers_are_those_read_bit_by_bit(
            data in proptest::collection::vec(any::<u8>(), 0..16),
            start in 0_usize..128,
            count in 1_u32..=64,
            is_big_endian: bool,
        ) {
            let range = match is_big_endian {
                true => BitRange::big_endian(start, count),
                false => BitRange::little_endian(start, count),
            };
            prop_assert_eq!(range.unwrap().read(&data), bit_by_bit(&data, start, count, is_big_endian));
        }
    }

    #[test]
    fn signs_are_extended() {
        let range = BitRange::little_endian(0, 12).unwrap();
        assert_eq!(range.signed(0xfff), -1);
        assert_eq!(range.signed(0x7ff), 2047);
        let whole = BitRange::little_endian(0, 64).unwrap();
        assert_eq!(whole.signed(u64::MAX), -1);
        assert!(BitRange::little_endian(0, 0).is_none() && BitRange::big_endian(0, 65).is_none());
    }
}
