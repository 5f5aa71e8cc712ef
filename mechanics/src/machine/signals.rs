//! `[signals]`: where the log contains the machine's signals, as topics of the usual type or as single
//! number fields of any messages.

use std::collections::BTreeMap;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess};
use serde::{Deserialize, Deserializer};

use super::exactly::{exactly, exactly_if_any};
use super::one_of::{OneOf, one_of};

/// `[signals]`: absent signals are found by message type.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalsSpec {
    /// `sensor_msgs/JointState`, one topic or several topics.
    pub joint_states: Option<OneOrMany>,
    /// Single joints, by their URDF names, from any messages. They take precedence over `joint_states`.
    #[serde(default)]
    pub joints: BTreeMap<String, JointFields>,
    /// `sensor_msgs/Imu`, or single number fields.
    pub imu: Option<SignalSpec<ImuFields>>,
    /// `nav_msgs/Odometry`, or single number fields.
    pub odometry: Option<SignalSpec<OdometryFields>>,
    /// `geometry_msgs/WrenchStamped`, or single number fields: force and moment of the surroundings on the tool.
    pub tool_wrench: Option<SignalSpec<WrenchFields>>,
    /// By topic, `header.frame_id` of the sensor that is meant where several sensors share the topic.
    #[serde(default)]
    pub frames: BTreeMap<String, String>,
    /// Measured loads of single wheels, by the names of `[wheels]`. The loads are computed without them; they are
    /// compared with the computed ones.
    #[serde(default)]
    pub wheels: BTreeMap<String, WheelFields>,
    /// Measured total loads of several wheels: axle scales, load pins, weighbridges.
    #[serde(default)]
    pub load_sums: Vec<LoadSumFields>,
}

/// `[signals.wheels.NAME]`: the measured load of a wheel.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelFields {
    /// Force of the ground on the wheel along the normal of the ground (N).
    pub load: FieldSpec,
    /// Standard deviation of its systematic error (N); default: 2 % of the mean wheel load.
    pub sigma: Option<f64>,
}

/// `[[signals.load_sums]]`: a sensor that measures the total load of several wheels.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadSumFields {
    /// Name of the sensor; default: its wheels.
    pub name: Option<String>,
    /// The wheels.
    pub wheels: Vec<String>,
    /// Sum of their loads (N).
    pub load: FieldSpec,
    /// Standard deviation of its systematic error (N); default: 2 % of the mean wheel load for each of its wheels.
    pub sigma: Option<f64>,
}

/// One name, or several.
#[derive(Debug, Clone)]
pub enum OneOrMany {
    /// One name.
    One(String),
    /// Several names.
    Many(Vec<String>),
}

impl<'de> OneOf<'de> for OneOrMany {
    const EXPECTED: &'static str = "the name of a topic, such as \"/joint_states\", or a list of names, such as [\"/arm/joint_states\", \
         \"/base/joint_states\"]";

    fn of_text(text: &str) -> Option<Self> {
        Some(Self::One(text.into()))
    }

    fn of_list<A: SeqAccess<'de>>(list: A) -> Option<Result<Self, A::Error>> {
        let names = Vec::deserialize(SeqAccessDeserializer::new(list));
        Some(names.map(Self::Many))
    }
}

crate::read_one_of!(OneOrMany, NumberSpec);

impl OneOrMany {
    /// The names in file order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Many(names) => names,
        }
    }
}

/// A signal: the name of a topic of its type, or a table of number fields.
#[derive(Debug, Clone, PartialEq)]
pub enum SignalSpec<T> {
    /// The topic.
    Topic(String),
    /// The number fields.
    Fields(T),
}

impl<T> SignalSpec<T> {
    /// The topic, if one is named.
    #[must_use]
    pub fn topic(&self) -> Option<&String> {
        match self {
            Self::Topic(topic) => Some(topic),
            Self::Fields(_) => None,
        }
    }

    /// The number fields, if they are named.
    #[must_use]
    pub fn fields(&self) -> Option<&T> {
        match self {
            Self::Topic(_) => None,
            Self::Fields(fields) => Some(fields),
        }
    }
}

/// A number field of a log: in the messages of a topic, or in CAN frames.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "FieldTable")]
pub struct FieldSpec {
    /// Topic, of any type. For a CAN signal, the name of the topic that its message becomes.
    pub topic: String,
    /// Path of the number in its messages, like `fluid_pressure` or `forces[2].x`. With `joint`: a list of
    /// numbers parallel to a list of names, like `effort`, or a number in a list of named messages, like
    /// `joints[].effort`; by default the list of a `sensor_msgs/JointState` that holds the quantity.
    pub field: Option<String>,
    /// The name whose index in the list of names selects the number.
    pub joint: Option<String>,
    /// Factor applied to the number.
    pub scale: f64,
    /// Offset added after scaling.
    pub offset: f64,
    /// Where the number is in CAN frames.
    pub can: Option<CanSpec>,
}

/// A signal in CAN frames: `{ topic, dbc, message, signal }` or `{ topic, pgn, source, signal }`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CanSpec {
    /// The topic of the frames; `None` for the only one of the log.
    pub bus: Option<String>,
    /// Where the message is described.
    pub message: CanMessageSpec,
    /// The only sender (SAE J1939).
    pub source: Option<u8>,
    /// The signal.
    pub signal: String,
}

/// Where a CAN message is described.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CanMessageSpec {
    /// In a DBC file, relative to the machine file, by name.
    Dbc {
        /// The file.
        file: String,
        /// The message.
        message: String,
    },
    /// A public parameter group of SAE J1939.
    ParameterGroup(u32),
}

impl CanSpec {
    /// The name of the topic that the message becomes.
    #[must_use]
    pub fn topic(&self) -> String {
        let bus = self.bus.as_deref().unwrap_or("can");
        let source = self
            .source
            .map_or(String::new(), |source| format!("@{source}"));
        match &self.message {
            CanMessageSpec::Dbc { message, .. } => format!("{bus}/{message}{source}"),
            CanMessageSpec::ParameterGroup(pgn) => format!("{bus}/PGN{pgn}{source}"),
        }
    }
}

/// The keys of a [`FieldSpec`] as written.
#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a table { topic, field }, such as { topic = \"/arm\", field = \"angle\" }"
)]
struct FieldTable {
    topic: Option<String>,
    field: Option<String>,
    joint: Option<String>,
    #[serde(default = "one")]
    scale: f64,
    #[serde(default)]
    offset: f64,
    dbc: Option<String>,
    message: Option<String>,
    pgn: Option<u32>,
    source: Option<u8>,
    signal: Option<String>,
}

impl TryFrom<FieldTable> for FieldSpec {
    type Error = &'static str;

    fn try_from(table: FieldTable) -> Result<Self, Self::Error> {
        const KEYS: &str = "a CAN signal: expected { topic, dbc, message, signal } or { topic, pgn, source, signal }, \
             of which topic and source may be missing, and no field or joint";
        let FieldTable {
            topic,
            field,
            joint,
            scale,
            offset,
            ..
        } = table;
        let message = match (table.dbc, table.message, table.pgn) {
            (None, None, None) if table.signal.is_none() && table.source.is_none() => {
                return Ok(Self {
                    topic: topic.ok_or("missing field `topic`")?,
                    field,
                    joint,
                    scale,
                    offset,
                    can: None,
                });
            }
            (Some(file), Some(message), None) => CanMessageSpec::Dbc { file, message },
            (None, None, Some(pgn)) => CanMessageSpec::ParameterGroup(pgn),
            _ => return Err(KEYS),
        };
        let (Some(signal), None, None) = (table.signal, field, joint) else {
            return Err(KEYS);
        };
        let can = CanSpec {
            bus: topic,
            message,
            source: table.source,
            signal,
        };
        Ok(Self {
            topic: can.topic(),
            field: Some(can.signal.clone()),
            joint: None,
            scale,
            offset,
            can: Some(can),
        })
    }
}

/// The keys that a number that switches has besides those of a field.
pub(super) const SWITCH_KEYS: [&str; 2] = ["above", "max_age"];

/// All CAN signals that a machine file names, wherever they stand in it.
#[must_use]
pub fn can_signals(text: &str) -> Vec<CanSpec> {
    let mut found = Vec::new();
    visit_tables(text, &mut |table| {
        if !table.contains_key("signal") {
            return true;
        }
        let mut field = table.clone();
        field.retain(|key, _| !SWITCH_KEYS.contains(&key));
        match FieldSpec::deserialize(toml::Value::Table(field)) {
            Ok(FieldSpec { can: Some(can), .. }) => {
                found.push(can);
                false
            }
            _ => true,
        }
    });
    found
}

/// The topics of all numbers that a machine file names by topic and field, wherever they stand in it, without those
/// of CAN signals.
#[must_use]
pub fn number_topics(text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    visit_tables(text, &mut |table| {
        let topic = table.get("topic").and_then(toml::Value::as_str);
        let is_can = table.contains_key("signal");
        if let Some(topic) = topic.filter(|_| !is_can)
            && !found.iter().any(|known| known == topic)
        {
            found.push(topic.to_owned());
        }
        true
    });
    found
}

/// Shows all tables of a machine file to `visit`, which returns whether it wants those within, too. A text that is no
/// machine file is refused where it is read.
fn visit_tables(text: &str, visit: &mut dyn FnMut(&toml::Table) -> bool) {
    fn walk(value: &toml::Value, visit: &mut dyn FnMut(&toml::Table) -> bool) {
        match value {
            toml::Value::Table(table) if visit(table) => {
                table.values().for_each(|value| walk(value, visit));
            }
            toml::Value::Array(values) => values.iter().for_each(|value| walk(value, visit)),
            _ => {}
        }
    }
    if let Ok(table) = text.parse::<toml::Table>() {
        walk(&toml::Value::Table(table), visit);
    }
}

fn one() -> f64 {
    1.0
}

/// A number of a signal: a field of the log, or a constant.
#[derive(Debug, Clone, PartialEq)]
pub enum NumberSpec {
    /// Constant value.
    Constant(f64),
    /// Field of the log.
    Field(FieldSpec),
}

impl NumberSpec {
    /// The field, unless the number is constant.
    #[must_use]
    pub fn field(&self) -> Option<&FieldSpec> {
        match self {
            Self::Constant(_) => None,
            Self::Field(field) => Some(field),
        }
    }
}

/// `[signals.joints.NAME]`: number fields of one joint.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointFields {
    /// Position (rad or m): a field, or a constant for a joint that no message measures.
    pub position: Option<NumberSpec>,
    /// Velocity (rad/s or m/s), from messages of the same topic.
    pub velocity: Option<FieldSpec>,
    /// Force or moment of its actuator (N or N m).
    pub effort: Option<FieldSpec>,
    /// Rate that its controller asks for (rad/s or m/s), NaN while it asks for nothing.
    pub command: Option<FieldSpec>,
}

/// `[signals.imu]`: the inertial measurement unit, in its own axes. What comes from other topics than the first number is
/// interpolated; an attitude must come from one topic.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuFields {
    /// Specific force x y z (m/s^2): +g along the axis that points up, at rest.
    #[serde(deserialize_with = "exactly")]
    pub specific_force: [NumberSpec; 3],
    /// Angular velocity x y z (rad/s).
    #[serde(deserialize_with = "exactly")]
    pub angular_velocity: [NumberSpec; 3],
    /// Orientation in an upright frame: quaternion x y z w.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub orientation: Option<[NumberSpec; 4]>,
    /// The same as roll, pitch and yaw about fixed axes (rad).
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub roll_pitch_yaw: Option<[NumberSpec; 3]>,
}

/// `[signals.odometry]`: motion of the base frame, from topics as in `[signals.imu]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryFields {
    /// Velocity forward, left and up (m/s).
    #[serde(deserialize_with = "exactly")]
    pub velocity: [NumberSpec; 3],
    /// Angular velocity x y z (rad/s); used only without an IMU.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub angular_velocity: Option<[NumberSpec; 3]>,
    /// Orientation in an upright frame: quaternion x y z w; used only without an IMU.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub orientation: Option<[NumberSpec; 4]>,
    /// The same as roll, pitch and yaw about fixed axes (rad).
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub roll_pitch_yaw: Option<[NumberSpec; 3]>,
}

/// `[signals.tool_wrench]`: wrench of the surroundings on the tool, in its frame, from topics as in `[signals.imu]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrenchFields {
    /// Force x y z (N).
    #[serde(deserialize_with = "exactly")]
    pub force: [NumberSpec; 3],
    /// Moment x y z about the tool's origin (N m).
    #[serde(deserialize_with = "exactly")]
    pub moment: [NumberSpec; 3],
}

impl<'de, T: Deserialize<'de>> OneOf<'de> for SignalSpec<T> {
    const EXPECTED: &'static str = "the name of a topic, such as \"/imu/data\", or a table of numbers, whose keys the machine-file \
         reference lists";

    fn of_text(text: &str) -> Option<Self> {
        Some(Self::Topic(text.into()))
    }

    fn of_table<A: MapAccess<'de>>(table: A) -> Option<Result<Self, A::Error>> {
        let fields = T::deserialize(MapAccessDeserializer::new(table));
        Some(fields.map(Self::Fields))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for SignalSpec<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        one_of(deserializer)
    }
}

impl<'de> OneOf<'de> for NumberSpec {
    const EXPECTED: &'static str = "a number, such as 0.0, or a table { topic, field }, such as { topic = \"/arm\", field = \"angle\" }";

    fn of_number(value: f64) -> Option<Self> {
        Some(Self::Constant(value))
    }

    fn of_table<A: MapAccess<'de>>(table: A) -> Option<Result<Self, A::Error>> {
        let field = FieldSpec::deserialize(MapAccessDeserializer::new(table));
        Some(field.map(Self::Field))
    }
}
