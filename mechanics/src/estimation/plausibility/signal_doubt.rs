//! Doubt about a signal that failed visibly, kept within a session and over its end: until the signal is back within what it
//! could have reached, is measured again, or a person trusts it again.

use crate::machine::{Proof, Proofs};

/// A signal that failed visibly: it jumped where it cannot have gone, stopped to be measured, may show other axes, or does not show what
/// is asked of its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalDoubt {
    /// The signal: a joint, the specific force, or the angular velocity of an IMU whose housing may have turned.
    pub signal: Proof,
    /// Error of the signal (rad, m or m/s^2; signed): the sum of the jumps of a joint or of the heading of the IMU, the difference of
    /// the mean length of the specific force from the nearest possible one, or the size of the sum of its steps. Zero for a joint that
    /// is not measured any more: its error is unknown.
    pub by: f64,
    /// The part of `by` that may be motion, or does no harm (same unit): after a jump back to a sum that is not larger, the joint is
    /// back. All of it for a joint that has lost counts. Zero for the mean length of the specific force.
    /// For a joint that is not measured any more: its velocity then (rad/s or m/s). Infinite if the lean of the platform has
    /// contradicted its standstill, whether it is measured again or not, and minus infinity if it does not show what its controller asks:
    /// doubts of their own, beside another one.
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

/// Doubts and positions that a session takes over from the one before.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inherited {
    /// Signals that failed visibly.
    pub doubts: Vec<SignalDoubt>,
    /// Last known positions of the joints.
    pub positions: Vec<KnownPosition>,
}

impl SignalDoubt {
    /// Creates the doubt that the mean length of the specific force is by so much beyond what is possible (m/s^2, signed).
    pub(super) fn of_length(beyond: f64) -> Self {
        Self {
            signal: Proof::SpecificForce,
            by: beyond,
            moved: 0.0,
        }
    }

    /// Returns the signals that the doubt leaves unproven without doubting a row: those of an IMU whose housing may have turned, and a
    /// joint that does not show what its controller asks.
    #[must_use]
    pub fn disputed(&self) -> Proofs {
        match self.signal {
            Proof::AngularVelocity => Proof::OF_IMU.into_iter().collect(),
            joint if self.disobeys() => [joint].into_iter().collect(),
            _ => Proofs::NONE,
        }
    }

    /// Whether the doubt is about the mean length of the specific force, and not that it has stepped.
    #[must_use]
    pub fn is_of_length(&self) -> bool {
        self.by != 0.0 && self.moved == 0.0
    }

    /// Creates the doubt that a joint is not measured any more, and shows the same position since.
    /// `rate`: its velocity then (rad/s or m/s).
    pub(super) fn frozen(joint: usize, rate: f64) -> Self {
        Self {
            signal: Proof::Joint(joint),
            by: 0.0,
            moved: rate,
        }
    }

    /// Creates the doubt that the lean of the platform has contradicted the standstill of a joint: its encoder may have lost its zero.
    pub(super) fn stopped_once(joint: usize) -> Self {
        Self {
            signal: Proof::Joint(joint),
            by: 0.0,
            moved: f64::INFINITY,
        }
    }

    /// Creates the doubt that a joint does not show what its controller asks.
    pub(in crate::estimation) fn disobedient(joint: usize) -> Self {
        Self {
            signal: Proof::Joint(joint),
            by: 0.0,
            moved: f64::NEG_INFINITY,
        }
    }

    /// Returns the `moved` of a doubt that was stated before velocities had a sign: what was contradicted as stopped moved by -1, and the
    /// velocity of a joint that stopped was its size. Whichever way it moved, such a joint has lost counts where it goes on.
    #[must_use]
    pub fn moved_of_before(by: f64, moved: f64) -> f64 {
        match by == 0.0 && moved < 0.0 {
            true => f64::INFINITY,
            false => moved,
        }
    }

    /// Whether the doubt is that a joint is not measured any more.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.by == 0.0 && self.moved.is_finite()
    }

    /// Whether the doubt is that the lean of the platform has contradicted the standstill of a joint, which may be measured again.
    #[must_use]
    pub fn has_stopped_once(&self) -> bool {
        self.by == 0.0 && self.moved == f64::INFINITY
    }

    /// Whether the doubt is that a joint does not show what its controller asks.
    #[must_use]
    pub fn disobeys(&self) -> bool {
        self.by == 0.0 && self.moved == f64::NEG_INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_that_is_not_measured_any_more_moved_either_way() {
        for rate in [-0.3, 0.0, 0.3] {
            let frozen = SignalDoubt::frozen(2, rate);
            assert_eq!(frozen.moved, rate);
            assert!(frozen.is_frozen() && !frozen.has_stopped_once());
        }
        let once = SignalDoubt::stopped_once(2);
        assert!(once.has_stopped_once() && !once.is_frozen() && !once.disobeys());
        let idle = SignalDoubt::disobedient(2);
        assert!(idle.disobeys() && !idle.is_frozen() && !idle.has_stopped_once());
    }

    #[test]
    fn a_housing_that_may_have_turned_and_a_joint_that_does_not_obey_doubt_no_row() {
        let turned = SignalDoubt {
            signal: Proof::AngularVelocity,
            by: 1.5,
            moved: 0.1,
        };
        assert_eq!(turned.disputed(), Proof::OF_IMU.into_iter().collect());
        let idle = SignalDoubt::disobedient(2);
        assert_eq!(idle.disputed(), [Proof::Joint(2)].into_iter().collect());
        for other in [
            SignalDoubt::frozen(2, 0.3),
            SignalDoubt::stopped_once(2),
            SignalDoubt::of_length(1.5),
        ] {
            assert!(other.disputed().is_empty());
        }
    }

    #[test]
    fn a_contradicted_standstill_of_before_is_one() {
        let signal = Proof::Joint(2);
        let of_before = |by, moved| SignalDoubt {
            signal,
            by,
            moved: SignalDoubt::moved_of_before(by, moved),
        };
        assert!(of_before(0.0, -1.0).has_stopped_once());
        assert_eq!(of_before(0.0, 0.3), SignalDoubt::frozen(2, 0.3));
        assert_eq!(of_before(-1.5, 0.02).moved, 0.02);
    }
}
