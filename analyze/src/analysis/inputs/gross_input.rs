//! A gross input: the error, the evidence, and the likely correction.

use schemars::JsonSchema;
use serde::Serialize;

/// An input that is grossly wrong. While one stands, every row is invalid and no lift or tip-over is claimed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct GrossInput {
    /// Its kind.
    pub kind: GrossInputKind,
    /// What is wrong, in one sentence.
    pub headline: String,
    /// The numbers behind it, one statement each.
    pub evidence: Vec<String>,
    /// The likely correction.
    pub fix: String,
}

tipwatch_mechanics::named! {
    /// Kinds of gross inputs.
    #[derive(PartialOrd, Ord, JsonSchema)]
    #[schemars(rename_all = "snake_case")]
    pub enum GrossInputKind {
        /// The specific force does not have the length of gravity.
        SpecificForceScale,
        /// At rest the specific force does not point away from the ground.
        SpecificForceDirection,
        /// The angular velocity is not the change of the attitude or of the heading.
        AngularVelocityScale,
        /// Positions of joints are in another unit.
        JointPositionScale,
        /// Velocities of joints are not the derivative of their positions.
        JointVelocityScale,
        /// The attitude is in another unit, not a rotation, or contradicts the specific force.
        Attitude,
        /// Loads follow from the attitude, but no tilt is measured.
        SlopeUnknown,
        /// The velocity of the odometry does not fit the wheels.
        OdometryScale,
        /// The velocities of left and right wheels contradict the turn of the machine.
        WheelsExchanged,
        /// Forces or pressures of actuators are in another unit.
        ActuatorScale,
        /// The machine stands still in a state in which it would tip over.
        RestsWhileTipping,
    }
}

impl GrossInputKind {
    /// Whether gyro or attitude, or the axes of both, are unusable: then they show no rotation.
    pub(crate) fn hides_rotations(self) -> bool {
        matches!(
            self,
            Self::SpecificForceDirection | Self::AngularVelocityScale | Self::Attitude
        )
    }
}
