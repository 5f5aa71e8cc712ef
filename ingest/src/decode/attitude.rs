//! Whether a message gives an attitude.

/// By convention, a first covariance of -1 marks an IMU without attitude.
pub(super) fn gives_attitude(covariance: f64) -> bool {
    covariance != -1.0
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
