//! Rows that cannot be read, reported by kind and not one by one: a table has millions of rows.

use std::{collections::BTreeMap, ops::Range, path::Path};

use super::columns::TOPIC;
use crate::message::{Losses, LostPart, LostRange};

/// Why a row cannot be read.
pub(super) struct Problem {
    /// Rows with problems of one kind are reported together.
    pub(super) kind: &'static str,
    pub(super) text: String,
}

/// Where a row is.
pub(super) struct Place {
    pub(super) bytes: Range<u64>,
    /// The number of its line, from 1.
    pub(super) line: u64,
}

/// The lost rows of each kind.
#[derive(Default)]
pub(super) struct LostRows(BTreeMap<&'static str, Kind>);

struct Kind {
    count: u64,
    /// From the first of them to the last.
    bytes: Range<u64>,
    lines: (u64, u64),
    /// What is wrong with the first.
    example: String,
}

impl LostRows {
    pub(super) fn count(&mut self, problem: Problem, place: &Place) {
        let kind = self.0.entry(problem.kind).or_insert_with(|| Kind {
            count: 0,
            bytes: place.bytes.clone(),
            lines: (place.line, place.line),
            example: problem.text,
        });
        kind.count += 1;
        kind.bytes.end = place.bytes.end;
        kind.lines.1 = place.line;
    }

    pub(super) fn report(self, path: &Path, losses: &mut Losses) {
        for kind in self.0.into_values() {
            let (first, last) = kind.lines;
            let reason = match kind.count {
                1 => format!("line {first}: {}", kind.example),
                count => format!(
                    "{count} rows, the first in line {first}, the last in line {last}: {}",
                    kind.example
                ),
            };
            losses.push(LostRange {
                file: path.to_path_buf(),
                start_byte: kind.bytes.start,
                end_byte: kind.bytes.end,
                part: LostPart::Records,
                reason,
                first_time_ns: None,
                last_time_ns: None,
                messages: BTreeMap::from([(TOPIC.to_owned(), kind.count)]),
                message_count: Some(kind.count),
            });
        }
    }
}
