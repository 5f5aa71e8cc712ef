//! Measured forces by which nothing is computed, such as those of the arm's cylinders: they are compared with what masses and motion
//! require.

use super::signals::FieldSpec;

/// The measured force of a linkage's actuator that neither splits the load of wheels nor tells the mass of a payload.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmForce {
    /// The linkage.
    pub linkage: usize,
    /// Its signals in [`Machine::force_signals`](super::Machine::force_signals), each with its coefficient in the force: 1, or an area
    /// (m^2, that of the annulus negative).
    pub signals: Vec<(usize, f64)>,
    /// Standard deviation of one sample of the force (N).
    pub force_sigma: f64,
    /// Standard deviation of the friction in the cylinder, as a fraction of the force.
    pub friction_share: f64,
    /// Positions of the linkage's measured joint (rad or m) between which what it moves may lie on a rest of its own machine.
    pub rests_within: Option<[f64; 2]>,
}

/// A signal of such a force: the force itself (N), or the pressure in a chamber (Pa).
#[derive(Debug, Clone, PartialEq)]
pub struct ForceSignal {
    /// The linkage.
    pub linkage: usize,
    /// Index of the signal among those of the linkage's force.
    pub signal: usize,
    /// Field of a log that contains the number.
    pub field: FieldSpec,
}
