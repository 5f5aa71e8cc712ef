//! Signals on a common, regular grid of bins, and filters on it.
//!
//! A bin holds the mean of the piecewise linear signal over it. NaN stands for what is unknown, in gaps and beyond the
//! ends; every filter passes it on.
//!
//! Signals are compared through a pair of filters that belong together: the derivative D of one signal and the mean K of
//! the other have the same delay and the same bandwidth,
//! ```text
//!     D x_k = (2 (x_{k+2} - x_{k-2}) + (x_{k+1} - x_{k-1})) / (10 h)
//!     K x_k = (x_{k-2} + 2.5 x_{k-1} + 3 x_k + 2.5 x_{k+1} + x_{k+2}) / 10
//! ```
//! so that `D x = K dx/dt` wherever dx/dt is linear between the middles of bins.

use nalgebra::Vector3;

/// Width of a bin (s).
pub(super) const STEP_S: f64 = 0.1;
/// Longest gap between samples that is bridged (ns).
const LONGEST_GAP_NS: i64 = 350_000_000;
/// Least part of a bin that samples must cover.
const LEAST_COVERED: f64 = 0.6;
/// Most bins: four hours.
const MOST_BINS: i64 = 144_000;

/// Noise of K of a signal as a share of that of the signal: the root of the sum of the squared weights.
pub(super) const SMOOTHED: f64 = 0.485;

/// The grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    start_ns: i64,
    pub(super) bins: usize,
}

impl Grid {
    /// The grid that holds these stamps.
    pub(super) fn around(stamps_ns: impl Iterator<Item = (i64, i64)>) -> Option<Self> {
        let (mut first, mut last) = (i64::MAX, i64::MIN);
        for (from, to) in stamps_ns {
            first = first.min(from);
            last = last.max(to);
        }
        let bins = last.checked_sub(first)? / step_ns();
        Some(Self {
            start_ns: first,
            bins: usize::try_from(bins.min(MOST_BINS)).ok()?,
        })
    }

    /// Means over the bins of a signal with these stamps.
    pub(super) fn means(&self, samples: impl Iterator<Item = (i64, f64)>) -> Vec<f64> {
        let (mut area, mut covered) = (vec![0.0; self.bins], vec![0.0; self.bins]);
        let mut before: Option<(i64, f64)> = None;
        for (stamp_ns, value) in samples.filter(|(_, value)| value.is_finite()) {
            if let Some((last_ns, last)) = before
                && stamp_ns > last_ns
                && stamp_ns - last_ns <= LONGEST_GAP_NS
            {
                self.add(
                    [(last_ns, last), (stamp_ns, value)],
                    &mut area,
                    &mut covered,
                );
            }
            before = Some((stamp_ns, value));
        }
        let mean = |(area, covered): (f64, f64)| match covered >= LEAST_COVERED {
            true => area / covered,
            false => f64::NAN,
        };
        area.into_iter().zip(covered).map(mean).collect()
    }

    /// Adds a straight piece of a signal to the bins that it crosses.
    fn add(&self, [(t0, x0), (t1, x1)]: [(i64, f64); 2], area: &mut [f64], covered: &mut [f64]) {
        let step = step_ns();
        let offset = |t: i64| t.saturating_sub(self.start_ns);
        let (first, last) = (offset(t0).div_euclid(step), offset(t1).div_euclid(step));
        for bin in first.max(0)..=last.min(self.bins as i64 - 1) {
            let from = offset(t0).max(bin * step);
            let to = offset(t1).min((bin + 1) * step);
            let share = |t: i64| (t - offset(t0)) as f64 / (t1 - t0) as f64;
            let middle = x0 + (x1 - x0) * 0.5 * (share(from) + share(to));
            let part = (to - from) as f64 / step as f64;
            area[bin as usize] += middle * part;
            covered[bin as usize] += part;
        }
    }

    /// Time of a bin's middle (s after the first sample).
    pub(super) fn seconds(bin: usize) -> f64 {
        (bin as f64 + 0.5) * STEP_S
    }
}

fn step_ns() -> i64 {
    (STEP_S * 1e9) as i64
}

/// Applies a symmetric or antisymmetric kernel of five bins.
fn filtered(values: &[f64], kernel: [f64; 5]) -> Vec<f64> {
    let mut result = vec![f64::NAN; values.len()];
    for (at, five) in values.windows(5).enumerate() {
        result[at + 2] = five.iter().zip(kernel).map(|(x, k)| x * k).sum();
    }
    result
}

/// K: the smoothed signal.
pub(super) fn smooth(values: &[f64]) -> Vec<f64> {
    filtered(values, [0.1, 0.25, 0.3, 0.25, 0.1])
}

/// D: the derivative.
pub(super) fn derivative(values: &[f64]) -> Vec<f64> {
    filtered(
        values,
        [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| k / (10.0 * STEP_S)),
    )
}

/// The second derivative of the parabola through five bins.
pub(super) fn second_derivative(values: &[f64]) -> Vec<f64> {
    filtered(
        values,
        [2.0, -1.0, -2.0, -1.0, 2.0].map(|k| k / (7.0 * STEP_S * STEP_S)),
    )
}

/// Applies a filter to each component of vectors.
pub(super) fn of_vectors(
    vectors: &[Vector3<f64>],
    filter: impl Fn(&[f64]) -> Vec<f64>,
) -> Vec<Vector3<f64>> {
    let component = |i: usize| filter(&vectors.iter().map(|v| v[i]).collect::<Vec<_>>());
    let [x, y, z] = [0, 1, 2].map(component);
    (0..vectors.len())
        .map(|k| Vector3::new(x[k], y[k], z[k]))
        .collect()
}

/// Standard deviation of the noise of a signal, from its fourth differences: slow motion drops out.
pub(super) fn noise(values: &[f64]) -> f64 {
    let squares = values.windows(5).filter_map(|x| {
        let fourth = x[0] - 4.0 * x[1] + 6.0 * x[2] - 4.0 * x[3] + x[4];
        fourth.is_finite().then_some(fourth * fourth / 70.0)
    });
    let mut squares: Vec<f64> = squares.collect();
    if squares.is_empty() {
        return f64::NAN;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of a chi-square variable of one degree of freedom is 0.455.
    (*median / 0.455).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        Grid::around([(0, 2_000_000_000)].into_iter()).unwrap()
    }

    #[test]
    fn bins_hold_means_of_the_piecewise_linear_signal() {
        let stamps = (0..=40).map(|k| k * 50_000_000_i64);
        let means = grid().means(stamps.map(|t| (t, 3.0 + 2.0 * t as f64 * 1e-9)));
        assert_eq!(means.len(), 20);
        for (bin, mean) in means.iter().enumerate() {
            assert!((mean - (3.0 + 2.0 * Grid::seconds(bin))).abs() < 1e-12);
        }
    }

    #[test]
    fn gaps_stay_unknown() {
        let stamps = (0..=40).map(|k| k * 50_000_000_i64);
        let stamps = stamps.filter(|t| !(500_000_001..1_400_000_000).contains(t));
        let means = grid().means(stamps.map(|t| (t, 1.0)));
        assert!(means[4] == 1.0 && means[7].is_nan() && means[15] == 1.0);
    }

    #[test]
    fn derivative_and_mean_belong_together() {
        let x: Vec<f64> = (0..30).map(|k| f64::from(k * k * k)).collect();
        let means: Vec<f64> = (0..30).map(|k| 3.0 * f64::from(k * k) / STEP_S).collect();
        let (d, k) = (derivative(&x), smooth(&means));
        for at in 2..28 {
            assert!((d[at] - k[at]).abs() < 12.0 / STEP_S, "{} {}", d[at], k[at]);
        }
        let ramp: Vec<f64> = (0..30).map(f64::from).collect();
        assert!((derivative(&ramp)[9] - 1.0 / STEP_S).abs() < 1e-9);
    }
}
