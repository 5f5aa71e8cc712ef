//! Statistics of columns with unknown values.

/// Mean of the finite values; NaN if there are none.
pub(super) fn mean(values: &[f64]) -> f64 {
    let known = values.iter().filter(|v| v.is_finite());
    known.clone().sum::<f64>() / known.count() as f64
}

/// Root mean square of the finite values; NaN if there are none.
pub(super) fn rms(values: &[f64]) -> f64 {
    let squares: Vec<f64> = values.iter().map(|v| v * v).collect();
    mean(&squares).sqrt()
}

/// Smallest and largest of the finite values; NaN if there are none.
pub(super) fn range(values: &[f64]) -> [f64; 2] {
    let known = values.iter().copied().filter(|v| v.is_finite());
    known.fold([f64::NAN; 2], |[least, greatest], v| {
        [least.min(v), greatest.max(v)]
    })
}

/// Largest absolute value; NaN if there is none.
pub(super) fn largest(values: &[f64]) -> f64 {
    let [least, greatest] = range(values);
    least.abs().max(greatest.abs())
}
