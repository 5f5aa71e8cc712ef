//! Noise of simulated sensors in tests.

use super::kalman_filter::FilterModel;

/// Stated noise: the defaults of a joint.
pub(super) const STATED: FilterModel = FilterModel {
    value_variance: 3e-4 * 3e-4,
    rate_variance: 3e-3 * 3e-3,
    density: 0.1 * 0.1,
    max_gap_ns: 250_000_000,
};

/// Standard normal numbers, the same in every run: the sum of twelve uniform ones.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = (self.0.wrapping_mul(6_364_136_223_846_793_005)).wrapping_add(1);
            (self.0 >> 40) as f64 / f64::from(1 << 24)
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}
