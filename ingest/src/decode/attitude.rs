//! Quantities that a message gives.

/// Whether a covariance marks the quantity as measured: by convention (REP 145), a first covariance of -1 marks a quantity that
/// an IMU does not measure.
pub(super) fn is_given(covariance: f64) -> bool {
    covariance != -1.0
}

/// A vector, or three unknown values if none is given.
#[inline]
pub(super) fn given_vector(vector: [f64; 3], is_given: bool) -> [f64; 3] {
    if is_given { vector } else { [f64::NAN; 3] }
}

/// A quaternion, or four unknown values if none is given.
#[inline]
pub(super) fn given_attitude(quaternion: [f64; 4], is_given: bool) -> [f64; 4] {
    // all zeros: never set by the driver
    if is_given && quaternion != [0.0; 4] {
        quaternion
    } else {
        [f64::NAN; 4]
    }
}
