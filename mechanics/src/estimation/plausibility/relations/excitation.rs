//! Which sensors a log can have shown to be wrong: those whose effect its motion excited.
//!
//! The checks of this folder say nothing where nothing moves. For each joint of the arm, the lean that its motion alone
//! makes is summed up step by step, in the band of the comparison, while the machine stands on all wheels:
//! ```text
//!     sum of lean(q with this joint moved) - lean(q)
//! ```
//! A log shows the sign of a joint, its order among the others and that it has not stopped only if that lean is large.

use nalgebra::{SVector, Vector1, Vector2, Vector3};
use tipwatch_language::{say, word};

use super::lean::of_arm;
use super::lean_model::LeanModel;
use super::low_pass::{Band, left};
use crate::machine::Machine;
use crate::state::State;

/// Time constant of the band in which a lean counts, and of turns and ways (s).
const BAND_S: f64 = 2.0;
const COMPARED_S: f64 = 3.0;
/// Shortest step between two rows that are compared (s), and longest.
const STEP_S: [f64; 2] = [0.1, 1.0];
/// Lean in the band by a joint that tests for its errors (rad): five times the lean of a standing platform by other causes.
const SHOWN_LEAN: f64 = 1e-3;
/// Turn (rad) and way (m) in three seconds that show the rest.
const SHOWN_TURN: f64 = 0.5;
const SHOWN_WAY: f64 = 1.0;
/// Fastest speed of a machine that stands (m/s).
const STANDING: f64 = 0.1;

/// An error of sensors that the motion in a log does not test for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unshown {
    /// Sign, order and motion of a joint, by its index.
    Joint(usize),
    /// Signs about the vertical: gyro, steering, left and right wheels.
    Turn,
    /// Direction of the wheels and of the odometry.
    Travel,
}

/// Sums up the motion of a log that tests for errors of sensors, from its rows in time order.
#[derive(Debug, Clone)]
pub struct Excitation {
    /// `None` where the platform's lean cannot be compared.
    model: Option<LeanModel>,
    base_from_imu: nalgebra::Matrix3<f64>,
    joints: Vec<JointLean>,
    /// Time (ns) of the last row that was compared; `None` before the first.
    last_ns: Option<i64>,
    /// Joint positions of that row.
    before: Vec<f64>,
    turned: LeakyIntegral<1>,
    gone: LeakyIntegral<1>,
    largest_turn: f64,
    largest_way: f64,
}

/// Lean by one joint.
#[derive(Debug, Clone)]
struct JointLean {
    joint: usize,
    sum: Vector2<f64>,
    band: Band,
    largest: f64,
}

impl Excitation {
    /// Creates the sums before the first row.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        Self {
            model: LeanModel::new(machine),
            base_from_imu: machine.imu().rotation_in_body(),
            joints: of_arm(machine)
                .map(|joint| JointLean {
                    joint,
                    sum: Vector2::zeros(),
                    band: Band::new(BAND_S),
                    largest: 0.0,
                })
                .collect(),
            last_ns: None,
            before: vec![f64::NAN; machine.joints().len()],
            turned: LeakyIntegral::new(),
            gone: LeakyIntegral::new(),
            largest_turn: 0.0,
            largest_way: 0.0,
        }
    }

    /// Takes a row whose state is known. Nothing allocates.
    pub fn take(&mut self, time_ns: i64, state: &State<f64>) {
        let Some(last_ns) = self.last_ns else {
            self.keep(time_ns, state);
            return;
        };
        let step_s = time_ns.saturating_sub(last_ns) as f64 * 1e-9;
        if step_s < STEP_S[0] {
            return;
        }
        if step_s > STEP_S[1] {
            self.keep(time_ns, state);
            return;
        }
        let turning = (self.base_from_imu * state.imu.angular_velocity).z;
        let forward = state.base.velocity.x;
        let left = left(step_s, COMPARED_S);
        for (sum, rate, largest) in [
            (&mut self.turned, turning, &mut self.largest_turn),
            (&mut self.gone, forward, &mut self.largest_way),
        ] {
            if rate.is_finite() {
                sum.add(left, &Vector1::new(rate * step_s));
                *largest = largest.max(sum.value.x.abs());
            }
        }
        let up = self.base_from_imu * state.imu.specific_force;
        let stands = !(state.base.velocity.norm() > STANDING);
        if let Some(model) = &mut self.model {
            add_joints(
                model,
                &mut self.joints,
                &self.before,
                state,
                &up,
                step_s,
                stands,
            );
        }
        self.keep(time_ns, state);
    }

    /// Keeps the row that the next one is compared with.
    fn keep(&mut self, time_ns: i64, state: &State<f64>) {
        self.last_ns = Some(time_ns);
        self.before.clear();
        let positions = state.joints.iter().map(|joint| joint.position);
        self.before.extend(positions);
    }

    /// Returns the errors of sensors for which the motion in the rows is no test.
    #[must_use]
    pub fn unshown(&self) -> Vec<Unshown> {
        let joints = self.joints.iter().filter(|it| it.largest < SHOWN_LEAN);
        let mut all: Vec<Unshown> = joints.map(|it| Unshown::Joint(it.joint)).collect();
        if self.largest_turn < SHOWN_TURN {
            all.push(Unshown::Turn);
        }
        if self.largest_way < SHOWN_WAY {
            all.push(Unshown::Travel);
        }
        all
    }

    /// States the errors for which the rows of `source` ("this log") are no test: these errors are found only by a check at the
    /// machine. `None` if the rows test for all of them.
    #[must_use]
    pub fn statement(&self, machine: &Machine, source: &str) -> Option<String> {
        let unshown = self.unshown();
        let joints = unshown.iter().filter_map(|it| match it {
            Unshown::Joint(joint) => Some(machine.joints()[*joint].name.as_str()),
            Unshown::Turn | Unshown::Travel => None,
        });
        let joints: Vec<&str> = joints.collect();
        let mut parts = Vec::new();
        if !joints.is_empty() {
            parts.push(say!(
                "the encoders of {} (sign, order, standstill: alone they lean the platform by less than 1 mrad while it stands on all wheels)",
                joints.join(", ")
            ));
        }
        if unshown.contains(&Unshown::Turn) {
            parts.push(
                word!("signs about the vertical (the machine turns by less than 0.5 rad)").into(),
            );
        }
        if unshown.contains(&Unshown::Travel) {
            parts.push(word!("the direction of travel (the machine goes less than 1 m)").into());
        }
        (!parts.is_empty()).then(|| {
            say!(
                "Not tested by the motion of {source}: {}. An error there is found only by a check at the machine.",
                parts.join("; ")
            )
        })
    }
}

/// Adds the lean by each joint, moved from its position before to that of the state.
fn add_joints(
    model: &mut LeanModel,
    joints: &mut [JointLean],
    before: &[f64],
    state: &State<f64>,
    up: &Vector3<f64>,
    step_s: f64,
    stands: bool,
) {
    for (joint, &position) in before.iter().enumerate() {
        model.set(joint, position, 0.0);
    }
    model.carry(state);
    let load = model.posture_load(up);
    let at_rest = model.lean_on_all_wheels(&load);
    // where a wheel carries nothing, tyres are no springs
    let stands = stands && model.is_on_all_wheels(&load);
    for it in joints {
        let now = state.joints[it.joint].position;
        let moved = if now == before[it.joint] || !stands {
            Vector2::zeros()
        } else {
            model.set(it.joint, now, 0.0);
            let load = model.posture_load(up);
            let lean = model.lean_on_all_wheels(&load);
            model.set(it.joint, before[it.joint], 0.0);
            lean - at_rest
        };
        if moved.iter().all(|v| v.is_finite()) {
            it.sum += moved;
        }
        let in_band = it.band.step(step_s, &it.sum);
        it.largest = it.largest.max(in_band.norm());
    }
}

/// The integral x of `dx/dt = r - x / T`.
#[derive(Debug, Clone)]
struct LeakyIntegral<const N: usize> {
    value: SVector<f64, N>,
}

impl<const N: usize> LeakyIntegral<N> {
    fn new() -> Self {
        Self {
            value: SVector::zeros(),
        }
    }

    /// Adds the change of a step; `left`: see [`left`](super::low_pass::left). Integrals of one time constant share the
    /// exponential.
    fn add(&mut self, left: f64, change: &SVector<f64, N>) {
        self.value = (self.value + change) * left;
    }
}
