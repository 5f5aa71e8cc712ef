//! An even time grid through the rows, on which delays are estimated.

use std::ops::Range;

use crate::base::estimated::EstimatedRows;
use crate::load::linkage_force::interpolated;

/// Time step (s).
pub(super) const STEP_S: f64 = 0.01;
const STEP_NS: i64 = 10_000_000;
/// Longest gap between rows within a stretch (ns).
const LONGEST_GAP_NS: i64 = 250_000_000;
/// Shortest stretch that determines a delay (steps).
const SHORTEST: usize = 300;
/// Longest stretch; longer ones are cut (steps).
const LONGEST: usize = 6000;
/// Most stretches used: ten minutes in total.
const MOST: usize = 10;

/// A stretch of time without gaps, on an even grid.
#[derive(Debug, Clone)]
pub(super) struct Stretch {
    /// Time of the first step (ns).
    pub(super) start_ns: i64,
    /// Number of steps.
    pub(super) steps: usize,
    /// Rows of the stretch, and one before and after.
    pub(super) rows: Range<usize>,
}

impl Stretch {
    pub(super) fn time_ns(&self, step: usize) -> i64 {
        self.start_ns + step as i64 * STEP_NS
    }
}

/// Stretches of rows for which `holds`; of many, those with the largest sum of `activity`.
pub(super) fn stretches(
    rows: &EstimatedRows,
    holds: impl Fn(usize) -> bool,
    activity: impl Fn(usize) -> f64,
) -> Vec<Stretch> {
    let times = &rows.times_ns;
    let mut found = Vec::new();
    let mut first = 0;
    while first < rows.len() {
        if !holds(first) {
            first += 1;
            continue;
        }
        let mut end = first + 1;
        let joined = |end: usize| times[end] - times[end - 1] <= LONGEST_GAP_NS && holds(end);
        while end < rows.len() && joined(end) {
            end += 1;
        }
        cut(times, first..end, &mut found);
        first = end;
    }
    if found.len() > MOST {
        let sum = |stretch: &Stretch| stretch.rows.clone().map(&activity).sum::<f64>();
        let mut by_activity: Vec<(f64, Stretch)> =
            found.into_iter().map(|s| (sum(&s), s)).collect();
        by_activity.sort_by(|a, b| b.0.total_cmp(&a.0));
        by_activity.truncate(MOST);
        found = by_activity
            .into_iter()
            .map(|(_, stretch)| stretch)
            .collect();
        found.sort_by_key(|stretch| stretch.start_ns);
    }
    found
}

/// Cuts rows without gaps into stretches of similar length.
fn cut(times: &[i64], rows: Range<usize>, found: &mut Vec<Stretch>) {
    let (first, last) = (times[rows.start], times[rows.end - 1]);
    let steps = ((last - first) / STEP_NS) as usize;
    let parts = steps.div_ceil(LONGEST).max(1);
    let steps = steps / parts;
    if steps < SHORTEST {
        return;
    }
    for part in 0..parts {
        let start_ns = first + (part * steps) as i64 * STEP_NS;
        let end_ns = start_ns + steps as i64 * STEP_NS;
        let from = times[rows.clone()].partition_point(|&t| t <= start_ns);
        let to = times[rows.clone()].partition_point(|&t| t < end_ns);
        found.push(Stretch {
            start_ns,
            steps,
            rows: rows.start + from.saturating_sub(1)..(rows.start + to + 1).min(rows.end),
        });
    }
}

/// Interpolates values linearly at the steps of a stretch; NaN beyond the ends and in gaps.
pub(super) fn at_steps(stretch: &Stretch, stamps_ns: &[i64], values: &[f64]) -> Vec<f64> {
    let value = |step: usize| {
        let time_ns = stretch.time_ns(step);
        interpolated(stamps_ns, values, time_ns, LONGEST_GAP_NS).unwrap_or(f64::NAN)
    };
    (0..stretch.steps).map(value).collect()
}
