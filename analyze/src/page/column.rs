//! The numbers of a page's curves: their bytes, which are shorter and faster to read than digits.

use std::cell::{Ref, RefCell};

use serde::Serialize;

/// The numbers of all curves of a page, column after column. Of a column, the first bytes of all its numbers come
/// first, then the second ones, and so on: those of a kind compress together.
#[derive(Debug)]
pub(crate) struct Columns {
    bytes: RefCell<Vec<u8>>,
    /// Low bits of a value that are left out, of the 23 behind its first one.
    left_out: u32,
    /// Length of a tick of the page's times (s).
    tick_s: f64,
}

impl Default for Columns {
    fn default() -> Self {
        Self {
            bytes: RefCell::default(),
            left_out: 0,
            tick_s: TICK_S,
        }
    }
}

/// A whole column, as `type:first byte:number of numbers`, and the length of its ticks where that is not the usual one; the page's
/// script reads it.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub(crate) struct Column(String);

/// Usual length of a tick of the page's times (s).
const TICK_S: f64 = 1e-4;
/// Ticks of a picture that shows all of the log: it has fewer columns.
const TICKS_OF_A_PICTURE: f64 = 4096.0;
/// Bits beyond what a reader is told: values are right to one in sixty thousand, of which the page tells four digits. What is left
/// out is a whole byte of each, mostly noise: a third of the packed size.
const BEYOND_A_READER: u32 = 8;
/// Bits that a picture does without: values are right to one in eight thousand, and pack to two thirds.
const BEYOND_A_PICTURE: u32 = 11;

impl Columns {
    /// No numbers, with room for the curves of so many points; values are as precise as a reader is told them.
    pub(crate) fn with_room(points: usize) -> Self {
        // a time and a value
        Self {
            bytes: RefCell::new(Vec::with_capacity(points * 8)),
            left_out: BEYOND_A_READER,
            ..Self::default()
        }
    }

    /// With values and times as precise as a picture of a log of this length (s) needs, for one of many pages.
    pub(crate) fn pictured(self, last_s: f64) -> Self {
        Self {
            left_out: BEYOND_A_PICTURE,
            tick_s: (last_s / TICKS_OF_A_PICTURE).max(TICK_S),
            ..self
        }
    }

    /// The columns of values over times (s from the first row). Times are 32-bit ticks, usually up to five days, each less the one
    /// before, and 64-bit numbers beyond; values are 32-bit numbers. A value that is not finite breaks the line.
    pub(crate) fn curve(&self, times: &[f64], values: &[f64]) -> (Column, Column) {
        let last_s = f64::from(u32::MAX) * self.tick_s;
        let times = if times.iter().all(|time| (0.0..=last_s).contains(time)) {
            let ticks = times.iter().map(|time| (time / self.tick_s).round() as u32);
            let mut before = 0;
            let steps = ticks.map(|tick| tick.wrapping_sub(std::mem::replace(&mut before, tick)));
            let Column(column) = self.add("ticks", steps.map(u32::to_le_bytes));
            match self.tick_s > TICK_S {
                true => Column(format!("{column}:{}", self.tick_s)),
                false => Column(column),
            }
        } else {
            self.add("f64", times.iter().map(|time| time.to_le_bytes()))
        };
        let drawn = |&value: &f64| {
            if value.is_finite() {
                rounded(value as f32, self.left_out)
            } else {
                f32::NAN
            }
        };
        let values = self.add("f32", values.iter().map(drawn).map(f32::to_le_bytes));
        (times, values)
    }

    fn add<const N: usize>(
        &self,
        type_name: &str,
        numbers: impl ExactSizeIterator<Item = [u8; N]>,
    ) -> Column {
        let mut bytes = self.bytes.borrow_mut();
        let (first, count) = (bytes.len(), numbers.len());
        let numbers: Vec<[u8; N]> = numbers.collect();
        for rank in 0..N {
            bytes.extend(numbers.iter().map(|number| number[rank]));
        }
        Column(format!("{type_name}:{first}:{count}"))
    }

    /// The bytes.
    pub(super) fn bytes(&self) -> Ref<'_, [u8]> {
        Ref::map(self.bytes.borrow(), Vec::as_slice)
    }
}

/// A number without so many of its low bits.
fn rounded(value: f32, left_out: u32) -> f32 {
    let half = (1 << left_out) >> 1;
    f32::from_bits((value.to_bits() + half) >> left_out << left_out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_has_five_digits_and_a_picture_four() {
        for value in [12_345.679_f32, -0.001_234_567, 3e-38, 0.0] {
            assert_eq!(rounded(value, 0), value);
            let read = rounded(value, BEYOND_A_READER);
            assert!((read - value).abs() <= 1.6e-5 * value.abs(), "{value}");
            let pictured = rounded(value, BEYOND_A_PICTURE);
            assert!((pictured - value).abs() <= 1.3e-4 * value.abs(), "{value}");
            assert_eq!(pictured.to_bits().trailing_zeros().min(11), 11);
        }
        let columns = Columns::default().pictured(0.0);
        let (_, values) = columns.curve(&[0.0, 1.0], &[1.000_1, f64::NAN]);
        let expected = [1.0_f32, f32::NAN].map(f32::to_le_bytes).concat();
        assert_eq!(read(&columns, &values), ("f32".into(), expected));
    }

    #[test]
    fn times_of_a_picture_are_as_precise_as_it_is_wide() {
        let columns = Columns::default().pictured(8192.0);
        let (times, _) = columns.curve(&[0.0, 8192.0, 4096.9], &[0.0; 3]);
        let ticks = [0, 4096, 2048_u32.wrapping_sub(4096)];
        let ticks = ticks.map(u32::to_le_bytes).concat();
        assert_eq!(read(&columns, &times), ("ticks".into(), ticks));
        assert_eq!(times.0.rsplit(':').next(), Some("2"));
    }

    /// The type of a column, and its bytes in order.
    fn read(columns: &Columns, column: &Column) -> (String, Vec<u8>) {
        let parts: Vec<&str> = column.0.split(':').collect();
        let [type_name, first, count, ..] = parts[..] else {
            panic!("{column:?}");
        };
        let [first, count] = [first, count].map(|part| part.parse::<usize>().unwrap_or(0));
        let width = if type_name == "f64" { 8 } else { 4 };
        let bytes = columns.bytes();
        let number = |place: usize| (0..width).map(move |rank| first + rank * count + place);
        let places = (0..count).flat_map(number);
        (type_name.into(), places.map(|place| bytes[place]).collect())
    }

    #[test]
    fn times_are_ticks_and_values_have_seven_digits() {
        let columns = Columns::default();
        columns.curve(&[1.0], &[2.0]);
        let (times, values) = columns.curve(&[360_000.1, 0.0123], &[12_345.678_912, f64::INFINITY]);
        let ticks = [3_600_001_000, 123_u32.wrapping_sub(3_600_001_000)];
        let ticks = ticks.map(u32::to_le_bytes).concat();
        assert_eq!(read(&columns, &times), ("ticks".into(), ticks));
        let expected = [12_345.679_f32, f32::NAN].map(f32::to_le_bytes).concat();
        assert_eq!(read(&columns, &values), ("f32".into(), expected));
    }

    #[test]
    fn times_beyond_the_ticks_keep_all_digits() {
        for times in [[0.0, 500_000.0], [-1.0, 0.0]] {
            let columns = Columns::default();
            let (stamps, _) = columns.curve(&times, &[1.0, 2.0]);
            let whole = times.map(f64::to_le_bytes).concat();
            assert_eq!(read(&columns, &stamps), ("f64".into(), whole));
        }
    }
}
