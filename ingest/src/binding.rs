//! Which topic carries which signal.

use crate::{
    definition::SchemaError,
    sensor::SensorKind,
    topic::{Topic, TopicId},
};

/// Why a topic cannot be taken for a signal.
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
        /// The type that is there.
        found: String,
    },
    /// The messages are encoded in a way that is not read.
    #[error("topic {topic}: not read yet: encoding {encoding}")]
    NotReadYet {
        /// The topic.
        topic: String,
        /// The encoding of the messages or of their definition.
        encoding: String,
    },
    /// Nothing tells the fields of the messages.
    #[error("topic {topic}: the log has no definition of {type_name}, and it is no common type")]
    NoDefinition {
        /// The topic.
        topic: String,
        /// The type.
        type_name: String,
    },
    /// The definition is not what the type name promises.
    #[error("topic {topic}: {source}")]
    Schema {
        /// The topic.
        topic: String,
        /// What is wrong.
        source: SchemaError,
    },
    /// The topic of a field that the machine file names is not in the log.
    #[error(
        "topic {named}, named by the machine file for field {field}: not in the log, which has: {}",
        available.join(", ")
    )]
    NoTopicOfField {
        /// The name in the machine file.
        named: String,
        /// The field.
        field: String,
        /// Every topic of the log.
        available: Vec<String>,
    },
    /// A field that the machine file names is no path.
    #[error(
        "topic {topic}: expected the path of one number, like wrench.force.z or forces[2].x, or a list of numbers and a joint, found \"{field}\""
    )]
    NoFieldPath {
        /// The topic.
        topic: String,
        /// What the machine file says.
        field: String,
    },
    /// No message has a number that the machine file names.
    #[error(
        "topic {topic}: expected a number in field {field}{}, found none in {messages} messages{}",
        joint.as_ref().map_or(String::new(), |joint| format!(" of \"{joint}\"")),
        if names.is_empty() { String::new() } else { format!("; the last one names: {}", names.join(", ")) }
    )]
    NoNumber {
        /// The topic.
        topic: String,
        /// The path.
        field: String,
        /// The name looked for beside it.
        joint: Option<String>,
        /// How many messages were looked at.
        messages: u64,
        /// The names in the last message.
        names: Vec<String>,
    },
    /// A topic that the machine file names is not in the log.
    #[error(
        "topic {named}, named by the machine file as {}: not in the log, which has: {}",
        kind.signal_key(),
        available.join(", ")
    )]
    NoSuchTopic {
        /// What it was to carry.
        kind: SensorKind,
        /// The name in the machine file.
        named: String,
        /// Every topic of the log, with its type.
        available: Vec<String>,
    },
    /// More than one topic could carry a signal.
    #[error(
        "two candidates for one signal: {} may be any of {}. Name one in the machine file, under \
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
}

/// A signal to look for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted {
    /// What it measures.
    pub kind: SensorKind,
    /// The topic that the machine file names, if it does.
    pub topic: Option<String>,
}

impl Wanted {
    /// Finds the topic, as [`bind`] does.
    pub fn bind(&self, topics: &[Topic]) -> Result<Option<Binding>, BindingError> {
        bind(topics, self.kind, self.topic.as_deref())
    }
}

/// A signal and the topic that carries it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Binding {
    /// What it measures.
    pub kind: SensorKind,
    /// The topic.
    pub topic: TopicId,
    /// Why this topic was taken.
    pub why: String,
}

/// Finds the topic for one signal: the named one, else the only one of the type that has messages.
/// `None` when there is none.
pub fn bind(
    topics: &[Topic],
    kind: SensorKind,
    named: Option<&str>,
) -> Result<Option<Binding>, BindingError> {
    if let Some(name) = named {
        return bind_named(topics, kind, name).map(Some);
    }
    match candidates(topics, kind).as_slice() {
        [] => Ok(None),
        [topic] => {
            let why = format!("the only {} topic", kind.type_name());
            Ok(Some(Binding {
                kind,
                topic: topic.id,
                why,
            }))
        }
        several => Err(several_candidates(kind, several)),
    }
}

/// Finds the topics of joint states: the named ones, else all of the type that have messages,
/// because different joints may come on different topics.
pub fn bind_joint_states(topics: &[Topic], named: &[String]) -> Result<Vec<Binding>, BindingError> {
    let kind = SensorKind::JointStates;
    if !named.is_empty() {
        return named
            .iter()
            .map(|name| bind_named(topics, kind, name))
            .collect();
    }
    let found = candidates(topics, kind);
    let why = match found.len() {
        1 => format!("the only {} topic", kind.type_name()),
        count => format!("one of {count} {} topics", kind.type_name()),
    };
    let binding = |topic: &&Topic| Binding {
        kind,
        topic: topic.id,
        why: why.clone(),
    };
    Ok(found.iter().map(binding).collect())
}

fn candidates(topics: &[Topic], kind: SensorKind) -> Vec<&Topic> {
    let fits = |topic: &&Topic| kind.is_type(&topic.type_name) && topic.message_count != Some(0);
    topics.iter().filter(fits).collect()
}

fn bind_named(topics: &[Topic], kind: SensorKind, name: &str) -> Result<Binding, BindingError> {
    let same_name: Vec<&Topic> = topics.iter().filter(|topic| topic.name == name).collect();
    let fits = |topic: &&&Topic| kind.is_type(&topic.type_name);
    let fitting: Vec<&Topic> = same_name.iter().filter(fits).copied().collect();
    match (fitting.as_slice(), same_name.first()) {
        ([topic], _) => Ok(Binding {
            kind,
            topic: topic.id,
            why: "named by the machine file".to_owned(),
        }),
        ([], None) => Err(BindingError::NoSuchTopic {
            kind,
            named: name.to_owned(),
            available: topics.iter().map(with_type).collect(),
        }),
        ([], Some(other)) => Err(BindingError::WrongType {
            topic: name.to_owned(),
            expected: kind.type_name(),
            found: other.type_name.clone(),
        }),
        (several, _) => Err(several_candidates(kind, several)),
    }
}

fn several_candidates(kind: SensorKind, topics: &[&Topic]) -> BindingError {
    let first = topics.first().map_or("", |topic| &topic.name);
    BindingError::SeveralCandidates {
        kind,
        candidates: topics.iter().map(|topic| with_count(topic)).collect(),
        line: format!("{} = \"{first}\"", kind.signal_key()),
    }
}

fn with_type(topic: &Topic) -> String {
    format!("{} ({})", topic.name, topic.type_name)
}

fn with_count(topic: &Topic) -> String {
    match topic.message_count {
        Some(count) => format!("{} ({}, {count} messages)", topic.name, topic.type_name),
        None => with_type(topic),
    }
}
