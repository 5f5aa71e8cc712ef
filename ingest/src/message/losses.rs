//! The report of what is damaged or missing in a log.

use std::{
    collections::BTreeMap,
    fmt,
    ops::Range,
    path::{Path, PathBuf},
};

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use tipwatch_language::{say, word};

/// Which part was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LostPart {
    /// One chunk, or a part of one.
    Chunk,
    /// Single records.
    Records,
    /// Everything from here to the end of the file.
    Tail,
    /// A whole file of the log.
    File,
}

/// A range of bytes whose messages are lost, with the reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LostRange {
    /// The file.
    #[serde(serialize_with = "path_as_text")]
    pub file: PathBuf,
    /// The first lost byte.
    pub start_byte: u64,
    /// The byte after the last lost byte.
    pub end_byte: u64,
    /// What the range contains.
    pub part: LostPart,
    /// What was expected and what was found.
    pub reason: String,
    /// Log time (ns) after which messages may be missing: the start of the chunk if known, else the
    /// last intact message before it. `None` at the beginning of the log.
    pub first_time_ns: Option<i64>,
    /// Log time (ns) before which messages may be missing; `None` at the end of the log.
    pub last_time_ns: Option<i64>,
    /// Lost messages by topic, as far as an index counts them: a lower bound.
    pub messages: BTreeMap<String, u64>,
    /// Total number of lost messages; `None` if unknown. Those not in [`Self::messages`] belong to
    /// unknown topics.
    pub message_count: Option<u64>,
}

impl LostRange {
    /// A range of which nothing else is known.
    pub(crate) fn of(part: LostPart, file: &Path, bytes: Range<u64>, reason: String) -> Self {
        Self {
            file: file.to_path_buf(),
            start_byte: bytes.start,
            end_byte: bytes.end,
            part,
            reason,
            first_time_ns: None,
            last_time_ns: None,
            messages: BTreeMap::new(),
            message_count: None,
        }
    }
}

/// A log time as date and time, to the millisecond; one outside 1990 to 2100 counts from a zero of its own (s).
fn clock_time(time_ns: i64) -> String {
    let time = jiff::Timestamp::from_nanosecond(time_ns.into());
    match time.map(|time| time.strftime("%Y-%m-%d %H:%M:%S%.3f UTC").to_string()) {
        Ok(text) if ("1990"..="2100").contains(&&text[..4]) => text,
        _ => format!("{:.3} s", time_ns as f64 * 1e-9),
    }
}

impl fmt::Display for LostRange {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            file,
            start_byte,
            end_byte,
            reason,
            first_time_ns,
            last_time_ns,
            messages,
            message_count,
            ..
        } = self;
        formatter.write_str(&say!(
            "{}: bytes {start_byte} to {end_byte}: {reason}",
            file.display()
        ))?;
        match (first_time_ns, last_time_ns) {
            (Some(first), Some(last)) => {
                let seconds = last.saturating_sub(*first) as f64 * 1e-9;
                let [first, last] = [first, last].map(|time| clock_time(*time));
                let times = say!("; log times {first} to {last} ({seconds:.3} s)");
                formatter.write_str(&times)?;
            }
            (None, Some(last)) => {
                formatter.write_str(&say!("; up to log time {}", clock_time(*last)))?;
            }
            (Some(first), None) => {
                formatter.write_str(&say!("; from log time {} on", clock_time(*first)))?;
            }
            (None, None) => {}
        }
        let by_topic: u64 = messages.values().sum();
        for (topic, count) in messages {
            formatter.write_str(&match message_count.is_none() {
                true => say!("; at least {count} messages of {topic}"),
                false => say!("; {count} messages of {topic}"),
            })?;
        }
        match message_count {
            Some(0) => formatter.write_str(word!("; no messages lost")),
            Some(count) if *count > by_topic => {
                let rest = count - by_topic;
                formatter.write_str(&say!("; {rest} messages of unknown topics"))
            }
            Some(_) => Ok(()),
            None if messages.is_empty() => {
                formatter.write_str(word!("; number of messages unknown"))
            }
            None => Ok(()),
        }
    }
}

/// Which bytes could be verified.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Integrity {
    /// At least one chunk carried a checksum.
    pub checksums_present: bool,
    /// At least one message is not covered by a checksum.
    pub checksums_absent: bool,
    /// Chunks skipped in this pass because the index lists none of the wanted topics in them; they
    /// are not verified. [`Losses::merge`] does not add them up.
    pub chunks_passed_over: u64,
}

impl Integrity {
    /// A remark for reports, if one is needed.
    pub fn note(self) -> Option<&'static str> {
        match (self.checksums_present, self.checksums_absent) {
            (_, false) => None,
            (false, true) => Some(word!(
                "chunk CRCs are absent: integrity cannot be verified from this file"
            )),
            (true, true) => Some(word!(
                "some chunk CRCs are absent: integrity can be verified only in part from this file"
            )),
        }
    }
}

/// All losses of a log, and findings that are not losses.
///
/// Absent checksums and [`notes`](Self::notes) are findings: [`is_empty`](Self::is_empty) ignores
/// them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Losses {
    /// Lost ranges of bytes, each once, in the order in which they were found.
    pub ranges: Vec<LostRange>,
    /// Messages that were read but could not be decoded, by topic name.
    pub undecodable_messages: BTreeMap<String, u64>,
    /// Messages of the topics read that the log's index counts but that were not found, by topic
    /// name. Includes those of [`LostRange::messages`].
    pub missing_messages: BTreeMap<String, u64>,
    /// Which bytes could be verified.
    pub integrity: Integrity,
    /// Findings that are not losses.
    pub notes: Vec<String>,
}

impl Losses {
    /// Whether nothing was lost.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
            && self.undecodable_messages.is_empty()
            && self.missing_messages.is_empty()
    }

    /// Whether the end of a file is lost: what was recorded after the last intact message is not known.
    pub fn end_is_lost(&self) -> bool {
        let with_messages = (self.ranges.iter()).filter(|range| range.message_count != Some(0));
        let mut last_times = with_messages.map(|range| range.last_time_ns);
        last_times.any(|last_time_ns| last_time_ns.is_none())
    }

    /// The number of bytes in the lost ranges.
    pub fn bytes_lost(&self) -> u64 {
        let length = |range: &LostRange| range.end_byte.saturating_sub(range.start_byte);
        self.ranges.iter().map(length).fold(0, u64::saturating_add)
    }

    /// The losses as text: each range, then the missing and undecodable messages by topic.
    pub fn lines(&self) -> impl Iterator<Item = String> {
        // what a lost range names is not told again
        let missing = self.missing_messages.iter();
        let missing = missing.filter_map(|(topic, &count)| {
            let ranges = self.ranges.iter();
            let named = ranges.filter_map(|range| range.messages.get(topic));
            match count.saturating_sub(named.fold(0, |sum: u64, &of| sum.saturating_add(of))) {
                0 => None,
                rest if rest == count => Some(say!(
                    "{count} messages of {topic} are missing: the log's index counts them"
                )),
                rest => Some(say!(
                    "{rest} more messages of {topic} are missing, {count} in all: the log's index counts them"
                )),
            }
        });
        let undecodable = self
            .undecodable_messages
            .iter()
            .map(|(topic, count)| say!("{count} messages of {topic} could not be decoded"));
        let ranges = self.ranges.iter().map(ToString::to_string);
        ranges.chain(missing).chain(undecodable)
    }

    /// Counts a message that could not be decoded.
    pub fn count_undecodable(&mut self, topic_name: &str) {
        match self.undecodable_messages.get_mut(topic_name) {
            Some(count) => *count += 1,
            None => {
                self.undecodable_messages.insert(topic_name.to_owned(), 1);
            }
        }
    }

    /// Adds the losses of another pass over the same log; a range found twice counts once.
    pub fn merge(&mut self, other: &Losses) {
        for range in &other.ranges {
            self.push(range.clone());
        }
        for (topic, count) in &other.undecodable_messages {
            *self.undecodable_messages.entry(topic.clone()).or_default() += count;
        }
        for (topic, count) in &other.missing_messages {
            self.miss(topic, *count);
        }
        for note in &other.notes {
            self.note(note.clone());
        }
        self.integrity.checksums_present |= other.integrity.checksums_present;
        self.integrity.checksums_absent |= other.integrity.checksums_absent;
    }

    /// Records missing messages; the same finding twice counts once.
    pub(crate) fn miss(&mut self, topic_name: &str, count: u64) {
        let known = self
            .missing_messages
            .entry(topic_name.to_owned())
            .or_default();
        *known = count.max(*known);
    }

    pub(crate) fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    pub(crate) fn lose(&mut self, part: LostPart, file: &Path, bytes: Range<u64>, reason: String) {
        self.push(LostRange::of(part, file, bytes, reason));
    }

    pub(crate) fn saw_checksum(&mut self, present: bool) {
        self.integrity.checksums_present |= present;
        self.integrity.checksums_absent |= !present;
    }

    pub(crate) fn push(&mut self, mut range: LostRange) {
        // where stamps go back, what is lost lies between those of its neighbours all the same
        if let (Some(before_ns), Some(behind_ns)) = (range.first_time_ns, range.last_time_ns) {
            range.first_time_ns = Some(before_ns.min(behind_ns));
            range.last_time_ns = Some(before_ns.max(behind_ns));
        }
        let same_bytes = |known: &&mut LostRange| {
            (known.start_byte, known.end_byte, known.part)
                == (range.start_byte, range.end_byte, range.part)
                && known.file == range.file
        };
        let Some(known) = self.ranges.iter_mut().find(same_bytes) else {
            self.ranges.push(range);
            return;
        };
        // The same damage, found again with more information.
        known.first_time_ns = known.first_time_ns.or(range.first_time_ns);
        known.last_time_ns = known.last_time_ns.or(range.last_time_ns);
        known.message_count = known.message_count.or(range.message_count);
        if known.messages.is_empty() {
            known.messages = range.messages;
        }
    }
}

/// A path may not be Unicode, but JSON must be.
fn path_as_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
