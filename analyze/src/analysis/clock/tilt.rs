//! Delays between the load and the signals that respond to it: actuator forces, and the tilt of the platform.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use tipwatch_mechanics::{
    self as mechanics, BatchWorkspace, Model, Motion, Scope, State, StateColumns, Workspace,
    evaluate, ground_wrenches,
};

use super::channel::Channel;
use super::delay::{self, Delay};
use super::grid::{Stretch, at_steps, stretches};
use super::scene::{Channels, Scene};
use crate::load::linkage_force::Series;

/// Lag of the tilt behind the load (s) and its standard deviation: tyre damping divided by tyre
/// stiffness. 3 to 10 % of critical damping at 1.5 to 3 Hz give 3 to 20 ms.
const TILT_LAG_S: f64 = 0.012;
const TILT_LAG_SIGMA_S: f64 = 0.010;
/// Below this joint velocity the direction of friction is unknown (rad/s, m/s).
const SLOW: f64 = 0.01;
/// Rows whose wrenches are computed at once.
const ROWS_AT_ONCE: usize = 128;
/// Smoothing time of forces and lean (s).
const SMOOTH_TILT_S: f64 = 0.1;

impl Scene<'_> {
    /// Force of a linkage's actuator: weight and inertia of the distal subtree, and friction against the
    /// motion.
    pub(super) fn actuator_force(&self, linkage: usize, force: &Series) -> Result<Delay, String> {
        let machine = &self.loaded.machine;
        let joint = machine.linkages()[linkage].measured_joint;
        let parts = stretches(
            self.rows,
            |row| self.is_whole(row),
            |row| self.rows.activities[row].arm,
        );
        let channels: Channels = (parts.par_iter())
            .map(|stretch| {
                let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
                let [computed, friction] = self.of_rows(stretch, |state| {
                    evaluate(machine, state, &mut workspace);
                    let force = mechanics::actuator_force(machine, state, &workspace, linkage);
                    let direction = (state.joints[joint].rate / SLOW).tanh();
                    [force, force.abs() * direction]
                });
                let measured = at_steps(stretch, &force.0, &force.1);
                let known = [&computed[..], &friction];
                vec![Channel::new(&measured, &known, SMOOTH_TILT_S)]
            })
            .collect();
        delay::find(&channels)
    }

    /// The platform tilts with the ground moment, which the joints of a stream change, or without one
    /// the tool wrench.
    pub(super) fn tilt(&self, stream: Option<usize>) -> Result<Delay, String> {
        let rotation = self.base_from_imu()?;
        let parts = stretches(
            self.rows,
            |row| self.is_whole(row) && self.rows.activities[row].at_standstill,
            |row| self.rows.activities[row].arm,
        );
        let channels: Channels = (parts.par_iter())
            .map(|stretch| {
                let [mx, my, rest_x, rest_y, ux, uy, fx, fy] =
                    self.moments_and_lean(stretch, stream, &rotation);
                let is_known = ux.iter().chain(&uy).any(|u| u.is_finite());
                // without an attitude, the IMU's specific force shows the tilt at standstill
                let (ux, uy) = if is_known { (ux, uy) } else { (fx, fy) };
                let known = [&ux[..], &uy, &rest_x, &rest_y];
                let channel = |moment: &Vec<f64>| Channel::new(moment, &known, SMOOTH_TILT_S);
                [mx, my].iter().map(channel).collect()
            })
            .collect();
        let found = delay::find(&channels)?;
        Ok(Delay {
            seconds: found.seconds + TILT_LAG_S,
            sigma: found.sigma.hypot(TILT_LAG_SIGMA_S),
            ..found
        })
    }

    /// Returns at the steps of a stretch: ground moment about the base's x and y axes (N m) under gravity alone, first the part
    /// due to the stream's joints, or without one the tool wrench, then the rest; horizontal parts of the upward direction and of
    /// the specific force (m/s^2), in base axes.
    fn moments_and_lean(
        &self,
        stretch: &Stretch,
        stream: Option<usize>,
        rotation: &Matrix3<f64>,
    ) -> [Vec<f64>; 8] {
        let machine = &self.loaded.machine;
        let moving: &[usize] =
            stream.map_or(&[], |s| &self.loaded.matched.sensors.joints[s].joints);
        let middle = self.mean_state(stretch);
        let model = Arc::new(Model::WholeBody);
        let mut workspace = BatchWorkspace::new(machine, Scope::LOADS, &model);
        let mut states = [(); 2].map(|()| StateColumns::unknown(machine, ROWS_AT_ONCE));
        let mut wrenches = [(); 2].map(|()| Vec::with_capacity(stretch.rows.len()));
        let mut compute = |states: &[StateColumns; 2], count: usize| {
            for (wrenches, states) in wrenches.iter_mut().zip(states) {
                wrenches.extend(ground_wrenches(machine, states, 0..count, &mut workspace));
            }
        };
        let mut place = 0;
        let [ux, uy, fx, fy] = self.of_rows(stretch, |state| {
            let (up, specific_force) = (state.base.up, rotation * state.imu.specific_force);
            state.imu = middle.imu;
            for (joint, motion) in machine.joints().iter().zip(&mut state.joints) {
                if joint.spins_wheel.is_some() {
                    *motion = Motion::zero();
                }
            }
            states[0].set(place, state);
            for &joint in moving {
                state.joints[joint] = middle.joints[joint];
            }
            if stream.is_none() {
                state.tool_wrench = middle.tool_wrench;
            }
            states[1].set(place, state);
            place += 1;
            if place == ROWS_AT_ONCE {
                compute(&states, std::mem::take(&mut place));
            }
            [up.x, up.y, specific_force.x, specific_force.y]
        });
        compute(&states, place);
        let [whole, rest] = wrenches;
        let times = &self.rows.times_ns[stretch.rows.clone()];
        let column = |number: fn(&Vector3<f64>, &Vector3<f64>) -> f64| {
            let wrenches = whole.iter().zip(&rest);
            let numbers = wrenches.map(|(whole, rest)| number(&whole.moment, &rest.moment));
            at_steps(stretch, times, &numbers.collect::<Vec<f64>>())
        };
        [
            column(|whole, rest| whole.x - rest.x),
            column(|whole, rest| whole.y - rest.y),
            column(|_, rest| rest.x),
            column(|_, rest| rest.y),
            ux,
            uy,
            fx,
            fy,
        ]
    }

    /// Joints at rest in their mean positions, mean specific force, no tool wrench.
    fn mean_state(&self, stretch: &Stretch) -> State<f64> {
        let mut mean = State::zero(&self.loaded.machine);
        let mut state = mean.clone();
        let share = 1.0 / stretch.rows.len() as f64;
        for row in stretch.rows.clone() {
            self.rows.state(row, &mut state);
            for (mean, motion) in mean.joints.iter_mut().zip(&state.joints) {
                mean.position += share * motion.position;
            }
            let specific_force: Vector3<f64> = state.imu.specific_force * share;
            mean.imu.specific_force += specific_force;
        }
        mean
    }
}
