//! Joints between base and IMU: on a moving body, they affect the estimated base motion.

use nalgebra::Vector3;

use super::following::{Following, measured_by};
use super::sensed_motion::SensedMotion;
use crate::dynamics::kinematics::{SensorFrame, base_motion};
use crate::dynamics::newton_euler_derivatives::BaseGradient;
use crate::geometry::coordinate::Coordinate;
use crate::machine::{JointKind, Machine};
use crate::number::{Dual, Real};
use crate::state::ImuState;

/// The joints that carry the IMU.
#[derive(Debug)]
pub(super) struct ImuJoints<T: Real> {
    changes: Vec<Change<T>>,
    dual_coordinates: Vec<Coordinate<Dual<T>>>,
}

/// Change of the base's motion with a joint of the IMU's carrier.
#[derive(Debug)]
struct Change<T> {
    /// The body of the joint, and the measured joint that it is coupled to.
    body: usize,
    measured: usize,
    /// Changes with the joint's position, velocity and acceleration: of specific force, angular velocity and angular
    /// acceleration.
    by_jet: [[Vector3<T>; 3]; 3],
}

impl<T: Real> ImuJoints<T> {
    pub(super) fn new(machine: &Machine) -> Self {
        let dual = Dual::constant(0.0);
        let mut changes = Vec::new();
        let mut body = machine.imu.body;
        while body != 0 {
            if let Some(measured) = measured_by(machine, body) {
                changes.push(Change {
                    body,
                    measured,
                    by_jet: [[Vector3::zeros(); 3]; 3],
                });
            }
            body = machine.bodies[body].parent;
        }
        Self {
            changes,
            dual_coordinates: vec![Coordinate::slid(dual, dual, dual); machine.bodies.len()],
        }
    }

    /// Differentiates the base's motion in dual numbers, joint by joint.
    pub(super) fn fill(&mut self, motion: &SensedMotion<'_, T>, followings: &[Following<T>]) {
        let machine = motion.machine;
        let imu = ImuState {
            specific_force: motion.state.imu.specific_force.map(Dual::fixed),
            angular_velocity: motion.state.imu.angular_velocity.map(Dual::fixed),
            angular_acceleration: motion.state.imu.angular_acceleration.map(Dual::fixed),
        };
        let slopes = |v: &Vector3<Dual<T>>| v.map(|component| component.slope);
        let dual_coordinates = &mut self.dual_coordinates;
        for change in &mut self.changes {
            let body = change.body;
            for (jet, by) in change.by_jet.iter_mut().enumerate() {
                vary(dual_coordinates, motion, body, &followings[body], jet);
                let sensor_frame = SensorFrame::of(machine, dual_coordinates);
                let moved = base_motion(machine, &sensor_frame, &imu);
                *by = [
                    slopes(&moved.specific_force),
                    slopes(&moved.angular_velocity),
                    slopes(&moved.angular_acceleration),
                ];
            }
        }
    }

    /// Adds the effect on the loads of some wheels, side by side, to the derivatives with respect to the measured
    /// joints.
    pub(super) fn follow(&self, base: &BaseGradient<T::Wheels>, by_joint: &mut [[T::Wheels; 3]]) {
        for change in &self.changes {
            for (by, moved) in by_joint[change.measured].iter_mut().zip(&change.by_jet) {
                *by += base.by_change(moved);
            }
        }
    }
}

/// Sets the coordinates of all joints, with that of `body` a function of its measured joint's position (0),
/// velocity (1) or acceleration (2).
fn vary<T: Real>(
    coordinates: &mut [Coordinate<Dual<T>>],
    motion: &SensedMotion<'_, T>,
    body: usize,
    following: &Following<T>,
    jet: usize,
) {
    for (dual, coordinate) in coordinates.iter_mut().zip(motion.coordinates) {
        *dual = coordinate.map(Dual::fixed);
    }
    let (zero, two) = (T::zero(), T::constant(2.0));
    let [moved, rate, acceleration] = match jet {
        0 => [following.coordinate, following.rate, following.acceleration],
        1 => [zero, following.coordinate, following.rate * two],
        _ => [zero, zero, following.coordinate],
    };
    let dual = &mut coordinates[body];
    match motion.machine.bodies[body].kind {
        JointKind::Revolute => {
            (dual.sin.slope, dual.cos.slope) = (dual.cos.value * moved, -dual.sin.value * moved);
        }
        JointKind::Prismatic => dual.displacement.slope = moved,
    }
    dual.rate.slope = rate;
    dual.acceleration.slope = acceleration;
}
