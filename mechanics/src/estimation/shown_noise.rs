//! The noise of the signals as their samples show it, beside what the machine file states.

use super::adaptation::Factors;
use super::followed::Followed;
use crate::machine::EstimatorSpec;
use crate::state::Sensor;

/// Noise of a sensor's signals that the machine file states, and as the samples show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownNoise {
    /// The sensor.
    pub sensor: Sensor,
    /// Key of `[estimator]` in the machine file that states it.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// As stated.
    pub stated: f64,
    /// As the samples show it: for the noise of a measurement the geometric mean over the log, for an agility the root
    /// mean square, which is not below the stated one.
    pub shown: f64,
}

/// Keys and units of a filter's noise: of values, of rates where they are measured, of the process.
type Keys = [Option<(&'static str, &'static str)>; 3];

impl ShownNoise {
    /// What a filter shows.
    pub(super) fn of(
        followed: Followed,
        sensor: Sensor,
        stated: &EstimatorSpec,
        factors: Factors,
    ) -> Vec<Self> {
        let e = stated;
        let (keys, [value, rate, agility]): (Keys, [f64; 3]) = match followed {
            Followed::Joints(_) => (
                [
                    Some(("joint_position_noise", "rad or m")),
                    Some(("joint_rate_noise", "rad/s or m/s")),
                    Some(("joint_agility", "rad/s^2 or m/s^2")),
                ],
                [e.joint_position_noise, e.joint_rate_noise, e.joint_agility],
            ),
            Followed::SpecificForce => (
                [
                    Some(("accelerometer_noise", "m/s^2")),
                    None,
                    Some(("accelerometer_agility", "m/s^4")),
                ],
                [e.accelerometer_noise, 0.0, e.accelerometer_agility],
            ),
            Followed::AngularVelocity => (
                [
                    Some(("gyro_noise", "rad/s")),
                    None,
                    Some(("gyro_agility", "rad/s^3")),
                ],
                [e.gyro_noise, 0.0, e.gyro_agility],
            ),
            Followed::Up => (
                [
                    Some(("attitude_noise", "rad")),
                    None,
                    Some(("attitude_agility", "rad/s^2")),
                ],
                [e.attitude_noise, 0.0, e.attitude_agility],
            ),
            Followed::Velocity => (
                [
                    Some(("odometry_noise", "m/s")),
                    None,
                    Some(("odometry_agility", "m/s^3")),
                ],
                [e.odometry_noise, 0.0, e.odometry_agility],
            ),
            Followed::ToolWrench => (
                [
                    Some(("tool_force_noise", "N or N m")),
                    None,
                    Some(("tool_force_agility", "N/s^2 or N m/s^2")),
                ],
                [e.tool_force_noise, 0.0, e.tool_force_agility],
            ),
            Followed::Actuator(_) => return Vec::new(),
        };
        let factors = [factors.value, factors.rate, factors.density];
        let all = keys.into_iter().zip([value, rate, agility]).zip(factors);
        all.filter_map(|((key, stated), factor)| {
            let (key, unit) = key?;
            Some(Self {
                sensor,
                key,
                unit,
                stated,
                shown: stated * factor.sqrt(),
            })
        })
        .collect()
    }

    /// The shown noise as a multiple of the stated one; NaN where none is stated.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.shown / self.stated
    }
}
