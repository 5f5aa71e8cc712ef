//! Differences between two versions of an output: by key of a document, by column of a table, else by byte.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::tables::parquet;
use crate::tables::table::Column;

/// Differences that are named; the rest is counted.
const MOST_NAMED: usize = 5;

/// Describes the difference of the second file from the first in a sentence; `None` if both have the same bytes.
///
/// # Errors
/// A file cannot be read.
pub fn between(first: &Path, second: &Path) -> Result<Option<String>> {
    let read =
        |path: &Path| fs::read(path).with_context(|| format!("{}: cannot be read", path.display()));
    let (a, b) = (read(first)?, read(second)?);
    if a == b {
        return Ok(None);
    }
    let kind = first.extension().and_then(|extension| extension.to_str());
    let named = match kind {
        Some("json") => keys(&a, &b),
        Some("parquet") => columns(first, second),
        _ => None,
    };
    Ok(Some(match named {
        Some(names) if !names.is_empty() => sentence(&names),
        _ => bytes(&a, &b),
    }))
}

fn sentence(names: &[String]) -> String {
    let shown = names[..names.len().min(MOST_NAMED)].join(", ");
    match names.len().saturating_sub(MOST_NAMED) {
        0 => format!("differs in {shown}"),
        more => format!("differs in {shown} and {more} more"),
    }
}

fn bytes(a: &[u8], b: &[u8]) -> String {
    let at = a.iter().zip(b).position(|(a, b)| a != b);
    let at = at.unwrap_or(a.len().min(b.len()));
    let (had, has) = (a.len(), b.len());
    format!("differs from byte {at} on; it had {had} bytes and now has {has}")
}

/// The keys whose values differ; `None` if one is not a document.
fn keys(a: &[u8], b: &[u8]) -> Option<Vec<String>> {
    let (a, b): (Value, Value) = (
        serde_json::from_slice(a).ok()?,
        serde_json::from_slice(b).ok()?,
    );
    let mut found = Vec::new();
    compare(&a, &b, "", &mut found);
    Some(found)
}

fn compare(a: &Value, b: &Value, at: &str, found: &mut Vec<String>) {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            for key in a.keys().chain(b.keys().filter(|key| !a.contains_key(*key))) {
                let at = if at.is_empty() {
                    key.clone()
                } else {
                    format!("{at}.{key}")
                };
                let value =
                    |of: &serde_json::Map<_, _>| of.get(key).cloned().unwrap_or(Value::Null);
                compare(&value(a), &value(b), &at, found);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (index, (a, b)) in a.iter().zip(b).enumerate() {
                compare(a, b, &format!("{at}[{index}]"), found);
            }
        }
        _ if a != b => found.push(at.into()),
        _ => {}
    }
}

/// The columns whose values differ; `None` if one is not a table.
fn columns(a: &Path, b: &Path) -> Option<Vec<String>> {
    let (a, b) = (parquet::read(a).ok()?, parquet::read(b).ok()?);
    if a.rows() != b.rows() {
        return Some(vec![format!("its rows ({}, now {})", a.rows(), b.rows())]);
    }
    let differs = |name: &str| match (a.column(name), b.column(name)) {
        (Some(a), Some(b)) => !a.is_same(b),
        _ => true,
    };
    let only_b = b.columns().iter().filter(|c| a.column(c.name()).is_none());
    let names = a.columns().iter().chain(only_b).map(Column::name);
    let named = names.filter(|name| differs(name));
    Some(named.map(|name| format!("column {name}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documents_differ_by_key() {
        let (a, b) = (br#"{"a":{"b":[1,2]},"c":3}"#, br#"{"a":{"b":[1,5]},"d":4}"#);
        assert_eq!(keys(a, b).unwrap(), ["a.b[1]", "c", "d"]);
    }

    #[test]
    fn other_files_differ_by_byte() {
        assert_eq!(
            bytes(b"abc", b"abd!"),
            "differs from byte 2 on; it had 3 bytes and now has 4"
        );
    }
}
