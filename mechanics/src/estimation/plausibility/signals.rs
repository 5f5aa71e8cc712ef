//! The checks of each sensor's samples by themselves. Of the other sensors they only ask whether something moves: a
//! signal that does not change is frozen then.

use nalgebra::Vector3;

use super::attitude::{AttitudeWatch, OTHER_AXES};
use super::explanation::Explanation;
use super::fault::{Finding, Part};
use super::freeze::Freeze;
use super::gravity::GravityWatch;
use super::joint::{JointLimits, JointWatch};
use super::notice::{Note, Notice, Rules};
use super::signal_doubt::{KnownPosition, SignalDoubt};
use super::vector::{Slew, VectorWatch};
use crate::machine::{FaultKind, ForceSource, Machine, PayloadQuantity, Proof, Proofs, SignalSpec};
use crate::state::{NumberKind, Sample, SampleError, Sensor, Sensors, tilt_is_measured};

/// Allowance for noise and stamp jitter in the change of an angular velocity (rad/s) and of a velocity (m/s).
const SLEW_ALLOWANCE: f64 = 0.5;
/// Angular velocity above which the machine counts as moving (rad/s).
const TURNING: f64 = 0.1;
/// Velocity above which the machine counts as moving (m/s).
const TRAVELLING: f64 = 0.1;
/// Differences between two samples that do no harm: of a specific force (m/s^2), an angular velocity (rad/s), a velocity (m/s),
/// and of a force on the tool, as a share of the weight.
pub(super) const HARMLESS_FORCE: f64 = 1.0;
const HARMLESS_TURNING: f64 = 0.2;
const HARMLESS_VELOCITY: f64 = 0.3;
const HARMLESS_TOOL: f64 = 0.02;
/// Lever arm that relates the largest moment on the tool to the largest force (m).
const TOOL_LEVER: f64 = 1.0;
/// Largest force of an actuator, or of one of its chambers, as a multiple of the machine's weight.
const ACTUATOR_WEIGHTS: f64 = 100.0;
/// Largest force on the tool as a multiple of the machine's weight, where none is stated.
const TOOL_FORCE_WEIGHTS: f64 = 10.0;

/// Checks samples by themselves, those of all sensors in stamp order.
#[derive(Debug, Clone)]
pub(in crate::estimation) struct SignalChecks {
    sensors: Sensors,
    rules: Rules,
    /// Stamp of the last sample of each sensor, in the order of [`Sensors::iter`].
    last_ns: Vec<(Sensor, Option<i64>)>,
    /// Joints, by stream and index in it.
    joints: Vec<Vec<JointWatch>>,
    force: VectorWatch,
    turning: VectorWatch,
    attitude: AttitudeWatch,
    gravity: GravityWatch,
    velocity: VectorWatch,
    odometry_turning: VectorWatch,
    odometry_attitude: AttitudeWatch,
    tool: [VectorWatch; 2],
    /// Actuators, by signal.
    actuators: Vec<VectorWatch>,
    /// The load sensors, the signals of payloads, and those of forces by which nothing is computed.
    numbers: Vec<NumberWatch>,
    motion: Motion,
}

/// The parts of a sample that are sound by themselves: only these are compared with other sensors.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::estimation) struct Sound {
    /// All of a sample of joints or of the tool.
    pub(super) whole: bool,
    pub(super) force: bool,
    pub(super) turning: bool,
    pub(super) attitude: bool,
    pub(super) velocity: bool,
}

/// The check of a number from which the state is not estimated.
#[derive(Debug, Clone)]
struct NumberWatch {
    sensor: Sensor,
    freeze: Freeze,
    /// Largest magnitude; infinite where nothing is known of it.
    largest: f64,
}

/// Motion detected in the last samples.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    joints: bool,
    wheels: bool,
    turning: bool,
    travelling: bool,
}

impl SignalChecks {
    /// Checks of samples of which the later ones are known, and judge the first ones. Where samples arrive one by one this is of
    /// no use: when it is known, rows have settled and the knock has faded.
    pub(in crate::estimation) fn in_retrospect(machine: &Machine, sensors: &Sensors) -> Self {
        let mut checks = Self::new(machine, sensors);
        checks.force.judge_first_samples(HARMLESS_FORCE);
        checks
    }

    /// Checks before their first sample.
    pub(in crate::estimation) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let spec = machine.plausibility();
        let weight = machine.mass() * machine.gravity();
        let largest_force = TOOL_FORCE_WEIGHTS * weight;
        let slew = |per_second: f64| {
            Some(Slew {
                per_second,
                allowance: SLEW_ALLOWANCE,
            })
        };
        let turning = || {
            let slew = slew(spec.angular_acceleration_max);
            VectorWatch::new(spec.angular_velocity_max, slew).with_outliers(HARMLESS_TURNING)
        };
        let signals = machine.signals();
        let imu = signals.imu.as_ref().and_then(SignalSpec::fields);
        let odometry = signals.odometry.as_ref().and_then(SignalSpec::fields);
        let tool = signals.tool_wrench.as_ref().and_then(SignalSpec::fields);
        let harmless_tool = HARMLESS_TOOL * weight;
        let rules = Rules::of(machine);
        let sticks = rules.limits.sticks;
        let joints: Vec<Vec<JointWatch>> = sensors
            .joints
            .iter()
            .map(|stream| {
                let watch = |&joint: &usize| JointWatch::new(joint_limits(machine, joint), sticks);
                stream.joints.iter().map(watch).collect()
            })
            .collect();
        Self {
            rules,
            last_ns: sensors.iter().map(|sensor| (sensor, None)).collect(),
            joints,
            force: VectorWatch::new(spec.specific_force_max, None)
                .with_outliers(HARMLESS_FORCE)
                .with_axes(sticks)
                .of_numbers(imu.map(|imu| &imu.specific_force)),
            turning: turning()
                .with_axes(sticks)
                .of_numbers(imu.map(|imu| &imu.angular_velocity)),
            attitude: AttitudeWatch::new(),
            gravity: GravityWatch::new(machine.gravity(), spec.gravity_tolerance),
            velocity: VectorWatch::new(spec.speed_max, slew(spec.acceleration_max))
                .with_outliers(HARMLESS_VELOCITY)
                .of_numbers(odometry.map(|odometry| &odometry.velocity)),
            odometry_turning: turning()
                .of_numbers(odometry.and_then(|odometry| odometry.angular_velocity.as_ref())),
            odometry_attitude: AttitudeWatch::new(),
            tool: [
                VectorWatch::new(spec.tool_force_max.unwrap_or(largest_force), None)
                    .with_outliers(harmless_tool)
                    .of_numbers(tool.map(|tool| &tool.force))
                    .may_rest(),
                VectorWatch::new(
                    spec.tool_moment_max.unwrap_or(largest_force * TOOL_LEVER),
                    None,
                )
                .with_outliers(harmless_tool * TOOL_LEVER)
                .of_numbers(tool.map(|tool| &tool.moment))
                .may_rest(),
            ],
            actuators: (sensors.actuators.iter())
                .map(|signal| {
                    let joint = &machine.contact().actuated_joints[signal.joint];
                    let factor = joint.signals[signal.signal].abs();
                    let freeze = match joint.source {
                        ForceSource::Support { .. } => Freeze::new().may_rest_at_zero(),
                        ForceSource::Linkage(_) => Freeze::new().may_rest(),
                    };
                    VectorWatch::new(ACTUATOR_WEIGHTS * weight / factor, None).of_one_number(freeze)
                })
                .collect(),
            numbers: (sensors.all())
                .filter_map(|sensor| {
                    Some(NumberWatch {
                        sensor,
                        freeze: rest_of_number(machine, sensor)?,
                        largest: largest_number(machine, sensor),
                    })
                })
                .collect(),
            motion: Motion::default(),
            sensors: sensors.clone(),
        }
    }

    /// Checks a sample and appends its faults to `findings`; returns which parts of it are sound. Joints that only `repeat` their
    /// last value, by place, are not checked.
    ///
    /// # Errors
    /// The sensor does not exist, the number of values is wrong, or the stamp is not later than the preceding one.
    pub(in crate::estimation) fn step(
        &mut self,
        sample: &Sample<'_>,
        repeat: &[bool],
        findings: &mut Vec<Finding>,
    ) -> Result<Sound, SampleError> {
        if self.sensors.value_count(sample.sensor) != Some(sample.values.len()) {
            return Err(SampleError::UnknownSensor);
        }
        let last = self
            .last_ns
            .iter_mut()
            .find(|(sensor, _)| *sensor == sample.sensor);
        let (_, last_ns) = last.ok_or(SampleError::UnknownSensor)?;
        if last_ns.is_some_and(|last| sample.stamp_ns <= last) {
            return Err(SampleError::NotLater);
        }
        *last_ns = Some(sample.stamp_ns);
        Ok(match sample.sensor {
            Sensor::Joints(stream) => self.check_joints(stream, sample, repeat, findings),
            Sensor::Imu => self.check_imu(sample, findings),
            Sensor::Odometry => self.check_odometry(sample, findings),
            Sensor::ToolWrench => self.check_tool(sample, findings),
            Sensor::Number(NumberKind::Actuator, signal) => {
                self.check_actuator(signal, sample, findings)
            }
            Sensor::Number(..) => {
                self.check_number(sample, findings);
                Sound::default()
            }
        })
    }

    /// Checks that a load sensor, a signal of payloads or a force by which nothing is computed is still measured, and that the force is
    /// possible. Nothing else is known of a number without a scale, which may jump.
    pub(super) fn check_number(&mut self, sample: &Sample<'_>, findings: &mut Vec<Finding>) {
        let mut numbers = self.numbers.iter_mut();
        let number = numbers.find(|it| it.sensor == sample.sensor);
        let Some(number) = number.filter(|_| sample.values.iter().all(|it| it.is_finite())) else {
            return;
        };
        let (stamp_ns, Rules { limits, policies }) = (sample.stamp_ns, &self.rules);
        let mut note = Note::new(findings, policies, sample);
        let mut found = note.of(Part::Number);
        let size = sample.values.iter().fold(0.0_f64, |a, it| a.max(it.abs()));
        if size > number.largest {
            found(Notice::of(FaultKind::OutOfRange, stamp_ns).measured(size, number.largest));
            return;
        }
        let moves = self.motion.joints;
        let frozen = (number.freeze).notice(stamp_ns, sample.values, moves, limits);
        if let Some(notice) = frozen {
            found(notice);
        }
    }

    /// The joints that have stopped to be measured.
    pub(super) fn frozen(&self) -> impl Iterator<Item = SignalDoubt> {
        let joints = self.watched_joints();
        joints.filter_map(|(watch, joint)| Some(SignalDoubt::frozen(joint, watch.frozen_rate()?)))
    }

    /// The joints that have stopped, and still repeat themselves.
    pub(super) fn repeating(&self) -> Proofs {
        let joints = self.watched_joints().filter(|(it, _)| it.still_repeats());
        joints.map(|(_, joint)| Proof::Joint(joint)).collect()
    }

    /// A joint had stopped to be measured when the session before ended.
    pub(super) fn remember_frozen(&mut self, joint: usize, rate: f64) {
        self.watch_of(joint)
            .for_each(|watch| watch.remember_frozen(rate));
    }

    /// Remembers the position of a joint from an earlier session.
    pub(super) fn remember_position(&mut self, at: &KnownPosition) {
        self.watch_of(at.joint)
            .for_each(|watch| watch.remember_position(at.stamp_ns, at.position));
    }

    /// Returns the last known positions of the joints.
    pub(super) fn known_positions(&self) -> impl Iterator<Item = KnownPosition> {
        self.watched_joints().filter_map(|(watch, joint)| {
            let (stamp_ns, position) = watch.known_position()?;
            Some(KnownPosition {
                joint,
                stamp_ns,
                position,
            })
        })
    }

    /// Returns the doubts about joints that have jumped where they cannot have moved, while nobody knows yet whether they stay
    /// there.
    pub(super) fn jumps(&self) -> impl Iterator<Item = SignalDoubt> {
        self.watched_joints().filter_map(|(watch, joint)| {
            let [by, moved] = watch.jump()?;
            Some(SignalDoubt {
                signal: Proof::Joint(joint),
                by,
                moved,
            })
        })
    }

    /// Returns the doubt about an IMU whose heading jumped, in this session or an earlier one: its housing may have turned.
    pub(super) fn turned(&self) -> Option<SignalDoubt> {
        let by = self.attitude.turned()?;
        Some(SignalDoubt {
            signal: Proof::AngularVelocity,
            by,
            moved: OTHER_AXES,
        })
    }

    /// Remembers by how much the heading of the IMU had jumped in an earlier session (rad).
    pub(super) fn remember_turned(&mut self, by: f64) {
        self.attitude.remember_turned(by);
    }

    /// Returns the signals whose axes may be others since then.
    pub(in crate::estimation) fn turned_housing(&self) -> Proofs {
        let disputed = self.turned().map(|doubt| doubt.disputed());
        disputed.unwrap_or(Proofs::NONE)
    }

    /// Trusts the present positions of these joints, and the axes of the IMU, as a person says.
    pub(super) fn trust(&mut self, signals: Proofs) {
        if signals.has(Proof::AngularVelocity) {
            self.attitude.trust();
        }
        self.watches_mut()
            .filter(|&(_, joint)| signals.has(Proof::Joint(joint)))
            .for_each(|(watch, _)| watch.trust());
    }

    fn watch_of(&mut self, joint: usize) -> impl Iterator<Item = &mut JointWatch> {
        let watches = self.watches_mut().filter(move |&(_, it)| it == joint);
        watches.map(|(watch, _)| watch)
    }

    fn watches_mut(&mut self) -> impl Iterator<Item = (&mut JointWatch, usize)> {
        let streams = self.joints.iter_mut().zip(&self.sensors.joints);
        streams.flat_map(|(watches, stream)| watches.iter_mut().zip(stream.joints.iter().copied()))
    }

    fn watched_joints(&self) -> impl Iterator<Item = (&JointWatch, usize)> {
        let streams = self.joints.iter().zip(&self.sensors.joints);
        streams.flat_map(|(watches, stream)| watches.iter().zip(stream.joints.iter().copied()))
    }

    /// Returns the signals that have had one value only so far. A switch does so rightly, and a standing machine's odometry.
    /// `is_idle` is true for signals of actuators on which no load depends.
    pub(in crate::estimation) fn unchanged(&self, is_idle: &dyn Fn(usize) -> bool) -> Proofs {
        let joints = self.watched_joints();
        let joints = joints.filter(|(watch, _)| !watch.has_changed());
        let joints = joints.map(|(_, joint)| Proof::Joint(joint));
        let vectors = self.freezes(is_idle);
        let vectors = vectors.filter(|(freeze, _)| !freeze.has_changed());
        joints.chain(vectors.map(|(_, proof)| proof)).collect()
    }

    /// Returns the signals of which nothing shows any more that they are measured: see [`Freeze::is_silent`].
    pub(super) fn silent(&self, is_idle: &dyn Fn(usize) -> bool) -> Proofs {
        let silent = self.freezes(is_idle).filter(|(it, _)| it.is_silent());
        silent.map(|(_, proof)| proof).collect()
    }

    /// Returns the repeat statistics of each signal other than joints, with the proof that the signal belongs to.
    fn freezes(&self, is_idle: &dyn Fn(usize) -> bool) -> impl Iterator<Item = (&Freeze, Proof)> {
        let of_imu = [
            (&self.force, Proof::SpecificForce),
            (&self.turning, Proof::AngularVelocity),
        ];
        let of_imu = of_imu.into_iter().filter(|_| self.sensors.imu);
        let of_tool = Some((&self.tool[0], Proof::ToolWrench)).filter(|_| self.sensors.tool_wrench);
        let of_actuators = self.actuators.iter().enumerate();
        let of_actuators = of_actuators
            .filter(|(signal, _)| !is_idle(*signal))
            .map(|(_, watch)| (watch, Proof::ActuatorForces));
        let vectors = of_imu.chain(of_tool).chain(of_actuators);
        let vectors = vectors.map(|(watch, proof)| (watch.freeze(), proof));
        // no load hangs on load sensors, nor on forces by which nothing is computed
        let is_of_payload =
            |sensor: Sensor| matches!(sensor, Sensor::Number(NumberKind::Payload, _));
        let numbers = self.numbers.iter();
        // an estimator that takes none of their samples knows nothing of them
        let payloads = numbers.filter(move |it| is_of_payload(it.sensor) && it.freeze.was_given());
        vectors.chain(payloads.map(|it| (&it.freeze, Proof::Payload)))
    }

    /// Whether the last value of an actuator's signal says nothing of the force: see [`Freeze::says_nothing`].
    pub(super) fn is_nothing(&self, signal: usize) -> bool {
        (self.actuators.get(signal)).is_some_and(|watch| watch.freeze().says_nothing())
    }

    /// The joints whose position is exactly zero.
    pub(in crate::estimation) fn at_zero(&self) -> Proofs {
        self.watched_joints()
            .filter(|(watch, _)| watch.is_at_zero())
            .map(|(_, joint)| Proof::Joint(joint))
            .collect()
    }

    fn check_joints(
        &mut self,
        stream: usize,
        sample: &Sample<'_>,
        repeat: &[bool],
        findings: &mut Vec<Finding>,
    ) -> Sound {
        let Self {
            joints,
            sensors,
            rules: Rules { limits, policies },
            motion,
            ..
        } = self;
        let mut note = Note::new(findings, policies, sample);
        let (positions, rates) = sample.values.split_at(sample.values.len() / 2);
        let moving = joints.iter().flatten().filter(|watch| watch.moves());
        let moving = moving.count() + usize::from(motion.turning || motion.travelling);
        let flickering = joints[stream].iter().filter(|watch| watch.flickers());
        let flickering = flickering.count();
        let watches = joints[stream]
            .iter_mut()
            .zip(&sensors.joints[stream].joints);
        let values = positions.iter().zip(rates).enumerate();
        let repeats = |place: usize| repeat.get(place) == Some(&true);
        for ((watch, &joint), (place, (&position, &rate))) in watches.zip(values) {
            if repeats(place) {
                continue;
            }
            let works =
                moving > usize::from(watch.moves()) || flickering > usize::from(watch.flickers());
            let mut found = note.of(Part::Joint(joint));
            let values = [position, rate];
            watch.check(sample.stamp_ns, values, works, limits, &mut found);
        }
        let moving = |wheel: bool| {
            let watches = joints.iter().flatten();
            watches
                .filter(|watch| watch.limits.spins_wheel == wheel)
                .any(JointWatch::moves)
        };
        (motion.joints, motion.wheels) = (moving(false), moving(true));
        // A position beyond a limit of the URDF is often right; the model goes on.
        let is_faulty = |finding: &Finding| finding.kind != FaultKind::JointLimit;
        Sound {
            whole: !findings.iter().any(is_faulty),
            ..Sound::default()
        }
    }

    fn check_imu(&mut self, sample: &Sample<'_>, findings: &mut Vec<Finding>) -> Sound {
        let (stamp_ns, values) = (sample.stamp_ns, sample.values);
        let (Rules { limits, policies }, seen) = (&self.rules, self.motion);
        let mut note = Note::new(findings, policies, sample);
        let moves = seen.joints || seen.wheels || seen.travelling;
        let (force, turning, attitude) = (&values[..3], &values[3..6], &values[6..]);
        let part = Part::SpecificForce;
        let has_force = self
            .force
            .check(stamp_ns, force, moves, limits, &mut note.of(part));
        let part = Part::AngularVelocity;
        let has_turning = self
            .turning
            .check(stamp_ns, turning, moves, limits, &mut note.of(part));
        let turns = is_faster(turning, TURNING);
        let part = Part::Attitude;
        let known = match has_turning {
            true => Vector3::from_column_slice(turning),
            false => Vector3::repeat(f64::NAN),
        };
        let mut of_attitude = |notice: Notice| {
            let jumps = notice.kind == FaultKind::Contradiction;
            note.of(part)(match jumps {
                true => notice.explained(Explanation::AttitudeOffset),
                false => notice,
            });
        };
        let has_attitude =
            (self.attitude).check(stamp_ns, attitude, known, turns, limits, &mut of_attitude);
        if has_force && has_attitude && tilt_is_measured(attitude) {
            self.gravity
                .check(stamp_ns, force, attitude, limits, &mut note.of(part));
        }
        self.motion.turning = turns;
        Sound {
            force: has_force,
            turning: has_turning,
            attitude: has_attitude,
            ..Sound::default()
        }
    }

    fn check_odometry(&mut self, sample: &Sample<'_>, findings: &mut Vec<Finding>) -> Sound {
        let (stamp_ns, values) = (sample.stamp_ns, sample.values);
        let (Rules { limits, policies }, seen) = (&self.rules, self.motion);
        let mut note = Note::new(findings, policies, sample);
        let (velocity, turning, attitude) = (&values[..3], &values[3..6], &values[6..]);
        let moves = seen.wheels || is_faster(velocity, TRAVELLING);
        let part = Part::Velocity;
        let has_velocity =
            self.velocity
                .check(stamp_ns, velocity, moves, limits, &mut note.of(part));
        let turns = seen.turning || is_faster(turning, TURNING);
        let part = Part::AngularVelocity;
        // With an IMU, the odometry may be bound without angular velocity.
        let is_absent = self.sensors.imu
            && self.odometry_turning.was_never_given()
            && turning.iter().all(|v| v.is_nan());
        let has_turning = !is_absent
            && self
                .odometry_turning
                .check(stamp_ns, turning, turns, limits, &mut note.of(part));
        let part = Part::Attitude;
        let has_attitude =
            // whether its own gyro is behind its attitude is not known
            self.odometry_attitude
                .check(stamp_ns, attitude, Vector3::repeat(f64::NAN), turns, limits, &mut note.of(part));
        self.motion.travelling = is_faster(velocity, TRAVELLING);
        Sound {
            velocity: has_velocity,
            turning: has_turning,
            attitude: has_attitude,
            ..Sound::default()
        }
    }

    fn check_tool(&mut self, sample: &Sample<'_>, findings: &mut Vec<Finding>) -> Sound {
        let (stamp_ns, Rules { limits, policies }) = (sample.stamp_ns, &self.rules);
        let mut note = Note::new(findings, policies, sample);
        let parts = [Part::ToolForce, Part::ToolMoment];
        let vectors = sample.values.chunks_exact(3);
        let mut is_credible = true;
        for ((watch, part), values) in self.tool.iter_mut().zip(parts).zip(vectors) {
            let moves = self.motion.joints;
            is_credible &= watch.check(stamp_ns, values, moves, limits, &mut note.of(part));
        }
        Sound {
            whole: is_credible,
            ..Sound::default()
        }
    }

    fn check_actuator(
        &mut self,
        signal: usize,
        sample: &Sample<'_>,
        findings: &mut Vec<Finding>,
    ) -> Sound {
        let Rules { limits, policies } = &self.rules;
        let mut note = Note::new(findings, policies, sample);
        let part = Part::Actuator(self.sensors.actuators[signal].joint);
        let along = [sample.values[0], 0.0, 0.0];
        let stamp_ns = sample.stamp_ns;
        let moves = self.motion.joints;
        self.actuators[signal].check(stamp_ns, &along, moves, limits, &mut note.of(part));
        Sound::default()
    }
}

/// Returns the largest magnitude of a number from which the state is not estimated; infinite where nothing is known of it.
fn largest_number(machine: &Machine, sensor: Sensor) -> f64 {
    let Sensor::Number(NumberKind::Force, signal) = sensor else {
        return f64::INFINITY;
    };
    let mut signals = machine.arm_forces().iter().flat_map(|it| &it.signals);
    let coefficient = signals
        .find(|(it, _)| *it == signal)
        .map(|(_, it)| it.abs());
    let weight = machine.mass() * machine.gravity();
    coefficient.map_or(f64::INFINITY, |factor| ACTUATOR_WEIGHTS * weight / factor)
}

/// Returns the check for repeats of a load sensor, of a signal of payloads or of one of a force by which nothing is computed, by how it
/// may rest; `None` for other sensors.
fn rest_of_number(machine: &Machine, sensor: Sensor) -> Option<Freeze> {
    let freeze = Freeze::new();
    match sensor {
        Sensor::Number(NumberKind::Load, _) => Some(freeze.may_rest_at_zero()),
        Sensor::Number(NumberKind::Payload, signal) => {
            let quantity = machine.payload_signals().get(signal)?.quantity;
            Some(match quantity {
                PayloadQuantity::Mass(_) => freeze.may_rest_at_zero(),
                _ => freeze.may_rest(),
            })
        }
        Sensor::Number(NumberKind::Force, _) => Some(freeze.may_rest()),
        _ => None,
    }
}

fn is_faster(vector: &[f64], limit: f64) -> bool {
    vector.iter().map(|v| v * v).sum::<f64>() > limit * limit
}

pub(super) fn joint_limits(machine: &Machine, joint: usize) -> JointLimits {
    let (spec, it) = (machine.plausibility(), &machine.joints()[joint]);
    let slides = machine.joint_slides(joint);
    let spins_wheel = it.spins_wheel.is_some();
    JointLimits {
        range: it.limits.filter(|_| !spins_wheel),
        margin: spec.margin_of(slides),
        max_velocity: machine.greatest_joint_rate(joint),
        max_acceleration: spec.joint_acceleration_max,
        rate_tolerance: match slides {
            true => spec.rate_tolerance_linear,
            false => spec.rate_tolerance,
        },
        spins_wheel,
        wraps: machine.joint_turns(joint),
    }
}
