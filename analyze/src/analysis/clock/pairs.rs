//! Pairs of topics that measure the same motion, and their signals on an even time grid.
//!
//! | pair | both measure |
//! |---|---|
//! | odometry, IMU | turning about each axis, acceleration along and across |
//! | joint states, odometry | wheel rotation and travel |
//! | joint states, IMU | without odometry: wheel and machine acceleration |
//! | joint states, IMU | machine at standstill: lean of the platform as the arm moves its weight |
//! | force or pressure of a linkage, joint states | the force that carries and moves the links |
//! | tool wrench, IMU | machine at standstill: lean of the platform under the force |
//!
//! Driven and braked wheels slip in proportion to their force, which looks like a delay; rolling wheels
//! agree best and count most. A platform on tyres leans slightly later than its load moves: see
//! [`LEAN_S`].

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use tipwatch_mechanics::state::Sensor;
use tipwatch_mechanics::{Motion, Scope, State, Workspace, actuator_force, evaluate};

use super::channel::{Channel, derivative};
use super::delay::{self, Delay};
use super::grid::{Stretch, at_steps, stretches};
use super::offsets::PairOffset;
use crate::base::rows::Rows;
use crate::load::linkage_force::{LinkageForce, Series};
use crate::load::{LoadedLog, Signal};

/// Lag of the lean behind the load (s) and its standard deviation: tyre damping divided by tyre
/// stiffness. 3 to 10 % of critical damping at 1.5 to 3 Hz give 3 to 20 ms.
const LEAN_S: f64 = 0.012;
const LEAN_SIGMA_S: f64 = 0.010;
/// Largest speed of a machine at standstill (m/s).
const STANDING: f64 = 0.05;
/// A machine that never exceeds this speed (m/s) may only rock on its brakes, without rolling wheels.
const TRAVELLING: f64 = 0.2;
/// Below this joint velocity the direction of friction is unknown (rad/s, m/s).
const SLOW: f64 = 0.01;
/// Smoothing times (s): of turning and travel, of acceleration, of lean.
const SMOOTH_TURNING_S: f64 = 0.08;
const SMOOTH_ACCELERATION_S: f64 = 0.15;
const SMOOTH_LEANING_S: f64 = 0.1;

/// A pair of topics, and how the delay between them is found.
struct Pair<'a> {
    topic: &'a str,
    against: &'a str,
    by: &'static str,
    find: Box<dyn Fn() -> Result<Delay, String> + Sync + Send + 'a>,
}

impl<'a> Pair<'a> {
    fn new(
        topic: &'a str,
        against: &'a str,
        by: &'static str,
        find: impl Fn() -> Result<Delay, String> + Sync + Send + 'a,
    ) -> Self {
        Self {
            topic,
            against,
            by,
            find: Box::new(find),
        }
    }
}

/// Compares every pair of topics that measure the same motion, in parallel.
pub(super) fn compare(loaded: &LoadedLog, forces: &[LinkageForce], rows: &Rows) -> Vec<PairOffset> {
    let scene = Scene::of(loaded, rows);
    let pairs = pairs(&scene, forces);
    let compare =
        |pair: &Pair<'_>| PairOffset::new(pair.topic, pair.against, pair.by, (pair.find)());
    pairs.par_iter().map(compare).collect()
}

fn pairs<'a>(scene: &'a Scene<'a>, forces: &'a [LinkageForce]) -> Vec<Pair<'a>> {
    let loaded = scene.loaded;
    let mut pairs = Vec::new();
    let (imu, odometry) = (scene.signal(Sensor::Imu), scene.signal(Sensor::Odometry));
    if let (Some(imu), Some(odometry)) = (imu, odometry) {
        let by = "rotation and acceleration of the machine";
        let find = move || scene.turning_and_acceleration(odometry);
        pairs.push(Pair::new(&odometry.topic, &imu.topic, by, find));
    }
    for joints in &loaded.signals {
        let Sensor::Joints(stream) = joints.sensor else {
            continue;
        };
        if let Some(odometry) = odometry
            && !scene.wheels_of(stream).is_empty()
        {
            let by = "wheel rotation and travel";
            let find = move || scene.rolling(stream, odometry);
            pairs.push(Pair::new(&joints.topic, &odometry.topic, by, find));
        } else if let Some(imu) = imu
            && !scene.wheels_of(stream).is_empty()
        {
            let by = "acceleration of wheels and machine";
            let find = move || scene.gaining_speed(stream);
            pairs.push(Pair::new(&joints.topic, &imu.topic, by, find));
        }
        if let Some(imu) = imu
            && scene.has_other_joints(stream)
        {
            let by = "lean of the platform as joints move its weight";
            let find = move || scene.leaning(Some(stream));
            pairs.push(Pair::new(&joints.topic, &imu.topic, by, find));
        }
    }
    if let (Some(imu), Some(wrench)) = (imu, scene.signal(Sensor::ToolWrench)) {
        let by = "lean of the platform under the tool force";
        let find = || scene.leaning(None);
        pairs.push(Pair::new(&wrench.topic, &imu.topic, by, find));
    }
    for force in forces {
        let joint = loaded.machine.linkages()[force.linkage].measured_joint;
        let of_joint = |signal: &&Signal| match signal.sensor {
            Sensor::Joints(stream) => loaded.matched.sensors.joints[stream]
                .joints
                .contains(&joint),
            _ => false,
        };
        let Some(joints) = loaded.signals.iter().find(of_joint) else {
            continue;
        };
        let by = "the force that carries and moves the links";
        let find = move || match &force.series {
            Ok(series) => scene.carrying(force.linkage, series),
            Err(error) => Err(format!("{error:#}")),
        };
        pairs.push(Pair::new(&force.topic, &joints.topic, by, find));
    }
    pairs
}

/// Activity of a row, by which stretches are chosen.
#[derive(Debug, Clone, Copy)]
struct RowFacts {
    /// No gap in a signal that the loads need.
    is_whole: bool,
    has_velocity: bool,
    stands: bool,
    travels: bool,
    /// Activity of the machine and of its arm.
    travel: f64,
    arm: f64,
}

struct Scene<'a> {
    loaded: &'a LoadedLog,
    rows: &'a Rows,
    facts: Vec<RowFacts>,
    /// Rotation from IMU axes to base axes; `None` if it is not mounted on the base.
    base_from_imu: Option<Matrix3<f64>>,
}

type Channels = Vec<Vec<Option<Channel>>>;

impl<'a> Scene<'a> {
    fn of(loaded: &'a LoadedLog, rows: &'a Rows) -> Self {
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
                stands: !(speed >= STANDING),
                travels: speed > TRAVELLING,
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

    fn signal(&self, sensor: Sensor) -> Option<&'a Signal> {
        let is_it =
            |signal: &&Signal| signal.sensor == sensor && !signal.recording.stamps_ns.is_empty();
        self.loaded.signals.iter().find(is_it)
    }

    /// The wheels of a stream and their joints.
    fn wheels_of(&self, stream: usize) -> Vec<(usize, usize)> {
        let joints = &self.loaded.matched.sensors.joints[stream].joints;
        let spins =
            |&joint: &usize| Some((self.loaded.machine.joints()[joint].spins_wheel?, joint));
        joints.iter().filter_map(spins).collect()
    }

    fn has_other_joints(&self, stream: usize) -> bool {
        let joints = &self.loaded.matched.sensors.joints[stream].joints;
        joints.len() > self.wheels_of(stream).len()
    }

    fn base_from_imu(&self) -> Result<Matrix3<f64>, String> {
        self.base_from_imu
            .ok_or_else(|| "the IMU is not on the platform".to_owned())
    }

    /// Values of the rows at the steps of a stretch.
    fn of_rows<const N: usize>(
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
    fn odometry_turning(&self, odometry: &Signal, stretch: &Stretch) -> [Vec<f64>; 3] {
        let recording = &odometry.recording;
        let mut order: Vec<usize> = (0..recording.stamps_ns.len()).collect();
        order.sort_by_key(|&sample| recording.stamps_ns[sample]);
        order.dedup_by_key(|&mut sample| recording.stamps_ns[sample]);
        let near = |time: i64| order.partition_point(|&s| recording.stamps_ns[s] < time);
        let from = near(stretch.start_ns).saturating_sub(1);
        let to = (near(stretch.time_ns(stretch.steps)) + 1).min(order.len());
        let order = &order[from.min(to)..to];
        let stamps: Vec<i64> = order.iter().map(|&s| recording.stamps_ns[s]).collect();
        std::array::from_fn(|axis| {
            let value = |&s: &usize| recording.sample(s)[3 + axis];
            let values: Vec<f64> = order.iter().map(value).collect();
            at_steps(stretch, &stamps, &values)
        })
    }

    fn whole_stretches(&self) -> Vec<Stretch> {
        stretches(
            self.rows,
            |row| self.facts[row].is_whole && self.facts[row].has_velocity,
            |row| self.facts[row].travel,
        )
    }

    fn turning_and_acceleration(&self, odometry: &Signal) -> Result<Delay, String> {
        let rotation = self.base_from_imu()?;
        let channels: Channels = (self.whole_stretches().iter())
            .map(|stretch| {
                let odometry = self.odometry_turning(odometry, stretch);
                let [vx, vy, ax, ay] = self.of_rows(stretch, |state| {
                    let (v, rate) = (state.base.velocity, state.base.velocity_rate);
                    [v.x, v.y, rate.x, rate.y]
                });
                let [wx, wy, wz, fx, fy] = self.of_rows(stretch, |state| {
                    let turning = rotation * state.imu.angular_velocity;
                    let felt = rotation * state.imu.specific_force;
                    [turning.x, turning.y, turning.z, felt.x, felt.y]
                });
                // a = dv/dt + w x v, with the odometry's own w: all terms have the same delay
                let turned = |v: &[f64], sign: f64| -> Vec<f64> {
                    let products = odometry[2].iter().zip(v);
                    products.map(|(w, v)| sign * w * v).collect()
                };
                let along = added(&ax, &turned(&vy, -1.0));
                let across = added(&ay, &turned(&vx, 1.0));
                let [ox, oy, oz] = odometry;
                vec![
                    Channel::new(&ox, &[&wx], SMOOTH_TURNING_S),
                    Channel::new(&oy, &[&wy], SMOOTH_TURNING_S),
                    Channel::new(&oz, &[&wz], SMOOTH_TURNING_S),
                    Channel::new(&along, &[&fx], SMOOTH_ACCELERATION_S),
                    Channel::new(&across, &[&fy], SMOOTH_ACCELERATION_S),
                ]
            })
            .collect();
        delay::find(&channels)
    }

    fn rolling(&self, stream: usize, odometry: &Signal) -> Result<Delay, String> {
        let wheels = self.wheels_of(stream);
        let mut parts = self.whole_stretches();
        parts.retain(|part| part.rows.clone().any(|row| self.facts[row].travels));
        if parts.is_empty() {
            return Err("the machine does not travel".into());
        }
        let channels: Channels = (parts.iter())
            .map(|stretch| {
                let [wx, wy, wz] = self.odometry_turning(odometry, stretch);
                let [vx, vy] = self.of_rows(stretch, |state| {
                    [state.base.velocity.x, state.base.velocity.y]
                });
                let of_wheel = |&(wheel, joint): &(usize, usize)| {
                    let wheel = &self.loaded.machine.wheels()[wheel];
                    let c = wheel.centre_at_zero;
                    let [speed] =
                        self.of_rows(stretch, |state| [state.joints[joint].rate * wheel.radius]);
                    // velocity of the wheel's centre: v + w x c
                    let steps = 0..speed.len();
                    let along = |i: usize| vx[i] + wy[i] * c.z - wz[i] * c.y;
                    let across = |i: usize| vy[i] + wz[i] * c.x - wx[i] * c.z;
                    let along: Vec<f64> = steps.clone().map(along).collect();
                    let across: Vec<f64> = steps.map(across).collect();
                    Channel::new(&speed, &[&along, &across], SMOOTH_TURNING_S)
                };
                wheels.iter().map(of_wheel).collect()
            })
            .collect();
        delay::find(&channels)
    }

    fn gaining_speed(&self, stream: usize) -> Result<Delay, String> {
        let rotation = self.base_from_imu()?;
        let wheels = self.wheels_of(stream);
        let parts = stretches(
            self.rows,
            |row| self.facts[row].is_whole,
            |row| self.facts[row].travel,
        );
        let channels: Channels = (parts.iter())
            .map(|stretch| {
                let of_wheel = |&(wheel, joint): &(usize, usize)| {
                    let radius = self.loaded.machine.wheels()[wheel].radius;
                    let [speed, fx, fy] = self.of_rows(stretch, |state| {
                        let felt = rotation * state.imu.specific_force;
                        [state.joints[joint].rate * radius, felt.x, felt.y]
                    });
                    let rolls = speed.iter().any(|speed| speed.abs() > TRAVELLING);
                    let gain = rolls.then(|| derivative(&speed))?;
                    Channel::new(&gain, &[&fx, &fy], SMOOTH_ACCELERATION_S)
                };
                wheels.iter().map(of_wheel).collect()
            })
            .collect();
        delay::find(&channels)
    }

    /// Force of a linkage's actuator: weight and inertia of the distal subtree, and friction against the
    /// motion.
    fn carrying(&self, linkage: usize, force: &Series) -> Result<Delay, String> {
        let machine = &self.loaded.machine;
        let joint = machine.linkages()[linkage].measured_joint;
        let parts = stretches(
            self.rows,
            |row| self.facts[row].is_whole,
            |row| self.facts[row].arm,
        );
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        let channels: Channels = (parts.iter())
            .map(|stretch| {
                let [carried, friction] = self.of_rows(stretch, |state| {
                    evaluate(machine, state, &mut workspace);
                    let force = actuator_force(machine, state, &workspace, linkage);
                    let way = (state.joints[joint].rate / SLOW).tanh();
                    [force, force.abs() * way]
                });
                let measured = at_steps(stretch, &force.0, &force.1);
                let known = [&carried[..], &friction];
                vec![Channel::new(&measured, &known, SMOOTH_LEANING_S)]
            })
            .collect();
        delay::find(&channels)
    }

    /// The platform leans with the ground moment, which the joints of a stream change, or without one
    /// the tool wrench.
    fn leaning(&self, stream: Option<usize>) -> Result<Delay, String> {
        let rotation = self.base_from_imu()?;
        let parts = stretches(
            self.rows,
            |row| self.facts[row].is_whole && self.facts[row].stands,
            |row| self.facts[row].arm,
        );
        let channels: Channels = (parts.iter())
            .map(|stretch| {
                let (moved, rest) = self.moments(stretch, stream);
                let [ux, uy, fx, fy] = self.of_rows(stretch, |state| {
                    let felt = rotation * state.imu.specific_force;
                    [state.base.up.x, state.base.up.y, felt.x, felt.y]
                });
                let is_known = ux.iter().chain(&uy).any(|u| u.is_finite());
                // without an attitude, the IMU's specific force shows the lean at standstill
                let (ux, uy) = if is_known { (ux, uy) } else { (fx, fy) };
                let known = [&ux[..], &uy, &rest[0], &rest[1]];
                let channel = |moment: &Vec<f64>| Channel::new(moment, &known, SMOOTH_LEANING_S);
                moved.iter().map(channel).collect()
            })
            .collect();
        let found = delay::find(&channels)?;
        Ok(Delay {
            seconds: found.seconds + LEAN_S,
            sigma: found.sigma.hypot(LEAN_SIGMA_S),
            ..found
        })
    }

    /// Ground moment about the base's x and y axes (N m) under gravity alone: the part due to the
    /// stream's joints, or without one the tool wrench, and the rest.
    fn moments(&self, stretch: &Stretch, stream: Option<usize>) -> ([Vec<f64>; 2], [Vec<f64>; 2]) {
        let machine = &self.loaded.machine;
        let moving: &[usize] =
            stream.map_or(&[], |s| &self.loaded.matched.sensors.joints[s].joints);
        let middle = self.mean_state(stretch);
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        let [x, y, rest_x, rest_y] = self.of_rows(stretch, |state| {
            state.imu = middle.imu;
            for (joint, motion) in machine.joints().iter().zip(&mut state.joints) {
                if joint.spins_wheel.is_some() {
                    *motion = Motion::zero();
                }
            }
            let whole = evaluate(machine, state, &mut workspace)
                .ground_wrench
                .moment;
            for &joint in moving {
                state.joints[joint] = middle.joints[joint];
            }
            if stream.is_none() {
                state.tool_wrench = middle.tool_wrench;
            }
            let rest = evaluate(machine, state, &mut workspace)
                .ground_wrench
                .moment;
            [whole.x - rest.x, whole.y - rest.y, rest.x, rest.y]
        });
        ([x, y], [rest_x, rest_y])
    }

    /// Joints at rest in their mean positions, mean specific force, no tool wrench.
    fn mean_state(&self, stretch: &Stretch) -> State<f64> {
        let mut mean = State::zero(&self.loaded.machine);
        let mut state = mean.clone();
        let share = 1.0 / stretch.rows.len() as f64;
        for row in stretch.rows.clone() {
            self.rows.states.get(row, &mut state);
            for (mean, motion) in mean.joints.iter_mut().zip(&state.joints) {
                mean.position += share * motion.position;
            }
            let felt: Vector3<f64> = state.imu.specific_force * share;
            mean.imu.specific_force += felt;
        }
        mean
    }
}

fn added(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
