//! Kinds of faults of a sample, and the parts that they affect.

use super::explanation::Explanation;
use crate::machine::{FaultKind, Machine, Policy};
use crate::state::{NumberKind, Reason, Sensor};

/// The part of a sample that is judged separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Part {
    /// Position and velocity of the joint with this index.
    Joint(usize),
    /// Specific force of the IMU.
    SpecificForce,
    /// Angular velocity of the IMU or of the odometry.
    AngularVelocity,
    /// Orientation of the IMU or of the odometry.
    Attitude,
    /// Velocity of the odometry.
    Velocity,
    /// Motion of the arm with the lean of the platform.
    Lean,
    /// Specific force with attitude, angular velocity and odometry.
    Acceleration,
    /// Inclinations by IMU and odometry.
    Tilt,
    /// Angular velocity with the change of the attitude.
    Rotation,
    /// Angular velocity about the vertical with another.
    Yaw(YawBy),
    /// Velocity by the odometry with that by the wheels.
    Rolling,
    /// Specific force with the change of the wheels' speed.
    Drive,
    /// Force on the tool.
    ToolForce,
    /// Moment on the tool.
    ToolMoment,
    /// Actuator force of the actuated joint with this index, or a pressure in its cylinder.
    Actuator(usize),
    /// The number of a load sensor, or of a signal of payloads.
    Number,
}

/// Source of the angular velocity about the vertical that the measured one is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum YawBy {
    /// The odometry.
    Odometry,
    /// The speeds of the wheels.
    Speeds,
    /// The steering of the wheels.
    Steering,
}

/// The faulty numbers of a part: its values or their measured derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Component {
    /// The values.
    Value,
    /// The derivatives; only joints have them.
    Rate,
}

/// A fault of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The sensor.
    pub sensor: Sensor,
    /// The affected part of its sample.
    pub part: Part,
    /// The kind of fault.
    pub kind: FaultKind,
    /// The affected numbers of the part.
    pub component: Component,
    /// The treatment.
    pub policy: Policy,
    /// Start of the fault (ns): the stamp of this sample or, if several samples are needed, of an earlier one.
    pub since_ns: i64,
    /// Stamp since which the fault may be there (ns): `since_ns`, or earlier, where nothing before that told of the sensor.
    pub possible_since_ns: i64,
    /// Stamp of this sample (ns).
    pub stamp_ns: i64,
    /// Magnitude of the fault, in the unit of its kind: the value out of range, the rate, the time for which the
    /// signal has been frozen, the norm of the quaternion, the difference of velocity or gravity, the logarithm of the
    /// likelihood ratio of a contradiction, or by how much a joint has jumped since it contradicts itself (signed), an attitude (rad), or a
    /// specific force (m/s^2); 1 for a value that is not finite.
    pub measure: f64,
    /// Limit for `measure`, in the same unit; NaN if there is none.
    pub limit: f64,
    /// Possible error of the value (in its unit) and of its derivative.
    pub amount: Amount,
    /// The most likely explanation of the fault; `None` for a fault of one signal.
    pub explanation: Option<Explanation>,
}

impl Finding {
    /// Whether rows that depend on the faulty part must not be used: because of the policy, or because a value is not finite. A
    /// contradiction between sensors never forbids rows: it makes them doubtful. Neither does an outlier, which the estimate
    /// bridges.
    /// `has_imu`: whether there is an IMU, with which loads do not require the odometry.
    #[must_use]
    pub fn forbids_rows(&self, has_imu: bool) -> bool {
        let is_needed = self.part.reason(self.sensor, has_imu).is_some();
        let leaves_rows = matches!(self.kind, FaultKind::Contradiction | FaultKind::Outlier);
        let is_unusable = self.policy == Policy::Invalid && !leaves_rows;
        is_needed && (is_unusable || self.lacks_a_value())
    }

    /// Whether the fault casts doubt on rows: a contradiction between sensors of which the loads require one. An attitude that
    /// jumps without the gyro leaves open what in the IMU failed, and the loads rest on its specific force.
    #[must_use]
    pub fn casts_doubt(&self, has_imu: bool) -> bool {
        let is_needed = self.part.reason(self.sensor, has_imu).is_some()
            || (self.sensor, self.part) == (Sensor::Imu, Part::Attitude);
        self.kind == FaultKind::Contradiction && self.policy != Policy::Report && is_needed
    }

    /// Whether a value that the estimate requires is not finite.
    pub(crate) fn lacks_a_value(&self) -> bool {
        self.kind == FaultKind::NotFinite
            && self.component == Component::Value
            && self.part != Part::Attitude
    }
}

/// The name of a number in events.
fn subject_of_number(sensor: Sensor, machine: &Machine) -> String {
    match sensor {
        Sensor::Number(NumberKind::Load, index) => {
            format!("load.{}", machine.load_sensors()[index].name)
        }
        Sensor::Number(NumberKind::Payload, index) => format!("payload_signal.{index}"),
        Sensor::Number(NumberKind::Force, index) => {
            let linkage = machine.force_signals()[index].linkage;
            let name = machine.linkages()[linkage].name.to_lowercase();
            format!("actuator.{name}")
        }
        _ => "number".into(),
    }
}

/// Possible error of a signal: one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Amount {
    /// Error of the value (in its unit).
    pub value: f64,
    /// Error of the value's derivative (per second).
    pub rate: f64,
}

impl Part {
    /// Name in events: the signal, then the quantity or the joint.
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
            Self::Lean => return "imu.angular_velocity against joint_states".into(),
            Self::Acceleration => {
                return "imu.specific_force against gravity and odometry.velocity".into();
            }
            Self::Tilt => return "imu.attitude against odometry.attitude".into(),
            Self::Rotation => return "imu.angular_velocity against imu.attitude".into(),
            Self::Yaw(YawBy::Odometry) => {
                return "imu.angular_velocity against odometry.angular_velocity".into();
            }
            Self::Yaw(YawBy::Speeds) => {
                return "imu.angular_velocity against the speeds of the wheels".into();
            }
            Self::Yaw(YawBy::Steering) => {
                return "imu.angular_velocity against the steering of the wheels".into();
            }
            Self::Drive => return "imu.specific_force against the speeds of the wheels".into(),
            Self::Rolling => return "odometry.velocity against the wheels".into(),
            Self::ToolForce => "force",
            Self::ToolMoment => "moment",
            Self::Number => return subject_of_number(sensor, machine),
            Self::Actuator(joint) => {
                let joint = &machine.contact().actuated_joints[joint];
                let name = joint.name(machine.linkages());
                return format!("actuator.{}", name.to_lowercase());
            }
        };
        let signal = match sensor {
            Sensor::Joints(_) => "joint_states",
            Sensor::Imu => "imu",
            Sensor::Odometry => "odometry",
            Sensor::ToolWrench => "tool_wrench",
            Sensor::Number(kind, _) => kind.name(),
        };
        format!("{signal}.{quantity}")
    }

    /// Probability that the loads are right although this relation does not hold, all sensors of it being equally likely to be
    /// wrong: the loads rest on the joints, the specific force and, little, on the gyro.
    #[must_use]
    pub fn loads_are_right(self, explanation: Explanation) -> f64 {
        match self {
            Self::Lean => match explanation {
                // the gyro shows otherwise: it, and not the arm, may be wrong
                Explanation::Sign(_)
                | Explanation::HalfTurn(_)
                | Explanation::Exchanged(..)
                | Explanation::Stopped => 0.5,
                _ => 0.1,
            },
            // the loads rest on the specific force, not on the velocity beside it
            Self::Acceleration if matches!(explanation, Explanation::Speed(_)) => 0.9,
            // attitude and specific force agree: the housing of both is turned, or the velocity is wrong
            Self::Acceleration
                if matches!(
                    explanation,
                    Explanation::HousingHalfTurn(_) | Explanation::HousingQuarterTurn(..)
                ) =>
            {
                0.5
            }
            // the attitude, the gyro, or all that the IMU sends: only the last is what the loads rest on
            Self::Attitude => 2.0 / 3.0,
            // specific force, attitude and velocity: one of three is what the loads rest on
            Self::Acceleration => 2.0 / 3.0,
            // one side of a jump is right: this one or the other
            Self::Joint(_) | Self::SpecificForce | Self::Drive | Self::Rotation | Self::Yaw(_) => {
                0.5
            }
            _ => 1.0,
        }
    }

    /// Units of the part's value and of its derivative.
    fn units(self, machine: &Machine) -> [&'static str; 2] {
        match self {
            Self::Joint(joint) if machine.joint_slides(joint) => ["m", "m/s"],
            Self::Joint(_) => ["rad", "rad/s"],
            Self::SpecificForce => ["m/s^2", "m/s^3"],
            Self::AngularVelocity => ["rad/s", "rad/s^2"],
            Self::Attitude | Self::Lean => ["-", "-"],
            Self::Acceleration => ["m/s^2", "m/s^3"],
            Self::Tilt | Self::Rotation | Self::Yaw(_) => ["rad", "rad/s"],
            Self::Rolling => ["m", "m/s"],
            Self::Velocity | Self::Drive => ["m/s", "m/s^2"],
            Self::ToolForce => ["N", "N/s"],
            Self::ToolMoment => ["N m", "N m/s"],
            // in whichever unit it is measured
            Self::Number => ["-", "-"],
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
            FaultKind::OutOfRange | FaultKind::Saturated | FaultKind::JointLimit => value,
            FaultKind::Outlier => value,
            FaultKind::Contradiction if matches!(self, Self::Joint(_) | Self::SpecificForce) => {
                value
            }
            FaultKind::Contradiction if self == Self::Attitude => "rad",
            // the logarithm of a likelihood ratio
            FaultKind::Contradiction => "-",
            FaultKind::Disagreement if self == Self::Attitude => "m/s^2",
            FaultKind::ImpossibleRate | FaultKind::Disagreement => rate,
            FaultKind::Frozen => "s",
            FaultKind::NotUnit => "-",
        }
    }

    /// Returns the reason for which a row that depends on this part is invalid; `None` for parts that the loads do not require:
    /// attitude, odometry besides an IMU, and actuator forces.
    pub(crate) fn reason(self, sensor: Sensor, has_imu: bool) -> Option<Reason> {
        match (sensor, self) {
            (Sensor::Joints(_), _) => Some(Reason::JointsFault),
            (Sensor::Imu, Self::Attitude) => None,
            (Sensor::Imu, _) => Some(Reason::ImuFault),
            (Sensor::Odometry, _) => (!has_imu).then_some(Reason::OdometryFault),
            (Sensor::ToolWrench, _) => Some(Reason::ToolWrenchFault),
            // without the mass of its payload a machine has no loads
            (Sensor::Number(NumberKind::Payload, _), _) => Some(Reason::ToolWrenchFault),
            // Without an actuator's force the split rule applies. What else tells a number is missing or not.
            (Sensor::Number(..), _) => None,
        }
    }

    /// Returns the index of the part among the filters that its sensor feeds.
    pub(crate) fn slot(self) -> usize {
        match self {
            Self::Joint(_)
            | Self::SpecificForce
            | Self::Lean
            | Self::Acceleration
            | Self::Tilt
            | Self::Rotation
            | Self::Yaw(_)
            | Self::Rolling
            | Self::Drive
            | Self::Velocity
            | Self::ToolForce
            | Self::ToolMoment
            | Self::Actuator(_)
            | Self::Number => 0,
            Self::AngularVelocity => 1,
            Self::Attitude => 2,
        }
    }
}
