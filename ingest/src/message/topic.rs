//! The topics of a log.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::schema::{Dialect, GivenDefinitions, builtin, significant_lines};

/// Identifies one topic of one log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct TopicId(pub(crate) usize);

impl TopicId {
    /// The index of the topic in [`Log::topics`](crate::Log::topics).
    pub fn index(self) -> usize {
        self.0
    }
}

/// Source of the definition of a message type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DefinitionSource {
    /// The definition was recorded in the log.
    Embedded,
    /// The log has no definition; it was read from a folder that a person named.
    Given,
    /// The log has none; the built-in definition of that type is used.
    BuiltIn,
    /// The log has none, nobody gave one, and the type is not built in.
    Missing,
}

/// One topic: all messages of one name and one type.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Topic {
    /// Identifies the topic within its log.
    pub id: TopicId,
    /// Name as recorded, such as `/imu/data`.
    pub name: String,
    /// Type as recorded, such as `sensor_msgs/msg/Imu`; empty if the log names none.
    pub type_name: String,
    /// Encoding of the messages, such as `cdr`.
    pub encoding: String,
    /// The language of the definition, such as `ros2msg`.
    pub schema_encoding: String,
    /// The definition of the message type, including nested types.
    pub definition: Option<String>,
    /// The `FileDescriptorSet` that defines a protobuf message.
    #[serde(skip)]
    pub descriptors: Option<Vec<u8>>,
    /// Source of the definition.
    pub definition_source: DefinitionSource,
    /// The number of messages; `None` if only reading the whole log can count them.
    pub message_count: Option<u64>,
    /// Records of the log about the topic's writers, one entry for each that differs. Empty for formats that record nothing.
    #[serde(skip)]
    pub writers: Vec<TopicWriter>,
}

/// Record of a log about one writer of a topic.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TopicWriter {
    /// Keys and values, such as its quality of service.
    pub says: BTreeMap<String, String>,
    /// The definition of its messages; `None` if nothing was recorded, not even an empty one.
    pub(crate) schema: Option<RecordedSchema>,
}

/// A definition byte by byte as the log has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RecordedSchema {
    pub(crate) encoding: String,
    pub(crate) data: Vec<u8>,
}

/// A topic before it has an id.
pub(crate) struct TopicDescription<'a> {
    pub(crate) name: &'a str,
    pub(crate) type_name: &'a str,
    pub(crate) encoding: &'a str,
    pub(crate) schema_encoding: &'a str,
    pub(crate) definition: Option<&'a [u8]>,
}

/// The topics of all files of a log.
#[derive(Default)]
pub(crate) struct TopicTable {
    topics: Vec<Topic>,
    given: GivenDefinitions,
}

impl TopicTable {
    /// A table whose topics take definitions that the log lacks from folders.
    pub(crate) fn new(given: GivenDefinitions) -> Self {
        Self {
            topics: Vec::new(),
            given,
        }
    }

    /// The id of the topic: an existing one if name, type and definition agree.
    pub(crate) fn register(&mut self, description: &TopicDescription<'_>) -> TopicId {
        let new = self.topic(description);
        let known = self.topics.iter().find(|topic| is_same(topic, &new));
        if let Some(topic) = known {
            return topic.id;
        }
        let id = new.id;
        self.topics.push(new);
        id
    }

    /// Registers the topic for one of its writers, with the log's record of the writer; also returns the writer's index in
    /// [`Topic::writers`].
    pub(crate) fn register_writer(
        &mut self,
        description: &TopicDescription<'_>,
        says: &BTreeMap<String, String>,
    ) -> (TopicId, u32) {
        let id = self.register(description);
        let Some(topic) = self.topics.get_mut(id.0) else {
            return (id, 0);
        };
        let writer = TopicWriter {
            says: says.clone(),
            schema: description.definition.map(|data| RecordedSchema {
                encoding: description.schema_encoding.to_owned(),
                data: data.to_vec(),
            }),
        };
        let known = topic.writers.iter().position(|known| *known == writer);
        let index = known.unwrap_or_else(|| {
            topic.writers.push(writer);
            topic.writers.len() - 1
        });
        (id, index as u32)
    }

    /// Adds the message count of one channel or file; an unknown count makes the sum unknown.
    pub(crate) fn add_messages(&mut self, id: TopicId, count: Option<u64>) {
        if let Some(topic) = self.topics.get_mut(id.0) {
            let sum = topic.message_count.zip(count);
            topic.message_count = sum.map(|(known, more)| known.saturating_add(more));
        }
    }

    pub(crate) fn into_topics(self) -> Vec<Topic> {
        self.topics
    }

    fn topic(&self, description: &TopicDescription<'_>) -> Topic {
        let is_text = description.schema_encoding != "protobuf";
        let descriptors = description
            .definition
            .filter(|bytes| !is_text && !bytes.is_empty());
        let embedded = description
            .definition
            .filter(|_| is_text)
            .map(String::from_utf8_lossy)
            .filter(|text| !text.trim().is_empty());
        let dialect = Dialect::of_encoding(description.encoding);
        let type_name = description.type_name;
        let of_others = dialect.filter(|_| embedded.is_none());
        let given = of_others.and_then(|dialect| self.given.definition(type_name, dialect));
        let built_in = || of_others.and_then(|dialect| builtin::definition(type_name, dialect));
        let (definition, source) = match (embedded, given) {
            (Some(embedded), _) => (Some(embedded.into_owned()), DefinitionSource::Embedded),
            (None, Some(given)) => (Some(given), DefinitionSource::Given),
            (None, None) if descriptors.is_some() => (None, DefinitionSource::Embedded),
            (None, None) => match built_in() {
                Some(built_in) => (Some(built_in), DefinitionSource::BuiltIn),
                None => (None, DefinitionSource::Missing),
            },
        };
        let schema_encoding = match (source, dialect) {
            (DefinitionSource::BuiltIn | DefinitionSource::Given, Some(Dialect::Ros1)) => "ros1msg",
            (DefinitionSource::BuiltIn | DefinitionSource::Given, _) => "ros2msg",
            _ => description.schema_encoding,
        };
        Topic {
            id: TopicId(self.topics.len()),
            name: description.name.to_owned(),
            type_name: description.type_name.to_owned(),
            encoding: description.encoding.to_owned(),
            schema_encoding: schema_encoding.to_owned(),
            definition,
            descriptors: descriptors.map(<[u8]>::to_vec),
            definition_source: source,
            message_count: Some(0),
            writers: Vec::new(),
        }
    }
}

fn is_same(left: &Topic, right: &Topic) -> bool {
    left.name == right.name
        && left.type_name == right.type_name
        && left.encoding == right.encoding
        && left.schema_encoding == right.schema_encoding
        && left.descriptors == right.descriptors
        && same_definition(left.definition.as_deref(), right.definition.as_deref())
}

/// Recorders of different versions write the same fields with different comments.
fn same_definition(left: Option<&str>, right: Option<&str>) -> bool {
    match (left, right) {
        (Some(left), Some(right)) => {
            left == right || significant_lines(left).eq(significant_lines(right))
        }
        (left, right) => left == right,
    }
}
