//! One clip of the black box: a file under a provisional name until it is complete and synced.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::pending::Encoded;
use super::segment::{Preamble, Segment, sync_folder};
use super::trigger::Trigger;
use super::writer::RecordCounts;

/// Added to the name of a clip that is being written.
pub(super) const UNFINISHED: &str = "partial";
/// Name of the record that only a finished clip has.
pub(super) const FINISHED_RECORD: &str = "tipwatch_clip";
/// Name of the entry in it that tells whether the clip lacks part of what was asked for.
pub(super) const SHORT_ENTRY: &str = "is_short";
/// Most triggers that a clip lists.
pub(super) const MAX_ONSETS: usize = 1000;

/// Time at which a condition began to be met (ns).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Onset {
    pub(super) trigger: Trigger,
    pub(super) log_time_ns: i64,
}

/// A clip being written.
pub(super) struct ClipFile {
    pub(super) segment: Segment,
    /// The name it gets when it is finished.
    path: PathBuf,
    pub(super) counts: RecordCounts,
    /// Times of the session of the first and the last message (ns).
    pub(super) span_ns: (i64, i64),
    log_span_ns: (i64, i64),
}

/// A finished clip.
#[derive(Debug)]
pub(super) struct FinishedClip {
    pub(super) path: PathBuf,
    pub(super) log_span_ns: (i64, i64),
    pub(super) onsets: Vec<Onset>,
    pub(super) counts: RecordCounts,
}

impl ClipFile {
    /// Begins a clip with this first message.
    pub(super) fn begin(path: PathBuf, preamble: &Preamble, first: &Encoded) -> Result<Self> {
        ensure!(!path.exists(), "{}: exists already", path.display());
        let segment = Segment::begin(unfinished(&path), preamble)?;
        Ok(Self {
            segment,
            path,
            counts: RecordCounts::default(),
            span_ns: (first.session_ns, first.session_ns),
            log_span_ns: (first.log_time_ns, first.log_time_ns),
        })
    }

    /// Another handle of the file, to sync it in another thread.
    pub(super) fn file(&self) -> io::Result<File> {
        self.segment.file()
    }

    /// The name it gets when it is finished.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes messages with one system call. If that fails, none of them stays in the file.
    pub(super) fn write(&mut self, messages: &[Encoded], preamble: &Preamble) -> Result<()> {
        for message in messages {
            let channel = preamble.channels.of(message.kind);
            self.segment.add(channel, message)?;
        }
        self.segment.flush()?;
        for message in messages {
            self.counts.count(message.kind);
            self.span_ns.1 = self.span_ns.1.max(message.session_ns);
            self.log_span_ns.1 = self.log_span_ns.1.max(message.log_time_ns);
        }
        Ok(())
    }

    /// Completes the file, syncs it, and only then gives it its name. One that `is_short` lacks part of what was asked for.
    pub(super) fn finish(mut self, onsets: Vec<Onset>, is_short: bool) -> Result<FinishedClip> {
        let mut entries = BTreeMap::from([
            (
                "first_log_time_ns".to_owned(),
                self.log_span_ns.0.to_string(),
            ),
            (
                "last_log_time_ns".to_owned(),
                self.log_span_ns.1.to_string(),
            ),
            ("samples".to_owned(), self.counts.samples.to_string()),
            ("verdicts".to_owned(), self.counts.verdicts.to_string()),
            ("commands".to_owned(), self.counts.commands.to_string()),
            ("triggers".to_owned(), onsets.len().to_string()),
            (SHORT_ENTRY.to_owned(), is_short.to_string()),
        ]);
        for (index, onset) in onsets.iter().enumerate() {
            let text = format!("{} {}", onset.log_time_ns, onset.trigger.name());
            entries.insert(format!("trigger_{index:04}"), text);
        }
        self.segment.note(FINISHED_RECORD, entries)?;
        let place = self.segment.place();
        self.segment.finish()?;
        ensure!(
            place.holds(),
            "{}: removed or replaced by somebody",
            place.path.display()
        );
        std::fs::rename(&place.path, &self.path)
            .with_context(|| format!("{}: cannot be named", self.path.display()))?;
        if let Some(folder) = self.path.parent() {
            sync_folder(folder);
        }
        Ok(FinishedClip {
            path: self.path,
            log_span_ns: self.log_span_ns,
            onsets,
            counts: self.counts,
        })
    }

    /// Keeps what is in the file, as a partial clip: the disk has failed.
    pub(super) fn abandon(self) -> RecordCounts {
        let path = self.segment.place().path;
        drop(self.segment);
        // the next start tries again
        let _ = std::fs::rename(&path, partial(&self.path));
        self.counts
    }
}

/// The name of a clip while it is written.
fn unfinished(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(UNFINISHED);
    name.into()
}

/// End of the name of a clip that was never finished.
pub(super) const PARTIAL: &str = "_partial.mcap";

/// The name of a clip that was never finished.
pub(super) fn partial(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}{PARTIAL}"))
}
