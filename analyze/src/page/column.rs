//! The numbers of a curve on the page: their bytes, which are shorter and faster to read than digits.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotly::Scatter;
use serde::Serialize;

/// A curve of the plot library with one [`Column`] for times and one for values.
pub(crate) type ColumnScatter = Scatter<Column, Column>;

/// A whole column: `type:` and the bytes of its numbers in base64. It is the only element where the library
/// expects a list of numbers; the page's script replaces it with them.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub(crate) struct Column(String);

/// Length of a tick of the page's times (s).
const TICK_S: f64 = 1e-4;

/// A curve of values over times (s from the first row). Times are 32-bit ticks up to five days, and 64-bit
/// numbers beyond; values are 32-bit numbers. A value that is not finite breaks the line.
pub(crate) fn scatter(times: &[f64], values: &[f64]) -> Box<ColumnScatter> {
    let last_s = f64::from(u32::MAX) * TICK_S;
    let times = if times.iter().all(|time| (0.0..=last_s).contains(time)) {
        let ticks = times.iter().map(|time| (time / TICK_S).round() as u32);
        Column::of("ticks", ticks.map(u32::to_le_bytes))
    } else {
        Column::of("f64", times.iter().map(|time| time.to_le_bytes()))
    };
    let drawn = |&value: &f64| {
        if value.is_finite() {
            value as f32
        } else {
            f32::NAN
        }
    };
    let values = Column::of("f32", values.iter().map(drawn).map(f32::to_le_bytes));
    Scatter::new(vec![times], vec![values])
}

impl Column {
    fn of<const N: usize>(type_name: &str, numbers: impl Iterator<Item = [u8; N]>) -> Self {
        let bytes: Vec<u8> = numbers.flatten().collect();
        Self(format!("{type_name}:{}", STANDARD.encode(bytes)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(curve: &ColumnScatter, axis: &str) -> (String, Vec<u8>) {
        let json = serde_json::to_value(curve).unwrap_or_default();
        assert_eq!(json[axis].as_array().map(Vec::len), Some(1));
        let column = json[axis][0].as_str().unwrap_or_default().to_owned();
        let (type_name, text) = column.split_once(':').unwrap_or_default();
        (type_name.into(), STANDARD.decode(text).unwrap_or_default())
    }

    #[test]
    fn times_are_ticks_and_values_have_seven_digits() {
        let curve = scatter(&[0.0123, 360_000.1], &[12_345.678_912, f64::INFINITY]);
        let ticks = [123_u32, 3_600_001_000].map(u32::to_le_bytes).concat();
        assert_eq!(bytes(&curve, "x"), ("ticks".into(), ticks));
        let values = [12_345.679_f32, f32::NAN].map(f32::to_le_bytes).concat();
        assert_eq!(bytes(&curve, "y"), ("f32".into(), values));
    }

    #[test]
    fn times_beyond_the_ticks_keep_all_digits() {
        for times in [[0.0, 500_000.0], [-1.0, 0.0]] {
            let curve = scatter(&times, &[1.0, 2.0]);
            let whole = times.map(f64::to_le_bytes).concat();
            assert_eq!(bytes(&curve, "x"), ("f64".into(), whole));
        }
    }
}
