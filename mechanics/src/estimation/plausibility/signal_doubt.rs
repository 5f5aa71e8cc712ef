//! What stays of a signal that failed visibly, within a session and over its end: it is doubted until it is back within what it
//! could have reached, or a person trusts it again.

use crate::machine::Proof;

/// A signal that failed visibly: it jumped where it cannot have gone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalDoubt {
    /// The signal: a joint, or the specific force.
    pub signal: Proof,
    /// By how much it is off (rad, m or m/s^2; signed): the sum of the jumps of a joint, or how far the mean length of the
    /// specific force is beyond what is possible.
    pub by: f64,
    /// What of that may be motion (same unit): with a sum of jumps that is not larger, the joint is back.
    pub moved: f64,
}
