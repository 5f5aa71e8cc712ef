//! The offset of one clock against another: a robust straight line.
//!
//! Theil-Sen estimator (Theil 1950, Sen 1968): the slope is the median of the slopes of all pairs
//! of points, the offset the median of the residuals.

use super::{
    ordered_bits::{from_ordered_bits, ordered_bits},
    pairs,
    time::{NS_PER_S, seconds_between},
};

/// Most points used for a slope; the number of pairs grows with the square.
const MOST_POINTS: usize = 300;
/// Standard deviation of a normal distribution per median absolute deviation.
pub(super) const SIGMA_BY_MAD: f64 = 1.4826;

/// The offset of one clock against another, as a function of the other's time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    at_ns: i64,
    offset_ns: i64,
    /// Growth of the offset (s/s).
    pub(super) slope: f64,
    /// Standard deviation of the slope.
    pub(super) slope_sigma: f64,
    /// Median absolute deviation of the points from the line (s).
    pub(super) mad_s: f64,
    /// Time from the first to the last point (s).
    pub(super) span_s: f64,
}

impl Line {
    /// The line of two equal clocks.
    pub(super) const SAME: Self = Self {
        at_ns: 0,
        offset_ns: 0,
        slope: 0.0,
        slope_sigma: 0.0,
        mad_s: 0.0,
        span_s: 0.0,
    };

    /// A constant offset (ns).
    pub(super) const fn constant(offset_ns: i64) -> Self {
        Self {
            offset_ns,
            ..Self::SAME
        }
    }

    /// Fits points (time, offset) in nanoseconds; `None` without points.
    pub(super) fn through(points: impl Iterator<Item = (i64, i64)> + Clone) -> Option<Self> {
        let points = few(points);
        let (&(first, _), &(last, _)) = (points.first()?, points.last()?);
        let mut offsets: Vec<i64> = points.iter().map(|point| point.1).collect();
        let reference = median_ns(&mut offsets)?;
        // small differences are exact in floating point
        let small: Vec<(f64, f64)> = points
            .iter()
            .map(|&(x, y)| (seconds_between(first, x), seconds_between(reference, y)))
            .collect();
        let slope = median_slope(&small).unwrap_or(0.0);
        let mut rests: Vec<f64> = small.iter().map(|(x, y)| y - slope * x).collect();
        let rest = median(&mut rests)?;
        let mut deviations: Vec<f64> = rests.iter().map(|r| (r - rest).abs()).collect();
        let mad_s = median(&mut deviations)?;
        Some(Self {
            at_ns: first,
            offset_ns: reference.saturating_add((rest * NS_PER_S).round() as i64),
            slope,
            slope_sigma: SIGMA_BY_MAD * mad_s / spread(&small),
            mad_s,
            span_s: seconds_between(first, last),
        })
    }

    /// The offset at a time (ns).
    pub(super) fn at(&self, time_ns: i64) -> i64 {
        let grown_s = self.slope * seconds_between(self.at_ns, time_ns);
        self.offset_ns
            .saturating_add((grown_s * NS_PER_S).round() as i64)
    }
}

/// Square root of the sum of the squared distances of the times from their mean (s).
fn spread(points: &[(f64, f64)]) -> f64 {
    let mean = points.iter().map(|p| p.0).sum::<f64>() / points.len() as f64;
    let squares: f64 = points.iter().map(|p| (p.0 - mean) * (p.0 - mean)).sum();
    squares.sqrt().max(f64::MIN_POSITIVE)
}

fn median_slope(points: &[(f64, f64)]) -> Option<f64> {
    if let Some(slope) = pairs::median_slope(points) {
        return Some(slope);
    }
    let mut slopes = Vec::with_capacity(points.len() * points.len() / 2);
    for (i, a) in points.iter().enumerate() {
        let later = points[i + 1..].iter().filter(|b| b.0 != a.0);
        slopes.extend(later.map(|b| ordered_bits((b.1 - a.1) / (b.0 - a.0))));
    }
    median_ns(&mut slopes).map(from_ordered_bits)
}

/// Evenly chosen points, few enough for a fit.
pub(super) fn few(points: impl Iterator<Item = (i64, i64)> + Clone) -> Vec<(i64, i64)> {
    let mut chosen = few_of(points.clone().count()).peekable();
    points
        .enumerate()
        .filter(|(index, _)| chosen.next_if_eq(index).is_some())
        .map(|(_, point)| point)
        .collect()
}

/// The indices of evenly chosen points.
pub(super) fn few_of(all: usize) -> impl Iterator<Item = usize> {
    let count = all.min(MOST_POINTS);
    (0..count).map(move |i| i * all.saturating_sub(1) / count.saturating_sub(1).max(1))
}

/// The middle value, the lower of two; `None` if empty.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}

/// Like [`median`], for integers.
pub(super) fn median_ns(values: &mut [i64]) -> Option<i64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable(middle).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fifth_of_wild_points_do_not_move_the_line() {
        let start = 1_700_000_000_000_000_000_i64;
        let points: Vec<(i64, i64)> = (0..5000_i64)
            .map(|i| {
                let time = start + i * 10_000_000;
                let wild = if i % 5 == 0 {
                    (i * 7919) % 900_000_000
                } else {
                    0
                };
                // 50 ppm, 3 ms behind, and delays up to 1 ms
                (time, -3_000_000 + i * 500 - (i * 7919) % 1_000_000 + wild)
            })
            .collect();
        let line = Line::through(points.into_iter()).unwrap();
        assert!((line.slope - 50e-6).abs() < 2e-6, "{line:?}");
        let error = line.at(start + 25_000_000_000) + 3_000_000 - 1_250_000 + 400_000;
        assert!(error.abs() < 300_000, "{error}");
        assert!((line.span_s - 49.99).abs() < 1e-9);
    }

    #[test]
    fn one_point_is_a_line_without_slope() {
        let line = Line::through([(5, 7)].into_iter()).unwrap();
        assert_eq!((line.at(0), line.at(i64::MAX), line.slope), (7, 7, 0.0));
        assert_eq!(Line::through(std::iter::empty()), None);
    }
}
