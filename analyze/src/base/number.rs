//! Numbers for documents and for people.

/// The number if it is finite: documents hold no infinity and no NaN.
pub(crate) fn known(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

/// A number with as many digits as a reader needs.
pub(crate) fn number(value: f64) -> String {
    match value.abs() {
        _ if !value.is_finite() => "not computable".to_string(),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 1.0 => format!("{value:.1}"),
        size if size < 0.0005 => "0".to_string(),
        _ => format!("{value:.3}"),
    }
}
