//! The signals and rows of a log on the time grid.

use nalgebra::Matrix3;
use tipwatch_language::word;
use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Sensor;

use super::channel::Channel;
use super::grid::{Stretch, at_steps, stretches};
use crate::base::estimated::{Activity, EstimatedRows};
use crate::load::{LoadedLog, Signal};

/// Largest speed of a machine at standstill (m/s).
const STANDSTILL_SPEED: f64 = 0.05;
/// A machine that never exceeds this speed (m/s) may only rock on its brakes, without rolling wheels.
pub(super) const ROLLING_SPEED: f64 = 0.2;

/// Returns the activity of the machine in a state; stretches are chosen by it.
pub(crate) fn activity(machine: &Machine, state: &State<f64>, is_quiet: bool) -> Activity {
    let speed = state.base.velocity.norm();
    let joints = machine.joints().iter().zip(&state.joints);
    Activity {
        has_velocity: speed.is_finite(),
        // without odometry travel is unknown
        at_standstill: !(speed >= STANDSTILL_SPEED),
        travels: speed > ROLLING_SPEED,
        is_quiet,
        travel: state.imu.angular_velocity.norm()
            + Some(state.base.velocity_rate.norm())
                .filter(|v| v.is_finite())
                .unwrap_or(0.0),
        arm: joints
            .filter(|(joint, _)| joint.spins_wheel.is_none())
            .map(|(_, motion)| motion.rate.abs())
            .sum(),
    }
}

/// The log under comparison, with helpers that bring its signals to the grid.
pub(super) struct Scene<'a> {
    pub(super) loaded: &'a LoadedLog,
    pub(super) rows: &'a EstimatedRows,
    /// Rotation from IMU axes to base axes; `None` if it is not mounted on the base.
    base_from_imu: Option<Matrix3<f64>>,
}

/// Channels of each stretch.
pub(super) type Channels = Vec<Vec<Option<Channel>>>;

impl<'a> Scene<'a> {
    pub(super) fn of(loaded: &'a LoadedLog, rows: &'a EstimatedRows) -> Self {
        let mount = loaded.machine.imu();
        Self {
            loaded,
            rows,
            base_from_imu: (mount.body == 0)
                .then(|| *mount.body_from_mount.rotation.to_rotation_matrix().matrix()),
        }
    }

    /// Whether a row has no gap in a signal that the loads need.
    pub(super) fn is_whole(&self, row: usize) -> bool {
        !self.rows.reasons[row].leave_state_unknown()
    }

    pub(super) fn signal(&self, sensor: Sensor) -> Option<&'a Signal> {
        let is_it =
            |signal: &&Signal| signal.sensor == sensor && !signal.recording.stamps_ns.is_empty();
        self.loaded.signals.iter().find(is_it)
    }

    /// The wheels of a stream and their joints.
    pub(super) fn wheels_of(&self, stream: usize) -> Vec<(usize, usize)> {
        let joints = &self.loaded.matched.sensors.joints[stream].joints;
        let spins =
            |&joint: &usize| Some((self.loaded.machine.joints()[joint].spins_wheel?, joint));
        joints.iter().filter_map(spins).collect()
    }

    pub(super) fn has_other_joints(&self, stream: usize) -> bool {
        let joints = &self.loaded.matched.sensors.joints[stream].joints;
        joints.len() > self.wheels_of(stream).len()
    }

    pub(super) fn base_from_imu(&self) -> Result<Matrix3<f64>, String> {
        self.base_from_imu
            .ok_or_else(|| word!("the IMU is not on the platform").to_owned())
    }

    /// Values of the rows at the steps of a stretch.
    pub(super) fn of_rows<const N: usize>(
        &self,
        stretch: &Stretch,
        mut numbers: impl FnMut(&mut State<f64>) -> [f64; N],
    ) -> [Vec<f64>; N] {
        let write = |state: &mut State<f64>, into: &mut [f64]| {
            into.copy_from_slice(&numbers(state));
        };
        let mut columns = self.many_of_rows(stretch, N, write).into_iter();
        std::array::from_fn(|_| columns.next().unwrap_or_default())
    }

    /// `count` values of the rows, which `numbers` writes, at the steps of a stretch. Reading a row's state costs more than
    /// most of what is computed from it: what can be asked for together should be.
    pub(super) fn many_of_rows(
        &self,
        stretch: &Stretch,
        count: usize,
        mut numbers: impl FnMut(&mut State<f64>, &mut [f64]),
    ) -> Vec<Vec<f64>> {
        let mut state = State::zero(&self.loaded.machine);
        let mut columns = vec![Vec::with_capacity(stretch.rows.len()); count];
        let mut row_numbers = vec![f64::NAN; count];
        for row in stretch.rows.clone() {
            self.rows.state(row, &mut state);
            numbers(&mut state, &mut row_numbers);
            for (column, number) in columns.iter_mut().zip(&row_numbers) {
                column.push(*number);
            }
        }
        let times = &self.rows.times_ns[stretch.rows.clone()];
        let columns = columns.iter();
        columns
            .map(|column| at_steps(stretch, times, column))
            .collect()
    }

    /// Angular velocity of the odometry at the steps of a stretch.
    pub(super) fn odometry_angular_velocity(
        &self,
        odometry: &Signal,
        stretch: &Stretch,
    ) -> [Vec<f64>; 3] {
        let recording = &odometry.recording;
        let mut order: Vec<usize> = (0..recording.stamps_ns.len()).collect();
        order.sort_by_key(|&sample| recording.stamps_ns[sample]);
        order.dedup_by_key(|&mut sample| recording.stamps_ns[sample]);
        let near = |time: i64| order.partition_point(|&s| recording.stamps_ns[s] < time);
        let from = near(stretch.start_ns).saturating_sub(1);
        let to = (near(stretch.time_ns(stretch.steps)) + 1).min(order.len());
        let order = &order[from.min(to)..to];
        let stamps: Vec<i64> = order.iter().map(|&s| recording.stamps_ns[s]).collect();
        let mut reader = recording.reader();
        std::array::from_fn(|axis| {
            let value = |&s: &usize| reader.sample(s)[3 + axis];
            let values: Vec<f64> = order.iter().map(value).collect();
            at_steps(stretch, &stamps, &values)
        })
    }

    pub(super) fn whole_stretches(&self) -> Vec<Stretch> {
        stretches(
            self.rows,
            |row| self.is_whole(row) && self.rows.activities[row].has_velocity,
            |row| self.rows.activities[row].travel,
        )
    }
}
