//! Conversions of the numbers of a channel.

use std::io::{self, Read, Seek};

use tipwatch_language::say;

use super::block::BlockFile;
use crate::bits::{array_at, u16_at};

/// Conversion from the number in a record to the value of the channel.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Conversion {
    None,
    Linear {
        factor: f64,
        offset: f64,
    },
    /// Two polynomials of the second degree, highest power first, one divided by the other.
    Rational([f64; 6]),
    /// Values by keys, which rise.
    Table {
        pairs: Vec<[f64; 2]>,
        is_interpolated: bool,
    },
    /// Values by the least and greatest key, and the value of all other keys.
    Ranges {
        ranges: Vec<[f64; 3]>,
        other: f64,
    },
    /// Texts by the least and greatest key: the numbers at their ends. The last is that of all other keys.
    Texts {
        ranges: Vec<[f64; 2]>,
        numbers: Vec<Option<f64>>,
    },
}

/// Types of conversions (`cc_type`).
mod kind {
    pub(super) const NONE: u8 = 0;
    pub(super) const LINEAR: u8 = 1;
    pub(super) const RATIONAL: u8 = 2;
    pub(super) const INTERPOLATED: u8 = 4;
    pub(super) const TABLE: u8 = 5;
    pub(super) const RANGES: u8 = 6;
    pub(super) const TEXTS: u8 = 7;
    pub(super) const RANGES_OF_TEXTS: u8 = 8;
}

/// Links of a conversion before those to texts.
const FIRST_TEXT: usize = 4;

impl Conversion {
    /// Reads the conversion at a link; an error if it is not known.
    pub(super) fn read<R: Read + Seek>(
        file: &mut BlockFile<R>,
        at: u64,
    ) -> io::Result<Result<Self, String>> {
        if at == 0 {
            return Ok(Ok(Self::None));
        }
        let block = match file.block(at, *b"CC")? {
            Ok(block) => block,
            Err(reason) => return Ok(Err(reason)),
        };
        let kind = block.data.first().copied().unwrap_or(0);
        let count = u16_at(&block.data, 6).map_or(0, usize::from);
        let values: Vec<f64> = (0..count)
            .map_while(|index| array_at(&block.data, 24 + 8 * index).map(f64::from_le_bytes))
            .collect();
        if matches!(kind, kind::TEXTS | kind::RANGES_OF_TEXTS) {
            let mut numbers = Vec::new();
            for &link in block.links.get(FIRST_TEXT..).unwrap_or_default() {
                numbers.push(file.text(link)?.ok().and_then(|text| number_at_end(&text)));
            }
            let ranges = match kind {
                kind::TEXTS => values.iter().map(|&key| [key, key]).collect(),
                _ => values.as_chunks().0.to_vec(),
            };
            return Ok(Ok(Self::Texts { ranges, numbers }));
        }
        let conversion = match (kind, values.as_slice()) {
            (kind::NONE, _) => Some(Self::None),
            (kind::LINEAR, &[offset, factor, ..]) => Some(Self::Linear { factor, offset }),
            (kind::RATIONAL, values) => values.first_chunk().copied().map(Self::Rational),
            (kind::INTERPOLATED | kind::TABLE, values) => Some(Self::Table {
                pairs: values.as_chunks().0.to_vec(),
                is_interpolated: kind == kind::INTERPOLATED,
            }),
            (kind::RANGES, values) => values.split_last().map(|(&other, ranges)| Self::Ranges {
                ranges: ranges.as_chunks().0.to_vec(),
                other,
            }),
            _ => None,
        };
        Ok(conversion.ok_or_else(|| {
            say!(
                "expected a conversion by numbers or to texts, found one of type {kind} with {} numbers: save the file \
                 with raw values of the bus channels",
                values.len()
            )
        }))
    }

    /// Whether the conversion leaves numbers unchanged.
    pub(super) fn is_none(&self) -> bool {
        match self {
            Self::None => true,
            Self::Linear { factor, offset } => (*factor, *offset) == (1.0, 0.0),
            _ => false,
        }
    }

    /// The number; of texts that at the end of the text, if `reads_texts`, else the number before the conversion.
    pub(super) fn apply(&self, x: f64, reads_texts: bool) -> Option<f64> {
        let within = |least: f64, greatest: f64| (least..=greatest).contains(&x);
        match self {
            Self::None => Some(x),
            Self::Linear { factor, offset } => Some(x * factor + offset),
            Self::Rational([a, b, c, d, e, f]) => {
                Some((a * x * x + b * x + c) / (d * x * x + e * x + f))
            }
            Self::Table {
                pairs,
                is_interpolated,
            } => tabulated(pairs, x, *is_interpolated),
            Self::Ranges { ranges, other } => {
                let found = ranges
                    .iter()
                    .find(|[least, greatest, _]| within(*least, *greatest));
                Some(found.map_or(*other, |[.., value]| *value))
            }
            Self::Texts { .. } if !reads_texts => Some(x),
            Self::Texts { ranges, numbers } => {
                let place = ranges
                    .iter()
                    .position(|[least, greatest]| within(*least, *greatest));
                *numbers.get(place.unwrap_or(ranges.len()))?
            }
        }
    }
}

/// Returns the value of a key; between two keys, that of the nearer one, or the value on the line between both.
fn tabulated(pairs: &[[f64; 2]], x: f64, is_interpolated: bool) -> Option<f64> {
    let next = pairs.partition_point(|[key, _]| *key < x);
    let (Some([before, low]), Some([after, high])) = (
        next.checked_sub(1).and_then(|at| pairs.get(at)),
        pairs.get(next),
    ) else {
        // the first and the last go on
        let end = pairs.get(next).or_else(|| pairs.last());
        return end.map(|[_, value]| *value);
    };
    Some(match is_interpolated {
        true => low + (high - low) * (x - before) / (after - before),
        false if after - x < x - before => *high,
        false => *low,
    })
}

/// The number at the end of a name such as `CAN2`.
pub(super) fn number_at_end(text: &str) -> Option<f64> {
    let text = text.trim_end();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    text.get(digits..)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_converted() {
        let rational = Conversion::Rational([0.0, 2.0, 1.0, 0.0, 0.0, 4.0]);
        assert_eq!(rational.apply(3.0, false), Some(7.0 / 4.0));
        let pairs = vec![[1.0, 10.0], [2.0, 30.0]];
        for (is_interpolated, x, expected) in [
            (true, 1.5, 20.0),
            (true, 0.0, 10.0),
            (true, 9.0, 30.0),
            (false, 1.4, 10.0),
            (false, 1.6, 30.0),
            (false, 2.0, 30.0),
        ] {
            let table = Conversion::Table {
                pairs: pairs.clone(),
                is_interpolated,
            };
            assert_eq!(
                table.apply(x, false),
                Some(expected),
                "{is_interpolated} {x}"
            );
        }
        let ranges = Conversion::Ranges {
            ranges: vec![[0.0, 1.0, 7.0]],
            other: 2.0,
        };
        assert_eq!(ranges.apply(1.0, false), Some(7.0));
        assert_eq!(ranges.apply(5.0, false), Some(2.0));
        let texts = Conversion::Texts {
            ranges: vec![[0.0, 0.0]],
            numbers: vec![number_at_end("CAN 3"), number_at_end("none")],
        };
        assert_eq!(texts.apply(0.0, true), Some(3.0));
        assert_eq!(texts.apply(1.0, true), None);
        assert_eq!(texts.apply(1.0, false), Some(1.0));
    }
}
