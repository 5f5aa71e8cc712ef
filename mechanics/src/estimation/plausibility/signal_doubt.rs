//! What stays of a signal that failed visibly, within a session and over its end: it is doubted until it is back within what it
//! could have reached, is measured again, or a person trusts it again.

use crate::machine::Proof;

/// A signal that failed visibly: it jumped where it cannot have gone, or stopped to be measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalDoubt {
    /// The signal: a joint, or the specific force.
    pub signal: Proof,
    /// By how much it is off (rad, m or m/s^2; signed): the sum of the jumps of a joint, or how far the mean length of the
    /// specific force is beyond what is possible. Zero of a joint that stopped to be measured: how far it is off is unknown.
    pub by: f64,
    /// What of that may be motion (same unit): after a jump back to a sum that is not larger, the joint is back. All of it, of a joint that
    /// has lost counts.
    pub moved: f64,
}

/// Where a joint was at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownPosition {
    /// Index of the joint.
    pub joint: usize,
    /// When (ns), by the clock of the sensors.
    pub stamp_ns: i64,
    /// In rad or m.
    pub position: f64,
}

impl SignalDoubt {
    /// That a joint stopped to be measured, and shows the same position since.
    pub(super) fn frozen(joint: usize) -> Self {
        Self {
            signal: Proof::Joint(joint),
            by: 0.0,
            moved: 0.0,
        }
    }

    /// Whether a joint stopped to be measured.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.by == 0.0
    }
}
