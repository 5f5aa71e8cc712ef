//! Changes of a signal by noise or by a motion, and the evidence that the signal has stopped changing.
//!
//! Of the changes of noise two in three go back. What moves slowly and has no noise, to and fro perhaps, goes on in its direction for some
//! samples, and may rest then. The changes say which of both it is:
//! ```text
//!     log likelihood ratio = b ln((2/3) / m) + (n - b) ln((1/3) / (1 - m)),     b of n changes go back, of a motion the share m
//! ```

/// Shares of the changes of noise and of a motion that go back.
const NOISE_BACK: f64 = 2.0 / 3.0;
const MOTION_BACK: f64 = 0.15;

/// Returns the log likelihood ratio of noise against a motion, for so many changes that go back and so many that go on.
pub(super) fn noise_against_motion(back: f64, on: f64) -> f64 {
    back * (NOISE_BACK / MOTION_BACK).ln() + on * ((1.0 - NOISE_BACK) / (1.0 - MOTION_BACK)).ln()
}

/// Returns the log likelihood ratio that each repeat on end adds for a signal that is not measured any more, if the signal
/// repeated itself so many times among so many changes while it was measured (Laplace's rule of succession).
pub(super) fn per_repeat(changes: f64, repeats: f64) -> f64 {
    ((changes + repeats + 2.0) / (repeats + 1.0)).ln()
}
