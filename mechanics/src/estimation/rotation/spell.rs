//! A rotation of the platform about an edge.

use nalgebra::Vector3;

use super::reference::{Claim, rotation};
use crate::number::normal_density;

named! {
    /// Which measurement shows a rotation.
    pub enum RotationWitness {
        /// The angular velocity and the attitude.
        Both,
        /// The angular velocity: there is no attitude.
        GyroAlone,
        /// The attitude: there is no angular velocity.
        AttitudeAlone,
        /// The angular velocity. The attitude contradicts it.
        GyroNotAttitude,
        /// The attitude. The angular velocity contradicts it.
        AttitudeNotGyro,
        /// The attitude, and the angular velocity by as much about another edge: the axes of one of them are wrong.
        OtherEdges,
    }
}

impl RotationWitness {
    /// Whether one measurement contradicts the other.
    #[must_use]
    pub fn is_contradicted(self) -> bool {
        matches!(self, Self::GyroNotAttitude | Self::AttitudeNotGyro)
    }

    /// Whether the numbers of the rotation come from the angular velocity.
    #[must_use]
    pub fn is_by_gyro(self) -> bool {
        matches!(self, Self::Both | Self::GyroAlone | Self::GyroNotAttitude)
    }

    /// Whether angular velocity and attitude both show a rotation, about the same edge or not.
    #[must_use]
    pub fn is_both(self) -> bool {
        matches!(self, Self::Both | Self::OtherEdges)
    }

    /// Returns the probability that the sensors that show a rotation do not err together.
    pub(super) fn soundness(self) -> f64 {
        match self {
            Self::Both => 0.9999,
            Self::GyroAlone | Self::AttitudeAlone | Self::OtherEdges => 0.99,
            Self::GyroNotAttitude | Self::AttitudeNotGyro => 0.9,
        }
    }
}

/// A rotation of the platform about an edge of its support polygon, farther than tyres, suspension and ground explain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationSpell {
    /// Index of the edge, see [`PlatformRotation::edge_name`](super::PlatformRotation::edge_name).
    pub edge: usize,
    /// The edge by the angular velocity, for [`RotationWitness::OtherEdges`]: the rotation is about one of both edges.
    pub other_edge: Option<usize>,
    /// Stamp at which the rotation exceeded what the reference follows (ns).
    pub left_ns: i64,
    /// Stamp at which the rotation became certain (ns).
    pub certain_ns: i64,
    /// Rotation outwards from the reference at the last sample (rad).
    pub angle: f64,
    /// Rate at which the rotation grows (rad/s).
    pub rate: f64,
    /// Largest rotation so far (rad).
    pub largest: f64,
    /// Stamp of the largest rotation (ns).
    pub largest_ns: i64,
    /// Standard deviation of the rotation that tyres, ground and sensor explain (rad).
    pub sigma: f64,
    /// Largest rotation about the edge by a ramp and soft ground until the rotation was certain (rad).
    pub by_ground: f64,
    /// The measurement that shows the rotation.
    pub witness: RotationWitness,
    /// Probability that the platform rotates about the edge, and not the ground under it or the sensor.
    pub certainty: f64,
    /// Stamp since which the platform has rested on its side (ns).
    pub at_rest_ns: Option<i64>,
    /// Stamp since which the platform has rested between its wheels and its side (ns). Gravity does not let it: the ground gave
    /// way under it, or something props it.
    pub rested_ns: Option<i64>,
    /// Whether the log or the session began while the platform rotated: the start of the rotation is unknown then.
    pub is_from_start: bool,
    /// Stamp of the last sample that shows the rotation (ns).
    pub last_ns: i64,
}

impl RotationSpell {
    /// Rotation from which a platform no longer stands on any wheel (rad): 60 degrees.
    pub const TUMBLES: f64 = std::f64::consts::FRAC_PI_3;

    /// Rotation between two up directions about an axis, all in base axes (rad).
    #[must_use]
    pub fn rotation_between(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
        rotation(from, to, axis)
    }
}

/// Largest rotation considered (rad).
const LARGEST: f64 = std::f64::consts::FRAC_PI_2;

/// Probability of a rotation, one as likely as none beforehand.
///
/// ```text
///     rotates: angle anywhere from 0 to 90 degrees,      does not: angle ~ N(0, sigma^2)
/// ```
pub(super) fn certainty(claim: &Claim, witness: RotationWitness) -> f64 {
    let (angle, sigma) = (claim.beyond_ground(), claim.sigma);
    let rotates = 1.0 / LARGEST;
    witness.soundness() * rotates / (rotates + normal_density(angle, sigma))
}
