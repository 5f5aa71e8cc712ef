//! The normal distribution.

/// Cumulative distribution function of the standard normal distribution.
pub(crate) fn normal_distribution(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// Density of a normal distribution about zero.
pub(crate) fn normal_density(x: f64, sigma: f64) -> f64 {
    (-0.5 * (x / sigma).powi(2)).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt())
}

#[cfg(test)]
mod tests {
    use super::normal_distribution;

    #[test]
    fn normal_distribution_matches_tabulated_values() {
        for (z, p) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_543),
            (-2.0, 0.022_750_131_948_179),
            (6.0, 1.0 - 9.865_876e-10),
        ] {
            assert!((normal_distribution(z) - p).abs() < 1e-15, "{z}");
        }
        assert!(normal_distribution(f64::NAN).is_nan());
    }
}
