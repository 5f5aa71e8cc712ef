//! Sensors and their samples, as read from a log or a live system.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::machine::{ActuatorSignal, Machine};

/// The sensors that a log or a live system provides.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sensors {
    /// Streams of joint states, at least one; rows follow the stamps of the first.
    pub joints: Vec<JointStream>,
    /// Whether there is an inertial measurement unit.
    pub imu: bool,
    /// Whether there is odometry.
    pub odometry: bool,
    /// Whether the tool wrench is measured.
    pub tool_wrench: bool,
    /// Signals from which the forces of actuated joints are assembled.
    pub actuators: Vec<ActuatorSignal>,
    /// Number of signals that tell which supports are on the ground: those of
    /// [`Supports::switches`](crate::machine::Supports::switches). The state is not estimated from them.
    pub switches: usize,
    /// Number of load sensors: those of [`Machine::load_sensors`]. The state is not estimated from them.
    pub loads: usize,
    /// Number of joints whose rate a controller asks for: those of [`Machine::joint_commands`]. The state is not estimated from
    /// them.
    pub commands: usize,
    /// The signals that tell masses of payloads, by their index in [`Machine::payload_signals`].
    pub payload_signals: Vec<usize>,
    /// Number of signals of forces by which nothing is computed: those of [`Machine::force_signals`]. The state is not estimated from
    /// them.
    pub forces: usize,
}

/// A stream of joint states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointStream {
    /// Indices into [`Machine::joints`] of the joints that it measures.
    pub joints: Vec<usize>,
}

/// A sensor, identified by its position in [`Sensors`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Sensor {
    /// The stream of joint states with this index.
    Joints(usize),
    /// The inertial measurement unit.
    Imu,
    /// Odometry.
    Odometry,
    /// The tool wrench.
    ToolWrench,
    /// The sensor of this kind that measures one number, and its index: see [`NumberKind`].
    Number(NumberKind, usize),
}

named! {
    /// Kinds of sensors that measure one number, and what their index counts.
    #[derive(PartialOrd, Ord)]
    pub enum NumberKind {
        /// Force or pressure of an actuator, or the load of a support: in [`Sensors::actuators`].
        Actuator,
        /// What tells whether some supports are set or raised: in [`Supports::switches`](crate::machine::Supports::switches).
        Switch,
        /// The load of one or more supports: in [`Machine::load_sensors`].
        Load,
        /// The rate that is asked of a joint: in [`Machine::joint_commands`].
        Command,
        /// What tells the mass of a payload: in [`Machine::payload_signals`].
        Payload,
        /// A force by which nothing is computed, or a pressure of it: in [`Machine::force_signals`].
        Force,
    }
}

/// One message of one sensor.
///
/// Its values, by sensor:
/// - joints: positions of the stream's joints (rad or m), then their velocities (rad/s or m/s), NaN where
///   the message has no velocity;
/// - IMU, in its own frame: specific force x y z (m/s^2), angular velocity x y z (rad/s), orientation
///   quaternion x y z w of the IMU in an upright frame, NaN where unknown;
/// - odometry, in the base frame: velocity x y z (m/s), angular velocity x y z (rad/s), orientation
///   quaternion x y z w;
/// - tool wrench: force x y z (N) and moment x y z (N m) of the surroundings on the tool, in its frame;
/// - actuator: force (N), positive when it extends the rod, or pressure in a chamber (Pa);
/// - switch: the number that the machine file binds, which counts as on from its threshold on;
/// - load: the load of one or more supports (N);
/// - command: the rate that is asked of a joint (rad/s or m/s), NaN while none is;
/// - payload: its mass (kg), or force (N) or pressure (Pa) of the cylinder that lifts it;
/// - force: force (N), positive when it extends the rod, or pressure in a chamber (Pa).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<'a> {
    /// The sensor.
    pub sensor: Sensor,
    /// Time of measurement (ns).
    pub stamp_ns: i64,
    /// The measured values.
    pub values: &'a [f64],
}

impl<'a> Sample<'a> {
    /// Creates a sample of a sensor, measured at a time (ns).
    #[must_use]
    pub fn new(sensor: Sensor, stamp_ns: i64, values: &'a [f64]) -> Self {
        Self {
            sensor,
            stamp_ns,
            values,
        }
    }
}

/// Cause for which a sample was not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SampleError {
    /// Its stamp is not later than that of the preceding sample.
    #[error("stamp is not later than that of the preceding sample")]
    NotLater,
    /// A required value is not finite.
    #[error("a value is not finite")]
    NotFinite,
    /// There is no such sensor, or its number of values differs.
    #[error("no such sensor, or wrong number of values")]
    UnknownSensor,
}

/// A quaternion whose norm differs from one by more than this is not an orientation.
const QUATERNION_NORM_TOLERANCE: f64 = 0.1;
/// Largest |x| and |y| of a quaternion without tilt: 2e-12 rad, beyond the resolution of any sensor.
const NO_TILT: f64 = 1e-12;

/// Whether an orientation, quaternion x y z w, measures how the machine tilts.
///
/// Planar odometry and an IMU without attitude filter report a rotation about the vertical alone, exactly. That
/// is not level ground: the slope is unknown.
#[must_use]
pub fn tilt_is_measured(xyzw: &[f64]) -> bool {
    match *xyzw {
        [x, y, _, _] => x.abs() > NO_TILT || y.abs() > NO_TILT,
        _ => false,
    }
}

/// Up direction in the axes of a sensor with this orientation, quaternion x y z w; `None` where it is none.
pub(crate) fn up_of(xyzw: &[f64]) -> Option<Vector3<f64>> {
    let &[x, y, z, w] = xyzw else { return None };
    let quaternion = Quaternion::new(w, x, y, z);
    // Written so that NaN is rejected.
    let is_orientation = (quaternion.norm() - 1.0).abs() <= QUATERNION_NORM_TOLERANCE;
    is_orientation.then(|| {
        UnitQuaternion::from_quaternion(quaternion).inverse_transform_vector(&Vector3::z())
    })
}

/// The same where the orientation measures how the machine tilts.
pub(crate) fn measured_up(xyzw: &[f64]) -> Option<Vector3<f64>> {
    up_of(xyzw).filter(|_| tilt_is_measured(xyzw))
}

/// Whether a sample was used unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Credible(pub(crate) bool);

/// Numbers of samples of a stream that were used and not used, by cause.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StreamCounts {
    /// Samples used.
    pub used: u64,
    /// Samples with a stamp not later than the preceding one.
    pub not_later: u64,
    /// Samples with a non-finite value.
    pub not_finite: u64,
    /// Samples excluded or down-weighted, wholly or in part, because they are implausible; those used in part
    /// also count as used.
    pub implausible: u64,
}

impl StreamCounts {
    pub(crate) fn count(&mut self, result: Result<Credible, SampleError>) {
        match result {
            Ok(Credible(credible)) => {
                self.used += 1;
                self.implausible += u64::from(!credible);
            }
            Err(SampleError::NotLater) => self.not_later += 1,
            Err(SampleError::NotFinite | SampleError::UnknownSensor) => self.not_finite += 1,
        }
    }
}

impl Sensors {
    /// The sensors from which the state is estimated, in their fixed order.
    pub fn iter(&self) -> impl Iterator<Item = Sensor> {
        let joints = (0..self.joints.len()).map(Sensor::Joints);
        let others = [
            (self.imu, Sensor::Imu),
            (self.odometry, Sensor::Odometry),
            (self.tool_wrench, Sensor::ToolWrench),
        ];
        joints
            .chain(
                others
                    .into_iter()
                    .filter(|(there, _)| *there)
                    .map(|(_, sensor)| sensor),
            )
            .chain(self.numbers(NumberKind::Actuator))
    }

    /// All sensors in their fixed order: those of [`Sensors::iter`], the switches, the load sensors, the commands, the
    /// signals of payloads, those of forces by which nothing is computed.
    pub fn all(&self) -> impl Iterator<Item = Sensor> {
        let beside = NumberKind::ALL.into_iter();
        let beside = beside.filter(|&kind| kind != NumberKind::Actuator);
        self.iter()
            .chain(beside.flat_map(|kind| self.numbers(kind)))
    }

    /// The sensors of a kind that measures one number.
    fn numbers(&self, kind: NumberKind) -> impl Iterator<Item = Sensor> {
        let (count, stated) = match kind {
            NumberKind::Actuator => (self.actuators.len(), &[][..]),
            NumberKind::Switch => (self.switches, &[][..]),
            NumberKind::Load => (self.loads, &[][..]),
            NumberKind::Command => (self.commands, &[][..]),
            NumberKind::Payload => (0, &self.payload_signals[..]),
            NumberKind::Force => (self.forces, &[][..]),
        };
        let indices = (0..count).chain(stated.iter().copied());
        indices.map(move |index| Sensor::Number(kind, index))
    }

    /// Indices into [`Machine::joints`] of the joints that `sensor` measures; `None` if it is no stream of joint states.
    #[must_use]
    pub fn joints_of(&self, sensor: Sensor) -> Option<&[usize]> {
        match sensor {
            Sensor::Joints(stream) => Some(&self.joints.get(stream)?.joints),
            _ => None,
        }
    }

    /// Whether every row needs samples of `sensor`.
    #[must_use]
    pub fn need(&self, sensor: Sensor) -> bool {
        match sensor {
            Sensor::Joints(_) => true,
            Sensor::Imu => self.imu,
            Sensor::Odometry => !self.imu,
            Sensor::ToolWrench => self.tool_wrench,
            Sensor::Number(..) => false,
        }
    }

    /// Number of values in a sample of `sensor`; `None` if there is no such sensor.
    #[must_use]
    pub fn value_count(&self, sensor: Sensor) -> Option<usize> {
        match sensor {
            Sensor::Joints(_) => self.joints_of(sensor).map(|joints| 2 * joints.len()),
            Sensor::Imu => self.imu.then_some(10),
            Sensor::Odometry => self.odometry.then_some(10),
            Sensor::ToolWrench => self.tool_wrench.then_some(6),
            Sensor::Number(kind, _) => self.numbers(kind).any(|it| it == sensor).then_some(1),
        }
    }
}

/// A log's sensors matched to a machine: which of its joints each stream measures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MatchedSensors {
    /// The sensors.
    pub sensors: Sensors,
    /// For each entry of [`Sensors::joints`], the index of its stream in the log.
    pub streams: Vec<usize>,
}

/// A joint that two streams measure.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("joint \"{joint}\": expected in one stream of joint states, found in {first} and {second}")]
pub struct JointTwice {
    /// The joint.
    pub joint: String,
    /// The first stream's name.
    pub first: String,
    /// The second stream's name.
    pub second: String,
}

impl MatchedSensors {
    /// Matches streams of joint states, given as name and joints, to the machine's joints. Drops streams
    /// without a joint of the machine and keeps the order.
    ///
    /// # Errors
    /// [`JointTwice`]: two streams measure one joint.
    pub fn new(
        machine: &Machine,
        streams: &[(&str, &[String])],
        others: OtherSensors,
    ) -> Result<Self, JointTwice> {
        let mut matched = Self {
            sensors: Sensors {
                imu: others.imu,
                odometry: others.odometry,
                tool_wrench: others.tool_wrench && machine.tool().is_some(),
                switches: machine.supports().switches.len(),
                loads: machine.load_sensors().len(),
                commands: machine.joint_commands().len(),
                payload_signals: (0..machine.payload_signals().len()).collect(),
                forces: machine.force_signals().len(),
                ..Sensors::default()
            },
            streams: Vec::new(),
        };
        let mut taken: Vec<Option<usize>> = vec![None; machine.joints().len()];
        for (index, (name, names)) in streams.iter().enumerate() {
            let has = |joint: &str| names.iter().any(|n| n == joint);
            let joints: Vec<usize> = (0..taken.len())
                .filter(|&j| has(&machine.joints()[j].name))
                .collect();
            for &joint in &joints {
                if let Some(other) = taken[joint].replace(index) {
                    return Err(JointTwice {
                        joint: machine.joints()[joint].name.clone(),
                        first: streams[other].0.into(),
                        second: (*name).into(),
                    });
                }
            }
            if !joints.is_empty() {
                matched.sensors.joints.push(JointStream { joints });
                matched.streams.push(index);
            }
        }
        Ok(matched)
    }

    /// Names of the joints of the stream with this index in [`Sensors::joints`], in its order.
    #[must_use]
    pub fn joint_names(&self, machine: &Machine, stream: usize) -> Vec<String> {
        let name = |&joint: &usize| machine.joints()[joint].name.clone();
        self.sensors.joints[stream]
            .joints
            .iter()
            .map(name)
            .collect()
    }
}

/// The available sensors other than joint states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OtherSensors {
    /// Whether there is an inertial measurement unit.
    pub imu: bool,
    /// Whether there is odometry.
    pub odometry: bool,
    /// Whether the tool wrench is measured.
    pub tool_wrench: bool,
}
