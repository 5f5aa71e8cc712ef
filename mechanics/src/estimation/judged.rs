//! Passing samples to a filter as the plausibility check judged them: left out, or with added variance.

use super::kalman_filter::{Doubt, KalmanFilter};
use crate::estimation::plausibility::Treatment;
use crate::state::SampleError;

/// Passes a sample to a filter, unless it is left out.
pub(super) fn push(
    filter: &mut KalmanFilter,
    stamp_ns: i64,
    values: &[f64],
    rates: Option<&[f64]>,
    treatment: &Treatment,
) -> Result<(), SampleError> {
    if treatment.left_out {
        return Ok(());
    }
    let rates = rates.filter(|_| !treatment.rates_left_out);
    let doubt = Doubt {
        value_variance: treatment.value_variance,
        rate_variance: treatment.rate_variance,
    };
    filter.push(stamp_ns, values, rates, doubt)
}
