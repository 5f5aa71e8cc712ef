//! What of a log is damaged or could not be read.

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
};

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

/// What was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LostPart {
    /// One chunk, or the rest of one.
    Chunk,
    /// Single records.
    Records,
    /// Everything from here to the end of the file.
    Tail,
    /// A whole file of the log.
    File,
}

/// A range of bytes whose messages are lost, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LostRange {
    /// The file.
    #[serde(serialize_with = "path_as_text")]
    pub file: PathBuf,
    /// The first lost byte.
    pub start_byte: u64,
    /// The byte after the last lost one.
    pub end_byte: u64,
    /// What the range holds.
    pub part: LostPart,
    /// What was expected and what was found.
    pub reason: String,
    /// The log time from which on messages may be missing, in nanoseconds: that of the chunk if it
    /// is known, else of the last intact message before. `None` where the log begins.
    pub first_time_ns: Option<i64>,
    /// The log time up to which messages may be missing; `None` up to the end of the log.
    pub last_time_ns: Option<i64>,
    /// How many messages of which topics are lost, so far as an index tells: at least so many.
    pub messages: BTreeMap<String, u64>,
    /// How many messages are lost in all; `None` where nobody knows. Those that [`Self::messages`]
    /// does not have are of topics not known.
    pub message_count: Option<u64>,
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
        write!(
            formatter,
            "{}: bytes {start_byte} to {end_byte}: {reason}",
            file.display()
        )?;
        match (first_time_ns, last_time_ns) {
            (Some(first), Some(last)) => {
                let seconds = last.saturating_sub(*first) as f64 * 1e-9;
                write!(
                    formatter,
                    "; log times {first} to {last} ns ({seconds:.3} s)"
                )?;
            }
            (None, Some(last)) => write!(formatter, "; up to log time {last} ns")?,
            (Some(first), None) => write!(formatter, "; from log time {first} ns on")?,
            (None, None) => {}
        }
        let by_topic: u64 = messages.values().sum();
        for (topic, count) in messages {
            let at_least = if message_count.is_none() {
                "at least "
            } else {
                ""
            };
            write!(formatter, "; {at_least}{count} messages of {topic}")?;
        }
        match message_count {
            Some(0) => formatter.write_str("; no message"),
            Some(count) if *count > by_topic => {
                let rest = count - by_topic;
                write!(formatter, "; {rest} messages of topics not known")
            }
            Some(_) => Ok(()),
            None if messages.is_empty() => formatter.write_str("; number of messages unknown"),
            None => Ok(()),
        }
    }
}

/// What could be verified of the bytes that were read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Integrity {
    /// At least one chunk carried a checksum.
    pub checksums_present: bool,
    /// At least one message came without a checksum that covers it.
    pub checksums_absent: bool,
    /// Chunks that this reading passed over, since the log's index says that they hold nothing that was
    /// asked for: they were not looked at. Not taken over from another reading by [`Losses::merge`].
    pub chunks_passed_over: u64,
}

impl Integrity {
    /// What a reader of a report has to know, if anything.
    pub fn note(self) -> Option<&'static str> {
        match (self.checksums_present, self.checksums_absent) {
            (_, false) => None,
            (false, true) => {
                Some("chunk CRCs are absent: integrity cannot be verified from this file")
            }
            (true, true) => Some(
                "some chunk CRCs are absent: integrity can be verified only in part from this file",
            ),
        }
    }
}

/// All losses of a log, with the findings that are none.
///
/// Absent checksums and the [`notes`](Self::notes) are findings: they do not make a `Losses`
/// count as loss.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Losses {
    /// Lost bytes, each range once, in the order of finding.
    pub ranges: Vec<LostRange>,
    /// Messages that were read but could not be decoded, for each topic name.
    pub undecodable_messages: BTreeMap<String, u64>,
    /// Messages that the log's own index counts and that did not come, for each topic name, of the
    /// topics that were read. Those of [`LostRange::messages`] are among them.
    pub missing_messages: BTreeMap<String, u64>,
    /// What could be verified.
    pub integrity: Integrity,
    /// Findings that are no loss.
    pub notes: Vec<String>,
}

impl Losses {
    /// Whether nothing was lost.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
            && self.undecodable_messages.is_empty()
            && self.missing_messages.is_empty()
    }

    /// How many chunks are lost, in whole or in part.
    pub fn chunks_lost(&self) -> usize {
        self.ranges
            .iter()
            .filter(|range| range.part == LostPart::Chunk)
            .count()
    }

    /// How many bytes the lost ranges cover.
    pub fn bytes_lost(&self) -> u64 {
        let length = |range: &LostRange| range.end_byte.saturating_sub(range.start_byte);
        self.ranges.iter().map(length).fold(0, u64::saturating_add)
    }

    /// What is lost in words: each range, then how many messages of each topic did not come.
    pub fn lines(&self) -> impl Iterator<Item = String> {
        let missing = self.missing_messages.iter().map(|(topic, count)| {
            format!("{count} messages of {topic} that the log's own index counts did not come")
        });
        let undecodable = self
            .undecodable_messages
            .iter()
            .map(|(topic, count)| format!("{count} messages of {topic} could not be decoded"));
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

    /// Takes in what another reading of the same log found; a range found twice counts once.
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

    /// Notes messages that should be there; the same finding twice counts once.
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

    pub(crate) fn lose(
        &mut self,
        part: LostPart,
        file: &Path,
        bytes: std::ops::Range<u64>,
        reason: String,
    ) {
        let file = file.to_path_buf();
        self.push(LostRange {
            file,
            start_byte: bytes.start,
            end_byte: bytes.end,
            part,
            reason,
            first_time_ns: None,
            last_time_ns: None,
            messages: BTreeMap::new(),
            message_count: None,
        });
    }

    pub(crate) fn saw_checksum(&mut self, present: bool) {
        self.integrity.checksums_present |= present;
        self.integrity.checksums_absent |= !present;
    }

    pub(crate) fn push(&mut self, range: LostRange) {
        let same_bytes = |known: &&mut LostRange| {
            (known.start_byte, known.end_byte, known.part)
                == (range.start_byte, range.end_byte, range.part)
                && known.file == range.file
        };
        let Some(known) = self.ranges.iter_mut().find(same_bytes) else {
            self.ranges.push(range);
            return;
        };
        // The same damage, met again with more knowledge.
        known.first_time_ns = known.first_time_ns.or(range.first_time_ns);
        known.last_time_ns = known.last_time_ns.or(range.last_time_ns);
        known.message_count = known.message_count.or(range.message_count);
        if known.messages.is_empty() {
            known.messages = range.messages;
        }
    }
}

/// A path need not be Unicode, a report must be.
fn path_as_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}
