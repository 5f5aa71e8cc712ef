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

table! {
    /// `[plausibility]`: limits in SI units. The defaults are those of machines of a tonne and more.
    #[derive(Copy)]
    pub struct PlausibilitySpec {
        /// Policy of every check without a policy of its own.
        policy: Option<Policy> = None;
        /// Policy for NaN and infinite values; they are never used.
        not_finite: Option<Policy> = None;
        /// Policy for values outside the range of such a sensor, and at its end.
        range: Option<Policy> = None;
        /// Policy for joint positions beyond the limits of the URDF.
        joint_limit: Option<Policy> = None;
        /// Policy for changes that are too fast, and for single samples far from those around them.
        rate: Option<Policy> = None;
        /// Policy for frozen values.
        frozen: Option<Policy> = None;
        /// Policy for quaternions of non-unit norm.
        quaternion: Option<Policy> = None;
        /// Policy for joint velocities that contradict the derivative of the position, and for attitudes that
        /// contradict the specific force.
        disagreement: Option<Policy> = None;
        /// Policy for sensors that contradict each other by the mechanics of the machine.
        contradiction: Option<Policy> = None;
        /// Largest specific force (m/s^2).
        specific_force_max: f64 = 39.2, positive;
        /// Largest angular velocity (rad/s).
        angular_velocity_max: f64 = 10.0, positive;
        /// Fastest change of an angular velocity (rad/s^2).
        angular_acceleration_max: f64 = 200.0, positive;
        /// Largest speed of the odometry (m/s).
        speed_max: f64 = 40.0, positive;
        /// Fastest change of the odometry velocity (m/s^2).
        acceleration_max: f64 = 50.0, positive;
        /// Largest force on the tool (N); default: ten times the weight.
        tool_force_max: Option<f64> = None, positive;
        /// Largest moment on the tool (N m); default: ten times the weight with a lever arm of one metre.
        tool_moment_max: Option<f64> = None, positive;
        /// Tolerance of a revolute joint beyond a URDF limit (rad).
        joint_margin: f64 = 0.05, positive;
        /// The same for a prismatic joint (m).
        joint_margin_linear: f64 = 0.02, positive;
        /// Factor on the URDF velocity limit of a joint.
        joint_rate_margin: f64 = 2.0, positive;
        /// Largest velocity of a revolute joint without such a limit (rad/s).
        joint_rate_max: f64 = 10.0, positive;
        /// The same for a prismatic joint (m/s).
        joint_rate_max_linear: f64 = 5.0, positive;
        /// The same for a wheel (rad/s).
        wheel_rate_max: f64 = 200.0, positive;
        /// Fastest change of a measured joint velocity (rad/s^2 or m/s^2); wheels are exempt, because brakes lock
        /// them.
        joint_acceleration_max: f64 = 200.0, positive;
        /// Number of identical samples from which a signal counts as frozen, where noise is expected or motion is
        /// detected.
        frozen_samples: u32 = 100, two_or_more;
        /// Tolerance of a quaternion's norm.
        quaternion_tolerance: f64 = 0.01, positive;
        /// Tolerance between a revolute joint's velocity and the derivative of its position (rad/s).
        rate_tolerance: f64 = 0.1, positive;
        /// The same for a prismatic joint (m/s).
        rate_tolerance_linear: f64 = 0.05, positive;
        /// Additional tolerance as a fraction of the velocity.
        rate_tolerance_share: f64 = 0.2, positive;
        /// Tolerance between gravity according to the IMU's attitude and the mean specific force of ten seconds
        /// (m/s^2).
        gravity_tolerance: f64 = 3.0, positive;
        /// Tolerance between the inclinations by the attitudes of IMU and odometry (rad).
        tilt_tolerance: f64 = 0.07, positive;
        /// Rate at which relations between sound sensors may contradict each other by chance (1/h): the thresholds follow.
        false_alarms_per_hour: f64 = 1e-4, positive;
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

    /// Tolerance of a joint beyond a limit of the URDF: of a prismatic one (m), or of a revolute one (rad).
    #[must_use]
    pub fn margin_of(&self, slides: bool) -> f64 {
        match slides {
            true => self.joint_margin_linear,
            false => self.joint_margin,
        }
    }
}
