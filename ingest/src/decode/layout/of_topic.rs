//! The layout of a topic's messages, for any supported encoding.

use super::Layout;
use crate::{
    message::{BindingError, DefinitionSource, Topic},
    schema::{Definitions, Dialect, FieldPath, IDL, SchemaError},
};

impl Layout {
    /// The layout for some fields of a topic's messages, by the embedded definition or else the
    /// built-in one.
    ///
    /// # Errors
    /// The encoding or the schema language is unsupported, there is no definition, or a path does
    /// not exist.
    pub fn of_topic(topic: &Topic, paths: &[FieldPath]) -> Result<Layout, BindingError> {
        let schema = |source: SchemaError| BindingError::Schema {
            topic: topic.name.clone(),
            source,
        };
        match topic.encoding.as_str() {
            "cdr" => definitions(topic, &["ros2msg", IDL], Dialect::Ros2)?
                .and_then(|definitions| Self::of_definitions(&definitions, paths)),
            "ros1" => definitions(topic, &["ros1msg"], Dialect::Ros1)?
                .and_then(|definitions| Self::of_definitions(&definitions, paths)),
            "json" => Self::json(paths),
            "protobuf" => {
                let descriptors = topic.descriptors.as_ref();
                let descriptors = descriptors.ok_or_else(|| no_definition(topic))?;
                Self::protobuf(descriptors, &topic.type_name, paths)
            }
            other => return Err(unsupported(topic, other)),
        }
        .map_err(schema)
    }
}

/// The definition of a topic, in one of these languages.
fn definitions(
    topic: &Topic,
    languages: &[&str],
    dialect: Dialect,
) -> Result<Result<Definitions, SchemaError>, BindingError> {
    let language = topic.schema_encoding.as_str();
    let is_missing = topic.definition_source == DefinitionSource::Missing;
    if !is_missing && !languages.contains(&language) {
        return Err(unsupported(topic, language));
    }
    let text = topic.definition.as_deref();
    let text = text.ok_or_else(|| no_definition(topic))?;
    Ok(Definitions::of_language(
        language,
        text,
        &topic.type_name,
        dialect,
    ))
}

fn no_definition(topic: &Topic) -> BindingError {
    BindingError::NoDefinition {
        topic: topic.name.clone(),
        type_name: topic.type_name.clone(),
    }
}

fn unsupported(topic: &Topic, encoding: &str) -> BindingError {
    BindingError::Unsupported {
        topic: topic.name.clone(),
        encoding: encoding.to_owned(),
    }
}

/// The layout for fields given as text.
pub(crate) fn layout_of(topic: &Topic, paths: &[&str]) -> Result<Layout, BindingError> {
    let paths: Result<Vec<FieldPath>, _> = paths.iter().map(|path| path.parse()).collect();
    let paths = paths.map_err(|source| BindingError::Schema {
        topic: topic.name.clone(),
        source,
    })?;
    Layout::of_topic(topic, &paths)
}
