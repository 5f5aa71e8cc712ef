//! Why a machine or a setting cannot be stabilised.

/// T* must not be nearer to the step than this factor.
pub(super) const STEP_FACTOR: f64 = 1.5;

/// What keeps a [`Stabiliser`](crate::Stabiliser) from being made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StabiliserError {
    /// The machine file has no active suspension.
    #[error("expected [suspension] in the machine file, found none")]
    NoSuspension,
    /// More actuators than the control steers, or none.
    #[error("suspension.linkages: expected one or two linkages, found {found}")]
    Actuators {
        /// How many there are.
        found: usize,
    },
    /// Free joints make the split of the loads depend on more than the control counts.
    #[error(
        "contact.free_joints: expected none on a machine whose suspension is steered, found {found}"
    )]
    FreeJoints {
        /// How many there are.
        found: usize,
    },
    /// An actuator that carries another cannot be steered by itself.
    #[error(
        "suspension.control.independent: expected linkages of which none carries another, found some that do"
    )]
    Nested,
    /// A triangle that does not close over the whole stroke.
    #[error(
        "suspension.stroke: expected positions that linkage \"{linkage}\" can take, found {position} m"
    )]
    Stroke {
        /// Name of the linkage.
        linkage: String,
        /// A position in the stroke where it cannot close (m).
        position: f64,
    },
    /// A weight for an edge that the machine does not have.
    #[error("suspension.control.weights.edges: expected {edges}, found \"{name}\"")]
    UnknownEdge {
        /// The name.
        name: String,
        /// The names of the machine's edges.
        edges: String,
    },
    /// A posture of another machine.
    #[error("posture: expected a position for each of {expected} joints, found {found}")]
    Posture {
        /// How many measured joints the machine has.
        expected: usize,
        /// How many positions there are.
        found: usize,
    },
    /// The paper's problem would steer the wrong way.
    #[error(
        "suspension.control.rate: literal mode needs steps of {least_step:.3} s or more, {factor} times the {critical:.3} s \
         below which the inertia of the step itself outweighs what it is for (largest at rod position {position:.3} m), \
         found {step:.3} s; mode \"look-ahead\" has no such limit",
        factor = STEP_FACTOR
    )]
    StepTooShort {
        /// The step asked for (s).
        step: f64,
        /// The least step (s).
        least_step: f64,
        /// The largest T* over the stroke (s).
        critical: f64,
        /// The rod position where it is (m).
        position: f64,
    },
    /// The paper's problem cannot be trusted with any step.
    #[error(
        "suspension.control.mode: literal mode needs a machine whose loads answer to the rods' position against their \
         inertia; at rod position {position:.3} m the load of the front less the rear changes by {by_position:.4e} N/m \
         and {by_acceleration:.4e} N s^2/m"
    )]
    NoCriticalStep {
        /// The rod position (m).
        position: f64,
        /// Front less rear load by the rods' position (N/m).
        by_position: f64,
        /// The same by their acceleration (N s^2/m).
        by_acceleration: f64,
    },
}
