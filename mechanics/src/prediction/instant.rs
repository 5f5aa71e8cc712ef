//! An instant ahead.

use super::decay::Decay;
use crate::machine::Machine;

/// Time constant with which roll, pitch and heave die away (s): motion of the platform on its tyres and on the ground does not go
/// on.
pub(super) const SHAKE_S: f64 = 0.1;

/// An instant ahead, with the values that depend on it alone.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instant {
    /// Time from now (s).
    pub(super) time_s: f64,
    /// Time constant of the joints' accelerations (s).
    pub(super) joint_decay_s: f64,
    pub(super) joint: Decay,
    pub(super) platform: Decay,
    /// Decay of the platform's roll, pitch and heave on its tyres.
    pub(super) shake: Decay,
}

impl Instant {
    pub(super) fn new(machine: &Machine, time_s: f64) -> Self {
        let spec = &machine.prediction;
        Self {
            time_s,
            joint_decay_s: spec.joint_decay,
            joint: Decay::after(time_s, spec.joint_decay),
            platform: Decay::after(time_s, spec.platform_decay),
            shake: Decay::after(time_s, SHAKE_S),
        }
    }
}
