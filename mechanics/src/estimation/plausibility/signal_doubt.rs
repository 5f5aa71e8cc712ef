//! Doubt about a signal that failed visibly, kept within a session and over its end: until the signal is back within what it
//! could have reached, is measured again, or a person trusts it again.

use crate::machine::Proof;

/// A signal that failed visibly: it jumped where it cannot have gone, or stopped to be measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalDoubt {
    /// The signal: a joint, or the specific force.
    pub signal: Proof,
    /// Error of the signal (rad, m or m/s^2; signed): the sum of the jumps of a joint, or the difference of the mean length of
    /// the specific force from the nearest possible one. Zero for a joint that is not measured any more: its error is unknown.
    pub by: f64,
    /// The part of `by` that may be motion (same unit): after a jump back to a sum that is not larger, the joint is back. All of
    /// it for a joint that has lost counts.
    /// For a joint that is not measured any more: how fast it moved then (rad/s or m/s); less than zero if the lean of the platform has
    /// contradicted its standstill, whether it is measured again or not.
    pub moved: f64,
}

/// Position of a joint at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownPosition {
    /// Index of the joint.
    pub joint: usize,
    /// Time (ns), by the clock of the sensors.
    pub stamp_ns: i64,
    /// Position (rad or m).
    pub position: f64,
}

impl SignalDoubt {
    /// Creates the doubt that a joint is not measured any more, and shows the same position since.
    /// `rate`: how it moved then (rad/s or m/s).
    pub(super) fn frozen(joint: usize, rate: f64) -> Self {
        Self {
            signal: Proof::Joint(joint),
            by: 0.0,
            moved: rate.abs(),
        }
    }

    /// Creates the doubt that the lean of the platform has contradicted the standstill of a joint: its encoder may have lost its zero.
    pub(super) fn stopped_once(joint: usize) -> Self {
        Self {
            signal: Proof::Joint(joint),
            by: 0.0,
            moved: -1.0,
        }
    }

    /// Whether the doubt is that a joint is not measured any more.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.by == 0.0 && !self.has_stopped_once()
    }

    /// Whether the doubt is that the lean of the platform has contradicted the standstill of a joint, which may be measured again.
    #[must_use]
    pub fn has_stopped_once(&self) -> bool {
        self.by == 0.0 && self.moved < 0.0
    }
}
