//! The median slope of many pairs of points, without keeping the slopes of all of them.
//!
//! A sample of the pairs tells between which two slopes the median almost certainly lies. Slopes outside are only
//! counted, those between them are kept, and the median is selected from these. It is the very slope that a selection
//! from all of them finds.

use super::ordered_bits::{from_ordered_bits, ordered_bits};

/// Fewer points have so few pairs that sampling does not pay.
const LEAST_POINTS: usize = 100;
/// Number of pairs per point in the sample, each with another point.
const SAMPLES_A_POINT: usize = 4;
/// Distance of the bounds from the sample's median, in standard deviations of its rank.
const SIGMAS: f64 = 4.0;
/// The most points of which slopes are computed at a time.
const ROW: usize = 64;

/// The median of the slopes of all pairs; `None` if the points are few, if two of them are at the same time or not in
/// order of time, or if the sample was misleading.
pub(super) fn median_slope(points: &[(f64, f64)]) -> Option<f64> {
    let count = points.len();
    if count < LEAST_POINTS || !points.is_sorted_by(|a, b| a.0 < b.0) {
        return None;
    }
    let (times, values): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    let [least, largest] = bounds(points)?;
    let width = largest.wrapping_sub(least) as u64;
    let mut below = 0;
    let mut between = Vec::with_capacity(count * count / 8);
    for first in 0..count {
        let (later_times, later_values) = (&times[first + 1..], &values[first + 1..]);
        for (times_of_row, values_of_row) in later_times.chunks(ROW).zip(later_values.chunks(ROW)) {
            let mut row = [i64::MIN; ROW];
            for ((slope, time), value) in row.iter_mut().zip(times_of_row).zip(values_of_row) {
                *slope = ordered_bits((value - values[first]) / (time - times[first]));
            }
            let row = &row[..times_of_row.len()];
            below += row.iter().filter(|&&slope| slope < least).count();
            // without a branch, of which a tenth would be mispredicted
            let mut kept = [0; ROW];
            let mut count = 0;
            for &slope in row {
                kept[count % ROW] = slope;
                count += usize::from(slope.wrapping_sub(least) as u64 <= width);
            }
            between.extend_from_slice(&kept[..count]);
        }
    }
    let middle = (count * (count - 1) / 2 - 1) / 2;
    let place = middle
        .checked_sub(below)
        .filter(|&place| place < between.len())?;
    let (_, median, _) = between.select_nth_unstable(place);
    Some(from_ordered_bits(*median))
}

/// Two slopes between which the median almost certainly lies.
fn bounds(points: &[(f64, f64)]) -> Option<[i64; 2]> {
    let count = points.len();
    let mut sample = Vec::with_capacity(SAMPLES_A_POINT * count);
    for place in 0..count {
        for step in 1..=SAMPLES_A_POINT {
            // near and far points, of each point other ones
            let distance = (place * 37 + step * count / (SAMPLES_A_POINT + 1)) % (count - 1) + 1;
            let other = (place + distance) % count;
            // in order of time, as below: a slope of zero has a sign, too
            let (a, b) = (points[place.min(other)], points[place.max(other)]);
            sample.push(ordered_bits((b.1 - a.1) / (b.0 - a.0)));
        }
    }
    let width = (SIGMAS * (sample.len() as f64).sqrt() / 2.0) as usize;
    let middle = sample.len() / 2;
    let (low, high) = (middle.checked_sub(width)?, middle + width);
    let (_, least, above) = sample.select_nth_unstable(low);
    let least = *least;
    let (_, largest, _) = above.select_nth_unstable(
        (high - low)
            .checked_sub(1)?
            .min(above.len().checked_sub(1)?),
    );
    Some([least, *largest])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Selects from all slopes.
    fn from_all(points: &[(f64, f64)]) -> f64 {
        let slopes = points.iter().enumerate().flat_map(|(i, a)| {
            let later = points[i + 1..].iter();
            later.map(|b| (b.1 - a.1) / (b.0 - a.0))
        });
        let mut slopes: Vec<f64> = slopes.collect();
        let middle = (slopes.len() - 1) / 2;
        *slopes.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    #[test]
    fn the_median_is_that_of_all_pairs_to_the_bit() {
        let noise = |seed: u64| {
            let bits = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            ((bits ^ (bits >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 * 1e-10
        };
        let courses: [fn(f64, f64) -> f64; 5] = [
            |_, _| 0.0,
            |time, noise| 50e-6 * time + noise,
            |_, noise| noise,
            |time, noise| if time < 1.3 { 0.0 } else { 2.0 } + noise,
            |time, noise| {
                if (time * 100.0) as u64 % 7 < 3 {
                    noise
                } else {
                    -0.5 * time
                }
            },
        ];
        for course in courses {
            for count in [100, 101, 217, 300] {
                let point = |i: usize| {
                    let time = i as f64 * 0.01 + noise(i as u64 + 1000);
                    (time, course(time, noise(i as u64)))
                };
                let points: Vec<(f64, f64)> = (0..count).map(point).collect();
                let found = median_slope(&points);
                assert_eq!(
                    found.map(f64::to_bits),
                    Some(from_all(&points).to_bits()),
                    "{count}"
                );
            }
        }
    }

    #[test]
    fn points_at_the_same_time_are_left_to_others() {
        let mut points: Vec<(f64, f64)> = (0..200).map(|i| (f64::from(i), 0.5)).collect();
        assert_eq!(median_slope(&points), Some(0.0));
        points[77].0 = 76.0;
        assert_eq!(median_slope(&points), None);
        assert_eq!(median_slope(&points[..50]), None);
    }
}
