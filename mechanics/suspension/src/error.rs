//! Reasons why a suspension cannot be controlled or replayed.

/// The step must exceed T* by this factor.
pub(crate) const STEP_FACTOR: f64 = 1.5;

/// The suspension of a machine cannot be controlled or replayed as requested.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SuspensionError {
    /// The machine file has no active suspension.
    #[error("expected [suspension] in the machine file, found none")]
    NoSuspension,
    /// More actuators than the controller supports, or none.
    #[error("suspension.linkages: expected one or two linkages, found {found}")]
    Actuators {
        /// Number of actuators.
        found: usize,
    },
    /// With free joints the load split depends on more than the controller models.
    #[error(
        "contact.free_joints: expected none on a machine with a controlled suspension, found {found}"
    )]
    FreeJoints {
        /// Number of free joints.
        found: usize,
    },
    /// An actuator that supports another cannot be controlled independently.
    #[error(
        "suspension.control.independent: expected linkages that do not carry each other, found one that carries another"
    )]
    Nested,
    /// A triangle that does not close over the whole stroke.
    #[error(
        "suspension.stroke: expected positions at which linkage \"{linkage}\" closes, found {position} m"
    )]
    Stroke {
        /// Name of the linkage.
        linkage: String,
        /// A position in the stroke where it cannot close (m).
        position: f64,
    },
    /// A weight for an edge that does not exist.
    #[error("suspension.control.weights.edges: expected {edges}, found \"{name}\"")]
    UnknownEdge {
        /// The name.
        name: String,
        /// The names of the machine's edges.
        edges: String,
    },
    /// A posture that does not fit the machine.
    #[error("posture: expected a position for each of {expected} joints, found {found}")]
    Posture {
        /// Number of measured joints of the machine.
        expected: usize,
        /// Number of positions.
        found: usize,
    },
    /// Recorded rows without a known posture.
    #[error("posture: expected a row with the positions of all joints, found none")]
    NoPosture,
    /// The problem of the paper would move the rods the wrong way.
    #[error(
        "suspension.control.rate: literal mode needs steps of {least_step:.3} s or more, {factor} times the {critical:.3} s \
         below which the inertia of a step outweighs its effect on the posture (largest at stroke {position:.3} m), \
         found {step:.3} s; mode \"look-ahead\" has no such limit",
        factor = STEP_FACTOR
    )]
    StepTooShort {
        /// The requested step (s).
        step: f64,
        /// The smallest step allowed (s).
        least_step: f64,
        /// The largest T* over the stroke (s).
        critical: f64,
        /// The stroke where it occurs (m).
        position: f64,
    },
    /// The problem of the paper is unreliable with any step.
    #[error(
        "suspension.control.mode: literal mode needs a machine whose loads respond to stroke and to \
         acceleration with opposite sign; at stroke {position:.3} m the front minus rear load changes by {by_position:.4e} N/m \
         and {by_acceleration:.4e} N s^2/m"
    )]
    NoCriticalStep {
        /// The stroke (m).
        position: f64,
        /// Front minus rear load by stroke (N/m).
        by_position: f64,
        /// Front minus rear load by acceleration (N s^2/m).
        by_acceleration: f64,
    },
}
