//! Windows of about one second over the samples of a signal.

use std::ops::Range;

use rayon::prelude::*;

use crate::load::{Recording, SampleReader};

/// Length of a window (ns).
const LENGTH_NS: i64 = 1_000_000_000;
/// Longest step between samples in a window (ns).
const LONGEST_STEP_NS: i64 = 250_000_000;
/// Fewest samples of a window.
const FEWEST: usize = 5;
/// Windows that a thread looks at in a row.
const IN_A_ROW: usize = 32;

/// The windows, in order; a gap or a stamp that steps back ends one.
pub(super) fn windows(stamps_ns: &[i64]) -> Vec<Range<usize>> {
    let mut windows = Vec::new();
    let mut start = 0;
    for at in 1..=stamps_ns.len() {
        let goes_on = stamps_ns.get(at).is_some_and(|&stamp| {
            let step = stamp.saturating_sub(stamps_ns[at - 1]);
            let length = stamp.saturating_sub(stamps_ns[start]);
            (0..=LONGEST_STEP_NS).contains(&step) && length < LENGTH_NS
        });
        if !goes_on {
            if at - start >= FEWEST {
                windows.push(start..at);
            }
            start = at;
        }
    }
    windows
}

/// Applies `of` to each window over a recording, on all cores, and returns the results in order.
pub(super) fn of_windows<T: Send>(
    recording: &Recording,
    of: impl Fn(&mut SampleReader<'_>, Range<usize>) -> Option<T> + Sync,
) -> Vec<T> {
    let windows = windows(&recording.stamps_ns);
    let found = windows.par_chunks(IN_A_ROW).map(|windows| {
        let mut reader = recording.reader();
        let found = windows
            .iter()
            .filter_map(|window| of(&mut reader, window.clone()));
        found.collect::<Vec<T>>()
    });
    let found: Vec<Vec<T>> = found.collect();
    found.into_iter().flatten().collect()
}

/// The quantile of values that are finite; `None` without any.
pub(super) fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(values[(share * last as f64).round() as usize])
}

/// The median of values that are finite; `None` without any.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_end_at_gaps_and_steps_back() {
        let mut stamps: Vec<i64> = (0..250).map(|i| i * 10_000_000).collect();
        let found = windows(&stamps);
        assert_eq!(found, [0..100, 100..200, 200..250]);
        stamps[150] = 0;
        assert_eq!(windows(&stamps)[1], 100..150);
        assert!(windows(&[]).is_empty() && windows(&[1]).is_empty());
        assert!(
            !windows(&[i64::MIN, i64::MAX, i64::MIN])
                .iter()
                .any(|w| w.len() > 1)
        );
    }

    #[test]
    fn quantiles_ignore_what_is_not_finite() {
        assert_eq!(median([3.0, f64::NAN, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([f64::INFINITY]), None);
        assert_eq!(quantile([1.0, 2.0, 3.0], 1.0), Some(3.0));
    }
}
