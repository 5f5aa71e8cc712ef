//! Reasons why the analytic model does not apply to a machine.

/// The analytic model does not apply to the machine: what it requires and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClosedFormError {
    /// Not four wheels.
    #[error("the closed form needs four wheels, found {found}")]
    Wheels {
        /// Number of wheels.
        found: usize,
    },
    /// Joints without torque are not modelled.
    #[error("the closed form needs a machine without free joints, found {found}")]
    FreeJoints {
        /// Number of free joints.
        found: usize,
    },
    /// The split rule is not (54).
    #[error(
        "the closed form needs contact.roll_moment_distribution and four wheels at four corners, found springs"
    )]
    Split,
    /// A wheel that is not a separate body.
    #[error("the closed form needs wheels on joints of their own, found wheel \"{wheel}\" welded")]
    WeldedWheel {
        /// Name of the wheel.
        wheel: String,
    },
    /// No mass remains without arm and wheels.
    #[error("the closed form needs a platform with mass, found none besides arm and wheels")]
    NoMass,
    /// The number of positions differs from the number of joints.
    #[error("expected {expected} joint positions, found {found}")]
    JointPositions {
        /// Number of the machine's joints.
        expected: usize,
        /// Number of positions.
        found: usize,
    },
    /// Positions that are not finite or at which a linkage cannot close.
    #[error("expected joint positions in which every linkage closes")]
    Posture,
    /// The wheels of an axle are not abreast.
    #[error(
        "the closed form needs the {axle} wheels abreast within {allowed:.3} m, found {found:.3} m"
    )]
    Axle {
        /// "front" or "rear".
        axle: &'static str,
        /// Largest distance (m).
        allowed: f64,
        /// Distance (m).
        found: f64,
    },
    /// The wheels of a side are not in line.
    #[error(
        "the closed form needs the {side} wheels in line within {allowed:.3} m, found {found:.3} m"
    )]
    HalfTrack {
        /// "left" or "right".
        side: &'static str,
        /// Largest distance (m).
        allowed: f64,
        /// Distance (m).
        found: f64,
    },
}
