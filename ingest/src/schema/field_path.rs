//! Paths to fields of a message.

use std::{fmt, str::FromStr};

use super::error::SchemaError;

/// The path to a field, such as `linear_acceleration.x`, `position[]` (all of an array),
/// `position[3]` (one element), `transforms[].transform.translation.x` (one value from each
/// message of an array) or `matrix[1][2]` (one element of a list of lists, as JSON has them).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct FieldPath {
    pub(crate) steps: Vec<PathStep>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct PathStep {
    /// Empty for the elements of a list that is itself an element.
    pub(crate) name: String,
    pub(crate) elements: Elements,
}

/// Elements of a field that a step selects.
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
        let mut steps = Vec::new();
        for field in text.split('.') {
            add_steps(field, &mut steps).ok_or_else(|| SchemaError::BadPath {
                path: text.to_owned(),
            })?;
        }
        Ok(Self { steps })
    }
}

/// Adds the step of a field, and one for each list that is an element of another.
fn add_steps(text: &str, steps: &mut Vec<PathStep>) -> Option<()> {
    let (name, lists) = text.split_at(text.find('[').unwrap_or(text.len()));
    let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_name {
        return None;
    }
    let mut step = |name: &str, elements| {
        steps.push(PathStep {
            name: name.to_owned(),
            elements,
        });
    };
    if lists.is_empty() {
        step(name, Elements::None);
        return Some(());
    }
    let lists = lists.strip_prefix('[')?.strip_suffix(']')?;
    for (depth, index) in lists.split("][").enumerate() {
        let elements = match index {
            "" => Elements::All,
            index => Elements::At(index.parse().ok()?),
        };
        step(if depth == 0 { name } else { "" }, elements);
    }
    Some(())
}

impl fmt::Display for FieldPath {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, step) in self.steps.iter().enumerate() {
            let is_inside = index == 0 || step.name.is_empty();
            let dot = if is_inside { "" } else { "." };
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
            "matrix[1][2]",
            "a.b[0][][3].c",
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
            "[0]",
            "a[0]b",
            "a[0]b[1]",
            "a[0][",
            "a[0]]",
            "a[[0]",
        ] {
            assert!(text.parse::<FieldPath>().is_err(), "{text}");
        }
    }
}
