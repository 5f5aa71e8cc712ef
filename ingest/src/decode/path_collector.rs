//! Collects the paths of the numbers in messages.

use crate::{
    message::Topic,
    schema::{Definitions, Dialect, FieldType, Repetition},
};

/// Most fields listed.
pub(crate) const MOST_FIELDS: usize = 500;
/// Most paths tried, of which a message has only some: the lengths of its arrays are not known before.
pub(super) const MOST_PATHS: usize = 8 * MOST_FIELDS;
const MAX_DEPTH: usize = 8;
/// Elements that are looked for in an array whose length only a message states.
const MOST_NUMBERS: u32 = 64;
/// Elements that are looked for in an array of messages whose length only a message states.
pub(super) const MOST_PARTS: u32 = 8;

/// Collects paths.
#[derive(Default)]
pub(super) struct Collector {
    pub(super) found: Vec<String>,
    has_arrays: bool,
}

impl Collector {
    pub(super) fn with(collect: impl FnOnce(&mut Self)) -> Self {
        let mut collector = Self {
            has_arrays: true,
            ..Self::default()
        };
        collect(&mut collector);
        collector
    }

    /// Whether no more paths are collected: there are too many, or they are nested too deeply.
    pub(super) fn is_full(&self, depth: usize) -> bool {
        self.found.len() > MOST_PATHS || depth > MAX_DEPTH
    }

    pub(super) fn number(&mut self, path: String) {
        self.found.push(path);
    }

    /// The numbers of an array.
    pub(super) fn numbers(&mut self, path: &str, count: Option<u32>) {
        let room = (MOST_PATHS + 1).saturating_sub(self.found.len());
        let count = count.unwrap_or(MOST_NUMBERS);
        let elements = (0..count).take(room);
        self.found.extend(elements.map(|i| format!("{path}[{i}]")));
    }

    /// Paths before the fields of each message in an array.
    pub(super) fn parts(path: &str, count: Option<u32>) -> impl Iterator<Item = String> {
        let count = count.unwrap_or(MOST_PARTS).min(MOST_PARTS);
        (0..count).map(move |i| format!("{path}[{i}]."))
    }

    pub(super) fn of_ros(topic: &Topic, has_arrays: bool) -> Self {
        let mut collector = Self {
            has_arrays,
            ..Self::default()
        };
        let dialect = Dialect::of_encoding(&topic.encoding);
        if let Some((definition, dialect)) = topic.definition.as_deref().zip(dialect)
            && let Ok(definitions) = Definitions::of_language(
                &topic.schema_encoding,
                definition,
                &topic.type_name,
                dialect,
            )
        {
            collector.collect(&definitions, &definitions.root, "", 0);
        }
        if !has_arrays {
            collector.found.truncate(MOST_FIELDS);
        }
        collector
    }

    fn collect(&mut self, definitions: &Definitions, type_name: &str, prefix: &str, depth: usize) {
        for field in definitions.fields(type_name) {
            let path = format!("{prefix}{}", field.name);
            if self.is_full(depth) || path == "header" {
                continue;
            }
            match (&field.field_type, field.repetition) {
                (FieldType::Number(_), Repetition::Once) => self.number(path),
                (FieldType::Number(_), Repetition::Fixed(count)) => {
                    self.numbers(&path, Some(count));
                }
                (FieldType::Number(_), Repetition::Sequence) if self.has_arrays => {
                    self.numbers(&path, None);
                }
                (FieldType::Message(part), Repetition::Once) => {
                    self.collect(definitions, part, &format!("{path}."), depth + 1);
                }
                (FieldType::Message(part), repetition) if self.has_arrays => {
                    let count = match repetition {
                        Repetition::Fixed(count) => Some(count),
                        _ => None,
                    };
                    for prefix in Self::parts(&path, count) {
                        self.collect(definitions, part, &prefix, depth + 1);
                    }
                }
                _ => {}
            }
        }
    }
}
