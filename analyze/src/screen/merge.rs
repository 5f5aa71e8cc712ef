//! Which record of a log becomes its row: one of each path, then one of each content.

use std::collections::BTreeMap;

use super::record::Record;

/// A log of the data set.
#[derive(Debug, Clone)]
pub(super) struct LogRow {
    /// Its record.
    pub(super) record: Record,
    /// Number of other paths with the same content.
    pub(super) copies: u64,
}

/// The record of each path, sorted by path: of the newest program, then the latest. The records in `now`
/// are those of this run and replace all others of their paths.
pub(super) fn latest(all: Vec<Record>, now: Vec<Record>) -> Vec<Record> {
    let mut by_path: BTreeMap<String, Record> = BTreeMap::new();
    for record in all {
        match by_path.get_mut(&record.path) {
            None => {
                by_path.insert(record.path.clone(), record);
            }
            Some(known) if replaces(&record, known) => *known = record,
            Some(_) => {}
        }
    }
    for record in now {
        match by_path.get(&record.path) {
            // another process analysed what this one could not
            Some(known) if record.is_failed() && !replaces(&record, known) => {}
            _ => {
                by_path.insert(record.path.clone(), record);
            }
        }
    }
    by_path.into_values().collect()
}

/// Whether a record takes the place of another of the same path. With the same program a failure never
/// replaces a result unless it is known to be about another content or another version of the analysis: a
/// lost worker does not undo what another one found.
fn replaces(record: &Record, known: &Record) -> bool {
    let order = record.program().cmp(&known.program());
    if order.is_ne() || record.is_failed() == known.is_failed() {
        return record.age() > known.age();
    }
    let (failure, result) = match record.is_failed() {
        true => (record, known),
        false => (known, record),
    };
    let differs = |a: &Option<String>, b: &Option<String>| a.is_some() && a != b;
    let is_about_another = differs(&failure.log_id, &result.log_id)
        || differs(&failure.analysis_version, &result.analysis_version);
    match record.is_failed() {
        true => is_about_another && record.age() > known.age(),
        false => !is_about_another || record.age() > known.age(),
    }
}

/// Rows of the records of different paths, sorted by path; of records with the same content, that of the
/// newest program, then the first analysed one by path.
pub(super) fn merge(records: Vec<Record>) -> Vec<LogRow> {
    let mut rows: Vec<LogRow> = Vec::with_capacity(records.len());
    let mut index_of: BTreeMap<String, usize> = BTreeMap::new();
    for record in records {
        let known = record.log_id.as_ref().and_then(|id| index_of.get(id));
        let Some(row) = known.map(|&index| &mut rows[index]) else {
            if let Some(id) = &record.log_id {
                index_of.insert(id.clone(), rows.len());
            }
            rows.push(LogRow { record, copies: 0 });
            continue;
        };
        row.copies += 1;
        let order = record.program().cmp(&row.record.program());
        let is_better = row.record.is_failed() && !record.is_failed();
        if order.then(is_better.cmp(&false)).is_gt() {
            row.record = record;
        }
    }
    rows
}
