//! Records on disk: `state/<hash of the log's path>.json`, each written atomically.
//!
//! Tables and page are built from them. A killed program leaves the records of the finished logs.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::record::{RECORD_SCHEMA, Record};
use crate::base::error_text::error_text;
use crate::base::file_hash::sha256_of;
use crate::base::files::{remove_unfinished, write_atomically};

/// The folder of records.
#[derive(Debug)]
pub(super) struct Store {
    folder: PathBuf,
}

impl Store {
    pub(super) fn in_folder(out: &Path) -> Result<Self> {
        let folder = out.join("state");
        fs::create_dir_all(&folder)
            .with_context(|| format!("{}: cannot be created", folder.display()))?;
        Ok(Self { folder })
    }

    /// Removes partial files of a killed program; only while holding the lock.
    pub(super) fn tidy(&self) {
        remove_unfinished(&self.folder);
    }

    pub(super) fn save(&self, record: &Record) -> Result<()> {
        let key = sha256_of(record.path.as_bytes());
        let name = format!("{}.json", key.get(..32).unwrap_or(&key));
        let text = serde_json::to_string_pretty(record)?;
        write_atomically(&self.folder.join(name), text.as_bytes())
    }

    /// All records by path, and a note on each invalid file, whose log is analysed again.
    pub(super) fn load(&self) -> Result<(Vec<Record>, Vec<String>)> {
        let mut records = Vec::new();
        let mut unusable = Vec::new();
        let entries = fs::read_dir(&self.folder)
            .with_context(|| format!("{}: cannot be read", self.folder.display()))?;
        for entry in entries {
            let path = entry?.path();
            if path.extension().is_none_or(|extension| extension != "json") {
                continue;
            }
            match read(&path) {
                Ok(record) => records.push(record),
                Err(error) => unusable.push(format!("{}: {}", path.display(), error_text(&error))),
            }
        }
        records.sort_by(|a: &Record, b: &Record| a.path.cmp(&b.path));
        Ok((records, unusable))
    }
}

fn read(path: &Path) -> Result<Record> {
    let record: Record = serde_json::from_slice(&fs::read(path)?)?;
    anyhow::ensure!(
        record.schema == RECORD_SCHEMA,
        "expected a record of schema {RECORD_SCHEMA}, found {}",
        record.schema
    );
    Ok(record)
}
