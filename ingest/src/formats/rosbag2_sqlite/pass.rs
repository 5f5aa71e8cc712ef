//! One pass over the wanted rows of a database.

use std::ops::{ControlFlow, Range};

use rusqlite::{Row, types::ValueRef};
use tipwatch_language::say;

use super::gaps::{IdGap, IdGaps};
use super::salvage::{MessageRow, Salvage};
use super::sqlite_reader::SqliteReader;
use super::tables;
use crate::{
    formats::reader::{FileReader, Request},
    message::{Error, LostPart, LostRange, RawMessage},
};

impl FileReader for SqliteReader {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        request.losses.integrity.checksums_absent = true;
        let mut pass = Pass {
            reader: self,
            request,
            rows: 0,
            seen: IdSet::new(self.file.len()),
            last_id: None,
            malformed: Malformed::default(),
        };
        let flow = match pass.run() {
            Ok(flow) => flow,
            Err(source) => pass.salvage(&source)?,
        };
        pass.report_malformed();
        Ok(flow)
    }

    fn span_ns(&self) -> Option<(i64, i64)> {
        tables::span_ns(&self.connect().ok()?)
    }
}

/// One pass over all wanted rows.
struct Pass<'p, 'r> {
    reader: &'p SqliteReader,
    request: &'p mut Request<'r>,
    rows: u64,
    /// Ids of the delivered messages, except the last one.
    seen: IdSet,
    last_id: Option<i64>,
    malformed: Malformed,
}

/// Rows that are not complete messages.
#[derive(Default)]
struct Malformed {
    rows: u64,
    /// First and last readable time of these rows (ns).
    span_ns: Option<(i64, i64)>,
}

impl Malformed {
    fn count(&mut self, time_ns: Option<i64>) {
        self.rows += 1;
        if let Some(time_ns) = time_ns {
            let (first, last) = self.span_ns.unwrap_or((time_ns, time_ns));
            self.span_ns = Some((first.min(time_ns), last.max(time_ns)));
        }
    }
}

impl Pass<'_, '_> {
    fn run(&mut self) -> Result<ControlFlow<()>, Error> {
        let Some(query) = self.query() else {
            return Ok(ControlFlow::Continue(()));
        };
        let connection = self.reader.connect()?;
        let failed = || Error::sqlite(&self.reader.path, "the messages");
        let mut statement = connection.prepare(&query).map_err(failed())?;
        let mut rows = statement.query([]).map_err(failed())?;
        while let Some(row) = rows.next().map_err(failed())? {
            if self.row(row).map_err(failed())?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// `None` if no topic of this file is wanted.
    fn query(&self) -> Option<String> {
        let topics = self.reader.topics.iter();
        let wanted = topics.filter(|(_, (topic, _))| self.request.wants(*topic));
        let numbers: Vec<String> = wanted.map(|(id, _)| id.to_string()).collect();
        let list = numbers.join(", ");
        (!numbers.is_empty()).then(|| {
            format!(
                "SELECT id, topic_id, timestamp, data FROM messages \
                 WHERE topic_id IN ({list}) ORDER BY id"
            )
        })
    }

    fn row(&mut self, row: &Row<'_>) -> Result<ControlFlow<()>, rusqlite::Error> {
        let id = row.get_ref(0)?.as_i64().ok();
        if let Some(id) = id {
            self.note_seen(id);
        }
        self.rows += 1;
        if self.rows.is_multiple_of(ROWS_PER_PROGRESS) {
            self.request.advance(self.estimated_bytes());
        }
        let topic = row
            .get_ref(1)?
            .as_i64()
            .ok()
            .and_then(|id| self.reader.topics.get(&id));
        let time_ns = row.get_ref(2)?.as_i64().ok();
        let (Some(&(topic, writer)), Some(time_ns), ValueRef::Blob(data)) =
            (topic, time_ns, row.get_ref(3)?)
        else {
            self.malformed.count(time_ns);
            return Ok(ControlFlow::Continue(()));
        };
        if self
            .reader
            .cut
            .as_ref()
            .is_some_and(|cut| cut.may_run_through(id, data))
        {
            self.malformed.count(Some(time_ns));
            return Ok(ControlFlow::Continue(()));
        }
        Ok((self.request.visit)(&RawMessage {
            topic,
            writer,
            log_time_ns: time_ns,
            publish_time_ns: time_ns,
            sequence: 0,
            data,
        }))
    }

    /// SQLite does not report positions; an estimate by row suffices for a progress bar.
    fn estimated_bytes(&self) -> u64 {
        const TYPICAL_ROW_BYTES: u64 = 400;
        (self.rows * TYPICAL_ROW_BYTES).min(self.reader.file.len())
    }

    /// Continues page by page where SQLite gave up.
    fn salvage(&mut self, source: &Error) -> Result<ControlFlow<()>, Error> {
        let Some(mut salvage) = Salvage::open(&self.reader.file)? else {
            let (path, bytes) = (&self.reader.path, 0..self.reader.file.len());
            (self.request.losses).lose(LostPart::Tail, path, bytes, source.to_string());
            return Ok(ControlFlow::Continue(()));
        };
        let mut gaps = IdGaps::default();
        self.note_seen(i64::MAX);
        let mut salvaged = 0;
        let flow = salvage.messages(&mut |row| {
            if row.is_in_order {
                gaps.pass(row);
                // Delivered before, or a copy on an unused page.
                if self.seen.contains(row.id) {
                    return ControlFlow::Continue(());
                }
                self.seen.insert(row.id);
            }
            salvaged += 1;
            self.salvaged(row)
        })?;
        if flow.is_break() {
            return Ok(flow);
        }
        let reason = say!("{source}; {salvaged} more messages were found in single pages");
        self.report_gaps(&gaps, &salvage.unknown_ranges(), &reason);
        Ok(flow)
    }

    /// Notes the previous id. An id larger than its successor is damaged and belongs to another
    /// message.
    fn note_seen(&mut self, id: i64) {
        if let Some(last) = self.last_id.filter(|last| *last < id) {
            self.seen.insert(last);
        }
        self.last_id = Some(id);
    }

    fn salvaged(&mut self, row: &MessageRow<'_>) -> ControlFlow<()> {
        let Some(&(topic, writer)) = self.reader.topics.get(&row.topic) else {
            self.malformed.count(Some(row.time_ns));
            return ControlFlow::Continue(());
        };
        if !self.request.wants(topic) {
            return ControlFlow::Continue(());
        }
        (self.request.visit)(&RawMessage {
            topic,
            writer,
            log_time_ns: row.time_ns,
            publish_time_ns: row.time_ns,
            sequence: 0,
            data: row.data,
        })
    }

    /// Reports unreadable pages, and how many messages are missing between which times.
    fn report_gaps(&mut self, gaps: &IdGaps, ranges: &[Range<u64>], reason: &str) {
        let losses = &mut self.request.losses;
        let mut push = |bytes: &Range<u64>, gap: Option<&IdGap>| {
            losses.push(LostRange {
                first_time_ns: gap.and_then(|gap| gap.first_time_ns),
                last_time_ns: gap.map(|gap| gap.last_time_ns),
                message_count: gap.map(|gap| gap.missing),
                ..LostRange::of(
                    LostPart::Records,
                    &self.reader.path,
                    bytes.clone(),
                    reason.to_owned(),
                )
            });
        };
        let mut is_told = vec![false; ranges.len()];
        for gap in &gaps.list {
            // The unreadable pages between the messages before and after.
            let within =
                |range: &Range<u64>| gap.pages.start <= range.start && range.end <= gap.pages.end;
            let mut bytes: Option<Range<u64>> = None;
            for (range, told) in ranges.iter().zip(&mut is_told) {
                if within(range) && !*told {
                    *told = true;
                    let start = bytes.map_or(range.start, |bytes| bytes.start);
                    bytes = Some(start..range.end);
                }
            }
            push(&bytes.unwrap_or(gap.pages.clone()), Some(gap));
        }
        // Pages without missing ids: whether they held messages is unknown.
        for (range, _) in ranges.iter().zip(&is_told).filter(|(_, told)| !**told) {
            push(range, None);
        }
        if gaps.list.is_empty() && ranges.is_empty() {
            let end = self.reader.file.len();
            push(&(end..end), None);
        }
    }

    fn report_malformed(&mut self) {
        let Malformed { rows, span_ns } = self.malformed;
        if rows > 0 {
            let end = self.reader.file.len();
            let reason = say!("{rows} rows are not complete messages");
            self.request.losses.push(LostRange {
                first_time_ns: span_ns.map(|span| span.0),
                last_time_ns: span_ns.map(|span| span.1),
                message_count: Some(rows),
                ..LostRange::of(LostPart::Records, &self.reader.path, end..end, reason)
            });
        }
    }
}

/// Rows between two progress reports.
const ROWS_PER_PROGRESS: u64 = 1024;

/// A set of small numbers.
struct IdSet {
    bits: Vec<u64>,
    /// Ids from here on are not valid.
    limit: i64,
}

impl IdSet {
    /// Returns a set for the ids in a file of this size: every row takes a few bytes.
    fn new(file_bytes: u64) -> Self {
        const SMALLEST_ROW_BYTES: u64 = 8;
        Self {
            bits: Vec::new(),
            limit: i64::try_from(file_bytes / SMALLEST_ROW_BYTES).unwrap_or(i64::MAX),
        }
    }

    fn place(&self, id: i64) -> Option<(usize, u64)> {
        let is_plausible = id < self.limit;
        let id = usize::try_from(id).ok().filter(|_| is_plausible)?;
        Some((id / 64, 1 << (id % 64)))
    }

    fn insert(&mut self, id: i64) {
        if let Some((word, bit)) = self.place(id) {
            if self.bits.len() <= word {
                self.bits.resize(word + 1, 0);
            }
            self.bits[word] |= bit;
        }
    }

    fn contains(&self, id: i64) -> bool {
        let place = self.place(id);
        place.is_some_and(|(word, bit)| self.bits.get(word).is_some_and(|bits| bits & bit != 0))
    }
}
