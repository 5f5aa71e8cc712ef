//! The checks of every sensor, sample by sample.

use nalgebra::{Matrix3, Vector3};

use super::attitude::AttitudeWatch;
use super::fault::{Finding, Part};
use super::gravity::GravityWatch;
use super::joint::{JointLimits, JointWatch};
use super::notice::{Limits, Notice};
use super::redundancy::{
    DriveWatch, LeanWatch, Rolled, RotationWatch, SpecificForceWatch, TiltWatch, Travel, YawWatch,
    skids, up_direction,
};
use super::treatment::{Judgement, RowEffect};
use super::vector::{Slew, VectorWatch};
use crate::machine::{FaultKind, Machine, Policy, rotation_in_body};
use crate::state::{Sample, SampleError, Sensor, Sensors, tilt_is_measured};

/// Allowance for noise and stamp jitter in the change of an angular velocity (rad/s) and of a velocity (m/s).
const SLEW_ALLOWANCE: f64 = 0.5;
/// Angular velocity above which the machine counts as moving (rad/s).
const TURNING: f64 = 0.1;
/// Velocity above which the machine counts as moving (m/s).
const TRAVELLING: f64 = 0.1;
/// Lever arm that relates the largest moment on the tool to the largest force (m).
const TOOL_LEVER: f64 = 1.0;
/// Largest force of an actuator, or of one of its chambers, as a multiple of the machine's weight.
const ACTUATOR_WEIGHTS: f64 = 100.0;
/// Largest force on the tool as a multiple of the machine's weight, where none is stated.
const TOOL_FORCE_WEIGHTS: f64 = 10.0;

/// Checks samples, each sensor's in stamp order.
#[derive(Debug, Clone)]
pub struct Plausibility {
    sensors: Sensors,
    limits: Limits,
    policies: [Policy; FaultKind::ALL.len()],
    /// Stamp of the last sample of each sensor, in the order of [`Sensors::iter`].
    last_ns: Vec<(Sensor, Option<i64>)>,
    /// By stream and index in it.
    joints: Vec<Vec<JointWatch>>,
    force: VectorWatch,
    turning: VectorWatch,
    attitude: AttitudeWatch,
    gravity: GravityWatch,
    velocity: VectorWatch,
    odometry_turning: VectorWatch,
    odometry_attitude: AttitudeWatch,
    tool: [VectorWatch; 2],
    /// By signal.
    actuators: Vec<VectorWatch>,
    motion: Motion,
    redundancy: Redundancy,
    findings: Vec<Finding>,
}

/// Comparison of sensors with each other.
#[derive(Debug, Clone)]
struct Redundancy {
    travel: Travel,
    lean: Option<LeanWatch>,
    /// Of an IMU on the base.
    specific_force: Option<SpecificForceWatch>,
    tilt: TiltWatch,
    rotation: RotationWatch,
    /// Of an IMU on the base.
    yaw: Option<YawWatch>,
    /// Of an IMU on the base.
    drive: Option<DriveWatch>,
    base_from_imu: Matrix3<f64>,
    /// By stream: radius of each wheel's joint; NaN for other joints.
    radii: Vec<Vec<f64>>,
}

/// Motion detected in the last samples.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    joints: bool,
    wheels: bool,
    turning: bool,
    travelling: bool,
}

impl Plausibility {
    /// Checks before their first sample.
    #[must_use]
    pub fn new(machine: &Machine, sensors: &Sensors) -> Self {
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
            VectorWatch::new(
                spec.angular_velocity_max,
                slew(spec.angular_acceleration_max),
            )
        };
        let joints: Vec<Vec<JointWatch>> = sensors
            .joints
            .iter()
            .map(|stream| {
                let watch = |&joint: &usize| JointWatch::new(joint_limits(machine, joint));
                stream.joints.iter().map(watch).collect()
            })
            .collect();
        let most_findings = 4 * joints.iter().map(Vec::len).max().unwrap_or(0) + 16;
        Self {
            limits: Limits {
                max_gap_s: machine.estimator().max_gap,
                frozen_samples: spec.frozen_samples,
                quaternion_tolerance: spec.quaternion_tolerance,
                rate_tolerance_share: spec.rate_tolerance_share,
            },
            policies: FaultKind::ALL.map(|kind| spec.policy_of(kind)),
            last_ns: sensors.iter().map(|sensor| (sensor, None)).collect(),
            joints,
            force: VectorWatch::new(spec.specific_force_max, None),
            turning: turning(),
            attitude: AttitudeWatch::new(),
            gravity: GravityWatch::new(machine.gravity(), spec.gravity_tolerance),
            velocity: VectorWatch::new(spec.speed_max, slew(spec.acceleration_max)),
            odometry_turning: turning(),
            odometry_attitude: AttitudeWatch::new(),
            tool: [
                VectorWatch::new(spec.tool_force_max.unwrap_or(largest_force), None),
                VectorWatch::new(
                    spec.tool_moment_max.unwrap_or(largest_force * TOOL_LEVER),
                    None,
                ),
            ],
            actuators: (sensors.actuators.iter())
                .map(|signal| {
                    let joint = &machine.contact().actuated_joints[signal.joint];
                    let factor = joint.signals[signal.signal].abs();
                    VectorWatch::new(ACTUATOR_WEIGHTS * weight / factor, None)
                })
                .collect(),
            motion: Motion::default(),
            redundancy: Redundancy::new(machine, sensors),
            findings: Vec::with_capacity(most_findings),
            sensors: sensors.clone(),
        }
    }

    /// The faults of the last sample.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Whether a value that the estimate requires was not finite in the last sample.
    pub(crate) fn lacks_a_value(&self) -> bool {
        self.findings.iter().any(Finding::lacks_a_value)
    }

    /// Checks a sample; [`Self::findings`] returns the faults found.
    ///
    /// # Errors
    /// The sensor does not exist, the number of values is wrong, or the stamp is not later than the preceding one.
    pub fn step(&mut self, sample: &Sample<'_>) -> Result<Judgement, SampleError> {
        self.findings.clear();
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
        match sample.sensor {
            Sensor::Joints(stream) => self.check_joints(stream, sample),
            Sensor::Imu => self.check_imu(sample),
            Sensor::Odometry => self.check_odometry(sample),
            Sensor::ToolWrench => self.check_tool(sample),
            Sensor::Actuator(signal) => self.check_actuator(signal, sample),
        }
        let mut judgement = Judgement::default();
        for finding in &self.findings {
            judgement.add(finding);
        }
        Ok(judgement)
    }

    /// Effect of the last sample's findings on rows until the sensor's next one.
    pub(crate) fn row_effect(&self, machine: &Machine) -> RowEffect {
        let mut effect = RowEffect::default();
        for finding in &self.findings {
            effect.add(finding, machine, self.sensors.imu);
        }
        effect
    }

    fn check_joints(&mut self, stream: usize, sample: &Sample<'_>) {
        let Self {
            joints,
            sensors,
            limits,
            motion,
            redundancy,
            ..
        } = self;
        let mut note = Note::new(&mut self.findings, &self.policies, sample);
        let (positions, rates) = sample.values.split_at(sample.values.len() / 2);
        let watches = joints[stream]
            .iter_mut()
            .zip(&sensors.joints[stream].joints);
        for ((watch, &joint), (&position, &rate)) in watches.zip(positions.iter().zip(rates)) {
            let part = Part::Joint(joint);
            watch.check(sample.stamp_ns, position, rate, limits, &mut note.of(part));
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
        if note.findings.iter().any(is_faulty) {
            if let Some(lean) = &mut redundancy.lean {
                lean.distrust_joints(sample.stamp_ns);
            }
            redundancy.take_wheels(sample.stamp_ns, None);
        } else {
            let joints = &sensors.joints[stream].joints;
            redundancy.take_joints(stream, sample, joints, limits);
        }
    }

    fn check_imu(&mut self, sample: &Sample<'_>) {
        let (stamp_ns, values) = (sample.stamp_ns, sample.values);
        let (limits, seen) = (&self.limits, self.motion);
        let mut note = Note::new(&mut self.findings, &self.policies, sample);
        let moves = seen.joints || seen.travelling;
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
        let has_attitude =
            self.attitude
                .check(stamp_ns, attitude, turns, limits, &mut note.of(part));
        if has_force && has_attitude && tilt_is_measured(attitude) {
            self.gravity
                .check(stamp_ns, force, attitude, limits, &mut note.of(part));
        }
        self.motion.turning = turns;
        let redundancy = &mut self.redundancy;
        let vectors = [force, turning].map(Vector3::from_column_slice);
        if let Some(lean) = redundancy
            .lean
            .as_mut()
            .filter(|_| has_force && has_turning)
        {
            let [force, turning] = &vectors;
            let found = &mut note.of(Part::Lean);
            lean.check(
                stamp_ns,
                [force, turning],
                &redundancy.travel,
                limits,
                found,
            );
        }
        let up = has_attitude && tilt_is_measured(attitude);
        let [_, turning] = &vectors;
        let measured = (has_turning && has_attitude).then_some((attitude, turning));
        let rotation = &mut redundancy.rotation;
        rotation.check(stamp_ns, measured, limits, &mut note.of(Part::Rotation));
        if let Some(yaw) = redundancy.yaw.as_mut().filter(|_| has_turning) {
            let about_z = (redundancy.base_from_imu * turning).z;
            yaw.check(stamp_ns, about_z, limits, &mut |by, notice| {
                note.of(Part::Yaw(by))(notice);
            });
        }
        if let Some(watch) = &mut redundancy.specific_force
            && let Some(up) = up.then(|| up_direction(attitude)).flatten()
        {
            let in_base = redundancy.base_from_imu * up;
            let tilt = &mut redundancy.tilt;
            tilt.check(stamp_ns, &in_base, limits, &mut note.of(Part::Tilt));
            if let Some(drive) = redundancy.drive.as_mut().filter(|_| has_force) {
                let [force, _] = &vectors;
                let found = &mut note.of(Part::Drive);
                drive.check(stamp_ns, [force, &up], limits, found);
            }
            if has_force && has_turning {
                let [force, turning] = &vectors;
                let found = &mut note.of(Part::Acceleration);
                let vectors = [force, turning, &up];
                watch.check(stamp_ns, vectors, &redundancy.travel, limits, found);
            }
        }
    }

    fn check_odometry(&mut self, sample: &Sample<'_>) {
        let (stamp_ns, values) = (sample.stamp_ns, sample.values);
        let (limits, seen) = (&self.limits, self.motion);
        let mut note = Note::new(&mut self.findings, &self.policies, sample);
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
            self.odometry_attitude
                .check(stamp_ns, attitude, turns, limits, &mut note.of(part));
        if has_velocity {
            let velocity = Vector3::from_column_slice(velocity);
            self.redundancy.travel.take_odometry(stamp_ns, velocity);
            if let Some(yaw) = &mut self.redundancy.yaw {
                let found = &mut note.of(Part::Rolling);
                yaw.check_travel(stamp_ns, velocity.x, limits, found);
            }
        }
        if let Some(yaw) = &mut self.redundancy.yaw {
            let turning = if has_turning { turning[2] } else { f64::NAN };
            yaw.take_odometry(stamp_ns, turning);
        }
        if has_attitude && tilt_is_measured(attitude) {
            self.redundancy.tilt.take_odometry(stamp_ns, attitude);
        }
        self.motion.travelling = is_faster(velocity, TRAVELLING);
    }

    fn check_tool(&mut self, sample: &Sample<'_>) {
        let (stamp_ns, limits) = (sample.stamp_ns, &self.limits);
        let mut note = Note::new(&mut self.findings, &self.policies, sample);
        let parts = [Part::ToolForce, Part::ToolMoment];
        let vectors = sample.values.chunks_exact(3);
        let mut is_credible = true;
        for ((watch, part), values) in self.tool.iter_mut().zip(parts).zip(vectors) {
            // A constant force is legitimate: only vanishing noise counts.
            is_credible &= watch.check(stamp_ns, values, false, limits, &mut note.of(part));
        }
        if let Some(lean) = &mut self.redundancy.lean
            && is_credible
        {
            let wrench = [0, 3].map(|at| Vector3::from_column_slice(&sample.values[at..at + 3]));
            lean.take_tool(stamp_ns, wrench);
        }
    }
}

impl Plausibility {
    fn check_actuator(&mut self, signal: usize, sample: &Sample<'_>) {
        let mut note = Note::new(&mut self.findings, &self.policies, sample);
        let part = Part::Actuator(self.sensors.actuators[signal].joint);
        let along = [sample.values[0], 0.0, 0.0];
        let (stamp_ns, limits) = (sample.stamp_ns, &self.limits);
        // The same as for the tool: a constant force is legitimate.
        self.actuators[signal].check(stamp_ns, &along, false, limits, &mut note.of(part));
    }
}

impl Redundancy {
    fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let imu_on_base = sensors.imu && machine.imu().body == 0;
        let radius = |&joint: &usize| {
            let wheel = machine.joints()[joint].spins_wheel;
            wheel.map_or(f64::NAN, |wheel| machine.wheels()[wheel].radius)
        };
        let radii = sensors.joints.iter();
        Self {
            travel: Travel::default(),
            lean: imu_on_base.then(|| LeanWatch::new(machine)).flatten(),
            specific_force: imu_on_base.then(|| SpecificForceWatch::new(machine)),
            tilt: TiltWatch::new(machine.plausibility().tilt_tolerance),
            rotation: RotationWatch::new(),
            yaw: imu_on_base.then(|| YawWatch::new(skids(machine))),
            drive: imu_on_base
                .then(|| DriveWatch::new(rotation_in_body(machine.imu()), machine.gravity())),
            base_from_imu: rotation_in_body(machine.imu()),
            radii: radii
                .map(|stream| stream.joints.iter().map(radius).collect())
                .collect(),
        }
    }

    fn take_joints(
        &mut self,
        stream: usize,
        sample: &Sample<'_>,
        joints: &[usize],
        limits: &Limits,
    ) {
        let stamp_ns = sample.stamp_ns;
        let (positions, rates) = sample.values.split_at(sample.values.len() / 2);
        let speeds = self.radii[stream].iter().zip(rates);
        let speeds = speeds.map(|(radius, rate)| (radius * rate).abs());
        if let Some(fastest) = speeds.filter(|speed| speed.is_finite()).reduce(f64::max) {
            self.travel.take_wheels(stamp_ns, fastest);
        }
        if let Some(lean) = &mut self.lean {
            let motions = joints.iter().zip(positions.iter().zip(rates));
            let motions = motions.map(|(&joint, (&position, &rate))| (joint, position, rate));
            lean.take_joints(stamp_ns, motions, limits);
            let rolled = lean.rolled;
            self.take_wheels(stamp_ns, rolled);
        }
    }

    /// Takes the motion by the wheels; `None`: it is not known.
    fn take_wheels(&mut self, stamp_ns: i64, rolled: Option<Rolled>) {
        if let Some(yaw) = &mut self.yaw {
            yaw.take_wheels(stamp_ns, rolled);
        }
        if let Some(drive) = &mut self.drive {
            drive.take_wheels(stamp_ns, rolled);
        }
    }
}

/// Collects findings, up to the capacity reserved.
struct Note<'n> {
    findings: &'n mut Vec<Finding>,
    policies: &'n [Policy; FaultKind::ALL.len()],
    sensor: Sensor,
    stamp_ns: i64,
}

impl<'n> Note<'n> {
    fn new(
        findings: &'n mut Vec<Finding>,
        policies: &'n [Policy; FaultKind::ALL.len()],
        sample: &Sample<'_>,
    ) -> Self {
        Self {
            findings,
            policies,
            sensor: sample.sensor,
            stamp_ns: sample.stamp_ns,
        }
    }

    fn of(&mut self, part: Part) -> impl FnMut(Notice) + '_ {
        move |notice| {
            if self.findings.len() == self.findings.capacity() {
                return;
            }
            self.findings.push(Finding {
                sensor: self.sensor,
                part,
                kind: notice.kind,
                component: notice.component,
                policy: self.policies[notice.kind as usize],
                since_ns: notice.since_ns,
                stamp_ns: self.stamp_ns,
                measure: notice.measure,
                limit: notice.limit,
                amount: notice.amount,
            });
        }
    }
}

fn is_faster(vector: &[f64], limit: f64) -> bool {
    vector.iter().map(|v| v * v).sum::<f64>() > limit * limit
}

fn joint_limits(machine: &Machine, joint: usize) -> JointLimits {
    let (spec, it) = (machine.plausibility(), &machine.joints()[joint]);
    let slides = machine.joint_slides(joint);
    let of_kind = |turning: f64, sliding: f64| if slides { sliding } else { turning };
    let spins_wheel = it.spins_wheel.is_some();
    let usual_rate = match spins_wheel {
        true => spec.wheel_rate_max,
        false => of_kind(spec.joint_rate_max, spec.joint_rate_max_linear),
    };
    JointLimits {
        range: it.limits.filter(|_| !spins_wheel),
        margin: of_kind(spec.joint_margin, spec.joint_margin_linear),
        max_velocity: it
            .max_velocity
            .map_or(usual_rate, |rate| rate * spec.joint_rate_margin),
        max_acceleration: spec.joint_acceleration_max,
        rate_tolerance: of_kind(spec.rate_tolerance, spec.rate_tolerance_linear),
        spins_wheel,
        wraps: !slides && it.limits.is_none(),
    }
}
