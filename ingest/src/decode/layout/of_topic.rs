//! The layout of a topic's messages, whatever their encoding.

use super::Layout;
use crate::{
    message::{BindingError, DefinitionSource, Topic},
    schema::{Dialect, FieldPath, SchemaError},
};

impl Layout {
    /// Works out how to read fields of a topic's messages, by the definition that the log carries
    /// or by the common one of that name.
    ///
    /// # Errors
    /// The encoding or the language of the definition is not read, there is no definition, or a
    /// path leads nowhere.
    pub fn of_topic(topic: &Topic, paths: &[FieldPath]) -> Result<Layout, BindingError> {
        let schema = |source: SchemaError| BindingError::Schema {
            topic: topic.name.clone(),
            source,
        };
        match topic.encoding.as_str() {
            "cdr" => {
                let definition = definition(topic, "ros2msg")?;
                Self::compile_dialect(definition, &topic.type_name, Dialect::Ros2, paths)
            }
            "ros1" => {
                let definition = definition(topic, "ros1msg")?;
                Self::compile_dialect(definition, &topic.type_name, Dialect::Ros1, paths)
            }
            "json" => Self::json(paths),
            "protobuf" => {
                let descriptors = topic.descriptors.as_ref();
                let descriptors = descriptors.ok_or_else(|| no_definition(topic))?;
                Self::protobuf(descriptors, &topic.type_name, paths)
            }
            other => return Err(not_read_yet(topic, other)),
        }
        .map_err(schema)
    }
}

fn definition<'t>(topic: &'t Topic, language: &str) -> Result<&'t str, BindingError> {
    let is_missing = topic.definition_source == DefinitionSource::Missing;
    if !is_missing && topic.schema_encoding != language {
        return Err(not_read_yet(topic, &topic.schema_encoding));
    }
    let definition = topic.definition.as_deref();
    definition.ok_or_else(|| no_definition(topic))
}

fn no_definition(topic: &Topic) -> BindingError {
    BindingError::NoDefinition {
        topic: topic.name.clone(),
        type_name: topic.type_name.clone(),
    }
}

fn not_read_yet(topic: &Topic, encoding: &str) -> BindingError {
    BindingError::NotReadYet {
        topic: topic.name.clone(),
        encoding: encoding.to_owned(),
    }
}

/// The steps that read some fields of a topic's messages; an error if they cannot be read at all.
pub(crate) fn layout_of(topic: &Topic, paths: &[&str]) -> Result<Layout, BindingError> {
    let paths: Result<Vec<FieldPath>, _> = paths.iter().map(|path| path.parse()).collect();
    let paths = paths.map_err(|source| BindingError::Schema {
        topic: topic.name.clone(),
        source,
    })?;
    Layout::of_topic(topic, &paths)
}
