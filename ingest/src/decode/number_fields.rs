//! Lists the numbers in the messages of a topic, to help find a signal.

use crate::{
    message::Topic,
    schema::{Definitions, Dialect, FieldType, Repetition},
};

/// Most fields listed.
const MOST_FIELDS: usize = 500;
const MAX_DEPTH: usize = 8;

/// Paths of the single numbers in a topic's messages, without the header, in the order of the
/// definition. Empty if the topic has no ROS definition.
pub fn number_fields(topic: &Topic) -> Vec<String> {
    let Some((definition, dialect)) =
        (topic.definition.as_deref()).zip(Dialect::of_encoding(&topic.encoding))
    else {
        return Vec::new();
    };
    let mut found = Vec::new();
    if let Ok(definitions) = Definitions::parse(definition, &topic.type_name, dialect) {
        collect(&definitions, &definitions.root, "", 0, &mut found);
    }
    found
}

fn collect(
    definitions: &Definitions,
    type_name: &str,
    prefix: &str,
    depth: usize,
    found: &mut Vec<String>,
) {
    for field in definitions.fields(type_name) {
        let path = format!("{prefix}{}", field.name);
        if found.len() >= MOST_FIELDS || depth > MAX_DEPTH || path == "header" {
            continue;
        }
        match (&field.field_type, field.repetition) {
            (FieldType::Number(_), Repetition::Once) => found.push(path),
            (FieldType::Number(_), Repetition::Fixed(count)) => {
                let room = MOST_FIELDS - found.len();
                let elements = (0..count as usize).take(room);
                found.extend(elements.map(|i| format!("{path}[{i}]")));
            }
            (FieldType::Message(part), Repetition::Once) => {
                collect(definitions, part, &format!("{path}."), depth + 1, found);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
