//! Reads the tables other than the messages themselves.

use std::{collections::HashMap, path::Path};

use rusqlite::Connection;

use super::salvage::TopicRow;
use crate::message::Error;

pub(super) struct StoredDefinition {
    pub(super) encoding: String,
    pub(super) text: String,
}

/// The definitions by type name. Older databases lack this table.
pub(super) fn definitions(connection: &Connection) -> HashMap<String, StoredDefinition> {
    const QUERY: &str =
        "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";
    let Ok(mut statement) = connection.prepare(QUERY) else {
        return HashMap::new();
    };
    let rows = statement.query_map([], |row| {
        Ok((
            row.get(0)?,
            StoredDefinition {
                encoding: row.get(1)?,
                text: row.get(2)?,
            },
        ))
    });
    rows.into_iter().flatten().flatten().collect()
}

pub(super) fn topic_rows(connection: &Connection, path: &Path) -> Result<Vec<TopicRow>, Error> {
    const QUERY: &str =
        "SELECT id, name, type, serialization_format, offered_qos_profiles FROM topics ORDER BY id";
    // the first databases lack the column
    const OLD_QUERY: &str =
        "SELECT id, name, type, serialization_format, NULL FROM topics ORDER BY id";
    let failed = || Error::sqlite(path, "the table of topics");
    let statement = (connection.prepare(QUERY)).or_else(|_| connection.prepare(OLD_QUERY));
    let mut statement = statement.map_err(failed())?;
    let rows = statement
        .query_map([], |row| {
            Ok(TopicRow {
                id: row.get(0)?,
                name: row.get(1)?,
                type_name: row.get(2)?,
                encoding: row.get(3)?,
                offered_qos: row.get(4).ok().flatten(),
            })
        })
        .map_err(failed())?;
    rows.collect::<Result<_, _>>().map_err(failed())
}

/// Log times of the first and the last message; `None` without messages, or if damage hides them.
pub(super) fn span_ns(connection: &Connection) -> Option<(i64, i64)> {
    // one query each: SQLite takes each from the recorder's index of the times
    let time = |query: &str| connection.query_row(query, [], |row| row.get(0)).ok()?;
    let first: Option<i64> = time("SELECT MIN(timestamp) FROM messages");
    let last: Option<i64> = time("SELECT MAX(timestamp) FROM messages");
    first.zip(last)
}

/// Message counts.
pub(super) struct Counts {
    by_topic: HashMap<i64, u64>,
    first_id: i64,
    last_id: i64,
}

impl Counts {
    /// `None` if damage prevents counting.
    pub(super) fn read(connection: &Connection) -> Option<Self> {
        const QUERY: &str =
            "SELECT topic_id, COUNT(*), MIN(id), MAX(id) FROM messages GROUP BY topic_id";
        let mut statement = connection.prepare(QUERY).ok()?;
        let mut rows = statement.query([]).ok()?;
        let mut counts = Self {
            by_topic: HashMap::new(),
            first_id: i64::MAX,
            last_id: i64::MIN,
        };
        while let Some(row) = rows.next().ok()? {
            let count: i64 = row.get(1).ok()?;
            counts
                .by_topic
                .insert(row.get(0).ok()?, count.unsigned_abs());
            counts.first_id = counts.first_id.min(row.get(2).ok()?);
            counts.last_id = counts.last_id.max(row.get(3).ok()?);
        }
        Some(counts)
    }

    pub(super) fn of_topic(&self, id: i64) -> u64 {
        self.by_topic.get(&id).copied().unwrap_or(0)
    }

    /// The number of missing ids; recorders number messages without gaps.
    pub(super) fn missing(&self) -> u64 {
        let span = i128::from(self.last_id) - i128::from(self.first_id) + 1;
        let count: u64 = self.by_topic.values().sum();
        u64::try_from(span - i128::from(count)).unwrap_or(0)
    }
}
