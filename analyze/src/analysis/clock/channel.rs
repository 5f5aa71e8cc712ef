//! Pairs of signals on an even time grid, smoothed alike.

use super::grid::STEP_S;

/// Every second step is one of a coarse channel: smoothing leaves nothing that is faster.
pub(super) const COARSE_STEP: usize = 2;

/// Measurements of the same motion by two sensors, on an even time grid.
///
/// `late` is the signal whose stamps may be late; apart from the delay it is a linear combination of the
/// `known` ones.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    pub(super) late: Vec<f64>,
    pub(super) known: Vec<Vec<f64>>,
}

impl Channel {
    /// Smooths the signals over a time (s) and removes their mean, from the first to the last step with
    /// all of them; `None` if one has a gap or the late one is constant.
    pub(super) fn new(late: &[f64], known: &[&[f64]], smooth_s: f64) -> Option<Self> {
        let is_whole = |&step: &usize| {
            late[step].is_finite() && known.iter().all(|values| values[step].is_finite())
        };
        let mut steps = 0..late.len();
        let (first, last) = (steps.find(is_whole)?, steps.rfind(is_whole)?);
        if !(first..=last).all(|step| is_whole(&step)) {
            return None;
        }
        let half = (0.5 * smooth_s / STEP_S).round() as usize;
        let prepare = |values: &[f64]| without_mean(smooth(&values[first..=last], half));
        let late = prepare(late);
        let known = known.iter().map(|values| prepare(values));
        changes(&late).then(|| Self {
            late,
            known: known.filter(|values| changes(values)).collect(),
        })
    }

    /// The channel on a coarser time grid.
    pub(super) fn coarse(&self) -> Self {
        let coarse = |values: &Vec<f64>| values.iter().step_by(COARSE_STEP).copied().collect();
        Self {
            late: coarse(&self.late),
            known: self.known.iter().map(coarse).collect(),
        }
    }

    /// The channel with its late signal earlier by some steps, as far as it has both.
    pub(super) fn earlier(&self, steps: isize) -> Self {
        let cut = steps.unsigned_abs().min(self.late.len());
        let end = self.late.len() - cut;
        let (late, known) = if steps > 0 { (cut, 0) } else { (0, cut) };
        Self {
            late: self.late[late..late + end].to_vec(),
            known: (self.known.iter())
                .map(|values| values[known..known + end].to_vec())
                .collect(),
        }
    }
}

fn changes(values: &[f64]) -> bool {
    let largest = values
        .iter()
        .fold(0.0_f64, |largest, v| largest.max(v.abs()));
    largest > 1e-12
}

/// Applies a moving average over `half` steps to each side twice: no phase shift, and the same filter
/// for all signals.
fn smooth(values: &[f64], half: usize) -> Vec<f64> {
    let mut values = values.to_vec();
    let mut sums = Vec::with_capacity(values.len() + 1);
    for _ in 0..2 {
        average_around(&mut values, half, &mut sums);
    }
    values
}

/// Replaces each value by the mean of those around it; `sums` is scratch memory.
fn average_around(values: &mut [f64], half: usize, sums: &mut Vec<f64>) {
    sums.clear();
    let mut sum = 0.0;
    sums.push(sum);
    sums.extend(values.iter().map(|value| {
        sum += value;
        sum
    }));
    let count = values.len();
    // symmetric windows, also at the ends
    let ends = half.min(count.div_ceil(2));
    for i in (0..ends).chain(count - ends..count) {
        let reach = i.min(count - 1 - i);
        values[i] = (sums[i + reach + 1] - sums[i - reach]) / (2 * reach + 1) as f64;
    }
    let width = 2 * half + 1;
    let sums = sums.iter().zip(sums.get(width..).unwrap_or_default());
    let middle = ends..(count - ends).max(ends);
    for (mean, (before, after)) in values[middle].iter_mut().zip(sums) {
        *mean = (after - before) / width as f64;
    }
}

fn without_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value -= mean);
    values
}

/// Central difference (1/s) on the time grid.
pub(super) fn derivative(values: &[f64]) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let slope = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        (values[b] - values[a]) / ((b - a).max(1) as f64 * STEP_S)
    };
    (0..values.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_are_of_symmetric_windows() {
        let values = [1.0, 4.0, 2.0, 8.0, 6.0, 3.0, 9.0];
        for half in 0..6 {
            let mut averaged = values;
            average_around(&mut averaged, half, &mut Vec::new());
            for (i, found) in averaged.into_iter().enumerate() {
                let reach = half.min(i).min(values.len() - 1 - i);
                let window = &values[i - reach..=i + reach];
                let mean = window.iter().sum::<f64>() / window.len() as f64;
                assert!((found - mean).abs() < 1e-12, "{half} {i}: {found} {mean}");
            }
        }
        average_around(&mut [], 3, &mut Vec::new());
    }
}
