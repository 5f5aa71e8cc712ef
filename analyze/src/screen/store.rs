//! The records of a place, in `state/`: each is written once and never changed.
//!
//! The name of an analysed log's record holds its content, the version of the analysis and its path. Two
//! processes that analyse the same log therefore end in one record, and a list of the names tells what is
//! done. Tables and page are built from the records.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Result;

use super::place::Place;
use super::record::{
    Common, FAILED, OLDEST_SCHEMA, Outcome, RECORD_SCHEMA, REPORT_PAGE, Record, Records,
    content_key, path_key,
};
use crate::base::error_text::error_text;

const FOLDER: &str = "state";
const ENDING: &str = ".json";

/// The records of a place.
#[derive(Debug)]
pub(super) struct Store {
    place: Place,
}

/// The names of the records that were there when it was made.
#[derive(Debug, Default)]
pub(super) struct Index {
    /// Keys of analysed logs, by [`content_key`].
    analysed: BTreeMap<String, Vec<String>>,
    /// Path keys of failed logs.
    failed: BTreeSet<String>,
}

/// A record that is damaged or of an unknown schema. Its name tells which log it is of only by a hash of the path.
#[derive(Debug)]
pub(super) struct Unreadable {
    /// Path of the record.
    pub(super) place: String,
    pub(super) path_key: String,
    pub(super) reason: String,
}

/// Use of earlier records in a run.
#[derive(Debug)]
pub(super) enum Before {
    /// Earlier records are not reused.
    Ignored,
    /// All names were listed: for many logs.
    Listed(Index),
    /// The store is asked for each log: for one.
    OnDemand,
}

impl Index {
    pub(super) fn is_empty(&self) -> bool {
        self.analysed.is_empty() && self.failed.is_empty()
    }

    /// Number of records.
    pub(super) fn len(&self) -> usize {
        self.analysed.values().map(Vec::len).sum::<usize>() + self.failed.len()
    }
}

impl Store {
    pub(super) fn of(place: &Place) -> Self {
        Self {
            place: place.clone(),
        }
    }

    /// Writes a record; of an analysed log only if there is none of this name.
    pub(super) fn save(&self, record: &Record) -> Result<()> {
        let name = name_of(&record.key());
        let text = serde_json::to_string_pretty(record)?;
        if record.is_failed() {
            return self.place.put(&name, text.as_bytes());
        }
        let is_new = self.place.put_if_absent(&name, text.as_bytes())?;
        // a damaged record is worth less than a new one, and one without a report less than one with it
        let is_worse = |known: Result<Record>| {
            known.map_or(true, |known| {
                known.report_folder().is_none() && record.report_folder().is_some()
            })
        };
        if !is_new && is_worse(self.read(&name)) {
            self.place.put(&name, text.as_bytes())?;
        }
        Ok(())
    }

    /// Writes a record in place of the one of its name.
    pub(super) fn replace(&self, record: &Record) -> Result<()> {
        let text = serde_json::to_string_pretty(record)?;
        self.place.put(&name_of(&record.key()), text.as_bytes())
    }

    /// Removes records, and the failures of their paths: the next run would find them alone.
    pub(super) fn remove(&self, records: &[Box<Record>]) -> Result<()> {
        let keys = records.iter().flat_map(|record| {
            let failure = format!("{}{FAILED}", path_key(&record.path));
            [record.key(), failure]
        });
        let names: BTreeSet<String> = keys.map(|key| name_of(&key)).collect();
        let names: Vec<String> = names.into_iter().collect();
        self.place
            .in_parallel(&names, |name| self.place.remove(name))?;
        Ok(())
    }

    /// Removes the failure of a path that is analysed now.
    pub(super) fn forget_failure(&self, before: &Before, path: &str) -> Result<()> {
        let key = path_key(path);
        let may_exist = match before {
            Before::Ignored => false,
            Before::Listed(index) => index.failed.contains(&key),
            Before::OnDemand => true,
        };
        match may_exist {
            true => self.place.remove(&name_of(&format!("{key}{FAILED}"))),
            false => Ok(()),
        }
    }

    /// The names of all records.
    pub(super) fn index(&self) -> Result<Index> {
        let mut index = Index::default();
        for name in self.place.list(FOLDER)? {
            let Some(key) = name.strip_suffix(ENDING) else {
                continue;
            };
            match (key.strip_suffix(FAILED), key.rsplit_once('-')) {
                (Some(path), _) => {
                    index.failed.insert(path.into());
                }
                (None, Some((content, _))) => {
                    let keys = index.analysed.entry(format!("{content}-")).or_default();
                    keys.push(key.into());
                }
                (None, None) => {}
            }
        }
        Ok(index)
    }

    /// A record of this content and version: under any path if the names were listed, else under this one.
    pub(super) fn analysed(
        &self,
        before: &Before,
        log_id: &str,
        version: &str,
        path: &str,
    ) -> Result<Option<Record>> {
        let content = content_key(log_id, version);
        let keys = match before {
            Before::Ignored => return Ok(None),
            Before::Listed(index) => index.analysed.get(&content).cloned().unwrap_or_default(),
            // one request; copies under other paths are not worth a list of all names
            Before::OnDemand => vec![format!("{content}{}", path_key(path))],
        };
        let records = keys.iter().filter_map(|key| self.read(&name_of(key)).ok());
        let is_it = |record: &Record| {
            record.log_id.as_deref() == Some(log_id)
                && record.analysis_version.as_deref() == Some(version)
                && !record.is_failed()
        };
        Ok(records.into_iter().find(is_it))
    }

    /// The objects that hold records.
    pub(super) fn names(&self) -> Result<Vec<String>> {
        let names = self.place.list(FOLDER)?.into_iter();
        let names = names.filter(|name| name.ends_with(ENDING));
        Ok(names.map(|name| format!("{FOLDER}/{name}")).collect())
    }

    /// All records of these objects, and those that are not valid.
    pub(super) fn load(&self, names: &[String]) -> Result<(Records, Vec<Unreadable>)> {
        let common = Common::default();
        let read = self.place.in_parallel(names, |name| {
            let read = self.read(name);
            Ok(read.map(|record| Box::new(record.compact(&common))))
        })?;
        let mut unusable = Vec::new();
        // in place: the list is long
        let records = read.into_iter().zip(names).filter_map(|(read, name)| {
            let of_error = |error| Unreadable {
                place: format!("{}/{name}", self.place),
                path_key: path_key_of(name).to_owned(),
                reason: error_text(&error),
            };
            read.map_err(|error| unusable.push(of_error(error))).ok()
        });
        let records = records.collect();
        Ok((records, unusable))
    }

    fn read(&self, name: &str) -> Result<Record> {
        let mut record: Record = serde_json::from_slice(&self.place.read(name)?)?;
        anyhow::ensure!(
            (OLDEST_SCHEMA..=RECORD_SCHEMA).contains(&record.schema),
            "expected a record of schema {OLDEST_SCHEMA} to {RECORD_SCHEMA}, found {}",
            record.schema
        );
        // a report that somebody removed is none; nobody tidies a bucket by hand
        if let (Some(folder), Some(local)) = (record.report_folder(), self.place.local())
            && !local.join(folder).join(REPORT_PAGE).is_file()
            && let Outcome::Analysed { has_report, .. } = &mut record.result
        {
            *has_report = false;
        }
        Ok(record)
    }
}

/// The [`path_key`] in the name of a record.
fn path_key_of(name: &str) -> &str {
    let name = name.rsplit_once('/').map_or(name, |(_, name)| name);
    let key = name.strip_suffix(ENDING).unwrap_or(name);
    match (key.strip_suffix(FAILED), key.rsplit_once('-')) {
        (Some(path), _) | (None, Some((_, path))) => path,
        (None, None) => key,
    }
}

fn name_of(key: &str) -> String {
    format!("{FOLDER}/{key}{ENDING}")
}
