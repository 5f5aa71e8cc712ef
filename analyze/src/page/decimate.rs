//! Fewer points for a curve, with its peaks and breaks kept.

/// The rows of a curve to draw: at most `most` of them, in order.
///
/// A short curve keeps all rows. A longer one is cut into equal buckets; each keeps its smallest value, its
/// largest value and, as a break, its first value that is not finite. The first and the last row stay too.
pub(crate) fn rows_to_draw(values: &[f64], most: usize) -> Vec<usize> {
    let count = values.len();
    if count <= most {
        return (0..count).collect();
    }
    let buckets = (most.saturating_sub(2) / 3).max(1);
    let mut rows = vec![0];
    for bucket in 0..buckets {
        let (start, end) = (bucket * count / buckets, (bucket + 1) * count / buckets);
        let mut kept = extremes_and_break(&values[start..end]);
        kept.sort_unstable();
        rows.extend(kept.into_iter().map(|row| start + row));
    }
    rows.push(count - 1);
    rows.dedup();
    rows
}

fn extremes_and_break(values: &[f64]) -> Vec<usize> {
    let finite = || {
        values
            .iter()
            .enumerate()
            .filter(|(_, value)| value.is_finite())
    };
    let smallest = finite().min_by(|a, b| a.1.total_cmp(b.1));
    let largest = finite().max_by(|a, b| a.1.total_cmp(b.1));
    let break_row = values.iter().position(|value| !value.is_finite());
    [
        smallest.map(|(row, _)| row),
        largest.map(|(row, _)| row),
        break_row,
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize) -> Vec<f64> {
        (0..count).map(|row| (row as f64 * 0.01).sin()).collect()
    }

    #[test]
    fn short_curves_keep_every_row() {
        assert_eq!(rows_to_draw(&wave(100), 100), (0..100).collect::<Vec<_>>());
        assert!(rows_to_draw(&[], 10).is_empty());
    }

    #[test]
    fn single_peaks_and_dips_stay() {
        let mut values = wave(100_000);
        values[31_415] = 99.0;
        values[92_653] = -99.0;
        let rows = rows_to_draw(&values, 4000);
        assert!(rows.len() <= 4000);
        assert!(rows.contains(&31_415) && rows.contains(&92_653));
        assert!(rows.contains(&0) && rows.contains(&99_999));
        assert!(rows.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn a_single_missing_value_breaks_the_line() {
        let mut values = wave(50_000);
        values[20_000] = f64::NAN;
        assert!(rows_to_draw(&values, 1000).contains(&20_000));
    }

    #[test]
    fn a_curve_without_values_stays_empty() {
        let rows = rows_to_draw(&vec![f64::NAN; 10_000], 1000);
        assert!(!rows.is_empty() && rows.len() <= 1000);
    }
}
