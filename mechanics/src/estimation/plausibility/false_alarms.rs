//! The threshold of a log likelihood ratio, from the rate of false alarms that the machine file states.

/// Samples of which one repeats by chance, an hour, and the signals, axes and ends of ranges that are weighed, about.
const SAMPLES_PER_HOUR: f64 = 1e6;
const ENDS: usize = 12;

/// Returns the threshold of repeats, whose evidence is weighed with every sample.
pub(super) fn threshold_of_repeats(false_alarms_per_hour: f64) -> f64 {
    threshold(false_alarms_per_hour, SAMPLES_PER_HOUR, ENDS)
}

/// Returns the threshold for each of so many alternatives, weighed so many times an hour with independent evidence.
pub(super) fn threshold(
    false_alarms_per_hour: f64,
    weighed_per_hour: f64,
    alternatives: usize,
) -> f64 {
    (weighed_per_hour * alternatives as f64 / false_alarms_per_hour).ln()
}
