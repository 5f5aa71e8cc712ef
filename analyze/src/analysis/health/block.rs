//! Fast components of half a second of samples: deviations from the parabola through them.

/// Fewest samples that show fast components.
pub(super) const LEAST_SAMPLES: usize = 10;

/// Polynomials of the first and second degree, orthogonal over the times of the samples.
#[derive(Debug, Default)]
pub(super) struct Parabola {
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Parabola {
    /// Computes the polynomials for samples at these times (s).
    pub(super) fn over(times: &[f64]) -> Self {
        let mean = mean(times);
        let first: Vec<f64> = times.iter().map(|time| time - mean).collect();
        let squares: Vec<f64> = first.iter().map(|x| x * x).collect();
        let norm = squares.iter().sum::<f64>();
        let middle = self::mean(&squares);
        let skew = squares.iter().zip(&first).map(|(s, x)| s * x).sum::<f64>() / norm;
        let second = squares.iter().zip(&first);
        let second = second.map(|(s, x)| s - middle - skew * x).collect();
        Self { first, second }
    }

    /// Mean of the values, and root mean square of their deviations from the parabola.
    pub(super) fn mean_and_rms(&self, values: &[f64]) -> (f64, f64) {
        let mean = mean(values);
        let mut rest: Vec<f64> = values.iter().map(|value| value - mean).collect();
        for polynomial in [&self.first, &self.second] {
            let norm: f64 = polynomial.iter().map(|p| p * p).sum();
            let along: f64 = rest.iter().zip(polynomial).map(|(r, p)| r * p).sum();
            if norm > 0.0 {
                for (rest, p) in rest.iter_mut().zip(polynomial) {
                    *rest -= along / norm * p;
                }
            }
        }
        let squares: f64 = rest.iter().map(|r| r * r).sum();
        // three numbers of the parabola are taken from the values
        let free = values.len().saturating_sub(3).max(1) as f64;
        (mean, (squares / free).sqrt())
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The middle of some values, which are reordered; `None` of none.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Counts values far from the two on either side, which agree. The first two and the last two are not judged. `step` is
/// the smallest change of the number that was seen.
pub(super) fn outliers(values: &[f64], step: f64) -> u64 {
    /// Times the usual deviation.
    const FAR: f64 = 12.0;
    /// Least ratio of an outlier's deviation to the spread of the four values around it.
    const AGREE: f64 = 3.0;
    const SIGMA_BY_MAD: f64 = 1.4826;
    let judged = values.windows(5).map(|around| {
        let mut four = [around[0], around[1], around[3], around[4]];
        four.sort_unstable_by(f64::total_cmp);
        let deviation = (around[2] - 0.5 * (four[1] + four[2])).abs();
        (deviation, four[3] - four[0])
    });
    let judged: Vec<(f64, f64)> = judged.collect();
    let mut deviations: Vec<f64> = judged.iter().map(|(deviation, _)| *deviation).collect();
    let Some(usual) = median(&mut deviations) else {
        return 0;
    };
    let far = FAR * (SIGMA_BY_MAD * usual).max(step);
    let is_outlier =
        |(deviation, spread): &&(f64, f64)| *deviation > far && AGREE * *spread < *deviation;
    judged.iter().filter(is_outlier).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parabola_leaves_noise_and_vibration() {
        let times: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.01).collect();
        let parabola = Parabola::over(&times);
        let motion = |t: f64| 3.0 - 2.0 * t + 7.0 * t * t;
        let smooth: Vec<f64> = times.iter().map(|t| motion(*t)).collect();
        assert!(parabola.mean_and_rms(&smooth).1 < 1e-12);
        // 20 Hz, of amplitude 2: an effective value of the square root of 2
        let shaken = |t: &f64| motion(*t) + 2.0 * (2.0 * std::f64::consts::PI * 20.0 * t).sin();
        let shaken: Vec<f64> = times.iter().map(shaken).collect();
        let (_, rms) = parabola.mean_and_rms(&shaken);
        assert!((rms / 2_f64.sqrt() - 1.0).abs() < 0.05, "{rms}");
    }

    #[test]
    fn single_values_apart_are_outliers_and_steps_are_not() {
        let noise = |k: u32| f64::from(k.wrapping_mul(2_654_435_769) >> 16) / 65536.0 - 0.5;
        let mut values: Vec<f64> = (0..100).map(|k| 10.0 + 0.01 * noise(k)).collect();
        assert_eq!(outliers(&values, 1e-6), 0);
        (values[30], values[60]) = (10.5, 9.0);
        assert_eq!(outliers(&values, 1e-6), 2);
        assert_eq!(outliers(&values, 1.0), 0);
        for value in &mut values[50..] {
            *value += 5.0;
        }
        values[60] = 15.0;
        assert_eq!(outliers(&values, 1e-6), 1);
    }
}
