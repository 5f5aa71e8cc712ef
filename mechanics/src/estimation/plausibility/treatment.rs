//! Effect of findings on the sample and on the rows that depend on it.

use super::fault::{Component, Finding, Part};
use crate::machine::FaultKind;
use crate::machine::{Machine, Policy};
use crate::state::SignalNoise;
use crate::state::{Reason, Reasons, Sensor};

/// A larger disagreement is no measure of uncertainty; the sample is not used.
const LARGEST_DOUBT: f64 = 1e6;

/// Treatment of a part of a sample by its filter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Treatment {
    /// The part is not used.
    pub(crate) left_out: bool,
    /// The derivatives of the part are not used.
    pub(crate) rates_left_out: bool,
    /// Added to the variance of a measured value.
    pub(crate) value_variance: f64,
    /// Added to the variance of a measured derivative.
    pub(crate) rate_variance: f64,
}

/// Treatment of a sample, by the filter of each part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Judgement {
    pub(crate) parts: [Treatment; 3],
}

impl Judgement {
    /// Whether the sample is used unchanged.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        *self == Self::default()
    }

    /// The treatment of a sample with these faults.
    pub(crate) fn of(findings: &[Finding]) -> Self {
        let mut judgement = Self::default();
        for finding in findings {
            judgement.add(finding);
        }
        judgement
    }

    pub(crate) fn add(&mut self, finding: &Finding) {
        let treatment = &mut self.parts[finding.part.slot()];
        let is_unusable = finding.kind == FaultKind::NotFinite;
        if finding.policy == Policy::Report && !is_unusable {
            return;
        }
        // Which of the sensors is wrong is unknown. The filters follow all of them, so that rows are valid again as soon
        // as the contradiction ends.
        if finding.kind == FaultKind::Contradiction {
            return;
        }
        // Its rows are invalid; the filter still follows the position, which is continuous across the limit, so
        // that the estimate before and after stays good.
        if finding.kind == FaultKind::JointLimit && finding.policy == Policy::Invalid {
            return;
        }
        if finding.kind == FaultKind::Outlier {
            match finding.component {
                Component::Value => treatment.left_out = true,
                Component::Rate => treatment.rates_left_out = true,
            }
            return;
        }
        if finding.component == Component::Rate {
            treatment.rates_left_out = true;
            if finding.policy == Policy::Widen {
                treatment.value_variance += finding.amount.value.powi(2);
            }
            return;
        }
        let doubt = finding.amount.value;
        if finding.policy == Policy::Widen && !is_unusable && doubt < LARGEST_DOUBT {
            treatment.value_variance += doubt * doubt;
            treatment.rate_variance += finding.amount.rate.powi(2);
        } else {
            treatment.left_out = true;
        }
    }
}

/// Effect of present faults on a row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RowEffect {
    pub(crate) reasons: Reasons,
    /// Added to the variances of joint positions and velocities.
    joint: [f64; 2],
    specific_force: f64,
    angular_velocity: f64,
    tool_wrench: f64,
}

impl RowEffect {
    pub(crate) fn add(&mut self, finding: &Finding, machine: &Machine, has_imu: bool) {
        let reason = finding.part.reason(finding.sensor, has_imu);
        if finding.kind == FaultKind::Contradiction {
            // The row stays valid: which of the sensors is wrong is unknown.
            if finding.casts_doubt(has_imu) {
                self.reasons.add(Reason::Contradiction);
            }
            return;
        }
        if matches!(finding.kind, FaultKind::NotFinite | FaultKind::Outlier) {
            // The estimate bridges it like a lost sample; where that lasts too long, a gap invalidates the row.
            return;
        }
        match finding.policy {
            Policy::Invalid => {
                if let Some(reason) = reason {
                    self.reasons.add(reason);
                }
            }
            Policy::Widen if reason.is_some() => self.widen(finding, machine),
            Policy::Widen | Policy::Report => {}
        }
    }

    fn widen(&mut self, finding: &Finding, machine: &Machine) {
        let doubt = finding.amount.value.min(LARGEST_DOUBT).powi(2);
        match finding.part {
            // The noise of all joints is one number, which a wheel's spin must not determine.
            Part::Joint(joint) if machine.joints()[joint].spins_wheel.is_some() => {}
            Part::Joint(_) => {
                self.joint[0] += doubt;
                self.joint[1] += finding.amount.rate.min(LARGEST_DOUBT).powi(2);
            }
            Part::SpecificForce => self.specific_force += doubt,
            // Without an IMU the specific force is derived from the odometry's acceleration.
            Part::Velocity => self.specific_force += finding.amount.rate.powi(2),
            Part::AngularVelocity => self.angular_velocity += doubt,
            Part::Attitude if finding.sensor == Sensor::Odometry => {
                self.specific_force += (doubt.sqrt().min(2.0) * machine.gravity()).powi(2);
            }
            Part::Attitude
            | Part::Lean
            | Part::Acceleration
            | Part::Tilt
            | Part::Rotation
            | Part::Yaw(_)
            | Part::Rolling
            | Part::Drive => {}
            Part::ToolForce | Part::ToolMoment => self.tool_wrench += doubt,
            // The accuracy of a force is stated in its linkage.
            Part::Actuator(_) | Part::Number => {}
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.reasons.add_all(other.reasons);
        self.joint[0] += other.joint[0];
        self.joint[1] += other.joint[1];
        self.specific_force += other.specific_force;
        self.angular_velocity += other.angular_velocity;
        self.tool_wrench += other.tool_wrench;
    }

    /// Adds the possible errors to the covariance of an estimate.
    pub(crate) fn enlarge(&self, noise: &mut SignalNoise<f64>) {
        noise.joint.value[0] += self.joint[0];
        noise.joint.first[0] += self.joint[1];
        noise.specific_force += self.specific_force;
        noise.turning[0] += self.angular_velocity;
        noise.tool_wrench += self.tool_wrench;
    }
}
