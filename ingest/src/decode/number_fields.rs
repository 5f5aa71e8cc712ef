//! Lists the numbers in the messages of a topic, to help find a signal.

use super::{
    json,
    path_collector::{Collector, MOST_PATHS},
    protobuf,
};
use crate::message::Topic;

/// Paths of the single numbers in a topic's messages, without the header, in the order of the
/// definition. Empty if the topic has no ROS definition.
pub fn number_fields(topic: &Topic) -> Vec<String> {
    Collector::of_ros(topic, false).found
}

/// Paths of numbers, some of which a message may not have.
#[derive(Debug, Default)]
pub(crate) struct NumberPaths {
    pub(crate) paths: Vec<String>,
    /// Whether there are more paths than those listed.
    pub(crate) is_cut: bool,
}

/// Paths of the numbers in a topic's messages, also of those in arrays, in any encoding. JSON has no definition: one
/// message must do.
pub(crate) fn number_paths(topic: &Topic, message: &[u8]) -> NumberPaths {
    let mut collector = match topic.encoding.as_str() {
        "json" => Collector::with(|found| json::number_paths(message, found)),
        "protobuf" => {
            let set = topic.descriptors.as_deref().unwrap_or_default();
            Collector::with(|found| protobuf::number_paths(set, &topic.type_name, found))
        }
        _ => Collector::of_ros(topic, true),
    };
    let is_cut = collector.found.len() > MOST_PATHS;
    collector.found.truncate(MOST_PATHS);
    NumberPaths {
        paths: collector.found,
        is_cut,
    }
}

#[cfg(test)]
mod tests {
    use super::{super::path_collector::MOST_FIELDS, *};
    use crate::message::{DefinitionSource, TopicId};

    #[test]
    fn single_numbers_are_listed_and_recursion_ends() {
        let topic = |definition: &str| Topic {
            id: TopicId(0),
            name: "/t".into(),
            type_name: "p/T".into(),
            encoding: "cdr".into(),
            schema_encoding: "ros2msg".into(),
            definition: Some(definition.into()),
            descriptors: None,
            definition_source: DefinitionSource::Embedded,
            message_count: None,
            writers: Vec::new(),
        };
        let plain = "std_msgs/Header header\nfloat64 a\nstring s\nV v\nint8[2] n\nfloat32[] list\n\
            ===\nMSG: p/V\nfloat64 x\nfloat64 y\n";
        let found = number_fields(&topic(plain));
        assert_eq!(found, ["a", "v.x", "v.y", "n[0]", "n[1]"]);
        let endless = "T t\nT u\nfloat64 a\nfloat64[4000000000] b\n";
        assert!(number_fields(&topic(endless)).len() <= MOST_FIELDS);
        assert!(number_fields(&topic("no definition at all")).is_empty());
    }
}
