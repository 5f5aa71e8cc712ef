//! Errors of TOML files with the path of the key that they are about, and numbers that no key takes.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// Returns the message of an error of this text: the path of its key, line and column, the line itself, and the error.
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
        let path = path_of_key(above, key.get_ref());
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

/// The first number that is NaN or infinite, and the path of its key; keys below `except` may hold such numbers. A text that is no TOML is
/// refused where it is read.
pub(super) fn not_finite(text: &str, except: &str) -> Option<(String, String)> {
    let document = DeTable::parse(text).ok()?;
    not_finite_in_table(document.get_ref(), "", except)
}

fn not_finite_in_table(table: &DeTable<'_>, above: &str, except: &str) -> Option<(String, String)> {
    table.iter().find_map(|(key, value)| {
        let path = path_of_key(above, key.get_ref());
        not_finite_in_value(value.get_ref(), &path, except)
    })
}

fn not_finite_in_value(value: &DeValue<'_>, path: &str, except: &str) -> Option<(String, String)> {
    match value {
        _ if path == except => None,
        // a decimal beyond the largest number is infinite, too
        DeValue::Float(float) => {
            let written = float.as_str();
            let is_finite = written.parse().is_ok_and(f64::is_finite);
            (!is_finite).then(|| (path.into(), written.into()))
        }
        DeValue::Table(table) => not_finite_in_table(table, path, except),
        DeValue::Array(values) => values.iter().enumerate().find_map(|(index, value)| {
            not_finite_in_value(value.get_ref(), &format!("{path}[{index}]"), except)
        }),
        _ => None,
    }
}

fn path_of_key(above: &str, key: &str) -> String {
    let name = quoted_if_needed(key);
    match above {
        "" => name,
        above => format!("{above}.{name}"),
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
