//! The normal distribution, and what counts as certain.

/// What is beyond so many standard deviations is certain: loads, times and positions, in decisions and in bands.
pub const SURE_SIGMAS: f64 = 2.0;
/// Probability beyond [`SURE_SIGMAS`] on one side.
pub const BEYOND_SURE: f64 = 0.022_750_131_948_179;

/// Cumulative distribution function of the standard normal distribution.
#[must_use]
pub fn normal_distribution(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// Density of a normal distribution about zero.
#[must_use]
pub fn normal_density(x: f64, sigma: f64) -> f64 {
    (-0.5 * (x / sigma).powi(2)).exp() / (sigma * std::f64::consts::TAU.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_distribution_matches_tabulated_values() {
        for (z, p) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_543),
            (-SURE_SIGMAS, BEYOND_SURE),
            (6.0, 1.0 - 9.865_876e-10),
        ] {
            assert!((normal_distribution(z) - p).abs() < 1e-15, "{z}");
        }
        assert!(normal_distribution(f64::NAN).is_nan());
    }
}
