//! From when on measured and computed loads differ by more than chance.

/// Excess over the root of the number of sensors.
pub(super) const EXCESS: f64 = 3.5;

/// Whether a difference of a sum of loads contradicts the computed one by itself.
#[must_use]
pub fn shows(difference: f64, sigma: f64) -> bool {
    difference.abs() > (1.0 + EXCESS) * sigma
}
