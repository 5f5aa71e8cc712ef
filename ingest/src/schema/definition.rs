//! Parses the text that defines a message type and the types nested in it.
//!
//! Recorders embed the fields of the message, then for each nested type a line of `=` signs, a line
//! `MSG: package/Type` and its fields.

use std::collections::HashMap;

use super::{
    builtin,
    error::SchemaError,
    idl,
    types::{Dialect, Field, FieldType, NumberType, Repetition, normal_type_name},
};

/// The name of OMG IDL as a language of definitions.
pub(crate) const IDL: &str = "ros2idl";

/// The fields of a message type and of all types nested in it.
#[derive(Debug)]
pub(crate) struct Definitions {
    pub(crate) root: String,
    pub(crate) dialect: Dialect,
    types: HashMap<String, Vec<Field>>,
}

impl Definitions {
    /// Parses a definition in the language that a log states.
    pub(crate) fn of_language(
        language: &str,
        text: &str,
        type_name: &str,
        dialect: Dialect,
    ) -> Result<Self, SchemaError> {
        if language != IDL {
            return Self::parse(text, type_name, dialect);
        }
        let mut definitions = Self {
            root: normal_type_name(type_name),
            dialect,
            types: idl::parse(text, type_name)?,
        };
        if !definitions.types.contains_key(&definitions.root) {
            return Err(SchemaError::Line {
                type_name: type_name.to_owned(),
                line: text.lines().count(),
                found: "the end, without this structure".to_owned(),
            });
        }
        definitions.add_common_parts();
        definitions.check_parts()?;
        Ok(definitions)
    }

    pub(crate) fn parse(
        text: &str,
        type_name: &str,
        dialect: Dialect,
    ) -> Result<Self, SchemaError> {
        let root = normal_type_name(type_name);
        let mut types: HashMap<String, Vec<Field>> = HashMap::new();
        let mut current = root.clone();
        types.insert(root.clone(), Vec::new());
        for (index, line) in text.lines().enumerate() {
            if is_separator(line) {
                continue;
            }
            if let Some(name) = line.trim().strip_prefix("MSG:") {
                current = normal_type_name(name.trim());
                types.insert(current.clone(), Vec::new());
                continue;
            }
            let parsed = parse_line(line, &current, dialect).ok_or_else(|| SchemaError::Line {
                type_name: type_name.to_owned(),
                line: index + 1,
                found: line.chars().take(80).collect(),
            })?;
            if let Some(field) = parsed {
                types.entry(current.clone()).or_default().push(field);
            }
        }
        let mut definitions = Self {
            root,
            dialect,
            types,
        };
        definitions.add_common_parts();
        definitions.check_parts()?;
        Ok(definitions)
    }

    pub(crate) fn fields(&self, type_name: &str) -> &[Field] {
        self.types
            .get(type_name)
            .map(Vec::as_slice)
            .unwrap_or_default()
    }

    /// Some recorders omit the definitions of the most common nested types.
    fn add_common_parts(&mut self) {
        loop {
            let missing: Vec<String> = self
                .types
                .values()
                .flatten()
                .filter_map(|field| match &field.field_type {
                    FieldType::Message(name) if !self.types.contains_key(name) => Some(name),
                    _ => None,
                })
                .filter(|name| builtin::fields(name, self.dialect).is_some())
                .cloned()
                .collect();
            if missing.is_empty() {
                return;
            }
            for name in missing {
                let lines = builtin::fields(&name, self.dialect)
                    .unwrap_or_default()
                    .lines();
                let fields = lines
                    .filter_map(|line| parse_line(line, &name, self.dialect).flatten())
                    .collect();
                self.types.insert(name, fields);
            }
        }
    }

    fn check_parts(&self) -> Result<(), SchemaError> {
        for (type_name, fields) in &self.types {
            for field in fields {
                if let FieldType::Message(part) = &field.field_type
                    && !self.types.contains_key(part)
                {
                    return Err(SchemaError::UndefinedType {
                        type_name: type_name.clone(),
                        field: field.name.clone(),
                        part: part.clone(),
                    });
                }
            }
        }
        Ok(())
    }
}

/// The types of the fields of a definition that are messages themselves, as far as its lines can be read.
pub(super) fn part_types(text: &str, type_name: &str, dialect: Dialect) -> Vec<String> {
    let fields = text
        .lines()
        .filter_map(|line| parse_line(line, type_name, dialect)?);
    let parts = fields.filter_map(|field| match field.field_type {
        FieldType::Message(part) => Some(part),
        _ => None,
    });
    parts.collect()
}

/// The lines of a definition without comments and blank lines.
pub(crate) fn significant_lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines()
        .map(|line| without_comment(line).trim())
        .filter(|line| !line.is_empty())
}

fn is_separator(line: &str) -> bool {
    let line = line.trim();
    line.len() >= 3 && line.bytes().all(|byte| byte == b'=')
}

/// The line up to a `#` outside quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (None, '#') => return &line[..at],
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), _) if open == c => quote = None,
            _ => {}
        }
    }
    // An apostrophe in a comment opens no quotes, because the comment begins before it. An unclosed
    // quote belongs to a default value or constant, which is not needed.
    line
}

/// `Some(None)` for a line without a field, `None` for an invalid line.
fn parse_line(line: &str, current: &str, dialect: Dialect) -> Option<Option<Field>> {
    let line = without_comment(line).trim();
    if line.is_empty() {
        return Some(None);
    }
    let (type_text, rest) = line.split_once(char::is_whitespace)?;
    let rest = rest.trim_start();
    let name_end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    let (name, after) = rest.split_at(name_end.unwrap_or(rest.len()));
    if name.is_empty() {
        return None;
    }
    if after.trim_start().starts_with('=') {
        // A constant is not part of the encoded message.
        return Some(None);
    }
    if !after.is_empty() && !after.starts_with(char::is_whitespace) {
        return None;
    }
    let (element, repetition) = parse_repetition(type_text)?;
    let field_type = parse_type(element, current, dialect)?;
    Some(Some(Field {
        name: name.to_owned(),
        field_type,
        repetition,
    }))
}

fn parse_repetition(type_text: &str) -> Option<(&str, Repetition)> {
    let Some(open) = type_text.find('[') else {
        return Some((type_text, Repetition::Once));
    };
    let (element, brackets) = type_text.split_at(open);
    let inner = brackets.strip_prefix('[')?.strip_suffix(']')?;
    if inner.is_empty() {
        return Some((element, Repetition::Sequence));
    }
    if let Some(bound) = inner.strip_prefix("<=") {
        bound.parse::<u32>().ok()?;
        return Some((element, Repetition::Sequence));
    }
    let count = inner.parse::<u32>().ok().filter(|&count| count > 0)?;
    Some((element, Repetition::Fixed(count)))
}

fn parse_type(element: &str, current: &str, dialect: Dialect) -> Option<FieldType> {
    // A bound on a string does not change its encoding.
    let bare = element.split_once("<=").map_or(element, |(bare, _)| bare);
    Some(match bare {
        "string" => FieldType::Text,
        "wstring" => FieldType::WideText,
        "time" => FieldType::Message("builtin_interfaces/Time".to_owned()),
        "duration" => FieldType::Message("builtin_interfaces/Duration".to_owned()),
        _ => match NumberType::from_name(bare, dialect) {
            Some(number) => FieldType::Number(number),
            None => FieldType::Message(full_type_name(bare, current)?),
        },
    })
}

/// A name without a package belongs to the package that uses it.
fn full_type_name(name: &str, current: &str) -> Option<String> {
    let is_name = |part: &str| {
        part.starts_with(|c: char| c.is_ascii_alphabetic())
            && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    if !name.split('/').all(is_name) {
        return None;
    }
    if name.contains('/') {
        return Some(normal_type_name(name));
    }
    if name == "Header" {
        return Some("std_msgs/Header".to_owned());
    }
    let package = current.split('/').next().unwrap_or_default();
    Some(format!("{package}/{name}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_line_is_parsed() {
        let text = "# a comment that doesn't end\n\
            string<=5 a \"x # y\" # c\nfloat64[<=3] b\nuint8 MAX=5\nstring NAME = a # b\n\
            int32[2] c [1, 2]\nPart[] d\nother/msg/Thing e\nHeader f\nbyte g\n\
            ==========\nMSG: pkg/Part\nwstring h\n===\nMSG: other/Thing\nbool i\n";
        let definitions = Definitions::parse(text, "pkg/msg/Root", Dialect::Ros2).unwrap();
        let names: Vec<_> = definitions
            .fields("pkg/Root")
            .iter()
            .map(|field| field.name.as_str())
            .collect();
        assert_eq!(names, ["a", "b", "c", "d", "e", "f", "g"]);
        assert_eq!(
            definitions.fields("pkg/Root")[2].repetition,
            Repetition::Fixed(2)
        );
        assert_eq!(
            definitions.fields("pkg/Part")[0].field_type,
            FieldType::WideText
        );
        assert_eq!(definitions.fields("builtin_interfaces/Time").len(), 2);
    }

    #[test]
    fn invalid_line_is_reported_by_number() {
        let error =
            Definitions::parse("float64 x\nfloat64[] \n", "a/B", Dialect::Ros2).unwrap_err();
        assert!(error.to_string().contains("line 2"), "{error}");
        let error = Definitions::parse("Nothing x", "a/B", Dialect::Ros2).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a/B.x: the definition of its type a/Nothing is missing"
        );
    }

    #[test]
    fn builtin_definitions_are_sorted_and_complete() {
        assert!(builtin::DEFINITIONS.is_sorted_by_key(|(name, _)| name));
        for (name, _) in builtin::DEFINITIONS {
            for dialect in [Dialect::Ros2, Dialect::Ros1] {
                let text = builtin::definition(name, dialect).unwrap();
                Definitions::parse(&text, name, dialect).unwrap();
            }
        }
    }
}
