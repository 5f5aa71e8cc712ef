//! `[plausibility]` of the machine file: limits of plausible signals, and the treatment of rows that depend on
//! implausible ones.

use serde::Deserialize;

use super::fault_kind::FaultKind;

named! {
    /// Treatment of rows that depend on an implausible sample.
    #[derive(Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Policy {
        /// The sample is not used and the rows are invalid.
        Invalid,
        /// The sample is down-weighted, and the rows' standard deviations grow by the discrepancy.
        Widen,
        /// The finding is reported; the sample is used unchanged.
        Report,
    }
}

/// `[plausibility]`: limits in SI units. The defaults are those of machines of a tonne and more.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlausibilitySpec {
    /// Policy of every check without a policy of its own.
    pub policy: Option<Policy>,
    /// Policy for NaN and infinite values; they are never used.
    pub not_finite: Option<Policy>,
    /// Policy for values outside the range of such a sensor, and at its end.
    pub range: Option<Policy>,
    /// Policy for joint positions beyond the limits of the URDF.
    pub joint_limit: Option<Policy>,
    /// Policy for changes that are too fast, and for single samples far from those around them.
    pub rate: Option<Policy>,
    /// Policy for frozen values.
    pub frozen: Option<Policy>,
    /// Policy for quaternions of non-unit norm.
    pub quaternion: Option<Policy>,
    /// Policy for joint velocities that contradict the derivative of the position, and for attitudes that
    /// contradict the specific force.
    pub disagreement: Option<Policy>,
    /// Policy for sensors that contradict each other by the mechanics of the machine.
    pub contradiction: Option<Policy>,
    /// Largest specific force (m/s^2).
    pub specific_force_max: f64,
    /// Largest angular velocity (rad/s).
    pub angular_velocity_max: f64,
    /// Fastest change of an angular velocity (rad/s^2).
    pub angular_acceleration_max: f64,
    /// Largest speed of the odometry (m/s).
    pub speed_max: f64,
    /// Fastest change of the odometry velocity (m/s^2).
    pub acceleration_max: f64,
    /// Largest force on the tool (N); default: ten times the weight.
    pub tool_force_max: Option<f64>,
    /// Largest moment on the tool (N m); default: ten times the weight with a lever arm of one metre.
    pub tool_moment_max: Option<f64>,
    /// Tolerance of a revolute joint beyond a URDF limit (rad).
    pub joint_margin: f64,
    /// The same for a prismatic joint (m).
    pub joint_margin_linear: f64,
    /// Factor on the URDF velocity limit of a joint.
    pub joint_rate_margin: f64,
    /// Largest velocity of a revolute joint without such a limit (rad/s).
    pub joint_rate_max: f64,
    /// The same for a prismatic joint (m/s).
    pub joint_rate_max_linear: f64,
    /// The same for a wheel (rad/s).
    pub wheel_rate_max: f64,
    /// Fastest change of a measured joint velocity (rad/s^2 or m/s^2); wheels are exempt, because brakes lock
    /// them.
    pub joint_acceleration_max: f64,
    /// Number of identical samples from which a signal counts as frozen, where noise is expected or motion is
    /// detected.
    pub frozen_samples: u32,
    /// Tolerance of a quaternion's norm.
    pub quaternion_tolerance: f64,
    /// Tolerance between a revolute joint's velocity and the derivative of its position (rad/s).
    pub rate_tolerance: f64,
    /// The same for a prismatic joint (m/s).
    pub rate_tolerance_linear: f64,
    /// Additional tolerance as a fraction of the velocity.
    pub rate_tolerance_share: f64,
    /// Tolerance between gravity according to the IMU's attitude and the mean specific force of ten seconds
    /// (m/s^2).
    pub gravity_tolerance: f64,
    /// Tolerance between the inclinations by the attitudes of IMU and odometry (rad).
    pub tilt_tolerance: f64,
    /// Rate at which relations between sound sensors may contradict each other by chance (1/h): the thresholds follow.
    pub false_alarms_per_hour: f64,
}

impl Default for PlausibilitySpec {
    fn default() -> Self {
        Self {
            policy: None,
            not_finite: None,
            range: None,
            joint_limit: None,
            rate: None,
            frozen: None,
            quaternion: None,
            disagreement: None,
            contradiction: None,
            specific_force_max: 39.2,
            angular_velocity_max: 10.0,
            angular_acceleration_max: 200.0,
            speed_max: 40.0,
            acceleration_max: 50.0,
            tool_force_max: None,
            tool_moment_max: None,
            joint_margin: 0.05,
            joint_margin_linear: 0.02,
            joint_rate_margin: 2.0,
            joint_rate_max: 10.0,
            joint_rate_max_linear: 5.0,
            wheel_rate_max: 200.0,
            joint_acceleration_max: 200.0,
            frozen_samples: 100,
            quaternion_tolerance: 0.01,
            rate_tolerance: 0.1,
            rate_tolerance_linear: 0.05,
            rate_tolerance_share: 0.2,
            gravity_tolerance: 3.0,
            tilt_tolerance: 0.07,
            false_alarms_per_hour: 1e-4,
        }
    }
}

impl PlausibilitySpec {
    /// Policy of a check: its own, else the common one, else its default.
    ///
    /// Positions beyond a limit and contradicting velocities are often due to an inaccurate URDF or driver while
    /// the positions are correct: by default they widen the uncertainty, all other faults invalidate the rows.
    #[must_use]
    pub fn policy_of(&self, kind: FaultKind) -> Policy {
        let (own, default) = match kind {
            FaultKind::NotFinite => (self.not_finite, Policy::Invalid),
            FaultKind::OutOfRange | FaultKind::Saturated => (self.range, Policy::Invalid),
            FaultKind::JointLimit => (self.joint_limit, Policy::Widen),
            FaultKind::ImpossibleRate | FaultKind::Outlier => (self.rate, Policy::Invalid),
            FaultKind::Frozen => (self.frozen, Policy::Invalid),
            FaultKind::NotUnit => (self.quaternion, Policy::Invalid),
            FaultKind::Disagreement => (self.disagreement, Policy::Widen),
            FaultKind::Contradiction => (self.contradiction, Policy::Invalid),
        };
        own.or(self.policy).unwrap_or(default)
    }

    /// Limits by key, if stated or with a default.
    pub(super) fn limits_by_key(&self) -> [(&'static str, Option<f64>); 21] {
        [
            ("specific_force_max", Some(self.specific_force_max)),
            ("angular_velocity_max", Some(self.angular_velocity_max)),
            (
                "angular_acceleration_max",
                Some(self.angular_acceleration_max),
            ),
            ("speed_max", Some(self.speed_max)),
            ("acceleration_max", Some(self.acceleration_max)),
            ("tool_force_max", self.tool_force_max),
            ("tool_moment_max", self.tool_moment_max),
            ("joint_margin", Some(self.joint_margin)),
            ("joint_margin_linear", Some(self.joint_margin_linear)),
            ("joint_rate_margin", Some(self.joint_rate_margin)),
            ("joint_rate_max", Some(self.joint_rate_max)),
            ("joint_rate_max_linear", Some(self.joint_rate_max_linear)),
            ("wheel_rate_max", Some(self.wheel_rate_max)),
            ("joint_acceleration_max", Some(self.joint_acceleration_max)),
            ("quaternion_tolerance", Some(self.quaternion_tolerance)),
            ("rate_tolerance", Some(self.rate_tolerance)),
            ("rate_tolerance_linear", Some(self.rate_tolerance_linear)),
            ("rate_tolerance_share", Some(self.rate_tolerance_share)),
            ("gravity_tolerance", Some(self.gravity_tolerance)),
            ("tilt_tolerance", Some(self.tilt_tolerance)),
            ("false_alarms_per_hour", Some(self.false_alarms_per_hour)),
        ]
    }
}
