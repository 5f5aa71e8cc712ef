//! Single changes of what an operator controls, and what each does to the state of a row.
//!
//! In a state of the window the sensor frame is the base frame, so that `imu` is the motion of the base: specific
//! force f, angular velocity w and angular acceleration alpha at the base origin, in base axes.

use nalgebra::Vector3;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Parameter, State};

/// A single change. Its amount is an offset for a joint position, a mass for a mass, and otherwise the share by which
/// a motion or a force becomes smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// A constant offset of a joint's position over the whole window (rad or m).
    JointOffset(usize),
    /// All joints move more slowly on the same path; the base moves as logged.
    SlowerArm,
    /// Machine and joints move more slowly on the same path.
    SlowerManoeuvre,
    /// Less braking and accelerating: a smaller derivative of the forward velocity, the same yaw rate.
    LessForwardAcceleration,
    /// A wider curve: a smaller yaw rate, the same velocity.
    WiderCurve,
    /// A lighter payload (kg).
    LessPayload(usize),
    /// A lighter link at the end of the arm (kg).
    LessLinkMass(usize),
    /// A smaller force and moment on the tool.
    LessToolForce,
}

impl Change {
    /// Changes the state of one row by `amount`. `entry_speed` is the forward velocity (m/s) in the window's first row.
    pub(super) fn apply(self, amount: f64, entry_speed: f64, state: &mut State<f64>) {
        let left = 1.0 - amount;
        match self {
            Self::JointOffset(joint) => state.joints[joint].position += amount,
            Self::SlowerArm => slow_joints(left, state),
            Self::SlowerManoeuvre => slow_manoeuvre(left, state),
            Self::LessForwardAcceleration => brake_less(left, entry_speed, state),
            Self::WiderCurve => turn_less(left, state),
            Self::LessToolForce => {
                state.tool_wrench.force *= left;
                state.tool_wrench.moment *= left;
            }
            Self::LessPayload(_) | Self::LessLinkMass(_) => {}
        }
    }

    /// The machine with this change; `None` if the change leaves it as it is.
    pub(super) fn changed_machine(self, amount: f64, machine: &Machine) -> Option<Machine> {
        let parameter = match self {
            Self::LessPayload(payload) => Parameter::PayloadMass(payload),
            Self::LessLinkMass(link) => Parameter::LinkMass(link),
            _ => return None,
        };
        Some(machine.changed(&[(parameter, -amount)]))
    }

    /// The signal or parameter that changes by the amount itself, if there is one.
    pub(super) fn parameter(self) -> Option<Parameter> {
        match self {
            Self::JointOffset(joint) => Some(Parameter::JointPosition(joint)),
            Self::LessPayload(payload) => Some(Parameter::PayloadMass(payload)),
            Self::LessLinkMass(link) => Some(Parameter::LinkMass(link)),
            _ => None,
        }
    }

    /// Sign of the reported change for a positive amount.
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::JointOffset(_) => 1.0,
            _ => -1.0,
        }
    }

    /// Stable name of what changes.
    pub(super) fn name(self, machine: &Machine) -> String {
        match self {
            Self::SlowerArm => "arm.speed".into(),
            Self::SlowerManoeuvre => "manoeuvre.speed".into(),
            Self::LessForwardAcceleration => "base.forward_acceleration".into(),
            Self::WiderCurve => "base.yaw_rate".into(),
            Self::LessToolForce => "tool.wrench".into(),
            Self::JointOffset(_) | Self::LessPayload(_) | Self::LessLinkMass(_) => self
                .parameter()
                .map_or_else(String::new, |parameter| parameter.name(machine)),
        }
    }

    /// Unit of the change.
    pub(super) fn unit(self, machine: &Machine) -> &'static str {
        self.parameter()
            .map_or("-", |parameter| parameter.unit(machine))
    }
}

/// A path that is travelled `s` times as fast: velocities times s, accelerations times s^2.
fn slow_joints(s: f64, state: &mut State<f64>) {
    for joint in &mut state.joints {
        joint.rate *= s;
        joint.acceleration *= s * s;
    }
}

/// The same for the whole machine. The inertial acceleration of the base origin is
/// ```text
///     a = vdot + w x v        v: velocity in base axes, vdot: derivative of its components
/// ```
/// and becomes s^2 a; the rest of the specific force is gravity and stays.
fn slow_manoeuvre(s: f64, state: &mut State<f64>) {
    slow_joints(s, state);
    let (imu, base) = (&mut state.imu, &mut state.base);
    let acceleration = base.velocity_rate + imu.angular_velocity.cross(&base.velocity);
    imu.specific_force += acceleration * (s * s - 1.0);
    imu.angular_velocity *= s;
    imu.angular_acceleration *= s * s;
    base.velocity *= s;
    base.velocity_rate *= s * s;
}

/// The forward velocity changes only by the share k of its logged change since the window began:
/// ```text
///     v_x' = v_0 + k (v_x - v_0)      vdot_x' = k vdot_x      a' - a = (k - 1) vdot_x e_x + w x (v_x' - v_x) e_x
/// ```
/// A vehicle that brakes less is faster afterwards, also in a curve.
fn brake_less(k: f64, entry_speed: f64, state: &mut State<f64>) {
    let (imu, base) = (&mut state.imu, &mut state.base);
    let faster = Vector3::x() * ((k - 1.0) * (base.velocity.x - entry_speed));
    let pushed = Vector3::x() * ((k - 1.0) * base.velocity_rate.x);
    imu.specific_force += pushed + imu.angular_velocity.cross(&faster);
    base.velocity += faster;
    base.velocity_rate += pushed;
}

/// The yaw rate and its derivative times k at the same velocity: a' - a = (k - 1) w_z e_z x v
fn turn_less(k: f64, state: &mut State<f64>) {
    let imu = &mut state.imu;
    let yaw = Vector3::z() * ((k - 1.0) * imu.angular_velocity.z);
    imu.specific_force += yaw.cross(&state.base.velocity);
    imu.angular_velocity += yaw;
    imu.angular_acceleration.z *= k;
}
