//! Fingerprints of results: one line for each column, topic or key, that a person can review.
//!
//! A line shows the values themselves where they are few, otherwise how many there are, their least, largest, mean and
//! last value, and a hash of all of them. What may change without a change of the results is left out: sentences, paths,
//! hashes of files, versions and times of the run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;
use tipwatch_analyze::tables::parquet;
use tipwatch_analyze::tables::table::{self, Column};
use tipwatch_ingest::{FieldRequest, Log, Topic, number_fields, record_fields};

use crate::digest::{Digest, Item};

/// Columns of sentences, paths, hashes and versions.
const LEFT_OUT_COLUMNS: [&str; 9] = [
    "analysis_version",
    "findings",
    "log_id",
    "machine_file_sha256",
    "notes",
    "path",
    "reason",
    "report",
    "tipwatch_version",
];
/// Keys of documents: versions of the keys, and where a result comes from.
const LEFT_OUT_KEYS: [&str; 2] = ["schema", "provenance"];
/// Keys whose texts are names, not sentences.
const NAMES: [&str; 11] = [
    "cautions",
    "faults",
    "kind",
    "next_wheel",
    "parameter",
    "reasons",
    "subject",
    "unit",
    "verdict",
    "verdict_latched",
    "wheel",
];
/// Topics of sentences.
const LEFT_OUT_TOPICS: [&str; 1] = ["/diagnostics"];
/// Folders of a screen: its records, with times of the run and hashes of the program, and reports of single logs,
/// which are those of `analyze`.
const LEFT_OUT_FOLDERS: [&str; 2] = ["state", "reports"];
/// The record of custody: hashes and sizes of files, the program's own among them, and times of the run.
const LEFT_OUT_FILES: [&str; 1] = ["custody.json"];

/// Fingerprint of every table, document and log in a folder of results, in the order of their paths.
///
/// # Errors
/// A file cannot be read.
pub fn folder(path: &Path) -> Result<Vec<String>> {
    let mut files = Vec::new();
    list(path, &mut files)?;
    files.sort();
    let mut lines = Vec::new();
    for file in files {
        let name = file.strip_prefix(path)?.display().to_string();
        let found = match file.extension().and_then(|extension| extension.to_str()) {
            Some("parquet") => table(&file),
            Some("json") => serde_json::from_slice(&fs::read(&file)?)
                .map(|document| documents(&[document]))
                .map_err(Into::into),
            Some("mcap") => topics(&file),
            _ => continue,
        };
        let found = found.with_context(|| file.display().to_string())?;
        lines.extend(found.into_iter().map(|line| format!("{name} {line}")));
    }
    Ok(lines)
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        match path.is_dir() {
            true if LEFT_OUT_FOLDERS.iter().any(|name| path.ends_with(name)) => {}
            true => list(&path, files)?,
            false if LEFT_OUT_FILES.iter().any(|name| path.ends_with(name)) => {}
            false => files.push(path),
        }
    }
    Ok(())
}

/// A line for each column: name, type and values.
fn table(path: &Path) -> Result<Vec<String>> {
    let table = parquet::read(path)?;
    if table.rows() == 0 {
        return Ok(vec!["no rows".into()]);
    }
    let columns = table.columns().iter();
    let counted = columns.filter(|column| !LEFT_OUT_COLUMNS.contains(&column.name()));
    Ok(counted.map(line_of_column).collect())
}

fn line_of_column(column: &Column) -> String {
    let mut digest = Digest::default();
    for value in column.values() {
        add(&mut digest, value);
    }
    format!("{} {} = {digest}", column.name(), column.type_name())
}

fn add(digest: &mut Digest, value: table::Value<'_>) {
    use table::Value::{Boolean, Float32, Float64, List, Null, String};
    digest.add(match value {
        Null => Item::Null,
        Float32(number) => Item::Number(number.into()),
        Float64(number) => Item::Number(number),
        Boolean(truth) => Item::Name(truth.to_string()),
        String(text) => Item::Name(format!("{text:?}")),
        List(values) => {
            let element = |value: table::Value<'_>| match value {
                String(text) => format!("Text({text:?})"),
                Float64(number) => format!("Number({number:?})"),
                other => format!("{other:?}"),
            };
            let names: Vec<_> = values.iter().map(element).collect();
            Item::Name(format!("[{}]", names.join(" ")))
        }
        whole => Item::Integer(whole.extract().expect("a whole number")),
    });
}

/// A line for each topic: number of messages, and all numbers in them.
fn topics(path: &Path) -> Result<Vec<String>> {
    let log = Log::open(path)?;
    let counted = |topic: &&Topic| !LEFT_OUT_TOPICS.contains(&topic.name.as_str());
    let mut lines = Vec::new();
    for topic in log.topics().iter().filter(counted) {
        let fields = number_fields(topic);
        let requests: Vec<FieldRequest> = (fields.iter())
            .map(|field| FieldRequest::raw(&topic.name, field))
            .collect();
        let recordings = match record_fields(&log, &requests, None) {
            Ok((recordings, _)) => recordings,
            // some field has no number in any message
            Err(_) => (requests.iter())
                .filter_map(|request| record_fields(&log, std::slice::from_ref(request), None).ok())
                .flat_map(|(recordings, _)| recordings)
                .collect(),
        };
        let mut digest = Digest::default();
        // the last column first: the line ends with the last value of the first field
        for recording in recordings.iter().rev() {
            for &value in &recording.values {
                digest.add(Item::Number(value));
            }
        }
        let count = topic.message_count.unwrap_or_default();
        lines.push(format!("{} {count} messages = {digest}", topic.name));
    }
    lines.sort();
    Ok(lines)
}

/// A line for each path of keys with its values. Elements of a list share a path, and so do documents.
#[must_use]
pub fn documents(documents: &[Value]) -> Vec<String> {
    let mut leaves: BTreeMap<String, Digest> = BTreeMap::new();
    for document in documents {
        collect(document, "", &mut leaves);
    }
    let lines = leaves.iter();
    lines
        .map(|(path, digest)| format!("{path} = {digest}"))
        .collect()
}

fn collect(value: &Value, path: &str, leaves: &mut BTreeMap<String, Digest>) {
    let item = match value {
        Value::String(_) if !NAMES.contains(&last_key(path)) => return,
        Value::Object(map) => {
            let counted = |key: &String| !LEFT_OUT_KEYS.contains(&key.as_str());
            for (key, value) in map.iter().filter(|(key, _)| counted(key)) {
                let dot = if path.is_empty() { "" } else { "." };
                collect(value, &format!("{path}{dot}{key}"), leaves);
            }
            return;
        }
        Value::Array(values) => {
            for value in values {
                collect(value, &format!("{path}[]"), leaves);
            }
            return;
        }
        Value::Null => Item::Null,
        Value::Number(number) => match number.as_i128() {
            Some(integer) => Item::Integer(integer),
            None => Item::Number(number.as_f64().unwrap_or(f64::NAN)),
        },
        name => Item::Name(name.to_string()),
    };
    leaves.entry(path.into()).or_default().add(item);
}

fn last_key(path: &str) -> &str {
    let key = path.rsplit('.').next().unwrap_or(path);
    key.trim_end_matches("[]")
}
