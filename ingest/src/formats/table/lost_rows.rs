//! Rows that cannot be read, reported by kind and not one by one: a table has millions of rows.

use std::{collections::BTreeMap, ops::Range, path::Path};

use tipwatch_language::say;

use super::columns::TOPIC;
use crate::message::{Losses, LostPart, LostRange};

/// Reason why a row cannot be read.
pub(super) struct Problem {
    /// Rows with problems of one kind are reported together.
    pub(super) kind: &'static str,
    pub(super) text: String,
}

impl Problem {
    const REMARK: &'static str = "remark";

    /// Returns the problem of a line that is no row: a line for a reader, or one that repeats the names of the columns.
    pub(super) fn remark() -> Self {
        Self {
            kind: Self::REMARK,
            text: String::new(),
        }
    }

    pub(super) fn is_remark(&self) -> bool {
        self.kind == Self::REMARK
    }
}

/// Position of a row.
#[derive(Clone)]
pub(super) struct Place {
    pub(super) bytes: Range<u64>,
    /// The number of its line, from 1.
    pub(super) line: u64,
}

/// The lost rows of each kind.
#[derive(Default)]
pub(super) struct LostRows {
    kinds: BTreeMap<&'static str, Kind>,
    /// The time of the last intact row.
    last_ns: Option<i64>,
}

struct Kind {
    count: u64,
    /// Bytes from the first of these rows to the last.
    bytes: Range<u64>,
    lines: (u64, u64),
    /// Problem of the first lost row.
    example: String,
    /// The times of the intact rows before the first lost row and behind the last one (ns).
    before_ns: Option<i64>,
    behind_ns: Option<i64>,
}

impl LostRows {
    pub(super) fn count(&mut self, problem: Problem, place: &Place) {
        let before_ns = self.last_ns;
        let kind = self.kinds.entry(problem.kind).or_insert_with(|| Kind {
            count: 0,
            bytes: place.bytes.clone(),
            lines: (place.line, place.line),
            example: problem.text,
            before_ns,
            behind_ns: None,
        });
        kind.count += 1;
        kind.behind_ns = None;
        kind.bytes.end = place.bytes.end;
        kind.lines.1 = place.line;
    }

    /// An intact row follows.
    pub(super) fn intact(&mut self, time_ns: i64) {
        self.last_ns = Some(time_ns);
        for kind in self.kinds.values_mut() {
            kind.behind_ns.get_or_insert(time_ns);
        }
    }

    pub(super) fn report(self, path: &Path, losses: &mut Losses) {
        for kind in self.kinds.into_values() {
            let (first, last) = kind.lines;
            let reason = match kind.count {
                1 => say!("line {first}: {}", kind.example),
                count => say!(
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
                first_time_ns: kind.before_ns,
                last_time_ns: kind.behind_ns,
                messages: BTreeMap::from([(TOPIC.to_owned(), kind.count)]),
                message_count: Some(kind.count),
            });
        }
    }
}
