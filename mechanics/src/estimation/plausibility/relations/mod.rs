//! The table of relations: what one sensor measures, predicted from the others by the mechanics of the machine.
//!
//! | relation | predicted | from | asked |
//! |---|---|---|---|
//! | [`Part::Rotation`] | how the attitude changes | gyro | always |
//! | [`Part::Acceleration`] | specific force | attitude, gyro, change of the odometry's velocity | unless the platform is turned over |
//! | [`Part::Drive`] | specific force forward | attitude, gyro, change of the wheels' speed | without odometry, as above |
//! | [`Part::Yaw`] | turn about the vertical | gyro; against odometry, speeds and steering of the wheels | as above |
//! | [`Part::Rolling`] | way | wheels; against odometry | as above |
//! | [`Part::Tilt`] | inclination | IMU; against odometry | always |
//! | [`Part::Lean`] | how the platform leans on its tyres | joints of the arm; against gyro | of a machine that stands |
//! | [`Part::SpecificForce`] | specific force after it stepped | as `Part::Acceleration`, and itself before | until it steps back |
//! | [`Part::Joint`] | where a joint is after its position jumped | itself before; decided by the lean | until it returns |
//!
//! Where no attitude is measured, the up direction at rest, carried on by the gyro, stands for it: see [`inclination`].
//!
//! A row of it is judged window by window: see [`window`]. The density of the residual if all sensors are sound
//! ([`likelihood`]) contains the noise that the samples themselves show, what is not known beforehand and is learned
//! ([`unknowns`]: biases, the compliance of tyres and ground), and an error of the model. Against it stand alternatives
//! ([`Explanation`](super::Explanation)). A relation cannot tell which of its sensors is wrong. Where nothing moves, nothing is shown.

mod excitation;
mod force_step;
mod gyro;
mod hypotheses;
mod inclination;
mod lean;
mod lean_model;
mod likelihood;
mod low_pass;
mod motion;
mod offsets;
mod rolling;
#[cfg(test)]
mod tests;
mod tilt;
mod turn;
mod unknowns;
mod window;

use nalgebra::{Matrix3, Vector3};

use super::attitude::up_direction;
use super::false_alarms;
use super::fault::{Finding, Part, YawBy};
use super::notice::{Found, Note, Notice, Rules};
use super::signal_doubt::SignalDoubt;
use super::signals::Sound;
use crate::machine::{Machine, Proof, Proofs};
use crate::state::{Sample, Sensor, Sensors, tilt_is_measured};
pub use excitation::{Excitation, Unshown};
use force_step::{ForceSteps, Measured};
pub use lean::lean_shows_loads;
use lean::{BEFOREHAND, LeanRelation, of_arm};
pub use lean_model::LeanOnTyres;
use likelihood::Standing;
pub use likelihood::student;
use motion::{RotationRelation, SpecificForceRelation};
use offsets::Offsets;
use tilt::TiltRelation;
use turn::{TurnRelation, WayRelation};
use window::{Accumulated, TURNED_OVER, WINDOW_S};

/// Time after the platform was turned over for which wheels and odometry are not compared (ns).
const AFTERWARDS_NS: i64 = 2_000_000_000;
/// Alternatives that are weighed, about: the threshold depends on the logarithm of their number.
const ALTERNATIVES: usize = 80;

/// Compares samples of all sensors, in stamp order, as far as they are sound by themselves.
#[derive(Debug, Clone)]
pub(in crate::estimation) struct Relations {
    rules: Rules,
    window: Accumulated,
    start_ns: Option<i64>,
    /// Stamp before which wheels and odometry are not compared (ns).
    silent_until_ns: i64,
    base_from_imu: Matrix3<f64>,
    has_imu: bool,
    rotation: RotationRelation,
    force: SpecificForceRelation,
    steps: ForceSteps,
    turns: [TurnRelation; 3],
    way: WayRelation,
    tilt: TiltRelation,
    lean: Option<LeanRelation>,
    /// Joints of the arm.
    arm: Vec<usize>,
    /// Joints of which an earlier session has contradicted that they stood still, and of which the lean tells nothing in this one.
    stopped_before: Vec<usize>,
    offsets: Offsets,
    /// Joints of each stream.
    joints: Vec<Vec<usize>>,
    /// Signals that the windows so far have proven, and signals that they make unlikely to be right.
    proven: Proofs,
    disputed: Proofs,
}

impl Relations {
    /// Relations before their first sample.
    pub(in crate::estimation) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let rules = Rules::of(machine);
        let has_imu = sensors.imu && machine.imu().body == 0;
        let base_from_imu = machine.imu().rotation_in_body();
        let threshold = false_alarms::threshold(
            machine.plausibility().false_alarms_per_hour,
            3600.0 / WINDOW_S,
            ALTERNATIVES,
        );
        let skids = machine.skids();
        let turn = |by| TurnRelation::new(by, skids && by != YawBy::Steering, threshold);
        let streams = sensors.joints.iter();
        Self {
            window: Accumulated::new(base_from_imu, rules.limits.max_gap_s),
            rules,
            start_ns: None,
            silent_until_ns: i64::MIN,
            base_from_imu,
            has_imu,
            rotation: RotationRelation::new(threshold),
            force: SpecificForceRelation::new(machine, threshold),
            steps: ForceSteps::new(machine),
            turns: [YawBy::Odometry, YawBy::Speeds, YawBy::Steering].map(turn),
            way: WayRelation::new(threshold),
            tilt: TiltRelation::new(machine, threshold),
            lean: LeanRelation::new(machine, has_imu, threshold),
            arm: of_arm(machine).collect(),
            stopped_before: Vec::new(),
            offsets: Offsets::new(machine),
            joints: streams.map(|stream| stream.joints.clone()).collect(),
            proven: Proofs::NONE,
            disputed: Proofs::NONE,
        }
    }

    /// Takes a sample that was checked by itself, and appends the contradictions to `findings`. A sample of joints of which some
    /// repeat their last value compares nothing; earlier findings about a joint in it stand.
    pub(in crate::estimation) fn step(
        &mut self,
        sample: &Sample<'_>,
        sound: Sound,
        is_whole: bool,
        findings: &mut Vec<Finding>,
    ) {
        self.offsets.take(findings, self.lean.as_mut());
        match sample.sensor {
            Sensor::Number(..) => {
                return;
            }
            // as if it had been lost
            _ if findings.iter().any(Finding::lacks_a_value) => {}
            Sensor::Joints(_) if !is_whole => {}
            Sensor::Joints(stream) => self.take_joints(stream, sample, sound),
            Sensor::Imu => self.take_imu(sample, sound),
            Sensor::Odometry => self.take_odometry(sample, sound),
            Sensor::ToolWrench => self.take_tool(sample, sound),
        }
        self.finish_window(sample.stamp_ns);
        self.report(sample, findings);
    }

    fn take_imu(&mut self, sample: &Sample<'_>, sound: Sound) {
        if !self.has_imu {
            return;
        }
        if !(sound.force && sound.turning) {
            self.window.break_imu();
            if let Some(lean) = &mut self.lean {
                lean.distrust();
            }
            self.prove();
            return;
        }
        let (force, turning, xyzw) = (
            &sample.values[..3],
            &sample.values[3..6],
            &sample.values[6..],
        );
        let [force, turning] = [force, turning].map(Vector3::from_column_slice);
        let xyzw = sound.attitude.then_some(xyzw);
        (self.window).take_imu(sample.stamp_ns, [&force, &turning], xyzw);
        let up = xyzw
            .filter(|xyzw| tilt_is_measured(xyzw))
            .and_then(up_direction)
            .map(|up| self.base_from_imu * up);
        if let Some(up) = &up {
            self.tilt.take_imu(up);
        }
        let [force, turning] = [force, turning].map(|vector| self.base_from_imu * vector);
        match up.or_else(|| self.window.carried_up()) {
            // thrown about, it moves as no wheel does
            _ if sample.stamp_ns < self.silent_until_ns => self.steps.restart(),
            Some(up) => {
                let measured = Measured {
                    stamp_ns: sample.stamp_ns,
                    force,
                    turning,
                    up,
                    velocity: self.window.velocity(sample.stamp_ns),
                };
                self.steps.take(&measured, &self.rules.limits);
            }
            None => {}
        }
        if let Some(lean) = &mut self.lean {
            lean.take_imu(sample.stamp_ns, [&force, &turning], self.window.speed());
        }
    }

    fn take_odometry(&mut self, sample: &Sample<'_>, sound: Sound) {
        let (velocity, turning, attitude) = (
            &sample.values[..3],
            &sample.values[3..6],
            &sample.values[6..],
        );
        if !sound.velocity {
            self.window.break_odometry();
            return;
        }
        let turning = if sound.turning { turning[2] } else { f64::NAN };
        let velocity = Vector3::from_column_slice(velocity);
        self.window
            .take_odometry(sample.stamp_ns, velocity, turning);
        if sound.attitude && tilt_is_measured(attitude) {
            self.tilt.take_odometry(attitude);
        }
    }

    fn take_tool(&mut self, sample: &Sample<'_>, sound: Sound) {
        if let Some(lean) = self.lean.as_mut().filter(|_| sound.whole) {
            let wrench = [0, 3].map(|at| Vector3::from_column_slice(&sample.values[at..at + 3]));
            lean.take_tool(sample.stamp_ns, wrench);
        }
    }

    fn take_joints(&mut self, stream: usize, sample: &Sample<'_>, sound: Sound) {
        let Some(lean) = &mut self.lean else {
            return;
        };
        if !sound.whole {
            lean.distrust();
            self.window.take_wheels(sample.stamp_ns, None);
            return;
        }
        let (positions, rates) = sample.values.split_at(sample.values.len() / 2);
        let motions = self.joints[stream].iter().zip(positions.iter().zip(rates));
        let motions = motions.map(|(&joint, (&position, &rate))| (joint, position, rate));
        let rolled = lean.take_joints(sample.stamp_ns, motions, &self.rules.limits);
        self.window.take_wheels(sample.stamp_ns, rolled);
    }

    /// Ends the window if it is long enough, and weighs its measurements.
    fn finish_window(&mut self, stamp_ns: i64) {
        let start_ns = *self.start_ns.get_or_insert(stamp_ns);
        let elapsed_s = self.rules.limits.elapsed_s(start_ns, stamp_ns);
        if elapsed_s < WINDOW_S {
            return;
        }
        self.start_ns = Some(stamp_ns);
        let window = self.window.finish(start_ns, stamp_ns);
        if elapsed_s > WINDOW_S + self.rules.limits.max_gap_s {
            // a hole of all sensors
            return;
        }
        self.rotation.weigh(&window);
        self.tilt.weigh(start_ns);
        let turned = window.turned.map_or(0.0, |turned| turned.xy().norm());
        if turned > TURNED_OVER {
            self.silent_until_ns = stamp_ns.saturating_add(AFTERWARDS_NS);
        }
        if stamp_ns < self.silent_until_ns {
            if let Some(lean) = &mut self.lean {
                lean.distrust();
            }
            return;
        }
        self.force.weigh(&window);
        for turn in &mut self.turns {
            turn.weigh(&window);
        }
        self.way.weigh(&window);
        if let Some(lean) = &mut self.lean {
            lean.weigh(start_ns, stamp_ns);
            self.offsets.end_refuted(lean);
        }
        self.prove();
    }

    /// Reports the explanations that stand, with the samples of the sensor that each is about.
    fn report(&mut self, sample: &Sample<'_>, findings: &mut Vec<Finding>) {
        let policies = &self.rules.policies;
        let mut note = Note::new(findings, policies, sample);
        if let Sensor::Joints(stream) = sample.sensor {
            for &joint in &self.joints[stream] {
                if let Some(notice) = self.offsets.standing(joint, sample.stamp_ns) {
                    note.of(Part::Joint(joint))(notice);
                }
            }
        }
        if sample.sensor == Sensor::Odometry && self.has_imu {
            tell(self.way.standing(), &mut note.of(Part::Rolling));
        }
        if sample.sensor != Sensor::Imu {
            return;
        }
        if let Some(notice) = self.steps.standing(sample.stamp_ns) {
            note.of(Part::SpecificForce)(notice);
        }
        tell(self.rotation.standing(), &mut note.of(Part::Rotation));
        let part = self.force.part();
        tell(self.force.standing(), &mut note.of(part));
        for turn in &self.turns {
            tell(turn.standing(), &mut note.of(Part::Yaw(turn.by)));
        }
        tell(self.tilt.standing(), &mut note.of(Part::Tilt));
        if let Some(lean) = &self.lean {
            let standing = lean.standing(|explanation| self.rotation.against(explanation));
            tell(standing, &mut note.of(Part::Lean));
        }
    }
}

impl Relations {
    /// Returns the doubts about joints that contradict themselves since they jumped.
    pub(in crate::estimation) fn offsets(&self) -> impl Iterator<Item = SignalDoubt> {
        self.offsets.doubts()
    }

    /// Returns the doubt about the specific force since it stepped.
    pub(in crate::estimation) fn force_step(&self) -> Option<SignalDoubt> {
        self.steps.doubt()
    }

    /// Remembers the size of a step of the specific force in an earlier session (m/s^2).
    pub(in crate::estimation) fn remember_force_step(&mut self, by: f64) {
        self.steps.remember(by);
    }

    /// Remembers the jump of a joint in an earlier session: its size, and the part of it that may be motion (rad or m).
    pub(in crate::estimation) fn remember_offset(&mut self, joint: usize, by: f64, moved: f64) {
        let supposed = self.offsets.remember(joint, by, moved);
        if let Some(lean) = &mut self.lean {
            lean.suppose_offset(joint, supposed);
        }
    }

    /// The joints whose encoder had stopped, as the lean of the platform has contradicted.
    pub(in crate::estimation) fn had_stopped(&self) -> impl Iterator<Item = SignalDoubt> {
        let joints = self.lean.iter().flat_map(LeanRelation::had_stopped);
        let joints = joints.chain(self.stopped_before.iter().copied());
        joints.map(SignalDoubt::stopped_once)
    }

    /// The encoder of a joint had stopped in a session before, or before a restart.
    pub(in crate::estimation) fn remember_stopped(&mut self, joint: usize) {
        let lean = self.lean.as_mut();
        if !lean.is_some_and(|lean| lean.remember_stopped(joint)) {
            self.stopped_before.push(joint);
        }
        self.prove();
    }

    /// Trusts the present positions of these joints, as a person says.
    pub(in crate::estimation) fn trust(&mut self, signals: Proofs) {
        if let Some(lean) = &mut self.lean {
            lean.trust(signals);
            let joints = self.offsets.doubts().map(|doubt| doubt.signal);
            for signal in joints.filter(|&signal| signals.has(signal)) {
                if let Proof::Joint(joint) = signal {
                    lean.suppose_offset(joint, None);
                }
            }
        }
        self.offsets.trust(signals);
        (self.stopped_before).retain(|&joint| !signals.has(Proof::Joint(joint)));
        if signals.has(Proof::SpecificForce) {
            self.steps.trust();
        }
    }
}

impl Relations {
    /// Returns the signals that the motion so far has proven: each alternative about them is refuted. The mounting of the
    /// accelerometer is not among them: the slope of the ground is unknown.
    pub(in crate::estimation) fn proven(&self) -> Proofs {
        self.proven
    }

    /// Returns the probability that each joint of the arm has the other sign, by the windows so far; where the lean is not
    /// compared, the probability of a joint that nobody has tested.
    pub(in crate::estimation) fn reversed(&self) -> Vec<(usize, f64)> {
        let refuted = |explanation| self.rotation.against(explanation);
        let untested = || self.arm.iter().map(|&joint| (joint, BEFOREHAND)).collect();
        (self.lean.as_ref()).map_or_else(untested, |lean| lean.reversed(refuted))
    }

    /// Returns the signals that the motion so far makes unlikely to be right, without refuting them: an alternative is more
    /// likely by now, although only one in a hundred sensors is wired so.
    pub(in crate::estimation) fn disputed(&self) -> Proofs {
        self.disputed
    }

    fn prove(&mut self) {
        let lean = self.lean.as_ref();
        self.proven = lean.map_or(Proofs::NONE, LeanRelation::proven);
        // An attitude may stand in the same housing: what turns with it proves nothing.
        if !self.turns.iter().any(TurnRelation::is_proven) {
            self.proven.remove(Proof::AngularVelocity);
        }
        self.disputed = lean.map_or(Proofs::NONE, LeanRelation::disputed);
        for &joint in &self.stopped_before {
            self.disputed.add(Proof::Joint(joint));
        }
        // the attitude of an IMU is that of its housing
        let is_force = self.force.is_disputed(BEFOREHAND) || self.tilt.is_disputed(BEFOREHAND);
        let is_turning = self.rotation.is_disputed(BEFOREHAND);
        for (is_disputed, signal) in [
            (is_force, Proof::SpecificForce),
            (is_turning, Proof::AngularVelocity),
        ] {
            if is_disputed {
                self.disputed.add(signal);
            }
        }
    }
}

fn tell(standing: Standing, found: &mut Found<'_>) {
    if let Some((explanation, evidence, threshold)) = standing {
        let notice =
            Notice::contradiction(evidence.since_ns, evidence.value, threshold, explanation);
        found(notice.possible_since(evidence.possible_since_ns()));
    }
}
