//! The signals and rows of a log on the time grid.

use nalgebra::Matrix3;
use tipwatch_mechanics::State;
use tipwatch_mechanics::state::Sensor;

use super::channel::Channel;
use super::grid::{Stretch, at_steps, stretches};
use crate::base::rows::Rows;
use crate::load::{LoadedLog, Signal};

/// Largest speed of a machine at standstill (m/s).
const STANDSTILL_SPEED: f64 = 0.05;
/// A machine that never exceeds this speed (m/s) may only rock on its brakes, without rolling wheels.
pub(super) const ROLLING_SPEED: f64 = 0.2;

/// Activity of a row, by which stretches are chosen.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowFacts {
    /// No gap in a signal that the loads need.
    pub(super) is_whole: bool,
    pub(super) has_velocity: bool,
    pub(super) at_standstill: bool,
    pub(super) travels: bool,
    /// Activity of the machine and of its arm.
    pub(super) travel: f64,
    pub(super) arm: f64,
}

/// The log under comparison, with helpers that bring its signals to the grid.
pub(super) struct Scene<'a> {
    pub(super) loaded: &'a LoadedLog,
    pub(super) rows: &'a Rows,
    pub(super) facts: Vec<RowFacts>,
    /// Rotation from IMU axes to base axes; `None` if it is not mounted on the base.
    base_from_imu: Option<Matrix3<f64>>,
}

/// Channels of each stretch.
pub(super) type Channels = Vec<Vec<Option<Channel>>>;

impl<'a> Scene<'a> {
    pub(super) fn of(loaded: &'a LoadedLog, rows: &'a Rows) -> Self {
        let machine = &loaded.machine;
        let mut state = State::zero(machine);
        let facts = (0..rows.len()).map(|row| {
            rows.states.get(row, &mut state);
            let speed = state.base.velocity.norm();
            let joints = machine.joints().iter().zip(&state.joints);
            RowFacts {
                is_whole: !rows.reasons[row].leave_state_unknown(),
                has_velocity: speed.is_finite(),
                // without odometry travel is unknown
                at_standstill: !(speed >= STANDSTILL_SPEED),
                travels: speed > ROLLING_SPEED,
                travel: state.imu.angular_velocity.norm()
                    + Some(state.base.velocity_rate.norm())
                        .filter(|v| v.is_finite())
                        .unwrap_or(0.0),
                arm: joints
                    .filter(|(joint, _)| joint.spins_wheel.is_none())
                    .map(|(_, motion)| motion.rate.abs())
                    .sum(),
            }
        });
        let mount = machine.imu();
        Self {
            loaded,
            rows,
            facts: facts.collect(),
            base_from_imu: (mount.body == 0)
                .then(|| *mount.body_from_mount.rotation.to_rotation_matrix().matrix()),
        }
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
            .ok_or_else(|| "the IMU is not on the platform".to_owned())
    }

    /// Values of the rows at the steps of a stretch.
    pub(super) fn of_rows<const N: usize>(
        &self,
        stretch: &Stretch,
        mut numbers: impl FnMut(&mut State<f64>) -> [f64; N],
    ) -> [Vec<f64>; N] {
        let mut state = State::zero(&self.loaded.machine);
        let mut columns: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
        for row in stretch.rows.clone() {
            self.rows.states.get(row, &mut state);
            for (column, number) in columns.iter_mut().zip(numbers(&mut state)) {
                column.push(number);
            }
        }
        let times = &self.rows.times_ns[stretch.rows.clone()];
        columns.map(|column| at_steps(stretch, times, &column))
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
            |row| self.facts[row].is_whole && self.facts[row].has_velocity,
            |row| self.facts[row].travel,
        )
    }
}
