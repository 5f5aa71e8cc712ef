//! Single changes that an operator controls, and the effect of each on the state of a row.
//!
//! In a state of the window the sensor frame is the base frame, so that `imu` is the motion of the base: specific
//! force f, angular velocity w and angular acceleration alpha at the base origin, in base axes.

use nalgebra::Vector3;
use tipwatch_mechanics::geometry::spatial::cross;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Parameter, Real, State};

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
    pub(super) fn apply<T: Real>(self, amount: f64, entry_speed: f64, state: &mut State<T>) {
        let left = 1.0 - amount;
        match self {
            Self::JointOffset(joint) => state.joints[joint].position += T::constant(amount),
            Self::SlowerArm => slow_joints(left, state),
            Self::SlowerManoeuvre => slow_manoeuvre(left, state),
            Self::LessForwardAcceleration => brake_less(left, entry_speed, state),
            Self::WiderCurve => turn_less(left, state),
            Self::LessToolForce => {
                state.tool_wrench.force *= T::constant(left);
                state.tool_wrench.moment *= T::constant(left);
            }
            Self::LessPayload(_) | Self::LessLinkMass(_) => {}
        }
    }

    /// Returns the machine with this change; `None` if the change leaves the machine as it is.
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

    /// Returns the stable name of the changed quantity.
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
pub(super) fn slow_joints<T: Real>(s: f64, state: &mut State<T>) {
    for joint in &mut state.joints {
        joint.rate *= T::constant(s);
        joint.acceleration *= T::constant(s * s);
    }
}

/// Makes the whole machine travel its path `s` times as fast. The inertial acceleration of the base origin is
/// ```text
///     a = vdot + w x v        v: velocity in base axes, vdot: derivative of its components
/// ```
/// and becomes s^2 a; the rest of the specific force is gravity and stays.
pub(super) fn slow_manoeuvre<T: Real>(s: f64, state: &mut State<T>) {
    slow_joints(s, state);
    let (imu, base) = (&mut state.imu, &mut state.base);
    let acceleration = base.velocity_rate + cross(&imu.angular_velocity, &base.velocity);
    imu.specific_force += acceleration * T::constant(s * s - 1.0);
    imu.angular_velocity *= T::constant(s);
    imu.angular_acceleration *= T::constant(s * s);
    base.velocity *= T::constant(s);
    base.velocity_rate *= T::constant(s * s);
}

/// The forward velocity changes only by the share k of its logged change since the window began:
/// ```text
///     v_x' = v_0 + k (v_x - v_0)      vdot_x' = k vdot_x      a' - a = (k - 1) vdot_x e_x + w x (v_x' - v_x) e_x
/// ```
/// A vehicle that brakes less is faster afterwards, also in a curve.
fn brake_less<T: Real>(k: f64, entry_speed: f64, state: &mut State<T>) {
    let (imu, base) = (&mut state.imu, &mut state.base);
    let along = |x: T| Vector3::new(x.scaled(k - 1.0), T::zero(), T::zero());
    let faster = along(base.velocity.x - T::constant(entry_speed));
    let pushed = along(base.velocity_rate.x);
    imu.specific_force += pushed + cross(&imu.angular_velocity, &faster);
    base.velocity += faster;
    base.velocity_rate += pushed;
}

/// The yaw rate and its derivative times k at the same velocity: a' - a = (k - 1) w_z e_z x v
fn turn_less<T: Real>(k: f64, state: &mut State<T>) {
    let imu = &mut state.imu;
    let yaw = Vector3::new(T::zero(), T::zero(), imu.angular_velocity.z.scaled(k - 1.0));
    imu.specific_force += cross(&yaw, &state.base.velocity);
    imu.angular_velocity += yaw;
    imu.angular_acceleration.z *= T::constant(k);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rigid::rigid;

    const G: f64 = 9.81;

    /// A machine that brakes in a curve at time `t`, its speed v(t), with one joint that moves as q = sin(2 t).
    fn driving(machine: &Machine, t: f64) -> State<f64> {
        let mut state = State::zero(machine);
        let (speed, slowing, curvature) = (5.0 - 1.5 * t, -1.5, 0.1);
        state.base.velocity = Vector3::x() * speed;
        state.base.velocity_rate = Vector3::x() * slowing;
        state.imu.angular_velocity = Vector3::z() * (curvature * speed);
        state.imu.angular_acceleration = Vector3::z() * (curvature * slowing);
        state.imu.specific_force = Vector3::new(slowing, curvature * speed * speed, G);
        state.joints[0].position = (2.0 * t).sin();
        state.joints[0].rate = 2.0 * (2.0 * t).cos();
        state.joints[0].acceleration = -4.0 * (2.0 * t).sin();
        state
    }

    /// Half the speed at every place: lateral acceleration v^2 / R and braking fall to a quarter, gravity stays.
    #[test]
    fn a_slower_manoeuvre_is_the_same_path_in_stretched_time() {
        let mut state = driving(&rigid(), 1.0);
        Change::SlowerManoeuvre.apply(0.5, f64::NAN, &mut state);
        let (speed, joint) = (0.5 * 3.5, state.joints[0]);
        let expected = Vector3::new(-0.25 * 1.5, 0.1 * speed * speed, G);
        assert!((state.imu.specific_force - expected).norm() < 1e-12);
        assert!((state.imu.angular_velocity.z - 0.1 * speed).abs() < 1e-12);
        // q(t / 2) differentiated at t = 2 s
        assert!((joint.position - 2.0_f64.sin()).abs() < 1e-12);
        assert!((joint.rate - 2.0_f64.cos()).abs() < 1e-12);
        assert!((joint.acceleration + 2.0_f64.sin()).abs() < 1e-12);
    }

    /// Less braking leaves more speed for the curve: its lateral acceleration grows.
    #[test]
    fn a_machine_that_brakes_less_is_faster_in_the_curve() {
        let mut state = driving(&rigid(), 1.0);
        Change::LessForwardAcceleration.apply(0.4, 5.0, &mut state);
        let speed = 5.0 - 0.6 * 1.5;
        let expected = Vector3::new(-0.6 * 1.5, 0.35 * speed, G);
        assert!((state.base.velocity.x - speed).abs() < 1e-12);
        assert!((state.imu.specific_force - expected).norm() < 1e-12);
    }

    #[test]
    fn a_wider_curve_at_the_same_speed_has_less_lateral_acceleration() {
        let mut state = driving(&rigid(), 1.0);
        Change::WiderCurve.apply(0.2, 5.0, &mut state);
        let expected = Vector3::new(-1.5, 0.8 * 0.1 * 3.5 * 3.5, G);
        assert!((state.imu.specific_force - expected).norm() < 1e-12);
        assert!((state.imu.angular_velocity.z - 0.8 * 0.35).abs() < 1e-12);
    }

    #[test]
    fn an_amount_of_zero_changes_nothing() {
        let logged = driving(&rigid(), 0.3);
        for change in [
            Change::JointOffset(0),
            Change::SlowerArm,
            Change::SlowerManoeuvre,
            Change::LessForwardAcceleration,
            Change::WiderCurve,
            Change::LessToolForce,
        ] {
            let mut state = logged.clone();
            change.apply(0.0, 5.0, &mut state);
            assert_eq!(
                state.imu.specific_force, logged.imu.specific_force,
                "{change:?}"
            );
            assert_eq!(state.joints, logged.joints, "{change:?}");
        }
    }
}
