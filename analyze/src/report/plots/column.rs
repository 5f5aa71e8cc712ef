//! Numbers of a curve as the page takes them: their bytes, which are fewer than their digits and read at once.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotly::Scatter;
use serde::Serialize;

/// A curve of the plotting library whose numbers stand in one [`Column`] each for times and values.
pub(super) type ColumnScatter = Scatter<Column, Column>;

/// A whole column, in base64; it stands as the only element where the library has a list of numbers, and
/// the page puts the numbers there.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub(super) struct Column(String);

/// A tick of the page's times (s).
const TICK_S: f64 = 1e-4;

/// A curve over times (s from the first row), written as ticks of 32 bits, which last for five days, and
/// values, written with the seven digits of 32 bits. What is not finite breaks the line.
pub(super) fn scatter(times: &[f64], values: &[f64]) -> Box<ColumnScatter> {
    let ticks = times.iter().map(|time| (time / TICK_S).round() as u32);
    let values = values.iter().map(|&value| {
        if value.is_finite() {
            value as f32
        } else {
            f32::NAN
        }
    });
    let column = |bytes: Vec<u8>| vec![Column(STANDARD.encode(bytes))];
    Scatter::new(
        column(ticks.flat_map(u32::to_le_bytes).collect()),
        column(values.flat_map(f32::to_le_bytes).collect()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_ticks_and_values_have_seven_digits() {
        let curve = scatter(&[0.0123, 360_000.1], &[12_345.678_912, f64::INFINITY]);
        let json = serde_json::to_value(&curve).unwrap_or_default();
        let bytes = |axis: &str| {
            let text = json[axis][0].as_str().unwrap_or_default();
            STANDARD.decode(text).unwrap_or_default()
        };
        assert_eq!(
            bytes("x"),
            [123_u32, 3_600_001_000].map(u32::to_le_bytes).concat()
        );
        let values = [12_345.679_f32, f32::NAN].map(f32::to_le_bytes).concat();
        assert_eq!(bytes("y"), values);
        assert_eq!(json["x"].as_array().map(Vec::len), Some(1));
    }
}
