//! The thread of the black box: it keeps the last seconds in memory, and writes them with what follows when a condition
//! of the verdict is met.
//!
//! ```text
//!     before              after         the same, if its beginning overlaps
//!     |-------- trigger ----|........... trigger ----|
//!     [from the ring        until]                   until]
//! ```
//! A clip stays open for the time before it once more: a trigger within that time belongs to the same clip.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Result;

use super::clip_file::{ClipFile, MAX_ONSETS, Onset};
use super::clip_list;
use super::encode;
use super::latched_program::LatchedProgram;
use super::pending::{Dropped, Encoded, Kind, Pending};
use super::ring::Ring;
use super::sync::SyncThread;
use super::tries::Tries;
use super::trigger::Trigger;
use super::writer::{BATCH_PERIOD, Plan, RecordCounts};
use crate::system::clock::monotonic_ns;

/// Options of the black box: its triggers, and the time and memory of its clips.
#[derive(Debug, Clone)]
pub struct ClipOptions {
    /// The conditions that make it keep a clip.
    pub on: Vec<Trigger>,
    /// Time kept before a trigger.
    pub before: Duration,
    /// Time kept after the last trigger.
    pub after: Duration,
    /// Longest clip: a longer one goes on in the next file.
    pub longest: Duration,
    /// Bytes that the ring may have in memory.
    pub ring_bytes: usize,
}

/// A clip that is wanted, whether or not its file is open.
#[derive(Debug)]
struct Wanted {
    /// Its span in the time of the session, without what is written (ns).
    from_ns: i64,
    until_ns: i64,
    /// The trigger that began it.
    first: Onset,
    /// Triggers that the open file lists.
    onsets: Vec<Onset>,
    /// The clip that it continues.
    continues: Option<PathBuf>,
    is_short: bool,
}

/// Keeps the messages of a session in memory, and writes clips.
pub(super) struct ClipWriter {
    plan: Plan,
    options: ClipOptions,
    /// Time of the session relative to that of this computer; 0 if unrelated.
    pace: f64,
    before_ns: i64,
    after_ns: i64,
    longest_ns: i64,
    pending: Arc<Pending>,
    sync: SyncThread,
    ring: Ring,
    wanted: Option<Wanted>,
    pub(super) clip: Option<ClipFile>,
    /// Whether a sample of the session has come.
    has_sample: bool,
    /// The condition that the last verdict met.
    met: Option<Trigger>,
    now_ns: i64,
    last_log_ns: i64,
    tries: Tries,
    is_overflow_told: bool,
    counts: RecordCounts,
    program: LatchedProgram,
}

impl ClipWriter {
    pub(super) fn begin(
        plan: Plan,
        options: ClipOptions,
        pace: f64,
        pending: Arc<Pending>,
    ) -> Result<Self> {
        let before_ns = nanoseconds(options.before);
        Ok(Self {
            pace,
            before_ns,
            after_ns: nanoseconds(options.after),
            longest_ns: nanoseconds(options.longest),
            pending,
            sync: SyncThread::start()?,
            ring: Ring::new(options.ring_bytes, before_ns),
            wanted: None,
            clip: None,
            has_sample: false,
            met: None,
            now_ns: i64::MIN,
            last_log_ns: 0,
            tries: Tries::default(),
            is_overflow_told: false,
            counts: RecordCounts::default(),
            program: LatchedProgram::default(),
            plan,
            options,
        })
    }

    /// Runs until `ends` is set and no message waits.
    pub(super) fn run(mut self, ends: &AtomicBool) -> RecordCounts {
        loop {
            let is_last = ends.load(Ordering::Acquire);
            self.step(is_last);
            if is_last {
                break;
            }
            std::thread::sleep(BATCH_PERIOD);
        }
        self.finish();
        // without a clip there is nothing in it
        let _ = std::fs::remove_dir(&self.plan.folder);
        self.counts
    }

    /// Takes what waits, and writes what is wanted.
    pub(super) fn step(&mut self, is_last: bool) {
        let (messages, dropped) = self.pending.take();
        if dropped != Dropped::default() {
            let log_time_ns = (messages.front()).map_or(self.last_log_ns, |m| m.log_time_ns);
            let session_ns = messages.front().map_or(self.now_ns, |m| m.session_ns);
            self.take(encode::gap_message(session_ns, log_time_ns, dropped));
            self.count_lost(dropped);
        }
        for message in messages {
            self.take(message);
        }
        if self.pace > 0.0 {
            // the end comes even if nothing else does
            let clock_ns = (monotonic_ns() as f64 * self.pace) as i64;
            self.now_ns = self.now_ns.max(clock_ns);
        }
        let is_over = self.is_over(self.now_ns);
        self.write(is_last || is_over);
        if is_over {
            self.finish();
        }
    }

    /// Whether no trigger from this time on belongs to the clip.
    fn is_over(&self, now_ns: i64) -> bool {
        let end_ns = |wanted: &Wanted| wanted.until_ns.saturating_add(self.before_ns);
        self.wanted
            .as_ref()
            .is_some_and(|wanted| now_ns > end_ns(wanted))
    }

    fn take(&mut self, message: Encoded) {
        self.now_ns = self.now_ns.max(message.session_ns);
        self.last_log_ns = message.log_time_ns;
        if self.is_over(message.session_ns) {
            self.write(true);
            self.finish();
        }
        if let Kind::Verdict { trigger, .. } = message.kind {
            if let Some(trigger) = trigger {
                self.trigger(trigger, &message);
            }
            self.met = trigger;
        }
        if matches!(message.kind, Kind::Sample(_)) && !std::mem::replace(&mut self.has_sample, true)
        {
            // the first sample of a session has number zero
            if message.sequence != 0 {
                self.ring.joins_at(message.session_ns);
            }
        }
        self.program.keep(&message);
        let dropped = self.ring.push(message, self.wanted.is_some());
        if dropped != Dropped::default() {
            self.tell_overflow();
            if self.wanted.is_some() {
                self.count_lost(dropped);
            }
        }
    }

    fn trigger(&mut self, trigger: Trigger, message: &Encoded) {
        let until_ns = message.session_ns.saturating_add(self.after_ns);
        let from_ns = message.session_ns.saturating_sub(self.before_ns);
        let onset = Onset {
            trigger,
            log_time_ns: message.log_time_ns,
        };
        let wanted = self.wanted.get_or_insert_with(|| Wanted {
            from_ns,
            until_ns,
            first: onset,
            onsets: Vec::new(),
            continues: None,
            is_short: false,
        });
        wanted.until_ns = wanted.until_ns.max(until_ns);
        let is_onset = self.met != Some(trigger) || wanted.onsets.is_empty();
        if is_onset && wanted.onsets.len() < MAX_ONSETS {
            wanted.onsets.push(onset);
        }
    }

    /// Writes what the ring has of the wanted clip.
    fn write(&mut self, is_last: bool) {
        for _ in 0..self.tries.now(is_last) {
            match self.write_wanted() {
                Ok(()) => return,
                Err(error) => self.tries.fail(&error),
            }
        }
    }

    /// Writes once what the ring has of the wanted clip.
    fn write_wanted(&mut self) -> Result<()> {
        let Some(wanted) = &self.wanted else {
            return Ok(());
        };
        let mut messages = Vec::new();
        while let Some(message) = self.ring.take_until(wanted.until_ns) {
            messages.push(message);
        }
        // a clip may be longer than a file
        while !messages.is_empty() {
            let longest_ns = self.longest_ns;
            let first_ns =
                (self.clip.as_ref()).map_or(messages[0].session_ns, |clip| clip.span_ns.0);
            let fits =
                |message: &Encoded| message.session_ns.saturating_sub(first_ns) <= longest_ns;
            let count = messages.partition_point(fits);
            let rest = messages.split_off(count);
            if let Err(error) = self.write_messages(&messages) {
                messages.extend(rest);
                self.retreat(messages);
                return Err(error);
            }
            self.tries.succeed();
            messages = rest;
            if !messages.is_empty() {
                let done = self.finish_file();
                if let Some(wanted) = &mut self.wanted {
                    wanted.continues = done;
                }
            }
        }
        Ok(())
    }

    /// After a failure: what was written stays; the rest goes into a new file.
    fn retreat(&mut self, messages: Vec<Encoded>) {
        if let Some(clip) = self.clip.take() {
            let path = clip.path().to_owned();
            self.counts.add(&clip.abandon());
            if let Some(wanted) = &mut self.wanted {
                (wanted.continues, wanted.is_short) = (Some(path), true);
            }
        }
        self.plan.retention.make_room();
        let dropped = self.ring.give_back(messages);
        if dropped != Dropped::default() {
            self.tell_overflow();
            self.count_lost(dropped);
        }
    }

    fn write_messages(&mut self, messages: &[Encoded]) -> Result<()> {
        let Some(first) = messages.first() else {
            return Ok(());
        };
        let clip = match &mut self.clip {
            Some(clip) => clip,
            None => {
                let clip = self.open(first)?;
                self.sync.follow(clip.file()?);
                let clip = self.clip.insert(clip);
                if let Some(program) = self.program.before(first) {
                    clip.write(&[program], &self.plan.preamble)?;
                }
                clip
            }
        };
        clip.write(messages, &self.plan.preamble)?;
        if let (Some(wanted), Some(last)) = (&mut self.wanted, messages.last()) {
            wanted.from_ns = last.session_ns;
        }
        let is_new = |message: &Encoded| matches!(message.kind, Kind::Verdict { is_new: true, .. });
        if messages.iter().any(is_new) {
            self.sync.now();
        }
        Ok(())
    }

    fn open(&mut self, first: &Encoded) -> Result<ClipFile> {
        std::fs::create_dir_all(&self.plan.folder)?;
        let Some(wanted) = &mut self.wanted else {
            anyhow::bail!("no clip is wanted");
        };
        let (name, at_ns) = (wanted.first.trigger.name(), wanted.first.log_time_ns);
        // a name must not come again, even where the oldest clips are removed
        let named_ns = match wanted.continues {
            None => at_ns,
            Some(_) => first.log_time_ns,
        };
        let time = jiff::Timestamp::from_nanosecond(named_ns.into()).unwrap_or_default();
        let time = time.strftime("%Y%m%dT%H%M%SZ");
        let free = (1_u32..).map(|number| {
            let name = format!("clip_{time}_{name}_{number}.mcap");
            self.plan.folder.join(name)
        });
        let is_free = |path: &PathBuf| !path.exists() && !super::clip_file::partial(path).exists();
        let path = free.into_iter().find(is_free).unwrap_or_default();
        let mut preamble = self.plan.preamble.clone();
        let options = &self.options;
        let missing_ns = match self.ring.has_lost_after(wanted.from_ns) {
            true => first.session_ns.saturating_sub(wanted.from_ns).max(0),
            false => 0,
        };
        wanted.is_short |= missing_ns > 0;
        let conditions: Vec<_> = options.on.iter().map(|trigger| trigger.name()).collect();
        preamble.metadata.extend([
            ("clip_on".into(), conditions.join(" ")),
            ("clip_trigger".into(), name.into()),
            ("clip_trigger_log_time_ns".into(), at_ns.to_string()),
            (
                "clip_before_s".into(),
                options.before.as_secs_f64().to_string(),
            ),
            (
                "clip_after_s".into(),
                options.after.as_secs_f64().to_string(),
            ),
            ("clip_ring_bytes".into(), options.ring_bytes.to_string()),
            (
                "clip_missing_s".into(),
                (missing_ns as f64 * 1e-9).to_string(),
            ),
        ]);
        if let Some(before) = &wanted.continues {
            let name = before.file_name().unwrap_or_default().to_string_lossy();
            preamble
                .metadata
                .insert("clip_continues".into(), name.into());
        }
        ClipFile::begin(path, &preamble, first)
    }

    /// Finishes the clip: no trigger belongs to it any more.
    pub(super) fn finish(&mut self) {
        if let Some(wanted) = &mut self.wanted {
            // what could not be written until now
            let mut lost = Dropped::default();
            while let Some(message) = self.ring.take_until(wanted.until_ns) {
                lost.count(message.kind);
            }
            wanted.is_short |= lost != Dropped::default();
            self.count_lost(lost);
        }
        self.finish_file();
        // where no file was left to tell it
        let is_short = self.wanted.take().is_some_and(|wanted| wanted.is_short);
        self.counts.short_clips += u64::from(is_short);
        self.met = None;
    }

    /// Finishes the file of the clip; its path, if that went well.
    fn finish_file(&mut self) -> Option<PathBuf> {
        let clip = self.clip.take()?;
        let (name, counts) = (clip.path().to_owned(), clip.counts);
        let mut wanted = self.wanted.as_mut();
        let onsets = (wanted.as_mut()).map(|wanted| std::mem::take(&mut wanted.onsets));
        let is_short = wanted.as_ref().is_some_and(|wanted| wanted.is_short);
        match clip.finish(onsets.unwrap_or_default(), is_short) {
            Ok(clip) => {
                // what follows is another file
                if let Some(wanted) = wanted {
                    wanted.is_short = false;
                }
                self.counts.add(&counts);
                self.counts.clips += 1;
                self.counts.short_clips += u64::from(is_short);
                clip_list::add(&self.plan.retention.root(), &clip, is_short);
                self.plan.retention.apply();
                Some(clip.path)
            }
            Err(error) => {
                eprintln!("record: {error:#}; the clip {} is lost", name.display());
                self.count_lost(Dropped {
                    samples: counts.samples,
                    verdicts: counts.verdicts + counts.commands,
                });
                None
            }
        }
    }

    /// Returns the counts of the messages that were written.
    #[cfg(test)]
    pub(super) fn counts(&self) -> RecordCounts {
        self.counts
    }

    fn tell_overflow(&mut self) {
        if !std::mem::replace(&mut self.is_overflow_told, true) {
            let held_ns =
                (self.ring.first_ns()).map_or(0, |first| self.now_ns.saturating_sub(first));
            eprintln!(
                "record: ring: {} MiB hold only {:.1} s of the {} s before a trigger; expected a larger --ring or a smaller --before",
                self.options.ring_bytes >> 20,
                held_ns as f64 * 1e-9,
                self.options.before.as_secs_f64()
            );
        }
    }

    fn count_lost(&mut self, dropped: Dropped) {
        self.counts.samples_lost += dropped.samples;
        self.counts.verdicts_lost += dropped.verdicts;
    }
}

fn nanoseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}
