//! The state of a machine at one instant: the complete input of the memoryless equations.

use nalgebra::Vector3;

use crate::geometry::coordinate::Motion;
use crate::geometry::spatial::Wrench;
use crate::machine::{BaseMotion, Machine, Parameter, Payload};
use crate::number::Real;

/// The state at one instant, or at several instants at once: see [`Real`].
#[derive(Debug, Clone)]
pub struct State<T> {
    /// Motion of [`Machine::joints`], in their order.
    pub joints: Vec<Motion<T>>,
    /// Measurement of the IMU, in its own frame.
    pub imu: ImuState<T>,
    /// Force and moment of the surroundings on the tool, about the origin of the tool frame and in its axes
    /// (N, N m); zero without a tool load.
    pub tool_wrench: Wrench<T>,
    /// Actuator force of each of the [`actuated joints`](crate::machine::Contact::actuated_joints) (N),
    /// positive when it extends the rod; NaN where unknown, which leaves the load split to the split rule.
    pub actuator_force: Vec<T>,
    /// Share of each of [`Machine::payloads`] that is attached to its link: 1 or 0; the mass (kg) of one whose mass a signal
    /// states.
    pub payload_share: Vec<T>,
    /// 1 where the measured loads of all supports replace the computed total load and its place, because a load is there
    /// that the machine does not state; 0 elsewhere.
    pub follows_supports: T,
    /// Attitude and velocity of the base, in addition to the IMU's measurement.
    pub base: BaseState<T>,
    /// Covariance of the numbers above due to signal noise.
    pub noise: SignalNoise<T>,
    /// Lag of the numbers above behind a motion that changes fast; zero where later samples are known, too.
    pub lag: Lag<T>,
}

/// Lag of a causal filter's estimates behind a motion that changes fast, in addition to their noise. The errors belong together:
/// they have the signs of one motion.
#[derive(Debug, Clone)]
pub struct Lag<T> {
    /// Lag of the acceleration, by joint (rad/s^2 or m/s^2). Position and velocity lag in proportion to the last column of the
    /// covariance of a joint's noise.
    pub joints: Vec<T>,
    /// Lag of the specific force (m/s^2).
    pub specific_force: Vector3<T>,
    /// Lag of the angular velocity (rad/s).
    pub angular_velocity: Vector3<T>,
    /// Lag of the angular acceleration (rad/s^2).
    pub angular_acceleration: Vector3<T>,
}

/// Largest deviation of the length of a stated upward unit vector from 1.
pub const UNIT_TOLERANCE: f64 = 0.01;

/// Attitude and velocity of the base, in base axes; NaN where unknown.
///
/// The loads do not depend on them. They separate the specific force into slope, acceleration and cornering.
#[derive(Debug, Clone, Copy)]
pub struct BaseState<T> {
    /// Unit vector pointing up, against gravity.
    pub up: Vector3<T>,
    /// Velocity of the base origin (m/s).
    pub velocity: Vector3<T>,
    /// Time derivative of the components of that velocity (m/s^2): not the inertial acceleration.
    pub velocity_rate: Vector3<T>,
}

/// Covariance of a channel's value and its first and second time derivative.
#[derive(Debug, Clone, Copy)]
pub struct JetCovariance<T> {
    /// Value with value, with first and with second derivative.
    pub value: [T; 3],
    /// First with first and with second derivative.
    pub first: [T; 2],
    /// Second with second derivative.
    pub second: T,
}

/// Covariance of the estimated state due to the noise of the signals; zero where nothing was measured. For
/// several channels of a kind, the largest.
#[derive(Debug, Clone, Copy)]
pub struct SignalNoise<T> {
    /// Covariance of a joint's position, velocity and acceleration.
    pub joint: JetCovariance<T>,
    /// Variance of a component of the specific force (m^2/s^4).
    pub specific_force: T,
    /// The systematic error of the specific force, as far as the signals have narrowed it down.
    pub accelerometer_bias: AccelerometerBias<T>,
    /// Variance of a component of the angular velocity, its covariance with the angular acceleration, and the variance of the
    /// latter (rad^2/s^2, rad^2/s^3, rad^2/s^4).
    pub turning: [T; 3],
    /// Variance of a component of the tool wrench (N^2 or N^2 m^2).
    pub tool_wrench: T,
    /// Variance of the mass of a payload that is estimated row by row (kg^2).
    pub payload_mass: T,
}

/// Estimate of an accelerometer's bias, in IMU axes; zero where it is as uncertain as the machine file states.
#[derive(Debug, Clone, Copy)]
pub struct AccelerometerBias<T> {
    /// The bias that was subtracted from the measured specific force (m/s^2).
    pub removed: Vector3<T>,
    /// Covariance of the bias less the stated one, which is not positive: xx, yy, zz, xy, xz, yz (m^2/s^4).
    pub covariance_change: [T; 6],
}

/// Measurement of an inertial measurement unit fixed to its body, in its own frame.
#[derive(Debug, Clone, Copy)]
pub struct ImuState<T> {
    /// Acceleration minus gravity (m/s^2): points up at rest.
    pub specific_force: Vector3<T>,
    /// Angular velocity (rad/s).
    pub angular_velocity: Vector3<T>,
    /// Angular acceleration (rad/s^2).
    pub angular_acceleration: Vector3<T>,
}

impl<T: Real> State<T> {
    /// No motion, no specific force (not even gravity), no noise; payloads without a time limit are attached;
    /// attitude and velocity of the base are unknown.
    #[must_use]
    pub fn zero(machine: &Machine) -> Self {
        let always = |payload: &Payload| {
            if payload.is_always() {
                T::one()
            } else {
                T::zero()
            }
        };
        Self {
            joints: vec![Motion::zero(); machine.joints().len()],
            imu: ImuState {
                specific_force: Vector3::zeros(),
                angular_velocity: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
            },
            tool_wrench: Wrench::zero(),
            actuator_force: vec![T::constant(f64::NAN); machine.contact.actuated_joints.len()],
            payload_share: machine.payloads().iter().map(always).collect(),
            follows_supports: T::zero(),
            base: BaseState::unknown(),
            noise: SignalNoise::zero(),
            lag: Lag {
                joints: vec![T::zero(); machine.joints().len()],
                specific_force: Vector3::zeros(),
                angular_velocity: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
            },
        }
    }

    /// The state [`Self::zero`] with the joints that never move where they are.
    #[must_use]
    pub fn with_constants(machine: &Machine) -> Self {
        let mut state = Self::zero(machine);
        for (motion, joint) in state.joints.iter_mut().zip(machine.joints()) {
            motion.position = T::constant(joint.constant.unwrap_or(0.0));
        }
        state
    }

    /// Number of values in a state: the columns of [`StateColumns`](crate::StateColumns).
    #[must_use]
    pub fn size(machine: &Machine) -> usize {
        let (joints, actuated) = (machine.joints.len(), machine.contact.actuated_joints.len());
        4 * joints + 9 + 6 + actuated + machine.payloads.len() + 1 + 9 + 21 + 9
    }

    /// Returns the state in another number type.
    #[must_use]
    pub fn map<U: Real>(&self, convert: impl Fn(T) -> U) -> State<U> {
        let vector = |v: &Vector3<T>| v.map(&convert);
        State {
            joints: self.joints.iter().map(|m| m.map(&convert)).collect(),
            imu: ImuState {
                specific_force: vector(&self.imu.specific_force),
                angular_velocity: vector(&self.imu.angular_velocity),
                angular_acceleration: vector(&self.imu.angular_acceleration),
            },
            tool_wrench: Wrench {
                force: vector(&self.tool_wrench.force),
                moment: vector(&self.tool_wrench.moment),
            },
            actuator_force: self.actuator_force.iter().map(|&f| convert(f)).collect(),
            payload_share: self.payload_share.iter().map(|&s| convert(s)).collect(),
            follows_supports: convert(self.follows_supports),
            base: BaseState {
                up: vector(&self.base.up),
                velocity: vector(&self.base.velocity),
                velocity_rate: vector(&self.base.velocity_rate),
            },
            noise: SignalNoise {
                joint: JetCovariance {
                    value: self.noise.joint.value.map(&convert),
                    first: self.noise.joint.first.map(&convert),
                    second: convert(self.noise.joint.second),
                },
                specific_force: convert(self.noise.specific_force),
                accelerometer_bias: AccelerometerBias {
                    removed: vector(&self.noise.accelerometer_bias.removed),
                    covariance_change: self
                        .noise
                        .accelerometer_bias
                        .covariance_change
                        .map(&convert),
                },
                turning: self.noise.turning.map(&convert),
                tool_wrench: convert(self.noise.tool_wrench),
                payload_mass: convert(self.noise.payload_mass),
            },
            lag: Lag {
                joints: self.lag.joints.iter().map(|&l| convert(l)).collect(),
                specific_force: vector(&self.lag.specific_force),
                angular_velocity: vector(&self.lag.angular_velocity),
                angular_acceleration: vector(&self.lag.angular_acceleration),
            },
        }
    }

    /// Copies another state of the same machine. Does not allocate.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.joints.copy_from_slice(&other.joints);
        self.imu = other.imu;
        self.tool_wrench = other.tool_wrench;
        self.actuator_force.copy_from_slice(&other.actuator_force);
        self.payload_share.copy_from_slice(&other.payload_share);
        self.follows_supports = other.follows_supports;
        self.base = other.base;
        self.noise = other.noise;
        self.lag.copy_from(&other.lag);
    }

    /// Adds an amount to a signal. Machine parameters are not part of a state and are ignored; for them see
    /// [`Machine::changed`].
    pub fn change(&mut self, signal: Parameter, amount: T) {
        let (imu, tool) = (&mut self.imu, &mut self.tool_wrench);
        let place = match signal {
            Parameter::JointPosition(joint) => &mut self.joints[joint].position,
            Parameter::JointVelocity(joint) => &mut self.joints[joint].rate,
            Parameter::JointAcceleration(joint) => &mut self.joints[joint].acceleration,
            Parameter::SpecificForce(axis) => &mut imu.specific_force[axis as usize],
            Parameter::AngularVelocity(axis) => &mut imu.angular_velocity[axis as usize],
            Parameter::AngularAcceleration(axis) => &mut imu.angular_acceleration[axis as usize],
            Parameter::ToolForce(axis) => &mut tool.force[axis as usize],
            Parameter::ToolMoment(axis) => &mut tool.moment[axis as usize],
            Parameter::ActuatorForce(joint) => &mut self.actuator_force[joint],
            _ => return,
        };
        *place += amount;
    }

    /// The value of a signal; `None` for a machine parameter.
    #[must_use]
    pub fn value(&self, signal: Parameter) -> Option<T> {
        let (imu, tool) = (&self.imu, &self.tool_wrench);
        Some(match signal {
            Parameter::JointPosition(joint) => self.joints[joint].position,
            Parameter::JointVelocity(joint) => self.joints[joint].rate,
            Parameter::JointAcceleration(joint) => self.joints[joint].acceleration,
            Parameter::SpecificForce(axis) => imu.specific_force[axis as usize],
            Parameter::AngularVelocity(axis) => imu.angular_velocity[axis as usize],
            Parameter::AngularAcceleration(axis) => imu.angular_acceleration[axis as usize],
            Parameter::ToolForce(axis) => tool.force[axis as usize],
            Parameter::ToolMoment(axis) => tool.moment[axis as usize],
            Parameter::ActuatorForce(joint) => self.actuator_force[joint],
            Parameter::BaseMotion(BaseMotion::ForwardVelocity) => self.base.velocity.x,
            Parameter::BaseMotion(BaseMotion::LeftVelocity) => self.base.velocity.y,
            Parameter::BaseMotion(BaseMotion::ForwardAcceleration) => self.base.velocity_rate.x,
            Parameter::BaseMotion(BaseMotion::LeftAcceleration) => self.base.velocity_rate.y,
            _ => return None,
        })
    }

    /// Standard deviation of the systematic error of a signal, or of a machine parameter: as the machine file states it, or
    /// less where the signals have narrowed it down.
    #[must_use]
    pub fn sigma(&self, machine: &Machine, parameter: Parameter) -> T {
        let stated = T::constant(parameter.sigma(machine));
        let axis = match parameter {
            Parameter::SpecificForce(axis) => axis,
            Parameter::PayloadMass(payload) if machine.payloads[payload].is_weighed() => {
                return (stated * stated + self.noise.payload_mass).sqrt();
            }
            _ => return stated,
        };
        let left = stated * stated + self.noise.accelerometer_bias.covariance_change[axis as usize];
        // Rounding may leave less than nothing.
        T::select(T::zero().lt(left), left, T::zero()).sqrt()
    }

    /// Visits all values in their fixed order: joints (position, velocity, acceleration each), specific force,
    /// angular velocity, angular acceleration, tool force, tool moment, actuator forces, payload shares,
    /// whether the measured loads of the supports are followed, up, velocity and its derivative, noise, lag.
    pub(crate) fn for_each_value(&mut self, mut visit: impl FnMut(&mut T)) {
        for joint in &mut self.joints {
            visit(&mut joint.position);
            visit(&mut joint.rate);
            visit(&mut joint.acceleration);
        }
        let (imu, tool) = (&mut self.imu, &mut self.tool_wrench);
        imu.specific_force.iter_mut().for_each(&mut visit);
        imu.angular_velocity.iter_mut().for_each(&mut visit);
        imu.angular_acceleration.iter_mut().for_each(&mut visit);
        tool.force.iter_mut().for_each(&mut visit);
        tool.moment.iter_mut().for_each(&mut visit);
        self.actuator_force.iter_mut().for_each(&mut visit);
        self.payload_share.iter_mut().for_each(&mut visit);
        visit(&mut self.follows_supports);
        self.base.up.iter_mut().for_each(&mut visit);
        self.base.velocity.iter_mut().for_each(&mut visit);
        self.base.velocity_rate.iter_mut().for_each(&mut visit);
        let noise = &mut self.noise;
        noise.joint.value.iter_mut().for_each(&mut visit);
        noise.joint.first.iter_mut().for_each(&mut visit);
        visit(&mut noise.joint.second);
        visit(&mut noise.specific_force);
        let bias = &mut noise.accelerometer_bias;
        bias.removed.iter_mut().for_each(&mut visit);
        bias.covariance_change.iter_mut().for_each(&mut visit);
        noise.turning.iter_mut().for_each(&mut visit);
        visit(&mut noise.tool_wrench);
        visit(&mut noise.payload_mass);
        let lag = &mut self.lag;
        lag.joints.iter_mut().for_each(&mut visit);
        lag.specific_force.iter_mut().for_each(&mut visit);
        lag.angular_velocity.iter_mut().for_each(&mut visit);
        lag.angular_acceleration.iter_mut().for_each(&mut visit);
    }
}

impl<T: Real> Lag<T> {
    /// Copies another one of the same machine. Does not allocate.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.joints.copy_from_slice(&other.joints);
        self.specific_force = other.specific_force;
        self.angular_velocity = other.angular_velocity;
        self.angular_acceleration = other.angular_acceleration;
    }
}

impl BaseState<f64> {
    /// Upward direction in base axes; `None` where the attitude is unknown.
    #[must_use]
    pub fn known_up(&self) -> Option<Vector3<f64>> {
        Some(self.up).filter(|up| up.iter().all(|c| c.is_finite()))
    }
}

/// A state with these joint positions, at rest, without specific force.
#[must_use]
pub fn resting_state(machine: &Machine, joint_positions: &[f64]) -> State<f64> {
    let mut state = State::<f64>::zero(machine);
    for (motion, &position) in state.joints.iter_mut().zip(joint_positions) {
        *motion = Motion::at_rest(position);
    }
    state
}

impl<T: Real> BaseState<T> {
    /// Attitude and velocity unknown.
    #[must_use]
    pub fn unknown() -> Self {
        let unknown = Vector3::repeat(T::constant(f64::NAN));
        Self {
            up: unknown,
            velocity: unknown,
            velocity_rate: unknown,
        }
    }
}

impl<T: Real> AccelerometerBias<T> {
    /// Returns the bias as uncertain as the machine file states it.
    #[must_use]
    pub fn unknown() -> Self {
        Self {
            removed: Vector3::zeros(),
            covariance_change: [T::zero(); 6],
        }
    }
}

impl<T: Real> SignalNoise<T> {
    /// Signals without noise.
    #[must_use]
    pub fn zero() -> Self {
        let zero = T::zero();
        Self {
            joint: JetCovariance {
                value: [zero; 3],
                first: [zero; 2],
                second: zero,
            },
            specific_force: zero,
            accelerometer_bias: AccelerometerBias::unknown(),
            turning: [zero; 3],
            tool_wrench: zero,
            payload_mass: zero,
        }
    }
}
