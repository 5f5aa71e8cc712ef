//! The threshold of a log likelihood ratio, from the rate of false alarms that the machine file states.

/// The threshold of one of so many alternatives, weighed so many times an hour with independent evidence.
pub(super) fn threshold(
    false_alarms_per_hour: f64,
    weighed_per_hour: f64,
    alternatives: usize,
) -> f64 {
    (weighed_per_hour * alternatives as f64 / false_alarms_per_hour).ln()
}
