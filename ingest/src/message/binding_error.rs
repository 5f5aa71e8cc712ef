//! Errors of using a topic as a signal.

use super::sensor_kind::SensorKind;
use crate::schema::SchemaError;

/// Error: a topic cannot serve as a signal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BindingError {
    /// The messages are of another type.
    #[error("topic {topic}: expected messages of type {expected}, found {found}")]
    WrongType {
        /// The topic.
        topic: String,
        /// The type that the signal needs.
        expected: &'static str,
        /// The type found.
        found: String,
    },
    /// The encoding of the messages is not supported.
    #[error("topic {topic}: unsupported encoding {encoding}")]
    Unsupported {
        /// The topic.
        topic: String,
        /// The encoding of the messages or of their definition.
        encoding: String,
    },
    /// The fields of the messages are unknown.
    #[error(
        "topic {topic}: the log has no definition of {type_name}, and the type is not built in; give a folder with \
         PACKAGE/msg/NAME.msg of this type and its parts: --definitions DIR"
    )]
    NoDefinition {
        /// The topic.
        topic: String,
        /// The type.
        type_name: String,
    },
    /// The definition does not fit the wanted fields.
    #[error("topic {topic}: {source}")]
    Schema {
        /// The topic.
        topic: String,
        /// Error in the definition.
        source: SchemaError,
    },
    /// The topic of a field that the machine file names is not in the log.
    #[error(
        "topic {named}, named by the machine file for field {field}: not in the log, which has {}",
        listed(available)
    )]
    NoTopicOfField {
        /// The name in the machine file.
        named: String,
        /// The field.
        field: String,
        /// Every topic of the log.
        available: Vec<String>,
    },
    /// The frames of a CAN message cannot be found.
    #[error(
        "CAN message {message}: expected {}, found {}",
        named.as_ref().map_or_else(
            || "one topic of CAN frames, or topic = \"...\" to choose one".to_owned(),
            |named| format!("CAN frames (can_msgs/msg/Frame) on topic {named}"),
        ),
        if available.is_empty() { "no topic of CAN frames".to_owned() } else { available.join(", ") }
    )]
    NoBus {
        /// The message.
        message: String,
        /// The name in the machine file.
        named: Option<String>,
        /// Every topic of CAN frames.
        available: Vec<String>,
    },
    /// Several controllers send a message, and none of them is named.
    #[error(
        "CAN message {topic}: expected one sender, found source addresses {}; name one: source = {}",
        sources.iter().map(u8::to_string).collect::<Vec<_>>().join(", "),
        sources.first().copied().unwrap_or(0)
    )]
    SeveralSources {
        /// The message.
        topic: String,
        /// The source addresses.
        sources: Vec<u8>,
    },
    /// A field that the machine file names is not a field path.
    #[error(
        "topic {topic}: expected the path of one number, like wrench.force.z or forces[2].x, or a list of numbers and a joint, found \"{field}\""
    )]
    NoFieldPath {
        /// The topic.
        topic: String,
        /// Path of the field in the machine file.
        field: String,
    },
    /// No message has the number that the machine file names.
    #[error(
        "topic {topic}: expected a number in field {field}{}, found none in {messages} messages{}",
        joint.as_ref().map_or(String::new(), |joint| format!(" of \"{joint}\"")),
        if names.is_empty() { String::new() } else { format!("; names in the last message: {}", names.join(", ")) }
    )]
    NoNumber {
        /// The topic.
        topic: String,
        /// The path.
        field: String,
        /// Name of the number in a list of names.
        joint: Option<String>,
        /// Number of messages read.
        messages: u64,
        /// The names in the last message.
        names: Vec<String>,
    },
    /// A topic that the machine file names is not in the log.
    #[error(
        "topic {named} ({}), named by the machine file as {}: not in the log, which has {}",
        kind.type_name(),
        kind.signal_key(),
        listed(available)
    )]
    NoSuchTopic {
        /// The signal it should carry.
        kind: SensorKind,
        /// The name in the machine file.
        named: String,
        /// Every topic of the log, with its type.
        available: Vec<String>,
    },
    /// More than one topic could carry a signal.
    #[error(
        "several candidates for one signal: {} may be any of {}. Name one in the machine file, under \
         [signals]: {line}",
        kind.signal_key(),
        candidates.join(", ")
    )]
    SeveralCandidates {
        /// The signal.
        kind: SensorKind,
        /// The topics, with type and number of messages.
        candidates: Vec<String>,
        /// The line to write.
        line: String,
    },
    /// Several sensors share a topic, and none of them is named; or the named one is not among them.
    #[error(
        "topic {topic} ({}): expected messages of {}, found {} by header.frame_id ({}). Name one in the machine file, \
         under [signals]: frames = {{ {topic:?} = {:?} }}",
        kind.signal_key(),
        wanted.as_ref().map_or("one sensor".to_owned(), |frame| format!("the sensor {frame:?}")),
        match found.len() { 1 => "one sensor".to_owned(), count => format!("{count} sensors") },
        found.iter().map(|frame| format!("{frame:?}")).collect::<Vec<_>>().join(", "),
        found.first().map_or("", String::as_str)
    )]
    Frames {
        /// The signal.
        kind: SensorKind,
        /// The topic.
        topic: String,
        /// The frame that the machine file names.
        wanted: Option<String>,
        /// The frames in the first messages.
        found: Vec<String>,
    },
}

fn listed(topics: &[String]) -> String {
    match topics.is_empty() {
        true => "no topics".to_owned(),
        false => format!("these: {}", topics.join(", ")),
    }
}
