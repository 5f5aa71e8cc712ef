//! Signals in even steps that are compared, made smooth in the same way.

use super::evenly::STEP_S;

/// What one sensor feels and what another does, in even steps through one stretch.
///
/// `late` is the signal whose stamps may be late; up to a delay it is a sum of the `known` ones.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    pub(super) late: Vec<f64>,
    pub(super) known: Vec<Vec<f64>>,
}

impl Channel {
    /// The signals made smooth over a time (s), without mean, from when all are there until one
    /// ends; `None` if one has a hole between or the late one does not change.
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

/// Twice the mean over `half` steps to each side: no delay, and the same for all signals.
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
        // as far to one side as to the other, also at the ends
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

/// The derivative (1/s) of a signal in even steps.
pub(super) fn derivative(values: &[f64]) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let slope = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        (values[b] - values[a]) / ((b - a).max(1) as f64 * STEP_S)
    };
    (0..values.len()).map(slope).collect()
}
