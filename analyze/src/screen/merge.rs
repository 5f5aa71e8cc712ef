//! From the records of a screen to its rows: each content once.

use std::collections::BTreeMap;

use super::record::Record;

/// A log of the data set.
#[derive(Debug, Clone)]
pub(super) struct LogRow {
    /// Its record.
    pub(super) record: Record,
    /// How many other paths hold the same content.
    pub(super) copies: u64,
}

/// The rows of all records: of those with the same content one that was analysed, the first by path.
pub(super) fn merge(records: Vec<Record>) -> Vec<LogRow> {
    let mut rows: Vec<LogRow> = Vec::with_capacity(records.len());
    let mut place_of: BTreeMap<String, usize> = BTreeMap::new();
    for record in records {
        let known = record.log_id.as_ref().and_then(|id| place_of.get(id));
        let Some(row) = known.map(|&place| &mut rows[place]) else {
            if let Some(id) = &record.log_id {
                place_of.insert(id.clone(), rows.len());
            }
            rows.push(LogRow { record, copies: 0 });
            continue;
        };
        row.copies += 1;
        if row.record.is_failed() && !record.is_failed() {
            row.record = record;
        }
    }
    rows
}
