//! The list of a black box's clips, `clips.jsonl`: one line for each, with its SHA-256; and what a killed recorder left.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use mcap::MessageStream;
use mcap::read::LinearReader;
use mcap::records::Record;
use serde::{Deserialize, Serialize};
use tipwatch_binding::{hash_file, hex, monitor_topic};

use super::clip_file::{FINISHED_RECORD, FinishedClip, PARTIAL, SHORT_ENTRY, UNFINISHED, partial};
use super::repair::repair;
use super::retention::recorded_files;
use super::topics;

/// Name of the list, in the recorder's folder.
const LIST: &str = "clips.jsonl";
/// Bytes of the largest clip that is read to describe it. The recorder does so in memory, before it records.
const MOST_READ: u64 = 256 << 20;

/// A line of the list.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Line {
    /// Path relative to the list.
    file: String,
    sha256: String,
    bytes: u64,
    /// Whether the clip has all that was asked for. An interrupted clip ends before its time; one whose recorder joined late, or
    /// had no room, lacks something before its trigger.
    is_complete: bool,
    /// The conditions in order, and when each began to be met (ns); the first alone for a clip that was interrupted.
    triggers: Vec<(String, i64)>,
    first_log_time_ns: Option<i64>,
    last_log_time_ns: Option<i64>,
    samples: Option<u64>,
    verdicts: Option<u64>,
}

/// Adds a finished clip, and tells of it. One that `is_short` lacks part of what was asked for.
pub(super) fn add(root: &Path, clip: &FinishedClip, is_short: bool) {
    let counts = &clip.counts;
    let (first_ns, last_ns) = clip.log_span_ns;
    let names: BTreeSet<_> = clip
        .onsets
        .iter()
        .map(|onset| onset.trigger.name())
        .collect();
    let names: Vec<_> = names.into_iter().collect();
    eprintln!(
        "record: {}: {}, {:.1} s, {} samples, {} verdicts",
        clip.path.display(),
        names.join(", "),
        (last_ns - first_ns) as f64 * 1e-9,
        counts.samples,
        counts.verdicts
    );
    let onsets = clip.onsets.iter();
    let line = Line {
        triggers: onsets
            .map(|o| (o.trigger.name().to_owned(), o.log_time_ns))
            .collect(),
        first_log_time_ns: Some(first_ns),
        last_log_time_ns: Some(last_ns),
        samples: Some(counts.samples),
        verdicts: Some(counts.verdicts),
        ..blank(!is_short)
    };
    list(root, &clip.path, line);
}

/// Keeps what a killed recorder left: closes its clip and says that it is partial; lists clips that are not listed.
pub(super) fn adopt_all(root: &Path) {
    for path in unfinished_clips(root) {
        match adopt(&path) {
            Ok(None) => {}
            Ok(Some(kept)) => {
                eprintln!(
                    "record: {}: partial: its recording was interrupted before its end",
                    kept.display()
                );
                list(root, &kept, described(&kept));
            }
            Err(error) => eprintln!("record: {}: cannot close it: {error}", path.display()),
        }
    }
    let text = std::fs::read_to_string(root.join(LIST)).unwrap_or_default();
    let listed = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    let listed: BTreeSet<String> = listed.map(|line: Line| line.file).collect();
    let mut recorded: Vec<_> = recorded_files(root).collect();
    recorded.sort();
    for path in recorded {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("clip_") && !listed.contains(&relative(root, &path)) {
            list(root, &path, described(&path));
        }
    }
}

/// Closes an unfinished clip and names it a partial one; `None` if it is being written, or empty.
fn adopt(path: &Path) -> io::Result<Option<PathBuf>> {
    let file = File::options().read(true).write(true).open(path)?;
    if file.try_lock().is_err() {
        return Ok(None);
    }
    let is_empty = file.metadata()?.len() == 0;
    drop(file);
    if is_empty {
        std::fs::remove_file(path)?;
        return Ok(None);
    }
    repair(path)?;
    let kept = partial(&path.with_extension(""));
    std::fs::rename(path, &kept)?;
    Ok(Some(kept))
}

fn unfinished_clips(root: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten();
    let folders = entries(root).map(|entry| entry.path());
    let folders = folders.filter(|path| path.is_dir());
    let files = folders.flat_map(|folder| entries(&folder).map(|e| e.path()).collect::<Vec<_>>());
    files
        .filter(|path| path.extension().is_some_and(|e| e == UNFINISHED))
        .collect()
}

/// The line of a clip that its recorder did not list, by what is in its file. Of one that cannot be read, what is known, and whether
/// it was finished by its name.
fn described(path: &Path) -> Line {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut line = blank(!name.ends_with(PARTIAL));
    if let Err(error) = read(path, &mut line) {
        eprintln!("record: {}: cannot read it: {error:#}", path.display());
    }
    line
}

/// Adds what is in the file of a clip to its line.
fn read(path: &Path, line: &mut Line) -> Result<()> {
    let size = std::fs::metadata(path)?.len();
    ensure!(
        size <= MOST_READ,
        "expected at most {} MiB, found {}: it is listed without what is in it",
        MOST_READ >> 20,
        size >> 20
    );
    let bytes = std::fs::read(path)?;
    let (mut is_finished, mut is_short) = (false, false);
    for record in LinearReader::new(&bytes)? {
        let Record::Metadata(record) = record? else {
            continue;
        };
        let of = |key: &str| record.metadata.get(key);
        if record.name == FINISHED_RECORD {
            is_finished = true;
            is_short |= of(SHORT_ENTRY).is_some_and(|is_short| is_short == "true");
            let entries = record.metadata.iter();
            let triggers = entries.filter(|(key, _)| key.starts_with("trigger_"));
            let triggers = triggers.filter_map(|(_, text)| {
                let (time, name) = text.split_once(' ')?;
                Some((name.to_owned(), time.parse::<i64>().ok()?))
            });
            line.triggers = triggers.collect();
        } else if let Some(name) = of("clip_trigger") {
            is_short |= of("clip_missing_s").is_some_and(|missing| missing != "0");
            line.is_complete &= !is_short;
            let time = of("clip_trigger_log_time_ns").map(|time| time.parse::<i64>());
            line.triggers = vec![(name.clone(), time.unwrap_or(Ok(0))?)];
        }
    }
    line.is_complete = is_finished && !is_short;
    let (mut samples, mut verdicts) = (0, 0);
    let command = topics::command().name;
    for message in MessageStream::new(&bytes)? {
        let message = message?;
        match message.channel.topic.as_str() {
            // stands before the clip, from whenever it is
            monitor_topic::PROGRAM => continue,
            monitor_topic::GAPS => {}
            monitor_topic::NAME => verdicts += 1,
            topic => samples += u64::from(topic != command),
        }
        let log_time_ns = i64::try_from(message.log_time)?;
        line.first_log_time_ns.get_or_insert(log_time_ns);
        line.last_log_time_ns = line.last_log_time_ns.max(Some(log_time_ns));
    }
    (line.samples, line.verdicts) = (Some(samples), Some(verdicts));
    Ok(())
}

fn blank(is_complete: bool) -> Line {
    Line {
        is_complete,
        ..Line::default()
    }
}

/// Adds a line with path and hash of the file. The clip does not depend on it.
fn list(root: &Path, path: &Path, line: Line) {
    let added = hash_file(path).and_then(|(hash, bytes)| {
        let file = relative(root, path);
        let line = Line {
            file,
            sha256: hex(&hash),
            bytes,
            ..line
        };
        let mut text = serde_json::to_string(&line)?;
        text.push('\n');
        let mut list = File::options()
            .create(true)
            .append(true)
            .open(root.join(LIST))?;
        list.write_all(text.as_bytes())?;
        list.sync_data()
    });
    if let Err(error) = added {
        eprintln!(
            "record: {}: cannot list {}: {error}",
            root.join(LIST).display(),
            path.display()
        );
    }
}

fn relative(root: &Path, path: &Path) -> String {
    path.strip_prefix(root)
        .unwrap_or(path)
        .display()
        .to_string()
}
