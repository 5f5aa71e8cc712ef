//! The state of a machine at one instant: all that the memoryless equations need.

use nalgebra::Vector3;

use crate::coordinate::Motion;
use crate::machine::Machine;
use crate::number::Real;
use crate::spatial::Wrench;

/// The state at one instant, or at several side by side: see [`Real`].
#[derive(Debug, Clone)]
pub struct State<T> {
    /// Motion of [`Machine::joints`], in their order.
    pub joints: Vec<Motion<T>>,
    /// What the inertial measurement unit feels, in its own frame.
    pub imu: ImuState<T>,
    /// Force and moment by the surroundings on the tool, at the origin of the tool's frame and in its
    /// axes (N, N m); zero without one.
    pub tool_wrench: Wrench<T>,
    /// How much of each of [`Machine::payloads`] hangs on its link: 1 or 0.
    pub payload_share: Vec<T>,
}

/// What an inertial measurement unit at rest in its body feels, in its own frame.
#[derive(Debug, Clone, Copy)]
pub struct ImuState<T> {
    /// Acceleration minus gravity [m/s^2]: upwards at rest.
    pub specific_force: Vector3<T>,
    /// Angular velocity (rad/s).
    pub angular_velocity: Vector3<T>,
    /// Angular acceleration (rad/s^2).
    pub angular_acceleration: Vector3<T>,
}

impl<T: Real> State<T> {
    /// Nothing moves, nothing is felt, not even gravity; payloads of unlimited time are in place.
    #[must_use]
    pub fn zero(machine: &Machine) -> Self {
        let always = |window: [f64; 2]| {
            if window[0].is_finite() || window[1].is_finite() {
                T::zero()
            } else {
                T::one()
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
            payload_share: machine
                .payloads()
                .iter()
                .map(|p| always(p.window_s))
                .collect(),
        }
    }

    /// How many numbers a state holds: the columns of [`StateColumns`](crate::StateColumns).
    #[must_use]
    pub fn size(machine: &Machine) -> usize {
        3 * machine.joints().len() + 9 + 6 + machine.payloads().len()
    }

    /// Visits the numbers in their fixed order: joints (position, rate, acceleration each), specific force,
    /// angular velocity, angular acceleration, tool force, tool moment, payload shares.
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
        self.payload_share.iter_mut().for_each(visit);
    }
}
