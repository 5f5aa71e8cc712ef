//! The thread that waits for the disk: it writes batches of a few milliseconds into files of a minute, removes
//! old files, and starts a new one when a file fails.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use super::encode;
use super::latched_program::LatchedProgram;
use super::pending::{Dropped, Encoded, Kind, Pending};
use super::retention::Retention;
use super::segment::{Place, Preamble, Segment, sync_folder};
use super::sync::SyncThread;
use super::tries::Tries;

/// Time covered by a batch. Including polling and writing, a killed process loses no more than 20 ms.
pub(super) const BATCH_PERIOD: Duration = Duration::from_millis(8);
/// Size of the parts in which waiting messages are written (bytes): a file that has room for only some of the parts takes these.
const PART_BYTES: usize = 64 * 1024;
/// Period at which the files are looked for where they were written: a removed folder is noticed within a second.
const PLACE_CHECK: Duration = Duration::from_millis(250);

/// Whether a write failed because there was no room.
fn is_full(error: io::ErrorKind) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error, FileTooLarge | QuotaExceeded | StorageFull)
}

/// The first messages, up to [`PART_BYTES`] and one at least.
fn first_part(messages: &mut VecDeque<Encoded>) -> VecDeque<Encoded> {
    let mut bytes = 0;
    let is_within = |message: &&Encoded| {
        bytes += message.data.len();
        bytes <= PART_BYTES
    };
    let count = messages.iter().take_while(is_within).count();
    let rest = messages.split_off(count.max(1).min(messages.len()));
    std::mem::replace(messages, rest)
}

/// Counts of messages, clips and sessions that were recorded, lost or refused.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RecordCounts {
    /// Samples written.
    pub samples: u64,
    /// Verdicts written.
    pub verdicts: u64,
    /// Commands written.
    pub commands: u64,
    /// Samples that could not be written, or were lost on the way to the recorder.
    pub samples_lost: u64,
    /// Verdicts and commands that could not be written, or were lost on the way to the recorder.
    pub verdicts_lost: u64,
    /// Clips of the black box that were finished.
    pub clips: u64,
    /// Clips that lack part of the time asked for, because the ring or the disk had no room for it.
    pub short_clips: u64,
    /// Samples that failed the checks, as they did in the monitor; they are not recorded. One whose sequence
    /// number is unreadable counts as lost, too.
    pub samples_refused: u64,
    /// Sessions that were recorded.
    pub sessions: u64,
    /// Sessions that were announced and could not be recorded.
    pub sessions_refused: u64,
    /// Samples of sessions that nobody announced; they cannot be recorded.
    pub samples_unannounced: u64,
}

impl RecordCounts {
    /// Counts a message that was written.
    pub(super) fn count(&mut self, kind: Kind) {
        match kind {
            Kind::Sample(_) => self.samples += 1,
            Kind::Verdict { .. } => self.verdicts += 1,
            Kind::Command => self.commands += 1,
            Kind::Program | Kind::Gap => {}
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.verdicts += other.verdicts;
        self.commands += other.commands;
        self.samples_lost += other.samples_lost;
        self.verdicts_lost += other.verdicts_lost;
        self.clips += other.clips;
        self.short_clips += other.short_clips;
        self.samples_refused += other.samples_refused;
        self.sessions += other.sessions;
        self.sessions_refused += other.sessions_refused;
        self.samples_unannounced += other.samples_unannounced;
    }
}

/// Folder, preamble, file length and retention of a session that is recorded.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    pub(super) folder: PathBuf,
    pub(super) preamble: Preamble,
    pub(super) split: Duration,
    pub(super) retention: Retention,
}

/// A file and what was written into it.
struct Written<T> {
    file: T,
    counts: RecordCounts,
}

/// Writes the pending messages of a session.
pub(super) struct FileWriter {
    plan: Plan,
    pending: Arc<Pending>,
    sync: SyncThread,
    segment: Option<Written<Segment>>,
    /// Complete files of the session, but for those that retention has removed.
    finished: Vec<Written<Place>>,
    segments: usize,
    first_ns: Option<i64>,
    tries: Tries,
    counts: RecordCounts,
    program: LatchedProgram,
    /// Whether the open file has messages.
    is_begun: bool,
}

impl FileWriter {
    /// Creates the first file.
    pub(super) fn begin(plan: Plan, pending: Arc<Pending>) -> Result<Self> {
        std::fs::create_dir_all(&plan.folder)?;
        let mut writer = Self {
            plan,
            pending,
            sync: SyncThread::start()?,
            segment: None,
            finished: Vec::new(),
            segments: 0,
            first_ns: None,
            tries: Tries::default(),
            counts: RecordCounts::default(),
            program: LatchedProgram::default(),
            is_begun: false,
        };
        writer.open()?;
        Ok(writer)
    }

    /// Writes until `ends` is set and no message waits.
    pub(super) fn run(mut self, ends: &AtomicBool) -> Result<RecordCounts> {
        let mut checked = Instant::now();
        loop {
            let is_last = ends.load(Ordering::Acquire);
            if is_last || checked.elapsed() >= PLACE_CHECK {
                checked = Instant::now();
                self.check_places();
            }
            self.write_pending(is_last);
            if is_last {
                break;
            }
            std::thread::sleep(BATCH_PERIOD);
        }
        let (left, dropped) = self.pending.take();
        self.count_lost(dropped);
        for message in left {
            match message.kind {
                Kind::Sample(_) => self.counts.samples_lost += 1,
                Kind::Verdict { .. } | Kind::Command | Kind::Program => {
                    self.counts.verdicts_lost += 1;
                }
                Kind::Gap => {}
            }
        }
        self.finish()?;
        Ok(self.counts)
    }

    /// Looks for all files where they were written. What is gone is counted as lost, and a new file begins.
    fn check_places(&mut self) {
        let is_gone = |place: &Place, counts: &RecordCounts| {
            let is_gone = !place.holds();
            if is_gone {
                eprintln!(
                    "record: {}: removed or replaced by somebody; {} samples, {} verdicts and {} commands in it are lost",
                    place.path.display(),
                    counts.samples,
                    counts.verdicts,
                    counts.commands
                );
            }
            is_gone
        };
        let mut lost = RecordCounts::default();
        self.finished.retain(|written| {
            let is_gone = is_gone(&written.file, &written.counts);
            if is_gone {
                lost.add(&written.counts);
            }
            !is_gone
        });
        if let Some(open) = &self.segment
            && is_gone(&open.file.place(), &open.counts)
        {
            lost.add(&open.counts);
            self.segment = None;
            if let Err(error) = self.open() {
                self.tries.fail(&error);
            }
        }
        self.counts.samples -= lost.samples;
        self.counts.verdicts -= lost.verdicts;
        self.counts.commands -= lost.commands;
        // the next file tells of it, and then it is counted
        let outputs = lost.verdicts + lost.commands;
        self.pending.note_dropped(lost.samples, outputs);
    }

    /// Finishes the file with its index, or without where the disk is full: all its messages are in it.
    fn finish(&mut self) -> Result<()> {
        let Some(Written { file, counts }) = self.segment.take() else {
            return Ok(());
        };
        let place = file.place();
        if let Err(error) = file.finish() {
            let of_disk = error.downcast_ref::<io::Error>().map(io::Error::kind);
            if !of_disk.is_some_and(is_full) {
                return Err(error);
            }
            eprintln!("record: {error:#}; the file ends without an index");
        }
        self.finished.push(Written {
            file: place,
            counts,
        });
        Ok(())
    }

    fn write_pending(&mut self, is_last: bool) {
        let mut tries = self.tries.now(is_last);
        while tries > 0 {
            let (mut messages, mut dropped) = self.pending.take();
            let (mut is_written, mut has_failed) = (false, false);
            while !has_failed && (!messages.is_empty() || dropped != Dropped::default()) {
                let mut part = first_part(&mut messages);
                match self.write(&part, dropped) {
                    Ok(()) => {
                        self.tries.succeed();
                        self.count(&part, std::mem::take(&mut dropped));
                        is_written = true;
                    }
                    Err(error) => {
                        part.append(&mut messages);
                        self.retreat(&error, part, dropped);
                        has_failed = true;
                    }
                }
            }
            // what is last has no later try: a file that took something was at its limit, and the next one may take more
            tries = match has_failed {
                false => 0,
                true => tries - u8::from(!(is_last && is_written)),
            };
        }
    }

    /// After a failure: what was written stays; the rest goes into a new file.
    fn retreat(&mut self, error: &anyhow::Error, messages: VecDeque<Encoded>, dropped: Dropped) {
        self.tries.fail(error);
        if let Some(Written { file, counts }) = self.segment.take() {
            let file = file.place();
            self.finished.push(Written { file, counts });
        }
        let removed = self.plan.retention.make_room();
        self.finished
            .retain(|written| removed.as_ref() != Some(&written.file.path));
        self.pending.give_back(messages, dropped);
    }

    fn write(&mut self, messages: &VecDeque<Encoded>, dropped: Dropped) -> Result<()> {
        self.split(messages)?;
        if self.segment.is_none() {
            self.open()?;
        }
        let Some(Written { file: segment, .. }) = &mut self.segment else {
            return Ok(());
        };
        let channels = self.plan.preamble.channels;
        if dropped != Dropped::default() {
            let log_time_ns = messages.front().map_or(0, |message| message.log_time_ns);
            segment.add(channels.gaps, &encode::gap_message(0, log_time_ns, dropped))?;
        }
        if !std::mem::replace(&mut self.is_begun, true)
            && let Some(program) = messages
                .front()
                .and_then(|first| self.program.before(first))
        {
            segment.add(channels.programs, &program)?;
        }
        for message in messages {
            segment.add(channels.of(message.kind), message)?;
        }
        segment.flush()?;
        let is_alarm =
            |message: &Encoded| matches!(message.kind, Kind::Verdict { is_new: true, .. });
        if messages.iter().any(is_alarm) {
            self.sync.now();
        }
        Ok(())
    }

    /// Finishes the file if it is long enough.
    fn split(&mut self, messages: &VecDeque<Encoded>) -> Result<()> {
        let Some(now_ns) = messages.back().map(|message| message.log_time_ns) else {
            return Ok(());
        };
        let first_ns = *self.first_ns.get_or_insert(now_ns);
        let age_ns = now_ns.saturating_sub(first_ns);
        if i128::from(age_ns) < self.plan.split.as_nanos().cast_signed() {
            return Ok(());
        }
        if self.segment.is_some() {
            self.finish()?;
            let removed = self.plan.retention.apply();
            self.finished
                .retain(|written| !removed.contains(&written.file.path));
        }
        Ok(())
    }

    fn open(&mut self) -> Result<()> {
        // somebody may have removed the folder
        std::fs::create_dir_all(&self.plan.folder)
            .with_context(|| format!("{}: cannot create it", self.plan.folder.display()))?;
        while self.next_path().exists() {
            self.segments += 1;
        }
        let segment = Segment::begin(self.next_path(), &self.plan.preamble)?;
        self.segments += 1;
        sync_folder(&self.plan.folder);
        self.sync.follow(segment.file()?);
        self.plan.retention.keep(&segment.path);
        self.segment = Some(Written {
            file: segment,
            counts: RecordCounts::default(),
        });
        self.first_ns = None;
        self.is_begun = false;
        Ok(())
    }

    fn next_path(&self) -> PathBuf {
        let stem = self.plan.folder.file_name().unwrap_or_default();
        let name = format!("{}_{}.mcap", stem.to_string_lossy(), self.segments);
        Path::new(&self.plan.folder).join(name)
    }

    fn count(&mut self, messages: &VecDeque<Encoded>, dropped: Dropped) {
        let mut written = RecordCounts::default();
        messages.iter().for_each(|message| {
            written.count(message.kind);
            self.program.keep(message);
        });
        self.counts.add(&written);
        if let Some(open) = &mut self.segment {
            open.counts.add(&written);
        }
        self.count_lost(dropped);
    }

    fn count_lost(&mut self, dropped: Dropped) {
        self.counts.samples_lost += dropped.samples;
        self.counts.verdicts_lost += dropped.verdicts;
    }
}
