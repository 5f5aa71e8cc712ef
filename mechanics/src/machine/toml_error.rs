//! Errors of TOML files with the path of the key that they are about.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// The message of an error of this text: the path of its key, line and column, the line itself, and what is wrong.
#[must_use]
pub fn explained(text: &str, error: &toml::de::Error) -> String {
    let message = without_type_names(error.to_string().trim_end());
    let path = error.span().and_then(|span| path_at(text, &span));
    match path {
        Some(path) => format!("{path}: {message}"),
        None => message,
    }
}

/// The path of the innermost key whose name or value holds the beginning of the place.
fn path_at(text: &str, place: &Range<usize>) -> Option<String> {
    let document = DeTable::parse(text).ok()?;
    let mut found = None;
    in_table(document.get_ref(), "", place.start, &mut found);
    found
}

fn in_table(table: &DeTable<'_>, above: &str, at: usize, found: &mut Option<String>) {
    for (key, value) in table {
        let name = quoted_if_needed(key.get_ref());
        let path = match above {
            "" => name,
            above => format!("{above}.{name}"),
        };
        // what is inside is found after, and replaces it
        if key.span().contains(&at) || value.span().contains(&at) {
            *found = Some(path.clone());
        }
        in_value(value.get_ref(), &path, at, found);
    }
}

fn in_value(value: &DeValue<'_>, path: &str, at: usize, found: &mut Option<String>) {
    match value {
        DeValue::Table(table) => in_table(table, path, at, found),
        DeValue::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                let path = format!("{path}[{index}]");
                if value.span().contains(&at) {
                    *found = Some(path.clone());
                }
                in_value(value.get_ref(), &path, at, found);
            }
        }
        _ => {}
    }
}

fn quoted_if_needed(key: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    match !key.is_empty() && key.chars().all(is_bare) {
        true => key.into(),
        false => format!("\"{key}\""),
    }
}

/// Names of types of the program mean nothing to a reader.
fn without_type_names(message: &str) -> String {
    let mut kept = String::new();
    let mut rest = message;
    while let Some((before, after)) = rest.split_once("expected struct ") {
        kept += before;
        kept += "expected a table";
        rest = after.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_');
    }
    kept + rest
}
