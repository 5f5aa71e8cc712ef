//! Why the analytic model does not describe a machine.

/// A machine that is not of the analytic model's kind: what it expects and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClosedFormError {
    /// Not four wheels.
    #[error("the closed form needs four wheels, found {found}")]
    Wheels {
        /// How many there are.
        found: usize,
    },
    /// Joints without torque are not part of it.
    #[error("the closed form needs a machine without free joints, found {found}")]
    FreeJoints {
        /// How many there are.
        found: usize,
    },
    /// The split is not that of (54).
    #[error(
        "the closed form needs contact.front_share and four wheels at four corners, found springs"
    )]
    Split,
    /// A wheel that cannot be told from the platform, or from another wheel.
    #[error("the closed form needs wheels on joints of their own, found wheel \"{wheel}\" welded")]
    WeldedWheel {
        /// Name of the wheel.
        wheel: String,
    },
    /// Nothing left without arm and wheels.
    #[error("the closed form needs a platform with mass, found none beside arm and wheels")]
    NoMass,
    /// As many positions as the machine has joints.
    #[error("expected {expected} joint positions, found {found}")]
    JointPositions {
        /// Number of the machine's joints.
        expected: usize,
        /// Number of positions.
        found: usize,
    },
    /// Positions that are not finite or that no linkage can take.
    #[error("expected joint positions in which every linkage closes")]
    Posture,
    /// Wheels of an axle of which one stands further forward.
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
    /// Wheels of a side of which one stands further out.
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
