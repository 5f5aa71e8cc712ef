//! `[signals]`: where the log contains the machine's signals, as topics of the usual type or as single
//! number fields of any messages.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

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
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub enum OneOrMany {
    /// One name.
    One(String),
    /// Several names.
    Many(Vec<String>),
}

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

/// A number field of a log.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// Topic, of any type.
    pub topic: String,
    /// Path of the number in its messages, like `fluid_pressure` or `forces[2].x`. With `joint`: a list of
    /// numbers parallel to a list of names, like `effort`, or a number in a list of named messages, like
    /// `joints[].effort`; by default the list of a `sensor_msgs/JointState` that holds the quantity.
    pub field: Option<String>,
    /// The name whose index in the list of names selects the number.
    pub joint: Option<String>,
    /// Factor applied to the number.
    #[serde(default = "one")]
    pub scale: f64,
    /// Offset added after scaling.
    #[serde(default)]
    pub offset: f64,
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
}

/// `[signals.imu]`: the inertial measurement unit, in its own axes. The components of a vector must come from
/// one topic.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuFields {
    /// Specific force x y z (m/s^2): +g along the axis that points up, at rest.
    pub specific_force: [NumberSpec; 3],
    /// Angular velocity x y z (rad/s).
    pub angular_velocity: [NumberSpec; 3],
    /// Orientation in an upright frame: quaternion x y z w.
    pub orientation: Option<[NumberSpec; 4]>,
    /// The same as roll, pitch and yaw about fixed axes (rad).
    pub roll_pitch_yaw: Option<[NumberSpec; 3]>,
}

/// `[signals.odometry]`: motion of the base frame. The components of a vector must come from one topic.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryFields {
    /// Velocity forward, left and up (m/s).
    pub velocity: [NumberSpec; 3],
    /// Angular velocity x y z (rad/s); used only without an IMU.
    pub angular_velocity: Option<[NumberSpec; 3]>,
    /// Orientation in an upright frame: quaternion x y z w; used only without an IMU.
    pub orientation: Option<[NumberSpec; 4]>,
    /// The same as roll, pitch and yaw about fixed axes (rad).
    pub roll_pitch_yaw: Option<[NumberSpec; 3]>,
}

/// `[signals.tool_wrench]`: wrench of the surroundings on the tool, in its frame. All fields from one topic.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrenchFields {
    /// Force x y z (N).
    pub force: [NumberSpec; 3],
    /// Moment x y z about the tool's origin (N m).
    pub moment: [NumberSpec; 3],
}

// Implemented by hand: an untagged enum would not report the error inside the table.
impl<'de, T: Deserialize<'de>> Deserialize<'de> for SignalSpec<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TopicOrFields<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for TopicOrFields<T> {
            type Value = SignalSpec<T>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("the name of a topic, or a table of numbers")
            }

            fn visit_str<E>(self, topic: &str) -> Result<Self::Value, E> {
                Ok(SignalSpec::Topic(topic.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(SignalSpec::Fields)
            }
        }

        deserializer.deserialize_any(TopicOrFields(PhantomData))
    }
}

impl<'de> Deserialize<'de> for NumberSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrField;

        impl<'de> Visitor<'de> for NumberOrField {
            type Value = NumberSpec;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a number, or a table { topic, field }")
            }

            fn visit_f64<E>(self, number: f64) -> Result<Self::Value, E> {
                Ok(NumberSpec::Constant(number))
            }

            fn visit_i64<E>(self, number: i64) -> Result<Self::Value, E> {
                Ok(NumberSpec::Constant(number as f64))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                FieldSpec::deserialize(MapAccessDeserializer::new(map)).map(NumberSpec::Field)
            }
        }

        deserializer.deserialize_any(NumberOrField)
    }
}
