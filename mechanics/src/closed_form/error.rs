//! Reasons why the analytic model does not apply to a machine.

use std::fmt;

use tipwatch_language::{say, told, word};

/// Error of a machine to which the analytic model does not apply: the required and the found property.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ClosedFormError {
    /// Not four wheels.
    Wheels {
        /// Number of wheels.
        found: usize,
    },
    /// Joints without torque are not modelled.
    FreeJoints {
        /// Number of free joints.
        found: usize,
    },
    /// The split rule is not (54).
    Split,
    /// A wheel that is not a separate body.
    WeldedWheel {
        /// Name of the wheel.
        wheel: String,
    },
    /// No mass remains without arm and wheels.
    NoMass,
    /// The number of positions differs from the number of joints.
    JointPositions {
        /// Number of the machine's joints.
        expected: usize,
        /// Number of positions.
        found: usize,
    },
    /// Positions that are not finite or at which a linkage cannot close.
    Posture,
    /// The wheels of an axle are not abreast.
    Axle {
        /// "front" or "rear".
        axle: &'static str,
        /// Largest distance (m).
        allowed: f64,
        /// Distance (m).
        found: f64,
    },
    /// The wheels of a side are not in line.
    HalfTrack {
        /// "left" or "right".
        side: &'static str,
        /// Largest distance (m).
        allowed: f64,
        /// Distance (m).
        found: f64,
    },
}

impl std::error::Error for ClosedFormError {}

impl fmt::Display for ClosedFormError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&match self {
            Self::Wheels { found } => say!("the closed form needs four wheels, found {found}"),
            Self::FreeJoints { found } => {
                say!("the closed form needs a machine without free joints, found {found}")
            }
            Self::Split => word!(
                "the closed form needs four wheels at four corners that share the load by a stated share of the front axle, found springs"
            )
            .into(),
            Self::WeldedWheel { wheel } => {
                say!("the closed form needs wheels on joints of their own, found wheel \"{wheel}\" welded")
            }
            Self::NoMass => {
                word!("the closed form needs a platform with mass, found none besides arm and wheels").into()
            }
            Self::JointPositions { expected, found } => {
                say!("expected {expected} joint positions, found {found}")
            }
            Self::Posture => word!("expected joint positions in which every linkage closes").into(),
            Self::Axle {
                axle,
                allowed,
                found,
            } => say!(
                "the closed form needs the {} wheels abreast within {allowed:.3} m, found {found:.3} m",
                told(axle)
            ),
            Self::HalfTrack {
                side,
                allowed,
                found,
            } => say!(
                "the closed form needs the {} wheels in line within {allowed:.3} m, found {found:.3} m",
                told(side)
            ),
        })
    }
}
