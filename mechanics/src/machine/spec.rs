//! The machine file as written in TOML, before it is checked against the URDF.
//! [`MachineSpec::check`] turns it into a [`Machine`](super::Machine).

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::MapAccess;
use serde::de::value::MapAccessDeserializer;

use super::exactly::{exactly, exactly_if_any};
use super::toml_error::not_finite;
use crate::machine::HydraulicsSpec;

use super::{
    FieldSpec, IdentifiedSpec, LinkSigma, MachineError, OneOf, PlausibilitySpec, PredictionSpec,
    PresenceSpec, QuasiStaticSpec, SignalsSpec, SupportOrigin, SupportSpec, SuspensionControl,
    TrackSpec, WeighedSpec, explained,
};

/// The machine file; the project's machine-file reference describes every key.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineSpec {
    /// Name of the machine.
    pub name: String,
    /// Serial number, which tells it from others of the same name: alarms are kept by it.
    pub serial: Option<String>,
    /// Gravitational acceleration (m/s^2).
    #[serde(default = "standard_gravity")]
    pub gravity: f64,
    /// Path of the URDF relative to the machine file; if absent, the log's `/robot_description` is used.
    pub urdf: Option<String>,
    /// Path of the result of a commissioning relative to the machine file, written by `check-machine`.
    pub commissioning: Option<String>,
    /// Whether inertias of the URDF that no body has are replaced, with their uncertainty, and not refused.
    pub accept_inertias: Option<bool>,
    /// Pose of the inertial measurement unit; if absent, the frame named by its messages.
    pub imu: Option<ImuSpec>,
    /// The wheels by name, three or more.
    #[serde(default)]
    pub wheels: BTreeMap<String, WheelSpec>,
    /// Supports other than wheels by name, until they are added to the wheels.
    #[serde(default)]
    pub supports: BTreeMap<String, SupportSpec>,
    /// Tracks by name, until their points are added to the wheels.
    #[serde(default)]
    pub tracks: BTreeMap<String, TrackSpec>,
    /// The manipulator.
    pub arm: Option<ArmSpec>,
    /// Uncertainty of single links, by name.
    #[serde(default)]
    pub links: BTreeMap<String, LinkSigma>,
    /// Linear actuators that close a triangle.
    #[serde(default)]
    pub linkage: Vec<LinkageSpec>,
    /// Contact between wheels and ground.
    #[serde(default)]
    pub contact: ContactSpec,
    /// Thresholds for findings.
    #[serde(default)]
    pub limits: LimitsSpec,
    /// Loads attached to links.
    #[serde(default)]
    pub payload: Vec<PayloadSpec>,
    /// Topics and fields of the signals; absent ones are found by message type.
    #[serde(default)]
    pub signals: SignalsSpec,
    /// Known properties of the topics' clocks.
    #[serde(default)]
    pub clock: ClockSpec,
    /// Settings of the state estimator.
    #[serde(default)]
    pub estimator: EstimatorSpec,
    /// Uncertainty of the machine's parameters.
    #[serde(default)]
    pub uncertainty: UncertaintySpec,
    /// Limits of plausible signals, and the treatment of implausible ones.
    #[serde(default)]
    pub plausibility: PlausibilitySpec,
    /// Greatest rates and accelerations between the rows of a sparse log.
    #[serde(default)]
    pub quasi_static: QuasiStaticSpec,
    /// Horizon of the prediction, and the assumed motions.
    #[serde(default)]
    pub prediction: PredictionSpec,
    /// Guessed values that no person has confirmed, by key: `wheels.NAME.radius`, `imu` or
    /// `signals.joints.NAME`. They carry a wide standard deviation and a note.
    #[serde(default)]
    pub unconfirmed: Vec<String>,
    /// Measured weights of the real machine.
    pub weighed: Option<WeighedSpec>,
    /// Parameters corrected by `tipwatch identify`.
    pub identified: Option<IdentifiedSpec>,
    /// Active suspension.
    pub suspension: Option<SuspensionSpec>,
    /// Name of the machine file, for messages.
    #[serde(skip)]
    pub file: String,
}

fn standard_gravity() -> f64 {
    9.806_65
}

/// `[imu]`: pose of the sensor on a link.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuSpec {
    /// The link that carries it; if absent, the base link.
    pub link: Option<String>,
    /// Position in the link (m).
    #[serde(default)]
    #[serde(deserialize_with = "exactly")]
    pub xyz: [f64; 3],
    /// Orientation in the link: roll, pitch, yaw about fixed axes (rad).
    #[serde(default)]
    #[serde(deserialize_with = "exactly")]
    pub rpy: [f64; 3],
}

/// `[wheels.NAME]`: one wheel.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelSpec {
    /// The link whose origin is the wheel's centre.
    pub link: String,
    /// Unloaded radius (m).
    pub radius: f64,
    /// When it is off the ground because the machine is jacked.
    pub raised: Option<PresenceSpec>,
    /// The supports that keep it off the ground while all of them are set.
    #[serde(default)]
    pub raised_by: Vec<String>,
    /// Which table of the machine file it is from.
    #[serde(skip)]
    pub origin: SupportOrigin,
}

/// `[arm]`: the links of the manipulator.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmSpec {
    /// The root link: it and its distal subtree are the manipulator.
    pub root: String,
    /// The link in whose frame the tool wrench is expressed, acting at its origin.
    pub tool: Option<String>,
}

/// `[[linkage]]`: a linear actuator that closes a triangle.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkageSpec {
    /// Name for messages.
    pub name: String,
    /// The revolute joint that it actuates.
    pub pivot: String,
    /// The revolute joint of its cylinder.
    pub cylinder: String,
    /// The prismatic joint of its rod.
    pub rod: String,
    /// The eye at the end of the rod, on the rod's side.
    pub rod_end: PointSpec,
    /// The pin that holds the eye, on the side of the actuated link.
    pub anchor: PointSpec,
    /// Field of its logged force (N), positive when it extends the rod.
    pub force: Option<FieldSpec>,
    /// Fields of its logged chamber pressures.
    pub pressure: Option<PressureSpec>,
    /// Standard deviation of one sample of the force (N).
    #[serde(default = "actuator_force_sigma")]
    pub force_sigma: f64,
    /// Standard deviation of its friction, as a fraction of the force.
    #[serde(default = "actuator_friction")]
    pub friction_share: f64,
    /// Positions of its measured joint (rad or m) between which what it moves may lie on a rest of its own machine: the actuator then
    /// carries less than masses and motion require.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub rests_within: Option<[f64; 2]>,
    /// An angle of the pivot (rad) on the side of the dead centre on which the machine works; needed only if the rod is measured.
    /// Default: that of the reference posture, the middle of the pivot's URDF limits if they span less than half a turn, or 0 if it
    /// carries wheels.
    pub pivot_near: Option<f64>,
}

fn actuator_force_sigma() -> f64 {
    500.0
}

fn actuator_friction() -> f64 {
    0.03
}

/// A point fixed in a link.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSpec {
    /// The link.
    pub link: String,
    /// Its coordinates there (m).
    #[serde(deserialize_with = "exactly")]
    pub xyz: [f64; 3],
}

/// `[contact]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactSpec {
    /// Roll moment distribution: D of assumption 8 of the first paper, the front axle's share of the roll moment, 0
    /// to 1. The former spelling of the key, `front_share`, is deprecated.
    #[serde(alias = "front_share")]
    pub roll_moment_distribution: Option<f64>,
    /// Joints that carry no torque (bogie pivots, frame roll joints).
    #[serde(default)]
    pub free_joints: Vec<String>,
    /// Standard deviation of a distal wheel's traction from its proportional share, as a fraction of its load,
    /// for joints with known torque; default 0.1.
    pub traction_share: Option<f64>,
    /// Vertical stiffness of the tyres (N/m); if stated, their deflection under load is included.
    pub tyre_stiffness: Option<Stiffness>,
    /// Whether the ground is assumed to be flat.
    #[serde(default)]
    pub ground: Ground,
    /// Time around each change of the supports on the ground in which it is unknown which of them carry (s);
    /// default 1.
    pub transition: Option<f64>,
}

/// One stiffness for all wheels, or one per wheel.
#[derive(Debug, Clone)]
pub enum Stiffness {
    /// The same for all wheels (N/m).
    All(f64),
    /// By wheel name (N/m).
    PerWheel(BTreeMap<String, f64>),
}

impl<'de> OneOf<'de> for Stiffness {
    const EXPECTED: &'static str = "one stiffness for all wheels [N/m], such as 4e5, or a table of one for each wheel, such as { FL = \
         4e5, FR = 4e5, RL = 5e5, RR = 5e5 }";

    fn of_number(value: f64) -> Option<Self> {
        Some(Self::All(value))
    }

    fn of_table<A: MapAccess<'de>>(table: A) -> Option<Result<Self, A::Error>> {
        let by_name = BTreeMap::deserialize(MapAccessDeserializer::new(table));
        Some(by_name.map(Self::PerWheel))
    }
}

crate::read_one_of!(Stiffness, PayloadMass);

/// Assumption about the shape of the ground.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ground {
    /// No assumption.
    #[default]
    Unknown,
    /// Flat ground.
    Plane,
}

table! {
    /// `[limits]`.
    pub struct LimitsSpec {
        /// A wheel whose OTF is below this value is light (N).
        min_load: Option<f64> = None, positive;
        /// The same as a fraction of the wheel's static load, 0 to 1.
        min_load_share: Option<f64> = None, positive;
        /// Joint positions (rad or m) of the posture whose static loads are the reference of utilisation and
        /// load limits. Joints not listed are at zero, or at their limit next to zero.
        reference_posture: BTreeMap<String, f64> = BTreeMap::new();
        /// Optimal load of each wheel (N); default: the static load in the reference posture.
        optimal_load: Option<BTreeMap<String, f64>> = None;
        /// Utilisation from which a notice is issued.
        notice: f64 = 0.75, positive;
        /// Utilisation from which a warning is issued.
        warning: f64 = 0.90, positive;
        /// Utilisation at which the limit is exceeded.
        limit: f64 = 1.0, positive;
    }
}

/// `[[payload]]`: a load attached to a link.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PayloadSpec {
    /// The link.
    pub link: String,
    /// Mass (kg), "estimate", or a signal.
    pub mass: PayloadMass,
    /// Standard deviation of the mass (kg).
    pub mass_sigma: Option<f64>,
    /// Centre of mass in the link (m).
    #[serde(default)]
    #[serde(deserialize_with = "exactly")]
    pub com: [f64; 3],
    /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz (kg m^2).
    #[serde(default)]
    #[serde(deserialize_with = "exactly")]
    pub inertia: [f64; 6],
    /// Time of attachment (s after the first sample).
    pub from: Option<f64>,
    /// Time of release (s after the first sample).
    pub to: Option<f64>,
}

/// The mass of a payload: stated, to be estimated from a cylinder force, or logged.
#[derive(Debug, Clone, PartialEq)]
pub enum PayloadMass {
    /// Mass (kg).
    Known(f64),
    /// The word "estimate".
    Word(String),
    /// A signal of the log.
    Signal(MassSignal),
}

/// `mass = { signal, max_age }`: the mass of a payload as the log has it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a table { signal }, such as { signal = { topic = \"/scale\", field = \"mass\" } }"
)]
pub struct MassSignal {
    /// The number (kg, once scaled): of a load moment indicator, a loader's scale, a sum of jacks, a CAN signal.
    pub signal: FieldSpec,
    /// Longest time for which a sample holds (s).
    #[serde(default = "mass_max_age")]
    pub max_age: f64,
}

impl MassSignal {
    /// Returns the longest time for which a sample holds (ns).
    #[must_use]
    pub fn max_age_ns(&self) -> i64 {
        (self.max_age * 1e9).min(9e18) as i64
    }
}

/// A scale reports at least that often (s).
fn mass_max_age() -> f64 {
    2.0
}

impl<'de> OneOf<'de> for PayloadMass {
    const EXPECTED: &'static str = "a mass [kg], such as 450.0, the word \"estimate\", or a table { signal }, such as \
         { signal = { topic = \"/scale\", field = \"mass\" } }";

    fn of_number(value: f64) -> Option<Self> {
        Some(Self::Known(value))
    }

    fn of_text(text: &str) -> Option<Self> {
        Some(Self::Word(text.into()))
    }

    fn of_table<A: MapAccess<'de>>(table: A) -> Option<Result<Self, A::Error>> {
        let signal = MassSignal::deserialize(MapAccessDeserializer::new(table));
        Some(signal.map(Self::Signal))
    }
}

/// Pressures in a cylinder's chambers: force = p_piston A_piston - p_rod A_rod.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressureSpec {
    /// Pressure on the piston's side (Pa).
    pub piston: FieldSpec,
    /// Pressure on the rod's side (Pa).
    pub rod: FieldSpec,
    /// Area of the piston (m^2).
    pub piston_area: f64,
    /// Area of the annulus around the rod (m^2).
    pub rod_area: f64,
}

/// `[clock]`: known properties of the topics' clocks.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockSpec {
    /// Correction to add to the stamps of each topic (s): negative if they are late.
    #[serde(default)]
    pub offset: BTreeMap<String, f64>,
}

table! {
    /// `[estimator]`: noise model of the signals, where an estimator begins; the samples may correct those of joints. The
    /// machine-file reference describes the trade-off of each value.
    #[derive(Copy)]
    pub struct EstimatorSpec {
        /// Longest gap between two samples of a signal that is bridged (s); rows in a longer gap are invalid.
        max_gap: f64 = 0.25, positive;
        /// Standard deviation of a joint position (rad or m).
        joint_position_noise: f64 = 3e-4, positive;
        /// Standard deviation of a joint velocity (rad/s or m/s).
        joint_rate_noise: f64 = 3e-3, positive;
        /// Process noise: standard deviation of the change of a joint's acceleration in one second (rad/s^2 or
        /// m/s^2).
        joint_agility: f64 = 0.1, positive;
        /// Standard deviation of an angular velocity (rad/s).
        gyro_noise: f64 = 2e-3, positive;
        /// Process noise: standard deviation of the change of the angular jerk in one second (rad/s^3).
        gyro_agility: f64 = 2.0, positive;
        /// Standard deviation of a specific force (m/s^2).
        accelerometer_noise: f64 = 0.05, positive;
        /// Process noise: standard deviation of the change of its second derivative in one second (m/s^4).
        accelerometer_agility: f64 = 30.0, positive;
        /// Standard deviation of the up direction (rad).
        attitude_noise: f64 = 2e-3, positive;
        /// Process noise: standard deviation of the change of its second derivative in one second (rad/s^2).
        attitude_agility: f64 = 1.0, positive;
        /// Standard deviation of an odometry velocity (m/s).
        odometry_noise: f64 = 0.01, positive;
        /// Process noise: standard deviation of the change of its second derivative in one second (m/s^3).
        odometry_agility: f64 = 5.0, positive;
        /// Standard deviation of a component of the tool wrench (N or N m).
        tool_force_noise: f64 = 20.0, positive;
        /// Process noise: standard deviation of the change of its second derivative in one second (N/s^2 or
        /// N m/s^2).
        tool_force_agility: f64 = 1e5, positive;
        /// Process noise of an actuator's force: standard deviation of the change of its second derivative in one
        /// second (N/s^2). Its measurement noise is the linkage's `force_sigma`.
        actuator_force_agility: f64 = 1e6, positive;
        /// Whether the samples correct the stated noise: the noise of measurements in both directions, the process noise
        /// upwards.
        noise_from_log: bool = false;
        /// Warm-up time of the causal estimator after a start or a gap (s), during which rows are invalid.
        settle: f64 = 0.3, not_negative;
    }
}

table! {
    /// `[uncertainty]`: standard deviation of each parameter. The defaults suit a machine whose data come from
    /// drawings, without weighing.
    #[derive(Copy)]
    pub struct UncertaintySpec {
        /// Mass of a link, relative.
        mass_share: f64 = 0.02, not_negative;
        /// Centre of mass of a link, along each axis (m).
        com: f64 = 0.01, not_negative;
        /// Inertia tensor of a link, relative.
        inertia_share: f64 = 0.1, not_negative;
        /// Mass of a payload that states no standard deviation, relative.
        payload_mass_share: f64 = 0.05, not_negative;
        /// Position of a wheel, along each axis (m).
        wheel_position: f64 = 0.005, not_negative;
        /// Radius of a wheel (m).
        wheel_radius: f64 = 0.002, not_negative;
        /// Position of the arm's root, along each axis (m).
        arm_position: f64 = 0.005, not_negative;
        /// Systematic error of a revolute joint's position (rad).
        joint_offset: f64 = 0.005, not_negative;
        /// Systematic error of a prismatic joint's position (m).
        joint_offset_linear: f64 = 0.003, not_negative;
        /// Position of the IMU, along each axis (m).
        imu_position: f64 = 0.01, not_negative;
        /// Orientation of the IMU, about each axis (rad).
        imu_rotation: f64 = 0.005, not_negative;
        /// Bias of the accelerometer, along each axis (m/s^2).
        accelerometer_bias: f64 = 0.03, not_negative;
        /// Bias of the gyro, about each axis (rad/s).
        gyro_bias: f64 = 0.002, not_negative;
        /// Constant error of roll and pitch in the IMU's orientation (rad).
        attitude_bias: f64 = 0.001, not_negative;
        /// Local gravity (m/s^2).
        gravity: f64 = 0.01, not_negative;
        /// Systematic error of the force on the tool, along each axis (N).
        tool_force: f64 = 50.0, not_negative;
        /// Systematic error of the moment on the tool, about each axis (N m).
        tool_moment: f64 = 20.0, not_negative;
        /// Roll moment distribution D. The default is that of tyres of one kind on plane ground, each 8 % stiffer or softer
        /// than the others (a quarter of that in D); what uneven ground does is in the envelope. The former spelling of the key, `front_share`, is deprecated.
        #[serde(alias = "front_share")]
        roll_moment_distribution: f64 = 0.02, not_negative;
        /// Stiffness of a tyre, relative.
        tyre_stiffness_share: f64 = 0.2, not_negative;
        /// Effects outside the rigid-body model, for each load as a fraction of the mean load.
        model_share: f64 = 0.003, not_negative;
    }
}

impl UncertaintySpec {
    /// Its values by key.
    #[must_use]
    pub fn by_key(&self) -> Vec<(&'static str, f64)> {
        let numbers = self.numbers().into_iter();
        numbers.map(|number| (number.key, number.value)).collect()
    }
}

/// `[suspension]`: active suspension of the second paper, only for machines that have one.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuspensionSpec {
    /// Names of the linkages whose cylinders actuate the suspension.
    pub linkages: Vec<String>,
    /// Smallest and largest cylinder stroke (m).
    #[serde(deserialize_with = "exactly")]
    pub stroke: [f64; 2],
    /// Largest stroke velocity (m/s).
    pub max_velocity: f64,
    /// Largest stroke acceleration (m/s^2).
    pub max_acceleration: f64,
    /// Cylinders, oil and valves.
    #[serde(default)]
    pub hydraulics: HydraulicsSpec,
    /// Settings of its controller.
    #[serde(default)]
    pub control: SuspensionControl,
}

/// The key whose numbers may be NaN: where only the change of an identified parameter has a meaning.
const MAY_BE_NAN: &str = "identified.nominal";

impl MachineSpec {
    /// Returns the machine's identity among others: its name, and its serial number where the machine file states one. Both are
    /// quoted then, so that it is seen where the one ends and the other begins.
    #[must_use]
    pub fn identity(&self) -> String {
        match &self.serial {
            Some(serial) => format!("{:?} {serial:?}", self.name),
            None => self.name.clone(),
        }
    }

    /// Its identity before the machine file stated a serial number; `None` if it states none.
    #[must_use]
    pub fn unnumbered_identity(&self) -> Option<&str> {
        self.serial.as_ref().map(|_| self.name.as_str())
    }

    /// Field of the force of a linkage's actuator: its own key, else the effort of the rod joint.
    #[must_use]
    pub fn force_of<'a>(&'a self, linkage: &'a LinkageSpec) -> Option<&'a FieldSpec> {
        let of_rod = || self.signals.joints.get(&linkage.rod)?.effort.as_ref();
        linkage.force.as_ref().or_else(of_rod)
    }

    /// Returns the fields of the signals of a linkage's force: the force itself, or the pressures on the piston's and on the
    /// rod's side; none if the linkage binds neither.
    #[must_use]
    pub fn signals_of<'a>(&'a self, linkage: &'a LinkageSpec) -> Vec<&'a FieldSpec> {
        match (self.force_of(linkage), &linkage.pressure) {
            (Some(force), _) => vec![force],
            (None, Some(pressure)) => vec![&pressure.piston, &pressure.rod],
            (None, None) => Vec::new(),
        }
    }

    /// Parses the text of a machine file; `file` is its name for messages.
    ///
    /// # Errors
    /// Invalid TOML, or an unknown, missing or mistyped key, with line and column; a number that is not finite.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, MachineError> {
        let spec: Self = toml::from_str(text).map_err(|e| MachineError::MachineFile {
            file: file.into(),
            message: explained(text, &e),
        })?;
        let mut spec = Self {
            file: file.into(),
            ..spec
        };
        if let Some((key, found)) = not_finite(text, MAY_BE_NAN) {
            return Err(MachineError::value(file, key, "a finite number", found));
        }
        spec.add_supports()?;
        Ok(spec)
    }
}
