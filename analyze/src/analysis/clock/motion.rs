//! Delays between measurements of the machine's motion: odometry, IMU and wheels.

use rayon::prelude::*;
use tipwatch_language::word;
use tipwatch_mechanics::State;

use super::channel::{Channel, derivative};
use super::delay::{self, Delay};
use super::grid::{Stretch, stretches};
use super::scene::{Channels, ROLLING_SPEED, Scene};
use crate::load::Signal;

/// Smoothing time of velocities and of accelerations (s).
const SMOOTH_VELOCITY_S: f64 = 0.08;
const SMOOTH_ACCELERATION_S: f64 = 0.15;

impl Scene<'_> {
    pub(super) fn rotation_and_acceleration(&self, odometry: &Signal) -> Result<Delay, String> {
        let rotation = self.base_from_imu()?;
        let channels: Channels = (self.whole_stretches().par_iter())
            .map(|stretch| {
                let odometry = self.odometry_angular_velocity(odometry, stretch);
                let [vx, vy, ax, ay, wx, wy, wz, fx, fy] = self.of_rows(stretch, |state| {
                    let (v, rate) = (state.base.velocity, state.base.velocity_rate);
                    let angular_velocity = rotation * state.imu.angular_velocity;
                    let specific_force = rotation * state.imu.specific_force;
                    [
                        v.x,
                        v.y,
                        rate.x,
                        rate.y,
                        angular_velocity.x,
                        angular_velocity.y,
                        angular_velocity.z,
                        specific_force.x,
                        specific_force.y,
                    ]
                });
                // a = dv/dt + w x v, with the odometry's own w: all terms have the same delay
                let cross_term = |v: &[f64], sign: f64| -> Vec<f64> {
                    let products = odometry[2].iter().zip(v);
                    products.map(|(w, v)| sign * w * v).collect()
                };
                let along = added(&ax, &cross_term(&vy, -1.0));
                let across = added(&ay, &cross_term(&vx, 1.0));
                let [ox, oy, oz] = odometry;
                vec![
                    Channel::new(&ox, &[&wx], SMOOTH_VELOCITY_S),
                    Channel::new(&oy, &[&wy], SMOOTH_VELOCITY_S),
                    Channel::new(&oz, &[&wz], SMOOTH_VELOCITY_S),
                    Channel::new(&along, &[&fx], SMOOTH_ACCELERATION_S),
                    Channel::new(&across, &[&fy], SMOOTH_ACCELERATION_S),
                ]
            })
            .collect();
        delay::find(&channels)
    }

    pub(super) fn wheel_speed(&self, stream: usize, odometry: &Signal) -> Result<Delay, String> {
        let wheels = self.wheels_of(stream);
        let mut parts = self.whole_stretches();
        parts.retain(|part| {
            part.rows
                .clone()
                .any(|row| self.rows.activities[row].travels)
        });
        if parts.is_empty() {
            return Err(word!("the machine does not travel").into());
        }
        let channels: Channels = (parts.par_iter())
            .map(|stretch| {
                let [wx, wy, wz] = self.odometry_angular_velocity(odometry, stretch);
                let ([vx, vy], speeds) = self.wheel_speeds(stretch, &wheels, |state| {
                    [state.base.velocity.x, state.base.velocity.y]
                });
                let of_wheel = |(&(wheel, _), speed): (&(usize, usize), &Vec<f64>)| {
                    let c = self.loaded.machine.wheels()[wheel].centre_at_zero;
                    // velocity of the wheel's centre: v + w x c
                    let steps = 0..speed.len();
                    let along = |i: usize| vx[i] + wy[i] * c.z - wz[i] * c.y;
                    let across = |i: usize| vy[i] + wz[i] * c.x - wx[i] * c.z;
                    let along: Vec<f64> = steps.clone().map(along).collect();
                    let across: Vec<f64> = steps.map(across).collect();
                    Channel::new(speed, &[&along, &across], SMOOTH_VELOCITY_S)
                };
                wheels.iter().zip(&speeds).map(of_wheel).collect()
            })
            .collect();
        delay::find(&channels)
    }

    pub(super) fn wheel_acceleration(&self, stream: usize) -> Result<Delay, String> {
        let rotation = self.base_from_imu()?;
        let wheels = self.wheels_of(stream);
        let parts = stretches(
            self.rows,
            |row| self.is_whole(row),
            |row| self.rows.activities[row].travel,
        );
        let channels: Channels = (parts.par_iter())
            .map(|stretch| {
                let ([fx, fy], speeds) = self.wheel_speeds(stretch, &wheels, |state| {
                    let specific_force = rotation * state.imu.specific_force;
                    [specific_force.x, specific_force.y]
                });
                let of_wheel = |speed: &Vec<f64>| {
                    let rolls = speed.iter().any(|speed| speed.abs() > ROLLING_SPEED);
                    let gain = rolls.then(|| derivative(speed))?;
                    Channel::new(&gain, &[&fx, &fy], SMOOTH_ACCELERATION_S)
                };
                speeds.iter().map(of_wheel).collect()
            })
            .collect();
        delay::find(&channels)
    }

    /// Two values of the rows, and the speed of each of these wheels and their joints (m/s), at the steps of a stretch.
    fn wheel_speeds(
        &self,
        stretch: &Stretch,
        wheels: &[(usize, usize)],
        numbers: impl Fn(&State<f64>) -> [f64; 2],
    ) -> ([Vec<f64>; 2], Vec<Vec<f64>>) {
        let all = self.loaded.machine.wheels();
        let mut columns = self.many_of_rows(stretch, 2 + wheels.len(), |state, into| {
            let (two, speeds) = into.split_at_mut(2);
            two.copy_from_slice(&numbers(state));
            for (speed, &(wheel, joint)) in speeds.iter_mut().zip(wheels) {
                *speed = state.joints[joint].rate * all[wheel].radius;
            }
        });
        let speeds = columns.split_off(2);
        let mut two = columns.into_iter();
        (
            std::array::from_fn(|_| two.next().unwrap_or_default()),
            speeds,
        )
    }
}

fn added(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
