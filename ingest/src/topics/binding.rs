//! Binds signals to topics.

use tipwatch_language::{say, word};

use crate::{
    log::Log,
    message::{BindingError, Error, SensorKind, Topic, TopicId},
};

/// A signal and the topic that carries it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Binding {
    /// Quantity that the signal measures.
    pub kind: SensorKind,
    /// The topic.
    pub topic: TopicId,
    /// Reason why this topic was chosen.
    pub why: String,
    /// `header.frame_id` of its messages, where they have one.
    pub frame_id: Option<String>,
}

impl Binding {
    fn of(kind: SensorKind, topic: &Topic, why: &str) -> Self {
        Self {
            kind,
            topic: topic.id,
            why: why.to_owned(),
            frame_id: None,
        }
    }
}

/// Finds the topic for one signal: the named one, else the only one of the type with messages.
/// `None` if there is none.
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
            let why = say!("the only {} topic", kind.type_name());
            Ok(Some(Binding::of(kind, topic, &why)))
        }
        several => Err(several_candidates(kind, several)),
    }
}

/// Finds the joint state topics: the named ones, else all of the type with messages, because
/// different joints may come on different topics.
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
        1 => say!("the only {} topic", kind.type_name()),
        count => say!("one of {count} {} topics", kind.type_name()),
    };
    let binding = |topic: &&Topic| Binding::of(kind, topic, &why);
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
        ([topic], _) => Ok(Binding::of(kind, topic, word!("named by the machine file"))),
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

/// The topic of a field that a machine file names.
///
/// # Errors
/// The log has no such topic; the error lists the existing ones.
pub fn topic_of_field<'l>(log: &'l Log, name: &str, field: &str) -> Result<&'l Topic, Error> {
    let topics = log.topics();
    topics
        .iter()
        .find(|topic| topic.name == name)
        .ok_or_else(|| {
            Error::from(BindingError::NoTopicOfField {
                named: name.to_owned(),
                field: field.to_owned(),
                available: topics.iter().map(|topic| topic.name.clone()).collect(),
            })
        })
}
