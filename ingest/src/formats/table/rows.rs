//! Rows as messages: what both kinds of table share.

use std::ops::ControlFlow;

use super::{
    coarse_times::Counted,
    columns::{Columns, TOPIC, TYPE},
};
use crate::{
    formats::reader::Request,
    message::{RawMessage, TopicDescription, TopicId, TopicTable},
    schema::CDR,
};

/// Rows between two progress reports.
const ROWS_PER_PROGRESS: u64 = 4096;

/// The topic of a table's rows.
#[derive(Debug)]
pub(super) struct RowTopic {
    pub(super) topic: TopicId,
    pub(super) bytes: u64,
    pub(super) counted: Counted,
}

impl RowTopic {
    pub(super) fn register(columns: &Columns, bytes: u64, topics: &mut TopicTable) -> Self {
        let topic = topics.register(&TopicDescription {
            name: TOPIC,
            type_name: TYPE,
            encoding: "cdr",
            schema_encoding: "ros2msg",
            definition: Some(columns.definition.as_bytes()),
        });
        Self {
            topic,
            bytes,
            counted: Counted::default(),
        }
    }

    /// Passes on the row with this index.
    pub(super) fn visit(
        &self,
        row: u64,
        time_ns: i64,
        values: &[f64],
        message: &mut Vec<u8>,
        request: &mut Request<'_>,
    ) -> ControlFlow<()> {
        if row.is_multiple_of(ROWS_PER_PROGRESS) {
            let share = u128::from(row.min(self.counted.rows)) * u128::from(self.bytes);
            request.advance((share / u128::from(self.counted.rows.max(1))) as u64);
        }
        message.clear();
        message.extend_from_slice(&CDR);
        for value in values {
            message.extend_from_slice(&value.to_le_bytes());
        }
        (request.visit)(&RawMessage {
            topic: self.topic,
            writer: 0,
            log_time_ns: time_ns,
            publish_time_ns: time_ns,
            sequence: 0,
            data: message,
        })
    }
}

/// Whether messages of this type are rows of a table, each of which may have some of the numbers.
pub(crate) fn is_row(type_name: &str) -> bool {
    type_name == TYPE
}

/// Collects the numbers of a row of a table: `first` keeps the first of each column, `last` gets the newest.
pub(crate) fn collect_numbers(row: &[u8], first: &mut Vec<u8>, last: &mut Vec<u8>) {
    if first.len() != row.len() {
        // the first row; no table has rows of several lengths
        first.clear();
        first.extend_from_slice(row);
        last.clear();
        last.extend_from_slice(row);
        return;
    }
    let is_number = |cell: &[u8; 8]| f64::from_le_bytes(*cell).is_finite();
    let (_, cells) = row.split_at(CDR.len().min(row.len()));
    for (at, cell) in cells.as_chunks::<8>().0.iter().enumerate() {
        let place = CDR.len() + 8 * at..CDR.len() + 8 * (at + 1);
        if !is_number(cell) {
            continue;
        }
        let had_number = <&[u8; 8]>::try_from(&first[place.clone()]).is_ok_and(is_number);
        if !had_number {
            first[place.clone()].copy_from_slice(cell);
        }
        last[place].copy_from_slice(cell);
    }
}
