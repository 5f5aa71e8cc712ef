//! Numbers by wheel.

use tipwatch_mechanics::machine::MAX_WHEELS;

/// Numbers by wheel or edge; entries beyond their number are zero.
pub(super) type ByWheel = [f64; MAX_WHEELS];

/// Sum of the load differences over all pairs of wheels (N).
pub(super) fn spread(loads: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (i, a) in loads.iter().enumerate() {
        sum += loads[..i].iter().map(|b| (a - b).abs()).sum::<f64>();
    }
    sum
}
