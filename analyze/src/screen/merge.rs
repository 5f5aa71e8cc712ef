//! Merges records with the same content to one row.

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

/// Rows of all records; of records with the same content, the first analysed one by path.
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
        if row.record.is_failed() && !record.is_failed() {
            row.record = record;
        }
    }
    rows
}
