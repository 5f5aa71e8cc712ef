//! Signals that tell the masses of payloads.

use super::signals::FieldSpec;

/// A signal that tells the mass of one or more payloads.
#[derive(Debug, Clone, PartialEq)]
pub struct PayloadSignal {
    /// The measured quantity.
    pub quantity: PayloadQuantity,
    /// Field of a log that contains the number.
    pub field: FieldSpec,
}

/// Quantity that a signal of payloads measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PayloadQuantity {
    /// The mass of the payload with this index (kg).
    Mass(usize),
    /// The force in the actuator of the linkage with this index (N), or a pressure in it (Pa): that signal of
    /// [`ActuatedJoint::signals`](super::ActuatedJoint::signals).
    Lift {
        /// The linkage.
        linkage: usize,
        /// The signal.
        signal: usize,
    },
}

/// The actuator that lifts a payload of unknown mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Lift {
    /// Its linkage.
    pub linkage: usize,
    /// Its index among the actuated joints, whose force is in the state: that of a linkage that carries supports, too.
    pub joint: Option<usize>,
    /// Otherwise the signals of its force in [`Machine::payload_signals`](super::Machine::payload_signals), each with its coefficient in the
    /// force: 1, or an area (m^2, that of the annulus negative).
    pub signals: Vec<(usize, f64)>,
    /// Standard deviation of one sample of the force (N).
    pub force_sigma: f64,
    /// Standard deviation of the friction in the cylinder, as a fraction of the force.
    pub friction_share: f64,
}
