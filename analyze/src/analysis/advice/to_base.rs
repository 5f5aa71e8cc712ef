//! The measured motion of the base, as a sensor at the base frame would measure it.

use nalgebra::{Matrix3, Vector3};
use tipwatch_mechanics::dynamics::kinematics::{SensorFrame, base_motion, coordinates};
use tipwatch_mechanics::geometry::coordinate::Coordinate;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{ImuState, State};

/// Moves the motion of states to the base frame of their machine.
#[derive(Debug)]
pub(crate) struct ToBase {
    coordinates: Vec<Coordinate<f64>>,
}

impl ToBase {
    pub(crate) fn new(machine: &Machine) -> Self {
        let at_zero = Coordinate {
            cos: 1.0,
            sin: 0.0,
            displacement: 0.0,
            rate: 0.0,
            acceleration: 0.0,
        };
        Self {
            coordinates: vec![at_zero; machine.bodies().len()],
        }
    }

    /// Replaces the measurement of the IMU of `machine` by that of [`Machine::measured_at_base`].
    pub(crate) fn apply(&mut self, machine: &Machine, state: &mut State<f64>) {
        if machine.imu().body != 0 {
            coordinates(machine, state, &mut self.coordinates);
        }
        let frame = SensorFrame::of(machine, &self.coordinates);
        let motion = base_motion(machine, &frame, &state.imu);
        state.imu = ImuState {
            specific_force: motion.specific_force,
            angular_velocity: motion.angular_velocity,
            angular_acceleration: motion.angular_acceleration,
        };
        // odometry is planar
        let base = &mut state.base;
        for vector in [&mut base.velocity, &mut base.velocity_rate] {
            *vector = Vector3::new(vector.x, vector.y, 0.0);
        }
        if machine.imu().body == 0 {
            // C' = R C R'
            let turn = machine.imu().rotation_in_body();
            let bias = &mut state.noise.accelerometer_bias;
            let [xx, yy, zz, xy, xz, yz] = bias.covariance_change;
            let change = turn * Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * turn.transpose();
            bias.covariance_change =
                [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|place| change[place]);
        }
    }
}
