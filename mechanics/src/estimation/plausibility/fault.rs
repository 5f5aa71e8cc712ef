//! What can be wrong with a sample, and with which part of it.

use crate::machine::{FaultKind, Machine, Policy};
use crate::state::{Reason, Sensor};

/// The part of a sensor's sample that is judged by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Part {
    /// Position and rate of the joint of this index.
    Joint(usize),
    /// Specific force of the IMU.
    SpecificForce,
    /// Angular velocity of the IMU or of the odometry.
    AngularVelocity,
    /// Orientation of the IMU or of the odometry.
    Attitude,
    /// Velocity of the odometry.
    Velocity,
    /// Force on the tool.
    ToolForce,
    /// Moment on the tool.
    ToolMoment,
    /// Force of the actuator of the actuated joint of this index, or a pressure in its cylinder.
    Actuator(usize),
}

/// Whether the values or their measured rates are at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Component {
    /// The values.
    Value,
    /// The rates; only joints have them.
    Rate,
}

/// What is wrong with one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The sensor.
    pub sensor: Sensor,
    /// The part of its sample.
    pub part: Part,
    /// What is wrong.
    pub kind: FaultKind,
    /// With which numbers of the part.
    pub component: Component,
    /// What becomes of it.
    pub policy: Policy,
    /// When it began (ns): the stamp of this sample or, where several samples tell, of an earlier one.
    pub since_ns: i64,
    /// Stamp of this sample (ns).
    pub stamp_ns: i64,
    /// How bad it is, in the unit of its kind: the value out of range, the rate, how long the signal has
    /// been frozen, the length of the quaternion, the difference of the rates or of gravity; 1 of a value that
    /// is not finite.
    pub measure: f64,
    /// What `measure` was held against, in the same unit; NaN where nothing is.
    pub limit: f64,
    /// By how much the value may be wrong (in its unit), and its rate.
    pub amount: Amount,
}

impl Finding {
    /// Whether rows rest on it and are not to be used: by the policy, or because a value is no number
    /// at all. `has_imu`: whether an IMU is there, beside which loads do not rest on the odometry.
    #[must_use]
    pub fn forbids_rows(&self, has_imu: bool) -> bool {
        let is_needed = self.part.reason(self.sensor, has_imu).is_some();
        is_needed && (self.policy == Policy::Invalid || self.lacks_a_value())
    }

    /// Whether a value that the estimate needs is not finite.
    pub(crate) fn lacks_a_value(&self) -> bool {
        self.kind == FaultKind::NotFinite
            && self.component == Component::Value
            && self.part != Part::Attitude
    }
}

/// By how much a signal may be wrong: one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Amount {
    /// Of the value (in its unit).
    pub value: f64,
    /// Of its rate (per second).
    pub rate: f64,
}

impl Part {
    /// Its name in events: the signal, then the quantity or the joint.
    #[must_use]
    pub fn subject(self, sensor: Sensor, machine: &Machine) -> String {
        let quantity = match self {
            Self::Joint(joint) => {
                return format!(
                    "joint_states.{}",
                    machine.joints()[joint].name.to_lowercase()
                );
            }
            Self::SpecificForce => "specific_force",
            Self::AngularVelocity => "angular_velocity",
            Self::Attitude => "attitude",
            Self::Velocity => "velocity",
            Self::ToolForce => "force",
            Self::ToolMoment => "moment",
            Self::Actuator(joint) => {
                let joint = &machine.contact().actuated_joints[joint];
                let linkage = &machine.linkages()[joint.linkage];
                return format!("actuator.{}", linkage.name.to_lowercase());
            }
        };
        let signal = match sensor {
            Sensor::Joints(_) => "joint_states",
            Sensor::Imu => "imu",
            Sensor::Odometry => "odometry",
            Sensor::ToolWrench => "tool_wrench",
            Sensor::Actuator(_) => "actuator",
        };
        format!("{signal}.{quantity}")
    }

    /// Units of the part's value and of its rate.
    fn units(self, machine: &Machine) -> [&'static str; 2] {
        match self {
            Self::Joint(joint) if machine.joint_slides(joint) => ["m", "m/s"],
            Self::Joint(_) => ["rad", "rad/s"],
            Self::SpecificForce => ["m/s^2", "m/s^3"],
            Self::AngularVelocity => ["rad/s", "rad/s^2"],
            Self::Attitude => ["-", "-"],
            Self::Velocity => ["m/s", "m/s^2"],
            Self::ToolForce => ["N", "N/s"],
            Self::ToolMoment => ["N m", "N m/s"],
            Self::Actuator(joint)
                if machine.contact().actuated_joints[joint].signals.len() == 1 =>
            {
                ["N", "N/s"]
            }
            Self::Actuator(_) => ["Pa", "Pa/s"],
        }
    }

    /// Unit of [`Finding::measure`] for a fault of this kind.
    #[must_use]
    pub fn measure_unit(self, kind: FaultKind, machine: &Machine) -> &'static str {
        let [value, rate] = self.units(machine);
        match kind {
            FaultKind::NotFinite => "samples",
            FaultKind::OutOfRange | FaultKind::JointLimit => value,
            FaultKind::Disagreement if self == Self::Attitude => "m/s^2",
            FaultKind::ImpossibleRate | FaultKind::Disagreement => rate,
            FaultKind::Frozen => "s",
            FaultKind::NotUnit => "-",
        }
    }

    /// The reason for which a row is invalid that would rest on it; `None` where the loads do not:
    /// attitude, odometry beside an IMU, and forces of actuators.
    pub(crate) fn reason(self, sensor: Sensor, has_imu: bool) -> Option<Reason> {
        match (sensor, self) {
            (Sensor::Joints(_), _) => Some(Reason::JointsFault),
            (Sensor::Imu, Self::Attitude) => None,
            (Sensor::Imu, _) => Some(Reason::ImuFault),
            (Sensor::Odometry, _) => (!has_imu).then_some(Reason::OdometryFault),
            (Sensor::ToolWrench, _) => Some(Reason::ToolWrenchFault),
            // without it the split rule decides
            (Sensor::Actuator(_), _) => None,
        }
    }

    /// Its place among the tracks that its sensor feeds.
    pub(crate) fn slot(self) -> usize {
        match self {
            Self::Joint(_)
            | Self::SpecificForce
            | Self::Velocity
            | Self::ToolForce
            | Self::ToolMoment
            | Self::Actuator(_) => 0,
            Self::AngularVelocity => 1,
            Self::Attitude => 2,
        }
    }
}
