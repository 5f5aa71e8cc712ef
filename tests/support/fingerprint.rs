//! Fingerprints of results: one line for each column, topic or key, so that a difference names what changed.
//!
//! Numbers, truth values, nulls and names count to the bit. What may change without a change of the results is left
//! out: sentences, paths, hashes of files, versions and times of the run.

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;
use tipwatch_analyze::tables::table::Column;
use tipwatch_analyze::tables::{cell, parquet};
use tipwatch_ingest::{Log, TopicId};

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

/// Fowler-Noll-Vo, 64 bits: not cryptographic, but short, fast and the same everywhere.
#[derive(Debug, Clone, Copy)]
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn text(self) -> String {
        format!("{:016x}", self.0)
    }
}

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

/// A line for each column: name, type, number of rows, hash of the values.
fn table(path: &Path) -> Result<Vec<String>> {
    let table = parquet::read(path)?;
    let columns = table.columns().iter();
    let counted = columns.filter(|column| !LEFT_OUT_COLUMNS.contains(&column.name()));
    Ok(counted.map(line_of_column).collect())
}

fn line_of_column(column: &Column) -> String {
    let mut hash = Hash::new();
    for value in column.values() {
        add(&mut hash, &value);
    }
    format!(
        "{} {} {} {}",
        column.name(),
        column.type_name(),
        column.len(),
        hash.text()
    )
}

fn add(hash: &mut Hash, value: &cell::Value) {
    match value {
        cell::Value::Null => hash.add(b"null"),
        // the sign of NaN is not specified
        cell::Value::Number(number) if number.is_nan() => hash.add(b"nan"),
        cell::Value::Number(number) => hash.add(&number.to_bits().to_le_bytes()),
        cell::Value::Boolean(truth) => hash.add(&[u8::from(*truth)]),
        cell::Value::Text(text) => {
            hash.add(text.as_bytes());
            hash.add(&[0xff]);
        }
        cell::Value::List(values) => {
            hash.add(&(values.len() as u64).to_le_bytes());
            for value in values {
                add(hash, value);
            }
        }
        cell::Value::Integer(integer) => hash.add(&integer.to_le_bytes()),
    }
}

/// A line for each topic: number of messages, hash of their times and bytes.
fn topics(path: &Path) -> Result<Vec<String>> {
    let log = Log::open(path)?;
    let counted = |name: &str| !LEFT_OUT_TOPICS.contains(&name);
    let topics: Vec<_> = (log.topics().iter())
        .filter(|topic| counted(&topic.name))
        .collect();
    let ids: Vec<TopicId> = topics.iter().map(|topic| topic.id).collect();
    let mut found: BTreeMap<usize, (u64, Hash)> = BTreeMap::new();
    log.read(&ids, &mut |message| {
        let (count, hash) = (found.entry(message.topic.index())).or_insert((0, Hash::new()));
        *count += 1;
        hash.add(&message.log_time_ns.to_le_bytes());
        hash.add(message.data);
        ControlFlow::Continue(())
    })?;
    let mut lines: Vec<String> = (topics.iter())
        .filter_map(|topic| {
            let (count, hash) = found.get(&topic.id.index())?;
            Some(format!("{} {count} messages {}", topic.name, hash.text()))
        })
        .collect();
    lines.sort();
    Ok(lines)
}

/// A line for each path of keys: the value, or number and hash of the values where there are several. Elements of a
/// list share a path, and so do documents.
#[must_use]
pub fn documents(documents: &[Value]) -> Vec<String> {
    let mut leaves: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for document in documents {
        collect(document, "", &mut leaves);
    }
    let line = |(path, values): (&String, &Vec<String>)| {
        if let [value] = values.as_slice() {
            return format!("{path} = {value}");
        }
        let mut hash = Hash::new();
        for value in values {
            hash.add(value.as_bytes());
            hash.add(b"\n");
        }
        format!("{path} = {} values {}", values.len(), hash.text())
    };
    leaves.iter().map(line).collect()
}

fn collect(value: &Value, path: &str, leaves: &mut BTreeMap<String, Vec<String>>) {
    match value {
        Value::String(_) if !NAMES.contains(&last_key(path)) => {}
        Value::Object(map) => {
            let counted = |key: &String| !LEFT_OUT_KEYS.contains(&key.as_str());
            for (key, value) in map.iter().filter(|(key, _)| counted(key)) {
                let dot = if path.is_empty() { "" } else { "." };
                collect(value, &format!("{path}{dot}{key}"), leaves);
            }
        }
        Value::Array(values) => {
            for value in values {
                collect(value, &format!("{path}[]"), leaves);
            }
        }
        leaf => leaves
            .entry(path.into())
            .or_default()
            .push(leaf.to_string()),
    }
}

fn last_key(path: &str) -> &str {
    let key = path.rsplit('.').next().unwrap_or(path);
    key.trim_end_matches("[]")
}
