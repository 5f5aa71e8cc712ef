//! Paths to fields of a message.

use std::{fmt, str::FromStr};

use super::error::SchemaError;

/// The path to a field, such as `linear_acceleration.x`, `position[]` (all of an array),
/// `position[3]` (one element) or `transforms[].transform.translation.x` (one value from each
/// message of an array).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct FieldPath {
    pub(crate) steps: Vec<PathStep>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct PathStep {
    pub(crate) name: String,
    pub(crate) elements: Elements,
}

/// Which elements of a field a step selects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Elements {
    /// The field is not an array.
    None,
    All,
    At(u32),
}

impl FromStr for FieldPath {
    type Err = SchemaError;

    fn from_str(text: &str) -> Result<Self, SchemaError> {
        let steps: Option<Vec<PathStep>> = text.split('.').map(parse_step).collect();
        let steps = steps.ok_or_else(|| SchemaError::BadPath {
            path: text.to_owned(),
        })?;
        Ok(Self { steps })
    }
}

fn parse_step(text: &str) -> Option<PathStep> {
    let (name, elements) = match text.strip_suffix(']').map(|open| open.split_once('[')) {
        None => (text, Elements::None),
        Some(None) => return None,
        Some(Some((name, ""))) => (name, Elements::All),
        Some(Some((name, index))) => (name, Elements::At(index.parse().ok()?)),
    };
    let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    is_name.then(|| PathStep {
        name: name.to_owned(),
        elements,
    })
}

impl fmt::Display for FieldPath {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, step) in self.steps.iter().enumerate() {
            let dot = if index == 0 { "" } else { "." };
            write!(formatter, "{dot}{}", step.name)?;
            match step.elements {
                Elements::None => {}
                Elements::All => write!(formatter, "[]")?,
                Elements::At(index) => write!(formatter, "[{index}]")?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_written_as_they_are_read() {
        for text in [
            "a",
            "a.b_2.c",
            "position[]",
            "position[3]",
            "transforms[].header.frame_id",
        ] {
            assert_eq!(text.parse::<FieldPath>().unwrap().to_string(), text);
        }
        for text in [
            "",
            ".",
            "a.",
            "a[",
            "a]",
            "a[-1]",
            "a[b]",
            "a[99999999999]",
            "a b",
        ] {
            assert!(text.parse::<FieldPath>().is_err(), "{text}");
        }
    }
}
