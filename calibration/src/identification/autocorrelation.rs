//! How many independent samples correlated residuals are worth.

/// Correlations below this end the sum.
const LEAST: f64 = 0.05;

/// Number of samples after which residuals count as independent, at least one:
/// ```text
///     tau = 1 + 2 sum over k of c_k / c_0,      c_k = sum over t of e_t e_(t+k)
/// ```
/// up to the first small term. The mean is not subtracted: an error that stays the same through a whole log is one
/// sample of that error.
pub(crate) fn correlated_samples(residuals: &[f64]) -> f64 {
    let count = residuals.len();
    let lag = |k: usize| -> f64 {
        let pairs = residuals.iter().zip(&residuals[k..]);
        pairs.map(|(a, b)| a * b).sum()
    };
    let zero = match count {
        0 => return 1.0,
        _ => lag(0),
    };
    if !(zero > 0.0) {
        return 1.0;
    }
    let mut sum = 1.0;
    for k in 1..count {
        let correlation = lag(k) / zero;
        if !(correlation > LEAST) {
            break;
        }
        sum += 2.0 * correlation;
    }
    sum.min(count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_error_is_one_sample_and_alternating_ones_are_independent() {
        assert_eq!(correlated_samples(&[]), 1.0);
        assert_eq!(correlated_samples(&[0.0; 9]), 1.0);
        // sums of a finite series: half of the samples lie before the other half
        let constant = correlated_samples(&[0.7; 400]);
        assert!(constant > 300.0, "{constant}");
        let alternating: Vec<f64> = (0..400).map(|t| f64::from(1 - 2 * (t % 2))).collect();
        assert_eq!(correlated_samples(&alternating), 1.0);
    }

    #[test]
    fn val_a_first_order_process_has_its_known_correlation_time() {
        // e_t = a e_(t-1) + noise: tau = (1 + a) / (1 - a)
        let (mut e, mut seed, a) = (0.0_f64, 1_u64, 0.8);
        let series: Vec<f64> = (0..40_000)
            .map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                e = a * e + (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0;
                e
            })
            .collect();
        let found = correlated_samples(&series);
        assert!((found - 9.0).abs() < 1.2, "{found}");
    }
}
