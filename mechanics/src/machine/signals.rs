//! `[signals]`: where a log has what the machine's sensors measure. A topic of the usual type, or single
//! numbers of any messages.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// `[signals]`: what is absent is found by message type.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalsSpec {
    /// `sensor_msgs/JointState`, one topic or several.
    pub joint_states: Option<OneOrMany>,
    /// Single joints, by their names in the URDF, out of any messages. They go before `joint_states`.
    #[serde(default)]
    pub joints: BTreeMap<String, JointFields>,
    /// `sensor_msgs/Imu`, or single numbers.
    pub imu: Option<SignalSpec<ImuFields>>,
    /// `nav_msgs/Odometry`, or single numbers.
    pub odometry: Option<SignalSpec<OdometryFields>>,
    /// `geometry_msgs/WrenchStamped`, or single numbers: force and moment by the surroundings on the tool.
    pub tool_wrench: Option<SignalSpec<WrenchFields>>,
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
    /// The names in the order written.
    #[must_use]
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Many(names) => names,
        }
    }
}

/// A signal: the name of a topic of its type, or a table of the numbers that make it up.
#[derive(Debug, Clone, PartialEq)]
pub enum SignalSpec<T> {
    /// The topic.
    Topic(String),
    /// The numbers.
    Fields(T),
}

impl<T> SignalSpec<T> {
    /// The topic, where one is named.
    #[must_use]
    pub fn topic(&self) -> Option<&String> {
        match self {
            Self::Topic(topic) => Some(topic),
            Self::Fields(_) => None,
        }
    }

    /// The numbers, where they are named.
    #[must_use]
    pub fn fields(&self) -> Option<&T> {
        match self {
            Self::Topic(_) => None,
            Self::Fields(fields) => Some(fields),
        }
    }
}

/// Where a number in a log stands.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// The topic, of any type.
    pub topic: String,
    /// Path of the number in its messages, like `fluid_pressure` or `forces[2].x`; with `joint` a list of
    /// numbers beside a list of names, like `effort`, or a number in a list of messages that have names,
    /// like `joints[].effort`. With `joint` the default is that list of a `sensor_msgs/JointState` which
    /// holds the quantity.
    pub field: Option<String>,
    /// The name whose place in the list of names the number has in its own.
    pub joint: Option<String>,
    /// What the number is multiplied by.
    #[serde(default = "one")]
    pub scale: f64,
    /// What is added then.
    #[serde(default)]
    pub offset: f64,
}

fn one() -> f64 {
    1.0
}

/// A number of a signal: in the log, or the same at all times.
#[derive(Debug, Clone, PartialEq)]
pub enum NumberSpec {
    /// Always this.
    Constant(f64),
    /// In the log.
    Field(FieldSpec),
}

impl NumberSpec {
    /// Where it stands in the log, unless it is constant.
    #[must_use]
    pub fn field(&self) -> Option<&FieldSpec> {
        match self {
            Self::Constant(_) => None,
            Self::Field(field) => Some(field),
        }
    }
}

/// `[signals.joints.NAME]`: a joint.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointFields {
    /// Position (rad or m).
    pub position: Option<FieldSpec>,
    /// Rate (rad/s or m/s), from messages of the same topic.
    pub velocity: Option<FieldSpec>,
    /// Force or moment of its actuator (N or N m).
    pub effort: Option<FieldSpec>,
}

/// `[signals.imu]`: the inertial measurement unit, in its own axes. Each triple comes from one topic.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuFields {
    /// Specific force x y z (m/s^2): +g along the axis that points up at rest.
    pub specific_force: [NumberSpec; 3],
    /// Angular velocity x y z (rad/s).
    pub angular_velocity: [NumberSpec; 3],
    /// Orientation in an upright frame: quaternion x y z w.
    pub orientation: Option<[NumberSpec; 4]>,
    /// The same as roll, pitch and yaw about fixed axes (rad).
    pub roll_pitch_yaw: Option<[NumberSpec; 3]>,
}

/// `[signals.odometry]`: motion of the base frame. Each triple comes from one topic.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryFields {
    /// Velocity forward, left and up (m/s).
    pub velocity: [NumberSpec; 3],
    /// Angular velocity x y z (rad/s); counts where there is no IMU.
    pub angular_velocity: Option<[NumberSpec; 3]>,
    /// Orientation in an upright frame: quaternion x y z w; counts where there is no IMU.
    pub orientation: Option<[NumberSpec; 4]>,
    /// The same as roll, pitch and yaw about fixed axes (rad).
    pub roll_pitch_yaw: Option<[NumberSpec; 3]>,
}

/// `[signals.tool_wrench]`: by the surroundings on the tool, in its frame. All from one topic.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrenchFields {
    /// Force x y z (N).
    pub force: [NumberSpec; 3],
    /// Moment x y z about the tool's origin (N m).
    pub moment: [NumberSpec; 3],
}

// By hand, because an untagged enumeration would not say what is wrong inside of the table.
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
