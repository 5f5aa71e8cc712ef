//! The noise of joints as their samples show it, beside what the machine file states.

use tipwatch_language::word;

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
    /// Unit of the noise.
    pub unit: &'static str,
    /// Noise as the machine file states it.
    pub stated: f64,
    /// Noise as the samples show it: for the noise of a measurement the geometric mean over the log, for an agility the root mean
    /// square, which is not below the stated one.
    pub shown: f64,
}

impl ShownNoise {
    /// Returns the stated noise of a filter's joints and the noise by the estimated `factors`; nothing for filters of other
    /// sensors, which keep the stated noise.
    pub(super) fn of(
        followed: Followed,
        sensor: Sensor,
        stated: &EstimatorSpec,
        factors: Factors,
    ) -> Vec<Self> {
        // the filters of the other sensors keep what is stated
        let Followed::Joints(_) = followed else {
            return Vec::new();
        };
        let e = stated;
        let stated = [
            (
                "joint_position_noise",
                word!("rad or m"),
                e.joint_position_noise,
            ),
            (
                "joint_rate_noise",
                word!("rad/s or m/s"),
                e.joint_rate_noise,
            ),
            ("joint_agility", word!("rad/s^2 or m/s^2"), e.joint_agility),
        ];
        let factors = [factors.value, factors.rate, factors.density];
        let all = stated.into_iter().zip(factors);
        all.map(|((key, unit, stated), factor)| Self {
            sensor,
            key,
            unit,
            stated,
            shown: stated * factor.sqrt(),
        })
        .collect()
    }

    /// The shown noise as a multiple of the stated one; NaN where none is stated.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.shown / self.stated
    }
}
