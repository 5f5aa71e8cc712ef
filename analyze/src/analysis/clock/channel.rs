//! Pairs of signals on an even time grid, smoothed alike.

use super::grid::STEP_S;

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
    mean_around(&mean_around(values, half), half)
}

fn mean_around(values: &[f64], half: usize) -> Vec<f64> {
    let mut sums = Vec::with_capacity(values.len() + 1);
    sums.push(0.0);
    for value in values {
        sums.push(sums[sums.len() - 1] + value);
    }
    let mean = |i: usize| {
        // symmetric windows, also at the ends
        let reach = half.min(i).min(values.len() - 1 - i);
        (sums[i + reach + 1] - sums[i - reach]) / (2 * reach + 1) as f64
    };
    (0..values.len()).map(mean).collect()
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
