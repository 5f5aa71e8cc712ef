//! Positions of the signals of a message, and the conversion of their bits to numbers.

use std::ops::RangeInclusive;

use tipwatch_language::{say, word};

use crate::bits::BitRange;
use crate::frame::CanId;
use crate::tally::Tally;
use crate::unit::SiUnit;

/// A message: its addressing, and its signals.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Its name, such as `VehicleWeight`; the long one of a DBC file that has two.
    pub name: String,
    /// The short name of a DBC file that also has a long one.
    pub symbol: Option<String>,
    /// Frames that carry the message.
    pub addressing: Addressing,
    /// Its length (bytes).
    pub len: usize,
    /// The rules for its values.
    pub protocol: Protocol,
    /// Its signals.
    pub signals: Vec<Signal>,
}

/// Frames that carry a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Addressing {
    /// Frames of this identifier.
    Id(CanId),
    /// Frames of a parameter group of J1939, of any priority and destination.
    ParameterGroup {
        /// Parameter group number.
        pgn: u32,
        /// The only sender, if one is stated.
        source: Option<u8>,
    },
}

/// The rules for values and lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// None beyond the description of the message.
    Plain,
    /// SAE J1939: the highest values of a signal say "not available" or "error", and messages are padded to 8 bytes.
    J1939,
}

/// A signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// Its name; the long one of a DBC file that has two.
    pub name: String,
    /// The short name of a DBC file that also has a long one.
    pub symbol: Option<String>,
    pub(crate) bits: BitRange,
    /// Data type of the bits.
    pub kind: ValueKind,
    /// Factor of the bits, before units are converted.
    pub factor: f64,
    /// Offset after the factor, before units are converted.
    pub offset: f64,
    /// Least and greatest value that the description states, in its unit.
    pub range: Option<(f64, f64)>,
    /// The unit as described.
    pub unit: String,
    /// Its SI unit. [`SiUnit::NONE`] also for a unit that is unknown: see [`Signal::is_converted`].
    pub si: SiUnit,
    /// Whether the unit is known, so that values are in SI units.
    pub is_converted: bool,
    /// Raw values, with sign, that the description calls not available, an error or invalid.
    pub not_numbers: Vec<i64>,
    /// Multiplexer and its values that select the signal; `None` for a signal in every frame.
    pub multiplexed: Option<Multiplexed>,
    /// Whether the signal selects other signals.
    pub is_multiplexer: bool,
    /// Whether the signal counts the messages, by its name.
    pub is_counter: bool,
    /// Whether the signal is a checksum, by its name.
    pub is_checksum: bool,
}

/// Data type of the bits of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueKind {
    /// A whole number.
    Unsigned,
    /// A whole number in two's complement.
    Signed,
    /// IEEE 754, 32 bits.
    Float32,
    /// IEEE 754, 64 bits.
    Float64,
}

/// A signal that is there only for some values of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Multiplexed {
    /// Index of the multiplexer among the signals.
    pub multiplexer: usize,
    /// Its raw values for which the signal is there.
    pub values: Vec<RangeInclusive<u64>>,
}

/// Multiplexers select multiplexers no deeper than this.
pub(crate) const MOST_NESTED: usize = 8;
/// Rounding must not move the ends of a range.
const RANGE_TOLERANCE: f64 = 1e-9;

/// Meaning of the raw bits of a signal.
pub(crate) enum Reading {
    Number(f64),
    NotAvailable,
    Error,
    OutOfRange,
}

impl Signal {
    /// The number in SI units, or why there is none.
    #[inline]
    fn read(&self, raw: u64, protocol: Protocol) -> Reading {
        if protocol == Protocol::J1939
            && self.kind == ValueKind::Unsigned
            && !self.is_multiplexer
            && !self.is_counter
            && let Some(said) = indicator(raw, self.bits.bit_count)
        {
            return match said {
                Indicator::NotAvailable => Reading::NotAvailable,
                Indicator::Error => Reading::Error,
            };
        }
        let value = match self.kind {
            ValueKind::Unsigned => raw as f64,
            ValueKind::Signed => self.bits.signed(raw) as f64,
            ValueKind::Float32 => f64::from(f32::from_bits(raw as u32)),
            ValueKind::Float64 => f64::from_bits(raw),
        };
        if !self.not_numbers.is_empty() && self.not_numbers.contains(&self.integer(raw)) {
            return Reading::NotAvailable;
        }
        let value = value * self.factor + self.offset;
        if !value.is_finite() {
            return Reading::NotAvailable;
        }
        if let Some((least, greatest)) = self.range {
            let slack = RANGE_TOLERANCE * least.abs().max(greatest.abs());
            if value < least - slack || value > greatest + slack {
                return Reading::OutOfRange;
            }
        }
        Reading::Number(value * self.si.factor + self.si.offset)
    }

    fn integer(&self, raw: u64) -> i64 {
        match self.kind {
            ValueKind::Signed => self.bits.signed(raw),
            _ => raw as i64,
        }
    }
}

impl Message {
    /// The parameter group number, of messages of SAE J1939.
    #[must_use]
    pub fn pgn(&self) -> Option<u32> {
        match self.addressing {
            Addressing::ParameterGroup { pgn, .. } => Some(pgn),
            Addressing::Id(_) => None,
        }
    }

    /// Whether the message's frames have identifiers of 29 bits.
    #[must_use]
    pub fn is_extended(&self) -> bool {
        match self.addressing {
            Addressing::ParameterGroup { .. } => true,
            Addressing::Id(id) => id.is_extended,
        }
    }

    /// The index of a signal, by its name or by its short name.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<usize> {
        let place = |is: &dyn Fn(&Signal) -> bool| self.signals.iter().position(is);
        place(&|signal| signal.name == name)
            .or_else(|| place(&|signal| signal.symbol.as_deref() == Some(name)))
    }

    /// Whether data of this length can be those of the message. CAN FD has only a few lengths between 8 and 64; J1939 pads to 8
    /// bytes.
    pub(crate) fn has_length(&self, found: usize, is_fd: bool) -> bool {
        const FD_LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, 64];
        if found == self.len {
            return true;
        }
        let padded = match self.protocol {
            Protocol::J1939 if self.len < 8 => Some(8),
            _ if is_fd => FD_LENGTHS.into_iter().find(|len| *len >= self.len),
            _ => None,
        };
        padded == Some(found)
    }

    /// Reads all signals, in SI units where the unit is known. What is not there, or not a number, is NaN.
    pub(crate) fn decode(&self, data: &[u8], values: &mut Vec<f64>, tally: &mut Tally) {
        values.clear();
        let mut unknown = None;
        for (index, signal) in self.signals.iter().enumerate() {
            if signal.multiplexed.is_some() && !self.is_selected(signal, data, MOST_NESTED) {
                values.push(f64::NAN);
                continue;
            }
            let Some(raw) = signal.bits.read(data) else {
                values.push(f64::NAN);
                continue;
            };
            if signal.is_multiplexer && !self.selects(index, raw) {
                unknown = Some(raw);
            }
            let counts = match signal.read(raw, self.protocol) {
                Reading::Number(value) => {
                    values.push(value);
                    continue;
                }
                Reading::NotAvailable => &mut tally.not_available,
                Reading::Error => &mut tally.errors,
                Reading::OutOfRange => &mut tally.out_of_range,
            };
            *counts.entry(index).or_default() += 1;
            values.push(f64::NAN);
        }
        if let Some(value) = unknown {
            let count = tally.unknown_multiplexer.map_or(0, |(count, _)| count);
            tally.unknown_multiplexer = Some((count + 1, value));
        }
    }

    /// Whether the multiplexers select a signal.
    fn is_selected(&self, signal: &Signal, data: &[u8], levels: usize) -> bool {
        let Some(multiplexed) = &signal.multiplexed else {
            return true;
        };
        let Some(multiplexer) = self.signals.get(multiplexed.multiplexer) else {
            return false;
        };
        let raw = multiplexer.bits.read(data);
        let is_in = |raw: u64| {
            multiplexed
                .values
                .iter()
                .any(|values| values.contains(&raw))
        };
        levels > 0 && raw.is_some_and(is_in) && self.is_selected(multiplexer, data, levels - 1)
    }

    /// Whether a value of a multiplexer selects any signal.
    fn selects(&self, multiplexer: usize, raw: u64) -> bool {
        self.signals.iter().any(|signal| {
            let multiplexed = signal.multiplexed.as_ref();
            multiplexed.is_some_and(|by| {
                by.multiplexer == multiplexer
                    && by.values.iter().any(|values| values.contains(&raw))
            })
        })
    }

    /// Describes the values of its frames that did not become numbers; empty if all did.
    #[must_use]
    pub fn told(&self, tally: &Tally) -> Vec<String> {
        let name = &self.name;
        let mut lines = Vec::new();
        let mut tell = |count: u64, what: String| {
            if count > 0 {
                lines.push(say!("{name}: {count} of {} frames {what}", tally.frames));
            }
        };
        if let Some((count, found)) = tally.wrong_length {
            let expected = self.len;
            tell(
                count,
                say!(
                    "have a wrong length (expected {expected} bytes, found for example {found}): no numbers"
                ),
            );
        }
        if let Some((count, value)) = tally.unknown_multiplexer {
            tell(
                count,
                say!(
                    "have an unknown multiplexer (for example {value}): no numbers of multiplexed signals"
                ),
            );
        }
        tell(
            tally.standing_counter,
            word!("repeat the message counter of the frame before: no numbers").to_owned(),
        );
        tell(
            tally.idle_counter,
            word!("have other data and a message counter that has not moved: it is ignored")
                .to_owned(),
        );
        tell(
            tally.standing_checksum,
            word!("have the checksum of the frame before although other data changed").to_owned(),
        );
        let of_signals = [
            (&tally.not_available, word!("say \"not available\"")),
            (&tally.errors, word!("say \"error\" or are reserved")),
            (&tally.out_of_range, word!("lie outside the stated range")),
        ];
        for (counts, what) in of_signals {
            for (&index, count) in counts {
                let signal = self.signals.get(index).map_or("?", |signal| &signal.name);
                lines.push(say!("{name}.{signal}: {count} values {what}: no numbers"));
            }
        }
        if tally.incomplete > 0 {
            let count = tally.incomplete;
            lines.push(say!(
                "{name}: {count} messages of several packets are incomplete: no numbers"
            ));
        }
        if tally.remote > 0 {
            lines.push(say!("{name}: {} remote frames carry no data", tally.remote));
        }
        lines
    }
}

/// Meaning of a value that is reserved as an indicator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Indicator {
    NotAvailable,
    /// An error, also a value that is reserved or specific to the parameter.
    Error,
}

/// Returns the indicator that an unsigned value of `bit_count` bits stands for, or `None` for a number (J1939-71, table 1). Of a
/// byte, 255 is "not available", 254 "error" and 251 to 253 are reserved; the high byte of 2, 3 and 4 bytes likewise. Of shorter
/// fields the highest value is "not available" and the one below it "error"; a single bit is a number.
#[inline]
fn indicator(raw: u64, bit_count: u32) -> Option<Indicator> {
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
