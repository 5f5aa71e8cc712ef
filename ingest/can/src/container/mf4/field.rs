//! A number of each record: some of its bits, or its index, and their conversion.

use super::conversion::Conversion;
use crate::bits::BitRange;

/// Numbers above it have no fraction in `f64`, and are no bus, identifier or length.
const MOST_WHOLE: f64 = 9_007_199_254_740_992.0;

/// Source of a number.
#[derive(Debug, Clone)]
pub(super) struct Field {
    source: Source,
    conversion: Conversion,
}

#[derive(Debug, Clone, Copy)]
enum Source {
    Unsigned(BitRange),
    Signed(BitRange),
    Float32(BitRange),
    Float64(BitRange),
    /// The index of the record in its group.
    Index,
}

impl Field {
    /// A number that is in no record.
    pub(super) fn of_index(conversion: Conversion) -> Self {
        Self {
            source: Source::Index,
            conversion,
        }
    }

    /// Bits of a record, of a data type of the standard (`cn_data_type`): unsigned, signed and floating point, each with
    /// the lowest or with the highest byte first.
    pub(super) fn of_bits(
        at: usize,
        bit_offset: u8,
        bit_count: u32,
        data_type: u8,
        conversion: Conversion,
    ) -> Option<Self> {
        let bits = match data_type % 2 {
            0 => BitRange::little_endian(at.checked_mul(8)? + usize::from(bit_offset), bit_count)?,
            _ => BitRange::highest_byte_first(at, u32::from(bit_offset), bit_count)?,
        };
        let source = match (data_type, bit_count) {
            (0 | 1, _) => Source::Unsigned(bits),
            (2 | 3, _) => Source::Signed(bits),
            (4 | 5, 32) => Source::Float32(bits),
            (4 | 5, 64) => Source::Float64(bits),
            _ => return None,
        };
        Some(Self { source, conversion })
    }

    /// Whether the field is the unconverted index of the record.
    pub(super) fn is_bare_index(&self) -> bool {
        matches!(self.source, Source::Index) && self.conversion.is_none()
    }

    pub(super) fn number(&self, record: &[u8], index: u64) -> Option<f64> {
        let (number, is_virtual) = match self.source {
            Source::Unsigned(bits) => (bits.read(record)? as f64, false),
            Source::Signed(bits) => (bits.signed(bits.read(record)?) as f64, false),
            Source::Float32(bits) => {
                let float = f32::from_bits(bits.read(record)? as u32);
                (f64::from(float), false)
            }
            Source::Float64(bits) => (f64::from_bits(bits.read(record)?), false),
            Source::Index => (index as f64, true),
        };
        self.conversion.apply(number, is_virtual)
    }

    /// Returns the number if it is whole and not negative.
    pub(super) fn whole(&self, record: &[u8], index: u64) -> Option<u64> {
        let number = self.number(record, index)?;
        let is_whole = (0.0..MOST_WHOLE).contains(&number) && number.fract() == 0.0;
        is_whole.then_some(number as u64)
    }
}
